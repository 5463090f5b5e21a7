"""Closed forms of wheel suspensions that are driven at an arm: point after point, and the wheel is
carried by three of them.

Driven at the wheel instead, the same motions have none: the arm's angle is then the root of a
transcendental equation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .jet import Jet, constant, sqrt
from .vectors import Circle, Numbers, Vec, carried, fixed, meet_in_space


@dataclass(frozen=True)
class Arm:
    """An arm on the chassis: two points of its hinge and its ball, global at design [m]."""

    front: Numbers
    back: Numbers
    ball: Numbers

    @property
    def circle(self) -> Circle:
        """The way of its ball about the axis from back to front."""
        return Circle.about(self.back, np.subtract(self.front, self.back).tolist(), self.ball)


@dataclass(frozen=True)
class Upright:
    """What the wheel carrier has besides its balls: the tie rod's ends, inner and outer, and the
    wheel's centre, at design [m].
    """

    inner: Numbers
    outer: Numbers
    wheel: Numbers

    @property
    def rod(self) -> float:
        """Squared length of the tie rod [m^2]."""
        return _squared(self.inner, self.outer)


def double_wishbone(lower: Arm, upper: Arm, upright: Upright, turn: Jet) -> dict[str, Vec]:
    """The points of a double wishbone suspension with the lower arm turned from the design by
    `turn` [rad].

    The upper ball is on its circle at the upright's length from the lower ball; the tie rod's outer
    end has its distances from both balls and from the inner end.
    """
    low, high, inner, outer = (
        fixed(each, turn) for each in (lower.ball, upper.ball, upright.inner, upright.outer)
    )
    design, to_point = upper.circle, np.subtract(upper.circle.centre, lower.ball)
    L = lower.circle.turned(turn)
    U = design.meet(L, _squared(lower.ball, upper.ball) ** 0.5, float(np.sign(to_point @ design.v)))
    squares = (_squared(each, upright.outer) for each in (lower.ball, upper.ball))
    bb, cc = (constant(square, turn) for square in squares)
    T = meet_in_space(
        inner, constant(upright.rod, turn), L, bb, U, cc, _side(upright, lower.ball, upper.ball)
    )
    wheel = carried((low, high, outer), (L, U, T), fixed(upright.wheel, turn))
    return {"lower_ball": L, "upper_ball": U, "tie_rod_end": T, "wheel_center": wheel}


def macpherson(
    arm: Arm, top: Numbers, clamp: Numbers, upright: Upright, turn: Jet, rack: Jet
) -> dict[str, Vec]:
    """The points of a MacPherson strut, the arm turned by `turn` [rad] and the rack shifted along y
    by `rack` [m] from the design.

    The strut's axis from its clamp to its top is a line of the upright and slides through the top.
    In the upright's own axes the top is at  t u  from the foot of the ball on the line, with
    t^2 = distance^2 - offset^2,  the distance being that from top to ball and the offset, which is
    constant, that of the ball from the line. So the tie rod's outer end has known
    distances from ball, top and inner end, and the upright is carried by ball, outer end and,
    moving along u, the top.
    """
    u = np.subtract(top, clamp) / np.linalg.norm(np.subtract(top, clamp))
    slid = float(np.subtract(top, arm.ball) @ u)
    foot = np.array(top) - slid * u
    ball, outer, along = (fixed(each, turn) for each in (arm.ball, upright.outer, u.tolist()))
    zero = constant(0.0, turn)
    inner = fixed(upright.inner, turn) + Vec(zero, rack, zero)
    L, U = arm.circle.turned(turn), fixed(top, turn)
    t = float(np.sign(slid)) * sqrt((U - L) @ (U - L) - _squared(arm.ball, foot.tolist()))
    in_upright = fixed(foot.tolist(), turn) + t * along
    rod, bb, cc = (
        constant(upright.rod, turn),
        constant(_squared(arm.ball, upright.outer), turn),
        _square(outer - in_upright),
    )
    T = meet_in_space(inner, rod, L, bb, U, cc, _side(upright, arm.ball, top))
    wheel = carried((ball, in_upright, outer), (L, U, T), fixed(upright.wheel, turn))
    return {"lower_ball": L, "tie_rod_end": T, "wheel_center": wheel}


def _squared(a: Numbers, b: Numbers) -> float:
    d = np.subtract(a, b)
    return float(d @ d)


def _square(a: Vec) -> Jet:
    return a @ a


def _side(upright: Upright, b: Numbers, c: Numbers) -> float:
    """On which side of the plane through the inner end, b and c the outer end is at design."""
    p, q, r = (np.subtract(each, upright.inner) for each in (b, c, upright.outer))
    return float(np.sign(np.cross(p, q) @ r))
