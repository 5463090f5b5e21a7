"""Elements that Drake reads beyond SDF and URDF: ball constraints, mimics, spring-dampers.

`kincheck export --to sdf` closes its loops by them. Three ball constraints of two links hold them
together as a whole. In SDF their values are texts, and in URDF attributes.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import TypeAlias

from ....algebra import Vec3, X, cross, vec
from ....errors import CaseError
from ..mjcf.elements import Element, unlike
from ..mjcf.frames import Place, of_axes
from .dynamics import STRUT_LAW, strut_spring
from .robot import Connection, Loop, Mimic, Move, Robot, Strut
from .sdf_frames import Frames, Short
from .values import only_child, require_children, value_of

BALL, MIMIC, STRUT = "drake:ball_constraint", "drake:mimic", "drake:linear_spring_damper"
# Of the distance of two points, what lies on the line through both.
ON_LINE = 1e-6

LinkOf: TypeAlias = Callable[[Element, str], str]
"""Name of the link that an element names."""


def add_ties(robot: Robot, elements: Iterable[tuple[Element, LinkOf]]) -> None:
    """Add ball constraints and spring-dampers.

    Raises:
        CaseError: a link is unknown, or a point is not three numbers.
    """
    found: dict[tuple[str, str], list[tuple[Element, Vec3, Vec3]]] = {}
    for element, link_of in elements:
        if element.tag == BALL:
            links, points = _ends(element, link_of)
            found.setdefault(links, []).append((element, *points))
        elif element.tag == STRUT:
            _add_strut(robot, element, link_of)
    taken, again = set[str](), Counter[str]()

    def name_of(element: Element, links: Sequence[str]) -> str:
        name = _name(element, links)
        if "name" not in element.attributes:  # several may hold two links together
            name = unlike(name, taken, again=again)
        taken.add(name)
        return name

    for links, ties in found.items():
        if links[0] == links[1]:
            raise ties[0][0].fault(
                f"ties {links[0]!r} to itself, expected two links; correct one of the bodies"
            )
        here, there = (robot.links[link] for link in links)
        frame = _frame([each for _, each, _ in ties]), _frame([each for _, _, each in ties])
        if frame[0] is not None and frame[1] is not None:
            whole = Connection(name_of(ties[0][0], links), links, (), ties[0][0])
            robot.loops.append(Loop(whole, (here.then(frame[0]), there.then(frame[1]))))
            continue
        for element, first, second in ties:
            at = here.then(Place(first)), there.then(Place(second))
            ball = Move("ball", name_of(element, links), at[0].at, X)
            robot.loops.append(Loop(Connection(ball.name, links, (ball,), element), at))


def _add_strut(robot: Robot, element: Element, link_of: LinkOf) -> None:
    """Add a spring-damper of two points; one that makes no sense is counted."""
    try:
        links, points = _ends(element, link_of)
        spring = strut_spring(element)
    except CaseError:
        robot.count(STRUT)
        return
    here, there = (
        robot.links[link].point(point) for link, point in zip(links, points, strict=True)
    )
    robot.struts.append(Strut(_name(element, links), links, (here, there), element, spring))


def mimic_of(frames: Frames, short: Short, full: str, joint: Connection) -> Mimic | None:
    """Return the mimic of a joint in Drake's form; None without one.

    Raises:
        CaseError: another joint is unknown, or one of both has not one coordinate.
    """
    framed = frames.joints[full]
    element = only_child(framed.element, MIMIC)
    if element is None:
        return None
    element.require_known(("joint", "multiplier", "offset"), "SDF")
    leader = frames.within(element, framed.scope, element.attributes.get("joint", ""))
    if leader not in frames.joints:
        name = element.attributes.get("joint", "")
        known = [short(each) for each in frames.joints]
        raise element.unknown_name("joint", name, known, "a joint")
    if len(joint.moves) != 1 or joint.moves[0].kind == "ball":
        raise element.fault(
            f"{joint.name!r} has not one coordinate, expected a revolute or prismatic joint;"
            " correct it"
        )
    (factor,) = element.numbers("multiplier", (1,), (1.0,))
    (offset,) = element.numbers("offset", (1,), (0.0,))
    return Mimic(f"{joint.name}.mimic", (joint.name, short(leader)), (offset, factor), element)


def _ends(element: Element, link_of: LinkOf) -> tuple[tuple[str, str], tuple[Vec3, Vec3]]:
    """Return the links of an element between two points, and the points in them."""
    tag = element.tag
    parts = [*(f"{tag}_body_{side}" for side in "AB"), f"{tag}_p_AP", f"{tag}_p_BQ"]
    require_children(element, (*parts, *(f"{tag}_{each}" for each in STRUT_LAW)), closed=True)
    links: list[str] = []
    for part in parts[:2]:
        child = only_child(element, part)
        name = child and (child.text or child.attributes.get("name", ""))
        if child is None or not name:
            raise element.fault(f"<{part}>: missing, expected a name; add it")
        links.append(link_of(child, name))
    return (links[0], links[1]), (_point(element, parts[2]), _point(element, parts[3]))


def _point(element: Element, tag: str) -> Vec3:
    return vec(value_of(element, tag, 3))


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
    return Place(points[0], of_axes(x, cross(z, x), z))


def _name(element: Element, links: Sequence[str]) -> str:
    return element.attributes.get("name", " = ".join(links))
