"""Conditions between two frames of a simulator: equations with their Jacobian and its rate.

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
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ...core.trajectory import Array


class Frame(Protocol):
    """A frame on a body: a point, with axes that are global at design, in the simulator's current
    configuration. All vectors are in global axes.
    """

    @property
    def position(self) -> Array:
        """The position of the point [m], shape (3,)."""
        ...

    @property
    def rotation(self) -> Array:
        """The rotation matrix of the body since design, shape (3, 3)."""
        ...

    @property
    def jacobian(self) -> Array:
        """The Jacobian of the point over that of the rotation, shape (6, unknowns)."""
        ...

    @property
    def velocity(self) -> Array:
        """The velocity of the point [m/s] and the angular velocity [rad/s], shape (6,)."""
        ...

    @property
    def acceleration(self) -> Array:
        """The acceleration of the point [m/s^2] and the angular acceleration [rad/s^2], shape (6,);
        Jdot v if the coordinates are not accelerated.
        """
        ...


class FrameOnBody(Frame, Protocol):
    """A frame with the number of its body."""

    @property
    def body(self) -> int: ...


class Vector(Protocol):
    """A vector that moves with the mechanism."""

    def placed(self) -> tuple[Array, Array]:
        """Return x and J_x, shapes (3,) and (3, unknowns)."""
        ...

    def moving(self) -> tuple[Array, Array, Array]:
        """Return x, its rate and its bias, each of shape (3,)."""
        ...


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
    """A unit vector of a body, a0 at design."""

    frame: Frame
    a0: Array

    def placed(self) -> tuple[Array, Array]:
        x = self.frame.rotation @ self.a0
        return x, -skew(x) @ self.frame.jacobian[3:]

    def moving(self) -> tuple[Array, Array, Array]:
        x, w, alpha = (
            self.frame.rotation @ self.a0,
            skew(self.frame.velocity[3:]),
            skew(self.frame.acceleration[3:]),
        )
        return x, w @ x, alpha @ x + w @ (w @ x)


@dataclass(frozen=True, eq=False)
class Difference:
    """The vector from the point of frame i to that of frame j [m]."""

    i: Frame
    j: Frame

    def placed(self) -> tuple[Array, Array]:
        return self.j.position - self.i.position, (self.j.jacobian - self.i.jacobian)[:3]

    def moving(self) -> tuple[Array, Array, Array]:
        rate, bias = self.j.velocity - self.i.velocity, self.j.acceleration - self.i.acceleration
        return self.j.position - self.i.position, rate[:3], bias[:3]


@dataclass(frozen=True, eq=False)
class Coincident:
    """x = 0."""

    x: Vector
    n = 3

    def rows(self) -> tuple[Any, Array]:
        return self.x.placed()

    def bias(self) -> Any:
        return self.x.moving()[2]


@dataclass(frozen=True, eq=False)
class Dot:
    """x . y = c."""

    x: Vector
    y: Vector
    c: float = 0.0
    n = 1

    def rows(self) -> tuple[Any, Array]:
        (x, J_x), (y, J_y) = self.x.placed(), self.y.placed()
        return x @ y - self.c, y @ J_x + x @ J_y

    def bias(self) -> Any:
        (x, x_dot, b_x), (y, y_dot, b_y) = self.x.moving(), self.y.moving()
        return y @ b_x + x @ b_y + 2.0 * (x_dot @ y_dot)


@dataclass(frozen=True, eq=False)
class Length:
    """|x| = L, instead of its square, so that the row is in metres like the others."""

    x: Vector
    L: float
    n = 1

    def rows(self) -> tuple[Any, Array]:
        x, J_x = self.x.placed()
        length = np.sqrt(x @ x)
        return length - self.L, (x / length) @ J_x

    def bias(self) -> Any:
        x, x_dot, b_x = self.x.moving()
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

    i: Frame
    j: Frame
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
