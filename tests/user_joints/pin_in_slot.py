"""A pin in a slot: as in the tutorial of the documentation."""

from dataclasses import dataclass

from kincheck import Body, Joint, Revolute, Translational
from kincheck.core import primitives as p
from kincheck.core.algebra import ZERO, cross, vec
from kincheck.core.joints.base import directions, position, require_perpendicular, triad, unit


@dataclass(frozen=True)
class PinInSlot(Joint):
    """Body i has a slot along the first axis; a pin of body j, about the second, slides and turns
    in it.
    """

    type = "pin_in_slot"
    freedoms = ("slide", "turn")
    symmetric = False
    point: tuple[float, float, float] = position()
    axes: tuple[tuple[float, float, float], tuple[float, float, float]] = directions()

    def __post_init__(self):
        super().__post_init__()
        require_perpendicular(self, self.axes)

    def primitives(self, i, j):
        P, (slot, pin) = vec(self.point), map(unit, self.axes)
        sides = (p.Dot20(a, i.arm(P), j.arm(P), ZERO) for a in (unit([*cross(pin, slot)]), pin))
        return p.Dot11(*triad([*pin])), *sides

    def equivalent(self):
        block, (slot, pin) = f"{self.name}_block", self.axes
        return [Body(block)], [
            Translational(f"{self.name}_slot", self.i, block, self.point, slot),
            Revolute(f"{self.name}_pin", block, self.j, self.point, pin),
        ]
