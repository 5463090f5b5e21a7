"""SDF: links and joints as a graph, in which a link may be the child of several joints.

Places of links, joints and frames may be given in each other. A pose is in the frame named by
`relative_to`. Without it, the pose of a link or a nested model is in the model's frame, a joint's
pose in its child, and a frame's pose in its `attached_to`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from ...algebra import Vec3, X, Y, Z
from ...case.io.document import read_text, shown
from ...case.io.readers import LARGEST_FILE
from ...errors import CaseError
from ..xml.element import EXTENDED, TAKEN, ZEROS, Apart, Element, file_near, parse_xml, words
from .graph import Freedom, Graph, Joint
from .masses import mass_in
from .place import ORIGIN, Place
from .robot_elements import (
    BALL,
    BUSHING,
    DRAKE_JOINT,
    ENTRIES,
    FRICTION,
    JOINT_MOVES,
    LAW,
    MIMIC,
    STRUT,
    Unread,
    add_spring,
    add_ties,
    mimic,
    planar,
    screw,
)
from .sdf_frames import (
    FLAGS,
    MODEL,
    PLACED,
    TRUE,
    Framed,
    Frames,
    endings,
    flag_of,
    full_name_of,
    pose_of,
    text_of,
)
from .tree import NO_LIMIT, WORLD, Coupling, Limit, Mass, Move, Tree, limit_of

TYPES = words("revolute continuous prismatic fixed ball universal revolute2 screw gearbox")
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
    *(*FRICTION[1:], "drake:controller_gains"),
)
BARE = words("parent child screw_thread_pitch gearbox_ratio gearbox_reference_body")
"""Those without attributes."""
GEARBOX = "gearbox"
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
IN_LIMIT = words("lower upper effort velocity stiffness dissipation drake:acceleration")
IN_DRAKE = words("drake:parent drake:child drake:damping")
_READ = (*words("model world link joint frame pose static"), BALL, STRUT, BUSHING, DRAKE_JOINT)
# Three for each body that other models may have.
MOST_FRAMES = 6_000
GRAVITY = (0.0, 0.0, -9.8)
"""Gravity of a world unless given [m/s^2]."""
MOST_INCLUDES, _SUFFIXES = 100, (".sdf", ".world", ".config")
_WRITE_OUT = "write the whole model out: gz sdf -p FILE > flat.sdf"
# Cosine between an axis and that of a hinge it means, which few digits leave.
ALONG = 1.0 - 1e-6
APART = Apart(
    "SDF",
    {
        "sdf": ("version",),
        "inertial": words("<mass> <pose> <inertia> <density> <frame> <auto_inertia_params>"),
        "inertia": tuple(f"<{each}>" for each in ENTRIES),
    },
    extended=(*EXTENDED, "inertial"),
)
"""Names of SDF without meaning for kinematics."""
UNIT = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
"""Inertia of a link unless given, of 1 kg [kg m^2]."""
# Axes were in the model's frame before this version.
_AXES_IN_JOINT = (1, 5)


def whole_sdf(root: Element) -> Element:
    """Return a document with the models that it includes from files beside it.

    Raises:
        CaseError: a model is elsewhere, or an option of its inclusion is not read.
    """
    folder = root.file.parent.resolve()
    return _Inclusion(folder, folder.parent, _version(root)).with_models(root)


@dataclass
class _Inclusion:
    """The inclusion of models.

    Attributes:
        folder: of the document that includes.
        around: all files are in here.
        version: of SDF.
        count: how many are included so far, at any depth.
    """

    folder: Path
    around: Path
    version: tuple[int, ...]
    count: int = 0

    def with_models(self, around: Element) -> Element:
        """Return an element with included models in place of <include>, at any depth."""
        return around.rebuild(lambda each: (self._model(each) if each.tag == "include" else each,))

    def _model(self, element: Element) -> Element:
        element.require_known(("merge",), "SDF")
        if element.choice("merge", FLAGS, "false") in TRUE:
            raise element.fault(f"merge: is not read; {_WRITE_OUT}")
        element.require_children(("uri", "name", "pose", "static", "plugin", PLACED), closed=True)
        self.count += 1
        if self.count > MOST_INCLUDES:
            raise element.fault(f"found more than {MOST_INCLUDES} includes, or a ring of them")
        file = self._file(element, text_of(element, "uri"))
        root = parse_xml(file, read_text(file, LARGEST_FILE, "it holds one model"))
        models = [*root.findall("model")]
        if root.tag != "sdf" or len(models) != 1:
            raise element.fault(
                f"{file.name}: found <{root.tag}> with {len(models)} models, expected <sdf> with"
                f" one; {_WRITE_OUT}"
            )
        if (_version(root) < _AXES_IN_JOINT) != (self.version < _AXES_IN_JOINT):
            raise element.fault(
                f"{file.name}: is of SDF {root.attributes.get('version')}, whose axes have another"
                f" meaning than those of the file around it; {_WRITE_OUT}"
            )
        folder, self.folder = self.folder, file.parent
        model = self.with_models(models[0])
        self.folder = folder
        own = [*element.findall("pose", "static", "plugin")]
        given = {each.tag for each in own if each.tag != "plugin"}
        children = [*own, *(each for each in model.children if each.tag not in given)]
        attributes = dict(model.attributes)
        for tag in ("name", PLACED):
            if element.child(tag) is not None:
                attributes[tag] = text_of(element, tag)
        return replace(model, attributes=attributes, children=children)

    def _file(self, element: Element, uri: str) -> Path:
        """Return the file of a model: the URI's own, or that named by the folder's model.config."""
        kind, _, path = uri.rpartition("://")
        names = [f"../{path}", path] if kind == "model" else [path]
        places = [file_near(self.folder, name, _SUFFIXES) for name in names]
        if kind in ("model", ""):
            # a folder beside the document's has no suffix
            places += [
                file_near(self.folder, f"{name}/{inside}", _SUFFIXES)
                for name in names
                for inside in ("model.config", "model.sdf")
            ]
        near = [each for each in places if each and each.is_relative_to(self.around)]
        found = [each for each in near if each.is_file()]
        if not found or kind not in ("model", "file", ""):
            raise element.fault(
                f"uri: found {shown(uri)}, expected a model in the folder of the file, in one"
                f" beside it or below, and there is none; put it there, or {_WRITE_OUT}"
            )
        if found[0].suffix != ".config":
            return found[0]
        config = parse_xml(found[0], read_text(found[0], LARGEST_FILE, "it describes one model"))
        files = [*config.findall("sdf")]
        newest = max(files, key=_version, default=config)
        file = file_near(found[0].parent, newest.text, _SUFFIXES)
        if file is None or not file.is_file():
            raise newest.fault(f"found {shown(newest.text)}, expected a file beside it; correct it")
        return file


def read_sdf(root: Element) -> Tree:
    """Return the tree of all models in a document, and their worlds, in its zero pose.

    Raises:
        CaseError: unknown frames, or an unknown joint.
    """
    name = root.attributes.get("name", root.file.stem)
    graph, frames = Graph.of(root, f"SDF model {name!r} of {root.file.name}"), Frames()
    graph.tree.gravity = GRAVITY
    worlds = [*root.findall("world")]
    if not (worlds or any(root.findall("model"))):
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
            if child.tag not in _READ:
                graph.tree.leave(child, child.tag)
        frames.place(framed.element, full)
    for world in (root, *worlds):
        for child in world.children:
            if child.tag not in (*_READ, "gravity"):
                graph.tree.leave(child, child.tag)
    for world in worlds:
        if (gravity := world.child("gravity")) is not None:
            x, y, z = gravity.text_numbers(3, default=GRAVITY)
            graph.tree.gravity = x, y, z
    graph.joints += joints_of(graph, frames, _version(root))
    in_models = [
        (child, partial(_link, frames, full), partial(_link_and_place, frames, full))
        for full, framed in frames.models.items()
        for child in framed.element.children
    ]
    add_ties(graph, in_models)
    _require_apart(graph, frames)
    for full, framed in frames.found.items():
        if framed.element.tag == "frame" and (link := frames.link(framed.element, framed.attached)):
            place = frames.place(framed.element, full)
            graph.frames[frames.short_name(full)] = frames.short_name(link), place
    graph.close_named_pairs()
    return graph.hang().settled(root, APART)


def _add_links(graph: Graph, frames: Frames) -> None:
    for full, framed in frames.links.items():
        framed.element.require_children(IN_LINK, closed=True)
        name = frames.short_name(full)
        graph.places[name] = frames.place(framed.element, full)
        graph.elements[name] = framed.element
        if frames.is_still(full):
            graph.fixed.add(name)
        if (inertial := framed.element.child("inertial")) is not None:
            graph.masses[name] = _mass(inertial)
        for child in framed.element.children:
            if child.tag not in ("inertial", "pose"):
                graph.tree.leave(child, child.tag)
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
    for child in element.findall("inertia"):
        child.require_children(ENTRIES, closed=True)
    try:
        if element.choice("auto", FLAGS, "false") in TRUE:
            return None  # that of its collision shapes
        matrix = element.child("inertia")
        entries = [
            matrix.child_number(name, default)
            if matrix is not None and matrix.child_text(name)
            else default
            for name, default in zip(ENTRIES, UNIT, strict=True)
        ]
        mass = element.child_number("mass", 1.0)
        return mass_in(pose_of(element.child("pose")), mass, entries)
    except CaseError:
        return None


def _version(root: Element) -> tuple[int, ...]:
    try:
        return tuple(map(int, root.attributes.get("version", "1.7").split(".")))
    except ValueError:
        raise root.fault(
            f"version: found {shown(root.attributes['version'])}, expected a number such as 1.7;"
            " correct it"
        ) from None


def _link(frames: Frames, model: str, element: Element, name: str) -> str:
    """Return the link of an element of Drake."""
    link = frames.link(element, full_name_of(model, name))
    if not link:
        raise element.fault("is the world, expected a link; fix a link to the world")
    return frames.short_name(link)


def _link_and_place(frames: Frames, model: str, element: Element, name: str) -> tuple[str, Place]:
    """Return link and place of a frame named by an element of Drake."""
    return _link(frames, model, element, name), frames.place(element, full_name_of(model, name))


def _require_apart(graph: Graph, frames: Frames) -> None:
    """Refuse elements that are not read and may join links."""
    joints = {name: frames.short_name(full) for full in frames.joints for name in endings(full)}
    links = {name: frames.short_name(full) for name, full in frames.link_names().items()}
    unread = Unread(links, joints, graph.followers, f"a <joint> or <{BALL}>")
    around = [("", each) for each in (graph.root, *graph.root.findall("world"))]
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
    joints: list[Joint] = []
    gears: list[tuple[_Joint, tuple[str, str]]] = []
    for full, framed in frames.joints.items():
        element = framed.element
        element.require_children(IN_JOINT, closed=True)
        for each in element.findall(*BARE):
            each.require_known((), "SDF")
        (first, _), (second, _) = _ends(graph, frames, framed, ("parent", "child"))
        links = first, second
        if {*links} <= graph.fixed:
            graph.tree.leave(element, "joints of what stands still")
            continue
        joint = _Joint(graph, frames, full, version)
        if joint.kind == GEARBOX:
            gears.append((joint, links))
        else:
            joints.append(joint.read(links))
    for gear, links in gears:
        graph.couplings.append(gear.gearbox(links, [*graph.joints, *joints]))
    for scope, framed in frames.models.items():
        for element in framed.element.findall(DRAKE_JOINT):
            joints.append(_planar(graph, frames, scope, element))
    return joints


def _planar(graph: Graph, frames: Frames, scope: str, element: Element) -> Joint:
    """Return Drake's planar joint, in the plane of x and y of a frame of the parent.

    Raises:
        CaseError: it is of another type, or its frames are apart, which Drake would put together.
    """
    element.require_known(("name", "type"), "SDF")
    element.choice("type", ("planar",), "")
    element.require_children(IN_DRAKE, closed=True)
    if any(element.value("drake:damping", 3, ZEROS)):
        graph.tree.count("dynamics of joints")
    ends = _ends(graph, frames, Framed(element, scope, scope), IN_DRAKE[:2])
    (outer, place), (inner, other) = ((link, frames.place(element, full)) for link, full in ends)
    apart = other.relative_to(place)
    near = 10.0 ** (1 - graph.tree.digits)
    if apart.at @ apart.at > near**2 or apart.turn.e @ apart.turn.e > near**2:
        raise element.fault(
            "its frames are apart in the poses of the links, and Drake puts them together, expected"
            " one place; correct the pose of the child"
        )
    freedoms = planar(*map(place.direction, (X, Y, Z)))
    name = frames.short_name(full_name_of(scope, element.require("name")))
    return Joint.of(name, (outer, inner), place.at, freedoms, element)


def _ends(
    graph: Graph, frames: Frames, framed: Framed, tags: Sequence[str]
) -> list[tuple[str, str]]:
    """Return the two links of a joint, and the full names of the frames that it names."""
    ends: list[tuple[str, str]] = []
    for tag in tags:
        full = full_name_of(framed.scope, text_of(framed.element, tag))
        link = frames.link(framed.element, full)
        ends.append((frames.short_name(link) if link else graph.add_world(), full))
    framed.element.require_two(ends[0][0], ends[1][0])
    return ends


class _Joint:
    """A joint during its reading."""

    def __init__(self, graph: Graph, frames: Frames, full: str, version: tuple[int, ...]) -> None:
        self.graph, self.frames, self.version = graph, frames, version
        self.framed, self.name = frames.joints[full], frames.short_name(full)
        self.element = self.framed.element
        self.place = frames.place(self.element, full)
        self.kind = self.element.choice("type", TYPES, "")

    def read(self, links: tuple[str, str]) -> Joint:
        """Return the joint between two links; add mimics, couplings and springs."""
        joint = Joint.of(self.name, links, self.place.at, self._freedoms(), self.element)
        moves = [replace(each, limit=self._limit(each)) for each in joint.moves]
        mimics: list[Coupling] = []
        for tag, move in zip(("axis", "axis2"), moves, strict=False):
            for axis in self.element.findall(tag):
                self._add_spring(move, axis)
                if (element := axis.child("mimic")) is not None:
                    mimics.append(self._mimic(move, element))
        if (element := self.element.child(MIMIC)) is not None:
            mimics.append(self._drake_mimic(moves, element))
        self.graph.couplings += mimics
        self._leave_rest()
        return replace(joint, moves=moves)

    def _leave_rest(self) -> None:
        """List parts without use for a joint of its type, such as the axis of a ball."""
        axes = [*self.element.findall("axis", "axis2")]
        limits = [limit for axis in axes for limit in axis.findall("limit")]
        for around in (self.element, *axes, *limits):
            for child in around.children:
                if TAKEN not in child.marks:
                    self.graph.tree.leave(child, f"{child.tag} of {around.tag}")

    def _limit(self, move: Move) -> Limit:
        axis = self.element.child("axis2" if move.name.endswith(".2") else "axis")
        found = axis and axis.child("limit")
        if not found:
            return NO_LIMIT
        limit = limit_of(found, {each.tag: each.text for each in found.findall(*IN_LIMIT[:4])})
        sizes = (each if each >= 0.0 else math.inf for each in (limit.effort, limit.velocity))
        return Limit(limit.lower, limit.upper, *sizes)

    def gearbox(self, links: tuple[str, str], joints: Sequence[Joint]) -> Coupling:
        """Return the coupling of the turns of two links about a third.

        The child turns by minus the ratio times the turn of the parent, each about its own axis
        (SDF 1.4 and later).
        """
        element, named = self.element, text_of(self.element, "gearbox_reference_body")
        reference = self.frames.link(element, full_name_of(self.framed.scope, named))
        around = self.frames.short_name(reference) if reference else WORLD
        ratio = element.child_number("gearbox_ratio", 1.0)
        second = "axis2" if element.child("axis2") is not None else "axis"
        weights: dict[str, float] = {}
        for tag, link, weight in (("axis", links[0], ratio), (second, links[1], 1.0)):
            for joint in joints:
                ends = [around if end in self.graph.fixed else end for end in joint.links]
                if {*ends} == {around, link} and [move.kind for move in joint.moves] == ["hinge"]:
                    (move,) = joint.moves
                    along = move.axis @ self._axis(tag)
                    if abs(along) > ALONG:
                        sense = along if ends[1] == link else -along
                        weights[move.name] = weight * math.copysign(1.0, sense)
                        break
            else:
                raise element.fault(
                    f"<{tag}>: there is no hinge between {link!r} and {named!r} along it, expected"
                    " one, whose turn the gearbox couples; correct the axis, or write <mimic>"
                )
        self._leave_rest()
        return Coupling(self.name, weights, {}, (0.0,), element)

    def _freedoms(self) -> list[Freedom]:
        element = self.element
        match self.kind:
            case "revolute2":
                kinds = JOINT_MOVES["universal"]
            case "screw":
                if (pitch := element.child("screw_thread_pitch")) is None:
                    raise element.fault(
                        "<screw_thread_pitch>: missing, expected metres in a turn, as of SDF 1.10;"
                        " give it in place of <thread_pitch>, whose sign and unit differ between"
                        " simulators"
                    )
                (lead,) = pitch.text_numbers(1)
                return screw(self.graph, self.name, lead, self._axis("axis"), element)
            case kind:
                kinds = JOINT_MOVES[kind]
        return [
            (f".{k}" * (len(kinds) > 1), each, X if each == "ball" else self._axis(tag))
            for k, (each, tag) in enumerate(zip(kinds, ("axis", "axis2"), strict=False), 1)
        ]

    def _axis(self, tag: str) -> Vec3:
        """Return an axis, global; z of the joint unless given."""
        if (axis := self.element.child(tag)) is None:
            raise self.element.fault(f"<{tag}>: missing, expected an axis; add it")
        axis.require_known((), "SDF")
        axis.require_children(IN_AXIS, closed=True)
        for limit in axis.findall("limit"):
            limit.require_known((), "SDF")
            limit.require_children(IN_LIMIT, closed=True)
        numbers: Sequence[float] = (0.0, 0.0, 1.0)
        given, place = "", self.place
        if (xyz := axis.child("xyz")) is not None:
            xyz.require_known(("expressed_in",), "SDF")
            numbers = xyz.text_numbers(3, default=numbers)
            given = xyz.attributes.get("expressed_in", "")
        of_model = flag_of(axis.child("use_parent_model_frame"))
        if of_model or self.version < _AXES_IN_JOINT:
            given = given or MODEL
        if given:
            place = self.frames.place(axis, full_name_of(self.framed.scope, given))
        return place.direction((xyz or axis).direction(numbers))

    def _add_spring(self, move: Move, axis: Element) -> None:
        for dynamics in axis.findall("dynamics"):
            if self.kind == "screw":  # of the turn or of the shift
                self.graph.tree.leave(dynamics, "dynamics of screw joints")
                return
            dynamics.require_known((), "SDF")
            dynamics.require_children((*LAW, *FRICTION), closed=True)
            said = {each.tag: each.text for each in dynamics.findall(*LAW, *FRICTION)}
            add_spring(self.graph, move.name, said)

    def _mimic(self, move: Move, element: Element) -> Coupling:
        """Return the mimic of an axis."""
        element.require_known(("joint", "axis"), "SDF")
        element.require_children(("multiplier", "offset", "reference"), closed=True)
        leader = element.attributes.get("joint", "")
        full = full_name_of(self.framed.scope, leader)
        if full not in self.frames.joints:
            raise element.fault(f"joint: found {shown(leader)}, expected a joint; correct the name")
        name, other = (
            self.frames.short_name(full),
            element.choice("axis", ("axis", "axis2"), "axis"),
        )
        if self.frames.joints[full].element.attributes.get("type") in TWO_AXES:
            name = f"{name}.{1 + (other == 'axis2')}"
        factor, offset, reference = (
            element.child_number(tag, default)
            for tag, default in (("multiplier", 1.0), ("offset", 0.0), ("reference", 0.0))
        )
        return mimic(move.name, name, (offset - factor * reference, factor), element)

    def _drake_mimic(self, moves: Sequence[Move], element: Element) -> Coupling:
        """Return the mimic of a joint in Drake's form."""
        element.require_known(("joint", "multiplier", "offset"), "SDF")
        name = element.attributes.get("joint", "")
        leader = full_name_of(self.framed.scope, name)
        if leader not in self.frames.joints:
            known = [*map(self.frames.short_name, self.frames.joints)]
            raise element.unknown_name("joint", name, known, "a joint")
        if len(moves) != 1 or moves[0].kind == "ball":
            raise element.fault(
                f"{self.name!r} has not one coordinate, expected a revolute or prismatic joint;"
                " correct it"
            )
        factor, offset = element.number("multiplier", 1.0), element.number("offset", 0.0)
        return mimic(self.name, self.frames.short_name(leader), (offset, factor), element)
