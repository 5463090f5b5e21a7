"""A mechanism moved by its drivers: each value of a slider is a pose, with its loops closed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np

from ..case.case import HELD_BUT, SLOW, Case, size
from ..errors import KincheckError, SolveError, unknown
from ..harness.compare import output_series
from ..kinematics import NativeSolver, conditioning
from ..mechanism.motions import Path as Way
from ..mechanism.motions import Ramp, Slowed
from .protocol import VERSION, Answer, LiveDriver, Opening, Pose, Reached, Refused
from .table import (
    TOL,
    as_values,
    drawn,
    drawn_frames,
    live_axis,
    live_outputs,
    live_reference,
    sweep_axis,
)

WAY = 33
"""Samples on the way from the design to a pose; longer steps are divided by the solver."""
REACH = 129
"""Samples on the way to the end of a slider, which tell its reach."""


class LiveModel:
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
        return Opening(
            protocol=VERSION,
            kind=self.kind,
            file=self.file.name,
            source=self.case.source,
            unit=self.case.length_unit,
            axes="",
            points=[],
            outputs=live_outputs(self.case),
            axis=live_axis(self.axis),
            drivers=[*self.drivers.values()],
            engines=[*engines],
            save="",
            reference=live_reference(self.case),
            limits={},
            varied=False,
        )

    def answer(self, number: int) -> Answer | Refused:
        """Return the motion over the sweep of the case, or why there is none."""
        case, begin = self.case, perf_counter()
        try:
            found = self.solver.prepare(
                case.mechanism, case.sweep.path, case.points, self.bodies, case.forces
            )(TOL)
        except SolveError as error:
            return Refused(id=number, message=str(error), point="")
        solved = perf_counter()
        values = {
            each.name: as_values(output_series(case, each, found).position)
            for each in case.outputs
            if HELD_BUT not in each.facts
        }
        frames = drawn_frames(found.solved)
        poses = {
            name: np.concatenate([motion.r, motion.p], axis=1)[frames]
            for name, motion in found.bodies.items()
        }
        return Answer(
            id=number,
            outputs=values,
            solved=found.solved.tolist(),
            drawing=drawn(case, self.axis, frames, poses, values),
            frames=frames,
            message=found.message,
            milliseconds={"solve": 1e3 * (solved - begin), "rest": 1e3 * (perf_counter() - solved)},
        )

    def pose(self, number: int, values: Mapping[str, float], *, measured: bool) -> Pose:
        """Return the pose at values of the drivers, straight from the design, or the last pose
        before a lock-up.

        Args:
            measured: whether reactions and the distance from a singular pose are wanted, which
                takes longer.

        Raises:
            KincheckError: there is no such driver.
        """
        begin = perf_counter()
        changes = {name: value - self._known(name).design for name, value in values.items()}
        way = self._way(changes, np.linspace(0.0, 1.0, WAY))
        case = replace(self.case, sweep=replace(self.case.sweep, values=way.times))
        found = self.solver.prepare(case.mechanism, way, case.points, self.bodies, ())(TOL)
        reached = np.flatnonzero(found.solved)
        if not len(reached):
            raise KincheckError(f"{self.file.name}: {found.message}")
        last = int(reached[-1])
        share = float(way.times[last])
        solved = perf_counter()
        outputs = {
            each.name: as_values(output_series(case, each, found).position[[last]])[0]
            for each in case.outputs
            if HELD_BUT not in each.facts and not each.forces
        }
        distance = self._distance(changes, share) if measured else None
        reactions = self._reactions(changes, share) if measured else {}
        return Pose(
            id=number,
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
            distance=distance,
            reactions=reactions,
            message=found.message,
            milliseconds={"solve": 1e3 * (solved - begin), "rest": 1e3 * (perf_counter() - solved)},
        )

    def _way(self, changes: Mapping[str, float], times: np.ndarray) -> Way:
        """Return the path on which all drivers go to their values in a second."""
        names = [each.name for each in self.case.mechanism.drivers]
        design = {
            name: value for name in names if (value := self.case.mechanism.design_value(name))
        }
        return Way({name: Ramp(changes.get(name, 0.0)) for name in names}, times, design)

    def _distance(self, changes: Mapping[str, float], share: float) -> float:
        """Return the smallest singular value of the rows at a place of a way, over the one at its
        beginning.
        """
        way = self._way(changes, np.array([0.0, share]))
        poses = conditioning(self.case.mechanism, way, way.times, (), {}, 2, TOL).poses
        return poses[-1].smallest / poses[0].smallest

    def _reactions(self, changes: Mapping[str, float], share: float) -> dict[str, list[float]]:
        """Return the force of each joint at rest at a place of a way, of the global components that
        rigid bodies determine; none without loads.
        """
        mechanism = self.case.mechanism
        if not mechanism.forces and not any(body.mass for body in mechanism.moving):
            return {}
        way = self._way(changes, np.linspace(0.0, share, WAY))
        slow = {name: Slowed(motion, SLOW) for name, motion in way.motions.items()}
        joints = [joint.name for joint in mechanism.joints]
        still = Way(slow, way.times * SLOW, way.design)
        found = self.solver.prepare(mechanism, still, (), self.bodies, joints)(TOL).forces
        if found is None:
            return {}
        forces = {
            name: np.array([each.along(axis)[-1] for axis in np.eye(3)])
            for name, each in found.joints.items()
        }
        return {
            name: np.nan_to_num(each).tolist()
            for name, each in forces.items()
            if np.isfinite(each).any()
        }

    def reach(self, number: int, name: str) -> Reached:
        """Return the travel of a driver while the others rest.

        Raises:
            KincheckError: there is no such driver.
        """
        driver = self._known(name)
        ends, messages = list[float](), list[str]()
        for end in (driver.low, driver.high):
            way = self._way({name: end - driver.design}, np.linspace(0.0, 1.0, REACH))
            found = self.solver.prepare(self.case.mechanism, way)(TOL)
            share = float(way.times[found.solved].max(initial=0.0))
            ends.append(driver.design + share * (end - driver.design))
            messages.append("" if found.solved.all() else found.message)
        return Reached(
            id=number, driver=name, low=ends[0], high=ends[1], messages=(messages[0], messages[1])
        )

    def _known(self, name: str) -> LiveDriver:
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
