"""Efforts of drivers in closed form, by the balance of power.

The power of the one driver is that of the accelerated masses, less that of gravity, plus that of
the springs; no reaction of a joint enters. Masses are those of the case file, the motion is that of
the case's closed form: each body by three points of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

import numpy as np

from ..core.mechanism.loads import SpringDamper
from ..core.mechanism.mechanism import GROUND, Mechanism
from .jet import Jet, Lanes, sqrt
from .vectors import Numbers, Vec, carried, cross, fixed

Three: TypeAlias = tuple[Vec, Vec, Vec]


def effort(
    mechanism: Mechanism, turn: Jet, now: Mapping[str, Three], design: Mapping[str, Three]
) -> Lanes:
    """Return the effort of the only driver over the samples [N or N m].

    Args:
        turn: the driver's coordinate, which moves at every sample.
        now, design: three points of each moving body, not on one line.
    """
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

    Its axes e_k carried along give  omega = 1/2 sum e_k x e_k-dot.
    """
    like = now[0].x
    origin = fixed((0.0, 0.0, 0.0), like)
    base = carried(design, now, origin)
    axes = [carried(design, now, fixed(axis, like)) - base for axis in np.eye(3).tolist()]
    xx, yy, zz, xy, yz, xz = inertia
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    spin, change = origin, origin
    for axis in axes:
        rate, second = (
            Vec(*(constant_like(each) for each in values))
            for values in ([x.v for x in axis], [x.a for x in axis])
        )
        spin, change = spin + 0.5 * cross(axis, rate), change + 0.5 * cross(axis, second)
    omega = np.array([(axis @ spin).x for axis in axes])
    omega_t = np.array([(axis @ change).x for axis in axes])
    return np.einsum("in,ij,jn->n", omega, matrix, omega_t)


def standing(like: Jet) -> Jet:
    """Return a coordinate at the design position, without motion, one sample."""
    zero = np.zeros_like(like.x[:1])
    return Jet(zero, zero, zero)


def constant_like(values: Lanes) -> Jet:
    """Return numbers as jets without derivatives."""
    zero = np.zeros_like(values)
    return Jet(values, zero, zero)
