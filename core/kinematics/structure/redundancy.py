"""Which rows to solve, where some say what others say: as many as are independent, chosen so that
they stay so along a sweep.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...trajectory import Array
from ..formulation.formulation import Condition, Formulation

# Rows are of size one. At a feasible pose a redundant row is left with round-off (1e-15); the
# smallest independent remainder in sound linkages is near 1e-2. In between lies nearly singular
# geometry, which is to be solved, not reduced.
RANK_TOLERANCE = 1e-9
SHARE = 1e-6
"""A row takes part in a sum that vanishes with at least this weight, the weights' squares adding up
to one: round-off is 1e-15.
"""
# Anything from 0.1 to 0.3 leaves out the same rows of 113 pairs of four-bars; 0.5 takes one of the
# ground's hinges apart, 1 most.
LARGE = 0.3
"""Rows with this part of the largest weight can be left out as well as those that have it."""
DIGITS = 9
"""Decimals to which parts are compared: what is equal but for round-off is so on every processor,
and the first is chosen.
"""
# Work and memory grow with the square of what is looked at together. Mechanisms have less,
# senseless files have thousands.
PORTION = 2
"""Conditions that are looked at together, for every unknown."""


def independent_rows(matrix: Array, last: int, conditions: Sequence[Condition] = ()) -> list[int]:
    """Indices of a largest independent set of rows, the given number of last rows taken first.

    Args:
        conditions: what the rows belong to; without, what is chosen is good where the matrix is
            taken, and not along a sweep.
    """
    left, taken = np.array(matrix), list[int]()
    enough = RANK_TOLERANCE * (float(np.abs(left).max(initial=0.0)) or 1.0)
    for row in range(len(matrix) - last, len(matrix)):
        if (size := float(np.linalg.norm(left[row]))) > enough:
            taken.append(row)
            left = _without(left, left[row : row + 1] / size)
    all_rows = sorted(conditions, key=lambda each: each.remote) or [
        Condition([k]) for k in range(len(matrix))
    ]
    others = [each for each in all_rows if not {*each.rows} & {*taken}]
    kept, portion = list[Condition](), PORTION * max(1, matrix.shape[1])
    for k in range(0, len(others), portion):
        kept = _independent(left, kept + others[k : k + portion], enough)
    return sorted([*taken, *(k for each in kept for k in each.rows)])


def independent_joint_rows(formulation: Formulation, matrix: Array) -> list[int]:
    """Indices of a largest independent set of the first rows of a formulation, which are those of
    joints.
    """
    return independent_rows(
        matrix, 0, [each for each in formulation.conditions if each.rows[-1] < len(matrix)]
    )


def _independent(matrix: Array, conditions: Sequence[Condition], enough: float) -> list[Condition]:
    """The conditions without the rows that are left out."""
    rows = [k for each in conditions for k in each.rows]
    u, sizes, _ = np.linalg.svd(matrix[rows])
    out = _left_out(dict(zip(rows, u[:, int((sizes > enough).sum()) :], strict=True)), conditions)
    kept = [
        Condition([k for k in each.rows if k not in out], each.remote, each.steady)
        for each in conditions
    ]
    return [each for each in kept if each.rows]


def _left_out(weights: Mapping[int, Array], conditions: Sequence[Condition]) -> set[int]:
    """As many rows as there are sums of rows that vanish, by the rows' weights in those.

    The larger its weights the better conditioned are the other rows. Of those with large weights
    - a condition is left out as a whole, or a row that does not turn with the bodies: of two hinges
      that keep the same axis parallel one row each would agree or not as the hinges turn;
    - and farthest from the ground: of the joint that closes a loop, not of one that other loops
      hang on, as the rows of these would tie them into one system.
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
        left = _without(left, np.linalg.qr(left[chosen].T)[0].T)
    rows = [*weights]
    return {rows[k] for k in found}


class _Candidate(NamedTuple):
    """What may be left out: the largest is."""

    sound: bool
    remote: int
    whole: bool
    part: float
    at: list[int]


def _least(weights: Array) -> float:
    """The least that remains of the rows' weights in any of their sums; zero where they are more
    than the sums that vanish.
    """
    return (
        float(np.linalg.svd(weights, compute_uv=False)[-1])
        if len(weights) <= weights.shape[1]
        else 0.0
    )


def _without(left: Array, basis: Array) -> Array:
    """Rows less their components along orthonormal ones; twice, as the first time leaves
    round-off.
    """
    for _ in range(2):
        left = left - (left @ basis.T) @ basis
    return left
