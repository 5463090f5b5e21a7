"""Equivalent mechanisms for simulators: drivers and loops of joints only, and a scaled frame.

A driven coordinate of a point becomes the coordinate of a slide: three slides in series carry a
ball at the point, and the first slide is driven. A rod between two points becomes a body between a
universal joint and a ball. Each replacement adds as many freedoms as conditions, so no other body
moves differently.

The scaled frame has a unit of length near the mechanism's size, and an origin near it. Simulators
have fixed metres and a fixed origin. A residual of 1e-12 m is a millionth of a mechanism of one
micrometre, and ten thousand kilometres from the origin no residual is so small: without scaling,
they stop there or silently continue in another assembly.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.algebra import triple
from ...core.case.case import Case, size
from ...core.joints import AxialJoint, Joint, Kind
from ...core.joints.base import triad, unit
from ...core.kinematics import unit_near
from ...core.mechanism.body import ACCELERATION
from ...core.mechanism.mechanism import Mechanism, Vector
from ...core.trajectory import Array

# Largest difference of a rod's length from the distance at design for a body in its place [m].
SAME_LENGTH = 1e-12
# Sine of the smallest angle between a rod and the axis of its body's hinge at which this axis is
# the first axis of a cross: 17 degrees.
ALONG = 0.3


def cross_of(mechanism: Mechanism, body: str, along: Iterable[float]) -> tuple[Vector, Vector]:
    """Return the axes of a cross between a body and a rod along a unit vector, unit vectors.

    The cross locks when the rod lies along the first axis. A crank turns its rod about the crank's
    hinge, so the first axis is the axis of such a hinge, if it is not nearly along the rod.
    """
    d = np.array([*along])
    hinges = [
        each
        for each in mechanism.joints
        if isinstance(each, AxialJoint) and body in each.bodies and not mechanism.is_fixed(body)
    ]
    axes = [np.array([*unit(each.axis)]) for each in hinges]
    first = next(
        (axis for axis in axes if math.hypot(*np.cross(axis, d)) > ALONG),
        np.array([*triad((*d.tolist(),))[0]]),
    )
    second = np.cross(d, first)
    return triple(first), triple(second / np.linalg.norm(second))


@dataclass(frozen=True)
class OwnFrame:
    """A unit of length and an origin.

    Attributes:
        unit: a power of two, so that scaling does not round [m].
        origin: global position [m].
    """

    unit: float
    origin: Vector

    def there(self, position: Sequence[float]) -> Vector:
        """Return a global position [m] in this frame [units]."""
        x, y, z = ((x - o) / self.unit for x, o in zip(position, self.origin, strict=True))
        return x, y, z

    def units(self, length: float) -> float:
        """Return a length [m] in units."""
        return length / self.unit

    def back(self, position: Array) -> Array:
        """Return positions in this frame [units], shape (..., 3), as global positions [m]."""
        return self.unit * position + np.array(self.origin)


GLOBAL = OwnFrame(1.0, (0.0, 0.0, 0.0))


def own_frame(case: Case) -> OwnFrame:
    """Return the frame of a case.

    The origin is the global one if the mechanism's middle is within half a unit of it on each axis.
    """
    mechanism, unit = case.mechanism, unit_near(size(case))
    positions = [at for joint in mechanism.joints for at in joint.points_on()] + [
        point.position for point in mechanism.points
    ]
    # a multiple of the unit, so that points on such a grid move without rounding
    x, y, z = (
        unit * round(0.5 * (min(axis) + max(axis)) / unit) for axis in zip(*positions, strict=True)
    )
    return OwnFrame(unit, (x, y, z))


def in_own_frame(case: Case) -> Case:
    """Return the case with its mechanism in its scaled frame; drivers and outputs stay in SI.

    Loads are in kg, s and the unit u of length [m]: inertia in kg u^2, gravity in u/s^2, forces in
    kg u/s^2, torques in kg u^2/s^2, stiffness and damping accordingly.
    """
    mechanism, frame = case.mechanism, own_frame(case)
    ways: dict[Kind, Any] = {Kind.POSITION: frame.there, Kind.LENGTH: frame.units}

    def scaled(joint: Joint) -> Joint:
        return joint.changed(**joint.mapped(ways))

    return replace(
        case,
        mechanism=mechanism.with_joints(
            scaled,
            bodies=[body.in_frame(frame.there, frame.unit) for body in mechanism.bodies],
            points=[
                replace(point, position=frame.there(point.position)) for point in mechanism.points
            ],
            couplers=[coupler.scaled(1.0 / frame.unit) for coupler in mechanism.couplers],
            gravity=tuple(ACCELERATION.in_kg_and_s(x, frame.unit) for x in mechanism.gravity),
            forces=[force.in_frame(frame.there, frame.unit) for force in mechanism.forces],
        ),
    )
