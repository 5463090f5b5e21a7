"""A point in a bowl: with a primitive of its own that is its residual alone."""

from dataclasses import dataclass

from kincheck import Joint
from kincheck.core.algebra import Scalar, Vec3, vec
from kincheck.core.joints.base import direction, length, position, triad
from kincheck.core.primitives import Primitive


@dataclass(frozen=True)
class OnBowl(Primitive):
    """phi = z - (x^2 + y^2) / (2 R), from the apex along three axes of body i."""

    n = 1
    axes: tuple[Vec3, Vec3, Vec3]
    s_i: Vec3
    s_j: Vec3
    R: Scalar

    def phi(self, i, j):
        d = (j.u + j.swing(self.s_j)) - (i.u + i.swing(self.s_i))
        x, y, z = (i.turn(axis) @ d for axis in self.axes)
        return (z - (x**2 + y**2) * (0.5 / self.R),)


@dataclass(frozen=True)
class Bowl(Joint):
    """A point of body j slides in a bowl of body i whose apex it is at design."""

    type = "bowl"
    freedoms = ("x", "y", "rotation x", "rotation y", "rotation z")
    symmetric = False
    point: tuple[float, float, float] = position()
    axis: tuple[float, float, float] = direction()
    radius: float = length()

    def primitives(self, i, j):
        P = vec(self.point)
        return (OnBowl(triad(self.axis), i.arm(P), j.arm(P), self.radius),)
