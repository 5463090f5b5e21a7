"""A mechanism as one tree of slides, hinges and balls, for simulators with generalized coordinates.

The base owns the spanning tree, the joints as chains of links (`joint_chains`), the conditions of
loops (`loop_closures`), relations, couplers and drivers. A simulator adds links and frames and
reports their motion. It knows a body by the number of its link; the ground is body 0. The axes of
every body are global at design, and its origin is the point of its link there.

A constructor prepares the simulator's empty model and then calls the base constructor, which calls
`add_link` for every link, parents first, `make_frame` for every frame, and finally `finish`. Then
the model is solved: `design` and `moved` return configurations q, `place` and `rate` update the
simulator's data, which `placement`, `slope` and `motion` read frame by frame.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.polynomial import Polynomial

from ...core.case.case import Case
from ...core.joints import Fixed, Joint
from ...core.joints.base import unit
from ...core.mechanism.loads import TorsionSpringDamper
from ...core.mechanism.mechanism import (
    GROUND,
    Branch,
    Mechanism,
    SpanningTree,
    Vector,
    spanning_tree,
)
from ...core.mechanism.motions import JointDriver, PointCoordinate
from ...core.trajectory import Array
from .force_solution import Dynamics
from .frame_constraints import Condition
from .joint_chains import CHAINS, Link, free, relations
from .loop_closures import CLOSURES, ends_of
from .poses import middle
from .tree_forces import TreeForces
from .tree_reactions import RowWrench
from .tree_rows import BodyFrame, Curved, DrivenPoint, Linear, Terms, by_frame
from .tree_simulator import TreeSimulator


class TreeModel(TreeSimulator):
    """The mechanism in a simulator; a `ProjectionModel`. Order of rows: joints, couplers, drivers.

    Attributes:
        origin: origin of each body, global at design [m].
        carrier: name of a body of the mechanism -> number of its body here.
        coordinates: joint and freedom -> body moved by this coordinate, and its sign.
        conditions: all rows, the rows of drivers last.
        closures: name of a cut joint -> description of its rows.
        parents: number of the carrier of each body; the ground carries itself.
        branch_of: joint of the tree -> carried body, and its sign: -1 if it is the joint's first.
        tied: conditions between frames, with their joint and frames.
        related: rows of coordinates, with joint, freedom and weight of the terms.
        forces: None unless outputs of the case use forces.
    """

    gives_forces: ClassVar[bool] = True

    def __init__(self, case: Case) -> None:
        self.case = case
        mechanism, tree = case.mechanism, spanning_tree(case.mechanism)
        self.carrier = {GROUND: 0} | {body.name: 0 for body in mechanism.bodies if body.fixed}
        self.origin = [np.zeros(3)]
        self.coordinates: dict[tuple[str, str], tuple[int, int]] = {}
        self.conditions: list[Condition] = []
        self.closures: dict[str, str] = {}
        self.frames: list[BodyFrame] = []
        self.parents = [0]
        self.branch_of: dict[str, tuple[int, int]] = {}
        self.tied: list[tuple[str, Condition, tuple[BodyFrame, BodyFrame]]] = []
        self.related: list[tuple[Condition, Terms]] = []
        self.loaded = self.gives_forces and bool(case.forces)
        cut = tree.cut
        for branch in self.branches(mechanism, tree):
            if self.loaded and isinstance(branch.joint, Fixed):  # see `tree_forces`
                cut = (*cut, branch.joint)
                branch = Branch(GROUND, branch.child, None)
            self.carry(mechanism, branch)
        for joint in cut:
            self.close(joint, ends_of(mechanism, joint), joint.name in self._named(mechanism))
        for coupler in mechanism.couplers:
            self.relate(coupler.terms, coupler.curve)
        for driver in mechanism.drivers:
            if isinstance(driver, PointCoordinate):
                point, k = mechanism.point(driver.point), np.array([*unit(driver.direction)])
                frame = self.add_frame(self.carrier[point.body], point.position)
                self.conditions.append(DrivenPoint(frame, k, np.array(point.position)))
            elif isinstance(driver, JointDriver):
                self.relate([(driver.joint, driver.freedom, 1.0)])
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
        ends = np.cumsum([each.n for each in self.conditions])
        self.slices = [
            slice(end - each.n, end) for end, each in zip(ends, self.conditions, strict=True)
        ]
        self.J = np.zeros((ends[-1], self.unknowns))
        self.columns = np.eye(ends[-1])[:, ends[-1] - len(mechanism.drivers) :]
        self.reset()

    # methods that a simulator may override

    def branches(self, mechanism: Mechanism, tree: SpanningTree) -> Iterable[Branch]:
        """Return the branches in an order with parents before children."""
        return tree.branches

    def close(self, joint: Joint, ends: tuple[Vector, Vector], named: bool) -> None:
        """Add the conditions of a cut joint, by its points on both bodies.

        Args:
            named: whether a driver or coupler names the joint. Its coordinates, which count the
                turns, then move a copy of the second body.
        """
        (i, j), closure, copied = self.bodies_of(joint), CLOSURES[type(joint)], ""
        if named:
            i, closure = self.add_joint(i, joint, ends[0], 1), CLOSURES[Fixed]
            copied = f"on a copy of {joint.j!r}: "
        self.closures[joint.name] = copied + closure.text
        i_frame, j_frame = map(self.add_frame, (i, j), ends)
        conditions = closure.conditions(joint, i_frame, j_frame)
        self.conditions += conditions
        self.tied += [(joint.name, each, (i_frame, j_frame)) for each in conditions]

    # methods of the base

    def _named(self, mechanism: Mechanism) -> set[str]:
        """Return the joints whose coordinates are used: driven, coupled, with torsional springs."""
        found = {name for coupler in mechanism.couplers for name in coupler.joints}
        found |= {each.joint for each in mechanism.drivers if isinstance(each, JointDriver)}
        springs = mechanism.forces if self.loaded else ()
        return found | {f.joint for f in springs if isinstance(f, TorsionSpringDamper)}

    def bodies_of(self, joint: Joint) -> tuple[int, int]:
        """Return the numbers of a joint's first and second body."""
        return self.carrier[joint.i], self.carrier[joint.j]

    def carry(self, mechanism: Mechanism, branch: Branch) -> None:
        """Add the links of a branch."""
        at, joint = self.carrier[branch.parent], branch.joint
        if joint is None:
            # a tangent predicts a body best that turns about its middle
            x, y, z = middle(mechanism, mechanism.body(branch.child)).tolist()
            self.carrier[branch.child] = self.add_links(at, free((x, y, z)))
        else:
            sign = 1 if joint.j == branch.child else -1
            P = ends_of(mechanism, joint)[0]
            self.carrier[branch.child] = self.add_joint(at, joint, P, sign)
            self.branch_of[joint.name] = self.carrier[branch.child], sign

    def add_joint(self, at: int, joint: Joint, P: Vector, sign: int) -> int:
        """Add the links and the relations of a joint on a body; return the number of the last body.

        The chain begins at the joint's first body, or for sign -1 at its second.
        """
        at = self.add_links(at, CHAINS[type(joint)](joint, P), joint.name, sign)
        for relation in relations(joint):
            self.relate(relation)
        return at

    def add_links(self, at: int, links: Sequence[Link], joint: str = "", sign: int = 1) -> int:
        """Add links in the order of the sign; return the number of the last body."""
        for link in links[::sign]:
            self.add_link(at, link, np.array(link.point) - self.origin[at])
            self.parents.append(at)
            at = len(self.origin)
            self.origin.append(np.array(link.point))
            if link.name:
                self.coordinates[joint, link.name] = at, sign
        return at

    def add_frame(self, body: int, at: Vector) -> BodyFrame:
        """Add a frame to a body, at a point, global at design [m]."""
        handle = self.make_frame(body, np.array(at) - self.origin[body]) if body else None
        self.frames.append(BodyFrame(body, handle, np.array(at)))
        return self.frames[-1]

    def relate(self, terms: Terms, curve: Sequence[float] = ()) -> None:
        """Add the row of a weighted sum of coordinates: joint, freedom and weight of its terms.

        Args:
            curve: coefficients of a polynomial in the last coordinate, which is added.
        """
        moved = [(*self.coordinates[joint, freedom], weight) for joint, freedom, weight in terms]
        weights = np.array([sign * weight for _, sign, weight in moved])
        row = Linear(self, [body for body, _, _ in moved], weights)
        self.conditions.append(Curved(row, Polynomial(curve), moved[-1][1]) if curve else row)
        self.related.append((self.conditions[-1], terms))

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
        self.q = self.moved(dx)

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

    # forces; see `tree_forces.LoadedTree`

    def dynamics(self, v: Array, a: Array) -> Dynamics:
        assert self.forces is not None
        return self.forces.dynamics(v, a)

    def angle(self, joint: str) -> float:
        """Return a joint's angle [rad], zero at design."""
        body, sign = self.coordinates[joint, "rotation"]
        return sign * float(self.q[self.coordinate(body)[0]])

    def rows_of(self, joint: str) -> list[slice]:
        """Return the rows of a cut joint."""
        return [self._rows(each) for name, each, _ in self.tied if name == joint]

    def _rows(self, condition: Condition) -> slice:
        return self.slices[self.conditions.index(condition)]

    def exerted(self) -> list[RowWrench]:
        """Return the wrenches of unit multipliers of conditions between frames."""
        found = [
            RowWrench(self._rows(condition), frame.body, frame.position, wrenches)
            for _, condition, frames in self.tied
            for frame, wrenches in zip(frames, by_frame(condition, frames), strict=True)
        ]
        return found + [
            RowWrench(self._rows(each), each.frame.body, each.frame.position, each.pull)
            for each in self.conditions
            if isinstance(each, DrivenPoint)
        ]

    def coordinate_rows(self) -> dict[int, list[tuple[str, str]]]:
        """Return the rows of coordinates, and joint and freedom of each."""
        return {
            self._rows(row).start: [(joint, freedom) for joint, freedom, _ in terms]
            for row, terms in self.related
        }

    def coordinate_weight(self, row: int, joint: str, freedom: str) -> float:
        body, sign = self.coordinates[joint, freedom]
        return sign * float(self.J[row, self.coordinate(body)[1]])
