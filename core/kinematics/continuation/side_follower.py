"""Follow the sides of a route sample by sample, with parts of the steps that fail.

A failed step is first tried in equal parts, followed by the executor alone, then in parts found one
by one. The motion ends if no part of a step succeeds.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...failures import FailureKind, PoseFailure
from ...program import MARGIN, Side
from ...trajectory import Array
from ..compiled.request import FROM, LARGEST_SIGMA, SIGMA, TIME
from ..compiled.samples import AS_THEY_ARE, Route
from .failure_reasons import pose_failure
from .step_halving import AT_ONCE, LONGER, Walk, part_of_step

# Equal parts of a step that fails. One takes a tenth of a microsecond, a part that is looked for by
# itself a hundred. Grids of up to ROOM parts are kept: longer sweeps are seldom coarse.
FINER, ROOM = (8, 64, 512, 4096), 8192
# Steps in equal parts before the next is tried whole; twice as many after each failure.
FEW = 4


class March(NamedTuple):
    """Results of a march by sample, in the given order.

    Attributes:
        kept: the kept rows of every sample (`Model.rows`), shape (kept, n); NaN if not reached.
        worst: see `Track`: the largest residuals of kept and redundant rows, and the smallest
            estimate of sigma.
        solved: shape (n,).
        ends: one for each side not followed to its last sample.
        visited: by requested sample, all slots of a lane there, ready to continue.
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

    @property
    def failures(self) -> tuple[FailureKind, ...]:
        """The kinds of these failures."""
        return tuple(end.failure for end in self.ends)


@dataclass(frozen=True, eq=False)
class End:
    """The end of a side before its last sample.

    Attributes:
        message: place and reason.
        route: the given one, or the straight way to its start.
        lane: all slots of the last pose.
        wanted: time of the sample out of reach [s].
        failure: the reason; `LEFT_OFF` if no part of the step was tried, see `march`.
    """

    message: str
    route: Route
    lane: Array
    wanted: float
    failure: FailureKind


def _columns(side: Side, at: int, stop: int) -> NDArray[np.intp]:
    """Return the columns of samples of a side among all samples."""
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
        """The table of all samples, in memory used again by the next run."""
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
        self.visit = visit
        self.visited: dict[int, Array] = {}
        self.low = low if self.model.selection.dropped else 0.0
        reached = [0] * len(self.counts) if visit else self.track.run()
        ends: tuple[End, ...] = ()
        if reached != self.counts:
            found = (self._side(side, at) for side, at in enumerate(reached))
            ends = tuple(end for end in found if end is not None)
        kept, solved, back = self.kept, self.solved, self.route.back
        del self.kept, self.solved  # they are whose they are given to
        if back is not AS_THEY_ARE:
            kept, solved = kept[:, back], solved[back]
        return March(kept, self.track.worst.tolist(), solved, ends, self.visited)

    def _side(self, number: int, at: int) -> End | None:
        """Follow one side, after `at` samples, to its last sample; return its end if it ends
        before.
        """
        side, anew = self.grid.sides[number], True
        for stop in self._stops(side) if self.visit else [side.count]:
            if self.visit:
                at, anew = self.track.follow(number, at, stop, anew=anew), False
            walk = SideWalk(self, number)
            at, failure = walk.advance(at, stop)
            if failure is not None:
                columns = _columns(side, at, side.count)
                self.kept[:, columns], self.solved[columns] = np.nan, False
                return self._end(side, at, self.anchor(number), failure)
            if self.visit:
                self._stand(number, at)
        return None

    def worsen(self, columns: NDArray[np.intp]) -> None:
        """Add the tests of samples reached on a finer grid."""
        plan, worst = self.model.plan, self.track.worst
        for k, slot in enumerate([*plan.largest, *plan.smallest]):
            if slot in plan.kept:
                values = self.kept[plan.kept.index(slot), columns]
                worst[k] = (
                    max(worst[k], values.max())
                    if k < len(plan.largest)
                    else min(worst[k], values.min())
                )

    def anchor(self, number: int) -> Array:
        """All slots of the last lane on a side."""
        found = self.departure.copy()
        found[self.model.ahead] = self.track.anchors[number]
        return found

    def time_of(self, lane: Array) -> float:
        """The time at which a lane stands."""
        return float(lane[self.slots[FROM + TIME]])

    def _stops(self, side: Side) -> list[int]:
        """Return the number of samples of a side up to each one to visit."""
        place = np.argsort(self.route.by_time)
        passed = {int((place[k] - side.first) * side.step) + 1 for k in self.visit}
        return sorted(count for count in passed if 1 <= count <= side.count)

    def _stand(self, number: int, passed: int) -> None:
        side = self.route.sides[number]
        sample = int(self.route.by_time[side.first + side.step * (passed - 1)])
        if sample in self.visit:
            self.visited[sample] = self.anchor(number)

    def _end(self, side: Side, at: int, anchor: Array, failure: PoseFailure) -> End:
        if failure.kind is not FailureKind.TOO_MANY_PARTS:
            failure = replace(failure, sigma=float(anchor[self.slots[FROM + SIGMA]]))
        last, wanted = float(side.samples[0, at - 1]) if at else None, float(side.samples[0, at])
        message = self.route.path.ended(self.time_of(anchor), wanted, last, str(failure))
        return End(message, self.route, anchor, wanted, failure.kind)


class SideWalk(Walk):
    """The walk along one side of a marcher, after a failed step."""

    def __init__(self, marcher: Marcher, number: int) -> None:
        self.marcher, self.number, self.track = marcher, number, marcher.track
        self.model, self.route, self.side = marcher.model, marcher.route, marcher.grid.sides[number]
        self.few, self.length, self.leaves_off = FEW, math.inf, False

    def follow(self, at: int, stop: int, parts: int) -> int:
        """Follow samples in equal parts of their steps, then whole.

        The rest of a step is tried whole: in equal parts the step has failed.
        """
        passed = at
        if not parts:
            self.leaves_off = self._leaves_off()
            if not self.leaves_off:
                passed, self.few = self._in_parts(at, min(at + self.few, stop)), 2 * self.few
            if passed == at:
                return at
        beyond = passed
        passed = self.track.follow(self.number, passed, stop, anew=False)
        self.few = FEW if passed - beyond > self.few else self.few
        if passed > at:
            self.length = math.inf
        else:
            self.leaves_off = self._leaves_off()
        return passed

    def follow_part(self, at: int) -> PoseFailure | None:
        """Follow a part of a step, up to `LONGER` times as long as the one before."""
        if self.leaves_off:
            return PoseFailure(FailureKind.LEFT_OFF)
        anchor, time_of = self.marcher.anchor(self.number), self.marcher.time_of
        found = self._divided(anchor, float(self.side.samples[0, at]))
        if isinstance(found, PoseFailure):
            return found
        self.track.anchors[self.number] = found[self.model.ahead]
        self.length = LONGER * abs(time_of(found) - time_of(anchor))
        return None

    def _leaves_off(self) -> bool:
        """Return whether no part of the step is tried; see `march`."""
        sigma, largest = self.track.anchors[self.number, self.marcher.sigmas]
        return self.marcher.crossing or bool(sigma < self.marcher.low * largest)

    def _in_parts(self, at: int, stop: int) -> int:
        """Follow samples in equal parts of their steps, and a failed step in more; return the
        number passed.
        """
        anchors, number = self.track.anchors, self.number
        passed, before = at, 1
        for grid in self.marcher.finer():
            kept, parts = grid.kept, grid.parts
            grid.track.anchors[number] = anchors[number]
            passed = grid.track.follow(number, passed * (parts // before), stop * parts, anew=False)
            anchors[number] = grid.track.anchors[number]
            came, at, before = at, passed // parts, parts
            if at > came:
                columns = _columns(self.side, came, at)
                self.marcher.kept[:, columns] = kept[:, grid.ends[columns]]
                self.marcher.worsen(columns)
            if at == stop:
                break
            stop = at + 1
        return at

    def _divided(self, anchor: Array, aim: float) -> Array | PoseFailure:
        """Return a lane after a part of the step, or the failure of the shortest part."""
        parts, every = self.model.executor(AT_ONCE), range(len(self.model.slots))
        margin = self.model.slots[MARGIN]

        def attempt(times: Array) -> Array:
            parts.put(every, anchor[:, None])
            parts.put(self.model.sampled, self.route.sampled(times))
            parts.attempt()
            return parts.get([margin])[0]

        part = part_of_step(self.marcher.time_of(anchor), aim, attempt, AT_ONCE, self.length)
        lanes = parts.get(every)
        if part is None:
            refused = np.flatnonzero(~(lanes[margin] > 0.0))[-1]
            return pose_failure(self.model, lanes[:, refused])
        return self.model.departing(lanes[:, part[0]], lanes[self.model.sampled, part[0]])
