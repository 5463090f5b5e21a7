"""Instant centres of the wheel carrier in the views from the front and from the side, and the swing
arms between them and the wheel centre.

In a view, the carrier's points in the plane through the wheel centre move as a plane figure: from
the wheel centre C, the velocity along the first axis falls by the rate of turn w for each metre up,
and that upwards grows by w for each metre along it. The instant centre is the point at rest,
(-v_z / w, v_along / w) from C. Slope and angle of the swing arm need no w.

Sources: W. F. and D. L. Milliken, Race Car Vehicle Dynamics, chapter 17; Altair MotionView,
Suspension Design Factors (help.altair.com/hwdesktop), whose lengths have no sign.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ....algebra import Scalar, root
from ....jet import Jet, arctan2, known, sign, sqrt
from .base import Rate
from .corner import PARALLEL, Corner, velocity


@dataclass(frozen=True)
class _InView(Rate):
    """A quantity of the instant centre in a view.

    Attributes:
        side_view: whether it is seen from the side, its first axis forward; else from the front,
            the first axis outboard.
    """

    measure = "m"
    nowhere = "the wheel hardly travels there, or its swing arm is almost endless"
    side_view: ClassVar[bool] = False

    def motion(self, corner: Corner) -> tuple[Jet, Jet, Jet]:
        """Return the velocity of the wheel centre along the view's axis and upwards [m/s], and the
        rate of turn [rad/s], NaN if both centres are farther from each other than 1 / PARALLEL [m].
        """
        v = velocity(corner.center)
        along, turn = (v.x, -corner.pitch) if self.side_view else (v.y, corner.roll)
        speed: Scalar = root(along.x * along.x + v.z.x * v.z.x)
        return along, v.z, known(turn.x, PARALLEL * speed, turn)


@dataclass(frozen=True)
class FrontViewSwingArm(_InView):
    """Distance of the wheel centre from the instant centre in the view from the front."""

    type = "front_view_swing_arm"
    positive = "the instant centre inboard of the wheel centre"

    def value(self, corner: Corner) -> Jet:
        """Return the length [m]."""
        along, up, turn = self.motion(corner)
        return sign(up.x) * sqrt(along * along + up * up) / turn


@dataclass(frozen=True)
class SideViewSwingArm(FrontViewSwingArm):
    """The same in the view from the side."""

    type = "side_view_swing_arm"
    positive = "the instant centre behind the wheel centre"
    side_view = True


@dataclass(frozen=True)
class FrontViewSwingAngle(_InView):
    """Angle of the line from the wheel centre to the instant centre against the horizontal, in the
    view from the front: the virtual swing angle.
    """

    type = "front_view_swing_angle"
    measure = "rad"
    positive = "the line rising inboard"

    def value(self, corner: Corner) -> Jet:
        """Return the angle [rad], in -pi/2..pi/2."""
        along, up, _ = self.motion(corner)
        one = sign(up.x)
        return arctan2(one * along, one * up)


@dataclass(frozen=True)
class SideViewSwingAngle(FrontViewSwingAngle):
    """The same in the view from the side."""

    type = "side_view_swing_angle"
    positive = "the line rising rearward"
    side_view = True


@dataclass(frozen=True)
class FrontViewInstantCenterY(_InView):
    """Lateral place of the instant centre in the view from the front, from the centre plane of the
    vehicle.
    """

    type = "front_view_instant_center_y"
    positive = "on the wheel's side of the vehicle"

    def value(self, corner: Corner) -> Jet:
        """Return the coordinate [m]."""
        _, up, turn = self.motion(corner)
        return corner.center.y - up / turn


@dataclass(frozen=True)
class FrontViewInstantCenterZ(_InView):
    """Height of the instant centre above the road, in the view from the front."""

    type = "front_view_instant_center_z"
    positive = "above the road"
    needs = ("wheel_radius",)

    def value(self, corner: Corner) -> Jet:
        """Return the height [m]."""
        along, _, turn = self.motion(corner)
        return corner.center.z - corner.contact.z + along / turn


@dataclass(frozen=True)
class SideViewInstantCenterX(_InView):
    """Longitudinal place of the instant centre in the view from the side, from the wheel centre."""

    type = "side_view_instant_center_x"
    positive = "ahead of the wheel centre"
    side_view = True

    def value(self, corner: Corner) -> Jet:
        """Return the coordinate [m]."""
        _, up, turn = self.motion(corner)
        return -up / turn


@dataclass(frozen=True)
class SideViewInstantCenterZ(FrontViewInstantCenterZ):
    """Height of the instant centre above the road, in the view from the side."""

    type = "side_view_instant_center_z"
    side_view = True


SWING_ARMS = (
    FrontViewSwingArm,
    FrontViewSwingAngle,
    FrontViewInstantCenterY,
    FrontViewInstantCenterZ,
    SideViewSwingArm,
    SideViewSwingAngle,
    SideViewInstantCenterX,
    SideViewInstantCenterZ,
)
"""In the order of tables."""
