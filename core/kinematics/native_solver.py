"""The native solver with its settings: makes a mechanism ready for a path, or for many designs."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..errors import SolveError
from ..mechanism.mechanism import Mechanism
from ..mechanism.motions import Path
from ..program import ITERATIONS
from ..trajectory import QUANTITIES, Array
from .compiled.compiled_model import Model, compile_model
from .compiled.request import LAST_ITERATION, OUTPUT, RESTING, Request, WantedOutput
from .compiled.routes import Route, Start
from .compiled.step_programs import ALONE, JOINED
from .continuation.walk import marcher
from .design_batch import RECYCLED, Variants, slopes_of, solve_variants
from .forces.wanted import WantedForces, wanted_forces
from .formulation.styles import NATIVE
from .motion_solver import Method, Solver, by_method
from .one_design import by_motion, by_program, motion_only, prepare, start_notes

if TYPE_CHECKING:
    from .design_forces import ForcesOfDesigns


@dataclass(frozen=True)
class NativeSolver:
    """Settings of the native solver.

    Attributes:
        order: 0 positions, 1 and velocities, 2 and accelerations.
        style: row style.
        compiled: run by machine code if llvmlite is installed, else by numpy; the results are the
            same to round-off.
        last_iteration: a sample's iteration from a residual below this is its last [units of the
            mechanism's size]; a sparse system iterates as long as it gains by it.
        method: the system solved at once. `BY_SIZE` keeps the last few mechanisms ready in the
            process; the others make them ready anew.
    """

    order: int = 2
    style: str = NATIVE
    compiled: bool = True
    last_iteration: float = LAST_ITERATION
    method: Method = Method.BY_SIZE

    def prepare(
        self,
        mechanism: Mechanism,
        path: Path,
        points: Sequence[str] = (),
        bodies: Sequence[str] = (),
        forces: Collection[str] = (),
    ) -> Solver:
        """Return the mechanism made ready for a path, to be solved to any tolerance.

        Args:
            mechanism: the mechanism.
            path: motions of the drivers, and the times of the samples.
            points, bodies: names of those whose motion is wanted.
            forces: names of joints, drivers and force elements whose forces are wanted. They take
                the motion of all bodies with accelerations.

        Raises:
            SolveError: drivers and degrees of freedom do not match, or the mechanism does not close
                at the design position.
        """
        request = self._request(mechanism, path, points, bodies, forces)
        if self.method is Method.BY_SIZE:
            return prepare(mechanism, request, path)
        if self.method is Method.ONE_PROGRAM:
            return by_program(
                mechanism, request, path, lambda each: Route(compile_model(mechanism, each), path)
            )
        if (make := by_method(self.method)) is None:
            raise SolveError(
                f"no extension solves {self.method.value}. Leave out the method, or install blocks."
            )
        motion = make(mechanism, motion_only(mechanism, request))(path)
        return by_motion(mechanism, request, path, motion)

    def prepare_designs(
        self,
        mechanism: Mechanism,
        path: Path,
        varied: Sequence[str],
        points: Sequence[str] = (),
        forces: Collection[str] = (),
        bodies: Sequence[str] = (),
        outputs: Sequence[WantedOutput] = (),
    ) -> PreparedDesigns:
        """Return the mechanism made ready for many designs, as one program.

        Args:
            mechanism: the nominal design.
            path: as for `prepare`.
            varied: varied places, see `places` and `load_places`; all others are constants in the
                programs.
            points: names of the points whose motion is wanted.
            forces: names of joints, drivers and force elements whose forces are wanted; they take
                order 2.
            bodies: names of the bodies whose poses are wanted.
            outputs: wanted outputs, part of the programs.

        Raises:
            SolveError: as `prepare`.
        """
        request = self._request(mechanism, path, points, bodies, forces, varied)
        request = replace(request, outputs=tuple(outputs))
        wanted = request.forces
        if wanted is not None:
            from .compiled.traced_forces import can_trace  # most studies are without

            traced = wanted if can_trace(mechanism) else None
            request = replace(request, order=2, forces=traced)
        return PreparedDesigns(Route(compile_model(mechanism, request), path), wanted)

    def program_size(
        self,
        mechanism: Mechanism,
        path: Path,
        points: Sequence[str] = (),
        bodies: Sequence[str] = (),
    ) -> ProgramSize:
        """Return the size of the mechanism's programs, as one program.

        Raises:
            SolveError: as `prepare`.
        """
        request = self._request(mechanism, path, points, bodies)
        return ProgramSize.of(compile_model(mechanism, request))

    def loops(
        self,
        mechanism: Mechanism,
        path: Path,
        points: Sequence[str],
        bodies: Sequence[str],
        tol: float,
    ) -> Callable[[], Array]:
        """Return a call of the executor's loops over all samples, as one program: tests and copying
        included, without any result built. Its result holds the kept rows of all samples.

        Raises:
            SolveError: as `prepare`; and in the call, a step has to be divided, which is not done
                in the loops.
        """
        request = self._request(mechanism, path, points, bodies)
        route = Route(compile_model(mechanism, request), path)
        track = marcher(route, tol, crossing=False).track

        def work() -> Array:
            kept = track.begin()
            for went, side in zip(track.run(), route.sides, strict=True):
                if went < side.count:
                    raise SolveError(
                        f"mechanism {mechanism.name!r}: the loops alone end after {went} of"
                        f" {side.count} samples on one side"
                    )
            return kept

        return work

    def _request(
        self,
        mechanism: Mechanism,
        path: Path,
        points: Sequence[str],
        bodies: Sequence[str],
        forces: Collection[str] = (),
        varied: Sequence[str] = (),
    ) -> Request:
        return Request(
            tuple(path.motions),
            tuple(points),
            tuple(bodies),
            self.order,
            self.style,
            self.compiled,
            varied=tuple(varied),
            last_iteration=self.last_iteration,
            forces=wanted_forces(mechanism, forces) if forces else None,
        )


@dataclass(frozen=True)
class ProgramSize:
    """The size of the programs of one mechanism.

    Attributes:
        unknowns: number of unknowns.
        rows: number of solved rows.
        redundant: rows only checked, as "joint: primitive".
        flops: floating-point operations of each program.
    """

    unknowns: int
    rows: int
    redundant: Sequence[str]
    flops: Mapping[str, int]

    @staticmethod
    def of(model: Model) -> ProgramSize:
        """Return the size of the programs of a model."""
        account = model.selection.account
        return ProgramSize(
            account.moving_coordinates,
            len(model.selection.chosen),
            account.redundant_rows,
            {name: each["flops"] for name, each in model.sizes.items()},
        )

    def of_sample(self, iterations: float, *, motions: bool = False) -> float:
        """Return the floating-point operations of a sample: predictor, Newton's iterations, rates,
        outputs and the test of a solution.

        Operations of rejected lanes, and further iterations for a neighbour's sake, do not count.

        Args:
            iterations: Newton's iterations of the sample.
            motions: lanes are motions of their own, of varied geometry, and not samples of one
                motion; the first few samples of a motion use other programs.
        """
        tests = ("extend", *ALONE) if motions else ("extrapolate", *JOINED)
        once = sum(self.flops[name] for name in ("outputs", *tests))
        return iterations * self.flops["newton"] + once


# Designs solved at once at least: with fewer, the calls around them would be felt.
FEWEST = 8


@dataclass(frozen=True, eq=False)
class PreparedDesigns:
    """A mechanism of varied geometry, made ready for a path.

    Attributes:
        route: the path made ready for the compiled model.
        wanted: the wanted forces; None without any.
    """

    route: Route
    wanted: WantedForces | None = None

    def on_path(self, path: Path) -> PreparedDesigns:
        """Return the same programs on another path of the same drivers."""
        return replace(self, route=Route(self.route.model, path))

    @property
    def start(self) -> Start:
        """The start of the nominal design."""
        return self.route.begin

    @property
    def size(self) -> ProgramSize:
        """The size of the programs."""
        return ProgramSize.of(self.route.model)

    def at_once(self, most: int) -> int:
        """Return the number of designs to solve together, at most the given one: the table of their
        motions fits in recycled memory.
        """
        of_a_design = 8 * self.route.model.kept * len(self.route.path.times)
        return max(FEWEST, min(most, RECYCLED // of_a_design))

    def solve(self, geometry: Array, tol: float, *, alone: bool = True) -> Variants:
        """Solve designs at all samples.

        Args:
            geometry: numbers of the varied places in their order, shape (numbers, V).
            tol, alone: as for `solve_variants`.
        """
        return solve_variants(self.route, geometry, tol, alone=alone)

    def motion(self, found: Variants, point: str) -> Sequence[Array]:
        """Return position [m], velocity and acceleration of a point, as far as they were asked for,
        each of shape (3, n, V).
        """
        rows, orders = self.route.model.rows, self.route.model.orders
        return [found.kept[rows[f"{label} {point}"]] for label in QUANTITIES[:orders]]

    def pose(self, found: Variants, body: str) -> Array:
        """Return origin [m] and Euler parameters of a requested body, shape (7, n, V)."""
        rows = self.route.model.rows
        return np.concatenate([found.kept[rows[f"{each} {body}"]] for each in "rp"])

    def output(self, found: Variants, name: str, derivative: int = 0) -> Array:
        """Return the terms of an output, or a time derivative of theirs, shape (terms, n, V)."""
        return found.kept[self.route.model.rows[f"{OUTPUT}{QUANTITIES[derivative]} {name}"]]

    def resting(self, found: Variants, name: str) -> tuple[Array, Array] | None:
        """Return squares of the speeds of an output without a value at rest, shape (n, V); None for
        any other output.
        """
        rows = self.route.model.rows.get(f"{RESTING}{name}")
        return None if rows is None else (found.kept[rows][0], found.kept[rows][1])

    def slopes(self, found: Variants, geometry: Array, towards: Array) -> Mapping[str, Array]:
        """Return the derivatives of the terms of each output by motions of the geometry, drivers
        held, shape (motions, terms, n, V); NaN at samples not reached.

        Args:
            found: result of `solve` for the geometry.
            towards: motions of the varied numbers, shape (numbers, motions).
        """
        return slopes_of(self.route, found, geometry, towards)

    def forces(self, found: Variants, geometry: Array, tol: float) -> ForcesOfDesigns | None:
        """Return the forces of solved designs; None where none are wanted.

        Args:
            found: the result of `solve` for the geometry.
        """
        if self.wanted is None:
            return None
        from .design_forces import forces_of_designs  # most studies are without

        return forces_of_designs(self.route, self.wanted, found, geometry, tol)

    def iterations(self, found: Variants) -> Array:
        """Return Newton's iterations of each sample, shape (n, V)."""
        return found.kept[self.route.model.rows[ITERATIONS].start]

    def start_notes(self, tol: float) -> list[str]:
        """Return notes on the assumed start of the nominal design; none if it is certain."""
        model = self.route.model
        return start_notes(model.mechanism, model.request, self.route.path, tol)
