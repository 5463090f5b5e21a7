"""Motions of points and bodies at solved poses of a sparse system."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...algebra import Quat, Vec3, quat, vec
from ...primitives.base import Pose, Twist
from ...trajectory import Array
from ..formulation.body_kinematics import motion_of_frame, motion_of_point
from ..formulation.formulation import Acceleration
from .sparse_equations import SparseEquations
from .step_state import Stand


class OutputMotions:
    """Points whose motion is an output: given points, or origins and frames of bodies."""

    def __init__(
        self, model: SparseEquations, names: Sequence[str], *, frames: bool = False
    ) -> None:
        m, self.names, self._model = model.mechanism, names, model
        found = [
            (name, m.body(name).origin) if frames else (m.point(name).body, m.point(name).position)
            for name in names
        ]
        number = {name: k for k, name in enumerate(model.frame.moving)}
        # what is not among the moving bodies comes after them, and stands still
        self._body = np.array([number.get(body, len(number)) for body, _ in found], np.intp)
        self._position = _columns([position for _, position in found], 3)
        self._arm = _columns(
            [tuple(model.frame.arm(body, position)) for body, position in found], 3
        )
        self._frame = (
            _columns([m.body(name).euler_parameters for name in names], 4) if frames else None
        )

    def _taken(self, at: Sequence[Stand]) -> list[Array]:
        """What their motion follows from: poses, rates and accelerations of their bodies, shapes (7
        or 6, stands, names).
        """
        n, found = self._model.bodies, list[Array]()
        for rows, each in (
            (7, [k.state for k in at]),
            (6, [k.rates for k in at]),
            (6, [k.accelerations for k in at]),
        ):
            whole = np.zeros((rows, len(at), n + 1))
            whole[:, :, :n] = np.array(each)[:, : rows * n].reshape(len(at), rows, n).swapaxes(0, 1)
            found.append(whole)
        found[0][3, :, n] = 1.0
        return [each[:, :, self._body] for each in found]

    def motions(self, at: Sequence[Stand]) -> Array:
        """Position, velocity and acceleration; of bodies then p, omega' and omega'dot, shape
        (stands, components, names).
        """
        poses, rates, accelerations = self._taken(at)
        moving = (
            Pose.of(vec([*poses[:3]]), quat(poses[3:])),
            Twist(vec([*rates[:3]]), vec([*rates[3:]])),
            Acceleration(vec([*accelerations[:3]]), vec([*accelerations[3:]])),
        )
        found: list[Vec3 | Quat] = [
            *motion_of_point([*self._position], vec([*self._arm]), self._model.frame.unit, *moving)
        ]
        if self._frame is not None:
            found += motion_of_frame(quat(self._frame), *moving)
        shape = len(at), len(self.names)
        return np.stack(
            [np.broadcast_to(component, shape) for each in found for component in each], axis=1
        )


def _columns(rows: Sequence[Sequence[float]], count: int) -> Array:
    return np.array(rows).reshape(-1, count).T
