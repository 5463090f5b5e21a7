"""Proving the truth itself: a share of its samples is shown to lie near exactly one solution of the
engine's equations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from ....algebra import Vec3
from ....kinematics import Cartesian
from ....kinematics.continuation.row_exchange import chosen_at
from ....kinematics.formulation.constraints import frames
from ....kinematics.structure.degrees_of_freedom import select_rows
from ....kinematics.verified.exact import as_double, equations, exact_mechanism
from ....kinematics.verified.krawczyk import enclose
from ....program.ball_executor import flint, precision
from ....trajectory import Array
from .long_double import Real, extended, unit
from .reference_motion import Truth
from .solutions import Solved

BITS = 160


def distance_from_proof(truth: Truth, sample: int) -> float:
    """How far the truth is from the proved solution near it, over what is round-off of an engine.

    Raises:
        UnprovedError: there is no proof: the pose is singular.
        KincheckError: python-flint is not installed, or the engine's rows cannot be selected.
    """
    part, k = next(
        (p, int(np.flatnonzero(at == sample)[0])) for at, p in truth.parts if sample in at
    )
    at, system = part.at(k), truth.system
    mechanism, points = system.mechanism, system.case.points
    path = system.path
    drives = system.sampled(np.array([sample]))[:, :, 0]
    frame = frames(mechanism)
    still = Cartesian.of(mechanism, frame)
    pose = _state(truth, at, [*still.design], frame.unit, frame.origins)
    change = {name: float(drives[0, system.names.index(name)]) for name in path.motions}
    kept = chosen_at(mechanism, change, pose, select_rows(mechanism, frame, still).chosen)
    with precision(BITS):
        traced = equations(exact_mechanism(mechanism, as_double), tuple(path.motions), points, kept)
        driven = [
            [
                flint().arb(_exact(x))
                / (1.0 if mechanism.driver(name).turns else traced.frame.unit)
                for x in drives[:, system.names.index(name)]
            ]
            for name in path.motions
        ]
        found = enclose(traced, points, pose, driven, BITS)
        worst = 0.0
        for name in points:
            mine = truth.points[name][0][sample] - extended(mechanism.point(name).position)
            for ball, x in zip(found.points[name][0], mine, strict=True):
                off = float((ball - flint().arb(_exact(x))).abs_upper())
                worst = max(worst, off / float(truth.bounds[name][0, sample]))
    return worst


def _exact(x: Any) -> Any:
    """An extended number, exactly: as two doubles."""
    high = float(x)
    exact = Fraction(high) + Fraction(float(x - np.longdouble(high)))
    return flint().fmpq(exact.numerator, exact.denominator)


def _state(
    truth: Truth, at: Solved, names: Sequence[str], metres: float, origins: Mapping[str, Vec3]
) -> Array:
    """The scalars that fix the configuration, as the proof has them."""
    stated = truth.system.rows.stated
    found: list[float] = []
    for name in names:
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
    """A joint's turn [rad] or displacement [units]."""
    joint, freedom = name.rsplit(".", 1)
    stated = truth.system.rows.stated
    if freedom == "rotation":
        return float(at.angles[stated.turning.index(joint), 0])
    # the way from the joint's point on the first body to that on the second, along the axis of the
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
