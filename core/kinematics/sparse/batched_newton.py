"""Several samples of a sparse system at once, each in a lane of vectors.

A group of samples is predicted by the polynomial through the last eight, at first by a Taylor step,
and solved by Newton's iteration with factors in an order made for one pose. The acceptance criteria
are those of `SparseModel.reach`, and fewer samples near singular poses meet them: no pivots are
chosen here. Samples are accepted up to the first refused one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...program import before
from ...trajectory import Array
from ..compiled.interpolation import lagrange
from ..structure.sparse_lu import PIVOT_THRESHOLD
from .sparse_equations import SparseEquations
from .step_state import CONTRACTS, SETTLED, STALLS, Poses, Stand, distance, lacked
from .tables import SparseTables

REMEMBERED = 8
"""Samples that the next ones are predicted from: extrapolated by as many again, their rounding
errors grow to 1e-12.
"""
ITERATIONS = 6
"""At most: what needs more is better predicted from the samples before it."""
GROWTH = 5.0 / PIVOT_THRESHOLD
"""The largest entry of L that is believed. SuperLU allows a fifth of it: most of a digit of the
rates may be lost. Twice as much lost more than the library's conditions explain, eight samples at a
time, and saved no order of large mechanisms."""


class Batch:
    """Samples of a model, one for each lane of a vector.

    Attributes:
        width: number of samples.
        outgrown: whether a sample was refused only because its factors grew in the present order:
            another order would serve it.
    """

    def __init__(self, model: SparseEquations) -> None:
        # not the model, which keeps this: what refers to each other stays in memory until somebody
        # looks for it
        self._kept, self._dropped, self._solved = model.kept, model.dropped, model.solved
        self._angles = model.angles
        self._blocks, self._scale, self._tables = (
            model.blocks,
            model.scale,
            SparseTables(model.elements, model.bodies),
        )
        self.width = self._tables.width
        self.order(model)

    def order(self, model: SparseEquations) -> None:
        """Use the elimination order of the model's last evaluated pose from now on."""
        tables, self.outgrown = self._tables, False
        model.factors.update(model.elements.entries[model.solved])
        model.factors.factor()
        found = model.factors.ordered
        tables.order(found, model.solved[found.entries], model.kept[np.argsort(found.row)])
        tables["results"][:] = model.elements.results[:, None]
        tables.factor()
        # the sign of the determinant is that of the model's factors, or always the opposite
        self._sign = np.sign(model.factors.signed_pivot) * np.sign(tables.pivots).prod(axis=0)

    def reach(self, known: Sequence[Stand], times: Array, drives: Array, tol: float) -> list[Stand]:
        """Follow a motion to the next samples, up to the first refused one.

        Args:
            known: the last `REMEMBERED` poses at different times, or all if fewer, the present one
                last.
            times, drives: of the samples, one or more; those beyond a group are left out.
            tol: largest accepted residual.
        """
        count, here, tables = min(len(times), self.width), known[-1], self._tables
        lanes = np.minimum(np.arange(self.width), count - 1)
        times, tables["drives"][:] = times[lanes], drives[:, lanes]
        earlier = np.append(here.time, times[:-1])
        with np.errstate(all="ignore"):  # lanes that diverge are found by their residuals
            self._predict(known, times)
            closure, iterations, done = self._iterated(tol)
            tables.motion()
            state, rates, accelerations = (
                tables["state"].copy(),
                tables["rates"].copy(),
                tables["accelerations"].copy(),
            )
            leftover: Array = np.abs(tables["phi"].take(self._dropped, axis=0)).max(
                axis=0, initial=0.0
            )
            branch: Array = tables["branch"].min(axis=0, initial=1.0)
            (pivot, turned), sigmas = self._pivots(here), self._sigmas()
            past = before(state, here.state)
            taylor = self._taylor(
                past,
                before(rates, here.rates),
                before(accelerations, here.accelerations),
                times - earlier,
            )
            gap, step = distance(state - taylor, self._scale), distance(state - past, self._scale)
            angles = tables["drives"][self._angles]
            turn = np.abs(angles - before(angles, here.turns)).max(axis=0, initial=0.0)
            poses = Poses(
                done,
                closure,
                leftover,
                branch,
                gap,
                step,
                turn,
                pivot,
                chosen=False,
                turned=turned,
                sigmas=sigmas,
            )
            sure = np.logical_and.reduce([*poses.passed(here, tol).values()])
            small = tables.growth <= GROWTH
        accepted = int(np.logical_and.accumulate((sure & small)[:count]).sum())
        self.outgrown = accepted < count and bool(sure[accepted])
        remembered = poses.remembered(here)
        return [
            Stand(
                *(float(times[k]), float(earlier[k])),
                *(state[:, k], taylor[:, k], rates[:, k], accelerations[:, k], angles[:, k]),
                *(iterations, float(closure[k]), float(leftover[k]), float(branch[k])),
                *(float(pivot[k]), here.largest_pivot, here.orientation, *remembered[k]),
            )
            for k in range(accepted)
        ]

    def _pivots(self, here: Stand) -> tuple[Array, NDArray[np.bool_]]:
        """Return the smallest pivot of each pose, and whether its orientation differs from the
        present pose's, by the last factors.
        """
        pivots = self._tables.pivots
        entries = self._tables["entries"].take(self._solved, axis=0)
        orientation = self._blocks.orientation(entries, self._sign * np.sign(pivots).prod(axis=0))
        return np.abs(pivots).min(axis=0), np.array(
            [each != here.orientation for each in orientation]
        )

    def _sigmas(self) -> Array:
        """Return the sigmas of `SparseModel` by the last factors."""
        if not len(self._dropped):
            return np.abs(self._tables.pivots).min(axis=0)[:, None]
        tables = self._tables
        return self._blocks.sigmas(
            tables["entries"].take(self._solved, axis=0), tables.solve, tables.solve_transposed
        )

    def _predict(self, before: Sequence[Stand], times: Array) -> None:
        """Predict by the polynomial through the last samples, or by a Taylor step with the error of
        the last one.
        """
        here = before[-1]
        if len(before) == REMEMBERED:
            known = np.array([each.time for each in before])
            weights = lagrange(times, np.repeat(known[:, None], len(times), axis=1))
            state = np.column_stack([each.state for each in before]) @ weights
        else:
            h = times - here.time
            state = self._taylor(
                here.state[:, None], here.rates[:, None], here.accelerations[:, None], h
            )
            state = (
                state + lacked(h, here.time - here.earlier) * (here.state - here.predicted)[:, None]
            )
        self._taylor(state, np.zeros(1), np.zeros(1), times)

    def _taylor(self, state: Array, rates: Array, accelerations: Array, h: Array) -> Array:
        tables = self._tables
        tables["state"][:], tables["step"][:] = state, h * (rates + (0.5 * h) * accelerations)
        tables.move()
        return tables["state"].copy()

    def _iterated(self, tol: float) -> tuple[Array, int, NDArray[np.bool_]]:
        """Newton's iteration from the state there is: residuals, how many iterations, and of which
        lanes it ended.
        """
        residual, iterations = self._evaluated(), 0
        rate, done = np.full(self.width, np.inf), residual <= SETTLED
        while iterations < ITERATIONS and not done.all():
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
        return np.abs(self._tables["phi"].take(self._kept, axis=0)).max(axis=0)
