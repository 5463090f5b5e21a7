"""OpenSim: models in its XML since version 4; older ones are brought up to date by its own library.

Coordinates keep their names, and their default values are the pose. Custom joints turn and
slide by lines of their coordinates; other axes may follow by polynomials and splines. Angles of
frames and of ball, gimbal and free joints are turns about x, y and z of the body, one after the
other (OpenSim 4.6).
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from posixpath import join as joined
from posixpath import normpath

from numpy.polynomial import Polynomial

from ...algebra import Quat, Vec3, X, Y, Z
from ...case.io.document import fault, read_text, shown
from ...case.io.readers import LARGEST_FILE
from ...errors import KincheckError
from ...extras import library
from ...joints import PiecewisePolynomial
from ...mechanism.loads import Law
from ..trees.graph import FramedFreedom, FramedJoint, Graph, Joint, global_frames, join
from ..trees.masses import mass_in
from ..trees.place import ORIGIN, Place, euler_turn, unit_quaternion
from ..trees.tree import (
    NO_LIMIT,
    BushingLaw,
    Closure,
    Coupling,
    Kind,
    Limit,
    Move,
    Spring,
    Strut,
    Tree,
)
from ..xml.element import LEFT, TAKEN, ZEROS, Apart, Element, Names, parse_xml, words
from .curves import ZERO, curve_of, function, is_own, polynomial

VERSION_4 = 40_000
"""Oldest version of documents that are read as they are."""
CHAINS: Mapping[str, Sequence[tuple[Kind, Vec3, int]]] = {
    "PinJoint": [("hinge", Z, 0)],
    "SliderJoint": [("slide", X, 0)],
    "UniversalJoint": [("hinge", X, 0), ("hinge", Y, 1)],
    "GimbalJoint": [("hinge", X, 0), ("hinge", Y, 1), ("hinge", Z, 2)],
    "BallJoint": [("hinge", X, 0), ("hinge", Y, 1), ("hinge", Z, 2)],
    "PlanarJoint": [("slide", X, 1), ("slide", Y, 2), ("hinge", Z, 0)],
    "FreeJoint": [
        *(("slide", axis, k) for k, axis in enumerate((X, Y, Z), 3)),
        *(("hinge", axis, k) for k, axis in enumerate((X, Y, Z))),
    ],
    "WeldJoint": [],
}
"""Moves of joints, slides first, with the number of their coordinates in the file."""
CUSTOM, SPACE = "CustomJoint", "SpatialTransform"
AXES = words("translation1 translation2 translation3 rotation1 rotation2 rotation3")
CONSTRAINTS = words(
    "PointConstraint WeldConstraint ConstantDistanceConstraint CoordinateCouplerConstraint"
)
APART = Apart(
    "OpenSim",
    {
        "": ("name",),
        "Model": words(
            "<credits> <publications> <length_units> <force_units> <assembly_accuracy>"
            " <ModelVisualPreferences> <defaults> <visible> <gravity>"
        ),
        **dict.fromkeys(
            (*(f"{each}Set" for each in words("Body Joint Constraint Force Marker Frame")),),
            ("<groups>", "<defaults>"),
        ),
        **dict.fromkeys(
            words("Body Ground PhysicalOffsetFrame"),
            words(
                "<FrameGeometry> <attached_geometry> <WrapObjectSet> <VisibleObject> <mass_center>"
                " <appearance>"
            ),
        ),
        **dict.fromkeys(("frames", "components", "objects"), ("<PhysicalOffsetFrame>",)),
        "Coordinate": words(
            "<motion_type> <default_speed_value> <range> <clamped> <prescribed_function>"
            " <is_free_to_satisfy_constraints>"
        ),
        "Marker": ("<fixed>",),
        "PointToPointSpring": ("<GeometryPath>",),
        **dict.fromkeys(
            words("BushingForce TwoFrameLinker WeldConstraint PointConstraint"), ("<GeometryPath>",)
        ),
        "TransformAxis": ("<coordinates>", "<axis>"),
    },
    extended=("Model",),
)
"""Names of OpenSim without meaning for kinematics."""
EXPRESSION = "ExpressionBasedPointToPointForce"
_NUMBER = r"([-+]?[\d.]+(?:[eE][-+]?\d+)?)"
# A spring and a damper, as kincheck writes them.
_LINE = re.compile(rf"{_NUMBER}\*\(d-{_NUMBER}\)\+{_NUMBER}\*ddot")
_NAMED = re.compile(r"\w*(?:Joint|Constraint|Body|Force|Spring|Actuator|Damper)")
_INSIDE = ("objects", "components", "frames", "coordinates", "Model")
_TIED = (*words("BodySet JointSet ConstraintSet ForceSet MarkerSet CoordinateSet FrameSet"),)
GRAVITY = (0.0, -9.80665, 0.0)
BY_RATES = "its turning damping is by the angular velocity, and in OpenSim by rates of angles"
"""Gravity unless given [m/s^2]."""
DEEPEST_FRAME = 50


def whole_osim(root: Element) -> Element:
    """Return a document in the form of version 4.

    Raises:
        CaseError: OpenSim cannot read an older document, or is not installed.
    """
    version = root.attributes.get("Version", "")
    if re.fullmatch(r"[4-9]\d{4}", version):
        return root
    if not re.fullmatch(r"[1-9]\d{4}", version):
        raise root.fault(
            f"Version: found {shown(version)}, expected {VERSION_4} or more; correct it"
        )
    try:
        opensim = library("an older one", "opensim", "simbody")
    except KincheckError as error:
        problem = f"Version: found {version}, expected {VERSION_4} or more; save it by OpenSim 4"
        raise root.fault(f"{problem}, or install that: {error}") from None
    opensim.Logger.setLevelString("Off")
    with tempfile.TemporaryDirectory() as folder:
        newer = Path(folder) / "newer.osim"
        try:
            opensim.Model(str(root.file)).printToXML(str(newer))
        except RuntimeError as error:
            reason = " ".join(str(error).split())
            raise fault(
                root.file, "", f"OpenSim cannot read it: {reason}; correct the model"
            ) from None
        text = read_text(newer, 2 * LARGEST_FILE, "take out what does not move")
        return parse_xml(root.file, text)


def read_osim(root: Element) -> Tree:
    """Return the tree of a whole document, in its default pose.

    Raises:
        CaseError: an unknown joint, function or constraint, an unknown frame or coordinate.
    """
    root = _with_names(root)
    return _Reader(root).read().settled(root, APART)


def _with_names(root: Element) -> Element:
    """Return a document whose components all have names: OpenSim takes those without one too."""
    names = Names(each.attributes.get("name", "") for each in root.descendants())

    def named(element: Element) -> Iterator[Element]:
        if _NAMED.fullmatch(element.tag) and not element.attributes.get("name"):
            own = {**element.attributes, "name": names.new(element.tag.lower())}
            element = replace(element, attributes=own)
        yield element

    return root.rebuild(named)


class _Reader:
    """A model during its reading.

    Attributes:
        paths: elements with names, by their paths in the model.
        owners: paths of elements, by identity.
        coordinates: moves by name of the coordinate.
    """

    def __init__(self, root: Element) -> None:
        models = [*root.findall("Model", "ModelComponentSet")]
        if len(models) != 1 or models[0].tag != "Model":
            raise root.fault("found no single <Model>, expected one; give a model of OpenSim")
        self.model = models[0]
        name = self.model.attributes.get("name", root.file.stem)
        self.graph = Graph.of(root, f"OpenSim model {name!r} of {root.file.name}")
        self.graph.tree.zero = "its default pose"
        self.paths: dict[str, Element] = {}
        self.owners: dict[int, str] = {}
        self.ties: list[Coupling] = []
        self.values: dict[str, float] = {}
        self._name(self.model, "")

    def read(self) -> Tree:
        """Return the tree."""
        graph, tree = self.graph, self.graph.tree
        units = self.model.child("length_units")
        if units is not None and units.text not in ("", "m", "meters"):
            raise units.fault(f"found {shown(units.text)}, expected meters; convert the model")
        for element in self._all("Body"):
            self._add_body(element)
        every = [each.take() for each in self.paths.values() if each.tag.endswith("Joint")]
        coupled = {
            name
            for each in self._all("CoordinateCouplerConstraint")
            for key in ("independent_coordinate_names", "dependent_coordinate_name")
            for name in each.child_text(key).split()
        }
        joints = [found for each in every if (found := self._joint(each, coupled))]
        join(graph, joints)
        for each in self.paths.values():
            if each.tag.endswith("Constraint"):
                self._constrain(each.take())
        graph.couplings += self.ties
        self._forces()
        for marker in self._all("Marker"):
            link, place = self._frame(marker.take(), "socket_parent_frame")
            at = place * Place(marker.child_vector("location"))
            name = marker.require("name")
            name += ".marker" * (name in graph.places)
            graph.frames[name] = link, graph.places[link] * at
        x, y, z = self.model.value("gravity", 3, GRAVITY)
        tree.gravity = x, y, z
        for section in self.model.children:
            if section.tag.endswith("Set") and section.tag not in _TIED:
                for each in section.take().findall("objects", "groups", "defaults"):
                    for other in each.children:
                        tree.leave(other, other.tag)
            if section.tag == "components":
                for other in section.take().children:
                    if not other.marks & {TAKEN, LEFT}:
                        tree.leave(other, other.tag)
        return graph.hang()

    def _name(self, around: Element, path: str) -> None:
        """Give the elements in another one their paths."""
        for child in around.children:
            if child.tag in _INSIDE or child.tag in _TIED or child.tag == "Ground":
                child.take()
            if child.tag in _INSIDE:
                self._name(child, path)
            elif "name" in child.attributes or child.tag.endswith("Set"):
                own = f"{path}/{child.attributes.get('name', child.tag.lower())}"
                if own in self.paths and child.tag.endswith(("Joint", "Constraint", "Body")):
                    raise child.repeated_name(own, "the components")
                self.paths.setdefault(own, child)
                self.owners[id(child)] = own
                self._name(child, own)

    def _all(self, tag: str) -> Iterator[Element]:
        return (each for each in self.paths.values() if each.tag == tag)

    def _add_body(self, element: Element) -> None:
        graph, name = self.graph, element.take().require("name")
        if name in graph.places:
            raise element.repeated_name(name, "the bodies")
        graph.places[name], graph.elements[name] = ORIGIN, element
        xx, yy, zz, xy, xz, yz = element.value("inertia", 6, (0.0,) * 6)
        mass = element.child_number("mass", 0.0)
        if mass != 0.0:
            place = Place(element.child_vector("mass_center"))
            graph.masses[name] = mass_in(place, mass, (xx, yy, zz, xy, xz, yz))

    def _frame(self, element: Element, key: str, depth: int = 0) -> tuple[str, Place]:
        """Return the link of a frame that a socket names, and its place in the link.

        Raises:
            CaseError: there is none, or frames hang on each other in a ring.
        """
        text, owner = element.child_text(key), self.owners[id(element)]
        tried = [normpath(joined(each, text)) for each in (owner, owner.rpartition("/")[0] or "/")]
        tried += [f"/bodyset/{text}", f"/{text}"]
        found = next((path for path in tried if path in self.paths), "")
        if not found and "/ground" in tried:  # OpenSim has a ground without <Ground> too
            return self.graph.add_world(), ORIGIN
        frame = self.paths.get(found)
        if frame is None or not text or frame.tag not in ("Ground", "Body", "PhysicalOffsetFrame"):
            known = [path for path, each in self.paths.items() if each.tag == "Body"]
            raise element.unknown_name(key, text, ["/ground", *known], "a frame of the model")
        if frame.tag == "Body":
            return frame.require("name"), ORIGIN
        if frame.tag == "Ground":
            return self.graph.add_world(), ORIGIN
        if depth > DEEPEST_FRAME:
            raise frame.fault("hangs on itself by a ring of frames; correct socket_parent")
        frame.take()
        link, place = self._frame(frame, "socket_parent", depth + 1)
        angles = frame.value("orientation", 3, ZEROS)
        return link, place * Place(frame.child_vector("translation"), _turn(angles))

    def _joint(self, element: Element, coupled: set[str]) -> FramedJoint | None:
        """Return a joint; None if it leaves its link free."""
        graph, name = self.graph, element.require("name")
        if element.tag not in (*CHAINS, CUSTOM):
            raise element.unknown_name("type", element.tag, (*CHAINS, CUSTOM), "a joint")
        if _flag(element, "reverse"):
            raise element.fault("reverse: is not read, expected false; exchange its frames")
        (a, f), (b, g) = (
            self._frame(element, f"socket_{each}_frame") for each in ("parent", "child")
        )
        element.require_two(a, b)
        freedoms = (
            self._custom(element, name)
            if element.tag == CUSTOM
            else self._chain(element, name, coupled)
        )
        found = FramedJoint(name, element, (a, b), (f, g), freedoms)
        if element.tag == "FreeJoint" and a in graph.fixed and freedoms[-1].kind == "ball":
            motion, _ = found.motion(ORIGIN)
            graph.places[b] = f * motion * g.inverse
            return None
        return found

    def _coordinates(self, element: Element, name: str, count: int) -> list[Element]:
        """Return the coordinates of a joint, with those that have their default name."""
        given = [
            each
            for around in element.findall("coordinates")
            for each in around.findall("Coordinate")
        ]
        for k, each in enumerate(given):
            if not each.attributes.get("name"):
                own = {**each.attributes, "name": f"{name}_coord_{k}"}
                given[k] = replace(each, attributes=own)
        for k in range(len(given), count):
            named = {"name": f"{name}_coord_{k}"}
            given.append(Element(element.file, "Coordinate", named, element.line))
        if element.tag != CUSTOM and len(given) > count:
            raise element.fault(f"found {len(given)} coordinates, expected {count}; correct it")
        return given

    def _chain(self, element: Element, name: str, coupled: set[str]) -> list[FramedFreedom]:
        chain = CHAINS[element.tag]
        coordinates = self._coordinates(element, name, len(chain))
        whole = element.tag in ("BallJoint", "FreeJoint") and not any(
            _is_still(each) or each.require("name") in coupled for each in coordinates
        )
        if not whole:
            return [self._freedom(coordinates[k], kind, axis) for kind, axis, k in chain]
        turn = _turn([self._default(each) for each in coordinates[:3]])
        slides = [
            self._freedom(coordinates[k], kind, axis) for kind, axis, k in chain if kind == "slide"
        ]
        return [*slides, FramedFreedom(name, "ball", X, element, turn=turn)]

    def _default(self, coordinate: Element) -> float:
        """Return the value of a coordinate in the pose; of a prescribed one, by its function.

        Raises:
            CaseError: the motion is no rest.
        """
        own = coordinate.child_number("default_value", 0.0)
        if (motion := _prescribed(coordinate)) is None:
            return own
        first, *more = function(motion).powers
        value, *slopes = first
        if more or slopes:
            raise coordinate.fault(
                f"is prescribed by a {motion.tag} of time, expected a Constant: a model says no"
                " time; say <prescribed>false</prescribed>, and how it moves by --drive"
            )
        return value

    def _freedom(self, coordinate: Element, kind: Kind, axis: Vec3) -> FramedFreedom:
        """Return the move of a coordinate; lock it if the file does."""
        name = coordinate.require("name")
        if name in self.values:
            raise coordinate.repeated_name(name, "the coordinates")
        self.values[name] = self._default(coordinate)
        if _is_still(coordinate):
            self.ties.append(Coupling(f"{name}.lock", {name: 1.0}, {}, (0.0,), coordinate))
        clamped = _flag(coordinate, "clamped")
        limit = Limit(*coordinate.value("range", 2, ())) if clamped else NO_LIMIT
        return FramedFreedom(name, kind, axis, coordinate, self.values[name], limit=limit)

    def _custom(self, element: Element, name: str) -> list[FramedFreedom]:
        """Return the moves of a custom joint: of each coordinate an axis moved as much as itself;
        other axes follow. One without such an axis turns a hinge, and another one back.
        """
        coordinates = {each.require("name"): each for each in self._coordinates(element, name, 0)}
        space = element.child(SPACE)
        if space is None:
            raise element.fault(f"<{SPACE}>: missing, expected six axes; add it")
        given = {each.require("name"): each for each in space.findall("TransformAxis")}
        curves: dict[str, tuple[str, PiecewisePolynomial]] = {}
        for each in AXES:
            curves[each] = curve_of(given[each], coordinates) if each in given else ("", ZERO)
        leads = {
            coordinate: each
            for each in (*AXES[:3], *AXES[3:])
            if (coordinate := curves[each][0]) and is_own(curves[each][1])
        }
        used = {coordinate for coordinate, _ in curves.values()}
        for coordinate, own in coordinates.items():
            if coordinate not in used:
                raise own.fault("moves no axis of its joint, expected one; correct the joint")
        freedoms: list[FramedFreedom] = []

        def follow(follower: str, kind: Kind, axis: Vec3, of: str, curve: PiecewisePolynomial):
            own = given.get(follower.removeprefix(f"{name}."), coordinates[of])
            self.values[follower] = value = curve.at(self._default(coordinates[of]))[0]
            freedoms.append(FramedFreedom(follower, kind, axis, own, value))
            self._follow(f"{follower}.curve", follower, of, curve, own)

        for k, each in enumerate(AXES):
            if k == 3:  # a hinge of the coordinate, and one back
                for free in [x for x in coordinates if x not in leads]:
                    freedoms.append(self._freedom(coordinates[free], "hinge", X))
                    follow(f"{free}.back", "hinge", X, free, polynomial(0.0, -1.0))
            coordinate, curve = curves[each]
            kind: Kind = "slide" if k < 3 else "hinge"
            axis = (X, Y, Z)[k % 3]
            if each in given and (child := given[each].child("axis")) is not None:
                axis = child.direction(child.text_numbers(3))
            constant = curve.powers[0][0]
            if leads.get(coordinate) == each:
                if constant:
                    freedoms.append(FramedFreedom("", kind, axis, element, constant, stands=True))
                slope = curve.powers[0][1]
                freedoms.append(self._freedom(coordinates[coordinate], kind, slope * axis))
            elif coordinate:
                follow(f"{name}.{each}", kind, axis, coordinate, curve)
            elif constant:
                freedoms.append(FramedFreedom("", kind, axis, element, constant, stands=True))
        return freedoms

    def _follow(
        self, name: str, follower: str, leader: str, curve: PiecewisePolynomial, element: Element
    ) -> None:
        """Let a coordinate follow a curve of another one; the tie is of their changes."""
        at, value = self._default_of(leader), self.values[follower]
        coefficients: list[float] = []
        if not curve.knots:
            changed = Polynomial(curve.powers[0])(Polynomial([at, 1.0])) - value
            coefficients = changed.coef.tolist()
        points = tuple((x - at, y - value) for x, y in curve.knots)
        pair = {follower: 1.0}, {leader: 1.0}
        self.ties.append(Coupling(name, *pair, coefficients, element, points))

    def _default_of(self, name: str) -> float:
        coordinate = next((x for x in self._all("Coordinate") if x.require("name") == name), None)
        return self.values.get(name, 0.0) if coordinate is None else self._default(coordinate)

    def _constrain(self, element: Element) -> None:
        graph, name = self.graph, element.require("name")
        if element.tag not in CONSTRAINTS:
            raise element.fault(
                f"is a {element.tag}, expected one of {', '.join(CONSTRAINTS)}; leave it out by"
                f" --without {name}"
            )
        if not _flag(element, "isEnforced", default=True):
            graph.tree.leave(element, "constraints that are not enforced")
            return
        if element.tag == "CoordinateCouplerConstraint":
            self._couple(name, element)
            return
        welded = element.tag == "WeldConstraint"
        keys = ("socket_frame{}",) if welded else ("socket_body_{}", "location_body_{}")
        links, (first, second) = self._ends(element, *keys)
        if element.tag == "ConstantDistanceConstraint":
            length = element.child_number("constant_distance", 0.0)
            graph.rods.append(Closure(name, links, (first, second), element, "distance", length))
            return
        moves = () if welded else (Move(name, "ball", first.at, X, element),)
        graph.loops.append(Joint(name, links, moves, element, (first, second)))

    def _couple(self, name: str, element: Element) -> None:
        """Let a coordinate follow others."""
        follower = element.child_text("dependent_coordinate_name")
        leaders = element.child_text("independent_coordinate_names").split()
        for key, each in [("dependent", follower), *(("independent", x) for x in leaders)]:
            if each not in self.values:
                raise element.unknown_name(f"{key}_coordinate", each, self.values, "a coordinate")
        scale = element.child_number("scale_factor", 1.0)
        around = element.child("coupled_coordinates_function")
        functions = [each.take() for each in around.children] if around else []
        if len(functions) != 1:
            raise element.fault("coupled_coordinates_function: expected one function; correct it")
        if len(leaders) == 1:
            curve = function(functions[0]).scaled(1.0, scale)
            self._follow(name, follower, leaders[0], curve, element)
            return
        if functions[0].tag != "LinearFunction":
            raise element.fault("is a curve of several coordinates, expected a line; correct it")
        numbers = functions[0].value("coefficients", len(leaders) + 1)
        weights = {follower: 1.0}
        for leader, slope in zip(leaders, numbers, strict=False):
            weights[leader] = weights.get(leader, 0.0) - scale * slope
        apart = scale * numbers[-1] - sum(w * self.values[x] for x, w in weights.items())
        self.ties.append(Coupling(name, weights, {}, (apart,), element))

    def _forces(self) -> None:
        """Add springs and motors; count other forces."""
        tree = self.graph.tree
        forces = [
            each
            for section in self.model.findall("ForceSet")
            for objects in section.findall("objects")
            for each in objects.children
        ]
        for each in forces:
            coordinate = each.child_text("coordinate")
            if not _flag(each.take(), "appliesForce", default=True):
                tree.leave(each, "forces that are not applied")
            elif each.tag == "SpringGeneralizedForce" and coordinate in self.values:
                numbers = [
                    each.child_number(key, 0.0) for key in ("stiffness", "viscosity", "rest_length")
                ]
                own, others = Spring(*numbers), tree.springs.get(coordinate)
                tree.springs[coordinate] = own if others is None else own.beside(others)
            elif each.tag == "BushingForce":
                self._add_bushing(each)
            elif each.tag == "PointToPointSpring":
                self._add_spring(each)
            elif each.tag == EXPRESSION and (
                found := _LINE.fullmatch(each.child_text("expression"))
            ):
                stiffness, length, damping = map(float, found.groups())
                ends = self._ends(each, "body{}", "point{}")
                self._add_strut(each, *ends, Spring(stiffness, damping, length))
            else:
                if each.tag.endswith("CoordinateActuator"):
                    tree.add_motor(each.tag, {coordinate} & self.values.keys())
                tree.leave(each, each.tag)

    def _ends(
        self, element: Element, socket: str, point: str = ""
    ) -> tuple[tuple[str, str], tuple[Place, Place]]:
        """Return two links and a frame of each, global, by the keys of sockets and points."""

        def end(k: int) -> tuple[str, Place]:
            link, frame = self._frame(element, socket.format(k))
            return link, frame * Place(element.child_vector(point.format(k))) if point else frame

        (a, f), (b, g) = map(end, (1, 2))
        element.require_two(a, b)
        return (a, b), global_frames(self.graph.places, (a, b), (f, g))

    def _add_spring(self, element: Element) -> None:
        stiffness, rest = (element.child_number(key, 0.0) for key in ("stiffness", "rest_length"))
        ends = self._ends(element, "socket_body{}", "point{}")
        self._add_strut(element, *ends, Spring(stiffness, 0.0, rest))

    def _add_bushing(self, element: Element) -> None:
        laws = [
            element.value(f"{kind}_{law}", 3, ZEROS)
            for law in ("stiffness", "damping")
            for kind in ("translational", "rotational")
        ]
        numbers = [(x, y, z) for x, y, z in laws]
        law = BushingLaw(*numbers, law=Law.CARDAN)
        self._add_strut(element, *self._ends(element, "socket_frame{}"), law)
        if any(law.turning_damping):
            self.graph.tree.notes.append(f"{element}: {BY_RATES}")

    def _add_strut(
        self,
        element: Element,
        links: tuple[str, str],
        places: tuple[Place, Place],
        law: Spring | BushingLaw,
    ) -> None:
        name = element.require("name")
        self.graph.struts.append(Strut(name, links, places, law, element, element.tag))


def _turn(angles: Sequence[float]) -> Quat:
    """Return the turns about x, y and z of the body, one after the other."""
    return unit_quaternion(euler_turn("xyz", angles))


def _prescribed(coordinate: Element) -> Element | None:
    """Return the function of a prescribed coordinate; None of another one.

    Raises:
        CaseError: it has several.
    """
    if not _flag(coordinate, "prescribed"):
        return None
    around = coordinate.child("prescribed_function")
    if around is None or not around.children:
        return None
    if len(around.children) > 1:
        raise around.fault("found several functions, expected one; remove the others")
    return around.children[0].take()


def _is_still(coordinate: Element) -> bool:
    """Return whether a coordinate keeps its value."""
    return _flag(coordinate, "locked") or _prescribed(coordinate) is not None


def _flag(element: Element, tag: str, *, default: bool = False) -> bool:
    child = element.child(tag)
    if child is None:
        return default
    if child.text not in ("true", "false"):
        raise child.fault(f"found {shown(child.text)}, expected true or false; correct the text")
    return child.text == "true"
