"""Motions of points and bodies at solved poses of a sparse system."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...algebra import Quat, Vec3, quat, vec
from ...primitives.base import Pose, Twist
from ...trajectory import Array
from ..compiled.request import Request
from ..compiled.solution import Columns
from ..formulation.body_kinematics import motion_of_frame, motion_of_point
from ..formulation.formulation import Acceleration
from .sparse_equations import SparseEquations


class OutputMotions:
    """Motions of the points and bodies of a request.

    Attributes:
        columns: their columns in the table of samples.
    """

    def __init__(self, model: SparseEquations, request: Request) -> None:
        m = model.mechanism
        self.columns, self._order = Columns.of(request), request.order
        points = [(m.point(name).body, m.point(name).position) for name in request.points]
        origins = [(name, m.body(name).origin) for name in request.bodies]
        self._points = _Places(model, points)
        self._bodies = _Places(model, origins)
        self._frame = _columns([m.body(name).euler_parameters for name in request.bodies], 4)

    def motions(self, *at: Array) -> Array:
        """Return the motions at solved poses, by their states, rates and accelerations, shape
        (numbers, poses) each; shape (columns, poses).
        """
        order, poses, points = self._order, at[0].shape[1], self._points
        of_points = _side_by_side(
            points.motions(points.moving(at))[: order + 1] if points.count else (),
            (poses, points.count),
        )
        if not self._bodies.count:  # nearly always: they take as long as the points
            return of_points
        moving = self._bodies.moving(at)
        r, *rates = self._bodies.motions(moving)
        p, *turning = motion_of_frame(quat(self._frame), *moving)
        pairs = [each for pair in zip(rates, turning, strict=True) for each in pair]
        of_bodies = [r, p, *pairs[: 2 * order]]
        return np.vstack([of_points, _side_by_side(of_bodies, (poses, self._bodies.count))])


class _Places:
    """Points fixed in bodies."""

    def __init__(
        self, model: SparseEquations, places: Sequence[tuple[str, Sequence[float]]]
    ) -> None:
        self._moving, self._unit, self.count = model.bodies, model.frame.unit, len(places)
        number = {name: k for k, name in enumerate(model.frame.moving)}
        # bodies at rest follow the moving ones
        self._body = np.array([number.get(body, len(number)) for body, _ in places], np.intp)
        self._position = _columns([position for _, position in places], 3)
        self._arm = _columns([tuple(model.frame.arm(*place)) for place in places], 3)

    def moving(self, at: Sequence[Array]) -> tuple[Pose, Twist, Acceleration]:
        """Return poses, rates and accelerations of the bodies, each component of shape (poses,
        places).
        """
        n, poses, found = self._moving, at[0].shape[1], list[Array]()
        for rows, each in zip((7, 6, 6), at, strict=True):
            whole = np.zeros((rows, poses, n + 1))
            whole[:, :, :n] = each[: rows * n].reshape(rows, n, poses).swapaxes(1, 2)
            found.append(whole)
        found[0][3, :, n] = 1.0
        poses, rates, accelerations = (each[:, :, self._body] for each in found)
        return (
            Pose.of(vec([*poses[:3]]), quat(poses[3:])),
            Twist(vec([*rates[:3]]), vec([*rates[3:]])),
            Acceleration(vec([*accelerations[:3]]), vec([*accelerations[3:]])),
        )

    def motions(self, moving: tuple[Pose, Twist, Acceleration]) -> Sequence[Vec3]:
        """Return position, velocity and acceleration of the points."""
        return motion_of_point([*self._position], vec([*self._arm]), self._unit, *moving)


def _side_by_side(found: Sequence[Vec3 | Quat], shape: tuple[int, int]) -> Array:
    """Return components of vectors, of each place side by side, shape (columns, poses)."""
    components = [np.broadcast_to(component, shape) for each in found for component in each]
    if not components:
        return np.empty((0, shape[0]))
    return np.stack(components, axis=-1).reshape(shape[0], -1).T


def _columns(rows: Sequence[Sequence[float]], count: int) -> Array:
    return np.array(rows).reshape(-1, count).T
