"""Outputs of a trajectory, and their deviations from a reference or from another engine.

Only outputs are compared, since generalized coordinates may differ between correct engines. The
samples are the same, so nothing is interpolated. A deviation is accepted up to atol + rtol * range,
with the range of the reference over the compared samples. A rounded or interpolated reference is
known within an interval only; its half-width at each sample is added to the tolerance.

An output's atol applies to positions. A wrong pose propagates: the velocities of a mechanism are
its driver's rate times functions of the pose. Moving the pose by d, small against the size D of the
mechanism, changes a velocity by about d * rate / D and an acceleration by d * (rate / D)^2. Hence
the atol of velocities is atol * pace, and of accelerations atol * pace^2, with pace = rate / D
[1/s]. D is a radian for a rotational driver and the mechanism's size for a translational one. A
driver with a motion adds d * s / D to an acceleration; s is its own acceleration. The pace is then
sqrt(s / D), if this is larger. Rate and s are maxima over the samples, and the driver with the
largest pace counts. All three quantities thus need the same relative accuracy, at any scale and any
rate. Example: with atol = 1e-9 m, a mechanism of 1 m and a drive of 1 m/s, a relative error of 1e-6
in an acceleration of 1 m/s^2 is a thousand times out of tolerance.

The same holds for outputs in other units, such as angles: they too are functions of the pose. The
derivative of an output by wheel travel has its own atol, the output's atol divided by D; the atol
of its rate is this atol times the pace.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from ..case.case import HELD_BUT, ORDERS, Case, Quantity, Series, pace
from ..case.measures import ForceMeasure
from ..case.quantity import point_jets, still_jets
from ..case.turns import output_over_sweep
from ..errors import CaseError, number_of
from ..trajectory import PER_TIME, QUANTITIES, Array, Trajectory
from ..unit_text import motion_word
from . import labels
from .record import Deviation, Deviations, Facts, OutputSeries
from .table_units import driver_unit

NO_VALUE = "has no value at"
"""Phrase of a reason: the standard has no value at some samples, so they are not judged."""


def output_series(
    case: Case,
    output: Quantity,
    trajectory: Trajectory,
    held: Mapping[tuple[str, ...], Trajectory] | None = None,
) -> Series:
    """Return an output over the samples of a trajectory.

    Args:
        held: the same poses, with velocities caused by some drivers while the others are at rest,
            by these drivers; outputs defined as such derivatives have no value without it.

    Values are NaN at unsolved samples. A quantity is None if the engine does not give it.
    """
    alone = tuple(output.facts.get(HELD_BUT, ()))
    moved = (held or {}).get(alone) if alone else trajectory
    if moved is None:
        return Series(np.full(len(trajectory.solved), np.nan), possible=False)
    if isinstance(output, ForceMeasure):
        return _force_series(output, trajectory, moved)
    trajectory = moved
    at = {name: point_jets(trajectory.points[name]) for name in output.points}
    # NaN marks unknown values, and spreads to all results that depend on them
    with np.errstate(all="ignore"):
        design = {name: still_jets(case.mechanism.point(name).position) for name in output.points}
        jet = output_over_sweep(case.mechanism, case.sweep.path, output, at, design)
    solved = trajectory.solved
    position, *rates = (
        np.where(solved & np.isfinite(values), values, np.nan) for values in (jet.x, jet.v, jet.a)
    )
    motions = [trajectory.points[name] for name in output.points]
    given = 1 + sum(
        all(getattr(each, quantity) is not None for each in motions) for quantity in QUANTITIES[1:]
    )
    # the value of a derivative output needs the rate given by the engine
    known = given - (ORDERS - output.orders)
    if case.sweep.static:  # rates of the path are no result
        return Series(position, possible=known > 0)
    return Series(
        position,
        *(rate if order < known else None for order, rate in enumerate(rates, 1)),
        possible=known > 0,
    )


def _force_series(output: ForceMeasure, trajectory: Trajectory, moved: Trajectory) -> Series:
    """Return a force over the samples, NaN if it is missing or undetermined."""
    given = trajectory.forces
    # a simulator may replace a joint by an equivalent, which gives no reaction of the joint
    if given is None or not given.has(output.forces):
        return Series(np.full(len(trajectory.solved), np.nan), possible=False)
    if output.follows_points:
        at = {name: point_jets(moved.points[name]) for name in output.points}
        output = output.with_points(at)
    values = np.where(trajectory.solved, output.values(given), np.nan)
    return Series(values, reason=output.undetermined(given))


def as_numbers(series: Series, output: Quantity) -> OutputSeries:
    """Return the series as plain numbers, null for NaN, with the reason for missing values."""
    reasons = [] if np.isfinite(series.position).all() else ["samples without a value are null"]
    reasons += [series.reason] if series.reason else []
    if output.forces:
        reasons.append("forces have no rates")
    else:
        absent = (name for name in QUANTITIES[1:] if getattr(series, name) is None)
        reasons += [f"there is no {name}" for name in absent]
    return OutputSeries(
        position=numbers(series.position),
        velocity=None if series.velocity is None else numbers(series.velocity),
        acceleration=None if series.acceleration is None else numbers(series.acceleration),
        unit=output.unit,
        sense=output.sense or None,
        reason="; ".join(reasons) or None,
    )


def numbers(values: Array) -> list[float | None]:
    """Return plain numbers, None for NaN."""
    return [value if math.isfinite(value) else None for value in values.tolist()]


def as_array(numbers: Sequence[float | None] | None) -> Array | None:
    """Return the values of plain numbers, without loss: NaN for null; None for no series."""
    return None if numbers is None else np.array(numbers, dtype=np.float64)


def deviations(
    case: Case,
    output: Quantity,
    found: Series,
    standards: Sequence[tuple[str, Series]],
    *,
    complete: bool = False,
    refused: NDArray[np.bool_] | None = None,
) -> Deviations:
    """Return the deviations of an output in position, velocity and acceleration.

    Args:
        found: the engine's output.
        standards: possible standards, (name, series), best first; each quantity takes the first
            standard with this quantity.
        complete: whether every sample was solved; a missing value is then out of tolerance if the
            standard has one.
        refused: samples that the standard's solver cannot reach, shape (n,); a value at such a
            sample contradicts the solver.
    """
    rate_scale, force = pace(case), isinstance(output, ForceMeasure)
    compared: dict[str, Deviation | None] = {}
    reasons: list[str] = []
    losses = 0
    unreached = np.zeros(len(found.position), dtype=np.bool_) if refused is None else refused
    for order, quantity in enumerate(QUANTITIES):
        values: Array | None = getattr(found, quantity)
        known = [
            (name, Curve(getattr(series, quantity), half=series.uncertainty.get(quantity)))
            for name, series in standards
            if getattr(series, quantity) is not None
        ]
        compared[quantity], word = None, motion_word(quantity, output.unit)
        if order and (force or case.sweep.static):
            continue  # forces have no rates, and a mechanism at rest has none
        if order >= output.orders:
            reasons.append(f"{word}: needs a higher derivative than engines give")
        elif values is None:
            reasons.append(f"{word}: the engine gives none")
        elif not known:
            names = " and ".join(labels.against(name) for name, _ in standards)
            reasons.append(
                f"{word}: {names} gives none"
                if names
                else f"{word}: there is nothing to compare with"
            )
        else:
            (name, standard), own = known[0], found.uncertainty.get(quantity)
            shown, has = labels.against(name), np.isfinite(standard.values)
            mine = curve_of(output, order, rate_scale, values, own)
            compared[quantity] = off = deviation(mine, standard, name)
            lost = int((has & ~np.isfinite(values)).sum()) if complete else 0
            many = number_of(lost, "sample")
            if lost and (order or found.possible):
                compared[quantity] = off and msgspec.structs.replace(off, within=False)
                reasons.append(f"{word}: {many} without a value where {shown} has one")
                losses += lost
            elif not (order or found.possible):
                inputs = "forces" if force else "velocities, on which it depends"
                reasons.append(found.reason or f"{word}: the engine gives no {inputs}")
            elif off is None:
                none = f"{word}: no sample is known to both the engine and {shown}"
                reasons.append(found.reason or none)
            alone = np.isfinite(values) & ~has & ~unreached
            if off is not None and (count := int(alone.sum())):
                reasons.append(f"{word}: {shown} {NO_VALUE} {count} of {len(values)} samples")
    contradicted = int((unreached & np.isfinite(found.position)).sum())
    if contradicted:
        reasons.append(
            f"values at {contradicted} of {len(found.position)} samples that the standard cannot"
            " reach"
        )
    return Deviations(
        **compared,
        reason="; ".join(reasons) or None,
        lost=losses or msgspec.UNSET,
        contradicted=contradicted or msgspec.UNSET,
    )


@dataclass(frozen=True, eq=False)
class Curve:
    """One quantity of an output over the samples, and how far it may be off a standard: by
    atol + rtol * range of the standard over the compared samples, plus the half-width.

    Attributes:
        values: shape (n,), NaN at unknown samples.
        unit: of the values.
        half: half-width of the interval around each value, shape (n,); None for exact values.
        facts: of its case, for the units of texts.
    """

    values: Array
    atol: float = 0.0
    rtol: float = 0.0
    unit: str = ""
    half: Array | None = None
    facts: Facts = field(default_factory=dict[str, Any])

    def text(self, value: float, form: str = ".3g") -> str:
        """Return a value, or a difference of values, with its unit."""
        return labels.shown_text(value, self.unit, self.facts, form)

    def changed(self, change: Callable[[Array], Array]) -> Curve:
        """Return the curve after an affine change of its values and samples."""
        if self.half is None:
            return replace(self, values=change(self.values))
        half = np.abs(change(self.half) - change(np.zeros_like(self.half)))
        half = np.where(np.isfinite(half), half, 0.0)
        return replace(self, values=change(self.values), half=half)


def curve_of(
    output: Quantity, order: int, rate_scale: float, values: Array, half: Array | None = None
) -> Curve:
    """Return a quantity of an output with its tolerance, from the pace of its case."""
    unit = output.unit + PER_TIME[order]
    return Curve(values, output.atol * rate_scale**order, output.rtol, unit, half)


def deviation(found: Curve, standard: Curve, against: str = "") -> Deviation | None:
    """Return the deviation of a curve from a standard over the samples known to both; None without
    such samples. The tolerances and half-widths of both add up.

    With a half-width, the result is the deviation at the sample with the largest ratio to its
    tolerance.

    Raises:
        CaseError: the shapes differ.
    """
    values, reference = found.values, standard.values
    if values.shape != reference.shape:
        raise CaseError(
            f"{labels.against(against)} has shape {reference.shape}, expected {values.shape}: one"
            " number for each sample of the sweep"
        )
    both = np.isfinite(values) & np.isfinite(reference)
    if not both.any():
        return None
    error = np.where(both, np.abs(values - reference), -1.0)
    largest, extent = float(error.max()), float(np.ptp(reference[both]))
    tolerance = found.atol + standard.atol + (found.rtol + standard.rtol) * extent
    # scaled by the largest value: no square overflows or underflows
    rms = largest * math.sqrt(float(np.mean((error[both] / largest) ** 2))) if largest else 0.0
    worst = int(np.argmax(error))
    if halves := [each for each in (found.half, standard.half) if each is not None]:
        allowed = tolerance + np.sum(halves, axis=0)
        exact = allowed <= 0.0
        ratio = np.where(exact, np.where(error > 0.0, np.inf, error), error)
        worst = int(np.argmax(ratio / np.where(exact, 1.0, allowed)))
        largest, tolerance = float(error[worst]), float(allowed[worst])
    return Deviation(
        max_abs=largest,
        rms=rms,
        worst_step=worst,
        tolerance=tolerance,
        against=against,
        within=largest <= tolerance,
    )


def describe(
    output: str,
    quantity: str,
    worst: Deviation,
    driver: str,
    values: Sequence[float],
    unit: str = "m",
    facts: Facts | None = None,
) -> str:
    """Return one line with the deviation and its sample, or the note that values are missing.

    Args:
        unit: unit of the output.
        facts: of the case: the units of its table, and its driver.
    """
    facts = facts or {}
    word, standard = motion_word(quantity, unit), labels.against(worst.against)
    if worst.max_abs <= worst.tolerance:
        return f"{output}: {word} has no value at samples where {standard} has one"
    unit += PER_TIME[QUANTITIES.index(quantity)]
    off, tolerance = (
        labels.shown_text(size, unit, facts, ".3g") for size in (worst.max_abs, worst.tolerance)
    )
    driven = driver_unit(facts) if facts.get("units") else ""
    place = labels.shown_text(values[worst.worst_step], driven, facts, ".9g")
    return (
        f"{output}: {word} is off by {off} at sample {worst.worst_step} ({driver} = {place}),"
        f" tolerance {tolerance}, against {standard}"
    )
