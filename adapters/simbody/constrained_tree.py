"""A mechanism as a tree of bodies in an OpenSim model, with Simbody's constraints to close loops;
private to its adapter.

The axes of every body are global at design. Names are numbers, because OpenSim aborts the process
at a name with a space. Limits of coordinates have no effect: they act on forces and on `setValue`,
and neither is used.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ...core.case.case import Case
from ...core.joints import Distance, Inline, Joint
from ...core.joints.base import unit
from ...core.mechanism.mechanism import Vector
from ...core.trajectory import Array
from ..shared.joint_chains import CHAINS, Link, dependence, end_of_loop, relations
from ..shared.opensim_frames import orientation
from ..shared.tree_forces import NO_MASS
from ..shared.tree_model import TreeModel
from ..shared.tree_rows import Terms

NO_TURN = (0.0, 0.0, 0.0)


class ConstrainedTree(TreeModel):
    """The OpenSim model of a case: a body with its joint for each link, a constraint for each cut
    joint and each relation.

    Attributes:
        o: OpenSim's package.
        model: OpenSim's model, which owns all other objects.
        bodies: OpenSim's bodies by their numbers; the first is the ground.
        moves: OpenSim's joint of each body after the ground.
        constraints: purpose of each of OpenSim's constraints: the name of a cut joint, or joint and
            freedom of the coordinates of a relation.
    """

    def __init__(self, o: Any, case: Case) -> None:
        self.o, self.model = o, o.Model()
        self.bodies = [self.model.getGround()]
        self.moves: list[Any] = []
        self.constraints: list[tuple[int, str | list[tuple[str, str]]]] = []
        super().__init__(case)

    def add_link(self, parent: int, link: Link, offset: Array) -> None:
        o, number = self.o, len(self.bodies)
        joint = {"slide": o.SliderJoint, "hinge": o.PinJoint, "ball": o.BallJoint}[link.move]
        axes = self.vector(orientation(link.move, link.axis))
        # kinematics does not depend on masses, but OpenSim requires them
        mass = NO_MASS if self.loaded else 1.0
        body = o.Body(f"body_{number}", mass, o.Vec3(0.0), o.Inertia(mass, mass, mass))
        move = joint(
            f"joint_{number}",
            self.bodies[parent],
            self.vector(offset),
            axes,
            body,
            o.Vec3(0.0),
            axes,
        )
        if link.move != "ball":
            move.upd_coordinates(0).setName(coordinate_name(number))
        self.model.addBody(body)
        self.model.addJoint(move)
        self.bodies.append(body)
        self.moves.append(move)

    def close(self, joint: Joint, ends: tuple[Vector, Vector], named: bool) -> None:
        i, j = self.bodies_of(joint)
        links, point, turns = (), ends[0], False
        if not isinstance(joint, Distance | Inline):
            links, point, turns = end_of_loop(CHAINS[type(joint)](joint, point), point)
            ends = point, point
        i = self.add_links(i, links, joint.name)
        for relation in relations(joint):
            self.relate(relation)
        if i == j:
            # OpenSim aborts the process at a constraint of a body with itself
            super().close(joint, ends, named=False)
            return
        o = self.o
        at_i, at_j = (
            (self.bodies[body], self.vector(np.array(P) - self.origin[body]))
            for body, P in zip((i, j), ends, strict=True)
        )
        none = self.vector(NO_TURN)
        if isinstance(joint, Distance):
            rows, constraint = 1, o.ConstantDistanceConstraint(*at_i, *at_j, joint.rod_length)
        elif isinstance(joint, Inline):
            body, P = at_i
            along = self.vector(unit(joint.axis))
            rows, constraint = 2, o.PointOnLineConstraint(body, along, P, *at_j)
        elif turns:
            rows, constraint = 3, o.PointConstraint(*at_i, *at_j)
        else:
            rows, constraint = 6, o.WeldConstraint("weld", *at_i, none, *at_j, none)
        self.constrain(constraint, rows, joint.name)
        moved = f", on a body that {' and '.join(each.move for each in links)} move on {joint.i!r}"
        self.closures[joint.name] = constraint.getConcreteClassName() + (moved if links else "")

    def relate(self, terms: Terms, curve: Sequence[float] = ()) -> None:
        if len(terms) == 1 or curve:  # a driver or a polynomial
            super().relate(terms, curve)
            return
        o, coupler = self.o, self.o.CoordinateCouplerConstraint()
        moved = [(self.coordinates[joint, freedom], weight) for joint, freedom, weight in terms]
        one, other, factor = dependence((body, sign * weight) for (body, sign), weight in moved)
        names = o.ArrayStr()
        names.append(coordinate_name(other))
        coupler.setIndependentCoordinateNames(names)
        coupler.setDependentCoordinateName(coordinate_name(one))
        coupler.setFunction(o.LinearFunction(factor, 0.0))
        self.constrain(coupler, 1, [(joint, freedom) for joint, freedom, _ in terms])

    def constrain(self, constraint: Any, rows: int, keeps: str | list[tuple[str, str]]) -> None:
        """Add a constraint with a number of rows under a unique name."""
        self.constraints.append((rows, keeps))
        constraint.setName(f"constraint_{self.model.getNumConstraints()}")
        self.model.addConstraint(constraint)

    def vector(self, a: Iterable[float]) -> Any:
        """Return a vector as OpenSim's type."""
        return self.o.Vec3(*map(float, a))


def coordinate_name(body: int) -> str:
    """Return the name in OpenSim of the coordinate of a body's slide or hinge."""
    return f"coordinate_{body}"
