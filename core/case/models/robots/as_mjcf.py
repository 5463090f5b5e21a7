"""A robot as elements of MJCF: one reader makes the case of either.

A link is a body. A link without freedoms of its own is part of the body around it, and a site, so
its position is an output. A joint of a loop moves a massless copy on its first link, welded to its
second link: it can be driven, held and compared like a joint of the tree.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from ....algebra import Quat, Vec3
from ..mjcf.elements import DEEPEST, Element, unlike
from ..mjcf.equalities import MOST_EQUALITIES
from ..mjcf.frames import HERE, Place, unit_quaternion
from ..mjcf.tree import WORLD
from .robot import Connection, Described, Inertial, Loop, Move, Robot, Rod, Spring, Strut
from .tree import spanned

FIXED = ("world", "ground")
"""Names of a fixed link at the origin, which is the world."""
# Readers refuse smaller numbers, which are the rounding of zeros.
_ZERO = 1e-100


def as_mjcf(robot: Robot) -> Element:
    """Return the document of a robot.

    Raises:
        CaseError: the links hang on each other in too long a chain.
    """
    return _Writer(robot).document()


class _Writer:
    """The document during its construction."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.bodies: dict[str, list[Element]] = {}
        self.names: dict[str, str] = {}
        self.places = {WORLD: HERE} | robot.links
        self.depth = {WORLD: 0}
        self.tendons: list[Element] = []
        self.equalities: list[Element] = []
        self.world: list[Element] = []
        self.copies = set(robot.links)
        self.again = Counter[str]()

    def document(self) -> Element:
        """Return the root."""
        robot = self.robot
        ties = [each.joint for each in robot.loops], robot.rods, robot.struts, robot.mimics
        for each in [each.element for them in ties for each in them][MOST_EQUALITIES:]:
            raise each.fault(
                f"found more than {MOST_EQUALITIES} elements that join others, expected fewer; take"
                " out those that are not looked at"
            )
        tree, loops = spanned(robot)
        hung = {joint.links[1] for joint in tree}
        self.bodies[WORLD], self.names[WORLD] = self.world, WORLD
        for name, place in robot.links.items():
            if name in hung:
                continue
            if name in robot.fixed:
                if name in FIXED and place == HERE:
                    self.bodies[name], self.names[name] = self.world, WORLD
                    self.depth[name] = 0
                else:
                    self.body(name, WORLD, [], robot.elements[name])
            else:
                free = self.element("freejoint", {}, robot.elements[name])
                self.body(name, WORLD, [free], robot.elements[name])
        for joint in tree:
            outer, inner = joint.links
            if self.is_world(joint):
                self.bodies[inner], self.names[inner] = self.world, WORLD
                self.depth[inner] = 0
                continue
            if joint.free:
                around, joints = WORLD, [self.element("freejoint", {"name": joint.name}, joint)]
            else:
                around, joints = outer, self.joints(joint, robot.links[inner])
            self.body(inner, around, joints, joint.element)
            if not joints:  # a frame of the link around it
                self.site(inner, inner, robot.links[inner], joint.element)
        for name, (link, place) in robot.frames.items():
            self.site(name, link, place, robot.elements[link])
        for loop in loops:
            self.close(loop)
        self.relate()
        motors = [self.element("motor", {"joint": name}, robot.root) for name in robot.actuated]
        sections = {
            "worldbody": self.world,
            "actuator": motors,
            "tendon": self.tendons,
            "equality": self.equalities,
        }
        root = robot.root
        name = root.attributes.get("name", root.file.stem)
        gravity = " ".join(map(_number, robot.gravity))
        return self.element(
            "mujoco",
            {"model": name},
            root,
            [
                Element(root.file, "compiler", {"angle": "radian"}, root.line),
                Element(root.file, "option", {"gravity": gravity}, root.line),
                *(
                    Element(root.file, tag, {}, root.line, list(each))
                    for tag, each in sections.items()
                ),
            ],
        )

    def element(
        self,
        tag: str,
        attributes: dict[str, str],
        origin: Element | Connection,
        children: list[Element] | None = None,
    ) -> Element:
        """Return an element; messages name its origin."""
        source = origin.element if isinstance(origin, Connection) else origin
        children = [] if children is None else children
        return Described(source.file, tag, attributes, source.line, children, words=str(source))

    def is_world(self, joint: Connection) -> bool:
        """Return whether a joint fixes a link of the world's names and place to the world."""
        outer, inner = joint.links
        fixed = not (joint.moves or joint.free) and self.names.get(outer) == WORLD
        return fixed and inner in FIXED and self.places[inner] == HERE

    def body(self, name: str, outer: str, inside: list[Element], origin: Element) -> None:
        """Add a body to another one, or to the world."""
        self.depth[name] = self.depth[outer] + 1
        if self.depth[name] > DEEPEST:
            raise origin.fault(
                f"hangs on a chain of more than {DEEPEST} links, expected the tree of a mechanism;"
                " take out those that are not looked at"
            )
        self.names[name], self.bodies[name] = name, inside
        if (inertial := self.robot.inertials.get(name)) is not None:
            inside.append(self.element("inertial", _mass(inertial), origin))
        pose = _pose(self.places[name].seen_from(self.places[outer]))
        self.bodies[outer].append(self.element("body", {"name": name, **pose}, origin, inside))

    def site(self, name: str, link: str, place: Place, origin: Element) -> None:
        """Add a site to the body of a link."""
        pose = _pose(place.seen_from(self.places[link]))
        self.bodies[link].append(self.element("site", {"name": name, **pose}, origin))

    def joints(self, joint: Connection, place: Place) -> list[Element]:
        """Return the freedoms of a body, given in its place."""
        return [self.move(move, joint, place) for move in joint.moves]

    def move(self, move: Move, joint: Connection, place: Place) -> Element:
        """Return one freedom."""
        inside = Place(move.point).seen_from(place)
        attributes = {"name": move.name, "type": move.kind, "pos": _text(inside.at)}
        if move.kind != "ball":
            back = Place(turn=place.turn.conjugate())
            attributes["axis"] = _text(back.direction(move.axis))
        if (spring := self.robot.springs.get(move.name)) is not None:
            attributes |= {**_law(spring), "springref": _number(spring.rest)}
        return self.element("joint", attributes, joint)

    def close(self, loop: Loop) -> None:
        """Add a joint of a loop."""
        joint = loop.joint
        outer, inner = joint.links
        moves, ball = joint.moves, bool(joint.moves) and joint.moves[-1].kind == "ball"
        if ball:  # a common point leaves the same free
            moves = moves[:-1]
        closure = joint.name
        if moves:
            closure = f"{joint.name}.closure"
            name = self.unused(f"{joint.name}.copy")
            place = loop.frames[0] if loop.frames else self.places[inner]
            self.places[name] = place
            self.body(
                name,
                outer,
                self.joints(Connection(joint.name, joint.links, moves, joint.element), place),
                joint.element,
            )
            outer = name
        tag = "connect" if ball else "weld"
        if loop.frames is None:
            attributes = {"body1": self.names[outer], "body2": self.names[inner]}
            if ball:
                center = Place(joint.moves[-1].point)
                attributes["anchor"] = _text(center.seen_from(self.places[outer]).at)
        else:
            names = [self.unused(f"{joint.name}.{each}") for each in ("parent", "child")]
            for site, link, place in zip(names, (outer, inner), loop.frames, strict=True):
                self.site(site, link, place, joint.element)
            attributes = {"site1": names[0], "site2": names[1]}
        self.equalities.append(self.element(tag, {"name": closure, **attributes}, joint))

    def relate(self) -> None:
        """Add rods, struts, couplings and mimics."""
        for rod in self.robot.rods:
            self.tendon("spatial", rod.name, self.ends(rod), rod.element)
        for strut in self.robot.struts:
            law = {**_law(strut.spring), "springlength": _number(strut.spring.rest)}
            attributes = {"name": self.unused(strut.name), **law}
            ends = self.ends(strut)
            self.tendons.append(self.element("spatial", attributes, strut.element, ends))
        for each in self.robot.couplings:
            joints = [
                self.element("joint", {"joint": name, "coef": _number(weight)}, each.element)
                for name, weight in each.weights.items()
            ]
            self.tendon("fixed", each.name, joints, each.element)
        for each in self.robot.mimics:
            follower, leader = each.joints
            values = " ".join(map(_number, each.coefficients))
            attributes = {"joint1": follower, "joint2": leader, "polycoef": values}
            self.equalities.append(
                self.element("joint", {"name": each.name, **attributes}, each.element)
            )

    def ends(self, each: Rod | Strut) -> list[Element]:
        """Add sites at both ends of a rod or strut; return their mentions in a tendon."""
        names = [self.unused(f"{each.name}.{end}") for end in ("parent", "child")]
        for name, link, point in zip(names, each.links, each.points, strict=True):
            self.site(name, link, Place(point), each.element)
        return [self.element("site", {"site": name}, each.element) for name in names]

    def tendon(self, tag: str, name: str, inside: Sequence[Element], origin: Element) -> None:
        """Add a tendon of constant length."""
        key = self.unused(f"{name}.tendon")
        self.tendons.append(self.element(tag, {"name": key}, origin, list(inside)))
        self.equalities.append(self.element("tendon", {"name": name, "tendon1": key}, origin))

    def unused(self, wanted: str) -> str:
        """Return a name unlike all links and frames."""
        name = unlike(wanted, self.copies, self.robot.frames, again=self.again)
        self.copies.add(name)
        return name


def fitted(here: Place, there: Place, moves: Sequence[Move]) -> Place:
    """Return the first frame of a loop, moved by the joint's own freedoms to the second one.

    The rest between both is the gap of the loop.
    """
    kinds = [move.kind for move in moves]
    at, turn = here.at, here.turn
    for move in moves:
        if move.kind == "slide":
            at += (move.axis @ (there.at - here.at)) * move.axis
    if kinds.count("hinge") > 1:
        turn = there.turn
    elif "hinge" in kinds:
        axis = moves[kinds.index("hinge")].axis
        between = there.turn * here.turn.conjugate()
        twist = Quat(between.e0, (axis @ between.e) * axis)
        if math.hypot(twist.e0, *twist.e) > 0.0:
            turn = unit_quaternion(twist) * here.turn
    return Place(at, turn)


def _mass(inertial: Inertial) -> dict[str, str]:
    """Return the attributes of an <inertial>; none of one that cannot be read."""
    if inertial.mass is None:
        return {}
    entries = " ".join(map(_number, inertial.inertia))
    return {**_pose(inertial.place), "mass": _number(inertial.mass), "fullinertia": entries}


def _law(spring: Spring) -> dict[str, str]:
    return {"stiffness": _number(spring.stiffness), "damping": _number(spring.damping)}


def _pose(place: Place) -> dict[str, str]:
    turn = place.turn
    return {"pos": _text(place.at), "quat": " ".join(map(_number, (turn.e0, *turn.e)))}


def _text(a: Vec3) -> str:
    return " ".join(map(_number, a))


def _number(value: float) -> str:
    return repr(float(value) if abs(value) >= _ZERO else 0.0)
