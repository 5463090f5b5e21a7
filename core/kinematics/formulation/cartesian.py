"""The Cartesian formulation: six unknowns (dr, dpi) of every moving body, and all joints as rows.

A joint's rotation or translation is a further unknown if it is named: by a coupling or by the
style. dpi is in global axes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import groupby
from typing import Any

from ...algebra import Quat, Scalar, is_literal_zero, quat, turned_by, vec
from ...mechanism.mechanism import Mechanism
from ...primitives.base import GROUND_POSE, GROUND_TWIST, Drive, Pose, Primitive, Row, Twist
from ...program import cos, sin
from .constraints import Constraint, Frames, Relation, constraints
from .formulation import GROUND_ACCELERATION, Acceleration, Condition, Configuration, Rows, State

COLUMNS = 6
"""Unknowns of a moving body: dr and dpi."""


@dataclass(frozen=True, slots=True)
class PrescribedBody:
    """The prescribed motion of a body that is solved elsewhere."""

    pose: Pose = GROUND_POSE
    twist: Twist = GROUND_TWIST
    acceleration: Acceleration = GROUND_ACCELERATION


@dataclass(frozen=True, eq=False)
class Cartesian:
    """The equations of a mechanism over its named moving bodies: rows of joints, then of drivers.

    Attributes:
        named: coordinates with a column even if no primitive is driven by them.
        prescribed: moving bodies, without columns.
    """

    constraints: Sequence[Constraint | Relation]
    bodies: Sequence[str]
    named: Sequence[str] = ()
    prescribed: Mapping[str, PrescribedBody] = field(default_factory=dict[str, PrescribedBody])

    @classmethod
    def of(
        cls,
        mechanism: Mechanism,
        frame: Frames,
        drives: Mapping[str, Drive] | None = None,
        named: Collection[str] = (),
        *,
        mixed: bool = False,
    ) -> Cartesian:
        """Return all constraints of a mechanism over its moving bodies; see `constraints`.

        Drivers without a drive hold their design value.
        """
        return cls(constraints(mechanism, frame, drives or {}, named, mixed=mixed), frame.moving)

    @cached_property
    def columns(self) -> Mapping[str, int]:
        """First column of every moving body."""
        return {name: COLUMNS * k for k, name in enumerate(self.bodies)}

    @cached_property
    def coordinates(self) -> Mapping[str, int]:
        """Column of every named coordinate, after those of the bodies."""
        driven = (
            c.coordinate for c in self.constraints if isinstance(c, Constraint) and c.coordinate
        )
        return {
            name: COLUMNS * len(self.bodies) + k
            for k, name in enumerate(dict.fromkeys([*self.named, *driven]))
        }

    @property
    def unknowns(self) -> int:
        """Number of unknowns (columns)."""
        return COLUMNS * len(self.bodies) + len(self.coordinates)

    @property
    def design(self) -> Mapping[str, Sequence[float]]:
        """The state at the design position."""
        still: dict[str, Sequence[float]] = {f"u {name}": (0.0, 0.0, 0.0) for name in self.bodies}
        still |= {f"q {name}": (1.0, 0.0, 0.0, 0.0) for name in self.bodies}
        return still | {f"x {name}": (0.0,) for name in self.coordinates}

    @property
    def owners(self) -> Sequence[tuple[str, str]]:
        """For every row, its joint or driver and its primitive."""
        return [*map(_names, self.of_rows)]

    @property
    def row_names(self) -> list[str]:
        """A readable name of every row: its joint or driver, and its primitive."""
        return [f"{owner}: {primitive}" for owner, primitive in self.owners]

    @cached_property
    def of_rows(self) -> Sequence[Constraint | Relation]:
        """The constraint of every row."""
        return [c for c in self.constraints for _ in range(c.n)]

    @cached_property
    def measuring_rows(self) -> Mapping[str, int]:
        """Number of the row that measures a named coordinate."""
        rows = enumerate(self.of_rows)
        return {c.coordinate: k for k, c in rows if isinstance(c, Constraint) and c.coordinate}

    @property
    def conditions(self) -> Sequence[Condition]:
        """The geometric conditions of the rows, in order."""
        far, found, first = self._from_ground, list[Condition](), 0
        for _, group in groupby(self.constraints, key=_condition):
            members = [*group]
            rows = range(first, first := first + sum(c.n for c in members))
            pairs = [c for c in members if isinstance(c, Constraint)]
            remote = max((far.get(c.i, 0) + far.get(c.j, 0) for c in pairs), default=0)
            steady = all(
                c.primitive.steady or not (c.i in self.columns or c.i in self.prescribed)
                for c in pairs
            )
            found.append(Condition(rows, remote, steady))
        return found

    @cached_property
    def _from_ground(self) -> Mapping[str, int]:
        """Joints and drivers between every body and the ground or a prescribed body.

        Unconnected bodies are missing.
        """
        near: dict[str, list[str]] = {}
        for c in self.constraints:
            if isinstance(c, Constraint):
                near.setdefault(c.i, []).append(c.j)
                near.setdefault(c.j, []).append(c.i)
        far = {name: 0 for name in near if name not in self.columns}
        waiting = deque(far)
        while waiting:
            a = waiting.popleft()
            for b in near[a]:
                if b not in far:
                    far[b] = far[a] + 1
                    waiting.append(b)
        return far

    def configuration(self, state: State) -> Configuration:
        """Return the poses of a state."""
        poses = {name: each.pose for name, each in self.prescribed.items()}
        for name in self.bodies:
            poses[name] = Pose.of(vec(state[f"u {name}"]), quat(state[f"q {name}"]))
        return Configuration(state, poses)

    def retract(self, at: Configuration, step: Sequence[Scalar]) -> State:
        """Return the state after a step of the unknowns, exact to second order."""
        state: dict[str, Sequence[Scalar]] = {}
        for name, k in self.columns.items():
            dr, dpi = vec(step[k : k + 3]), vec(step[k + 3 : k + COLUMNS])
            state[f"u {name}"] = tuple(at.poses[name].u + dr)
            state[f"q {name}"] = tuple(turned_by(at.poses[name].q, 0.5 * dpi))
        for name, k in self.coordinates.items():
            state[f"x {name}"] = (at.state[f"x {name}"][0] + step[k],)
        return state

    def flow(self, at: Configuration, rates: Sequence[Scalar]) -> State:
        """Return the rates of the state at rates of the unknowns."""
        state: dict[str, Sequence[Scalar]] = {}
        for name, k in self.columns.items():
            half = 0.5 * vec(rates[k + 3 : k + COLUMNS])
            state[f"u {name}"] = tuple(rates[k : k + 3])
            state[f"q {name}"] = tuple(Quat(0.0, half) * at.poses[name].q)
        for name, k in self.coordinates.items():
            state[f"x {name}"] = (rates[k],)
        return state

    def phi(self, at: Configuration) -> list[Scalar]:
        """Return all residuals."""
        found: list[Scalar] = []
        for c in self.constraints:
            if isinstance(c, Relation):
                found.append(c.value(_values(c, at)))
            else:
                found += self._bound(c, at).phi(*_pair(c, at))
        return found

    def branch(self, at: Configuration) -> list[Scalar]:
        """Return all branch tests: positive on the intended branch."""
        bodily = (c for c in self.constraints if isinstance(c, Constraint))
        return [value for c in bodily for value in self._bound(c, at).branch(*_pair(c, at))]

    def rows(self, at: Configuration) -> Rows:
        """Return the Jacobian by the unknowns."""
        found: Rows = []
        for c in self.constraints:
            if isinstance(c, Relation):
                slopes = c.slopes(_values(c, at))
                found.append({self.coordinates[name]: k for name, k in slopes.items()})
                continue
            pair, bound = _pair(c, at), self._bound(c, at, rate=1.0)
            rows = [self._sparse(row, c) for row in bound.rows(*pair)]
            # nu is linear in the drive's rate: its value at rate one is minus the coordinate's
            # column
            if c.coordinate:
                for row, value in zip(rows, bound.nu(*pair), strict=True):
                    if not is_literal_zero(value):
                        row[self.coordinates[c.coordinate]] = -value
            found += rows
        return found

    def nu(self, at: Configuration) -> list[Scalar]:
        """Return the right-hand sides of the velocity equations."""
        carried = {name: each.twist for name, each in self.prescribed.items()}
        found: list[Scalar] = []
        for c in self.constraints:
            if isinstance(c, Relation):
                found.append(c.drive.c_t)
            else:
                found += self._less(self._bound(c, at).nu(*_pair(c, at)), c, at, carried)
        return found

    def gamma(self, at: Configuration, v: Sequence[Scalar]) -> list[Scalar]:
        """Return the right-hand sides of the acceleration equations at unknown rates v."""
        twists = self._by_body(v) | {name: each.twist for name, each in self.prescribed.items()}
        carried = {
            name: Twist(each.acceleration.v_t, each.acceleration.w_t)
            for name, each in self.prescribed.items()
        }
        found: list[Scalar] = []
        for c in self.constraints:
            if isinstance(c, Relation):
                rates = [v[self.coordinates[name]] for name in c.weights]
                found.append(c.gamma(_values(c, at), rates))
                continue
            rate = v[self.coordinates[c.coordinate]] if c.coordinate else 0.0
            vi, vj = twists.get(c.i, GROUND_TWIST), twists.get(c.j, GROUND_TWIST)
            found += self._less(
                self._bound(c, at, rate).gamma(*_pair(c, at), vi, vj), c, at, carried
            )
        return found

    def _less(
        self,
        values: Sequence[Scalar],
        c: Constraint,
        at: Configuration,
        carried: Mapping[str, Twist],
    ) -> list[Scalar]:
        """Subtract the contribution of prescribed bodies from right-hand sides."""
        found: list[Scalar] = [*values]
        for body, place in ((c.i, "i"), (c.j, "j")):
            if body in carried:
                rows = self._bound(c, at).rows(*_pair(c, at))
                found = [
                    x - row.part(place, carried[body]) for x, row in zip(found, rows, strict=True)
                ]
        return found

    def _bound(self, c: Constraint, at: Configuration, rate: Scalar = 0.0) -> Primitive:
        """Return the primitive, driven by its coordinate if it has one.

        The coordinate's acceleration is an unknown and stays zero here.
        """
        if not c.coordinate:
            return c.primitive
        (x,) = at.state[f"x {c.coordinate}"]
        drive = Drive(x, rate, 0.0, cos(0.5 * x), sin(0.5 * x))
        driven: Any = c.primitive
        return replace(driven, drive=drive)

    def twists(self, at: Configuration, v: Sequence[Scalar]) -> Mapping[str, Twist]:
        """Return the twists of the bodies at unknown rates v."""
        return self._by_body(v)

    def accelerations(
        self, at: Configuration, v: Sequence[Scalar], a: Sequence[Scalar]
    ) -> Mapping[str, Acceleration]:
        """Return the accelerations of the bodies at unknown rates v and accelerations a."""
        return {name: Acceleration(each.v, each.w) for name, each in self._by_body(a).items()}

    def _by_body(self, v: Sequence[Scalar]) -> dict[str, Twist]:
        """Return the unknowns by body."""
        return {
            name: Twist(vec(v[k : k + 3]), vec(v[k + 3 : k + COLUMNS]))
            for name, k in self.columns.items()
        }

    def _sparse(self, row: Row, c: Constraint) -> dict[int, Scalar]:
        entries: dict[int, Scalar] = {}
        for body, blocks in ((c.i, (row.ri, row.pi)), (c.j, (row.rj, row.pj))):
            if body in self.columns:
                first = self.columns[body]
                values = [value for block in blocks for value in block]
                entries |= {first + k: x for k, x in enumerate(values) if not is_literal_zero(x)}
        return entries


def _names(c: Constraint | Relation) -> tuple[str, str]:
    """Return the names of the joint or driver, and of the primitive."""
    return c.owner, "Relation" if isinstance(c, Relation) else type(c.primitive).__name__


def _condition(c: Constraint | Relation) -> tuple[object, ...]:
    """Return the names, and what tells a driver from a joint or coupler of its name."""
    return _names(c), c.coordinate if isinstance(c, Constraint) else len(c.weights)


def _values(c: Relation, at: Configuration) -> list[Scalar]:
    """Return the coordinates of a relation."""
    return [at.state[f"x {name}"][0] for name in c.weights]


def _pair(c: Constraint, at: Configuration) -> tuple[Pose, Pose]:
    return at.poses.get(c.i, GROUND_POSE), at.poses.get(c.j, GROUND_POSE)
