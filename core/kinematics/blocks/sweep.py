"""Sweep a list of blocks bound to lanes, one sample a lane: outwards from the design position, many
samples at once, on from the last one accepted by every block, over singular poses too.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import number_of
from ...failures import FailureKind, PoseFailure
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path, outwards
from ...program import ITERATIONS, MARGIN
from ...trajectory import Array, Trajectory, largest_found
from ..compiled.compiled_model import CLOSED
from ..compiled.request import LARGEST_OF_PARTS, SIGMA, SMALLEST_OF_PARTS, Request, accept_by
from ..compiled.routes import Start, solve_from_start, start_of
from ..compiled.solution import Columns, solution
from ..continuation.singular_poses import (
    CONTINUED,
    NEARLY,
    Numbers,
    Passage,
    interpolated,
    listed,
    pass_over,
)
from ..continuation.walk import Walk, longest, part_of_step
from ..formulation.acceptance_criteria import AMPLIFIED, EPSILON, WORSE

WORST = (*LARGEST_OF_PARTS, *SMALLEST_OF_PARTS)
"""Tests of which the worst of all blocks is known."""
CLOSURES, SIGMAS, MARGINS = (WORST.index(name) for name in ("closure", SIGMA, MARGIN))
"""Rows of those."""
Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Anchor:
    """The pose before the lanes, to be restored later.

    Attributes:
        time: of the pose [s].
        pose: of all blocks, as the lanes keep it.
        motions: the wanted motions there, shape (columns,); none if they were not taken along.
        error: a bound of its error by its tests [units].
    """

    time: float
    pose: Any
    _numbers: Callable[[Any], Numbers]
    motions: Array = field(default_factory=lambda: np.empty(0))
    error: float = 0.0

    @property
    def numbers(self) -> Numbers:
        """The numbers of all blocks."""
        return self._numbers(self.pose)


class Lanes(ABC):
    """Blocks bound to lanes; all lanes are predicted from one pose, the last one accepted by every
    block.

    Attributes:
        mechanism, request: what is bound, and the wanted motions.
        unit: length unit of the residuals [m].
        details: the blocks as the record of every solution shows them.
        design: the design position.
        many: number of lanes.
        worst: the worst tests of all blocks, shape (WORST, room).
        last: the lane of the last time of the last attempt.
    """

    mechanism: Mechanism
    request: Request
    unit: float
    details: Mapping[str, Any]
    design: Anchor
    many: int
    worst: Array
    last: int = 0

    def attempt(self, times: Array, path: Path) -> Array:
        """Solve all blocks at times, up to the number of lanes, each lane alone; return the margin
        of each time, positive if accepted.
        """
        return self.attempt_at(self.sampled(times, path))

    def accept(self, tol: float, *, crossing: bool = False) -> None:
        """Set the tolerance, and whether a singular pose may be crossed."""
        self.accept_by(accept_by(tol, crossing=crossing))

    def begin(self) -> None:
        """Forget the findings of before."""
        return

    @abstractmethod
    def accept_by(self, limits: Mapping[str, float]) -> None:
        """Set the numbers of `ACCEPT`."""

    @abstractmethod
    def depart(self, time: float, path: Path) -> PoseFailure | None:
        """Stand at a time of a path with the rates there, with no step behind."""

    @abstractmethod
    def anchor(self, time: float) -> Anchor:
        """Return the pose before the lanes, at a time."""

    def taken(self, time: float) -> Anchor:
        """Return the pose that was carried from the first lane, with its motions."""
        closure, sigma = (float(self.worst[row, 0]) for row in (CLOSURES, SIGMAS))
        error = WORSE * max(closure, EPSILON) / sigma
        return replace(self.anchor(time), motions=self.motions(1)[:, 0], error=error)

    @abstractmethod
    def restore(self, anchor: Anchor) -> None:
        """Set the pose before the lanes."""

    @abstractmethod
    def sampled(self, times: Array, path: Path) -> list[Array]:
        """Return the inputs at times, tables of shape (numbers, times)."""

    @abstractmethod
    def attempt_at(self, tables: Sequence[Array], *, neighbours: bool = False) -> Array:
        """Attempt all blocks as `attempt` does, with tables from `sampled`.

        Args:
            neighbours: the times are neighbours on the way.
        """

    @abstractmethod
    def carry(self, lane: int) -> None:
        """Predict from a solved lane from now on, whichever it is."""

    def go_on(self) -> None:
        """Predict from the last lane from now on."""
        self.carry(self.last)

    @abstractmethod
    def motions(self, count: int) -> Array:
        """Return the wanted motions of the first lanes, shape (columns, count)."""

    @abstractmethod
    def uncertain(self, count: int, path: Path) -> Mapping[int, float]:
        """Return which of the first lanes are left uncertain by their residuals, and a bound of the
        error of each.
        """

    @property
    def findings(self) -> Mapping[str, Any]:
        """What the record of a solution says beside the tests, since `begin`."""
        return {}

    @property
    @abstractmethod
    def sound(self) -> bool:
        """Whether no block is nearly singular at the pose before the lanes."""

    @abstractmethod
    def failure(self, tol: float) -> PoseFailure:
        """Return the failure of the last lane."""


# Halvings of a step to a pose beside a singular one, and how many parts it is gone in at most; over
# the singular pose there are fewer.
HALVED, MOST, FEW = 8, 64, 4
# Samples that are interpolated at most: a fine sweep has some tens of them beside a singular pose.
BRIDGED = 64

Keep = Callable[[Indices], None]
"""Takes samples, by their number outwards, from as many lanes."""


class BlockWalk(Walk):
    """The walk over samples of a path, from the pose before the lanes.

    Args:
        samples: numbers of the samples, in their order: all up or all down.
        times: of all samples [s].
        given: tables of all samples, see `Lanes.sampled`.
        start: that pose.
        tol: largest accepted residual.
        watch: look for sound poses all the way, not only where a step fails.

    Attributes:
        time: of the pose before the lanes [s].
        sound: the last sound pose before the lanes.
    """

    def __init__(
        self,
        lanes: Lanes,
        samples: Indices,
        times: Array,
        given: Sequence[Array],
        path: Path,
        keep: Keep,
        *,
        start: Anchor,
        tol: float,
        watch: bool = False,
    ) -> None:
        self.watch = watch
        self.lanes, self.samples, self.times, self.given = lanes, samples, times, given
        self.path, self.keep, self.tol = path, keep, tol
        self.time, self.sound = start.time, start

    def run(self) -> tuple[int, PoseFailure | None]:
        """Follow all samples; see `advance`."""
        return self.advance(0, len(self.samples))

    def follow(self, at: int, stop: int, parts: int) -> int:
        """Follow as many samples at once as there are lanes, up to the first failure."""
        lanes, ahead = self.lanes, self.samples[at : min(at + self.lanes.many, stop)]
        self._parts = parts
        if self.watch and lanes.sound:
            self.sound = lanes.anchor(self.time)
        first, last = int(ahead[0]), int(ahead[-1])
        step = 1 if last >= first else -1
        end = last + step
        run = slice(first, end if end >= 0 else None, step)
        good = lanes.attempt_at([each[:, run] for each in self.given], neighbours=True) > 0.0
        accepted = len(ahead) if good.all() else int(good.argmin())
        if not accepted:
            if lanes.sound and not self.watch:
                self.sound = lanes.anchor(self.time)
            return at
        self.keep(ahead[:accepted])
        if accepted == len(ahead):
            lanes.go_on()
        else:
            lanes.carry(accepted - 1)
        self.time = float(self.times[ahead[accepted - 1]])
        return at + accepted

    def follow_part(self, at: int) -> PoseFailure | None:
        """Follow equal parts of a step that fails, as neighbours, and else the longest accepted
        part.
        """
        lanes, wanted = self.lanes, float(self.times[self.samples[at]])
        if not self._parts:
            many = lanes.many - 1  # the last part is left: a sample ends an iteration of its own
            parts = np.arange(1.0, many + 1.0) / lanes.many
            times: Array = self.time + (wanted - self.time) * parts
            good = lanes.attempt_at(lanes.sampled(times, self.path), neighbours=True) > 0.0
            accepted = many if good.all() else int(good.argmin())
            if accepted:
                lanes.carry(accepted - 1)
                self.time = float(times[accepted - 1])
                return None
        reached = part_of_step(
            self.time,
            wanted,
            lambda times: self.lanes.attempt(times, self.path),
            self.lanes.many,
        )
        if reached is None:
            return self.lanes.failure(self.tol)
        lane, self.time = reached
        self.lanes.carry(lane)
        return None


@dataclass
class _Results:
    """What a sweep found: the motions and tests of all samples, the bounds of errors of those that
    are refused, and words on the way.
    """

    table: Array
    worst: Array
    refused: dict[int, float] = field(default_factory=dict[int, float])
    messages: list[str] = field(default_factory=list[str])
    notes: list[str] = field(default_factory=list[str])
    failures: list[FailureKind] = field(default_factory=list[FailureKind])

    def take_away(self, path: Path, tol: float) -> None:
        """Take away the samples left uncertain, and say so."""
        refused = self.refused
        if refused:
            self.table[:, [*refused]] = np.nan
            self.worst[:, [*refused]] = np.nan
            worst = max(refused, key=refused.__getitem__)
            there = path.where(float(path.times[worst]))
            self.messages.append(
                f"refused at {number_of(len(refused), 'sample')} so near a singular pose that"
                " residuals leave the pose or its rates uncertain, by up to"
                f" {refused[worst]:.2g} (at {there}), allowed {AMPLIFIED * tol:.2g}; keep away"
                " from it"
            )
            self.failures.append(FailureKind.UNCERTAIN)


@dataclass(frozen=True, eq=False)
class _Side:
    """Samples on one side of the start, outwards.

    Attributes:
        order: their numbers.
        times: of the samples.
        given: their inputs, see `Lanes.sampled`.
    """

    path: Path
    order: Indices
    times: Array
    given: Sequence[Array]


class BlockSweep:
    """A path through blocks bound to lanes; solved as often as wanted."""

    def __init__(self, lanes: Lanes, path: Path, start: Start | None = None) -> None:
        self._lanes, self._mechanism, self.path = lanes, lanes.mechanism, path
        self.start = start or start_of(self._mechanism, path)
        self._columns = Columns.of(lanes.request)

    def solve(self, tol: float) -> Trajectory:
        """The motion at all samples; see `solve`."""

        def by(start: Start) -> Trajectory:
            own = start is self.start
            return (self if own else BlockSweep(self._lanes, self.path, start))._solve(tol)

        return solve_from_start(
            self.start, self._mechanism, self.path, by, compare=np.isfinite(tol)
        )

    def _solve(self, tol: float) -> Trajectory:
        lanes, n = self._lanes, len(self.path.times)
        departure, before = self._departure
        found = _Results(
            np.full((self._columns.count, n), np.nan),
            np.full((len(WORST), n), np.nan),
            messages=[*before.messages],
            notes=[*before.notes],
            failures=[*before.failures],
        )
        lanes.begin()
        for side in self._sides if departure else ():
            assert departure is not None
            lanes.restore(departure)
            lanes.accept(tol)
            self._follow(side, departure, self._keep(side, found), tol, found)
        if departure and len(found.refused) <= BRIDGED:
            self._interpolate_refused(departure, found, tol)
        found.take_away(self.path, tol)
        return self._trajectory(found)

    def _keep(self, side: _Side, found: _Results) -> Keep:
        lanes = self._lanes

        def keep(samples: Indices) -> None:
            at, count = side.order[samples], len(samples)
            found.table[:, at] = lanes.motions(count)
            found.worst[:, at] = lanes.worst[:, :count]
            for lane, error in lanes.uncertain(count, side.path).items():
                found.refused[int(at[lane])] = error

        return keep

    def _interpolate_refused(self, departure: Anchor, found: _Results, tol: float) -> None:
        """Replace refused samples by interpolation between both sides of them, where the motion
        continues.
        """
        lanes = self._lanes
        for side in self._sides:
            for at in np.flatnonzero([int(k) in found.refused for k in side.order]).tolist():
                lanes.restore(departure)
                lanes.accept(tol)
                ahead = _Side(side.path, side.order, side.times[: at + 1], side.given)
                came = self._follow(
                    ahead, departure, _nothing, tol, _Results(*_NOTHING), watch=True
                )
                if came is not None and self._interpolate(side, at, *came, found, tol):
                    del found.refused[int(side.order[at])]

    def _interpolate(
        self,
        side: _Side,
        at: int,
        sound: Anchor,
        near: Anchor | None,
        found: _Results,
        tol: float,
    ) -> bool:
        """Replace a sample by interpolation between eight poses around it; return whether they are
        on one smooth curve, with the pose at the sample if it is known.
        """
        time, k = float(side.times[at]), int(side.order[at])
        passed = self._pass_over(side.path, sound, near, time, time - sound.time, tol)
        if passed is None:
            return False
        found.table[:, k] = passed.motions
        tests = found.worst[:, k]
        tests[np.isnan(tests)] = 0.0
        found.notes.append(
            f"passes a singular pose at {side.path.where(time)}; {CONTINUED}, interpolated"
            f" there to {passed.error:.1g} of the mechanism's size and of the rates"
        )
        return True

    def _pass_over(
        self,
        path: Path,
        sound: Anchor,
        near: Anchor | None,
        time: float,
        way: float,
        tol: float,
        *,
        rates: bool = True,
    ) -> Passage[Anchor] | None:
        measure = partial(interpolated, self._columns.by_vector, self._lanes.unit, rates=rates)
        known = near and (near.numbers.state, NEARLY)
        reach = self._reach(path, tol)
        return pass_over(sound, known, time, way, reach, measure, AMPLIFIED * tol)

    @cached_property
    def _sides(self) -> list[_Side]:
        """The samples of each side of the start, outwards."""
        path, sides = self.path, outwards(self.path.times, self.start.time)
        return [
            _Side(path, side, path.times[side], self._lanes.sampled(path.times[side], path))
            for side in sides
        ]

    @cached_property
    def _departure(self) -> tuple[Anchor | None, _Results]:
        """The start of the sweep: the pose there, None if it cannot be reached, and words on the
        way.
        """
        lanes, path, begin, found = self._lanes, self.path, self.start, _Results(*_NOTHING)
        lanes.restore(lanes.design)
        lanes.accept(CLOSED)
        if way := begin.lead:
            times = np.array([0.0, 1.0])
            lanes.depart(0.0, way)
            side = _Side(way, np.arange(2), times, lanes.sampled(times, way))
            self._follow(side, lanes.anchor(0.0), _nothing, CLOSED, found)
            if found.messages:
                found.messages[:] = [f"on the way to {begin.name}: {found.messages[0]}"]
                return None, found
        failure = lanes.depart(begin.time, path)
        if failure is not None:
            where = path.where(begin.time)
            found.messages.append(f"the motion cannot start at {where}: {failure}")
            found.failures.append(failure.kind)
            return None, found
        return lanes.anchor(begin.time), found

    def _follow(
        self,
        side: _Side,
        start: Anchor,
        keep: Keep,
        tol: float,
        found: _Results,
        *,
        watch: bool = False,
    ) -> tuple[Anchor, Anchor | None] | None:
        """Follow the samples of a side outwards, over singular poses too; add the message of an
        end.

        Returns:
            A sound pose before the last sample, and the pose there, None if it was reached from
            beyond; None if it is not reached.
        """
        lanes, path, times, left, refused = (
            self._lanes,
            side.path,
            side.times,
            np.arange(len(side.times)),
            list[int](),
        )

        def walk(samples: Indices, start: Anchor) -> BlockWalk:
            return BlockWalk(
                lanes, samples, times, side.given, path, keep, start=start, tol=tol, watch=watch
            )

        came: tuple[Anchor, Anchor | None] | None = None
        while len(left):
            ahead = walk(left, start)
            count, failure = ahead.run()
            left = left[count:]
            if failure is None:
                came = (ahead.sound, lanes.anchor(ahead.time)) if watch else None
                break
            at = int(left[0])
            wanted, last = float(times[at]), float(times[at - 1]) if at else None
            near = lanes.anchor(ahead.time)
            way, passed = wanted - near.time, None
            if failure.kind is not FailureKind.TOO_MANY_PARTS:
                passed = self._pass_over(path, ahead.sound, near, near.time, way, tol, rates=False)
            lanes.accept(tol)
            if passed is None:
                found.failures.append(failure.kind)
                found.messages.append(path.ended(ahead.time, wanted, last, str(failure)))
                return None
            found.notes.append(
                f"crosses a singular pose near {path.where(ahead.time)}; {CONTINUED}"
            )
            start = passed.poses[-1]
            beside = left[np.abs(times[left] - ahead.time) <= abs(start.time - ahead.time)]
            left = left[len(beside) :]
            lanes.restore(start)
            reached, _ = walk(beside[::-1], start).run()
            for each in beside[: len(beside) - reached].tolist()[:BRIDGED]:
                if not self._interpolate(side, each, ahead.sound, None, found, tol):
                    refused.append(each)
            lanes.restore(start)
            lanes.accept(tol)
            came = start, None
        if refused:
            found.failures.append(FailureKind.UNCERTAIN)
            places = listed([path.where(float(times[k])) for k in refused])
            found.messages.append(
                f"refused at {places}: so near a singular pose that neither side reaches it; keep"
                " away from it"
            )
        return came

    def _reach(self, path: Path, tol: float) -> Callable[[Anchor, float, bool], Anchor | None]:
        """Return what goes from a pose to a time of a path, see `pass_over`."""
        lanes = self._lanes

        def reach(at: Anchor, time: float, crossing: bool) -> Anchor | None:
            lanes.restore(at)
            lanes.accept(tol, crossing=crossing)
            here = at.time
            # parts of a step over a singular pose at which the motion turns back end at the pose
            for _ in range(FEW if crossing else MOST):
                parts: Array = here + (time - here) * 0.5 ** np.arange(0.0, HALVED)
                part = longest(lanes.attempt(parts, path))
                if part is None:
                    return None
                lanes.carry(part)
                if part == 0:
                    return lanes.taken(time)
                here = float(parts[part])
            return None

        return reach

    def _trajectory(self, found: _Results) -> Trajectory:
        tests = dict(zip(WORST, found.worst, strict=True))
        solved = ~np.isnan(tests["closure"])
        closure, leftover, sigma = (
            largest_found(each[solved])
            for each in (tests["closure"], tests["leftover"], -tests[SIGMA])
        )
        return solution(
            found.table.T,
            self._columns.points,
            self._columns.bodies,
            unit=self._lanes.unit,
            solved=solved,
            iterations=tests[ITERATIONS],
            closure=closure,
            leftover=leftover,
            message="; ".join(found.messages),
            failures=found.failures,
            account=self._lanes.details,
            findings={
                "smallest_singular_value": min(-sigma, 1.0),
                **self._lanes.findings,
                **({"notes": found.notes} if found.notes else {}),
            },
        )


_NOTHING = np.empty((0, 0)), np.empty((0, 0))


def _nothing(samples: Indices) -> None:
    """Keep none of the samples."""
