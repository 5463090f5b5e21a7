"""Motion over the manifold of a joint, the poses that satisfy its equations: Newton's iteration to
reach it, small steps along it, and the branches that Newton's iteration reaches.

Small steps lead from the design to the poses of a specimen, so the poses are on the intended
branch. Motions through them have random admissible velocities and accelerations, from exact
derivatives of phi alone. The joint's own statements (rows, nu, gamma, branch) take no part in
either. Matrices are Jacobians of lanes, shape (lanes, rows, columns).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...joints import Joint
from ...trajectory import Array
from .findings import Finding, Limit, Verdict
from .traced_joint import COLUMNS, POSES, Place, TracedJoint

Mask = NDArray[np.bool_]
Motion = tuple[Array, Array, Array]
"""States, rates and accelerations, one pose a lane."""

# Newton is quadratic: a step below this value ends at round-off.
SETTLED = 1e-13
# Branches meet near a pose whose rows are closer to dependence than this part of their distance at
# design. Such a pose belongs to no branch.
NEARLY_SINGULAR = 0.1
# A step corrected by more than this part of itself may have left its branch, and is halved.
LARGEST_CORRECTION = 0.25
# A dependent row of size one leaves round-off (1e-15); an independent one, in sound geometry,
# leaves 1e-2.
DEPENDENT = 1e-9


def times(jacobian: Array, rate: Array) -> Array:
    """Multiply rows by rates, shapes (lanes, rows, columns), (columns, lanes) -> (rows, lanes)."""
    return np.einsum("lmn,nl->ml", jacobian, rate)


def min_norm(matrix: Array, right: Array, columns: slice = slice(None)) -> Array:
    """Return the smallest solutions of matrix x = right over the columns, rows scaled to
    the same size.

    Shapes (lanes, rows, columns), (rows, lanes) -> (columns, lanes).
    """
    even, size = _scale_rows(matrix)
    inverse = np.linalg.pinv(even[:, :, columns], rcond=DEPENDENT)
    return (inverse @ (right.T / size)[:, :, None])[:, :, 0].T


def admitted_rates(matrix: Array, wanted: Array, columns: slice = slice(None)) -> Array:
    """Return the part of the wanted rates admitted by the rows."""
    admitted = wanted.copy()
    admitted[columns] -= min_norm(matrix, times(matrix, wanted), columns)
    return admitted


def newton(
    joint: TracedJoint,
    state: Array,
    jacobian: Callable[[Array], Array],
    iterations: int,
    columns: slice = slice(None),
) -> tuple[Array, NDArray[np.int64]]:
    """Run Newton's iteration by smallest steps over the given columns; return the final states and
    the iterations until the steps vanish.

    A lane that does not converge has the allowed number of iterations plus one.
    """
    state = state.copy()
    taken = np.full(state.shape[1], iterations + 1)
    for k in range(iterations):
        active = np.flatnonzero(taken > iterations)
        if not len(active):
            break
        moving = state[:, active]
        step = np.zeros((joint.columns, len(active)))
        step[columns] = -min_norm(jacobian(moving), joint.phi(moving), columns)
        state[:, active] = joint.retract(moving, step)
        settled = np.abs(step).max(axis=0) < SETTLED
        taken[active[settled]] = k + 1
    return state, taken


def walk(
    joint: TracedJoint,
    start: Array,
    aims: Callable[[Array, Array], Array],
    steps: int,
    columns: slice = slice(None),
) -> list[Array]:
    """Take small steps over the manifold, each followed by a return to it; return the states after
    every step, the start first.

    A lane does not move if its step reaches a nearly singular pose or does not return to the
    manifold nearby. The next step of the lane is shorter.

    Args:
        aims: state, last step -> the wanted step (columns, lanes), projected onto the manifold.
    """
    states, share = [start], np.ones(start.shape[1])
    last = np.zeros((joint.columns, start.shape[1]))
    matrix = joint.exact(start)
    for _ in range(steps):
        state = states[-1]
        wanted = np.zeros_like(last)
        wanted[columns] = aims(state, last)[columns]
        last = admitted_rates(matrix, wanted, columns)
        step = share * last
        off = joint.retract(state, step)
        there, taken = newton(joint, off, joint.exact, 6, columns)
        corrected, length = (np.linalg.norm(each, axis=0) for each in (there - off, step))
        ahead = joint.exact(there)
        good = (taken <= 6) & (corrected <= LARGEST_CORRECTION * length + SETTLED)
        good &= regular(joint, ahead, columns)
        share = np.where(good, np.minimum(1.0, 2.0 * share), 0.5 * share)
        states.append(np.where(good, there, state))
        matrix = np.where(good[:, None, None], ahead, matrix)
    return states


def straight(directions: Array) -> Callable[[Array, Array], Array]:
    """Return aims that start in the given directions and then keep the
    direction of the last step.
    """

    def aims(_: Array, last: Array) -> Array:
        ahead = np.where(np.linalg.norm(last, axis=0) > 0.0, last, directions)
        return ahead * (STEP / np.linalg.norm(ahead, axis=0))

    return aims


def regular(joint: TracedJoint, matrix: Array, columns: slice = slice(None)) -> Mask:
    """Return which lanes have neither nearly dependent nor nearly zero rows, relative to
    the design position.
    """
    at_design = joint.exact_at_design[:, :, columns]
    _, size = _scale_rows(at_design)
    found, there = (
        _smallest(each / size[:, :, None]) for each in (matrix[:, :, columns], at_design)
    )
    return np.asarray(found > NEARLY_SINGULAR * there)


def smallest(matrix: Array) -> Array:
    """Return the distance of each lane's rows from dependence: the smallest singular value, rows
    scaled to size one, shape (lanes,).
    """
    return _smallest(_scale_rows(matrix)[0])


def _smallest(matrix: Array) -> Array:
    sizes = np.linalg.svd(np.nan_to_num(matrix), compute_uv=False)
    return np.asarray(sizes[:, -1], dtype=np.float64)


def rank(matrix: Array) -> NDArray[np.int64]:
    """Return the numerical rank of each lane's rows, shape (lanes,)."""
    return np.asarray(np.linalg.matrix_rank(_scale_rows(matrix)[0], tol=DEPENDENT), dtype=np.int64)


def _scale_rows(matrix: Array) -> tuple[Array, Array]:
    """Return the rows scaled to size one, and their sizes; zero rows stay, rows that are not
    finite become zero.
    """
    finite = np.where(np.isfinite(matrix).all(axis=2, keepdims=True), matrix, 0.0)
    size = np.linalg.norm(finite, axis=2)
    size = np.where(size > 0.0, size, 1.0)
    return finite / size[:, :, None], size


# Twelve steps of this length [rad, or units of the joint's size] lead far from the design.
STEP, STEPS = 0.15, 12
# Any joint must still be within its reach after this number of steps.
NEAR = 2


@dataclass(frozen=True, eq=False)
class Specimen:
    """A joint, its equations and motions admitted by the joint.

    Attributes:
        state: poses on the manifold, shape (size, lanes), in the layout of `TracedJoint`.
        near: earlier poses of the walk, near the design.
        rate, acceleration: an admissible motion through each pose, shape (columns, lanes).
        exact: the Jacobian of phi at each pose, shape (lanes, rows, columns).
    """

    joint: Joint
    place: Place
    traced: TracedJoint
    near: Array
    state: Array
    rate: Array
    acceleration: Array
    exact: Array
    rng: np.random.Generator

    @property
    def motion(self) -> Motion:
        """The poses with their rates and accelerations."""
        return self.state, self.rate, self.acceleration

    @property
    def lanes(self) -> int:
        """Number of poses."""
        return self.state.shape[1]


def moved_specimen(joint: Joint, place: Place, lanes: int, rng: np.random.Generator) -> Specimen:
    """Return the joint with random poses and motions on its manifold, one of each a lane.

    Raises:
        MechanismError, or any error of the joint's own code: the equations cannot be traced.
    """
    traced = TracedJoint(joint, place)
    directions = rng.normal(size=(traced.columns, lanes))
    start, _ = newton(traced, traced.design(lanes), traced.exact, 10)
    way = walk(traced, start, straight(directions), STEPS)
    state = way[-1]
    exact = traced.exact(state)
    rate = admitted_rates(exact, rng.normal(size=directions.shape))
    bent = traced.jets(state, rate, np.zeros_like(rate))[2]
    acceleration = admitted_rates(exact, rng.normal(size=rate.shape)) - min_norm(exact, bent)
    return Specimen(joint, place, traced, way[NEAR], state, rate, acceleration, exact, rng)


# A pose is on the intended branch if small steps over the manifold lead from it to the design, or
# to a pose reached by small steps from the design. No step crosses a pose with nearly dependent
# rows: branches meet there.

ITERATIONS = 60
CLOSED = 1e-11
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
UNCAUGHT = Limit(0.0, "each zero is on the intended branch, or a test says so")


def branches(s: Specimen, starts: int) -> Iterator[Finding]:
    """Run Newton with the declared rows from random poses of body j, and yield the outcome of all
    starts: the intended branch, another one refused by the joint's branch tests, or another one
    that they accept.
    """
    t, rng = s.traced, s.rng
    state = t.design(starts)
    state[SHIFT] = rng.normal(size=(3, starts))
    q = rng.normal(size=(4, starts))
    state[TURN] = q * np.sign(q[0]) / np.linalg.norm(q, axis=0)
    state[POSES:] = rng.normal(size=(t.size - POSES, starts))
    ended, taken = newton(t, state, t.rows, ITERATIONS, MOVING)
    off = np.abs(t.phi(ended)).max(axis=0, initial=0.0)
    closed = (taken <= ITERATIONS) & (off < CLOSED) & regular(t, t.exact(ended), MOVING)
    caught, right = closed & (t.branch(ended) <= 0.0), np.zeros(starts, dtype=bool)
    asked = closed & ~caught
    right[asked] = lie_on_branch(s, ended[:, asked])
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
    count = int(uncaught.sum())
    if count:
        k = int(np.flatnonzero(uncaught)[0])
        turn, shift = (
            ", ".join(f"{x:.3g}" for x in ended[part, k] * unit)
            for part, unit in ((TURN, 1.0), (SHIFT, s.place.unit))
        )
        text += f"; one of them has body j at Euler parameters [{turn}], displacement [{shift}] m: "
        text += "give the primitive a branch test that is positive on the intended branch only"
    verdict = Verdict.FAIL if count else Verdict.PASS
    yield Finding("spurious branches", verdict, float(count), *UNCAUGHT, message=text)


def lie_on_branch(s: Specimen, state: Array) -> Mask:
    """Return whether each pose is on the intended branch."""
    t = s.traced
    directions = s.rng.normal(size=(t.columns, WALKS))
    directions[:COLUMNS] = 0.0
    there = _reach_aim(t, state, np.repeat(t.design(1), state.shape[1], axis=1))
    if there.all():
        return there
    known = np.concatenate(walk(t, t.design(WALKS), straight(directions), STRIDES, MOVING), axis=1)
    for k in range(AIMS):
        astray = np.flatnonzero(~there)
        if len(astray):
            any_of_them = s.rng.integers(known.shape[1], size=len(astray))
            aims = any_of_them if k else _distances(state[:, astray], known).argmin(axis=1)
            there[astray] = _reach_aim(t, state[:, astray], known[:, aims])
    return there


def _reach_aim(t: TracedJoint, state: Array, aim: Array) -> Mask:
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
