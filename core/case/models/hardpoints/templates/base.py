"""Suspension templates: roles of hardpoints, and the joints that follow from their places.

Places are in metres, x forward, y left, z up. A template is of the left side, the chassis is the
ground, the steering is locked.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from .....joints import Joint
from .....mechanism.mechanism import Vector

KNUCKLE = "knuckle"
"""The body that carries the wheel, in every template."""


@dataclass(frozen=True)
class Role:
    """A hardpoint that a template needs.

    Attributes:
        meaning: what it is, for messages.
        also: other names it goes by; one point may fill several roles.
    """

    name: str
    meaning: str
    also: Sequence[str] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """All names it goes by, in their normal form."""
        return tuple(normal(name) for name in (self.name, *self.also))


@dataclass(frozen=True)
class Template:
    """A kind of suspension.

    Attributes:
        also: its names in files.
        joints: from places by role; the bodies are those named by the joints.
        watched: roles of non-collinear points of the knuckle: their motion is compared, and with it
            the knuckle's.
        upper, lower: roles; the first is above the second in any car, which detects wrong axes.
    """

    name: str
    also: Sequence[str]
    roles: Sequence[Role]
    joints: Callable[[Mapping[str, Vector]], Sequence[Joint]]
    watched: Sequence[str]
    upper: str
    lower: str


def normal(name: str) -> str:
    """A hardpoint's name without the differences that do not matter: case, blanks, the prefix of
    Adams/Car, spelling of centre.
    """
    plain = (
        re.sub(r"[^a-z0-9]+", "_", name.lower())
        .strip("_")
        .replace("centre", "center")
        .replace("tie_rod", "tierod")
    )
    return re.sub(r"^hp[ls]_", "", plain)


def between(a: Vector, b: Vector) -> Vector:
    """Return the vector from a to b."""
    return b[0] - a[0], b[1] - a[1], b[2] - a[2]


WHEEL_CENTER = Role("wheel_center", "the wheel's centre", ("wheel", "Spindle/COM"))
TIEROD_INNER = Role(
    "tierod_inner",
    "the tie rod's joint on the rack or chassis",
    ("Tierod/Location Chassis", "tierod_chassis", "tierod_rack"),
)
TIEROD_OUTER = Role(
    "tierod_outer",
    "the tie rod's joint on the knuckle",
    ("Tierod/Location Upright", "tierod_upright", "tierod_knuckle"),
)
