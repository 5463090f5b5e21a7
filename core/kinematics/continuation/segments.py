"""The followed parts of a motion: a singular pose on the motion ends one part and begins the next,
and so does a pose at which only the solved rows are singular.

A mechanism with redundant rows has many choices of independent ones, and none may be good
everywhere: the rods of a locomotive, a Bennett loop. If the rows chosen at the design position
become singular, but all rows together do not, the mechanism is regular, and the motion continues
with rows chosen at the new pose.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...failures import FailureKind
from ...mechanism.motions import Path
from ...trajectory import Array
from ..compiled.compiled_model import Model, recent_model
from ..compiled.dense_equations import system_of
from ..compiled.request import CONSISTENT, FROM, LARGEST_SIGMA, SIGMA
from ..compiled.routes import Route
from ..formulation.acceptance_criteria import LOW, is_uncertain, needs_check
from ..formulation.formulation import Condition
from ..structure.redundancy import independent_rows
from .singular_poses import bridge, onward
from .walk import End, March, follow_samples, lane_at_start, route_from_start, time_of

# A motion that ends with a smallest singular value above this part of the largest that it has had
# does not end at a singular pose.
NEAR = 1e-2
# Rows are chosen anew where all together have a smallest singular value above this part of the
# largest that there was, thirty times what rounding can turn (TURNED); with NEAR kites off by 0.002
# to 0.008 of their size were refused beside their corner.
SEEN = 1e-4
# Rows are chosen anew where that makes the smallest singular value as many times larger.
BETTER = 3.0
# Rows of before are taken again where their smallest singular value is this part of that of all
# rows: of those that are chosen at a pose it is 0.5 to 0.95, and to choose takes up to 0.1 s.
AS_GOOD = 0.3


def with_better_rows(route: Route, lane: Array, path: Path, models: list[Model]) -> Route | None:
    """Return the route from the pose of a lane on another one along a path, with rows chosen there;
    None if none are better.

    Args:
        models: one for each choice of rows of the motion so far; a new one is added.
    """
    model, time = route.model, time_of(route.model, lane)
    if not model.selection.dropped:
        return None
    system, sample = system_of(model), route.sampled(np.array([time]))
    (matrix,) = system.jacobian(system.evaluate(system.state(lane[:, None]), sample)[2])
    if not np.isfinite(matrix).all():
        return None
    largest = float(lane[model.slots[FROM + LARGEST_SIGMA]])
    least = max(BETTER * _sigma(matrix, model.selection.chosen), SEEN * largest)
    if not _sigma(matrix, range(len(matrix))) > least:
        return None
    known = {each.selection.chosen: each for each in models}
    rows = choose_rows(matrix, [*known], len(model.mechanism.drivers), system.conditions)
    sigma = _sigma(matrix, rows)
    if not sigma > least:
        return None
    best = known.get(rows)
    if best is None:
        best = recent_model(model.mechanism, replace(model.request, rows=rows))
        models.append(best)
    state = {name: lane[model.vectors[FROM + name]] for name in model.state}
    stands = _lane_near(best, state, sample, NEAR * sigma)
    if stands is None:
        return None
    # beside a corner all rows are nearly singular: the scale is that of the motion, not of what it
    # is there
    for name in (LARGEST_SIGMA, FROM + LARGEST_SIGMA):
        stands[best.slots[name]] = max(stands[best.slots[name]], largest)
    return Route(best, path, stands, time)


def choose_rows(
    matrix: Array, known: Sequence[tuple[int, ...]], drivers: int, conditions: Sequence[Condition]
) -> tuple[int, ...]:
    """Return the rows to solve at a pose: the best known ones if others are hardly better, else
    those chosen there.

    Args:
        matrix: Jacobian of all rows, the drivers' last.
        conditions: see `Cartesian`.
    """
    best = max(known, key=lambda rows: _sigma(matrix, rows))
    if _sigma(matrix, best) >= AS_GOOD * _sigma(matrix, range(len(matrix))):
        return best
    rows = tuple(independent_rows(matrix, drivers, conditions))
    # where the mechanism is singular there are fewer
    return rows if len(rows) == len(best) else best


def _sigma(matrix: Array, rows: Sequence[int]) -> float:
    """Smallest singular value of rows of a matrix."""
    return float(np.linalg.svd(matrix[[*rows]], compute_uv=False)[-1])


def _lane_near(model: Model, state: dict[str, Array], sample: Array, nearby: float) -> Array | None:
    """Return a lane of a model at a sample, no farther from a state than the given distance, or
    None.

    The distance to another solution is the smallest singular value or more.
    """
    executor = model.executor(1)
    (closes,) = model.solve_near(executor, state, sample)
    lane = executor.get(range(len(model.slots)))[:, 0]
    moved = max(
        float(np.abs(lane[model.vectors[name]] - value).max()) for name, value in state.items()
    )
    return (
        lane if closes and lane[model.slots["leftover"]] <= CONSISTENT and moved <= nearby else None
    )


# Each takes some milliseconds to be passed. A motion that has so many is one of thousands of turns.
MOST = 1000
# A sample takes a millisecond to find that no rows are better there; where so many have none it is
# the mechanism that is singular.
WITHOUT = 64


@dataclass(frozen=True, eq=False)
class Part:
    """A route, and which of all samples were followed on it."""

    route: Route
    samples: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class UnreachedSample:
    """A sample too near to a passage to be reached from either side.

    Attributes:
        sample: its number.
        route: the route with the passage.
        before, near: lanes: a good one before the passage, and the last one there.
    """

    sample: int
    route: Route
    before: Array
    near: Array


class Followed:
    """A march, continued beyond its ends.

    Attributes:
        found: the samples, with those reached beyond ends.
        parts: the first is the wanted route, from its start on the path.
        part_of: the part of each sample, shape (n,).
        models: one for each choice of rows.
        ends: the remaining ends.
        passages, stuck: ends at which singular poses are passed, and samples near them.
    """

    def __init__(self, route: Route, found: March, tol: float) -> None:
        self.route, self.found, self.tol, self.times = route, found, tol, route.path.times
        self.models = [route.model]
        stands = route_from_start(route, tol)
        self.parts = [
            Part(stands if isinstance(stands, Route) else route, np.arange(len(self.times)))
        ]
        self.part_of = np.zeros(len(self.times), dtype=np.intp)
        self.ends: list[End] = []
        self.passages: list[End] = []
        self.stuck: list[UnreachedSample] = []
        self.renewed = 0
        self._stood: dict[int, Array] = {}

    @property
    def is_uncertain(self) -> NDArray[np.bool_]:
        """Return whether each reached sample may be wrong, shape (n,)."""
        return self.found.solved & is_uncertain(*self._tests, self.tol)

    @property
    def needs_check(self) -> NDArray[np.bool_]:
        """Return whether each sample is doubtful or may be better with other rows, shape (n,)."""
        model = self.route.model
        largest = (
            np.fmax.reduce(self.found.kept[model.rows[LARGEST_SIGMA].start], initial=0.0)
            if model.selection.dropped
            else None
        )
        return self.found.solved & needs_check(*self._tests, self.tol, largest)

    @property
    def _tests(self) -> tuple[Array, Array]:
        sigma, closure = (
            self.found.kept[self.route.model.rows[name].start] for name in (SIGMA, "closure")
        )
        return sigma, closure

    def go_on(self) -> None:
        """Pass the singular poses at ends, one after the other, if the motion continues there."""
        waiting = list(self.found.ends)
        while waiting:
            end = waiting.pop(0)
            further = self._beyond(end)
            if further is None:
                self.ends.append(end)
            else:
                waiting = [*further, *waiting]

    def renew(self, lanes: Mapping[int, Array]) -> None:
        """Follow samples with rows chosen there, from lanes at these samples."""
        left: list[int] = list(lanes)
        routes = {k: self.parts[int(self.part_of[k])].route for k in left}
        without = 0
        while left and without < WITHOUT:
            here, samples = left[0], np.array(left)
            route = with_better_rows(routes[here], lanes[here], self._path(samples), self.models)
            if route is None:
                without += 1
                left = left[1:]
            else:
                self._follow(route, samples)
                self.renewed += 1
                left = [k for k in left[1:] if self.needs_check[k]]

    def _beyond(self, end: End) -> list[End] | None:
        """Return the next end of the motion beyond an end; None if the motion does not continue."""
        if end.failure is not FailureKind.LEFT_OFF and end.is_regular(NEAR):
            return None
        here, number = end.time, self._number(end.route)
        side = 1.0 if end.wanted > here else -1.0
        missing = np.empty(0, np.intp)
        if number is not None:  # the samples of that side from the first wanted one on
            start = self.parts[number].route.start
            ahead = side * (self.times - start) >= side * (end.wanted - start)
            missing = np.flatnonzero(~self.found.solved & ahead)
        path = end.route.path if number is None else self._path(missing)
        other = None
        if self.renewed < MOST:
            other = with_better_rows(end.route, end.lane, path, self.models)
        if other is not None:
            self.renewed += 1
            if number is None:
                return self._arrive(other)
            ends = self._follow(other, missing)
            return [each for each in ends if side * (each.wanted - here) >= 0.0]
        if (
            end.failure is FailureKind.LEFT_OFF and number is not None
        ):  # the way to the start is gone to its end
            return self._further(end, number, side)
        if len(self.passages) == MOST:
            return None
        lane = self.before(here, side, number) if number is not None else end.route.departure
        if lane is None:
            return None
        passed = bridge(end.route, lane, here, self.tol, end.lane, rates=False)
        if passed is None:
            return None
        self.passages.append(end)
        over = onward(end.route.model, passed.poses[-1].pose, path)
        if number is None:
            return self._arrive(over)
        ends, beyond = self._follow(over, missing), over.start
        back = [each for each in ends if side * (each.wanted - beyond) < 0.0]
        # a sample right beyond the pose is not given up for want of better rows
        while back and back[0].failure is FailureKind.LEFT_OFF:
            back = self._further(back[0], len(self.parts) - 1, -side)
        self.stuck += [
            UnreachedSample(k, end.route, lane, end.lane)
            for k in missing.tolist()
            if not self.found.solved[k] and side * (self.times[k] - beyond) < 0.0
        ]
        return [each for each in ends if side * (each.wanted - beyond) >= 0.0]

    def _further(self, end: End, number: int, side: float) -> list[End]:
        """Run a route again, and continue it beyond its earlier end."""
        samples = self.parts[number].samples
        found = follow_samples(end.route, self.tol, low=LOW * end.sigma)
        self._take(found, samples, found.solved & ~self.found.solved[samples], number)
        return [each for each in found.ends if side * (each.wanted - end.route.start) >= 0.0]

    def _path(self, samples: NDArray[np.intp]) -> Path:
        """The path at samples."""
        path = self.route.path
        return Path(path.motions, self.times[samples], path.design)

    def _arrive(self, way: Route) -> list[End]:
        """Go on to the start of the samples, and from there."""
        last = len(way.path.times) - 1
        found = follow_samples(way, self.tol, {last})
        if not found.solved.all():
            return list(found.ends)
        lane = lane_at_start(way.model, found.visited[last])
        return self._follow(
            Route(way.model, self.route.path, lane, self.route.start), np.arange(len(self.times))
        )

    def _follow(self, route: Route, samples: NDArray[np.intp]) -> list[End]:
        """Store the samples reached by a route if they were missing, or much nearer to singular."""
        found, sigma = follow_samples(route, self.tol, low=LOW), self.route.model.rows[SIGMA].start
        nearer = BETTER * self.found.kept[sigma, samples] < found.kept[sigma]
        reached = found.solved & (nearer | ~self.found.solved[samples])
        self._take(found, samples, reached, len(self.parts))
        self.parts.append(Part(route, samples))
        return list(found.ends)

    def _take(
        self, found: March, samples: NDArray[np.intp], reached: NDArray[np.bool_], number: int
    ) -> None:
        """Store samples that a part reached."""
        taken = samples[reached]
        self.found.kept[:, taken], self.found.solved[taken] = found.kept[:, reached], True
        self.part_of[taken] = number

    def visit(self, samples: Collection[int]) -> dict[int, Array]:
        """Return lanes at samples; samples not reached again are absent."""
        found: dict[int, Array] = {}
        for number, part in enumerate(self.parts):
            wanted = {
                at
                for at, k in enumerate(part.samples.tolist())
                if k in samples and self.part_of[k] == number
            }
            if wanted:
                found |= {
                    int(part.samples[at]): lane
                    for at, lane in follow_samples(
                        part.route, self.tol, visit=wanted
                    ).visited.items()
                }
        return found

    def before(self, time: float, side: float, number: int) -> Array | None:
        """Return the lane of the last certain sample of a part before a time, going outwards; or of
        its start, if known.
        """
        route = self.parts[number].route
        away = side * (self.times - route.start)
        mine = (self.part_of == number) & self.found.solved & ~self.is_uncertain
        good = np.flatnonzero(mine & (away >= 0.0) & (away < side * (time - route.start)))
        if not len(good):
            return route.departure if route.starts_at_design else None
        nearest = int(good[away[good].argmax()])
        if nearest not in self._stood:
            self._stood |= self.visit({nearest})
        return self._stood.get(nearest)

    def _number(self, route: Route) -> int | None:
        """Return the number of the part on a route; None on the way to the start."""
        return next((k for k, part in enumerate(self.parts) if part.route is route), None)
