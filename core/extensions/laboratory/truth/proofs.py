"""Proof of the truth: a share of its samples is proved to lie near exactly one solution of the
engine's equations.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from ...proofs.ball_executor import flint, precision
from ...proofs.proofs import PoseState, prove_pose
from .motion import Solved, Truth
from .rows import Real, Rows, extended, unit

BITS = 160


def distance_from_proof(truth: Truth, sample: int) -> float:
    """Return the largest error of the truth from the proved solution, over the round-off bound.

    Raises:
        UnprovedError: there is no proof, because the pose is singular.
        KincheckError: python-flint is not installed, or the engine's rows cannot be selected.
    """
    samples, part = next(each for each in truth.parts if sample in each[0])
    at, system = part.at(np.flatnonzero(samples == sample)), truth.system
    mechanism, rows = system.mechanism, system.rows
    points = [p for p in system.case.points if rows.index(mechanism.point(p).body)]
    drives = system.sampled(np.array([sample]))[:, :, 0]
    exact = {
        name: [_exact(x) for x in drives[:, system.names.index(name)]]
        for name in system.path.motions
    }
    state = _state(rows, at, PoseState.of(mechanism))
    found = prove_pose(mechanism, points, state, exact, BITS)
    worst = 0.0
    with precision(BITS):
        for name in points:
            mine = truth.points[name][0, sample] - extended(mechanism.point(name).position)
            for ball, x in zip(found.points[name][0], map(_exact, mine), strict=True):
                off = ball - flint().arb(flint().fmpq(x.numerator, x.denominator))
                worst = max(worst, float(off.abs_upper()) / float(truth.bounds[name][0, sample]))
    return worst


def _exact(x: Any) -> Fraction:
    """Return an extended number exactly, as the sum of two doubles."""
    high = float(x)
    return Fraction(high) + Fraction(float(x - np.longdouble(high)))


def _state(rows: Rows, at: Solved, state: PoseState) -> Any:
    """Return the scalars of the configuration, as in the proof."""
    found: list[Any] = []
    for name in state.names:
        kind, of = name.split(" ", 1)
        if kind == "x":
            found.append(_coordinate(rows, at, of, state.unit))
        elif kind == "q":
            found += [*at.poses.q[rows.index(of), :, 0]]
        else:
            origin = extended([*state.origins[of]]) * state.unit
            found += [*(_shift(rows, at, of, origin) * (rows.unit / state.unit))]
    return np.array(found, dtype=np.float64)


def _shift(rows: Rows, at: Solved, body: str, position: Any) -> Real:
    """Return the displacement of a body's point [units]."""
    k = rows.index(body)
    return (at.poses.u[k] + at.poses.swing(k, rows.arm(k, position)))[:, 0]


def _coordinate(rows: Rows, at: Solved, name: str, metres: float) -> Any:
    """Return a joint's turn [rad] or displacement [units]."""
    joint, freedom = name.rsplit(".", 1)
    if freedom == "rotation":
        return at.angles[rows.turning.index(joint), 0]
    # from the joint's point on the first body to its point on the second, along the axis of the
    # first
    axial: Any = rows.mechanism.joint(joint)
    first, second = (_shift(rows, at, body, axial.point) for body in axial.bodies)
    h = unit(axial.axis)
    axis = h + at.poses.swing(rows.index(axial.i), h)[:, 0]
    return (second - first) @ axis * rows.unit / metres
