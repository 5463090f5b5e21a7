"""SDF: links and joints as a graph, in which a link may be the child of several joints."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial

from ....algebra import Vec3, X
from ...io.document import shown
from ..mjcf.elements import Element
from ..mjcf.frames import HERE, Place
from .drake import BALL, MIMIC, STRUT, add_ties, mimic_of
from .dynamics import add_sdf_spring
from .inertials import UNIT, sdf_inertial
from .robot import Connection, Coupling, Inertial, Mimic, Move, Robot
from .sdf_frames import MODEL, Frames, Short, endings, flag, text_of
from .unread import Unread
from .values import direction, numbers_of, only_child, require_children

# Three for each body that other models may have.
MOST_FRAMES = 6_000
TYPES = (
    *("revolute", "continuous", "prismatic", "fixed", "ball"),
    *("universal", "revolute2", "screw"),
)
IN_MODEL = (
    *("link", "joint", "frame", "model", "pose", "static", "include", "plugin", "gripper"),
    *("self_collide", "allow_auto_disable", "enable_wind"),
)
IN_LINK = (
    *("pose", "inertial", "visual", "collision", "sensor", "light", "gravity", "kinematic"),
    *("self_collide", "enable_wind", "velocity_decay", "must_be_base_link", "projector"),
    *("audio_sink", "audio_source", "battery", "particle_emitter", "plugin", "frame"),
    "contact",  # of Bullet
)
IN_JOINT = (
    *("parent", "child", "pose", "axis", "axis2", "physics", "sensor", "thread_pitch"),
    *("screw_thread_pitch", "gearbox_ratio", "gearbox_reference_body", "frame", MIMIC),
)
IN_AXIS = ("xyz", "limit", "dynamics", "mimic", "use_parent_model_frame", "initial_position")
_READ = ("model", "world", "link", "joint", "frame", "pose", "static", BALL, STRUT)
_COUNTED = ("visual", "collision", "sensor", "light", "plugin")
GRAVITY = (0.0, 0.0, -9.8)
"""Gravity of a world unless given [m/s^2]."""
# Axes were in the model's frame before this version.
_AXES_IN_JOINT = (1, 5)


def read_sdf(root: Element) -> Robot:
    """Return the robot of a document: all models in it, and their worlds.

    Raises:
        CaseError: included models, unknown frames, or an unknown joint.
    """
    robot = Robot("SDF model", root, gravity=GRAVITY)
    top = [*root.only("model"), *root.only("world")]
    if not top:
        raise root.fault("has no model, expected one; give a model that moves")
    for element in root.below():
        if element.tag == "include":
            raise element.fault(
                "takes a model from elsewhere, expected one whole file; write it out: gz sdf -p"
                " FILE > flat.sdf"
            )
    frames = Frames()
    frames.read(root, "")
    for world in root.only("world"):
        frames.read(world, "")
    short = Short(frames)
    if len(frames.found) > MOST_FRAMES:
        raise root.fault(
            f"found {len(frames.found)} links, joints and frames, expected {MOST_FRAMES} at most;"
            " take out those that are not looked at"
        )
    for full, framed in frames.links.items():
        require_children(framed.element, IN_LINK, closed=True)
        name = short(full)
        robot.links[name] = frames.place(framed.element, full)
        robot.elements[name] = framed.element
        if frames.still(full):
            robot.fixed.add(name)
        if (inertial := sdf_inertial(framed.element)) is not None:
            robot.inertials[name] = inertial
        for child in framed.element.only(*_COUNTED):
            robot.count(child.tag)
    if not robot.links:
        raise root.fault("has no link, expected a mechanism; give a model that moves")
    for full, framed in frames.models.items():
        require_children(framed.element, IN_MODEL)
        for child in framed.element.children:
            if child.tag in _COUNTED or (":" in child.tag and child.tag not in _READ):
                robot.count(child.tag)
        frames.place(framed.element, full)
    _default_masses(robot)
    for world in root.only("world"):
        if (gravity := only_child(world, "gravity")) is not None:
            robot.gravity = numbers_of(gravity, (3,), GRAVITY)
    robot.joints += joints_of(robot, frames, short, _version(root))
    add_ties(
        robot,
        (
            (element, partial(_link, frames, short, full))
            for full, framed in frames.models.items()
            for element in framed.element.children
        ),
    )
    _require_apart(robot, frames, short)
    for full, framed in frames.found.items():
        if framed.element.tag == "frame":
            link = frames.link(framed.element, framed.attached)
            if link:
                place = frames.place(framed.element, full)
                robot.frames[short(full)] = short(link), place
    return robot


def _default_masses(robot: Robot) -> None:
    """Give links without a mass that of SDF, 1 kg, if others have one."""
    if not robot.inertials:
        return
    for name in robot.links:
        if name not in robot.inertials and name not in robot.fixed:
            robot.inertials[name] = Inertial(HERE, 1.0, UNIT)
            robot.count("masses of links without one, 1 kg each as in SDF")


def _version(root: Element) -> tuple[int, ...]:
    try:
        return tuple(map(int, root.attributes.get("version", "1.7").split(".")))
    except ValueError:
        raise root.fault(
            f"version: found {shown(root.attributes['version'])}, expected a number such as 1.7;"
            " correct it"
        ) from None


def _link(frames: Frames, short: Short, model: str, element: Element, name: str) -> str:
    """Return the link of an element of Drake."""
    link = frames.link(element, frames.within(element, model, name))
    if not link:
        raise element.fault("is the world, expected a link; fix a link to the world")
    return short(link)


def _require_apart(robot: Robot, frames: Frames, short: Short) -> None:
    """Refuse elements that are not read and may join links."""
    joints = {name: short(full) for full in frames.joints for name in endings(full)}
    links = {name: short(full) for name, full in frames.named().items()}
    followers = [each.joints for each in robot.mimics]
    unread = Unread(links, joints, followers, f"a <joint> or <{BALL}>")
    around = [("", each) for each in (robot.root, *robot.root.only("world"))]
    around += [("", each.element) for each in frames.models.values()]
    around += [(full, each.element) for full, each in frames.links.items()]
    for link, element in around:
        for child in element.children:
            if child.tag not in _READ:
                unread.require_apart(child, link)
    for framed in frames.joints.values():
        for child in framed.element.children:
            if child.tag not in IN_JOINT and child.tag != MIMIC:
                unread.require_apart(child)


def joints_of(
    robot: Robot, frames: Frames, short: Short, version: tuple[int, ...]
) -> Iterator[Connection]:
    """Yield the joints; add the world if one hangs there, and mimics, couplings and springs.

    Raises:
        CaseError: an unknown link or joint, or a value that makes no sense.
    """
    world = "world"
    while world in robot.links:
        world += "'"
    for full, framed in frames.joints.items():
        element = framed.element
        require_children(element, IN_JOINT, closed=True)
        ends: list[str] = []
        for tag in ("parent", "child"):
            name = text_of(element, tag)
            link = frames.link(element, frames.within(element, framed.scope, name))
            if not link and world not in robot.links:
                robot.links[world], robot.elements[world] = HERE, robot.root
                robot.fixed.add(world)
            ends.append(short(link) if link else world)
        if ends[0] == ends[1]:
            raise element.fault(
                f"joins {ends[0]!r} with itself, expected two links; correct parent or child"
            )
        if {*ends} <= robot.fixed:
            robot.count("joints of what stands still")
            continue
        place = frames.place(element, full)
        links = ends[0], ends[1]
        joint = _joint(robot, frames, full, short(full), links, place, version)
        _mimics(robot, frames, short, full, joint.moves)
        _springs(robot, element, joint.moves)
        if (mimic := mimic_of(frames, short, full, joint)) is not None:
            robot.mimics.append(mimic)
        yield joint


def _joint(
    robot: Robot,
    frames: Frames,
    full: str,
    name: str,
    links: tuple[str, str],
    place: Place,
    version: tuple[int, ...],
) -> Connection:
    element = frames.joints[full].element
    kind = element.choice("type", TYPES, "")

    def axis(tag: str = "axis") -> Vec3:
        return _axis(frames, full, tag, place, version)

    def moves(*each: tuple[str, str, Vec3]) -> tuple[Move, ...]:
        return tuple(
            Move("slide" if what == "slide" else "hinge", title, place.at, along)
            for what, title, along in each
        )

    found: tuple[Move, ...]
    match kind:
        case "revolute" | "continuous":
            found = moves(("hinge", name, axis()))
        case "prismatic":
            found = moves(("slide", name, axis()))
        case "universal" | "revolute2":
            found = moves(("hinge", f"{name}.1", axis()), ("hinge", f"{name}.2", axis("axis2")))
        case "ball":
            found = (Move("ball", name, place.at, X),)
        case "screw":
            pitch = only_child(element, "screw_thread_pitch")
            if pitch is None:
                raise element.fault(
                    "<screw_thread_pitch>: missing, expected metres in a turn, as of SDF 1.10; give"
                    " it in place of <thread_pitch>, whose sign and unit differ between simulators"
                )
            (lead,) = numbers_of(pitch, (1,))
            turn, shift = f"{name}.rotation", f"{name}.translation"
            found = moves(("slide", shift, axis()), ("hinge", turn, axis()))
            weights = {shift: 1.0, turn: -lead / (2.0 * math.pi)}
            robot.couplings.append(Coupling(f"{name}.thread", weights, element))
        case _:
            found = ()
    return Connection(name, links, found, element)


def _axis(frames: Frames, full: str, tag: str, place: Place, version: tuple[int, ...]) -> Vec3:
    """Return an axis of a joint, global; z of the joint unless given."""
    framed = frames.joints[full]
    axis = only_child(framed.element, tag)
    if axis is None:
        raise framed.element.fault(f"<{tag}>: missing, expected an axis; add it")
    axis.require_known((), "SDF")
    require_children(axis, IN_AXIS, closed=True)
    xyz = only_child(axis, "xyz")
    numbers: Sequence[float] = (0.0, 0.0, 1.0)
    given = ""
    if xyz is not None:
        xyz.require_known(("expressed_in",), "SDF")
        numbers = numbers_of(xyz, (3,), numbers)
        given = xyz.attributes.get("expressed_in", "")
    if flag(only_child(axis, "use_parent_model_frame")) or version < _AXES_IN_JOINT:
        given = given or MODEL
    if given:
        base = frames.within(axis, framed.scope, given)
        place = frames.place(axis, base)
    return place.direction(direction(axis if xyz is None else xyz, numbers))


def _springs(robot: Robot, joint: Element, moves: Sequence[Move]) -> None:
    """Add the springs and dampers of the axes."""
    for tag, move in zip(("axis", "axis2"), moves, strict=False):
        for axis in joint.only(tag):
            if joint.attributes.get("type") != "screw":
                add_sdf_spring(robot, move.name, axis)
            elif any(axis.only("dynamics")):  # of the turn or of the shift
                robot.count("dynamics of screw joints")


def _mimics(robot: Robot, frames: Frames, short: Short, full: str, moves: Sequence[Move]) -> None:
    """Add the mimics of the axes."""
    framed = frames.joints[full]
    for tag, move in zip(("axis", "axis2"), moves, strict=False):
        axis = only_child(framed.element, tag)
        mimic = None if axis is None else only_child(axis, "mimic")
        if mimic is None:
            continue
        mimic.require_known(("joint", "axis"), "SDF")
        require_children(mimic, ("multiplier", "offset", "reference"), closed=True)
        leader = mimic.attributes.get("joint", "")
        key = frames.within(mimic, framed.scope, leader)
        if key not in frames.joints:
            raise mimic.fault(f"joint: found {shown(leader)}, expected a joint; correct the name")
        other = mimic.choice("axis", ("axis", "axis2"), "axis")
        two = frames.joints[key].element.attributes.get("type") in ("universal", "revolute2")
        name = f"{short(key)}.{1 + (other == 'axis2')}" if two else short(key)
        values = {
            each: numbers_of(child, (1,))[0] if (child := only_child(mimic, each)) else default
            for each, default in (("multiplier", 1.0), ("offset", 0.0), ("reference", 0.0))
        }
        factor = values["multiplier"]
        constant = values["offset"] - factor * values["reference"]
        robot.mimics.append(
            Mimic(f"{move.name}.mimic", (move.name, name), (constant, factor), mimic)
        )
