"""Kinds of failures of a solution, with messages for unreached poses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum


class FailureKind(StrEnum):
    """The reason for a refused mechanism, or for missing samples."""

    # a description
    NOT_FINITE = "number not finite"
    NO_LENGTH = "length of zero"
    WRONG_ANGLE = "wrong angle between axes"
    # a mechanism at the design position
    FREE = "degrees of freedom left free"
    OVERDRIVEN = "more drivers than degrees of freedom"
    LOCKED = "drivers locked at the design position"
    NOT_CLOSED = "not closed at the design position"
    # a pose
    DIVERGED = "divergence"
    NOT_CONVERGED = "no convergence"
    NOT_SETTLED = "no settling"
    NOT_FOUND = "no convergence, or another assembly"
    NO_POSE = "no pose that closes"
    BELOW_ROUNDING = "tolerance below rounding"
    CONTRADICTORY = "contradictory redundant rows"
    WRONG_BRANCH = "wrong branch"
    OTHER_ASSEMBLY = "another assembly"
    LONG_STEP = "long step"
    TOO_MANY_PARTS = "too many parts of a step"
    SINGULAR_AHEAD = "singular pose ahead"
    SINGULAR_ROWS = "singular rows"
    DEAD_CENTRE = "dead centre"
    LEFT_OFF = "left off"
    # a sample
    UNCERTAIN = "uncertain beside a singular pose"
    UNREPEATABLE = "reached once, by rounding"


MOST_PARTS = 2000
"""Largest number of parts of a step. Of a slider-crank a part is 0.7 rad: a step of 1,000 rad is
followed to its end, one of 1,500 rad is not.
"""

ZERO = "zero at a lock-up or dead centre"

TEXTS = {
    FailureKind.DIVERGED: "Newton diverges to numbers that are not finite",
    FailureKind.NOT_CONVERGED: (
        "Newton does not converge, residual {residual:.3g} of the mechanism's size"
    ),
    FailureKind.NOT_SETTLED: (
        "Newton does not settle, residual {residual:.3g} of the mechanism's size"
    ),
    FailureKind.NOT_FOUND: "Newton does not converge or jumps to another assembly",
    FailureKind.NO_POSE: (
        "no pose near there closes better than to {residual:.3g} of the mechanism's size: the"
        " motion ends, or joints contradict each other"
    ),
    FailureKind.BELOW_ROUNDING: (
        "the residual {residual:.3g} of the mechanism's size is rounding, and the tolerance"
        " {tol:.3g} is less; allow more"
    ),
    FailureKind.CONTRADICTORY: (
        "the redundant rows ({redundant}) contradict the others by {leftover:.3g}"
    ),
    FailureKind.WRONG_BRANCH: (
        "Newton reaches a wrong branch (axes turned over, cosine {branch:.3g})"
    ),
    FailureKind.OTHER_ASSEMBLY: "Newton jumps to another assembly",
    FailureKind.LONG_STEP: "the step to it is too long to be believed",
    FailureKind.TOO_MANY_PARTS: (
        f"{MOST_PARTS} parts of the step were taken, and the next sample was not reached; give"
        " samples in between"
    ),
    FailureKind.SINGULAR_AHEAD: "there is a singular pose ahead",
    FailureKind.SINGULAR_ROWS: "the equations are singular there",
    FailureKind.LEFT_OFF: "the step fails, and no part of it was tried",
    FailureKind.DEAD_CENTRE: (
        "drivers cannot move: it is a dead centre, or the motions that joints leave contradict"
        " each other"
    ),
}
"""Messages by kind, with places for the numbers of a `PoseFailure`."""


@dataclass(frozen=True)
class PoseFailure:
    """An unreached pose: the kind, and the numbers of the message.

    Attributes:
        residual: largest residual of the solved rows [units of the mechanism's size].
        tol: largest accepted residual.
        leftover: largest residual of the redundant rows.
        branch: smallest branch test, the cosine of an angle.
        redundant: names of the redundant rows.
        where: the failing part of the mechanism; empty for all of it.
        sigma: smallest singular value at the last pose, an estimate; None if not known.
    """

    kind: FailureKind
    residual: float = math.nan
    tol: float = math.nan
    leftover: float = 0.0
    branch: float = 1.0
    redundant: Sequence[str] = ()
    where: str = ""
    sigma: float | None = None

    def __str__(self) -> str:
        numbers = {**vars(self), "redundant": ", ".join(self.redundant)}
        text = self.where + TEXTS[self.kind].format_map(numbers)
        if self.sigma is not None:
            text += f"; smallest singular value there about {self.sigma:.3g} ({ZERO})"
        return text
