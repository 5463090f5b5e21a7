"""Dependence of outputs on solvers' residuals, hence a sensible tolerance, and on hardpoints."""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec
import numpy as np

from ...algebra import Vec3, vec
from ...case.case import ORDERS, Case, Quantity
from ...jet import Jet
from ...joints import Kind
from ...trajectory import Array
from ..sweep.varied_places import Variable
from .conditioning import Conditioning, Gradient, PoseConditioning

# The house formula for tolerances: 10 for engines that scale their rows otherwise, 10 for
# accelerations, whose rows carry rates.
MARGIN = 100.0
# Derivatives are of size one; below this they are round-off, a hundred times of a condition of 1e5.
NOTHING = 1e-9
ROUND_OFF = float(np.finfo(np.float64).eps)


class Budget(msgspec.Struct, frozen=True):
    """Effect of residuals on an output, and the resulting tolerance.

    Attributes:
        shift: by residuals of the tolerance in every row, at most over the samples [unit].
        round_off: by residuals and a result rounded to double precision [unit].
        at: driver value of the largest shift.
        row: the row with the largest share of the shift; share: its share.
        suggested: tolerance by the house formula [unit].
        atol: tolerance of the case.
    """

    output: str
    unit: str
    shift: float
    round_off: float
    at: float
    row: str
    share: float
    suggested: float
    why: str
    atol: float


class Sensitivity(msgspec.Struct, frozen=True):
    """Derivative of an output by one number of the geometry, drivers held.

    Attributes:
        number: row and axis of a table, "lca_front x"; else the first place at a point, and the
            axis, "joints.NAME.point x"; or "joints.NAME.length".
        unit: the output's unit by m, or by rad for a direction.
        by_sample: at the examined samples.
    """

    output: str
    number: str
    unit: str
    by_sample: list[float]

    @property
    def largest(self) -> float:
        """The largest over the samples, with its sign."""
        return max(self.by_sample, key=abs)


def budgets(case: Case, found: Conditioning, tol: float, design: dict[str, Array]) -> list[Budget]:
    """Return the budget of every output of the pose alone."""
    return [
        _budget(output, found, tol, design) for output in case.outputs if output.orders == ORDERS
    ]


def _budget(output: Quantity, found: Conditioning, tol: float, design: dict[str, Array]) -> Budget:
    by_rows = [np.abs(_derivative(output, pose, design, "by_residuals")[1]) for pose in found.poses]
    shifts = [float(rows.sum()) for rows in by_rows]
    k = int(np.argmax(shifts))
    row = int(by_rows[k].argmax())
    size = max(
        float(np.abs(_derivative(output, pose, design, "by_residuals")[0]).max())
        for pose in found.poses
    )
    shift = tol * shifts[k]
    suggested = _two_digits(MARGIN * shift)
    why = (
        f"100 times what residuals of {tol:g} in every row shift it by, at most {shift:.3g}"
        f" {output.unit}: 10 for rows scaled otherwise, 10 for accelerations"
    )
    share = float(by_rows[k][row]) / shifts[k] if shifts[k] else 0.0
    name = "{}: {}".format(*found.poses[k].owners[row])
    floor = ROUND_OFF * (shifts[k] + size)
    return Budget(
        output.name,
        output.unit,
        shift,
        floor,
        found.poses[k].value,
        name,
        share,
        suggested,
        why,
        output.atol,
    )


def sensitivities(
    case: Case, found: Conditioning, design: dict[str, Array], variables: Sequence[Variable]
) -> list[Sensitivity]:
    """Return the nonzero derivatives, the largest of each output first."""
    numbers = [
        (name, "rad" if each.kind is Kind.DIRECTION else "m")
        for each in variables
        for name in each.numbers
    ]
    result: list[Sensitivity] = []
    for output in case.outputs:
        if output.orders != ORDERS:
            continue
        table = np.array(
            [_derivative(output, pose, design, "by_geometry")[1] for pose in found.poses]
        )
        own: list[Sensitivity] = []
        for slopes, (name, unit) in zip(table.T, numbers, strict=True):
            if np.abs(slopes).max() > NOTHING:
                by = f"{output.unit}/{unit}"
                own.append(Sensitivity(output.name, name, by, slopes.tolist()))
        result += sorted(own, key=lambda each: -abs(each.largest))
    return result


def binding_numbers(found: Conditioning, variables: Sequence[Variable]) -> list[str]:
    """Return the numbers of the geometry not to be changed alone: redundant rows would contradict
    the others.
    """
    contradicted = np.max(
        [np.abs(pose.contradicted).max(axis=0, initial=0.0) for pose in found.poses], axis=0
    )
    names = [name for each in variables for name in each.numbers]
    return [name for name, rate in zip(names, contradicted, strict=True) if rate > NOTHING]


def _derivative(
    output: Quantity, pose: PoseConditioning, design: dict[str, Array], by: str
) -> tuple[Array, Array]:
    """Return value and derivatives of an output from the derivatives of its points."""
    at = {
        name: _jets(gradient.position, getattr(gradient, by))
        for name, gradient in pose.points.items()
    }
    still = {name: _design(gradient, design[name], by) for name, gradient in pose.points.items()}
    jet = output.of(at, still)
    return jet.x, np.broadcast_to(jet.v, next(iter(at.values())).x.v.shape)


def _design(gradient: Gradient, position: Array, by: str) -> Vec3:
    """Return a point at design: hardpoints shift it, residuals do not."""
    moved = (
        gradient.design_by_geometry if by == "by_geometry" else np.zeros_like(gradient.by_residuals)
    )
    return _jets(position, moved)


def _jets(position: Array, derivatives: Array) -> Vec3:
    """Return a position as jets, with derivatives in place of time derivatives."""
    return vec(
        [
            Jet(np.full_like(d, x), d, np.zeros_like(d))
            for x, d in zip(position, derivatives, strict=True)
        ]
    )


def _two_digits(x: float) -> float:
    """Return a number rounded up to two digits."""
    if not (x > 0.0 and math.isfinite(x)):
        return x
    digit = 10.0 ** (math.floor(math.log10(x)) - 1)
    return float(f"{math.ceil(x / digit * (1.0 - 1e-12)) * digit:.1e}")


def read_points(case: Case) -> Sequence[str]:
    """Return the points read by outputs of the pose alone."""
    return tuple(
        dict.fromkeys(
            point for output in case.outputs if output.orders == ORDERS for point in output.points
        )
    )
