"""Efforts of drivers in closed form, by the balance of power.

The power of the one driver equals the power of the accelerated masses, less the power of gravity,
plus the power of the springs. No reaction of a joint enters. The case file gives the masses. The
case's closed form gives the motion, as three points of each body.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeAlias

import numpy as np

from ..core.mechanism.loads import SpringDamper
from ..core.mechanism.mechanism import GROUND, Mechanism
from .jet import Jet, Lanes, sqrt
from .vectors import Numbers, Vec, carried, fixed

Three: TypeAlias = tuple[Vec, Vec, Vec]


def effort(mechanism: Mechanism, turn: Jet, bodies: Callable[[Jet], Mapping[str, Three]]) -> Lanes:
    """Return the effort of the only driver over the samples [N or N m].

    Args:
        turn: change of the driver's coordinate since design; it moves at every sample.
        bodies: function from the change to three points of each moving body, not on one line.
    """
    now, design = bodies(turn), bodies(standing(turn))
    power = np.zeros_like(turn.x)
    gravity = fixed(mechanism.gravity, turn)
    for body in mechanism.moving:
        if not body.mass:
            continue
        center = carried(
            design[body.name], now[body.name], fixed(body.center_of_mass or body.origin, turn)
        )
        for x, g in zip(center, gravity, strict=True):
            power += body.mass * (x.a - g.x) * x.v
        if body.inertia is not None:
            power += turning_power(body.inertia, design[body.name], now[body.name])
    for each in mechanism.forces:
        assert isinstance(each, SpringDamper)
        ends = [
            fixed(point, turn)
            if body == GROUND
            else carried(design[body], now[body], fixed(point, turn))
            for body, point in zip(each.bodies, each.points, strict=True)
        ]
        way = ends[1] - ends[0]
        length = sqrt(way @ way)
        stretch = length.x - (each.free_length or 0.0)
        power += (each.stiffness * stretch + each.damping * length.v) * length.v
    return power / turn.v


def turning_power(inertia: Numbers, design: Three, now: Three) -> Lanes:
    """Return  omega . I omega-dot  of a body, in its axes at design [W].

    Its axes e_k, carried by the body, give  omega = 1/2 sum e_k x e_k-dot.
    """
    like = now[0].x
    origin = fixed((0.0, 0.0, 0.0), like)
    base = carried(design, now, origin)
    axes = [carried(design, now, fixed(axis, like)) - base for axis in np.eye(3).tolist()]
    e, rates, seconds = (
        np.array([[getattr(x, order) for x in axis] for axis in axes]) for order in ("x", "v", "a")
    )
    omega, omega_t = (
        np.einsum("kxn,xn->kn", e, 0.5 * np.cross(e, each, axis=1).sum(axis=0))
        for each in (rates, seconds)
    )
    xx, yy, zz, xy, yz, xz = inertia
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return np.einsum("in,ij,jn->n", omega, matrix, omega_t)


def standing(like: Jet) -> Jet:
    """Return a coordinate at the design position, without motion, one sample."""
    zero = np.zeros_like(like.x[:1])
    return Jet(zero, zero, zero)
