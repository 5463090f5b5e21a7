"""Vectors of jets, and intersections of circles and spheres: the parts of the closed forms of
linkages.

A mechanism is assembled point after point, each from its distances to known points. There are two
such points in the plane, on a circle and in space. The design position selects the side. A motion
reaches the other side only through a position with both points in one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from .jet import Jet, constant, cos, sin, sqrt

Numbers: TypeAlias = Sequence[float]


@dataclass(frozen=True, slots=True)
class Vec:
    """A vector of three jets, global axes."""

    x: Jet
    y: Jet
    z: Jet

    def __iter__(self) -> Iterator[Jet]:
        return iter((self.x, self.y, self.z))

    def __add__(self, b: Vec) -> Vec:
        return Vec(self.x + b.x, self.y + b.y, self.z + b.z)

    def __sub__(self, b: Vec) -> Vec:
        return Vec(self.x - b.x, self.y - b.y, self.z - b.z)

    def __rmul__(self, k: Jet | float) -> Vec:
        return Vec(self.x * k, self.y * k, self.z * k)

    def __matmul__(self, b: Vec) -> Jet:
        return self.x * b.x + self.y * b.y + self.z * b.z


def fixed(point: Numbers, like: Jet) -> Vec:
    """Return a vector that does not change."""
    x, y, z = point
    return Vec(constant(x, like), constant(y, like), constant(z, like))


def cross(a: Vec, b: Vec) -> Vec:
    """Return the vector product."""
    return Vec(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@dataclass(frozen=True)
class Circle:
    """The path of a point about an axis: centre and radius. The radius is u at design, and v after
    a right angle [m].
    """

    centre: Numbers
    u: Numbers
    v: Numbers

    @staticmethod
    def about(on_axis: Numbers, direction: Numbers, point: Numbers) -> Circle:
        """Return the circle of a point about an axis through another point, right-handed."""
        axis = np.array(direction) / np.linalg.norm(direction)
        centre = np.array(on_axis) + axis * (axis @ np.subtract(point, on_axis))
        u = np.array(point) - centre
        return Circle(centre.tolist(), u.tolist(), np.cross(axis, u).tolist())

    def at(self, c: Jet, s: Jet) -> Vec:
        """Return the point at an angle, given by its cosine and sine."""
        return fixed(self.centre, c) + c * fixed(self.u, c) + s * fixed(self.v, c)

    def turned(self, angle: Jet) -> Vec:
        """Return the point at an angle from the design [rad]."""
        return self.at(cos(angle), sin(angle))

    def meet(self, point: Vec, distance: float, side: float) -> Vec:
        """Return the point of the circle at a distance from a point [m].

        The equation |centre + u cos t + v sin t - point| = distance, squared, is
        A cos t + B sin t + C = 0  (Hartenberg and Denavit, Kinematic Synthesis of Linkages, 1964,
        ch. 12).

        Args:
            side: +1 or -1, the sign of  B cos t - A sin t:  the later or the earlier of the two
                answers on the circle.
        """
        like = point.x
        away, u, v = fixed(self.centre, like) - point, fixed(self.u, like), fixed(self.v, like)
        A, B, C = (
            2.0 * (away @ u),
            2.0 * (away @ v),
            away @ away + (float(np.dot(self.u, self.u)) - distance**2),
        )
        AABB = A * A + B * B
        S = side * sqrt(AABB - C * C)
        return self.at((B * S - A * C) / AABB, -(B * C + A * S) / AABB)


def meet_in_plane(a: Vec, aa: float, b: Vec, bb: float, side: float) -> Vec:
    """Return the point of the x-y plane with squared distances aa from a and bb from b.

    The point is  a + k p + h p_perp  with  p = b - a,  k = (p.p + aa - bb) / (2 p.p)  and
    k^2 + h^2 = aa / p.p.

    Args:
        side: +1 to the left of the line from a to b, -1 to its right.
    """
    p = b - a
    pp = p.x * p.x + p.y * p.y
    k = (pp + (aa - bb)) / (2.0 * pp)
    h = side * sqrt(constant(aa, pp) / pp - k * k)
    return Vec(a.x + k * p.x - h * p.y, a.y + k * p.y + h * p.x, a.z)


def meet_in_space(a: Vec, aa: Jet, b: Vec, bb: Jet, c: Vec, cc: Jet, side: float) -> Vec:
    """Return the point with squared distances aa, bb and cc from three points (trilateration).

    With p = b - a, q = c - a and n = p x q the point is  a + k p + l q + h n.  Its products with p
    and q,  (p.p + aa - bb) / 2  and  (q.q + aa - cc) / 2,  give k and l; h is the rest of aa.

    Args:
        side: +1 on the side of n, seen from the three points; else -1.
    """
    p, q = b - a, c - a
    n = cross(p, q)
    pp, pq, qq, nn = p @ p, p @ q, q @ q, n @ n
    along_p, along_q = 0.5 * (pp + aa - bb), 0.5 * (qq + aa - cc)
    in_plane = ((along_p * qq - along_q * pq) / nn) * p + ((along_q * pp - along_p * pq) / nn) * q
    return a + in_plane + (side * sqrt((aa - in_plane @ in_plane) / nn)) * n


def carried(before: tuple[Vec, Vec, Vec], now: tuple[Vec, Vec, Vec], point: Vec) -> Vec:
    """Return the present place of a point of a body, from three other points before and now.

    Its components along the three points' triangle and normal do not change; the dual basis gives
    them.
    """
    (a, b, c), (d, e, f) = before, now
    p, q, r = b - a, c - a, point - a
    n = cross(p, q)
    nn = n @ n
    k, l, h = (r @ cross(q, n)) / nn, (r @ cross(n, p)) / nn, (r @ n) / nn  # noqa: E741
    P, Q = e - d, f - d
    return d + k * P + l * Q + h * cross(P, Q)
