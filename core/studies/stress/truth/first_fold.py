"""The first fold of a motion, found on its curve by arc length, which passes folds.

The study places samples relative to the fold. The truth that judges them does not use it.
"""

from __future__ import annotations

import numpy as np

from ....case.case import Case
from ....trajectory import Array
from .evaluation import Poses
from .long_double import Real, extended
from .newton_kantorovich import System

Spot = tuple[Poses, float, Real]
"""A pose on the curve, its time [s], and the angles of the turns there [rad]."""
# Step of the unknowns [units, rad]. Secants on the rate of time find a fold within a step.
STEP, SECANTS = 0.05, 4
MOST_STEPS, CORRECTIONS, CLOSED = 400, 6, 1e-9


def turning(case: Case, stop: float) -> float | None:
    """Return the time of the first fold between the design and a given time [s]; None without a
    fold.
    """
    system = System(case)
    turns = len(system.rows.stated.turns)
    at: Spot = Poses.design(system.rows.bodies, 1), 0.0, extended(np.zeros((turns, 1)))
    way = _tangent(system, at, None) * np.sign(stop)
    for _ in range(MOST_STEPS):
        new = _next(system, at, way, STEP)
        if new is None or abs(new[1]) > abs(stop):
            return None
        ahead = _tangent(system, new, way)
        if ahead[-1] * way[-1] < 0.0:
            return _fold(system, at, way, ahead)
        at, way = new, ahead
    return None


def _fold(system: System, at: Spot, way: Array, ahead: Array) -> float | None:
    """Return the time of the fold on the curve, between a pose and a step ahead of it [s].

    The derivative of time along the curve is zero at a fold.

    Args:
        way, ahead: tangents at both ends of the step.
    """
    (low, high), (before, after) = (0.0, STEP), (float(way[-1]), float(ahead[-1]))
    time = None
    for _ in range(SECANTS):
        middle = low + (high - low) * before / (before - after)
        found = _next(system, at, way, middle)
        if found is None:
            break
        time, rate = found[1], float(_tangent(system, found, way)[-1])
        if rate * before > 0.0:
            low, before = middle, rate
        else:
            high, after = middle, rate
    return time


def _slopes(system: System, at: Spot) -> Array:
    """Return the derivative of the rows by unknowns and time, shape (rows, unknowns + 1)."""
    rates = system.drives(np.array([at[1]]))[1, :, 0]
    by_time = np.zeros((system.rows.stated.rows, 1))
    for (row, size), rate in zip(system.rows.stated.driven, rates, strict=True):
        by_time[row] = -float(size) * float(rate)
    return np.hstack([system.rows.jacobian(at[0])[0], by_time])


def _tangent(system: System, at: Spot, before: Array | None) -> Array:
    """Return the unit tangent of the curve, in the direction of the previous tangent or, without
    one, of growing time.
    """
    found = np.linalg.svd(_slopes(system, at))[2][-1]
    return found * np.sign(found[-1] if before is None else found @ before)


def _next(system: System, at: Spot, way: Array, length: float) -> Spot | None:
    """Return the pose on the curve at a distance along a tangent; None if none is found."""
    step, (poses, time, near) = length * way, at
    for _ in range(CORRECTIONS):
        poses, time = poses.moved(extended(step[:-1]).reshape(-1, 6, 1)), time + float(step[-1])
        angles = system.rows.angles(poses)
        near = angles + 2.0 * np.pi * np.rint((near - angles) / (2.0 * np.pi))
        found = (poses, time, near)
        drives = system.drives(np.array([time]))[0]
        open_by = system.rows.residual(poses, drives, near)[:, 0].astype(np.float64)
        if np.abs(open_by).max() <= CLOSED:
            return found
        square = np.vstack([_slopes(system, found), way])
        step = np.linalg.lstsq(square, np.append(-open_by, 0.0), rcond=None)[0]
    return None
