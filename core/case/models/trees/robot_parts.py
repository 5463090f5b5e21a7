"""What URDF and SDF have alike: masses, springs, and Drake's elements beyond either.

Motion needs neither masses nor springs: what makes no sense of them is counted and left out. Three
ball constraints of two links hold them together as a whole; `kincheck export --to sdf` closes its
loops by them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeAlias

import numpy as np

from ....algebra import ZERO, Vec3, X, cross, vec
from ....errors import CaseError
from ...io.document import decimal, usable
from .element import Element, Names
from .graph import Graph, Joint, Loop
from .place import Place, turn_of_axes, unit_vector
from .tree import Coupling, Mass, Move, Spring, Strut

BALL, MIMIC, STRUT = "drake:ball_constraint", "drake:mimic", "drake:linear_spring_damper"
# Of the distance of two points, what lies on the line through both.
ON_LINE = 1e-6
ENTRIES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
"""Names of the moments and products of inertia in either format."""
FRICTION = ("friction", "drake:rotor_inertia", "drake:gear_ratio")
"""Forces of joints without a place in a mechanism."""
LAW = ("damping", "spring_stiffness", "spring_reference")
"""Those that have one."""
STRUT_LAW = ("stiffness", "damping", "free_length")
"""What Drake's element between two points has of its own."""

LinkOf: TypeAlias = Callable[[Element, str], str]
"""Name of the link that an element names."""


def direction(element: Element, numbers: Sequence[float]) -> Vec3:
    """Return a unit vector along three numbers.

    Raises:
        CaseError: they are zero.
    """
    if math.hypot(*numbers) < 1e-10:  # as in MJCF: shorter axes point anywhere
        raise element.fault("xyz: found zero, expected the direction of an axis; correct it")
    return unit_vector(numbers)


def mass_in(place: Place, mass: float, entries: Sequence[float]) -> Mass | None:
    """Return the mass of a link in its frame; None of a negative one.

    Args:
        place: centre of mass and axes of the inertia, in the frame of the link.
        entries: the inertia, by `ENTRIES` [kg m^2].
    """
    xx, yy, zz, xy, xz, yz = entries
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return Mass(mass, ZERO, inertia).seen_in(place) if mass >= 0.0 else None


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
        law = number("spring_stiffness"), number("damping")
        if min(law) < 0.0:
            raise ValueError(move)
        if any(law):
            graph.tree.springs[move] = Spring(*law, number("spring_reference"))
    except ValueError:
        graph.tree.count("dynamics of joints")


def screw(graph: Graph, name: str, lead: float, place: Place, axis: Vec3, element: Element):
    """Return the moves of a screw, and couple them.

    Args:
        lead: advance in a turn [m].
    """
    shift, turn = f"{name}.translation", f"{name}.rotation"
    weights = {shift: 1.0, turn: -lead / (2.0 * math.pi)}
    graph.couplings.append(Coupling(f"{name}.thread", weights, {}, (0.0,), element))
    return (
        Move(shift, "slide", place.at, axis, element),
        Move(turn, "hinge", place.at, axis, element),
    )


def mimic(move: str, leader: str, offset: float, factor: float, element: Element) -> Coupling:
    """Return a move that follows another one."""
    return Coupling(f"{move}.mimic", {move: 1.0}, {leader: 1.0}, (offset, factor), element)


def add_ties(graph: Graph, elements: Iterable[tuple[Element, LinkOf]]) -> None:
    """Add Drake's ball constraints and spring-dampers.

    Raises:
        CaseError: a link is unknown, or a point is not three numbers.
    """
    found: dict[tuple[str, str], list[tuple[Element, Vec3, Vec3]]] = {}
    for element, link_of in elements:
        if element.tag == BALL:
            links, points = _ends(element, link_of)
            found.setdefault(links, []).append((element, *points))
        elif element.tag == STRUT:
            try:
                graph.struts.append(_strut(graph, element, link_of))
            except CaseError:
                graph.tree.count(STRUT)
    names = Names()

    def add(element: Element, links: tuple[str, str], ends: Sequence[Place], kind: str) -> None:
        name = _name(element, links)
        if "name" in element.attributes:
            names.add(name)
        else:  # several may hold two links together
            name = names.new(name)
        first, second = (
            graph.places[link].then(end) for link, end in zip(links, ends, strict=True)
        )
        moves = [Move(name, "ball", first.at, X, element)] if kind == "point" else []
        graph.loops.append(Loop(Joint(name, links, moves, element), (first, second)))

    for links, ties in found.items():
        if links[0] == links[1]:
            raise ties[0][0].fault(
                f"ties {links[0]!r} to itself, expected two links; correct one of the bodies"
            )
        frames = [_frame(points) for points in zip(*(points for _, *points in ties), strict=True)]
        first, second = frames
        if first is not None and second is not None:
            add(ties[0][0], links, (first, second), "frame")
            continue
        for element, *points in ties:
            add(element, links, [*map(Place, points)], "point")


def _strut(graph: Graph, element: Element, link_of: LinkOf) -> Strut:
    links, points = _ends(element, link_of)
    p, q = (graph.places[link].point(point) for link, point in zip(links, points, strict=True))
    stiffness, damping, length = (
        element.value(f"{element.tag}_{each}", 1)[0] for each in STRUT_LAW
    )
    if min(stiffness, damping, length) < 0.0:
        raise element.fault("has a negative number, expected positive ones; correct it")
    spring = Spring(stiffness, damping, length)
    return Strut(_name(element, links), links, (p, q), spring, element, STRUT)


def _ends(element: Element, link_of: LinkOf) -> tuple[tuple[str, str], tuple[Vec3, Vec3]]:
    """Return the links of an element between two points, and the points in them."""
    tag = element.tag
    parts = [*(f"{tag}_body_{side}" for side in "AB"), f"{tag}_p_AP", f"{tag}_p_BQ"]
    element.require_children((*parts, *(f"{tag}_{each}" for each in STRUT_LAW)), closed=True)
    links: list[str] = []
    for part in parts[:2]:
        child = element.child(part)
        name = child and (child.text or child.attributes.get("name", ""))
        if child is None or not name:
            raise element.fault(f"<{part}>: missing, expected a name; add it")
        links.append(link_of(child, name))
    p, q = (vec(element.value(part, 3)) for part in parts[2:])
    return (links[0], links[1]), (p, q)


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
