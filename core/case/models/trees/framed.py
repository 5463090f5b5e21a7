"""Joints between a frame of each of two links, as USD and OpenSim have them, hung up as a graph.

The frames decide where links are: along a tree of joints each link is placed by its joint. The
other joints close loops, between frames that may have a gap.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from ....algebra import IDENTITY, ZERO, Quat, Vec3
from .element import Element
from .graph import Graph, Joint, Loop
from .limits import NO_LIMIT, Limit
from .place import ORIGIN, Place, turn_about, unit_quaternion
from .tree import Kind, Move


@dataclass(frozen=True)
class Freedom:
    """A move of a joint.

    Attributes:
        axis: in the first frame, turned by the moves before.
        value: its coordinate in the pose of the file [m or rad]; None for the nearest to the places
            of the links.
        stands: it keeps its value, and is no move.
        turn: of a ball, in the pose of the file; None for the nearest.
        key: of its drive and state in USD, as names of schemas end.
    """

    name: str
    kind: Kind
    axis: Vec3
    element: Element
    value: float | None = None
    stands: bool = False
    turn: Quat | None = None
    limit: Limit = NO_LIMIT
    key: str = ""


@dataclass(frozen=True)
class FramedJoint:
    """A joint; slides come before turns.

    Attributes:
        frames: in its links [m].
        closes: it closes a loop, whatever else holds its links.
    """

    name: str
    element: Element
    links: tuple[str, str]
    frames: tuple[Place, Place]
    freedoms: Sequence[Freedom]
    closes: bool = False

    def motion(self, relative: Place) -> tuple[Place, list[tuple[Freedom, Vec3, float]]]:
        """Return the motion of the second frame in the first one by the moves of the joint, and the
        axis in the first frame and the coordinate of each move [m or rad].

        Args:
            relative: the second frame in the first one, by the places of the links.
        """
        at, turn, moved = ZERO, IDENTITY, list[tuple[Freedom, Vec3, float]]()
        for each in self.freedoms:
            axis, value = Place(turn=turn).direction(each.axis), 0.0
            if each.kind == "slide":
                value = axis @ relative.at if each.value is None else each.value
                at += value * axis
            elif each.kind == "hinge":
                nearest = _angle(each.axis, turn.conjugate() * relative.turn)
                value = nearest if each.value is None else each.value
                turn = turn * turn_about(each.axis, value)
            else:
                turn = relative.turn if each.turn is None else each.turn
            if not each.stands:
                moved.append((each, axis, value))
        return Place(at, unit_quaternion(turn)), moved

    def between(self, places: Mapping[str, Place]) -> tuple[Place, Place]:
        """Return its frames, global, by the places of links."""
        first, second = (
            places[link].then(frame) for link, frame in zip(self.links, self.frames, strict=True)
        )
        return first, second


def _angle(axis: Vec3, turn: Quat) -> float:
    """Return the angle about an axis nearest to a turn [rad]."""
    sign = math.copysign(1.0, turn.e0)
    return 2.0 * math.atan2(sign * (axis @ turn.e), sign * turn.e0)


def join(graph: Graph, joints: Collection[FramedJoint]) -> dict[str, list[Move]]:
    """Place the links of a graph along a tree of joints, and add all joints to it; return the moves
    by joint.
    """
    named = {each.name: each for each in joints}
    own = dict(graph.places)
    graph.joints = [
        Joint(each.name, each.links, (), each.element) for each in joints if not each.closes
    ]
    spanning, loops = graph.spanning_tree()
    for each in spanning:
        joint = named[each.name]
        (a, b), (f, g) = joint.links, joint.frames
        first, second = joint.between(own)
        motion, _ = joint.motion(second.seen_from(first))
        if each.links == joint.links:
            placed = graph.places[a].then(f).then(motion)
            graph.places[b] = placed.then(ORIGIN.seen_from(g))
        else:
            placed = graph.places[b].then(g).then(ORIGIN.seen_from(motion))
            graph.places[a] = placed.then(ORIGIN.seen_from(f))
    moves: dict[str, list[Move]] = {}
    closing = [each.joint.name for each in loops]
    closing += [each.name for each in joints if each.closes]
    graph.joints = [_joined(graph, named[each.name], moves)[0] for each in spanning]
    graph.loops += [Loop(*_joined(graph, named[name], moves)) for name in closing]
    return moves


def _joined(
    graph: Graph, joint: FramedJoint, moves: dict[str, list[Move]]
) -> tuple[Joint, tuple[Place, Place]]:
    """Return a joint of the graph, and its frames: the first one behind its moves."""
    first, second = joint.between(graph.places)
    motion, moved = joint.motion(second.seen_from(first))
    behind = first.then(motion)
    moves[joint.name] = [
        Move(
            *(each.name, each.kind, behind.at, first.direction(axis), each.element, value),
            limit=each.limit,
        )
        for each, axis, value in moved
    ]
    return Joint(joint.name, joint.links, moves[joint.name], joint.element), (behind, second)
