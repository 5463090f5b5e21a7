"""March from the design position outwards, along the samples of a path on both sides of it.

The executor follows each side while the samples continue the motion. A failed step is divided, so a
coarse grid costs steps: into equal parts, followed by the executor alone, or else into parts found
one by one. If no part of a step succeeds the motion ends, and a message gives the place and the
reason.

The solvers by components and by a sparse system share the `Walk` with parts of failed steps.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...failures import MOST_PARTS, FailureKind, PoseFailure
from ...program import MARGIN, Side
from ...trajectory import Array
from ..compiled.compiled_model import Model
from ..compiled.request import (
    FROM,
    LARGEST_SIGMA,
    ORIENTATION,
    SIGMA,
    SLOPE,
    TIME,
    accept_by,
    by_block,
    remembered_tests,
)
from ..compiled.routes import AS_THEY_ARE, Route
from ..compiled.step_programs import candidate, limits
from ..formulation.acceptance_criteria import (
    ROUNDING,
    Block,
    known_slope,
    margins,
)
from ..formulation.state_vectors import turns

# A failing step is tried at its halves, quarters, ... down to this many halvings, and so many at
# once: to 1e-12 of it, for a crank that passes within 1e-9 of its length beside a pivot turns its
# rocker by half a turn over such a part of a sweep.
HALVINGS, AT_ONCE = 40, 8
# The next part is looked for among those up to so many times as long as the last: towards a limit
# they get shorter and shorter.
LONGER = 8.0


class Walk(ABC):
    """A walk over samples in their order, each from the pose before."""

    @abstractmethod
    def follow(self, at: int, stop: int, parts: int) -> int:
        """Follow samples as far as each continues the motion; return the number passed.

        Args:
            at: number passed so far.
            stop: number to pass.
            parts: number of parts taken of the step to the next sample.
        """

    @abstractmethod
    def follow_part(self, at: int) -> PoseFailure | None:
        """Follow a part of the step to the next sample; return the failure if no part succeeds."""

    def advance(self, at: int, stop: int) -> tuple[int, PoseFailure | None]:
        """Follow samples to the last one, or to the first one out of reach.

        A failed step is divided: the longest successful part is followed, and the rest of the step
        is tried again.

        Returns:
            The number of samples passed, and the failure if it is not `stop`.
        """
        parts = 0
        while at < stop:
            passed = self.follow(at, stop, parts)
            if passed > at:
                at, parts = passed, 0
                continue
            if parts == MOST_PARTS:
                return at, PoseFailure(FailureKind.TOO_MANY_PARTS)
            failure = self.follow_part(at)
            if failure is not None:
                return at, failure
            parts += 1
        return at, None


def longest(margins: Array) -> int | None:
    """Return the longest part of a step, of parts each half of the one before, with both it and its
    half accepted; None without one.

    One of many parts may be accepted by chance, at a pose of another assembly; two such parts are
    not halves of each other.
    """
    good = np.flatnonzero((margins[:-1] > 0.0) & (margins[1:] > 0.0))
    return int(good[0]) if len(good) else None


def part_of_step(
    here: float,
    wanted: float,
    attempt: Callable[[Array], Array],
    lanes: int,
    length: float = math.inf,
) -> tuple[int, float] | None:
    """Return a part of a step: the lane that reaches it, and its end time; None without one.

    Args:
        attempt: sends as many lanes to as many times, longest part first; returns their margins.
        length: of the longest part to try [s].
    """
    whole = wanted - here
    start = max(1, math.ceil(math.log2(abs(whole) / length))) if 0.0 < length < abs(whole) else 1
    for first in range(start, HALVINGS, lanes - 1):  # a part counts if its half is reached too
        times: Array = here + whole * 0.5 ** np.arange(float(first), first + lanes)
        part = longest(attempt(times)[: HALVINGS + 1 - first])
        if part is not None:
            return part, float(times[part])
    return None


SINGULAR = ("as regular", "on this side", "regular between", "certain", "not turned by rounding")
"""Criteria that a lane does not meet if a singular pose is ahead."""


def pose_failure(model: Model, lane: Array) -> PoseFailure:
    """Return the failure of a lane, with its numbers.

    Args:
        lane: all its slots.
    """

    def read(name: str) -> float:
        return float(lane[model.slots[name]])

    names = zip(by_block(SIGMA, model.blocks), by_block(SLOPE, model.blocks), strict=True)
    blocks = [
        Block(read(name), read(FROM + name), max(known_slope(read(FROM + label)), read(label)))
        for name, label in names
    ]
    pose = candidate(
        read,
        before=read(FROM + SIGMA),
        reversal=read(ORIENTATION) - read(FROM + ORIENTATION),
        largest=read(LARGEST_SIGMA),
        blocks=blocks,
        turns=turns(model.mechanism, model.request.drivers),
    )
    found = margins(pose, limits(read))
    failed = [name for name, margin in found.items() if not margin > 0.0]
    closure, leftover, branch, tol = (
        read(name) for name in ("closure", "leftover", "branch", "tolerance")
    )
    redundant = model.selection.account.redundant_rows
    return PoseFailure(failure_kind(failed, closure), closure, tol, leftover, branch, redundant)


def failure_kind(failed: Sequence[str], closure: float) -> FailureKind:
    """Return the kind of a failure by the criteria not met.

    Args:
        failed: names of the criteria, see `margins`.
        closure: largest residual of the solved rows [units of the mechanism's size].
    """
    if not np.isfinite(closure):
        return FailureKind.DIVERGED
    if "on the branch" in failed:
        return FailureKind.WRONG_BRANCH
    if "closed" in failed:
        return FailureKind.BELOW_ROUNDING if closure <= ROUNDING else FailureKind.NOT_CONVERGED
    if "consistent" in failed:
        return FailureKind.CONTRADICTORY
    if any(name in failed for name in SINGULAR):
        return FailureKind.SINGULAR_AHEAD
    if failed == ["converged"]:
        return FailureKind.NOT_SETTLED
    if not set(failed) - {"near", "not turned round"}:
        return FailureKind.LONG_STEP
    return FailureKind.OTHER_ASSEMBLY


# Equal parts of a step that fails. One takes a tenth of a microsecond, a part that is looked for by
# itself a hundred. Grids of up to ROOM parts are kept: longer sweeps are seldom coarse.
FINER, ROOM = (8, 64, 512, 4096), 8192
# Steps in equal parts before the next is tried whole; twice as many after each failure.
FEW = 4


class March(NamedTuple):
    """Results of a march by sample, in the given order.

    Attributes:
        kept: the kept rows of every sample (`Model.rows`), shape (kept, n); NaN if not reached.
        worst: see `NumpyTrack`: the largest residuals of kept and redundant rows, and the smallest
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
        failure: the reason; `LEFT_OFF` if no part of the step was tried, see `follow_samples`.
    """

    message: str
    route: Route
    lane: Array
    wanted: float
    failure: FailureKind

    @property
    def time(self) -> float:
        """The time of the last pose [s]."""
        return time_of(self.route.model, self.lane)

    @property
    def sigma(self) -> float:
        """The smallest singular value at the last pose, by the largest there was."""
        slots = self.route.model.slots
        return float(self.lane[slots[FROM + SIGMA]] / self.lane[slots[FROM + LARGEST_SIGMA]])

    def is_regular(self, part: float) -> bool:
        """Return whether `sigma` is above a part, even if all singular values were zero."""
        slots = self.route.model.slots
        return bool(self.lane[slots[FROM + SIGMA]] > part * self.lane[slots[FROM + LARGEST_SIGMA]])


def time_of(model: Model, lane: Array) -> float:
    """Return the time at which a lane stands [s]."""
    return float(lane[model.slots[FROM + TIME]])


def _columns(side: Side, at: int, stop: int) -> NDArray[np.intp]:
    """Return the columns of samples of a side among all samples."""
    return side.first + side.step * np.arange(at, stop)


class Grid:
    """The samples of a route, bound to lanes of this thread, or as many more as make equal parts of
    the steps between them.

    Attributes:
        parts: how many.
        ends: the route's samples by time among those.
        sides, track: see `Side` and `NumpyTrack`.
    """

    def __init__(self, route: Route, departure: Array, parts: int) -> None:
        self.parts, self.ends = parts, route.ends(parts)
        self.sides = route.sides if parts == 1 else route.sides_in_parts(parts)
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
        """See `follow_samples`."""
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
        stops = {side.count: -1}
        if self.visit:  # the samples to visit, by the number of samples up to each
            place = np.argsort(self.route.by_time)
            passed = {int((place[k] - side.first) * side.step) + 1: k for k in self.visit}
            stops = {count: passed[count] for count in sorted(passed) if 1 <= count <= side.count}
        for stop, sample in stops.items():
            if self.visit:
                at, anew = self.track.follow(number, at, stop, anew=anew), False
            walk = SideWalk(self, number)
            at, failure = walk.advance(at, stop)
            if failure is not None:
                columns = _columns(side, at, side.count)
                self.kept[:, columns], self.solved[columns] = np.nan, False
                return self._end(side, at, self.anchor(number), failure)
            if self.visit:
                self.visited[sample] = self.anchor(number)
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

    def _end(self, side: Side, at: int, anchor: Array, failure: PoseFailure) -> End:
        if failure.kind is not FailureKind.TOO_MANY_PARTS:
            failure = replace(failure, sigma=float(anchor[self.slots[FROM + SIGMA]]))
        last, wanted = float(side.samples[0, at - 1]) if at else None, float(side.samples[0, at])
        message = self.route.path.end_message(
            time_of(self.model, anchor), wanted, last, str(failure)
        )
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
        anchor = self.marcher.anchor(self.number)
        found = self._divide_step(anchor, float(self.side.samples[0, at]))
        if isinstance(found, PoseFailure):
            return found
        self.track.anchors[self.number] = found[self.model.ahead]
        self.length = LONGER * abs(time_of(self.model, found) - time_of(self.model, anchor))
        return None

    def _leaves_off(self) -> bool:
        """Return whether no part of the step is tried; see `follow_samples`."""
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

    def _divide_step(self, anchor: Array, aim: float) -> Array | PoseFailure:
        """Return a lane after a part of the step, or the failure of the shortest part."""
        parts, every = self.model.executor(AT_ONCE), range(len(self.model.slots))
        margin = self.model.slots[MARGIN]

        def attempt(times: Array) -> Array:
            parts.put(every, anchor[:, None])
            parts.put(self.model.sampled, self.route.sampled(times))
            parts.attempt()
            return parts.get([margin])[0]

        part = part_of_step(time_of(self.model, anchor), aim, attempt, AT_ONCE, self.length)
        lanes = parts.get(every)
        if part is None:
            refused = np.flatnonzero(~(lanes[margin] > 0.0))[-1]
            return pose_failure(self.model, lanes[:, refused])
        return self.model.prediction_start(lanes[:, part[0]], lanes[self.model.sampled, part[0]])


def follow_samples(
    route: Route,
    tol: float,
    visit: Collection[int] = (),
    *,
    crossing: bool = False,
    low: float = 0.0,
) -> March:
    """Solve a model at the samples of a path, from the design outwards; see `solve` for the
    tolerance.

    Args:
        visit: samples whose lanes are wanted; nothing beyond them is.
        crossing: accept steps across singular poses, as a whole or not at all: parts of them end at
            the pose.
        low: with redundant rows, leave off at a failed step if the smallest singular value is below
            this fraction of its largest value so far: other rows may be better.
    """
    stands = route if route.starts_at_design else route_from_start(route, tol)
    if isinstance(stands, Route):
        return marcher(stands, tol, crossing=crossing).run(visit, low)
    n = len(route.path.times)
    kept = np.full((route.model.kept, n), np.nan)
    return March(kept, route.model.plan.best[:, 0].tolist(), np.zeros(n, np.bool_), (stands,))


def route_from_start(route: Route, tol: float) -> Route | End:
    """Return the route from a lane on its path, or the end of the straight way to there; kept with
    the route.
    """
    return (
        route
        if route.starts_at_design
        else route.thread_cache(("led", tol), lambda: _route_from_start(route, tol))
    )


def _route_from_start(route: Route, tol: float) -> Route | End:
    model, begin = route.model, route.begin
    way = Route(model, begin.lead or route.path.lead_in(begin.time), route.design)
    found = marcher(way, tol, crossing=False).run({0})
    if found.ends:
        return replace(found.ends[0], message=f"on the way to {begin.name}: {found.messages[0]}")
    return Route(model, route.path, lane_at_start(model, found.visited[0]), begin.time)


def marcher(route: Route, tol: float, *, crossing: bool) -> Marcher:
    """Return the marcher of a route from its departure; kept with it, because binding takes as long
    as a run.
    """
    return route.thread_cache(
        (tol, crossing), lambda: Marcher(route, route.departure, accept_by(tol, crossing=crossing))
    )


def lane_at_start(model: Model, lane: Array) -> Array:
    """Return a lane at the start of the given lane's prediction."""
    found = lane.copy()
    for name in model.state:
        found[model.vectors[name]] = lane[model.vectors[FROM + name]]
    for name in remembered_tests(model.blocks):
        found[model.slots[name]] = lane[model.slots[FROM + name]]
    return found
