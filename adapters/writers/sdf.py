"""A mechanism as SDF for Drake: a tree, ball constraints that close the loops, and joints that
mimic others.

SDF has no state, so the model is written in its start pose, where all joints are at zero. A link
has the frame of its body in the case; spring-dampers are Drake's. Drake's parser reads only ball
constraints: two of them tie a hinge, three a frame, and a rod is a link between a cross and a ball.
Drake supports constraints only in discrete plants.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from math import inf

import numpy as np

from ...core.algebra import IDENTITY, Quat, triple
from ...core.errors import KincheckError
from ...core.extensions.exports.model_writer import NO_RANGES, NO_ZEROS, Ranges, Zeros
from ...core.extensions.trees.robot_elements import BUSHING, STRUT
from ...core.joints.base import unit
from ...core.mechanism.body import Body
from ...core.mechanism.loads import ForceElement, SpringDamper, TorsionSpringDamper
from ...core.mechanism.mechanism import GROUND, Mechanism, Vector
from ...core.trajectory import BodyMotion
from ..shared.equivalents import cross_of
from . import text
from .hung_tree import Tie, TreeJoint, extent, loops, tree_of
from .poses import at_start, attitude, bushing_ends, joint_coordinates, local
from .text import add_note, add_text, document, numbers, require_known

NOTE = (
    " Written by kincheck. Lengths are in m, angles in rad. {} Joints are at zero at the start,"
    " which is the pose of this file{}. Read it into a discrete plant of Drake: a continuous one"
    " has no constraints.{}{} "
)
TIES = ("a ball constraint", "three ball constraints", "a link on a cross and a ball constraint")
KINDS = {"slide": "prismatic", "hinge": "revolute", "ball": "ball", "fixed": "fixed"}
WORLD = "world"
MIMIC = "drake:mimic"
FAR = (-inf, inf)


def write(
    mechanism: Mechanism,
    way: Mapping[str, BodyMotion],
    start: Mapping[str, float],
    zeros: Zeros = NO_ZEROS,
    ranges: Ranges = NO_RANGES,
) -> Mapping[str, str]:
    """Return an .sdf file in the pose at the end of the way; see `Writer`.

    Raises:
        KincheckError: a joint has no counterpart here, or a name cannot be used.
    """
    require_known(mechanism, "SDF")
    for coupler in mechanism.couplers:
        if coupler.curve:
            raise KincheckError(
                f"{coupler} has no counterpart in SDF: its joints mimic others by a factor. Write"
                " URDF or OpenSim instead."
            )
    values = joint_coordinates(mechanism, way)
    values = {key: x + zeros.get(key, 0.0) for key, x in values.items()}
    limits = {key: [x - values[key] for x in each] for key, each in ranges.items()}
    model = _Model(at_start(mechanism, way), limits)
    model.add_bushings(mechanism)
    at = ", ".join(f"{name} = {value!r}" for name, value in start.items())
    zero = text.zeros_of(values) + text.lost_limits(ranges, model.tree.coordinates)
    frames = model.tree.frames.values()
    masses, left_out = text.facts(mechanism, model.sprung, frames, "Drake", gravity=False)
    note = NOTE.format(masses, at and f" ({at})", model.loops, zero + left_out)
    add_note(model.root, note)
    kinds = (["link", "frame", "joint", "drake:ball_constraint", STRUT],)
    return {".sdf": document(model.root, kinds, reserved=[WORLD])}


class _Model:
    """The document during its construction; the mechanism is at its start."""

    def __init__(
        self, mechanism: Mechanism, limits: Mapping[tuple[str, str], Sequence[float]]
    ) -> None:
        self.mechanism, self.tree = mechanism, tree_of(mechanism)
        names = self.tree.coordinates
        self.limits = {names[key]: each for key, each in limits.items() if key in names}
        self.root = ET.Element("sdf", {"version": "1.11", "xmlns:drake": text.DRAKE})
        self.model = ET.SubElement(self.root, "model", name=mechanism.name)
        self.joints: dict[str, ET.Element] = {}
        self.loops = loops(self.tree.ties, TIES)
        for tie in self.tree.ties:
            if tie.length is not None:
                self.add_rod(tie)
        # Drake has no ball constraint with the world body
        self.tree.frames[GROUND] = Body(GROUND)
        self.tree.joints.append(
            TreeJoint(f"{GROUND}.fixed", "fixed", WORLD, GROUND, (0.0, 0.0, 0.0))
        )
        for frame in self.tree.frames.values():
            self.add_link(frame)
        for joint in self.tree.joints:
            if joint.move != "free":  # a link without a joint is free
                self.add_joint(joint)
        for name, one, other, line in self.tree.relations:
            self.relate(name, one, other, line.at(0.0)[1])
        for point in mechanism.points:
            frame = {"name": f"point.{point.name}", "attached_to": point.body}
            self.add_pose(ET.SubElement(self.model, "frame", frame), point.position)
        arm = extent(mechanism)
        for tie in self.tree.ties:
            if tie.length is None:
                self.add_tie(tie, arm)
        self.sprung = {
            each.name for each in text.without_curves(mechanism) if self.add_spring(each)
        }

    def add_rod(self, tie: Tie) -> None:
        """Add a link on a cross at the first point of a rod; tie its end to the second point."""
        (i, j), (P, Q), length = tie.links, tie.points, tie.length
        assert length is not None
        along = np.array([*unit([b - a for a, b in zip(P, Q, strict=True)])])
        end = triple(np.array(P) + length * along)
        names = [f"{tie.name}.first", f"{tie.name}.second"]
        links = [f"{names[0]}.link", f"{tie.name}.rod"]
        axes = cross_of(self.mechanism, i, along)
        for name, parent, child, axis in zip(names, (i, *links), links, axes, strict=False):
            self.tree.joints.append(TreeJoint(name, "hinge", parent, child, P, axis))
            self.tree.frames[child] = Body(child, P)
        self.tree.ties.append(Tie(tie.name, (links[1], j), (end, Q)))

    def add_link(self, body: Body) -> None:
        """Add a link with the frame and the mass of a body."""
        link = ET.SubElement(self.model, "link", name=body.name)
        self.add_pose(link, body.origin, attitude(body))
        inertial = ET.SubElement(link, "inertial")
        add_text(inertial, "pose", f"{numbers(local(body, body.center))} 0 0 0")
        add_text(inertial, "mass", text.mass_of(body))
        inertia = ET.SubElement(inertial, "inertia")
        entries = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        for entry, value in zip(entries, text.six(text.own_inertia(body)), strict=True):
            add_text(inertia, entry, value)

    def add_pose(
        self, element: ET.Element, at: Vector, turn: Quat = IDENTITY, of: str = "__model__"
    ) -> None:
        """Add the pose of an element, in the axes of the model or a link."""
        e0, e1, e2, e3 = turn
        options = {"relative_to": of, "rotation_format": "quat_xyzw"}
        add_text(element, "pose", (*at, e1, e2, e3, e0), options)

    def add_joint(self, joint: TreeJoint) -> None:
        """Add a joint at its point, in global axes."""
        element = ET.SubElement(
            self.model, "joint", name=self.joint_name(joint.name), type=KINDS[joint.move]
        )
        self.joints[joint.name] = element
        add_text(element, "parent", joint.parent)
        add_text(element, "child", joint.child)
        self.add_pose(element, joint.point)
        if joint.move in ("slide", "hinge"):
            axis = ET.SubElement(element, "axis")
            add_text(axis, "xyz", joint.axis)
            limit = ET.SubElement(axis, "limit")
            for key, x in zip(("lower", "upper"), self.limits.get(joint.name, FAR), strict=True):
                add_text(limit, key, x)

    def joint_name(self, name: str) -> str:
        """Return the name of a joint, which in SDF must differ from the names of links."""
        return f"{name}.joint" if name in self.tree.frames else name

    def add_tie(self, tie: Tie, arm: float) -> None:
        """Add ball constraints: at the point, and for a whole frame at two further points."""
        arms = np.concatenate([np.zeros((1, 3)), arm * np.eye(3)[:2]]) if tie.whole else [(0,) * 3]
        for k, offset in enumerate(np.array(arms)):
            element = ET.SubElement(
                self.model, "drake:ball_constraint", name=f"{tie.name}.tie{k or ''}"
            )
            for side, link, P in zip("AB", tie.links, tie.points, strict=True):
                point = triple(np.array(P) + offset)
                end = "P" if side == "A" else "Q"
                add_text(element, f"drake:ball_constraint_body_{side}", link)
                name = f"drake:ball_constraint_p_{side}{end}"
                add_text(element, name, self.local(link, point))

    def add_bushings(self, design: Mechanism) -> None:
        """Add the bushings of the mechanism at design. Drake's law has forces along half-way axes,
        at half-way points, and angles of roll, pitch and yaw.
        """
        for each in design.forces:
            if not text.plain_bushing(each):
                continue
            element = ET.Element(BUSHING)
            for side, (body, at, turn) in zip("AC", bushing_ends(design, each), strict=True):
                name = f"{each.name}.{side}"
                frame = ET.SubElement(self.model, "frame", name=name, attached_to=body)
                self.add_pose(frame, at, turn, body)
                add_text(element, f"drake:bushing_frame{side}", name)
            for what, values in text.bushing_law(each).items():
                add_text(element, f"drake:bushing_{what}", values)
            self.model.append(element)
            self.sprung.add(each.name)

    def add_spring(self, force: ForceElement) -> bool:
        """Add a spring-damper; return whether Drake has it."""
        if isinstance(force, SpringDamper):
            if not force.free_length:  # Drake refuses it
                return False
            element = ET.SubElement(self.model, STRUT, name=self.spring_name(force.name))
            for tag, content in text.strut(force, self.local).items():
                add_text(element, tag, content)
            return True
        if isinstance(force, TorsionSpringDamper):
            name = self.tree.coordinates.get((force.joint, "rotation"))
            axis = self.joints[name].find("axis") if name else None
            # between fixed bodies, or a second one
            if axis is None or axis.find("dynamics") is not None:
                return False
            dynamics = ET.SubElement(axis, "dynamics")
            add_text(dynamics, "damping", force.damping)
            add_text(dynamics, "spring_reference", force.free_angle)
            add_text(dynamics, "spring_stiffness", force.stiffness)
            return True
        return False

    def spring_name(self, name: str) -> str:
        """Return the name of a spring, which in SDF differs from those of all others in a model."""
        taken = {each.attrib.get("name") for each in self.model}
        while name in taken:
            name += ".spring"
        return name

    def local(self, link: str, P: Vector) -> Vector:
        """Return a point, global at the start, in the axes of a link [m]."""
        return local(self.tree.frames[link], P)

    def relate(self, name: str, one: str, other: str, factor: float) -> None:
        """Let one coordinate mimic another, by a factor, or the other by its inverse.

        Raises:
            KincheckError: both mimic others already.
        """
        taken = [self.joints[each].find(MIMIC) is not None for each in (one, other)]
        if all(taken):
            raise KincheckError(
                f"{name!r}: a joint of SDF mimics one other, and {one!r} and {other!r} do already;"
                " write MJCF or Exudyn instead"
            )
        if taken[0]:
            one, other, factor = other, one, 1.0 / factor
        options = {"joint": self.joint_name(other), "multiplier": numbers(factor), "offset": "0"}
        ET.SubElement(self.joints[one], MIMIC, options)
