"""Joints and couplers of a dataset: constraints of two markers and their assembly, and relations of
two joints.

Adams Solver moves parts to agreement. So does the assembly: the least motion of all parts that
closes the rows, by Gauss-Newton, from the parts as the dataset places them.
"""

from __future__ import annotations

import math
import re
import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...case.curves import EXACT
from ...case.io.document import explained
from ...errors import shortened
from ...joints import (
    ConstantVelocity,
    Coupler,
    Cylindrical,
    Distance,
    Fixed,
    Inline,
    InPlane,
    Joint,
    OrientationLock,
    ParallelAxes,
    PerpendicularAxes,
    Planar,
    Revolute,
    Screw,
    Spherical,
    Translational,
    Universal,
)
from ...joints.base import AxialJoint
from ...trajectory import Array
from ..trees.linear_relation import linear_relation
from .dataset import Dataset, Statement
from .functions import linear
from .model import Coordinate, Frame, Marker, Model, Places, coordinates, rotations

_POINT, _LINE, _PLANE = ("dx", "dy", "dz"), ("dx", "dy"), ("dz",)
_AXIS, _FRAME = ("zx", "zy"), ("zx", "zy", "xy")
ROWS: Mapping[str, Sequence[str]] = {
    "REVOLUTE": (*_POINT, *_AXIS),
    "TRANSLATIONAL": (*_LINE, *_FRAME),
    "CYLINDRICAL": (*_LINE, *_AXIS),
    "SPHERICAL": _POINT,
    "UNIVERSAL": (*_POINT, "zz"),
    "HOOKE": (*_POINT, "xy"),
    "FIXED": (*_POINT, *_FRAME),
    "PLANAR": (*_PLANE, *_AXIS),
    "SCREW": (*_LINE, *_AXIS),
    "CONVEL": (*_POINT, "xy-yx"),
    "ATPOINT": _POINT,
    "INLINE": _LINE,
    "INPLANE": _PLANE,
    "ORIENTATION": _FRAME,
    "PARALLEL_AXES": _AXIS,
    "PERPENDICULAR": ("zz",),
    "DISTANCE": ("d",),
}
"""Rows of each kind: dx is what I is off J along J's x axis, zy the product of I's z and J's y."""
MOST_STEPS, LONGEST_STEP = 100, 0.3
# As in the assembly of other models: rounding of composed frames, what is too far, and gaps of
# several joints that add up.
CLOSED, FAR, ADDED_UP = 1e-12, 0.1, 10.0
# Singular values of rows redundant within rounding.
WEAK = 1e-9
# What prints numbers writes six digits and more.
FEWEST = 6
_PLACED = ("QP", "QG", "ZP", "XP", "ZG", "XG", "REULER")
MOST_TOLD = 8


@dataclass(frozen=True, eq=False)
class Link:
    """A constraint of two markers.

    Attributes:
        length: of a DISTANCE [m].
    """

    statement: Statement
    kind: str
    i: Marker
    j: Marker
    length: float = 0.0

    def frames(self, places: Places) -> tuple[Frame, Frame]:
        """Return the frames of I and J, global."""
        return self.i.place.relative_to(places[self.i.part]), self.j.place.relative_to(
            places[self.j.part]
        )

    @property
    def rows(self) -> Sequence[str]:
        """Its rows; without the x axes if one of them is not known."""
        known = self.i.place.turned and self.j.place.turned
        return [row for row in ROWS[self.kind] if known or not row.startswith("xy")]


def tolerance_of(dataset: Dataset, size: float) -> tuple[float, str]:
    """Return the gaps that the digits of a dataset leave [m], and why.

    Numbers of six digits and more count, half of which have as many or more; without any, those
    that somebody set are exact.
    """
    placed = (
        statement.values.get(name, "")
        for statement in dataset.of("PART", "MARKER")
        for name in _PLACED
    )
    numbers = re.findall(r"[\d.]+", " ".join(placed))
    counts = [len(each.replace(".", "").strip("0")) for each in numbers]
    counts = [count for count in counts if count >= FEWEST]
    digits = int(statistics.median(counts)) if counts else EXACT
    limit = size * min(1e-5, max(CLOSED, 10.0 ** (1 - digits)))
    return limit, f"the file's digits, {digits}: {limit:.2g} m"


def size_of(model: Model) -> float:
    """Return the largest extent of the markers along an axis [m]."""
    points = [model.frame(each).origin for each in model.markers.values()]
    extent = float(np.ptp(np.array(points), axis=0).max()) if points else 0.0
    return extent if extent > 1e-9 else 1.0


def assemble_links(model: Model, links: Sequence[Link], size: float, tolerance: float) -> Model:
    """Return the dataset with both markers of each link together, with a note on how far they were
    apart unless they agreed.

    Raises:
        CaseError: axes point in opposite directions, the markers are too far apart, or cannot be
            brought together.
    """
    gaps = dict[str, tuple[float, float]]()
    for link in links:
        _require_same_sense(link, model.places)
        gaps[link.statement.name] = _gap(link, model.places)
    opened = {name: gap for name, gap in gaps.items() if max(gap[0], size * gap[1]) > CLOSED * size}
    if not opened:
        return model
    for link in links:
        shift, turn = gaps[link.statement.name]
        if shift > FAR * size or turn > FAR:
            raise link.statement.fault(
                f"its markers {link.i} and {link.j} are {_text(shift, turn)} apart at the start,"
                f" expected {FAR * size:.3g} m and {math.degrees(FAR):.2g} degrees at most; Adams"
                " assembles them first: save the dataset after its assembly, or correct a marker"
            )
    found = _close_links(model, links, size, max(WEAK, ADDED_UP * tolerance / size))
    for link in links:
        shift, turn = _gap(link, found)
        if max(shift, size * turn) > max(tolerance, CLOSED * ADDED_UP * size):
            raise link.statement.fault(
                f"its markers {link.i} and {link.j} cannot be brought together: they are"
                f" {_text(*gaps[link.statement.name])} apart as the dataset places them, and"
                f" {_text(shift, turn)} in the nearest assembly, expected {tolerance:.2g} m at"
                " most; correct a marker or a part, or give --closure"
            )
    told = sorted(opened.items(), key=lambda each: -max(each[1][0], size * each[1][1]))
    moves = shortened([f"{name} by {_text(*gap)}" for name, gap in told], MOST_TOLD)
    model.note(f"markers that were apart at the start are assembled: {moves}")
    return replace(model, places=found)


def _text(shift: float, turn: float) -> str:
    parts = [f"{shift:.3g} m"] if shift or not turn else []
    return " and ".join([*parts, *([f"{math.degrees(turn):.3g} degrees"] if turn else [])])


def _require_same_sense(link: Link, places: Places) -> None:
    if link.kind == "PARALLEL_AXES":
        return
    i, j = link.frames(places)
    pairs = {"zx": ("z", i.z, j.z), "xy": ("x", i.x, j.x)}
    for row in link.rows:
        if row in pairs and link.kind != "HOOKE":
            axis, one, other = pairs[row]
            if one @ other <= 0.0:
                angle = math.degrees(math.acos(max(-1.0, float(one @ other))))
                raise link.statement.fault(
                    f"the {axis} axes of its markers {link.i} and {link.j} are {angle:.3g} degrees"
                    " apart, expected the same direction; turn one of the markers"
                )


def _gap(link: Link, places: Places) -> tuple[float, float]:
    """Return how far the markers of a link are apart [m, rad]."""
    i, j = link.frames(places)
    values = {row: _residual(row, i, j, link.length) for row in link.rows}
    shift = math.hypot(*(x for row, x in values.items() if row[0] == "d"), 0.0)
    sine = math.hypot(*(x for row, x in values.items() if row[0] != "d"), 0.0)
    return shift, math.asin(min(1.0, sine))


def _products(row: str, i: Frame, j: Frame) -> list[tuple[float, Array, Array]]:
    """Return sign, axis of I and axis of J of the products of a row."""
    terms = [(1.0, row[:2]), (-1.0, row[3:])] if "-" in row else [(1.0, row)]
    return [(sign, getattr(i, a), getattr(j, b)) for sign, (a, b) in terms]


def _residual(row: str, i: Frame, j: Frame, length: float) -> float:
    apart = i.origin - j.origin
    if row == "d":
        return float(np.linalg.norm(apart)) - length
    if row[0] == "d":
        return float(apart @ getattr(j, row[1]))
    return float(sum(sign * (a @ b) for sign, a, b in _products(row, i, j)))


def _slopes(row: str, i: Frame, j: Frame, arms: Sequence[Array]) -> tuple[Array, Array]:
    """Return the derivatives of a row by shift and turn of I's part and of J's, shape (6,) each."""
    if row[0] == "d":
        apart = i.origin - j.origin
        e = apart / (np.linalg.norm(apart) or 1.0) if row == "d" else getattr(j, row[1])
        of_i = np.concatenate([e, np.cross(arms[0], e)])
        return of_i, -np.concatenate([e, np.cross(arms[1] + apart, e)])
    turn = sum((s * np.cross(a, b) for s, a, b in _products(row, i, j)), np.zeros(3))
    of_i = np.concatenate([np.zeros(3), turn])
    return of_i, -of_i


def _rows(
    links: Sequence[Link], places: Places, columns: Mapping[int, int], size: float
) -> Iterator[tuple[float, Array]]:
    """Yield residual and derivatives of all rows, lengths over the size."""
    for link in links:
        i, j = link.frames(places)
        arms = [f.origin - places[m.part].origin for f, m in ((i, link.i), (j, link.j))]
        for row in link.rows:
            unit = size if row[0] == "d" else 1.0
            slope = np.zeros(6 * len(columns))
            for marker, part in zip((link.i, link.j), _slopes(row, i, j, arms), strict=True):
                if marker.part in columns:
                    first = columns[marker.part]
                    scaled = np.concatenate([size * part[:3], part[3:]]) / unit
                    slope[first : first + 6] += scaled
            yield _residual(row, i, j, link.length) / unit, slope


def _close_links(model: Model, links: Sequence[Link], size: float, weak: float) -> dict[int, Frame]:
    """Return the frames of the nearest assembly found.

    Args:
        weak: singular values below this are of rows redundant within the digits.
    """
    places = model.places
    columns = {part: 6 * k for k, part in enumerate(sorted({*places} - {model.ground}))}
    free = np.ones(6 * len(columns))
    for part, first in columns.items():
        exact = model.dataset.statements["PART"][part].values.get("EXACT", "").upper()
        held = {word.strip() for word in re.split(r"[:,\x1f]", exact)}
        free[first : first + 3] = [letter not in held for letter in "XYZ"]
        free[first + 3 : first + 6] = held.isdisjoint(("PSI", "THETA", "PHI"))
    found, best, least = {**places}, {**places}, math.inf
    for _ in range(MOST_STEPS):
        residuals, slopes = map(np.array, zip(*_rows(links, found, columns, size), strict=True))
        left = float(np.abs(residuals).max())
        if left < least:
            best, least = {**found}, left
        elif left < 1e-9:
            break
        step = -free * np.linalg.lstsq(slopes * free, residuals, rcond=weak)[0]
        step *= min(1.0, LONGEST_STEP / max(float(np.abs(step).max()), 1e-300))
        for part, first in columns.items():
            shift, turn = size * step[first : first + 3], step[first + 3 : first + 6]
            old = found[part]
            found[part] = Frame(
                old.origin + shift, rotations().from_rotvec(turn).as_matrix() @ old.axes, old.turned
            )
    return best


_AXIAL = {
    "REVOLUTE": Revolute,
    "TRANSLATIONAL": Translational,
    "CYLINDRICAL": Cylindrical,
    "PLANAR": Planar,
    "INLINE": Inline,
    "INPLANE": InPlane,
}
_TYPES = tuple(name for name in ROWS if name != "DISTANCE")
# What a rack may be off half the pitch diameter of its pinion, relative to it.
_OFF_PITCH = 0.1
# A turn or displacement below this is rounding.
_ROUNDED = 1e-9


def read_links(model: Model) -> list[Link]:
    """Read the constraints of two markers: JOINT, JPRIM and GCON.

    Raises:
        CaseError: a marker is missing, or the type or function is not read.
    """
    found = list[Link]()
    for each in model.dataset.of("JOINT", "JPRIM"):
        kind = each.choice(*_TYPES, "RACKPIN")
        if not kind:
            raise each.fault(f"found no type, expected one of {', '.join(_TYPES)}; state it")
        ends = model.ends(each)
        if kind == "HOOKE":
            model.require_x(each, *ends)
        if kind != "RACKPIN":
            found.append(Link(each, kind, *ends))
    for each in model.dataset.of("GCON"):
        constant, slope, _, ids = linear(each, "DM", "VR", "DM(I, J) - length")
        length = -constant / slope if slope else 0.0
        if not length > 0.0:
            raise each.fault(f"FUNCTION: found the length {length:g}, expected more; correct it")
        i, j = (model.marker(each, "FUNCTION", k) for k in ids)
        found.append(Link(each, "DISTANCE", i, j, model.units.length * length))
    return found


def joint_of(model: Model, link: Link) -> Joint:
    """Return a link as a joint: its first body carries J, its second one I, as Adams measures I
    relative to J.
    """
    name, kind = link.statement.name, link.kind
    bodies = model.body(link.j), model.body(link.i)
    one, other = model.frame(link.i), model.frame(link.j)
    point, axis = coordinates(one.origin), coordinates(other.z)
    z, lead = coordinates(one.z), 0.0
    if kind == "SCREW":
        lead = model.units.length * link.statement.one("PITCH")
    known: Mapping[str, tuple[Any, ...]] = {
        "SPHERICAL": (Spherical, point),
        "ATPOINT": (Spherical, point),
        "FIXED": (Fixed, point),
        "UNIVERSAL": (Universal, point, (axis, z)),
        "HOOKE": (Universal, point, (coordinates(other.y), coordinates(one.x))),
        # both z axes point away from the centre
        "CONVEL": (ConstantVelocity, point, (coordinates(-other.z), z)),
        "SCREW": (Screw, point, axis, lead),
        "ORIENTATION": (OrientationLock,),
        "PARALLEL_AXES": (ParallelAxes, axis),
        "PERPENDICULAR": (PerpendicularAxes, (axis, z)),
        "DISTANCE": (Distance, (coordinates(other.origin), point), link.length),
    }
    made: Any = known.get(kind) or (_AXIAL[kind], point, axis)
    cls, *geometry = made
    with explained(link.statement.file, link.statement.label):
        return cls(name, *bodies, *geometry)


def coordinates_of(
    model: Model, links: Sequence[Link], joints: Mapping[str, Joint]
) -> list[Coordinate]:
    """Return the coordinates of all joints, to be driven."""
    found = list[Coordinate]()
    for link in links:
        joint = joints[link.statement.name]
        if not isinstance(joint, AxialJoint) or link.kind == "PLANAR":
            continue
        several = len(joint.freedoms) > 1
        for freedom in joint.freedoms:
            measure = model.turn if freedom == "rotation" else model.slide
            name = f"{joint.name}.{freedom}" if several else joint.name
            found.append(Coordinate(name, joint, freedom, measure(link.i, link.j)))
    return found


def read_couplers(model: Model, driven: Sequence[Coordinate]) -> list[Coupler]:
    """Read the relations of joints: COUPLER, GEAR and rack and pinion joints.

    Raises:
        CaseError: a joint has no such coordinate, or the geometry does not say how they couple.
    """
    found = list[Coupler]()
    for each in model.dataset.of("COUPLER"):
        pair = _coupled_coordinates(each, driven)
        scales = each.numbers("SCALES") if "SCALES" in each.values else []
        if len(scales) not in (len(pair) - 1, len(pair)) or not all(scales):
            raise each.fault(
                f"SCALES: found {scales or 'none'}, expected {len(pair) - 1} or {len(pair)} numbers"
                f" for {len(pair)} joints, not zero; a subroutine cannot be read: leave it out by"
                " --without COUPLER"
            )
        weights = [
            scale * (1.0 if one.turns else 1.0 / model.units.length)
            for scale, one in zip([1.0, *scales][-len(pair) :], pair, strict=True)
        ]
        found.append(_coupler(each, pair, weights))
        off = sum(w * one.value for w, one in zip(weights, pair, strict=True))
        if abs(off) > _ROUNDED * sum(map(abs, weights)):
            model.note(
                f"{each.name}: the scaled sum of its joints' coordinates is {off:.6g} at the start,"
                " and stays so: joints are coupled from the start"
            )
    for each in model.dataset.of("GEAR"):
        pair = _coupled_coordinates(each, driven)
        found.append(_coupler(each, pair, _gear_weights(each, model, pair)))
    for each in model.dataset.of("JOINT"):
        if "RACKPIN" in each.flags:
            found.append(_rack(each, model, driven))
    return found


def _coupled_coordinates(statement: Statement, driven: Sequence[Coordinate]) -> list[Coordinate]:
    """Return the two coordinates of a gear, two or three of a coupler, named by its joints."""
    names = statement.ids("JOINTS")
    types = statement.values.get("TYPE", "").upper().replace(",", ":").split(":")
    if not 2 <= len(names) <= 2 + (statement.kind == "COUPLER"):
        raise statement.fault(f"JOINTS: found {len(names)}, expected two; correct it")
    found = list[Coordinate]()
    for k, name in enumerate(names):
        wanted = {"T": "translation", "R": "rotation"}.get(
            types[k].strip()[:1] if types[k:] else ""
        )
        own = [
            each
            for each in driven
            if each.joint.name == f"JOINT_{name}" and wanted in (None, each.freedom)
        ]
        if statement.kind == "GEAR":
            own = [each for each in own if each.turns] or own
        if len(own) != 1:
            listed = ", ".join(each.freedom for each in own) or "no such coordinate"
            raise statement.fault(
                f"JOINTS: JOINT/{name} has {listed}, expected one that turns or slides; name"
                " another joint, or say which by TYPE = R:T"
            )
        found += own
    return found


def _coupler(statement: Statement, pair: Sequence[Coordinate], weights: Sequence[float]) -> Coupler:
    """Return the coupler for a constant weighted sum of coordinates [rad, m]."""
    named = {one.joint.name: weight for one, weight in zip(pair, weights, strict=True)}
    if len(named) < len(pair):
        raise statement.fault("JOINTS: found a joint twice, expected different ones; correct it")
    with explained(statement.file, statement.label):
        return linear_relation(statement.name, named, [one.freedom for one in pair])


def _gear_weights(
    statement: Statement, model: Model, pair: Sequence[Coordinate]
) -> tuple[float, float]:
    """Return weights with which both gears have one velocity along z of the marker CV."""
    marker = model.marker(statement, "CV")
    contact, carrier = model.frame(marker), model.body(marker)
    found = list[float]()
    for one in pair:
        arm = contact.origin - np.array(one.joint.point)
        speed = np.cross(one.axis, arm) if one.turns else one.axis
        along = float(speed @ contact.z)
        if carrier not in one.joint.bodies or abs(along) <= 1e-6 * float(np.linalg.norm(speed)):
            raise statement.fault(
                f"CV = {marker.statement.id}: found on {carrier}, expected on the body that carries"
                f" both gears, its z axis along the common velocity and not across that of"
                f" {one.joint.name}; move or turn the marker"
            )
        found.append(along if carrier == one.joint.i else -along)
    return found[0], -found[1]


def _rack(statement: Statement, model: Model, driven: Sequence[Coordinate]) -> Coupler:
    """Return the coupler of a rack and pinion joint: the rack rolls on the pinion on the side where
    its marker lies.
    """
    pinion, rack = model.ends(statement)
    radius = 0.5 * model.units.length * abs(statement.one("PD"))
    one = _coordinate_of_body(statement, model.body(pinion), driven, "rotation")
    other = _coordinate_of_body(statement, model.body(rack), driven, "translation")
    arm = model.frame(rack).origin - np.array(one.joint.point)
    for axis in (one.axis, other.axis):
        arm = arm - axis * (axis @ arm)
    off = float(np.linalg.norm(arm))
    speed = float(np.cross(one.axis, arm) @ other.axis) * radius / (off or 1.0)
    if abs(off - radius) > _OFF_PITCH * radius or abs(speed) < 1e-6 * radius:
        raise statement.fault(
            f"the line of the rack's marker {rack} is {off:.6g} m off the pinion's axis, expected"
            f" half of PD, {radius:.6g} m, across it, which says on which side it rolls; move the"
            " marker, or give a COUPLER with SCALES"
        )
    for body, each in ((model.body(pinion), one), (model.body(rack), other)):
        speed = speed if body == each.joint.j else -speed
    model.note(
        f"{statement.name}: the rack rolls on the side of the pinion where {rack} lies, whatever"
        " the sign of PD"
    )
    return _coupler(statement, (one, other), (-speed, 1.0))


def _coordinate_of_body(
    statement: Statement, body: str, driven: Sequence[Coordinate], freedom: str
) -> Coordinate:
    """Return the only coordinate of a freedom of a body."""
    own = [x for x in driven if x.freedom == freedom and body in x.joint.bodies]
    if len(own) != 1:
        listed = ", ".join(x.name for x in own) or "none"
        raise statement.fault(
            f"found {listed} as joints of {body} with a {freedom}, expected the one that carries"
            " it; give a COUPLER with SCALES"
        )
    return own[0]
