"""A dataset in its start: units, frames of parts and markers, masses, and coordinates of joints."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any, TypeAlias

import numpy as np

from ...case.io.document import explained
from ...errors import remedy
from ...joints.base import AxialJoint
from ...mechanism.body import Body
from ...mechanism.mechanism import GROUND, Vector
from ...trajectory import Array
from .dataset import Dataset, Statement, full_name

_UNITS = {
    "LENGTH": (
        "METER 1 MILLIMETER 1e-3 CENTIMETER 1e-2 KILOMETER 1e3 MICROMETER 1e-6 NANOMETER 1e-9"
        " ANGSTROM 1e-10 INCH 0.0254 MICROINCH 2.54e-8 MILS 2.54e-5 FOOT 0.3048 YARD 0.9144"
        " MILE 1609.344"
    ),
    "MASS": (
        "KILOGRAM 1 GRAM 1e-3 MILLIGRAM 1e-6 MICROGRAM 1e-9 NANOGRAM 1e-12 TONNE 1e3"
        " US_TON 907.18474 POUND_MASS 0.45359237 KPOUND_MASS 453.59237 OUNCE_MASS 0.028349523125"
        " SLUG 14.593902937206364 SLINCH 175.12683524647636"
    ),
    "TIME": (
        "SECOND 1 MILLISECOND 1e-3 MICROSECOND 1e-6 NANOSECOND 1e-9 MINUTE 60 HOUR 3600 DAY 86400"
    ),
    "FORCE": (
        "NEWTON 1 CENTINEWTON 1e-2 MILLINEWTON 1e-3 MICRONEWTON 1e-6 NANONEWTON 1e-9 KNEWTON 1e3"
        " MEGANEWTON 1e6 DYNE 1e-5 KILOGRAM_FORCE 9.80665 POUND_FORCE 4.4482216152605"
        " KPOUND_FORCE 4448.2216152605 OUNCE_FORCE 0.27801385095378125 POUNDAL 0.138254954376"
    ),
}
"""Units of Adams Solver and their sizes in SI: of Adams' documentation, by definition."""
_SYSTEMS = {
    "NONE": "METER KILOGRAM SECOND NEWTON",
    "MKS": "METER KILOGRAM SECOND NEWTON",
    "CGS": "CENTIMETER GRAM SECOND DYNE",
    "FPS": "FOOT POUND_MASS SECOND POUND_FORCE",
    "IPS": "INCH POUND_MASS SECOND POUND_FORCE",
}
# Points nearer than this part of their distance from the origin give no direction.
_COINCIDE = 1e-12


@dataclass(frozen=True)
class Units:
    """One unit of each kind in SI [m, kg, s, N]."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0
    force: float = 1.0


def read_units(dataset: Dataset) -> Units:
    """Read the units of a dataset; SI without any, with a note.

    Raises:
        CaseError: there is no such unit.
    """
    statement = dataset.once("UNITS") or Statement(dataset.file, "UNITS", 0, 1)
    system = statement.values.get("SYSTEM", "NONE").strip().upper()
    if system not in _SYSTEMS:
        raise statement.fault(
            f"found SYSTEM = {system}, expected one of Adams; {remedy(system, _SYSTEMS)}"
        )
    sizes = list[float]()
    assumed = list[str]()
    for (what, text), name in zip(_UNITS.items(), _SYSTEMS[system].split(), strict=True):
        words = text.split()
        known = dict(zip(words[::2], map(float, words[1::2]), strict=True))
        given = statement.values.get(what, "").strip().upper()
        found = full_name(given, known) if given else name
        if not found:
            raise statement.fault(
                f"found {what} = {given}, expected a unit; {remedy(given, known)}"
            )
        sizes.append(known[found])
        assumed += [f"{what} = {found}"] if not given and system == "NONE" else []
    units = Units(*sizes)
    if "UCF" in statement.values:  # force times UCF is mass times acceleration
        factor = statement.one("UCF")
        if not factor > 0.0:
            raise statement.fault(f"UCF = {factor:g}: expected a positive number; correct it")
        force = factor * units.mass * units.length / units.time**2
        units, assumed = replace(units, force=force), [x for x in assumed if "FORCE" not in x]
    if assumed:
        dataset.notes.append(f"no UNITS are stated for {', '.join(assumed)}: read so")
    return units


@dataclass(frozen=True, eq=False)
class Frame:
    """A place and axes.

    Attributes:
        origin: [m], shape (3,).
        axes: x, y and z as columns, shape (3, 3).
        turned: whether x is known; a marker with ZP alone may have any.
    """

    origin: Array
    axes: Array
    turned: bool = True

    def relative_to(self, other: Frame) -> Frame:
        """Return this frame of another one in the frame of the latter."""
        turned = self.turned and other.turned
        return Frame(other.origin + other.axes @ self.origin, other.axes @ self.axes, turned)

    @property
    def x(self) -> Array:
        return self.axes[:, 0]

    @property
    def y(self) -> Array:
        return self.axes[:, 1]

    @property
    def z(self) -> Array:
        return self.axes[:, 2]


@dataclass(frozen=True, eq=False)
class Marker:
    """A marker: its part and its place on it."""

    part: int
    place: Frame
    statement: Statement

    def __str__(self) -> str:
        return f"MARKER/{self.statement.id}"


Places: TypeAlias = Mapping[int, Frame]
"""Frames of parts, global, by identifier."""


def read_places(dataset: Dataset, units: Units) -> tuple[dict[int, Frame], int]:
    """Return the frames of all parts, and the identifier of the ground.

    Raises:
        CaseError: numbers are wrong, or not one part is the ground.
    """
    parts = dataset.of("PART")
    grounds = [part for part in parts if "GROUND" in part.flags]
    if len(grounds) > 1:
        found = f"found GROUND again after PART/{grounds[0].id}"
        raise grounds[1].fault(f"{found}, expected one ground; remove one")
    if not grounds:
        (first, *_) = parts or [Statement(dataset.file, "PART", 1, 1)]
        raise first.fault("found no part with GROUND, expected one; add PART/1, GROUND")
    frames = {part.id: _frame(part, "QG", "ZG", "XG", units.length) for part in parts}
    for part in parts:
        if not frames[part.id].turned:
            raise part.fault("found ZG without XG, which leaves its turn open; add XG")
    return frames, grounds[0].id


def read_markers(dataset: Dataset, units: Units) -> dict[int, Marker]:
    """Return the markers on parts, by identifier; others are left out.

    Raises:
        CaseError: numbers are wrong, or there is no such part.
    """
    found = dict[int, Marker]()
    for each in dataset.of("MARKER"):
        if "PART" in each.values and "FLOATING" not in each.flags:
            part = dataset.member(each, "PART", "PART").id
            found[each.id] = Marker(part, _frame(each, "QP", "ZP", "XP", units.length), each)
    for marker in [*found.values()]:
        if "RM" in marker.statement.values:
            other = found.get(marker.statement.id_of("RM"))
            if other is None or other.part != marker.part or "RM" in other.statement.values:
                raise marker.statement.fault(
                    "RM: found no marker of the part that is stated in its frame, expected one;"
                    " correct it"
                )
            place = marker.place.relative_to(other.place)
            found[marker.statement.id] = replace(marker, place=place)
    return found


def _frame(statement: Statement, at: str, on_z: str, in_x: str, length: float) -> Frame:
    """Return the stated frame of a part or marker."""
    origin = length * _triple(statement, at) if at in statement.values else np.zeros(3)
    if "REULER" in statement.values:
        if on_z in statement.values or in_x in statement.values:
            raise statement.fault(f"found REULER beside {on_z} or {in_x}, expected one; remove one")
        angles = statement.numbers("REULER", 3)
        return Frame(origin, rotations().from_euler("ZXZ", angles).as_matrix())
    points = [name for name in (on_z, in_x) if name in statement.values]
    if not points:
        return Frame(origin, np.eye(3))
    away = {name: length * _triple(statement, name) - origin for name in points}
    for name, arm in away.items():
        if not np.linalg.norm(arm) > _COINCIDE * (np.linalg.norm(origin) + 1e-9):
            raise statement.fault(f"{name}: found the origin itself, expected a point elsewhere")
    z, x = away.get(on_z, np.array([0.0, 0.0, 1.0])), away.get(in_x)
    if x is None:  # any x will do where none is needed
        x = np.eye(3)[int(np.argmin(np.abs(z)))]
    if "USEXP" in statement.flags:
        x = x / np.linalg.norm(x)
        z = z - x * (x @ z)
    z = z / np.linalg.norm(z)
    x = x - z * (z @ x)
    if not np.linalg.norm(x) > 1e-9 * np.linalg.norm(away.get(in_x, x)):
        raise statement.fault(f"{in_x}: found a point on the z axis, expected one beside it")
    x = x / np.linalg.norm(x)
    return Frame(origin, np.stack([x, np.cross(z, x), z], axis=1), in_x in away)


def _triple(statement: Statement, name: str) -> Array:
    return np.array(statement.numbers(name, 3))


def coordinates(a: Array) -> Vector:
    """Return a vector as descriptions of mechanisms have it."""
    x, y, z = (float(each) + 0.0 for each in a)
    return x, y, z


def rotations() -> Any:
    """Return scipy's rotations, which are slow to import."""
    return import_module("scipy.spatial.transform").Rotation


@dataclass(frozen=True, eq=False)
class Model:
    """Parts and markers of a dataset.

    Attributes:
        places: frames of the parts, global; those of the start once it is assembled.
    """

    dataset: Dataset
    units: Units
    places: Places
    ground: int
    markers: Mapping[int, Marker]

    def note(self, text: str) -> None:
        """Note an assumption."""
        self.dataset.notes.append(text)

    def frame(self, marker: Marker) -> Frame:
        """Return the frame of a marker, global."""
        return marker.place.relative_to(self.places[marker.part])

    def body(self, marker: Marker) -> str:
        """Return the name of a marker's body."""
        return GROUND if marker.part == self.ground else f"PART_{marker.part}"

    def marker(self, owner: Statement, name: str, wanted: int | None = None) -> Marker:
        """Return the marker of an argument, or of an identifier in it.

        Raises:
            CaseError: it is missing, or on no part.
        """
        found = self.dataset.member(owner, name, "MARKER", wanted).id
        if found not in self.markers:
            raise owner.fault(
                f"{name} = {found}: found a floating marker or one on no part, expected one that"
                " is fixed on a part; name another"
            )
        return self.markers[found]

    def ends(self, owner: Statement) -> tuple[Marker, Marker]:
        """Return the markers I and J; see `marker`."""
        return self.marker(owner, "I"), self.marker(owner, "J")

    def require_x(self, owner: Statement, *markers: Marker) -> None:
        """Refuse markers whose x axis is not stated."""
        for marker in markers:
            if not marker.place.turned:
                raise owner.fault(
                    f"the x axis of {marker} is not stated, but needed; add XP or REULER to it"
                )

    def turn(self, i: Marker, j: Marker) -> float:
        """Return the turn of marker I from J about z [rad]; zero if an x axis is not stated."""
        one, other = self.frame(i), self.frame(j)
        known = i.place.turned and j.place.turned
        return math.atan2(float(one.x @ other.y), float(one.x @ other.x)) if known else 0.0

    def slide(self, i: Marker, j: Marker) -> float:
        """Return the displacement of marker I from J along z [m]."""
        return float((self.frame(i).origin - self.frame(j).origin) @ self.frame(j).z)


@dataclass(frozen=True)
class Coordinate:
    """A coordinate of a joint, to drive and to couple.

    Attributes:
        name: of the joint, with the freedom if it has several.
        value: turn or displacement of I from J at the start [rad, m].
    """

    name: str
    joint: AxialJoint
    freedom: str
    value: float

    @property
    def turns(self) -> bool:
        """Whether it is an angle."""
        return self.freedom == "rotation"

    @property
    def axis(self) -> Array:
        """The axis of its joint, of length one, shape (3,)."""
        return np.array(self.joint.axis) / np.linalg.norm(self.joint.axis)


def read_bodies(model: Model) -> list[Body]:
    """Return the bodies of all parts but the ground, with their masses.

    Raises:
        CaseError: a marker is missing or elsewhere, or no rigid body has such a mass.
    """
    found = list[Body]()
    for part in model.dataset.of("PART"):
        if part.id == model.ground:
            continue
        place = model.places[part.id]
        x, y, z, w = rotations().from_matrix(place.axes).as_quat(canonical=True).tolist()
        body = Body(part.name, coordinates(place.origin), (w, x, y, z))
        with explained(part.file, part.label):
            found.append(_with_mass(body, part, model))
    return found


def _with_mass(body: Body, part: Statement, model: Model) -> Body:
    units, place = model.units, model.places[part.id]
    mass = units.mass * part.one("MASS", 0.0)
    own = dict[str, Marker]()
    for name in ("CM", "IM"):
        if name not in part.values:
            continue
        (wanted, *_) = part.ids(name)
        marker = model.markers.get(wanted)
        if marker is None or marker.part != part.id:
            where = "there is none" if marker is None else f"which is on PART/{marker.part}"
            expected = "expected a marker of the part itself; correct it"
            raise part.fault(f"{name} = {wanted}: found {where}, {expected}")
        own[name] = marker
    center = own.get("CM")
    if mass and center is None:
        raise part.fault("found MASS without CM, expected the marker of its centre; add CM = ...")
    if center is None:
        return body
    at = center.place.relative_to(place)
    body = replace(body, mass=mass, center_of_mass=coordinates(at.origin))
    if not mass or "IP" not in part.values:
        return body
    numbers = part.numbers("IP")
    if len(numbers) not in (3, 6):
        raise part.fault(f"IP: found {len(numbers)} numbers, expected 3 or 6; correct it")
    if not any(numbers):
        return body
    # products are positive integrals, about the inertia marker and along its axes
    xx, yy, zz, xy, xz, yz = [*numbers, 0.0, 0.0, 0.0][:6]
    about = own.get("IM", center).place.relative_to(place)
    moments = np.array([[xx, -xy, -xz], [-xy, yy, -yz], [-xz, -yz, zz]])
    turned = units.mass * units.length**2 * about.axes @ moments @ about.axes.T
    arm = at.origin - about.origin
    turned = turned - mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    i = [float(x) for x in turned.ravel()]
    return replace(body, inertia=(i[0], i[4], i[8], i[1], i[5], i[2]))
