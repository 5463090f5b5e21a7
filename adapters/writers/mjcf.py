"""A mechanism as MJCF, the XML of MuJoCo. Writing needs no MuJoCo, whose own writer keeps only six
digits.

A body is a <body> with its frame in the case. A joint of the tree is a chain of MuJoCo joints on
one body. A loop is closed by a connect at a ball, two connects at a hinge, a tendon of constant
length at a distance, and else by a weld of an auxiliary body (see `hung_tree`). Joint equalities
tie coordinates to one another. Spring-dampers are tendons and attributes of joints; MJCF has no
constant forces. Without masses in the mechanism, bodies have a unit mass and inertia. Joints have
an armature only where a mass is missing.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence

from ...core.algebra import vec
from ...core.errors import KincheckError
from ...core.extensions.exports.model_writer import NO_RANGES, NO_ZEROS, Ranges, Zeros
from ...core.extensions.trees.masses import STAND_INS
from ...core.mechanism.loads import ForceElement, SpringDamper, TorsionSpringDamper
from ...core.mechanism.mechanism import GROUND, Body, Mechanism
from ...core.trajectory import BodyMotion
from ..shared.tree_plan import CHAINS, Chain, Closure, Relation, ends_of
from . import text
from .hung_tree import Tie, loops, plan, share_masses, ties
from .poses import (
    attitude,
    direction,
    displacements,
    link_coordinates,
    local,
    rotated,
)
from .text import add_note, document, numbers, require_known

NOTE = (
    " Written by kincheck. Lengths are in m, angles in rad. {} Drivers are not part of the model:"
    " the keyframe is consistent with the driver values under custom.{}{} "
)
PLAIN = "Masses, inertias and armatures are placeholders."
ARMATURE = f" Coordinates have an armature of {text.STAND_IN[1]:g}."
KINDS = ("connect", "weld", "tendon")


def write(
    mechanism: Mechanism,
    way: Mapping[str, BodyMotion],
    start: Mapping[str, float],
    zeros: Zeros = NO_ZEROS,
    ranges: Ranges = NO_RANGES,
) -> Mapping[str, str]:
    """Return an .xml file; see `Writer`. The keyframe "start" is the end of the way.

    Raises:
        KincheckError: a joint has no counterpart in MJCF, or a name cannot be used there.
    """
    require_known(mechanism, "MJCF")
    return {".xml": _Model(mechanism, way, zeros, ranges).text(start)}


class _Model:
    """The document during its construction."""

    def __init__(
        self, mechanism: Mechanism, way: Mapping[str, BodyMotion], zeros: Zeros, ranges: Ranges
    ) -> None:
        self.zeros, self.ranges = zeros, ranges
        self.mechanism, self.way, self.placed = mechanism, way, displacements(mechanism, way)
        self.root = ET.Element("mujoco", model=mechanism.name)
        self.loaded = mechanism.has_loads
        ET.SubElement(self.root, "compiler", angle="radian")
        gravity = numbers(mechanism.gravity) if self.loaded else "0 0 0"
        ET.SubElement(self.root, "option", gravity=gravity)
        self.custom = ET.SubElement(self.root, "custom")
        if not self.loaded:  # for the reader: the masses below are placeholders
            ET.SubElement(self.custom, "text", name=STAND_INS, data="masses")
        self.elements = {GROUND: ET.SubElement(self.root, "worldbody")}
        self.tendons, self.equalities = (
            ET.SubElement(self.root, "tendon"),
            ET.SubElement(self.root, "equality"),
        )
        self.frames = {GROUND: Body(GROUND)}  # design frames of everything with an element
        self.qpos: dict[str, Sequence[float]] = {}
        self.coordinates: dict[tuple[str, str], str] = {}  # names, by joint and freedom
        self.ties: list[Tie] = []
        for body in mechanism.bodies:
            if body.fixed:
                self.add_body(body, GROUND)
        for part in plan(mechanism):
            match part:
                case Chain():
                    self.carry(part)
                case Closure():
                    self.ties += ties(part, mechanism)
                case Relation():
                    self.relate(part)
        for point in mechanism.points:
            self.add_site(point.name, point.body, point.position)
        for tie in self.ties:
            self.close(tie)
        sprung = {force.name for force in text.without_curves(mechanism) if self.add_spring(force)}
        share_masses(self.frames, self.ties, mechanism)
        for frame in self.frames.values():
            self.weigh(frame)
        whole = self.loaded and text.weighs_all(self.frames.values())
        if not whole:
            # an inertia of each coordinate alone: otherwise hinges in line make the mass matrix
            # nearly singular
            default = ET.Element("default")
            armature = numbers(text.STAND_IN[1]) if self.loaded else "1"
            ET.SubElement(default, "joint", armature=armature)
            self.root.insert(2, default)
        masses, left_out = text.facts(mechanism, sprung, self.frames.values(), "MuJoCo")
        masses = f"{masses}{'' if whole else ARMATURE}" if self.loaded else PLAIN
        left_out += text.lost_limits(ranges, self.coordinates)
        add_note(self.root, NOTE.format(masses, loops(self.ties, KINDS), left_out))

    def text(self, start: Mapping[str, float]) -> str:
        """Return the document, with a consistent start."""
        for driver, value in start.items():
            ET.SubElement(self.custom, "numeric", name=driver, data=numbers(value))
        # MuJoCo numbers coordinates in document order; the joint among the defaults has no name
        names = [
            each.get("name", "") for each in self.root.iter() if each.tag in ("joint", "freejoint")
        ]
        qpos = numbers(x for name in names for x in self.qpos.get(name, ()))
        ET.SubElement(ET.SubElement(self.root, "keyframe"), "key", name="start", qpos=qpos)
        return document(
            self.root,
            (
                ["body"],
                ["joint", "freejoint"],
                ["site"],
                ["spatial", "fixed"],
                ["numeric"],
                [*KINDS],
            ),
            reserved=["world"],
        )

    def add_body(self, frame: Body, parent: str) -> None:
        """Add a body on its parent, with its name and frame at design."""
        carrier = self.frames[parent]
        turn = attitude(carrier).conjugate() * attitude(frame)
        at = {"pos": numbers(local(carrier, frame.origin)), "quat": numbers(turn)}
        self.frames[frame.name] = frame
        self.elements[frame.name] = ET.SubElement(
            self.elements[parent], "body", {"name": frame.name, **at}
        )

    def weigh(self, frame: Body) -> None:
        """Set the mass of a body."""
        if frame.name == GROUND:
            return
        at = {"pos": "0 0 0", "mass": "1", "diaginertia": "1 1 1"}
        if self.loaded:
            at = {
                "pos": numbers(local(frame, frame.center)),
                "mass": numbers(text.mass_of(frame)),
                "fullinertia": numbers(text.six(text.own_inertia(frame))),
            }
        self.elements[frame.name].insert(0, ET.Element("inertial", at))

    def add_site(
        self, name: str, body: str, position: Sequence[float], aligned: bool = False
    ) -> str:
        """Add a site to a body, parallel to the body, or to the global axes at design."""
        frame = self.frames[body]
        turned = {"quat": numbers(attitude(frame).conjugate())} if aligned else {}
        ET.SubElement(
            self.elements[body],
            "site",
            {"name": name, "pos": numbers(local(frame, position)), **turned},
        )
        return name

    def carry(self, chain: Chain) -> None:
        """Add a body on its carrier; a free one has its pose as coordinates."""
        joint, links = chain.joint, chain.links[:: chain.sign]
        if chain.cut:
            carrier = self.frames[chain.parent]
            frame = Body(chain.child, carrier.origin, carrier.euler_parameters)
        else:
            frame = self.mechanism.body(chain.child)
        self.add_body(frame, chain.parent)
        element = self.elements[frame.name]
        if joint is None:
            name, motion = f"{frame.name}.free", self.way[frame.name]
            ET.SubElement(element, "freejoint", name=name)
            self.qpos[name] = [*motion.r[-1], *motion.p[-1]]
            return
        # the last link of a joint may be a ball that is left out here
        every = CHAINS[type(joint)](joint, ends_of(self.mechanism, joint)[0])
        values = link_coordinates(joint, every, self.placed)[: len(links)][:: chain.sign]
        for (name, link, _, _), value in zip(chain.each(), values, strict=True):
            along = {} if link.move == "ball" else {"axis": numbers(direction(frame, link.axis))}
            at = {"pos": numbers(local(frame, link.point)), **along}
            if zero := self.zeros.get((joint.name, link.name), 0.0):
                at["ref"] = numbers(zero)
            if limits := self.ranges.get((joint.name, link.name)):
                at["range"] = numbers(limits)
            ET.SubElement(element, "joint", {"name": name, "type": link.move, **at})
            self.qpos[name] = value if link.move == "ball" else (value[0] + zero,)
            if link.move == "ball":  # in the axes of the body that it carries
                turn = chain.sign * rotated(attitude(frame).conjugate(), vec(value[1:]))
                self.qpos[name] = value[0], *turn
            self.coordinates[joint.name, link.name] = name

    def close(self, tie: Tie) -> None:
        """Hold a tie by an equality."""
        if tie.length is not None:
            self.add_tendon(tie.name, tie.links, tie.points)
            # the constant of the polynomial is the change of length since design
            change = numbers([tie.length - math.dist(*tie.points), 0, 0, 0, 0])
            ET.SubElement(self.equalities, "tendon", tendon1=tie.name, polycoef=change)
            return
        one, two = self.add_ends(tie.name, tie.links, tie.points)
        kind = "weld" if tie.whole else "connect"
        ET.SubElement(self.equalities, kind, name=tie.name, site1=one, site2=two)

    def add_spring(self, force: ForceElement) -> bool:
        """Add a spring-damper; return whether MJCF has the force element."""
        if isinstance(force, SpringDamper):
            tendon = self.add_tendon(force.name, force.bodies, force.points)
            tendon.set("springlength", numbers([force.free_length]))
        elif isinstance(force, TorsionSpringDamper):
            name = self.coordinates.get((force.joint, "rotation"), "")
            tendon = next(
                (each for each in self.root.iter("joint") if name and each.get("name") == name),
                None,
            )
            if tendon is None or "stiffness" in tendon.attrib:  # between fixed bodies, or a second
                return False
            zero = self.zeros.get((force.joint, "rotation"), 0.0)
            tendon.set("springref", numbers(force.free_angle + zero))
        else:
            return False
        tendon.set("stiffness", numbers(force.stiffness))
        tendon.set("damping", numbers(force.damping))
        return True

    def add_tendon(
        self, name: str, bodies: Sequence[str], points: Sequence[Sequence[float]]
    ) -> ET.Element:
        """Add a tendon between a point of each of two bodies."""
        tendon = ET.SubElement(self.tendons, "spatial", name=name)
        for site in self.add_ends(name, bodies, points):
            ET.SubElement(tendon, "site", site=site)
        return tendon

    def add_ends(
        self, name: str, bodies: Sequence[str], points: Sequence[Sequence[float]]
    ) -> list[str]:
        """Add a site at both ends of a loop closure or spring; return their names."""
        ends = zip(("first", "second"), bodies, points, strict=True)
        return [
            self.add_site(f"{name}.{which}", body, point, aligned=True)
            for which, body, point in ends
        ]

    def relate(self, relation: Relation) -> None:
        """Keep a coordinate at a polynomial of another, or a sum of more at zero."""
        if len(relation.terms) > 2:
            name = f"{relation.name}.sum"
            tendon = ET.SubElement(self.tendons, "fixed", name=name)
            for joint, freedom, weight in relation.terms:
                own = self.coordinates[joint, freedom]
                ET.SubElement(tendon, "joint", joint=own, coef=numbers(weight))
            ET.SubElement(self.equalities, "tendon", tendon1=name)
            return
        one, other, curve = relation.follower(signed=False)
        if curve.knots:
            raise KincheckError(
                f"joint {relation.name!r} (spline) has no counterpart in MJCF."
                " Write URDF or OpenSim instead."
            )
        names = {"joint1": self.coordinates[one], "joint2": self.coordinates[other]}
        polynomial = numbers([*curve.powers[0], 0, 0, 0, 0][:5])
        ET.SubElement(self.equalities, "joint", names, polycoef=polynomial)
