"""Exudyn in simulate mode: its own static and dynamic solvers over a whole leg of the sweep.

Joints are as in projection. A generic joint with a moving offset has no rate, so driven coordinates
are constraints on Exudyn's relative coordinates of two bodies, and so are the relations of screws,
gears, racks and pinions. The drivers' values come from Python, from a table prepared beforehand.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ...core import joints
from ...core.case.case import Case
from ...core.joints.base import unit
from ...core.kinematics import start_of as where_from
from ...core.mechanism.mechanism import GROUND
from ...core.mechanism.motions import Driver, JointDriver, PointCoordinate
from ...core.trajectory import Array
from ..exudyn.exudyn import Exudyn, ExudynModel
from ..exudyn.rows import Rows, System
from ..shared.exudyn_joints import objects_of
from ..shared.tree_plan import ends_of
from .simulation import (
    Leg,
    SimulatedPose,
    Simulation,
    SimulationEndedError,
    start_of,
    uneven_samples,
)


class DriverTable:
    """Values and rates of the drivers at every step of a leg, which Exudyn reads at its time."""

    def __init__(self) -> None:
        self.per_second, self.rows = 1.0, list[list[list[float]]]()

    def reader(self, order: int, value: int) -> Any:
        """Return a user function of Exudyn for one driver and order of derivative."""

        def at(mbs: Any, t: float, number: int, offset: float) -> float:
            return self.rows[order][value][round(t * self.per_second)]

        return at


class Coordinates(Rows):
    """The rows, with drivers and relations for Exudyn's own solvers.

    Attributes:
        angles: driver number of each relative angle, or None; the turns of these angles are
            counted.
    """

    def __init__(
        self, system: System, case: Case, table: DriverTable, *, loaded: bool = False
    ) -> None:
        self.table = table
        self.angles: list[int | None] = []
        super().__init__(system, case.mechanism, loaded=loaded)

    def relative(self, name: str, freedom: str, value: int | None = None) -> int:
        """Return a new marker for the coordinate of a joint."""
        joint: Any = self.mechanism.joint(name)
        if freedom == "translation":
            return self.shift(joint.i, joint.j, joint.point, joint.axis)
        (i, _), (j, _) = (self.bodies[body] for body in joint.bodies)
        node = self.mbs.AddNode(
            self.items.NodeGenericData(initialCoordinates=[0.0], numberOfDataCoordinates=1)
        )
        self.angles.append(value)
        axis = [*unit(joint.axis)]
        marker = self.items.MarkerBodiesRelativeRotationCoordinate(
            bodyNumbers=[i, j], nodeNumber=node, axis0=axis
        )
        return self.mbs.AddMarker(marker)

    def shift(self, i: str, j: str, point: Sequence[float], axis: Sequence[float]) -> int:
        """Return a new marker for the displacement of a point of body j along an axis of body i."""
        numbers, origins = zip(*(self.bodies[body] for body in (i, j)), strict=True)
        arms = [np.subtract(point, origin) for origin in origins]
        marker = self.items.MarkerBodiesRelativeTranslationCoordinate(
            bodyNumbers=[*numbers],
            localPosition0=arms[0],
            localPosition1=arms[1],
            axis0=[*unit(axis)],
        )
        return self.mbs.AddMarker(marker)

    def drive(self, driver: Driver, value: int) -> None:
        if isinstance(driver, PointCoordinate):
            point = self.mechanism.point(driver.point)
            marker = self.shift(GROUND, point.body, point.position, driver.direction)
        else:
            assert isinstance(driver, JointDriver)
            marker = self.relative(driver.joint, driver.freedom, value)
        still = self.mbs.AddNode(self.items.NodePointGround())
        rest = self.mbs.AddMarker(self.items.MarkerNodeCoordinate(nodeNumber=still, coordinate=0))
        self.connect(
            self.items.ObjectConnectorCoordinate(
                markerNumbers=[rest, marker],
                offset=1.0,
                offsetUserFunction=self.table.reader(0, value),
                offsetUserFunction_t=self.table.reader(1, value),
            ),
            range(1),
        )

    def relate(self, terms: Sequence[tuple[str, str, float]]) -> None:
        (one, large), (other, small) = sorted(
            ((self.relative(joint, freedom), weight) for joint, freedom, weight in terms),
            key=lambda term: -abs(term[1]),
        )
        self.connect(
            self.items.ObjectConnectorCoordinate(
                markerNumbers=[other, one], factor1=-large / small
            ),
            range(1),
        )


# Exudyn's objects keep products only at zero; a smaller value is round-off, below any residual.
NOTHING = 1e-12


def limitation_of(case: Case) -> str | None:
    """Return the reason why Exudyn's own solvers cannot simulate the case; None without one."""
    for joint in case.mechanism.joints:
        if isinstance(joint, joints.ConstantVelocity):
            return (
                f"{joint}: Exudyn's own solvers have no object that ties two products, which"
                " the joint needs"
            )
        for each in objects_of(joint, ends_of(case.mechanism, joint)):
            if abs(each.keeps) > NOTHING:
                return (
                    f"{joint} keeps a product at {each.keeps:.3g}, and Exudyn's own objects keep"
                    " products at only zero; make its axes exact"
                )
    for coupler in case.mechanism.couplers:
        if coupler.curve:
            return f"{coupler}: Exudyn's own solvers have no object that keeps a curve"
        if len(coupler.joints) > 2:
            return f"{coupler}: this adapter gives Exudyn's own solvers relations of two joints"
    if case.balance is None and (reason := uneven_samples(case, "Exudyn")) is not None:
        return reason
    if case.mechanism.couplers and not where_from(case.mechanism, case.sweep.path).starts_at_design:
        return (
            "turns of coupled joints count from the design, where this motion does not begin; use"
            " projection"
        )
    return None


# Relative and absolute tolerance of Newton; it leaves the constraints at round-off.
TIGHT = 1e-12


@dataclass(frozen=True)
class Solver(Simulation):
    """Exudyn's solver.

    Attributes:
        kind: "static", one load step per sample, only positions; "trapezoidal", index 2: rates
            satisfy the constraints and positions drift, the only one without oscillating
            accelerations; "generalized alpha", index 3: positions satisfy the constraints and rates
            drift.
        steps: number of steps between samples.
        modified: whether Newton keeps its Jacobian from step to step, as dynamic solvers always do
            by default.
        tolerance: tolerance of Newton, relative and absolute.
    """

    name: str
    kind: str
    steps: int = 1
    modified: bool = True
    tolerance: float = TIGHT
    projection = Exudyn
    loop = "simulator"

    @property
    def settings(self) -> Mapping[str, Any]:
        """Settings other than Exudyn's defaults."""
        return {
            "solver": {
                "static": "SolveStatic",
                "trapezoidal": "SolveDynamic, TrapezoidalIndex2",
                "generalized alpha": "SolveDynamic, GeneralizedAlpha, spectral radius 0.6, index 3",
            }[self.kind],
            "newton": (
                f"{'modified' if self.modified else 'full'}, relative and absolute tolerance"
                f" {self.tolerance:g}"
            ),
            "steps per sample": self.steps,
            "drivers": (
                "coordinate constraints on relative coordinates, values from a table by a Python"
                " function"
            ),
            "linear solver": "EXUdense; where rows are redundant, EigenDense that ignores it",
        }

    def unsupported(self, case: Case) -> str | None:
        """Return a message on an unsupported joint, driver or sample grid, or None."""
        return Exudyn().unsupported(case) or limitation_of(Exudyn().with_known_joints(case))

    def efforts(self) -> Mapping[str, Solver]:
        """Return the efforts by the tolerance of Newton, or by the number of steps."""
        if self.kind == "static":
            return {
                f"Newton to {tol:g}": replace(self, tolerance=tol)
                for tol in (1e-2, 1e-4, 1e-8, 1e-12, 1e-14)
            }
        return {f"{n} steps a sample": replace(self, steps=n) for n in (1, 2, 4, 8, 16)}

    def build(self, case: Case) -> _Solved:
        """Return Exudyn's system and its start."""
        return _Solved(Exudyn().with_known_joints(case), self)


class _Solved:
    def __init__(self, case: Case, how: Solver) -> None:
        self.system, self.how, self.of = System(), how, ExudynModel(case)
        self.start = start_of(self.of, case)
        mbs, items, kinds = self.system.mbs, self.system.items, self.system.kinds
        self.exu, self.mbs = self.system.exu, mbs
        self.table = DriverTable()
        rows = Coordinates(self.system, case, self.table)
        self.angles = rows.angles
        self.sensors: list[list[int]] = []
        self.still: dict[int, Array] = {}
        for k, point in enumerate(map(case.mechanism.point, case.points)):
            number, origin = rows.bodies[point.body]
            arm = np.array(point.position) - origin
            if number == rows.ground:  # Exudyn has no acceleration output there
                self.still[k] = arm
            wanted = (
                (kinds.Position,)
                if how.kind == "static"
                else (kinds.Position, kinds.Velocity, kinds.Acceleration)
            )
            make = {
                "bodyNumber": number,
                "localPosition": arm,
                "storeInternal": True,
                "writeToFile": False,
            }
            asked = () if k in self.still else wanted
            self.sensors.append(
                [mbs.AddSensor(items.SensorBody(**make, outputVariableType=kind)) for kind in asked]
            )
        state = kinds.Coordinates
        self.nodes = [
            mbs.AddSensor(
                items.SensorNode(
                    nodeNumber=node, storeInternal=True, writeToFile=False, outputVariableType=state
                )
            )
            for node in rows.nodes
        ]
        mbs.Assemble()
        self.settings = self._settings()
        # rows that follow none of the additional unknowns
        self.own = ~self.of.shared.any(axis=1)
        self.details: dict[str, Any] = {
            "rows": len(rows.rows),
            "independent_rows": self.start.independent,
        }

    def _settings(self) -> Any:
        settings = self.system.settings()
        settings.solution.sensors.writePeriod = 1e-9  # at every step
        types = self.exu.LinearSolverType
        settings.linearSolver.solverType = (
            types.EXUdense if self.start.independent else types.EigenDense
        )
        settings.linearSolver.ignoreSingularJacobian = not self.start.independent
        for each in (settings.staticSolver, settings.timeIntegration):
            each.verboseMode, each.adaptiveStep = 0, False
            each.newton.relativeTolerance = each.newton.absoluteTolerance = self.how.tolerance
            each.newton.useModifiedNewton = self.how.modified
        alpha = settings.timeIntegration.generalizedAlpha
        alpha.spectralRadius, alpha.useNewmark, alpha.useIndex2Constraints = 0.6, False, False
        # it would assume unaccelerated drivers, since it has only their values
        alpha.computeInitialAccelerations = False
        return settings

    def run(self, leg: Leg) -> Iterator[SimulatedPose]:
        """Yield the poses of a leg."""
        steps = self.how.steps
        n = (len(leg.samples) - 1) * steps
        # the times of all steps, which contain the exact times of the samples
        times = np.interp(np.arange(n + 1) / steps, np.arange(len(leg.samples)), leg.times)
        driven = leg.drive(times)
        if not n:  # its sensors store every step of the solver
            known = self.start.points.copy()
            if self.how.kind == "static":
                known[1:] = np.nan
            yield SimulatedPose(known, self.start.residual, 0)
            return
        self.table.rows = driven.tolist()
        self.set_off(leg, driven)
        failed = ""
        try:
            self.advance(n, abs(float(times[-1] - times[0])))
        except RuntimeError as error:  # Exudyn's SolverError; the samples stored before are valid
            failed = str(error).strip().split("\n")[0]
        yield from self.poses(driven)
        if failed:
            raise SimulationEndedError(f"Exudyn: {failed}")

    def set_off(self, leg: Leg, driven: Array) -> None:
        """Set Exudyn's initial values."""
        state, initial = self.mbs.systemData, self.exu.ConfigurationType.Initial
        n = self.of.coordinates
        state.SetODE2Coordinates(self.start.configuration[:n], initial)
        state.SetODE2Coordinates_t(leg.sign * self.start.v[:n], initial)
        state.SetODE2Coordinates_tt(self.start.a[:n], initial)
        if self.angles:
            state.SetDataCoordinates(
                [0.0 if value is None else driven[0, value, 0] for value in self.angles], initial
            )

    def advance(self, steps: int, duration: float) -> None:
        """Run Exudyn's solver to the end of the leg."""
        if self.how.kind == "static":
            static = self.settings.staticSolver
            static.numberOfLoadSteps = static.loadStepDuration = steps
            self.table.per_second = 1.0
            self.mbs.SolveStatic(self.settings, showHints=False)
        else:
            dynamic, solvers = self.settings.timeIntegration, self.exu.DynamicSolverType
            dynamic.numberOfSteps, dynamic.endTime = steps, duration
            self.table.per_second = steps / duration
            solver = (
                solvers.TrapezoidalIndex2
                if self.how.kind == "trapezoidal"
                else solvers.GeneralizedAlpha
            )
            self.mbs.SolveDynamic(self.settings, solverType=solver, showHints=False)

    def poses(self, driven: Array) -> Iterator[SimulatedPose]:
        """Yield the stored samples, all with the residual of the last one, which has the largest
        drift.
        """
        steps = self.how.steps
        stored = [
            [self.sensor_values(sensor)[::steps] for sensor in sensors] for sensors in self.sensors
        ]
        state = np.hstack([self.sensor_values(sensor) for sensor in self.nodes])[::steps]
        last = len(state) - 1
        self.of.restore(
            np.concatenate([state[last], np.zeros(self.of.unknowns - self.of.coordinates)])
        )
        residual = float(np.abs(self.of.residual(driven[0, :, last * steps])[self.own]).max())
        points = np.full((3, len(state), len(self.sensors), 3), np.nan)
        for k, quantities in enumerate(stored):
            if k in self.still:
                points[:, :, k] = 0.0
                points[0, :, k] = self.still[k]
            for order, values in enumerate(quantities):
                points[order, :, k] = values
        for k in range(last + 1):
            yield SimulatedPose(points[:, k], residual, steps if k else 0)

    def sensor_values(self, sensor: int) -> Array:
        """Return the stored values of a sensor without the times, shape (steps + 1, values)."""
        return np.array(self.mbs.GetSensorStoredData(sensor))[:, 1:]


trapezoidal = partial(Solver, "exudyn", "trapezoidal", steps=4)
alpha = partial(Solver, "exudyn-alpha", "generalized alpha", steps=4)
modified = partial(Solver, "exudyn-static-modified", "static")
