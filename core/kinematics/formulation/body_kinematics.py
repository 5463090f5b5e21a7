"""Motion of the points and the frame carried by a body, over any scalar."""

from __future__ import annotations

from collections.abc import Sequence

from ...algebra import Quat, Scalar, Vec3, rotation_less_identity, vec
from ...primitives.base import Pose, Twist
from .formulation import Acceleration


def position_of(position: Sequence[Scalar], arm: Vec3, metres: Scalar, pose: Pose) -> Vec3:
    """Return the position of a point [m]; its displacement is formed first and added once.

    Args:
        position: at design [m].
        arm: from the body's internal origin at design, in the unit of the frames.
        metres: length of that unit [m].
    """
    return vec(position) + metres * (pose.u + pose.swing(arm))


def motion_of_point(
    position: Sequence[Scalar],
    arm: Vec3,
    metres: Scalar,
    pose: Pose,
    twist: Twist,
    acceleration: Acceleration,
) -> tuple[Vec3, Vec3, Vec3]:
    """Return position [m], velocity and acceleration of a point; see `position_of`."""
    turned = pose.turn(arm)
    return (
        position_of(position, arm, metres, pose),
        metres * twist.of(turned),
        metres * acceleration.of(turned, twist),
    )


def motion_of_frame(
    design: Quat, pose: Pose, twist: Twist, acceleration: Acceleration
) -> tuple[Quat, Vec3, Vec3]:
    """Return the paper's variables p, omega' and omega'dot of a body's own frame.

    Args:
        design: Euler parameters of the frame at design.
    """
    p = pose.q * design
    to_body = rotation_less_identity(p).T
    return p, twist.w + to_body @ twist.w, acceleration.w_t + to_body @ acceleration.w_t
