"""The search of `kincheck tune`: its curves, its bands, its starts, and the check of its answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...case.case import Case
from ...case.units import Unit
from ...cli.registry import Registry
from ...errors import KincheckError
from ...report.axis import number
from ...report.sections import Report
from ...trajectory import Array
from ..compare.designs import comparison, designs_of
from ..hardpoints.options import WheelOptions
from ..hardpoints.reader import read_hardpoints
from ..hardpoints.table import HardpointTable, unit_of
from ..sweep.curves import curves
from .goals import Goal, read_goals, read_moves
from .least_move import HELD, LeastMove, least_move
from .new_table import case_of_points, check, moved_points

TIGHT = 1e-5
"""A sample this close to an edge of its band, over the half-width, is tight."""
SAME_NORM = 1e-6


@dataclass(frozen=True, eq=False)
class Band:
    """A goal and what becomes of it [SI].

    Attributes:
        before, after: smallest and largest value at its samples.
        excess: beyond the band, over its half-width; not positive if it is held.
        tight: driver values at which it is tight.
        worst: driver value nearest to an edge, or farthest beyond.
        multiplier: what the norm falls by, for each unit by which the band becomes wider.
    """

    goal: Goal
    before: tuple[float, float]
    after: tuple[float, float]
    excess: float
    tight: list[float]
    worst: float
    multiplier: float

    @property
    def held(self) -> bool:
        """Whether all its samples are in the band."""
        return self.excess <= HELD

    @property
    def unit(self) -> str:
        """The unit of the goal."""
        return self.goal.unit[0]

    @property
    def size_of_unit(self) -> float:
        """The size of the unit [SI]."""
        return self.goal.unit[1]

    @property
    def size(self) -> float:
        """The half-width in the unit of the goal."""
        return self.goal.tolerance / self.goal.unit[1]


@dataclass(frozen=True, eq=False)
class Tuned:
    """The answer.

    Attributes:
        moves, boxes: by place [m], along the axes of the table.
        rounds: of linearisation, over all starts; designs: that were solved.
        ends: the norm that each start ends with, None where it does not reach the target.
        checked: the engine that solved the answer again; None without one.
        table, points: the table as read, and its new points in its own units.
        comparison: old against new; None if the target is not reached.
        length: unit of the table.
    """

    case: Case
    move: LeastMove
    moves: Mapping[str, float]
    boxes: Mapping[str, float]
    bands: Sequence[Band]
    rounds: int
    designs: int
    ends: Sequence[float | None]
    checked: str | None
    notes: Sequence[str]
    table: HardpointTable
    points: Sequence[tuple[float, float, float]]
    comparison: Report | None
    length: Unit

    @property
    def reached(self) -> bool:
        """Whether all bands are held."""
        return self.move.held

    @property
    def same_ends(self) -> int:
        """The number of starts with the same end."""
        if not self.reached:
            return sum(each is None for each in self.ends)
        near = self.move.norm + SAME_NORM * max(1.0, self.move.norm)
        return sum(each is not None and each <= near for each in self.ends)

    def at(self, value: float) -> str:
        """Return a driver value as text, in the unit of the table."""
        turns = self.case.mechanism.driver(self.case.sweep.driver).turns
        size, unit = (np.pi / 180.0, "deg") if turns else (self.length.size, self.length.name)
        return f"{number(value / size)} {unit}"


class Search:
    """The outputs of a case over their bands, by the moves over their boxes."""

    def __init__(self, case: Case, goals: Sequence[Goal], boxes: Mapping[str, float]) -> None:
        self.case, self.goals, self.boxes = case, goals, boxes
        self.places = [*boxes]
        self.box = np.array([*boxes.values()])
        self.names = [*dict.fromkeys(each.output for each in goals)]
        self.designs = 0

    def __call__(self, u: Array) -> tuple[Array, Array] | None:
        """Return numbers and slopes as `least_move` asks for them."""
        self.designs += 1
        found = curves(self.case, self.places, (u * self.box)[None], self.names, self.names)
        g = np.concatenate(
            [(found.values[x.output][0, x.at] - x.middle) / x.tolerance for x in self.goals]
        )
        by = [found.slopes[x.output][0, x.at] * self.box / x.tolerance for x in self.goals]
        slopes = np.concatenate(by)
        usable = found.solved.all() and np.isfinite(g).all() and np.isfinite(slopes).all()
        return (g, slopes) if usable else None

    def values(self, u: Array, remedy: str = "give a smaller --travel") -> dict[str, Array]:
        """Return the outputs of a design, shape (n,) each.

        Raises:
            KincheckError: a sample is not reached, or a goal's output has no value there.
        """
        found = curves(self.case, self.places, (u * self.box)[None], self.names)
        if not found.solved.all():
            raise KincheckError(
                f"{self.case.name}: the table does not reach its whole travel"
                f" ({found.messages.get(0, 'no reason given')}); {remedy}"
            )
        for each in self.goals:
            if not np.isfinite(found.values[each.output][0, each.at]).all():
                reason = found.reasons.get(each.output, "it is not defined there")
                raise KincheckError(f"goal {each.text!r}: has no value at a sample: {reason}")
        return {name: values[0] for name, values in found.values.items()}


def tune(
    case: Case,
    file: Path,
    supplied: WheelOptions,
    wanted: tuple[Sequence[str], Sequence[str]],
    starts: int,
    registry: Registry,
) -> Tuned:
    """Return the least move that holds all bands, or the nearest miss.

    Args:
        file: the table of the case, read with `supplied`.
        wanted: texts of the goals, and of the moves.
        starts: number of starts of the search.

    Raises:
        KincheckError: a goal or move makes no sense, the table does not reach its travel, or
            another engine contradicts the answer.
    """
    of_goals, of_moves = wanted
    case, goals, notes = read_goals(of_goals, case, supplied)
    boxes = read_moves(of_moves, case)
    search = Search(case, goals, boxes)
    before = search.values(np.zeros(len(boxes)))
    random = np.random.default_rng(0)  # the same answer each time
    others = random.uniform(-1.0, 1.0, (starts - 1, len(boxes)))
    found = [
        end
        for start in (np.zeros(len(boxes)), *others)
        if (end := least_move(search, start)) is not None
    ]
    best = min(found, key=lambda each: each.order)

    table = read_hardpoints(file, supplied)
    length = unit_of(table, supplied.units)
    moves = dict(zip(boxes, (best.moves * search.box).tolist(), strict=True))
    points = moved_points(table, moves, length)
    after = search.values(best.moves)
    bands = [
        _band(case, goal, before, after, worth)
        for goal, worth in zip(goals, _by_goal(goals, best.multipliers), strict=True)
    ]
    checked, report = None, None
    if best.held:
        new = case_of_points(table, supplied, points, case, file)
        checked, results = check(case, new, registry)
        notes += [] if checked else ["no other engine is installed that can check the new table"]
        report = comparison(designs_of(results, [case, new]), [])
    return Tuned(
        *(case, best, moves, boxes, bands),
        *(sum(each.rounds for each in found), search.designs),
        [each.norm if each.held else None for each in found],
        *(checked, notes, table, points, report, length),
    )


def _by_goal(goals: Sequence[Goal], multipliers: Array) -> list[float]:
    ends = np.cumsum([len(each.at) for each in goals])[:-1]
    return [float(each.sum()) for each in np.split(multipliers, ends)]


def _band(
    case: Case, goal: Goal, before: Mapping[str, Array], after: Mapping[str, Array], worth: float
) -> Band:
    old, new = (each[goal.output][goal.at] for each in (before, after))
    off = np.abs(new - goal.middle) / goal.tolerance - 1.0
    values = case.sweep.values[goal.at]
    return Band(
        goal,
        (float(old.min()), float(old.max())),
        (float(new.min()), float(new.max())),
        float(off.max()),
        values[off >= -TIGHT].tolist(),
        float(values[off.argmax()]),
        worth / goal.tolerance,
    )
