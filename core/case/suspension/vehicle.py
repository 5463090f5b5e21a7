"""Vehicle data of suspension outputs beside the motion of points: axes, signs, wheel and axle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from ...algebra import Vec3, cross, vec
from ...mechanism.mechanism import Mechanism, Vector
from ..case import MARKER

# Distance from the wheel centre to the markers on the wheel carrier [m]: a rim's radius, so
# directions keep all digits of positions.
MARKER_DISTANCE = 0.25


class Convention(StrEnum):
    """Standard of the axes and signs of outputs. SAE J670 also allows z up; here its name means the
    historical z down.
    """

    ISO_8855 = "iso8855"
    SAE_J670 = "sae_j670"

    @property
    def words(self) -> str:
        """Standard and its axes, in words."""
        return (
            "ISO 8855 (x forward, y left, z up)"
            if self is Convention.ISO_8855
            else "SAE J670 (x forward, y right, z down)"
        )

    @property
    def up(self) -> int:
        """Factor from an upward component to one along z, and from a leftward component to one
        along y.
        """
        return 1 if self is Convention.ISO_8855 else -1


class Side(StrEnum):
    """Side of the wheel, seen by the driver."""

    LEFT = "left"
    RIGHT = "right"

    @property
    def left(self) -> int:
        """Factor from an outboard component to one to the left."""
        return 1 if self is Side.LEFT else -1


class Axle(StrEnum):
    """Axle of the wheel."""

    FRONT = "front"
    REAR = "rear"


class Reaction(StrEnum):
    """Support of the torque of brakes or drive: the wheel carrier, or the vehicle's body."""

    OUTBOARD = "outboard"
    INBOARD = "inboard"


@dataclass(frozen=True, kw_only=True)
class Vehicle:
    """One wheel's corner of a vehicle, in SI units and global axes at design. None is unknown and
    not needed.

    Attributes:
        forward, up: perpendicular unit vectors fixed to the vehicle's body [-].
        wheel_center: name of the point.
        static_toe, static_camber: angles at design [rad], as defined in `wheel`.
        wheel_axis: name of a point of the carrier on the axis of rotation, outboard of the centre,
            instead of both angles.
        middle: a point of the vehicle's centre plane [m].
        wheel_radius: loaded, from the wheel centre to the contact centre in the wheel plane [m].
        wheel_contact: name of a point of the carrier at this distance from the wheel centre, which
            variants of the design may move.
        kingpin: names of the lower and the upper point of the steering axis; or of the ends of four
            rods, on the body and on the wheel carrier each: the axis is then that of the screw
            about which the wheel turns when the fifth rod moves and the height of its centre is
            held.
        cg_height: height of the centre of gravity above the road [m].
        travel: driver of the wheel's travel, if other drivers move too, and that of the axle's
            other wheel if there is one: derivatives by travel move these alone, and hold the
            others. Empty: derivatives are along the sweep.
        brake_share, drive_share: parts of the vehicle's braking and driving force at this axle [-].
    """

    convention: Convention
    side: Side
    forward: Vector
    up: Vector
    wheel_center: str
    static_toe: float = 0.0
    static_camber: float = 0.0
    wheel_axis: str | None = None
    middle: Vector = (0.0, 0.0, 0.0)
    axle: Axle | None = None
    wheel_radius: float | None = None
    wheel_contact: str | None = None
    kingpin: tuple[str, str] | tuple[tuple[str, str], ...] | None = None
    wheelbase: float | None = None
    cg_height: float | None = None
    brakes: Reaction = Reaction.OUTBOARD
    brake_share: float | None = None
    drive: Reaction = Reaction.INBOARD
    drive_share: float | None = None
    travel: tuple[str, ...] = ()

    @property
    def kingpin_points(self) -> tuple[str, ...]:
        """Names of the points that define the steering axis."""
        return tuple(
            name
            for each in self.kingpin or ()
            for name in ((each,) if isinstance(each, str) else each)
        )

    @property
    def outboard(self) -> Vec3:
        """Global unit vector to the left or to the right, away from the centre plane."""
        return self.side.left * cross(vec(self.up), vec(self.forward))

    def spin(self, mechanism: Mechanism) -> Vec3:
        """Return the global unit vector along the wheel's axis of rotation at design, outboard."""
        if self.wheel_axis is None:
            toe, camber = self.static_toe, self.static_camber
            level = math.sin(toe) * vec(self.forward) + math.cos(toe) * self.outboard
            return math.cos(camber) * level + -math.sin(camber) * vec(self.up)
        along = self._arm(mechanism, self.wheel_axis)
        return (1.0 / math.sqrt(along @ along)) * along

    def radius(self, mechanism: Mechanism) -> float | None:
        """Return the wheel's radius at design [m]; None if unknown."""
        if self.wheel_contact is None:
            return self.wheel_radius
        ends = (mechanism.point(name) for name in (self.wheel_center, self.wheel_contact))
        return math.dist(*(end.position for end in ends))

    def aside(self, mechanism: Mechanism) -> float:
        """Return how far outboard of the wheel centre the point of the axis is at design [m]."""
        assert self.wheel_axis is not None
        return self.outboard @ self._arm(mechanism, self.wheel_axis)

    def _arm(self, mechanism: Mechanism, point: str) -> Vec3:
        center = mechanism.point(self.wheel_center).position
        return vec(mechanism.point(point).position) - vec(center)

    @property
    def spin_marker(self) -> str:
        """Name of the carrier's point on the axis of rotation, outboard of the wheel centre."""
        return self.wheel_axis or f"{MARKER}{self.wheel_center}.spin"

    @property
    def top_marker(self) -> str:
        """Name of a point of the carrier beside the axis of rotation, above or below the centre."""
        return self.wheel_contact or f"{MARKER}{self.wheel_center}.top"

    def markers(self, mechanism: Mechanism) -> dict[str, Vector]:
        """Return the positions of the points that the mechanism lacks at design, by name [m]."""
        sides: dict[str, Vec3] = {}
        if self.wheel_axis is None:
            sides[self.spin_marker] = self.spin(mechanism)
        if self.wheel_contact is None:
            sides[self.top_marker] = vec(self.up)
        center = vec(mechanism.point(self.wheel_center).position)
        places = {name: center + MARKER_DISTANCE * along for name, along in sides.items()}
        return {name: (at.x, at.y, at.z) for name, at in places.items()}

    @property
    def signs(self) -> str:
        """Convention, wheel and axes in words, for the head of each table of these outputs."""
        where = f"{self.axle} {self.side}" if self.axle else str(self.side)
        forward, up = (", ".join(f"{x:g}" for x in axis) for axis in (self.forward, self.up))
        return (
            f"{self.convention.words}; {where} wheel; forward is [{forward}] and up [{up}] in the"
            " case's axes"
        )
