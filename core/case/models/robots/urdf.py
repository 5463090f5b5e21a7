"""URDF: a tree of links, and its loops: <constraint> elements, joints of SDF in <gazebo>, Drake's
ball constraints, or a file beside it.

Two forms of <constraint> are read, which are no part of URDF yet: the one proposed to urdfdom
(github.com/ros/urdfdom/pull/264), with parent, child, parent_origin, child_origin and parent_axis,
and the one of generalized rigid-body dynamics (github.com/mit-biomimetics/URDF-Parser), with
predecessor, successor and an origin in each.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from ....algebra import IDENTITY, Vec3, X, vec
from ....joints.base import triad
from ...io.document import shown
from ..mjcf.elements import Element
from ..mjcf.frames import HERE, Place
from ..mjcf.tree import WORLD
from .as_mjcf import fitted
from .beside import read_beside
from .drake import BALL, STRUT, add_ties
from .dynamics import add_urdf_damper
from .inertials import urdf_inertial
from .robot import Connection, Coupling, Kind, Loop, Mimic, Move, Robot
from .sdf import joints_of
from .sdf_frames import Frames, Short
from .unread import Unread
from .values import (
    direction,
    named,
    only_child,
    require_children,
    required,
    roll_pitch_yaw,
    value_of,
)

# As for models of MuJoCo: what does not move is counted here too.
MOST_LINKS = 2_000
GAZEBO, DRAKE_JOINT, PITCH = "gazebo", "drake:joint", "drake:screw_thread_pitch"
JOINTS = ("joint", DRAKE_JOINT)
READ = ("link", *JOINTS, "constraint", BALL, STRUT)
IN_ROBOT = (*READ, "material", "transmission", "gazebo")
IN_LINK = ("inertial", "visual", "collision")
IN_GAZEBO = ("joint", "frame")
IN_JOINT = (
    *("origin", "parent", "child", "axis", "mimic", "limit"),
    *("calibration", "dynamics", "safety_controller", PITCH, "joint_properties"),
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
DRAKE_TYPES = ("ball", "planar", "screw", "universal")
# Of the axes of SDF in <gazebo>: those in the joint's own frame.
SDF_VERSION = (1, 7)

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
        if child.tag not in READ and not any(_joints_of_sdf(child)):
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
    add_ties(robot, ((each, partial(_tied, robot)) for each in root.children))
    frames = _gazebo(robot, joints)
    beside.add(robot)
    _require_apart(robot, frames)
    for each in root.only("transmission"):
        for joint in each.only("joint"):
            if joint.attributes.get("name") in joints:
                robot.actuated.append(joint.attributes["name"])
    return robot


def _tied(robot: Robot, element: Element, name: str) -> str:
    return named(element, "name", name, robot.links, "link")


def _gazebo(robot: Robot, joints: Mapping[str, Element]) -> Frames:
    """Add the joints of SDF in <gazebo>, which close loops; return all frames.

    Raises:
        CaseError: see `joints_of`; or they bring links, or move the base.
    """
    frames = Frames()
    for name, element in robot.elements.items():
        frames.put(name, element, robot.links[name], name)
    for name, element in joints.items():
        link = _link(robot, element, "child")
        if name not in frames.found:
            frames.put(name, element, robot.links[link], link)
    for element in robot.root.only("frame"):  # of Drake
        link, name = element.attributes.get("link", ""), element.attributes.get("name", "")
        if link in robot.links and name and name not in frames.found:
            frames.put(name, element, robot.links[link].then(_pose(element)), link)
    for gazebo in robot.root.only(GAZEBO):
        for element in gazebo.only("link", "model"):
            raise element.fault("is of SDF, expected links of URDF; write it as <link>")
        if any(_joints_of_sdf(gazebo)):
            frames.read(gazebo, "")
    still = {*robot.fixed}
    for joint in joints_of(robot, frames, Short(frames), SDF_VERSION):
        robot.loops.append(Loop(joint))
    for full, framed in frames.joints.items():
        base = frames.link(framed.element, framed.attached)
        if base in still and framed.element.attributes.get("type") != "fixed":
            raise framed.element.fault(
                f"{full!r} moves {base!r}, the base, which stands still, expected a joint between"
                " links that move; give the robot a link 'world' and this joint as one of URDF"
            )
    return frames


def _joints_of_sdf(element: Element) -> Iterator[Element]:
    """Yield the joints and frames of SDF in a <gazebo> of the whole robot."""
    if element.tag == GAZEBO and "reference" not in element.attributes:
        yield from element.only(*IN_GAZEBO)


def _require_apart(robot: Robot, frames: Frames) -> None:
    """Refuse elements that are not read and may join links."""
    names = {move.name: move.name for joint in robot.joints for move in joint.moves}
    names |= {joint.name: joint.name for joint in robot.joints}
    followers = [each.joints for each in robot.mimics]
    unread = Unread(frames.named(), names, followers, f"a <joint>, <constraint> or <{BALL}>")
    for element in (robot.root, *robot.root.only("link")):
        link = element.attributes["name"] if element.tag == "link" else ""
        if link:
            unread.require_apart(replace(element, children=[]), link)
        for child in element.children:
            if child.tag not in (*READ, *IN_LINK, GAZEBO):
                unread.require_apart(child, link)
    for gazebo in robot.root.only(GAZEBO):
        read = [*_joints_of_sdf(gazebo)]
        for child in gazebo.children:
            if child not in read:
                unread.require_apart(child, gazebo.attributes.get("reference", ""))


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
        element.require_known(("name", "type"), "URDF", closed=False)
        require_children(element, IN_LINK)
        if (inertial := urdf_inertial(element)) is not None:
            robot.inertials[name] = inertial
        for child in element.children:
            if child.tag != "inertial":
                robot.count(child.tag)
    parents = [each for joint in robot.root.only(*JOINTS) for each in joint.only("parent")]
    if any(each.attributes.get("link") == WORLD for each in parents):
        robot.elements.setdefault(WORLD, robot.root)  # as in Drake, which has it without a link
    if not robot.elements:
        raise robot.root.fault("has no link, expected a mechanism; give a robot that moves")


def _joints(robot: Robot) -> dict[str, Element]:
    """Return the elements of the joints by name, each link with one joint above it at most."""
    found: dict[str, Element] = {}
    above: dict[str, str] = {}
    for element in robot.root.only(*JOINTS):
        name = required(element, "name", ("type",))
        if name in found:
            raise element.repeated_name(name, "the joints")
        require_children(element, IN_JOINT, closed=True)
        child = _link(robot, element, "child")
        _link(robot, element, "parent")
        if child in above:
            raise element.fault(
                f"child: found {shown(child)}, which {above[child]!r} holds already, expected a"
                " tree; write the joint that closes a loop as <constraint>"
            )
        above[child], found[name] = name, element
        add_urdf_damper(robot, element)
        for each in ("limit", "calibration", "safety_controller", "joint_properties"):
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
            child.require_known(("link",), "URDF")
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
    return _pose(element)


def _pose(element: Element) -> Place:
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
    kind = other or element.choice("type", DRAKE_TYPES if element.tag == DRAKE_JOINT else TYPES, "")
    if kind == "screw":
        (lead,) = value_of(element, PITCH, 1)
        weights = {f"{name}.translation": 1.0, f"{name}.rotation": -lead / (2.0 * math.pi)}
        robot.couplings.append(Coupling(f"{name}.thread", weights, element))
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
        case "screw":
            axis = _axis(element, "axis", place)
            return slide(".translation", axis), hinge(".rotation", axis)
        case "universal":  # of Drake: about x of the parent, then y of the child
            return hinge(".1", place.direction(X)), hinge(".2", place.direction(_AXES["y"]))
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
    element.require_known(("name", "type"), "URDF")
    require_children(element, IN_CONSTRAINT, closed=True)
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
