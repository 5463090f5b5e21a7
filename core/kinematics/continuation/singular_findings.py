"""Findings on singular samples, passages and ends of a march, with their messages."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...failures import FailureKind
from ...mechanism.motions import Path
from ..compiled.dense_equations import system_of
from ..compiled.request import FROM, TIME
from ..compiled.samples import Route
from .segments import Followed, Passage
from .side_follower import End
from .singularity import (
    CONTINUED,
    REGULAR,
    Singularity,
    examine,
)
from .trace import limit_ahead

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


def add_passages(findings: Findings, followed: Followed) -> None:
    """Add the singular poses passed between samples."""
    said = [pose["time"] for pose in findings.poses if pose["outcome"] == "passed"]
    others = [
        each
        for each in followed.passages
        if not any(abs(each.time - t) <= BESIDE * (1.0 + abs(t)) for t in said)
    ]
    for each in others[:NAMED]:
        _crossed(findings, each, followed.route)
    if len(others) > NAMED:
        findings.notes.append(f"crosses {len(others) - NAMED} more singular poses, between samples")


def _crossed(findings: Findings, passage: Passage, asked: Route) -> None:
    path, time, where = passage.route.path, passage.time, passage.route.path.where
    system = system_of(passage.route.model)
    singularity = examine(
        system, system.state(passage.lane[:, None]), passage.route.sampled(np.array([time]))
    )
    if singularity.regular:  # the motion knows nothing of the choice of rows
        return
    findings.add_pose("crossed", path, time, singularity)
    if path.motions is asked.path.motions:
        places = np.append(asked.path.times, asked.start)
        low, high = (
            where(float(side))
            for side in (places[places <= time].max(), places[places >= time].min())
        )
        beside = f"between {low} and {high}, "
    else:
        beside = f"on the way to {asked.begin.name}, "
    findings.notes.append(
        f"crosses a singular pose {beside}near {where(time)}: {singularity.words}; {CONTINUED}"
    )


def add_end(findings: Findings, end: End, tol: float) -> None:
    """Add the reason why a side ended: a limit point ahead, or the singularity nearest to its last
    pose.
    """
    findings.failures.append(end.failure)
    if end.failure is FailureKind.TOO_MANY_PARTS:
        findings.messages.append(end.message)
        return
    model, path = end.route.model, end.route.path
    system, time = system_of(model), float(end.lane[model.slots[FROM + TIME]])
    state = system.state(end.lane[:, None])
    ahead = limit_ahead(system, path, state, time, 1 if end.wanted > time else -1, tol)
    if ahead is None:
        singularity = examine(system, state, end.route.sampled(np.array([time])))
        regular = f"the pose is regular there, smallest singular value {singularity.sigma:.3g}"
        findings.messages.append(
            f"{end.message}; there, {singularity.words}"
            if singularity.sigma < REGULAR
            else f"{end.message}; {regular}"
        )
        return
    findings.add_pose("limit", path, ahead.value, ahead.singularity)
    findings.messages.append(
        f"{end.message}; the limit of travel is {path.where(ahead.value)}:"
        f" {ahead.singularity.words}; kincheck trace goes on beyond"
    )
