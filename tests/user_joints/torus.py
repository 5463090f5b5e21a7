"""A point of one body on a torus of the other, at its outer equator at design."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from kincheck import Joint
from kincheck.core.algebra import root, vec
from kincheck.core.joints.base import direction, length, position, triad
from kincheck.primitives import Primitive


@dataclass(frozen=True)
class OnTorus(Primitive):
    """The distance of a point from the circle in the tube is the tube's radius."""

    n = 1
    axes: Any
    arm_i: Any
    arm_j: Any
    major: float
    minor: float

    def phi(self, i, j):
        off = (j.u + j.swing(self.arm_j)) - (i.u + i.swing(self.arm_i))
        x, y, z = (i.turn(axis) @ off for axis in self.axes)
        x = x + (self.major + self.minor)
        out = root(x * x + y * y) - self.major
        return ((out * out + z * z - self.minor**2) * (0.5 / self.minor),)


@dataclass(frozen=True)
class Torus(Joint):
    """The point slides along and about the tube, and turns freely."""

    type = "torus"
    freedoms = ("along", "about", "rotation x", "rotation y", "rotation z")
    symmetric = False
    point: tuple[float, float, float] = position()
    axis: tuple[float, float, float] = direction()
    major: float = length()
    minor: float = length()

    def primitives(self, i, j):
        point, axes = vec(self.point), triad(self.axis)
        return (OnTorus(axes, i.arm(point), j.arm(point), self.major, self.minor),)
