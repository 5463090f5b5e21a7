"""Simbody in projection mode: its joints as a spanning tree, its own constraints to close loops.

The simulator comes with OpenSim's Python package. A cut joint hangs its slides and hinges on its
first body (see `joint_chains`); one constraint of Simbody, of a point or of a whole frame, ties
their end to the second body. A rod is a constant distance, and a coordinate coupler ties two
coordinates. Residual, Jacobian and bias of these rows are Simbody's; the base adds the drivers.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.case.case import Case
from ...core.harness.engine import Floor
from ...core.joints import Translational
from ...core.mechanism.drivers import JointDisplacement
from ...core.mechanism.mechanism import GROUND, Body, Mechanism, Vector
from ...core.trajectory import Array
from ..shared.compiled_floor import floor_of
from ..shared.length_scaling import in_own_frame
from ..shared.loop_closures import CLOSURES
from ..shared.projection_engine import ProjectionEngine
from .constrained_tree import ConstrainedTree
from .rotations import UNTURNED, euler_angles, turned
from .stations import Station


class Simbody(ProjectionEngine):
    """The engine `simbody`."""

    name, package, title, joints = "simbody", "opensim", "Simbody", CLOSURES

    @property
    def described(self) -> Mapping[str, Any]:
        """Coordinates of Simbody's tree and the calls that give the rows of its constraints."""
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

    def build(self, case: Case) -> SimbodyModel:
        """Return OpenSim's model of the case, at the design position."""
        return SimbodyModel(opensim(), in_own_frame(case))

    def floor(self, case: Case) -> Floor:
        """Return the floor from Simbody's stages and its calls for constraints and frames."""
        model = self.build(case)
        solved = self.solve(model, case, 1e-12)
        own, least = (
            _calls(each)
            for each in (model, SimbodyModel(model.o, replace(case, mechanism=LEAST, outputs=())))
        )
        frames, points = len(model.moving), len(model.wanted)
        times = {
            "realizePosition": 1,
            "calcG": 1,
            "calcFrameJacobian": frames,
            "realizeVelocity": 2,
            "calcBiasForAccelerationConstraints": 1,
            "calcBiasForFrameJacobian": frames + points,
        }
        parts = [(name, (own[name], least[name], each)) for name, each in times.items()]
        return floor_of(self, solved, model.unknowns, dict(parts[:3]), dict(parts[3:]))


LEAST = Mechanism(
    "slide",
    [Body("slide")],
    [Translational("rail", GROUND, "slide", point=(0.0, 0.0, 0.0), axis=(1.0, 0.0, 0.0))],
    [],
    [JointDisplacement("push", "rail")],
)
"""The smallest mechanism, for the floor."""


def _calls(of: SimbodyModel) -> Mapping[str, Callable[[], Any]]:
    """Return the calls of the projection mode into Simbody, by name."""
    whole, matter, state = of.model, of.matter, of.state
    (q, u), J = (
        (of.o.Vector.createFromMat(np.zeros(n)) for n in (of.slots, of.unknowns)),
        of.o.Matrix(),
    )
    at = of.make_frame(1, np.zeros(3))
    body = at.body.getMobilizedBodyIndex()
    return {
        "realizePosition": lambda: (state.setQ(q), whole.realizePosition(state)),
        "calcG": lambda: matter.calcG(state, J),
        "calcFrameJacobian": lambda: matter.calcFrameJacobian(state, body, at.point, J),
        "realizeVelocity": lambda: (state.setU(u), whole.realizeVelocity(state)),
        "calcBiasForAccelerationConstraints": lambda: matter.calcBiasForAccelerationConstraints(
            state, of.vector_
        ),
        "calcBiasForFrameJacobian": lambda: matter.calcBiasForFrameJacobian(state, body, at.point),
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
        return self.of.constraint_rows()

    def bias(self) -> Any:
        return self.of.constraint_bias()


class SimbodyModel(ConstrainedTree):
    """The constrained tree in Simbody's state.

    The configuration q has the coordinates of slides and hinges at the places that Simbody has for
    them, and Euler parameters at the four places of a ball.

    Attributes:
        slots: the number of Simbody's coordinates.
        balls: places of a ball's coordinates in q and v.
    """

    def finish(self) -> None:
        o = self.o
        self.model.finalizeConnections()
        self.state = self.model.initSystem()
        self.matter = self.model.getMatterSubsystem()
        self.slots, n = self.state.getNQ(), self.state.getNU()
        # every coordinate is given its place as value, and tells it
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
        self.matrix, self.vector_ = o.Matrix(), o.Vector()
        rows = self.state.getNQErr()
        if rows:
            self.conditions.insert(0, Constraints(self, rows))

    @property
    def unknowns(self) -> int:
        return self.state.getNU()

    def coordinate(self, body: int) -> tuple[int, int]:
        return self.places[body - 1]

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
        self.a = a
        self.state.setU(self.o.Vector.createFromMat(v))
        self.model.realizeVelocity(self.state)

    def add_frame(self, body: int, at: Vector) -> Any:
        # not among the frames of the base, which reads all of each at every pose
        return self.make_frame(body, np.array(at) - self.origin[body])

    def make_frame(self, body: int, offset: Array) -> Station:
        return Station(self, self.bodies[body], self.vector(offset))

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

    def constraint_rows(self) -> tuple[Array, Array]:
        """Return residual and Jacobian of Simbody's constraints."""
        self.matter.calcG(self.state, self.matrix)
        return self.state.getQErr().to_numpy(), self.matrix.to_numpy()

    def constraint_bias(self) -> Array:
        """Return Jdot v of Simbody's constraints."""
        self.matter.calcBiasForAccelerationConstraints(self.state, self.vector_)
        return self.vector_.to_numpy()
