"""Newton's iteration, rates and tests of a sparse system at several poses, in two ways.

`ChosenPivots` has factors of its own for each pose (SuperLU). `FixedOrder` has the poses in the
lanes of vectors, and eliminates in an order made for one pose: several times as fast, by machine
code only, and not where the factors grow in that order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ...trajectory import Array
from ..compiled.request import MAX_ITERATIONS
from ..formulation.acceptance_criteria import EPSILON
from ..structure.sparse_lu import PIVOT_THRESHOLD, Factors, SingularError
from .sparse_equations import POSES, Rows, SparseEquations, distance
from .tables import SparseTables

# An iteration with old factors costs half of one with new ones, or less; it is worth it where it
# gains two digits.
CONTRACTS = 1e-2
# Residuals below this, some round-offs in rows of size one, are as small as they get; elsewhere an
# iteration that gains less than a digit though its factors are new shows that they are.
SETTLED, STALLS = 1e-15, 0.1
# The largest entry of L that is believed. SuperLU allows a fifth of it: most of a digit of the
# rates may be lost. Twice as much lost more than the library's conditions explain, eight samples at
# a time, and saved no order of large mechanisms.
GROWTH = 5.0 / PIVOT_THRESHOLD


@dataclass(frozen=True, eq=False)
class Solved:
    """Poses after Newton's iteration, shape (numbers, poses) or (poses,).

    Attributes:
        state, rates, accelerations: of the poses.
        iterations, done: how many, and whether they ended.
        closure, leftover, branch: largest residual of the solved and of the redundant rows,
            smallest branch test.
        pivot: smallest pivot.
        orientation, sigmas: of the blocks, see `Blocks`; sigmas have shape (poses, blocks).
        believed: whether the factors are good enough.
    """

    state: Array
    rates: Array
    accelerations: Array
    iterations: Array
    done: NDArray[np.bool_]
    closure: Array
    leftover: Array
    branch: Array
    pivot: Array
    orientation: list[bytes]
    sigmas: Array
    believed: NDArray[np.bool_]


class Motion(NamedTuple):
    """Residuals, rates and accelerations at several poses, and solutions by their factors, of
    tables of shape (unknowns, poses).
    """

    residual: Array
    rates: Array
    accelerations: Array
    solve: Callable[[Array], Array]
    solve_transposed: Callable[[Array], Array]


class Poses(Protocol):
    """A way to solve several poses at once."""

    @property
    def width(self) -> int:
        """How many poses."""
        ...

    def moved(self, state: Array, step: Array) -> Array:
        """Return the states after steps of the unknowns, shape (numbers, width) each."""
        ...

    def solve(self, state: Array, drives: Array, tol: float, count: int) -> Solved:
        """Solve from predicted states, shape (numbers, width); the first `count` are wanted."""
        ...

    def motion(self, state: Array, drives: Array) -> Motion:
        """Return the motion at states, shape (numbers, width); NaN where it is singular."""
        ...


class ChosenPivots:
    """See `Poses`."""

    width = POSES

    def __init__(self, model: SparseEquations, rows: Rows) -> None:
        self._model, self._rows = model, rows
        self.moved = model.moved

    def solve(self, state: Array, drives: Array, tol: float, count: int) -> Solved:
        """See `Poses`."""
        model, rows, elements = self._model, self._rows, self._model.elements
        state, iterations, done = self._iterated(state, drives, tol, count)
        closure = model.residuals(rows)
        factors = [self._factors(k) if np.isfinite(closure[k]) else None for k in range(count)]
        rates, accelerations = model.motion(rows, factors)
        regular = {k: each for k, each in enumerate(factors) if each is not None}
        pivot, orientation = np.zeros(count), [b""] * count
        sigmas, believed = np.full((count, rows.blocks.count), np.nan), np.zeros(count, np.bool_)
        if regular:
            found, sigmas[[*regular]] = model.tests(rows, regular)
            for (k, each), sign in zip(regular.items(), found, strict=True):
                pivot[k], orientation[k], believed[k] = abs(each.signed_pivot), sign, True
        return Solved(
            state[:, :count],
            rates[:, :count],
            accelerations[:, :count],
            iterations[:count],
            done[:count],
            closure[:count],
            np.abs(elements.phi[rows.dropped, :count]).max(axis=0, initial=0.0),
            elements.branch[:, :count].min(axis=0, initial=1.0),
            pivot,
            orientation,
            sigmas,
            believed,
        )

    def motion(self, state: Array, drives: Array) -> Motion:
        """See `Poses`."""
        model, rows = self._model, self._rows
        model.evaluate(state, drives)
        residual = model.residuals(rows)
        factors = [self._factors(k) for k in range(POSES)]

        def solved(name: str, b: Array) -> Array:
            nothing = np.full(len(b), np.nan)
            found = [getattr(x, name)(b[:, k]) if x else nothing for k, x in enumerate(factors)]
            return np.stack(found, axis=1)

        solve, transposed = (partial(solved, name) for name in ("solve", "solve_transposed"))
        return Motion(residual, *model.motion(rows, factors), solve, transposed)

    def _factors(self, k: int) -> Factors | None:
        try:
            return self._model.factor(self._rows, k)
        except SingularError:
            return None

    def _iterated(
        self, state: Array, drives: Array, tol: float, count: int
    ) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Newton's iteration: the states, how many iterations, and of which poses it ended."""
        model, rows = self._model, self._rows
        model.evaluate(state, drives)
        residual, rate, iterations = model.residuals(rows), np.full(POSES, np.inf), np.zeros(POSES)
        done = residual <= SETTLED
        factors: list[Factors | None] = [None] * POSES
        for _ in range(MAX_ITERATIONS):
            active = [k for k in range(count) if not done[k] and np.isfinite(residual[k])]
            if not active:
                break
            step, renewed = np.zeros((len(rows.kept), POSES)), ~(rate <= CONTRACTS)
            for k in active:
                factors[k] = each = self._factors(k) if renewed[k] else factors[k]
                step[:, k] = -each.solve(model.elements.phi[rows.kept, k]) if each else np.nan
            state = model.moved(state, step)
            model.evaluate(state, drives)
            last, residual = residual, model.residuals(rows)
            rate = residual / last
            iterations[active] += 1.0
            done |= (residual <= SETTLED) | (renewed & (residual <= tol) & (rate > STALLS))
        return state, iterations, done


class FixedOrder:
    """See `Poses`."""

    MOST = 6
    """Iterations at most: what needs more is better predicted from nearer by."""

    def __init__(self, model: SparseEquations, rows: Rows) -> None:
        self._rows, self._tables = rows, SparseTables(model.elements, model.bodies)
        self.width = self._tables.width
        self.order(model)

    def order(self, model: SparseEquations) -> None:
        """Use the elimination order of the model's first last evaluated pose from now on."""
        tables, rows = self._tables, self._rows
        factors = model.factor(rows, 0)
        found = rows.order.places(factors)
        tables.order(found, rows.solved, rows.kept[np.argsort(found.row)])
        tables["results"][:] = model.elements.results[:, :1]
        tables.factor()
        # the sign of the determinant is that of the model's factors, or always the opposite
        self._sign = np.sign(factors.signed_pivot) * np.sign(tables.pivots).prod(axis=0)

    def moved(self, state: Array, step: Array) -> Array:
        """See `Poses`."""
        tables = self._tables
        tables["state"][:], tables["step"][:] = state, step
        tables.move()
        return tables["state"].copy()

    def solve(self, state: Array, drives: Array, tol: float, count: int) -> Solved:
        """See `Poses`."""
        tables, rows = self._tables, self._rows
        tables["state"][:], tables["drives"][:] = state, drives
        closure, iterations, done = self._iterated(tol)
        tables.motion()
        pivots = tables.pivots
        entries = tables["entries"].take(rows.solved, axis=0)
        leftover: Array = np.abs(tables["phi"].take(rows.dropped, axis=0)).max(axis=0, initial=0.0)
        orientation = rows.blocks.orientation(entries, self._sign * np.sign(pivots).prod(axis=0))
        return Solved(
            tables["state"][:, :count].copy(),
            tables["rates"][:, :count].copy(),
            tables["accelerations"][:, :count].copy(),
            np.full(count, float(iterations)),
            done[:count],
            closure[:count],
            leftover[:count],
            tables["branch"][:, :count].min(axis=0, initial=1.0),
            np.abs(pivots).min(axis=0)[:count],
            orientation[:count],
            rows.blocks.sigmas(entries, tables.solve, tables.solve_transposed)[:count],
            (tables.growth <= GROWTH)[:count],
        )

    def motion(self, state: Array, drives: Array) -> Motion:
        """See `Poses`."""
        tables = self._tables
        tables["state"][:], tables["drives"][:] = state, drives
        residual = self._evaluated()
        tables.motion()
        rates, accelerations = tables["rates"].copy(), tables["accelerations"].copy()
        return Motion(residual, rates, accelerations, tables.solve, tables.solve_transposed)

    def _iterated(self, tol: float) -> tuple[Array, int, NDArray[np.bool_]]:
        """Newton's iteration from the state there is: residuals, how many iterations, and of which
        lanes it ended.
        """
        residual, iterations = self._evaluated(), 0
        rate, done = np.full(self.width, np.inf), residual <= SETTLED
        while iterations < self.MOST and not done.all():
            renewed = not (rate[~done] <= CONTRACTS).all()
            if renewed:
                self._tables.factor()
            self._tables.newton()
            last, residual = residual, self._evaluated()
            rate, iterations = residual / last, iterations + 1
            done |= (residual <= SETTLED) | (renewed & (residual <= tol) & (rate > STALLS))
        return residual, iterations, done

    def _evaluated(self) -> Array:
        self._tables.evaluate()
        return np.abs(self._tables["phi"].take(self._rows.kept, axis=0)).max(axis=0)


# Steps of inverse iteration: each divides what is left of other directions by the square of how
# much better they are determined.
STEPS = 3


def error_bounds(poses: Poses, state: Array, drives: Array, scale: Array, order: int) -> Array:
    """Return bounds of the errors of poses [of the mechanism's size] and of their rates and
    accelerations [of their own], as far as the order wants them; NaN at singular poses.

    Each pose is displaced as far as its residuals allow, in the direction least determined by the
    rows. The smallest singular value alone would put all samples of a large ring in doubt, although
    they are known well.

    Args:
        state, drives: shape (numbers, n), for any number of poses.
        scale: see `distance`.
    """
    n, found = state.shape[1], list[Array]()
    for first in range(0, n, poses.width):
        some = np.minimum(first + np.arange(poses.width), n - 1)
        found.append(_error_bounds(poses, state[:, some], drives[:, some], scale, order))
    return np.concatenate(found)[:n]


def _error_bounds(poses: Poses, state: Array, drives: Array, scale: Array, order: int) -> Array:
    with np.errstate(all="ignore"):  # what overflows is no number
        here = poses.motion(state, drives)
        left = np.ones(here.rates.shape)
        for _ in range(STEPS):
            left = here.solve_transposed(here.solve(left / np.abs(left).max(axis=0)))
        step = here.solve(np.maximum(here.residual, EPSILON) * np.sign(left))
        moved = poses.moved(state, step)
        there = poses.motion(moved, drives)
        speed, acceleration = (np.abs(each).max(axis=0) for each in here[1:3])
        sizes = speed, np.maximum(acceleration, speed**2)
        off = [
            np.abs(a - b).max(axis=0) / np.where(size == 0.0, 1.0, size)
            for a, b, size in zip(there[1:3], here[1:3], sizes, strict=True)
        ]
        return np.max([distance(moved - state, scale), *off][: order + 1], axis=0)
