"""Ways over the manifold of a joint, the poses where its equations hold: to it by Newton's
iteration, over it by small steps.

Matrices are Jacobians of lanes, shape (lanes, rows, columns).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...trajectory import Array
from .traced import TracedJoint

Mask = NDArray[np.bool_]

# Newton is quadratic: a step below this ends at round-off.
SETTLED = 1e-13
# A pose whose rows are nearer to dependence than this part of their distance at design is on no
# branch but between two.
NEARLY_SINGULAR = 0.1
# A step that has to be corrected by more than this part of itself may have left its branch; it is
# halved.
LARGEST_CORRECTION = 0.25
# What is left of a dependent row of size one is round-off (1e-15); of an independent one, in sound
# geometry, 1e-2.
DEPENDENT = 1e-9


def design(joint: TracedJoint, lanes: int) -> Array:
    """The design position, in all lanes."""
    state = np.zeros((joint.size, lanes))
    state[[3, 10]] = 1.0
    return state


def min_norm(matrix: Array, right: Array, columns: slice = slice(None)) -> Array:
    """The smallest solutions of matrix x = right over the columns, rows brought to the same size.

    Shapes (lanes, rows, columns), (rows, lanes) -> (columns, lanes).
    """
    even, size = _even(matrix)
    return (np.linalg.pinv(even[:, :, columns], rcond=DEPENDENT) @ (right.T / size)[:, :, None])[
        :, :, 0
    ].T


def newton(
    joint: TracedJoint,
    state: Array,
    jacobian: Callable[[Array], Array],
    iterations: int,
    columns: slice = slice(None),
) -> tuple[Array, NDArray[np.int64]]:
    """Newton's iteration by smallest steps over the given columns: where it ends, and iterations
    until the steps vanish.

    A lane that does not settle has as many iterations as were allowed, plus one.
    """
    state = state.copy()
    taken = np.full(state.shape[1], iterations + 1)
    for k in range(iterations):
        active = np.flatnonzero(taken > iterations)
        if not len(active):
            break
        here = state[:, active]
        step = np.zeros((joint.columns, len(active)))
        step[columns] = -min_norm(jacobian(here), joint.phi(here), columns)
        state[:, active] = joint.retract(here, step)
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
    """Small steps over the manifold, each followed by a return to it: the states after every step,
    the start first.

    A lane stays where it is if its step would reach a nearly singular pose, or does not return to
    the manifold nearby; its next step is shorter.

    Args:
        aims: state, last step -> the step wanted (columns, lanes); its part along the manifold is
            taken.
    """
    states, share, last = (
        [start],
        np.ones(start.shape[1]),
        np.zeros((joint.columns, start.shape[1])),
    )
    for _ in range(steps):
        here = states[-1]
        step, matrix = np.zeros((joint.columns, here.shape[1])), joint.exact(here)
        step[columns] = aims(here, last)[columns]
        step[columns] -= min_norm(matrix, np.einsum("lmn,nl->ml", matrix, step), columns)
        last, step = step, share * step
        off = joint.retract(here, step)
        there, taken = newton(joint, off, joint.exact, 6, columns)
        near = (
            np.linalg.norm(there - off, axis=0)
            <= LARGEST_CORRECTION * np.linalg.norm(step, axis=0) + SETTLED
        )
        good = (taken <= 6) & near & regular(joint, there, columns)
        share = np.where(good, np.minimum(1.0, 2.0 * share), 0.5 * share)
        states.append(np.where(good, there, here))
    return states


def straight(directions: Array, length: float) -> Callable[[Array, Array], Array]:
    """Aims that start in the given directions and go straight on, as far as the manifold is
    straight.
    """

    def aims(_: Array, last: Array) -> Array:
        ahead = np.where(np.linalg.norm(last, axis=0) > 0.0, last, directions)
        return ahead * (length / np.linalg.norm(ahead, axis=0))

    return aims


def regular(joint: TracedJoint, state: Array, columns: slice = slice(None)) -> Mask:
    """Lanes whose rows are not nearly dependent, and none nearly zero, by the measure of the design
    position.
    """
    at_design = joint.exact(design(joint, 1))[:, :, columns]
    size = np.linalg.norm(at_design, axis=2, keepdims=True)
    size = np.where(size > 0.0, size, 1.0)
    return np.asarray(
        _smallest(joint.exact(state)[:, :, columns] / size)
        > NEARLY_SINGULAR * _smallest(at_design / size)
    )


def smallest(matrix: Array) -> Array:
    """How far the rows of each lane are from dependence: the smallest singular value, rows brought
    to size one, shape (lanes,).
    """
    return _smallest(_even(matrix)[0])


def _smallest(matrix: Array) -> Array:
    singular: Array = np.asarray(
        np.linalg.svd(np.nan_to_num(matrix), compute_uv=False), dtype=np.float64
    )
    return singular[:, -1]


def rank(matrix: Array) -> NDArray[np.int64]:
    """Numerical rank of the rows of each lane, shape (lanes,)."""
    return np.asarray(np.linalg.matrix_rank(_even(matrix)[0], tol=DEPENDENT))


def _even(matrix: Array) -> tuple[Array, Array]:
    """The rows brought to size one, and their sizes; a row of zeros stays, one that is not finite
    becomes zeros.
    """
    finite = np.where(np.isfinite(matrix).all(axis=2, keepdims=True), matrix, 0.0)
    size = np.linalg.norm(finite, axis=2)
    size = np.where(size > 0.0, size, 1.0)
    return finite / size[:, :, None], size
