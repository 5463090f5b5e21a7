"""Account of the native engine's programs for a case, and of the parts left out as not needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..case.case import Case
from ..kinematics.compiled.compiled_model import Model, compile_model
from ..kinematics.compiled.request import Request

ORDERS = ("positions only", "and velocities", "and accelerations")


def explain(case: Case) -> list[str]:
    """Return lines of text: unknowns, rows, drivers and points, used and left out, and the
    operations of every program.

    Raises:
        SolveError: the mechanism cannot be solved as described.
    """
    mechanism, moving = case.mechanism, tuple(case.sweep.path.motions)
    full = Request(moving, case.points, compiled=False)
    models = [compile_model(mechanism, replace(full, order=order)) for order in range(len(ORDERS))]
    account = models[-1].selection.account
    held = [driver.name for driver in mechanism.drivers if driver.name not in moving]
    unread = [point.name for point in mechanism.points if point.name not in case.points]
    fixed = [body.name for body in mechanism.bodies if body.fixed]
    grounded = [joint.name for joint in mechanism.grounded]
    lines = [
        (
            f"{case.name}: {account.moving_coordinates} unknowns for"
            f" {_names([body.name for body in mechanism.moving])}"
        ),
        f"  fixed, in no program: {_names(fixed)}",
        *(
            [
                "  joints between fixed bodies, which hold at the design: left out:"
                f" {_names(grounded)}"
            ]
            if grounded
            else []
        ),
        (
            f"  rows solved {len(models[-1].selection.chosen)}, redundant and only checked:"
            f" {_names(account.redundant_rows)}"
        ),
        f"  drivers moving: {_names(moving)}; held, constants: {_names(held)}",
        (
            f"  points computed: {_names(case.points)}; not read by an output, not computed:"
            f" {_names(unread)}"
        ),
    ]
    lines += [f"  {name:18} {_flops(model)}" for name, model in zip(ORDERS, models, strict=True)]
    return lines


def _flops(model: Model) -> str:
    """Return the operations of one sample: of each Newton iteration, and once at the end."""
    newton, outputs = (model.programs[name].flops for name in ("newton", "outputs"))
    return (
        f"{newton} operations an iteration, outputs {outputs} once: {newton + outputs} with one"
        " iteration"
    )


def _names(names: Sequence[str]) -> str:
    return ", ".join(names) or "none"
