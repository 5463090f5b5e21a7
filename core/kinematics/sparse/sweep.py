"""Sweep a large mechanism as one sparse system, outwards from the design position."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ...errors import number_of
from ...failures import FailureKind, PoseFailure
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path, outwards
from ...trajectory import Array, Trajectory, largest_found
from ..compiled.motion_start import Start, solve_from_start, start_of
from ..compiled.request import Request
from ..compiled.solution import solution
from ..formulation.acceptance_criteria import AMPLIFIED, EPSILON, LOW, WORSE_BY_PIVOTS
from .batched_newton import REMEMBERED
from .error_bound import uncertain
from .output_motions import OutputMotions
from .sparse_equations import PoseError
from .sparse_model import SparseModel
from .step_state import Stand
from .step_walk import StepWalk


def solve_sparse(
    mechanism: Mechanism | SparseModel,
    path: Path,
    points: Sequence[str] = (),
    bodies: Sequence[str] = (),
    order: int = 2,
    tol: float = 1e-12,
) -> Trajectory:
    """Solve a mechanism over the samples of a path, as one sparse system.

    Args:
        mechanism: the mechanism, or for repeated use its `SparseModel`.
        points, bodies: names of the points and bodies whose motion is wanted.
        order: 0 for positions, 1 for velocities too, 2 for accelerations too.
        tol: largest accepted constraint residual, relative to the size of the bodies.

    Returns:
        The motion; NaN at samples out of reach, with the reason in its message.

    Raises:
        SolveError: drivers and degrees of freedom do not match, or the mechanism does not close at
            the design position.
    """
    model = mechanism if isinstance(mechanism, SparseModel) else SparseModel(mechanism)
    outputs = OutputMotions(model, Request((), tuple(points), tuple(bodies), order))
    sweep = partial(_Sweep, model, path, tol, outputs, order)
    start = start_of(model.mechanism, path)
    return solve_from_start(
        start, model.mechanism, path, lambda each: sweep(each).solve(), compare=np.isfinite(tol)
    )


AT_ONCE = 64
"""Stands whose motions are computed together: one alone takes as many calls of numpy."""
WORTH = 4
"""Samples on one side that are worth making tables for: that takes what 12 (43 bodies) to 36
(1,999) save, once for all sweeps.
"""


@dataclass
class _Sweep:
    """A path through a model, and its results; refused: error bound by refused sample."""

    model: SparseModel
    path: Path
    tol: float
    outputs: OutputMotions
    order: int
    start: Start
    messages: list[str] = field(default_factory=list[str])
    failures: list[FailureKind] = field(default_factory=list[FailureKind])
    smallest_pivot: float = np.inf
    renewed: int = 0
    refused: dict[int, float] = field(default_factory=dict[int, float])

    def __post_init__(self) -> None:
        self.by = self.model
        self.known = [self.model]

    def solve(self) -> Trajectory:
        """The motion at all samples."""
        path, n = self.path, len(self.path.times)
        stands = {name: np.full(n, np.nan) for name in ("closure", "leftover", "iterations")}
        table = np.full((n, self.outputs.columns.count), np.nan)
        departure = self._departure()
        for side in outwards(path.times, self.start.time):
            if departure is None or not len(side):
                continue
            followed = zip(
                self._follow(departure, path, path.times[side]), side.tolist(), strict=False
            )
            certain = self._certain(followed)
            while some := list(islice(certain, AT_ONCE)):
                reached = [k for _, k in some]
                for name, values in stands.items():
                    values[reached] = [getattr(at, name) for at, _ in some]
                table[reached] = self.outputs.motions([at for at, _ in some])
        self._tell_refused()
        return self._trajectory(table, stands)

    def _departure(self) -> Stand | None:
        """Return the pose from which the samples are followed; None if it cannot be reached."""
        model, path, here, start = self.model, self.path, self.model.design, self.start.time
        try:
            if way := self.start.lead:
                here = model.moving(here, 0.0, self._drives(way, 0.0))
                for there in self._follow(here, way, way.times):
                    here = there
                if self.messages:
                    self.messages[:] = [f"on the way to {self.start.name}: {self.messages[0]}"]
                    return None
            return model.moving(here, start, self._drives(path, start))
        except PoseError as error:
            self.messages.append(f"the motion cannot start at {path.where(start)}: {error}")
            self.failures.append(error.failure.kind)
            return None

    def _follow(self, here: Stand, path: Path, times: Array) -> Iterable[Stand]:
        """Yield the pose at each time, outwards, until the motion ends; then add a message."""
        drives, many = self.model.drives(path, times), len(times) >= WORTH
        self.by = self.model
        before: deque[Stand] = deque([here], REMEMBERED)
        k = alone = 0
        while k < len(times):
            found: list[Stand] = []
            together = self.by.together if many else None
            if together and k >= alone:
                found = together.reach(before, times[k:], drives[:, k:], self.tol)
                if not found:  # from here on by pivots that are chosen
                    alone = k + together.width
                    try:
                        here = self.by.moving(here, here.time, self._drives(path, here.time))
                    except PoseError as error:
                        self._end(here, path, times, k, error.failure)
                        return
            if not found:
                walk = self._walk(here, path, float(times[k]), drives[:, k])
                _, failure = walk.advance(0, 1)
                here = walk.here
                if failure is not None:
                    self._end(here, path, times, k, failure)
                    return
                found = [here]
                if together and together.outgrown and self.by.together is together:
                    together.order(self.by)
            for here in found:
                if here.time == before[-1].time:
                    before.pop()
                before.append(here)
                self.smallest_pivot = min(self.smallest_pivot, here.pivot)
                yield here
                k, by = k + 1, self.by
                before[-1] = here = self._by_better_rows(here, path)
                if self.by is not by:  # what was found beyond is not as good
                    break

    def _walk(self, here: Stand, path: Path, time: float, drives: Array) -> StepWalk:
        """Return the walk to a time, by the present rows."""

        def reach(at: Stand, to: float) -> Stand:
            return self.by.reach(at, to, drives if to == time else self._drives(path, to), self.tol)

        return StepWalk(here, time, reach, lambda at: self._by_better_rows(at, path))

    def _certain(self, followed: Iterable[tuple[Stand, int]]) -> Iterator[tuple[Stand, int]]:
        """Yield samples as the motion reaches them, without those left uncertain by residuals.

        Small pivots alone are no reason to refuse a sample: large mechanisms have many.
        """
        limit = AMPLIFIED * self.tol
        for here, k in followed:
            least = min(here.pivot, here.sigmas.min(initial=np.inf))
            if WORSE_BY_PIVOTS * max(here.closure, EPSILON) > limit * least**2:
                found = uncertain(self.by, here, self._drives(self.path, here.time))
                worst = float(np.max(found[: self.order + 1]))
                if not worst <= limit:  # or it is no number
                    self.refused[k] = worst
                    continue
            yield here, k

    def _tell_refused(self) -> None:
        if self.refused:
            worst = max(self.refused, key=self.refused.__getitem__)
            there = self.path.where(float(self.path.times[worst]))
            where = (
                f"by up to {self.refused[worst]:.2g} (at {there}), allowed"
                f" {AMPLIFIED * self.tol:.2g}"
            )
            why = (
                "so near a singular pose that residuals leave the pose or its rates uncertain,"
                f" {where}"
            )
            many = number_of(len(self.refused), "sample")
            self.messages.append(f"refused at {many} {why}; keep away from it")
            self.failures.append(FailureKind.UNCERTAIN)

    def _by_better_rows(self, here: Stand, path: Path) -> Stand:
        """Return the pose, by other rows if its own have become much more singular and others are
        better.
        """
        if not (here.sigmas < LOW * here.high).any():
            return here
        found = self.by.anew(here, self._drives(path, here.time), self.known)
        if found is None:
            return replace(here, high=here.sigmas)
        self.by, here = found
        self.renewed += 1
        self.known += [self.by] if self.by not in self.known else []
        return here

    def _drives(self, path: Path, time: float) -> Array:
        return self.model.drives(path, np.array([time]))[:, 0]

    def _end(self, here: Stand, path: Path, times: Array, k: int, failure: PoseFailure) -> None:
        self.smallest_pivot = min(self.smallest_pivot, here.pivot)
        reason = str(replace(failure, pivot=here.pivot))
        self.failures.append(failure.kind)
        self.messages.append(
            path.ended(here.time, float(times[k]), float(times[k - 1]) if k else None, reason)
        )

    def _trajectory(self, table: Array, tests: Mapping[str, Array]) -> Trajectory:
        solved: NDArray[np.bool_] = ~np.isnan(tests["closure"])
        closure, leftover = (largest_found(tests[name][solved]) for name in ("closure", "leftover"))
        return solution(
            table,
            self.outputs.columns.points,
            self.outputs.columns.bodies,
            unit=self.model.frame.unit,
            solved=solved,
            iterations=tests["iterations"],
            closure=closure,
            leftover=leftover,
            message="; ".join(self.messages),
            failures=self.failures,
            account=self.model.details,
            findings={
                "smallest_pivot": self.smallest_pivot,
                **({"rows_chosen_anew": self.renewed} if self.renewed else {}),
            },
        )
