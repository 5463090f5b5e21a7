"""The table behind the curves of a rig: its most likely points, their intervals, and slips of the
file with as good a fit.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from itertools import combinations as pairs
from math import erfc, log
from pathlib import Path

import numpy as np

from ...case.case import Case
from ...case.io.reader_options import CurveOptions
from ...case.units import ANGLES, Unit
from ...errors import KincheckError, unknown
from ...report.axis import ZERO
from ...trajectory import Array
from ..suspects.suspects import FACTORS
from .goals import Movable, points_of, read_box, read_moves, times, travel_of
from .identify import Combination, combinations, source, without_effect
from .likely import Estimate, most_likely
from .rig import ROUND_OFF, Rig, RigModel, read_rig, with_scatter
from .rubber import PERCENT, rates_of

ALPHA = 0.01
"""Data are off, if such ones have a smaller probability."""
NORMAL = 1.959963984540054
"""Half-width of an interval of 95 % over the deviation."""
LESS = 2.0 * log(1000.0)
"""Another unit is named, if its data are at most a thousand times less likely."""
MOST_FOUND = 6
# A linear misfit this many times the mean will not end near it.
_HOPELESS = 100.0
_UNKNOWN_SCALE = 0.03  # a gauge may be so much off, and be trusted
# Factors of units of lengths and angles, by parts of their names.
_LENGTHS, _ANGLES = ("25.4", "0254", "3048"), ("pi",)


class Verdict(StrEnum):
    """Whether data and model agree."""

    FITS = "fits"
    OTHERS = "fits, others too"
    OFF = "does not fit"


@dataclass(frozen=True, eq=False)
class Shift:
    """A shift of the measured numbers: a zero, a scale, or one sample.

    Attributes:
        direction: over the noise, for a size of one, shape (numbers,).
        unit: of its text.
        size, deviation: by how much the rig reads too much [SI].
        chance: probability of a shift as large, if there is none.
    """

    name: str
    direction: Array
    unit: Unit
    size: float = 0.0
    deviation: float = np.inf
    chance: float = 1.0

    @property
    def si(self) -> str:
        """The unit of its size."""
        return "1" if self.unit.name == "%" else "rad" if self.unit.name in ANGLES else "m"

    @property
    def words(self) -> str:
        """Name and size, with its interval."""
        size, half = self.size / self.unit.size, NORMAL * self.deviation / self.unit.size
        return f"{self.name} {size:+.3g} ± {half:.2g} {self.unit.name}"


@dataclass(frozen=True, eq=False)
class Slip:
    """A slip of the rig's file with a fit.

    Attributes:
        chance: probability of its misfit.
        largest: largest move over the drawing's deviation.
    """

    name: str
    chance: float
    largest: float


@dataclass(frozen=True, eq=False)
class Prediction:
    """An output without a column in the file, at the samples [SI].

    Attributes:
        values, spread: by rig and drawing, with their deviations; drawing: deviations by the
            drawing alone.
    """

    values: Array
    spread: Array
    drawing: Array

    @property
    def source(self) -> str:
        """Who tells more of it, over the travel."""
        return source(float(np.nansum(self.spread)), float(np.nansum(self.drawing)))


@dataclass(frozen=True, eq=False, repr=False)
class Fitted:
    """The answer.

    Attributes:
        boxes: the drawing's deviation of each place [m].
        first: the estimate from the data as they are; estimate: without the shifts found.
        shifts: zeros and scales, as tested in the end; found: shifts without which the data do not
            fit, the clearest first.
        worst: the number farthest off, in words.
        slips: those with a fit.
        combinations: the best known first.
        null: combinations without effect on the measured outputs, in words.
        idle: places left out, without effect on the measured outputs.
        predictions: by output.
    """

    rig: Rig
    boxes: Mapping[str, float]
    first: Estimate
    estimate: Estimate
    shifts: Sequence[Shift]
    found: Sequence[Shift]
    worst: str
    slips: Sequence[Slip]
    combinations: Sequence[Combination]
    null: Sequence[str]
    idle: Sequence[str]
    predictions: Mapping[str, Prediction]

    def __repr__(self) -> str:
        return f"<Fitted: {self.rig.case.name} by {self.rig.file.name}, {self.verdict}>"

    @property
    def verdict(self) -> Verdict:
        """Whether data and model agree, and whether slips do too."""
        if self.first.probability < ALPHA or self.found:
            return Verdict.OFF
        return Verdict.OTHERS if self.slips or self.loose else Verdict.FITS

    @property
    def loose(self) -> list[Shift]:
        """The scales in doubt, since moved points do the same."""
        return [
            each
            for each in self.shifts
            if each.unit.name == "%" and NORMAL * each.deviation > _UNKNOWN_SCALE
        ]

    def told_at(self, prediction: Prediction) -> int:
        """Return the sample to tell of: the one nearest to design, unless all is known there."""
        drawn = np.nan_to_num(prediction.drawing)
        order = np.argsort(np.abs(self.rig.case.sweep.values), kind="stable")
        return next(int(k) for k in order if drawn[k] > 0.01 * drawn.max())

    @property
    def moves(self) -> dict[str, float]:
        """The most likely moves from the drawing, by place [m]."""
        return times(self.boxes, self.estimate.u)

    @property
    def deviations(self) -> dict[str, float]:
        """The deviation of each move [m]."""
        return times(self.boxes, np.sqrt(np.diag(self.estimate.covariance)))


def fit(
    case: Case,
    file: Path,
    options: CurveOptions,
    drawing: str,
    moves: Sequence[str] = (),
    free: Sequence[str] = (),
) -> Fitted:
    """Return the most likely moves of a table, by a rig and the drawing.

    Args:
        file: of the rig.
        drawing: the drawing's deviation, as text.
        moves: places in doubt, as texts; all by default.
        free: names of the rig's possible shifts.

    Raises:
        KincheckError: the file or an option makes no sense, or the table does not reach the travel
            of the rig.
    """
    soft = bool(case.mechanism.bushings)
    boxes = _boxes(rates_of(case) if soft else points_of(case), drawing, moves)
    return fit_rig(read_rig(case, file, options), boxes, free, every=not moves)


def fit_rig(
    rig: Rig, boxes: Mapping[str, float], free: Sequence[str] = (), *, every: bool = False
) -> Fitted:
    """Return the most likely moves, as `fit` does.

    Args:
        boxes: deviation of each place by the drawing [m].
        every: leave out places without effect on the measured outputs.
    """
    model, start = rig.model(boxes), np.zeros(len(boxes))
    rig = with_scatter(rig, model.values(start))
    model = rig.model(boxes)
    given = model(start)
    if given is None:
        raise KincheckError(
            f"{rig.file}: a measured output has no slope by the points of {rig.case.name} at a"
            " sample; leave its column out"
        )
    idle = list[str]()
    if every:  # at a drawing with round numbers an effect may be zero by chance
        near = model(np.random.default_rng(0).uniform(-0.5, 0.5, len(boxes))) or given
        size = np.abs(near[1]).max(axis=0)
        idle = [
            x for x, known in zip(boxes, size > ROUND_OFF * size.max(), strict=True) if not known
        ]
        boxes = {place: box for place, box in boxes.items() if place not in idle}
        model = rig.model(boxes)
    if not boxes:
        raise KincheckError(f"{rig.file}: nothing measured follows a point of {rig.case.name}")

    freed = _named(free, [*_offsets(model, _estimate(model, []))]) if free else []
    first = estimate = _estimate(model, freed)
    slips = [*_slips(model, first)] if first.probability < ALPHA else []
    found = list[Shift]()
    while True:
        taken = {each.name for each in (*freed, *found)}
        offsets = [each for each in _offsets(model, estimate) if each.name not in taken]
        tests = [_sized(each, estimate) for each in (*offsets, *_samples(rig))]
        offsets = tests[: len(offsets)]
        clearest = min(tests, key=lambda each: (each.chance, -abs(each.size / each.deviation)))
        if slips or len(found) == MOST_FOUND or clearest.chance * len(tests) >= ALPHA:
            break
        found.append(clearest)
        estimate = _estimate(model, [*freed, *found])
    at = tests[len(offsets) :]
    worst = max(at, key=lambda each: abs(each.size / each.deviation))
    every_shift = [*freed, *found]
    return Fitted(
        *(rig, boxes, first, estimate, offsets),
        [_alone(each, k, every_shift, estimate) for k, each in enumerate(found, len(freed))],
        *(worst.words, slips or [*_slips(model, estimate)], combinations(estimate, boxes)),
        without_effect(*model.over_travel(estimate.u), rig.case, boxes, times(boxes, estimate.u)),
        *(idle, predictions(model, estimate)),
    )


def _boxes(movable: Movable, drawing: str, moves: Sequence[str]) -> dict[str, float]:
    usual = read_box(drawing, f"--drawing {drawing!r}", movable)
    every = {f"{row} {axis}": usual for row in movable.rows.values() for axis in "xyz"}
    found = read_moves(moves, movable, drawing) if moves else every
    for place, box in found.items():
        if -box.low != box.high:
            raise KincheckError(f"move {place}: a deviation is the same both ways; say +- 2 mm")
    return {place: box.size for place, box in found.items()}


def _estimate(model: RigModel, free: Sequence[Shift]) -> Estimate:
    columns = np.array([each.direction for each in free]).reshape(-1, model.rig.count).T
    found = most_likely(model, np.zeros(len(model.boxes)), columns)
    assert found is not None  # the drawing reaches all samples
    return found


def _offsets(model: RigModel, estimate: Estimate) -> Iterator[Shift]:
    """Yield zeros and scales of outputs and travel, of any size."""
    rig, percent = model.rig, Unit("%", 0.01, float)
    values = rig.of(model.values(estimate.u))
    for goal in rig.goals:
        rows = rig.rows(goal) * rig.weights
        yield Shift(f"{goal.output} zero", rows, goal.unit)
        if (rows * values).any():
            yield Shift(f"{goal.output} scale", rows * values, percent)
    if (slopes := model.by_travel(estimate.u)) is not None:
        along = -slopes * rig.weights
        travel = np.array([rig.case.sweep.change[k] for _, k in rig.places])
        yield Shift("travel zero", along, travel_of(rig.case)[1])
        yield Shift("travel scale", along * travel, percent)


def _samples(rig: Rig) -> Iterator[Shift]:
    """Yield each number as a shift of its own."""
    _, unit = travel_of(rig.case)
    for k, (goal, at) in enumerate(rig.places):
        where = f"{rig.case.sweep.values[at] / unit.size:.4g} {unit.name}"
        direction = np.zeros(rig.count)
        direction[k] = rig.weights[k]
        name = f"{goal.output} at {where}"
        yield Shift(name, direction, goal.unit)


def _sized(shift: Shift, estimate: Estimate) -> Shift:
    size, deviation = estimate.shift(shift.direction)
    chance = erfc(abs(size / deviation) * 0.5**0.5)
    return replace(shift, size=size, deviation=deviation, chance=chance)


def _alone(shift: Shift, k: int, every: Sequence[Shift], estimate: Estimate) -> Shift:
    """Return a shift with its size beside the others."""
    free = np.delete(estimate.free, k, axis=1)
    size, deviation = replace(estimate, free=free).shift(every[k].direction)
    return replace(shift, size=size, deviation=deviation)


def _named(names: Sequence[str], known: Sequence[Shift]) -> list[Shift]:
    found = {each.name: each for each in known}
    for name in names:
        if name not in found:
            raise KincheckError(f"--free {name!r}: {unknown('offset', name, found)}")
    return [found[name] for name in names]


def _slips(model: RigModel, estimate: Estimate) -> Iterator[Slip]:
    """Yield the slips of the rig's file with a fit, the likeliest first; beside data
    with a fit, those as good.
    """
    rig = model.rig
    box = model.boxes
    slips = dict[str, Rig]()
    for goal in rig.goals:
        slips[f"{goal.output} negated"] = rig.times({goal.output: -1.0})
        others = _LENGTHS if goal.unit.name in ANGLES else _ANGLES
        for name, factor in FACTORS.items():
            if any(each in name for each in others):
                continue
            slips[f"{goal.output} times {name}"] = rig.times({goal.output: factor})
    for one, other in pairs(rig.goals, 2):
        if one.unit.name == other.unit.name and one.at.tolist() == other.at.tolist():
            middle = {one.output: other.middle, other.output: one.middle}
            goals = [replace(g, middle=middle.get(g.output, g.middle)) for g in rig.goals]
            slips[f"{one.output} and {other.output} exchanged"] = replace(rig, goals=goals)
    if rig.back is not rig.case:
        slips["travel negated"] = replace(rig, case=rig.back)
    fits = list[tuple[float, Slip]]()
    for name, slipped in slips.items():
        changed = slipped.model(box)
        near = changed(estimate.u)
        if near is None:
            continue
        off, slopes = near
        free = estimate.free * (slipped.weights / rig.weights)[:, None]
        if _linear_misfit(replace(estimate, off=off, slopes=slopes)) > _HOPELESS * rig.count:
            continue
        # a study of rates takes a hundred times as long as a design, so the slopes do
        linear = partial(_linear, estimate.u, off, slopes) if rig.move is PERCENT else changed
        found = most_likely(linear, np.zeros(len(box)), free)
        if found is not None and found.probability >= ALPHA:
            largest = float(np.abs(found.u).max())
            fits.append((found.evidence, Slip(name, found.probability, largest)))
    fits.sort(key=lambda each: each[0])
    best = min([each for each, _ in fits], default=np.inf)
    if estimate.probability >= ALPHA:
        best = estimate.evidence
    for each, slip in fits:
        if " times " not in slip.name or each <= best + LESS:
            yield slip


def _linear(at: Array, off: Array, slopes: Array, u: Array) -> tuple[Array, Array]:
    return off + slopes @ (u - at), slopes


def _linear_misfit(estimate: Estimate) -> float:
    system = np.vstack([estimate.slopes, np.eye(len(estimate.u))])
    right = np.concatenate([estimate.slopes @ estimate.u - estimate.off, np.zeros(len(estimate.u))])
    left = system @ np.linalg.lstsq(system, right)[0] - right
    return float(left @ left)


def predictions(model: RigModel, estimate: Estimate) -> dict[str, Prediction]:
    """Return the outputs without a column, by rig and drawing, by name."""
    told = dict[str, Prediction]()
    for name, values, slopes in model.predicted(estimate.u):
        spread = np.sqrt(np.einsum("si,ij,sj->s", slopes, estimate.covariance, slopes))
        drawn = np.linalg.norm(slopes, axis=1)
        if np.nanmax(drawn, initial=0.0) > ZERO:
            told[name] = Prediction(values, spread, drawn)
    return told
