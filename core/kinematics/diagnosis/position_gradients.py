"""Gradients of point positions by residuals and by geometry."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...algebra import Vec3, vec
from ...dual_numbers import Slope, derivatives
from ...mechanism.mechanism import Mechanism, Point
from ...primitives.base import GROUND_POSE, Twist
from ...trajectory import Array
from ..formulation.body_kinematics import position_of
from ..formulation.cartesian import Cartesian
from ..formulation.constraints import Frames
from ..formulation.formulation import Configuration
from ..formulation.parameters import places


@dataclass(frozen=True, eq=False)
class Gradient:
    """Derivatives of a point's position [m] at a sample, by components x, y, z.

    Attributes:
        position: at the sample and at design, global [m], shape (3,).
        by_residuals: by the residuals of the solved rows [m or rad], shape (3, rows).
        by_geometry: by the parameters of the geometry, shape (3, parameters).
        design_by_geometry: of the position at design, shape (3, parameters).
    """

    position: Array
    design: Array
    by_residuals: Array
    by_geometry: Array
    design_by_geometry: Array


class Geometry:
    """A geometry that depends on parameters.

    Attributes:
        slopes: values of the places that move, each number with its derivatives by all parameters.
        parameters: number of parameters.
    """

    def __init__(self, mechanism: Mechanism, moves: Mapping[str, Array]) -> None:
        values = places(mechanism)
        self.slopes = {place: tuple(map(Slope, values[place], moves[place])) for place in moves}
        self.parameters = next((moves[place].shape[1] for place in moves), 0)

    def derivatives_of(self, x: Any) -> Array:
        """Return the derivatives of a number by all parameters, shape (parameters,); zero for an
        independent number.
        """
        return np.broadcast_to(derivatives(x), (self.parameters,))


@dataclass(frozen=True, eq=False)
class Dependence:
    """Dependence of the unknowns at a sample on residuals and geometry.

    Attributes:
        by_residuals: derivatives of the unknowns by the residuals of the solved rows [m or rad],
            shape (unknowns, rows).
        by_geometry: derivatives of the unknowns by the parameters of the geometry, shape
            (unknowns, parameters).
    """

    formulation: Cartesian
    at: Configuration
    frame: Frames
    by_residuals: Array
    by_geometry: Array

    def gradient(self, point: Point, geometry: Geometry) -> Gradient:
        """How the position of a point depends on both."""
        pose, arm = (
            self.at.poses.get(point.body, GROUND_POSE),
            self.frame.arm(point.body, point.position),
        )
        turned = pose.turn(arm)
        by_unknowns = np.zeros((3, self.formulation.unknowns))
        if point.body in self.formulation.columns:
            first = self.formulation.columns[point.body]
            for k in range(6):
                rates = [float(k == column) for column in range(6)]
                by_unknowns[:, first + k] = [*Twist(vec(rates[:3]), vec(rates[3:])).of(turned)]
        by_unknowns *= self.frame.unit
        moved: Vec3 = vec(geometry.slopes.get(f"points.{point.name}.position", point.position))
        # the body carries its point along: A times the change of where it is at design
        design = np.array([geometry.derivatives_of(x) for x in moved])
        along = np.array([geometry.derivatives_of(x) for x in pose.turn(moved)])
        here, there = (
            np.array([*position_of(point.position, arm, self.frame.unit, pose)]),
            np.array(point.position),
        )
        return Gradient(
            here,
            there,
            by_unknowns @ self.by_residuals,
            by_unknowns @ self.by_geometry + along,
            design,
        )
