"""Drake in simulate mode: the steps of a discrete MultibodyPlant, whose SAP solver uses Drake's
constraints to close loops.

Drake supports constraints only in discrete plants. They are nearly rigid, with a fixed softness. A
ball is a floating joint with a constraint of its point, because Drake's ball joint locks at a right
angle. A driven coordinate has an armature far above all masses, and is set to its value and
velocity at every step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from ...core.case.case import Case
from ...core.joints import Fixed, Spherical
from ...core.trajectory import Array
from ..shared.simulation import SimulationEndedError
from ..shared.stepped_tree import SteppedTree, Stepping, Tie
from ..shared.tree_plan import Chain, Relation
from .drake import Drake, DrakeModel

# Inertia of driven coordinates [kg or kg m2] next to bodies with unit inertia: reactions change
# their motion by a billionth.
ARMATURE = 1e9


class DrakePlant(SteppedTree, DrakeModel):
    """The tree in a discrete plant, with a constraint for each tie and each relation.

    Attributes:
        couplings: coordinates that are a factor times another, by the numbers of their bodies.
    """

    held = False

    def __init__(self, case: Case, steps: int) -> None:
        self.ties = []
        self.couplings: list[tuple[int, int, float]] = []
        times = case.sweep.path.times
        gap = float(np.ptp(times)) / max(len(times) - 1, 1)
        DrakeModel.__init__(self, case, (gap or 1.0) / steps)
        self.set_off(case, steps)
        self.rates = [self.coordinate(body)[1] for body, _ in self.driven]
        self.efforts = self.plant.get_applied_generalized_force_input_port()

    def carry(self, chain: Chain) -> None:
        first = len(self.origin)
        super().carry(chain)
        for at, link in enumerate(chain.links, first):
            if link.move == "ball":
                bodies, points = (self.parents[at], at), (link.point, link.point)
                self.tie(f"ball {at}", Tie(Spherical, bodies, points))

    def relate(self, relation: Relation) -> None:
        super().relate(relation)
        one, other, (_, factor) = relation.follower(signed=True)
        self.couplings.append((self.coordinates[one][0], self.coordinates[other][0], factor))

    def finish(self) -> None:
        plant, tree = self.plant, self.tree
        # Drake aborts the process at a constraint on the world body alone
        whole = tree.SpatialInertia(1.0, np.zeros(3), tree.UnitInertia(1.0, 1.0, 1.0))
        anchor = plant.AddRigidBody("anchor", whole)
        plant.WeldFrames(self.world, anchor.body_frame())
        for tie in self.ties:
            self.constrain([self.bodies[body] if body else anchor for body in tie.bodies], tie)
        for one, other, factor in self.couplings:
            plant.AddCouplerConstraint(self.joints[one], self.joints[other], factor)
        for body, _ in self.driven:
            motor = plant.AddJointActuator(f"motor {body}", self.joints[body])
            motor.set_default_rotor_inertia(ARMATURE)
        # with caching, Drake evaluates no update outside a simulator
        plant.SetUseSampledOutputPorts(False)
        super().finish()

    def constrain(self, bodies: Sequence[Any], tie: Tie) -> None:
        """Add Drake's constraint of a tie."""
        plant, (one, other) = self.plant, bodies
        P, Q = (
            np.array(point) - self.origin[body]
            for body, point in zip(tie.bodies, tie.points, strict=True)
        )
        if tie.by is Spherical:
            plant.AddBallConstraint(one, P, other, Q)
        elif tie.by is Fixed:
            plant.AddWeldConstraint(one, self.shift(P), other, self.shift(Q))
        else:
            plant.AddDistanceConstraint(one, P, other, Q, tie.length)

    def step(self, q: Array, v: Array, driven: Array, h: float) -> tuple[Array, Array]:
        plant, context = self.plant, self.context
        forces = np.zeros_like(v)
        forces[self.rates] = ARMATURE * (driven - v[self.rates]) / h
        plant.SetPositions(context, q)
        plant.SetVelocities(context, v)
        self.efforts.FixValue(context, forces)
        try:
            context.SetDiscreteState(plant.EvalUniquePeriodicDiscreteUpdate(context))
        except RuntimeError as error:
            first = str(error).strip().splitlines()[0]
            raise SimulationEndedError(f"Drake: {first}") from error
        return np.array(plant.GetPositions(context)), np.array(plant.GetVelocities(context))


class Steps(Stepping):
    """The engine `drake` in simulate mode."""

    projection, model, rods, couples, equal = Drake, DrakePlant, True, True, True
    described: ClassVar[Mapping[str, Any]] = {
        "solver": "discrete MultibodyPlant, SAP",
        "balls": "QuaternionFloatingJoint and a ball constraint",
        "driven coordinates": f"set at every step, armature {ARMATURE:g}",
    }
