"""Planar linkages with closed forms, for the families of sizes, offsets, rates and reaches."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ....algebra import triple
from ....joints import Cylindrical, Distance, Joint, Revolute, Spherical, Translational, Universal
from ....mechanism.mechanism import Body, Mechanism, Point
from ....mechanism.motions import JointAngle, JointDisplacement
from ....trajectory import Array
from ...truth.motion import Motion
from ...truth.rows import Real, extended, unit
from .base import Rng, direction

Plan = tuple[float, float]
"""A point in the plane."""


@dataclass(frozen=True, eq=False)
class Plane:
    """The plane of a linkage: its origin and axes, global [m]."""

    origin: Array
    e1: Array
    e2: Array

    def point(self, at: Plan) -> tuple[float, float, float]:
        """Return the global position of a point of the plane, rounded once."""
        return triple(
            np.asarray(
                extended(self.origin) + self.lift(extended(at)[:, None])[:, 0], dtype=np.float64
            )
        )

    def lift(self, shift: Real) -> Real:
        """Return global displacements from displacements in the plane, shape (3, n)."""
        e1, e2 = map(extended, (self.e1, self.e2))
        return e1[:, None] * shift[0] + e2[:, None] * shift[1]

    @property
    def normal(self) -> tuple[float, float, float]:
        """Return the normal of the plane, global; turns are right-handed about it."""
        return triple(np.cross(self.e1, self.e2))

    def along(self, at: Plan) -> tuple[float, float, float]:
        """Return the global direction of a direction in the plane."""
        return triple(at[0] * self.e1 + at[1] * self.e2)

    def turned(self, angle: Real) -> Real:
        """Return the quaternion of a rotation in the plane, shape (4, n)."""
        h = unit(extended(np.cross(extended(self.e1), extended(self.e2))))
        return np.concatenate([np.cos(angle / 2)[None], h[:, None] * np.sin(angle / 2)])


def any_plane(rng: Rng, origin: Array | None = None) -> Plane:
    """Return a plane of any direction through a point; by default the point is near the origin."""
    e3, e1 = direction(rng), direction(rng)
    e1 = np.cross(e3, e1)
    e1 = e1 / np.linalg.norm(e1)
    at = rng.uniform(-1.0, 1.0, 3) if origin is None else origin
    return Plane(at, e1, np.cross(e3, e1))


def flat_plane(rng: Rng, origin: Array) -> Plane:
    """Return a plane along two of the global axes: global coordinates are sums of two numbers,
    which are exact for suitable numbers.
    """
    first = int(rng.integers(3))
    e1, e2 = np.eye(3)[first], np.eye(3)[(first + 1) % 3]
    return Plane(origin, e1, e2)


def spin(angle: Real, at: Plan | Real) -> Real:
    """Return a point of the plane after a rotation about the origin, shape (2, n)."""
    x, y = (extended(each) for each in at)
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * x - s * y, s * x + c * y])


def heading(a: Real) -> Real:
    """Return the angle of vectors of shape (2, n)."""
    return np.arctan2(a[1], a[0])


def meet(first: Real, p: Real, second: Real, q: Real, side: float) -> Real:
    """Return the intersection of circles with squared radii p and q about two points, on one side
    of the line through them; NaN if there is none.
    """
    d = second - first
    e = (d * d).sum(axis=0)
    along = (p - q + e) / (2.0 * e)
    with np.errstate(invalid="ignore"):
        across = side * np.sqrt(p / e - along * along)
    return first + along * d + across * np.stack([-d[1], d[0]])


JOINTS_OF_A_LOOP = ("revolutes", "balls", "rod", "cylinders")
"""Ways to connect the coupler of a loop to its neighbours, with or without redundant rows."""


def coupled(
    way: str, plane: Plane, names: tuple[str, str, str], at: tuple[Plan, Plan], label: str = ""
) -> tuple[list[Body], list[Joint]]:
    """Return bodies and joints of the coupler between two bodies at their points, or of a rod that
    replaces it.
    """
    first, second, coupler = names
    start, end = map(plane.point, at)
    n = plane.normal
    along = plane.along((at[1][0] - at[0][0], at[1][1] - at[0][1]))
    across = triple(np.cross(n, along))
    if way == "rod":
        return [], [Distance(f"{label}rod", first, second, (start, end))]
    pin_1, pin_2 = f"{label}pin_1", f"{label}pin_2"
    joints: Mapping[str, Sequence[Joint]] = {
        "revolutes": (
            Revolute(pin_1, first, coupler, start, n),
            Revolute(pin_2, coupler, second, end, n),
        ),
        "balls": (
            Universal(pin_1, first, coupler, start, (n, across)),
            Spherical(pin_2, coupler, second, end),
        ),
        "universals": (
            Universal(pin_1, first, coupler, start, (across, n)),
            Universal(pin_2, coupler, second, end, (n, along)),
        ),
        "cylinders": (
            Cylindrical(pin_1, first, coupler, start, n),
            Spherical(pin_2, coupler, second, end),
        ),
    }
    return [Body(coupler)], list(joints[way])


def four_bar(
    plane: Plane, b: Plan, d: Plan, c: Plan, way: str = "revolutes", turn: str = "turn"
) -> Mechanism:
    """Return a four-bar: a driven crank from the plane's origin to B, a coupler from B to C, a
    rocker from C to D.
    """
    bodies, joints = coupled(way, plane, ("crank", "rocker", "coupler"), (b, c))
    return Mechanism(
        "four_bar",
        [Body("crank"), Body("rocker"), *bodies],
        [
            Revolute("pivot", "ground", "crank", plane.point((0.0, 0.0)), plane.normal),
            Revolute("rest", "ground", "rocker", plane.point(d), plane.normal),
        ]
        + joints,
        [Point("B", "crank", plane.point(b)), Point("C", "rocker", plane.point(c))],
        [JointAngle(turn, "pivot")],
    )


def four_bar_motion(plane: Plane, b: Plan, d: Plan, c: Plan, parallel: bool = False) -> Motion:
    """Return the closed form of a four-bar in the assembly of the design, between the crank's
    turning points; a parallelogram passes them.
    """
    B, C, D = (extended(each)[:, None] for each in (b, c, d))
    p, q = ((C - B) ** 2).sum(axis=0), ((C - D) ** 2).sum(axis=0)
    side = float(np.sign((D - B)[0, 0] * (C - B)[1, 0] - (D - B)[1, 0] * (C - B)[0, 0]))
    first, last = (-np.inf, np.inf) if parallel else turning_range(B, D, p, q)
    pivot, pin, rest = (extended(plane.point(each)) for each in ((0.0, 0.0), b, d))

    def motion(drives: Real) -> Mapping[str, tuple[Real, Real, Real]]:
        turn = np.where((first < drives[0]) & (drives[0] < last), drives[0], np.nan)
        now_b = spin(turn, b)
        now_c = now_b + (C - B) if parallel else meet(now_b, p, D + 0.0 * now_b, q, side)
        still = np.zeros((3, len(turn)), dtype=np.longdouble)
        return {
            "crank": (plane.turned(turn), pivot, still),
            "rocker": (plane.turned(heading(now_c - D) - heading(C - D)), rest, still),
            "coupler": (
                plane.turned(heading(now_c - now_b) - heading(C - B)),
                pin,
                plane.lift(now_b - B),
            ),
        }

    return motion


def turning_range(b: Real, d: Real, p: Real, q: Real) -> tuple[float, float]:
    """Return the range of rotation of a crank at b, from there, in both directions.

    The coupler and the rocker have squared lengths p and q; the rocker's pivot is at d. The law of
    cosines gives the cosines of the crank's angle from the ground with coupler and rocker folded or
    stretched out. A cosine between -1 and 1 is a turning point; other cosines are no limit.
    """
    r2, g2 = (b * b).sum(axis=0)[0], (d * d).sum(axis=0)[0]
    folded, stretched = ((np.sqrt(p[0]) + sign * np.sqrt(q[0])) ** 2 for sign in (-1.0, 1.0))
    nearest, farthest = ((r2 + g2 - e) / (2.0 * np.sqrt(r2 * g2)) for e in (folded, stretched))
    at = heading(b)[0] - heading(d)[0]
    at = np.arctan2(np.sin(at), np.cos(at))
    low, high = (float(np.arccos(x)) if -1.0 < x < 1.0 else None for x in (nearest, farthest))
    # all angles of turning points, in the full turn and one full turn to either side
    stops = [
        k * 2.0 * np.pi + sign * stop
        for stop in (low, high)
        if stop is not None
        for sign in (-1.0, 1.0)
        for k in (-1, 0, 1)
    ]
    ahead, behind = (
        [stop - at for stop in stops if stop > at],
        [stop - at for stop in stops if stop < at],
    )
    return float(max(behind, default=-np.inf)), float(min(ahead, default=np.inf))


def flats(b: Plan, d: Plan) -> list[float]:
    """Return the rotations of a crank at b, up to two turns, that bring it into the line of the
    ground: it points to the pivot at d, or away from it.
    """
    at = float(heading(extended(b)) - heading(extended(d)))
    return [k * math.pi - at for k in range(-4, 5)]


def slider_crank(
    plane: Plane, b: Plan, c: Plan, way: str, drive: str, guide: Plan = (1.0, 0.0)
) -> Mechanism:
    """Return a slider-crank: a crank from the plane's origin to B, a coupler from B to C on a
    slider along the guide; "turn" or "slide" is driven.
    """
    bodies, joints = coupled(way, plane, ("crank", "slider", "coupler"), (b, c))
    driver = JointAngle("turn", "pivot") if drive == "turn" else JointDisplacement("slide", "guide")
    return Mechanism(
        "slider_crank",
        [Body("crank"), Body("slider", plane.point(c)), *bodies],
        [
            Revolute("pivot", "ground", "crank", plane.point((0.0, 0.0)), plane.normal),
            Translational("guide", "ground", "slider", plane.point(c), plane.along(guide)),
            *joints,
        ],
        [Point("B", "crank", plane.point(b)), Point("C", "slider", plane.point(c))],
        [driver],
    )


def slider_crank_motion(
    plane: Plane, b: Plan, c: Plan, drive: str, guide: Plan = (1.0, 0.0)
) -> Motion:
    """Return the closed form of a slider-crank with a guide vector of length one: a quadratic
    equation gives the slider, or two circles give the crank.
    """
    B, C, g = (extended(each)[:, None] for each in (b, c, guide))
    r2, l2 = (B * B).sum(axis=0), ((C - B) ** 2).sum(axis=0)
    side = float(np.sign(C[0, 0] * B[1, 0] - C[1, 0] * B[0, 0]))
    ahead = float(np.sign(((C - B) * g).sum()))
    pivot, pin, slider = (extended(plane.point(each)) for each in ((0.0, 0.0), b, c))

    def motion(drives: Real) -> Mapping[str, tuple[Real, Real, Real]]:
        value = drives[0]
        if drive == "turn":
            now_b = spin(value, b)
            back = ((C - now_b) * g).sum(axis=0)  # |C + s g - B|^2 = l^2
            with np.errstate(invalid="ignore"):
                s = -back + ahead * np.sqrt(back * back - ((C - now_b) ** 2).sum(axis=0) + l2)
            turn, now_c = value, C + s * g
        else:
            # beyond the pivot the linkage can be assembled, but no motion leads there
            value = np.where(((C + value * g) * g).sum(axis=0) * (C * g).sum() > 0.0, value, np.nan)
            now_c = C + value * g
            now_b = meet(0.0 * now_c, r2 + 0.0 * value, now_c, l2 + 0.0 * value, side)
            turn = heading(now_b) - heading(B)
        return {
            "crank": (plane.turned(turn), pivot, np.zeros((3, len(turn)), dtype=np.longdouble)),
            "slider": (plane.turned(0.0 * turn), slider, plane.lift(now_c - C)),
            "coupler": (
                plane.turned(heading(now_c - now_b) - heading(C - B)),
                pin,
                plane.lift(now_b - B),
            ),
        }

    return motion
