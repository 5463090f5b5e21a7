"""Random dimensions of planar linkages: the points B, C and D of four-bars and slider-cranks."""

from __future__ import annotations

import numpy as np

from ....trajectory import Array
from ...truth.rows import extended
from .base import Rng, power
from .planar import Plan, meet


def nearly_parallel(rng: Rng) -> tuple[Plan, Plan, Plan, float]:
    """Return B, D and C of a parallelogram, and its error; it folds flat twice a turn."""
    off = 0.0 if rng.random() < 0.25 else power(rng, -12.0, -2.0) * float(rng.choice([-1.0, 1.0]))
    crank, up = float(rng.uniform(0.2, 0.5)), float(rng.uniform(0.8, 2.2))
    b: Plan = (crank * float(np.cos(up)), crank * float(np.sin(up)))
    # The crank is the shortest bar, and the coupler is as long as the ground. By Grashof the crank
    # turns if the rocker is longer than the crank.
    c: Plan = (b[0] + 1.0, b[1])
    if off:
        met = meet(
            extended(b)[:, None],
            extended([1.0]),
            extended([[1.0], [0.0]]),
            extended([(crank + off) ** 2]),
            1.0,
        )
        c = (float(met[0, 0]), float(met[1, 0]))
    return b, (1.0, 0.0), c, off


def nearly_kite(rng: Rng) -> tuple[Plan, Plan, Plan, float]:
    """Return B, D and C of a kite, and its error. The crank is as long as the ground, except for
    the error, and passes the rocker's pivot.
    """
    off, up = power(rng, -9.0, -2.0), float(rng.uniform(0.8, 2.2))
    crank, long = 0.4 * (1.0 - off), float(rng.uniform(0.8, 1.2))
    b: Plan = (crank * float(np.cos(up)), crank * float(np.sin(up)))
    d: Plan = (0.4, 0.0)
    middle, half = (np.add(b, d)) / 2.0, np.subtract(d, b) / 2.0
    away = np.array([-half[1], half[0]]) / np.hypot(*half) * np.sqrt(long**2 - half @ half)
    return b, d, (float(middle[0] + away[0]), float(middle[1] + away[1])), off


def rockers(rng: Rng) -> tuple[Plan, Plan, Plan]:
    """Return B, D and C of a four-bar whose longest bar is between the pivots: neither the crank
    nor the rocker turns fully.
    """
    b = (float(rng.uniform(-0.2, 0.2)), float(rng.uniform(0.4, 0.6)))
    d: Plan = (float(rng.uniform(1.0, 1.1)), 0.0)
    return b, d, (float(rng.uniform(0.5, 0.8)), float(rng.uniform(0.5, 0.7)))


def crank_rocker(rng: Rng, scale: float = 1.0, grid: float = 0.0) -> tuple[Plan, Plan, Plan]:
    """Return B, D and C of a four-bar far from its change points, whose crank turns fully.

    The points lie on a grid, unless the grid is zero.
    """
    while True:
        turn, high = rng.uniform(0.0, 2.0 * np.pi), rng.choice([-1.0, 1.0])
        crank, ground = rng.uniform(0.15, 0.4), rng.uniform(0.8, 1.2)
        points = np.array(
            [
                [crank * np.cos(turn), crank * np.sin(turn)],
                [ground, 0.0],
                [rng.uniform(0.2, 1.0), 0.0],
            ]
        )
        points[2, 1] = high * rng.uniform(0.5, 1.0)
        points = scale * (np.round(points / grid) * grid if grid else points)
        b, d, c = points
        bars = sorted([np.hypot(*b), np.hypot(*d), np.hypot(*(c - b)), np.hypot(*(d - c))])
        if bars[0] == np.hypot(*b) and bars[0] + bars[3] < 0.95 * (bars[1] + bars[2]):
            return _plan(b), _plan(d), _plan(c)


def turning_crank(rng: Rng, grid: float = 0.0) -> tuple[Plan, Plan]:
    """Return B and C of a slider-crank whose crank turns fully. The guide along the first axis may
    miss the pivot.
    """
    turn, crank, offset = (
        rng.uniform(0.0, 2.0 * np.pi),
        rng.uniform(0.15, 0.4),
        rng.uniform(-0.2, 0.2),
    )
    points = np.array(
        [[crank * np.cos(turn), crank * np.sin(turn)], [rng.uniform(1.0, 1.3), offset]]
    )
    b, c = np.round(points / grid) * grid if grid else points
    return _plan(b), _plan(c)


def _plan(x: Array) -> Plan:
    return float(x[0]), float(x[1])
