"""Ground: body j stays where it was at design (6 rows).  Formulation section 2.

    phi   = [ u_j ; 2 vec(q_j) ]       rows = [ . | . | I_6 ]       gamma = 0

Fixed bodies are normally eliminated and need no rows; these count them as the paper's Table 5 does,
and check that the elimination changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..algebra import ZERO, Scalar, X, Y, Z
from .base import Pose, Primitive, Row


@dataclass(frozen=True)
class Ground(Primitive):
    """No geometry; body i is the ground."""

    n = 6
    steady = True

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return *j.u, *(2.0 * j.q.e)

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        translation = (Row(ZERO, ZERO, e, ZERO) for e in (X, Y, Z))
        rotation = (Row(ZERO, ZERO, ZERO, e) for e in (X, Y, Z))
        return *translation, *rotation
