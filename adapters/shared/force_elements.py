"""Force elements on the frames of a simulator: the wrench of each element on its bodies.

They serve simulators without such elements, or with elements of another meaning.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.joints.base import unit
from ...core.mechanism.curves import Curve
from ...core.mechanism.loads import (
    Axes,
    Bushing,
    Force,
    ForceElement,
    Law,
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
    if isinstance(each, Bushing):
        return [(body, each.point) for body in each.bodies]
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
            deflection = length - (each.free_length or 0.0)
            tension = each.stiffness * deflection + each.damping * rate
            tension += curve_force(each.curve, deflection)
            pull = np.concatenate([tension * along, np.zeros(3)])
            return tension, (pull, -pull)
        if isinstance(each, TorsionSpringDamper):
            i, j = self.frames
            axis = i.rotation @ self.axis
            rate = float(axis @ (j.velocity - i.velocity)[3:])
            deflection = self.angle() - each.free_angle
            elastic = each.stiffness * deflection + curve_force(each.curve, deflection)
            amount = -(elastic + each.damping * rate)
            twist = np.concatenate([np.zeros(3), amount * axis])
            return amount, (-twist, twist)
        if isinstance(each, Bushing):
            return bushing_at_work(each, *self.frames)
        assert isinstance(each, Force | Torque)
        vector = np.array(each.vector)
        turned = vector if each.frame is Axes.GLOBAL else self.frames[0].rotation @ vector
        parts = (np.zeros(3), turned) if isinstance(each, Torque) else (turned, np.zeros(3))
        return float(np.linalg.norm(vector)), (np.concatenate(parts),)


def curve_force(table: Curve | None, deflection: float) -> float:
    """Return the force of a curve at a deflection; straight beyond its ends."""
    if not table:
        return 0.0
    # slow to import, and few mechanisms have curves
    from scipy.interpolate import PchipInterpolator  # pyright: ignore[reportMissingTypeStubs]

    inside = float(np.clip(deflection, table[0][0], table[-1][0]))
    cubic: Any = PchipInterpolator(*np.array(table).T)
    return float(cubic(inside) + cubic(inside, 1) * (deflection - inside))


def bushing_at_work(
    each: Bushing, i: FrameOnBody, j: FrameOnBody
) -> tuple[float, tuple[Array, Array]]:
    """Return the amount of a bushing, and its wrenches on both bodies about their points.

    Written with rotation matrices, as the native engine's with Euler parameters.
    """
    axes = i.rotation @ np.array(each.triad).T
    d = j.position - i.position
    v, w = i.velocity[:3], i.velocity[3:]
    rates = axes.T @ (j.velocity[:3] - v - np.cross(w, d))
    x = axes.T @ d
    tables = each.curve or ((), (), ())
    curves = np.array([curve_force(table, s) for table, s in zip(tables, x.tolist(), strict=True)])
    loads = np.array([each.stiffness, each.preload, each.damping])
    force = axes @ (loads[0] * x + loads[1] + curves + loads[2] * rates)
    turn = np.array(each.triad) @ i.rotation.T @ j.rotation @ np.array(each.triad).T
    torque = elastic_torque(each, turn)
    torque += np.array(each.turning_damping) * (axes.T @ (j.velocity[3:] - w))
    moment = axes @ torque
    size = float(np.linalg.norm(moment if each.turns_only else force))
    on_first: Any = np.concatenate([force, moment + np.cross(d, force)])
    return size, (on_first, -np.concatenate([force, moment]))


def elastic_torque(each: Bushing, turn: Array) -> Array:
    """Return the elastic torque on the first body in the bushing's axes [N m].

    Args:
        turn: rotation matrix of the second body in these axes since design.
    """
    k: Array = np.array(each.turning_stiffness)
    if each.law is Law.CARDAN:
        a, b = np.arctan2(-turn[1, 2], turn[2, 2]), np.arcsin(turn[0, 2])
        c = np.arctan2(-turn[0, 1], turn[0, 0])
        # the axes of the three turns, in the bushing's
        of_turns = np.array(
            [
                [1.0, 0.0, 0.0],
                [0.0, np.cos(a), np.sin(a)],
                [np.sin(b), -np.sin(a) * np.cos(b), np.cos(a) * np.cos(b)],
            ]
        )
        torque: Any = np.linalg.solve(of_turns, k * np.array([a, b, c]))
        return torque
    e0 = 0.5 * np.sqrt(max(0.0, 1.0 + np.trace(turn)))
    if e0 < 0.5:  # near a half turn e is the axis, by the largest column
        square = 0.25 * (1.0 + 2.0 * np.diag(turn) - np.trace(turn))
        k_max = int(square.argmax())
        e = (turn[k_max] + turn[:, k_max]) / 4.0
        e[k_max] = square[k_max]
        e /= np.sqrt(square[k_max])
        other, third = (k_max + 1) % 3, (k_max + 2) % 3
        e0 = (turn[third, other] - turn[other, third]) / (4.0 * e[k_max])
    else:
        skew = turn - turn.T
        e = np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / (4.0 * e0)
    t = 2.0 * k * e
    return e0 * t + np.cross(e, t)


def axis_of(each: ForceElement, mechanism: Mechanism) -> Array:
    """Return the unit axis of a torsional spring-damper's joint; for other elements, zero."""
    if not isinstance(each, TorsionSpringDamper):
        return np.zeros(3)
    joint: Any = mechanism.joint(each.joint)
    return np.array([*unit(joint.axis)])
