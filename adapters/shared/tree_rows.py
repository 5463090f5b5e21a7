"""Frames and rows of a tree of links; see `tree_model`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.polynomial import Polynomial

from ...core.trajectory import Array
from .frame_constraints import Condition, FrameOnBody


class Coordinates(Protocol):
    """A tree in its configuration q, and at the velocity v last set; see `tree_model.TreeModel`."""

    q: Array

    v: Array

    @property
    def unknowns(self) -> int: ...

    def coordinate(self, body: Any) -> tuple[int, int]: ...


@dataclass(eq=False)
class BodyFrame:
    """A frame of a body as the simulator last reported it; see `frame_constraints.Frame`.

    Attributes:
        body: number of the body.
        handle: the simulator's handle; None for a frame of the ground, which never moves.
    """

    body: int
    handle: Any
    position: Array
    rotation: Array = field(default_factory=lambda: np.eye(3))
    jacobian: Array = field(default_factory=lambda: np.zeros((6, 0)))
    velocity: Array = field(default_factory=lambda: np.zeros(6))
    acceleration: Array = field(default_factory=lambda: np.zeros(6))


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
    """A linear row plus a polynomial in its last coordinate.

    Attributes:
        sign: sign of the coordinate in the tree.
    """

    linear: Linear
    curve: Polynomial
    sign: float
    n = 1

    @cached_property
    def _at(self) -> tuple[int, int]:
        return self.linear.of.coordinate(self.linear.bodies[-1])

    @property
    def _x(self) -> float:
        return self.sign * self.linear.of.q[self._at[0]]

    def rows(self) -> tuple[Any, Array]:
        value, row = self.linear.rows()
        row = row.copy()
        row[self._at[1]] += self.sign * self.curve.deriv()(self._x)
        return value + self.curve(self._x), row

    def bias(self) -> Any:
        return self.curve.deriv(2)(self._x) * self.linear.of.v[self._at[1]] ** 2


@dataclass(frozen=True, eq=False)
class DrivenPoint:
    """The displacement since design of a point along the fixed direction k [m]."""

    frame: FrameOnBody
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
