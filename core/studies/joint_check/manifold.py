"""Motion over the manifold of a joint, the poses that satisfy its equations: Newton's iteration to
reach it, small steps along it.

Matrices are Jacobians of lanes, shape (lanes, rows, columns).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...trajectory import Array
from .traced import TracedJoint

Mask = NDArray[np.bool_]

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


def design(joint: TracedJoint, lanes: int) -> Array:
    """Return the design position in all lanes."""
    state = np.zeros((joint.size, lanes))
    state[[3, 10]] = 1.0
    return state


def min_norm(matrix: Array, right: Array, columns: slice = slice(None)) -> Array:
    """Return the smallest solutions of matrix x = right over the columns, rows scaled to
    the same size.

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
    """Take small steps over the manifold, each followed by a return to it; return the states after
    every step, the start first.

    A lane does not move if its step reaches a nearly singular pose or does not return to the
    manifold nearby. The next step of the lane is shorter.

    Args:
        aims: state, last step -> the wanted step (columns, lanes), projected onto the manifold.
    """
    states, share, last = (
        [start],
        np.ones(start.shape[1]),
        np.zeros((joint.columns, start.shape[1])),
    )
    matrix, at_design = joint.exact(start), joint.exact(design(joint, 1))
    for _ in range(steps):
        here = states[-1]
        step = np.zeros((joint.columns, here.shape[1]))
        step[columns] = aims(here, last)[columns]
        step[columns] -= min_norm(matrix, np.einsum("lmn,nl->ml", matrix, step), columns)
        last, step = step, share * step
        off = joint.retract(here, step)
        there, taken = newton(joint, off, joint.exact, 6, columns)
        near = (
            np.linalg.norm(there - off, axis=0)
            <= LARGEST_CORRECTION * np.linalg.norm(step, axis=0) + SETTLED
        )
        ahead = joint.exact(there)
        good = (taken <= 6) & near & _regular(ahead, at_design, columns)
        share = np.where(good, np.minimum(1.0, 2.0 * share), 0.5 * share)
        states.append(np.where(good, there, here))
        matrix = np.where(good[:, None, None], ahead, matrix)
    return states


def straight(directions: Array, length: float) -> Callable[[Array, Array], Array]:
    """Return aims that start in the given directions and then keep the
    direction of the last step.
    """

    def aims(_: Array, last: Array) -> Array:
        ahead = np.where(np.linalg.norm(last, axis=0) > 0.0, last, directions)
        return ahead * (length / np.linalg.norm(ahead, axis=0))

    return aims


def regular(joint: TracedJoint, state: Array, columns: slice = slice(None)) -> Mask:
    """Return which lanes have neither nearly dependent nor nearly zero rows, relative to
    the design position.
    """
    return _regular(joint.exact(state), joint.exact(design(joint, 1)), columns)


def _regular(matrix: Array, at_design: Array, columns: slice) -> Mask:
    size = np.linalg.norm(at_design[:, :, columns], axis=2, keepdims=True)
    size = np.where(size > 0.0, size, 1.0)
    return np.asarray(
        _smallest(matrix[:, :, columns] / size)
        > NEARLY_SINGULAR * _smallest(at_design[:, :, columns] / size)
    )


def smallest(matrix: Array) -> Array:
    """Return the distance of each lane's rows from dependence: the smallest singular value, rows
    scaled to size one, shape (lanes,).
    """
    return _smallest(_even(matrix)[0])


def _smallest(matrix: Array) -> Array:
    singular: Array = np.asarray(
        np.linalg.svd(np.nan_to_num(matrix), compute_uv=False), dtype=np.float64
    )
    return singular[:, -1]


def rank(matrix: Array) -> NDArray[np.int64]:
    """Return the numerical rank of each lane's rows, shape (lanes,)."""
    return np.asarray(np.linalg.matrix_rank(_even(matrix)[0], tol=DEPENDENT), dtype=np.int64)


def _even(matrix: Array) -> tuple[Array, Array]:
    """Return the rows scaled to size one, and their sizes; zero rows stay, rows that are not
    finite become zero.
    """
    finite = np.where(np.isfinite(matrix).all(axis=2, keepdims=True), matrix, 0.0)
    size = np.linalg.norm(finite, axis=2)
    size = np.where(size > 0.0, size, 1.0)
    return finite / size[:, :, None], size
