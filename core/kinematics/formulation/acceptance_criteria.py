"""May a pose be believed: does it come from the same motion as its neighbour, and are its residuals
all there is to know?
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...trajectory import Array

# Along one motion the trapezoidal rule predicts the change between neighbours; on a sinusoid
# sampled every 70 degrees it is off by 13 %. A step that is off by more than a quarter is divided
# and tried again, so a coarse grid costs steps, not samples.
LARGEST_DEVIATION = 0.25
# Newton corrects a predicted pose by what its prediction lacks, of third order: on a sinusoid by a
# tenth of the way in steps of 45 degrees. At a quarter a loop of four bodies was found beyond the
# limit of its travel, in another assembly.
LARGEST_CORRECTION = 0.1
# Changes below this part of the mechanism's size are not another assembly: where a motion is
# followed poses are known no better (FOLLOWED).
NEGLIGIBLE = 1e-8
# A step from one pose to the next that is longer than this, in Euler parameters (half of it: one
# radian), joint angles [rad] or parts of the mechanism's size, says nothing of what is between: a
# whole turn ends where it began, on whatever assembly.
LONGEST_STEP = 0.5
# Where all stands still at two samples the state says nothing of a driver that made whole turns
# between them, and its row does not know two of them from none: a driver turns by no more than this
# in a step, or it is divided [rad].
LONGEST_TURN = 2.0
# Nor does a step over which sigma changes by more than this factor, or a determinant its sign:
# beside a singular pose rates change as fast. Steps towards it get shorter and shorter, and nothing
# there is stepped over. Where rows are exchanged the estimate of sigma jumps, over the case library
# by up to 3.6 times.
LARGEST_RATIO = 16.0
# Nor one in which sigma could have been zero: it is taken to change, by what the pose does [Euler
# parameters, parts of the mechanism's size], by no more than the first times what it did or does,
# which is forgotten by the second from step to step, and never by more than the third: the angle
# between two bodies changes by up to four times what the Euler parameters of each do. It is asked
# of every block of the rows, for a small loop's sigma hides that of a large one beside it (8 of
# 2,500 sweeps). The sign of a determinant says nothing of a gap behind which the motion seems to go
# on; and where there are more rows than are solved it changes by their choice too, and not where
# both are within a step. Of 600 coarse sweeps of kites with redundant rows that are off by less
# than 1e-4, 79 were found on their other assembly without this, four where all was forgotten at
# once, none of 4,600 so. The third alone gives thousands of parts to a screw so fine that sigma is
# 0.002 everywhere. (Comparing the frames of all rows of two poses, as one sign of a determinant,
# leaves 0.5 %: there both may turn over within a step too.)
STEEPER, FALLS, STEEPEST = 4.0, 0.5, 4.0
# The same question where whole Jacobians are at hand, as a simulator gives them: over a step J may
# change by this part of itself. At one, J may be singular on the straight way between both. A half
# leaves as much again for what J does beside that way.
LARGEST_CHANGE = 0.5
# Residuals are accepted up to a tolerance, and amplified by the mechanism up to this: with the
# 1e-12 of `kincheck run` to the 1e-9 m that outputs are held to.
AMPLIFIED = 1e3
# The estimate of sigma (`Elimination.sigma`) is 0.16 to 4 times as much over the case library: a
# bound by sigma is worse than by the estimate by up to this. Where there are only pivots (sparse
# systems), which are 1.3 to 17 times as much, by more.
WORSE, WORSE_BY_PIVOTS = 10.0, 30.0
# Where there are more rows than are solved, others are looked for where a step fails and sigma is
# below this part of the largest that it has had; if none are better, where it is this part of that.
LOW = 0.1
# So much less is allowed of errors that other rows may not have.
SHARPER = 1e-2
EPSILON = float(np.finfo(np.float64).eps)
# Residuals up to this are of a row's own rounding: some tens of products and sums of size one.
ROUNDING = 64.0 * EPSILON
# A motion is followed towards a singular pose as long as rounding leaves its rates uncertain by
# less than the first part, estimated from sigma: nearer it seems to turn any way, also into another
# motion that crosses it there. Away from one it is followed only where they are surer than the
# second: what turns there may have been turned by rounding. The other motion is about sigma away,
# so that rounding moves a pose by a ten-thousandth of the way there, by a six-hundredth where the
# estimate is four times too large. Of pivots, which may be too large by much more, a parallelogram
# was found on its other motion.
FOLLOWED, TURNED, TURNED_BY_PIVOTS = 1e-2, 1e-3, 1e-5


def doubtful(
    sigma: float | Array, closure: float | Array, tol: float, order: int = 1
) -> bool | NDArray[np.bool_]:
    """Which samples need scrutiny: their residuals and estimates of sigma allow errors too large.

    The error of rates is that of the pose over sigma once more. Where sigma itself is known the
    same margin is kept: without it accelerations two thousandths of a radian from a singular pose
    were off by 1e-8, solved closely by 1e-10.

    Args:
        order: 2 for accelerations, whose error is that of rates over sigma once more.
    """
    limit = AMPLIFIED * tol * sigma ** (1 + order)
    return (WORSE * closure > limit) | (limit < WORSE * EPSILON)


def in_question(
    sigma: float | Array, closure: float | Array, tol: float, largest: float | None
) -> bool | NDArray[np.bool_]:
    """Which samples are doubtful, or may be better by other rows than those that are solved.

    What the mechanism itself makes of rounding cannot be helped, a choice of rows can: from them
    more is asked.

    Args:
        largest: estimate of sigma along the motion, if there are more rows than are solved.
    """
    found = doubtful(sigma, closure, tol)
    if largest is None:
        return found
    return found | (doubtful(sigma, closure, SHARPER * tol, order=2) & (sigma < LOW * largest))


def continuous(
    change: Array, velocity: Array, velocity_before: Array, dt: float | Array, size: float
) -> NDArray[np.bool_]:
    """Whether the change between neighbouring samples is what their velocities make it (Hermite's
    condition).

    Args:
        change: coordinates now less coordinates before [m], shape (..., k).
        velocity, velocity_before: their rates at both samples, same shape.
        dt: time between the samples, broadcast against the leading axes.
        size: characteristic length of the mechanism [m].

    Returns:
        One truth value per pair; false where anything is not finite.
    """
    step = np.abs(np.asarray(dt))
    half = 0.5 * np.asarray(dt)[..., None]
    deviation = np.abs(change - half * (velocity + velocity_before)).max(axis=-1)
    speed = np.abs(velocity).max(axis=-1) + np.abs(velocity_before).max(axis=-1)
    return deviation <= LARGEST_DEVIATION * 0.5 * step * speed + NEGLIGIBLE * size


def continued(change: Array, velocity: Array, velocity_before: Array, dt: float | Array) -> bool:
    """Return whether a step of all coordinates is short, and as their velocities predict it.

    Beside a fold the rates are so large that they allow any deviation. So the deviation is compared
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
    """Return whether a Jacobian stays regular on the way between two poses (see LARGEST_CHANGE).

    Let C = J_before^-1 J - I. The Jacobian is regular on the straight way from J_before to J where
    some norm of C is below one. The norm used is the smallest of all those that differ only by the
    units of the unknowns: the largest eigenvalue of |C| (Perron and Frobenius). So the units do not
    matter, nor the weights of the rows, and each block of the rows is judged by itself.

    Args:
        ratio: J_before^-1 J, or the least-squares solution where there are redundant rows.
    """
    change = np.abs(ratio - np.eye(len(ratio)))
    if not change.max() < 1.0 / EPSILON:  # singular where it begins, or not finite
        return False
    if np.linalg.norm(change) <= LARGEST_CHANGE:  # never smaller than that eigenvalue, and cheap
        return True
    return bool(np.abs(np.linalg.eigvals(change)).max() <= LARGEST_CHANGE)
