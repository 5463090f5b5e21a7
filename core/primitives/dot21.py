"""Dot21: P_j stays on the line through P_i along h_i, for bodies that turn alike (2 rows).

Paper sec. 2.2.6, eq. (23); Table 2.

Const-C form (formulation section 3): where Dot12 holds, body j's arm can be carried by body i, so
body j's rotation and its arm drop out. With e = r_j - r_i = e0 + u_j - u_i between the body
origins, and a = A_i a0 for a0 = f, g:

    (23)  phi   = a . e - a0 . e0
          rows  = [ -a | a x e | a | 0 ]        exact for this phi everywhere
          gamma = -( (w_i x (w_i x a)) . e + 2 (w_i x a) . (v_j - v_i) )

Only together with Dot12 of the same joint: the rows of the line constraint alone (Dot20) differ
from these by multiples of the Dot12 rows. With the current A_ij in the residual, as the paper has
it, the same rows take one or two Newton passes more and lose their basin for long arms; that form
was rejected. Table 2 prints a spurious block and drops a dot (formulation section 9).
"""

from __future__ import annotations

from dataclasses import dataclass

from ..algebra import Scalar, Vec3
from .base import Pose, Primitive


@dataclass(frozen=True)
class Dot21(Primitive):
    """f, g: two axes perpendicular to the line [-]; e0: from body i's origin to body j's at design
    [m].
    """

    n = 2
    f: Vec3
    g: Vec3
    e0: Vec3

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        du = j.u - i.u
        return tuple(i.swing(a) @ (self.e0 + du) + a @ du for a in (self.f, self.g))
