"""A mechanism as URDF, which only has trees, with a JSON file of the conditions of its loops.

Every link is parallel to the global axes at design, so axes and arms are the numbers of the case;
its origin is the point of its joint. A joint is a chain of URDF's revolute and prismatic joints
(see `joint_chains`). URDF has no ball joint, and three hinges would lock at a quarter turn, so a
body that every chain connects by a ball floats, and its joints are conditions (see
`loop_closures`). Hinges are "revolute" with very large limits, not "continuous": their coordinate
is then the angle including full turns.
"""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

from ...core.algebra import vec
from ...core.errors import KincheckError
from ...core.joints import Fixed, Joint
from ...core.mechanism.mechanism import GROUND, Body, Mechanism, Vector, spanning_tree
from ...core.trajectory import BodyMotion
from ..shared.frame_constraints import Frame
from ..shared.joint_chains import CHAINS, Link, polynomial_in_tree, relations
from ..shared.loop_closures import CLOSURES, ends_of
from ..shared.poses import backwards, displacements, link_coordinates
from . import loads
from .conditions import as_data
from .xml_text import document, link_names, numbers

SCHEMA = "kincheck-constraints/1"
NOTE = (
    " Written by kincheck. Lengths are in m, angles in rad; {}. The tree alone is not"
    " the mechanism: the constraints in the file beside it close its loops.{} "
)
MEANING = {
    "coincident": "the points i and j are one (3 equations)",
    "distance": "the points i and j are `value` apart [m]",
    "directions": "x . y = value [-], unit vectors",
    "offset": "x . (point j - point i) = value [m], x a unit vector",
    "linear": "the sum of weight * coordinate of the joint is zero [m or rad]",
    "polynomial": (
        "the coordinate of the driven joint is the polynomial of the driving one's, constant first"
    ),
    "bodies": "the frame of the body in its link at design",
    "start": (
        "coordinates of joints: m or rad; floating: displacement x, y, z [m] and quaternion x, y,"
        " z, w"
    ),
}
ENTRIES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
KINDS = {"hinge": "revolute", "slide": "prismatic"}
FAR = {"lower": "-1e9", "upper": "1e9", "effort": "1e9", "velocity": "1e9"}


def write(
    mechanism: Mechanism, way: Mapping[str, BodyMotion], start: Mapping[str, float]
) -> Mapping[str, str]:
    """Return a .urdf file and a .constraints.json file, with a consistent start at the end of the
    way; see `Writer`.

    Points of links are in the link's axes, as in URDF. Coordinates of the start are listed by joint
    name, and are neutral at design.

    Raises:
        KincheckError: a joint has no counterpart here, or a name cannot be used.
    """
    for joint in mechanism.joints:
        if type(joint) not in CLOSURES:
            raise KincheckError(
                f"{joint} has no counterpart in URDF here; write an equivalent of known joints"
                " instead"
            )
    model = _Model(mechanism, way)
    beside = {
        "schema": SCHEMA,
        "mechanism": mechanism.name,
        "units": {"length": "m", "angle": "rad"},
        "meaning": MEANING,
        "constraints": model.constraints,
        "bodies": {body.name: model.pose(body) for body in mechanism.bodies},
        "start": {"drivers": dict(start), "coordinates": model.q},
    }
    text = document(model.root, (["link"], ["joint"]))
    return {".urdf": text, ".constraints.json": _json(beside)}


def _json(table: Mapping[str, Any]) -> str:
    """Return JSON text with one entry per line."""

    def lines(value: Any) -> str:
        if isinstance(value, dict):
            entries = (
                f"{json.dumps(key)}: {json.dumps(each, allow_nan=False)}"
                for key, each in cast(dict[str, Any], value).items()
            )
            return "{\n    " + ",\n    ".join(entries) + "\n  }"
        if isinstance(value, list):
            return (
                "[\n    "
                + ",\n    ".join(
                    json.dumps(each, allow_nan=False) for each in cast(list[Any], value)
                )
                + "\n  ]"
            )
        return json.dumps(value)

    return (
        "{\n  "
        + ",\n  ".join(f"{json.dumps(key)}: {lines(value)}" for key, value in table.items())
        + "\n}\n"
    )


@dataclass(frozen=True)
class _End:
    """A point of a link, in the link's axes [m]; it replaces the frame of a condition."""

    link: str
    point: list[float]


class _Model:
    """The document and the constraints file during their construction."""

    def __init__(self, mechanism: Mechanism, way: Mapping[str, BodyMotion]) -> None:
        self.mechanism, self.way, self.placed = mechanism, way, displacements(mechanism, way)
        self.root = ET.Element("robot", name=mechanism.name)
        note = ("nothing has a mass", "")
        if mechanism.has_loads:
            note = ("masses are in kg", loads.left_out(mechanism, (), False))
        self.root.append(ET.Comment(NOTE.format(*note)))
        self.origin: dict[str, Vector] = {}  # origins of links, global at design
        self.q: dict[str, list[float]] = {}
        # name and sign of coordinates, by joint and freedom
        self.coordinates: dict[tuple[str, str], tuple[str, float]] = {}
        self.constraints: list[dict[str, Any]] = []
        self.add_link(GROUND, (0.0, 0.0, 0.0))
        for body in mechanism.bodies:
            if body.fixed:
                self.attach(body.name, GROUND, body.origin, f"{body.name}.fixed")
        tree = spanning_tree(mechanism)
        cut = set(tree.cut)
        for branch in tree.branches:
            joint, body = branch.joint, mechanism.body(branch.child)
            if joint is not None and (links := self.links(joint)) is not None:
                self.carry(body.name, joint, links, 1 if joint.j == body.name else -1)
                continue
            self.add_free(body)
            cut |= {joint} - {None}
        coupled = {name for coupler in mechanism.couplers for name in coupler.joints}
        for joint in (each for each in mechanism.joints if each in cut):
            self.close(joint, on_copy=joint.name in coupled or bool(relations(joint)))
        for coupler in mechanism.couplers:
            self.relate(coupler.name, coupler.terms, coupler.curve)
        for point in mechanism.points:
            self.attach(
                f"point.{point.name}", point.body, point.position, f"point.{point.name}.fixed"
            )
        for body in mechanism.bodies:
            if body.mass:
                self.weigh(body)

    def links(self, joint: Joint) -> list[Link] | None:
        """Return a joint's chain, from its first body to its second; None if there is none or it
        has a ball.
        """
        chain = CHAINS.get(type(joint))
        links = chain and chain(joint, ends_of(self.mechanism, joint)[0])
        return None if links is None or any(link.move == "ball" for link in links) else links

    def add_link(self, name: str, origin: Vector) -> ET.Element:
        """Add a link with its origin at a position, global at design."""
        self.origin[name] = origin
        return ET.SubElement(self.root, "link", name=name)

    def attach(
        self, link: str, parent: str, origin: Vector, joint: str, kind: str = "fixed"
    ) -> ET.Element:
        """Add a link on another link, with one of URDF's joints."""
        self.add_link(link, origin)
        element = ET.SubElement(self.root, "joint", name=joint, type=kind)
        ET.SubElement(element, "parent", link=parent)
        ET.SubElement(element, "child", link=link)
        ET.SubElement(element, "origin", xyz=numbers(self.arm(parent, origin)), rpy="0 0 0")
        return element

    def weigh(self, body: Body) -> None:
        """Set the mass of a body's link; a point mass has no inertia."""
        link = next(each for each in self.root.iter("link") if each.get("name") == body.name)
        inertial = ET.Element("inertial")
        link.insert(0, inertial)
        center = numbers(self.arm(body.name, loads.center_of(body)))
        ET.SubElement(inertial, "origin", xyz=center, rpy="0 0 0")
        ET.SubElement(inertial, "mass", value=numbers([body.mass]))
        values = [numbers([x]) for x in loads.six(loads.inertia_of(body, 0.0))]
        ET.SubElement(inertial, "inertia", dict(zip(ENTRIES, values, strict=True)))

    def arm(self, link: str, P: Sequence[float]) -> list[float]:
        """Return a point of a link from its design position."""
        return [*(vec(P) - vec(self.origin[link]))]

    def add_free(self, body: Body) -> None:
        """Add a body without a chain."""
        name = f"{body.name}.free"
        self.attach(body.name, GROUND, body.origin, name, "floating")
        e0, *e = (float(each[-1]) for each in self.placed[body.name].turn)
        self.q[name] = [*(self.way[body.name].r[-1] - body.origin).tolist(), *e, e0]

    def carry(self, end: str, joint: Joint, links: Sequence[Link], sign: int = 1) -> None:
        """Add a chain to a new link, from the joint's first body or (sign -1) from its second."""
        at = joint.bodies[sign < 0]
        values = link_coordinates(joint, links, self.placed)
        chain = [*zip(link_names(joint.name, links), links, values, strict=True)][::sign]
        for k, (name, link, value) in enumerate(chain, 1):
            following = end if k == len(chain) else f"{name}.link"
            element = self.attach(following, at, link.point, name, KINDS[link.move])
            ET.SubElement(element, "axis", xyz=numbers(link.axis))
            ET.SubElement(element, "limit", FAR)
            self.q[name] = [*(value if sign > 0 else backwards(link, value))]
            self.coordinates[joint.name, link.name] = name, float(sign)
            at = following
        if not chain:
            self.attach(end, at, ends_of(self.mechanism, joint)[0], joint.name)
        for relation in relations(joint):
            self.relate(joint.name, relation)

    def close(self, joint: Joint, on_copy: bool) -> None:
        """Add the conditions of a joint outside the tree; if its coordinates must count turns, they
        move a copy of the body.
        """
        (i, j), ends, closing = joint.bodies, ends_of(self.mechanism, joint), CLOSURES[type(joint)]
        if on_copy:
            links = self.links(joint)
            assert links is not None  # joints with relations or couplers have no ball
            i, closing = f"{joint.name}.copy", CLOSURES[Fixed]
            self.carry(i, joint, links)
        frames = [
            cast(Frame, _End(link, self.arm(link, P))) for link, P in zip((i, j), ends, strict=True)
        ]
        for condition in closing.conditions(joint, *frames):
            self.constraints += ({"joint": joint.name, **written} for written in as_data(condition))

    def relate(
        self, name: str, terms: Sequence[tuple[str, str, float]], curve: Sequence[float] = ()
    ) -> None:
        """Keep the weighted sum of coordinates (joint, freedom, weight) at zero.

        Args:
            curve: coefficients of a polynomial in the last coordinate that is added.
        """
        found = [(*self.coordinates[joint, freedom], weight) for joint, freedom, weight in terms]
        if curve:
            (driven, first, _), (driving, second, weight) = found
            coefficients = polynomial_in_tree(weight, curve, first, second)
            self.constraints.append(
                {
                    "joint": name,
                    "kind": "polynomial",
                    "driven": driven,
                    "driving": driving,
                    "coefficients": coefficients,
                }
            )
            return
        self.constraints.append(
            {
                "joint": name,
                "kind": "linear",
                "weights": {one: sign * weight for one, sign, weight in found},
            }
        )

    def pose(self, body: Body) -> dict[str, Any]:
        """Return a body's frame in its link."""
        return {
            "link": body.name,
            "origin": self.arm(body.name, body.origin),
            "euler_parameters": [*body.euler_parameters],
        }
