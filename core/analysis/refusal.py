"""Why a lane of a march was not accepted: the tests of `following`, in words."""

from __future__ import annotations

import numpy as np

from ..trajectory import Array
from .continuity import EPSILON, FOLLOWED, LARGEST_RATIO, TURNED, WORSE
from .model import Model
from .request import FROM, LARGEST_SIGMA, ORIENTATION, SIGMA

# Residuals up to this are of a row's own rounding: some tens of products and sums of size one.
ROUNDING = 64.0 * EPSILON


def why_refused(model: Model, lane: Array) -> str:
    """Why a lane was not accepted, with the number found.

    Args:
        lane: all its slots.
    """
    closure, branch, leftover, tol, consistent = (
        lane[model.slots[name]] for name in ("closure", "branch", "leftover", "tolerance", "consistent")
    )
    if not np.isfinite(closure):
        return "Newton diverges to numbers that are not finite"
    if not branch > 0.0:
        return f"Newton reaches a wrong branch (axes turned over, cosine {branch:.3g})"
    if closure <= tol and leftover > consistent:
        names = ", ".join(model.selection.account.redundant_rows)
        return f"the redundant rows ({names}) contradict the others by {leftover:.3g}"
    if tol < closure <= ROUNDING:
        return f"the residual {closure:.3g} of the mechanism's size is rounding, and the tolerance {tol:.3g} is less; allow more"
    if closure > tol:
        return f"Newton does not converge, residual {closure:.3g} of the mechanism's size"
    sigma, before, largest, *turned = (
        float(lane[model.slots[name]]) for name in (SIGMA, FROM + SIGMA, LARGEST_SIGMA, ORIENTATION, FROM + ORIENTATION)
    )
    uncertain = WORSE * largest * max(closure, EPSILON) / sigma**2 if sigma else np.inf
    lost = uncertain >= FOLLOWED or (uncertain >= TURNED and sigma >= before)
    if lost or not 1.0 / LARGEST_RATIO < sigma / before < LARGEST_RATIO or turned[0] != turned[1]:
        return "there is a singular pose ahead"
    return "Newton jumps to another assembly"
