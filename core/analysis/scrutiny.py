"""Samples of a march that are nearly singular, and singular poses that it crossed or ended at: none is passed in silence.

A pose is wrong by up to its residual over the smallest singular value sigma of its rows. The march sees residuals, and of sigma
only the smallest pivot. Where that leaves room for an error the sample is solved again by orthogonal factors, and sigma and the
errors are computed; where they are too large the sample is interpolated, if the motion goes on beyond, or else refused.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..motions import Path
from ..trajectory import Array
from .bridge import bridge, onward
from .continuation import limit_ahead
from .continuity import AMPLIFIED, EPSILON, PIVOT
from .march import End, March, Route, march
from .request import FROM, TIME
from .singularity import Singularity, examine, listed, solve_closely

# Of one march: a crossing takes a few milliseconds to be located, and a thousand turns may cross a thousand times.
LOCATED = 8
# A fine sweep has some tens of samples beside a singular pose that cannot be told from it.
BRIDGED = 64
PARTS, ROUNDS = 17, 3  # a prime number of parts: few of them end where it is singular
# Unknowns up to which a dense decomposition is worth its time, a second.
LARGEST = 1000
CONTINUED = "the branch followed is the continuation of the motion"


@dataclass
class Findings:
    """What there is to say of a march.

    Attributes:
        notes: of samples that are right, but at or beyond singular poses.
        messages: why samples are missing.
        poses: the singular poses, for the record.
        retried: samples that were solved again.
        sigma: smallest singular value among those.
    """

    notes: list[str] = field(default_factory=list[str])
    messages: list[str] = field(default_factory=list[str])
    poses: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    retried: int = 0
    sigma: float = np.inf

    @property
    def details(self) -> dict[str, Any]:
        """For the record; empty where nothing was found."""
        found: dict[str, Any] = {}
        if self.retried:
            found |= {"retried_samples": self.retried, "smallest_singular_value": self.sigma}
        if self.poses:
            found["singular_poses"] = self.poses
        return found | ({"notes": self.notes} if self.notes else {})


def scrutinise(route: Route, found: March, tol: float) -> Findings:
    """Solve doubtful samples again, in place, and those beyond an end that the motion passes; say what was found."""
    scrutiny = _Scrutiny(route, found, tol)
    if len(route.model.selection.kept) > LARGEST:
        return scrutiny.too_large()
    ends = scrutiny.resume()
    scrutiny.samples()
    scrutiny.crossings()
    for end in ends:
        scrutiny.end(end)
    return scrutiny.findings


class _Scrutiny:
    """Attributes: parts: the routes that the samples were followed on; part_of: the one of each sample, shape (n,)."""

    def __init__(self, route: Route, found: March, tol: float) -> None:
        self.route, self.found, self.tol = route, found, tol
        self.model, self.system, self.times = route.model, route.system, route.path.times
        self.limit = AMPLIFIED * tol
        self.findings = Findings()
        self._stood: dict[int, Array] = {}
        self.parts: list[tuple[Route, NDArray[np.intp]]] = [(route, np.arange(len(self.times)))]
        self.part_of = np.zeros(len(self.times), dtype=np.intp)

    @property
    def doubtful(self) -> NDArray[np.bool_]:
        """Samples that were reached and may be wrong, shape (n,)."""
        closure, pivot = (self.found.kept[self.model.rows[name].start] for name in ("closure", "pivot"))
        return self.found.solved & (PIVOT * np.maximum(closure, EPSILON) > self.limit * pivot**2)

    def too_large(self) -> Findings:
        """Say that nothing was examined."""
        count = int(self.doubtful.sum())
        if count:
            self.findings.notes.append(
                f"{count} samples are nearly singular by their pivots, and were not examined: {self.system.unknowns} unknowns are "
                f"more than {LARGEST}"
            )
        self.findings.messages += self.found.messages
        return self.findings

    # Ends that are none

    def resume(self) -> list[End]:
        """Go on beyond singular poses that the motion passes; the ends that remain."""
        waiting, remaining = [*self.found.ends], list[End]()
        while waiting:
            end = waiting.pop(0)
            further = self._beyond(end) if end.route in [route for route, _ in self.parts] else None
            if further is None:
                remaining.append(end)
            else:
                waiting = [*further, *waiting]
        return remaining

    def _beyond(self, end: End) -> tuple[End, ...] | None:
        here, start = float(end.lane[self.model.slots[FROM + TIME]]), self.route.start
        side = 1.0 if end.wanted > here else -1.0
        lane = self._before(here, side)
        passed = bridge(self.route, lane, here, self.tol) if lane is not None else None
        if passed is None:
            return None
        samples = np.flatnonzero(~self.found.solved & (side * (self.times - start) >= side * (end.wanted - start)))
        route = onward(self.route, passed.beyond, self.times[samples])
        found = march(route, self.tol)
        if not found.solved.any():
            return None
        self.found.kept[:, samples], self.found.solved[samples] = found.kept, found.solved
        self.part_of[samples] = len(self.parts)
        self.parts.append((route, samples))
        return found.ends

    # Samples

    def samples(self) -> None:
        """Solve doubtful samples closely; interpolate or refuse those that remain in doubt."""
        indices = np.flatnonzero(self.doubtful)
        if not len(indices):
            return
        visited = self._visit(indices.tolist())
        self._lost([k for k in indices.tolist() if k not in visited])
        if not visited:
            return
        indices = np.array(sorted(visited), np.intp)
        lanes = np.stack([visited[k] for k in indices.tolist()], axis=1)
        state, sample = self.system.state(lanes), self.route.sampled(self.times[indices])
        solved = solve_closely(self.system, state, sample)
        outputs = self.system.outputs(solved.state, sample, solved.rate, solved.rate_t)
        closure, leftover, branch = (outputs.pop(name)[0] for name in ("closure", "leftover", "branch"))
        kept, rows = self.found.kept, self.model.rows
        # closely solved is nearly where it was; anything else is another solution
        moved = np.abs(solved.state - state).max(axis=0)
        near = moved <= np.maximum(self.limit, PIVOT * kept[rows["closure"].start, indices] / solved.sigma)
        good = (solved.error[: self.model.orders].max(axis=0) <= self.limit) & near & (closure <= self.tol) & (branch > 0.0)
        for name, values in [*outputs.items(), ("closure", closure), ("leftover", leftover)]:
            kept[rows[name], indices[good]] = values[..., good]
        self.findings.retried, self.findings.sigma = len(indices), float(solved.sigma.min())
        doubted: list[int] = np.flatnonzero(~good).tolist()
        # a motion passes singular poses one by one; where all its samples are nearly singular there is nothing to pass
        tried = doubted if len(doubted) <= BRIDGED else []
        passed = {at for at in tried if self._passed(int(indices[at]), state[:, [at]], sample[:, [at]])}
        refused = [at for at in doubted if at not in passed]
        if refused:
            self._refuse(indices[refused], state[:, refused], sample[:, refused], solved.error[: self.model.orders, refused])

    def _lost(self, samples: list[int]) -> None:
        """Refuse doubtful samples that are not reached a second time: rounding alone had them accepted."""
        if samples:
            self.found.kept[:, samples], self.found.solved[samples] = np.nan, False
            places = listed([self._where(float(self.times[k])) for k in samples])
            why = f"reached once and not again, so near are residuals to the tolerance {self.tol:.3g}; allow more"
            self.findings.messages.append(f"refused at {places}: {why}")

    def _passed(self, k: int, state: Array, sample: Array) -> bool:
        """Put what the motion has on both sides of a sample in its place, where it goes on."""
        time = float(self.times[k])
        lane = self._before(time, 1.0 if time >= self.route.start else -1.0)
        passed = bridge(self.route, lane, time, self.tol) if lane is not None else None
        if passed is None:
            return False
        motions = ~np.isnan(passed.kept)
        self.found.kept[motions, k] = passed.kept[motions]
        singularity = examine(self.system, state, sample)
        self._say("passed", time, singularity, k)
        self.findings.notes.append(
            f"passes a singular pose at {self._where(time)}: {singularity.words}; {CONTINUED}, interpolated there to "
            f"{passed.off:.1g} of the mechanism's size and of the rates"
        )
        return True

    def _refuse(self, indices: NDArray[np.intp], state: Array, sample: Array, error: Array) -> None:
        self.found.kept[:, indices], self.found.solved[indices] = np.nan, False
        for at, k in enumerate(indices.tolist()):
            self._say("refused", float(self.times[k]), examine(self.system, state[:, [at]], sample[:, [at]]), k)
        worst = int(error.max(axis=0).argmax())
        singularity = examine(self.system, state[:, [worst]], sample[:, [worst]])
        uncertain = f"the pose uncertain by {error[0, worst]:.2g} of the mechanism's size"
        uncertain += f", rates by {error[1:, worst].max():.2g} of their own" if len(error) > 1 else ""
        places = listed([self._where(float(self.times[k])) for k in indices.tolist()])
        self.findings.messages.append(
            f"refused at {places}: so near a singular pose that residuals leave {uncertain} (at "
            f"{self._where(float(self.times[indices[worst]]))}), allowed {self.limit:.2g}; {singularity.words}; keep away from it"
        )

    # Crossings

    def crossings(self) -> None:
        """Say between which samples the determinant of the rows changes its sign."""
        signs = np.sign(self.found.kept[self.model.rows["pivot"].start]) * (1.0 if self.route.ahead else -1.0)
        away, sure = self.times - self.route.start, self.found.solved & ~self.doubtful
        changes: list[tuple[float, float]] = []
        for side, there in ((1.0, away >= 0.0), (-1.0, away < 0.0)):
            order = np.flatnonzero(there & sure)
            order = order[np.argsort(side * away[order], kind="stable")]
            along, times = np.append(1.0, signs[order]), np.append(self.route.start, self.times[order])
            changes += [(float(times[at]), float(times[at + 1])) for at in np.flatnonzero(along[1:] != along[:-1]).tolist()]
        passed = [pose["time"] for pose in self.findings.poses if pose["outcome"] == "passed"]
        changes = [(a, b) for a, b in changes if not any(min(a, b) < t < max(a, b) for t in passed)]
        for here, there in changes[:LOCATED]:
            self._crossed(here, there)
        if len(changes) > LOCATED:
            self.findings.notes.append(f"crosses {len(changes) - LOCATED} more singular poses, between samples")

    def _crossed(self, here: float, there: float) -> None:
        lane = self._before(there, 1.0 if there >= self.route.start else -1.0)
        if lane is None:
            self.findings.notes.append(f"crosses a singular pose on the way to {self._where(there)}; {CONTINUED}")
            return
        a, b, sign = here, there, float(np.sign(lane[self.model.slots[FROM + "pivot"]]))
        for _ in range(ROUNDS):
            times = a + (b - a) * np.arange(1, PARTS + 1) / PARTS
            found = march(onward(self.route, lane, times), self.tol, visit=range(PARTS))
            good = found.solved & (np.sign(found.kept[self.model.rows["pivot"].start]) == sign)
            first = PARTS - 1 if good.all() else int((~good).argmax())
            if first:
                lane, a = found.visited[first - 1], float(times[first - 1])
            if not found.solved[first]:
                break
            b = float(times[first])
        singularity = examine(self.system, self.system.state(lane[:, None]), self.route.sampled(np.array([a])))
        self._say("crossed", 0.5 * (a + b), singularity)
        self.findings.notes.append(
            f"crosses a singular pose between {self._where(here)} and {self._where(there)}, near {self._where(0.5 * (a + b))}; at "
            f"{self._where(a)} {singularity.words}; {CONTINUED}"
        )

    # Ends

    def end(self, end: End) -> None:
        """Say what stopped a side: a limit point ahead of its last pose, or what that pose is nearest to."""
        time, path = float(end.lane[self.model.slots[FROM + TIME]]), end.route.path
        state = self.system.state(end.lane[:, None])
        ahead = limit_ahead(self.system, path, state, time, 1 if end.wanted > time else -1, self.tol)
        if ahead is None:
            singularity = examine(self.system, state, end.route.sampled(np.array([time])))
            self.findings.messages.append(f"{end.message}; there, {singularity.words}")
            return
        self._say("limit", ahead.value, ahead.singularity, path=path)
        self.findings.messages.append(
            f"{end.message}; the limit of travel is {path.where(ahead.value)}: {ahead.singularity.words}; kincheck trace goes "
            "on beyond"
        )

    # Places

    def _visit(self, samples: Collection[int]) -> dict[int, Array]:
        """Lanes that stand at samples."""
        found: dict[int, Array] = {}
        for number, (route, own) in enumerate(self.parts):
            wanted = {at for at, k in enumerate(own.tolist()) if k in samples and self.part_of[k] == number}
            if wanted:
                found |= {int(own[at]): lane for at, lane in march(route, self.tol, visit=wanted).visited.items()}
        return found

    def _before(self, time: float, side: float) -> Array | None:
        """The lane of the last sample before a time, going out from the start, that is not in doubt; or of the start, if known."""
        away = side * (self.times - self.route.start)
        good = np.flatnonzero(self.found.solved & ~self.doubtful & (away >= 0.0) & (away < side * (time - self.route.start)))
        if not len(good):
            return self.route.departure if self.route.from_design else None
        nearest = int(good[away[good].argmax()])
        if nearest not in self._stood:
            self._stood |= self._visit({nearest})
        return self._stood.get(nearest)

    def _where(self, time: float) -> str:
        return self.route.path.where(time)

    def _say(
        self, outcome: str, time: float, singularity: Singularity, sample: int | None = None, path: Path | None = None
    ) -> None:
        path = path or self.route.path
        values = path.drive(list(path.motions), np.array([time]))[0, :, 0]
        driver = {name: path.design.get(name, 0.0) + float(x) for name, x in zip(path.motions, values, strict=True)}
        self.findings.poses.append({"outcome": outcome, "time": time, "driver": driver, "sample": sample, **singularity.facts})
