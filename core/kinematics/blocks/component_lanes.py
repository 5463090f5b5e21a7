"""Components of a cascade bound to lanes, one sample a lane."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import groupby

import numpy as np

from ...failures import FailureKind, PoseFailure
from ...mechanism.motions import Path
from ...program import Parts, Plan
from ...program.plan import aligned
from ...trajectory import QUANTITIES, Array
from ..compiled.request import (
    EARLIER,
    FROM,
    LARGEST_SIGMA,
    RATE,
    RATE_T,
    SIGMA,
    TIME,
    slots_of,
)
from ..compiled.solution import Columns
from ..continuation.singular_crossing import SOUND, Numbers
from ..formulation.acceptance_criteria import AMPLIFIED, doubtful
from .cascade import Cascade
from .lanes import CLOSURES, MARGINS, SIGMAS, WORST, Anchor, Indices, Lanes
from .sparse_lanes import SparseLanes

# Samples at once: all are predicted from one pose, and the farther they are from it the more
# iterations they take, and the more are tried in vain; and what a large chain takes its time for is
# memory: with 24 one of 200 loops takes up to 1.6 times as long. With 8 one of 16 loops takes 1.3
# times as long.
LANES = 16
# Numbers of all components that stay in the second-level cache beside their programs; of more, half
# as many samples are taken at once: a chain of 1,000 loops takes 0.7 times as long.
CACHED = 500_000
BODY = ("r", "p", "rdot", "omega", "rddot", "omega_t")
STILL = 0.0, 0.0, 0.0


class ComponentLanes(Lanes):
    """A cascade bound to lanes: the world, and calls for its components in order, one for
    neighbours of one type. Each lane is attempted alone. Their number suits the cascade's size,
    unless it is given.

    Attributes:
        world: all solved quantities, shape (rows, room); see `Cascade`.
    """

    def __init__(self, cascade: Cascade, lanes: int = 0) -> None:
        lanes = lanes or (LANES if cascade.rows * LANES <= CACHED else LANES // 2)
        self.cascade, self.many = cascade, lanes
        self.mechanism, self.request = cascade.mechanism, cascade.request
        self.unit, self.details = cascade.unit, cascade.details
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
        self._columns, self._rows, self._still = self._outputs()
        self.design = self.anchor(0.0)

    def _outputs(self) -> tuple[Indices, Indices, Array]:
        """Return the columns of moving outputs with their rows of the world, and a column of the
        outputs at rest.
        """
        cascade, request = self.cascade, self.cascade.request
        every = Columns.of(request)
        columns, rows, still = list[int](), list[int](), np.zeros((every.count, 1))

        def add(vector: str, part: int | None, own: str, at_rest: Sequence[float]) -> None:
            place = every.by_vector[vector]
            if part is None:
                still[place, 0] = at_rest
                return
            kind, member = cascade.place[part]
            columns.extend(range(place.start, place.stop))
            rows.extend(kind.rows(own, member))

        for name in request.points:
            point = cascade.mechanism.point(name)
            part = cascade.part_of.get(point.body)
            own = "" if part is None else f"p{cascade.points[part].index(name)}"
            at_rest = {"position": point.position}
            for label in QUANTITIES[: request.order + 1]:
                add(f"{label} {name}", part, f"{label} {own}", at_rest.get(label, STILL))
        for name in request.bodies:
            body = cascade.mechanism.body(name)
            part = cascade.part_of.get(name)
            own = "" if part is None else f"b{cascade.parts[part].bodies.index(name)}"
            at_rest = {"r": body.origin, "p": body.euler_parameters}
            for label in BODY[: 2 * (request.order + 1)]:
                add(f"{label} {name}", part, f"{label} {own}", at_rest.get(label, STILL))
        return np.array(columns, np.intp), np.array(rows, np.intp), still

    def accept_by(self, limits: Mapping[str, float]) -> None:
        """See `Lanes`."""
        self._tol = limits["tolerance"]
        for kind, fixed in zip(self.cascade.kinds, self._fixed, strict=True):
            fixed[:, [kind.column[name] for name in limits]] = [*limits.values()]

    def depart(self, time: float, path: Path) -> PoseFailure | None:
        """See `Lanes`. The rates of the path where the mechanism stands are those of a sample."""
        for kind, fixed in zip(self.cascade.kinds, self._fixed, strict=True):
            fixed[:, [kind.column[FROM + TIME], kind.column[EARLIER + TIME]]] = time
        self.attempt(np.array([time]), path)
        self.carry(0)
        return None

    def anchor(self, time: float) -> Anchor:
        """See `Lanes`: values of `Plan.fixed`, by component type."""
        return Anchor(time, [fixed.copy() for fixed in self._fixed], self._numbers)

    def restore(self, anchor: Anchor) -> None:
        """See `Lanes`."""
        for fixed, kept in zip(self._fixed, anchor.pose, strict=True):
            fixed[:] = kept

    def sampled(self, times: Array, path: Path) -> list[Array]:
        """See `Lanes`: by component type; types without drivers share one table."""
        models, alone = (kind.model for kind in self.cascade.kinds), times[None]
        return [each.samples(path, times) if each.request.drivers else alone for each in models]

    def attempt_at(self, tables: Sequence[Array], *, neighbours: bool = False) -> Array:
        """See `Lanes`."""
        count = tables[0].shape[1]
        self.last, self._times = count - 1, tables[0][0]
        for table, samples in zip(tables, self._samples, strict=True):
            samples[:, :count] = table
            samples[:, count:] = table[:, count - 1 :]
        self.worst[:] = self._best
        groups = self._groups(count)
        for call in self._calls[0]:
            call(groups)
        return self.worst[MARGINS, :count].copy()

    def motions(self, count: int) -> Array:
        """See `Lanes`."""
        found = np.repeat(self._still, count, axis=1)
        found[self._columns] = self.world[self._rows, :count]
        return found

    def uncertain(self, count: int, path: Path) -> Mapping[int, float]:
        """See `Lanes`: the tests tell of doubt, by estimates; whether there is reason for it, the
        equations of the whole mechanism do.
        """
        closure, sigma = (self.worst[row, :count] for row in (CLOSURES, SIGMAS))
        if not doubtful(float(sigma.min()), float(closure.max()), self._tol):
            return {}
        at = np.flatnonzero(doubtful(sigma, closure, self._tol))
        state = np.stack([self._state(k) for k in at.tolist()], axis=1)
        sample = self._whole.sampled(self._times[at], path)[0]
        errors = self._whole.error_bounds(state, sample)
        limit, found = AMPLIFIED * self._tol, zip(at.tolist(), errors.tolist(), strict=True)
        return {k: error for k, error in found if not error <= limit}  # or it is no number

    @cached_property
    def _whole(self) -> SparseLanes:
        return SparseLanes(self.mechanism, replace(self.request, points=(), bodies=()))

    def _state(self, lane: int) -> Array:
        """Return the state of a lane as the equations of the whole mechanism have it."""
        names, cascade = self._whole.system.names, self.cascade
        found = np.zeros(len(self._whole.system.design))
        for k, part in enumerate(cascade.parts):
            kind, member = cascade.place[k]
            for name in kind.model.state:
                what, own = name.split(" ", 1)
                if what == "x":
                    joint, _, coordinate = own.rpartition(".")
                    whole = f"x {part.joints[int(joint[1:])].name}.{coordinate}"
                else:
                    whole = f"{what} {part.bodies[int(own[1:])]}"
                length = what == "u" or name.endswith(".translation")
                values = self.world[kind.rows(name, member), lane]
                found[names[whole]] = values * (cascade.unit / self._whole.unit if length else 1.0)
        return found

    def each(self, name: str) -> Array:
        """Return a kept test of all components, shape (components, room)."""
        found: list[Array] = []
        for kind in self.cascade.kinds:
            size, first = kind.model.kept, kind.base + kind.model.rows[name].start
            found.append(self.world[first : kind.base + size * len(kind.members) : size])
        return np.concatenate(found)

    def _numbers(self, pose: Sequence[Array]) -> Numbers:
        """Return the states of all components of an anchor, and their rates with the rates of
        those.
        """
        found: tuple[list[Array], list[Array]] = ([], [])
        for kind, fixed in zip(self.cascade.kinds, pose, strict=True):
            place, model = {slot: k for k, slot in enumerate(kind.model.plan.fixed)}, kind.model
            for each, names in zip(found, (model.state, (RATE, RATE_T)), strict=True):
                slots = slots_of(model.vectors, (FROM + name for name in names))
                each.append(fixed[:, [place[slot] for slot in slots]].ravel())
        return Numbers(*map(np.concatenate, found))

    @property
    def sound(self) -> bool:
        """See `Lanes`."""
        for kind, fixed in zip(self.cascade.kinds, self._fixed, strict=True):
            sigma, largest = (fixed[:, kind.column[FROM + name]] for name in (SIGMA, LARGEST_SIGMA))
            if not (sigma >= SOUND * largest).all():
                return False
        return True

    def go_on(self) -> None:
        """See `Lanes`: the values of the last lane are in place."""
        self._fixed, self._ahead = self._ahead, self._fixed
        self._calls.reverse()

    def carry(self, lane: int) -> None:
        """See `Lanes`."""
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

    def failure(self, tol: float) -> PoseFailure:
        """See `Lanes`: that of its unsolved component, or of the one nearest to singular."""
        cascade = self.cascade
        closure, sigma = (self.each(name)[:, self.last] for name in ("closure", SIGMA))
        closes = bool((closure <= tol).all())
        worst = int(np.nanargmin(sigma) if closes else np.nan_to_num(closure, nan=np.inf).argmax())
        order = [part for kind in cascade.kinds for part in kind.members]
        return PoseFailure(
            FailureKind.SINGULAR_AHEAD if closes else FailureKind.NOT_CONVERGED,
            closure[worst],
            tol,
            sigma=sigma[worst],
            where=f"the component of {', '.join(cascade.parts[order[worst]].bodies)}: ",
        )


def _carried(plan: Plan) -> list[tuple[Indices, Indices]]:
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
    return [(np.array(a, np.intp), np.array(b, np.intp)) for a, b in found]
