"""The native solver with its settings: makes a mechanism ready for a path, or for many designs."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from ..errors import SolveError
from ..mechanism.mechanism import Mechanism
from ..mechanism.motions import Path
from ..trajectory import Array
from .compiled.compiled_model import Model, compile_model
from .compiled.request import LAST_ITERATION, Request
from .compiled.samples import Route
from .continuation.walk import marcher
from .force_solver import Solver, by_motion, by_program, motion_only
from .formulation.constraints import Style
from .prepared_designs import PreparedDesigns
from .program_size import ProgramSize
from .solver_selection import prepare


class Method(StrEnum):
    """The system of equations solved at once; the solutions are the same to round-off."""

    BY_SIZE = "by size"
    ONE_PROGRAM = "one program"
    BY_COMPONENTS = "component by component"
    SPARSE = "one sparse system"


@dataclass(frozen=True)
class NativeSolver:
    """Settings of the native solver.

    Attributes:
        order: 0 positions, 1 and velocities, 2 and accelerations.
        style: form of the rows.
        compiled: run by machine code if llvmlite is installed, else by numpy; the results are the
            same to round-off.
        last_iteration: a sample's iteration from a residual below this is its last [units of the
            mechanism's size]; a sparse system iterates as long as it gains by it.
        method: the system solved at once. `BY_SIZE` keeps the last few mechanisms ready in the
            process; the others make them ready anew.
    """

    order: int = 2
    style: Style = Style.NATIVE
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
        request = self._request(path, points, bodies)
        if forces:
            from .forces.wanted import wanted_forces  # most motions are without forces

            request = replace(request, forces=wanted_forces(mechanism, forces))
        if self.method is Method.BY_SIZE:
            return prepare(mechanism, request, path)
        if self.method is Method.ONE_PROGRAM:
            return by_program(
                mechanism,
                request,
                path,
                lambda each: Route(compile_model(mechanism, each), path),
                prepare,
            )
        motion = motion_only(mechanism, request)
        return by_motion(mechanism, request, path, self._large(mechanism, motion, path), prepare)

    def _large(self, mechanism: Mechanism, request: Request, path: Path) -> Solver:
        # few mechanisms are so large: the others need not wait for the import
        from .blocks.cascade import Cascade
        from .blocks.component_lanes import ComponentLanes
        from .blocks.sparse_lanes import SparseLanes
        from .blocks.sweep import BlockSweep

        lanes = (
            ComponentLanes(Cascade(mechanism, request))
            if self.method is Method.BY_COMPONENTS
            else SparseLanes(mechanism, request)
        )
        return BlockSweep(lanes, path).solve

    def prepare_designs(
        self,
        mechanism: Mechanism,
        path: Path,
        varied: Sequence[str],
        points: Sequence[str] = (),
        forces: Collection[str] = (),
        bodies: Sequence[str] = (),
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

        Raises:
            SolveError: as `prepare`.
        """
        request = self._request(path, points, bodies, varied)
        if not forces:
            return PreparedDesigns(Route(compile_model(mechanism, request), path))
        from .design_forces import DesignForces, compile_with_forces  # most studies are without
        from .forces.wanted import wanted_forces

        wanted = wanted_forces(mechanism, forces)
        model = compile_with_forces(mechanism, replace(request, order=2, forces=wanted))
        route = Route(model, path)
        return PreparedDesigns(route, DesignForces(route, wanted))

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
        return ProgramSize.of(self._model(mechanism, path, points, bodies))

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
        route = Route(self._model(mechanism, path, points, bodies), path)
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

    def _model(
        self,
        mechanism: Mechanism,
        path: Path,
        points: Sequence[str],
        bodies: Sequence[str] = (),
    ) -> Model:
        return compile_model(mechanism, self._request(path, points, bodies))

    def _request(
        self,
        path: Path,
        points: Sequence[str],
        bodies: Sequence[str],
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
        )
