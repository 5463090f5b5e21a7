"""Planar linkages with closed forms, and their random dimensions. Points of the plane are complex
numbers [m]; four-bars and slider-cranks have their crank's pivot at zero.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np

from .....algebra import triple
from .....joints import Cylindrical, Distance, Joint, Revolute, Spherical, Translational, Universal
from .....mechanism.mechanism import GROUND, Body, Mechanism, Point
from .....mechanism.motions import JointAngle, JointDisplacement
from .....trajectory import Array
from ...truth.motion import Motion
from ...truth.rows import Real, about, extended, unit
from .base import Rng, direction, power, sign, unit_vector

Moved: TypeAlias = tuple[Real, Real, Real]
"""Turn of a body, a point of it, and the point's displacement; see `Motion`."""
Planar: TypeAlias = Any
"""Points or vectors of a plane as complex numbers; arrays of them have extended precision."""


@dataclass(frozen=True, eq=False)
class Plane:
    """The plane of a linkage: its origin and axes, global [m]."""

    origin: Array
    e1: Array
    e2: Array

    def point(self, at: complex) -> tuple[float, float, float]:
        """Return the global position of a point of the plane, rounded once."""
        place = extended(self.origin) + self.lift(plan(at)[None])[:, 0]
        return triple(place.astype(np.float64))

    def lift(self, shift: Planar) -> Real:
        """Return global displacements from displacements in the plane, shape (3, n)."""
        e1, e2 = extended(self.e1)[:, None], extended(self.e2)[:, None]
        return e1 * shift.real + e2 * shift.imag

    @property
    def normal(self) -> tuple[float, float, float]:
        """Return the normal of the plane, global; turns are right-handed about it."""
        return triple(np.cross(self.e1, self.e2))

    def direction(self, at: complex) -> tuple[float, float, float]:
        """Return the global direction of a direction in the plane."""
        return triple(at.real * self.e1 + at.imag * self.e2)

    def rotation(self, angle: Real) -> Real:
        """Return the quaternion of a rotation in the plane, shape (4, n)."""
        return about(unit(np.cross(extended(self.e1), extended(self.e2))), angle)

    def link(self, a: Planar, b: Planar, now_a: Planar, now_b: Planar) -> Moved:
        """Return the motion of a body from two of its points, at design and now."""
        turn = np.angle(now_b - now_a) - np.angle(b - a)
        return self.rotation(turn), extended(self.point(complex(a[0]))), self.lift(now_a - a)


def any_plane(rng: Rng, origin: Array | None = None) -> Plane:
    """Return a plane of any direction through a point; by default the point is near the origin."""
    e3, e1 = direction(rng), direction(rng)
    e1 = unit_vector(np.cross(e3, e1))
    at = rng.uniform(-1.0, 1.0, 3) if origin is None else origin
    return Plane(at, e1, np.cross(e3, e1))


def flat_plane(rng: Rng, origin: Array) -> Plane:
    """Return a plane along two of the global axes: global coordinates are sums of two numbers,
    which are exact for suitable numbers.
    """
    first = int(rng.integers(3))
    return Plane(origin, np.eye(3)[first], np.eye(3)[(first + 1) % 3])


def plan(at: Any) -> Planar:
    """Return points of the plane in extended precision."""
    return np.asarray(at, dtype=np.clongdouble)


def polar(length: float, angle: float) -> complex:
    """Return a point of the plane at a distance and angle from zero."""
    return complex(length * np.cos(angle), length * np.sin(angle))


def square(a: Planar) -> Planar:
    """Return squares of lengths."""
    return a.real * a.real + a.imag * a.imag


def area(a: Planar, b: Planar) -> Planar:
    """Return the signed area between two vectors."""
    return a.real * b.imag - a.imag * b.real


def meet(first: Planar, p: Real, second: Planar, q: Real, side: float) -> Planar:
    """Return the intersection of circles with squared radii p and q about two points, on one side
    of the line through them; NaN if there is none.
    """
    d = second - first
    e = square(d)
    along = (p - q + e) / (2.0 * e)
    with np.errstate(invalid="ignore"):
        return first + along * d + side * np.sqrt(p / e - along * along) * (1j * d)


JOINTS_OF_A_LOOP = ("revolutes", "balls", "rod", "cylinders")
"""Ways to connect the coupler of a loop to its neighbours, with or without redundant rows."""


def coupler(
    way: str, plane: Plane, names: Sequence[str], start: complex, end: complex, label: str = ""
) -> tuple[list[Body], list[Joint]]:
    """Return bodies and joints of the coupler between two bodies at their points, or of a rod that
    replaces it.

    Args:
        names: of both bodies and the coupler.
        label: begins the names of the joints.
    """
    (first, second, coupler), n = names, plane.normal
    pin, other = plane.point(start), plane.point(end)
    along = plane.direction(end - start)
    across = triple(np.cross(n, along))
    if way == "rod":
        return [], [Distance(f"{label}rod", first, second, (pin, other))]
    ends = (f"{label}pin_1", first, coupler, pin), (f"{label}pin_2", coupler, second, other)
    joints: Mapping[str, tuple[Joint, Joint]] = {
        "revolutes": (Revolute(*ends[0], n), Revolute(*ends[1], n)),
        "balls": (Universal(*ends[0], (n, across)), Spherical(*ends[1])),
        "universals": (Universal(*ends[0], (across, n)), Universal(*ends[1], (n, along))),
        "cylinders": (Cylindrical(*ends[0], n), Spherical(*ends[1])),
    }
    return [Body(coupler)], [*joints[way]]


Linkage = tuple[Mechanism, Motion]
"""A mechanism and its closed form."""


def four_bar(
    plane: Plane,
    b: complex,
    d: complex,
    c: complex,
    way: str = "revolutes",
    *,
    parallel: bool = False,
) -> Linkage:
    """Return a four-bar: a driven crank from the plane's origin to B, a coupler from B to C, a
    rocker from C to D; a parallelogram passes its turning points.
    """
    pivot = plane.point(0j)
    crank = Mechanism(
        "crank",
        [Body("crank")],
        [Revolute("pivot", GROUND, "crank", pivot, plane.normal)],
        [Point("B", "crank", plane.point(b))],
        [JointAngle("turn", "pivot")],
    )

    def motion(drives: Real) -> Mapping[str, Moved]:
        still = np.zeros((3, drives.shape[1]), dtype=np.longdouble)
        return {"crank": (plane.rotation(drives[0]), extended(pivot), still)}

    found, closed = add_loop((crank, motion), plane, b, d, c, way, "", parallel=parallel)
    return replace(found, name="four_bar"), closed


def add_loop(
    first: Linkage,
    plane: Plane,
    b: complex,
    d: complex,
    c: complex,
    way: str,
    label: str,
    *,
    parallel: bool = False,
) -> Linkage:
    """Return a linkage with a further coupler and rocker on its crank, whose names begin with the
    label.

    The closed form is in the assembly of the design, between the turning points of the crank. It is
    that of all loops, because only the crank connects them.
    """
    single, others = first
    rocker = f"{label}rocker"
    bodies, joints = coupler(way, plane, ("crank", rocker, f"{label}coupler"), b, c, label)
    rest = Revolute(f"{label}rest", GROUND, rocker, plane.point(d), plane.normal)
    mechanism = Mechanism(
        "two_loops",
        [*single.bodies, Body(rocker), *bodies],
        [*single.joints, rest, *joints],
        [*single.points, Point(f"{label}C", rocker, plane.point(c))],
        single.drivers,
    )
    B, C, D = (plan(each)[None] for each in (b, c, d))
    p, q = square(C - B), square(C - D)
    side = float(np.sign(area(D - B, C - B)[0]))
    first_turn, last_turn = (-np.inf, np.inf) if parallel else turning_range(B, D, p, q)

    def motion(drives: Real) -> Mapping[str, Moved]:
        turn = drives[0]
        turn = np.where((first_turn < turn) & (turn < last_turn), turn, np.nan)
        now_b = B * np.exp(1j * turn)
        now_c = now_b + (C - B) if parallel else meet(now_b, p, D + 0.0 * now_b, q, side)
        return {
            **others(drives),
            rocker: plane.link(D, C, D, now_c),
            f"{label}coupler": plane.link(B, C, now_b, now_c),
        }

    return mechanism, motion


def turning_range(b: Planar, d: Planar, p: Real, q: Real) -> tuple[float, float]:
    """Return the range of rotation of a crank at b, from there, in both directions.

    The coupler and the rocker have squared lengths p and q; the rocker's pivot is at d. The law of
    cosines gives the cosines of the crank's angle from the ground with coupler and rocker folded or
    stretched out. A cosine between -1 and 1 is a turning point; other cosines are no limit.
    """
    r2, g2 = square(b)[0], square(d)[0]
    at = np.angle(b)[0] - np.angle(d)[0]
    at = np.arctan2(np.sin(at), np.cos(at))
    # all angles of turning points, in the full turn and one full turn to either side
    stops: list[Any] = []
    for bend in (-1.0, 1.0):
        length = np.sqrt(p[0]) + bend * np.sqrt(q[0])
        with np.errstate(divide="ignore", invalid="ignore"):  # a crank or ground without length
            cosine = (r2 + g2 - length * length) / (2.0 * np.sqrt(r2 * g2))
        if -1.0 < cosine < 1.0:
            stop = float(np.arccos(cosine))
            stops += [k * 2.0 * np.pi + s * stop - at for s in (-1.0, 1.0) for k in (-1, 0, 1)]
    behind, ahead = [x for x in stops if x < 0.0], [x for x in stops if x > 0.0]
    return float(max(behind, default=-np.inf)), float(min(ahead, default=np.inf))


def flats(b: complex, d: complex) -> list[float]:
    """Return the rotations of a crank at b, up to two turns, that bring it into the line of the
    ground: it points to the pivot at d, or away from it.
    """
    at = float(np.angle(plan(b)) - np.angle(plan(d)))
    return [k * math.pi - at for k in range(-4, 5)]


def slider_crank(plane: Plane, b: complex, c: complex, way: str, drive: str) -> Linkage:
    """Return a slider-crank: a crank from the plane's origin to B, a coupler from B to C on a
    slider along the first axis; "turn" or "slide" is driven.

    In the closed form, a quadratic equation gives the slider, or two circles give the crank.
    """
    pivot, pin, slider = (plane.point(each) for each in (0j, b, c))
    bodies, joints = coupler(way, plane, ("crank", "slider", "coupler"), b, c)
    mechanism = Mechanism(
        "slider_crank",
        [Body("crank"), Body("slider", slider), *bodies],
        [
            Revolute("pivot", GROUND, "crank", pivot, plane.normal),
            Translational("guide", GROUND, "slider", slider, plane.direction(1.0 + 0j)),
            *joints,
        ],
        [Point("B", "crank", pin), Point("C", "slider", slider)],
        [JointAngle("turn", "pivot") if drive == "turn" else JointDisplacement("slide", "guide")],
    )
    B, C = plan(b)[None], plan(c)[None]
    r2, l2 = square(B), square(C - B)
    side, ahead = float(np.sign(area(C, B)[0])), float(np.sign((C - B).real[0]))

    def motion(drives: Real) -> Mapping[str, Moved]:
        turn = value = drives[0]
        if drive == "turn":
            now_b = B * np.exp(1j * turn)
            back = (C - now_b).real  # |C + s - B|^2 = l^2
            with np.errstate(invalid="ignore"):
                s = -back + ahead * np.sqrt(back * back - square(C - now_b) + l2)
            now_c = C + s
        else:
            # beyond the pivot the linkage can be assembled, but no motion leads there
            now_c = C + np.where((C + value).real * C.real > 0.0, value, np.nan)
            now_b = meet(0.0 * now_c, r2, now_c, l2, side)
            turn = np.angle(now_b) - np.angle(B)
        still = np.zeros((3, len(turn)), dtype=np.longdouble)
        return {
            "crank": (plane.rotation(turn), extended(pivot), still),
            "slider": (plane.rotation(0.0 * turn), extended(slider), plane.lift(now_c - C)),
            "coupler": plane.link(B, C, now_b, now_c),
        }

    return mechanism, motion


# Random dimensions


def nearly_parallel(rng: Rng) -> tuple[complex, complex, complex, float]:
    """Return B, D and C of a parallelogram, and its error; it folds flat twice a turn."""
    off = 0.0 if rng.random() < 0.25 else power(rng, -12.0, -2.0) * sign(rng)
    crank = float(rng.uniform(0.2, 0.5))
    b = polar(crank, rng.uniform(0.8, 2.2))
    # The crank is the shortest bar, and the coupler is as long as the ground. By Grashof the crank
    # turns if the rocker is longer than the crank.
    c = b + 1.0
    if off:
        c = complex(meet(plan(b), extended(1.0), plan(1.0), extended((crank + off) ** 2), 1.0))
    return b, 1.0 + 0j, c, off


def nearly_kite(rng: Rng) -> tuple[complex, complex, complex, float]:
    """Return B, D and C of a kite, and its error. The crank is as long as the ground, except for
    the error, and passes the rocker's pivot.
    """
    off, up = power(rng, -9.0, -2.0), rng.uniform(0.8, 2.2)
    long, b, d = float(rng.uniform(0.8, 1.2)), polar(0.4 * (1.0 - off), up), 0.4 + 0j
    half = np.array([d.real - b.real, d.imag - b.imag]) / 2.0
    height = np.sqrt(long**2 - half @ half)
    away = np.array([-half[1], half[0]]) / np.hypot(*half) * height
    return b, d, (b + d) / 2.0 + complex(*away), off


def rockers(rng: Rng) -> tuple[complex, complex, complex]:
    """Return B, D and C of a four-bar whose longest bar is between the pivots: neither the crank
    nor the rocker turns fully.
    """
    b = complex(rng.uniform(-0.2, 0.2), rng.uniform(0.4, 0.6))
    d = complex(rng.uniform(1.0, 1.1))
    return b, d, complex(rng.uniform(0.5, 0.8), rng.uniform(0.5, 0.7))


def crank_rocker(
    rng: Rng, scale: float = 1.0, grid: float = 0.0
) -> tuple[complex, complex, complex]:
    """Return B, D and C of a four-bar far from its change points, whose crank turns fully.

    The points lie on a grid, unless the grid is zero.
    """
    while True:
        turn, high = rng.uniform(0.0, 2.0 * np.pi), sign(rng)
        crank, d = rng.uniform(0.15, 0.4), complex(rng.uniform(0.8, 1.2))
        x, y = rng.uniform(0.2, 1.0), high * rng.uniform(0.5, 1.0)
        b, d, c = (
            scale * each for each in snap_to_grid(grid, polar(crank, turn), d, complex(x, y))
        )
        first, *bars = abs(b), abs(d), abs(c - b), abs(d - c)
        if first < min(bars) and first + max(bars) < 0.95 * (sum(bars) - max(bars)):
            return b, d, c


def turning_crank(rng: Rng, grid: float = 0.0) -> tuple[complex, ...]:
    """Return B and C of a slider-crank whose crank turns fully. The guide along the first axis may
    miss the pivot.
    """
    turn, crank = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.15, 0.4)
    offset = rng.uniform(-0.2, 0.2)
    return snap_to_grid(grid, polar(crank, turn), complex(rng.uniform(1.0, 1.3), offset))


def snap_to_grid(grid: float, *points: complex) -> tuple[complex, ...]:
    """Return points on a grid, unless it is zero."""
    if not grid:
        return points
    return tuple(complex(np.round(point / grid) * grid) for point in points)
