"""Forces in a tree of links whose loops are closed by rows: inverse dynamics of the simulator, rows
and force elements on its bodies.

In a model with forces, every body of the mechanism is a body of the simulator: a fixed joint closes
a loop of a free body. So the simulator's recursion and rows distinguish the bodies.

A simulator's recursion gives the wrench that a joint of the tree transmits to all carried bodies.
Rows, drivers, couplers and force elements also act on the carried bodies, so their wrenches are
subtracted. A cut joint exerts the wrenches of its own rows. Forces of drivers and couplers along a
joint's coordinate do not belong to its reaction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import Any, ClassVar, Protocol

import numpy as np

from ...core.case.case import Case
from ...core.joints import Joint
from ...core.joints.base import unit
from ...core.mechanism.body import Body, inertia_matrix
from ...core.mechanism.loads import ForceElement, TorsionSpringDamper
from ...core.mechanism.mechanism import Mechanism, Vector
from ...core.trajectory import Array
from .constraints import BodyFrame, Condition, Coordinates, skew
from .force_solution import (
    Element,
    LeftOut,
    RowWrench,
    axis_of,
    left_out_of,
    places,
    reacting_joints,
)
from .projection_model import Dynamics
from .tree_plan import Relation


@dataclass(frozen=True, eq=False)
class Mass:
    """A body with mass, and a frame at its centre of mass."""

    body: Body
    frame: BodyFrame


@dataclass(frozen=True, eq=False)
class Site:
    """A joint whose reaction is requested, and a frame at its point on its second body.

    Attributes:
        second: number of the second body.
        carried: by the parts of the joint in the tree, numbers of all carried bodies, that of the
            part first, and a sign: minus if this body is the joint's first.
        cut: rows of the parts of the joint that close loops, and of those left out.
    """

    joint: Joint
    frame: BodyFrame
    second: int
    carried: Sequence[tuple[list[int], int]]
    cut: Sequence[slice]

    def reaction(
        self, passed_on: Callable[[int, Array], Array], exerted: Array, loads: Array
    ) -> tuple[Array, Array]:
        """Return the wrench on the second body without multipliers, shape (6,), and its derivative
        by the multipliers, shape (6, rows); both still include the coordinate's share.

        Args:
            passed_on: returns the wrench that the joint of a body transmits to it and all carried
                bodies, about a point.
            exerted: wrenches of unit multipliers on each body, about the origin, shape (bodies, 6,
                rows).
            loads: wrenches of force elements on each body, about the origin, shape (bodies, 6).
        """
        to_point = from_origin(self.frame.position)
        alone, by_multiplier = np.zeros(6), np.zeros(exerted.shape[1:])
        for bodies, sign in self.carried:
            total = passed_on(bodies[0], self.frame.position)
            alone += sign * (total - to_point @ loads[bodies].sum(axis=0))
            by_multiplier -= sign * (to_point @ exerted[bodies].sum(axis=0))
        for rows in self.cut:
            by_multiplier[:, rows] += to_point @ exerted[self.second][:, rows]
        return alone, by_multiplier

    def coordinate_wrench(self, freedom: str) -> Array:
        """Return the wrench of a unit force or torque of a coordinate on the second body."""
        joint: Any = self.joint
        h, none = self.frame.rotation @ np.array([*unit(joint.axis)]), np.zeros(3)
        return np.concatenate([h, none] if freedom == "translation" else [none, h])


def about_origin(point: Array, wrenches: Array) -> Array:
    """Return wrenches about a point, shape (n, 6), as columns about the origin, shape (6, n)."""
    return np.vstack([wrenches[:, :3].T, wrenches[:, 3:].T + skew(point) @ wrenches[:, :3].T])


def from_origin(point: Array) -> Array:
    """Return the matrix from wrenches about the origin to wrenches about a point."""
    found = np.eye(6)
    found[3:, :3] = -skew(point)
    return found


def carried_by(body: int, parents: Sequence[int]) -> list[int]:
    """Return a body of a tree and all carried bodies; parents are numbered before children."""
    found = [body]
    for child in range(body + 1, len(parents)):
        if parents[child] in found:
            found.append(child)
    return found


def of_relations(
    mechanism: Mechanism, rows: Mapping[int, Sequence[tuple[str, str]]]
) -> dict[str, list[tuple[int, str]]]:
    """Return, by joint, the rows and freedoms of its coordinates that do not belong to its
    reaction.

    Args:
        rows: joint and freedom of the coordinates in each row. A row with two coordinates of one
            joint is the joint's own (a screw).
    """
    found: dict[str, list[tuple[int, str]]] = {joint.name: [] for joint in mechanism.given_joints}
    for row, terms in rows.items():
        if len(terms) > 1 and len({joint for joint, _ in terms}) == 1:
            continue
        for joint, freedom in terms:
            found[joint].append((row, freedom))
    return found


# Mass for simulators that refuse massless bodies: it changes no force, and its inverse is finite.
NO_MASS = 1e-100


class Tree(Coordinates, Protocol):
    """What forces need of a `TreeModel`, which says what each is."""

    case: Case
    carrier: dict[str, int]
    parents: list[int]
    coordinates: dict[tuple[str, str], tuple[Any, int]]
    branch_of: dict[str, tuple[int, int]]
    tied: list[tuple[str, Condition, tuple[BodyFrame, BodyFrame]]]
    related: list[tuple[Condition, Relation]]
    recursion: ClassVar[bool]
    J: Array

    @property
    def own_rows(self) -> list[tuple[slice, str | Relation]]: ...

    def add_frame(self, body: int, at: Vector) -> BodyFrame: ...

    def rows_of(self, condition: Condition) -> slice: ...

    def row_wrenches(self) -> list[RowWrench]: ...

    def look(self, frame: BodyFrame) -> None: ...

    def inverse_dynamics(self, v: Array, a: Array) -> Array: ...

    def passed_on(self, body: int, point: Array) -> Array: ...


class TreeForces:
    """Frames of joints, masses and force elements of a `TreeModel`, and their forces."""

    def __init__(self, model: Tree) -> None:
        self.model, mechanism = model, model.case.mechanism
        self.gravity = np.array(mechanism.gravity)
        self.frames: list[BodyFrame] = []
        self.elements = [self._element(each) for each in mechanism.forces]
        self.masses = [
            Mass(body, self._frame(body.name, body.center))
            for body in mechanism.moving
            if body.mass > 0.0
        ]
        self.points = {
            joint.name: self._frame(joint.j, mechanism.reaction_point(joint))
            for joint in map(mechanism.joint, reacting_joints(model.case))
        }
        self.left_out = left_out_of(mechanism, self._frame)

    def _frame(self, body: str, at: Vector) -> BodyFrame:
        self.frames.append(self.model.add_frame(self.model.carrier[body], at))
        return self.frames[-1]

    def _element(self, each: ForceElement) -> Element:
        model = self.model
        frames = [self._frame(*end) for end in places(each, model.case.mechanism)]

        def angle() -> float:
            assert isinstance(each, TorsionSpringDamper)
            body, sign = model.coordinates[each.joint, "rotation"]
            return sign * float(model.q[model.coordinate(body)[0]])

        return Element(each, frames, axis_of(each, model.case.mechanism), angle)

    @cached_property
    def sites(self) -> list[Site]:
        """Return the requested joints."""
        model, found = self.model, list[Site]()
        mechanism = model.case.mechanism
        for name, frame in self.points.items():
            joint, parts = mechanism.joint(name), mechanism.parts_of(name)
            branches = [model.branch_of[part] for part in parts if part in model.branch_of]
            cut = [rows for rows, what in model.own_rows if what in parts]
            cut += [model.rows_of(each) for part, each, _ in model.tied if part in parts]
            cut += [rows for each, rows in self.slices if each.of == name]
            carried = [(carried_by(body, model.parents), sign) for body, sign in branches]
            found.append(Site(joint, frame, model.carrier[joint.j], carried, cut))
        return found

    @cached_property
    def slices(self) -> list[tuple[LeftOut, slice]]:
        """Return the rows left out, which follow those of the model."""
        first = len(self.model.J)
        ends = [*accumulate((each.joint.rows for each in self.left_out), initial=first)]
        return [*zip(self.left_out, map(slice, ends, ends[1:]), strict=False)]

    @cached_property
    def shares(self) -> Mapping[str, Sequence[tuple[int, str]]]:
        """Return the rows and freedoms of each joint's coordinates."""
        model = self.model
        rows = [(model.rows_of(row), relation) for row, relation in model.related]
        rows += [(at, what) for at, what in model.own_rows if isinstance(what, Relation)]
        terms = {at.start: [each[:2] for each in relation.terms] for at, relation in rows}
        return of_relations(model.case.mechanism, terms)

    def dynamics(self, v: Array, a: Array) -> Dynamics:
        """Return the forces at velocities and accelerations; see `ProjectionModel`."""
        model = self.model
        demand, bodies = model.inverse_dynamics(v, a), len(model.parents)
        for frame in self.frames:
            model.look(frame)
        amounts, loads = dict[str, float](), np.zeros((bodies, 6))
        for element in self.elements:
            amounts[element.given.name], wrenches = element.at_work()
            for frame, wrench in zip(element.frames, wrenches, strict=True):
                demand = demand - frame.jacobian.T @ wrench
                loads[frame.body] += about_origin(frame.position, wrench[None])[:, 0]
        left_out, exerting = [np.zeros((0, len(v)))], [*model.row_wrenches()]
        for each, place in self.slices:
            rows, wrenches = each.rows(place.start)
            left_out.append(rows)
            exerting += wrenches
        total = np.vstack(left_out)
        exerted = np.zeros((bodies, 6, len(model.J) + len(total)))
        for each in exerting:
            exerted[each.body][:, each.rows] += about_origin(each.point, each.wrenches)
        passed_on, reactions = self._passed_on(bodies), dict[str, tuple[Array, Array]]()
        for site in self.sites:
            name = site.joint.name
            alone, by_multiplier = site.reaction(passed_on, exerted, loads)
            for row, freedom in self.shares[name]:
                body, sign = model.coordinates[name, freedom]
                weight = sign * float(model.J[row, model.coordinate(body)[1]])
                by_multiplier[:, row] -= weight * site.coordinate_wrench(freedom)
            reactions[name] = alone, by_multiplier
        return Dynamics(demand, reactions, amounts, total)

    def _passed_on(self, bodies: int) -> Callable[[int, Array], Array]:
        """Return the function for the wrench that the joint of a body transmits, about a point: the
        simulator's recursion, or else Newton and Euler with the simulator's accelerations.
        """
        if self.model.recursion:
            return self.model.passed_on
        each = np.zeros((bodies, 6))
        for mass in self.masses:
            wrench = demand_of(mass.body, mass.frame, self.gravity)
            each[mass.frame.body] += about_origin(mass.frame.position, wrench[None])[:, 0]

        def passed_on(body: int, point: Array) -> Array:
            total: Array = each[carried_by(body, self.model.parents)].sum(axis=0)
            return from_origin(point) @ total

        return passed_on


def demand_of(body: Body, frame: Any, gravity: Array) -> Array:
    """Return m (a - g) over I wdot + w x I w about the centre of mass, where the frame is."""
    force = body.mass * (frame.acceleration[:3] - gravity)
    inertia = frame.rotation @ inertia_matrix(body.inertia) @ frame.rotation.T
    w, w_t = frame.velocity[3:], frame.acceleration[3:]
    return np.concatenate([force, inertia @ w_t + skew(w) @ (inertia @ w)])


def mass_properties(body: Body, origin: Array) -> tuple[float, Array, Array]:
    """Return mass, centre of mass from an origin, and inertia about the centre of mass, shape (3,
    3), at design.
    """
    center = np.array(body.center) - origin
    return body.mass, center, inertia_matrix(body.inertia)
