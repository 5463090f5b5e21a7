"""The branches reached by Newton's iteration from random poses: the intended branch of a joint's
zeros, another one refused by its branch tests, or another one that they accept.

A pose is on the intended branch if small steps over the manifold lead from it to the design, or to
a pose reached by small steps from the design. No step crosses a pose with nearly dependent rows:
branches meet there.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...trajectory import Array
from ..findings import Finding, Verdict
from .checks import STEP, Specimen
from .manifold import Mask, design, newton, regular, straight, walk
from .traced import COLUMNS, POSES, TracedJoint

ITERATIONS = 60
# Body i stays at design; body j and the joint's coordinates move.
MOVING = slice(COLUMNS, None)
SHIFT, TURN = slice(7, 10), slice(10, POSES)
# Walks from the design; their poses are the aims of the other walks.
WALKS, STRIDES = 48, 24
# Steps of a leg, largest number of legs, and the smallest progress of a leg: with less, the walk is
# abandoned.
STRIDE, LEGS, PROGRESS = 6, 12, 0.2 * STEP
# A pose may be on the branch although the straight path to its aim is blocked: this number of
# further aims is tried.
AIMS = 24
ARRIVED = STEP


def branches(s: Specimen, starts: int) -> Iterator[Finding]:
    """Run Newton with the declared rows from random poses of body j, and yield the outcome
    of all starts.
    """
    t, rng = s.traced, s.rng
    state = design(t, starts)
    state[SHIFT] = rng.normal(size=(3, starts))
    q = rng.normal(size=(4, starts))
    state[TURN] = q * np.sign(q[0]) / np.linalg.norm(q, axis=0)
    state[POSES:] = rng.normal(size=(t.size - POSES, starts))
    ended, taken = newton(t, state, t.rows, ITERATIONS, MOVING)
    closed = (
        (taken <= ITERATIONS)
        & (np.abs(t.phi(ended)).max(axis=0, initial=0.0) < 1e-11)
        & regular(t, ended, MOVING)
    )
    caught, right = closed & (t.branch(ended) <= 0.0), np.zeros(starts, dtype=bool)
    asked = closed & ~caught
    right[asked] = connected(s, ended[:, asked])
    uncaught = asked & ~right
    counts = {
        "right": right,
        "caught by a branch test": caught,
        "uncaught": uncaught,
        "not converged": ~closed,
    }
    text = f"Newton from {starts} poses anywhere: " + ", ".join(
        f"{mask.sum()} {name}" for name, mask in counts.items()
    )
    if uncaught.any():
        k = int(np.flatnonzero(uncaught)[0])
        turn, shift = (
            ", ".join(f"{x:.3g}" for x in ended[part, k] * unit)
            for part, unit in ((TURN, 1.0), (SHIFT, s.place.unit))
        )
        text += f"; one of them has body j at Euler parameters [{turn}], displacement [{shift}] m: "
        text += "give the primitive a branch test that is positive on the intended branch only"
    count = float(uncaught.sum())
    verdict = Verdict.FAIL if count else Verdict.PASS
    yield Finding(
        "spurious branches",
        verdict,
        count,
        0.0,
        "each zero is on the intended branch, or a test says so",
        message=text,
    )


def connected(s: Specimen, state: Array) -> Mask:
    """Return whether each pose is on the intended branch."""
    t = s.traced
    directions = s.rng.normal(size=(t.columns, WALKS))
    directions[:COLUMNS] = 0.0
    there = _led(t, state, np.repeat(design(t, 1), state.shape[1], axis=1))
    if there.all():
        return there
    known = np.concatenate(
        walk(t, design(t, WALKS), straight(directions, STEP), STRIDES, MOVING), axis=1
    )
    for k in range(AIMS):
        astray = np.flatnonzero(~there)
        if len(astray):
            any_of_them = s.rng.integers(known.shape[1], size=len(astray))
            aims = any_of_them if k else _distances(state[:, astray], known).argmin(axis=1)
            there[astray] = _led(t, state[:, astray], known[:, aims])
    return there


def _led(t: TracedJoint, state: Array, aim: Array) -> Mask:
    """Return whether small steps over the manifold lead from each pose to its aim."""
    there, state = np.zeros(state.shape[1], dtype=bool), state.copy()
    waiting = np.flatnonzero(~there)
    for _ in range(LEGS):
        goal = aim[:, waiting]
        before = state[:, waiting]

        def towards(here: Array, _: Array, goal: Array = goal) -> Array:
            step = difference(t, here, goal)
            return step * np.minimum(1.0, STEP / np.maximum(np.linalg.norm(step, axis=0), 1e-300))

        after = walk(t, before, towards, STRIDE, MOVING)[-1]
        state[:, waiting] = after
        left, advance = (np.linalg.norm(difference(t, a, goal), axis=0) for a in (after, before))
        there[waiting] = left < ARRIVED
        waiting = waiting[(left >= ARRIVED) & (advance - left > PROGRESS)]
        if not len(waiting):
            break
    return there


def difference(t: TracedJoint, state: Array, aim: Array) -> Array:
    """Return the step of body j and of the coordinates from a state to an aim, its rotation by its
    sine, shape (columns, lanes).
    """
    step = np.zeros((t.columns, state.shape[1]))
    a0, a, b0, b = aim[10], aim[11:14], state[10], state[11:14]
    # vector and scalar part of aim times the conjugate of the state
    turn, cosine = -a0 * b + b0 * a - np.cross(a, b, axis=0), a0 * b0 + (a * b).sum(axis=0)
    step[6:9] = aim[7:10] - state[7:10]
    step[9:12] = 2.0 * np.where(cosine < 0.0, -turn, turn)
    step[12:] = aim[POSES:] - state[POSES:]
    return step


def _distances(state: Array, known: Array) -> Array:
    """Return the squared distances by pose and known pose."""
    a, b = state[:, :, None], known[:, None, :]
    cosine = (a[10:14] * b[10:14]).sum(axis=0)
    return np.asarray(
        ((a[7:10] - b[7:10]) ** 2).sum(axis=0)
        + 4.0 * (1.0 - cosine**2)
        + ((a[POSES:] - b[POSES:]) ** 2).sum(axis=0)
    )
