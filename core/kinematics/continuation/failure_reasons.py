"""The failure of a pose by the acceptance criteria it does not meet."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...failures import FailureKind, PoseFailure
from ...trajectory import Array
from ..compiled.acceptance import candidate, limits
from ..compiled.compiled_model import Model
from ..compiled.request import FROM, LARGEST_SIGMA, ORIENTATION, SIGMA, SLOPE, by_block
from ..formulation.acceptance_criteria import ROUNDING
from ..formulation.driver_inputs import turns
from ..formulation.margins import Block, known_slope, margins

SINGULAR = ("as regular", "on this side", "regular between", "certain", "not turned by rounding")
"""Criteria that a lane does not meet if a singular pose is ahead."""


def pose_failure(model: Model, lane: Array) -> PoseFailure:
    """Return the failure of a lane, with its numbers.

    Args:
        lane: all its slots.
    """

    def read(name: str) -> float:
        return float(lane[model.slots[name]])

    names = zip(by_block(SIGMA, model.blocks), by_block(SLOPE, model.blocks), strict=True)
    blocks = [
        Block(read(name), read(FROM + name), max(known_slope(read(FROM + label)), read(label)))
        for name, label in names
    ]
    pose = candidate(
        read,
        before=read(FROM + SIGMA),
        reversal=read(ORIENTATION) - read(FROM + ORIENTATION),
        largest=read(LARGEST_SIGMA),
        blocks=blocks,
        turns=turns(model.mechanism, model.request.drivers),
    )
    found = margins(pose, limits(read))
    failed = [name for name, margin in found.items() if not margin > 0.0]
    closure, leftover, branch, tol = (
        read(name) for name in ("closure", "leftover", "branch", "tolerance")
    )
    redundant = model.selection.account.redundant_rows
    return PoseFailure(failure_kind(failed, closure), closure, tol, leftover, branch, redundant)


def failure_kind(failed: Sequence[str], closure: float) -> FailureKind:
    """Return the kind of a failure by the criteria not met.

    Args:
        failed: names of the criteria, see `margins`.
        closure: largest residual of the solved rows [units of the mechanism's size].
    """
    if not np.isfinite(closure):
        return FailureKind.DIVERGED
    if "on the branch" in failed:
        return FailureKind.WRONG_BRANCH
    if "closed" in failed:
        return FailureKind.BELOW_ROUNDING if closure <= ROUNDING else FailureKind.NOT_CONVERGED
    if "consistent" in failed:
        return FailureKind.CONTRADICTORY
    if any(name in failed for name in SINGULAR):
        return FailureKind.SINGULAR_AHEAD
    if failed == ["converged"]:
        return FailureKind.NOT_SETTLED
    if not set(failed) - {"near", "not turned round"}:
        return FailureKind.LONG_STEP
    return FailureKind.OTHER_ASSEMBLY
