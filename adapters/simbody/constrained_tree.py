"""A mechanism as a tree of bodies in an OpenSim model, with Simbody's constraints to close loops;
private to its adapter.

The axes of every body are global at design. Names are numbers, because OpenSim aborts the process
at a name with a space. Limits of coordinates have no effect: they act on forces and on `setValue`,
and neither is used.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ...core.case.case import Case
from ...core.joints import Distance, Inline, Spherical
from ...core.joints.base import unit
from ...core.trajectory import Array
from ..shared.opensim_frames import orientation
from ..shared.tree_forces import NO_MASS
from ..shared.tree_model import TreeModel
from ..shared.tree_plan import Closure, Link, Relation

NO_TURN = (0.0, 0.0, 0.0)


class ConstrainedTree(TreeModel):
    """The OpenSim model of a case: a body with its joint for each link, a constraint for each cut
    joint and each relation.

    Attributes:
        o: OpenSim's package.
        model: OpenSim's model, which owns all other objects.
        bodies: OpenSim's bodies by their numbers; the first is the ground.
        moves: OpenSim's joint of each body after the ground.
    """

    whole = (Distance, Inline)

    def __init__(self, o: Any, case: Case) -> None:
        self.o, self.model = o, o.Model()
        self.bodies = [self.model.getGround()]
        self.moves: list[Any] = []
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

    def close(self, closure: Closure) -> None:
        i, j = self.bodies_of(closure)
        if i == j:
            # OpenSim aborts the process at a constraint of a body with itself
            super().close(closure)
            return
        o, joint = self.o, closure.joint
        at_i, at_j = (
            (self.bodies[body], self.vector(np.array(P) - self.origin[body]))
            for body, P in zip((i, j), closure.points, strict=True)
        )
        none = self.vector(NO_TURN)
        if isinstance(joint, Distance):
            rows, constraint = 1, o.ConstantDistanceConstraint(*at_i, *at_j, joint.rod_length)
        elif isinstance(joint, Inline):
            body, P = at_i
            along = self.vector(unit(joint.axis))
            rows, constraint = 2, o.PointOnLineConstraint(body, along, P, *at_j)
        elif closure.by is Spherical:
            rows, constraint = 3, o.PointConstraint(*at_i, *at_j)
        else:
            rows, constraint = 6, o.WeldConstraint("weld", *at_i, none, *at_j, none)
        self.constrain(constraint, rows, joint.name)
        moved = f", on a body that {' and '.join(closure.links)} move on {joint.i!r}"
        name = constraint.getConcreteClassName()
        self.closures[joint.name] = name + (moved if closure.links else "")

    def relate(self, relation: Relation) -> None:
        if relation.curve:
            super().relate(relation)
            return
        o, coupler = self.o, self.o.CoordinateCouplerConstraint()
        one, other, (_, factor) = relation.follower(signed=True)
        names = o.ArrayStr()
        names.append(coordinate_name(self.coordinates[other][0]))
        coupler.setIndependentCoordinateNames(names)
        coupler.setDependentCoordinateName(coordinate_name(self.coordinates[one][0]))
        coupler.setFunction(o.LinearFunction(factor, 0.0))
        self.constrain(coupler, 1, relation)

    def constrain(self, constraint: Any, rows: int, keeps: str | Relation) -> None:
        """Add a constraint with a number of rows under a unique name."""
        self.own.append((rows, keeps))
        constraint.setName(f"constraint_{self.model.getNumConstraints()}")
        self.model.addConstraint(constraint)

    def vector(self, a: Iterable[float]) -> Any:
        """Return a vector as OpenSim's type."""
        return self.o.Vec3(*map(float, a))


def coordinate_name(body: int) -> str:
    """Return the name in OpenSim of the coordinate of a body's slide or hinge."""
    return f"coordinate_{body}"
