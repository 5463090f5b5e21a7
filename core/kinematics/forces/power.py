"""Balance of power, a check without reference: drivers' power is stored or dissipated."""

from __future__ import annotations

from collections.abc import Mapping

from ...algebra import Scalar, is_literal_zero, vec
from ...mechanism.mechanism import Mechanism
from .demand import (
    BodyStates,
    acceleration_of_center,
    arm_of_center,
    inertia_of,
    spin_of,
)
from .elements import Applied


def powers(
    mechanism: Mechanism,
    at: BodyStates,
    applied: Mapping[str, Applied],
    efforts: Mapping[str, Scalar],
    rates: Mapping[str, Scalar],
) -> list[Scalar]:
    """Return the powers of drivers, less the changes of energy and the dissipation [W].

    Their sum is zero. Kinetic energy changes by m v a + w I wdot: the gyroscopic term does no work.
    The balance uses no joint and no row. A wrong sign, point or inertia in the equations of forces
    therefore breaks it.
    """
    found: list[Scalar] = [efforts[name] * rates[name] for name in efforts]
    gravity = vec(mechanism.gravity)
    for body in mechanism.moving:
        if is_literal_zero(body.mass):
            continue
        v = at.frame.unit * at.twists[body.name].of(arm_of_center(body, at))
        a = acceleration_of_center(body, at)
        found += [-body.mass * (v @ a), body.mass * (v @ gravity)]
        inertia = inertia_of(body)
        if inertia is not None:
            w, w_t = spin_of(body, at)
            found.append(-(w @ (inertia @ w_t)))
    for each in applied.values():
        found += [-each.stored, -each.lost]
    return found
