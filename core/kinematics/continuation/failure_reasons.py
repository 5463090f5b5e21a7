"""Why a pose was not accepted, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...trajectory import Array
from ..compiled.acceptance import margins, steepness
from ..compiled.compiled_model import Model
from ..compiled.request import FROM, LARGEST_SIGMA, ORIENTATION, SIGMA, SLOPE, by_block
from ..formulation.acceptance_criteria import ROUNDING
from ..formulation.driver_inputs import turns

SINGULAR = ("as regular", "on this side", "regular between", "certain", "not turned by rounding")
"""The tests that a lane fails where a singular pose is ahead."""


def why_refused(model: Model, lane: Array) -> str:
    """Why a lane was not accepted, with the number found.

    Args:
        lane: all its slots.
    """

    def read(name: str) -> float:
        return float(lane[model.slots[name]])

    names = zip(by_block(SIGMA, model.blocks), by_block(SLOPE, model.blocks), strict=True)
    blocks = [
        (read(name), read(FROM + name), max(steepness(read, label), read(label)))
        for name, label in names
    ]
    angles = turns(model.mechanism, model.request.drivers)
    found = margins(
        read, read(FROM + SIGMA), read(FROM + ORIENTATION), read(LARGEST_SIGMA), blocks, angles
    )
    failed = [name for name, margin in found.items() if not margin > 0.0]
    closure, leftover, branch, tol = (
        read(name) for name in ("closure", "leftover", "branch", "tolerance")
    )
    return in_words(failed, closure, leftover, branch, tol, model.selection.account.redundant_rows)


def in_words(
    failed: Sequence[str],
    closure: float,
    leftover: float,
    branch: float,
    tol: float,
    redundant: Sequence[str],
) -> str:
    """Why a pose was refused that failed so many tests.

    Args:
        closure, leftover, branch, tol: what the tests are of.
        redundant: names of rows.
    """
    if not np.isfinite(closure):
        return "Newton diverges to numbers that are not finite"
    if "on the branch" in failed:
        return f"Newton reaches a wrong branch (axes turned over, cosine {branch:.3g})"
    if "closed" in failed and closure <= ROUNDING:
        return (
            f"the residual {closure:.3g} of the mechanism's size is rounding, and the tolerance"
            f" {tol:.3g} is less; allow more"
        )
    if "closed" in failed:
        return f"Newton does not converge, residual {closure:.3g} of the mechanism's size"
    if "consistent" in failed:
        return (
            f"the redundant rows ({', '.join(redundant)}) contradict the others by {leftover:.3g}"
        )
    if any(name in failed for name in SINGULAR):
        return "there is a singular pose ahead"
    if failed == ["converged"]:
        return f"Newton does not settle, residual {closure:.3g} of the mechanism's size"
    if not set(failed) - {"near", "not turned round"}:
        return "the step to it is too long to be believed"
    return "Newton jumps to another assembly"
