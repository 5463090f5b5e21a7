"""Elements that URDF and SDF have alike: masses, springs, Drake's own, and unread ones.

Motion needs neither masses nor springs: what makes no sense of them is counted and left out. Three
ball constraints of two links hold them together as a whole; `kincheck export --to sdf` closes its
loops by them.

Programs add elements of their own to robots. Those that may join links are refused, because
without them the mechanism is another one; it is not their names that tell what they do, but the
links and joints that they name.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from ...algebra import Vec3, X, cross
from ...case.io.document import decimal, shown, usable
from ...errors import CaseError
from ..xml.element import Element, Names, words
from .graph import Freedom, Graph, Joint, global_frames
from .place import Place, coordinates, turn_of_axes
from .tree import BushingLaw, Coupling, Kind, Spring, Strut

BALL, MIMIC, STRUT = "drake:ball_constraint", "drake:mimic", "drake:linear_spring_damper"
BUSHING, DRAKE_JOINT = "drake:linear_bushing_rpy", "drake:joint"
# Of the distance of two points, what lies on the line through both.
ON_LINE = 1e-6
ENTRIES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
"""Names of the moments and products of inertia in either format."""
FRICTION = ("friction", "drake:rotor_inertia", "drake:gear_ratio")
"""Forces of joints without a place in a mechanism."""
LAW = ("damping", "spring_stiffness", "spring_reference")
"""Those that have one."""
STRUT_LAW = ("stiffness", "damping", "free_length")
"""Own keys of Drake's element between two points."""
BUSHING_LAW = ("force_stiffness", "torque_stiffness", "force_damping", "torque_damping")
"""Own keys of Drake's bushing."""
HALFWAY = (
    "its axes are those of its first frame, and its torque that of Euler parameters; in Drake the"
    " axes are halfway between both frames, and the torque is that of roll, pitch and yaw; both are"
    " equal for small turns"
)

JOINT_MOVES: Mapping[str, Sequence[Kind]] = {
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
"""Moves of joints by their types; `link` joins the halves of a link."""

# What is seen, touched or measured joins nothing.
_APART = words(
    "visual collision material sensor light camera projector audio particle contact geometry state "
    "physics"
)
# Plugins that publish where links are.
_PUBLISHERS = words("p3d imu camera laser gps publisher odometry ft_sensor")
# Elements whose attribute `name` is their own.
_NAMED = words("plugin param controller hardware system joint link frame")
_CLOSING = words("loop equality constraint closure")
_COUPLING = words("mimic gear coupl")
_OF_LINK = words("link body parent child frame member")
_SEPARATOR = re.compile(r"[\s,;|]+")
_PATH = re.compile(r"::|^/")

LinkOf: TypeAlias = Callable[[Element, str], str]
"""Name of the link that an element names."""
FrameOf: TypeAlias = Callable[[Element, str], tuple[str, Place]]
"""Link of the frame that an element names, and the frame's global place."""


def add_spring(graph: Graph, move: str, values: Mapping[str, str]) -> None:
    """Add the spring and damper of a move, from the texts of <dynamics>."""

    def number(name: str) -> float:
        value = decimal(values.get(name) or "0")
        if not usable(value):
            raise ValueError(name)
        return value

    try:
        if any(map(number, FRICTION)):
            graph.tree.count("friction and rotors of joints")
        law, rest = (number("spring_stiffness"), number("damping")), number("spring_reference")
        if min(law) < 0.0:
            raise ValueError(move)
        if any(law):
            graph.tree.springs[move] = Spring(*law, rest)
    except ValueError:
        graph.tree.count("dynamics of joints")


def screw(graph: Graph, name: str, lead: float, axis: Vec3, element: Element) -> list[Freedom]:
    """Return the freedoms of a screw, and couple them.

    Args:
        lead: advance in a turn [m].
    """
    shift, turn = ".translation", ".rotation"
    weights = {f"{name}{shift}": 1.0, f"{name}{turn}": -lead / (2.0 * math.pi)}
    graph.couplings.append(Coupling(f"{name}.thread", weights, {}, (0.0,), element))
    return [(shift, "slide", axis), (turn, "hinge", axis)]


def planar(x: Vec3, y: Vec3, normal: Vec3) -> list[Freedom]:
    """Return the freedoms of a joint in a plane."""
    return [(".slide1", "slide", x), (".slide2", "slide", y), (".rotation", "hinge", normal)]


def mimic(move: str, leader: str, powers: Sequence[float], element: Element) -> Coupling:
    """Return a move that follows a polynomial of another one, from the constant on."""
    return Coupling(f"{move}.mimic", {move: 1.0}, {leader: 1.0}, powers, element)


def add_ties(graph: Graph, elements: Iterable[tuple[Element, LinkOf, FrameOf]]) -> None:
    """Add Drake's ball constraints, spring-dampers and bushings.

    Raises:
        CaseError: a link or frame is unknown, or a point or stiffness is not three numbers.
    """
    found: dict[tuple[str, str], list[tuple[Element, Vec3, Vec3]]] = {}
    for element, link_of, frame_of in elements:
        if element.tag in (BALL, STRUT, BUSHING):
            element.take("name")  # several ties of a frame have one name
        if element.tag == BALL:
            links, points = _ends(element, link_of)
            found.setdefault(links, []).append((element, *points))
        elif element.tag == STRUT:
            try:
                graph.struts.append(_strut(graph, element, link_of))
            except CaseError:
                graph.tree.leave(element, STRUT)
        elif element.tag == BUSHING:
            graph.struts.append(_bushing_strut(element, frame_of))
            graph.tree.notes.append(f"{element}: {HALFWAY}")
    names = Names()

    def add(
        element: Element,
        links: tuple[str, str],
        ends: Sequence[Place],
        freedoms: Sequence[Freedom] = (),
    ) -> None:
        name = _name(element, links)
        if "name" in element.attributes:
            names.add(name)
        else:  # several may hold two links together
            name = names.new(name)
        frames = global_frames(graph.places, links, ends)
        graph.loops.append(Joint.of(name, links, frames[0].at, freedoms, element, frames=frames))

    for links, ties in found.items():
        ties[0][0].require_two(*links)
        first, second = map(_frame, zip(*(points for _, *points in ties), strict=True))
        if first is not None and second is not None:
            add(ties[0][0], links, (first, second))
            continue
        for element, *points in ties:
            add(element, links, [*map(Place, points)], [("", "ball", X)])


def _strut(graph: Graph, element: Element, link_of: LinkOf) -> Strut:
    links, points = _ends(element, link_of)
    ends = global_frames(graph.places, links, map(Place, points))
    stiffness, damping, length = (
        element.child_number(f"{element.tag}_{each}", 0.0) for each in STRUT_LAW
    )
    if min(stiffness, damping, length) < 0.0:
        raise element.fault("has a negative number, expected positive ones; correct it")
    spring = Spring(stiffness, damping, length)
    return Strut(_name(element, links), links, ends, spring, element, STRUT)


def _bushing_strut(element: Element, frame_of: FrameOf) -> Strut:
    frames = [f"drake:bushing_frame{side}" for side in "AC"]
    laws = [f"drake:bushing_{each}" for each in BUSHING_LAW]
    element.require_children((*frames, *laws), closed=True)
    (first, place), (second, other) = (
        frame_of(child, name) for child, name in (_named_child(element, part) for part in frames)
    )
    for part in laws:
        if element.child(part) is None:
            raise element.fault(f"<{part}>: missing, expected three numbers; add it")
    forces, torques, damping, turning = values = [
        coordinates(element.child_vector(part)) for part in laws
    ]
    if min(map(min, values)) < 0.0:
        raise element.fault("has a negative number, expected positive ones; correct it")
    element.require_two(first, second)
    links = first, second
    law = BushingLaw(forces, torques, damping, turning)
    return Strut(_name(element, links), links, (place, other), law, element, BUSHING)


def _named_child(element: Element, part: str) -> tuple[Element, str]:
    """Return a child and the name in it.

    Raises:
        CaseError: it is missing, or has no name.
    """
    child = element.child(part)
    name = child and (child.text or child.attributes.get("name", ""))
    if child is None or not name:
        raise element.fault(f"<{part}>: missing, expected a name; add it")
    return child, name


def _ends(element: Element, link_of: LinkOf) -> tuple[tuple[str, str], tuple[Vec3, Vec3]]:
    """Return the links of an element between two points, and the points in them."""
    tag = element.tag
    parts = [*(f"{tag}_body_{side}" for side in "AB"), f"{tag}_p_AP", f"{tag}_p_BQ"]
    element.require_children((*parts, *(f"{tag}_{each}" for each in STRUT_LAW)), closed=True)
    first, second = (link_of(*_named_child(element, part)) for part in parts[:2])
    p, q = (element.child_vector(part) for part in parts[2:])
    return (first, second), (p, q)


def _name(element: Element, links: Sequence[str]) -> str:
    return element.attributes.get("name", " = ".join(links))


def _frame(points: Sequence[Vec3]) -> Place | None:
    """Return the frame of three points, the first one its origin; None of fewer or on a line."""
    if len(points) < 3:
        return None
    first, second = (point - points[0] for point in points[1:3])
    size = math.sqrt(first @ first)
    normal = cross(first, second)
    area = math.sqrt(normal @ normal)
    if not area > ON_LINE * max(size, math.sqrt(second @ second)) ** 2 > 0.0:
        return None
    x, z = (1.0 / size) * first, (1.0 / area) * normal
    return Place(points[0], turn_of_axes(x, cross(z, x), z))


@dataclass(frozen=True)
class Unread:
    """What the elements of a file that are not read may name.

    Attributes:
        links: links by their names, and by those of frames on them.
        joints: joints by name.
        followers: joints with the one they follow.
        advice: the remedy for a joint of an unknown type.
    """

    links: Mapping[str, str]
    joints: Mapping[str, str]
    followers: Sequence[tuple[str, str]]
    advice: str

    def require_all_apart(
        self, elements: Iterable[Element], read: Sequence[str], around: str = ""
    ) -> None:
        """Refuse elements beside those that are read, if they may join links."""
        for element in elements:
            if element.tag not in read:
                self.require_apart(element, around)

    def require_apart(self, element: Element, around: str = "") -> None:
        """Refuse an element that names two links, or couples joints.

        Args:
            around: the link or joint named by the element around it.

        Raises:
            CaseError: it does.
        """
        found = dict.fromkeys([*filter(None, [self.links.get(around)]), *self._links(element)])
        if len(found) > 1:
            first, second, *more = found
            others = f" and {len(more)} more" if more else ""
            raise element.fault(
                f"names the links {shown(first)} and {shown(second)}{others}, which it may join,"
                f" and is not read, expected {self.advice}; write what joins them so, or leave it"
                f" out by --without {element.tag}"
            )
        if any(word in _local_tag(element.tag) for word in _CLOSING) and not _joins_nothing(
            element
        ):
            raise element.fault(
                f"may close a loop, and is not read, expected {self.advice}; write it so, or leave"
                f" it out by --without {element.tag}"
            )
        self._require_uncoupled(element)

    def _require_uncoupled(self, element: Element) -> set[str]:
        """Return the joints that an element and those in it name, if it couples none."""
        joints = {*self._joints(element)}
        for child in element.children:
            joints |= self._require_uncoupled(child)
        if len(joints) < 2 or any(joints <= {*pair} for pair in self.followers):
            return joints
        why = ""
        if any(map(_says_coupled, (element, *element.children))):
            why = "couples the joints"
        elif _local_tag(element.tag) == "transmission":
            free = joints - {follower for follower, _ in self.followers}
            motors = sum("actuator" in _local_tag(each.tag) for each in element.children)
            why = "with fewer actuators than joints may couple" if len(free) > motors > 0 else ""
        if why:
            raise element.fault(
                f"{why} {' and '.join(map(shown, sorted(joints)))}, and is not read, expected"
                f" <mimic> in one of them; write it so, or leave it out by --without {element.tag}"
            )
        return joints

    def _links(self, element: Element) -> Iterator[str]:
        """Yield the links that an element and those in it name."""
        if _joins_nothing(element):
            return
        for hint, word in _words(element):
            link = self.links.get(word)
            if link is None or (word in self.joints and "joint" in hint):
                continue
            if _is_number(word) and not any(each in hint for each in _OF_LINK):
                continue
            yield link
        for child in element.children:
            yield from self._links(child)

    def _joints(self, element: Element) -> Iterator[str]:
        own = element.attributes.get("name", "")
        if "joint" in _local_tag(element.tag) and own in self.joints:
            yield self.joints[own]
        for hint, word in _words(element):
            if word in self.joints and (
                word not in self.links or "joint" in hint or "mimic" in hint
            ):
                yield self.joints[word]


def _local_tag(tag: str) -> str:
    """Return a tag in small letters, without its prefix."""
    return tag.rpartition(":")[2].lower()


def _joins_nothing(element: Element) -> bool:
    tag = _local_tag(element.tag)
    if tag == "plugin":
        said = " ".join(element.attributes.values()).lower()
        return any(word in said for word in _PUBLISHERS)
    parts = tag.split("_")
    return any(
        word in (*_APART, *(f"{each}s" for each in _APART)) for word in (parts[0], parts[-1])
    )


def _says_coupled(element: Element) -> bool:
    tag = _local_tag(element.tag)
    said = [tag, *element.attributes]
    if tag in ("plugin", "param"):
        said += element.attributes.values()
    return any(word in text.lower() for text in said for word in _COUPLING)


def _words(element: Element) -> Iterator[tuple[str, str]]:
    """Yield the words of an element's attributes and text, each with what it is called."""
    tag, own = _local_tag(element.tag), element.attributes.get("name", "")
    for key, value in element.attributes.items():
        if key != "name":
            yield from ((_local_tag(key), word) for word in _split(value))
        elif tag not in _NAMED:
            yield from ((tag, word) for word in _split(value))
    hint = f"{tag} {own}".lower() if tag == "param" else tag
    yield from ((hint, word) for word in _split("".join(element.texts)))


def _split(text: str) -> Iterator[str]:
    """Yield a text, the words in it, and the last parts of those that are paths of names."""
    found = dict.fromkeys((text.strip(), *_SEPARATOR.split(text)))
    yield from found
    yield from (_PATH.split(word)[-1] for word in found if _PATH.search(word))


def _is_number(word: str) -> bool:
    try:
        return math.isfinite(decimal(word))
    except ValueError:
        return False
