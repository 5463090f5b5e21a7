"""The balance of power, a check without reference: what drivers put in is stored or dissipated."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...algebra import Scalar, cross, vec
from ...mechanism.mechanism import Mechanism
from ...trajectory import Array
from .demand import Applied, BodyStates, inertia_now


def balance(
    mechanism: Mechanism,
    at: BodyStates,
    applied: Mapping[str, Applied],
    efforts: Mapping[str, Array],
    rates: Mapping[str, Array],
    n: int,
) -> tuple[Array, Array]:
    """Return the drivers' power less the change of energy and the dissipation, and the largest of
    the powers that are summed [W], shape (n,) each.

    Kinetic energy changes by m v a + w I wdot: the gyroscopic term does no work. No joint and no
    row enters, so the balance shows a wrong sign, point or inertia of the others.
    """
    powers: list[Scalar] = [efforts[name] * rates[name] for name in efforts]
    gravity = vec(mechanism.gravity)
    for body in mechanism.moving:
        if body.mass == 0.0:
            continue
        pose, twist = at.poses[body.name], at.twists[body.name]
        arm = pose.turn(at.frame.arm(body.name, body.center_of_mass or body.origin))
        v = at.frame.unit * twist.of(arm)
        a = at.accelerations[body.name]
        a_C = at.frame.unit * (a.v_t + cross(a.w_t, arm) + twist.centripetal(arm))
        powers += [-body.mass * (v @ a_C), body.mass * (v @ gravity)]
        inertia = inertia_now(body, pose)
        if inertia is not None:
            powers.append(-(twist.w @ (inertia @ a.w_t)))
    for each in applied.values():
        powers += [-each.stored, -each.lost]
    table: Array = np.array([each + np.zeros(n) for each in powers]).reshape(-1, n)
    return table.sum(axis=0), np.abs(table).max(axis=0, initial=0.0)
