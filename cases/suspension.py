"""Closed forms of wheel suspensions driven at an arm.

The points follow one after another; three of them carry the wheel.

The same motions have no closed form with the wheel as driver: the arm's angle is then the root of
a transcendental equation.
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
        """The path of its ball about the axis from back to front."""
        return Circle.about(self.back, np.subtract(self.front, self.back).tolist(), self.ball)


@dataclass(frozen=True)
class Upright:
    """The wheel carrier without its balls: inner and outer end of the tie rod, and the wheel's
    centre, at design [m].
    """

    inner: Numbers
    outer: Numbers
    wheel: Numbers

    @property
    def rod(self) -> float:
        """Squared length of the tie rod [m^2]."""
        return _squared(self.inner, self.outer)


def double_wishbone(lower: Arm, upper: Arm, upright: Upright, turn: Jet) -> dict[str, Vec]:
    """Return the points of a double wishbone suspension, the lower arm turned from the design by
    `turn` [rad].

    The upper ball is on its circle, at the upright's length from the lower ball. The tie rod's
    outer end has constant distances from both balls and from the inner end.
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
    """Return the points of a MacPherson strut, the arm turned by `turn` [rad] and the rack shifted
    along y by `rack` [m] from the design.

    The strut's axis, from its clamp to its top, is a line of the upright and slides through the
    top. In the upright's own axes the top is at  t u  from the foot of the ball on this line, with
    t^2 = distance^2 - offset^2.  Here `distance` is from top to ball, and the constant `offset`
    from ball to line. So the tie rod's outer end has known distances from ball, top and inner end.
    Ball, outer end and the top, moving along u, carry the upright.
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
    """Return the side of the outer end at design, from the plane through inner end, b and c."""
    p, q, r = (np.subtract(each, upright.inner) for each in (b, c, upright.outer))
    return float(np.sign(np.cross(p, q) @ r))
