"""Simbody in projection mode: its joints as a spanning tree, its own constraints to close loops.

The simulator comes with OpenSim's Python package. A cut joint has its slides and hinges on its
first body (see `tree_plan`); one constraint of Simbody, of a point or of a whole frame, ties
their end to the second body. A rod is a constant distance, and a coordinate coupler relates two
coordinates. Simbody gives residual, Jacobian and bias of these rows; the base adds the drivers.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ...core.case.case import Case
from ...core.harness.engine import Floor
from ...core.mechanism.drivers import PointCoordinate
from ...core.mechanism.mechanism import Vector
from ...core.trajectory import Array
from ..shared.compiled_floor import Call, floor_of
from ..shared.opensim_frames import euler_angles
from ..shared.tree_engine import LEAST, TreeEngine
from .forces import LoadedSimbody
from .rotations import UNTURNED, turned
from .stations import Station


class Simbody(TreeEngine):
    """The engine `simbody`."""

    name, title, package = "simbody", "Simbody", "opensim"

    @property
    def described(self) -> Mapping[str, Any]:
        """Return the coordinates of Simbody's tree and the calls that give the rows of its
        constraints.
        """
        return {
            "coordinates": (
                "spanning tree of OpenSim's slider, pin and ball joints; balls keep Euler"
                " parameters here, and Simbody gets their Euler angles"
            ),
            "residual": "getQErr; drivers: coordinates, or points of bodies",
            "jacobian": "calcG; driven points: calcFrameJacobian",
            "acceleration": (
                "calcBiasForAccelerationConstraints; points: calcBiasForFrameJacobian"
            ),
            "cut_joints": (
                "ConstantDistanceConstraint or PointOnLineConstraint; or PointConstraint or"
                " WeldConstraint, to an auxiliary body where the joint has slides or hinges"
            ),
            "relations": "CoordinateCouplerConstraint",
        }

    def model_of(self, case: Case) -> SimbodyModel:
        """Return OpenSim's model of the case."""
        return SimbodyModel(opensim(), case)

    def floor(self, case: Case) -> Floor:
        """Return the floor from Simbody's stages and its calls for constraints and points."""
        model = self.model_of(self.own(case))
        solved = self.solve(model, case, 1e-12)
        own = _calls(model)
        least = _calls(self.model_of(replace(case, mechanism=LEAST, outputs=())))
        driven = sum(isinstance(each, PointCoordinate) for each in case.mechanism.drivers)
        points = len(model.wanted)

        def timed(**times: int) -> Mapping[str, tuple[Call, Call, int]]:
            return {name: (own[name], least[name], n) for name, n in times.items()}

        pose = timed(realizePosition=1, calcG=1, calcFrameJacobian=driven)
        rates = timed(
            realizeVelocity=2,
            calcBiasForAccelerationConstraints=1,
            calcBiasForFrameJacobian=driven,
            calcStationJacobian=points,
            calcBiasForStationJacobian=points,
        )
        return floor_of(self.name, solved, model.unknowns, pose, rates)


def _calls(of: SimbodyModel) -> Mapping[str, Call]:
    """Return the calls of the projection mode into Simbody, by name."""
    whole, matter, state, J, b = of.model, of.matter, of.state, of.matrix, of.column
    q, u = (of.o.Vector.createFromMat(np.zeros(n)) for n in (of.slots, of.unknowns))
    station = of.make_frame(1, np.zeros(3))
    at = station.carrier.getMobilizedBodyIndex(), station.point
    return {
        "realizePosition": lambda: (state.setQ(q), whole.realizePosition(state)),
        "realizeVelocity": lambda: (state.setU(u), whole.realizeVelocity(state)),
        "calcG": partial(matter.calcG, state, J),
        "calcBiasForAccelerationConstraints": partial(
            matter.calcBiasForAccelerationConstraints, state, b
        ),
        "calcFrameJacobian": partial(matter.calcFrameJacobian, state, *at, J),
        "calcBiasForFrameJacobian": partial(matter.calcBiasForFrameJacobian, state, *at),
        "calcStationJacobian": partial(matter.calcStationJacobian, state, *at, J),
        "calcBiasForStationJacobian": partial(matter.calcBiasForStationJacobian, state, *at),
    }


def opensim() -> Any:
    """Return OpenSim's package without its messages, imported at the first call."""
    package: Any = importlib.import_module("opensim")
    package.Logger.setLevelString("Off")
    return package


@dataclass(frozen=True, eq=False)
class Constraints:
    """All rows of Simbody's constraints; see `frame_constraints.Condition`."""

    of: SimbodyModel
    n: int

    def rows(self) -> tuple[Any, Array]:
        state, G = self.of.state, self.of.matrix
        self.of.matter.calcG(state, G)
        return state.getQErr().to_numpy(), G.to_numpy()

    def bias(self) -> Any:
        self.of.matter.calcBiasForAccelerationConstraints(self.of.state, self.of.column)
        return self.of.column.to_numpy()


class SimbodyModel(LoadedSimbody):
    """The constrained tree in Simbody's state.

    The configuration q has the coordinates of slides and hinges at Simbody's indices, and Euler
    parameters at the four indices of a ball.

    Attributes:
        slots: number of Simbody's coordinates.
        balls: indices of each ball's coordinates in q and v.
    """

    def finish(self) -> None:
        o = self.o
        self.model.finalizeConnections()
        self.state = self.model.initSystem()
        self.matter = self.model.getMatterSubsystem()
        self.slots, n = self.state.getNQ(), self.state.getNU()
        # each value is its index, so that every coordinate reports its index
        self.state.setQ(o.Vector.createFromMat(np.arange(float(self.slots))))
        self.state.setU(o.Vector.createFromMat(np.arange(float(n))))
        first = [move.get_coordinates(0) for move in self.moves]
        self.places = [
            (int(each.getValue(self.state)), int(each.getSpeedValue(self.state))) for each in first
        ]
        turns = [move.numCoordinates() == 3 for move in self.moves]
        self.balls = [at for at, ball in zip(self.places, turns, strict=True) if ball]
        self.single = np.array(
            [at for at, ball in zip(self.places, turns, strict=True) if not ball], dtype=np.intp
        ).reshape(-1, 2)
        self.matrix, self.column = o.Matrix(), o.Vector()
        rows = self.state.getNQErr()
        if rows:
            self.conditions.insert(0, Constraints(self, rows))

    @property
    def unknowns(self) -> int:
        return self.state.getNU()

    def coordinate(self, body: Any) -> tuple[int, int]:
        return self.places[int(body) - 1]

    def design(self) -> Array:
        q = np.zeros(self.slots)
        for at, _ in self.balls:
            q[at : at + 4] = UNTURNED
        return q

    def moved(self, dx: Array) -> Array:
        q, (at_q, at_v) = self.q.copy(), self.single.T
        q[at_q] += dx[at_v]
        for k, n in self.balls:
            q[k : k + 4] = turned(q[k : k + 4].tolist(), dx[n : n + 3].tolist())
        return q

    def place(self) -> None:
        q = self.q.copy()
        for k, _ in self.balls:
            q[k : k + 4] = *euler_angles(q[k : k + 4].tolist()), 0.0
        self.state.setQ(self.o.Vector.createFromMat(q))
        self.model.realizePosition(self.state)

    def rate(self, v: Array, a: Array) -> None:
        self.u, self.a = v, a
        self.state.setU(self.o.Vector.createFromMat(v))
        self.model.realizeVelocity(self.state)

    def add_frame(self, body: int, at: Vector) -> Any:
        # separate from the frames of the base, which reads all their data at every pose
        return self.make_frame(body, np.array(at) - self.origin[body])

    def make_frame(self, body: int, offset: Array) -> Station:
        return Station(self, body, self.bodies[body], self.vector(offset))

    def placement(self, handle: Station) -> tuple[Array, Array]:
        return handle.position, handle.rotation

    def slope(self, handle: Station) -> Array:
        return handle.jacobian

    def motion(self, handle: Station) -> tuple[Array, Array]:
        return handle.velocity, handle.acceleration

    def points(self, v: Array, a: Array) -> list[tuple[Array, Array, Array]]:
        self.rate(v, a)
        stations: list[Any] = self.wanted
        return [station.motion() for station in stations]
