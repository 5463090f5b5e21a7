"""Frames and coordinates of Pinocchio as rows; private to its adapter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ...core.trajectory import Array


class Moved(Protocol):
    """A model of Pinocchio and its data in the current configuration q; axes: of its frames."""

    pin: Any
    model: Any
    data: Any
    axes: Any
    q: Array


@dataclass(frozen=True, eq=False)
class Frame:
    """A frame of the model, as last computed; see `frame_constraints.Frame`."""

    of: Moved
    index: int

    @property
    def position(self) -> Array:
        return self.of.data.oMf[self.index].translation

    @property
    def rotation(self) -> Array:
        return self.of.data.oMf[self.index].rotation

    @property
    def jacobian(self) -> Array:
        # a matrix of one column is given as a vector
        return self.of.pin.getFrameJacobian(
            self.of.model, self.of.data, self.index, self.of.axes
        ).reshape(6, -1)

    @property
    def velocity(self) -> Array:
        return self.of.pin.getFrameVelocity(
            self.of.model, self.of.data, self.index, self.of.axes
        ).vector

    @property
    def acceleration(self) -> Array:
        return self.of.pin.getFrameClassicalAcceleration(
            self.of.model, self.of.data, self.index, self.of.axes
        ).vector


@dataclass(frozen=True, eq=False)
class DrivenPoint:
    """The displacement since design of a point along the fixed direction k [m]."""

    frame: Frame
    k: Array
    design: Array
    n = 1

    def rows(self) -> tuple[Any, Array]:
        return self.k @ (self.frame.position - self.design), self.k @ self.frame.jacobian[:3]

    def bias(self) -> Any:
        return self.k @ self.frame.acceleration[:3]


@dataclass(frozen=True, eq=False)
class Linear:
    """A weighted sum of coordinates [m or rad]: a driver's, or zero by a coupler or a joint's own
    relation.
    """

    of: Moved
    q: list[int]
    v: list[int]
    weights: Array
    n = 1

    def rows(self) -> tuple[Any, Array]:
        row = np.zeros(self.of.model.nv)
        row[self.v] = self.weights
        return self.weights @ self.of.q[self.q], row

    def bias(self) -> Any:
        return 0.0
