"""Conditions between two frames of a simulator: equations with their Jacobian and its rate; the
conditions of each cut joint; rows of coordinates and driven points.

The frames sit at points of two bodies, with global axes at design. Their motion in
the simulator gives two kinds of moving vectors (w, alpha: angular velocity and
acceleration of the body; J_w: its angular Jacobian)

                         vector x     Jacobian J_x    rate x'      bias b_x = x'' - J_x (coord.)''
    direction of a body  A a0         -skew(x) J_w    w × x        alpha × x + w × (w × x)
    point i to point j   p_j - p_i    J_j - J_i       v_j - v_i    a_j - a_i

and conditions on them

    x = 0               row  J_x                     bias b_x
    x . y = c           row  y . J_x + x . J_y       bias y . b_x + x . b_y + 2 x' . y'
    |x| = L             row  u . J_x                 bias u . b_x + x' . x' / |x|
    x . y - u . v = 0   the difference of two such rows
    h . x - p turn = 0  row of h . x - p h . (J_wj - J_wi)
                        bias of h . x - p h . (alpha_j - alpha_i)

In the row of |x| = L, u = x / |x|, and u . x' = 0 already.

A cut joint becomes conditions on two frames, one on each body. The rows of one joint are never
redundant, so a loop has dependent rows only by its geometry (planar loops).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol, TypeAlias

import numpy as np

from ...core.algebra import Vec3
from ...core.errors import number_of
from ...core.joints import (
    ConstantVelocity,
    Cylindrical,
    Distance,
    Fixed,
    Inline,
    InPlane,
    Joint,
    OrientationLock,
    ParallelAxes,
    PerpendicularAxes,
    PiecewisePolynomial,
    Planar,
    Revolute,
    RevoluteSpherical,
    Screw,
    Spherical,
    Translational,
    Universal,
)
from ...core.joints.base import triad, unit
from ...core.trajectory import Array


@dataclass(eq=False)
class BodyFrame:
    """A frame of a body as the simulator last reported it: a point, with axes that are global at
    design. All vectors are in global axes.

    Attributes:
        body: number of the body.
        handle: the simulator's handle; None for a frame of the ground, which never moves.
        position: of the point [m], shape (3,).
        rotation: of the body since design, shape (3, 3).
        jacobian: of the point over that of the rotation, shape (6, unknowns).
        velocity: of the point [m/s], and the angular velocity [rad/s], shape (6,).
        acceleration: of the point [m/s^2], and the angular acceleration [rad/s^2], shape (6,); Jdot
            v if the coordinates are not accelerated.
    """

    body: int
    handle: Any
    position: Array
    rotation: Array = field(default_factory=lambda: np.eye(3))
    jacobian: Array = field(default_factory=lambda: np.zeros((6, 0)))
    velocity: Array = field(default_factory=lambda: np.zeros(6))
    acceleration: Array = field(default_factory=lambda: np.zeros(6))


class Condition(Protocol):
    """n equations, whose residuals are zero if they are satisfied."""

    @property
    def n(self) -> int: ...

    def rows(self) -> tuple[Any, Array]:
        """Return n residuals [m or -] and their Jacobian, shape (n, unknowns)."""
        ...

    def bias(self) -> Any:
        """Return Jdot v, n numbers."""
        ...


@dataclass(frozen=True, eq=False)
class Direction:
    """A unit vector of a body, a0 at design.

    `value_and_jacobian` returns x and J_x, shapes (3,) and (3, unknowns); `value_and_rates` returns
    x, its rate and its bias, each of shape (3,).
    """

    frame: BodyFrame
    a0: Array

    def value_and_jacobian(self) -> tuple[Array, Array]:
        x = self.frame.rotation @ self.a0
        return x, -skew(x) @ self.frame.jacobian[3:]

    def value_and_rates(self) -> tuple[Array, Array, Array]:
        x, w, alpha = (
            self.frame.rotation @ self.a0,
            skew(self.frame.velocity[3:]),
            skew(self.frame.acceleration[3:]),
        )
        return x, w @ x, alpha @ x + w @ (w @ x)


@dataclass(frozen=True, eq=False)
class Difference:
    """The vector from the point of frame i to that of frame j [m]; with the methods of
    `Direction`.
    """

    i: BodyFrame
    j: BodyFrame

    def value_and_jacobian(self) -> tuple[Array, Array]:
        return self.j.position - self.i.position, (self.j.jacobian - self.i.jacobian)[:3]

    def value_and_rates(self) -> tuple[Array, Array, Array]:
        rate, bias = self.j.velocity - self.i.velocity, self.j.acceleration - self.i.acceleration
        return self.j.position - self.i.position, rate[:3], bias[:3]


Vector: TypeAlias = Direction | Difference


@dataclass(frozen=True, eq=False)
class Coincident:
    """x = 0."""

    x: Vector
    n = 3

    def rows(self) -> tuple[Any, Array]:
        return self.x.value_and_jacobian()

    def bias(self) -> Any:
        return self.x.value_and_rates()[2]


@dataclass(frozen=True, eq=False)
class Dot:
    """x . y = c."""

    x: Vector
    y: Vector
    c: float = 0.0
    n = 1

    def rows(self) -> tuple[Any, Array]:
        (x, J_x), (y, J_y) = self.x.value_and_jacobian(), self.y.value_and_jacobian()
        return x @ y - self.c, y @ J_x + x @ J_y

    def bias(self) -> Any:
        (x, x_dot, b_x), (y, y_dot, b_y) = self.x.value_and_rates(), self.y.value_and_rates()
        return y @ b_x + x @ b_y + 2.0 * (x_dot @ y_dot)


@dataclass(frozen=True, eq=False)
class Length:
    """|x| = L, instead of its square, so that the row is in metres like the others."""

    x: Vector
    L: float
    n = 1

    def rows(self) -> tuple[Any, Array]:
        x, J_x = self.x.value_and_jacobian()
        length = np.sqrt(x @ x)
        return length - self.L, (x / length) @ J_x

    def bias(self) -> Any:
        x, x_dot, b_x = self.x.value_and_rates()
        return (x @ b_x + x_dot @ x_dot) / np.sqrt(x @ x)


@dataclass(frozen=True, eq=False)
class EqualDots:
    """x . y = u . v."""

    left: Dot
    right: Dot
    n = 1

    def rows(self) -> tuple[Any, Array]:
        (phi, row), (psi, other) = self.left.rows(), self.right.rows()
        return phi - psi, row - other

    def bias(self) -> Any:
        return self.left.bias() - self.right.bias()


@dataclass(frozen=True, eq=False)
class Thread:
    """h . x = p turn: the displacement along h of frame i is p [m/rad] times the rotation of frame
    j about h; other rows align the axes.

    The displacement gives the number of full turns, so no counter is needed. The row is exact for
    parallel axes.
    """

    i: BodyFrame
    j: BodyFrame
    f: Array
    h: Array
    p: float
    n = 1

    @property
    def slide(self) -> Dot:
        """The displacement."""
        return Dot(Direction(self.i, self.h), Difference(self.i, self.j))

    def rows(self) -> tuple[Any, Array]:
        phi, row = self.slide.rows()
        h, f_i, f_j = self.i.rotation @ self.h, self.i.rotation @ self.f, self.j.rotation @ self.f
        phi = float(phi) - self.p * math.atan2(h @ np.cross(f_i, f_j), f_i @ f_j)
        lead = 2.0 * math.pi * self.p
        # a screw without lead is a hinge
        return math.remainder(phi, lead) if lead else phi, row - self.p * (
            h @ (self.j.jacobian - self.i.jacobian)[3:]
        )

    def bias(self) -> Any:
        h = self.i.rotation @ self.h
        return self.slide.bias() - self.p * (h @ (self.j.acceleration - self.i.acceleration)[3:])


def skew(a: Array) -> Array:
    """Return the matrix of the cross product a ×, shape (3, 3)."""
    x, y, z = a.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@dataclass(frozen=True)
class Part:
    """Conditions of a joint between two frames, in words, and their number of rows."""

    text: str
    n: int
    conditions: Callable[[Any, BodyFrame, BodyFrame], Sequence[Condition]]


def _parallel(joint: Any, i: BodyFrame, j: BodyFrame) -> list[Condition]:
    f, g, h = map(_array, triad(joint.axis))
    return [Dot(Direction(i, a), Direction(j, h)) for a in (f, g)]


def _alike(joint: Any, i: BodyFrame, j: BodyFrame) -> list[Condition]:
    # cyclic pairs of the axes: the gradients a × b are the three axes, so the rows are independent
    x, y, z = np.eye(3)
    return [Dot(Direction(i, a), Direction(j, b)) for a, b in ((x, y), (y, z), (z, x))]


def _on_line(joint: Any, i: BodyFrame, j: BodyFrame) -> list[Condition]:
    f, g, _ = map(_array, triad(joint.axis))
    return [Dot(Direction(i, a), Difference(i, j)) for a in (f, g)]


def _crossing_axes(joint: Any, i: BodyFrame, j: BodyFrame) -> list[Condition]:
    # a table may round the right angle; two hinges keep the design angle
    a, b = (_array(unit(axis)) for axis in joint.axes)
    return [Dot(Direction(i, a), Direction(j, b), float(a @ b))]


def _rod(joint: Any, i: BodyFrame, j: BodyFrame) -> list[Condition]:
    length = joint.rod_length if isinstance(joint, Distance) else math.dist(*joint.points)
    return [Length(Difference(i, j), length)]


def _across(joint: Any, i: BodyFrame, j: BodyFrame) -> list[Condition]:
    h, d = _array(unit(joint.axis)), np.subtract(*joint.points[::-1])
    return [Dot(Direction(i, h), Difference(i, j), float(h @ d))]


def _twistless(joint: Any, i: BodyFrame, j: BodyFrame) -> list[Condition]:
    """Return the row of a constant-velocity joint about its shafts.

    With f × g along each shaft, f_i . g_j = g_i . f_j.
    """
    f, g, h = triad(joint.axes[0])
    # the shortest rotation from h to the other shaft acts on vectors normal to h like the
    # reflection that maps h to the opposite of the other shaft
    m = unit(tuple(h + unit(joint.axes[1])))
    f_j, g_j = (_array(a - (2.0 * (m @ a)) * m) for a in (f, g))
    left, right = ((f, g_j), (g, f_j))
    return [EqualDots(*(Dot(Direction(i, _array(a)), Direction(j, b)) for a, b in (left, right)))]


def _thread(joint: Screw, i: BodyFrame, j: BodyFrame) -> list[Condition]:
    f, _, h = map(_array, triad(joint.axis))
    return [Thread(i, j, f, h, joint.lead / (2.0 * math.pi))]


COINCIDENT = Part("points coincide", 3, lambda joint, i, j: [Coincident(Difference(i, j))])
ON_LINE = Part("point on line", 2, _on_line)
ON_PLANE = Part(
    "point on plane",
    1,
    lambda joint, i, j: [Dot(Direction(i, _array(unit(joint.axis))), Difference(i, j))],
)
ROD = Part("points at constant distance", 1, _rod)
PARALLEL = Part("axes parallel", 2, _parallel)
ALIKE = Part("axes aligned", 3, _alike)
CROSSED = Part("axes at right angle", 1, _crossing_axes)

CLOSURES: Mapping[type[Joint], Sequence[Part]] = {
    Spherical: [COINCIDENT],
    Revolute: [COINCIDENT, PARALLEL],
    Translational: [ALIKE, ON_LINE],
    Universal: [COINCIDENT, CROSSED],
    Fixed: [COINCIDENT, ALIKE],
    Distance: [ROD],
    Cylindrical: [PARALLEL, ON_LINE],
    Screw: [PARALLEL, ON_LINE, Part("displacement by turn", 1, _thread)],
    Planar: [PARALLEL, ON_PLANE],
    ConstantVelocity: [COINCIDENT, Part("shafts turn alike", 1, _twistless)],
    OrientationLock: [ALIKE],
    ParallelAxes: [PARALLEL],
    PerpendicularAxes: [CROSSED],
    Inline: [ON_LINE],
    InPlane: [ON_PLANE],
    RevoluteSpherical: [ROD, Part("link across the hinge", 1, _across)],
}
"""Conditions that close a loop, by exact joint type."""


def closure_text(by: type[Joint]) -> str:
    """Return the conditions of a joint type in words, with their rows."""
    first, *others = CLOSURES[by]
    texts = [f"{first.text} ({number_of(first.n, 'row')})"]
    return ", ".join(texts + [f"{each.text} ({each.n})" for each in others])


def closure_conditions(by: type[Joint], joint: Any, i: BodyFrame, j: BodyFrame) -> list[Condition]:
    """Return the conditions of a joint type between frames on both bodies of a joint."""
    return [each for part in CLOSURES[by] for each in part.conditions(joint, i, j)]


def _array(a: Vec3) -> Array:
    return np.array([*a], dtype=float)


class Coordinates(Protocol):
    """The coordinates of a tree; see `TreeModel`."""

    q: Array
    v: Array

    @property
    def unknowns(self) -> int: ...

    def coordinate(self, body: Any) -> tuple[int, int]: ...


@dataclass(frozen=True, eq=False)
class Linear:
    """A weighted sum of coordinates [m or rad]: a driver's value, or zero for a coupler or a
    joint's own relation.
    """

    of: Coordinates
    bodies: list[Any]
    weights: Array
    n = 1

    @cached_property
    def _q(self) -> list[int]:
        return [self.of.coordinate(body)[0] for body in self.bodies]

    @cached_property
    def _row(self) -> Array:
        row = np.zeros(self.of.unknowns)
        for body, weight in zip(self.bodies, self.weights, strict=True):
            row[self.of.coordinate(body)[1]] += weight
        return row

    def rows(self) -> tuple[Any, Array]:
        return self.weights @ self.of.q[self._q], self._row

    def bias(self) -> Any:
        return 0.0


@dataclass(frozen=True, eq=False)
class Curved:
    """A linear row plus a function of its last coordinate.

    Attributes:
        sign: sign of the coordinate in the tree.
    """

    linear: Linear
    curve: PiecewisePolynomial
    sign: float
    n = 1

    @cached_property
    def _at(self) -> tuple[int, int]:
        return self.linear.of.coordinate(self.linear.bodies[-1])

    @property
    def _curve(self) -> tuple[float, float, float]:
        return self.curve.at(self.sign * float(self.linear.of.q[self._at[0]]))

    def rows(self) -> tuple[Any, Array]:
        value, row = self.linear.rows()
        bent, slope, _ = self._curve
        row = row.copy()
        row[self._at[1]] += self.sign * slope
        return value + bent, row

    def bias(self) -> Any:
        return self._curve[2] * self.linear.of.v[self._at[1]] ** 2


@dataclass(frozen=True, eq=False)
class DrivenPoint:
    """The displacement since design of a point along the fixed direction k [m]."""

    frame: BodyFrame
    k: Array
    design: Array
    n = 1

    @property
    def pull(self) -> Array:
        """Return the wrench of a unit multiplier at the point, shape (1, 6)."""
        return np.concatenate([self.k, np.zeros(3)])[None]

    def rows(self) -> tuple[Any, Array]:
        return self.k @ (self.frame.position - self.design), self.k @ self.frame.jacobian[:3]

    def bias(self) -> Any:
        return self.k @ self.frame.acceleration[:3]


def by_frame(condition: Condition, frames: Sequence[BodyFrame]) -> list[Array]:
    """Return the derivative of a condition's rows by the twist of each of its frames at the frame's
    point, each of shape (rows, 6): the wrenches of unit multipliers.
    """
    kept, found = [frame.jacobian for frame in frames], list[Array]()
    for moved in frames:
        for frame in frames:
            frame.jacobian = np.eye(6) if frame is moved else np.zeros((6, 6))
        found.append(np.atleast_2d(condition.rows()[1]))
    for frame, jacobian in zip(frames, kept, strict=True):
        frame.jacobian = jacobian
    return found
