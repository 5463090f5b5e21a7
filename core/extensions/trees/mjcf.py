"""MJCF: models of MuJoCo, a tree of bodies closed by equalities; elements without meaning for
kinematics are counted, not read.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from typing import TypeAlias, cast

from ...algebra import X, quat, vec
from ...case.io.document import shown
from ...errors import MOST_NAMED, WARNING, CaseError, remedy, shortened
from ...mechanism.mechanism import GROUND, Vector
from ..xml.element import ZEROS, Element, significant_digits, words
from .graph import CLOSING
from .masses import STAND_INS, mass_of
from .mjcf_language import (
    APART,
    DYNAMIC,
    EXPANDED,
    IN_BODY,
    MAIN,
    MAKE_BODIES,
    ORIENTATION,
    ROOT,
    WRITE_OUT,
    Classes,
    expand,
    read_compiler,
    require_known_attributes,
)
from .place import ORIGIN, Place, coordinates, unit_quaternion
from .robot_elements import Unread
from .tree import (
    MOST_MOVING,
    UNKNOWNS,
    WORLD,
    Closure,
    Coupling,
    Kind,
    Limit,
    Move,
    Spring,
    Strut,
    Tree,
    limit_of,
)

# What these hold is for looks, actuators and measurements.
_LEFT_OUT = words("contact actuator sensor keyframe custom extension deformable asset")
OTHERS = {
    "mujocoinclude": "is a part of a model; give the file that includes it",
    "COLLADA": "holds shapes, which say nothing of joints; give the model that names it",
    "launch": "starts programs of ROS; give the URDF that it names",
    "model": "describes a package of Gazebo; give the SDF beside it",
}
"""Other documents in XML, and the remedy, by their root."""
_EQUALITIES = ("connect", "weld", "joint", "tendon")
_Part: TypeAlias = tuple[Element, Place, str]
"""An element, the place of the frame it is given in, and its default class."""
_INERTIAL = (*words("pos mass diaginertia fullinertia"), *ORIENTATION)
_OF_AXIS = words("pos axis ref range limited actuatorfrcrange actuatorfrclimited springref")
"""Attributes without effect on a free joint."""
_ACTUATORS = words("general motor position velocity intvelocity damper cylinder muscle dcmotor")
_TRANSMISSIONS = words(
    "joint jointinparent tendon site refsite body slidersite cranksite name class"
)
RANGES = f"{DYNAMIC['range']} of joints"


def whole_mjcf(root: Element) -> Element:
    """Return a model with all that it includes; see `expand`."""
    _require_model(root)
    root = expand(root)
    _require_model(root)
    return root


def read_mjcf(root: Element) -> Tree:
    """Return the tree of a whole model, in its pose qpos0.

    Raises:
        CaseError: an unknown element or one of new bodies, a name given twice, a joint, place
            or equality without a sense.
    """
    require_known_attributes(root)
    _require_rigid(root)
    return _Reader(root).read()


def _require_model(root: Element) -> None:
    """Refuse other documents, and elements in place of parts elsewhere."""
    if root.tag in OTHERS:
        raise root.fault(OTHERS[root.tag])
    if root.tag != "mujoco":
        raise root.fault(
            "found another document, expected a model <mujoco>, <robot> or <sdf>; give a file of"
            " MJCF, URDF or SDF"
        )
    for element in root.children:
        _require_written_out(element)
        if element.tag not in (*ROOT, *EXPANDED):
            raise element.fault(f"unknown in a model; {remedy(element.tag, ROOT)}")


def _require_written_out(element: Element) -> None:
    if element.tag in MAKE_BODIES:
        raise element.fault(f"cannot be read, because {MAKE_BODIES[element.tag]}; {WRITE_OUT}")


def _require_rigid(root: Element) -> None:
    """Refuse soft bodies between bodies."""
    for section in root.findall("deformable"):
        for flex in section.findall("flex"):
            names = {
                name for key in ("body", "node") for name in flex.attributes.get(key, "").split()
            }
            if len(names) > 1:
                raise flex.fault(
                    f"holds the bodies {shortened(sorted(names), MOST_NAMED)} together as a soft"
                    " one, expected rigid bodies; remove it, or write what joins them as <equality>"
                )


class _Reader:
    """A model during its reading."""

    def __init__(self, root: Element) -> None:
        self.root, self.classes, self.compiler = root, Classes(root), read_compiler(root)
        model = root.attributes.get("model", root.file.stem)
        described = f"MJCF model {model!r} of {root.file.name}"
        digits = significant_digits(root)
        self.tree = Tree(root.file, described, "its pose qpos0", digits=digits)
        flags = [flag for option in root.findall("option") for flag in option.findall("flag")]
        self.disabled = {
            key for flag in flags for key, value in flag.attributes.items() if value == "disable"
        }
        if "constraint" in self.disabled:  # equalities are some of them
            self.disabled.add("equality")
        self.stand_ins = any(
            text.attributes.get("name") == STAND_INS
            for custom in root.findall("custom")
            for text in custom.findall("text")
        )
        tendons = [each.take() for section in root.findall("tendon") for each in section.children]
        self.coupling = set[str]()
        self.plugins = [(each, "") for part in root.findall("extension") for each in part.children]
        self.tendons = {each.attributes.get("name", ""): each for each in tendons}

    def read(self) -> Tree:
        """Return the tree."""
        root, tree = self.root, self.tree
        worlds = [*root.findall("worldbody")]
        for world in worlds:
            bodies = (each for each in world.descendants() if each.tag == "body")
            tree.names.update(
                each.attributes["name"] for each in bodies if "name" in each.attributes
            )
            self._read_bodies(world)
        tree.require_moving(root)
        unread = Unread({name: name for name in tree.places}, {}, (), "an <equality>")
        for plugin, link in self.plugins:
            unread.require_apart(plugin, link)
        for section in root.findall(*_LEFT_OUT):
            for element in section.children:
                tree.leave(element, f"{section.tag}: {element.tag}")
        self._equalities()
        self._springs()
        keys = [each for section in root.findall("keyframe") for each in section.findall("key")]
        for k, key in enumerate(keys):
            qpos = key.attributes.get("qpos")
            numbers = None if qpos is None else qpos.split()
            tree.keyframes[key.attributes.get("name", str(k))] = key, numbers
        for section in root.findall("actuator"):
            for motor in section.findall(*_ACTUATORS):
                motor.require_known(_TRANSMISSIONS, closed=False)
                tendon = self.tendons.get(motor.attributes.get("tendon", ""))
                moved = motor
                if tendon is not None and tendon.tag == "fixed":  # of joints that move as one
                    moved = next(tendon.findall("joint"), motor)
                named = {moved.attributes.get(key, "") for key in ("joint", "jointinparent")}
                tree.add_motor(f"actuator: {motor.tag}", named & tree.moves.keys())
        ranges = ["range" in tree.moves[name].element.attributes for name in tree.actuated]
        tree.motors[RANGES] = sum(ranges)
        tied = {tie.element.attributes.get("site1") for tie in tree.ties}
        for site in tree.sites:
            other = f"{site[:-1]}2"
            ends = {site, other} <= tree.sites.keys() and not {site, other} & tied
            if CLOSING.fullmatch(site) and site.endswith("1") and ends:
                tree.notes.append(f"{WARNING}no equality holds {site} and {other} together")
        gravity = self._gravity()
        if tree.masses:
            tree.gravity = gravity
        self.classes.take()
        return tree.settled(root, APART)

    def _read_bodies(self, world: Element) -> None:
        """Read the bodies of a world and what is in them, depth first."""
        waiting = [(WORLD, self._parts_of(world, ORIGIN, MAIN))]
        while waiting:
            link, inside = waiting[-1]
            if (found := next(inside, None)) is None:
                waiting.pop()
                continue
            element, place, childclass = found
            match element.tag:
                case "body":
                    waiting.append(
                        self._body(
                            element, place, link, element.attributes.get("childclass", childclass)
                        )
                    )
                case "site":
                    site = self.classes.complete(element.take(), "site", childclass)
                    if (name := site.attributes.get("name")) is not None:
                        self.tree.mark(site, name, link, place * self.compiler.place(site))
                    else:
                        self.tree.leave(element, "sites without a name")
                case "joint" | "freejoint" if link == WORLD:
                    raise element.fault("is in no body, expected joints in bodies; remove it")
                case "joint" | "freejoint":
                    pass
                case "inertial":
                    element.take(*_INERTIAL)  # motion does not need it
                case _:
                    self.tree.leave(element, f"{element.tag}s")
                    if element.tag == "plugin":
                        self.plugins.append((element, link))

    def _body(
        self, element: Element, around: Place, outer: str, childclass: str
    ) -> tuple[str, Iterator[_Part]]:
        """Hang a body; return its name and content."""
        tree = self.tree
        if (name := element.take().attributes.get("name")) is None:
            name = tree.names.new(f"body{len(tree.places)}")
        place = around * self.compiler.place(element)
        # one more than are read is too many already
        moves = [*islice(self._moves(element, name, place, childclass), MOST_MOVING + 1)]
        tree.hang(element, name, outer, place, moves)
        if not moves and element.attributes.get("mocap") == "true":
            tree.count("mocap bodies, which stand still")
        if tree.carriers[name] != GROUND:
            if element.number("gravcomp", 0.0) != 0.0:
                tree.count("gravity compensation of bodies")
            self._weigh(element, name, childclass)
        return name, self._parts_of(element, place, childclass)

    def _weigh(self, element: Element, name: str, childclass: str) -> None:
        """Read the mass of a body, which motion does not need: what makes no sense is left out."""
        if self.stand_ins:
            return
        try:
            parts = [*self._parts_of(element, ORIGIN, childclass)]
            if (mass := mass_of(element, parts, self.classes, self.compiler)) is not None:
                self.tree.weigh(name, mass)
        except CaseError:
            self.tree.weigh(name, None)

    def _parts_of(self, around: Element, place: Place, childclass: str) -> Iterator[_Part]:
        """Yield what is in a body or its frames, with the place and the class of the frame."""
        waiting = [(each, place, childclass) for each in reversed(around.children)]
        while waiting:
            element, at, within = waiting.pop()
            _require_written_out(element)
            if element.tag not in IN_BODY:
                raise element.fault(f"unknown in a body; {remedy(element.tag, IN_BODY)}")
            if element.tag != "frame":
                yield element, at, within
                continue
            element.take()
            inner, own = (
                at * self.compiler.place(element),
                element.attributes.get("childclass", within),
            )
            waiting += [(each, inner, own) for each in reversed(element.children)]

    def _moves(self, body: Element, name: str, place: Place, childclass: str) -> Iterator[Move]:
        """Yield the joints of a body."""
        found = [
            (element, at, within)
            for element, at, within in self._parts_of(body, place, childclass)
            if element.tag in ("joint", "freejoint")
        ]
        for k, (element, at, within) in enumerate(found, 1):
            element.take()
            if element.tag == "joint":
                element = self.classes.complete(element, "joint", within)
            own = name if len(found) == 1 else f"{name}.{k}"
            yield self._move(element, element.attributes.get("name", own), at, place)

    def _move(self, element: Element, name: str, given: Place, body: Place) -> Move:
        kind: Kind = "free"
        if element.tag == "joint":
            kind = cast("Kind", element.choice("type", (*UNKNOWNS,), "hinge"))
        align = element.choice("align", ("true", "false", "auto"), "auto")
        if kind == "free":
            if align == "true" or (align == "auto" and self.compiler.align):
                raise element.fault(
                    "its body's frame is moved to its inertia (align, or alignfree of <compiler>),"
                    " where anchors and relpose mean something else, expected the frame of the"
                    ' file; set align="false" and give them in that'
                )
            element.take(*_OF_AXIS)
            return Move(name, kind, body.at, X, element)
        for attribute, what in DYNAMIC.items():
            if attribute in element.attributes:
                self.tree.count(f"{what} of joints")
        reference = element.number("ref", 0.0)
        point = given.point(vec(element.numbers("pos", 3, default=ZEROS)))
        limit = self._limit(element)
        if kind == "hinge":
            reference = self.compiler.angle(reference)
        if kind != "slide":
            angle = self.compiler.angle
            limit = replace(limit, lower=angle(limit.lower), upper=angle(limit.upper))
        axis = element.direction(element.numbers("axis", 3, default=(0.0, 0.0, 1.0)), "axis")
        return Move(name, kind, point, given.direction(axis), element, reference, limit)

    def _limit(self, element: Element) -> Limit:
        """Return the limits of a joint or tendon that act, in the units of the file.

        Raises:
            CaseError: they have no range between them, as MuJoCo refuses it; an equality is meant.
        """
        found: list[Limit] = []
        for key, flag in (("range", "limited"), ("actuatorfrcrange", "actuatorfrclimited")):
            said = element.choice(flag, ("true", "false", "auto"), "auto")
            on = said == "true" or (said == "auto" and self.compiler.limited)
            text = element.attributes.get(key, "") if on else ""
            ends = text.split()
            if ends and len(ends) != 2:
                raise element.fault(f"{key}: expected two numbers; correct the attribute")
            limit = limit_of(element, dict(zip(("lower", "upper"), ends, strict=False)))
            if said == "true" and not limit.lower < limit.upper:
                tag = "joint" if element.tag == "joint" else "tendon"
                name = element.attributes.get("name", "NAME")
                equality = f'<{tag} {tag}1="{name}" polycoef="CHANGE SINCE qpos0"/>'
                raise element.fault(
                    f"{key}: found {shown(text)} with {flag}, expected the lower limit first;"
                    f" correct it, or hold what is constant by an equality, {equality}"
                )
            found.append(limit)
        limit, effort = found
        return replace(limit, effort=max(abs(effort.lower), abs(effort.upper)))

    def _equalities(self) -> None:
        names = set[str]()
        for section in self.root.findall("equality"):
            for k, bare in enumerate(section.children, 1):
                element = self.classes.complete(bare.take(), "equality")
                if element.tag not in _EQUALITIES:
                    raise element.fault(
                        "cannot be read: there is no joint for it; expected one of"
                        f" {', '.join(_EQUALITIES)}; remove it"
                    )
                if "equality" in self.disabled or not element.flag("active", default=True):
                    self.tree.leave(bare, "equalities that are not active")
                    continue
                name = element.attributes.get("name", f"{element.tag}{k}")
                if name in names:
                    raise element.repeated_name(name, "the equalities")
                names.add(name)
                match element.tag:
                    case "connect" | "weld":
                        tie = self._closure(name, element)
                    case "joint":
                        tie = self._of_joints(name, element)
                    case _:
                        tie = self._of_tendon(name, element)
                self.tree.add_tie(tie)

    def _closure(self, name: str, element: Element) -> Closure:
        tree, welded = self.tree, element.tag == "weld"
        if welded and element.number("torquescale", 1.0) == 0.0:
            raise element.fault(
                "torquescale: found 0, which leaves all turning free, expected more; write it as"
                " <connect>"
            )
        holds = "frame" if welded else "point"
        if "site1" in element.attributes or "site2" in element.attributes:
            (i, first), (j, second) = (self._site(element, key) for key in ("site1", "site2"))
            if welded:
                first = first * ORIGIN
            return Closure(name, (i, j), (first, second), element, holds)
        if "body1" not in element.attributes:
            raise element.fault(
                "body1: missing, expected two bodies or two sites; add body1 and body2, or site1"
                " and site2"
            )
        names = element.attributes["body1"], element.attributes.get("body2", WORLD)
        for key, body in zip(("body1", "body2"), names, strict=True):
            if body not in tree.places:
                raise element.unknown_name(key, body, tree.places, "a body")
        links = tree.carriers[names[0]], tree.carriers[names[1]]
        first, second = tree.places[names[0]], tree.places[names[1]]
        if not welded:
            point = Place(first.point(vec(element.numbers("anchor", 3))))
            return Closure(name, links, (point, point), element, holds)
        relpose = element.numbers("relpose", 7, default=(0.0,) * 7)
        # zeros for the quaternion mean: as in qpos0
        wanted = second.relative_to(first)
        if any(relpose[3:]):
            wanted = Place(vec(relpose[:3]), unit_quaternion(quat(relpose[3:])))
        return Closure(name, links, (first * wanted, second), element, holds)

    def _site(self, element: Element, key: str) -> tuple[str, Place]:
        name = element.attributes.get(key, "")
        if name not in self.tree.sites:
            raise element.unknown_name(key, name, self.tree.sites, "a site")
        return self.tree.sites[name]

    def _of_joints(self, name: str, element: Element) -> Coupling:
        first = self.tree.require_axial(element, "joint1", element.attributes.get("joint1"))
        driving: dict[str, float] = {}
        if "joint2" in element.attributes:
            second = self.tree.require_axial(element, "joint2", element.attributes["joint2"])
            if first == second:
                raise element.fault(
                    f"couples the joint {first!r} with itself, expected two; correct joint2"
                )
            driving = {second: 1.0}
        return Coupling(name, {first: 1.0}, driving, _coefficients(element), element)

    def _of_tendon(self, name: str, element: Element) -> Closure | Coupling:
        single = self.tendons.get(element.attributes.get("tendon1", ""))
        if single is not None and single.tag == "spatial" and "tendon2" not in element.attributes:
            return self._rod(name, element, single)
        first = self._sum(element, "tendon1")
        second = self._sum(element, "tendon2") if "tendon2" in element.attributes else {}
        return Coupling(name, first, second, _coefficients(element), element)

    def _sum(self, element: Element, key: str) -> dict[str, float]:
        """Return the weights of the joints of a fixed tendon."""
        name = element.attributes.get(key, "")
        if name not in self.tendons:
            raise element.unknown_name(key, name, self.tendons, "a tendon")
        if self.tendons[name].tag != "fixed":
            raise element.fault(
                f"{key}: {name!r} is a spatial tendon, whose length is not linear in joint"
                " coordinates, expected a fixed one; only alone, and between two sites, is there a"
                " joint for it"
            )
        weights: dict[str, float] = {}
        for wrap in self.tendons[name].findall("joint"):
            joint = self.tree.require_axial(wrap, "joint", wrap.attributes.get("joint"))
            weights[joint] = weights.get(joint, 0.0) + wrap.number("coef")
        if not {"stiffness", "damping"} & self.tendons[name].attributes.keys():
            self.coupling.add(name)
        return weights

    def _rod(self, name: str, element: Element, tendon: Element) -> Closure:
        """Return the distance of a spatial tendon of constant length."""
        if [child.tag for child in tendon.children] != ["site", "site"]:
            way = ", ".join(child.tag for child in tendon.children) or "nothing"
            raise element.fault(
                f"tendon1: {tendon} goes over {way}, expected two sites; there is no joint for"
                " others"
            )
        (i, first), (j, second) = (self._site(child.take(), "site") for child in tendon.children)
        apart = second.at - first.at
        length = math.sqrt(apart @ apart) + _coefficients(element)[0]
        if i == j or not (apart @ apart > 0.0 and length > 0.0):
            what = (
                f"is between two points of {i!r}"
                if i == j
                else "has no length in the pose of the file"
            )
            raise element.fault(
                f"tendon1: {tendon} {what}, expected two points of two bodies; remove the equality,"
                " or write <connect>"
            )
        return Closure(name, (i, j), (first, second), element, "distance", length)

    def _springs(self) -> None:
        """Read springs and dampers of joints and tendons; a law that is not linear, or that
        MuJoCo's compiler tunes, is counted.
        """
        tree = self.tree
        for move in tree.moves.values():
            element = move.element
            try:
                law, rest = self._law(element), element.number("springref", 0.0)
                if any(law):
                    rest = self.compiler.angle(rest) if move.kind == "hinge" else rest
                    tree.springs[move.name] = Spring(*law, rest)
            except CaseError:
                element.take("stiffness", "damping", "springref")
                for key, what in (("stiffness", "springs"), ("damping", "damping")):
                    if {key, "springdamper"} & element.attributes.keys():
                        tree.count(f"{what} of joints")
        for section in self.root.findall("tendon"):
            for tendon in section.children:
                whole = self.classes.complete(tendon, "tendon")
                tree.tendons[whole.attributes.get("name", f"tendon {len(tree.tendons)}")] = whole
                self._limit(whole)
                try:
                    strut = self._strut(tendon)
                except CaseError:
                    if tendon.attributes.get("name") not in self.coupling:
                        tree.leave(tendon, f"tendon: {tendon.tag}")
                else:
                    tree.add_strut(strut)

    def _law(self, element: Element) -> tuple[float, float]:
        """Return stiffness and damping."""
        frequency, ratio = element.numbers("springdamper", 2, default=(0.0, 0.0))
        if frequency > 0.0 and ratio > 0.0:
            raise element.fault("springdamper: is tuned by MuJoCo, expected stiffness and damping")
        found: list[float] = []
        for key, switch in (("stiffness", "spring"), ("damping", "damper")):
            linear, *more = element.numbers(key, 1, 2, 3, default=(0.0,))
            acts = not self.disabled & {switch, "passive"}
            if acts and (any(more) or linear < 0.0):
                raise element.fault(f"{key}: is no linear law, expected one positive number")
            found.append(linear if acts else 0.0)
        return found[0], found[1]

    def _strut(self, bare: Element) -> Strut:
        """Return the spring of a tendon between two sites.

        Raises:
            CaseError: it is none.
        """
        tendon, tree = self.classes.complete(bare, "tendon"), self.tree
        stiffness, damping = self._law(tendon)
        sites = [str(child.take().attributes.get("site")) for child in tendon.children]
        if tendon.tag != "spatial" or len(sites) != 2 or not {*sites} <= tree.sites.keys():
            raise tendon.fault("goes elsewhere than between two sites")
        (i, first), (j, second) = (tree.sites[site] for site in sites)
        shortest, longest = (2 * tendon.numbers("springlength", 1, 2, default=(-1.0,)))[:2]
        if shortest != longest:
            raise tendon.fault("springlength: is a dead band, expected one length")
        if shortest < 0.0:
            rests = {key for move in tree.moves.values() for key in move.element.attributes}
            if stiffness and rests & {"ref", "springref"}:
                raise tendon.fault("has the length of a rest pose of its own")
            shortest = math.dist(coordinates(first.at), coordinates(second.at))
        name, spring = tendon.attributes.get("name", "tendon"), Spring(stiffness, damping, shortest)
        return Strut(name, (i, j), (first, second), spring, tendon, "tendon: spatial")

    def _gravity(self) -> Vector:
        """Return the gravity [m/s^2]; the last option counts."""
        found = self.tree.gravity
        for option in self.root.findall("option"):
            x, y, z = option.numbers("gravity", 3, default=found)
            found = x, y, z
        return ZEROS if "gravity" in self.disabled else found


def _coefficients(element: Element) -> tuple[float, ...]:
    """Return five coefficients; omitted ones of polycoef have their defaults."""
    found = element.numbers("polycoef", 1, 2, 3, 4, 5, default=(0.0, 1.0))
    return (*found, *(0.0, 1.0, 0.0, 0.0, 0.0)[len(found) :])
