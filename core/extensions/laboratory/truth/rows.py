"""The rows of a mechanism, written independently of the solver: full products of vectors, in
extended precision, without simplification. The tests' naive equations state the joints a second
time: their rows and rates follow from residuals alone, those here are derived by hand, so neither
repeats a slip of the other.

They share only the meaning of a joint's fields with the tested primitives, rows and programs. A row
is a sum of terms minus a constant: its value at design, or zero; the row of a curve has a function
of a sum beside it. A term is a product x . y / L of
two vectors, or the angle from body i to body j about an axis of i. A vector leads from a point of
body i to a point of body j (s = 1), or it is a direction of body i, of body j or of the ground
(s = 0). With the arms r from the centres to the points, of a direction a of body i r_i = -a, and of
one of body j r_j = a, with translations u and angular velocities w:

    x   = x0 + s (u_j - u_i) + (R_j - I) r_j - (R_i - I) r_i
    x'  = s (u_j' - u_i') + w_j x r_j - w_i x r_i
    x'' = w_j x (w_j x r_j) - w_i x (w_i x r_i)             without J times the accelerations
    (x . y)' = x' . y + x . y'                     (x . y)'' = x'' . y + 2 x' . y' + x . y''
    turn'    = h_i . (w_j - w_i)                   turn''    = h_i' . (w_j - w_i)

Quaternions give the rotations R since the design. The unknowns of a body are the translation of its
centre and its rotation in global axes (dA = w x A). Lengths are measured in a unit near the
mechanism's size, so a row is about as large as its violation. A turn is an arc tangent plus the
full turns that bring it nearest to a given angle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ....errors import KincheckError
from ....mechanism.mechanism import GROUND, Mechanism
from ....mechanism.motions import JointDriver, PointCoordinate
from .curves import Function

Real: TypeAlias = NDArray[Any]
"""Array of longdoubles, which numpy's own type hints lose next to a plain number. On x86 they have
a 64-bit mantissa: a two-thousandth of the round-off of the judged doubles.
"""
Indices: TypeAlias = NDArray[np.intp]


def extended(values: Any) -> Real:
    """Return doubles as extended numbers, exactly, or a text with all its digits."""
    return np.asarray(values, dtype=np.longdouble)


GROUND_AXES = np.eye(3, dtype=np.longdouble)
NO_ARM = np.zeros(3, dtype=np.longdouble)
PI = extended("3.14159265358979323846264338327950288")
SIGNS = np.array([-1.0, 1.0])[:, None, None]
"""Signs of the first and the second end of a vector."""


def require_extended() -> None:
    """Raise KincheckError if this machine has no extended precision in hardware."""
    if np.finfo(np.longdouble).eps > 1e-18:
        raise KincheckError(
            "kincheck stress: numpy's longdouble is no wider than a double on this machine, so"
            " the truth has no extra digits. Run it on x86-64 Linux."
        )


def unit(a: Any) -> Real:
    """Return the direction of a vector."""
    a = extended(a)
    return a / np.sqrt(a @ a)


def triad(axis: Sequence[float]) -> tuple[Real, Real, Real]:
    """Return f, g, h: orthonormal and right-handed, with h along the axis."""
    h = unit(axis)
    f = unit(np.cross(h, GROUND_AXES[int(np.abs(h).argmin())]))
    return f, np.cross(h, f), h


def cross(a: Real, b: Real) -> Real:
    """Return the cross product along the axis before the last."""
    (ax, ay, az), (bx, by, bz) = (np.moveaxis(each, -2, 0) for each in (a, b))
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-2)


def inner(a: Real, b: Real) -> Real:
    """Return the scalar product along the axis before the last."""
    return (a * b).sum(axis=-2)


def spun(w: Real, q: Real) -> Real:
    """Return the quaternion product (0, w) q, shape (bodies, 4, n)."""
    vector = w * q[:, :1] + cross(w, q[:, 1:])
    return np.concatenate([-inner(w, q[:, 1:])[:, None], vector], axis=1)


def about(h: Real, angle: Real) -> Real:
    """Return the quaternion of a turn about a unit vector, shape (4, n)."""
    return np.concatenate([np.cos(angle / 2)[None], h[:, None] * np.sin(angle / 2)])


def nearest_turn(angles: Real, near: Real) -> Real:
    """Return angles with the full turns that bring them nearest to given ones [rad]."""
    return angles + 2.0 * PI * np.rint((near - angles) / (2.0 * PI))


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of all bodies over n samples; body 0 is the ground.

    Attributes:
        u: displacement of the centres [units], shape (bodies + 1, 3, n).
        q: rotation since the design, unit quaternions, shape (bodies + 1, 4, n).
    """

    u: Real
    q: Real

    @staticmethod
    def design(bodies: int, n: int) -> Poses:
        """Return all bodies at the design position."""
        q = np.zeros((bodies + 1, 4, n), dtype=np.longdouble)
        q[:, 0] = 1.0
        return Poses(np.zeros((bodies + 1, 3, n), dtype=np.longdouble), q)

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.u.shape[-1]

    @cached_property
    def turned(self) -> Real:
        """R - I, shape (bodies + 1, 3, 3, n); exactly zero at the design."""
        e0, x, y, z = np.moveaxis(self.q, 1, 0)
        rows = (
            (-(y * y + z * z), x * y - e0 * z, x * z + e0 * y),
            (x * y + e0 * z, -(x * x + z * z), y * z - e0 * x),
            (x * z - e0 * y, y * z + e0 * x, -(x * x + y * y)),
        )
        return 2.0 * np.moveaxis(np.array(rows), 2, 0)

    def swing(self, body: Any, a: Real) -> Real:
        """Return (R - I) a for vectors a of bodies, (..., 3), shape (..., 3, n)."""
        return (self.turned[body] * a[..., None, :, None]).sum(axis=-2)

    def at(self, samples: Any) -> Poses:
        """Return some of the samples."""
        return Poses(self.u[..., samples], self.q[..., samples])

    def moved(self, step: Real) -> Poses:
        """Return the poses after translations and rotations of all bodies, (bodies + 1, 6, n)."""
        # tangent step and projection onto the sphere turn by 2 atan(|w| / 2): |w| up to third order
        q = self.q + 0.5 * spun(step[:, 3:], self.q)
        return Poses(self.u + step[:, :3], q / np.sqrt((q * q).sum(axis=1, keepdims=True)))


class Vector(NamedTuple):
    """Vectors x of the module, or one: x0 (m, 3), arms of both ends (m, 2, 3), and s (m,)."""

    start: Any
    arms: Any
    shift: Any

    @staticmethod
    def of(start: Real, first: Real = NO_ARM, second: Real = NO_ARM) -> Vector:
        """Return a direction, with its arms on both bodies; without arms it is global."""
        return Vector(start, (first, second), 0.0)

    def at(self, poses: Poses, bodies: Indices) -> tuple[Real, Real]:
        """Return the vectors between bodies (m, 2), (m, 3, n), and their arms, (m, 2, 3, n)."""
        swing = poses.swing(bodies, self.arms)
        moved = self.shift[:, None, None, None] * poses.u[bodies] + swing
        return self.start[..., None] + (moved[:, 1] - moved[:, 0]), self.arms[..., None] + swing

    def rates(self, v: Real, w: Real, arms: Real) -> tuple[Real, Real]:
        """Return x' and x'' at velocities of both bodies, shapes (m, 2, 3, n)."""
        swing = cross(w, arms)
        first, second = self.shift[:, None, None, None] * v + swing, cross(w, swing)
        return first[:, 1] - first[:, 0], second[:, 1] - second[:, 0]


class NotStatedError(KincheckError):
    """A joint or driver has no rows here."""


class Rows:
    """The rows of all joints, couplers and drivers of a mechanism, in this order.

    Attributes:
        unit: unit of length [m].
        origin: origin that is subtracted from global positions before scaling [m]; it removes a far
            offset.
        bodies: names of the moving bodies; body k of a pose is bodies[k - 1].
        centres: reference point of each body from the origin [units], the ground's first, shape
            (bodies + 1, 3).
        owners: joint, coupler or driver of each row.
        driven: row of each driver, in order, and the scale of the driver's value in it.
        turning: joint of each turn; turn_rows: its row.

    Raises:
        NotStatedError: a joint or driver of an unknown type.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.bodies = [body.name for body in mechanism.moving]
        places: dict[str, list[Sequence[float]]] = {
            name: [point.position for point in mechanism.points if point.body == name]
            for name in [*(body.name for body in mechanism.bodies), GROUND]
        }
        for joint in mechanism.joints:
            for name in joint.bodies:
                places[name] += joint.points_on(name)
        every = extended([p for points in places.values() for p in points] or [[0.0] * 3])
        extent = float(np.ptp(every, axis=0).max())
        self.origin, self.unit = every[0], 2.0 ** round(math.log2(extent)) if extent else 1.0
        centres = [[*places[name], mechanism.body(name).origin][0] for name in self.bodies]
        self.centres = np.stack([NO_ARM, *map(self.place, centres)])
        self.owners, self.turning = list[str](), list[str]()
        self.driven: list[tuple[int, float]] = []
        self._curves: list[tuple[int, int, float, Function]] = []
        self._constants: Any = []
        self._products: list[tuple[int, tuple[int, int], float, Any, Vector, Vector]] = []
        self._turns: list[tuple[int, int, int, float, tuple[Real, Real, Real]]] = []
        self._write()
        rows, bodies, weights, lengths, *vectors = zip(*self._products, strict=True)
        self._row, self._bodies = np.array(rows), np.array(bodies)
        self._weight, self._length = extended(weights)[:, None], extended(lengths)[:, None]
        self._x, self._y = (Vector(*map(np.stack, zip(*each, strict=True))) for each in vectors)
        turns = np.array([turn[:3] for turn in self._turns], dtype=np.intp)
        self.turn_rows, self._i, self._j = turns.reshape(-1, 3).T
        self._turn_weight = extended([turn[3] for turn in self._turns])[:, None]
        axes = extended([turn[4] for turn in self._turns]).reshape(-1, 3, 3)
        self._axes: Real = np.moveaxis(axes, 1, 0)

    # Writing

    def _write(self) -> None:
        mechanism = self.mechanism
        curved = list[tuple[int, Any, list[float]]]()
        for joint in mechanism.joints:
            if joint.type not in JOINTS:
                raise NotStatedError(
                    f"{joint}: the stress truth has no conditions for this type; known:"
                    f" {', '.join(JOINTS)}"
                )
            for condition in JOINTS[joint.type]:
                condition(Pair(self, joint, *map(self.index, joint.bodies)))
        for coupler in mechanism.couplers:
            row = self.row(coupler.name)
            units = [self.unit if each == "translation" else 1.0 for each in coupler.freedoms]
            if coupler.curve:
                self.coordinate(row, mechanism.joint(coupler.joints[0]), coupler.freedoms[0], 1.0)
                curved.append((row, coupler, units))
                continue
            largest = max(abs(k) * each for k, each in zip(coupler.weights, units, strict=True))
            for name, freedom, k, each in zip(
                coupler.joints, coupler.freedoms, coupler.weights, units, strict=True
            ):
                self.coordinate(row, mechanism.joint(name), freedom, k * each / largest)
        for driver in mechanism.drivers:
            row = self.row(driver.name)
            if isinstance(driver, PointCoordinate):
                point = mechanism.point(driver.point)
                body = self.index(point.body)
                shift = self.line(0, body, point.position, point.position)
                self.product(row, 0, body, Vector.of(unit(driver.direction)), shift)
            elif isinstance(driver, JointDriver):
                self.coordinate(row, mechanism.joint(driver.joint), driver.freedom, 1.0)
            else:
                raise NotStatedError(
                    f"driver {driver.name!r} ({driver.type}): the stress truth cannot drive it"
                )
            self.driven.append((row, 1.0 if driver.turns else 1.0 / self.unit))
        # behind all rows, the coordinates that others follow
        for row, coupler, units in curved:
            self._constants.append(extended(0.0))
            behind = len(self._constants) - 1
            self.coordinate(
                behind, mechanism.joint(coupler.joints[1]), coupler.freedoms[1], units[1]
            )
            self._curves.append((row, behind, units[0], Function.of(coupler)))

    def index(self, body: str) -> int:
        """Return the number of a body in poses; zero for a fixed body."""
        return 0 if self.mechanism.is_fixed(body) else self.bodies.index(body) + 1

    def place(self, position: Any) -> Real:
        """Return a global position from the origin [units]."""
        return (extended(position) - self.origin) / extended(self.unit)

    def arm(self, body: int, position: Any) -> Real:
        """Return the arm from a body's centre to a global position at design [units]."""
        return self.place(position) - self.centres[body]

    def line(self, i: int, j: int, first: Any, second: Any) -> Vector:
        """Return the vector from a point of body i to one of body j, global at design [m]."""
        start = (extended(second) - extended(first)) / extended(self.unit)
        return Vector(start, (self.arm(i, first), self.arm(j, second)), 1.0)

    def row(self, owner: str) -> int:
        """Begin a row and return its number."""
        self.owners.append(owner)
        self._constants.append(extended(0.0))
        return len(self.owners) - 1

    def product(
        self,
        row: int,
        i: int,
        j: int,
        x: Vector,
        y: Vector,
        weight: float = 1.0,
        *,
        length: Any = 1.0,
        constant: Any = 0.0,
    ) -> None:
        """Add x . y / length to a row, and subtract a constant."""
        self._products.append((row, (i, j), weight, length, x, y))
        self._constants[row] = self._constants[row] + constant

    def coordinate(self, row: int, joint: Any, freedom: str, weight: float) -> None:
        """Add a coordinate of an axial joint, of the second body relative to the first."""
        (i, j), axes = map(self.index, joint.bodies), triad(joint.axis)
        if freedom == "rotation":
            self.turning.append(joint.name)
            self._turns.append((row, i, j, weight, axes))
        else:
            shift = self.line(i, j, joint.point, joint.point)
            self.product(row, i, j, on_i(axes[2]), shift, weight)

    # Values at poses

    def angles(self, poses: Poses) -> Real:
        """Return the angle of every turn, within half a turn of zero [rad], shape (turns, n)."""
        f, g, _ = self._axes
        f_i, g_i = (self._arms(poses, self._i, a) for a in (f, g))
        f_j = self._arms(poses, self._j, f)
        return np.arctan2(inner(g_i, f_j), inner(f_i, f_j))

    def residual(self, poses: Poses, driven: Real, near: Real) -> Real:
        """Return the residuals of all rows, shape (rows, n).

        Args:
            driven: values of the drivers [m or rad], shape (drivers, n).
            near: angles near those of the turns [rad], shape (turns, n).
        """
        found = self._values(poses, near)
        for row, behind, unit, function in self._curves:
            found[row] -= function.at(found[behind])[0] / unit
        for (row, size), value in zip(self.driven, driven, strict=True):
            found[row] -= extended(size) * value
        return found[: len(self.owners)]

    def _values(self, poses: Poses, near: Real | None) -> Real:
        """Return the terms of all rows, and the coordinates that others follow."""
        (x, _), (y, _) = self._vectors(poses)
        angles = self.angles(poses)
        found = self._sum_terms(inner(x, y), angles if near is None else nearest_turn(angles, near))
        return found - extended(self._constants)[:, None]

    def jacobian(self, poses: Poses, near: Real | None = None) -> NDArray[np.float64]:
        """Return the derivative of the rows by the unknowns in doubles, shape (n, rows,
        unknowns).

        Args:
            near: as of `residual`; a function of a turn needs it beyond half a turn.
        """
        rows, n = len(self._constants), poses.samples
        found = np.zeros((rows, len(self.centres), 6, n))
        (x, x_arms), (y, y_arms) = self._vectors(poses)
        x, y = (each[:, None] / self._length[..., None, None] for each in (x, y))
        s_x, s_y = (each.shift[:, None, None, None] for each in (self._x, self._y))
        shift, turn = s_x * y + s_y * x, cross(x_arms, y) + cross(y_arms, x)
        slopes = np.concatenate([np.broadcast_to(shift, turn.shape), turn], axis=2)
        slopes = self._weight[..., None, None] * SIGNS * slopes
        np.add.at(found, (self._row[:, None], self._bodies), slopes.astype(np.float64))
        h = self._axes[2]
        turns = (self._turn_weight[..., None] * self._arms(poses, self._i, h)).astype(np.float64)
        np.add.at(found[:, :, 3:], (self.turn_rows, self._i), -turns)
        np.add.at(found[:, :, 3:], (self.turn_rows, self._j), turns)
        for row, behind, unit, function in self._curves:
            slope = function.at(self._values(poses, near)[behind])[1] / unit
            found[row] -= slope.astype(np.float64) * found[behind]
        found = found[: len(self.owners), 1:].reshape(len(self.owners), -1, n)
        return np.ascontiguousarray(np.moveaxis(found, -1, 0))

    def beyond(self, poses: Poses, rates: Real, near: Real | None = None) -> Real:
        """Return the rows' second time derivative minus J times the accelerations, shape (rows, n).

        Args:
            rates: of translations and rotations of all bodies, shape (bodies + 1, 6, n).
            near: as of `jacobian`.
        """
        v, w = rates[:, :3], rates[:, 3:]
        (x, x_arms), (y, y_arms) = self._vectors(poses)
        both = v[self._bodies], w[self._bodies]
        (x_t, x_tt), (y_t, y_tt) = self._x.rates(*both, x_arms), self._y.rates(*both, y_arms)
        h_t = cross(w[self._i], self._arms(poses, self._i, self._axes[2]))
        spin = w[self._j] - w[self._i]
        found = self._sum_terms(
            inner(x_tt, y) + 2.0 * inner(x_t, y_t) + inner(x, y_tt), inner(h_t, spin)
        )
        if not self._curves:
            return found
        h, values = self._arms(poses, self._i, self._axes[2]), self._values(poses, near)
        once = self._sum_terms(inner(x_t, y) + inner(x, y_t), inner(h, spin))
        for row, behind, unit, function in self._curves:
            _, slope, bend = function.at(values[behind])
            found[row] -= (slope * found[behind] + bend * once[behind] ** 2) / unit
        return found[: len(self.owners)]

    def _vectors(self, poses: Poses) -> tuple[tuple[Real, Real], tuple[Real, Real]]:
        return self._x.at(poses, self._bodies), self._y.at(poses, self._bodies)

    def _arms(self, poses: Poses, bodies: Indices, a: Real) -> Real:
        return a[..., None] + poses.swing(bodies, a)

    def _sum_terms(self, products: Real, turns: Real) -> Real:
        found = np.zeros((len(self._constants), products.shape[-1]), dtype=np.longdouble)
        np.add.at(found, self._row, self._weight * products / self._length)
        np.add.at(found, self.turn_rows, self._turn_weight * turns)
        return found


# Joint types (formulation section 6)


class Pair(NamedTuple):
    """The rows, a joint, and the numbers of its bodies."""

    rows: Rows
    joint: Any
    i: int
    j: int

    def row(self, x: Vector, y: Vector, **more: Any) -> None:
        """Add a row of one product; see `Rows.product`."""
        self.rows.product(self.rows.row(self.joint.name), self.i, self.j, x, y, **more)

    def gap(self) -> Vector:
        """Return the vector from the joint's point on i to that on j."""
        point = getattr(self.joint, "point", None)
        # a fixed joint may have no point: any point works
        both = (self.rows.origin if point is None else point,) * 2
        return self.rows.line(self.i, self.j, *(getattr(self.joint, "points", None) or both))


def on_i(a: Real) -> Vector:
    """Return a direction of body i."""
    return Vector.of(a, -a)


def on_j(a: Real) -> Vector:
    """Return a direction of body j."""
    return Vector.of(a, NO_ARM, a)


def _meet(pair: Pair) -> None:
    """Keep the point of both bodies together."""
    for axis in GROUND_AXES:
        pair.row(Vector.of(axis), pair.gap())


def _parallel(pair: Pair) -> None:
    """Keep the direction of the axis in both bodies."""
    f, g, h = triad(pair.joint.axis)
    for a in (f, g):
        pair.row(on_i(a), on_j(h))


def _alike(pair: Pair) -> None:
    """Keep the relative orientation of the bodies."""
    f, g, h = triad(getattr(pair.joint, "axis", (0.0, 0.0, 1.0)))
    for a, b in ((g, h), (h, f), (f, g)):
        pair.row(on_i(a), on_j(b))


def _line(pair: Pair) -> None:
    """Keep the point of j on the line of i."""
    for a in triad(pair.joint.axis)[:2]:
        pair.row(on_i(a), pair.gap())


def _plane(pair: Pair) -> None:
    """Keep the distance of the point of j from the plane of i at its design value."""
    h, d = triad(pair.joint.axis)[2], pair.gap()
    pair.row(on_i(h), d, constant=h @ d.start)


def _angle(pair: Pair) -> None:
    """Keep the angle between the axes."""
    a, b = map(unit, pair.joint.axes)
    pair.row(on_i(a), on_j(b), constant=a @ b)


def _length(pair: Pair) -> None:
    """Keep the distance between the points: (d . d - L^2) / 2 L."""
    d, given = pair.gap(), getattr(pair.joint, "length", None)
    length = np.sqrt(d.start @ d.start) if given is None else extended(given) / pair.rows.unit
    pair.row(d, d, length=2.0 * length, constant=0.5 * length)


def _twistless(pair: Pair) -> None:
    """Write f_i . g_j = g_i . f_j. The axes of shaft j are those of shaft i, turned by the shortest
    rotation.
    """
    rows, joint, i, j = pair
    f, g, h = triad(joint.axes[0])
    k = unit(joint.axes[1])
    n, row = np.cross(h, k), rows.row(joint.name)
    for a, b, sign in ((f, g, 1.0), (g, f, -1.0)):
        turned = b + np.cross(n, b) + np.cross(n, np.cross(n, b)) / (1.0 + h @ k)
        rows.product(row, i, j, on_i(a), on_j(turned), sign)


def _thread(pair: Pair) -> None:
    """Set the displacement to the lead times the turns."""
    rows, joint, *_ = pair
    row, pitch = rows.row(joint.name), joint.lead / (2.0 * math.pi)
    rows.coordinate(row, joint, "translation", 1.0)
    rows.coordinate(row, joint, "rotation", -pitch / rows.unit)


JOINTS: Mapping[str, Sequence[Callable[[Pair], None]]] = {
    "revolute": (_meet, _parallel),
    "spherical": (_meet,),
    "universal": (_meet, _angle),
    "translational": (_alike, _line),
    "fixed": (_meet, _alike),
    "distance": (_length,),
    "cylindrical": (_parallel, _line),
    "screw": (_parallel, _line, _thread),
    "planar": (_parallel, _plane),
    "inline": (_line,),
    "in_plane": (_plane,),
    "parallel_axes": (_parallel,),
    "perpendicular_axes": (_angle,),
    "orientation_lock": (_alike,),
    "revolute_spherical": (_length, _plane),
    "constant_velocity": (_meet, _twistless),
}
"""Joint type -> writers of its rows."""
