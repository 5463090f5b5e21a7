"""Acceptance criteria of a pose: same motion as its neighbour, residuals that bound its error.

The margins of the criteria are tests over floats, lanes or traced scalars. A margin is positive if
the pose meets its criterion. Every walk along a motion uses this list: the compiled programs trace
it, sparse systems evaluate it for arrays of poses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from ...algebra import Scalar
from ...program import absolute, maximum, minimum, where_larger
from ...trajectory import Array

# Along one motion the trapezoidal rule predicts the change between neighbours; on a sinusoid
# sampled every 70 degrees its error is 13 %. A step with an error above a quarter is halved and
# solved again, so a coarse grid costs steps, not samples.
LARGEST_DEVIATION = 0.25
# Newton's correction of a predicted pose is of third order: on a sinusoid a tenth of the step at
# steps of 45 degrees. With a limit of a quarter, a loop of four bodies converged beyond its limit
# of travel, in another assembly.
LARGEST_CORRECTION = 0.1
# Changes below this fraction of the mechanism's size are not another assembly: a followed pose is
# not known more accurately (FOLLOWED).
NEGLIGIBLE = 1e-8
# A longer step, in Euler parameters (half of it: one radian), joint angles [rad] or fractions of
# the mechanism's size, does not determine the motion between its ends: a whole turn ends at its
# start, on any assembly.
LONGEST_STEP = 0.5
# If the whole mechanism rests at two samples, its state does not show whole turns of a driver
# between them, and the driver's row cannot tell two turns from none. A driver that turns by more in
# one step [rad] has its step divided.
LONGEST_TURN = 2.0
# Nor is the motion determined over a step in which sigma changes by more than this factor or a
# determinant changes its sign: near a singular pose rates change as fast. Steps towards one shrink,
# and none crosses it. An exchange of rows makes the estimate of sigma jump, by up to 3.6 times over
# the case library.
LARGEST_RATIO = 16.0
# Nor over a step in which sigma could have been zero. The assumed slope of sigma by the change of
# the pose [Euler parameters, fractions of the mechanism's size] is at most the first factor times
# the observed slope. The observed slope decays by the second factor a step, and the assumed one
# never exceeds the third: the angle between two bodies changes by up to four times the change of
# their Euler parameters. The test runs on each block of the rows, because the sigma of a small loop
# hides that of a large one beside it (8 of 2,500 sweeps). The sign of a determinant does not show a
# gap behind which the motion seems to continue; with redundant rows it also changes with the choice
# of rows, and two changes within a step cancel. Of 600 coarse sweeps of kites with redundant rows
# off by less than 1e-4, 79 ended on the other assembly without this test, 4 with a slope that
# decays at once, and none of 4,600 with these values. The third factor alone divides the steps of a
# screw so fine that sigma is 0.002 everywhere into thousands of parts. (A comparison of the frames
# of all rows of two poses, as one sign of a determinant, leaves 0.5 %: both may turn over within a
# step.)
STEEPER, FALLS, STEEPEST = 4.0, 0.5, 4.0
# The same criterion for whole Jacobians, as a simulator returns them: over a step J may change by
# this fraction of itself. At one, J may be singular on the straight line between both. A half
# leaves the same margin for the deviation of J from that line.
LARGEST_CHANGE = 0.5
# Bounds of that eigenvalue before it is computed: a platform of 91 unknowns needs two at most.
ROUNDS = 4
# Residuals are accepted up to a tolerance, and the mechanism may amplify them by this factor: the
# 1e-12 of `kincheck run` becomes the 1e-9 m required of outputs.
AMPLIFIED = 1e3
# The estimate of sigma (`Elimination.sigma`) is 0.16 to 4 times sigma over the case library: a
# bound by sigma exceeds a bound by the estimate by up to this factor.
WORSE = 10.0
# With redundant rows, others are tried if a step fails and sigma is below this fraction of its
# largest value so far; if none are better, again at this fraction of the present value.
LOW = 0.1
# Factor on the errors allowed where another choice of rows might avoid them.
SHARPER = 1e-2
EPSILON = float(np.finfo(np.float64).eps)
# A row's own rounding leaves residuals up to this: some tens of products and sums of size one.
ROUNDING = 64.0 * EPSILON
# Towards a singular pose a motion is followed while rounding leaves its rates uncertain by less
# than the first fraction, estimated from sigma: nearer, the motion has no clear direction and may
# continue on another motion that crosses there. Away from a singular pose the second fraction is
# required, because rounding may already have turned the motion. The other motion is about sigma
# away, so rounding moves a pose by a ten-thousandth of that distance, or by a six-hundredth if the
# estimate is four times too large.
FOLLOWED, TURNED = 1e-2, 1e-3


def is_uncertain(
    sigma: float | Array, closure: float | Array, tol: float, order: int = 1
) -> bool | NDArray[np.bool_]:
    """Return whether residuals and estimates of sigma allow too large an error at each sample.

    The error of rates is that of the pose over sigma once more. A known sigma gets the same margin:
    without it accelerations two thousandths of a radian from a singular pose had errors of 1e-8; a
    close solution has 1e-10.

    Args:
        order: 2 for accelerations, whose error is that of rates over sigma once more.
    """
    limit = AMPLIFIED * tol * sigma ** (1 + order)
    return (WORSE * closure > limit) | (limit < WORSE * EPSILON)


def needs_check(
    sigma: float | Array, closure: float | Array, tol: float, largest: float | None
) -> bool | NDArray[np.bool_]:
    """Return whether each sample is doubtful, or may be more accurate with other rows.

    Amplification of rounding by the mechanism itself is unavoidable, but a poor choice of rows is
    not: redundant rows have to meet a sharper limit.

    Args:
        largest: largest estimate of sigma along the motion; None without redundant rows.
    """
    found = is_uncertain(sigma, closure, tol)
    if largest is None:
        return found
    return found | (is_uncertain(sigma, closure, SHARPER * tol, order=2) & (sigma < LOW * largest))


def continuous(
    change: Array, velocity: Array, velocity_before: Array, dt: float | Array, size: float
) -> NDArray[np.bool_]:
    """Return whether changes between neighbouring samples agree with their velocities (Hermite).

    Args:
        change: coordinates now less coordinates before [m], shape (..., k).
        velocity, velocity_before: their rates at both samples, same shape.
        dt: time between the samples, broadcast against the leading axes.
        size: characteristic length of the mechanism [m].

    Returns:
        One truth value for each step; false where anything is not finite.
    """
    step = np.abs(np.asarray(dt))
    half = 0.5 * np.asarray(dt)[..., None]
    deviation = np.abs(change - half * (velocity + velocity_before)).max(axis=-1)
    speed = np.abs(velocity).max(axis=-1) + np.abs(velocity_before).max(axis=-1)
    return deviation <= LARGEST_DEVIATION * 0.5 * step * speed + NEGLIGIBLE * size


def is_continuation(
    change: Array, velocity: Array, velocity_before: Array, dt: float | Array
) -> bool:
    """Return whether a step of all coordinates is short and agrees with their velocities.

    Near a fold the rates are so large that they allow any deviation, so the deviation is compared
    with the step itself.

    Args:
        change: all coordinates now less coordinates before, shape (k,) [rad, mechanism's size].
        velocity, velocity_before: their rates at both poses, same shape.
        dt: time between the poses [s].
    """
    moved = float(np.abs(change).max(initial=0.0))
    gap = float(np.abs(change - 0.5 * dt * (velocity + velocity_before)).max(initial=0.0))
    return moved <= LONGEST_STEP and gap <= LARGEST_CORRECTION * moved + NEGLIGIBLE


def regular_between(ratio: Array) -> bool:
    """Return whether a Jacobian stays regular between two poses (see LARGEST_CHANGE).

    Let C = J_before^-1 J - I. The Jacobian is regular on the straight line from J_before to J if
    some norm of C is below one. The smallest norm over all units of the unknowns is the largest
    eigenvalue of |C| (Perron and Frobenius). With this norm neither the units nor the weights of
    the rows matter, and each block of the rows is judged by itself.

    Args:
        ratio: J_before^-1 J, or the least-squares solution with redundant rows.
    """
    change = np.abs(ratio - np.eye(len(ratio)))
    if not change.max() < 1.0 / EPSILON:  # singular where it begins, or not finite
        return False
    if np.linalg.norm(change) <= LARGEST_CHANGE:  # never smaller than that eigenvalue, and cheap
        return True
    y = change.sum(axis=1)
    for _ in range(ROUNDS):  # each bounds it too (Collatz and Wielandt), and more closely
        y, before = change @ y, y
        if (y <= LARGEST_CHANGE * before).all():
            return True
    return bool(np.abs(np.linalg.eigvals(change)).max() <= LARGEST_CHANGE)


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
        **(
            {"not turned round": reduce(minimum, map(_turn_margin, pose.turns))}
            if pose.turns
            else {}
        ),
        "as regular": reduce(minimum, map(_as_regular, pose.blocks)) + crossing,
        "on this side": 0.5 - absolute(pose.reversal) + crossing,
        "regular between": (
            reduce(minimum, (_zero_margin(block, pose.moved) for block in pose.blocks)) + crossing
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


def _turn_margin(turn: Scalar) -> Scalar:
    """Positive if a driver has turned too little to lose a whole turn."""
    return LONGEST_TURN - absolute(turn)


def _as_regular(block: Block) -> Scalar:
    """Positive if neither sigma is too many times the other."""
    return (LARGEST_RATIO * block.sigma - block.before) * (
        LARGEST_RATIO * block.before - block.sigma
    )


def _zero_margin(block: Block, moved: Scalar) -> Scalar:
    """Positive if sigma cannot have been zero during the step."""
    return block.sigma + block.before - minimum(STEEPER * block.slope, STEEPEST) * moved
