"""Linkages in a plane with closed forms: what the families of sizes, offsets, rates and reaches are made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ....drivers import JointAngle, JointDisplacement
from ....joints import Cylindrical, Distance, Joint, Revolute, Spherical, Translational, Universal
from ....mechanism import Body, Mechanism, Point
from ....trajectory import Array
from ..extended import Real, extended, unit
from ..truth import Motion
from .base import Rng, direction, triple

Plan = tuple[float, float]
"""A point in the plane."""


@dataclass(frozen=True, eq=False)
class Plane:
    """Where the plane is: its origin and axes, global [m]."""

    origin: Array
    e1: Array
    e2: Array

    def point(self, at: Plan) -> tuple[float, float, float]:
        """A point of the plane in space, rounded once."""
        return triple(np.asarray(self.place(extended(at)[:, None])[:, 0], dtype=np.float64))

    def place(self, at: Real) -> Real:
        """Points of the plane in space, shape (3, n)."""
        e1, e2, o = map(extended, (self.e1, self.e2, self.origin))
        return o[:, None] + e1[:, None] * at[0] + e2[:, None] * at[1]

    @property
    def normal(self) -> tuple[float, float, float]:
        """Of the plane; turns go by the right hand about it."""
        return triple(np.cross(self.e1, self.e2))

    def along(self, at: Plan) -> tuple[float, float, float]:
        """A direction of the plane in space."""
        return triple(at[0] * self.e1 + at[1] * self.e2)

    def turned(self, angle: Real) -> Real:
        """The quaternion of a turn, shape (4, n)."""
        h = unit(extended(np.cross(extended(self.e1), extended(self.e2))))
        return np.concatenate([np.cos(angle / 2)[None], h[:, None] * np.sin(angle / 2)])


def any_plane(rng: Rng) -> Plane:
    """Anyhow in space, near the origin."""
    e3, e1 = direction(rng), direction(rng)
    e1 = np.cross(e3, e1)
    e1 = e1 / np.linalg.norm(e1)
    return Plane(rng.uniform(-1.0, 1.0, 3), e1, np.cross(e3, e1))


def flat_plane(rng: Rng, origin: Array) -> Plane:
    """Along two of the global axes: coordinates of points are sums of plain numbers, exact where these are."""
    first = int(rng.integers(3))
    e1, e2 = np.eye(3)[first], np.eye(3)[(first + 1) % 3]
    return Plane(origin, e1, e2)


def spin(angle: Real, at: Plan | Real) -> Real:
    """A point of the plane turned about the origin, shape (2, n)."""
    x, y = (extended(each) for each in at)
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * x - s * y, s * x + c * y])


def heading(a: Real) -> Real:
    """The angle of vectors of shape (2, n)."""
    return np.arctan2(a[1], a[0])


def meet(P: Real, p: Real, Q: Real, q: Real, side: float) -> Real:
    """Where circles of squared radii p about P and q about Q meet, on the side of the line from P to Q; NaN where they do not."""
    d = Q - P
    e = (d * d).sum(axis=0)
    along = (p - q + e) / (2.0 * e)
    with np.errstate(invalid="ignore"):
        across = side * np.sqrt(p / e - along * along)
    return P + along * d + across * np.stack([-d[1], d[0]])


JOINTS_OF_A_LOOP = ("revolutes", "balls", "rod", "cylinders")
"""How the coupler of a loop hangs on its neighbours: with three redundant rows, or none."""


def coupled(way: str, plane: Plane, names: tuple[str, str, str], at: tuple[Plan, Plan]) -> tuple[list[Body], list[Joint]]:
    """The coupler, or the rod in its place, between two bodies at their points: bodies and joints of it."""
    first, second, coupler = names
    P, Q = map(plane.point, at)
    n = plane.normal
    along = plane.along((at[1][0] - at[0][0], at[1][1] - at[0][1]))
    across = triple(np.cross(n, along))
    if way == "rod":
        return [], [Distance("rod", first, second, (P, Q))]
    joints: Mapping[str, Sequence[Joint]] = {
        "revolutes": (Revolute("pin_1", first, coupler, P, n), Revolute("pin_2", coupler, second, Q, n)),
        "balls": (Universal("pin_1", first, coupler, P, (n, across)), Spherical("pin_2", coupler, second, Q)),
        "cylinders": (Cylindrical("pin_1", first, coupler, P, n), Spherical("pin_2", coupler, second, Q)),
    }
    return [Body(coupler)], list(joints[way])


def four_bar(plane: Plane, B: Plan, D: Plan, C: Plan, way: str = "revolutes", turn: str = "turn") -> Mechanism:
    """A crank from the origin of the plane to B, a coupler to C, a rocker to D; the crank is driven."""
    bodies, joints = coupled(way, plane, ("crank", "rocker", "coupler"), (B, C))
    A = plane.point((0.0, 0.0))
    return Mechanism(
        "four_bar",
        [Body("crank"), Body("rocker"), *bodies],
        [Revolute("pivot", "ground", "crank", A, plane.normal), Revolute("rest", "ground", "rocker", plane.point(D), plane.normal)]
        + joints,
        [Point("B", "crank", plane.point(B)), Point("C", "rocker", plane.point(C))],
        [JointAngle(turn, "pivot")],
    )


def four_bar_motion(plane: Plane, B: Plan, D: Plan, C: Plan, parallel: bool = False) -> Motion:
    """Its closed form, on the side of the design all along; or of the parallelogram, that goes through its change points."""
    b, c, d = (extended(each)[:, None] for each in (B, C, D))
    p, q = ((c - b) ** 2).sum(axis=0), ((c - d) ** 2).sum(axis=0)
    side = float(np.sign((d - b)[0, 0] * (c - b)[1, 0] - (d - b)[1, 0] * (c - b)[0, 0]))

    def motion(drives: Real) -> Mapping[str, tuple[Real, Real, Real]]:
        turn = drives[0]
        now_b = spin(turn, B)
        now_c = now_b + (c - b) if parallel else meet(now_b, p, d + 0.0 * now_b, q, side)
        a, at_b, at_d = (extended(plane.point(x)) for x in ((0.0, 0.0), B, D))
        still = np.repeat(a[:, None], len(turn), axis=1)
        rest = np.repeat(at_d[:, None], len(turn), axis=1)
        rocked = heading(now_c - d) - heading(c - d)
        carried = heading(now_c - now_b) - heading(c - b)
        return {
            "crank": (plane.turned(turn), a, still),
            "rocker": (plane.turned(rocked), at_d, rest),
            "coupler": (plane.turned(carried), at_b, plane.place(now_b)),
        }

    return motion


def slider_crank(plane: Plane, B: Plan, C: Plan, way: str, drive: str, guide: Plan = (1.0, 0.0)) -> Mechanism:
    """A crank from the origin of the plane to B, a coupler to C on a slider along the guide; "turn" or "slide" is driven."""
    bodies, joints = coupled(way, plane, ("crank", "slider", "coupler"), (B, C))
    driver = JointAngle("turn", "pivot") if drive == "turn" else JointDisplacement("slide", "guide")
    return Mechanism(
        "slider_crank",
        [Body("crank"), Body("slider", plane.point(C)), *bodies],
        [
            Revolute("pivot", "ground", "crank", plane.point((0.0, 0.0)), plane.normal),
            Translational("guide", "ground", "slider", plane.point(C), plane.along(guide)),
            *joints,
        ],
        [Point("B", "crank", plane.point(B)), Point("C", "slider", plane.point(C))],
        [driver],
    )


def slider_crank_motion(plane: Plane, B: Plan, C: Plan, drive: str, guide: Plan = (1.0, 0.0)) -> Motion:
    """Its closed form, the guide of length one: the crank by the slider's circle and the coupler's, or the slider by a quadratic."""
    b, c, g = (extended(each)[:, None] for each in (B, C, guide))
    r2, l2 = (b * b).sum(axis=0), ((c - b) ** 2).sum(axis=0)
    side = float(np.sign(c[0, 0] * b[1, 0] - c[1, 0] * b[0, 0]))
    ahead = float(np.sign(((c - b) * g).sum()))

    def motion(drives: Real) -> Mapping[str, tuple[Real, Real, Real]]:
        value = drives[0]
        if drive == "turn":
            now_b = spin(value, B)
            back = ((c - now_b) * g).sum(axis=0)  # |c + s g - b|^2 = l^2
            with np.errstate(invalid="ignore"):
                s = -back + ahead * np.sqrt(back * back - ((c - now_b) ** 2).sum(axis=0) + l2)
            turn, now_c = value, c + s * g
        else:
            now_c = c + value * g
            now_b = meet(0.0 * now_c, r2 + 0.0 * value, now_c, l2 + 0.0 * value, side)
            turn = heading(now_b) - heading(b)
        a, at_b, at_c = (extended(plane.point(x)) for x in ((0.0, 0.0), B, C))
        return {
            "crank": (plane.turned(turn), a, np.repeat(a[:, None], len(value), axis=1)),
            "slider": (plane.turned(0.0 * turn + 0.0 * now_c[0]), at_c, plane.place(now_c)),
            "coupler": (plane.turned(heading(now_c - now_b) - heading(c - b)), at_b, plane.place(now_b)),
        }

    return motion


def crank_rocker(rng: Rng, scale: float = 1.0, grid: float = 0.0) -> tuple[Plan, Plan, Plan]:
    """B, D and C of a four-bar whose crank turns freely, far from its change points; on a grid unless that is zero."""
    while True:
        turn, high = rng.uniform(0.0, 2.0 * np.pi), rng.choice([-1.0, 1.0])
        crank, ground = rng.uniform(0.15, 0.4), rng.uniform(0.8, 1.2)
        points = np.array([[crank * np.cos(turn), crank * np.sin(turn)], [ground, 0.0], [rng.uniform(0.2, 1.0), 0.0]])
        points[2, 1] = high * rng.uniform(0.5, 1.0)
        points = scale * (np.round(points / grid) * grid if grid else points)
        b, d, c = points
        bars = sorted([np.hypot(*b), np.hypot(*d), np.hypot(*(c - b)), np.hypot(*(d - c))])
        if bars[0] == np.hypot(*b) and bars[0] + bars[3] < 0.95 * (bars[1] + bars[2]):
            return _plan(b), _plan(d), _plan(c)


def turning_crank(rng: Rng, grid: float = 0.0) -> tuple[Plan, Plan]:
    """B and C of a slider-crank whose crank turns freely; the guide along the first axis may pass the pivot."""
    turn, crank, offset = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.15, 0.4), rng.uniform(-0.2, 0.2)
    points = np.array([[crank * np.cos(turn), crank * np.sin(turn)], [rng.uniform(1.0, 1.3), offset]])
    b, c = np.round(points / grid) * grid if grid else points
    return _plan(b), _plan(c)


def _plan(x: Array) -> Plan:
    return float(x[0]), float(x[1])
