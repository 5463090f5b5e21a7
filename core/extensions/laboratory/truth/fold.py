"""The first fold of a motion, found on its curve by arc length, which passes folds.

The study places samples relative to the fold. The truth that judges them does not use it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....case.case import Case
from ....trajectory import Array
from .motion import System, by_body
from .rows import Poses, Real, nearest_turn

# Step of the unknowns [units, rad]. Secants on the rate of time find a fold within a step.
STEP, SECANTS = 0.05, 4
MOST_STEPS, CORRECTIONS, CLOSED = 400, 6, 1e-9


class _Spot(NamedTuple):
    """A pose on the curve, its time [s], the angles of the turns [rad] and the unit tangent."""

    poses: Poses
    time: float
    angles: Real
    way: Array


def first_fold(case: Case, stop: float) -> float | None:
    """Return the time of the first fold between the design and a given time [s]; None without a
    fold.
    """
    system = System(case)
    ahead = np.zeros(6 * len(system.rows.bodies) + 1)
    ahead[-1] = np.sign(stop)
    poses = Poses.design(len(system.rows.bodies), 1)
    at = _spot(system, poses, 0.0, system.rows.angles(poses), ahead)
    for _ in range(MOST_STEPS):
        new = _next(system, at, STEP)
        if new is None or abs(new.time) > abs(stop):
            return None
        if new.way[-1] * at.way[-1] < 0.0:
            break
        at = new
    else:
        return None
    # the derivative of time along the curve is zero at a fold
    (low, high), (before, after) = (0.0, STEP), (float(at.way[-1]), float(new.way[-1]))
    time = None
    for _ in range(SECANTS):
        middle = low + (high - low) * before / (before - after)
        found = _next(system, at, middle)
        if found is None:
            break
        time, rate = found.time, float(found.way[-1])
        if rate * before > 0.0:
            low, before = middle, rate
        else:
            high, after = middle, rate
    return time


def _spot(system: System, poses: Poses, time: float, angles: Real, before: Array) -> _Spot:
    """Return a spot with its tangent in the direction of the previous one."""
    way = np.linalg.svd(_slopes(system, poses, time, angles))[2][-1]
    return _Spot(poses, time, angles, way * np.sign(way @ before))


def _slopes(system: System, poses: Poses, time: float, near: Real) -> Array:
    """Return the derivative of the rows by unknowns and time, shape (rows, unknowns + 1)."""
    rates = system.drives(np.array([time]))[1, :, 0]
    by_time = np.zeros((len(system.rows.owners), 1))
    for (row, size), rate in zip(system.rows.driven, rates, strict=True):
        by_time[row] = -size * float(rate)
    return np.hstack([system.rows.jacobian(poses, near)[0], by_time])


def _next(system: System, at: _Spot, length: float) -> _Spot | None:
    """Return the spot on the curve at a distance along the tangent; None if none is found."""
    step: Real = length * at.way
    poses, time, near, way = at
    for _ in range(CORRECTIONS):
        poses, time = poses.moved(by_body(step[None, :-1])), time + float(step[-1])
        near = nearest_turn(system.rows.angles(poses), near)
        drives = system.drives(np.array([time]))[0]
        open_by = system.rows.residual(poses, drives, near)[:, 0].astype(np.float64)
        if np.abs(open_by).max() <= CLOSED:
            return _spot(system, poses, time, near, way)
        square = np.vstack([_slopes(system, poses, time, near), way])
        step = np.linalg.lstsq(square, np.append(-open_by, 0.0), rcond=None)[0]
    return None
