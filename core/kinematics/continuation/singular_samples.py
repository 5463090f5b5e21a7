"""Nearly singular samples of a march, and the singular poses it crossed or ended at: none is passed
in silence. Findings and messages.

The error of a pose is up to its residual over the smallest singular value sigma of its rows. The
march knows residuals, and an estimate of sigma. If these allow too large an error, sigma is
computed; if sigma allows it too, the sample is solved again by orthogonal factors, and its errors
are computed. If they are too large it is interpolated, if the motion continues beyond, or else
refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...failures import FailureKind
from ...mechanism.motions import Path
from ...trajectory import Array
from ..compiled.compiled_model import Model
from ..compiled.dense_equations import System, system_of
from ..compiled.request import SIGMA, TESTS
from ..compiled.routes import LONGEST_KEPT, Route
from ..formulation.acceptance_criteria import AMPLIFIED, WORSE
from .pseudo_arclength import limit_ahead
from .segments import BETTER, Followed
from .singular_poses import (
    BEYOND,
    CONTINUED,
    REGULAR,
    Singularity,
    bridge,
    examine,
    examine_lane,
    list_names,
    smallest_singular_values,
    solve_closely,
)
from .walk import End, March

# Of one march: the others are counted.
NAMED = 8
# A passage is found this near to the sample that it is at, by the time or one.
BESIDE = 1e-6


@dataclass
class Findings:
    """Findings of a march.

    Attributes:
        notes: on correct samples at or beyond singular poses.
        messages: reasons of missing samples.
        failures: kinds of these failures.
        poses: the singular poses, for the record.
        retried: number of samples solved again.
        sigma: smallest singular value among those.
        renewed: number of new choices of rows.
        uncertain: samples refused because of an uncertain pose or rates; the motion does not end
            there.
    """

    notes: list[str] = field(default_factory=list[str])
    messages: list[str] = field(default_factory=list[str])
    failures: list[FailureKind] = field(default_factory=list[FailureKind])
    poses: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    retried: int = 0
    sigma: float = np.inf
    renewed: int = 0
    uncertain: list[int] = field(default_factory=list[int])

    @property
    def details(self) -> dict[str, Any]:
        """The findings for the record; empty without findings."""
        found: dict[str, Any] = {}
        if self.retried:
            found |= {"retried_samples": self.retried, "smallest_singular_value": self.sigma}
        if self.renewed:
            found["rows_chosen_anew"] = self.renewed
        if self.poses:
            found["singular_poses"] = [*self.poses]
        if self.uncertain:
            found["uncertain_samples"] = sorted(self.uncertain)
        return found | ({"notes": [*self.notes]} if self.notes else {})

    def add_failure(self, message: str, kind: FailureKind) -> None:
        """Add the reason of missing samples."""
        self.messages.append(message)
        self.failures.append(kind)

    def add_pose(
        self,
        outcome: str,
        path: Path,
        time: float,
        singularity: Singularity,
        sample: int | None = None,
    ) -> None:
        """Add a singular pose to the record."""
        values = path.drive(list(path.motions), np.array([time]))[0, :, 0]
        driver = {
            name: path.design.get(name, 0.0) + float(x)
            for name, x in zip(path.motions, values, strict=True)
        }
        self.poses.append(
            {
                "outcome": outcome,
                "time": time,
                "driver": driver,
                "sample": sample,
                **singularity.facts,
            }
        )


# A fine sweep has some tens of samples beside a singular pose that cannot be told from it.
BRIDGED = 64
# Unknowns up to which a dense decomposition is worth its time, a second.
LARGEST = 1000


_Poses = tuple[Array, NDArray[np.bool_]]


def scrutinise(route: Route, found: March, tol: float) -> Findings:
    """Solve doubtful samples again, in place, and those beyond passed ends; return the findings.

    The last scrutiny of a route is remembered, with the poses before and after it: of a Bennett
    loop it takes two thirds of the time, of a torus of cranks nearly all. A route that is marched
    again gives the same poses, to the last digit.
    """
    if len(found.solved) > LONGEST_KEPT:
        return _Scrutiny(Followed(route, found, tol)).run()
    poses, before = (found.kept, found.solved), (found.kept.copy(), found.solved.copy())
    known = route.thread_cache(("scrutinised", tol), list[tuple[_Poses, _Poses, Findings]])
    for same, after, findings in known:
        if all(np.array_equal(*pair, equal_nan=True) for pair in zip(same, before, strict=True)):
            for array, values in zip(poses, after, strict=True):
                array[:] = values
            return findings
    findings = _Scrutiny(Followed(route, found, tol)).run()
    known[:] = [(before, (found.kept.copy(), found.solved.copy()), findings)]
    return findings


class _Scrutiny:
    def __init__(self, followed: Followed) -> None:
        self.followed, self.route = followed, followed.route
        self.found, self.tol = followed.found, followed.tol
        self.rows, self.times = self.route.model.rows, self.route.path.times
        self.limit, self.orders = AMPLIFIED * self.tol, self.route.model.orders
        self.findings = Findings()

    def run(self) -> Findings:
        """Return the findings; samples are solved again in place."""
        findings, unknowns = self.findings, len(self.route.model.selection.chosen)
        if unknowns > LARGEST:
            if count := int(self.followed.is_uncertain.sum()):
                findings.notes.append(
                    f"{count} samples seem to be nearly singular, and were not examined:"
                    f" {unknowns} unknowns are more than {LARGEST}"
                )
            findings.messages += self.found.messages
            findings.failures += self.found.failures
            return findings
        self.followed.go_on()
        self._samples()
        self._bridge_stuck()
        self._passages()
        for end in self.followed.ends:
            self._end(end)
        findings.renewed = self.followed.renewed
        findings.uncertain = [k for k in findings.uncertain if not self.found.solved[k]]
        return findings

    # Samples

    def _samples(self) -> None:
        """Follow samples with better rows, solve doubtful ones closely, and interpolate or refuse
        the rest.
        """
        indices, doubtful = np.flatnonzero(self.followed.needs_check), self.followed.is_uncertain
        visited = self.followed.visit(indices.tolist()) if len(indices) else {}
        self._refuse_lost([k for k in indices.tolist() if k not in visited and doubtful[k]])
        better: dict[int, Array] = {}
        for model, samples in self._by_model(visited):
            # the estimate says too little of many unknowns: most of their samples are beyond doubt
            # by sigma itself
            system, lanes = system_of(model), self._lanes(visited, samples)
            sigma, of_all = smallest_singular_values(
                system, system.state(lanes), self.route.sampled(self.times[samples])
            )
            wanted = of_all > BETTER * sigma
            better |= {k: visited[k] for k in samples[wanted].tolist()}
            judged = wanted | doubtful[samples]
            self.found.kept[self.rows[SIGMA].start, samples[judged]] = sigma[judged]
        self.followed.renew(better)
        doubtful = self.followed.is_uncertain
        for model, samples in self._by_model(k for k in visited if doubtful[k]):
            self._solve_closely(system_of(model), samples, self._lanes(visited, samples))

    def _by_model(self, samples: Iterable[int]) -> Iterator[tuple[Model, NDArray[np.intp]]]:
        """Return the samples by the model they were followed with."""
        found: dict[Model, list[int]] = {}
        for k in sorted(samples):
            found.setdefault(self._route_of(k).model, []).append(k)
        for model, each in found.items():
            yield model, np.array(each, np.intp)

    def _route_of(self, k: int) -> Route:
        return self.followed.parts[int(self.followed.part_of[k])].route

    def _lanes(self, visited: Mapping[int, Array], samples: NDArray[np.intp]) -> Array:
        return np.stack([visited[k] for k in samples.tolist()], axis=1)

    def _solve_closely(self, system: System, indices: NDArray[np.intp], lanes: Array) -> None:
        """Solve samples closely."""
        state, sample = system.state(lanes), self.route.sampled(self.times[indices])
        solved = solve_closely(system, state, sample)
        found = system.equations(solved.state, sample)
        closure, leftover = found.closure, found.leftover
        outputs = system.outputs(solved.state, sample, solved.rate.T, solved.rate_t.T)
        (branch,) = outputs.pop("branch")
        kept, rows = self.found.kept, self.rows
        # closely solved is nearly where it was; anything else is another solution
        moved = np.abs(solved.state - state).max(axis=0)
        near = moved <= np.maximum(
            self.limit, WORSE * kept[rows["closure"].start, indices] / solved.sigma
        )
        good = (closure <= self.tol) & (branch > 0.0) & near
        good &= solved.error[: self.orders].max(axis=0) <= self.limit
        for name, values in [*outputs.items(), ("closure", closure), ("leftover", leftover)]:
            kept[rows[name], indices[good]] = values[..., good]
        self.findings.retried += len(indices)
        self.findings.sigma = min(self.findings.sigma, float(solved.sigma.min()))
        doubted: list[int] = np.flatnonzero(~good).tolist()
        # a motion passes singular poses one by one; where all its samples are nearly singular there
        # is nothing to pass
        tried = doubted if len(doubted) <= BRIDGED else []
        passed = {at for at in tried if self._interpolate(int(indices[at]), lanes[:, at])}
        refused = [at for at in doubted if at not in passed]
        if refused:
            error = solved.error[: self.orders, refused]
            self._refuse(system, indices[refused], state[:, refused], error)

    def _refuse_lost(self, samples: list[int]) -> None:
        """Refuse doubtful samples not reached a second time: rounding made them acceptable."""
        if samples:
            self.found.kept[:, samples], self.found.solved[samples] = np.nan, False
            self.findings.uncertain += samples
            places = list_names([self._where(k) for k in samples])
            why = (
                "reached once and not again, so near are residuals to the tolerance"
                f" {self.tol:.3g}; allow more"
            )
            self.findings.add_failure(f"refused at {places}: {why}", FailureKind.UNREPEATABLE)

    def _bridge_stuck(self) -> None:
        """Interpolate samples not reached from either side of a passage, or refuse them."""
        stuck = [each for each in self.followed.stuck if not self.found.solved[each.sample]]
        for each in stuck[:BRIDGED]:
            self.found.solved[each.sample] = self._bridge(
                each.route, each.sample, each.before, each.near, passed=True
            )
        for each in stuck:
            k = each.sample
            if not self.found.solved[k]:
                system = system_of(each.route.model)
                state, error = system.state(each.near[:, None]), np.full((1, 1), self.tol**0.5)
                self._refuse(system, np.array([k]), state, error)

    def _interpolate(self, k: int, near: Array) -> bool:
        """Replace a sample by interpolation between both sides of it, if the motion continues."""
        time, number = float(self.times[k]), int(self.followed.part_of[k])
        side = 1.0 if time >= self.followed.parts[number].route.start else -1.0
        lane = self.followed.before(time, side, number)
        return lane is not None and self._bridge(self._route_of(k), k, lane, near)

    def _bridge(
        self, route: Route, k: int, lane: Array, near: Array, *, passed: bool = False
    ) -> bool:
        time = float(self.times[k])
        found = bridge(route, lane, time, self.tol, None if passed else near)
        if found is None:
            return False
        tests = self.rows[TESTS[0]].start
        self.found.kept[:tests, k] = found.motions[:tests]
        if passed:  # a sample that was reached has tests of its own
            self.found.kept[tests:, k] = found.poses[BEYOND - 1].motions[tests:]
        singularity = examine_lane(route, near, time)
        self.findings.add_pose("passed", self.route.path, time, singularity, k)
        what = "" if singularity.regular else "a singular pose at "
        self.findings.notes.append(
            f"passes {what}{self._where(k)}: {singularity.words}; {CONTINUED}, interpolated"
            f" there to {found.error:.1g} of the mechanism's size and of the rates"
        )
        return True

    def _refuse(
        self, system: System, indices: NDArray[np.intp], state: Array, error: Array
    ) -> None:
        sample = self.route.sampled(self.times[indices])
        self.found.kept[:, indices], self.found.solved[indices] = np.nan, False
        self.findings.uncertain += indices.tolist()
        found = [examine(system, state[:, [at]], sample[:, [at]]) for at in range(len(indices))]
        for k, each in zip(indices.tolist(), found, strict=True):
            if each.sigma < REGULAR:
                self.findings.add_pose("refused", self.route.path, float(self.times[k]), each, k)
        worst = int(error.max(axis=0).argmax())
        singularity = found[worst]
        uncertain = f"the pose uncertain by {error[0, worst]:.2g} of the mechanism's size"
        uncertain += (
            f", rates by {error[1:, worst].max():.2g} of their own" if len(error) > 1 else ""
        )
        places = list_names([self._where(k) for k in indices.tolist()])
        uncertain += f" (at {self._where(indices[worst])}), allowed {self.limit:.2g}"
        if singularity.sigma < REGULAR:
            why = (
                f"so near a singular pose that residuals leave {uncertain}; {singularity.words};"
                " keep away from it"
            )
        else:
            sigma = f"smallest singular value {singularity.sigma:.3g}"
            why = (
                f"rounding alone leaves {uncertain} by the tolerance {self.tol:.3g}; {sigma}, the"
                " pose is regular; allow more"
            )
        self.findings.add_failure(f"refused at {places}: {why}", FailureKind.UNCERTAIN)

    def _passages(self) -> None:
        """Add the singular poses passed between samples."""
        said = [pose["time"] for pose in self.findings.poses if pose["outcome"] == "passed"]
        others = [
            each
            for each in self.followed.passages
            if not any(abs(each.time - t) <= BESIDE * (1.0 + abs(t)) for t in said)
        ]
        for each in others[:NAMED]:
            self._note_crossing(each)
        if len(others) > NAMED:
            more = f"crosses {len(others) - NAMED} more singular poses, between samples"
            self.findings.notes.append(more)

    def _note_crossing(self, end: End) -> None:
        path, time = end.route.path, end.time
        singularity = examine_lane(end.route, end.lane, time)
        if singularity.regular:  # the motion knows nothing of the choice of rows
            return
        self.findings.add_pose("crossed", path, time, singularity)
        if path.motions is self.route.path.motions:
            places = np.append(self.times, self.route.start)
            low, high = places[places <= time].max(), places[places >= time].min()
            beside = f"between {path.where(float(low))} and {path.where(float(high))}, "
        else:
            beside = f"on the way to {self.route.begin.name}, "
        self.findings.notes.append(
            f"crosses a singular pose {beside}near {path.where(time)}: {singularity.words};"
            f" {CONTINUED}"
        )

    def _end(self, end: End) -> None:
        """Add the reason why a side ended: a limit point ahead, or the singularity nearest to its
        last pose.
        """
        message, route, time = end.message, end.route, end.time
        if end.failure is not FailureKind.TOO_MANY_PARTS:
            system = system_of(route.model)
            state, way = system.state(end.lane[:, None]), 1 if end.wanted > time else -1
            ahead = limit_ahead(system, route.path, state, time, way, self.tol)
            if ahead is not None:
                sample = route.sampled(np.array([ahead.spot.time]))
                singularity = examine(system, ahead.spot.state, sample)
                self.findings.add_pose("limit", route.path, ahead.time, singularity)
                message += (
                    f"; the limit of travel is {route.path.where(ahead.time)}:"
                    f" {singularity.words}; kincheck trace goes on beyond"
                )
            elif (nearest := examine_lane(route, end.lane, time)).sigma < REGULAR:
                message += f"; there, {nearest.words}"
            else:
                message += (
                    f"; the pose is regular there, smallest singular value {nearest.sigma:.3g}"
                )
        self.findings.add_failure(message, end.failure)

    def _where(self, k: int) -> str:
        return self.route.path.where(float(self.times[k]))
