"""Equilibria by Exudyn's own static solver: its bodies, joints, springs, loads and Newton.

Exudyn's bushing measures Cardan angles. Bushings, curves of springs, and they alone, have their law
by user functions, of displacement and rotation as Exudyn measures them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from ...core.case.case import Case
from ...core.forces import Forces
from ...core.mechanism.loads import Bushing, SpringDamper, TorsionSpringDamper
from ...core.trajectory import Array, Trajectory
from ..exudyn.exudyn import Exudyn, Loads
from ..exudyn.rows import System
from ..shared.exudyn_joints import frame_along
from ..shared.force_solution import elastic_force, elastic_forces, elastic_torque
from ..simulate.exudyn_solvers import Coordinates, DriverTable, Solver
from .walk import Rest, equilibria

# Tolerance of Newton on forces out of balance, as a part of the largest stiffness and load: the
# round-off of positions of a metre, which stiffness turns into forces.
TIGHT = 1e-15
# Longest change of positions and Euler parameters in a step [m, -], and its smallest part of a way.
LONG, SHORTEST = 0.1, 2.0**-16


class StaticLoads(Loads):
    """Loads that Exudyn's static solver evaluates by itself."""

    def add(self, each: Any) -> None:
        """Add a force element."""
        rows, items = self.rows, self.items
        if isinstance(each, Bushing):
            markers = [
                rows.marker(body, each.point, np.array(each.triad).T) for body in each.bodies
            ]
            stiffness = np.diag([*each.stiffness, *each.turning_stiffness])
            self.mbs.AddObject(
                items.ObjectConnectorRigidBodySpringDamper(
                    markerNumbers=markers,
                    stiffness=stiffness,
                    springForceTorqueUserFunction=self._bushing(each, markers),
                )
            )
            if not self.mechanism.is_fixed(each.i):
                couple = items.LoadTorqueVector(
                    markerNumber=markers[0], loadVectorUserFunction=self._couple(each, markers)
                )
                self.mbs.AddLoad(couple)
        elif isinstance(each, SpringDamper) and each.curve:
            self.add_spring(each, springForceUserFunction=_law(each, 0.0))
        elif isinstance(each, TorsionSpringDamper):
            joint: Any = self.mechanism.joint(each.joint)
            turns = items.NodeGenericData(numberOfDataCoordinates=1, initialCoordinates=[0.0])
            curved = {"springTorqueUserFunction": _law(each, each.free_angle)} if each.curve else {}
            self.mbs.AddObject(
                items.ObjectConnectorTorsionalSpringDamper(
                    markerNumbers=rows.markers(joint, joint.point, frame_along(joint.axis, 2)),
                    nodeNumber=self.mbs.AddNode(turns),
                    stiffness=each.stiffness,
                    offset=each.free_angle,
                    **curved,
                )
            )
        else:
            super().add(each)

    def _bushing(self, each: Bushing, markers: Sequence[int]) -> Any:
        """Return force and torque on the first body, as a user function of Exudyn."""

        def law(mbs: Any, t: float, item: int, displacement: Any, *others: Any) -> list[float]:
            i, j = (
                np.array(mbs.GetMarkerOutput(marker, self.kinds.RotationMatrix)).reshape(3, 3)
                for marker in markers
            )
            return [*elastic_forces(each, np.array(displacement)), *elastic_torque(each, i.T @ j)]

        return law

    def _couple(self, each: Bushing, markers: Sequence[int]) -> Any:
        """Return the torque of the force on the first body, which acts at the second one's point;
        Exudyn lets it act at the first one's.
        """

        def couple(mbs: Any, t: float, load: Any) -> list[float]:
            i, j = (np.array(mbs.GetMarkerOutput(k, self.kinds.Position)) for k in markers)
            turned = mbs.GetMarkerOutput(markers[0], self.kinds.RotationMatrix)
            axes = np.array(turned).reshape(3, 3)
            return [*np.cross(j - i, axes @ elastic_forces(each, axes.T @ (j - i)))]

        return couple


def _law(each: SpringDamper | TorsionSpringDamper, free: float) -> Any:
    """Return the force of a spring as a user function of Exudyn, of deflection plus `free`."""

    def law(mbs: Any, t: float, item: int, value: float, *others: Any) -> float:
        return elastic_force(each, value - free)

    return law


def _sizes(case: Case) -> list[float]:
    """Return the sizes of stiffnesses, slopes of curves, and loads."""
    names, found = ("stiffness", "turning_stiffness", "vector"), list[float]()
    for each in case.mechanism.forces:
        found += [float(np.abs(getattr(each, name, 0.0)).max()) for name in names]
        tables = getattr(each, "curve", None) or ()
        for table in tables if isinstance(each, Bushing) else [tables]:
            if len(table):
                steps: Array = np.diff(np.array(table, np.float64), axis=0)
                found.append(float(np.abs(steps[:, 1] / steps[:, 0]).max()))
    return found


class Statics:
    """Exudyn's system of a case with loads, its drivers held."""

    def __init__(self, case: Case) -> None:
        self.case, self.table = case, DriverTable()
        system = self.system = System()
        mbs = self.mbs = system.mbs
        self.exu, self.kinds = system.exu, system.kinds
        rows = self.rows = Coordinates(system, case, self.table, loaded=True)
        StaticLoads(rows, case)
        mbs.Assemble()
        self.state = mbs.systemData
        count = range(self.state.NumberOfLoads())
        self.loads = [np.array(mbs.GetLoadParameter(number, "loadVector")) for number in count]
        names = [driver.name for driver in case.mechanism.drivers]
        self.names = names
        self.values = case.sweep.path.drive(names, case.sweep.path.times)[0].T
        settings = self.settings = system.settings()
        settings.linearSolver.solverType = self.exu.LinearSolverType.EigenDense
        settings.linearSolver.ignoreSingularJacobian = True
        static = settings.staticSolver
        static.useLoadFactor = False
        static.verboseMode, static.adaptiveStep, static.numberOfLoadSteps = 0, False, 1
        static.newton.relativeTolerance = TIGHT
        static.newton.absoluteTolerance = TIGHT * max(1.0, *_sizes(case))
        static.newton.useModifiedNewton, static.newton.maxIterations = False, 40

    def solve(self, group: Sequence[int]) -> tuple[Mapping[int, Rest], Forces, str]:
        """Return samples in equilibrium, their forces, and why others are missing."""
        n, m = self.values.shape
        found, message, efforts = dict[int, Rest](), "", np.full((m, n), np.nan)
        near = [(np.zeros(m), 0.0, self._configuration())]
        for k in sorted(group, key=lambda k: float(np.linalg.norm(self.values[k]))):
            to = self.values[k]
            # without loads only if there is no sample yet
            start = min(near, key=lambda x: (x[1] < 1.0, float(np.linalg.norm(x[0] - to))))
            if message := self._advance(to, *start):
                continue
            near.append((to, 1.0, self._configuration()))
            found[k] = self._rest(to)
            efforts[:, k] = self._efforts()
        unknown, efforts = np.full(n, np.nan), dict(zip(self.names, efforts, strict=True))
        return found, Forces({}, efforts, {}, unknown, unknown), message

    def _configuration(self) -> tuple[Array, Array]:
        return np.array(self.state.GetODE2Coordinates()), np.array(self.state.GetDataCoordinates())

    def _advance(self, to: Array, start: Array, share: float, saved: tuple[Array, Array]) -> str:
        """Walk to driver values and all loads; return why the walk does not arrive, or nothing.

        Steps are halved if Newton fails, or goes far: plain Newton may land at another equilibrium.
        """
        done, step = 0.0, 1.0
        while done < 1.0:
            target = min(1.0, done + step)
            try:
                found = self._solve_static(start + target * (to - start), max(share, target), saved)
            except RuntimeError as error:  # Exudyn's SolverError
                why = f"Exudyn: {str(error).strip().splitlines()[0]}"
            else:
                if float(np.abs(found[0] - saved[0]).max()) <= LONG:
                    done, saved, step = target, found, 2.0 * step
                    continue
                why = "Exudyn's static solver leaps to another equilibrium"
            if (step := 0.5 * (target - done)) < SHORTEST:
                return why
        return ""

    def _solve_static(
        self, values: Array, share: float, saved: tuple[Array, Array]
    ) -> tuple[Array, Array]:
        """Return the state that Exudyn's solver finds from another one."""
        self.table.per_second = 0.0
        self.table.rows = [[[x] for x in values.tolist()], [[0.0] for _ in values]]
        for number, vector in enumerate(self.loads):
            self.mbs.SetLoadParameter(number, "loadVector", [*(share * vector)])
        self.state.SetODE2Coordinates(saved[0], self.exu.ConfigurationType.Initial)
        self.state.SetDataCoordinates(saved[1], self.exu.ConfigurationType.Initial)
        self.mbs.SolveStatic(self.settings, showHints=False)
        return self._configuration()

    def _rest(self, c: Array) -> Rest:
        still = np.zeros(0)
        points = list[Array]()
        for point in map(self.case.mechanism.point, self.case.points):
            number, origin = self.rows.bodies[point.body]
            arm = np.array(point.position) - origin
            at_rest = number == self.rows.ground
            at = arm if at_rest else self.mbs.GetObjectOutputBody(number, self.kinds.Position, arm)
            points.append(np.array(at))
        return Rest(self._configuration(), c, still, still, 0, 0.0, np.array(points))

    def _efforts(self) -> Array:
        drivers = self.rows.rows[len(self.rows.rows) - len(self.names) :]
        found = [self.mbs.GetObjectOutput(row.item, self.kinds.Force) for row in drivers]
        return np.array([float(np.atleast_1d(each)[0]) for each in found])


class StaticSolver(Solver):
    """Exudyn's static solver, which finds equilibria too."""

    def equilibria(self, case: Case) -> Trajectory:
        """Return the equilibria of a case; see `harness.engine.Balancing`."""
        return equilibria(
            case, lambda each, group: Statics(Exudyn().with_known_joints(each)).solve(group)
        )


static = partial(StaticSolver, "exudyn-static", "static", modified=False)
