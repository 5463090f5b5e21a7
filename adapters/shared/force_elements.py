"""Force elements on the frames of a simulator: the wrench of each element on its bodies.

They serve simulators without such elements, or with elements of another meaning.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.joints.base import unit
from ...core.mechanism.loads import (
    Axes,
    Force,
    ForceElement,
    SpringDamper,
    Torque,
    TorsionSpringDamper,
)
from ...core.mechanism.mechanism import Mechanism, Vector
from ...core.trajectory import Array
from .frame_constraints import FrameOnBody


def places(each: ForceElement, mechanism: Mechanism) -> Sequence[tuple[str, Vector]]:
    """Return the bodies of an element, and its points on them, global at design [m]."""
    if isinstance(each, SpringDamper):
        return list(zip(each.bodies, each.points, strict=True))
    if isinstance(each, TorsionSpringDamper):
        joint: Any = mechanism.joint(each.joint)
        return [(body, joint.point) for body in joint.bodies]
    if isinstance(each, Force):
        return [(each.body, each.point)]
    assert isinstance(each, Torque)
    body = each.body
    return [(body, (0.0, 0.0, 0.0) if mechanism.is_fixed(body) else mechanism.body(body).origin)]


@dataclass(frozen=True, eq=False)
class Element:
    """A force element on frames of a simulator.

    Attributes:
        frames: one frame on each body of the element, at its point.
        axis: unit vector of the joint of a torsional spring-damper, at design.
        angle: returns the angle of this joint [rad].
    """

    given: ForceElement
    frames: Sequence[FrameOnBody]
    axis: Array
    angle: Callable[[], float]

    def at_work(self) -> tuple[float, Sequence[Array]]:
        """Return the amount (see `core.forces.Forces.elements`), and the wrench on the body of each
        frame, force over moment about its point.
        """
        each = self.given
        if isinstance(each, SpringDamper):
            i, j = self.frames
            d = j.position - i.position
            length = float(np.sqrt(d @ d))
            along = d / length
            rate = float(along @ (j.velocity - i.velocity)[:3])
            tension = each.stiffness * (length - (each.free_length or 0.0)) + each.damping * rate
            pull = np.concatenate([tension * along, np.zeros(3)])
            return tension, (pull, -pull)
        if isinstance(each, TorsionSpringDamper):
            i, j = self.frames
            axis = i.rotation @ self.axis
            rate = float(axis @ (j.velocity - i.velocity)[3:])
            amount = -(each.stiffness * (self.angle() - each.free_angle) + each.damping * rate)
            twist = np.concatenate([np.zeros(3), amount * axis])
            return amount, (-twist, twist)
        assert isinstance(each, Force | Torque)
        vector = np.array(each.vector)
        turned = vector if each.frame is Axes.GLOBAL else self.frames[0].rotation @ vector
        parts = (np.zeros(3), turned) if isinstance(each, Torque) else (turned, np.zeros(3))
        return float(np.linalg.norm(vector)), (np.concatenate(parts),)


def axis_of(each: ForceElement, mechanism: Mechanism) -> Array:
    """Return the unit axis of a torsional spring-damper's joint; for other elements, zero."""
    if not isinstance(each, TorsionSpringDamper):
        return np.zeros(3)
    joint: Any = mechanism.joint(each.joint)
    return np.array([*unit(joint.axis)])
