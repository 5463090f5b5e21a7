"""Elements of SDF that Drake reads beyond the format: ball constraints, mimics, spring-dampers.

`kincheck export --to sdf` closes its loops by them. Three ball constraints of two links hold them
together as a whole.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ....algebra import Vec3, X, cross, vec
from ....errors import CaseError
from ..mjcf.elements import Element
from ..mjcf.frames import Place, of_axes
from .dynamics import strut_spring
from .robot import Connection, Loop, Mimic, Move, Robot, Strut
from .sdf_frames import Frames, Short, text_of
from .values import numbers_of, only_child

PREFIX = "drake:"
BALL, MIMIC, STRUT = "drake:ball_constraint", "drake:mimic", "drake:linear_spring_damper"
# Of the distance of two points, what lies on the line through both.
ON_LINE = 1e-6


def add_ties(robot: Robot, frames: Frames, short: Short) -> None:
    """Add the ball constraints and spring-dampers of all models; other elements are counted.

    Raises:
        CaseError: a link is unknown, or a point is not three numbers.
    """
    found: dict[tuple[str, str], list[tuple[Element, Vec3, Vec3]]] = {}
    for full, framed in frames.models.items():
        for element in framed.element.children:
            if element.tag == BALL:
                links, points = _ends(frames, short, element, full)
                found.setdefault(links, []).append((element, *points))
            elif element.tag == STRUT:
                _add_strut(robot, frames, short, element, full)
            elif element.tag.startswith(PREFIX):
                robot.count(element.tag)
    for links, ties in found.items():
        if links[0] == links[1]:
            raise ties[0][0].fault(
                f"ties {links[0]!r} to itself, expected two links; correct one of the bodies"
            )
        here, there = (robot.links[link] for link in links)
        frame = _frame([each for _, each, _ in ties]), _frame([each for _, _, each in ties])
        if frame[0] is not None and frame[1] is not None:
            whole = Connection(_name(ties[0][0], links), links, (), ties[0][0])
            robot.loops.append(Loop(whole, (here.then(frame[0]), there.then(frame[1]))))
            continue
        for element, first, second in ties:
            at = here.then(Place(first)), there.then(Place(second))
            ball = Move("ball", _name(element, links), at[0].at, X)
            robot.loops.append(Loop(Connection(ball.name, links, (ball,), element), at))


def _add_strut(robot: Robot, frames: Frames, short: Short, element: Element, model: str) -> None:
    """Add a spring-damper of two points; one that makes no sense is counted."""
    try:
        links, points = _ends(frames, short, element, model)
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


def _ends(
    frames: Frames, short: Short, element: Element, model: str
) -> tuple[tuple[str, str], tuple[Vec3, Vec3]]:
    """Return the links of an element between two points, and the points in them."""
    tag = element.tag
    first, second = (_link(frames, short, element, model, f"{tag}_body_{side}") for side in "AB")
    return (first, second), (_point(element, f"{tag}_p_AP"), _point(element, f"{tag}_p_BQ"))


def _link(frames: Frames, short: Short, element: Element, model: str, tag: str) -> str:
    link = frames.link(element, frames.within(element, model, text_of(element, tag)))
    if not link:
        raise element.fault(f"<{tag}>: is the world, expected a link; fix a link to the world")
    return short(link)


def _point(element: Element, tag: str) -> Vec3:
    child = only_child(element, tag)
    return vec((0.0, 0.0, 0.0) if child is None else numbers_of(child, (3,), (0.0, 0.0, 0.0)))


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
