"""The programs of a step, prediction and acceptance, and the slots carried from one to the next.

They share the layout of `programs`:

    predict         state, v, a and time; time -> state: Taylor step of second order
    extrapolate     states of earlier groups of lanes, weights -> state through `NODES` of them,
                    without v and a, and the carried slots of the last of them
    extend          states of earlier samples, weights -> state likewise, for lanes that are
                    motions of their own
    gaps            states, predicted and before -> gap, moved, reach
                    the largest of their components
    alone, joined   all test quantities, and the tolerance -> margin
                    positive if a lane may be accepted
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from typing import TYPE_CHECKING

from ...algebra import Scalar
from ...program import (
    DONE,
    MARGIN,
    NODES,
    Program,
    absolute,
    before,
    groups_behind,
    maximum,
    minimum,
    place_of,
    program,
)
from ...program.plan import shifted
from ..formulation.acceptance_criteria import (
    Block,
    Candidate,
    Limits,
    known_slope,
    least_slope,
    margins,
    slope_between,
)
from ..formulation.formulation import EULER_PARAMETERS
from .request import (
    ACCEPT,
    BLOCKS,
    FROM,
    LARGEST_SIGMA,
    ORIENTATION,
    PREDICTED,
    RATE,
    RATE_T,
    SIGMA,
    SLOPE,
    TIME,
    by_block,
    remembered_tests,
)

if TYPE_CHECKING:
    from .programs import Tracer

WEIGHT, PAST = "weight", "past"
"""The vectors of the samples that a state is continued through: their weights, and where they are
remembered their states.
"""


def carried_slots(tracer: Tracer) -> list[tuple[int, int]]:
    """Return pairs of slots to copy from a solved lane to the start of the next prediction."""
    sizes = {name: len(value) for name, value in tracer.formulation.design.items()}
    sizes |= {RATE: tracer.unknowns, RATE_T: tracer.unknowns}
    told = TIME, *remembered_tests(tracer.blocks), *tracer.turns
    pairs = [(tracer.layout.scalar(name), tracer.layout.scalar(FROM + name)) for name in told]
    pairs += [(tracer.layout.scalar(name), tracer.layout.scalar(name)) for name in ACCEPT]
    for name, count in sizes.items():
        pairs += zip(
            tracer.layout.vector(name, count), tracer.layout.vector(FROM + name, count), strict=True
        )
    return pairs


def continued_slots(tracer: Tracer) -> list[tuple[int, int]]:
    """Return the pairs of `carried_slots` still needed if lanes are continued through earlier ones.

    Tests need them, predictions do not.
    """
    ahead = [
        slot
        for name in (RATE, RATE_T)
        for slot in tracer.layout.vector(FROM + name, tracer.unknowns)
    ]
    return [pair for pair in carried_slots(tracer) if pair[1] not in ahead]


def predict(tracer: Tracer) -> Program:
    """Return the program of a Taylor step of second order."""
    read, vector = tracer.read, tracer.vector
    h = read(TIME) - read(FROM + TIME)
    v, a = vector(FROM + RATE, tracer.unknowns), vector(FROM + RATE_T, tracer.unknowns)
    step = [h * (v_k + (0.5 * h) * a_k) for v_k, a_k in zip(v, a, strict=True)]
    start = {
        name: vector(FROM + name, len(value)) for name, value in tracer.formulation.design.items()
    }
    taylor = tracer.formulation.retract(tracer.formulation.configuration(start), step)
    out: dict[int, Scalar] = {}
    for name, value in taylor.items():
        tracer.store(out, PREDICTED + name, value)  # kept, to see what the iteration makes of it
        tracer.store(out, name, _of_length_one([*value]))
    return program("predict", tracer.tape, out, tracer.prepared)


def extrapolate(tracer: Tracer, lanes: int) -> Program:
    """Return the program of the state by its values in the previous groups of so many lanes, see
    `weights_of_groups`.
    """
    # and what is carried of the last of them, which is at hand here; but its time and drives are no
    # longer there
    last, given = NODES - 1, {tracer.layout.scalar(name) for name in (TIME, *tracer.turns)}
    stood = {
        target: tracer.tape.at(last, source)
        for source, target in continued_slots(tracer)
        if source not in (*given, target)
    }
    state, behind = _state_slots(tracer), groups_behind(lanes)
    past = _past_slots(tracer) if behind > 1 else state
    stood |= {
        target: tracer.tape.input(source) for source, target in shifted(past[0], state, behind)
    }
    groups = [*(past[k * len(state) :][: len(state)] for k in range(behind - 1)), state]
    place = {slot: k for k, slot in enumerate(state)}

    def at(k: int, slot: int) -> Scalar:
        group, _ = place_of(k, lanes)
        return tracer.tape.at(k, groups[group][place[slot]])

    return _continue_state(tracer, "extrapolate", at, stood)


def extend(tracer: Tracer) -> Program:
    """Return the program of the state by its values at the last `NODES` samples, see
    `weights_of_samples`.
    """
    state, past = _state_slots(tracer), _past_slots(tracer)
    place = {slot: k for k, slot in enumerate(state)}
    return _continue_state(
        tracer, "extend", lambda k, slot: tracer.tape.input(past[k * len(state) + place[slot]]), {}
    )


def _state_slots(tracer: Tracer) -> list[int]:
    """The slots of the state."""
    return [slot for name in tracer.formulation.design for slot in tracer.layout.vectors[name]]


def _past_slots(tracer: Tracer) -> list[int]:
    """Return the slots of the stored states, of up to `NODES` samples or groups of lanes."""
    return tracer.layout.vector(PAST, NODES * len(_state_slots(tracer)))


def _continue_state(
    tracer: Tracer, name: str, at: Callable[[int, int], Scalar], further: Mapping[int, Scalar]
) -> Program:
    """Return the program of the state by Lagrange's formula, without v and a, with further outputs;
    at(k, slot) is the value of a slot at node k.
    """
    weights = tracer.vector(WEIGHT, NODES)
    out = dict(further)
    for part, value in tracer.formulation.design.items():
        slots = tracer.layout.vector(part, len(value))
        found = [sum((w * at(k, slot) for k, w in enumerate(weights)), 0.0) for slot in slots]
        for label in (part, PREDICTED + part):
            tracer.store(out, label, _of_length_one(found))
    return program(name, tracer.tape, out, tracer.prepared)


def _of_length_one(value: list[Scalar]) -> list[Scalar]:
    """Return Euler parameters of length one, to second order in their error; any other vector
    unchanged.
    """
    if len(value) != EULER_PARAMETERS:
        return value
    k = 1.5 - 0.5 * sum((x * x for x in value), 0.0)
    return [k * x for x in value]


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
