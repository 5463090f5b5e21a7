"""Simulate mode, shared by the simulators: start, direction and acceptance of samples.

A simulator starts at the reachable sample nearest to the design, with pose and rates of its
projection model, because no simulator checks its initial values, and runs from there in two legs.
The backward leg is the motion in reversed time: rates change their sign, accelerations do not. A
simulator reports its own motion, including soft constraints and drift.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.case.case import Case
from ...core.errors import KincheckError, SolveError
from ...core.kinematics import notes_on_start
from ...core.kinematics import start_of as where_from
from ...core.mechanism.motions import outwards
from ...core.trajectory import Array, PointMotion, Trajectory, largest_found
from .projection import Walk
from .projection_model import ProjectionModel

# A loop that is open by more than this fraction of the mechanism's size is torn: the pose does not
# belong to the mechanism. The softest simulator, MuJoCo with default settings, stays below it on
# most built-in cases.
TORN = 1e-2
# Largest difference in the spacing of equidistant samples, relative to the spacing: round-off.
EQUIDISTANT = 1e-6
# Residual of the start pose, which projection reaches.
START = 1e-12


class SimulationEndedError(KincheckError):
    """A simulator cannot continue; the message gives the reason."""


@dataclass(frozen=True, eq=False)
class Start:
    """A consistent pose at a sample near the design.

    Attributes:
        sample: index of the sample.
        configuration: the result of the model's `save` there.
        v, a: rates and accelerations of the unknowns there.
        points: position, velocity and acceleration of each point of case.points there, shape (3,
            points, 3).
        residual: residual of the projection model there [m or -].
        size: size of the mechanism [m].
        independent: whether the rows of the model are independent.
        facts: facts on the start for the record.
    """

    sample: int
    configuration: Any
    v: Array
    a: Array
    points: Array
    residual: float
    size: float
    independent: bool
    facts: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class Leg:
    """The samples on one side of the start, in the order of the simulation, the start first.

    Attributes:
        sign: -1 if time is reversed.
    """

    case: Case
    samples: NDArray[np.intp]
    sign: float

    @property
    def times(self) -> Array:
        """The times of the samples in the case [s]."""
        return self.case.sweep.path.times[self.samples]

    def drive(self, times: Array) -> Array:
        """Return values, rates and accelerations of the drivers at times of the case, in the time
        of the leg, shape (3, drivers, times).
        """
        moved = self.case.sweep.path.drive(
            [driver.name for driver in self.case.mechanism.drivers], times
        )
        moved[1] *= self.sign
        return moved


@dataclass(frozen=True, eq=False)
class SimulatedPose:
    """The result of a simulator at a sample, in the time of its leg.

    Attributes:
        points: position, velocity and acceleration of each point of case.points, shape (3, points,
            3); NaN if missing.
        residual: the largest violation of its constraints [m or -].
        steps: number of steps of the solver since the previous sample.
    """

    points: Array
    residual: float
    steps: int


Simulator = Callable[[Leg], Iterator[SimulatedPose]]
"""Function that yields the poses of a leg, the start first, and raises SimulationEndedError if it
cannot continue.
"""


def start_of(model: ProjectionModel, case: Case) -> Start:
    """Return the start of a simulation.

    Raises:
        SolveError: the design does not close, or no sample next to it can be reached.
    """
    walk, path = Walk(model, case, START), case.sweep.path
    begin = where_from(case.mechanism, path)
    origin, message = walk.start(path, begin)
    notes: list[str] = []
    if origin is None and begin.other is not None:
        notes.append(f"no sample can be reached by way of {begin.name} ({message})")
        begin = begin.other
        origin, _ = walk.start(path, begin)
    if origin is None:
        raise SolveError(f"case {case.name!r}: {message}", walk.kind_at_start)
    notes += notes_on_start(begin, path)
    facts = {"start": begin.facts, **({"notes": notes} if notes else {})}
    nearest = [int(side[0]) for side in outwards(path.times, origin.t) if len(side)]
    for k in sorted(nearest, key=lambda k: abs(float(path.times[k]) - origin.t)):
        aim = float(path.times[k])
        at, reached = walk.advance(path, origin, aim, abs(aim - origin.t))
        if reached:
            return Start(
                k,
                at.saved,
                at.v,
                at.a,
                np.array(at.rows),
                at.residual,
                walk.size,
                walk.rows == walk.rank,
                facts,
            )
    raise SolveError(
        f"case {case.name!r}: no sample next to the design can be reached; let the sweep come"
        " nearer to it",
        walk.lost.kind,
    )


def uneven(case: Case, title: str) -> str | None:
    """Return the reason why steps of equal length miss the samples, or None."""
    gaps = np.abs(np.diff(case.sweep.path.times))
    if len(gaps) and np.ptp(gaps) > EQUIDISTANT * gaps.max():
        return (
            f"samples are not equidistant in time, and {title}'s steps are; give the sweep by"
            " start, stop and steps"
        )
    return None


def simulated(
    case: Case, start: Start, simulator: Simulator, details: Mapping[str, Any]
) -> Trajectory:
    """Simulate both legs; see `Engine.solve`."""
    n = len(case.sweep.path.times)
    motion = np.full((3, n, len(case.points), 3), np.nan)
    solved, steps = np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.int64)
    residuals, messages = list[float](), list[str]()
    for leg in legs(case, start.sample):
        reached = 0
        try:
            for k, pose in zip(leg.samples, simulator(leg), strict=False):
                if not (np.isfinite(pose.points[0]).all() and pose.residual <= TORN * start.size):
                    raise SimulationEndedError(
                        f"its constraints are violated by {pose.residual:.3g}, more than {TORN:g}"
                        " of its size"
                    )
                motion[:, k], solved[k], reached = pose.points, True, reached + 1
                motion[1, k] *= leg.sign
                steps[k] = pose.steps
                residuals.append(pose.residual)
        except SimulationEndedError as why:
            where = case.sweep.path.where
            last = (
                f"last sample reached at {where(leg.times[reached - 1])}"
                if reached
                else "no sample reached on this side"
            )
            messages.append(
                f"cannot be followed to {where(leg.times[min(reached, len(leg.times) - 1)])}:"
                f" {why}; {last}"
            )
    known = [not np.isnan(motion[order][solved]).any() for order in range(3)]
    points = {
        name: PointMotion(
            motion[0, :, k],
            motion[1, :, k] if known[1] else None,
            motion[2, :, k] if known[2] else None,
        )
        for k, name in enumerate(case.points)
    }
    return Trajectory(
        points,
        solved,
        steps,
        largest_found(np.array(residuals)),
        "; ".join(messages),
        {**details, **start.facts},
    )


def legs(case: Case, start: int) -> list[Leg]:
    """Return the legs from a sample to both ends of the sweep.

    Samples at the same time as the start are in the first leg. A start without other samples is one
    leg.
    """
    times = case.sweep.path.times
    sides = [
        np.concatenate([[start], side[side != start]])
        for side in outwards(times, float(times[start]))
    ]
    ways = [Leg(case, side, sign) for side, sign in zip(sides, (1.0, -1.0), strict=True)]
    return [leg for leg in ways if len(leg.samples) > 1] or ways[:1]
