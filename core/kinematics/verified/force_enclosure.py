"""Forces of a proved sample as balls.

The multipliers solve F'^T mu = G with the inverse of F' that encloses the motion; see
`exact_forces`. Those of drivers and couplers give their efforts. The generalised forces of these
are then taken from G, and the same equations, solved again, give the reactions. Redundant rows are
left out and carry nothing. To find undetermined forces, each of them is given a unit multiplier,
and the solved rows balance it: what changes is undetermined.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from ...errors import KincheckError
from ...program import Program
from ...program.ball_executor import Ball, flint
from .exact_forces import ForcePrograms

WRENCH = 6
"""Numbers of a joint's reaction: force, then moment."""

Run = Callable[[Program, Sequence[Ball]], Sequence[Ball]]
"""Runs a program at the proved state, with rates, accelerations, multipliers, speeds and angles."""


class UnprovedError(KincheckError, ArithmeticError):
    """There is no proof for a sample; the message gives the reason."""


_Forces: TypeAlias = tuple[Mapping[str, Sequence[Ball]], Mapping[str, Ball], Sequence[Ball]]


@dataclass(frozen=True, eq=False)
class EnclosedForces:
    """Forces of a sample, as balls.

    Attributes:
        joints: force [N] and moment [N m] by joint, six balls.
        drivers, elements: effort or force by name [N or N m].
        free: for each row left out what a multiplier of one adds to the joints, with the unit of
            the frames in place of the metre.
        power: sum of the powers [W], which contains zero.
    """

    joints: Mapping[str, Sequence[Ball]]
    drivers: Mapping[str, Ball]
    elements: Mapping[str, Ball]
    free: Sequence[Mapping[str, Sequence[Ball]]]
    power: Ball


def enclose_forces(
    programs: ForcePrograms,
    kept: Sequence[int],
    left_out: Sequence[int],
    run: Run,
    motion: Sequence[Sequence[Ball]],
    speeds: Sequence[Ball],
    near: Sequence[float],
    inverse: Ball,
) -> EnclosedForces:
    """Return the forces of a sample.

    Args:
        kept, left_out: numbers of the rows solved, and of the others.
        motion: first and second derivative of the state by time.
        speeds: rates of the drivers [units/s or rad/s].
        near: approximate angles of the joints of torsional springs [rad], which count their turns.
        inverse: of F'.

    Raises:
        UnprovedError: an angle is not near the approximate one, or power is not balanced.
    """
    arb, matrix = flint().arb, flint().arb_mat
    size = len(motion[0])
    begin = [*motion[0], *motion[1]]
    nothing = [arb(0)] * programs.rows

    def further(multipliers: Sequence[Ball], angles: Sequence[Ball]) -> list[Ball]:
        return [*begin, *multipliers, *speeds, *angles]

    halves = run(programs.half_angles, further(nothing, [arb(0)] * len(near)))
    angles = [
        _angle(halves[2 * k], halves[2 * k + 1], about, programs.angles[k])
        for k, about in enumerate(near)
    ]

    rows = run(programs.left_out, further(nothing, angles))
    off = {row: rows[k * size : (k + 1) * size] for k, row in enumerate(left_out)}

    def balancing(right: Sequence[Ball], given: Collection[int]) -> list[Ball]:
        """Return the multipliers of all rows: one of the given rows, zero of others left out."""
        column = [x - sum((off[row][k] for row in given), arb(0)) for k, x in enumerate(right)]
        solved = (inverse.transpose() * matrix(size, 1, column)).entries()
        found = list(nothing)
        for row, value in zip(kept, solved, strict=False):  # those of lengths come last
            found[row] = value
        for row in given:
            found[row] = arb(1)
        return found

    def forces(right: Sequence[Ball], given: Collection[int] = ()) -> tuple[_Forces, list[Ball]]:
        """Return the forces in balance with generalised forces, and the multipliers left to the
        rows of drivers and couplers: zero.
        """
        every = further(balancing(right, given), angles)
        _, drivers, rest = _split(programs, run(programs.forces, every))
        left = [x - y for x, y in zip(right, run(programs.acting, every), strict=True)]
        own = balancing(left, [row for row in given if row < programs.of_joints])
        joints, *_ = _split(programs, run(programs.forces, further(own, angles)))
        return (joints, drivers, rest), own[programs.of_joints :]

    (joints, drivers, rest), beside = forces(run(programs.demand, further(nothing, angles)))
    *amounts, power = rest
    if not power.contains(0):
        raise UnprovedError(
            f"the powers of drivers, masses and force elements sum up to {power.str(5)} W, expected"
            " zero: an equation of the forces is wrong, please report it"
        )
    if not all(each.contains(0) for each in beside):
        raise UnprovedError(
            "a driver or coupler measures another coordinate than the turn about its joint's axis"
            " or the displacement along it: see measured() of the joint's type"
        )
    free = [forces([arb(0)] * size, [row])[0][0] for row in left_out]
    return EnclosedForces(
        joints, drivers, dict(zip(programs.wanted.elements, amounts, strict=True)), free, power
    )


def _split(programs: ForcePrograms, values: Sequence[Ball]) -> _Forces:
    """Return values by joint and driver, and the others."""
    wanted = programs.wanted
    last = WRENCH * len(wanted.joints)
    joints = {name: values[WRENCH * k : WRENCH * (k + 1)] for k, name in enumerate(wanted.joints)}
    end = last + len(wanted.drivers)
    return joints, dict(zip(wanted.drivers, values[last:end], strict=True)), values[end:]


def _angle(sine: Ball, cosine: Ball, near: float, joint: str) -> Ball:
    """Return the angle of a joint near an approximate one."""
    principal, turn = 2 * flint().arb.atan2(sine, cosine), 2 * flint().arb.pi()
    angle = principal + round((near - float(principal.mid())) / math.tau) * turn
    if not abs(angle - near) < 0.5:
        raise UnprovedError(
            f"the angle of joint {joint!r}, {angle.str(5)}, is not near the approximate {near:.5g}"
        )
    return angle
