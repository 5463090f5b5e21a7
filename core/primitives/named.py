"""Conditions that name a joint's own motion: RotX and TraX of the mixed formulation.

Formulation section 4.

The rotation theta about h and the displacement d along h enter as a drive, prescribed or an unknown
of its own. In global axes, with Q the rotation of theta about h as Euler parameters [cos theta/2, h
sin theta/2]:

    RotX   phi   = 2 vec( q_i Q(theta) conj(q_j) )
           rows  = [ 0 | I | 0 | -I ]          nu = -h_i theta_t
           gamma = -theta_t (w_i x h_i) - h_i theta_tt
    TraX   phi   = d0 + (P_j - P_i) - d h_i,   P measured since design
           rows  = [ -I | skew(S_i + d h_i) | I | -skew(S_j) ]          nu = h_i d_t
           gamma = w_i x (w_i x (S_i + d h_i)) - w_j x (w_j x S_j) + 2 d_t (w_i x h_i) + h_i d_tt

In section 4 TraX carries body j's arm by body i and theta, so that body j's rotation has no column;
here body j carries it, as in the spherical rows, which are the same where RotX holds and need no
theta.

RotX has no spurious zero and no counter of turns; its rows are exact where phi = 0, and lead from
any misalignment to it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ..algebra import Quat, Scalar, Vec3, cross, vec
from .base import Drive, Pose, Twist
from .dot12 import Dot12
from .spherical import Spherical


@dataclass(frozen=True)
class NamedTurn(Dot12):
    """h: axis of the turn [-]; drive: the turn of body j relative to body i about it [rad]."""

    h: Vec3
    drive: Drive = field(default_factory=Drive)

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        turn = Quat(self.drive.half_cos, self.drive.half_sin * self.h)
        return tuple(2.0 * (i.q * turn * j.q.conjugate()).e)

    def nu(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return tuple(-(self.drive.c_t * i.turn(self.h)))

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        h = i.turn(self.h)
        return tuple(-(self.drive.c_t * cross(vi.w, h) + self.drive.c_tt * h))


@dataclass(frozen=True, kw_only=True)
class NamedSlide(Spherical):
    """h: axis of the displacement [-]; drive: the displacement of P_j from P_i along it [m]."""

    h: Vec3
    drive: Drive = field(default_factory=Drive)

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return tuple(vec(super().phi(i, j)) - self.drive.c * i.turn(self.h))
