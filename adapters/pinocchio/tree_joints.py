"""Joints of Pinocchio that make a joint of the spanning tree; private to its adapter."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from ...core.joints import (
    ConstantVelocity,
    Cylindrical,
    Fixed,
    Joint,
    OrientationLock,
    Planar,
    Revolute,
    Screw,
    Spherical,
    Translational,
    Universal,
)
from ...core.joints.base import triad, unit
from ...core.trajectory import Array


# Axes are normalised, because Pinocchio takes others without a word and then shears the body.
def _turns(pin: Any, *axes: Iterable[float]) -> list[Any]:
    return [pin.JointModelRevoluteUnaligned(_unit(axis)) for axis in axes]


def _slides(pin: Any, *axes: Iterable[float]) -> list[Any]:
    return [pin.JointModelPrismaticUnaligned(_unit(axis)) for axis in axes]


TREE_JOINTS: dict[type[Joint], Callable[[Any, Any], Sequence[Any]]] = {
    Spherical: lambda pin, joint: [pin.JointModelSpherical()],
    Revolute: lambda pin, joint: _turns(pin, joint.axis),
    Translational: lambda pin, joint: _slides(pin, joint.axis),
    Cylindrical: lambda pin, joint: _turns(pin, joint.axis) + _slides(pin, joint.axis),
    # its relation makes a row
    Screw: lambda pin, joint: _turns(pin, joint.axis) + _slides(pin, joint.axis),
    # two hinges keep the design angle of the cross where a table has rounded its right angle
    Universal: lambda pin, joint: _turns(pin, *joint.axes),
    # a row keeps it from twisting
    ConstantVelocity: lambda pin, joint: [pin.JointModelSpherical()],
    Planar: lambda pin, joint: _slides(pin, *triad(joint.axis)[:2]) + _turns(pin, joint.axis),
    OrientationLock: lambda pin, joint: [pin.JointModelTranslation()],
    Fixed: lambda pin, joint: [],
}
"""Pinocchio's joints that make a joint, from first body to second, one a freedom of an axial joint;
other types are always cut.
"""


def _unit(a: Iterable[float]) -> Array:
    return np.array([*unit(tuple(a))])
