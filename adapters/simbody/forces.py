"""Forces by Simbody's own operators; private to its adapter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from ...core.mechanism.mechanism import Vector
from ...core.trajectory import Array
from ..shared.tree_forces import Mass, mass_properties
from ..shared.tree_reactions import RowWrench
from .constrained_tree import ConstrainedTree

COMPUTED_BY: Mapping[str, str] = {
    "inverse dynamics": "calcResidualForceIgnoringConstraints, getGravityBodyForces",
    "reactions of tree joints": (
        "Newton and Euler, of the adapter, by velocities and accelerations of Simbody's bodies"
    ),
    "reactions of cut joints": "calcConstraintForcesFromMultipliers",
    "force elements": "of the adapter, by stations of Simbody",
}


class LoadedSimbody(ConstrainedTree):
    """The tree with masses; see `tree_forces.LoadedTree`."""

    recursion: ClassVar[bool] = False
    computed_by: ClassVar[Mapping[str, str]] = COMPUTED_BY
    state: Any
    matter: Any

    def set_loads(self, gravity: Vector, masses: Sequence[Mass]) -> None:
        self.model.setGravity(self.vector(gravity))
        for each in masses:
            link: int = each.frame.body
            mass, center, I = mass_properties(each.body, self.origin[link])  # noqa: E741
            entries = I[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist()
            body = self.bodies[link]
            body.setMass(mass)
            body.setMassCenter(self.vector(center))
            body.setInertia(self.o.Inertia(*entries))

    def inverse_dynamics(self, v: Array, a: Array) -> Array:
        o, state, n = self.o, self.state, self.unknowns
        self.rate(v, a)
        self.model.realizeDynamics(state)
        none, found = o.Vector(n, 0.0), o.Vector(n, 0.0)
        gravity = self.model.getGravityBodyForces(state)
        self.matter.calcResidualForceIgnoringConstraints(
            state, none, gravity, o.Vector.createFromMat(np.ascontiguousarray(a)), found
        )
        return np.array(found.to_numpy())

    def look(self, frame: Any) -> None:
        pass  # stations are read on demand

    def exerted(self) -> list[RowWrench]:
        found = super().exerted()
        origins = [self.position_of(number) for number in range(len(self.bodies))]
        for rows, keeps in self.own_rows:
            if not isinstance(keeps, str):
                continue
            wrenches = np.array([self._on_bodies(row) for row in range(rows.start, rows.stop)])
            found += [
                RowWrench(rows, number, origins[number], wrenches[:, number])
                for number in range(len(self.bodies))
                if wrenches[:, number].any()
            ]
        return found

    def position_of(self, number: int) -> Array:
        """Return the position of a body's origin."""
        body = self.bodies[number]
        return body.findStationLocationInGround(self.state, self.o.Vec3(0.0)).to_numpy()

    def _on_bodies(self, row: int) -> Array:
        """Return the wrench of a unit multiplier on each body, shape (bodies, 6): force over moment
        about its origin.
        """
        o, unit = self.o, np.zeros(self.own_count)
        unit[row] = 1.0
        on_bodies, on_coordinates = o.VectorOfSpatialVec(), o.Vector()
        self.matter.calcConstraintForcesFromMultipliers(
            self.state, o.Vector.createFromMat(unit), on_bodies, on_coordinates
        )
        each = [on_bodies.get(int(body.getMobilizedBodyIndex())) for body in self.bodies]
        return np.array([[*w.get(1).to_numpy(), *w.get(0).to_numpy()] for w in each])
