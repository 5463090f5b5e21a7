"""Dot20: a on body i is perpendicular to the line from P_i to P_j (1 row).

Paper sec. 2.2.5, eq. (22); Table 2.

In global axes, with a = A_i a0, S = A s, and d from P_i to P_j:

    (22)  phi   = a . d - c - a0 . d0     expanded about design; c is the driven displacement
          rows  = [ -a | a x (d + S_i) | a | S_j x a ]          exact everywhere
          gamma = c_tt - ( (w_i x (w_i x a)) . d + 2 (w_i x a) . ddot + a .
                  (w_j x (w_j x S_j) - w_i x (w_i x S_i)) )

The printed gamma20 is garbled beyond reading (formulation section 9); this one is the second
derivative of (22). r_j - r_i is formed from displacements before anything else, which keeps the
residual exact at any distance from the global origin.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ..algebra import Scalar, Vec3
from .base import Drive, Pose, Primitive


@dataclass(frozen=True)
class Dot20(Primitive):
    """a on body i [-]; arms s_i, s_j to P_i and P_j [m]; d0 from P_i to P_j at design [m]; drive:
    displacement along a [m].
    """

    n = 1
    a: Vec3
    s_i: Vec3
    s_j: Vec3
    d0: Vec3
    drive: Drive = field(default_factory=Drive)

    def change(self, i: Pose, j: Pose) -> Vec3:
        """Return the change of d since design."""
        return (j.u - i.u) + (j.swing(self.s_j) - i.swing(self.s_i))

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        dd = self.change(i, j)
        return (i.swing(self.a) @ (self.d0 + dd) + self.a @ dd - self.drive.c,)
