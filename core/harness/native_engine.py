"""The native engine: kincheck's own solver, behind the same protocol as the simulators."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ..case.case import Case
from ..kinematics import LAST_ITERATION, NATIVE, NativeSolver, ProgramSize, Solver
from ..program.executor import compiler
from ..trajectory import Trajectory, shown
from ..version import VERSION
from .engine import STANDARD, equilibria_of


@dataclass(frozen=True)
class NativeEngine:
    """The geometric constraint formulation, traced to programs that machine code (without llvmlite,
    numpy) runs over lanes of samples; see `Engine`.

    Attributes:
        solver: the solver and its settings; with a `last_iteration` above the default, the residual
            after the last iteration is accepted.
        every_body: whether to solve the motion of every moving body, not only of the compared
            points.
        every_force: whether to solve the reactions of all joints, the efforts of all drivers and
            all force elements, not only the forces of outputs.
    """

    solver: NativeSolver = field(default_factory=NativeSolver)
    every_body: bool = False
    every_force: bool = False
    name: str = STANDARD
    mode = "projection"
    in_process = True
    bounds_error = True

    @property
    def loop(self) -> str:
        """Place of Newton's loop over the samples: machine code, if a compiler is available."""
        return "compiled" if self.solver.compiled and compiler() else "python"

    @property
    def settings(self) -> Mapping[str, Any]:
        """Formulation, executor, termination of the loop, and any additional solved quantities."""
        solver = self.solver
        executor = (
            "llvm, vectors of lanes"
            if self.loop == "compiled"
            else "numpy, one call an operation over all lanes"
        )
        last = solver.last_iteration if math.isfinite(solver.last_iteration) else "any"
        axes = " (global axes)" if solver.style == NATIVE else ""
        return {
            "row_style": f"{solver.style}{axes}",
            "executor": executor,
            "last_iteration_below": last,
            **({"order": solver.order} if solver.order != NativeSolver.order else {}),
            **({"every_body": True} if self.every_body else {}),
            **({"every_force": True} if self.every_force else {}),
        }

    def version(self) -> str | None:
        """Version of kincheck."""
        return VERSION

    def unsupported(self, case: Case) -> str | None:
        """Return None always: every joint is composed of supported primitives."""
        return None

    def bodies(self, case: Case) -> tuple[str, ...]:
        """Return the names of the bodies with a solved motion."""
        return tuple(body.name for body in case.mechanism.moving) if self.every_body else ()

    def build(self, case: Case) -> Solver:
        """Select the rows, trace the programs for the points of the outputs, and prepare the
        samples.
        """
        path, bodies, forces = case.sweep.path, self.bodies(case), self._forces(case)
        return self.solver.prepare(case.mechanism, path, case.points, bodies, forces)

    def _forces(self, case: Case) -> tuple[str, ...]:
        mechanism = case.mechanism
        every = (*mechanism.given_joints, *mechanism.drivers, *mechanism.forces)
        return tuple(each.name for each in every) if self.every_force else case.forces

    def equilibria(self, case: Case) -> Trajectory:
        """Return the equilibria of a case; see `engine.Balancing`."""
        return equilibria_of(self, case, STANDARD)

    def solve(self, model: Solver, case: Case, tol: float) -> Trajectory:
        """Solve all samples in order; tol is relative to the mechanism's size."""
        return model(tol if self.solver.last_iteration <= LAST_ITERATION else math.inf)


ORDERS = ("positions only", "and velocities", "and accelerations")


def explain(case: Case) -> list[str]:
    """Return lines of text on unknowns, rows, drivers and points, used or left out, and on the
    operations of every program.

    Raises:
        SolveError: the mechanism cannot be solved as described.
    """
    mechanism, moving = case.mechanism, tuple(case.sweep.path.motions)
    sizes = [
        NativeSolver(order=order, compiled=False).program_size(
            mechanism, case.sweep.path, case.points
        )
        for order in range(len(ORDERS))
    ]
    full = sizes[-1]
    held = [driver.name for driver in mechanism.drivers if driver.name not in moving]
    unread = shown(point.name for point in mechanism.points if point.name not in case.points)
    fixed = [body.name for body in mechanism.bodies if body.fixed]
    grounded = [joint.name for joint in mechanism.grounded]
    lines = [
        (
            f"{case.name}: {full.unknowns} unknowns for"
            f" {_names([body.name for body in mechanism.moving])}"
        ),
        f"  fixed, in no program: {_names(fixed)}",
        *(
            [f"  joints between fixed bodies, satisfied at design, left out: {_names(grounded)}"]
            if grounded
            else []
        ),
        (f"  rows solved: {full.rows}; redundant rows, only checked: {_names(full.redundant)}"),
        f"  moving drivers: {_names(moving)}; drivers at rest, constants: {_names(held)}",
        (
            f"  points computed: {_names(shown(case.points))}; read by no output, not computed:"
            f" {_names(unread)}"
        ),
    ]
    lines += [f"  {name:18} {_flops(size)}" for name, size in zip(ORDERS, sizes, strict=True)]
    return lines


def _flops(size: ProgramSize) -> str:
    """Return the operation counts of a sample: each Newton iteration, and the outputs."""
    newton, outputs = (size.flops[name] for name in ("newton", "outputs"))
    return (
        f"{newton} operations per iteration, {outputs} for the outputs: {newton + outputs} with one"
        " iteration"
    )


def _names(names: Sequence[str]) -> str:
    return ", ".join(names) or "none"
