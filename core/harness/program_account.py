"""Account of the native engine's programs for a case, and of the unneeded parts left out."""

from __future__ import annotations

from collections.abc import Sequence

from ..case.case import Case
from ..kinematics import NativeSolver, ProgramSize
from ..trajectory import shown

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
