"""A mechanism as .osim, the XML of OpenSim, whose simulator is Simbody.

The format has no velocities, and its ball joints lock at a right angle, so the model is written in
its start pose. Hinges and slides have the coordinates of the case there, as default values; those
of balls, crosses and free bodies are zero. A body has its frame of the case. Loops are closed
by Simbody's constraints of a point, a distance or a whole frame; coordinate couplers relate
coordinates to one another by a factor, a polynomial or a spline. Spring-dampers are forces of
OpenSim. Names in OpenSim are parts of paths: an underscore replaces characters with a meaning in
paths.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping

import numpy as np
from numpy.polynomial import Polynomial as Powers

from ...core.algebra import IDENTITY, Quat, triple, vec
from ...core.extensions.exports.model_writer import NO_RANGES, NO_ZEROS, Ranges, Zeros
from ...core.joints import PiecewisePolynomial
from ...core.joints.base import unit
from ...core.mechanism.body import Body
from ...core.mechanism.loads import ForceElement, Law, SpringDamper, TorsionSpringDamper
from ...core.mechanism.mechanism import GROUND, Mechanism, Vector
from ...core.trajectory import BodyMotion
from ..shared.axis_angles import euler_angles, orientation
from . import text
from .hung_tree import Tie, TreeJoint, loops, tree_of
from .poses import about, at_start, attitude, bushing_ends, joint_coordinates, local
from .text import add_note, add_text, document, numbers, require_known

NOTE = (
    " Written by kincheck. Lengths are in m, angles in rad. {} This file is in the pose of the"
    " start{}. Coordinates are those of the case; those of balls, crosses and free bodies are zero"
    " there.{}{} "
)
KINDS = {
    "slide": "SliderJoint",
    "hinge": "PinJoint",
    "ball": "BallJoint",
    "fixed": "WeldJoint",
    "free": "FreeJoint",
}
NONE = (0.0, 0.0, 0.0)
# Coordinates of a joint in OpenSim's order.
COORDINATES = {
    "slide": [""],
    "hinge": [""],
    "ball": [".rotation_x", ".rotation_y", ".rotation_z"],
    "fixed": [],
    "free": [".rotation_x", ".rotation_y", ".rotation_z", ".x", ".y", ".z"],
}


def write(
    mechanism: Mechanism,
    way: Mapping[str, BodyMotion],
    start: Mapping[str, float],
    zeros: Zeros = NO_ZEROS,
    ranges: Ranges = NO_RANGES,
) -> Mapping[str, str]:
    """Return an .osim file in the pose at the end of the way; see `Writer`.

    Raises:
        KincheckError: a joint has no counterpart here, or a name cannot be used.
    """
    require_known(mechanism, "OpenSim")
    values = joint_coordinates(mechanism, way)
    values = {key: x + zeros.get(key, 0.0) for key, x in values.items()}
    gravity = mechanism.gravity if mechanism.has_loads else NONE
    model = _Model(at_start(mechanism, way), gravity, values, ranges)
    model.add_bushings(mechanism)
    at = ", ".join(f"{name} = {value!r}" for name, value in start.items())
    frames = model.tree.frames.values()
    masses, left_out = text.facts(mechanism, model.sprung, frames, "OpenSim", law=Law.CARDAN)
    left_out += text.lost_limits(ranges, model.tree.coordinates)
    closed = loops(model.tree.ties, TIES[:3])
    add_note(model.root, NOTE.format(masses, at and f" ({at})", closed, left_out))
    sets = [["Body"], [*KINDS.values()], ["Coordinate"], ["Marker"], [*TIES], [*SPRINGS]]
    return {".osim": document(model.root, sets, reserved=[GROUND])}


TIES = (
    "PointConstraint",
    "WeldConstraint",
    "ConstantDistanceConstraint",
    "CoordinateCouplerConstraint",
)


SPRINGS = ("ExpressionBasedPointToPointForce", "SpringGeneralizedForce", "BushingForce")


class _Model:
    """The document during its construction; the mechanism is at its start."""

    def __init__(
        self,
        mechanism: Mechanism,
        gravity: Vector,
        values: Mapping[tuple[str, str], float],
        ranges: Ranges,
    ) -> None:
        self.tree = tree_of(mechanism)
        names = self.tree.coordinates
        self.ranges = {names[key]: limits for key, limits in ranges.items() if key in names}
        # values of coordinates at the start, by name
        self.values = {name: values.get(key, 0.0) for key, name in self.tree.coordinates.items()}
        self.root = ET.Element("OpenSimDocument", Version="40000")
        model = ET.SubElement(self.root, "Model", name=_name(mechanism.name))
        ET.SubElement(model, "Ground", name=GROUND)
        add_text(model, "gravity", gravity)
        bodies, joints, constraints, markers = (
            ET.SubElement(ET.SubElement(model, kind, name=kind.lower()), "objects")
            for kind in ("BodySet", "JointSet", "ConstraintSet", "MarkerSet")
        )
        for body in self.tree.frames.values():
            self.add_body(bodies, body)
        for joint in self.tree.joints:
            self.add_joint(joints, joint)
        for tie in self.tree.ties:
            self.add_tie(constraints, tie)
        for k, (name, one, other, line) in enumerate(self.tree.relations):
            self.couple(constraints, f"{name}.{k}", one, other, line)
        for curve in self.tree.curves:
            self.couple(constraints, *curve)
        for point in mechanism.points:
            marker = ET.SubElement(markers, "Marker", name=_name(point.name))
            add_text(marker, "socket_parent_frame", _path(point.body))
            add_text(marker, "location", self.local(point.body, point.position))

        self.model, self.sprung = model, set[str]()
        if mechanism.forces:
            forces = self.forces()
            plain = text.without_curves(mechanism)
            self.sprung = {each.name for each in plain if self.add_spring(forces, each)}

    def forces(self) -> ET.Element:
        """Return the place of force elements."""
        found = self.model.find("ForceSet/objects")
        if found is None:
            found = ET.SubElement(ET.SubElement(self.model, "ForceSet", name="forceset"), "objects")
        return found

    def add_bushings(self, design: Mechanism) -> None:
        """Add the bushings of the mechanism at design; OpenSim's torque is that of `Law.CARDAN`."""
        for each in design.forces:
            if not text.plain_bushing(each):
                continue
            element = ET.SubElement(self.forces(), SPRINGS[2], name=_name(each.name))
            for k in (1, 2):
                add_text(element, f"socket_frame{k}", f"end{k}")
            frames = ET.SubElement(element, "frames")
            for k, (body, at, turn) in enumerate(bushing_ends(design, each), 1):
                _add_frame(frames, f"end{k}", body, at, turn)
            add_text(element, "rotational_stiffness", each.turning_stiffness)
            add_text(element, "translational_stiffness", each.stiffness)
            add_text(element, "rotational_damping", each.turning_damping)
            add_text(element, "translational_damping", each.damping)
            self.sprung.add(each.name)

    def frame(self, body: str) -> Body:
        """Return the frame of a link at design."""
        return self.tree.frames.get(body) or Body(GROUND)

    def local(self, body: str, P: Vector) -> Vector:
        """Return a point, global at design, in the frame of a link [m]."""
        return local(self.frame(body), P)

    def add_body(self, bodies: ET.Element, body: Body) -> None:
        """Add a body with its mass."""
        element = ET.SubElement(bodies, "Body", name=_name(body.name))
        add_text(element, "mass", text.mass_of(body))
        add_text(element, "mass_center", local(body, body.center))
        add_text(element, "inertia", text.six(text.own_inertia(body)))

    def add_joint(self, joints: ET.Element, joint: TreeJoint) -> None:
        """Add a joint between a frame of the parent and a frame of the child, which coincide at
        zero.
        """
        element = ET.SubElement(joints, KINDS[joint.move], name=_name(joint.name))
        add_text(element, "socket_parent_frame", "parent")
        add_text(element, "socket_child_frame", "child")
        suffixes, value = COORDINATES[joint.move], self.values.get(joint.name, 0.0)
        coordinates = ET.SubElement(element, "coordinates") if suffixes else element
        for suffix in suffixes:
            coordinate = ET.SubElement(coordinates, "Coordinate", name=_name(joint.name + suffix))
            add_text(coordinate, "default_value", value)
            limits = self.ranges.get(joint.name)
            add_text(coordinate, "range", limits or "-1e9 1e9")
            if limits:
                add_text(coordinate, "clamped", "true")
        frames = ET.SubElement(element, "frames")
        turn = _turns(orientation(joint.move, joint.axis))
        if joint.move in ("fixed", "free"):
            turn = attitude(self.frame(joint.child))
        # the frame on the parent stands where the coordinate is zero
        zero, back = joint.point, turn
        if joint.move == "slide":
            along = np.array([*unit(joint.axis)])
            zero = triple(np.array(joint.point) - value * along)
        elif joint.move == "hinge":
            back = turn * about(vec((0.0, 0.0, 1.0)), -value)
        ends = (("parent", joint.parent, zero, back), ("child", joint.child, joint.point, turn))
        for end, body, point, axes in ends:
            _add_frame(frames, end, body, self.local(body, point), self.local_turn(body, axes))

    def local_turn(self, body: str, turn: Quat) -> Quat:
        """Return a rotation, global at design, in the axes of a link."""
        return attitude(self.frame(body)).conjugate() * turn

    def add_tie(self, constraints: ET.Element, tie: Tie) -> None:
        """Add a constraint between two links."""
        if tie.whole:
            element = ET.SubElement(constraints, "WeldConstraint", name=_name(tie.name))
            frames = ET.SubElement(element, "frames")
            for k, (link, at) in enumerate(zip(tie.links, tie.points, strict=True), 1):
                add_text(element, f"socket_frame{k}", f"end{k}")
                turn = self.local_turn(link, IDENTITY)
                _add_frame(frames, f"end{k}", link, self.local(link, at), turn)
            return
        kind = "PointConstraint" if tie.length is None else "ConstantDistanceConstraint"
        element = ET.SubElement(constraints, kind, name=_name(tie.name))
        for k, (link, at) in enumerate(zip(tie.links, tie.points, strict=True), 1):
            add_text(element, f"socket_body_{k}", _path(link))
            add_text(element, f"location_body_{k}", self.local(link, at))
        if tie.length is not None:
            add_text(element, "constant_distance", tie.length)

    def add_spring(self, forces: ET.Element, force: ForceElement) -> bool:
        """Add a spring-damper; return whether OpenSim has it."""
        if isinstance(force, SpringDamper):
            element = ET.SubElement(forces, SPRINGS[0], name=_name(force.name))
            for k, (link, at) in enumerate(zip(force.bodies, force.points, strict=True), 1):
                add_text(element, f"body{k}", _path(link))
                add_text(element, f"point{k}", self.local(link, at))
            stiffness, damping = numbers(force.stiffness), numbers(force.damping)
            length = numbers([force.free_length])
            # a force that pulls the points together is positive
            add_text(element, "expression", f"{stiffness}*(d-{length})+{damping}*ddot")
            return True
        if isinstance(force, TorsionSpringDamper):
            coordinate = self.tree.coordinates.get((force.joint, "rotation"))
            if coordinate is None:  # between fixed bodies
                return False
            element = ET.SubElement(forces, SPRINGS[1], name=_name(force.name))
            add_text(element, "coordinate", _name(coordinate))
            add_text(element, "stiffness", force.stiffness)
            rest = force.free_angle + self.values[coordinate]
            add_text(element, "rest_length", rest)
            add_text(element, "viscosity", force.damping)
            return True
        return False

    def couple(
        self, constraints: ET.Element, name: str, one: str, other: str, follows: PiecewisePolynomial
    ) -> None:
        """Let one coordinate follow a function of another, both from the start."""
        y, x = (self.values.get(each, 0.0) for each in (one, other))
        element = ET.SubElement(constraints, "CoordinateCouplerConstraint", name=_name(name))
        around = ET.SubElement(element, "coupled_coordinates_function")
        if follows.knots:
            spline = ET.SubElement(around, "SimmSpline")
            points = [(at + x, value + y) for at, value in follows.knots]
            for key, values in zip("xy", zip(*points, strict=True), strict=True):
                add_text(spline, key, values)
        else:
            moved: list[float] = (Powers(follows.powers[0])(Powers((-x, 1.0))) + y).coef.tolist()
            kind = "LinearFunction" if len(moved) == 2 else "PolynomialFunction"
            add_text(ET.SubElement(around, kind), "coefficients", moved[::-1])
        add_text(element, "independent_coordinate_names", _name(other))
        add_text(element, "dependent_coordinate_name", _name(one))


def _add_frame(frames: ET.Element, name: str, body: str, at: Vector, turn: Quat) -> None:
    """Add a frame of a link, by its place and rotation in the link."""
    frame = ET.SubElement(frames, "PhysicalOffsetFrame", name=name)
    add_text(frame, "socket_parent", _path(body))
    add_text(frame, "translation", at)
    add_text(frame, "orientation", euler_angles([float(x) for x in turn]))


def _turns(angles: Vector) -> Quat:
    """Return the rotation of successive rotations about x, y and z."""
    x, y, z = (
        about(vec(axis), angle) for axis, angle in zip(np.eye(3).tolist(), angles, strict=True)
    )
    return x * y * z


def _name(name: str) -> str:
    return re.sub(r"[^\w.-]", "_", name, flags=re.ASCII)


def _path(body: str) -> str:
    return "/ground" if body == GROUND else f"/bodyset/{_name(body)}"
