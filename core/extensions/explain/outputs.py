"""Dependence of outputs on solvers' residuals, hence a sensible tolerance, and on hardpoints."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import msgspec
import numpy as np

from ...algebra import Vec3
from ...case.case import ORDERS, Case, Quantity, without_forces
from ...case.quantity import still_jets
from ...harness.compare import numbers as as_numbers
from ...jet import Jet
from ...joints import Kind
from ...mechanism.motions import PointCoordinate
from ...trajectory import Array
from ..designs.outputs import DesignOutputs
from ..slopes.slopes import derivatives, value
from ..sweep.varied_places import Geometry, Moves, Variable
from .conditioning import Conditioning, PoseConditioning

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
        by_sample: at the examined samples; null where the output has no value.
    """

    output: str
    number: str
    unit: str
    by_sample: list[float | None]

    @property
    def largest(self) -> float:
        """The largest over the samples, with its sign."""
        return max((each for each in self.by_sample if each is not None), key=abs)


def budgets(case: Case, found: Conditioning, tol: float) -> list[Budget]:
    """Return the budget of every output of the pose alone."""
    return [_budget(case, output, found, tol) for output in case.outputs if output.orders == ORDERS]


def _budget(case: Case, output: Quantity, found: Conditioning, tol: float) -> Budget:
    by_rows = [np.abs(_derivative(case, output, pose)[1]) for pose in found.poses]
    shifts = [float(rows.sum()) for rows in by_rows]
    k = int(np.argmax(shifts))
    row = int(by_rows[k].argmax())
    size = max(float(np.abs(_derivative(case, output, pose)[0]).max()) for pose in found.poses)
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


def sensitivities(case: Case, found: Conditioning, geometry: Geometry) -> list[Sensitivity]:
    """Return the nonzero derivatives of outputs of motion, the largest of each output first."""
    numbers = [
        (name, "rad" if each.kind is Kind.DIRECTION else "m")
        for each in geometry.variables
        for name in each.numbers
    ]
    every = geometry.moves(geometry.variables)
    moved = {place: each for place, each in every.items() if each.any()}
    wanted = {each.name: 1 for each in case.outputs if not each.forces}
    if not moved or not wanted:
        return []
    held, moves = _shifted_drivers(case, moved), Moves.of(geometry.values, moved)
    ready = DesignOutputs.of(without_forces(case), moved, slopes=wanted, derivative=int(bool(held)))
    samples = [pose.sample for pose in found.poses]
    result: list[Sensitivity] = []
    solved = ready.solve(moves.nominal[:, None])
    for name, _, slopes in solved.slopes(moves.moves):
        own: list[Sensitivity] = []
        slopes = slopes[:, samples, 0]
        for driver, shift in held.items():
            alone = [*case.sweep.path.motions] == [driver]
            rate = solved.values(name, 1)[samples, 0] / case.sweep.pace if alone else np.nan
            slopes[shift != 0.0] += np.outer(
                shift[shift != 0.0], np.broadcast_to(rate, len(samples))
            )
        for slope, (number, unit) in zip(slopes, numbers, strict=True):
            if np.isfinite(slope).any() and np.nanmax(np.abs(slope), initial=0.0) > NOTHING:
                by = f"{ready.outputs[name].unit}/{unit}"
                own.append(Sensitivity(name, number, by, as_numbers(slope)))
        result += sorted(own, key=lambda each: -abs(each.largest))
    return result


def _shifted_drivers(case: Case, moves: Mapping[str, Array]) -> dict[str, Array]:
    """Return how far the numbers move each driver, from its design, whose value is an absolute
    position of a point that varies: it is given, and the design is not.
    """
    found: dict[str, Array] = {}
    for driver in case.mechanism.drivers:
        if isinstance(driver, PointCoordinate) and not driver.relative:
            direction = np.array(driver.direction) / np.linalg.norm(driver.direction)
            place = moves.get(f"points.{driver.point}.position")
            if place is not None and np.abs(direction @ place).any():
                found[driver.name] = -(direction @ place)
    return found


def binding_numbers(found: Conditioning, variables: Sequence[Variable]) -> list[str]:
    """Return the numbers of the geometry not to be changed alone: redundant rows would contradict
    the others.
    """
    contradicted = np.max(
        [np.abs(pose.contradicted).max(axis=0, initial=0.0) for pose in found.poses], axis=0
    )
    names = [name for each in variables for name in each.numbers]
    return [name for name, rate in zip(names, contradicted, strict=True) if rate > NOTHING]


def _derivative(case: Case, output: Quantity, pose: PoseConditioning) -> tuple[Array, Array]:
    """Return value and derivatives of an output by residuals, from those of its points; residuals
    do not shift its points at design.
    """
    rows = np.zeros(len(pose.owners))

    def jet(x: Any) -> Jet:
        """Return a number as a jet, with derivatives in place of time derivatives."""
        return Jet(rows + value(x), rows + derivatives(x), rows)

    at = {name: Vec3(*map(jet, pose.points[name])) for name in output.points}
    still = {name: still_jets(case.mechanism.point(name).position) for name in output.points}
    found = output.of(at, still)
    return found.x, np.broadcast_to(found.v, rows.shape)


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
