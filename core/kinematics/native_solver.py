"""The native solver with its settings: makes a mechanism ready for a path, or for many designs."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from ..doors import offers
from ..errors import SolveError
from ..mechanism.mechanism import Mechanism
from ..mechanism.motions import Path
from .compiled.compiled_model import Model, compile_model
from .compiled.request import LAST_ITERATION, Request
from .compiled.routes import Route
from .forces.wanted import wanted_forces
from .formulation.styles import NATIVE
from .motion_solver import Method, Solver, by_method
from .one_design import by_motion, by_program, motion_only, prepare


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
        method: the system solved at once, a `Method` or the name of an extension's. `BY_SIZE`
            keeps the last few mechanisms ready in the process; the others make them ready anew.
    """

    order: int = 2
    style: str = NATIVE
    compiled: bool = True
    last_iteration: float = LAST_ITERATION
    method: str = Method.BY_SIZE

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
        request = self.request(mechanism, path, points, bodies, forces)
        if self.method == Method.BY_SIZE:
            return prepare(mechanism, request, path)
        if self.method == Method.ONE_PROGRAM:
            return by_program(
                mechanism, request, path, lambda each: Route(compile_model(mechanism, each), path)
            )
        if (make := by_method(self.method)) is None:
            known = sorted({*offers("methods"), Method.BY_SIZE.value, Method.ONE_PROGRAM.value})
            raise SolveError(
                f"no extension has the method '{self.method}'. Give one of {', '.join(known)}."
            )
        motion = make(mechanism, motion_only(mechanism, request))(path)
        return by_motion(mechanism, request, path, motion)

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
        request = self.request(mechanism, path, points, bodies)
        return ProgramSize.of(compile_model(mechanism, request))

    def request(
        self,
        mechanism: Mechanism,
        path: Path,
        points: Sequence[str],
        bodies: Sequence[str],
        forces: Collection[str] = (),
        varied: Sequence[str] = (),
    ) -> Request:
        """Return what programs of a mechanism have to solve, by these settings."""
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
