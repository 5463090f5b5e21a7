"""A mechanism as MJCF, the XML of MuJoCo. Writing needs no MuJoCo, whose own writer keeps only six
digits.

A body is a <body> with its frame in the case. A joint is a chain of MuJoCo joints (see
`joint_chains`), in the tree or, if it closes a loop, on an auxiliary body tied to the second
body by an equality; a distance is a tendon of constant length. Joint equalities tie
coordinates to one another. Spring-dampers are tendons and attributes of joints; MJCF has
no constant forces. Without masses in the mechanism, bodies have a unit mass and inertia.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping, Sequence

from ...core.algebra import vec
from ...core.case.models.mjcf.masses import STAND_INS
from ...core.errors import KincheckError
from ...core.joints import Coupler, Distance, Joint
from ...core.mechanism.loads import ForceElement, SpringDamper, TorsionSpringDamper
from ...core.mechanism.mechanism import GROUND, Body, Mechanism
from ...core.mechanism.topology import spanning_tree
from ...core.trajectory import BodyMotion
from ..shared.joint_chains import (
    CHAINS,
    Link,
    dependence,
    end_of_loop,
    polynomial_in_tree,
    relations,
)
from ..shared.loop_closures import ends_of
from ..shared.poses import (
    attitude,
    backwards,
    direction,
    displacements,
    link_coordinates,
    local,
    rotated,
)
from . import loads
from .xml_text import document, link_names, numbers

NOTE = (
    " Written by kincheck. Lengths are in m, angles in rad. {} Drivers are not part of the model:"
    " the keyframe is consistent with the driver values under custom.{} "
)
PLAIN = "Masses, inertias and armatures are placeholders."
LOADED = f"{loads.LOADED} Coordinates have an armature of {loads.STAND_IN:g}."


def write(
    mechanism: Mechanism, way: Mapping[str, BodyMotion], start: Mapping[str, float]
) -> Mapping[str, str]:
    """Return an .xml file; see `Writer`. The keyframe "start" is the end of the way.

    Raises:
        KincheckError: a joint has no counterpart in MJCF, or a name cannot be used there.
    """
    for joint in mechanism.joints:
        if type(joint) not in CHAINS and type(joint) is not Distance:
            raise KincheckError(
                f"{joint} has no counterpart in MJCF here; write an equivalent of known joints"
                " instead"
            )
    return {".xml": _Model(mechanism, way).text(start)}


class _Model:
    """The document during its construction."""

    def __init__(self, mechanism: Mechanism, way: Mapping[str, BodyMotion]) -> None:
        self.mechanism, self.way, self.placed = mechanism, way, displacements(mechanism, way)
        self.root = ET.Element("mujoco", model=mechanism.name)
        self.loaded = mechanism.has_loads
        self.note = ET.Comment(NOTE)
        self.root.append(self.note)
        ET.SubElement(self.root, "compiler", angle="radian")
        gravity = numbers(mechanism.gravity) if self.loaded else "0 0 0"
        ET.SubElement(self.root, "option", gravity=gravity)
        # an inertia of each coordinate alone: otherwise hinges in line make the mass matrix nearly
        # singular
        armature = numbers([loads.STAND_IN]) if self.loaded else "1"
        ET.SubElement(ET.SubElement(self.root, "default"), "joint", armature=armature)
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
        self.coordinates: dict[
            tuple[str, str], str
        ] = {}  # names of coordinates, by joint and freedom
        # sign of a joint's coordinates: minus if they move the joint's first body
        self.signs: dict[str, float] = {}
        for body in mechanism.bodies:
            if body.fixed:
                self.add_body(body, GROUND)
        tree = spanning_tree(mechanism)
        for branch in tree.branches:
            body, joint = mechanism.body(branch.child), branch.joint
            if joint is None:
                self.add_free(body)
            else:
                forward = joint.j == body.name
                self.add_body(body, joint.i if forward else joint.j)
                self.carry(body.name, joint, self.links(joint), 1 if forward else -1)
        for joint in tree.cut:
            self.close(joint)
        for coupler in mechanism.couplers:
            if coupler.curve:
                self.bend(coupler)
            else:
                self.relate(
                    (joint, freedom, self.signs[joint] * weight)
                    for joint, freedom, weight in coupler.terms
                )
        for point in mechanism.points:
            self.add_site(point.name, point.body, point.position)
        sprung = {force.name for force in mechanism.forces if self.add_spring(force)}
        self.note.text = NOTE.format(
            LOADED if self.loaded else PLAIN, loads.left_out(mechanism, sprung, True)
        )

    def text(self, start: Mapping[str, float]) -> str:
        """Return the document, with a consistent start."""
        for driver, value in start.items():
            ET.SubElement(self.custom, "numeric", name=driver, data=numbers([value]))
        # MuJoCo numbers coordinates in document order; the joint among the defaults has no name
        names = [
            each.get("name", "") for each in self.root.iter() if each.tag in ("joint", "freejoint")
        ]
        qpos = numbers(x for name in names for x in self.qpos.get(name, ()))
        ET.SubElement(ET.SubElement(self.root, "keyframe"), "key", name="start", qpos=qpos)
        return document(
            self.root,
            (["body"], ["joint", "freejoint"], ["site"], ["spatial"], ["numeric"]),
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
        at = {"pos": "0 0 0", "mass": "1", "diaginertia": "1 1 1"}
        if self.loaded:
            at = {
                "pos": numbers(local(frame, loads.center_of(frame))),
                "mass": numbers([loads.mass_of(frame)]),
                "fullinertia": numbers(loads.six(loads.own_inertia(frame))),
            }
        ET.SubElement(self.elements[frame.name], "inertial", at)

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

    def add_free(self, body: Body) -> None:
        """Add a body without a joint: its coordinates are its pose."""
        name, motion = f"{body.name}.free", self.way[body.name]
        self.add_body(body, GROUND)
        ET.SubElement(self.elements[body.name], "freejoint", name=name)
        self.qpos[name] = [*motion.r[-1], *motion.p[-1]]

    def links(self, joint: Joint) -> list[Link]:
        """Return a joint's chain, from its first body to its second."""
        return CHAINS[type(joint)](joint, ends_of(self.mechanism, joint)[0])

    def carry(self, body: str, joint: Joint, links: Sequence[Link], sign: int = 1) -> None:
        """Let a body move by a joint's links, from the joint's first body on or (sign -1) from its
        second.
        """
        frame, element = self.frames[body], self.elements[body]
        values = link_coordinates(joint, self.links(joint), self.placed)
        for name, link, value in [*zip(link_names(joint.name, links), links, values, strict=False)][
            ::sign
        ]:
            along = {} if link.move == "ball" else {"axis": numbers(direction(frame, link.axis))}
            at = {"pos": numbers(local(frame, link.point)), **along}
            ET.SubElement(element, "joint", {"name": name, "type": link.move, **at})
            self.qpos[name] = value = value if sign > 0 else backwards(link, value)
            if link.move == "ball":  # in the axes of the body that it carries
                self.qpos[name] = value[0], *rotated(attitude(frame).conjugate(), vec(value[1:]))
            self.coordinates[joint.name, link.name] = name
        # all coordinates of the joint have the same sign, so their relations need none
        self.signs[joint.name] = sign
        for relation in relations(joint):
            self.relate(relation)

    def close(self, joint: Joint) -> None:
        """Express a joint of a closed loop by an equality."""
        if isinstance(joint, Distance):
            self.add_tendon(joint.name, joint.bodies, joint.points)
            # the constant of the polynomial is the change of length since design
            change = numbers([joint.rod_length - joint.design_distance, 0, 0, 0, 0])
            ET.SubElement(self.equalities, "tendon", tendon1=joint.name, polycoef=change)
            return
        links, point, turns = end_of_loop(self.links(joint), ends_of(self.mechanism, joint)[0])
        carrier = joint.i
        if links:
            carrier = f"{joint.name}.auxiliary"
            frame = self.frames[joint.i]
            self.add_body(Body(carrier, frame.origin, frame.euler_parameters), joint.i)
            self.carry(carrier, joint, links)
        one, two = self.add_ends(joint.name, (carrier, joint.j), (point, point))
        ET.SubElement(
            self.equalities, "connect" if turns else "weld", name=joint.name, site1=one, site2=two
        )

    def add_spring(self, force: ForceElement) -> bool:
        """Add a spring-damper; return whether MJCF has the force element."""
        if getattr(force, "curve", None):
            return False
        if isinstance(force, SpringDamper):
            tendon = self.add_tendon(force.name, force.bodies, force.points)
            tendon.set("springlength", numbers([force.free_length]))
        elif isinstance(force, TorsionSpringDamper):
            name = self.coordinates.get((force.joint, "rotation"))
            tendon = next(
                (each for each in self.root.iter("joint") if name and each.get("name") == name),
                None,
            )
            if tendon is None or "stiffness" in tendon.attrib:  # between fixed bodies, or a second
                return False
            tendon.set("springref", numbers([self.signs[force.joint] * force.free_angle]))
        else:
            return False
        tendon.set("stiffness", numbers([force.stiffness]))
        tendon.set("damping", numbers([force.damping]))
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

    def relate(self, terms: Iterable[tuple[str, str, float]]) -> None:
        """Keep the weighted sum of two coordinates (joint, freedom, weight) at zero."""
        one, other, factor = dependence(
            (self.coordinates[joint, freedom], weight) for joint, freedom, weight in terms
        )
        self.follow(one, other, [0, factor])

    def bend(self, coupler: Coupler) -> None:
        """Let the first coordinate, of weight one, follow the polynomial of the second."""
        *_, (_, _, weight) = coupler.terms
        one, other = (self.coordinates[joint, freedom] for joint, freedom, _ in coupler.terms)
        signs = (self.signs[joint] for joint in coupler.joints)
        self.follow(one, other, polynomial_in_tree(weight, coupler.curve, *signs))

    def follow(self, one: str, other: str, coefficients: Sequence[float]) -> None:
        """Keep a coordinate at a polynomial of another; the constant is the first coefficient."""
        polynomial = numbers([*coefficients, 0, 0, 0, 0][:5])
        ET.SubElement(self.equalities, "joint", joint1=one, joint2=other, polycoef=polynomial)
