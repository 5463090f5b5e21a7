"""Programs that follow a motion: what lanes are predicted from, how, and which of them are accepted (see `programs`).

predict   from state, v, a and time; time    -> state        Taylor step of second order
extrapolate   states of the groups of lanes before, weights   -> state       through `NODES` of them, without v and a; and what is
                                                                carried of the last of them
extend    states of the samples before, weights   -> state        likewise, for lanes that are motions of their own
gaps      states, predicted and before       -> gap, moved, reach   the largest of their components
alone, joined   all that is tested, and the tolerance   -> margin    positive where a lane may be accepted
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np

from ..algebra import Scalar
from ..program import (
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
    where_larger,
)
from ..program.executor import shifted
from ..trajectory import Array
from .continuity import EPSILON, FOLLOWED, LARGEST_CORRECTION, LARGEST_RATIO, LONGEST_STEP, NEGLIGIBLE, TURNED, WORSE
from .request import ACCEPT, BLOCKS, EARLIER, FROM, LARGEST_SIGMA, ORIENTATION, PREDICTED, RATE, RATE_T, SIGMA, TIME

if TYPE_CHECKING:
    from .programs import Tracer

WEIGHT, PAST = "weight", "past"
"""The vectors of the samples that a state is continued through: their weights, and where they are remembered their states."""
EULER_PARAMETERS = 4
ABOUT = 1.5
"""A step may be this much longer than the one it learns from."""
ALONE, JOINED = ("alone_gaps", "alone"), ("joined_gaps", "joined")
"""The programs of the two tests: of lanes that know nothing of each other, and of neighbours on one way."""
GAPS = GAP, MOVED, REACH = "gap", "moved", "reach"
"""Slots of the largest change of a correction, of a component of the state, and of its distance from the start."""


def carried(tracer: Tracer) -> list[tuple[int, int]]:
    """Slots of a solved lane, and of what the lanes after it are predicted from."""
    sizes = {name: len(value) for name, value in tracer.formulation.design.items()}
    sizes |= {PREDICTED + name: count for name, count in sizes.items()}
    sizes |= {RATE: tracer.unknowns, RATE_T: tracer.unknowns}
    pairs = [(tracer.layout.scalar(FROM + TIME), tracer.layout.scalar(EARLIER + TIME))]
    pairs += [(tracer.layout.scalar(name), tracer.layout.scalar(FROM + name)) for name in (TIME, SIGMA, ORIENTATION, LARGEST_SIGMA)]
    pairs += [(tracer.layout.scalar(name), tracer.layout.scalar(name)) for name in ACCEPT]
    for name, count in sizes.items():
        pairs += zip(tracer.layout.vector(name, count), tracer.layout.vector(FROM + name, count), strict=True)
    return pairs


def continued(tracer: Tracer) -> list[tuple[int, int]]:
    """What of that is carried where the lanes after are continued through those before: tests need it, predictions do not.

    Where they are predicted after all there is no step behind, and nothing is made of what it lacked.
    """
    time, unknowns = tracer.layout.scalar(TIME), tracer.unknowns
    ahead = [slot for name in tracer.formulation.design for slot in tracer.layout.vectors[FROM + PREDICTED + name]]
    ahead += [slot for name in (RATE, RATE_T) for slot in tracer.layout.vector(FROM + name, unknowns)]
    (_, earlier), *pairs = carried(tracer)
    return [(time, earlier), *(pair for pair in pairs if pair[1] not in ahead)]


def predict(tracer: Tracer) -> Program:
    """The state at the time by a Taylor step of second order, and what the last such step lacked.

    That is of third order, whatever the coordinates: it grows by the cube of the step. It is known where the step before was
    about as long as this one, or longer.
    """
    read, vector = tracer.read, tracer.vector
    time, here, earlier = (read(label + TIME) for label in ("", FROM, EARLIER))
    h, h_before = time - here, here - earlier
    v, a = vector(FROM + RATE, tracer.unknowns), vector(FROM + RATE_T, tracer.unknowns)
    step = [h * (v_k + (0.5 * h) * a_k) for v_k, a_k in zip(v, a, strict=True)]
    start = {name: vector(FROM + name, len(value)) for name, value in tracer.formulation.design.items()}
    taylor = tracer.formulation.retract(tracer.formulation.configuration(start), step)
    part = h / h_before
    lack = where_larger(ABOUT * h_before, h, part * part * part, 0.0)
    out: dict[int, Scalar] = {}
    corrected: dict[str, list[Scalar]] = {}
    for name, value in taylor.items():
        tracer.store(out, PREDICTED + name, value)  # kept, to see what the iteration makes of it
        solved, predicted = start[name], vector(FROM + PREDICTED + name, len(value))
        corrected[name] = [x + lack * (b - p) for x, b, p in zip(value, solved, predicted, strict=True)]
        corrected[name] = _of_length_one(corrected[name])
    tracer.store_state(out, corrected)
    return program("predict", tracer.tape, out, tracer.prepared)


def extrapolate(tracer: Tracer, lanes: int) -> Program:
    """The state from what it is in the group of so many lanes before, or several, by the weights of those: `weights_of_groups`."""
    # and what is carried of the last of them, which is at hand here; but its time is no longer there
    time, last = tracer.layout.scalar(TIME), NODES - 1
    stood = {target: tracer.tape.at(last, source) for source, target in continued(tracer) if source not in (time, target)}
    state, behind = _state_slots(tracer), groups_behind(lanes)
    past = _past_slots(tracer) if behind > 1 else state
    stood |= {target: tracer.tape.input(source) for source, target in shifted(past[0], state, behind)}
    groups = [*(past[k * len(state) :][: len(state)] for k in range(behind - 1)), state]
    place = {slot: k for k, slot in enumerate(state)}

    def at(k: int, slot: int) -> Scalar:
        group, _ = place_of(k, lanes)
        return tracer.tape.at(k, groups[group][place[slot]])

    return _continued(tracer, "extrapolate", at, stood)


def extend(tracer: Tracer) -> Program:
    """The state from what it was at the last `NODES` samples, by the weights of those; see `weights_of_samples`."""
    state, past = _state_slots(tracer), _past_slots(tracer)
    place = {slot: k for k, slot in enumerate(state)}
    return _continued(tracer, "extend", lambda k, slot: tracer.tape.input(past[k * len(state) + place[slot]]), {})


def _state_slots(tracer: Tracer) -> list[int]:
    """The slots of the state."""
    return [slot for name in tracer.formulation.design for slot in tracer.layout.vectors[name]]


def _past_slots(tracer: Tracer) -> list[int]:
    """The slots in which what was there at up to `NODES` samples, or in groups of lanes, is remembered."""
    return tracer.layout.vector(PAST, NODES * len(_state_slots(tracer)))


def _continued(tracer: Tracer, name: str, at: Callable[[int, int], Scalar], further: Mapping[int, Scalar]) -> Program:
    """The state by Lagrange's formula, without v and a; at(k, slot) is what a slot was at node k. And what else is put out."""
    weights = tracer.vector(WEIGHT, NODES)
    out = dict(further)
    for part, value in tracer.formulation.design.items():
        slots = tracer.layout.vector(part, len(value))
        found = [sum((w * at(k, slot) for k, w in enumerate(weights)), 0.0) for slot in slots]
        for label in (part, PREDICTED + part):
            tracer.store(out, label, _of_length_one(found))
    return program(name, tracer.tape, out, tracer.prepared)


def weights_of_groups(times: Array, lanes: int) -> Array:
    """Weights of `NODES` lanes of the group before, or several, for samples in groups of so many lanes.

    Args:
        times: of samples in the order in which they are gone through, shape (n,).

    Returns:
        Shape (NODES, n): zero for the first groups, not finite where two nodes share a time.
    """
    behind = groups_behind(lanes) * lanes
    found, wanted = np.zeros((NODES, len(times))), np.arange(behind, len(times))
    nodes = [[group * lanes + lane] for group, lane in (place_of(k, lanes) for k in range(NODES))]
    found[:, wanted] = _lagrange(times[wanted], times[wanted // lanes * lanes - behind + nodes])
    return found


def weights_of_samples(times: Array) -> Array:
    """Weights of the `NODES` samples before each, by the places at which they are kept (`Plan.past`); otherwise as above."""
    found, wanted = np.zeros((NODES, len(times))), np.arange(NODES, len(times))
    nodes = wanted - 1 - (wanted - 1 - np.arange(NODES)[:, None]) % NODES  # the last sample that was kept at each place
    found[:, wanted] = _lagrange(times[wanted], times[nodes])
    return found


def _lagrange(times: Array, nodes: Array) -> Array:
    """Lagrange's weights of nodes for the times, shape (n,), of both shape (NODES, n)."""
    found, ahead = np.empty_like(nodes), times - nodes
    with np.errstate(all="ignore"):
        for k, node in enumerate(nodes):  # one after the other: there may be millions of samples
            factors = ahead / (node - nodes)
            factors[k] = 1.0
            found[k] = factors.prod(axis=0)
    return found


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


def _of_length_one(value: list[Scalar]) -> list[Scalar]:
    """Euler parameters of length one, up to the square of what they lack; any other vector as it is."""
    if len(value) != EULER_PARAMETERS:
        return value
    k = 1.5 - 0.5 * sum((x * x for x in value), 0.0)
    return [k * x for x in value]
