"""A graph of links and joints, as URDF, SDF and decks describe a mechanism, hung up as a tree.

Each link hangs on one joint, and the other joints close loops. A joint of a loop moves a massless
copy on its first link, held to its second link: it can be driven, held and compared like a joint of
the tree.

Joints of USD and OpenSim are between a frame of each of two links. The frames decide where links
are: along a tree of joints each link is placed by its joint. The other joints close loops, between
frames that may have a gap.
"""

from __future__ import annotations

import math
import re
from collections import deque
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from ...algebra import IDENTITY, ZERO, Quat, Vec3, X
from ...case.io.document import SMALLEST
from ...errors import WARNING
from ...mechanism.mechanism import GROUND
from ..xml.element import Element, significant_digits
from .place import ORIGIN, Place, turn_about, unit_quaternion
from .tree import COPY, NO_LIMIT, WORLD, Closure, Coupling, Kind, Limit, Mass, Move, Strut, Tree

CLOSING = re.compile(r"(.*\bclosing_.+)_([12])")
"""Names of the two ends of a loop."""
FIXED = (WORLD, GROUND)
"""Names of a fixed link at the origin, which is the world."""


Freedom: TypeAlias = tuple[str, Kind, Vec3]
"""A move: the end of its name, which begins with its joint's, its kind and its axis."""


@dataclass(frozen=True)
class Joint:
    """A joint: the second link moves on the first by a chain of moves; without any it is fixed.

    Attributes:
        frames: of one that closes a loop, on the first link behind the moves, and on the second
            one; None without a gap in the zero pose.
        is_free: the second link is not held at all.
    """

    name: str
    links: tuple[str, str]
    moves: Sequence[Move]
    element: Element
    frames: tuple[Place, Place] | None = None
    is_free: bool = False

    @staticmethod
    def of(
        name: str,
        links: tuple[str, str],
        at: Vec3,
        freedoms: Sequence[Freedom],
        element: Element,
        limit: Limit = NO_LIMIT,
        frames: tuple[Place, Place] | None = None,
    ) -> Joint:
        """Return a joint whose moves go through one point."""
        moves = [
            Move(f"{name}{end}", kind, at, axis, element, limit=limit)
            for end, kind, axis in freedoms
        ]
        return Joint(name, links, moves, element, frames)

    @property
    def reverse(self) -> Joint:
        """The same joint with the links exchanged; its coordinates keep their values."""
        moves = [replace(move, axis=-move.axis) for move in reversed(self.moves)]
        return replace(self, links=(self.links[1], self.links[0]), moves=moves)


@dataclass(eq=False)
class Graph:
    """Links and joints of a file, global in its zero pose; a reader fills it.

    Attributes:
        tree: takes all but links, joints and ties; links, joints and ties when they are hung.
        places: of the links.
        elements: of the links, for messages.
        fixed: links of the world.
        masses: of links with one, in their frames; None if it cannot be read.
        frames: names of places on links, for outputs: link and place.
        rods: distances between points of links.
        struts: springs and dampers between points of links.
    """

    tree: Tree
    root: Element
    places: dict[str, Place] = field(default_factory=dict[str, Place])
    elements: dict[str, Element] = field(default_factory=dict[str, Element])
    fixed: set[str] = field(default_factory=set[str])
    masses: dict[str, Mass | None] = field(default_factory=dict[str, Mass | None])
    frames: dict[str, tuple[str, Place]] = field(default_factory=dict[str, tuple[str, Place]])
    joints: list[Joint] = field(default_factory=list[Joint])
    loops: list[Joint] = field(default_factory=list[Joint])
    rods: list[Closure] = field(default_factory=list[Closure])
    couplings: list[Coupling] = field(default_factory=list[Coupling])
    struts: list[Strut] = field(default_factory=list[Strut])

    @staticmethod
    def of(root: Element, described: str, *, closes: bool = True) -> Graph:
        """Return a graph without links; see `Tree`."""
        digits = significant_digits(root)
        return Graph(Tree(root.file, described, "its zero pose", closes, digits), root)

    @property
    def followers(self) -> list[tuple[str, str]]:
        """Moves that follow another one, and this one."""
        pairs = [(*each.driven, *each.driving) for each in self.couplings if each.driving]
        return [(follower, leader) for follower, leader in pairs]

    def add_world(self) -> str:
        """Return the name of the world as a link, and add it."""
        name = WORLD
        while self.elements.get(name, self.root) is not self.root:
            name += "'"
        self.places[name], self.elements[name] = ORIGIN, self.root
        self.fixed.add(name)
        return name

    def close_named_pairs(self) -> None:
        """Hold each two frames named closing_X_1 and closing_X_2 together at one point, as
        onshape-to-robot (github.com/Rhoban/onshape-to-robot) names the ends of a loop.
        """
        ends: dict[str, dict[str, str]] = {}
        for name in (*self.places, *self.frames):
            if found := CLOSING.fullmatch(name):
                ends.setdefault(found[1], {})[found[2]] = name
        bodies = self._rigid_bodies()
        closed = [{bodies[name] for name in loop.links} for loop in self.loops]
        for each in ends.values():
            if len(each) < 2:
                (alone,) = each.values()
                self.tree.notes.append(f"{WARNING}{alone} has no other end: that loop is open")
                continue
            names = each["1"], each["2"]
            frames = [self.frames.get(name) or (name, self.places[name]) for name in names]
            (a, first), (b, second) = frames
            if bodies[a] == bodies[b] or {bodies[a], bodies[b]} in closed:
                continue
            ball: list[Freedom] = [("", "ball", X)]
            element, at = self.elements[a], (Place(first.at), Place(second.at))
            title = " = ".join(names)
            self.loops.append(Joint.of(title, (a, b), first.at, ball, element, frames=at))
            self.tree.closes = False
            self.tree.notes.append(f"{names[0]} and {names[1]} are one point, as their names say")

    def _rigid_bodies(self) -> dict[str, str]:
        """Return by link the first of all links rigidly joined with it."""
        found = {name: WORLD if name in self.fixed else name for name in self.places}
        fixed = [joint.links for joint in self.joints if not joint.moves and not joint.is_free]
        for a, b in fixed:
            one, other = found[a], found[b]
            found = {name: one if body == other else body for name, body in found.items()}
        return found

    def hang(self) -> Tree:
        """Hang all links, and tie them; return the tree.

        Raises:
            CaseError: a name is taken, nothing moves, or there are too many links or ties.
        """
        self.tree.names.update(self.places, self.frames)
        _Hanging(self).hang()
        self.tree.require_moving(self.root)
        return self.tree

    def spanning_tree(self) -> tuple[list[Joint], list[Joint]]:
        """Return the joints of a spanning tree, outer ones first, and the loops.

        The tree begins at the fixed links, then at links without a joint above them, then
        anywhere. It takes the joints of a link in the order of the file. A joint from its second
        link to its first is reversed.
        """
        of_link: dict[str, list[Joint]] = {name: [] for name in self.places}
        for joint in self.joints:
            for name in joint.links:
                of_link[name].append(joint)
        spanning: list[Joint] = []
        used, reached = set[int](), set[str]()

        def grow(starts: Iterable[str]) -> None:
            waiting = deque(name for name in starts if name not in reached)
            reached.update(waiting)
            while waiting:
                link = waiting.popleft()
                for joint in of_link[link]:
                    forward = joint.links[0] == link
                    other = joint.links[forward]
                    if id(joint) not in used and other not in reached:
                        used.add(id(joint))
                        spanning.append(joint if forward else joint.reverse)
                        reached.add(other)
                        waiting.append(other)

        grow(name for name in self.places if name in self.fixed)
        seconds = {joint.links[1] for joint in self.joints}
        for name in (*(each for each in self.places if each not in seconds), *self.places):
            grow([name])
        loops = [joint for joint in self.joints if id(joint) not in used]
        return spanning, [*loops, *self.loops]


@dataclass(frozen=True)
class _Part:
    """A link that hangs on another one, or without moves a name of a place on a link."""

    name: str
    outer: str
    place: Place
    element: Element
    moves: Sequence[Move] | None = None


class _Hanging:
    """The tree of a graph during its making.

    Attributes:
        inside: parts that hang on each link, in order.
        closures: joints that close the loops, between links of the graph or copies.
    """

    def __init__(self, graph: Graph) -> None:
        self.graph, self.tree = graph, graph.tree
        self.inside: dict[str, list[_Part]] = {WORLD: []}
        self.closures: list[Closure] = []

    def hang(self) -> None:
        """Hang all links, and tie them."""
        graph, tree = self.graph, self.tree
        joints, loops = graph.spanning_tree()
        inner = {joint.links[1] for joint in joints}
        for name, place in graph.places.items():
            if name not in inner:
                element = graph.elements[name]
                free = Move(name, "free", place.at, X, element)
                moves = () if name in graph.fixed else (free,)
                self._add(_Part(name, WORLD, place, element, moves))
        for joint in joints:
            outer, name = joint.links
            place, moves = graph.places[name], joint.moves
            if joint.is_free:
                outer, moves = WORLD, [Move(joint.name, "free", place.at, X, joint.element)]
            if self._add(_Part(name, outer, place, joint.element, moves)) and not moves:
                self._mark(name, name, place, joint.element)
        for name, (link, place) in graph.frames.items():
            self._mark(name, link, place, graph.elements[link])
        for loop in loops:
            self._close(loop)
        for rod in graph.rods:
            self._mark_ends(rod.name, rod.links, rod.places, rod.element)
            self.closures.append(rod)
        struts: list[Strut] = []
        for strut in graph.struts:
            struts.append(replace(strut, name=tree.names.new(strut.name)))
            self._mark_ends(strut.name, strut.links, strut.places, strut.element)
        self._walk()
        for closure in self.closures:
            tree.add_tie(replace(closure, links=self._carriers(closure.links)))
        for strut in struts:
            tree.add_strut(replace(strut, links=self._carriers(strut.links)))
        for coupling in graph.couplings:
            self._couple(coupling)

    def _add(self, part: _Part) -> bool:
        """Add a link; return false for the world by another name."""
        world = self.inside[WORLD]
        is_world = part.name in FIXED and part.place == ORIGIN and not part.moves
        if is_world and self.inside[part.outer] is world:
            self.inside[part.name] = world
            if part.name != WORLD:
                self.tree.hang(part.element, part.name, WORLD, ORIGIN)
            return False
        if part.name in self.inside:
            raise part.element.repeated_name(part.name, "the bodies")
        self.inside[part.name] = []
        self.inside[part.outer].append(part)
        return True

    def _mark(self, name: str, link: str, place: Place, element: Element) -> None:
        self.inside[link].append(_Part(name, link, place, element))

    def _mark_ends(
        self, name: str, links: Sequence[str], places: Sequence[Place], element: Element
    ) -> None:
        for end, link, place in zip(("parent", "child"), links, places, strict=True):
            self._mark(self.tree.names.new(f"{name}.{end}"), link, place, element)

    def _close(self, joint: Joint) -> None:
        """Add the closure of a loop, and the copy that its joint moves."""
        outer, inner = joint.links
        at = joint.frames[0] if joint.frames else self.graph.places[inner]
        places = joint.frames or (at, at)
        moves, closure = joint.moves, joint.name
        ball = bool(moves) and moves[-1].kind == "ball"
        if ball:  # a common point leaves the same free
            if joint.frames is None:
                places = (Place(moves[-1].point), Place(moves[-1].point))
            moves = moves[:-1]
        if moves:
            closure = f"{joint.name}.closure"
            copy = self.tree.names.new(f"{joint.name}{COPY}")
            self._add(_Part(copy, outer, at, joint.element, moves))
            outer = copy
        if joint.frames:
            self._mark_ends(joint.name, (outer, inner), joint.frames, joint.element)
        holds = "point" if ball else "frame"
        self.closures.append(Closure(closure, (outer, inner), places, joint.element, holds))

    def _walk(self) -> None:
        """Hang all parts, in depth first."""
        tree, masses = self.tree, self.graph.masses
        waiting = self.inside[WORLD][::-1]
        while waiting:
            part = waiting.pop()
            if part.moves is None:
                tree.mark(part.element, part.name, part.outer, part.place)
                continue
            tree.hang(part.element, part.name, part.outer, part.place, part.moves)
            if part.name in masses:
                mass = masses[part.name]
                if mass is None or not mass.is_stand_in:
                    tree.weigh(part.name, mass)
            waiting += self.inside[part.name][::-1]

    def _carriers(self, links: tuple[str, str]) -> tuple[str, str]:
        return self.tree.carriers[links[0]], self.tree.carriers[links[1]]

    def _couple(self, coupling: Coupling) -> None:
        """Add a coupling of moves with one coordinate."""
        element, weights = coupling.element, [*coupling.driven, *coupling.driving]
        for name in weights:
            self.tree.require_axial(element, "joint", name)
        if len({*weights}) < len(weights):
            raise element.fault(
                f"couples the joint {weights[0]!r} with itself, expected two; correct it"
            )
        driven, driving = (
            {name: weight if abs(weight) >= SMALLEST else 0.0 for name, weight in side.items()}
            for side in (coupling.driven, coupling.driving)
        )
        coefficients = [x if abs(x) >= SMALLEST else 0.0 for x in coupling.coefficients]
        self.tree.add_tie(
            replace(coupling, driven=driven, driving=driving, coefficients=coefficients)
        )


@dataclass(frozen=True)
class FramedFreedom:
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
    freedoms: Sequence[FramedFreedom]
    closes: bool = False

    def motion(self, relative: Place) -> tuple[Place, list[tuple[FramedFreedom, Vec3, float]]]:
        """Return the motion of the second frame in the first one by the moves of the joint, and the
        axis in the first frame and the coordinate of each move [m or rad].

        Args:
            relative: the second frame in the first one, by the places of the links.
        """
        at, turn, moved = ZERO, IDENTITY, list[tuple[FramedFreedom, Vec3, float]]()
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


def global_frames(
    places: Mapping[str, Place], links: tuple[str, str], frames: Iterable[Place]
) -> tuple[Place, Place]:
    """Return a frame of each of two links, global, by the places of links."""
    first, second = (places[link] * frame for link, frame in zip(links, frames, strict=True))
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
        first, second = global_frames(own, joint.links, joint.frames)
        motion, _ = joint.motion(second.relative_to(first))
        if each.links == joint.links:
            placed = graph.places[a] * f * motion
            graph.places[b] = placed * g.inverse
        else:
            placed = graph.places[b] * g * motion.inverse
            graph.places[a] = placed * f.inverse
    moves: dict[str, list[Move]] = {}
    closing = [each.name for each in loops]
    closing += [each.name for each in joints if each.closes]
    graph.joints = [_graph_joint(graph, named[each.name], moves) for each in spanning]
    graph.loops += [_graph_joint(graph, named[name], moves) for name in closing]
    return moves


def _graph_joint(graph: Graph, joint: FramedJoint, moves: dict[str, list[Move]]) -> Joint:
    """Return a joint of the graph with its frames, the first one behind its moves."""
    first, second = global_frames(graph.places, joint.links, joint.frames)
    motion, moved = joint.motion(second.relative_to(first))
    behind = first * motion
    moves[joint.name] = [
        Move(
            *(each.name, each.kind, behind.at, first.direction(axis), each.element, value),
            limit=each.limit,
        )
        for each, axis, value in moved
    ]
    return Joint(joint.name, joint.links, moves[joint.name], joint.element, (behind, second))
