"""A mechanism moved by its drivers: each value of a slider is a pose, with its loops closed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np

from ...case.case import HELD_BUT, SLOW, Case, size
from ...case.designs import TOL
from ...errors import KincheckError, SolveError, unknown
from ...harness.compare import output_series
from ...kinematics import NativeSolver
from ...mechanism.motions import Path as Way
from ...mechanism.motions import Ramp, Slowed
from ...trajectory import Array
from ..explain.conditioning import conditioning
from ..explain.diagnose import diagnose
from .protocol import Answer, LiveDriver, Move, Opening, Pose, Reach, Reached, Solve
from .table import LiveFile, drawn, drawn_frames, sweep_axis

WAY = 33
"""Samples on the way from the design to a pose; longer steps are divided by the solver."""
REACH = 129
"""Samples on the way to the end of a slider, which tell its reach."""


class LiveModel(LiveFile):
    """A mechanism with drivers, opened.

    Args:
        file: the file of the case.
        case: the mechanism, its sweep and its outputs.
    """

    kind = "model"

    def __init__(self, file: Path, case: Case) -> None:
        self.file, self.case = file, case
        self.axis = sweep_axis(case)
        self.solver = NativeSolver()
        self.bodies = tuple(body.name for body in case.mechanism.moving)
        self.drivers = {each.name: self._driver(each.name) for each in case.mechanism.drivers}

    def opening(self, engines: Sequence[str]) -> Opening:
        """Return the mechanism as it is."""
        return self.opening_of(engines, drivers=[*self.drivers.values()])

    def solve(self, asked: Solve) -> Answer:
        """Return the motion over the sweep of the case; of a mechanism without one, its design
        position and the reason, with the rows that are off.
        """
        case, begin = self.case, perf_counter()
        try:
            found = self.solver.prepare(
                case.mechanism, case.sweep.path, case.points, self.bodies, case.forces
            )(TOL)
        except SolveError as error:
            reasons = diagnose(case, samples=1, tol=TOL).findings or [str(error)]
            return Answer(
                outputs={},
                solved=[False] * len(self.axis.values),
                drawing=drawn(case, self.axis, [], {}, {}),
                frames=[],
                message="; ".join(reasons),
                milliseconds={},
            )
        solved = perf_counter()
        values = {
            each.name: output_series(case, each, found).position.tolist()
            for each in case.outputs
            if HELD_BUT not in each.facts
        }
        frames = drawn_frames(found.solved)
        poses = {
            name: np.concatenate([motion.r, motion.p], axis=1)[frames]
            for name, motion in found.bodies.items()
        }
        return Answer(
            outputs=values,
            solved=found.solved.tolist(),
            drawing=drawn(case, self.axis, frames, poses, values),
            frames=frames,
            message=found.message,
            milliseconds={"solve": 1e3 * (solved - begin), "rest": 1e3 * (perf_counter() - solved)},
        )

    def move(self, asked: Move) -> Pose:
        """Return the pose at values of the drivers, straight from the design, or the last pose
        before a lock-up.

        Raises:
            KincheckError: there is no such driver.
        """
        begin, mechanism = perf_counter(), self.case.mechanism
        changes = {
            name: value - self._driver_named(name).design for name, value in asked.drivers.items()
        }
        # forces are those at rest
        way = self._way(changes, np.linspace(0.0, 1.0, WAY), SLOW if asked.measured else 1.0)
        sweep = replace(self.case.sweep, values=way.times, rate=0.0 if asked.measured else 1.0)
        case = replace(self.case, sweep=sweep)
        loaded = mechanism.forces or any(body.mass for body in mechanism.moving)
        joints = [each.name for each in mechanism.joints] if asked.measured and loaded else []
        wanted = dict.fromkeys([*joints, *(case.forces if asked.measured else ())])
        found = self.solver.prepare(mechanism, way, case.points, self.bodies, [*wanted])(TOL)
        reached = np.flatnonzero(found.solved)
        if not len(reached):
            raise KincheckError(f"{self.file.name}: {found.message}")
        last = int(reached[-1])
        share = last / (WAY - 1)
        solved = perf_counter()
        outputs = {
            each.name: float(output_series(case, each, found).position[last])
            for each in case.outputs
            if HELD_BUT not in each.facts and (asked.measured or not each.forces)
        }
        reactions = dict[str, Array]()
        if found.forces:
            known = found.forces.joints
            reactions = {
                name: np.array([known[name].along(axis)[last] for axis in np.eye(3)])
                for name in joints
                if name in known
            }
        return Pose(
            drivers={
                name: each.design + share * changes.get(name, 0.0)
                for name, each in self.drivers.items()
            },
            share=share,
            bodies={
                name: [*motion.r[last].tolist(), *motion.p[last].tolist()]
                for name, motion in found.bodies.items()
            },
            outputs=outputs,
            distance=self._distance(changes, share) if asked.measured else None,
            reactions={
                name: np.nan_to_num(force).tolist()
                for name, force in reactions.items()
                if np.isfinite(force).any()
            },
            message=found.message,
            milliseconds={"solve": 1e3 * (solved - begin), "rest": 1e3 * (perf_counter() - solved)},
        )

    def reach(self, asked: Reach) -> Reached:
        """Return the travel of a driver while the others rest.

        Raises:
            KincheckError: there is no such driver.
        """
        driver = self._driver_named(asked.driver)
        ends, messages = list[float](), list[str]()
        for end, way in zip((driver.low, driver.high), self.ways(driver), strict=True):
            found = self.solver.prepare(self.case.mechanism, way)(TOL)
            share = float(way.times[found.solved].max(initial=0.0))
            ends.append(driver.design + share * (end - driver.design))
            messages.append("" if found.solved.all() else found.message)
        return Reached(
            driver=driver.name, low=ends[0], high=ends[1], messages=(messages[0], messages[1])
        )

    def ways(self, driver: LiveDriver) -> Iterator[Way]:
        """Yield the paths from the design to the ends of a slider."""
        for end in (driver.low, driver.high):
            yield self._way({driver.name: end - driver.design}, np.linspace(0.0, 1.0, REACH))

    def _way(self, changes: Mapping[str, float], shares: Array, slow: float = 1.0) -> Way:
        """Return the path on which all drivers go to their values in a second, or so many times
        more slowly.
        """
        names = [each.name for each in self.case.mechanism.drivers]
        design = {
            name: value for name in names if (value := self.case.mechanism.design_value(name))
        }
        motions = {name: Slowed(Ramp(changes.get(name, 0.0)), slow) for name in names}
        return Way(motions, shares * slow, design)

    def _distance(self, changes: Mapping[str, float], share: float) -> float:
        """Return the smallest singular value of the rows at a place of a way, over the one at its
        beginning.
        """
        way = self._way(changes, np.array([0.0, share]))
        poses = conditioning(self.case.mechanism, way, way.times, (), {}, 2, TOL).poses
        return poses[-1].smallest / poses[0].smallest

    def _driver_named(self, name: str) -> LiveDriver:
        if name not in self.drivers:
            raise KincheckError(unknown("driver", name, self.drivers))
        return self.drivers[name]

    def _driver(self, name: str) -> LiveDriver:
        """Return a driver with a slider of a turn, or of a length of the mechanism, to both sides,
        or of its own wider sweep.
        """
        mechanism, sweep = self.case.mechanism, self.case.sweep
        design, turns = mechanism.design_value(name), mechanism.driver(name).turns
        far = np.pi if turns else size(self.case)
        own = sweep.change if sweep.driver == name else np.zeros(1)
        low, high = min(-far, float(own.min())), max(far, float(own.max()))
        return LiveDriver(name, "rad" if turns else "m", design, design + low, design + high)
