"""Dot12: the joint frames of both bodies coincide (3 rows).

Paper sec. 2.2.4, eqs (17)-(21); Table 1.

With e the vector part of the Euler parameters of the rotation from body j to body i, global axes:

    phi   = 2 vec( q_i conj(q_j) )
    rows  = [ 0 | I | 0 | -I ]       literally constant; exact where phi = 0
    gamma = 0

The paper's residual (17), B_i [g_i . h_j, h_i . f_j, f_i . g_j], agrees with this to first order
and has the same rows, but it is also zero at seven other rotations (turns of 180 and of 120
degrees), all of them regular for exact rows. The Euler parameters vanish at coincidence only and
are singular at an error of 180 degrees alone (formulation sections 3 and 4, RotX with theta = 0),
so no branch test is needed. q_j = -q_i is the same rotation; it repels, and Euler parameters
followed from design on do not come there.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..algebra import ZERO, Scalar, X, Y, Z
from .base import Pose, Primitive, Row, Twist


@dataclass(frozen=True)
class Dot12(Primitive):
    """No geometry: both bodies turn alike from design on."""

    n = 3
    steady = True

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return tuple(2.0 * (i.q * j.q.conjugate()).e)

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        return tuple(Row(ZERO, e, ZERO, -e) for e in (X, Y, Z))

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        return 0.0, 0.0, 0.0
