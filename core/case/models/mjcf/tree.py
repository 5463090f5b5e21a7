"""Tree of bodies of a model in the file's pose qpos0: moving bodies, their joints, and fixed
bodies.

A body without a joint is part of the body around it. A body with several joints hangs on a chain of
massless ones, a joint each.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice

from ....algebra import Vec3, X, vec
from ....errors import CaseError, remedy
from ....mechanism.mechanism import GROUND
from ...io.document import shown
from .attributes import DYNAMIC, IN_BODY, MAKE_BODIES, WRITE_OUT
from .classes import MAIN, Classes
from .elements import Element
from .frames import HERE, Compiler, Place, joint_axis, read_place
from .masses import Mass, Scales, read_scales

WORLD = "world"
# Scenes have many bodies, robots and hands at most some tens that move, a joint each; the freedom
# of all is counted at once, in a time that grows with the cube of their number: some seconds for as
# many as these.
MOST_BODIES, MOST_MOVING = 2_000, 150


@dataclass(frozen=True)
class ModelJoint:
    """A hinge, slide, ball or free joint of a model, global in the pose of the tree [m].

    Attributes:
        outer, inner: bodies of the mechanism it joins; the inner one moves on the outer.
        ref: coordinate at qpos0 [rad or m].
        moved: change of the coordinate since qpos0 [rad or m].
    """

    name: str
    type: str
    outer: str
    inner: str
    point: Vec3
    axis: Vec3
    ref: float
    element: Element
    moved: float = 0.0

    @property
    def value(self) -> float:
        """Its coordinate in the pose of the tree [rad or m]."""
        return self.ref + self.moved


@dataclass
class Tree:
    """Content of a model's worldbody.

    Attributes:
        places: of all bodies of the file, global.
        carriers: by body of the file, the body of the mechanism it belongs to.
        moving: moving bodies of the mechanism, with their places; the massless ones of chains
            too.
        massless: the names of those.
        free: by name, of the joint or of its body, bodies held by no joint.
        chain: all joints, free ones too, in the order of MuJoCo's coordinates: outer ones first.
        sites: by name, the body of the mechanism they are on, and their global places.
        names: of all bodies of the file that have one.
        masses: of each moving body with a mass, in its frame; several of bodies that move as one.
        unweighed: moving bodies whose masses cannot be read.
        left_out: how many there are of what has no meaning for kinematics, by what it is called.
    """

    classes: Classes
    compiler: Compiler
    scales: Scales = field(default_factory=Scales)
    places: dict[str, Place] = field(default_factory=lambda: {WORLD: HERE})
    carriers: dict[str, str] = field(default_factory=lambda: {WORLD: GROUND})
    moving: dict[str, Place] = field(default_factory=dict[str, Place])
    massless: set[str] = field(default_factory=set[str])
    joints: dict[str, ModelJoint] = field(default_factory=dict[str, ModelJoint])
    free: dict[str, str] = field(default_factory=dict[str, str])
    chain: list[ModelJoint] = field(default_factory=list[ModelJoint])
    sites: dict[str, tuple[str, Place]] = field(default_factory=dict[str, tuple[str, Place]])
    left_out: dict[str, int] = field(default_factory=dict[str, int])
    names: set[str] = field(default_factory=set[str])
    masses: dict[str, list[Mass]] = field(default_factory=dict[str, list[Mass]])
    unweighed: set[str] = field(default_factory=set[str])

    def read(self, around: Element, place: Place, body: str, childclass: str) -> None:
        """What is in a body, or in a frame of it; `place` is that of the body or frame, `body` one
        of the mechanism.

        Raises:
            CaseError: an element that is not known or makes bodies, a name given twice, a joint or
                place that makes no sense.
        """
        for element in around.children:
            if element.tag in MAKE_BODIES:
                raise element.fault(
                    f"cannot be read, because {MAKE_BODIES[element.tag]}; {WRITE_OUT}"
                )
            if element.tag not in IN_BODY:
                raise element.fault(f"unknown in a body; {remedy(element.tag, IN_BODY)}")
            if element.tag == "body":
                self._body(element, place, body, childclass)
            elif element.tag == "frame":
                if around.tag == "worldbody" and any(element.only("joint", "freejoint")):
                    raise element.fault("holds a joint, expected joints in bodies; remove it")
                inner = self._frame(element, place)
                self.read(element, inner, body, _class(element, childclass))
            elif element.tag == "site":
                self._site(self.classes.complete(element, "site", childclass), place, body)
            elif element.tag not in ("joint", "freejoint", "inertial"):
                self.count(f"{element.tag}s")

    def _frame(self, element: Element, around: Place) -> Place:
        return around.then(read_place(element, self.compiler))

    def _joints_in(
        self, around: Element, place: Place, childclass: str
    ) -> Iterator[tuple[Element, Place]]:
        """Yield the joints of a body, complete, and the places in which they are given."""
        for element in around.children:
            if element.tag == "joint":
                yield self.classes.complete(element, "joint", childclass), place
            elif element.tag == "freejoint":
                yield element, place
            elif element.tag == "frame":
                inner = self._frame(element, place)
                yield from self._joints_in(element, inner, _class(element, childclass))

    def count(self, what: str) -> None:
        """Count one more omitted item."""
        self.left_out[what] = self.left_out.get(what, 0) + 1

    def _body(self, element: Element, around: Place, outer: str, childclass: str) -> None:
        name = element.attributes.get("name", self._unused(f"body{len(self.places)}"))
        if name in self.places:
            raise element.repeated_name(name, "the bodies")
        place = around.then(read_place(element, self.compiler))
        childclass = _class(element, childclass)
        # one more than are read is too many already
        elements = [*islice(self._joints_in(element, place, childclass), MOST_MOVING + 1)]
        for most, count, what in (
            (MOST_BODIES, len(self.places), "bodies; take out what does not move"),
            (
                MOST_MOVING,
                len(self.moving) + len(elements),
                "joints; take out those that are not looked at",
            ),
        ):
            if count > most:
                raise element.fault(
                    f"found more than the {most} that are read, expected fewer {what}"
                )
        if name == GROUND and (elements or outer != GROUND):
            raise element.fault(
                f"name: found {shown(name)}, which is what does not move in a mechanism; rename the"
                " body"
            )
        if not elements:
            carrier = outer
            if element.attributes.get("mocap") == "true":
                self.count("mocap bodies, which stand still")
        else:
            carrier = name
            self._joints(name, elements, place, outer)
        self.places[name], self.carriers[name] = place, carrier
        if carrier != GROUND:
            self._weigh(element, place, carrier, childclass)
        self.read(element, place, carrier, childclass)

    def _weigh(self, element: Element, place: Place, carrier: str, childclass: str) -> None:
        """Read the mass of a body, which motion does not need: what makes no sense is left out."""
        if float(*element.numbers("gravcomp", (1,), (0.0,))) != 0.0:
            self.count("gravity compensation of bodies")
        try:
            found = self.scales.body(element, self.classes, self.compiler, childclass)
        except CaseError:
            self.unweighed.add(carrier)
            return
        if found is not None:
            seen = found.seen_in(place.seen_from(self.moving[carrier]))
            self.masses.setdefault(carrier, []).append(seen)

    def _joints(
        self, body: str, elements: list[tuple[Element, Place]], place: Place, outer: str
    ) -> None:
        for k, (element, given) in enumerate(elements):
            kind = self._kind(element)
            last = k == len(elements) - 1
            name = element.attributes.get("name", body if len(elements) == 1 else f"{body}.{k + 1}")
            if name in self.joints or (kind == "free" and name in self.free):
                raise element.repeated_name(name, "the joints")
            inner = body if last else self._unused(f"{body}.{name}")
            self.moving[inner] = place
            if not last:
                self.massless.add(inner)
            if kind == "free":
                if len(elements) > 1 or outer != GROUND:
                    raise element.fault(
                        "frees a body that other joints hold, expected a body in worldbody alone;"
                        " remove one of them"
                    )
                self.free |= {name: body, body: body}
                joint = ModelJoint(name, kind, outer, inner, place.at, X, 0.0, element)
            else:
                joint = self._joint(name, kind, element, given, outer, inner)
                self.joints[name] = joint
            self.chain.append(joint)
            outer = inner

    def _unused(self, wanted: str) -> str:
        """Return a name for an unnamed body, unlike all names of the file."""
        while wanted in self.names:
            wanted += "'"
        return wanted

    def _kind(self, element: Element) -> str:
        kind = (
            "free"
            if element.tag == "freejoint"
            else element.choice("type", ("hinge", "slide", "ball", "free"), "hinge")
        )
        align = element.choice("align", ("true", "false", "auto"), "auto")
        if kind == "free" and (align == "true" or (align == "auto" and self.compiler.align)):
            raise element.fault(
                "its body's frame is moved to its inertia (align, or alignfree of <compiler>),"
                " where anchors and relpose mean something else, expected the frame of the file;"
                ' set align="false" and give them in that'
            )
        return kind

    def _joint(
        self, name: str, kind: str, element: Element, place: Place, outer: str, inner: str
    ) -> ModelJoint:
        for attribute, what in DYNAMIC.items():
            if attribute in element.attributes:
                self.count(f"{what} of joints")
        (ref,) = element.numbers("ref", (1,), (0.0,))
        point = place.point(vec(element.numbers("pos", (3,), (0.0, 0.0, 0.0))))
        if kind == "hinge":
            ref = self.compiler.angle(ref)
        return ModelJoint(
            name, kind, outer, inner, point, place.direction(joint_axis(element)), ref, element
        )

    def _site(self, element: Element, place: Place, body: str) -> None:
        name = element.attributes.get("name")
        if name is None:
            return
        if name in self.sites:
            raise element.repeated_name(name, "the sites")
        self.sites[name] = body, place.then(read_place(element, self.compiler))


def _class(element: Element, childclass: str) -> str:
    return element.attributes.get("childclass", childclass)


def read_tree(root: Element, classes: Classes, compiler: Compiler) -> Tree:
    """Read the tree of a model."""
    tree = Tree(classes, compiler, read_scales(root))
    for world in root.only("worldbody"):
        tree.names |= {
            each.attributes["name"]
            for each in world.below()
            if each.tag == "body" and "name" in each.attributes
        }
        tree.read(world, HERE, GROUND, MAIN)
    return tree
