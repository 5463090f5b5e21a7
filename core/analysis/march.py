"""March from the design position outwards, along the samples of a path on both sides of it.

The executor follows each side as far as sample after sample continues the motion. A step that fails is divided, so a coarse grid
costs steps; where no part of a step succeeds the motion ends, and a message says where and why.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..motions import Path
from ..program import MARGIN
from ..trajectory import Array
from .model import Model
from .refusal import why_refused
from .request import FROM, LARGEST_SIGMA, ORIENTATION, SIGMA, TIME, accept_by

# Lanes of the numpy executor: many share the overhead of a call, and the block of a mechanism of few bodies stays below a megabyte.
LANES = 256
# A failing step is tried at its halves, quarters, ... down to this many halvings, all at once: to 1e-12 of it, for a crank that
# passes within 1e-9 of its length beside a pivot turns its rocker by half a turn over such a part of a sweep.
HALVINGS = 40
# A side that needs more rounds than this without reaching a sample makes no headway.
MAX_ROUNDS = 200


@dataclass(frozen=True, eq=False)
class March:
    """What a march found, sample by sample in the order given.

    Attributes:
        kept: the kept rows of every sample (`Model.rows`), shape (kept, n); NaN where it was not reached.
        last: all slots of where the last side ended.
        solved: shape (n,).
        ends: one for each side that ended before its last sample.
        visited: by sample, all slots of a lane that stands there and goes on from it; those asked for.
    """

    kept: Array
    last: Array
    solved: NDArray[np.bool_]
    ends: tuple[End, ...]
    visited: Mapping[int, Array] = field(default_factory=dict[int, Array])

    @property
    def messages(self) -> tuple[str, ...]:
        """Why samples are missing."""
        return tuple(end.message for end in self.ends)


@dataclass(frozen=True, eq=False)
class End:
    """Where a side ended before its last sample.

    Attributes:
        message: where, and why.
        route: on which: the one asked for, or the way to its first sample.
        lane: all slots of the last pose that was reached.
        wanted: time of the sample that was not.
    """

    message: str
    route: Route
    lane: Array
    wanted: float


@dataclass(frozen=True, eq=False)
class Side:
    """The samples on one side of where a march starts, outwards. first, step: their columns among all samples by time."""

    times: Array
    samples: Array
    first: int
    step: int


@dataclass(frozen=True, eq=False)
class Route:
    """A path made ready for a model: everything about the samples that does not depend on the motion.

    Attributes:
        design: all slots of a lane at the design position of a variant; the model's own unless given.
        since: the time at which that lane stands on the path, where that is not at the design position but on the way.
    """

    model: Model
    path: Path
    design: Array | None = None
    since: float | None = None

    @cached_property
    def from_design(self) -> bool:
        """Whether the lane it starts from stands on the path: at the design position at time zero, or on the way."""
        return self.since is not None or self.path.from_design

    @cached_property
    def start(self) -> float:
        """The time it starts at: where its lane stands, or else the first sample."""
        return self.since or 0.0 if self.from_design else float(self.path.times[0])

    @cached_property
    def order(self) -> NDArray[np.intp]:
        """The samples by time."""
        return np.argsort(self.path.times, kind="stable")

    @cached_property
    def back(self) -> NDArray[np.intp] | slice:
        """From the samples by time to the order wanted."""
        n = len(self.path.times)
        for simple in (slice(None), slice(None, None, -1)):
            if (self.order == np.arange(n)[simple]).all():
                return simple
        return np.argsort(self.order, kind="stable")

    @cached_property
    def origin(self) -> Array:
        """What is given at the start, shape (sampled,)."""
        return self.sampled(np.array([self.start]))[:, 0]

    @cached_property
    def departure(self) -> Array:
        """All slots of a lane that stands at the design position and moves as the start says."""
        return self.model.moving(self.model.design if self.design is None else self.design, self.origin)

    @cached_property
    def below(self) -> int:
        """How many samples are before the start."""
        return int(np.searchsorted(self.path.times[self.order], self.start, side="left"))

    @cached_property
    def sides(self) -> tuple[Side, ...]:
        """The side after the start and the side before it, as far as there are samples."""
        times = self.path.times[self.order]
        n, below = len(times), self.below
        pad = self.model.executor(self.lanes).margin
        found: list[Side] = []
        for columns, step in ((np.arange(below, n), 1), (np.arange(below - 1, -1, -1), -1)):
            if len(columns):
                ahead = times[columns]
                samples = self.sampled(ahead)
                padded = np.concatenate([samples, np.repeat(samples[:, -1:], pad, axis=1)], axis=1)
                found.append(Side(ahead, padded, int(columns[0]), step))
        return tuple(found)

    @cached_property
    def lanes(self) -> int:
        """How many samples are tried at once."""
        return min(LANES, max(1, len(self.path.times)))

    def sampled(self, times: Array) -> Array:
        """What is given at the times, shape (sampled, n)."""
        return self.model.samples(times, self.path.drive(self.model.request.drivers, times))


def march(route: Route, tol: float, visit: Collection[int] = (), *, crossing: bool = False) -> March:
    """Solve a model at the samples of a path, from the design outwards; see `solve` for the tolerance.

    Args:
        visit: samples at which the lane that stands there is wanted, and beyond which nothing is.
        crossing: accept steps across singular poses, whatever is there.
    """
    model, path, tolerances = route.model, route.path, accept_by(tol, crossing=crossing)
    if route.from_design:
        return _Marcher(route, route.departure, tolerances, visit).run()
    way = Route(model, path.lead_in(), route.design)
    found = _Marcher(way, way.departure, tolerances).run()
    if not found.solved.all():
        n = len(path.times)
        end = replace(found.ends[0], message=f"on the way to the first sample: {found.messages[0]}")
        return March(np.full((len(found.kept), n), np.nan), found.last, np.zeros(n, np.bool_), (end,))
    return _Marcher(route, model.moving(arrived(model, found.last), route.origin), tolerances, visit).run()


def arrived(model: Model, lane: Array) -> Array:
    """A lane that stands where the given one would be predicted from."""
    found = lane.copy()
    for name in model.state:
        found[model.vectors[name]] = lane[model.vectors[FROM + name]]
    for name in (SIGMA, ORIENTATION, LARGEST_SIGMA):
        found[model.slots[name]] = lane[model.slots[FROM + name]]
    return found


def longest(margins: Array) -> int | None:
    """The longest part of a step to go, of parts each half of the one before: one that was accepted, and its half too.

    Of so many parts one may be accepted by chance, at a pose of another assembly; two such are not halves of each other.
    """
    good = np.flatnonzero((margins[:-1] > 0.0) & (margins[1:] > 0.0))
    return int(good[0]) if len(good) else None


class _Marcher:
    def __init__(self, route: Route, start: Array, tolerances: Mapping[str, float], visit: Collection[int] = ()) -> None:
        self.route, self.model, self.slots = route, route.model, route.model.slots
        self.start = start.copy()
        for name, value in tolerances.items():
            self.start[self.slots[name]] = value
        self.executor = self.model.executor(route.lanes)
        if self.model.geometry:  # the lanes know their variant
            self.executor.put(range(len(self.start)), self.start[:, None])
        self.n = len(route.path.times)
        self.whole, self.first = self.executor.table(self.model.kept, self.n, route.below)
        self.kept = self.whole[:, self.first : self.first + self.n]
        self.solved = np.ones(self.n, dtype=np.bool_)
        self.visit, self.visited = visit, dict[int, Array]()

    def run(self) -> March:
        ends: list[End] = []
        for side in self.route.sides:
            self.executor.anchor[:] = self.start
            end = self._side(side)
            if end:
                ends.append(end)
        back = self.route.back
        return March(self.kept[:, back], self.executor.anchor.copy(), self.solved[back], tuple(ends), self.visited)

    def _side(self, side: Side) -> End | None:
        """Follow one side to its last sample; None, or where and why it ends before."""
        n, at, rounds, anchor = len(side.times), 0, 0, self.executor.anchor
        stops = self._stops(side)
        while stops:
            came, at = at, self.executor.follow(side.samples, at, stops[0], self.whole, self.first + side.first, side.step)
            if at == stops[0]:
                self._stand(side, stops.pop(0), anchor)
                continue
            rounds = 0 if at > came else rounds + 1
            further, reason = self._divide(anchor, float(side.times[at]))
            if not further or rounds > MAX_ROUNDS:
                columns = side.first + side.step * np.arange(at, n)
                self.kept[:, columns], self.solved[columns] = np.nan, False
                message = self._end(side, at, anchor, reason or "the parts of the step get smaller and smaller")
                return End(message, self.route, anchor.copy(), float(side.times[at]))
        return None

    def _stops(self, side: Side) -> list[int]:
        """How many samples of a side have passed where one to visit has; without any, at its end."""
        n = len(side.times)
        if not self.visit:
            return [n]
        place = np.argsort(self.route.order)
        passed = {int((place[k] - side.first) * side.step) + 1 for k in self.visit}
        return sorted(count for count in passed if 1 <= count <= n)

    def _stand(self, side: Side, passed: int, anchor: Array) -> None:
        if self.visit:
            sample = int(self.route.order[side.first + side.step * (passed - 1)])
            if sample in self.visit:
                self.visited[sample] = anchor.copy()

    def _divide(self, anchor: Array, aim: float) -> tuple[bool, str]:
        """Go a part of the step to a sample that could not be reached; whether there is one, and why the shortest refused is."""
        here = float(anchor[self.slots[FROM + TIME]])
        times: Array = here + (aim - here) * 0.5 ** np.arange(1.0, HALVINGS + 1)
        parts = self.model.executor(HALVINGS)
        every = range(len(self.slots))
        parts.put(every, anchor[:, None])
        parts.put(self.model.sampled, self.route.sampled(times))
        parts.attempt()
        lanes = parts.get(every)
        margins = lanes[self.slots[MARGIN]]
        part = longest(margins)
        refused = np.flatnonzero(~(margins[:part] > 0.0))
        reason = why_refused(self.model, lanes[:, refused[-1]]) if len(refused) else ""
        if part is None:
            return False, reason
        anchor[:] = self.model.moving(lanes[:, part], lanes[self.model.sampled, part])
        return True, reason

    def _end(self, side: Side, at: int, anchor: Array, reason: str) -> str:
        where = self.route.path.where
        here, wanted = float(anchor[self.slots[FROM + TIME]]), float(side.times[at])
        last = f"last reachable sample at {where(float(side.times[at - 1]))}" if at else "no sample reached on this side"
        return (
            f"cannot be followed beyond {where(here)} (wanted {where(wanted)}): {reason}; smallest singular value there about "
            f"{anchor[self.slots[FROM + SIGMA]]:.3g} (zero at a lock-up or dead centre); {last}; shorten the sweep or drive "
            "another coordinate"
        )
