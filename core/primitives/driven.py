"""Driven coordinates: one row each.  Formulation section 2, point driver and relative-angle driver.

Point coordinate along the global unit vector k, with S = A_j s (body i is the ground):

    phi   = k . (u_j + (A_j - I) s) - c       rows = [ 0 | 0 | k | S x k ]       nu = c_t
    gamma = c_tt - k . (w_j x (w_j x S))

Joint angle about h, on a joint whose axes are parallel, with the Euler parameters rho = conj(q_i)
q_j of the relative rotation:

    phi   = 2 ( cos(c/2) h . vec(rho) - sin(c/2) rho_0 )  =  2 sin((theta - c)/2)
    rows  = [ 0 | -h | 0 | h ]       nu = c_t       gamma = c_tt
            exact where the axes are parallel and phi = 0

sin(theta - c) has a second zero at c + pi, atan2 needs unwrapping and cos(theta) - cos(c) is
singular at 0 and pi; the half angle has none of these, because Euler parameters that are followed
continuously know the turn (any number of turns, no counter). It has one at c + 2 pi, from which the
rows lead away; where a driver at rest makes a whole turn between two samples Newton starts exactly
there, and the turn would be lost. The branch test is

    cos((theta - c)/2) = cos(c/2) rho_0 + sin(c/2) h . vec(rho).
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ..algebra import ZERO, Scalar, Vec3
from .base import Drive, Pose, Primitive, Row, Twist


@dataclass(frozen=True)
class DrivenCoordinate(Primitive):
    """k: global unit direction [-]; s: arm to the point on body j [m]; drive: its displacement
    along k [m].
    """

    n = 1
    k: Vec3
    s: Vec3
    drive: Drive = field(default_factory=Drive)

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return (self.k @ (j.u + j.swing(self.s)) - self.drive.c,)


@dataclass(frozen=True)
class DrivenAngle(Primitive):
    """h: common axis of both bodies [-]; drive: angle of body j relative to body i about h
    [rad].
    """

    n = 1
    h: Vec3
    drive: Drive = field(default_factory=Drive)

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        rho = i.q.conjugate() * j.q
        return (2.0 * (self.drive.half_cos * (self.h @ rho.e) - self.drive.half_sin * rho.e0),)

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        h = i.turn(self.h)
        return (Row(ZERO, -h, ZERO, h),)

    def branch(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        rho = i.q.conjugate() * j.q
        return (self.drive.half_cos * rho.e0 + self.drive.half_sin * (self.h @ rho.e),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        return (self.drive.c_tt,)

    def nu(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return (self.drive.c_t,)
