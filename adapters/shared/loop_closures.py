"""Loop closures for simulators with a tree of joints: a cut joint becomes conditions on two frames,
one on each body.

The rows of one joint are never redundant, so a loop has dependent rows only by its geometry (planar
loops).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.algebra import Vec3
from ...core.joints import (
    ConstantVelocity,
    Cylindrical,
    Distance,
    Fixed,
    Inline,
    InPlane,
    Joint,
    OrientationLock,
    ParallelAxes,
    PerpendicularAxes,
    Planar,
    Revolute,
    RevoluteSpherical,
    Screw,
    Spherical,
    Translational,
    Universal,
)
from ...core.joints.base import triad, unit
from ...core.trajectory import Array
from .frame_constraints import (
    Coincident,
    Condition,
    Difference,
    Direction,
    Dot,
    EqualDots,
    Frame,
    Length,
    Thread,
)


@dataclass(frozen=True)
class Closure:
    """The rows of a cut joint type and their description."""

    text: str
    conditions: Callable[[Any, Frame, Frame], Sequence[Condition]]


def _at_point(i: Frame, j: Frame) -> list[Condition]:
    return [Coincident(Difference(i, j))]


def _parallel(joint: Any, i: Frame, j: Frame) -> list[Condition]:
    f, g, h = map(_array, triad(joint.axis))
    return [Dot(Direction(i, a), Direction(j, h)) for a in (f, g)]


def _alike(i: Frame, j: Frame) -> list[Condition]:
    # cyclic pairs of the axes: the gradients a × b are the three axes, so the rows are independent
    x, y, z = np.eye(3)
    return [Dot(Direction(i, a), Direction(j, b)) for a, b in ((x, y), (y, z), (z, x))]


def _on_line(joint: Any, i: Frame, j: Frame) -> list[Condition]:
    f, g, _ = map(_array, triad(joint.axis))
    return [Dot(Direction(i, a), Difference(i, j)) for a in (f, g)]


def _on_plane(joint: Any, i: Frame, j: Frame) -> list[Condition]:
    return [Dot(Direction(i, _array(unit(joint.axis))), Difference(i, j))]


def _crossed(joint: Any, i: Frame, j: Frame) -> list[Condition]:
    # a table may round the right angle; two hinges keep the design angle
    a, b = (_array(unit(axis)) for axis in joint.axes)
    return [Dot(Direction(i, a), Direction(j, b), float(a @ b))]


def _link(joint: Any, i: Frame, j: Frame) -> list[Condition]:
    h, d = _array(unit(joint.axis)), np.subtract(*joint.points[::-1])
    return [
        Length(Difference(i, j), math.hypot(*d)),
        Dot(Direction(i, h), Difference(i, j), float(h @ d)),
    ]


def twistless(joint: Any, i: Frame, j: Frame) -> list[Condition]:
    """Return the row of a constant-velocity joint about its shafts.

    With f × g along each shaft, f_i . g_j = g_i . f_j.
    """
    f, g, h = triad(joint.axes[0])
    # the shortest rotation from h to the other shaft acts on vectors normal to h like the
    # reflection that maps h to the opposite of the other shaft
    m = unit(tuple(h + unit(joint.axes[1])))
    f_j, g_j = (_array(a - (2.0 * (m @ a)) * m) for a in (f, g))
    left, right = ((f, g_j), (g, f_j))
    return [EqualDots(*(Dot(Direction(i, _array(a)), Direction(j, b)) for a, b in (left, right)))]


def _threaded(joint: Screw, i: Frame, j: Frame) -> list[Condition]:
    f, _, h = map(_array, triad(joint.axis))
    return [Thread(i, j, f, h, joint.lead / (2.0 * math.pi))]


CLOSURES: dict[type[Joint], Closure] = {
    Spherical: Closure("points coincide (3 rows)", lambda joint, i, j: _at_point(i, j)),
    Revolute: Closure(
        "points coincide (3 rows), axes parallel (2)",
        lambda joint, i, j: _at_point(i, j) + _parallel(joint, i, j),
    ),
    Translational: Closure(
        "axes aligned (3 rows), point on line (2)",
        lambda joint, i, j: _alike(i, j) + _on_line(joint, i, j),
    ),
    Universal: Closure(
        "points coincide (3 rows), axes at right angle (1)",
        lambda joint, i, j: _at_point(i, j) + _crossed(joint, i, j),
    ),
    Fixed: Closure(
        "points coincide (3 rows), axes aligned (3)",
        lambda joint, i, j: _at_point(i, j) + _alike(i, j),
    ),
    Distance: Closure(
        "points at constant distance (1 row)",
        lambda joint, i, j: [Length(Difference(i, j), joint.rod_length)],
    ),
    Cylindrical: Closure(
        "axes parallel (2 rows), point on line (2)",
        lambda joint, i, j: _parallel(joint, i, j) + _on_line(joint, i, j),
    ),
    Screw: Closure(
        "axes parallel (2 rows), point on line (2), displacement by turn (1)",
        lambda joint, i, j: _parallel(joint, i, j) + _on_line(joint, i, j) + _threaded(joint, i, j),
    ),
    Planar: Closure(
        "axes parallel (2 rows), point on plane (1)",
        lambda joint, i, j: _parallel(joint, i, j) + _on_plane(joint, i, j),
    ),
    ConstantVelocity: Closure(
        "points coincide (3 rows), shafts turn alike (1)",
        lambda joint, i, j: _at_point(i, j) + twistless(joint, i, j),
    ),
    OrientationLock: Closure("axes aligned (3 rows)", lambda joint, i, j: _alike(i, j)),
    ParallelAxes: Closure("axes parallel (2 rows)", _parallel),
    PerpendicularAxes: Closure("axes at right angle (1 row)", _crossed),
    Inline: Closure("point on line (2 rows)", _on_line),
    InPlane: Closure("point on plane (1 row)", _on_plane),
    RevoluteSpherical: Closure(
        "points at constant distance (1 row), link across the hinge (1)", _link
    ),
}
"""Closures by exact joint type."""


def _array(a: Vec3) -> Array:
    return np.array([*a], dtype=float)
