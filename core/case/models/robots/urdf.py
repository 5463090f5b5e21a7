"""URDF: a tree of links, and its loops: <constraint> elements, or a file beside it.

Two forms of <constraint> are read, which are no part of URDF yet: the one proposed to urdfdom
(github.com/ros/urdfdom/pull/264), with parent, child, parent_origin, child_origin and parent_axis,
and the one of generalized rigid-body dynamics (github.com/mit-biomimetics/URDF-Parser), with
predecessor, successor and an origin in each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from ....algebra import IDENTITY, Vec3, X, vec
from ....joints.base import triad
from ...io.document import shown
from ..mjcf.elements import Element
from ..mjcf.frames import HERE, Place
from ..mjcf.tree import WORLD
from .as_mjcf import fitted
from .beside import read_beside
from .dynamics import add_urdf_damper
from .inertials import urdf_inertial
from .robot import Connection, Kind, Loop, Mimic, Move, Robot
from .values import direction, named, only_child, require_children, required, roll_pitch_yaw

# As for models of MuJoCo: what does not move is counted here too.
MOST_LINKS = 2_000
IN_ROBOT = ("link", "joint", "constraint", "material", "transmission", "gazebo")
IN_LINK = ("inertial", "visual", "collision")
IN_JOINT = (
    *("origin", "parent", "child", "axis", "mimic", "limit"),
    *("calibration", "dynamics", "safety_controller"),
)
IN_CONSTRAINT = (
    *("parent", "child", "parent_origin", "child_origin", "parent_axis", "child_axis"),
    *("predecessor", "successor"),
)
TYPES = (
    *("revolute", "continuous", "prismatic", "fixed", "floating", "planar"),
    *("spherical", "ball"),
)
"""Types of joints; balls are no part of URDF, and several simulators read them."""

CLOSING: Mapping[str, Sequence[Kind]] = {
    "fixed": (),
    "link": (),
    "revolute": ("hinge",),
    "continuous": ("hinge",),
    "prismatic": ("slide",),
    "cylindrical": ("slide", "hinge"),
    "universal": ("hinge", "hinge"),
    "spherical": ("ball",),
    "ball": ("ball",),
    "position": ("ball",),
}
"""Freedoms of a <constraint>, by its type; `link` joins the halves of a link."""


def read_urdf(file: Path, root: Element) -> Robot:
    """Return the robot of a document.

    Raises:
        CaseError: no tree of links, or an unknown joint or condition.
    """
    robot = Robot("URDF robot", root)
    for child in root.children:
        if child.tag.startswith("xacro:"):
            raise child.fault(
                "is a macro, expected plain URDF; expand the file: xacro FILE > robot.urdf"
            )
        if child.tag not in ("link", "joint", "constraint"):
            robot.count(child.tag)
    require_children(root, IN_ROBOT)
    _links(robot)
    beside = read_beside(file, root)
    joints = _joints(robot)
    _place(robot, joints)
    for name, element in joints.items():
        robot.joints.append(_connection(robot, name, element, beside.types.get(name)))
    _mimics(robot, joints)
    for k, element in enumerate(root.only("constraint"), 1):
        robot.loops.append(_constraint(robot, element, f"constraint{k}"))
    beside.add(robot)
    for each in root.only("transmission"):
        for joint in each.only("joint"):
            if joint.attributes.get("name") in joints:
                robot.actuated.append(joint.attributes["name"])
    return robot


def _links(robot: Robot) -> None:
    for element in robot.root.only("link"):
        name = required(element, "name")
        if name in robot.elements:
            raise element.repeated_name(name, "the links")
        if len(robot.elements) >= MOST_LINKS:
            raise element.fault(
                f"found more than the {MOST_LINKS} links that are read, expected fewer; take out"
                " those that are not looked at"
            )
        robot.elements[name] = element
        require_children(element, IN_LINK)
        if (inertial := urdf_inertial(element)) is not None:
            robot.inertials[name] = inertial
        for child in element.children:
            if child.tag != "inertial":
                robot.count(child.tag)
    parents = [each for joint in robot.root.only("joint") for each in joint.only("parent")]
    if any(each.attributes.get("link") == WORLD for each in parents):
        robot.elements.setdefault(WORLD, robot.root)  # as in Drake, which has it without a link
    if not robot.elements:
        raise robot.root.fault("has no link, expected a mechanism; give a robot that moves")


def _joints(robot: Robot) -> dict[str, Element]:
    """Return the elements of the joints by name, each link with one joint above it at most."""
    found: dict[str, Element] = {}
    above: dict[str, str] = {}
    for element in robot.root.only("joint"):
        name = required(element, "name")
        if name in found:
            raise element.repeated_name(name, "the joints")
        require_children(element, IN_JOINT)
        child = _link(robot, element, "child")
        _link(robot, element, "parent")
        if child in above:
            raise element.fault(
                f"child: found {shown(child)}, which {above[child]!r} holds already, expected a"
                " tree; write the joint that closes a loop as <constraint>"
            )
        above[child], found[name] = name, element
        add_urdf_damper(robot, element)
        for each in ("limit", "calibration", "safety_controller"):
            if any(element.only(each)):
                robot.count(f"{each} of joints")
    roots = [name for name in robot.elements if name not in above]
    if len(roots) != 1:
        listed = ", ".join(roots[:5]) or "none"
        raise robot.root.fault(
            f"found {len(roots)} links without a joint above them ({listed}), expected one, the"
            " base; join the others to it"
        )
    robot.fixed.add(roots[0])
    robot.links[roots[0]] = HERE
    return found


def _link(robot: Robot, element: Element, tag: str, *more: str) -> str:
    """Return the link named by a child element."""
    for each in (tag, *more):
        if (child := only_child(element, each)) is not None:
            return named(child, "link", required(child, "link"), robot.elements, "link")
    raise element.fault(f"<{tag}>: missing, expected a link; add it")


def _place(robot: Robot, joints: Mapping[str, Element]) -> None:
    """Place all links, from the base outwards."""
    below: dict[str, list[Element]] = {}
    for element in joints.values():
        below.setdefault(_link(robot, element, "parent"), []).append(element)
    waiting = [*robot.links]
    while waiting:
        here = waiting.pop()
        for element in below.get(here, ()):
            child = _link(robot, element, "child")
            robot.links[child] = robot.links[here].then(_origin(only_child(element, "origin")))
            waiting.append(child)
    if ring := [name for name in robot.elements if name not in robot.links]:
        raise robot.elements[ring[0]].fault(
            "hangs on itself by a ring of joints, expected a tree; write the joint that closes the"
            " ring as <constraint>"
        )


def _origin(element: Element | None) -> Place:
    if element is None:
        return HERE
    element.require_known(("xyz", "rpy"), "URDF")
    at = vec(element.numbers("xyz", (3,), (0.0, 0.0, 0.0)))
    return Place(at, roll_pitch_yaw(element.numbers("rpy", (3,), (0.0, 0.0, 0.0))))


def _axis(element: Element, tag: str, place: Place) -> Vec3:
    """Return the axis of a joint, global; x unless given."""
    child = only_child(element, tag)
    if child is None:
        return place.direction(X)
    child.require_known(("xyz",), "URDF")
    return place.direction(direction(child, child.numbers("xyz", (3,))))


def _connection(robot: Robot, name: str, element: Element, other: str | None) -> Connection:
    """Return a joint.

    Args:
        other: type from a file beside.
    """
    links = _link(robot, element, "parent"), _link(robot, element, "child")
    place = robot.links[links[1]]
    kind = other or element.choice("type", TYPES, "")
    if kind == "floating" and links[0] in robot.fixed:
        return Connection(name, links, (), element, free=True)
    return Connection(name, links, _moves(name, element, kind, place), element)


def _moves(name: str, element: Element, kind: str, place: Place) -> tuple[Move, ...]:
    def slide(suffix: str, axis: Vec3) -> Move:
        return Move("slide", f"{name}{suffix}", place.at, axis)

    def hinge(suffix: str, axis: Vec3) -> Move:
        return Move("hinge", f"{name}{suffix}", place.at, axis)

    ball = Move("ball", name, place.at, X)
    match kind:
        case "revolute" | "continuous":
            return (hinge("", _axis(element, "axis", place)),)
        case "prismatic":
            return (slide("", _axis(element, "axis", place)),)
        case "spherical" | "ball":
            return (ball,)
        case "floating":
            return (*(slide(f".{each}", place.direction(a)) for each, a in _AXES.items()), ball)
        case "planar":
            f, g, h = triad((*_axis(element, "axis", place),))
            return slide(".slide1", f), slide(".slide2", g), hinge(".rotation", h)
        case "fixed":
            return ()
        case _:  # of a file beside: a universal joint, by the letters of its axes
            return tuple(hinge(f"_{each}", place.direction(_AXES[each.lower()])) for each in kind)


_AXES = {"x": X, "y": vec((0.0, 1.0, 0.0)), "z": vec((0.0, 0.0, 1.0))}


def _mimics(robot: Robot, joints: Mapping[str, Element]) -> None:
    for name, element in joints.items():
        mimic = only_child(element, "mimic")
        if mimic is None:
            continue
        leader = required(mimic, "joint", ("multiplier", "offset"))
        (factor,) = mimic.numbers("multiplier", (1,), (1.0,))
        (offset,) = mimic.numbers("offset", (1,), (0.0,))
        named(mimic, "joint", leader, joints, "joint")
        robot.mimics.append(Mimic(f"{name}.mimic", (name, leader), (offset, factor), mimic))


def _constraint(robot: Robot, element: Element, default: str) -> Loop:
    """Return the joint of a <constraint>."""
    require_children(element, IN_CONSTRAINT)
    name = element.attributes.get("name", default)
    kind = element.attributes.get("type", "").lower()
    if kind not in CLOSING:
        raise element.unknown_name("type", kind, CLOSING, f"one of {', '.join(CLOSING)}")
    ends: list[str] = []
    places: list[Place] = []
    for tag, other in (("parent", "predecessor"), ("child", "successor")):
        link = _link(robot, element, tag, other)
        origin = only_child(element, f"{tag}_origin")
        within = only_child(element, other)
        if origin is None and within is not None:
            origin = only_child(within, "origin")
        ends.append(link)
        places.append(robot.links[link].then(_origin(origin)))
    here, there = places
    kinds = CLOSING[kind]
    axes = [_axis(element, "parent_axis", here)] if kinds not in ((), ("ball",)) else [X]
    if kind == "universal":
        axes.append(_axis(element, "child_axis", there))
    names = [name] if len(kinds) == 1 else [f"{name}.{each}{k}" for k, each in enumerate(kinds, 1)]
    moves = tuple(
        Move(each, title, here.at, axes[min(k, len(axes) - 1)])
        for k, (each, title) in enumerate(zip(kinds, names, strict=True))
    )
    joint = Connection(name, (ends[0], ends[1]), moves, element)
    if kind in ("spherical", "ball", "position"):
        return Loop(joint, (Place(here.at, IDENTITY), Place(there.at, IDENTITY)))
    return Loop(joint, (fitted(here, there, moves), there))
