"""A path made ready for a model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...caches import ThreadCache, keep_last
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...program import Side
from ...trajectory import Array
from .compiled_model import RECENT, Model, recent_model
from .interpolation import weights_of_groups, weights_of_samples
from .motion_start import Start, start_of
from .program_cache import is_builtin
from .request import Request

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
    def stands(self) -> bool:
        """Whether the lane it starts from stands on the path: at the design position, or on the
        way.
        """
        return self.since is not None or self.begin.lead is None

    @cached_property
    def single(self) -> bool:
        """Whether the design position is its start, and nothing else can be."""
        return self.stands and self.begin.other is None

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
            self if start is self.begin else self.bound(start, lambda: replace(self, given=start))
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
        return self.model.departing(
            self.model.design if self.design is None else self.design, self.origin
        )

    @cached_property
    def below(self) -> int:
        """How many samples are before the start."""
        return int(np.searchsorted(self.path.times[self.by_time], self.start, side="left"))

    @cached_property
    def sides(self) -> tuple[Side, ...]:
        """The side after the start and the side before it, as far as there are samples."""
        return self.divided(1)

    def divided(self, parts: int) -> tuple[Side, ...]:
        """The sides with every step in equal parts, the last of which ends at the sample; see
        `ends`.
        """
        times = self.path.times[self.by_time]
        n, below, executor = len(times), self.below, self.model.executor(self.lanes)
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
        return parts * np.arange(n) + np.where(np.arange(n) < self.below, 0, parts - 1)

    def for_motions(self, parts: int = 1) -> tuple[Array, ...]:
        """Return the samples of each side, for lanes with motions of their own."""
        return self.bound(parts, lambda: self._for_motions(parts))

    def _for_motions(self, parts: int) -> tuple[Array, ...]:
        given = [side.samples[: len(self.origin), : side.count] for side in self.divided(parts)]
        return tuple(np.concatenate([each, weights_of_samples(each[0])]) for each in given)

    @cached_property
    def lanes(self) -> int:
        """How many samples are tried at once."""
        return min(LANES, max(1, len(self.path.times)))

    @cached_property
    def bound(self) -> ThreadCache:
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


def recent_route(mechanism: Mechanism, request: Request, path: Path) -> Route:
    """A route, and the same for the same mechanism, request and path as long as it is among the
    last few asked for.

    To make one and bind it to lanes takes twenty times as long as to solve it.
    """
    kept = len(path.times) <= LONGEST_KEPT and path.is_builtin and is_builtin(mechanism)
    return (
        _recent(mechanism, request, path) if kept else Route(recent_model(mechanism, request), path)
    )


@keep_last(RECENT)
def _recent(mechanism: Mechanism, request: Request, path: Path) -> Route:
    return Route(recent_model(mechanism, request), path)
