"""A mechanism as URDF, which only has trees, with a JSON file of the conditions of its loops.

Every link is parallel to the global axes at design, so axes and arms are the numbers of the case;
its origin is the point of its joint. A joint is a chain of URDF's revolute and prismatic joints
(see `tree_plan`). URDF has no ball joint, and three hinges would lock at a quarter turn, so a
body that every chain connects by a ball floats, and its joints are conditions (see
`constraints`). In a file with masses every moving link has one, because some simulators take 1 kg
for none; for the same reason points are no links, but stand in the JSON file. Hinges are
"revolute" with very large limits, not "continuous": their coordinate is then the angle including
full turns. Springs between two points and bushings are Drake's elements.
"""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import atan2, hypot
from typing import Any, cast

import numpy as np

from ...core.algebra import vec
from ...core.extensions.exports.model_writer import NO_RANGES, NO_ZEROS, Ranges, Zeros
from ...core.extensions.trees.robot_elements import BUSHING, STRUT
from ...core.joints import Joint
from ...core.mechanism.loads import ForceElement, SpringDamper
from ...core.mechanism.mechanism import GROUND, Body, Mechanism, Vector
from ...core.trajectory import Array, BodyMotion
from ..shared.constraints import (
    CLOSURES,
    BodyFrame,
    Coincident,
    Condition,
    Difference,
    Direction,
    Dot,
    Length,
    closure_conditions,
)
from ..shared.tree_plan import CHAINS, Chain, Closure, Relation, plan_tree, relations
from . import text
from .poses import displacements, link_coordinates
from .text import add_note, document, numbers, require_known

SCHEMA = "kincheck-constraints/1"
NOTE = (
    " Written by kincheck. Lengths are in m, angles in rad. {} The tree alone is not"
    " the mechanism: the constraints in the file beside it close its loops{}.{} "
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
    "points": "the point in the axes of its link",
    "start": (
        "coordinates of joints: m or rad; floating: displacement x, y, z [m] and quaternion x, y,"
        " z, w"
    ),
}
ENTRIES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
KINDS = {"hinge": "revolute", "slide": "prismatic"}
FAR = {"lower": "-1e9", "upper": "1e9", "effort": "1e9", "velocity": "1e9"}


def write(
    mechanism: Mechanism,
    way: Mapping[str, BodyMotion],
    start: Mapping[str, float],
    zeros: Zeros = NO_ZEROS,
    ranges: Ranges = NO_RANGES,
) -> Mapping[str, str]:
    """Return a .urdf file and a .constraints.json file, with a consistent start at the end of the
    way; see `Writer`.

    Points of links are in the link's axes, as in URDF. Coordinates of the start are listed by joint
    name, and are neutral at design.

    Raises:
        KincheckError: a joint has no counterpart here, or a name cannot be used.
    """
    require_known(mechanism, "URDF")
    model = _Model(mechanism, way, zeros, ranges)
    beside = {
        "schema": SCHEMA,
        "mechanism": mechanism.name,
        "units": {"length": "m", "angle": "rad"},
        "meaning": MEANING,
        "constraints": model.constraints,
        "bodies": {body.name: model.pose(body) for body in mechanism.bodies},
        "points": {
            point.name: {"link": point.body, "point": model.arm(point.body, point.position)}
            for point in mechanism.points
        },
        "start": {"drivers": dict(start), "coordinates": model.q},
    }
    found = document(model.root, (["link", "frame"], ["joint"], [STRUT]))
    return {".urdf": found, ".constraints.json": _json(beside)}


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


def _as_data(condition: Condition) -> Iterator[dict[str, Any]]:
    """Yield a condition as data, by the links of its frames and points in their axes."""

    def end(frame: Any) -> dict[str, Any]:
        return {"link": frame.link, "point": frame.point}

    def axis_data(direction: Direction) -> dict[str, Any]:
        return {"link": cast(Any, direction.frame).link, "direction": direction.a0.tolist()}

    match condition:
        case Coincident(Difference(i, j)):
            yield {"kind": "coincident", "i": end(i), "j": end(j)}
        case Length(Difference(i, j), length):
            yield {"kind": "distance", "i": end(i), "j": end(j), "value": length}
        case Dot(Direction() as x, Direction() as y, value):
            yield {"kind": "directions", "x": axis_data(x), "y": axis_data(y), "value": value}
        case Dot(Direction() as x, Difference(i, j), value):
            yield {"kind": "offset", "x": axis_data(x), "i": end(i), "j": end(j), "value": value}
        case _:
            raise NotImplementedError(f"{type(condition).__name__}: give its kind here")


class _Model:
    """The document and the constraints file during their construction."""

    def __init__(
        self, mechanism: Mechanism, way: Mapping[str, BodyMotion], zeros: Zeros, ranges: Ranges
    ) -> None:
        self.zeros, self.ranges = zeros, ranges
        self.mechanism, self.way, self.placed = mechanism, way, displacements(mechanism, way)
        self.root = ET.Element("robot", name=mechanism.name)
        self.origin: dict[str, Vector] = {}  # origins of links, global at design
        self.q: dict[str, list[float]] = {}
        self.coordinates: dict[tuple[str, str], str] = {}  # names, by joint and freedom
        self.constraints: list[dict[str, Any]] = []
        self.add_link(GROUND, (0.0, 0.0, 0.0))
        for body in mechanism.bodies:
            if body.fixed:
                self.attach(body.name, GROUND, body.origin, f"{body.name}.fixed")
        counted = {name for coupler in mechanism.couplers for name in coupler.joints}
        counted |= {joint.name for joint in mechanism.joints if relations(joint)}
        for part in plan_tree(
            mechanism, whole=CLOSURES, counted=counted, loose=_turns, auxiliary="{joint}.copy"
        ):
            match part:
                case Chain():
                    self.carry(part)
                case Closure():
                    self.close(part)
                case Relation():
                    self.relate(part)
        masses, left_out = "Nothing has a mass.", ""
        sprung = {each.name for each in text.without_curves(mechanism) if self.add_spring(each)}
        if mechanism.has_loads:
            known = {body.name: body for body in mechanism.bodies if body.mass or not body.fixed}
            frames = [
                known.get(name) or text.link_between(name, at, mechanism)
                for name, at in self.origin.items()
                if name != GROUND
            ]
            for frame in frames:
                self.weigh(frame)
            masses, left_out = text.facts(mechanism, sprung, frames, "Drake", gravity=False)
        left_out += text.lost_limits(ranges, self.coordinates)
        closed = dict.fromkeys(each["joint"] for each in self.constraints)
        closed = f": {', '.join(closed)}" if closed else ""
        add_note(self.root, NOTE.format(masses, closed, text.zeros_of(zeros) + left_out))

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
        """Set the mass of a link."""
        link = next(each for each in self.root.iter("link") if each.get("name") == body.name)
        inertial = ET.Element("inertial")
        link.insert(0, inertial)
        center = numbers(self.arm(body.name, body.center))
        ET.SubElement(inertial, "origin", xyz=center, rpy="0 0 0")
        ET.SubElement(inertial, "mass", value=numbers(text.mass_of(body)))
        values = [numbers(x) for x in text.six(text.inertia_of(body))]
        ET.SubElement(inertial, "inertia", dict(zip(ENTRIES, values, strict=True)))

    def add_spring(self, force: ForceElement) -> bool:
        """Add a spring between points, or a bushing; return whether Drake has it."""
        if isinstance(force, SpringDamper):
            if not force.free_length:  # Drake refuses springs of no length
                return False
            element = ET.SubElement(self.root, STRUT, name=force.name)
            for tag, content in text.strut(force, self.arm).items():
                ET.SubElement(element, tag, {"name" if "_body_" in tag else "value": content})
        elif text.plain_bushing(force):
            turn = numbers(_roll_pitch_yaw(np.array(force.triad).T))
            element = ET.Element(BUSHING, name=force.name)
            for side, link in zip("AC", force.bodies, strict=True):
                name, place = f"{force.name}.{side}", numbers(self.arm(link, force.point))
                ET.SubElement(self.root, "frame", name=name, link=link, xyz=place, rpy=turn)
                ET.SubElement(element, f"drake:bushing_frame{side}", name=name)
            for key, values in text.bushing_law(force).items():
                ET.SubElement(element, f"drake:bushing_{key}", value=numbers(values))
            self.root.append(element)
        else:
            return False
        self.root.set("xmlns:drake", text.DRAKE)
        return True

    def arm(self, link: str, P: Sequence[float]) -> list[float]:
        """Return a point of a link from its design position."""
        return [*(vec(P) - vec(self.origin[link]))]

    def carry(self, chain: Chain) -> None:
        """Add a chain to a new link; a free body has a floating joint."""
        joint, child = chain.joint, chain.child
        if joint is None:
            name = f"{child}.free"
            self.attach(child, GROUND, chain.point, name, "floating")
            e0, *e = (float(each[-1]) for each in self.placed[child].turn)
            self.q[name] = [*(self.way[child].r[-1] - chain.point).tolist(), *e, e0]
            return
        if not chain.links:
            self.attach(child, chain.parent, chain.point, joint.name)
        values = link_coordinates(joint, chain.links[:: chain.sign], self.placed)[:: chain.sign]
        for (name, link, parent, following), value in zip(chain.each(), values, strict=True):
            element = self.attach(following, parent, link.point, name, KINDS[link.move])
            ET.SubElement(element, "axis", xyz=numbers(link.axis))
            key = joint.name, link.name
            limits = [numbers(x - self.zeros.get(key, 0.0)) for x in self.ranges.get(key, ())]
            limit = FAR | dict(zip(("lower", "upper"), limits, strict=False))
            ET.SubElement(element, "limit", limit)
            self.q[name] = [*value]
            self.coordinates[joint.name, link.name] = name

    def close(self, closure: Closure) -> None:
        """Add the conditions of a cut joint."""
        joint = closure.joint
        frames = [
            cast(BodyFrame, _End(link, self.arm(link, P)))
            for link, P in zip(closure.ends, closure.points, strict=True)
        ]
        for condition in closure_conditions(closure.by, joint, *frames):
            self.constraints += (
                {"joint": joint.name, **written} for written in _as_data(condition)
            )

    def relate(self, relation: Relation) -> None:
        """Keep the weighted sum of coordinates at zero, or one at a function of another."""
        if relation.curve:
            one, other, curve = relation.follower(signed=False)
            table: dict[str, Any] = {
                "kind": "spline" if curve.knots else "polynomial",
                "driven": self.coordinates[one],
                "driving": self.coordinates[other],
            }
            table |= {"points": curve.knots} if curve.knots else {"coefficients": curve.powers[0]}
        else:
            weights = {self.coordinates[name, one]: w for name, one, w in relation.terms}
            table = {"kind": "linear", "weights": weights}
        self.constraints.append({"joint": relation.name, **table})

    def pose(self, body: Body) -> dict[str, Any]:
        """Return a body's frame in its link."""
        return {
            "link": body.name,
            "origin": self.arm(body.name, body.origin),
            "euler_parameters": [*body.euler_parameters],
        }


def _roll_pitch_yaw(R: Array) -> list[float]:
    """Return the angles of turns about the fixed axes x, y, z that make a rotation matrix."""
    level = hypot(R[0, 0], R[1, 0])
    pitch = atan2(-R[2, 0], level)
    if level < np.finfo(float).eps:  # upright: roll and yaw are about one axis
        return [atan2(-R[1, 2], R[1, 1]), pitch, 0.0]
    return [atan2(R[2, 1], R[2, 2]), pitch, atan2(R[1, 0], R[0, 0])]


def _turns(joint: Joint) -> bool:
    """Return whether a joint has a ball, which URDF has not."""
    point = (0.0, 0.0, 0.0)
    return any(link.move == "ball" for link in CHAINS[type(joint)](joint, point))
