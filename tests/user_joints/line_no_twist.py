"""A joint that the first rods of a probe lock: others do not."""

from dataclasses import dataclass

from kincheck import Joint
from kincheck.core import primitives as p
from kincheck.core.algebra import ZERO, vec
from kincheck.core.joints.base import direction, position, triad


@dataclass(frozen=True)
class LineNoTwist(Joint):
    """A point of body j slides along a line of body i; body j bends from it, and does not turn
    about it.
    """

    type = "line_no_twist"
    freedoms = ("slide", "bend x", "bend y")
    symmetric = False
    point: tuple[float, float, float] = position()
    axis: tuple[float, float, float] = direction()

    def primitives(self, i, j):
        P, (x, y, _) = vec(self.point), triad(self.axis)
        return (
            p.Dot20(x, i.arm(P), j.arm(P), ZERO),
            p.Dot20(y, i.arm(P), j.arm(P), ZERO),
            p.Dot10(x, y),
        )
