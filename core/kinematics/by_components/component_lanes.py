"""Components of a cascade bound to lanes, one sample a lane.

All lanes are predicted from one pose: the last sample accepted by every component.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import groupby

import numpy as np

from ...mechanism.motions import Path
from ...program import MARGIN, Parts, Plan
from ...program.memory import aligned
from ...trajectory import Array
from ..compiled.request import (
    EARLIER,
    FROM,
    LARGEST_SIGMA,
    RATE,
    RATE_T,
    SIGMA,
    TIME,
)
from ..compiled.sample_rows import LARGEST_OF_PARTS, SMALLEST_OF_PARTS
from .block_solver import Cascade

WORST = (*LARGEST_OF_PARTS, *SMALLEST_OF_PARTS)
"""Tests of which the worst of all components is known."""
# A pose with smallest singular values above this part of their largest is sound enough to look over
# a singular pose from.
SOUND = 0.1


class Lanes:
    """A cascade bound to lanes: the world, and calls for its components in order, one for
    neighbours of one type.

    Attributes:
        world: all solved quantities, shape (rows, room); see `Cascade`.
        worst: the worst of all components, shape (WORST, room).
        last: the lane of the last time of the last attempt.
    """

    def __init__(self, cascade: Cascade, lanes: int) -> None:
        self.cascade, self.lanes, self.last = cascade, lanes, 0
        executors = {id(kind): kind.model.executor(lanes) for kind in cascade.kinds}
        room, self._groups = (
            max(each.room for each in executors.values()),
            next(iter(executors.values())).groups,
        )
        self.world = aligned(cascade.rows * room).reshape(-1, room)
        self.world[:] = 0.0
        self.worst = aligned(len(WORST) * room).reshape(-1, room)
        self._best = cascade.kinds[0].model.plan.best
        self._fixed = [kind.fixed.copy() for kind in cascade.kinds]
        self._ahead = [kind.fixed.copy() for kind in cascade.kinds]
        self._samples = [
            aligned(len(kind.model.sampled) * room).reshape(-1, room) for kind in cascade.kinds
        ]
        self._carried = [_carried(kind.model.plan) for kind in cascade.kinds]
        # from what is fixed now, and from what is ahead
        self._calls: list[list[Callable[[int], object]]] = [[], []]
        self._parts: list[Parts] = []  # calls know addresses, not arrays
        number = {id(kind): k for k, kind in enumerate(cascade.kinds)}
        for k, run in groupby(
            range(len(cascade.parts)), key=lambda part: number[id(cascade.place[part][0])]
        ):
            kind, parts = cascade.kinds[k], [*run]
            members = np.array([cascade.place[part][1] for part in parts], dtype=np.int64)
            rows = [
                [row for body in cascade.parts[part].given for row in cascade.body_rows(body)]
                for part in parts
            ]
            taken = np.array(rows, dtype=np.int64).reshape(len(parts), -1)
            now, ahead = self._fixed[k], self._ahead[k]
            for calls, (fixed, other) in zip(
                self._calls, ((now, ahead), (ahead, now)), strict=True
            ):
                self._parts.append(
                    Parts(
                        members,
                        fixed,
                        other,
                        self._samples[k],
                        taken,
                        self.world,
                        kind.base,
                        self.worst,
                    )
                )
                calls.append(executors[id(kind)].parts(self._parts[-1]))

    def accept_by(self, tolerances: Mapping[str, float]) -> None:
        """Set the tolerances."""
        for kind, fixed in zip(self.cascade.kinds, self._fixed, strict=True):
            for name, value in tolerances.items():
                fixed[:, kind.column[name]] = value

    def stand_at(self, time: float) -> None:
        """Set the time of the pose before the lanes, with no step behind it, as on another path."""
        for kind, fixed in zip(self.cascade.kinds, self._fixed, strict=True):
            fixed[:, [kind.column[FROM + TIME], kind.column[EARLIER + TIME]]] = time

    @property
    def anchor(self) -> list[Array]:
        """The pose before the lanes, to be restored later."""
        return [fixed.copy() for fixed in self._fixed]

    @anchor.setter
    def anchor(self, anchor: Sequence[Array]) -> None:
        for fixed, kept in zip(self._fixed, anchor, strict=True):
            fixed[:] = kept

    def attempt(self, times: Array, path: Path) -> Array:
        """Solve all components at times, up to the number of lanes; return the margin of each time,
        positive if accepted.
        """
        return self.attempt_at(self.sampled(times, path))

    def sampled(self, times: Array, path: Path) -> list[Array]:
        """Return the inputs at times by component type, shape (sampled, times); types without
        drivers share one table.
        """
        models, alone = [kind.model for kind in self.cascade.kinds], times[None]
        driven = [(model, model.request.drivers) for model in models]
        return [
            model.samples(times, path.drive(names, times)) if names else alone
            for model, names in driven
        ]

    def attempt_at(self, tables: Sequence[Array]) -> Array:
        """Attempt all components as `attempt` does, with tables from `sampled`."""
        count = tables[0].shape[1]
        self.last = count - 1
        for table, samples in zip(tables, self._samples, strict=True):
            samples[:, :count] = table
            samples[:, count:] = table[:, count - 1 :]
        self.worst[:] = self._best
        groups = self._groups(count)
        for call in self._calls[0]:
            call(groups)
        return self.worst[WORST.index(MARGIN), :count].copy()

    def each(self, name: str) -> Array:
        """Return a kept test of all components, shape (components, room)."""
        found: list[Array] = []
        for kind in self.cascade.kinds:
            size, first = kind.model.kept, kind.base + kind.model.rows[name].start
            found.append(self.world[first : kind.base + size * len(kind.members) : size])
        return np.concatenate(found)

    def kept(self, *, rates: bool = False) -> Array:
        """States of all components, or their rates and the rates of those, shape (numbers,
        room).
        """
        found: list[Array] = []
        for kind in self.cascade.kinds:
            names = (RATE, RATE_T) if rates else kind.model.state
            rows = np.concatenate(
                [np.arange(kind.model.kept)[kind.model.rows[name]] for name in names]
            )
            first = kind.base + kind.model.kept * np.arange(len(kind.members))
            found.append(self.world[(first[:, None] + rows).ravel()])
        return np.concatenate(found)

    def stands(self, *, rates: bool = False) -> Array:
        """Return the same of the pose before the lanes, shape (numbers,)."""
        found: list[Array] = []
        for kind, fixed in zip(self.cascade.kinds, self._fixed, strict=True):
            names, slots = (
                (RATE, RATE_T) if rates else kind.model.state,
                list(kind.model.plan.fixed),
            )
            columns = [
                slots.index(slot) for name in names for slot in kind.model.vectors[FROM + name]
            ]
            found.append(fixed[:, columns].ravel())
        return np.concatenate(found)

    @property
    def sound(self) -> bool:
        """Whether no component is nearly singular at the pose before the lanes."""
        for kind, fixed in zip(self.cascade.kinds, self._fixed, strict=True):
            sigma, largest = (fixed[:, kind.column[FROM + name]] for name in (SIGMA, LARGEST_SIGMA))
            if not (sigma >= SOUND * largest).all():
                return False
        return True

    def go_on(self) -> None:
        """Predict from the last lane from now on; its values are in place."""
        self._fixed, self._ahead = self._ahead, self._fixed
        self._calls.reverse()

    def carry(self, lane: int) -> None:
        """Predict from a solved lane from now on, whichever it is."""
        for kind, fixed, samples, carried in zip(
            self.cascade.kinds, self._fixed, self._samples, self._carried, strict=True
        ):
            size, count = kind.model.kept, len(kind.members)
            solved = self.world[kind.base : kind.base + size * count, lane].reshape(count, size)
            tables = solved, samples[None, :, lane], fixed
            values = [
                table[:, sources] for table, (sources, _) in zip(tables, carried, strict=True)
            ]
            for (_, targets), each in zip(carried, values, strict=True):
                fixed[:, targets] = each


def _carried(plan: Plan) -> list[tuple[list[int], list[int]]]:
    """Return the carried columns of kept, sampled and fixed values, and their targets among the
    fixed ones.
    """
    column = [
        {slot: k for k, slot in enumerate(slots)} for slots in (plan.kept, plan.sampled, plan.fixed)
    ]
    found: list[tuple[list[int], list[int]]] = [([], []) for _ in column]
    for source, target in plan.carried:
        k = next(k for k, each in enumerate(column) if source in each)
        found[k][0].append(column[k][source])
        found[k][1].append(column[-1][target])
    return found
