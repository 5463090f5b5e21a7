"""Sweep a list of blocks bound to lanes, one sample a lane: outwards from the design position, many
samples at once, on from the last one accepted by every block, over singular poses too.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import number_of
from ...failures import FailureKind, PoseFailure
from ...kinematics.compiled.compiled_model import CLOSED
from ...kinematics.compiled.request import (
    LARGEST,
    LARGEST_OF_PARTS,
    SIGMA,
    SMALLEST_OF_PARTS,
    Request,
    accept_by,
)
from ...kinematics.compiled.routes import Start, solve_from_start, start_of
from ...kinematics.compiled.solution import Columns, solution
from ...kinematics.continuation.singular_poses import (
    CONTINUED,
    NEARLY,
    Anchor,
    PassedSingularity,
    interpolation_error,
    list_names,
    pass_over,
)
from ...kinematics.continuation.walk import Walk, longest, part_of_step
from ...kinematics.formulation.acceptance_criteria import AMPLIFIED, EPSILON, WORSE, is_uncertain
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path, outwards
from ...program import ITERATIONS, MARGIN, leading
from ...trajectory import Array, Trajectory, largest_found

WORST = (*LARGEST_OF_PARTS, *SMALLEST_OF_PARTS)
"""Tests of which the worst of all blocks is known."""
CLOSURES, SIGMAS, MARGINS = (WORST.index(name) for name in ("closure", SIGMA, MARGIN))
"""Rows of those."""
Indices = NDArray[np.intp]
CERTAIN = (1.0 - 1e-12) * AMPLIFIED / WORSE
"""Bound of the residual of a certain sample, by the tolerance and the square of sigma: the reverse
of `is_uncertain`, for sure, not by rounding either.
"""


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
        refused: whether the last walk ended at once, and no closer look accepts its first sample.
    """

    mechanism: Mechanism
    request: Request
    unit: float
    details: Mapping[str, Any]
    design: Anchor
    many: int
    worst: Array
    last: int = 0
    refused: bool = False

    @cached_property
    def columns(self) -> Columns:
        """The columns of the wanted motions."""
        return Columns(self.request)

    def attempt(self, times: Array, path: Path) -> Array:
        """Solve all blocks at times, up to the number of lanes, each lane alone; return the margin
        of each time, positive if accepted.
        """
        return self.attempt_at(self.sample_tables(times, path))

    def reach(self, times: Array, path: Path) -> int:
        """Attempt neighbouring times, up to the number of lanes; return how many are reached, and
        predict from the last of them from now on.
        """
        accepted = leading(self.attempt_at(self.sample_tables(times, path), neighbours=True))
        if accepted:
            self.carry(accepted - 1)
        return accepted

    def solve_near(self, anchor: Anchor, tol: float, *, crossing: bool = False) -> None:
        """Set the pose before the lanes, the tolerance, and whether a singular pose may be
        crossed.
        """
        self.restore(anchor)
        self.accept_by(accept_by(tol, crossing=crossing))

    def begin(self) -> None:
        """Forget the findings of before."""
        return

    @abstractmethod
    def accept_by(self, limits: Mapping[str, float]) -> None:
        """Set the numbers of `ACCEPT`."""

    @abstractmethod
    def set_prediction_start(self, time: float, path: Path) -> PoseFailure | None:
        """Stand at a time of a path with the rates there, with no step behind."""

    @abstractmethod
    def anchor(self, time: float) -> Anchor:
        """Return the pose before the lanes, at a time."""

    def carried_anchor(self, time: float) -> Anchor:
        """Return the pose that was carried from the first lane, with its motions."""
        closure, sigma = (float(self.worst[row, 0]) for row in (CLOSURES, SIGMAS))
        error = WORSE * max(closure, EPSILON) / sigma
        return replace(self.anchor(time), motions=self.motions(1)[:, 0], error=error)

    @abstractmethod
    def restore(self, anchor: Anchor) -> None:
        """Set the pose before the lanes."""

    @abstractmethod
    def sample_tables(self, times: Array, path: Path) -> list[Array]:
        """Return the inputs at times, tables of shape (numbers, times)."""

    @abstractmethod
    def attempt_at(self, tables: Sequence[Array], *, neighbours: bool = False) -> Array:
        """Attempt all blocks as `attempt` does, with tables from `sample_tables`.

        Args:
            neighbours: the times are neighbours on the way.
        """

    @abstractmethod
    def carry(self, lane: int) -> None:
        """Predict from a solved lane from now on, whichever it is."""

    def walk(
        self, tables: Sequence[Array], count: int, certain: float = CERTAIN
    ) -> tuple[Array, Array]:
        """Follow samples as far as machine code does by itself; return the motions and the tests of
        those followed.

        Args:
            tables: from `sample_tables`, with the last sample `many` times more.
            certain: bound of the residual, by the tolerance and the square of sigma.
        """
        return np.empty((0, 0)), np.empty((0, 0))

    @abstractmethod
    def motions(self, count: int) -> Array:
        """Return the wanted motions of the first lanes, shape (columns, count)."""

    @abstractmethod
    def uncertain(self, doubtful: Indices, tol: float, path: Path) -> Mapping[int, float]:
        """Return which of the lanes in doubt are left uncertain by their residuals, and a bound of
        the error of each.
        """

    def refuse_uncertain(self, lanes: Indices, errors: Array, tol: float) -> dict[int, float]:
        """Return the errors of lanes that are too large, or no numbers."""
        found = zip(lanes.tolist(), errors.tolist(), strict=True)
        return {k: error for k, error in found if not error <= AMPLIFIED * tol}

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

Keep = Callable[[Indices, Array, Array, bool], None]
"""Takes samples, by their number outwards, with their motions and tests. They are certain, or in
the first lanes.
"""


@dataclass(frozen=True, eq=False)
class _Side:
    """Samples on one side of the start, outwards.

    Attributes:
        order: their numbers.
        times: of the samples.
        given: their inputs, see `Lanes.sample_tables`; the last one many times more.
    """

    path: Path
    order: Indices
    times: Array
    given: Sequence[Array]

    @staticmethod
    def of(lanes: Lanes, path: Path, order: Indices, times: Array) -> _Side:
        """Return a side whose samples lanes walk over."""
        tables = lanes.sample_tables(np.append(times, times[-1:].repeat(lanes.many)), path)
        return _Side(path, order, times, tables)

    def inputs(self, samples: Indices) -> list[Array]:
        """Return the inputs of samples."""
        return [each.take(samples, axis=1) for each in self.given]


class BlockWalk(Walk):
    """The walk over samples of a side, from the pose before the lanes.

    Args:
        samples: numbers of the samples, in their order: all up or all down.
        start: the pose before the lanes.
        watch: take the last sound pose along all the way, not only where the walk ends.

    Attributes:
        time: of the last pose.
        sound: the last pose far from singular before it.
    """

    def __init__(
        self,
        lanes: Lanes,
        side: _Side,
        samples: Indices,
        keep: Keep,
        start: Anchor,
        tol: float,
        *,
        watch: bool,
    ) -> None:
        self.lanes, self.side, self.samples, self.keep = lanes, side, samples, keep
        self.tol, self.watch = tol, watch
        self.time, self.sound = start.time, start

    def run(self) -> tuple[int, PoseFailure | None]:
        """Follow all samples; see `advance`."""
        return self.advance(0, len(self.samples))

    def follow(self, at: int, stop: int, parts: int) -> int:
        """Follow samples as far as they need no look, or else as many at once as there are lanes,
        up to the first failure.
        """
        lanes, self._parts = self.lanes, parts
        if self.watch and lanes.sound:
            self.sound = lanes.anchor(self.time)
        if not self.watch and (count := self._walk(self.samples[at:stop])):
            return at + count
        accepted, ahead = 0, self.samples[at : min(at + lanes.many, stop)]
        if self.watch or not lanes.refused:
            accepted = leading(lanes.attempt_at(self.side.inputs(ahead), neighbours=True))
        if not accepted:
            if lanes.sound and not self.watch:
                self.sound = lanes.anchor(self.time)
            return at
        self.keep(ahead[:accepted], lanes.motions(accepted), lanes.worst[:, :accepted], False)
        lanes.carry(accepted - 1)
        self.time = float(self.side.times[ahead[accepted - 1]])
        return at + accepted

    def _walk(self, ahead: Indices) -> int:
        """Follow samples that need no look; return how many there are."""
        first, side = int(ahead[0]), self.side
        if first + len(ahead) == len(side.times) and first <= ahead[-1]:
            given = [each[:, first:] for each in side.given] if first else side.given
        else:
            given = side.inputs(np.append(ahead, ahead[-1:].repeat(self.lanes.many)))
        motions, tests = self.lanes.walk(given, len(ahead))
        if count := tests.shape[1]:
            self.keep(ahead[:count], motions, tests, True)
            self.time = float(self.side.times[ahead[count - 1]])
        return count

    def follow_part(self, at: int) -> PoseFailure | None:
        """Follow equal parts of a step that fails, as neighbours, and else the longest accepted
        part.
        """
        lanes, path, wanted = self.lanes, self.side.path, float(self.side.times[self.samples[at]])
        if not self._parts:
            # the last part is left: a sample ends an iteration of its own
            parts = np.arange(1.0, lanes.many) / lanes.many
            times: Array = self.time + (wanted - self.time) * parts
            if accepted := lanes.reach(times, path):
                self.time = float(times[accepted - 1])
                return None
        reached = part_of_step(
            self.time, wanted, lambda times: lanes.attempt(times, path), lanes.many
        )
        if reached is None:
            return lanes.failure(self.tol)
        lane, self.time = reached
        lanes.carry(lane)
        return None


class _Run:
    """One solution of a sweep: the motions and tests of samples, the bounds of errors of those that
    are refused, and words on the way.

    Args:
        count: number of samples to keep.
    """

    def __init__(self, lanes: Lanes, tol: float, count: int = 0) -> None:
        self.lanes, self.tol, self.columns = lanes, tol, lanes.columns
        self.table = np.full((self.columns.count, count), np.nan)
        self.worst = np.full((len(WORST), count), np.nan)
        self.refuse_uncertain = dict[int, float]()
        self.messages, self.notes = list[str](), list[str]()
        self.failures = list[FailureKind]()

    def end(self, message: str, failure: FailureKind) -> None:
        """Add the reason of missing samples."""
        self.messages.append(message)
        self.failures.append(failure)

    def keep(
        self, side: _Side, samples: Indices, motions: Array, tests: Array, certain: bool
    ) -> None:
        """Keep samples of a side; see `Keep`."""
        at = side.order[samples]
        self.table[:, at], self.worst[:, at] = motions, tests
        if certain:
            return
        doubtful = np.flatnonzero(is_uncertain(tests[SIGMAS], tests[CLOSURES], self.tol))
        if len(doubtful):
            for lane, error in self.lanes.uncertain(doubtful, self.tol, side.path).items():
                self.refuse_uncertain[int(at[lane])] = error

    def follow(
        self, side: _Side, start: Anchor, keep: Keep, *, watch: bool = False
    ) -> tuple[Anchor, Anchor | None] | None:
        """Follow the samples of a side outwards, over singular poses too; add the message of an
        end.

        Returns:
            A sound pose before the last sample, and the pose there, None if it was reached from
            beyond; None if it is not reached.
        """
        lanes, path, times = self.lanes, side.path, side.times
        left, refused = np.arange(len(times)), list[int]()
        lanes.solve_near(start, self.tol)
        came: tuple[Anchor, Anchor | None] | None = None
        while len(left):
            ahead = BlockWalk(lanes, side, left, keep, start, self.tol, watch=watch)
            count, failure = ahead.run()
            left = left[count:]
            if failure is None:
                came = (ahead.sound, lanes.anchor(ahead.time)) if watch else None
                break
            at = int(left[0])
            wanted, last = float(times[at]), float(times[at - 1]) if at else None
            near, passed = lanes.anchor(ahead.time), None
            if failure.kind is not FailureKind.TOO_MANY_PARTS:
                way = wanted - near.time
                passed = self.pass_over(path, ahead.sound, near, near.time, way, rates=False)
            if passed is None:
                self.end(path.end_message(ahead.time, wanted, last, str(failure)), failure.kind)
                return None
            self.notes.append(f"crosses a singular pose near {path.where(ahead.time)}; {CONTINUED}")
            start = passed.poses[-1]
            beside = left[np.abs(times[left] - ahead.time) <= abs(start.time - ahead.time)]
            left = left[len(beside) :]
            lanes.solve_near(start, self.tol)
            back = BlockWalk(lanes, side, beside[::-1], keep, start, self.tol, watch=watch)
            reached, _ = back.run()
            for each in beside[: len(beside) - reached].tolist()[:BRIDGED]:
                if not self.interpolate(side, each, ahead.sound, None):
                    refused.append(each)
            lanes.solve_near(start, self.tol)
            came = start, None
        if refused:
            places = list_names([path.where(float(times[k])) for k in refused])
            self.end(
                f"refused at {places}: so near a singular pose that neither side reaches it; keep"
                " away from it",
                FailureKind.UNCERTAIN,
            )
        return came

    def pass_over(
        self,
        path: Path,
        sound: Anchor,
        near: Anchor | None,
        time: float,
        way: float,
        *,
        rates: bool = True,
    ) -> PassedSingularity | None:
        """Pass a time on a path, see `continuation.singular_poses.pass_over`."""
        lanes, tol = self.lanes, self.tol

        def reach(at: Anchor, time: float, crossing: bool) -> Anchor | None:
            lanes.solve_near(at, tol, crossing=crossing)
            here = at.time
            # parts of a step over a singular pose at which the motion turns back end at the pose
            for _ in range(FEW if crossing else MOST):
                parts: Array = here + (time - here) * 0.5 ** np.arange(0.0, HALVED)
                part = longest(lanes.attempt(parts, path))
                if part is None:
                    return None
                lanes.carry(part)
                if part == 0:
                    return lanes.carried_anchor(time)
                here = float(parts[part])
            return None

        measure = partial(interpolation_error, self.columns.by_vector, lanes.unit, rates=rates)
        known = near and (near.numbers.state, NEARLY)
        return pass_over(sound, known, time, way, reach, measure, AMPLIFIED * tol)

    def interpolate(self, side: _Side, at: int, sound: Anchor, near: Anchor | None) -> bool:
        """Replace a sample by interpolation between eight poses around it; return whether they are
        on one smooth curve, with the pose at the sample if it is known.
        """
        time, k = float(side.times[at]), int(side.order[at])
        passed = self.pass_over(side.path, sound, near, time, time - sound.time)
        if passed is None:
            return False
        self.table[:, k] = passed.motions
        tests = self.worst[:, k]
        tests[np.isnan(tests)] = 0.0
        self.notes.append(
            f"passes a singular pose at {side.path.where(time)}; {CONTINUED}, interpolated"
            f" there to {passed.error:.1g} of the mechanism's size and of the rates"
        )
        return True

    def interpolate_refused(self, side: _Side, start: Anchor) -> None:
        """Replace refused samples by interpolation between both sides of them, where the motion
        continues.
        """
        for at in np.flatnonzero([int(k) in self.refuse_uncertain for k in side.order]).tolist():
            ahead = replace(side, times=side.times[: at + 1])
            came = _Run(self.lanes, self.tol).follow(ahead, start, _keep_none, watch=True)
            if came is not None and self.interpolate(side, at, *came):
                del self.refuse_uncertain[int(side.order[at])]

    def take_away(self, path: Path) -> None:
        """Take away the samples left uncertain, and say so."""
        refused = self.refuse_uncertain
        if refused:
            self.table[:, [*refused]] = np.nan
            self.worst[:, [*refused]] = np.nan
            worst = max(refused, key=refused.__getitem__)
            there = path.where(float(path.times[worst]))
            self.end(
                f"refused at {number_of(len(refused), 'sample')} so near a singular pose that"
                " residuals leave the pose or its rates uncertain, by up to"
                f" {refused[worst]:.2g} (at {there}), allowed {AMPLIFIED * self.tol:.2g}; keep away"
                " from it",
                FailureKind.UNCERTAIN,
            )

    def trajectory(self) -> Trajectory:
        """Return what is kept."""
        solved = ~np.isnan(self.worst[CLOSURES])
        worst = self.worst if solved.all() else self.worst[:, solved]
        largest = (largest_found(each) for each in (*worst[: len(LARGEST)], -worst[SIGMAS]))
        closure, leftover, sigma = largest
        return solution(
            self.table.T,
            self.columns.points,
            self.columns.bodies,
            unit=self.lanes.unit,
            solved=solved,
            iterations=self.worst[WORST.index(ITERATIONS)],
            closure=closure,
            leftover=leftover,
            message="; ".join(self.messages),
            failures=self.failures,
            account=self.lanes.details,
            findings={
                "smallest_singular_value": min(-sigma, 1.0),
                **self.lanes.findings,
                **({"notes": self.notes} if self.notes else {}),
            },
        )


class BlockSweep:
    """A path through blocks bound to lanes; solved as often as wanted."""

    def __init__(self, lanes: Lanes, path: Path, start: Start | None = None) -> None:
        self._lanes, self._mechanism, self.path = lanes, lanes.mechanism, path
        self.start = start or start_of(self._mechanism, path)

    def solve(self, tol: float) -> Trajectory:
        """The motion at all samples; see `solve`."""

        def by(start: Start) -> Trajectory:
            own = start is self.start
            return (self if own else BlockSweep(self._lanes, self.path, start))._solve(tol)

        return solve_from_start(
            self.start, self._mechanism, self.path, by, compare=np.isfinite(tol)
        )

    def _solve(self, tol: float) -> Trajectory:
        departure, way = self._departure
        run = _Run(self._lanes, tol, len(self.path.times))
        run.messages, run.notes, run.failures = [*way.messages], [*way.notes], [*way.failures]
        self._lanes.begin()
        if departure is not None:
            for side in self._sides:
                run.follow(side, departure, partial(run.keep, side))
            for side in self._sides if 0 < len(run.refuse_uncertain) <= BRIDGED else ():
                run.interpolate_refused(side, departure)
        run.take_away(self.path)
        return run.trajectory()

    @cached_property
    def _sides(self) -> list[_Side]:
        """The samples of each side of the start, outwards."""
        path, sides = self.path, outwards(self.path.times, self.start.time)
        return [_Side.of(self._lanes, path, side, path.times[side]) for side in sides]

    @cached_property
    def _departure(self) -> tuple[Anchor | None, _Run]:
        """The start of the sweep: the pose there, None if it cannot be reached, and words on the
        way.
        """
        lanes, path, begin, run = self._lanes, self.path, self.start, _Run(self._lanes, CLOSED)
        lanes.solve_near(lanes.design, CLOSED)
        if way := begin.lead:
            lanes.set_prediction_start(0.0, way)
            side = _Side.of(lanes, way, np.arange(2), np.array([0.0, 1.0]))
            run.follow(side, lanes.anchor(0.0), _keep_none)
            if run.messages:
                run.messages[:] = [f"on the way to {begin.name}: {run.messages[0]}"]
                return None, run
        failure = lanes.set_prediction_start(begin.time, path)
        if failure is not None:
            run.end(f"the motion cannot start at {path.where(begin.time)}: {failure}", failure.kind)
            return None, run
        return lanes.anchor(begin.time), run


def _keep_none(samples: Indices, motions: Array, tests: Array, certain: bool) -> None:
    """Keep none of the samples."""
