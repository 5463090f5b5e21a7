"""Which lanes are accepted: the programs of the tests of a solution, and in words why one was not.

gaps      states, predicted and before       -> gap, moved, reach   the largest of their components
alone, joined   all that is tested, and the tolerance   -> margin    positive where a lane may be accepted
"""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING

import numpy as np

from ..program import DONE, MARGIN, Program, absolute, before, maximum, minimum, program
from ..trajectory import Array
from .continuity import EPSILON, FOLLOWED, LARGEST_CORRECTION, LARGEST_RATIO, LONGEST_STEP, NEGLIGIBLE, TURNED, WORSE
from .request import ACCEPT, BLOCKS, FROM, LARGEST_SIGMA, ORIENTATION, SIGMA

if TYPE_CHECKING:
    from .model import Model
    from .programs import Tracer

ALONE, JOINED = ("alone_gaps", "alone"), ("joined_gaps", "joined")
"""The programs of the two tests: of lanes that know nothing of each other, and of neighbours on one way."""
GAPS = GAP, MOVED, REACH = "gap", "moved", "reach"
"""Slots of the largest change of a correction, of a component of the state, and of its distance from the start."""
# Residuals up to this are of a row's own rounding: some tens of products and sums of size one.
ROUNDING = 64.0 * EPSILON


def tests(tracer: Tracer, *, neighbours: bool) -> list[Program]:
    """The programs of a test."""
    gaps, margin = JOINED if neighbours else ALONE
    return [_gaps(tracer, gaps, neighbours=neighbours), _margin(tracer, margin, neighbours=neighbours)]


def _gaps(tracer: Tracer, name: str, *, neighbours: bool) -> Program:
    """How far a lane is from where it should be by the lane before it, or where lanes are no neighbours by the start: the largest
    of all components of the state.

    The correction that Newton made of the prediction changes from the lane before, or from nothing at the start, by much less
    than the pose does, where it is the same motion.
    """
    design = tracer.formulation.design
    blocks = [[slot for each in design for slot in tracer.layout.vectors[label + each]] for label in BLOCKS]
    times = len(blocks[0])
    assert all(block == list(range(block[0], block[0] + times)) for block in blocks)
    x, predicted, start = (tracer.tape.input(block[0]) for block in blocks)
    x_before, predicted_before = (before(x, start), before(predicted, start)) if neighbours else (start, start)
    sizes = (x - predicted) - (x_before - predicted_before), x - x_before, x - start
    out = {tracer.layout.scalar(label): absolute(size) for label, size in zip(GAPS, sizes, strict=True)}
    return program(name, tracer.tape, out, times=times)


def _margin(tracer: Tracer, name: str, *, neighbours: bool) -> Program:
    """By how much a lane passes all tests of a solution: it has converged, closes, is on its branch, agrees with the
    redundant rows, and continues the motion it is predicted from.

    The last is seen from its gaps, and from sigma. No lane is taken that is far from there, nor one beyond a singular pose: whether
    the motion passes it, or turns round a corner before it, is not seen from afar.
    """
    read = tracer.read
    tol, consistent, crossing = (read(label) for label in ACCEPT)
    closure, sigma, turned = (read(name) for name in ("closure", SIGMA, ORIENTATION))
    sigma_before, turned_before, largest = (read(FROM + name) for name in (SIGMA, ORIENTATION, LARGEST_SIGMA))
    largest = maximum(sigma, largest)
    if neighbours:
        sigma_before, turned_before = before(sigma, sigma_before), before(turned, turned_before)
    uncertain = (WORSE * largest) * maximum(closure, EPSILON)
    margins = (
        read(DONE) - 0.5,
        tol - closure,
        consistent - read("leftover"),
        read("branch"),
        LARGEST_CORRECTION * read(MOVED) + NEGLIGIBLE - read(GAP),
        LONGEST_STEP - read(REACH),
        (LARGEST_RATIO * sigma - sigma_before) * (LARGEST_RATIO * sigma_before - sigma) + crossing,
        0.5 - absolute(turned - turned_before) + crossing,
        FOLLOWED * sigma * sigma - uncertain,
        maximum(TURNED * sigma * sigma - uncertain, sigma_before - sigma),
    )
    out = {tracer.layout.scalar(MARGIN): reduce(minimum, margins), tracer.layout.scalar(LARGEST_SIGMA): largest}
    return program(name, tracer.tape, out, tracer.prepared)


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
