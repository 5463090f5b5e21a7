"""URDF: a tree of links, and its loops: <constraint> elements, joints of SDF in <gazebo>, Drake's
ball constraints, or a file beside it.

Two forms of <constraint> are read, which are no part of URDF yet: the one proposed to urdfdom
(github.com/ros/urdfdom/pull/264), with parent, child, parent_origin, child_origin and parent_axis,
and the one of generalized rigid-body dynamics (github.com/mit-biomimetics/URDF-Parser), with
predecessor, successor and an origin in each. <loop_joint> is that of Isaac Sim and of the old
Drake, with link1, link2, their places, and axis.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from ...algebra import Quat, Vec3, X, Y, vec
from ...case.io.document import shown
from ...errors import CaseError
from ...joints.base import triad
from ..xml.element import ZEROS, Apart, Element, words
from .graph import Freedom, Graph, Joint
from .loop_files import read_loop_files
from .masses import mass_in
from .place import AXES, ORIGIN, Place, euler_turn, unit_quaternion
from .robot_elements import (
    BALL,
    BUSHING,
    DRAKE_JOINT,
    ENTRIES,
    FRICTION,
    JOINT_MOVES,
    LAW,
    STRUT,
    Unread,
    add_spring,
    add_ties,
    mimic,
    planar,
    screw,
)
from .sdf import Frames, joints_of
from .tree import NO_LIMIT, WORLD, Limit, Mass, Move, Tree, limit_of

GAZEBO, PITCH = "gazebo", "drake:screw_thread_pitch"
JOINTS, CONSTRAINTS = ("joint", DRAKE_JOINT), ("constraint", "loop_joint")
READ = ("link", "frame", *JOINTS, *CONSTRAINTS, BALL, STRUT, BUSHING)
IN_ROBOT = (
    *(*READ, GAZEBO),
    *words(
        "material transmission ros2_control fixed_frame sensor mujoco author version"
        " disable_collisions enable_collisions disable_default_collisions group group_state"
        " end_effector virtual_joint passive_joint capability speed_limit"
    ),
)
"""Elements of a robot, of its planners and simulators; others without a prefix are unknown."""
IN_LINK = ("inertial", "visual", "collision")
LOOKS = words(
    "material sensor contact audio_source self_collision_checking collision_checking self_filter"
)
"""Elements of links without a meaning for motion."""
IN_LIMIT = words(
    "lower upper effort velocity acceleration deceleration jerk drake:acceleration command_effort"
)
IN_GAZEBO = ("joint", "frame")
IN_JOINT = (
    *words("origin parent child axis mimic limit"),
    *("calibration", "dynamics", "safety_controller", PITCH, "joint_properties"),
)
IN_CONSTRAINT = words(
    "parent child parent_origin child_origin parent_axis child_axis predecessor successor"
)
IN_LOOP = ("link1", "link2")
POSE = ("xyz", "rpy")
TYPES = words("revolute continuous prismatic fixed floating planar spherical ball")
"""Types of joints; balls are no part of URDF, and several simulators read them."""
DRAKE_TYPES = ("ball", "planar", "screw", "universal")
# Of the axes of SDF in <gazebo>: those in the joint's own frame.
SDF_VERSION = (1, 7)

APART = Apart(
    "URDF",
    {
        "robot": ("version",),
        "joint": ("dont_collapse",),
        "link": ("type",),
        "limit": IN_LIMIT,
        "dynamics": FRICTION,
        "mass": ("value",),
        "inertia": ENTRIES,
        "origin": POSE,
    },
)
"""Names of URDF without meaning for kinematics."""


def read_urdf(root: Element) -> Tree:
    """Return the tree of a robot, in its zero pose.

    Raises:
        CaseError: no tree of links, or an unknown joint or condition.
    """
    robot = _Robot(root)
    robot.read()
    tree = robot.graph.hang()
    robot.beside.place(tree)
    return tree.settled(root, APART)


class _Robot:
    """A robot during its reading."""

    def __init__(self, root: Element) -> None:
        self.root, self.beside = root, read_loop_files(root)
        name, beside = root.attributes.get("name", root.file.stem), self.beside.names
        others = f" with {', '.join(beside)}" if beside else ""
        described = f"URDF robot {name!r} of {root.file.name}{others}"
        self.graph = Graph.of(root, described, closes=not self.beside.pairs)
        self.joints: dict[str, Element] = {}

    def read(self) -> None:
        """Read everything."""
        root, graph = self.root, self.graph
        for child in root.children:
            if child.tag.startswith("xacro:"):
                raise child.fault(
                    "is a macro, expected plain URDF; expand the file: xacro FILE > robot.urdf"
                )
            if child.tag not in READ and not any(_joints_of_sdf(child)):
                graph.tree.leave(child, child.tag)
        root.require_known(("name", "version"), "URDF", closed=False)
        root.require_children(IN_ROBOT)
        self._links()
        self._hang()
        for name, element in self.joints.items():
            graph.joints.append(self._joint(name, element))
        for name, element in self.joints.items():
            if (each := element.child("mimic")) is not None:
                each.require_known(("joint", "multiplier", "offset"), "URDF")
                leader = each.require("joint")
                if leader not in self.joints:
                    raise each.unknown_name("joint", leader, self.joints, "a joint")
                offset, factor = each.number("offset", 0.0), each.number("multiplier", 1.0)
                graph.couplings.append(mimic(name, leader, (offset, factor), each))
        for k, element in enumerate(root.findall(*CONSTRAINTS), 1):
            graph.loops.append(self._constraint(element, f"{element.tag}{k}"))
        frames = self._gazebo()

        def framed(element: Element, name: str) -> tuple[str, Place]:
            return frames.link(element, name), frames.place(element, name)

        add_ties(graph, ((each, self._require_link, framed) for each in root.children))
        self.beside.add(graph)
        graph.close_named_pairs()
        self._require_apart(frames)
        for motor in root.findall("transmission", "ros2_control"):
            names = {
                joint.attributes.get("name", "")
                for joint in motor.findall("joint")
                if motor.tag == "transmission" or any(joint.findall("command_interface"))
            }
            graph.tree.add_motor(motor.tag, names & self.joints.keys())
        limited = [any(self.joints[name].findall("limit")) for name in graph.tree.actuated]
        graph.tree.motors["limit of joints"] = sum(limited)

    def _links(self) -> None:
        root, graph = self.root, self.graph
        for element in root.findall("link"):
            name = element.require("name")
            if name in graph.elements:
                raise element.repeated_name(name, "the links")
            graph.elements[name] = element
            element.require_known(("name", "type"), "URDF", closed=False)
            element.require_children((*IN_LINK, *LOOKS))
            if (inertial := element.child("inertial")) is not None:
                graph.masses[name] = _mass(inertial)
            for child in element.children:
                if child.tag != "inertial":
                    graph.tree.leave(child, child.tag)
        parents = [each for joint in root.findall(*JOINTS) for each in joint.findall("parent")]
        if any(each.attributes.get("link") == WORLD for each in parents):
            graph.elements.setdefault(WORLD, root)  # as in Drake, which has it without a link
        if not graph.elements:
            raise root.fault("has no link, expected a mechanism; give a robot that moves")

    def _hang(self) -> None:
        """Read the joints, and place all links from the base outwards."""
        graph = self.graph
        above: dict[str, str] = {}
        below: dict[str, list[tuple[str, Element]]] = {}
        for element in self.root.findall(*JOINTS):
            element.require_known(("name", "type", "dont_collapse"), "URDF")
            name = element.require("name")
            if name in self.joints:
                raise element.repeated_name(name, "the joints")
            element.require_children(IN_JOINT, closed=True)
            child = self._link(element, "child")
            below.setdefault(self._link(element, "parent"), []).append((child, element))
            if child in above:
                raise element.fault(
                    f"child: found {shown(child)}, which {above[child]!r} holds already, expected a"
                    " tree; write the joint that closes a loop as <constraint>"
                )
            above[child], self.joints[name] = name, element
            self._damper(name, element)
            for limit in element.findall("limit"):
                limit.require_known(IN_LIMIT, "URDF")
                graph.tree.count("limit of joints")
            for each in element.findall("calibration", "safety_controller", "joint_properties"):
                graph.tree.leave(each, f"{each.tag} of joints")
        roots = [name for name in graph.elements if name not in above]
        if len(roots) != 1:
            listed = ", ".join(roots[:5]) or "none"
            raise self.root.fault(
                f"found {len(roots)} links without a joint above them ({listed}), expected one, the"
                " base; join the others to it"
            )
        graph.fixed.add(roots[0])
        graph.places[roots[0]] = ORIGIN
        waiting = roots
        while waiting:
            link = waiting.pop()
            for child, element in below.get(link, ()):
                graph.places[child] = graph.places[link] * _origin(element.child("origin"))
                waiting.append(child)
        if ring := [name for name in graph.elements if name not in graph.places]:
            raise graph.elements[ring[0]].fault(
                "hangs on itself by a ring of joints, expected a tree; write the joint that closes"
                " the ring as <constraint>"
            )

    def _damper(self, name: str, element: Element) -> None:
        for dynamics in element.findall("dynamics"):
            dynamics.require_known((*LAW, *FRICTION), "URDF")
            if element.attributes.get("type") in ("revolute", "continuous", "prismatic"):
                add_spring(self.graph, name, dynamics.attributes)
            else:
                self.graph.tree.leave(dynamics, "dynamics of joints")

    def _require_link(self, element: Element, name: str, key: str = "name") -> str:
        """Return a name of a link."""
        if name not in self.graph.elements:
            raise element.unknown_name(key, name, self.graph.elements, "a link")
        return name

    def _link(self, element: Element, tag: str, *more: str) -> str:
        """Return the link named by a child element."""
        for each in (tag, *more):
            if (child := element.child(each)) is not None:
                child.require_known(("link", *POSE) if each in IN_LOOP else ("link",), "URDF")
                return self._require_link(child, child.require("link"), "link")
        raise element.fault(f"<{tag}>: missing, expected a link; add it")

    def _joint(self, name: str, element: Element) -> Joint:
        graph = self.graph
        links = self._link(element, "parent"), self._link(element, "child")
        place = graph.places[links[1]]
        types = DRAKE_TYPES if element.tag == DRAKE_JOINT else TYPES
        said = element.choice("type", types, "") if name not in self.beside.types else ""
        kind = self.beside.types.get(name, said)
        element.take("type")
        for each in element.findall("axis"):
            each.asked.add("xyz")  # of a joint without an axis too

        def axis() -> Vec3:
            return _axis(element, "axis", place)

        freedoms: list[Freedom]
        match kind:
            case "revolute" | "continuous" | "prismatic" | "spherical" | "ball" | "fixed":
                freedoms = [
                    ("", each, X if each == "ball" else axis()) for each in JOINT_MOVES[kind]
                ]
            case "floating" if links[0] in graph.fixed:
                return Joint(name, links, (), element, is_free=True)
            case "floating":
                freedoms = [(f".{each}", "slide", place.direction(a)) for each, a in AXES.items()]
                freedoms.append(("", "ball", X))
            case "planar":
                freedoms = planar(*triad((*axis(),)))
            case "screw":
                if element.child(PITCH) is None:
                    raise element.fault(f"<{PITCH}>: missing, expected metres in a turn; add it")
                freedoms = screw(graph, name, element.child_number(PITCH, 0.0), axis(), element)
            case "universal":  # of Drake: about x of the parent, then y of the child
                axes = enumerate((X, Y), 1)
                freedoms = [(f".{k}", "hinge", place.direction(a)) for k, a in axes]
            case _:  # of a file beside: a universal joint, by the letters of its axes
                letters = {each: AXES[each.lower()] for each in kind}
                freedoms = [(f"_{k}", "hinge", place.direction(a)) for k, a in letters.items()]
        return Joint.of(name, links, place.at, freedoms, element, _limit(element))

    def _constraint(self, element: Element, default: str) -> Joint:
        """Return the joint of a <constraint> or <loop_joint>."""
        element.require_known(("name", "type"), "URDF")
        loop = element.tag == "loop_joint"
        element.require_children((*IN_LOOP, "axis") if loop else IN_CONSTRAINT, closed=True)
        name = element.attributes.get("name", default)
        kind = element.attributes.get("type", "").lower()
        if kind not in JOINT_MOVES:
            raise element.unknown_name(
                "type", kind, JOINT_MOVES, f"one of {', '.join(JOINT_MOVES)}"
            )
        links: list[str] = []
        places: list[Place] = []
        for tag, *others in (("parent", "predecessor"), ("child", "successor")):
            if loop:
                tag, *others = (IN_LOOP[len(links)],)
            link = self._link(element, tag, *others)
            origin = element.child(tag if loop else f"{tag}_origin")
            for within in filter(None, map(element.child, others if origin is None else ())):
                origin = within.child("origin")
            place = _pose(origin) if loop and origin else _origin(origin)
            links.append(link)
            places.append(self.graph.places[link] * place)
        first, second = places
        kinds = JOINT_MOVES[kind]
        ball = "ball" in kinds
        axis = "axis" if loop else "parent_axis"
        if loop and kinds and (kind == "universal" or (not ball and not element.child(axis))):
            raise element.fault(
                f"<axis>: missing for {kind!r}, expected one axis; add it, or write <constraint>"
            )
        axes = [_axis(element, axis, first)] if kinds and not ball else [X]
        if kind == "universal":
            axes.append(_axis(element, "child_axis", second))
        freedoms: list[Freedom] = [
            (f".{each}{k + 1}" * (len(kinds) > 1), each, axes[min(k, len(axes) - 1)])
            for k, each in enumerate(kinds)
        ]
        joint = Joint.of(name, (links[0], links[1]), first.at, freedoms, element)
        if ball:
            return replace(joint, frames=(Place(first.at), Place(second.at)))
        return replace(joint, frames=(_frame_behind(first, second, joint.moves), second))

    def _gazebo(self) -> Frames:
        """Add the joints of SDF in <gazebo>, which close loops; return all frames.

        Raises:
            CaseError: see `joints_of`; or they bring links, or move the base.
        """
        graph, root, frames = self.graph, self.root, Frames()
        for name, element in graph.elements.items():
            frames.add_given(name, element, graph.places[name], name)
        for name, element in self.joints.items():
            link = self._link(element, "child")
            if name not in frames.found:
                frames.add_given(name, element, graph.places[link], link)
        for element in root.findall("frame"):  # of Drake
            link, name = element.attributes.get("link", ""), element.attributes.get("name", "")
            if link in graph.places and name and name not in frames.found:
                frames.add_given(name, element, graph.places[link] * _pose(element), link)
        for gazebo in root.findall(GAZEBO):
            gazebo.require_known(("reference",), "URDF")
            for element in gazebo.findall("link", "model"):
                raise element.fault("is of SDF, expected links of URDF; write it as <link>")
            if any(_joints_of_sdf(gazebo)):
                frames.read(gazebo, "")
                for element in gazebo.children:
                    if element.tag not in IN_GAZEBO:
                        graph.tree.leave(element, element.tag)
        still = {*graph.fixed}
        graph.loops += joints_of(graph, frames, SDF_VERSION)
        for full, framed in frames.joints.items():
            base = frames.link(framed.element, framed.attached)
            if base in still and framed.element.attributes.get("type") != "fixed":
                raise framed.element.fault(
                    f"{full!r} moves {base!r}, the base, which stands still, expected a joint"
                    " between links that move; give the robot a link 'world' and this joint as one"
                    " of URDF"
                )
        return frames

    def _require_apart(self, frames: Frames) -> None:
        """Refuse elements that are not read and may join links."""
        graph = self.graph
        names = {move.name: move.name for joint in graph.joints for move in joint.moves}
        names |= {joint.name: joint.name for joint in graph.joints}
        advice = f"a <joint>, <constraint> or <{BALL}>"
        unread = Unread(frames.link_names(), names, graph.followers, advice)
        for element in (self.root, *self.root.findall("link")):
            link = element.attributes["name"] if element.tag == "link" else ""
            if link:
                unread.require_apart(replace(element, children=[]), link)
            unread.require_all_apart(element.children, (*READ, *IN_LINK, GAZEBO), link)
            element.require_children((*IN_LINK, *LOOKS) if link else IN_ROBOT, closed=True)
        for gazebo in self.root.findall(GAZEBO):
            read = IN_GAZEBO if any(_joints_of_sdf(gazebo)) else ()
            link = gazebo.attributes.get("reference", "")
            unread.require_all_apart(gazebo.children, read, link)


def _limit(element: Element) -> Limit:
    found = element.child("limit")
    if found is None:
        return NO_LIMIT
    found.take("lower", "upper", "effort", "velocity")
    texts = {"lower": "0", "upper": "0", **found.attributes}
    if element.attributes.get("type") == "continuous":
        texts |= {"lower": "", "upper": ""}
    return limit_of(found, texts)


def _mass(element: Element) -> Mass | None:
    """Return the mass of an <inertial>; None if it cannot be read, for motion does not need it."""
    element.require_known((), "URDF")
    element.require_children(("mass", "inertia", "origin"), closed=True)
    for child in element.children:
        child.require_known({"mass": ("value",), "inertia": ENTRIES}.get(child.tag, POSE), "URDF")
    try:
        mass, matrix = element.child("mass"), element.child("inertia")
        entries = [0.0 if matrix is None else matrix.number(name, 0.0) for name in ENTRIES]
        if mass is None:
            return None
        return mass_in(_origin(element.child("origin")), mass.number("value"), entries)
    except CaseError:
        return None


def _joints_of_sdf(element: Element) -> Iterator[Element]:
    """Yield the joints and frames of SDF in a <gazebo> of the whole robot."""
    if element.tag == GAZEBO and "reference" not in element.attributes:
        yield from element.findall(*IN_GAZEBO)


def _origin(element: Element | None) -> Place:
    if element is None:
        return ORIGIN
    element.require_known(POSE, "URDF")
    return _pose(element)


def _pose(element: Element) -> Place:
    at, angles = (element.numbers(name, 3, default=ZEROS) for name in POSE)
    return Place(vec(at), euler_turn("zyx", angles[::-1]))


def _axis(element: Element, tag: str, place: Place) -> Vec3:
    """Return the axis of a joint, global; x unless given."""
    child = element.child(tag)
    if child is None:
        return place.direction(X)
    child.require_known(("xyz",), "URDF")
    return place.direction(child.direction(child.numbers("xyz", 3)))


def _frame_behind(first: Place, second: Place, moves: Sequence[Move]) -> Place:
    """Return the first frame of a loop, moved by the joint's own moves to the second one.

    The rest between both is the gap of the loop.
    """
    kinds = [move.kind for move in moves]
    at, turn = first.at, first.turn
    for move in moves:
        if move.kind == "slide":
            at += (move.axis @ (second.at - first.at)) * move.axis
    if kinds.count("hinge") > 1:
        turn = second.turn
    elif "hinge" in kinds:
        axis = moves[kinds.index("hinge")].axis
        between = second.turn * first.turn.conjugate()
        twist = Quat(between.e0, (axis @ between.e) * axis)
        if math.hypot(twist.e0, *twist.e) > 0.0:
            turn = unit_quaternion(twist) * first.turn
    return Place(at, turn)
