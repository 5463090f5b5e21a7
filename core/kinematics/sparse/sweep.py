"""Sweep a large mechanism as one sparse system, outwards from the design position."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ...failures import FailureKind, PoseFailure
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path, outwards
from ...trajectory import Array, BodyMotion, PointMotion, Trajectory, largest_found
from ..compiled.motion_start import Start, solve_from_start, start_of
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
        mechanism: what to solve; made ready (`SparseModel`) where it is to be solved more than
            once.
        points, bodies: names whose motion is wanted.
        order: 0 for positions, 1 for velocities too, 2 for accelerations too.
        tol: largest accepted constraint residual, relative to the size of the bodies.

    Returns:
        The motion; NaN where a sample cannot be reached, and the reason in its message.

    Raises:
        SolveError: drivers and degrees of freedom do not match, or the mechanism does not close at
            the design position.
    """
    model = mechanism if isinstance(mechanism, SparseModel) else SparseModel(mechanism)
    wanted = OutputMotions(model, points), OutputMotions(model, bodies, frames=True)
    sweep, start = (
        partial(_Sweep, model, path, tol, *wanted, order),
        start_of(model.mechanism, path),
    )
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
    """A path through a model, and what is found along it; refused: by sample, how uncertain what is
    found there is.
    """

    model: SparseModel
    path: Path
    tol: float
    points: OutputMotions
    bodies: OutputMotions
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
        wanted = (self.points, self.bodies)
        found = [
            np.full((n, size, len(each.names)), np.nan)
            for each, size in zip(wanted, (9, 19), strict=True)
        ]
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
                for into, each in zip(found, wanted, strict=True):
                    if each.names:
                        into[reached] = each.motions([at for at, _ in some])
        self._tell_refused()
        return self._trajectory(found, stands)

    def _departure(self) -> Stand | None:
        """Return where the samples are followed from; None if that cannot be reached."""
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
        """Where the motion stands at each of the times, outwards, until it ends; then there is a
        message.
        """
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
        """Samples, each as soon as the motion stands there, without those that residuals leave
        uncertain.

        That pivots are small is no reason to refuse one: in large mechanisms many are.
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
            self.messages.append(f"refused at {len(self.refused)} samples {why}; keep away from it")
            self.failures.append(FailureKind.UNCERTAIN)

    def _by_better_rows(self, here: Stand, path: Path) -> Stand:
        """Where it stands; by other rows, where its own are much nearer to singular than they were
        and others are not.
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

    def _trajectory(self, found: Sequence[Array], tests: Mapping[str, Array]) -> Trajectory:
        (points, bodies), unit, order = found, self.model.frame.unit, self.order
        solved: NDArray[np.bool_] = ~np.isnan(tests["closure"])
        closure, leftover = (
            largest_found(tests[name][solved]) * unit for name in ("closure", "leftover")
        )
        # rates of place and of rotation stand side by side
        rates = [
            np.concatenate([bodies[:, k : k + 3], bodies[:, k + 10 : k + 13]], axis=1)
            for k in (3, 6)
        ]
        series = [points[:, 3 * k : 3 * k + 3] for k in range(order + 1)]
        missing = [None] * (2 - order)
        return Trajectory(
            points={
                name: PointMotion(*(each[:, :, k] for each in series), *missing)
                for k, name in enumerate(self.points.names)
            },
            solved=solved,
            iterations=np.where(solved, tests["iterations"], 0.0).astype(np.int64),
            residual=closure,
            message="; ".join(self.messages),
            details={
                **self.model.details,
                "redundant_residual": leftover,
                "smallest_pivot": self.smallest_pivot,
                **({"rows_chosen_anew": self.renewed} if self.renewed else {}),
            },
            bodies={
                name: BodyMotion(
                    bodies[:, :3, k],
                    bodies[:, 9:13, k],
                    *(each[:, :, k] for each in rates[:order]),
                    *missing,
                )
                for k, name in enumerate(self.bodies.names)
            },
            failures=self.failures,
        )
