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
from abc import abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import Field, dataclass, fields
from typing import Any, ClassVar, Self

import numpy as np

from ...algebra import Vec3, vec
from ...errors import MechanismError, unknown
from ...jet import sqrt
from ...mechanism.mechanism import GROUND, Mechanism
from ..quantity import MARKER, TypedQuantity, own_keys

NAMES: Mapping[str, str] = {
    "points": "point",
    "joint": "joint",
    "body": "body",
    "bodies": "body",
    "driver": "driver",
    "about": "point",
    "at": "joint",
    "force": "force",
}
"""Keys that hold names, and the kind of what they name."""


@dataclass(frozen=True)
class Measure(TypedQuantity):
    """A quantity of the pose, in the unit `measure`.

    Attributes:
        atol, rtol: an error is accepted up to atol [unit] + rtol * range of the reference.
    """

    registry: ClassVar[dict[str, type[Measure]]] = {}

    name: str
    atol: float
    rtol: float
    why: str

    @property
    @abstractmethod
    def points(self) -> tuple[str, ...]:
        """Names of the points it reads."""

    @property
    def facts(self) -> Mapping[str, Any]:
        """All keys and the unit."""
        own = {each.name: getattr(self, each.name) for each in fields(self)}
        return {"type": self.type, "unit": self.unit, "sense": self.sense, **own}

    def check(self, mechanism: Mechanism) -> None:
        """Raise MechanismError unless the mechanism has all its names."""
        known: Mapping[str, Iterable[str]] = {
            "point": [p.name for p in mechanism.points if not p.name.startswith(MARKER)],
            "joint": [joint.name for joint in (*mechanism.given_joints, *mechanism.grounded)],
            "body": [GROUND, *(body.name for body in mechanism.bodies)],
            "driver": [driver.name for driver in mechanism.drivers],
            "force": [force.name for force in mechanism.forces],
        }
        for each in own_keys(type(self)):
            if (kind := NAMES.get(key_of(each))) is None:
                continue
            found: str | tuple[str, ...] | None = getattr(self, each.name)
            for name in (found,) if isinstance(found, str) else found or ():
                if name not in known[kind]:
                    raise MechanismError(
                        unknown(kind, name, known[kind]), f"outputs.{self.name}.{key_of(each)}"
                    )

    def bound(self, mechanism: Mechanism) -> Self:
        """Return the measure with the facts it needs of the mechanism."""
        return self


def key_of(each: Field[Any]) -> str:
    """Return the key of a field in case files."""
    return each.metadata.get("key", each.name)


def length(design: Mapping[str, Vec3], start: str, end: str) -> Any:
    """Return the distance between two points at design [m]."""
    along = design[end] - design[start]
    return sqrt(along @ along).x


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
