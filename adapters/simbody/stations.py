"""Points of Simbody's bodies, read on demand; private to its adapter.

Most data of a frame are never needed: Simbody's constraints use no frame, and a driven point or an
output uses no rotation. Each call into the package costs as much as its work.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from ...core.trajectory import Array


class Solved(Protocol):
    """A model in Simbody's state; u, a: velocities and accelerations of the coordinates; matrix:
    for results.
    """

    state: Any
    matter: Any
    matrix: Any
    u: Array
    a: Array


@dataclass(frozen=True, eq=False)
class Station:
    """A point of a body and the body's axes; see `frame_constraints.Frame`.

    Attributes:
        body: number of the body.
        carrier: OpenSim's body.
        point: position of the point in the axes of the body [m].
    """

    of: Solved
    body: int
    carrier: Any
    point: Any

    @cached_property
    def _place(self) -> tuple[Any, Any, Any]:
        return self.of.state, self.carrier.getMobilizedBodyIndex(), self.point

    @property
    def position(self) -> Array:
        return self.carrier.findStationLocationInGround(self.of.state, self.point).to_numpy()

    @property
    def rotation(self) -> Array:
        R = self.carrier.getTransformInGround(self.of.state).R()
        return np.array([[R.get(i, j) for j in range(3)] for i in range(3)])

    @property
    def jacobian(self) -> Array:
        self.of.matter.calcFrameJacobian(*self._place, self.of.matrix)
        J = self.of.matrix.to_numpy()
        return np.concatenate((J[3:], J[:3]))  # Simbody has the rotation first

    @property
    def velocity(self) -> Array:
        turn = self.carrier.getAngularVelocityInGround(self.of.state)
        return np.concatenate((self._speed(), turn.to_numpy()))

    @property
    def acceleration(self) -> Array:
        bias = self.of.matter.calcBiasForFrameJacobian(*self._place)
        bias = np.concatenate((bias.get(1).to_numpy(), bias.get(0).to_numpy()))
        return bias + self.jacobian @ self.of.a if self.of.a.any() else bias

    def motion(self) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration of the point."""
        matter, matrix = self.of.matter, self.of.matrix
        matter.calcStationJacobian(*self._place, matrix)
        J, bias = matrix.to_numpy(), matter.calcBiasForStationJacobian(*self._place)
        return self.position, J @ self.of.u, bias.to_numpy() + J @ self.of.a

    def _speed(self) -> Array:
        return self.carrier.findStationVelocityInGround(self.of.state, self.point).to_numpy()
