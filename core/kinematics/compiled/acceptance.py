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
    where_larger,
)
from ..formulation.acceptance_criteria import (
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
from .request import ACCEPT, BLOCKS, FROM, LARGEST_SIGMA, ORIENTATION, SIGMA, SLOPE, by_block

if TYPE_CHECKING:
    from .programs import Tracer

ALONE, JOINED = ("alone_gaps", "alone"), ("joined_gaps", "joined")
"""The programs of the two tests: of lanes that know nothing of each other, and of neighbours on one
way.
"""
Block = tuple[Scalar, Scalar, Scalar]
"""Of a block of the rows: sigma as estimated, that of where a lane is predicted from, how steeply
it changes as far as known.
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
    """How far a lane is from where it should be by the lane before it, or where lanes are no
    neighbours by the start: the largest of all components of the state.

    The correction that Newton made of the prediction changes from the lane before, or from nothing
    at the start, by much less than the pose does, where it is the same motion.
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
    """By how much a lane passes all tests of a solution."""
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
        size, size_before, slope = read(which), read(FROM + which), steepness(read, label)
        if neighbours:
            size_before = before(size, size_before)
        found = where_larger(moved, NEGLIGIBLE, absolute(size - size_before) / moved, 0.0)
        least = maximum(FALLS * slope, EPSILON)
        known = maximum(before(found, slope), least) if neighbours else slope
        blocks.append((size, size_before, maximum(known, found)))
        slopes[label] = maximum(found, least)
    passed = margins(read, sigma_before, turned_before, largest, blocks, tracer.turns)
    out = {MARGIN: reduce(minimum, passed.values()), LARGEST_SIGMA: largest, **slopes}
    out = {tracer.layout.scalar(label): value for label, value in out.items()}
    return program(name, tracer.tape, out, tracer.prepared)


def margins(
    read: Callable[[str], Scalar],
    sigma_before: Scalar,
    turned_before: Scalar,
    largest: Scalar,
    blocks: Sequence[Block],
    turns: Sequence[str],
) -> dict[str, Scalar]:
    """By how much a lane passes each test of a solution: it has converged, closes, agrees with the
    redundant rows, is on its branch, and continues the motion it is predicted from.

    The last is seen from its gaps, and from sigma. No lane is taken that is far from there, nor one
    beyond a singular pose: whether the motion passes it, or turns round a corner before it, is not
    seen from afar.

    Args:
        read: a scalar of the lane by its name.
        sigma_before, turned_before: of where it is predicted from.
        largest: the largest estimate of sigma so far.
        blocks: of the rows. Of one loop sigma may stay as small as it is while another's, which is
            larger, falls to nothing.
        turns: names of the angles of drivers that turn.
    """
    tol, consistent, crossing = (read(label) for label in ACCEPT)
    closure, sigma, turned = (read(label) for label in ("closure", SIGMA, ORIENTATION))
    uncertain = (WORSE * largest) * maximum(closure, EPSILON)
    return {
        "converged": read(DONE) - 0.5,
        "closed": tol - closure,
        "consistent": consistent - read("leftover"),
        "on the branch": read("branch"),
        "continued": LARGEST_CORRECTION * read(MOVED) + NEGLIGIBLE - read(GAP),
        "near": LONGEST_STEP - read(REACH),
        **(
            {"not turned round": reduce(minimum, (_unturned(read, name) for name in turns))}
            if turns
            else {}
        ),
        "as regular": (
            reduce(minimum, (_as_regular(size, size_before) for size, size_before, _ in blocks))
            + crossing
        ),
        "on this side": 0.5 - absolute(turned - turned_before) + crossing,
        "regular between": (
            reduce(minimum, (_between(*block, read(MOVED)) for block in blocks)) + crossing
        ),
        "certain": FOLLOWED * sigma * sigma - uncertain,
        "not turned by rounding": maximum(TURNED * sigma * sigma - uncertain, sigma_before - sigma),
    }


def _unturned(read: Callable[[str], Scalar], angle: str) -> Scalar:
    """Positive where a driver has turned by so little that no turn is lost."""
    return LONGEST_TURN - absolute(read(angle) - read(FROM + angle))


def _as_regular(sigma: Scalar, sigma_before: Scalar) -> Scalar:
    """Positive where none of two numbers is too many times the other."""
    return (LARGEST_RATIO * sigma - sigma_before) * (LARGEST_RATIO * sigma_before - sigma)


def _between(sigma: Scalar, sigma_before: Scalar, slope: Scalar, moved: Scalar) -> Scalar:
    """Positive where sigma cannot have been zero on the way."""
    return sigma + sigma_before - minimum(STEEPER * slope, STEEPEST) * moved


def steepness(read: Callable[[str], Scalar], label: str) -> Scalar:
    """How steeply sigma of a block changed so far; as much as may be, where nothing is known of
    that.
    """
    found = read(FROM + label)
    return where_larger(found, 0.0, found, STEEPEST)
