"""Proof of the truth: a share of its samples is proved to lie near exactly one solution of the
engine's equations.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from ....kinematics import PoseState, prove_pose
from ....program.ball_executor import flint, precision
from ....trajectory import Array
from .long_double import Real, extended, unit
from .reference_motion import Truth
from .solutions import Solved

BITS = 160


def distance_from_proof(truth: Truth, sample: int) -> float:
    """Return the largest error of the truth from the proved solution, over the round-off bound.

    Raises:
        UnprovedError: there is no proof, because the pose is singular.
        KincheckError: python-flint is not installed, or the engine's rows cannot be selected.
    """
    part, k = next(
        (p, int(np.flatnonzero(at == sample)[0])) for at, p in truth.parts if sample in at
    )
    at, system = part.at(k), truth.system
    mechanism = system.mechanism
    points = [p for p in system.case.points if not mechanism.is_fixed(mechanism.point(p).body)]
    path = system.path
    drives = system.sampled(np.array([sample]))[:, :, 0]
    pose = _state(truth, at, PoseState.of(mechanism))
    exact = {
        name: [_exact(x) for x in drives[:, system.names.index(name)]] for name in path.motions
    }
    found = prove_pose(mechanism, points, pose, exact, BITS)
    worst = 0.0
    with precision(BITS):
        for name in points:
            mine = truth.points[name][0][sample] - extended(mechanism.point(name).position)
            for ball, x in zip(found.points[name][0], map(_exact, mine), strict=True):
                off = ball - flint().arb(flint().fmpq(x.numerator, x.denominator))
                worst = max(worst, float(off.abs_upper()) / float(truth.bounds[name][0, sample]))
    return worst


def _exact(x: Any) -> Fraction:
    """Return an extended number exactly, as the sum of two doubles."""
    high = float(x)
    return Fraction(high) + Fraction(float(x - np.longdouble(high)))


def _state(truth: Truth, at: Solved, state: PoseState) -> Array:
    """Return the scalars of the configuration, as in the proof."""
    stated, metres, origins = truth.system.rows.stated, state.unit, state.origins
    found: list[float] = []
    for name in state.names:
        kind, of = name.split(" ", 1)
        if kind == "x":
            found.append(_coordinate(truth, at, of, metres))
            continue
        body = stated.bodies.index(of) + 1
        if kind == "q":
            found += [float(x) for x in at.poses.q[body, :, 0]]
            continue
        origin = extended([*origins[of]]) * metres
        lever = (origin - stated.origin) / stated.unit - stated.centres[body - 1]
        shift = at.poses.u[body, :, 0] + at.poses.turned[body, :, :, 0] @ lever
        found += [float(x) for x in shift * (stated.unit / metres)]
    return np.array(found)


def _coordinate(truth: Truth, at: Solved, name: str, metres: float) -> float:
    """Return a joint's turn [rad] or displacement [units]."""
    joint, freedom = name.rsplit(".", 1)
    stated = truth.system.rows.stated
    if freedom == "rotation":
        return float(at.angles[stated.turning.index(joint), 0])
    # from the joint's point on the first body to its point on the second, along the axis of the
    # first
    axial: Any = truth.system.mechanism.joint(joint)
    place = (extended(axial.point) - stated.origin) / stated.unit
    moved: list[Real] = []
    h = unit(extended(axial.axis))
    for body in axial.bodies[::-1]:
        k = 0 if truth.system.mechanism.is_fixed(body) else stated.bodies.index(body) + 1
        turned = at.poses.turned[k, :, :, 0]
        moved.append(
            at.poses.u[k, :, 0] + turned @ (place - stated.centres[k - 1]) if k else 0.0 * h
        )
        h = h + turned @ h if body == axial.i else h
    return float((moved[0] - moved[1]) @ h) * stated.unit / metres
