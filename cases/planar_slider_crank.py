"""Closed form of the planar slider-crank: x = r cos t + sqrt(l^2 - r^2 sin^2 t).

x is the slider's position (any textbook). Its forces follow body by body. The slider's acceleration
gives the rod's push along the guide; the rod's moments about the crank pin give its push across it.
"""

from __future__ import annotations

from collections.abc import Mapping

from ..core.mechanism.mechanism import Mechanism
from .jet import Jet, Lanes, Motion, constant, cos, sin, sqrt

CRANK, ROD = 1.0, 3.0  # r, l [m]


def motion(turn: Jet) -> Motion:
    """Return the points of the mechanism, the crank turned by `turn` [rad] from the stretched-out
    design.
    """
    zero = constant(0.0, turn)
    px, py = CRANK * cos(turn), CRANK * sin(turn)
    x = px + sqrt(ROD**2 - py * py)
    return {"slider": (x, zero, zero), "rod_middle": (0.5 * (x + px), 0.5 * py, zero)}


def forces(mechanism: Mechanism, turn: Jet) -> Mapping[str, Lanes]:
    """Return the forces of gudgeon and guide on the slider, and the torque of the crank."""
    crank, rod, slider = mechanism.moving
    gravity = -mechanism.gravity[1]
    px, py = CRANK * cos(turn), CRANK * sin(turn)
    dx, dy = sqrt(ROD**2 - py * py), -py  # from pin to gudgeon
    x = px + dx
    cx, cy = 0.5 * (x + px), 0.5 * py
    push = slider.mass * x.a
    # the rod's angle s: sin s = dy / l, cos s s-ddot = (dy-ddot + sin s s-dot^2 l) / l
    rate = dy.v / dx.x
    turned = (dy.a + dy.x * rate**2) / dx.x
    inertia = rod.inertia[2] if rod.inertia else 0.0
    moment = inertia * turned + 0.5 * rod.mass * (dx.x * (cy.a + gravity) - dy.x * cx.a)
    lift = (dy.x * push - moment) / dx.x
    pin_x, pin_y = rod.mass * cx.a + push, rod.mass * (cy.a + gravity) + lift
    torque = px.x * pin_y - py.x * pin_x + 0.5 * crank.mass * gravity * px.x
    return {
        "crank_torque": torque,
        "gudgeon_force_x": push,
        "gudgeon_force_y": lift,
        "guide_force_y": slider.mass * gravity - lift,
    }
