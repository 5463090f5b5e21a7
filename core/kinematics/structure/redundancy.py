"""Redundant rows: independent ones among them, chosen to stay independent along a sweep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...joints import (
    Joint,
)
from ...mechanism.mechanism import Mechanism
from ...primitives.base import GROUND_POSE
from ...trajectory import Array, BodyMotion
from ..formulation.cartesian import Cartesian
from ..formulation.constraints import frames
from ..formulation.formulation import Condition
from ..formulation.state_vectors import displaced

# Rows are of size one. At a feasible pose a redundant row leaves round-off (1e-15); the smallest
# independent remainder in sound linkages is near 1e-2. Values between belong to nearly singular
# geometry, which is solved and not reduced.
RANK_TOLERANCE = 1e-9
SHARE = 1e-6
"""Smallest weight of a row in a vanishing sum, squares adding to one: round-off is 1e-15."""
# Values from 0.1 to 0.3 leave out the same rows of 113 pairs of four-bars; 0.5 splits one of the
# ground's hinges, 1 splits most.
LARGE = 0.3
"""Rows with this fraction of the largest weight are candidates like the row with the largest."""
DIGITS = 9
"""Decimals in a comparison of weights: ties within round-off are ties on every processor, and the
first one is chosen.
"""
# Work and memory grow with the square of the portion. Mechanisms have fewer conditions; malformed
# files have thousands.
PORTION = 2
"""Conditions in one portion, for every unknown."""


def independent_rows(matrix: Array, last: int, conditions: Sequence[Condition] = ()) -> list[int]:
    """Return the indices of a largest independent set of rows, the last rows taken first.

    Args:
        last: number of rows at the end that are taken first.
        conditions: geometric conditions of the rows. Without them the choice is good at the pose of
            the matrix only, not along a sweep.
    """
    left, taken = matrix.copy(), list[int]()
    enough = RANK_TOLERANCE * (float(np.abs(left).max(initial=0.0)) or 1.0)
    for row in range(len(matrix) - last, len(matrix)):
        if (size := float(np.linalg.norm(left[row : row + 1]))) > enough:
            taken.append(row)
            left = without(left, left[row : row + 1] / size)
    all_rows = sorted(conditions, key=lambda each: each.remote) or [
        Condition([k]) for k in range(len(matrix))
    ]
    others = [each for each in all_rows if not {*each.rows} & {*taken}]
    kept, portion = list[Condition](), PORTION * max(1, matrix.shape[1])
    for k in range(0, len(others), portion):
        kept = _independent(left, kept + others[k : k + portion], enough)
    return sorted([*taken, *(k for each in kept for k in each.rows)])


def independent_joint_rows(formulation: Cartesian, matrix: Array) -> list[int]:
    """Return the indices of a largest independent set of joint rows, a formulation's first rows."""
    return independent_rows(
        matrix, 0, [each for each in formulation.conditions if each.rows[-1] < len(matrix)]
    )


def _independent(matrix: Array, conditions: Sequence[Condition], enough: float) -> list[Condition]:
    """Return the conditions without their redundant rows."""
    rows = [k for each in conditions for k in each.rows]
    u, sizes, _ = np.linalg.svd(matrix[rows])
    out = _left_out(dict(zip(rows, u[:, int((sizes > enough).sum()) :], strict=True)), conditions)
    kept = [
        Condition([k for k in each.rows if k not in out], each.remote, each.steady)
        for each in conditions
    ]
    return [each for each in kept if each.rows]


def _left_out(weights: Mapping[int, Array], conditions: Sequence[Condition]) -> set[int]:
    """Return the rows to leave out, one for each vanishing sum of rows, by their weights in the
    sums.

    Rows with larger weights leave better conditioned rows. Preferred among large weights are:

    - a whole condition, or a row that does not turn with the bodies: if two hinges keep the same
      axis parallel, one row left of each would agree or not as the hinges turn;
    - then the rows farthest from the ground: the joint that closes a loop, not one that carries
      other loops, whose rows would merge these loops into one system.
    """
    found, left = set[int](), np.array([*weights.values()])
    place = {row: k for k, row in enumerate(weights)}
    while len(found) < left.shape[1]:
        sizes, candidates = np.linalg.norm(left, axis=1), list[_Candidate]()
        for each in conditions:
            at = [place[row] for row in each.rows]
            part = float(sizes[at[0]]) if len(at) == 1 else _least(left[at])
            if part > SHARE:
                candidates.append(_Candidate(True, each.remote, True, round(part, DIGITS), at))
            else:
                candidates += [
                    _Candidate(each.steady, each.remote, False, round(float(sizes[k]), DIGITS), [k])
                    for k in at
                ]
        large = LARGE * max(each.part for each in candidates)
        chosen = max(
            (each for each in candidates if each.part >= large), key=lambda each: each[:-1]
        ).at
        found.update(chosen)
        left = without(left, np.linalg.qr(left[chosen].T)[0].T)
    rows = [*weights]
    return {rows[k] for k in found}


class _Candidate(NamedTuple):
    """Rows that may be left out; the largest candidate is."""

    sound: bool
    remote: int
    whole: bool
    part: float
    at: list[int]


def _least(weights: Array) -> float:
    """Return the smallest singular value of the rows' weights, zero for more rows than sums."""
    return (
        float(np.linalg.svd(weights, compute_uv=False)[-1])
        if len(weights) <= weights.shape[1]
        else 0.0
    )


def without(left: Array, basis: Array) -> Array:
    """Return rows less their components along orthonormal ones.

    The first projection leaves round-off, so it is repeated.
    """
    for _ in range(2):
        left = left - (left @ basis.T) @ basis
    return left


def largest_residual(
    mechanism: Mechanism, joints: Sequence[Joint], bodies: Mapping[str, BodyMotion]
) -> float:
    """Return the largest residual of joints over poses of the moving bodies [m].

    Angles count at an arm of the mechanism's size.
    """
    frame = frames(mechanism)
    poses = displaced(mechanism, frame, {name: (each.r, each.p) for name, each in bodies.items()})
    found = 0.0
    for joint in joints:
        scaled, i, j = frame.attach(joint)
        pair = [poses.get(body, GROUND_POSE) for body in joint.bodies]
        for each in scaled.primitives(i, j):
            found = max(found, *(float(np.max(np.abs(x), initial=0.0)) for x in each.phi(*pair)))
    return frame.unit * found
