"""The same mechanism for simulators with drivers and closures by joints only.

A driven coordinate of a point becomes that of a slide: three slides in line carry a ball at the
point, the first one is driven. A rod between two points becomes a body between a universal joint
and a ball. Each adds as many freedoms as conditions; the motion of every other body stays.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ...core.algebra import triple
from ...core.joints import AxialJoint, Distance, Joint, Spherical, Translational, Universal
from ...core.joints.base import triad, unit
from ...core.mechanism.drivers import Driver, JointDisplacement, PointCoordinate
from ...core.mechanism.mechanism import GROUND, Body, Mechanism, Vector

# A rod whose given length differs from the distance at design by more does not fit at design, and
# no body has its length there [m].
SAME_LENGTH = 1e-12
# Sine of the angle between a rod and the axis of its body's hinge below which that axis is no first
# axis of a cross: 17 degrees.
ALONG = 0.3


def jointed(mechanism: Mechanism, *, rods: bool = False) -> Mechanism:
    """Return the mechanism with joint drivers only and without rods.

    Rods whose length differs from the design stay. Added bodies have no mass.

    Args:
        rods: whether all rods stay.
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
    if mechanism.is_fixed(j):  # the cross stands on what turns least
        (i, j), (P_i, P_j) = (j, i), (P_j, P_i)
    axes = cross_of(mechanism, i, unit([b - a for a, b in zip(P_i, P_j, strict=True)]))
    return [
        Universal(f"{joint.name}: cross", i, rod, point=P_i, axes=axes),
        Spherical(f"{joint.name}: ball", rod, j, point=P_j),
    ]


def cross_of(mechanism: Mechanism, body: str, along: Iterable[float]) -> tuple[Vector, Vector]:
    """Return the axes of a cross between a body and a rod along a unit vector, unit vectors.

    The cross locks where the rod comes to lie along the first axis. A crank turns its rod about the
    crank's own hinge, so the first axis is that of such a hinge where it is across the rod.
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
