"""A Rzeppa joint of two shafts in line at design."""

from dataclasses import dataclass

import numpy as np
from kincheck import Body, Joint, Revolute, Spherical
from kincheck.core import primitives as p
from kincheck.core.algebra import vec
from kincheck.core.joints.base import direction, position, triad


@dataclass(frozen=True)
class Rzeppa(Joint):
    """Both shafts meet in the point and turn at the same rate about their axes, in line at
    design.
    """

    type = "rzeppa"
    freedoms = ("bend x", "bend y")
    point: tuple[float, float, float] = position()
    axis: tuple[float, float, float] = direction()

    def primitives(self, i, j):
        P, (f, g, _) = vec(self.point), triad(self.axis)
        return p.Spherical(i.arm(P), j.arm(P)), p.ConstantVelocity(f, g, f, g)

    def equivalent(self):
        """A Clemens coupling: two links, hinged to a shaft each and to each other by a ball,
        mirror images across the joint.
        """
        P, (f, g, h) = np.array(self.point), (np.array([*a]) for a in triad(self.axis))
        links, reach = (f"{self.name}_link_{k}" for k in (1, 2)), 0.1
        first, second = links
        return [Body(first), Body(second)], [
            Spherical(f"{self.name}_centre", self.i, self.j, self.point),
            Revolute(f"{self.name}_hinge_1", self.i, first, tuple(P - reach * h), tuple(g)),
            Spherical(f"{self.name}_ball", first, second, tuple(P + reach * f)),
            Revolute(f"{self.name}_hinge_2", second, self.j, tuple(P + reach * h), tuple(g)),
        ]
