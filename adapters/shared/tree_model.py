"""A mechanism as one tree of slides, hinges and balls, for simulators with generalized coordinates.

The base adds the parts of the plan (`tree_plan`), the conditions of loops (`constraints`) and the
drivers to a simulator. A simulator adds links and frames and reports their motion. It knows a body
by the number of its link; the ground is body 0. The axes of every body are global at design, and
its origin is the point of its link there.

A constructor prepares the simulator's empty model and then calls the constructor of `TreeModel`,
which calls `add_link` for every link, parents first, `make_frame` for every frame, and finally
`finish`. Then the model is solved: `design` and `configuration_after` return configurations q,
`place` and `rate` update the simulator's data, which `placement`, `slope` and `motion` read frame
by frame.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import accumulate, pairwise
from typing import Any, ClassVar

import numpy as np

from ...core.case.case import Case
from ...core.joints import Fixed, Joint
from ...core.joints.base import unit
from ...core.mechanism.loads import TorsionSpringDamper
from ...core.mechanism.mechanism import GROUND, Vector
from ...core.mechanism.motions import JointDriver, PointCoordinate
from ...core.trajectory import Array
from .constraints import (
    CLOSURES,
    BodyFrame,
    Condition,
    Curved,
    DrivenPoint,
    Linear,
    by_frame,
    closure_conditions,
    closure_text,
)
from .force_solution import RowWrench
from .projection_engine import ProjectionEngine
from .projection_model import Dynamics
from .tree_forces import Mass, TreeForces
from .tree_plan import Chain, Closure, Link, Relation, plan_tree


class TreeModel(ABC):
    """The mechanism in a simulator; a `ProjectionModel`. Order of rows: joints, couplers, drivers.

    Attributes:
        q: the configuration, never changed in place.
        v: the velocities last set.
        origin: origin of each body, global at design [m].
        carrier: name of a body of the mechanism -> number of its body here.
        coordinates: joint and freedom -> the simulator's coordinate, by default the number of the
            body that it moves, and its sign.
        frames: all frames.
        conditions: all rows, the rows of drivers last.
        slices, J: rows of each condition, and the Jacobian of all.
        closures: name of a cut joint -> description of its rows.
        parents: number of the carrier of each body; the ground carries itself.
        branch_of: joint of the tree -> carried body, and its sign: -1 if it is the joint's first.
        tied: conditions between frames, with their joint and frames.
        related: rows of coordinates, with their relation.
        own: the simulator's own constraints, whose rows come first: their number, and what they
            keep, the name of a cut joint or a relation.
        recursion: whether the simulator gives the wrenches of its joints.
        computed_by: the forces that the simulator computes, with its calls.
        whole: types of joints that close a loop by all their conditions; see `plan_tree`.
        merges: whether bodies that a fixed joint connects are one body of the simulator.
        forces: None unless outputs of the case use forces.
    """

    q: Array
    v: Array
    coordinates: dict[tuple[str, str], tuple[Any, int]]
    frames: list[BodyFrame]
    conditions: list[Condition]
    closures: dict[str, str]
    branch_of: dict[str, tuple[int, int]]
    tied: list[tuple[str, Condition, tuple[BodyFrame, BodyFrame]]]
    related: list[tuple[Condition, Relation]]
    own: list[tuple[int, str | Relation]]
    recursion: ClassVar[bool] = True
    computed_by: ClassVar[Mapping[str, str]]
    gives_forces: ClassVar[bool] = True
    whole: ClassVar[Collection[type[Joint]]] = CLOSURES
    merges: ClassVar[bool] = True

    def __init__(self, case: Case) -> None:
        self.case, mechanism = case, case.mechanism
        self.carrier = {GROUND: 0} | {body.name: 0 for body in mechanism.bodies if body.fixed}
        self.origin, self.parents = [np.zeros(3)], [0]
        self.coordinates, self.closures, self.branch_of = {}, {}, {}
        self.conditions, self.frames = [], []
        self.tied, self.related, self.own = [], [], []
        self.loaded = self.gives_forces and bool(case.forces)
        for part in self.plan():
            match part:
                case Chain():
                    self.carry(part)
                case Closure():
                    self.close(part)
                case Relation():
                    self.relate(part)
        for driver in mechanism.drivers:
            if isinstance(driver, PointCoordinate):
                point, k = mechanism.point(driver.point), np.array([*unit(driver.direction)])
                frame = self.add_frame(self.carrier[point.body], point.position)
                self.conditions.append(DrivenPoint(frame, k, np.array(point.position)))
            elif isinstance(driver, JointDriver):
                self.add_row(Relation(driver.name, [(driver.joint, driver.freedom, 1.0)], ()))
        conditioned = len(self.frames)
        self.forces = TreeForces(self) if self.loaded else None
        if self.forces:
            self.set_loads(mechanism.gravity, self.forces.masses)
        self.wanted = [
            self.add_frame(self.carrier[each.body], each.position)
            for each in map(mechanism.point, case.points)
        ]
        self.finish()
        for frame in self.frames:
            frame.jacobian = np.zeros((6, self.unknowns))
        self.moving = [each for each in self.frames[:conditioned] if each.handle is not None]
        ends = [*accumulate(each.n for each in self.conditions)]
        self.slices = [
            slice(end - each.n, end) for end, each in zip(ends, self.conditions, strict=True)
        ]
        rows = ends[-1] if ends else 0
        self.J = np.zeros((rows, self.unknowns))
        self.columns = np.eye(rows)[:, rows - len(mechanism.drivers) :]
        self.reset()

    @abstractmethod
    def add_link(self, parent: int, link: Link, offset: Array) -> None:
        """Add a body that moves by a link relative to its parent, at an offset from the parent's
        origin [m].
        """

    @abstractmethod
    def make_frame(self, body: int, offset: Array) -> Any:
        """Return a handle of a frame of a body other than the ground, at an offset from its origin
        [m].
        """

    @abstractmethod
    def finish(self) -> None:
        """Finish the model for solving; no link and no frame follows."""

    @property
    @abstractmethod
    def unknowns(self) -> int:
        """The number of velocities."""

    @abstractmethod
    def coordinate(self, body: Any) -> tuple[int, int]:
        """Return the indices of a slide's or hinge's coordinate in q and in v."""

    @abstractmethod
    def design(self) -> Array:
        """Return the configuration at design, zero for slides and hinges."""

    @abstractmethod
    def configuration_after(self, dx: Array) -> Array:
        """Return the configuration q advanced by dx, shape (unknowns,)."""

    @abstractmethod
    def place(self) -> None:
        """Update the simulator's poses and Jacobians to q."""

    @abstractmethod
    def rate(self, v: Array, a: Array) -> None:
        """Update the simulator's velocities and accelerations to v and a, at the q last placed."""

    @abstractmethod
    def placement(self, handle: Any) -> tuple[Array, Array]:
        """Return the position of a frame [m], shape (3,), and the rotation since design, shape
        (3, 3).
        """

    @abstractmethod
    def slope(self, handle: Any) -> Array:
        """Return the Jacobian of a frame's point over that of its rotation, global axes, shape
        (6, unknowns).
        """

    @abstractmethod
    def motion(self, handle: Any) -> tuple[Array, Array]:
        """Return velocity and acceleration of a frame's point, over the angular velocity and
        acceleration, global axes, each of shape (6,).

        Without accelerations of the coordinates, the acceleration is Jdot v.
        """

    @abstractmethod
    def set_loads(self, gravity: Vector, masses: Sequence[Mass]) -> None:
        """Set the masses of these bodies, zero mass for others, and the gravity of the model."""

    @abstractmethod
    def inverse_dynamics(self, v: Array, a: Array) -> Array:
        """Return M a + h at v and a, at the q last placed, shape (unknowns,).

        It also updates velocities and accelerations, as `rate` does.
        """

    def passed_on(self, body: int, point: Array) -> Array:
        """Return the wrench that a body's joint transmits to it and all carried bodies, after
        `inverse_dynamics`: force over moment about a global point, shape (6,).

        Only simulators with a recursion implement it.
        """
        raise NotImplementedError

    # methods that a simulator may override

    def plan(self) -> Iterable[Chain | Relation | Closure]:
        """Return the parts of the tree. Joints whose coordinates are used count turns: driven and
        coupled ones, and those with torsional springs.
        """
        mechanism = self.case.mechanism
        counted = {name for coupler in mechanism.couplers for name in coupler.joints}
        counted |= {each.joint for each in mechanism.drivers if isinstance(each, JointDriver)}
        if self.loaded:
            springs = (f for f in mechanism.forces if isinstance(f, TorsionSpringDamper))
            counted |= {spring.joint for spring in springs}
        return plan_tree(
            mechanism,
            whole=self.whole,
            counted=counted,
            # see `tree_forces`
            loose=lambda joint: self.loaded and self.merges and isinstance(joint, Fixed),
        )

    def close(self, closure: Closure) -> None:
        """Add the conditions of a cut joint."""
        joint = closure.joint
        copied = f"on a copy of {joint.j!r}: " if closure.links else ""
        self.closures[joint.name] = copied + closure_text(closure.by)
        i, j = map(self.add_frame, self.bodies_of(closure), closure.points)
        conditions = closure_conditions(closure.by, joint, i, j)
        self.conditions += conditions
        self.tied += [(joint.name, each, (i, j)) for each in conditions]

    def relate(self, relation: Relation) -> None:
        """Add the row of a relation of coordinates."""
        self.add_row(relation)

    # methods of the base

    def add_frame(self, body: int, at: Vector) -> BodyFrame:
        """Add a frame to a body, at a point, global at design [m]."""
        handle = self.make_frame(body, np.array(at) - self.origin[body]) if body else None
        self.frames.append(BodyFrame(body, handle, np.array(at)))
        return self.frames[-1]

    @property
    def own_rows(self) -> list[tuple[slice, str | Relation]]:
        """Return the rows of the simulator's own constraints, and what they keep."""
        ends = accumulate((n for n, _ in self.own), initial=0)
        kept = (what for _, what in self.own)
        return [(slice(*pair), what) for pair, what in zip(pairwise(ends), kept, strict=True)]

    @property
    def own_count(self) -> int:
        """Return the number of rows of the simulator's own constraints."""
        return sum(n for n, _ in self.own)

    def rows_of(self, condition: Condition) -> slice:
        """Return the rows of a condition."""
        return self.slices[self.conditions.index(condition)]

    def row_wrenches(self) -> list[RowWrench]:
        """Return the wrenches of unit multipliers of rows between bodies."""
        found = [
            RowWrench(self.rows_of(condition), frame.body, frame.position, wrenches)
            for _, condition, frames in self.tied
            for frame, wrenches in zip(frames, by_frame(condition, frames), strict=True)
        ]
        return found + [
            RowWrench(self.rows_of(each), each.frame.body, each.frame.position, each.pull)
            for each in self.conditions
            if isinstance(each, DrivenPoint)
        ]

    def look(self, frame: BodyFrame) -> None:
        """Read pose, Jacobian and motion of a frame."""
        if frame.handle is not None:
            frame.position, frame.rotation = self.placement(frame.handle)
            frame.jacobian = self.slope(frame.handle)
            frame.velocity, frame.acceleration = self.motion(frame.handle)

    @property
    def driven(self) -> list[tuple[Any, int]]:
        """The driven coordinates, and their signs."""
        drivers = [each for each in self.case.mechanism.drivers if isinstance(each, JointDriver)]
        return [self.coordinates[each.joint, each.freedom] for each in drivers]

    def bodies_of(self, closure: Closure) -> tuple[int, int]:
        """Return the numbers of the bodies to be tied."""
        i, j = closure.ends
        return self.carrier[i], self.carrier[j]

    def carry(self, chain: Chain) -> None:
        """Add the links of a chain."""
        at = self.carrier[chain.parent]
        for link in chain.links:
            self.add_link(at, link, np.array(link.point) - self.origin[at])
            self.parents.append(at)
            at = len(self.origin)
            self.origin.append(np.array(link.point))
            if chain.joint and link.name:
                self.coordinates[chain.joint.name, link.name] = at, chain.sign
        self.carrier[chain.child] = at
        if chain.joint and not chain.cut:
            self.branch_of[chain.joint.name] = at, chain.sign

    def add_row(self, relation: Relation) -> None:
        """Add the row of a relation or of a driver's coordinate."""
        moved = [(*self.coordinates[joint, freedom], w) for joint, freedom, w in relation.terms]
        weights = np.array([sign * weight for _, sign, weight in moved])
        row = Linear(self, [body for body, _, _ in moved], weights)
        bent = Curved(row, relation.curve, moved[-1][1]) if relation.curve else row
        self.conditions.append(bent)
        self.related.append((bent, relation))

    @property
    def details(self) -> Mapping[str, Any]:
        return {"closures": self.closures}

    def reset(self) -> None:
        self.q = self.design()

    def save(self) -> Array:
        return self.q

    def restore(self, saved: Array) -> None:
        self.q = saved

    def move(self, dx: Array) -> None:
        self.q = self.configuration_after(dx)

    def observe(self) -> None:
        """Read the poses and Jacobians of all frames in conditions from the simulator, at q."""
        self.place()
        for frame in self.moving:
            frame.position, frame.rotation = self.placement(frame.handle)
            frame.jacobian = self.slope(frame.handle)

    def observe_rates(self, v: Array) -> None:
        """Read the frames' velocities at v and Jdot v from the simulator, at the q last placed."""
        self.v = v
        self.rate(v, np.zeros_like(v))
        for frame in self.moving:
            frame.velocity, frame.acceleration = self.motion(frame.handle)

    def residual(self, c: Array) -> Array:
        self.observe()
        r = -(self.columns @ c)
        for rows, condition in zip(self.slices, self.conditions, strict=True):
            phi, self.J[rows] = condition.rows()
            r[rows] += phi
        return r

    def jacobian(self) -> Array:
        return self.J

    def driver_columns(self) -> Array:
        return self.columns

    def bias(self, v: Array) -> Array:
        self.observe_rates(v)
        bias = np.empty(len(self.J))
        for rows, condition in zip(self.slices, self.conditions, strict=True):
            bias[rows] = condition.bias()
        return bias

    def points(self, v: Array, a: Array) -> list[tuple[Array, Array, Array]]:
        self.rate(v, a)
        for frame in self.wanted:
            if frame.handle is not None:
                frame.position, frame.rotation = self.placement(frame.handle)
                frame.velocity, frame.acceleration = self.motion(frame.handle)
        return [(each.position, each.velocity[:3], each.acceleration[:3]) for each in self.wanted]

    def dynamics(self, v: Array, a: Array) -> Dynamics:
        assert self.forces is not None
        return self.forces.dynamics(v, a)


class TreeEngine(ProjectionEngine):
    """An engine whose model is a `TreeModel`."""

    joints = CLOSURES

    @property
    def described(self) -> Mapping[str, Any]:
        """Return the coordinates of the tree and the equations of its loops."""
        return {
            "coordinates": f"spanning tree in {self.title}; a joint is a chain of slides, hinges"
            " and balls",
            "closures": "conditions on placements, Jacobians and accelerations of frames",
        }

    @abstractmethod
    def model_of(self, case: Case) -> TreeModel:
        """Return the simulator's model of the unscaled case, at the design position."""
