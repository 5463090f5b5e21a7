"""Acceptance of lanes: the programs of the tests of a solution.

gaps            states, predicted and before -> gap, moved, reach
                the largest of their components
alone, joined   all test quantities, and the tolerance -> margin
                positive if a lane may be accepted
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from typing import TYPE_CHECKING

from ...algebra import Scalar
from ...program import (
    DONE,
    MARGIN,
    Program,
    absolute,
    before,
    maximum,
    minimum,
    program,
)
from ..formulation.margins import (
    Block,
    Candidate,
    Limits,
    known_slope,
    least_slope,
    margins,
    slope_between,
)
from .request import ACCEPT, BLOCKS, FROM, LARGEST_SIGMA, ORIENTATION, SIGMA, SLOPE, by_block

if TYPE_CHECKING:
    from .programs import Tracer

ALONE, JOINED = ("alone_gaps", "alone"), ("joined_gaps", "joined")
"""The programs of the two tests: of lanes that know nothing of each other, and of neighbours on one
way.
"""
GAPS = GAP, MOVED, REACH = "gap", "moved", "reach"
"""Slots of the largest change of a correction, of a component of the state, and of its distance
from the start.
"""


def tests(tracer: Tracer, *, neighbours: bool) -> list[Program]:
    """The programs of a test."""
    gaps, margin = JOINED if neighbours else ALONE
    return [
        _gaps(tracer, gaps, neighbours=neighbours),
        _margin(tracer, margin, neighbours=neighbours),
    ]


def _gaps(tracer: Tracer, name: str, *, neighbours: bool) -> Program:
    """Return the program of the largest distances of a lane, over all components of the state.

    Distances are from the lane before, or from the start if lanes are no neighbours. Along one
    motion Newton's correction of the prediction changes by much less than the pose, from the lane
    before or from zero at the start.
    """
    design = tracer.formulation.design
    blocks = [
        [slot for each in design for slot in tracer.layout.vectors[label + each]]
        for label in BLOCKS
    ]
    times = len(blocks[0])
    assert all(block == list(range(block[0], block[0] + times)) for block in blocks)
    x, predicted, start = (tracer.tape.input(block[0]) for block in blocks)
    x_before, predicted_before = (
        (before(x, start), before(predicted, start)) if neighbours else (start, start)
    )
    sizes = (x - predicted) - (x_before - predicted_before), x - x_before, x - start
    out = {
        tracer.layout.scalar(label): absolute(size) for label, size in zip(GAPS, sizes, strict=True)
    }
    return program(name, tracer.tape, out, times=times)


def _margin(tracer: Tracer, name: str, *, neighbours: bool) -> Program:
    """Return the program of the smallest margin of a lane."""
    read, sigma, turned = tracer.read, tracer.read(SIGMA), tracer.read(ORIENTATION)
    sigma_before, turned_before, largest = (
        read(FROM + label) for label in (SIGMA, ORIENTATION, LARGEST_SIGMA)
    )
    largest = maximum(sigma, largest)
    if neighbours:
        sigma_before, turned_before = before(sigma, sigma_before), before(turned, turned_before)
    moved, blocks, slopes = read(MOVED), list[Block](), dict[str, Scalar]()
    for which, label in zip(
        by_block(SIGMA, tracer.blocks), by_block(SLOPE, tracer.blocks), strict=True
    ):
        size, size_before, slope = read(which), read(FROM + which), known_slope(read(FROM + label))
        if neighbours:
            size_before = before(size, size_before)
        found, least = slope_between(size, size_before, moved), least_slope(slope)
        known = maximum(before(found, slope), least) if neighbours else slope
        blocks.append(Block(size, size_before, maximum(known, found)))
        slopes[label] = maximum(found, least)
    pose = candidate(
        read,
        before=sigma_before,
        reversal=turned - turned_before,
        largest=largest,
        blocks=blocks,
        turns=tracer.turns,
    )
    passed = margins(pose, limits(read))
    out = {MARGIN: reduce(minimum, passed.values()), LARGEST_SIGMA: largest, **slopes}
    out = {tracer.layout.scalar(label): value for label, value in out.items()}
    return program(name, tracer.tape, out, tracer.prepared)


def candidate(
    read: Callable[[str], Scalar],
    *,
    before: Scalar,
    reversal: Scalar,
    largest: Scalar,
    blocks: Sequence[Block],
    turns: Sequence[str],
) -> Candidate:
    """Return a lane as a candidate.

    Args:
        read: returns a scalar of the lane by its name.
        before, reversal, largest, blocks: see `Candidate`.
        turns: names of the angles of turning drivers.
    """
    return Candidate(
        done=read(DONE),
        closure=read("closure"),
        leftover=read("leftover"),
        branch=read("branch"),
        gap=read(GAP),
        moved=read(MOVED),
        reach=read(REACH),
        turns=[read(angle) - read(FROM + angle) for angle in turns],
        sigma=read(SIGMA),
        before=before,
        largest=largest,
        reversal=reversal,
        blocks=blocks,
    )


def limits(read: Callable[[str], Scalar]) -> Limits:
    """Return the limits of a lane, read from its slots."""
    return Limits(*(read(label) for label in ACCEPT))
