"""Follow the sides of a route sample by sample, with parts of the steps that fail.

A failed step is first tried in equal parts, which the executor follows by itself, then in parts
that are found one by one. The motion ends where no part of a step succeeds.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...program import MARGIN, Side
from ...trajectory import Array
from ..compiled.request import FROM, LARGEST_SIGMA, SIGMA, TIME
from ..compiled.samples import AS_THEY_ARE, Route
from .failure_reasons import why_refused
from .step_halving import AT_ONCE, LONGER, MOST_PARTS, TOO_MANY, part_of_step

# A step that fails is gone in so many equal parts, or in more where that fails: each takes a tenth
# of a microsecond, and a hundred where it is looked for by itself. They are kept ready for sweeps
# of up to so many parts: longer ones are seldom coarse.
FINER, ROOM = (8, 64, 512, 4096), 8192
# So many steps are gone in parts before the next is tried whole; twice as many where that fails
# each time.
FEW = 4


class March(NamedTuple):
    """What a march found, sample by sample in the order given.

    Attributes:
        kept: the kept rows of every sample (`Model.rows`), shape (kept, n); NaN where it was not
            reached.
        worst: see `Track`: the largest residuals of kept and redundant rows, and the smallest
            estimate of sigma.
        solved: shape (n,).
        ends: one for each side that ended before its last sample.
        visited: by sample, all slots of a lane that stands there and goes on from it; those asked
            for.
    """

    kept: Array
    worst: Sequence[float]
    solved: NDArray[np.bool_]
    ends: tuple[End, ...]
    visited: Mapping[int, Array] = MappingProxyType({})

    @property
    def messages(self) -> tuple[str, ...]:
        """Why samples are missing."""
        return tuple(end.message for end in self.ends)


@dataclass(frozen=True, eq=False)
class End:
    """Where a side ended before its last sample.

    Attributes:
        message: where, and why.
        route: on which: the one asked for, or the straight way to its start.
        lane: all slots of the last pose that was reached.
        wanted: time of the sample that was not.
        early: see `march`: no part of the step was tried.
        divided: the step was too long to be gone in parts, and nothing else is known to be wrong.
    """

    message: str
    route: Route
    lane: Array
    wanted: float
    early: bool = False
    divided: bool = False


def _columns(side: Side, at: int, stop: int) -> NDArray[np.intp]:
    """Of samples of a side among all that are kept."""
    return side.first + side.step * np.arange(at, stop)


class Grid:
    """The samples of a route, bound to lanes of this thread, or as many more as make equal parts of
    the steps between them.

    Attributes:
        parts: how many.
        ends: the route's samples by time among those.
        sides, track: see `Side` and `Track`.
    """

    def __init__(self, route: Route, departure: Array, parts: int) -> None:
        self.parts, self.ends = parts, route.ends(parts)
        self.sides = route.sides if parts == 1 else route.divided(parts)
        self.track = route.model.executor(route.lanes).track(
            self.sides, departure[route.model.ahead], parts * len(self.ends)
        )

    @cached_property
    def kept(self) -> Array:
        """What is kept of all its samples, again and again in the same memory."""
        return self.track.begin()


class Marcher:
    """A route bound to lanes of this thread, to be gone along again and again."""

    def __init__(self, route: Route, departure: Array, tolerances: Mapping[str, float]) -> None:
        self.route, self.model, self.slots = route, route.model, route.model.slots
        self.departure, self.crossing = departure.copy(), tolerances["crossing"] > 0.0
        for name, value in tolerances.items():
            self.departure[self.slots[name]] = value
        self.every = np.ones(len(route.path.times), dtype=np.bool_)
        self.grid = Grid(route, self.departure, 1)
        self.track = self.grid.track
        self.counts = [side.count for side in self.grid.sides]
        self._finer: list[Grid] = []
        self.sigmas = [
            self.model.ahead.index(self.slots[FROM + name]) for name in (SIGMA, LARGEST_SIGMA)
        ]

    def finer(self) -> Iterator[Grid]:
        """Grids of parts of the steps; each is made when it is first needed."""
        for k, parts in enumerate(parts for parts in FINER if parts * len(self.every) <= ROOM):
            if k == len(self._finer):
                self._finer.append(Grid(self.route, self.departure, parts))
            yield self._finer[k]

    def run(self, visit: Collection[int] = (), low: float = 0.0) -> March:
        """See `march`."""
        if self.model.geometry:  # the lanes know their variant
            self.route.model.executor(self.route.lanes).put(
                range(len(self.departure)), self.departure[:, None]
            )
        self.kept, self.solved = self.track.begin(), self.every.copy()
        self.visit, self.visited = visit, dict[int, Array]()
        self.low = low if self.model.selection.dropped else 0.0
        reached = [0] * len(self.counts) if visit else self.track.run()
        ends: list[End] = []
        if reached != self.counts:
            ends = [
                end for side, at in enumerate(reached) if (end := self._side(side, at)) is not None
            ]
        kept, solved, back = self.kept, self.solved, self.route.back
        del self.kept, self.solved  # they are whose they are given to
        if back is not AS_THEY_ARE:
            kept, solved = kept[:, back], solved[back]
        return March(kept, self.track.worst.tolist(), solved, tuple(ends), self.visited)

    def _side(self, number: int, at: int) -> End | None:
        """Follow one side, which came so far, to its last sample; None, or where and why it ends
        before.
        """
        side, anew = self.grid.sides[number], True
        for stop in self._stops(side) if self.visit else [side.count]:
            if self.visit:
                at, anew = self.track.follow(number, at, stop, anew=anew), False
            few, divided, length = FEW, 0, math.inf
            while at < stop:
                came, early = at, self._early(number)
                if not early and not divided:
                    at, few = self._in_parts(number, at, min(at + few, stop)), 2 * few
                if at == came:
                    anchor, wanted = self._anchor(number), float(side.samples[0, at])
                    further = (
                        ""
                        if early
                        else (
                            TOO_MANY
                            if divided == MOST_PARTS
                            else self._divide(anchor, wanted, length)
                        )
                    )
                    if isinstance(further, str):
                        columns = _columns(side, at, side.count)
                        self.kept[:, columns], self.solved[columns] = np.nan, False
                        said = self._end(side, at, anchor, further)
                        return End(
                            said, self.route, anchor, wanted, early, divided=further is TOO_MANY
                        )
                    self.track.anchors[number] = further[self.model.ahead]
                    divided, length = (
                        divided + 1,
                        LONGER * abs(self._stands(further) - self._stands(anchor)),
                    )
                beyond, at = at, self.track.follow(number, at, stop, anew=False)
                few = FEW if at - beyond > few else few
                divided, length = (0, math.inf) if at > came else (divided, length)
            if self.visit:
                self._stand(number, at)
        return None

    def _early(self, number: int) -> bool:
        """Whether to leave off where a side stands; see `march`."""
        sigma, largest = self.track.anchors[number, self.sigmas]
        return self.crossing or bool(sigma < self.low * largest)

    def _in_parts(self, number: int, at: int, stop: int) -> int:
        """Go on in equal parts of steps, and in more to the end of one that fails; how many samples
        have passed then.
        """
        anchors, passed, before = self.track.anchors, at, 1
        for grid in self.finer():
            kept, parts = grid.kept, grid.parts
            grid.track.anchors[number] = anchors[number]
            passed = grid.track.follow(number, passed * (parts // before), stop * parts, anew=False)
            anchors[number] = grid.track.anchors[number]
            came, at, before = at, passed // parts, parts
            if at > came:
                columns = _columns(self.grid.sides[number], came, at)
                self.kept[:, columns] = kept[:, grid.ends[columns]]
                self._worsen(columns)
            if at == stop:
                break
            stop = at + 1
        return at

    def _worsen(self, columns: NDArray[np.intp]) -> None:
        """Take account of samples that a finer grid reached."""
        plan, worst = self.model.plan, self.track.worst
        for k, slot in enumerate([*plan.largest, *plan.smallest]):
            if slot in plan.kept:
                values = self.kept[plan.kept.index(slot), columns]
                worst[k] = (
                    max(worst[k], values.max())
                    if k < len(plan.largest)
                    else min(worst[k], values.min())
                )

    def _anchor(self, number: int) -> Array:
        """All slots of a lane where the motion stands on a side."""
        found = self.departure.copy()
        found[self.model.ahead] = self.track.anchors[number]
        return found

    def _stands(self, lane: Array) -> float:
        """The time at which a lane stands."""
        return float(lane[self.slots[FROM + TIME]])

    def _stops(self, side: Side) -> list[int]:
        """How many samples of a side have passed where one to visit has."""
        place = np.argsort(self.route.by_time)
        passed = {int((place[k] - side.first) * side.step) + 1 for k in self.visit}
        return sorted(count for count in passed if 1 <= count <= side.count)

    def _stand(self, number: int, passed: int) -> None:
        side = self.route.sides[number]
        sample = int(self.route.by_time[side.first + side.step * (passed - 1)])
        if sample in self.visit:
            self.visited[sample] = self._anchor(number)

    def _divide(self, anchor: Array, aim: float, length: float) -> Array | str:
        """Go a part of a step, no longer than a length: the lane there, or why the shortest is
        refused.
        """
        parts, every = self.model.executor(AT_ONCE), range(len(self.slots))

        def attempt(times: Array) -> Array:
            parts.put(every, anchor[:, None])
            parts.put(self.model.sampled, self.route.sampled(times))
            parts.attempt()
            return parts.get([self.slots[MARGIN]])[0]

        part = part_of_step(self._stands(anchor), aim, attempt, AT_ONCE, length)
        lanes = parts.get(every)
        if part is None:
            return why_refused(
                self.model, lanes[:, np.flatnonzero(~(lanes[self.slots[MARGIN]] > 0.0))[-1]]
            )
        return self.model.departing(lanes[:, part[0]], lanes[self.model.sampled, part[0]])

    def _end(self, side: Side, at: int, anchor: Array, reason: str) -> str:
        sigma, last = (
            float(anchor[self.slots[FROM + SIGMA]]),
            float(side.samples[0, at - 1]) if at else None,
        )
        if reason is not TOO_MANY:
            reason += (
                f"; smallest singular value there about {sigma:.3g} (zero at a lock-up or dead"
                " centre)"
            )
        return self.route.path.ended(self._stands(anchor), float(side.samples[0, at]), last, reason)
