"""The steering axis of a wheel carrier on rods: that of the screw which four rods leave while the
height of the wheel centre is held.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from ...algebra import Vec3, cross
from ...jet import Jet

Column: TypeAlias = Sequence[Jet]


def rods_axis(center: Vec3, inner: Sequence[Vec3], outer: Sequence[Vec3]) -> tuple[Vec3, Vec3]:
    """Return the point of the axis nearest to the wheel centre [m], and a vector along it, with z =
    1.

    A rod along d with its outer end at r from the centre keeps its length if d . v + (r x d) . w =
    0, v being the velocity of the centre and w that of rotation. Four rods, v_z = 0 and w_z = 1
    leave four equations for v_x, v_y, w_x and w_y. The axis of a screw is at w x v / (w . w) from
    the centre.

    Args:
        inner, outer: ends of the four rods, in corner axes [m].
    """
    along = [b - a for a, b in zip(inner, outer, strict=True)]
    arms = [cross(b - center, d) for b, d in zip(outer, along, strict=True)]
    columns: list[Column] = [
        [each.x for each in along],
        [each.y for each in along],
        [each.x for each in arms],
        [each.y for each in arms],
    ]
    right = [-each.z for each in arms]
    whole = _determinant(columns)
    # Cramer's rule: jets allow no pivoting
    v_x, v_y, w_x, w_y = (
        _determinant([*columns[:k], right, *columns[k + 1 :]]) / whole for k in range(4)
    )
    w, v = Vec3(w_x, w_y, whole / whole), Vec3(v_x, v_y, 0.0)
    x, y, z = cross(w, v)
    square = w @ w
    return center + Vec3(x / square, y / square, z / square), w


def _determinant(columns: Sequence[Column]) -> Jet:
    """Return the determinant of four columns, by pairs of minors of two columns each (Laplace)."""
    a, b, c, d = columns

    def minor(p: Column, q: Column, i: int, j: int) -> Jet:
        return p[i] * q[j] - p[j] * q[i]

    rows = ((0, 1, 2, 3), (0, 3, 1, 2), (2, 3, 0, 1), (1, 2, 0, 3))
    odd = ((0, 2, 1, 3), (1, 3, 0, 2))
    total = [minor(a, b, i, j) * minor(c, d, k, m) for i, j, k, m in rows]
    less = [minor(a, b, i, j) * minor(c, d, k, m) for i, j, k, m in odd]
    return total[0] + total[1] + total[2] + total[3] - less[0] - less[1]
