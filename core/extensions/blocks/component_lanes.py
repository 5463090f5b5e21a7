"""A large mechanism solved component by component: one program for all components built alike.

Every component reads the motion of prescribed bodies from a table of all solved quantities (the
world) and adds its own. `ComponentLanes` binds them to lanes, one sample a lane.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby
from typing import Any

import numpy as np

from ...errors import SolveError
from ...failures import FailureKind, PoseFailure
from ...kinematics.compiled.compiled_model import CLOSED, Model, compile_model
from ...kinematics.compiled.request import (
    ACCEPT,
    FROM,
    LARGEST_SIGMA,
    RATE,
    RATE_T,
    SIGMA,
    TIME,
    Request,
    slots_of,
)
from ...kinematics.compiled.solution import Columns
from ...kinematics.continuation.singular_poses import SOUND, Anchor, Numbers
from ...kinematics.formulation.acceptance_criteria import EPSILON
from ...kinematics.formulation.constraints import frames
from ...kinematics.formulation.state_vectors import samples
from ...kinematics.structure.degrees_of_freedom import freedom_account
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...program import Parts
from ...trajectory import QUANTITIES, Array
from ..llvm.executor import LlvmParts, LlvmWalk
from ..llvm.plan import aligned
from .components import Alike, components, describe_components
from .numbers_of import structure
from .sparse_lanes import SparseLanes
from .sweep import CERTAIN, CLOSURES, MARGINS, SIGMAS, WORST, Indices, Lanes


@dataclass(frozen=True, eq=False)
class ComponentType:
    """Components of one structure and drive: one model, and numbers for each.

    Attributes:
        drivers: of each; components of one structure that others drive have the same model.
        members: numbers of the components.
        fixed: values of the slots `Plan.fixed`, the same in all lanes, at the design position,
            shape (members, fixed).
        base: first row of the first member in the world; each has `model.kept` rows.
    """

    model: Model
    drivers: tuple[str, ...]
    members: tuple[int, ...]
    fixed: Array
    base: int

    @cached_property
    def column(self) -> Mapping[str, int]:
        """Return the columns of `fixed` with the tolerances, and with times and singular values at
        the poses before.
        """
        names = (*ACCEPT, *(FROM + name for name in (TIME, SIGMA, LARGEST_SIGMA)))
        return {name: list(self.model.plan.fixed).index(self.model.slots[name]) for name in names}

    def rows(self, name: str, member: int) -> range:
        """Return the rows of the world with a kept quantity of a member."""
        rows = self.model.rows[name]
        start = self.base + member * self.model.kept
        return range(start + rows.start, start + rows.stop)


# Samples at once: all are predicted from one pose, and the farther they are from it the more
# iterations they take, and the more are tried in vain; a large chain takes its time for memory.
# With 16 chains of 20 and 200 loops take as long, with 24 they take 1.2 times as long.
LANES = 8
BODY = ("r", "p", "rdot", "omega", "rddot", "omega_t")
STILL = 0.0, 0.0, 0.0


class ComponentLanes(Lanes):
    """The components of a mechanism bound to lanes: the world, and calls for the components in
    order, one for neighbours of one type. Each lane is attempted alone.

    Args:
        request: as for `compile_model`; accelerations are computed whatever its order, to predict
            from.
        parts: the bodies of its components, if known already.

    Attributes:
        parts, kinds: the components in order, and their types.
        world: all solved quantities, shape (rows, room).

    Raises:
        SolveError: the mechanism has couplers, is not driven enough, or does not close at the
            design position.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        request: Request,
        parts: Sequence[tuple[str, ...]] | None = None,
    ) -> None:
        self.mechanism, self.request = mechanism, request
        if parts is None:
            parts = components(mechanism, frames(mechanism))
        self.parts = describe_components(mechanism, parts, request.points, request.bodies)
        self.unit = self.parts[0].section.unit
        self.part_of = {name: k for k, part in enumerate(self.parts) for name in part.bodies}
        numbers: list[list[float]] = [[] for _ in self.parts]
        alike: dict[Hashable, list[int]] = {}
        for k, part in enumerate(self.parts):
            alike.setdefault(structure(part.section.unnamed, numbers[k]), []).append(k)
        self.kinds: list[ComponentType] = []
        rows = 0
        for members in alike.values():
            for kind in self._kinds(members, np.array([numbers[k] for k in members]), rows):
                self.kinds.append(kind)
                rows += len(kind.members) * kind.model.kept
        self.place = {part: (kind, k) for kind in self.kinds for k, part in enumerate(kind.members)}
        self.many = LANES
        self.details = self._details()
        self._columns, self._rows, self._still = self._outputs()
        self._bind(rows)
        self.design = self.anchor(0.0)

    def _bind(self, rows: int) -> None:
        executors = [kind.model.executor(self.many) for kind in self.kinds]
        room, self._groups = max(each.room for each in executors), executors[0].groups
        self.world = aligned(rows * room).reshape(-1, room)
        self.world[:] = 0.0
        self.worst = aligned(len(WORST) * room).reshape(-1, room)
        self._best = self.kinds[0].model.plan.best
        self._fixed = [kind.fixed.copy() for kind in self.kinds]
        tables = {  # types without drivers share one
            kind.drivers: aligned(len(kind.model.sampled) * room).reshape(-1, room)
            for kind in self.kinds
        }
        self._given = tables
        self._calls: list[Callable[[int, int], object]] = []
        self._tables: list[Parts] = []  # calls know addresses, not arrays
        self._which: list[int] = []  # the samples of each call
        kind_of = {part: k for k, kind in enumerate(self.kinds) for part in kind.members}
        for k, run in groupby(range(len(self.parts)), key=kind_of.__getitem__):
            parts, kind = [*run], self.kinds[k]
            members = np.array([self.place[part][1] for part in parts], dtype=np.int64)
            given = [
                [row for body in self.parts[part].given for row in self.body_rows(body)]
                for part in parts
            ]
            taken = np.array(given, dtype=np.int64).reshape(len(parts), -1)
            given_to, fixed = tables[kind.drivers], self._fixed[k]
            table = Parts(members, fixed, given_to, taken, self.world, kind.base, self.worst)
            self._tables.append(table)
            self._calls.append(executors[k].parts(table))
            self._which.append([*tables].index(kind.drivers))
        compiled = [call for call in self._calls if isinstance(call, LlvmParts)]
        self._walk = None
        if len(compiled) == len(self._calls):
            deciding, best = (CLOSURES, SIGMAS, MARGINS), self._best.ravel()
            self._walk = LlvmWalk(compiled, self.many, self._rows, best, deciding)

    def _details(self) -> dict[str, Any]:
        unknowns, rows, redundant, sizes = 0, 0, list[str](), dict[str, dict[str, int]]()
        alike: dict[Model, list[int]] = {}
        for kind in self.kinds:
            alike.setdefault(kind.model, []).extend(kind.members)
        for model, members in alike.items():
            account, like = model.selection.account, self.parts[members[0]].bodies[0]
            unknowns += account.moving_coordinates * len(members)
            rows += account.rows * len(members)
            for part in (self.parts[k] for k in members):
                # as they are called in a section
                joints = {f"j{k}": name for k, name in enumerate(part.joints)}
                named = (name.partition(":") for name in account.redundant_rows)
                redundant += [f"{joints[owner]}{colon}{row}" for owner, colon, row in named]
            which = f"components like that of {like} ({len(members)})"
            sizes |= {f"{name}, {which}": size for name, size in model.sizes.items()}
        return {
            **freedom_account(self.mechanism, unknowns, rows, redundant).details,
            "components": len(self.parts),
            "largest_component": max(
                kind.model.selection.account.moving_coordinates for kind in self.kinds
            ),
            "program": sizes,
        }

    def _kinds(self, members: Sequence[int], numbers: Array, base: int) -> Iterator[ComponentType]:
        first = self.parts[members[0]].section
        varied = np.flatnonzero((numbers != numbers[0]).any(axis=0))
        request = Request(
            tuple(first.drivers),
            tuple(first.points),
            tuple(first.outputs),
            compiled=self.request.compiled,
            last_iteration=self.request.last_iteration,
            state=True,
        )
        model = compile_model(self.mechanism, request, Alike(first, varied.tolist()))
        lanes = model.design_lanes(numbers[:, varied].T)
        if np.isnan(lanes).any():
            worst = self.parts[members[int(np.isnan(lanes).any(axis=0).argmax())]]
            raise SolveError(
                f"mechanism {self.mechanism.name!r}: the component of {', '.join(worst.bodies)}"
                f" does not close at the design position to {CLOSED:g} of its size; check points,"
                " axes and lengths",
                FailureKind.NOT_CLOSED,
            )
        source, target = np.array(model.plan.carried).T
        lanes[target] = lanes[source]
        fixed = np.ascontiguousarray(lanes[list(model.plan.fixed)].T)
        driven: dict[tuple[str, ...], list[int]] = {}
        for row, k in enumerate(members):
            driven.setdefault(tuple(self.parts[k].section.drivers), []).append(row)
        for names, own in driven.items():
            yield ComponentType(model, names, tuple(members[row] for row in own), fixed[own], base)
            base += len(own) * model.kept

    def body_rows(self, name: str) -> list[int]:
        """Return the rows of the world with the motion of a body, in the order of `PRESCRIBED`."""
        kind, member = self.place[self.part_of[name]]
        k = self.parts[kind.members[member]].bodies.index(name)
        u, q, v, a = (kind.rows(label, member) for label in (f"u b{k}", f"q b{k}", RATE, RATE_T))
        return [*u, *q, *v[6 * k : 6 * k + 6], *a[6 * k : 6 * k + 6]]

    def _outputs(self) -> tuple[Indices, Indices, Array]:
        """Return the columns of moving outputs with their rows of the world, and a column of the
        outputs at rest.
        """
        every = Columns(self.request)
        columns, rows, still = list[int](), list[int](), np.zeros((every.count, 1))
        points = map(self.mechanism.point, self.request.points)
        bodies = map(self.mechanism.body, self.request.bodies)
        wanted: list[tuple[str, str, Sequence[str], Mapping[str, Sequence[float]]]] = [
            *((x.name, x.body, QUANTITIES, {"position": x.position}) for x in points),
            *((x.name, x.name, BODY, {"r": x.origin, "p": x.euler_parameters}) for x in bodies),
        ]
        for name, body, labels, at_rest in wanted:
            part = self.part_of.get(body)
            for label in labels:
                place = every.by_vector.get(f"{label} {name}")
                if place is None:  # of a higher order
                    continue
                if part is None:
                    still[place, 0] = at_rest.get(label, STILL)
                    continue
                kind, member = self.place[part]
                which = self.parts[part].bodies if labels is BODY else self.parts[part].points
                own = f"{'b' if labels is BODY else 'p'}{which.index(name)}"
                columns.extend(range(place.start, place.stop))
                rows.extend(kind.rows(f"{label} {own}", member))
        order = np.argsort(columns)
        return np.array(columns, np.intp)[order], np.array(rows, np.intp)[order], still

    def accept_by(self, limits: Mapping[str, float]) -> None:
        """See `Lanes`."""
        self._tol = limits["tolerance"]
        for kind, fixed in zip(self.kinds, self._fixed, strict=True):
            for name, value in limits.items():
                fixed[:, kind.column[name]] = value

    def set_prediction_start(self, time: float, path: Path) -> PoseFailure | None:
        """See `Lanes`. The rates of the path where the mechanism stands are those of a sample."""
        for kind, fixed in zip(self.kinds, self._fixed, strict=True):
            fixed[:, kind.column[FROM + TIME]] = time
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

    def sample_tables(self, times: Array, path: Path) -> list[Array]:
        """See `Lanes`: one for the types with the same drivers."""
        return [
            samples(self.mechanism, drivers, self.unit, path, times) if drivers else times[None]
            for drivers in self._given
        ]

    def attempt_at(self, tables: Sequence[Array], *, neighbours: bool = False) -> Array:
        """See `Lanes`."""
        count = tables[0].shape[1]
        self.last, self._times = count - 1, tables[0][0]
        for table, room in zip(tables, self._given.values(), strict=True):
            room[:, :count] = table
            room[:, count:] = table[:, count - 1 :]
        self.worst[:] = self._best
        groups = self._groups(count)
        for call in self._calls:
            call(-1, groups)
        return self.worst[MARGINS, :count].copy()

    def walk(
        self, tables: Sequence[Array], count: int, certain: float = CERTAIN
    ) -> tuple[Array, Array]:
        """See `Lanes`."""
        if self._walk is None:
            return super().walk(tables, count, certain)
        samples = [tables[k] for k in self._which]
        moving, tests = self._walk(samples, count, (EPSILON, certain * self._tol))
        self.refused = not self.worst[MARGINS, 0] > 0.0
        return self._motions(moving), tests

    def motions(self, count: int) -> Array:
        """See `Lanes`."""
        return self._motions(self.world[self._rows, :count])

    def _motions(self, moving: Array) -> Array:
        if len(moving) == len(self._still):
            return moving
        found = np.repeat(self._still, moving.shape[1], axis=1)
        found[self._columns] = moving
        return found

    def uncertain(self, doubtful: Indices, tol: float, path: Path) -> Mapping[int, float]:
        """See `Lanes`: the doubt is by estimates; whether there is reason for it, the equations of
        the whole mechanism tell.
        """
        state = np.stack([self._state(k) for k in doubtful.tolist()], axis=1)
        sample = self._whole.sample_tables(self._times[doubtful], path)[0]
        return self.refuse_uncertain(doubtful, self._whole.error_bounds(state, sample), tol)

    @cached_property
    def _whole(self) -> SparseLanes:
        return SparseLanes(self.mechanism, replace(self.request, points=(), bodies=()))

    def _state(self, lane: int) -> Array:
        """Return the state of a lane as the equations of the whole mechanism have it."""
        names = self._whole.system.names
        found = np.zeros(len(self._whole.system.design))
        for k, part in enumerate(self.parts):
            kind, member = self.place[k]
            for name in kind.model.state:
                what, own = name.split(" ", 1)
                if what == "x":
                    joint, _, coordinate = own.rpartition(".")
                    whole = f"x {part.joints[int(joint[1:])]}.{coordinate}"
                else:
                    whole = f"{what} {part.bodies[int(own[1:])]}"
                length = what == "u" or name.endswith(".translation")
                values = self.world[kind.rows(name, member), lane]
                found[names[whole]] = values * (self.unit / self._whole.unit if length else 1.0)
        return found

    def each(self, name: str) -> Array:
        """Return a kept test of all components, shape (components, room)."""
        found: list[Array] = []
        for kind in self.kinds:
            size, first = kind.model.kept, kind.base + kind.model.rows[name].start
            found.append(self.world[first : kind.base + size * len(kind.members) : size])
        return np.concatenate(found)

    def _numbers(self, pose: Sequence[Array]) -> Numbers:
        """Return the states of all components of an anchor, and their rates with the rates of
        those.
        """
        found: tuple[list[Array], list[Array]] = ([], [])
        for kind, fixed in zip(self.kinds, pose, strict=True):
            place, model = {slot: k for k, slot in enumerate(kind.model.plan.fixed)}, kind.model
            for each, names in zip(found, (model.state, (RATE, RATE_T)), strict=True):
                slots = slots_of(model.vectors, (FROM + name for name in names))
                each.append(fixed[:, [place[slot] for slot in slots]].ravel())
        return Numbers(*map(np.concatenate, found))

    @property
    def sound(self) -> bool:
        """See `Lanes`."""
        for kind, fixed in zip(self.kinds, self._fixed, strict=True):
            sigma, largest = (fixed[:, kind.column[FROM + name]] for name in (SIGMA, LARGEST_SIGMA))
            if not (sigma >= SOUND * largest).all():
                return False
        return True

    def carry(self, lane: int) -> None:
        """See `Lanes`."""
        for call in self._calls:
            call(lane, 0)

    def failure(self, tol: float) -> PoseFailure:
        """See `Lanes`: that of its unsolved component, or of the one nearest to singular."""
        closure, sigma = (self.each(name)[:, self.last] for name in ("closure", SIGMA))
        closes = bool((closure <= tol).all())
        worst = int(np.nanargmin(sigma) if closes else np.nan_to_num(closure, nan=np.inf).argmax())
        order = [part for kind in self.kinds for part in kind.members]
        return PoseFailure(
            FailureKind.SINGULAR_AHEAD if closes else FailureKind.NOT_CONVERGED,
            closure[worst],
            tol,
            sigma=sigma[worst],
            where=f"the component of {', '.join(self.parts[order[worst]].bodies)}: ",
        )
