"""The search of `kincheck tune`: its bands, its starts, and what they found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ...case.case import Case
from ...errors import KincheckError
from ...report.axis import number
from ...trajectory import Array
from ..hardpoints.suspension.base import Change
from ..hardpoints.suspension.wheel import Twist
from .goals import Box, Goal, times, travel_of
from .least_move import HELD, LeastMove, least_move
from .rods import assembles
from .search import Clear, Search

TIGHT = 1e-5
"""A sample this close to an edge of its band, over the half-width, is tight."""
SAME_NORM, SAME_EXCESS = 1e-6, 1e-3


@dataclass(frozen=True, eq=False)
class Band:
    """A goal before and after.

    Attributes:
        travel: driver values of all samples, shape (n,).
        before, after: values there [SI], shape (n,).
        multiplier: by how much the norm falls, for each unit by which the band becomes wider [SI].
    """

    goal: Goal
    travel: Array
    before: Array
    after: Array
    multiplier: float

    @property
    def at(self) -> Array:
        """Driver values at the samples of the goal."""
        return self.travel[self.goal.at]

    @property
    def beyond(self) -> Array:
        """Distance beyond the band over its half-width at these; not positive within it."""
        return np.abs(self.after[self.goal.at] - self.goal.middle) / self.goal.tolerance - 1.0

    @property
    def ranges(self) -> list[tuple[float, float]]:
        """Smallest and largest value at these, before and after."""
        both = (each[self.goal.at] for each in (self.before, self.after))
        return [(float(each.min()), float(each.max())) for each in both]

    @property
    def excess(self) -> float:
        """The largest distance beyond the band, over its half-width."""
        return float(self.beyond.max())

    @property
    def held(self) -> bool:
        """Whether all its samples are in the band."""
        return self.excess <= HELD

    @property
    def tight(self) -> list[float]:
        """Driver values at which it is tight."""
        return self.at[self.beyond >= -TIGHT].tolist()


@dataclass(frozen=True, eq=False, repr=False)
class Tuned:
    """The answer.

    Attributes:
        moves, boxes: by place, moves in m, along the axes of the table.
        forbidding: texts of the goals and boxes that the nearest miss exceeds most; empty if all
            bands are held.
        proved: whether nothing can hold all bands, since two of them have no value in common.
        rounds: of linearisation, over all starts; designs: number of those solved.
        ends: the norm at the end of each start, None for one beyond the target.
        notes: on the files of the goals.
    """

    case: Case
    move: LeastMove
    moves: Mapping[str, float]
    boxes: Mapping[str, Box]
    bands: Sequence[Band]
    forbidding: Sequence[str]
    proved: bool
    rounds: int
    designs: int
    ends: Sequence[float | None]
    notes: Sequence[str] = ()

    def __repr__(self) -> str:
        how = "reached" if self.reached else "not reached"
        return f"<Tuned: {self.case.name}, {how}, norm {self.move.norm:.6g}>"

    @property
    def reached(self) -> bool:
        """Whether all bands are held."""
        return self.move.held

    @property
    def search(self) -> str:
        """What the answer rests on."""
        return "proved" if self.proved else "local"

    @property
    def same_ends(self) -> int:
        """The number of starts with the same end."""
        if not self.reached:
            return sum(each is None for each in self.ends)
        near = self.move.norm + SAME_NORM * max(1.0, self.move.norm)
        return sum(each is not None and each <= near for each in self.ends)

    def text_at(self, value: float) -> str:
        """Return a driver value as text, in the unit of the table."""
        unit = travel_of(self.case)[1]
        return f"{number(value / unit.size)} {unit.name}"


def tune(
    case: Case,
    goals: Sequence[Goal],
    boxes: Mapping[str, Box],
    starts: int,
    clear: Sequence[Clear] = (),
    notes: Sequence[str] = (),
) -> Tuned:
    """Return the least move to hold all bands, or the nearest miss.

    Args:
        case: with the samples of the goals.
        boxes: by place to move.
        starts: number of starts of the search.
        clear: boxes that no point of the table may be in.

    Raises:
        KincheckError: the table does not reach its travel, or a goal has no value there.
    """
    if assembles(boxes):
        _require_absolute(case, goals)
    sizes = {place: each.size for place, each in boxes.items()}
    search = Search(case, goals, sizes, clear)
    low = np.array([each.low for each in boxes.values()]) / search.box
    high = np.array([each.high for each in boxes.values()]) / search.box
    before = search.values(np.zeros(len(boxes)))
    random = np.random.default_rng(0)  # the same answer each time
    others = random.uniform(low, high, (starts - 1, len(boxes)))
    found = [
        end
        for start in (np.zeros(len(boxes)), *others)
        if (end := least_move(search, start, low, high)) is not None
    ]
    best = min(found, key=lambda each: each.order)
    after = search.values(best.moves)
    worth = np.split(best.multipliers, np.cumsum([len(each.at) for each in goals]))
    bands = [
        Band(
            *(goal, case.sweep.values, before[goal.output], after[goal.output]),
            float(own.sum()) / goal.tolerance,
        )
        for goal, own in zip(goals, worth, strict=False)
    ]
    worst = best.numbers >= (1.0 + best.excess) * (1.0 - SAME_EXCESS)
    pairs = combinations(goals, 2)
    return Tuned(
        *(case, best),
        times(sizes, best.moves),
        *(boxes, bands),
        [*dict.fromkeys(np.array(search.parts)[worst].tolist())] if not best.held else [],
        not best.held and any(_disjoint(*pair) for pair in pairs),
        *(sum(each.rounds for each in found), search.designs),
        [each.norm if each.held else None for each in found],
        notes,
    )


def _require_absolute(case: Case, goals: Sequence[Goal]) -> None:
    from_design = {
        each.name
        for each in case.outputs
        if isinstance(each, (Change, Twist)) or getattr(each, "relative", False)
    }
    for each in goals:
        if each.output in from_design:
            raise KincheckError(
                f"goal {each.text!r}: {each.output} counts from design, which the lengths of rods"
                " and shims move; leave the goal out, or move points alone"
            )


def _disjoint(one: Goal, other: Goal) -> bool:
    """Return whether two bands of an output have no value in common at a sample."""
    _, mine, its = np.intersect1d(one.at, other.at, return_indices=True)
    apart = np.abs(one.middle[mine] - other.middle[its]) > one.tolerance + other.tolerance
    return one.output == other.output and bool(apart.any())
