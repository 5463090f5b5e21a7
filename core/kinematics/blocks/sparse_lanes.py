"""A sparse system bound to lanes, one sample a lane: a list of one block.

Lanes are predicted by the polynomial through the last eight samples, at first by a Taylor step of
second order with the error of the last such step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...failures import FailureKind, PoseFailure
from ...mechanism.motions import Path
from ...program import before, maximum
from ...trajectory import Array
from ..compiled.interpolation import lagrange
from ..compiled.predictor import ABOUT
from ..compiled.request import ACCEPT, Request
from ..continuation.failure_reasons import failure_kind
from ..continuation.singular_crossing import SOUND, Numbers
from ..formulation.acceptance_criteria import (
    AMPLIFIED,
    EPSILON,
    LOW,
    TURNED_BY_PIVOTS,
    WORSE_BY_PIVOTS,
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
from ..sparse.output_motions import OutputMotions
from ..sparse.poses import ChosenPivots, FixedOrder, Poses, Solved, error_bounds
from ..sparse.sparse_equations import (
    POSES,
    Rows,
    SparseEquations,
    Stand,
    distance,
)
from ..structure.sparse_lu import SingularError
from .lanes import MARGINS, WORST, Anchor, Lanes

REMEMBERED = 8
"""Samples that the next ones are predicted from: extrapolated by as many again, their rounding
errors grow to 1e-12.
"""
WORTH = 4
"""Samples at once that are worth making tables for: that takes what 12 (43 bodies) to 36 (1,999)
save, once for all sweeps.
"""
# Rows are chosen anew where that makes the determinant, and so the least of what it is a product
# of, as many times larger.
BETTER = 3.0
TOO_LONG = ("continued", "near", "not turned round", "as regular", "regular between")
"""Criteria that shorter steps meet; the order of elimination has no effect on them."""
FEW = 5
"""Names listed in a message, at most."""


@dataclass(frozen=True, eq=False)
class _Reached:
    """What an attempt found: poses, and beside them numbers of shape (numbers, lanes)."""

    poses: Solved
    times: Array
    earlier: Array
    drives: Array
    taylor: Array
    largest_pivot: Array
    slopes: Array
    high: Array
    margins: Mapping[str, Array]
    neighbours: bool


def _numbers(here: Stand) -> Numbers:
    return Numbers(here.state, np.concatenate([here.rates, here.accelerations]))


class SparseLanes(Lanes):
    """A sparse system bound to lanes.

    Attributes:
        here: the pose before the lanes.
    """

    many, worse = POSES, WORSE_BY_PIVOTS

    def __init__(self, model: SparseEquations, request: Request) -> None:
        self.model, self.mechanism, self.request = model, model.mechanism, request
        self.unit, self.details = model.unit, model.details
        self._outputs = OutputMotions(model, request)
        self.here, self._known = model.design, [model.rows]
        self._ordered: dict[Rows, FixedOrder] = {}
        self.worst = np.zeros((len(WORST), POSES))
        self.design = self.anchor(0.0)
        self.begin()

    def begin(self) -> None:
        """See `Lanes`."""
        self._renewed, self._smallest_pivot = 0, np.inf

    @property
    def findings(self) -> Mapping[str, Any]:
        """See `Lanes`."""
        renewed = {"rows_chosen_anew": self._renewed} if self._renewed else {}
        return {"smallest_pivot": self._smallest_pivot, **renewed}

    def accept_by(self, limits: Mapping[str, float]) -> None:
        """See `Lanes`."""
        tol, consistent, crossing = (limits[name] for name in ACCEPT)
        self._crossing = crossing > 0.0
        self._limits = Limits(tol, consistent, crossing, WORSE_BY_PIVOTS, TURNED_BY_PIVOTS)

    def depart(self, time: float, path: Path) -> PoseFailure | None:
        """See `Lanes`."""
        try:
            drives = self.model.drives(path, np.array([time]))
            self.here = self.model.moving(self.here, time, drives)
        except SingularError:
            return PoseFailure(FailureKind.SINGULAR_ROWS)
        return None

    def anchor(self, time: float) -> Anchor:
        """See `Lanes`: the pose."""
        return Anchor(time, self.here, _numbers)

    def restore(self, anchor: Anchor) -> None:
        """See `Lanes`."""
        self.here = anchor.pose

    def sampled(self, times: Array, path: Path) -> list[Array]:
        """See `Lanes`: the times, and the numbers of all drivers."""
        return [np.concatenate([times[None], self.model.drives(path, times)])]

    @property
    def sound(self) -> bool:
        """See `Lanes`."""
        return bool((self.here.sigmas >= SOUND * self.here.largest).all())

    def attempt_at(self, tables: Sequence[Array], *, neighbours: bool = False) -> Array:
        """See `Lanes`: in a fixed order if that is worth it, and else, or if it may be the order
        that is refused, by chosen pivots.
        """
        (table,) = tables
        count, rows = table.shape[1], self.here.rows
        worth = (neighbours and count >= WORTH) or rows in self._ordered
        together = self._together(rows) if worth else None
        if together is not None:
            some = self._margins(together, table[:, : together.width], neighbours=neighbours)
            if not (some > 0.0).any() and not self._too_long():
                outgrown = not self._found.poses.believed[0]
                wanted = 1 if neighbours else count
                poses = ChosenPivots(self.model, rows)
                some = self._margins(poses, table[:, :wanted], neighbours=neighbours)
                if outgrown and some[0] > 0.0:
                    together.order(self.model)
            return np.concatenate([some, np.full(count - len(some), -np.inf)])
        return self._margins(ChosenPivots(self.model, rows), table, neighbours=neighbours)

    def _too_long(self) -> bool:
        """Return whether all lanes of the last attempt are only too far from the one before."""
        found, count = self._found, len(self._found.times)
        margins = {
            name: margin.reshape(-1, count).min(axis=0) for name, margin in found.margins.items()
        }
        others = [margin > 0.0 for name, margin in margins.items() if name not in TOO_LONG]
        return bool((np.logical_and.reduce(others) & found.poses.believed).all())

    def _together(self, rows: Rows) -> FixedOrder | None:
        """Return the rows in a fixed order, kept with them; None without machine code."""
        if not self.model.elements.compiled:
            return None
        if rows not in self._ordered:
            self.model.evaluate(self.here.state[:, None], self.here.drives[:, None])
            self._ordered[rows] = FixedOrder(self.model, rows)
        return self._ordered[rows]

    def _margins(self, poses: Poses, table: Array, *, neighbours: bool) -> Array:
        """Attempt lanes, and return their margins."""
        count, here = table.shape[1], self.here
        self.last = count - 1
        with np.errstate(all="ignore"):  # lanes that diverge are found by their residuals
            found = self._found = self._attempt(poses, table, count, neighbours=neighbours)
            each = [margin.reshape(-1, count).min(axis=0) for margin in found.margins.values()]
            margin: Array = np.minimum.reduce(each)
        solved = found.poses
        margin = np.where(solved.believed & ~np.isnan(margin), margin, -np.inf)
        if neighbours and len(here.rows.dropped):
            low = (solved.sigmas < LOW * found.high).any(axis=1)
            # with other rows, what is found beyond may be better
            margin[1:][np.logical_or.accumulate(low)[:-1]] = -np.inf
        sigma = np.minimum(solved.pivot, solved.sigmas.min(axis=1, initial=np.inf))
        tests = solved.closure, solved.leftover, solved.iterations, sigma, margin
        self.worst[:, :count] = tests
        return margin

    def _attempt(self, poses: Poses, table: Array, count: int, *, neighbours: bool) -> _Reached:
        here, model = self.here, self.model
        lanes = np.minimum(np.arange(poses.width), count - 1)
        times, drives = table[0, lanes], table[1:, lanes]

        def previous(values: Array, first: Array) -> Array:
            """Return the values of the pose before each lane, those of the first one given."""
            alone = np.broadcast_to(first[..., None], values.shape)
            return before(values, first) if neighbours else alone

        def taylor_from(state: Array, rates: Array, accelerations: Array, h: Array) -> Array:
            whole = np.broadcast_to(state, (len(state), poses.width))
            return poses.moved(whole, h * (rates + (0.5 * h) * accelerations))

        state, rates, accelerations = (
            each[:, None] for each in (here.state, here.rates, here.accelerations)
        )
        taylor = taylor_from(state, rates, accelerations, times - here.time)
        zero = np.zeros((len(here.rates), poses.width))
        predicted = poses.moved(self._predicted(taylor, times, neighbours=neighbours), zero)
        solved = poses.solve(predicted, drives, self._limits.tol, count)
        times, drives, taylor = times[:count], drives[:, :count], taylor[:, :count]
        past, earlier = previous(solved.state, here.state), previous(times, np.array(here.time))
        if neighbours:
            rates, accelerations = (
                previous(solved.rates, here.rates),
                previous(solved.accelerations, here.accelerations),
            )
            state, rates, accelerations = (each[:, lanes] for each in (past, rates, accelerations))
            taylor = taylor_from(state, rates, accelerations, (times - earlier)[lanes])[:, :count]
        gap, step = (distance(solved.state - each, model.scale) for each in (taylor, past))
        angles = drives[model.angles]
        sigmas, sigmas_before = solved.sigmas.T, previous(solved.sigmas.T, here.sigmas)
        slope = known_slope(here.slopes)
        slopes = slope_between(sigmas, sigmas_before, step)
        least = least_slope(slope)[:, None]
        known = maximum(previous(slopes, slope), least)
        slopes = maximum(slopes, least)
        largest = np.maximum(solved.pivot, here.largest_pivot)
        falls = min(here.pivot, here.sigmas.min(initial=np.inf))
        candidate = Candidate(
            done=solved.done.astype(float),
            closure=solved.closure,
            leftover=solved.leftover,
            branch=solved.branch,
            gap=gap,
            moved=step,
            reach=step,
            turns=[
                np.abs(angles - previous(angles, here.drives[model.angles])).max(
                    axis=0, initial=0.0
                )
            ],
            sigma=np.minimum(solved.pivot, sigmas.min(axis=0, initial=np.inf)),
            # exchanges of rows make SuperLU's pivots jump tenfold: their increase is no sign of a
            # motion away from a singular pose
            before=falls if isinstance(poses, ChosenPivots) else -np.inf,
            largest=largest,
            # signs of determinants change with the choice of rows too, so they do not replace the
            # test of sigma
            reversal=np.array([float(each != here.orientation) for each in solved.orientation]),
            blocks=[Block(sigmas, sigmas_before, np.maximum(slopes, known))],
        )
        high = np.maximum.accumulate(np.vstack([here.high, solved.sigmas]))[1:]
        return _Reached(
            solved,
            times,
            earlier,
            drives,
            taylor,
            largest,
            slopes.T,
            high,
            margins(candidate, self._limits),
            neighbours,
        )

    def _predicted(self, taylor: Array, times: Array, *, neighbours: bool) -> Array:
        """Return predicted states, their Euler parameters of any length."""
        here = self.here
        if neighbours and len(here.past) == REMEMBERED:
            nodes = np.array([time for time, _ in here.past])
            weights = lagrange(times, np.repeat(nodes[:, None], len(times), axis=1))
            return np.column_stack([state for _, state in here.past]) @ weights
        h, last = times - here.time, here.time - here.earlier
        part = np.where(ABOUT * abs(last) > np.abs(h), (h / (last or 1.0)) ** 3, 0.0)
        return taylor + part * (here.state - here.predicted)[:, None]

    def carry(self, lane: int) -> None:
        """See `Lanes`; change to better rows there, if the present ones have become much more
        singular.
        """
        self.here = self._stand(lane)
        self._smallest_pivot = min(self._smallest_pivot, self.here.pivot)
        if not self._crossing and (self.here.sigmas < LOW * self.here.high).any():
            self._choose_rows()

    def _stand(self, lane: int) -> Stand:
        found, solved, here = self._found, self._found.poses, self.here
        passed = zip(found.times[: lane + 1].tolist(), solved.state.T, strict=False)
        past = {**dict(here.past), **dict(passed)} if found.neighbours else {}
        return Stand(
            here.rows,
            float(found.times[lane]),
            float(found.earlier[lane]),
            solved.state[:, lane],
            found.taylor[:, lane],
            solved.rates[:, lane],
            solved.accelerations[:, lane],
            found.drives[:, lane],
            float(solved.pivot[lane]),
            float(found.largest_pivot[lane]),
            solved.orientation[lane],
            solved.sigmas[lane],
            found.slopes[lane],
            np.maximum(here.largest, found.high[lane]),
            found.high[lane],
            tuple(past.items())[-REMEMBERED:],
        )

    def _choose_rows(self) -> None:
        """Change to better rows at the pose before the lanes; if none are better, remember how
        singular it is.
        """
        here, model = self.here, self.model
        drives = here.drives[:, None]
        model.evaluate(here.state[:, None], drives)
        jacobian = model.jacobian()
        if len(here.rows.dropped) and jacobian.well_chosen:
            kept = jacobian.independent(len(model.mechanism.drivers))
            known = (each for each in self._known if np.array_equal(each.kept, kept))
            try:
                rows: Rows = next(known, None) or Rows.of(kept, jacobian)
                of_rows, of_here = (
                    each.order.factor(jacobian.values[each.solved]) for each in (rows, here.rows)
                )
                if of_rows.log_determinant > of_here.log_determinant + np.log(BETTER):
                    still = Stand(
                        rows, here.time, here.time, here.state, here.state, here.rates, here.rates
                    )
                    self.here = replace(model.moving(still, here.time, drives), past=here.past)
                    self._renewed += 1
                    self._known += [rows] if rows not in self._known else []
                    return
            except SingularError:
                pass
        self.here = replace(here, high=here.sigmas)

    def motions(self, count: int) -> Array:
        """See `Lanes`."""
        found = self._found.poses
        return self._outputs.motions(
            *(each[:, :count] for each in (found.state, found.rates, found.accelerations))
        )

    def uncertain(self, count: int, path: Path) -> Mapping[int, float]:
        """See `Lanes`. Small pivots alone are no reason to refuse a sample: large mechanisms have
        many.
        """
        found, limit, off = self._found.poses, AMPLIFIED * self._limits.tol, dict[int, float]()
        least = np.minimum(found.pivot, found.sigmas.min(axis=1, initial=np.inf))[:count]
        doubtful = WORSE_BY_PIVOTS * np.maximum(found.closure[:count], EPSILON) > limit * least**2
        rows, at = self.here.rows, np.flatnonzero(doubtful)
        # what a fixed order leaves uncertain may be the order
        for poses in (self._ordered.get(rows), ChosenPivots(self.model, rows)):
            if poses is not None and at.size:
                drives, order = self._found.drives[:, at], self.request.order
                errors = error_bounds(poses, found.state[:, at], drives, self.model.scale, order)
                beyond = ~(errors <= limit)  # or it is no number
                at, off = at[beyond], dict(zip(at[beyond].tolist(), errors[beyond], strict=True))
        return off

    def failure(self, tol: float) -> PoseFailure:
        """See `Lanes`."""
        found, solved, count = self._found, self._found.poses, len(self._found.times)
        refused = np.flatnonzero(~(self.worst[MARGINS, :count] > 0.0))
        lane = int(refused[-1]) if len(refused) else self.last
        failed = [
            name
            for name, margin in found.margins.items()
            if not (margin.reshape(-1, count)[:, lane] > 0.0).all()
        ]
        closure, leftover, branch = (
            float(each[lane]) for each in (solved.closure, solved.leftover, solved.branch)
        )
        names = self.model.redundant(self.here.rows)
        few = [*names[:FEW], "..."] if len(names) > FEW else names
        kind = failure_kind(failed, closure)
        return PoseFailure(kind, closure, tol, leftover, branch, few, pivot=self.here.pivot)
