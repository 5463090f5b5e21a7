"""SDF: links and joints as a graph, in which a link may be the child of several joints.

Places of links, joints and frames may be given in each other. A pose is in the frame named by
`relative_to`. Without it, the pose of a link or a nested model is in the model's frame, a joint's
pose in its child, and a frame's pose in its `attached_to`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path

from ....algebra import Vec3, X, quat, vec
from ....errors import CaseError, remedy
from ...io.document import shown
from .element import DEEPEST, Element, words
from .graph import Freedom, Graph, Joint
from .place import ORIGIN, Place, roll_pitch_yaw, unit_quaternion
from .robot_elements import (
    BALL,
    BUSHING,
    ENTRIES,
    FRICTION,
    LAW,
    MIMIC,
    STRUT,
    Unread,
    add_spring,
    add_ties,
    direction,
    mass_in,
    mimic,
    screw,
)
from .tree import WORLD, Coupling, Mass, Move, Tree

MODEL = "__model__"
SCOPE = "::"
# Three for each body that other models may have.
MOST_FRAMES = 6_000
TYPES = words("revolute continuous prismatic fixed ball universal revolute2 screw")
TWO_AXES = ("universal", "revolute2")
IN_MODEL = words(
    "link joint frame model pose static include plugin gripper self_collide "
    "allow_auto_disable enable_wind"
)
IN_LINK = words(
    "pose inertial visual collision sensor light gravity kinematic self_collide "
    "enable_wind velocity_decay must_be_base_link projector audio_sink audio_source "
    "battery particle_emitter plugin frame contact"
)
IN_JOINT = (
    *words("parent child pose axis axis2 physics sensor thread_pitch"),
    *("screw_thread_pitch", "gearbox_ratio", "gearbox_reference_body", "frame", MIMIC),
)
IN_AXIS = words("xyz limit dynamics mimic use_parent_model_frame initial_position")
IN_INERTIAL = words("mass density pose inertia frame auto_inertia_params fluid_added_mass")
IN_ROOT = words("model world light actor")
IN_WORLD = (
    *(*IN_ROOT, "include", "frame", "joint", "plugin", "gravity", "physics"),
    *words("audio atmosphere magnetic_field scene gui state road population wind"),
    "spherical_coordinates",
)
IN = {"sdf": IN_ROOT, "world": IN_WORLD, "model": IN_MODEL, "link": IN_LINK}
"""Known elements, by the one around them."""
IN_LIMIT = words("lower upper effort velocity stiffness dissipation")
_READ = ("model", "world", "link", "joint", "frame", "pose", "static", BALL, STRUT, BUSHING)
_COUNTED = words("visual collision sensor light plugin")
GRAVITY = (0.0, 0.0, -9.8)
"""Gravity of a world unless given [m/s^2]."""
UNIT = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
"""Inertia of a link unless given, of 1 kg [kg m^2]."""
# Axes were in the model's frame before this version.
AXES_IN_JOINT = (1, 5)


@dataclass(frozen=True)
class Framed:
    """An element with a frame.

    Attributes:
        scope: full name of the model around it; empty for the world.
        default: full name of the base of its pose without relative_to.
        attached: full name of the frame it moves with; empty for a link, or the world.
    """

    element: Element
    scope: str
    default: str
    attached: str = ""


@dataclass
class Frames:
    """All frames of a document, by full name: MODEL::LINK; the world has an empty name."""

    found: dict[str, Framed] = field(default_factory=dict[str, Framed])
    links: dict[str, Framed] = field(default_factory=dict[str, Framed])
    joints: dict[str, Framed] = field(default_factory=dict[str, Framed])
    models: dict[str, Framed] = field(default_factory=dict[str, Framed])
    static: set[str] = field(default_factory=set[str])
    _places: dict[str, Place] = field(default_factory=lambda: {"": ORIGIN})

    def read(self, around: Element, scope: str, depth: int = 0) -> None:
        """Take the frames of a model or world.

        Raises:
            CaseError: a name is missing or given twice, or models nest too deeply.
        """
        if depth > DEEPEST // 10:
            raise around.fault("nests too deeply, expected few models in models; flatten the file")
        for element in around.only("link"):
            element.require_known(("name",), "SDF")
            full = self._add(element, scope, scope)
            self.links[full] = self.found[full]
        for element in around.only("model"):
            element.require_known(("name", "canonical_link"), "SDF")
            full = self._add(element, scope, scope)
            self.models[full] = self.found[full]
            if _flag(element.child("static")):
                self.static.add(full)
            self.read(element, full, depth + 1)
        for element in around.only("joint"):
            element.require_known(("name", "type"), "SDF")
            child = within(scope, text_of(element, "child"))
            full = self._add(element, scope, child, child)
            self.joints[full] = self.found[full]
        for element in around.only("frame"):
            element.require_known(("name", "attached_to"), "SDF")
            element.require_children(("pose",), closed=True)
            base = element.attributes.get("attached_to", "")
            attached = within(scope, base) if base else scope
            self._add(element, scope, attached, attached)

    def _add(self, element: Element, scope: str, default: str, attached: str = "") -> str:
        name = element.attributes.get("name", "")
        if not name or SCOPE in name or name in (WORLD, MODEL):
            raise element.fault(f"name: found {shown(name)}, expected a name of its own; give one")
        full = _full_name(scope, name)
        if full in self.found:
            raise element.repeated_name(name, "them")
        self.found[full] = Framed(element, scope, default, attached)
        return full

    def put(self, name: str, element: Element, place: Place, link: str) -> None:
        """Take a frame of another format, at a place on a link."""
        self.found[name] = Framed(element, "", "", link)
        self._places[name] = place
        if name == link:
            self.links[name] = self.found[name]

    def named(self) -> dict[str, str]:
        """Return the links by the names of links and frames, with and without their models.

        Raises:
            CaseError: a frame is attached to none.
        """
        links = {WORLD: WORLD}
        for full, framed in self.found.items():
            if full not in self.models and full not in self.joints:
                link = self.link(framed.element, full) or WORLD
                links |= {name: link for name in _endings(full) if name not in links}
        return links

    @cached_property
    def _prefix(self) -> str:
        """What all names have in common: the model, if there is only one at the top."""
        tops = [full for full, each in self.models.items() if not each.scope]
        outside = any(not each.scope for each in (*self.links.values(), *self.joints.values()))
        return f"{tops[0]}{SCOPE}" if len(tops) == 1 and not outside else ""

    def short(self, full: str) -> str:
        """Return a full name without the model, if there is only one at the top; not before all are
        read.
        """
        return full.removeprefix(self._prefix)

    def known(self, element: Element, full: str) -> str:
        """Return a full name of a frame.

        Raises:
            CaseError: there is none.
        """
        if full and full not in self.found:
            raise element.fault(
                f"found the frame {shown(full)}, expected another one; {remedy(full, self.found)}"
            )
        return full

    def place(self, element: Element, full: str) -> Place:
        """Return the place of a frame, global.

        Raises:
            CaseError: it is unknown, or given in itself by a ring of frames.
        """
        chain: list[str] = []
        name = self.known(element, full)
        while name not in self._places:
            chain.append(name)
            if len(chain) > len(self.found):
                raise self.found[name].element.fault(
                    "is given in itself by a ring of frames, expected poses from the model on;"
                    " correct relative_to"
                )
            name = self.known(self.found[name].element, self._base(name))
        for name in reversed(chain):
            base = self._places[self._base(name)]
            self._places[name] = base.then(_pose(self.found[name].element.child("pose")))
        return self._places[full]

    def _base(self, full: str) -> str:
        """Return the base of the pose of a frame."""
        framed = self.found[full]
        pose = framed.element.child("pose")
        given = pose.attributes.get("relative_to", "") if pose is not None else ""
        return within(framed.scope, given) if given else framed.default

    def link(self, element: Element, full: str) -> str:
        """Return the link of a frame; empty for the world.

        Raises:
            CaseError: there is none.
        """
        for _ in range(len(self.found) + 1):
            if not full or full in self.links:
                return full
            self.known(element, full)
            full = self._canonical(full) if full in self.models else self.found[full].attached
        raise element.fault(
            f"found the frame {shown(full)}, which is attached to itself; correct attached_to"
        )

    def _canonical(self, model: str) -> str:
        """Return the link of a model's frame: its canonical one, its first, or that of a model
        inside.
        """
        element = self.found[model].element
        if name := element.attributes.get("canonical_link", ""):
            return _full_name(model, name)
        for full, each in (*self.links.items(), *self.models.items()):
            if each.scope == model:
                return full
        raise element.fault("has no link, expected one; give a model with links")

    def is_still(self, full: str) -> bool:
        """Return whether a link is in a static model, or in a model inside it."""
        scope = self.found[full].scope
        while scope and scope not in self.static:
            scope = self.found[scope].scope
        return bool(scope)


def within(scope: str, name: str) -> str:
    """Return the full name of a name in a scope; whether there is such a frame is asked later, for
    it may follow.
    """
    if name == MODEL:
        return scope
    return "" if name == WORLD else _full_name(scope, name)


def _full_name(scope: str, name: str) -> str:
    return f"{scope}{SCOPE}{name}" if scope else name


def _endings(full: str) -> list[str]:
    """Return a full name, and what it is called within its models."""
    parts = full.split(SCOPE)
    return [SCOPE.join(parts[k:]) for k in range(len(parts))]


def read_sdf(file: Path, root: Element) -> Tree:
    """Return the tree of all models in a document, and their worlds, in its zero pose.

    Raises:
        CaseError: unknown frames, or an unknown joint.
    """
    name = root.attributes.get("name", file.stem)
    graph, frames = Graph.of(root, f"SDF model {name!r} of {file.name}"), Frames()
    graph.tree.gravity = GRAVITY
    worlds = [*root.only("world")]
    if not (worlds or any(root.only("model"))):
        raise root.fault("has no model, expected one; give a model that moves")
    for around in (root, *worlds):
        frames.read(around, "")
    if len(frames.found) > MOST_FRAMES:
        raise root.fault(
            f"found {len(frames.found)} links, joints and frames, expected {MOST_FRAMES} at most;"
            " take out those that are not looked at"
        )
    _add_links(graph, frames)
    for full, framed in frames.models.items():
        framed.element.require_children(IN_MODEL)
        for child in framed.element.children:
            if child.tag in _COUNTED or (":" in child.tag and child.tag not in _READ):
                graph.tree.count(child.tag)
        frames.place(framed.element, full)
    for world in worlds:
        if (gravity := world.child("gravity")) is not None:
            x, y, z = gravity.text_numbers(3, default=GRAVITY)
            graph.tree.gravity = x, y, z
    graph.joints += joints_of(graph, frames, version_of(root))
    in_models = [
        (child, partial(_link, frames, full), partial(_framed, frames, full))
        for full, framed in frames.models.items()
        for child in framed.element.children
    ]
    add_ties(graph, in_models)
    _require_apart(graph, frames)
    for full, framed in frames.found.items():
        if framed.element.tag == "frame" and (link := frames.link(framed.element, framed.attached)):
            place = frames.place(framed.element, full)
            graph.frames[frames.short(full)] = frames.short(link), place
    return graph.hang()


def _add_links(graph: Graph, frames: Frames) -> None:
    for full, framed in frames.links.items():
        framed.element.require_children(IN_LINK, closed=True)
        name = frames.short(full)
        graph.places[name] = frames.place(framed.element, full)
        graph.elements[name] = framed.element
        if frames.is_still(full):
            graph.fixed.add(name)
        for inertial in [*framed.element.only("inertial")][:1]:
            graph.masses[name] = _mass(inertial)
        for child in framed.element.only(*_COUNTED):
            graph.tree.count(child.tag)
    if not graph.places:
        raise graph.root.fault("has no link, expected a mechanism; give a model that moves")
    if graph.masses:
        for name in graph.places:
            if name not in graph.masses and name not in graph.fixed:
                graph.masses[name] = mass_in(ORIGIN, 1.0, UNIT)
                graph.tree.count("masses of links without one, 1 kg each as in SDF")


def _mass(element: Element) -> Mass | None:
    """Return the mass of an <inertial>; None if it cannot be read, for motion does not need it."""
    element.require_known(("auto",), "SDF")
    element.require_children(IN_INERTIAL, closed=True)
    for child in element.only("inertia"):
        child.require_children(ENTRIES, closed=True)
    try:
        if element.choice("auto", FLAGS, "false") in TRUE:
            return None  # that of its collision shapes
        matrix = element.child("inertia")
        entries = [
            default if matrix is None else _number(matrix, name, default)
            for name, default in zip(ENTRIES, UNIT, strict=True)
        ]
        mass = element.child("mass")
        kilograms = 1.0 if mass is None else mass.text_numbers(1)[0]
        return mass_in(_pose(element.child("pose")), kilograms, entries)
    except CaseError:
        return None


def _number(element: Element, tag: str, default: float) -> float:
    child = element.child(tag)
    return default if child is None else child.text_numbers(1, default=(default,))[0]


def version_of(root: Element) -> tuple[int, ...]:
    """Return the version of SDF of a document; 1.7 unless given.

    Raises:
        CaseError: it is no number.
    """
    try:
        return tuple(map(int, root.attributes.get("version", "1.7").split(".")))
    except ValueError:
        raise root.fault(
            f"version: found {shown(root.attributes['version'])}, expected a number such as 1.7;"
            " correct it"
        ) from None


def _link(frames: Frames, model: str, element: Element, name: str) -> str:
    """Return the link of an element of Drake."""
    link = frames.link(element, within(model, name))
    if not link:
        raise element.fault("is the world, expected a link; fix a link to the world")
    return frames.short(link)


def _framed(frames: Frames, model: str, element: Element, name: str) -> tuple[str, Place]:
    """Return link and place of a frame named by an element of Drake."""
    return _link(frames, model, element, name), frames.place(element, within(model, name))


def _require_apart(graph: Graph, frames: Frames) -> None:
    """Refuse elements that are not read and may join links."""
    joints = {name: frames.short(full) for full in frames.joints for name in _endings(full)}
    links = {name: frames.short(full) for name, full in frames.named().items()}
    unread = Unread(links, joints, graph.followers, f"a <joint> or <{BALL}>")
    around = [("", each) for each in (graph.root, *graph.root.only("world"))]
    around += [("", each.element) for each in frames.models.values()]
    around += [(full, each.element) for full, each in frames.links.items()]
    for link, element in around:
        unread.require_all_apart(element.children, _READ, link)
        element.require_children(IN[element.tag], closed=True)
    for framed in frames.joints.values():
        unread.require_all_apart(framed.element.children, IN_JOINT)


def joints_of(graph: Graph, frames: Frames, version: tuple[int, ...]) -> list[Joint]:
    """Return the joints; add the world if one hangs there, and mimics, couplings and springs.

    Args:
        version: of SDF.

    Raises:
        CaseError: an unknown link or joint, or a value that makes no sense.
    """
    world = WORLD
    while world in graph.places:
        world += "'"
    joints: list[Joint] = []
    for full, framed in frames.joints.items():
        element = framed.element
        element.require_children(IN_JOINT, closed=True)
        ends: list[str] = []
        for tag in ("parent", "child"):
            link = frames.link(element, within(framed.scope, text_of(element, tag)))
            if not link and world not in graph.places:
                graph.places[world], graph.elements[world] = ORIGIN, graph.root
                graph.fixed.add(world)
            ends.append(frames.short(link) if link else world)
        if ends[0] == ends[1]:
            raise element.fault(
                f"joins {ends[0]!r} with itself, expected two links; correct parent or child"
            )
        if {*ends} <= graph.fixed:
            graph.tree.count("joints of what stands still")
        else:
            joints.append(_Joint(graph, frames, full, version).read((ends[0], ends[1])))
    return joints


class _Joint:
    """A joint during its reading."""

    def __init__(self, graph: Graph, frames: Frames, full: str, version: tuple[int, ...]) -> None:
        self.graph, self.frames, self.version = graph, frames, version
        self.framed, self.name = frames.joints[full], frames.short(full)
        self.element = self.framed.element
        self.place = frames.place(self.element, full)
        self.kind = self.element.choice("type", TYPES, "")

    def read(self, links: tuple[str, str]) -> Joint:
        """Return the joint between two links; add mimics, couplings and springs."""
        joint = Joint.of(self.name, links, self.place.at, self._freedoms(), self.element)
        moves = joint.moves
        mimics: list[Coupling] = []
        for tag, move in zip(("axis", "axis2"), moves, strict=False):
            for axis in self.element.only(tag):
                self._add_spring(move, axis)
                if (element := axis.child("mimic")) is not None:
                    mimics.append(self._mimic(move, element))
        if (element := self.element.child(MIMIC)) is not None:
            mimics.append(self._drake_mimic(moves, element))
        self.graph.couplings += mimics
        return joint

    def _freedoms(self) -> list[Freedom]:
        element = self.element
        match self.kind:
            case "revolute" | "continuous":
                return [("", "hinge", self._axis("axis"))]
            case "prismatic":
                return [("", "slide", self._axis("axis"))]
            case "universal" | "revolute2":
                return [(".1", "hinge", self._axis("axis")), (".2", "hinge", self._axis("axis2"))]
            case "ball":
                return [("", "ball", X)]
            case "screw":
                if (pitch := element.child("screw_thread_pitch")) is None:
                    raise element.fault(
                        "<screw_thread_pitch>: missing, expected metres in a turn, as of SDF 1.10;"
                        " give it in place of <thread_pitch>, whose sign and unit differ between"
                        " simulators"
                    )
                (lead,) = pitch.text_numbers(1)
                return screw(self.graph, self.name, lead, self._axis("axis"), element)
            case _:
                return []

    def _axis(self, tag: str) -> Vec3:
        """Return an axis, global; z of the joint unless given."""
        if (axis := self.element.child(tag)) is None:
            raise self.element.fault(f"<{tag}>: missing, expected an axis; add it")
        axis.require_known((), "SDF")
        axis.require_children(IN_AXIS, closed=True)
        for limit in axis.only("limit"):
            limit.require_children(IN_LIMIT, closed=True)
        numbers: Sequence[float] = (0.0, 0.0, 1.0)
        given, place = "", self.place
        if (xyz := axis.child("xyz")) is not None:
            xyz.require_known(("expressed_in",), "SDF")
            numbers = xyz.text_numbers(3, default=numbers)
            given = xyz.attributes.get("expressed_in", "")
        if _flag(axis.child("use_parent_model_frame")) or self.version < AXES_IN_JOINT:
            given = given or MODEL
        if given:
            place = self.frames.place(axis, within(self.framed.scope, given))
        return place.direction(direction(xyz or axis, numbers))

    def _add_spring(self, move: Move, axis: Element) -> None:
        for dynamics in axis.only("dynamics"):
            if self.kind == "screw":  # of the turn or of the shift
                self.graph.tree.count("dynamics of screw joints")
                return
            dynamics.require_children((*LAW, *FRICTION), closed=True)
            add_spring(self.graph, move.name, {each.tag: each.text for each in dynamics.children})

    def _mimic(self, move: Move, element: Element) -> Coupling:
        """Return the mimic of an axis."""
        element.require_known(("joint", "axis"), "SDF")
        element.require_children(("multiplier", "offset", "reference"), closed=True)
        leader = element.attributes.get("joint", "")
        full = within(self.framed.scope, leader)
        if full not in self.frames.joints:
            raise element.fault(f"joint: found {shown(leader)}, expected a joint; correct the name")
        name, other = self.frames.short(full), element.choice("axis", ("axis", "axis2"), "axis")
        if self.frames.joints[full].element.attributes.get("type") in TWO_AXES:
            name = f"{name}.{1 + (other == 'axis2')}"
        factor, offset, reference = (
            default if (child := element.child(tag)) is None else child.text_numbers(1)[0]
            for tag, default in (("multiplier", 1.0), ("offset", 0.0), ("reference", 0.0))
        )
        return mimic(move.name, name, offset - factor * reference, factor, element)

    def _drake_mimic(self, moves: Sequence[Move], element: Element) -> Coupling:
        """Return the mimic of a joint in Drake's form."""
        element.require_known(("joint", "multiplier", "offset"), "SDF")
        name = element.attributes.get("joint", "")
        leader = within(self.framed.scope, name)
        if leader not in self.frames.joints:
            known = [*map(self.frames.short, self.frames.joints)]
            raise element.unknown_name("joint", name, known, "a joint")
        if len(moves) != 1 or moves[0].kind == "ball":
            raise element.fault(
                f"{self.name!r} has not one coordinate, expected a revolute or prismatic joint;"
                " correct it"
            )
        factor, offset = element.number("multiplier", 1.0), element.number("offset", 0.0)
        return mimic(self.name, self.frames.short(leader), offset, factor, element)


def text_of(element: Element, tag: str) -> str:
    """Return the text of the only element of a tag."""
    child = element.child(tag)
    if child is None or not child.text:
        raise element.fault(f"<{tag}>: missing, expected a name; add it")
    return child.text


FLAGS = ("true", "false", "1", "0")
TRUE = ("true", "1")


def _flag(element: Element | None) -> bool:
    """Return the flag in the text of an element; false without one."""
    if element is None:
        return False
    if element.text.lower() not in FLAGS:
        raise element.fault(f"found {shown(element.text)}, expected true or false; correct it")
    return element.text.lower() in TRUE


def _pose(element: Element | None) -> Place:
    """Return the place of a <pose>; the frame itself without one."""
    if element is None:
        return ORIGIN
    element.require_known(("relative_to", "degrees", "rotation_format", "frame"), "SDF")
    if element.attributes.get("frame"):
        raise element.fault(
            "frame: found an attribute of SDF 1.6, expected relative_to; convert it"
        )
    kind = element.choice("rotation_format", ("euler_rpy", "quat_xyzw"), "euler_rpy")
    if kind == "quat_xyzw":
        numbers = element.text_numbers(7, default=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
        if not math.hypot(*numbers[3:]) > 0.0:
            raise element.fault("found a quaternion of zeros, expected a rotation; correct it")
        x, y, z, w = numbers[3:]
        return Place(vec(numbers[:3]), unit_quaternion(quat((w, x, y, z))))
    *at, roll, pitch, yaw = element.text_numbers(6, default=(0.0,) * 6)
    angles = [roll, pitch, yaw]
    if element.choice("degrees", FLAGS, "false") in TRUE:
        angles = [*map(math.radians, angles)]
    return Place(vec(at), roll_pitch_yaw(angles))
