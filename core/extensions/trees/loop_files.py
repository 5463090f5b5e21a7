"""Files beside a URDF, with its loops: NAME.constraints.json, as `kincheck export --to urdf` writes
it, and NAME.yaml or loop_closures.yaml, which have keys of three kinds.

Of example-parallel-robots (github.com/Gepetto/example-parallel-robots):

closed_loop: [[frame, frame], ...]     links of the URDF that coincide
type: ["6d", "3d", ...]                all, or only the points
name_mot: [joint, ...]                 joints with a motor
joint_name: [joint, ...]               joints of another type than the URDF can say
joint_type: [SPHERICAL, UJOINT_XY, FIXED, ...]

Of scikit-robot (github.com/iory/scikit-robot) and converters of CAD with the same file, in the axes
of the base in the zero pose:

closures: [{link_a: link, link_b: link, point: [x, y, z], axis: [x, y, z]}, ...]
independent: [joint, ...]              joints with a motor
dependent: [joint, ...]                the others

Of RoboNex (github.com/Humanoid-Project/robonex-description), in the axes of both links:

ball_loops: [{name: ..., parent: link, child: link, parent_xyz: [...], child_xyz: [...]}, ...]
pin_loops: the same with axis: [x, y, z]
ball_upgrades: [joint, ...]            joints as balls

All conditions of a joint in NAME.constraints.json together give its freedoms: `offset` leaves
slides across its direction, and pairs of `directions` leave turns. The joint is a chain of slides
and turns from the zero pose, in which all conditions hold.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, cast

import msgspec

from ...algebra import Vec3, X, Y, Z, cross, quat, vec
from ...case.io.document import (
    Section,
    fault,
    parse,
    read_text,
    shown,
    unknown_name,
    usable,
)
from ...case.io.lines import join, place
from ...errors import WARNING, CaseError, remedy, shortened, similar
from ...joints.base import triad
from ...joints.polynomial import HIGHEST
from ...mechanism.mechanism import Vector
from ..xml.element import Element, unit_vector
from ..yaml.reading import parse_yaml
from .graph import Freedom, Graph, Joint
from .place import ORIGIN, Place, unit_quaternion
from .tree import Closure, Coupling, Kind, Move, Tree, require_spline

CONSTRAINTS = ".constraints.json"
YAML = (".yaml", ".yml")
LARGEST_FILE = 4_000_000
LOOPS = "loop_closures"
# The folder of the URDF, and in a package of ROS that of the package, beside urdf/.
_PLACES = ("", "config/", "../", "../config/")
_LOOPS = ".*(?:loop|closure|closed|constraint).*"
_CLOSES = re.compile(r"loop|clos|constrain|mimic|coupl|equal")
MOST_NAMED = 8
SCHEMA = "kincheck-constraints/1"
RELATIONS = ("linear", "polynomial", "spline")
# Rounding of exported numbers, relative to the size of the numbers.
OPEN = 1e-9
_UNIVERSAL = re.compile(r"UJOINT_([XYZ])([XYZ])")
_TYPES = {"SPHERICAL": "spherical", "FIXED": "fixed"}


class LinkPoint(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A point of a link, in its axes [m]."""

    link: str
    point: Vector


class LinkDirection(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A direction of a link, in its axes [-]."""

    link: str
    direction: Vector


class Condition(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A condition of a joint; the fields depend on its kind."""

    joint: str
    kind: Literal[
        "coincident", "distance", "directions", "offset", "linear", "polynomial", "spline"
    ]
    i: LinkPoint | None = None
    j: LinkPoint | None = None
    x: LinkDirection | None = None
    y: LinkDirection | None = None
    value: float = 0.0
    weights: dict[str, float] = {}
    driven: str = ""
    driving: str = ""
    coefficients: Annotated[list[float], msgspec.Meta(max_length=HIGHEST + 1)] = []
    points: tuple[tuple[float, float], ...] = ()


class BodyFrame(msgspec.Struct, frozen=True):
    """The frame of a body in its link."""

    link: str
    origin: Vector
    euler_parameters: tuple[float, float, float, float]


class ConstraintsFile(msgspec.Struct, frozen=True):
    """NAME.constraints.json; what a reader of the URDF needs not know has no type."""

    constraints: list[Condition]
    schema: Any
    bodies: dict[str, BodyFrame] = {}
    mechanism: Any = None
    units: Any = None
    meaning: Any = None
    points: Any = None
    start: Any = None


class HingeOfBase(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A closing hinge, in the axes of the base; a ball without an axis."""

    link_a: str
    link_b: str
    point: Vector
    axis: Vector | None = None
    name: str = ""


class LoopOfLinks(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A point of each of two links, in its axes, and an axis in those of the first."""

    parent: str
    child: str
    parent_xyz: Vector
    child_xyz: Vector
    axis: Vector | None = None
    name: str = ""


class PairsFile(msgspec.Struct, frozen=True):
    """NAME.yaml or loop_closures.yaml; its other keys are for control programs."""

    closed_loop: list[tuple[str, str]] = []
    type: list[str] = []
    name_mot: list[str] = []
    joint_name: list[str] = []
    joint_type: list[str] = []
    closures: list[HingeOfBase] = []
    independent: list[str] = []
    dependent: list[str] = []
    ball_loops: list[LoopOfLinks] = []
    pin_loops: list[LoopOfLinks] = []
    ball_upgrades: list[str] = []

    @property
    def links(self) -> set[str]:
        """The links and frames it joins."""
        found = {name for pair in self.closed_loop for name in pair}
        found |= {name for each in self.closures for name in (each.link_a, each.link_b)}
        rows = (*self.ball_loops, *self.pin_loops)
        return found | {name for each in rows for name in (each.parent, each.child)}


@dataclass(frozen=True)
class LoopFiles:
    """Content of the files beside a URDF.

    Attributes:
        pairs: pairs of frames, which the zero pose need not bring together.
        types: types of joints in place of those of the URDF; letters for a universal joint.
        notes: on unread files and keys.
    """

    constraints: tuple[Path, ConstraintsFile] | None = None
    pairs: Sequence[tuple[Path, PairsFile]] = ()
    types: Mapping[str, str] = field(default_factory=dict[str, str])
    notes: Sequence[str] = ()

    @property
    def names(self) -> list[str]:
        """Names of the files."""
        return [each[0].name for each in (self.constraints, *self.pairs) if each]

    def add(self, graph: Graph) -> None:
        """Add the loops to the links of a robot.

        Raises:
            CaseError: they name unknown links, or do not hold in the zero pose.
        """
        if self.constraints is not None:
            _add_constraints(*self.constraints, graph)
        for pairs in self.pairs:
            _add_pairs(*pairs, graph)
        graph.tree.notes += self.notes

    def place(self, tree: Tree) -> None:
        """Give links the frames of the bodies they are written of, whose joints and numbers a URDF
        has in other axes.

        Raises:
            CaseError: a frame has no turn.
        """
        if self.constraints is None:
            return
        file, found = self.constraints
        for name, each in found.bodies.items():
            if each.link != name or name not in tree.places:
                continue
            if not all(map(usable, (*each.origin, *each.euler_parameters))) or not any(
                each.euler_parameters
            ):
                raise fault(file, join("bodies", name), "has no frame; export the case anew")
            turn = unit_quaternion(quat(each.euler_parameters))
            frame = Place(vec(each.origin), turn)
            tree.places[name] = tree.places[name] * frame
            if name in tree.moving:
                tree.moving[name] = tree.moving[name] * frame
                back = frame.inverse
                masses = tree.masses.get(name, ())
                tree.masses |= {name: [mass.in_frame(back) for mass in masses]} if masses else {}


def read_loop_files(root: Element) -> LoopFiles:
    """Read the files beside a URDF, of the same name with another ending.

    Raises:
        CaseError: one of them cannot be read, or PyYAML is missing.
    """
    file, constraints, types = root.file, None, dict[str, str]()
    own = file.with_suffix(CONSTRAINTS)
    if own.exists():
        constraints = own, _constraints(own)
    joints = {each.attributes.get("name", "") for each in root.findall("joint")}
    frames = joints | {each.attributes.get("name", "") for each in root.findall("link")}
    found: list[tuple[Path, PairsFile]] = []
    notes: list[str] = []
    beside = _paired(file)
    for paired in beside:
        pairs, unread = _pairs(paired)
        if pairs.links and not pairs.links & frames:
            notes.append(f"{paired.name} beside it is of other links, and not read")
            continue
        if unread:
            where = shortened([place(paired, name) for name in unread], MOST_NAMED)
            notes.append(f"{paired.name}: not read: {where}")
        for key, name in [
            *(("joint_name", name) for name in pairs.joint_name),
            *(("ball_upgrades", name) for name in pairs.ball_upgrades),
            *(("independent", name) for name in pairs.independent),
            *(("dependent", name) for name in pairs.dependent),
            *(("name_mot", name) for name in pairs.name_mot),
        ]:
            if name not in joints:
                raise unknown_name(paired, key, name, joints, f"a joint of {file.name}")
        for name, kind in zip(pairs.joint_name, pairs.joint_type, strict=True):
            types[name] = _TYPES.get(kind, kind.removeprefix("UJOINT_"))
        types |= dict.fromkeys(pairs.ball_upgrades, "spherical")
        found.append((paired, pairs))
    notes += unread_beside(file, own, *beside)
    return LoopFiles(constraints, found, types, notes)


def _paired(file: Path) -> list[Path]:
    """Return the YAML beside a URDF, in its folder or in those of packages of ROS."""
    folder, stem = file.parent, file.stem
    own = [file.with_suffix(each) for each in YAML]
    named = [f"{stem}{mark}{LOOPS}" for mark in "._-"] + [LOOPS]
    places = [f"{place}{name}{end}" for place in _PLACES for name in named for end in YAML]
    return [each for each in (*own, *(folder / name for name in places)) if each.is_file()]


def unread_beside(file: Path, *read: Path) -> list[str]:
    """Return a warning for each file beside a model that may hold its loops, by its name.

    Args:
        read: files beside a URDF that are read; none of another format, whose model may lie beside
            the URDF that has them.
    """
    try:
        names = [each.name for each in os.scandir(file.parent) if each.is_file()]
    except OSError:
        return []
    if not read and any(name.lower().endswith(".urdf") for name in names):
        return []
    data = r"\.(?:ya?ml|json|toml)"
    own = rf"{re.escape(file.stem)}{data}"
    other = re.compile(rf"{_LOOPS}(?:{data}|\.(?:xml|csv|txt|ini|cfg))|{own}", re.IGNORECASE)
    robots = [Path(name).stem for name in names if name.endswith(file.suffix)]

    def is_own(name: str) -> bool:
        owner = max((each for each in robots if name.startswith(each)), key=len, default=file.stem)
        if owner != file.stem or file.parent / name in {file, *read}:
            return False
        with (file.parent / name).open("rb") as data:  # what kincheck writes begins with its schema
            return b"kincheck-" not in data.read(200)

    return [
        f"{WARNING}{name} beside it may close loops, and is not read; write them into {file.name}"
        for name in sorted(names)
        if other.fullmatch(name) and is_own(name)
    ]


def _text(file: Path) -> str:
    return read_text(file, LARGEST_FILE, "it holds the loops of one robot; take out the rest")


def _misfit(file: Path, error: msgspec.ValidationError, advice: str) -> CaseError:
    """Return the error of a value that has another type than the format says, by its key."""
    what, _, path = str(error).partition(" - at `$")
    return fault(file, path.strip("`."), f"{what}; {advice}")


def _constraints(file: Path) -> ConstraintsFile:
    tables: dict[str, Any] = parse(file, _text(file))
    if tables.get("schema") != SCHEMA:
        raise fault(
            file,
            "schema",
            f"found {tables.get('schema')!r}, expected {SCHEMA!r}, as kincheck export writes it;"
            " rename a file of another kind",
        )
    Section(file, "", tables).require_keys(ConstraintsFile.__struct_fields__)
    try:
        return msgspec.convert(tables, ConstraintsFile)
    except msgspec.ValidationError as error:
        raise _misfit(file, error, "export the case anew") from None


def _pairs(file: Path) -> tuple[PairsFile, list[str]]:
    """Return the content of a file, and its unread keys.

    Raises:
        CaseError: it is no such file, or one of those keys may close loops.
    """
    data: object = parse_yaml(file, _text(file))
    known = PairsFile.__struct_fields__
    keys = cast("dict[str, Any]", data) if isinstance(data, dict) else {}
    unread = [name for name in keys if name not in known]
    for name in unread:
        if similar(name, known) or _CLOSES.search(name.lower()):
            raise unknown_name(file, name, name, known, f"a key of {', '.join(known)}")
    try:
        found = msgspec.convert(data, PairsFile, strict=False)
    except msgspec.ValidationError as error:
        advice = f"expected {', '.join(known)}; correct it, or rename a file of another kind"
        raise _misfit(file, error, advice) from None
    for key, values, other, others in (
        ("type", found.type, "closed_loop", found.closed_loop),
        ("joint_type", found.joint_type, "joint_name", found.joint_name),
    ):
        if len(values) != len(others):
            raise fault(
                file,
                key,
                f"found {len(values)}, expected {len(others)}, one for each {other}; complete it",
            )
    for kind in found.joint_type:
        if kind not in _TYPES and not _UNIVERSAL.fullmatch(kind):
            known = (*_TYPES, "UJOINT_XY")
            raise unknown_name(
                file, "joint_type", kind, known, f"{', '.join(known)}, or other axes"
            )
    for kind in found.type:
        if kind.lower() not in ("3d", "6d"):
            raise fault(file, "type", f"found {shown(kind)}, expected 3d or 6d; correct it")
    return found, unread


def _add_pairs(file: Path, pairs: PairsFile, graph: Graph) -> None:
    # as in Pinocchio, a joint has a frame too: that of its link
    frames = {joint.name: joint.links[1] for joint in graph.joints}
    frames |= {name: name for name in graph.places}
    for k, (names, kind) in enumerate(zip(pairs.closed_loop, pairs.type, strict=True)):
        element = Element(file, "", {}, 1, words=f"closed_loop[{k}]: {' = '.join(names)}")
        for name in names:
            if name not in frames:
                raise element.unknown_name("link", name, frames, "a link or joint")
        first, second = (frames[name] for name in names)
        places = graph.places[first], graph.places[second]
        title = " = ".join(names)
        freedoms: list[Freedom] = [("", "ball", X)] if kind.lower() == "3d" else []
        links, at = (first, second), places[0].at
        graph.loops.append(Joint.of(title, links, at, freedoms, element, frames=places))
    for k, each in enumerate(pairs.closures):
        point = vec(each.point)
        element = Element(file, "", {}, 1, words=f"closures[{k}]")
        _add_loop(graph, each, (each.link_a, each.link_b), (point, point), element)
    for key, rows in (("ball_loops", pairs.ball_loops), ("pin_loops", pairs.pin_loops)):
        for k, each in enumerate(rows):
            element = Element(file, "", {}, 1, words=f"{key}[{k}]")
            if (each.axis is None) != (key == "ball_loops"):
                raise element.fault("axis: expected one in pin_loops alone; correct it")
            links = each.parent, each.child
            ends = zip(links, (each.parent_xyz, each.child_xyz), strict=True)
            points = [graph.places.get(link, ORIGIN).point(vec(at)) for link, at in ends]
            _add_loop(graph, each, links, points, element)
    coordinates = {move.name for joint in graph.joints for move in joint.moves}
    graph.tree.actuated |= coordinates & {*pairs.name_mot, *pairs.independent}


def _add_loop(
    graph: Graph,
    row: HingeOfBase | LoopOfLinks,
    links: tuple[str, str],
    points: Sequence[Vec3],
    element: Element,
) -> None:
    """Add a hinge or ball between points of two links, global."""
    for link in links:
        if link not in graph.places:
            raise element.unknown_name("link", link, graph.places, "a link")
    element.require_two(*links)
    freedoms: list[Freedom] = [("", "ball", X)]
    if row.axis is not None:
        of_base = isinstance(row, HingeOfBase)
        axis = element.direction(row.axis, "axis")
        freedoms = [("", "hinge", axis if of_base else graph.places[links[0]].direction(axis))]
    name = row.name or " = ".join(links)
    frames = Place(points[0]), Place(points[1])
    graph.loops.append(Joint.of(name, links, points[0], freedoms, element, frames=frames))


def _add_constraints(file: Path, found: ConstraintsFile, graph: Graph) -> None:
    groups: dict[str, list[Condition]] = {}
    for each in found.constraints:
        if each.kind not in RELATIONS:
            groups.setdefault(each.joint, []).append(each)
    for name, conditions in groups.items():
        element = _element(file, found.constraints.index(conditions[0]), name)
        _Group(element, name, conditions, graph).add()
    names = {*groups}
    for k, each in enumerate(found.constraints, 1):
        if each.kind not in RELATIONS:
            continue
        name = each.joint if each.joint not in names else f"{each.joint}.{k}"
        names.add(name)
        element = _element(file, k - 1, each.joint)
        if each.kind == "linear":
            coupling = Coupling(name, each.weights, {}, (0.0,), element)
        elif each.coefficients or each.points:
            pair = {each.driven: 1.0}, {each.driving: 1.0}
            coupling = Coupling(name, *pair, each.coefficients, element, each.points)
            require_spline(element, each.points)
        else:
            raise element.fault("found no coefficients, expected some; export the case anew")
        graph.couplings.append(coupling)


def _element(file: Path, k: int, joint: str) -> Element:
    return Element(file, "", {}, 1, words=f"constraints[{k}]: joint {joint!r}")


class _Group:
    """The conditions of one joint, by their kinds."""

    def __init__(
        self, element: Element, name: str, conditions: Sequence[Condition], graph: Graph
    ) -> None:
        self.element, self.name, self.graph = element, name, graph
        self.coincident, self.distance, self.offset, self.directions = (
            [each for each in conditions if each.kind == kind]
            for kind in ("coincident", "distance", "offset", "directions")
        )
        first = conditions[0]
        ends = (first.i, first.j) if first.i and first.j else (first.x, first.y)
        if ends[0] is None or ends[1] is None:
            raise self._fault("found no two links, expected i and j, or x and y")
        self.links = self._link(ends[0].link), self._link(ends[1].link)

    def add(self) -> None:
        """Add the joint."""
        if self.distance:
            self._add_distance()
            return
        found = [*self._slides(), *self._turns()]
        freedoms: list[Freedom] = [
            (f".{k}" * (len(found) > 1), *each) for k, each in enumerate(found, 1)
        ]
        joint = Joint.of(self.name, self.links, self._pivot(), freedoms, self.element)
        self.graph.loops.append(joint)

    def _fault(self, problem: str) -> CaseError:
        return self.element.fault(f"{problem}; export the case anew")

    def _link(self, name: str) -> str:
        if name not in self.graph.places:
            raise self._fault(
                f"found {shown(name)}, expected a link; {remedy(name, self.graph.places)}"
            )
        return name

    def _point(self, end: LinkPoint | None) -> Vec3:
        """Return a point, global."""
        if end is None:
            raise self._fault("found a condition without i and j, expected two points")
        return self.graph.places[self._link(end.link)].point(vec(end.point))

    def _axis(self, along: LinkDirection | None) -> Vec3:
        """Return a direction, global, length one."""
        if along is None:
            raise self._fault("found a condition without x, expected a direction")
        found = self.graph.places[self._link(along.link)].direction(vec(along.direction))
        if not math.hypot(*found) > 0.0:
            raise self._fault("found a direction of length zero, expected an axis")
        return unit_vector([*found])

    def _require_zero(self, residual: float, scale: float) -> None:
        """Refuse a condition with a residual in the zero pose."""
        if abs(residual) > OPEN * max(1.0, scale):
            raise self._fault(
                f"is open by {residual:.3g} in the zero pose, expected a condition that holds there"
            )

    def _pivot(self) -> Vec3:
        """Return the point of the second link about which it turns, global."""
        for each in (*self.coincident, *self.offset):
            return self._point(each.j)
        return self.graph.places[self.links[1]].at

    def _add_distance(self) -> None:
        """Add a rod; with an offset across a hinge on its first link."""
        (rod,) = self.distance
        p, q = self._point(rod.i), self._point(rod.j)
        apart = q - p
        length = math.sqrt(apart @ apart)
        self._require_zero(length - rod.value, rod.value)
        if not self.offset:
            places = Place(p), Place(q)
            self.graph.rods.append(
                Closure(self.name, self.links, places, self.element, "distance", length)
            )
            return
        (across,) = self.offset
        hinge = Move(self.name, "hinge", p, self._axis(across.x), self.element)
        moves = hinge, Move(f"{self.name}.ball", "ball", q, X, self.element)
        self.graph.loops.append(Joint(self.name, self.links, moves, self.element))

    def _slides(self) -> list[tuple[Kind, Vec3]]:
        """Return the slides left by offsets; none with a common point."""
        for each in self.coincident:
            apart = self._point(each.j) - self._point(each.i)
            self._require_zero(math.sqrt(apart @ apart), 1.0)
            return []
        held: list[Vec3] = []
        for each in self.offset:
            x, p, q = self._axis(each.x), self._point(each.i), self._point(each.j)
            self._require_zero(x @ (q - p) - each.value, abs(each.value))
            held.append(x)
        match held:
            case []:
                free = [X, Y, Z]
            case [x]:
                f, g, _ = triad((*x,))
                free = [f, g]
            case [x, y]:
                free = [unit_vector([*cross(x, y)])]
            case _:
                raise self._fault(f"found {len(held)} offsets, expected two at most")
        return [("slide", axis) for axis in free]

    def _turns(self) -> list[tuple[Kind, Vec3]]:
        """Return the turns left by pairs of directions."""
        pairs: list[tuple[Vec3, Vec3]] = []
        for each in self.directions:
            x, y = self._axis(each.x), self._axis(each.y)
            self._require_zero(x @ y - each.value, 1.0)
            pairs.append((x, y))
        match pairs:
            case []:
                return [("ball", X)]
            case [(x, y)]:
                return [("hinge", x), ("hinge", y)]
            case [(_, y), (_, z)] if abs(y @ z) > 1.0 - OPEN:
                return [("hinge", y)]
            case [_, _, _]:
                return []
            case _:
                raise self._fault(f"found {len(pairs)} pairs of directions of no joint")
