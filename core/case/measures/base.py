"""Base class of measures: outputs of joints, bodies and pairs of points.

A new type is a frozen dataclass with `type`, `measure`, `positive`, its keys as fields, and a
formula over the motion of points. The class declaration registers it: case files can name it at
once, `case_writer` writes it, and `kincheck list --outputs` prints it. A field named in `NAMES`
holds names of the mechanism, and is checked.

Formulas read points only, and every engine gives every measure: the angle of a joint is the angle
between markers on its bodies.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import Field, dataclass, fields
from typing import Any, ClassVar, Self

import numpy as np

from ...algebra import Vec3, vec
from ...errors import MechanismError, unknown
from ...jet import Jet, sqrt
from ...mechanism.mechanism import GROUND, Mechanism, Point, Vector
from ..quantity import MARKER, ORDERS

NAMES: Mapping[str, str] = {
    "points": "point",
    "joint": "joint",
    "body": "body",
    "bodies": "body",
    "driver": "driver",
    "force": "force",
}
"""Keys that hold names, and the kind of what they name."""
HIDDEN: Mapping[str, Any] = {"hidden": True}
"""Metadata of a field that case files do not give: `Measure.bound` finds it in the mechanism."""


@dataclass(frozen=True)
class Measure(ABC):
    """A quantity of the pose, in the unit `measure`.

    Attributes:
        type: name in case files.
        measure: SI unit: m, rad, or 1.
        positive: meaning of a positive value.
        atol, rtol: an error is accepted up to atol [unit] + rtol * range of the reference.
    """

    type: ClassVar[str]
    measure: ClassVar[str]
    positive: ClassVar[str]
    registry: ClassVar[dict[str, type[Measure]]] = {}

    name: str
    atol: float
    rtol: float
    why: str

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "type" in cls.__dict__:
            Measure.registry[cls.type] = cls

    @property
    @abstractmethod
    def points(self) -> tuple[str, ...]:
        """Names of the points it reads."""

    @property
    def forces(self) -> tuple[str, ...]:
        """Names of the joints, drivers and force elements whose forces it reads."""
        return ()

    @property
    def unit(self) -> str:
        """Unit of the type."""
        return self.measure

    @property
    def orders(self) -> int:
        """Value, rate and second rate."""
        return ORDERS

    @property
    def period(self) -> float:
        """Zero: each value is a pose of its own."""
        return 0.0

    @property
    def sense(self) -> str:
        """Meaning of a positive value, in words."""
        return f"positive: {self.positive}"

    @property
    def signs(self) -> str:
        """Empty: only the case's own axes apply."""
        return ""

    @property
    def facts(self) -> Mapping[str, Any]:
        """All keys and the unit."""
        own = {each.name: getattr(self, each.name) for each in fields(self)}
        return {"type": self.type, "unit": self.unit, "sense": self.sense, **own}

    def check(self, mechanism: Mechanism) -> None:
        """Raise MechanismError unless the mechanism has all its names."""
        known: Mapping[str, Iterable[str]] = {
            "point": [p.name for p in mechanism.points if not p.name.startswith(MARKER)],
            "joint": [joint.name for joint in (*mechanism.joints, *mechanism.grounded)],
            "body": [GROUND, *(body.name for body in mechanism.bodies)],
            "driver": [driver.name for driver in mechanism.drivers],
            "force": [force.name for force in mechanism.forces],
        }
        for each in own_keys(type(self)):
            if (kind := NAMES.get(key_of(each))) is None:
                continue
            found: str | tuple[str, ...] = getattr(self, each.name)
            for name in (found,) if isinstance(found, str) else found:
                if name not in known[kind]:
                    raise MechanismError(
                        unknown(kind, name, known[kind]), f"outputs.{self.name}.{key_of(each)}"
                    )

    def bound(self, mechanism: Mechanism) -> Self:
        """Return the measure with the facts it needs of the mechanism."""
        return self

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        """Return the points it reads beyond those of the case."""
        return ()

    @abstractmethod
    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the measure over the samples; see `Quantity.of`."""


def own_keys(cls: type[Measure]) -> list[Field[Any]]:
    """Return the fields of a type beyond the common ones, which case files give."""
    inherited = {each.name for each in fields(Measure)}
    return [
        each
        for each in fields(cls)
        if each.name not in inherited and not each.metadata.get("hidden")
    ]


def key_of(each: Field[Any]) -> str:
    """Return the key of a field in case files."""
    return each.metadata.get("key", each.name)


def length(design: Mapping[str, Vec3], start: str, end: str) -> Any:
    """Return the distance between two points at design [m]."""
    along = design[end] - design[start]
    return sqrt(along @ along).x


def coordinates(place: Vec3) -> Vector:
    """Return a place as three floats [m]."""
    x, y, z = place
    return float(x), float(y), float(z)


def place_on(mechanism: Mechanism, body: str) -> Vec3:
    """Return a place on a body near its joints and points [m]."""
    places = [
        place
        for joint in mechanism.joints
        for place in joint.points_on(body)
        if body in joint.bodies
    ]
    places += [point.position for point in mechanism.points if point.body == body]
    if body != GROUND:
        places.append(mechanism.body(body).origin)
    return vec(places[0] if places else (0.0, 0.0, 0.0))


def reach_of(mechanism: Mechanism) -> float:
    """Return the distance of markers from their place [m], a power of two near the mechanism's
    size: directions then keep all digits of positions.
    """
    places = [place for joint in mechanism.joints for place in joint.points_on()]
    places += [p.position for p in mechanism.points if not p.name.startswith(MARKER)]
    extent = float(np.ptp(np.array(places), axis=0).max()) if places else 0.0
    return 2.0 ** round(math.log2(extent)) if extent else 1.0
