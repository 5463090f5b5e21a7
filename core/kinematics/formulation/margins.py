"""Margins of the acceptance criteria: the tests of a pose, over floats, lanes or traced scalars.

A margin is positive if the pose meets its criterion. Every walk along a motion uses this list: the
compiled programs trace it, sparse systems evaluate it for arrays of poses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

from ...algebra import Scalar
from ...program import absolute, maximum, minimum, where_larger
from .acceptance_criteria import (
    EPSILON,
    FALLS,
    FOLLOWED,
    LARGEST_CORRECTION,
    LARGEST_RATIO,
    LONGEST_STEP,
    LONGEST_TURN,
    NEGLIGIBLE,
    STEEPER,
    STEEPEST,
    TURNED,
    WORSE,
)


@dataclass(frozen=True, eq=False)
class Block:
    """Singularity of one block of the rows. The sigma of a small block may stay small while the
    larger sigma of another block falls to zero.

    Attributes:
        sigma, before: estimate of the smallest singular value, here and at the previous pose.
        slope: largest known change of sigma by the change of the pose.
    """

    sigma: Scalar
    before: Scalar
    slope: Scalar


@dataclass(frozen=True, eq=False)
class Candidate:
    """A pose to be accepted or not, with the quantities of its tests.

    Attributes:
        done: 1 if Newton's iteration has converged, else 0.
        closure, leftover: largest residual of the solved and of the redundant rows.
        branch: smallest branch test, positive on the branch.
        gap: distance from the predicted pose, less the same distance of the previous pose.
        moved, reach: distance from the previous pose, and from the start of the lanes.
        turns: changes of the angles of turning drivers from the previous pose [rad].
        sigma, before: estimate of the smallest singular value, here and at the previous pose.
        largest: largest estimate so far.
        reversal: zero if the rows have the same orientation as at the previous pose.
        blocks: blocks of the rows.
    """

    done: Scalar
    closure: Scalar
    leftover: Scalar
    branch: Scalar
    gap: Scalar
    moved: Scalar
    reach: Scalar
    turns: Sequence[Scalar]
    sigma: Scalar
    before: Scalar
    largest: Scalar
    reversal: Scalar
    blocks: Sequence[Block]


@dataclass(frozen=True, eq=False)
class Limits:
    """Limits of the acceptance criteria.

    Attributes:
        tol, consistent: largest accepted residual of the solved and of the redundant rows.
        crossing: added to margins of singular poses; zero unless they may be crossed.
    """

    tol: Scalar
    consistent: Scalar
    crossing: Scalar


def margins(pose: Candidate, limits: Limits) -> dict[str, Scalar]:
    """Return the margin of each criterion by its name.

    A pose is accepted if it has converged, closes, agrees with the redundant rows, is on its
    branch, and continues the motion. Distances and sigma decide on the last. No pose far from the
    previous one is accepted, and none beyond a singular pose: from afar, a motion that passes there
    looks like one that turns back.
    """
    sigma, crossing = pose.sigma, limits.crossing
    uncertain = (WORSE * pose.largest) * maximum(pose.closure, EPSILON)
    return {
        "converged": pose.done - 0.5,
        "closed": limits.tol - pose.closure,
        "consistent": limits.consistent - pose.leftover,
        "on the branch": pose.branch,
        "continued": LARGEST_CORRECTION * pose.moved + NEGLIGIBLE - pose.gap,
        "near": LONGEST_STEP - pose.reach,
        **({"not turned round": reduce(minimum, map(_unturned, pose.turns))} if pose.turns else {}),
        "as regular": reduce(minimum, map(_as_regular, pose.blocks)) + crossing,
        "on this side": 0.5 - absolute(pose.reversal) + crossing,
        "regular between": (
            reduce(minimum, (_between(block, pose.moved) for block in pose.blocks)) + crossing
        ),
        "certain": FOLLOWED * sigma * sigma - uncertain,
        "not turned by rounding": maximum(TURNED * sigma * sigma - uncertain, pose.before - sigma),
    }


def known_slope(slope: Scalar) -> Scalar:
    """Return a remembered slope of sigma, or the steepest one if it is zero: unknown."""
    return where_larger(slope, 0.0, slope, STEEPEST)


def slope_between(sigma: Scalar, before: Scalar, moved: Scalar) -> Scalar:
    """Return the observed slope of sigma over a step; zero if the pose has hardly moved."""
    return where_larger(moved, NEGLIGIBLE, absolute(sigma - before) / moved, 0.0)


def least_slope(slope: Scalar) -> Scalar:
    """Return the smallest slope to assume after a known one."""
    return maximum(FALLS * slope, EPSILON)


def _unturned(turn: Scalar) -> Scalar:
    """Positive if a driver has turned too little to lose a whole turn."""
    return LONGEST_TURN - absolute(turn)


def _as_regular(block: Block) -> Scalar:
    """Positive if neither sigma is too many times the other."""
    return (LARGEST_RATIO * block.sigma - block.before) * (
        LARGEST_RATIO * block.before - block.sigma
    )


def _between(block: Block, moved: Scalar) -> Scalar:
    """Positive if sigma cannot have been zero during the step."""
    return block.sigma + block.before - minimum(STEEPER * block.slope, STEEPEST) * moved
