"""What formulations have in common: states and the poses they stand for, conditions of rows,
motions of points and frames carried by a body, and rows of joint coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, TypeAlias

from ...algebra import ZERO, Quat, Scalar, Vec3, cross, rotation_less_identity, vec
from ...joints import PiecewisePolynomial
from ...primitives.base import Drive, Pose, Twist
from ...program import maximum, where_larger

State: TypeAlias = Mapping[str, Sequence[Scalar]]
"""Named vectors that define the configuration (for Cartesian coordinates: displacement and Euler
parameters of every body).
"""

EULER_PARAMETERS = 4
"""Length of a state vector of Euler parameters."""

Rows: TypeAlias = list[dict[int, Scalar]]
"""A matrix by rows; each row maps a column to its entry, literal zeros left out."""


@dataclass(frozen=True, eq=False)
class Configuration:
    """A state and the poses of the moving bodies that follow from it."""

    state: State
    poses: Mapping[str, Pose]


@dataclass(frozen=True, slots=True)
class Condition:
    """Rows that form one geometric condition, such as two parallel axes.

    Attributes:
        remote: joints between its bodies and the ground, summed over both bodies.
        steady: whether the rows keep their direction when a body turns.
    """

    rows: Sequence[int]
    remote: int = 0
    steady: bool = False


@dataclass(frozen=True, slots=True)
class Acceleration:
    """vdot of a body's origin and wdot, global axes."""

    v_t: Vec3
    w_t: Vec3

    def of(self, arm: Vec3, twist: Twist) -> Vec3:
        """Return the acceleration of the end of a (turned) arm on the body."""
        return self.v_t + cross(self.w_t, arm) + twist.centripetal(arm)


GROUND_ACCELERATION = Acceleration(ZERO, ZERO)


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


@dataclass(frozen=True)
class Relation:
    """A row of coordinates: their weighted sum is the drive's value (zero unless driven).

    Attributes:
        curve: a function of the last coordinate that is added to the sum; None for a linear row.
    """

    n: ClassVar[int] = 1
    owner: str
    weights: Mapping[str, Scalar]
    drive: Drive = field(default_factory=Drive)
    curve: PiecewisePolynomial | None = None

    def value(self, x: Sequence[Scalar]) -> Scalar:
        """Return the residual at values of the coordinates."""
        linear = sum((k * each for k, each in zip(self.weights.values(), x, strict=True)), 0.0)
        return linear + (_value(self.curve, x[-1], 0) if self.curve else 0.0) - self.drive.c

    def slopes(self, x: Sequence[Scalar]) -> dict[str, Scalar]:
        """Return the derivatives by the coordinates."""
        found = dict(self.weights)
        if self.curve:
            last = [*found][-1]
            found[last] = found[last] + _value(self.curve, x[-1], 1)
        return found

    def gamma(self, x: Sequence[Scalar], rates: Sequence[Scalar]) -> Scalar:
        """Return the right-hand side of the accelerations at values and rates."""
        if not self.curve:
            return self.drive.c_tt
        return self.drive.c_tt - _value(self.curve, x[-1], 2) * (rates[-1] * rates[-1])


def _value(curve: PiecewisePolynomial, x: Scalar, order: int) -> Scalar:
    """Return the value of a curve, or one of its first two derivatives; traced, it selects the
    coefficients of the piece of x.
    """
    (start, *starts), (powers, *others) = curve.starts, curve.powers
    for later, each in zip(starts, others, strict=True):
        beyond = maximum(x - later, 0.0)
        start = where_larger(beyond, 0.0, later, start)
        powers = [where_larger(beyond, 0.0, *pair) for pair in zip(each, powers, strict=True)]
    for _ in range(order):
        powers = [float(k) * c for k, c in enumerate(powers)][1:]
    found: Scalar = 0.0
    for c in reversed(powers):
        found = c + (x - start) * found
    return found
