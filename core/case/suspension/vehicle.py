"""What the outputs of a suspension need to know of the vehicle beside the motion of points: axes,
signs, wheel and axle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from ...algebra import Vec3, cross, vec
from ...mechanism.mechanism import Vector
from ..case import MARKER

# Metres between the wheel centre and the points that show how the wheel carrier turns: a rim's
# radius, so that directions keep all digits of positions.
MARKER_DISTANCE = 0.25


class Convention(StrEnum):
    """Whose axes and signs the outputs have. SAE J670 also allows z up; here its name means its
    historical z down.
    """

    ISO_8855 = "iso8855"
    SAE_J670 = "sae_j670"

    @property
    def words(self) -> str:
        """The standard and its axes."""
        return (
            "ISO 8855 (x forward, y left, z up)"
            if self is Convention.ISO_8855
            else "SAE J670 (x forward, y right, z down)"
        )

    @property
    def up(self) -> int:
        """What makes a component along z of one that is upwards; and one along y of one that is to
        the left.
        """
        return 1 if self is Convention.ISO_8855 else -1


class Side(StrEnum):
    """Where the wheel is, seen by the driver."""

    LEFT = "left"
    RIGHT = "right"

    @property
    def left(self) -> int:
        """What makes a component to the left of one that is outboard."""
        return 1 if self is Side.LEFT else -1


class Axle(StrEnum):
    """Which axle the wheel is on."""

    FRONT = "front"
    REAR = "rear"


class Reaction(StrEnum):
    """Where the torque of brakes or drive is held: on the wheel carrier, or on the vehicle's
    body.
    """

    OUTBOARD = "outboard"
    INBOARD = "inboard"


@dataclass(frozen=True, kw_only=True)
class Vehicle:
    """One wheel's corner of a vehicle; SI, global axes at design. What is None is not known and not
    needed.

    Attributes:
        forward, up: unit vectors fixed to the vehicle's body, at right angles [-].
        wheel_center: name of the point.
        static_toe, static_camber: at design [rad]; see `wheel` for what the angles are.
        middle: a point of the vehicle's centre plane [m].
        wheel_radius: loaded, from the wheel centre to the contact centre in the wheel plane [m].
        kingpin: names of the lower and the upper point of the steering axis.
        cg_height: above the road [m].
        brake_share, drive_share: parts of the vehicle's braking and driving force at this axle [-].
    """

    convention: Convention
    side: Side
    forward: Vector
    up: Vector
    wheel_center: str
    static_toe: float = 0.0
    static_camber: float = 0.0
    middle: Vector = (0.0, 0.0, 0.0)
    axle: Axle | None = None
    wheel_radius: float | None = None
    kingpin: tuple[str, str] | None = None
    wheelbase: float | None = None
    cg_height: float | None = None
    brakes: Reaction = Reaction.OUTBOARD
    brake_share: float | None = None
    drive: Reaction = Reaction.INBOARD
    drive_share: float | None = None

    @property
    def outboard(self) -> Vec3:
        """Unit vector to the left or to the right, away from the centre plane, global."""
        return self.side.left * cross(vec(self.up), vec(self.forward))

    @property
    def spin(self) -> Vec3:
        """Unit vector along the wheel's axis of rotation at design, outboard, global."""
        toe, camber = self.static_toe, self.static_camber
        level = math.sin(toe) * vec(self.forward) + math.cos(toe) * self.outboard
        return math.cos(camber) * level + -math.sin(camber) * vec(self.up)

    @property
    def spin_marker(self) -> str:
        """Name of the point on the wheel carrier that is outboard of the wheel centre on the axis
        of rotation.
        """
        return f"{MARKER}{self.wheel_center}.spin"

    @property
    def top_marker(self) -> str:
        """Name of the point on the wheel carrier that is beside the wheel centre in the wheel
        plane, upwards at design.
        """
        return f"{MARKER}{self.wheel_center}.top"

    def marker_positions(self, center: Vector) -> dict[str, Vector]:
        """Where the two markers are at design, by name [m]."""
        s, u = self.spin, vec(self.up)
        top = u - (u @ s) * s
        top = (1.0 / math.sqrt(top @ top)) * top
        sides = {self.spin_marker: s, self.top_marker: top}
        return {
            name: _numbers(vec(center) + MARKER_DISTANCE * along) for name, along in sides.items()
        }

    @property
    def signs(self) -> str:
        """The convention, the wheel and the axes in words: what heads every table of these
        outputs.
        """
        where = f"{self.axle} {self.side}" if self.axle else str(self.side)
        forward, up = (", ".join(f"{x:g}" for x in axis) for axis in (self.forward, self.up))
        return (
            f"{self.convention.words}; {where} wheel; forward is [{forward}] and up [{up}] in the"
            " case's axes"
        )


def _numbers(a: Vec3) -> Vector:
    x, y, z = a
    return float(x), float(y), float(z)
