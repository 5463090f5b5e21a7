"""A path made ready for a model: the start of its samples, and the weights of their predictions.

The design position is on the path if the drivers have their design values there, up to six typed
digits: at time zero, or else at a sample. Otherwise all drivers are assumed to go straight to the
start. Every engine takes the same start. Any difference between design and path is travelled, never
ignored.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...caches import ThreadCache, cache_last
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...program import NODES, Side, groups_behind, place_of
from ...program.numpy_executor import lagrange
from ...trajectory import Array, Trajectory
from .compiled_model import CLOSED, RECENT, Model, is_builtin, recent_model
from .request import Request

# Six digits leave a number uncertain by up to 5e-6 of it. A driver's value and its design value are
# made of some six such numbers: amplitude, phase, three coordinates and a direction.
TYPED = 3e-5
# Times that differ by less than this part of the largest are one: more than rounding, less than
# anyone writes.
SAME_TIME = 1e-12
# Two ways end in one motion if its points differ by less than this part of the size: more than
# round-off beside a singular pose, less than the distance of two assemblies.
APART = 1e-6


@dataclass(frozen=True, eq=False)
class Start:
    """A time on a path, and the way of the drivers from the design position to there.

    Attributes:
        time: the samples are followed from here, both ways [s].
        name: of the time, for messages.
        lead: straight way to the start, which ends at its time one; None if the design position is
            there up to rounding.
        stands: whether the design position is there up to typed digits.
        other: another possible start, or None.
        ambiguous: whether only a rule prefers this start to the other.
    """

    time: float = 0.0
    name: str = "time zero"
    lead: Path | None = None
    starts_at_design: bool = True
    other: Start | None = None
    ambiguous: bool = False

    @cached_property
    def facts(self) -> Mapping[str, Any]:
        """Return the time, and how far the drivers go straight to there [SI], for the record."""
        way = dict[str, float]()
        if self.lead:
            way = dict(
                zip(self.lead.motions, self.lead.values(np.ones(1))[:, 0].tolist(), strict=True)
            )
        return {"time": self.time, "lead": way}


AT_DESIGN = Start()


def start_of(mechanism: Mechanism, path: Path) -> Start:
    """Return the start of the samples of a path.

    The design position decides if it is on the path, at time zero or else at the nearest sample. If
    not, all drivers go straight to their values at time zero if the samples lie around it, else to
    those at the first sample: the pose of a sample must not depend on the first sample of a sweep.
    """
    times = path.times
    known = path.covers(0.0)
    if not len(times) or (known and not path.values(np.zeros(1)).any()):
        return AT_DESIGN
    places = np.concatenate([np.zeros(1), times]) if known else times
    values = path.values(places)
    off = (np.abs(values) / _scales(mechanism, path, values)[:, None]).max(axis=0, initial=0.0)
    nearest = np.argsort(np.abs(places), kind="stable")
    same = SAME_TIME * float(np.abs(times).max())
    here = [k for k in nearest.tolist() if off[k] <= TYPED]
    first = _start(path, float(times[0]), float(off[-len(times)]))
    zero = (
        _start(path, 0.0, float(off[0]))
        if known and np.isfinite(off[0]) and abs(first.time) > same
        else None
    )
    if here:
        found = _start(path, float(places[here[0]]), float(off[here[0]]))
        again = [k for k in here if abs(float(places[k]) - found.time) > same]
        if abs(found.time) > same and again:
            return replace(
                found,
                other=_start(path, float(places[again[0]]), float(off[again[0]])),
                ambiguous=True,
            )
        others = [
            each
            for each in (first, zero)
            if each is not None and abs(each.time - found.time) > same
        ]
        return replace(found, other=others[0] if others else None)
    if zero is None:
        return first
    around = float(times.min()) <= same and float(times.max()) >= -same
    taken, other = (zero, first) if around else (first, zero)
    return replace(taken, other=other, ambiguous=True)


def _scales(mechanism: Mechanism, path: Path, values: Array) -> Array:
    """Return the scales of the moving drivers' values [m or rad], shape (drivers,): a radian or the
    mechanism's size, or the largest number in the values.
    """
    size, given = (
        mechanism.size,
        np.where(np.isfinite(values), np.abs(values), 0.0).max(axis=1, initial=0.0),
    )
    own = [1.0 if mechanism.driver(name).turns else size for name in path.motions]
    return np.maximum(
        np.maximum(own, given), [abs(path.design.get(name, 0.0)) for name in path.motions]
    )


def _start(path: Path, time: float, off: float) -> Start:
    first = float(path.times[0])
    name = (
        "the first sample"
        if time == first
        else "time zero"
        if time == 0.0
        else f"the sample at {time:.9g} s"
    )
    return Start(time, name, None if off <= CLOSED else path.lead_in(time), off <= TYPED)


def solve_from_start(
    start: Start,
    mechanism: Mechanism,
    path: Path,
    solve: Callable[[Start], Trajectory],
    *,
    compare: bool = True,
) -> Trajectory:
    """Solve from a start, or from the other one if no sample is reached; add notes on the
    assumptions.

    Args:
        solve: solves all samples from a start.
        compare: whether the numbers are exact enough to compare two starts.
    """
    found, taken, other = solve(start), start, start.other
    notes: list[str] = []
    if other is not None and not found.solved.any():
        second = solve(other)
        if second.solved.any():
            notes.append(f"no sample can be reached by way of {start.name} ({found.message})")
            found, taken = second, other
    elif other is not None and start.ambiguous and compare:
        notes += _differ(start, other, found, solve(other), mechanism.size)
    notes = [
        *found.details.get("notes", ()),
        *notes,
        *(notes_on_start(taken, path) if found.solved.any() else ()),
    ]
    return replace(
        found,
        details={**found.details, "start": taken.facts, **({"notes": notes} if notes else {})},
    )


def notes_on_start(start: Start, path: Path) -> list[str]:
    """Return notes on the assumed way from the design position to the path; none if it is on the
    path.
    """
    if start.starts_at_design:
        return []
    way = (
        f"all drivers go straight from it to {start.name} ({path.where(start.time)}), and are"
        " followed from there"
    )
    return [f"the design position is not on the path: {way}"]


def _differ(
    start: Start, other: Start, found: Trajectory, second: Trajectory, size: float
) -> list[str]:
    """Return a note on the difference of the motions from two starts; none if they are one."""
    both = found.solved & second.solved
    apart = [
        motion.position - second.points[name].position for name, motion in found.points.items()
    ]
    for name, body in found.bodies.items():
        apart += [
            body.r - second.bodies[name].r,
            size * _turn_between(body.p, second.bodies[name].p),
        ]
    worst = max((float(np.abs(each[both]).max(initial=0.0)) for each in apart), default=0.0)
    if worst <= APART * size:
        return []
    return [
        f"AMBIGUOUS: by way of {other.name} the results differ by up to {worst:.6g} m (another"
        f" assembly, or another number of turns); {start.name} is taken; make the design position"
        " the pose at time zero, or begin the sweep there"
    ]


def _turn_between(p: Array, q: Array) -> Array:
    """Return how far two sets of Euler parameters are apart; p and -p are the same."""
    return np.minimum(np.abs(p - q).max(axis=1), np.abs(p + q).max(axis=1))


def weights_of_groups(times: Array, lanes: int) -> Array:
    """Return the weights of `NODES` lanes of the previous groups, for samples in groups of so many
    lanes.

    Args:
        times: of the samples in the order of the walk, shape (n,).

    Returns:
        Shape (NODES, n): zero for the first groups, not finite if two nodes share a time.
    """
    behind = groups_behind(lanes) * lanes
    found, wanted = np.zeros((NODES, len(times))), np.arange(behind, len(times))
    nodes = [[group * lanes + lane] for group, lane in (place_of(k, lanes) for k in range(NODES))]
    found[:, wanted] = lagrange(times[wanted], times[wanted // lanes * lanes - behind + nodes])
    return found


def weights_of_samples(times: Array) -> Array:
    """Weights of the `NODES` samples before each, by the places at which they are kept
    (`Plan.past`); otherwise as above.
    """
    found, wanted = np.zeros((NODES, len(times))), np.arange(NODES, len(times))
    # the last sample that was kept at each place
    nodes = wanted - 1 - (wanted - 1 - np.arange(NODES)[:, None]) % NODES
    found[:, wanted] = lagrange(times[wanted], times[nodes])
    return found


# Lanes of the numpy executor: many share the overhead of a call, and the block of a mechanism of
# few bodies stays below a megabyte.
LANES = 256
# Routes of more samples are not kept: to make them takes a small part of what solving them does,
# and megabytes.
LONGEST_KEPT = 10_000
# Samples that are in the order of their times.
AS_THEY_ARE = slice(None)


@dataclass(frozen=True, eq=False)
class Route:
    """A path made ready for a model, independent of the motion.

    Attributes:
        design: all slots of a lane at the design position of a variant; the model's own by default.
        since: time of that lane on the path, if it is not at the design position but on the way.
        given: start of the samples, if not `start_of` the path.
    """

    model: Model
    path: Path
    design: Array | None = None
    since: float | None = None
    given: Start | None = None

    @cached_property
    def begin(self) -> Start:
        """The start of the samples, if its lane is not on the way."""
        return self.given or start_of(self.model.mechanism, self.path)

    @cached_property
    def starts_at_design(self) -> bool:
        """Whether the lane it starts from stands on the path: at the design position, or on the
        way.
        """
        return self.since is not None or self.begin.lead is None

    @cached_property
    def single(self) -> bool:
        """Whether the design position is its start, and nothing else can be."""
        return self.starts_at_design and self.begin.other is None

    @cached_property
    def details(self) -> Mapping[str, Any]:
        """Details of the model and the start for the record of a solution."""
        return {**self.model.details, "start": self.begin.facts}

    @cached_property
    def start(self) -> float:
        """The time it starts at."""
        return self.begin.time if self.since is None else self.since

    def by(self, start: Start) -> Route:
        """Return the route from another start; kept with this one."""
        return (
            self
            if start is self.begin
            else self.thread_cache(start, lambda: replace(self, given=start))
        )

    @cached_property
    def by_time(self) -> NDArray[np.intp]:
        """The samples by time."""
        return np.argsort(self.path.times, kind="stable")

    @cached_property
    def back(self) -> NDArray[np.intp] | slice:
        """Order or slice from samples sorted by time back to the wanted order."""
        n = len(self.path.times)
        for simple in (AS_THEY_ARE, slice(None, None, -1)):
            if (self.by_time == np.arange(n)[simple]).all():
                return simple
        return np.argsort(self.by_time, kind="stable")

    @cached_property
    def origin(self) -> Array:
        """The given values at the start, shape (sampled,)."""
        return self.sampled(np.array([self.start]))[:, 0]

    @cached_property
    def departure(self) -> Array:
        """All slots of a lane at the design position, with the rates of the start."""
        return self.model.prediction_start(
            self.model.design if self.design is None else self.design, self.origin
        )

    @cached_property
    def count_before_start(self) -> int:
        """How many samples are before the start."""
        return int(np.searchsorted(self.path.times[self.by_time], self.start, side="left"))

    @cached_property
    def sides(self) -> tuple[Side, ...]:
        """The side after the start and the side before it, as far as there are samples."""
        return self.sides_in_parts(1)

    def sides_in_parts(self, parts: int) -> tuple[Side, ...]:
        """The sides with every step in equal parts, the last of which ends at the sample; see
        `ends`.
        """
        times = self.path.times[self.by_time]
        n, below, executor = len(times), self.count_before_start, self.model.executor(self.lanes)
        found: list[Side] = []
        for columns, step in ((np.arange(below, n), 1), (np.arange(below - 1, -1, -1), -1)):
            if len(columns):
                given = _in_parts(self.start, times[columns], parts)
                samples = np.concatenate(
                    [self.sampled(given), weights_of_groups(given, executor.group)]
                )
                padded = np.concatenate(
                    [samples, np.repeat(samples[:, -1:], executor.margin, axis=1)], axis=1
                )
                found.append(Side(padded, len(given), parts * below - (step < 0), step))
        return tuple(found)

    def ends(self, parts: int) -> NDArray[np.intp]:
        """Return the samples by time, as positions among the equal parts of all steps."""
        n = len(self.path.times)
        return parts * np.arange(n) + np.where(np.arange(n) < self.count_before_start, 0, parts - 1)

    def for_motions(self, parts: int = 1) -> tuple[Array, ...]:
        """Return the samples of each side, for lanes with motions of their own."""

        def made() -> tuple[Array, ...]:
            given = [
                side.samples[: len(self.origin), : side.count]
                for side in self.sides_in_parts(parts)
            ]
            return tuple(np.concatenate([each, weights_of_samples(each[0])]) for each in given)

        return self.thread_cache(parts, made)

    @cached_property
    def lanes(self) -> int:
        """How many samples are tried at once."""
        return min(LANES, max(1, len(self.path.times)))

    @cached_property
    def thread_cache(self) -> ThreadCache:
        """Cache for each thread."""
        return ThreadCache()

    def sampled(self, times: Array) -> Array:
        """Return the given values at the times, shape (sampled, n)."""
        return self.model.samples(self.path, times)


def _in_parts(start: float, times: Array, parts: int) -> Array:
    """Times with each step to them, the first one from the start, in equal parts."""
    before = np.concatenate([[start], times[:-1]])[:, None]
    found = before + (times[:, None] - before) * (np.arange(1, parts + 1) / parts)
    found[:, -1] = times
    return found.ravel()


def _is_kept(mechanism: Mechanism, _: Request, path: Path) -> bool:
    return len(path.times) <= LONGEST_KEPT and path.is_builtin and is_builtin(mechanism)


@cache_last(RECENT, when=_is_kept)
def recent_route(mechanism: Mechanism, request: Request, path: Path) -> Route:
    """A route, and the same for the same mechanism, request and path as long as it is among the
    last few asked for.

    To make one and bind it to lanes takes twenty times as long as to solve it.
    """
    return Route(recent_model(mechanism, request), path)
