"""What was followed of a motion, part by part: a singular pose that the motion passes ends one part, and begins the next."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..trajectory import Array
from .bridge import bridge, onward
from .continuity import doubtful
from .march import End, March, arrived, march
from .request import FROM, LARGEST_SIGMA, SIGMA, TIME
from .route import Route
from .system import System

# A motion that ends with a smallest singular value above this part of the largest that it has had does not end at a singular pose.
NEAR = 1e-2
# Each takes some milliseconds to be passed. A motion that has so many is one of thousands of turns.
MOST = 1000


@dataclass(frozen=True, eq=False)
class Part:
    """A route, and which of all samples were followed on it."""

    route: Route
    samples: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Passage:
    """A singular pose that the motion passes.

    Attributes:
        lane: all slots of the last pose before it.
        time: of that pose.
        route: on which.
    """

    lane: Array
    time: float
    route: Route


@dataclass(frozen=True, eq=False)
class Stuck:
    """A sample beside a passage that is too near for either side to reach it.

    Attributes:
        sample: which.
        before, near: lanes: a good one before the passage, and the last one there.
    """

    sample: int
    before: Array
    near: Array


class Followed:
    """A march, and its going on beyond its ends.

    Attributes:
        system: the equations.
        found: the samples; those beyond ends are put in as they are reached.
        parts: the first is the route asked for.
        part_of: the part of each sample, shape (n,).
        ends: those that remain.
        passages, stuck: what was passed.
    """

    def __init__(self, route: Route, found: March, tol: float) -> None:
        self.route, self.found, self.tol, self.times = route, found, tol, route.path.times
        # tracing it anew takes longer than all else here
        self.system = route.model.bound("system", lambda: System(route.model))
        self.parts = [Part(route, np.arange(len(self.times)))]
        self.part_of = np.zeros(len(self.times), dtype=np.intp)
        self.ends: list[End] = []
        self.passages: list[Passage] = []
        self.stuck: list[Stuck] = []
        self._stood: dict[int, Array] = {}

    @property
    def doubtful(self) -> NDArray[np.bool_]:
        """Samples that were reached and may be wrong, shape (n,)."""
        closure, sigma = (self.found.kept[self.route.model.rows[name].start] for name in ("closure", SIGMA))
        return self.found.solved & doubtful(sigma, closure, self.tol)

    def go_on(self) -> None:
        """Pass the singular poses at ends, one after the other, where the motion passes them."""
        waiting = list(self.found.ends)
        while waiting:
            end = waiting.pop(0)
            further = self._beyond(end) if len(self.passages) < MOST else None
            if further is None:
                self.ends.append(end)
            else:
                waiting = [*further, *waiting]

    def _beyond(self, end: End) -> list[End] | None:
        """What ends the motion beyond an end; None where it does not go on."""
        slots = self.route.model.slots
        if end.lane[slots[FROM + SIGMA]] > NEAR * end.lane[slots[FROM + LARGEST_SIGMA]]:
            return None
        here, number = self._time(end.lane), self._number(end.route)
        side = 1.0 if end.wanted > here else -1.0
        lane = self.before(here, side, number) if number is not None else end.route.departure
        passed = bridge(self.system, end.route, lane, here, self.tol, end.lane) if lane is not None else None
        if passed is None:
            return None
        self.passages.append(Passage(end.lane, here, end.route))
        if number is None:
            return self._arrive(onward(end.route, passed.beyond, end.route.path.times))
        start = self.parts[number].route.start
        missing = np.flatnonzero(~self.found.solved & (side * (self.times - start) >= side * (end.wanted - start)))
        ends = self._follow(onward(self.route, passed.beyond, self.times[missing]), missing)
        beyond = self._time(passed.beyond)
        short = {k for k in missing.tolist() if not self.found.solved[k] and side * (self.times[k] - beyond) < 0.0}
        self.stuck += [Stuck(k, lane, end.lane) for k in sorted(short)] if lane is not None else []
        return [each for each in ends if side * (each.wanted - beyond) >= 0.0]

    def _arrive(self, way: Route) -> list[End]:
        """Go on to the first sample, and from there."""
        last = len(way.path.times) - 1
        found = march(way, self.tol, {last})
        if not found.solved.all():
            return list(found.ends)
        lane = arrived(self.route.model, found.visited[last])
        return self._follow(Route(self.route.model, self.route.path, lane, float(self.times[0])), np.arange(len(self.times)))

    def _follow(self, route: Route, samples: NDArray[np.intp]) -> list[End]:
        found = march(route, self.tol)
        self.found.kept[:, samples], self.found.solved[samples] = found.kept, found.solved
        self.part_of[samples] = len(self.parts)
        self.parts.append(Part(route, samples))
        return list(found.ends)

    def visit(self, samples: Collection[int]) -> dict[int, Array]:
        """Lanes that stand at samples; those that are not reached again are missing."""
        found: dict[int, Array] = {}
        for number, part in enumerate(self.parts):
            wanted = {at for at, k in enumerate(part.samples.tolist()) if k in samples and self.part_of[k] == number}
            if wanted:
                found |= {int(part.samples[at]): lane for at, lane in march(part.route, self.tol, visit=wanted).visited.items()}
        return found

    def before(self, time: float, side: float, number: int) -> Array | None:
        """The lane of the last sample of a part before a time, going outwards, that is not in doubt; or of its start, if known."""
        route = self.parts[number].route
        away = side * (self.times - route.start)
        mine = (self.part_of == number) & self.found.solved & ~self.doubtful
        good = np.flatnonzero(mine & (away >= 0.0) & (away < side * (time - route.start)))
        if not len(good):
            return route.departure if route.from_design else None
        nearest = int(good[away[good].argmax()])
        if nearest not in self._stood:
            self._stood |= self.visit({nearest})
        return self._stood.get(nearest)

    def _number(self, route: Route) -> int | None:
        """Of the part that is followed on a route; None on the way to the first sample."""
        return next((k for k, part in enumerate(self.parts) if part.route is route), None)

    def _time(self, lane: Array) -> float:
        return float(lane[self.route.model.slots[FROM + TIME]])
