"""Equivalent mechanisms for simulators that drive and close only joints.

A driven coordinate of a point becomes the coordinate of a slide: three slides in series carry a
ball at the point, and the first slide is driven. A rod between two points becomes a body between a
universal joint and a ball. Each replacement adds as many freedoms as conditions, so no other body
moves differently.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ...core.algebra import triple
from ...core.joints import AxialJoint, Distance, Joint, Spherical, Translational, Universal
from ...core.joints.base import triad, unit
from ...core.mechanism.mechanism import GROUND, Body, Mechanism, Vector
from ...core.mechanism.motions import Driver, JointDisplacement, PointCoordinate

# Largest difference of a rod's length from the distance at design for a body in its place [m].
SAME_LENGTH = 1e-12
# Sine of the smallest angle between a rod and the axis of its body's hinge at which this axis is
# the first axis of a cross: 17 degrees.
ALONG = 0.3


def jointed(mechanism: Mechanism, *, rods: bool = False) -> Mechanism:
    """Return the mechanism with joint drivers only and without rods.

    Rods whose length differs from the design remain. Added bodies have no mass.

    Args:
        rods: whether all rods remain.
    """
    bodies, joints, drivers = list(mechanism.bodies), list[Joint](), list[Driver]()
    for joint in mechanism.joints:
        if isinstance(joint, Distance) and fits(joint) and not rods:
            rod = Body(f"{joint.name}: rod", joint.points[0])
            bodies.append(rod)
            joints += _rod(mechanism, joint, rod.name)
        else:
            joints.append(joint)
    for driver in mechanism.drivers:
        if isinstance(driver, PointCoordinate):
            point = mechanism.point(driver.point)
            f, g, h = triad(driver.direction)
            names = [f"{driver.name}: {way}" for way in ("along", "across", "beyond")]
            bodies += [Body(name, point.position) for name in names]
            for below, name, axis in zip((GROUND, *names), names, (h, f, g), strict=False):
                joints.append(
                    Translational(name, below, name, point=point.position, axis=triple(axis))
                )
            joints.append(
                Spherical(f"{driver.name}: ball", names[-1], point.body, point=point.position)
            )
            drivers.append(JointDisplacement(driver.name, names[0], driver.relative))
        else:
            drivers.append(driver)
    return replace(mechanism, bodies=bodies, joints=joints, drivers=drivers)


def fits(rod: Distance) -> bool:
    """Return whether a rod has its length at design."""
    return abs(rod.rod_length - rod.design_distance) <= SAME_LENGTH * rod.design_distance


def _rod(mechanism: Mechanism, joint: Distance, rod: str) -> list[Joint]:
    (i, j), (P_i, P_j) = joint.bodies, joint.points
    if mechanism.is_fixed(j):  # the cross is on the body that turns least
        (i, j), (P_i, P_j) = (j, i), (P_j, P_i)
    axes = cross_of(mechanism, i, unit([b - a for a, b in zip(P_i, P_j, strict=True)]))
    return [
        Universal(f"{joint.name}: cross", i, rod, point=P_i, axes=axes),
        Spherical(f"{joint.name}: ball", rod, j, point=P_j),
    ]


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
