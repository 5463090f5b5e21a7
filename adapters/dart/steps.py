"""DART in simulate mode: the steps of its `World`, with its own constraints to close loops.

A driven joint is a velocity actuator, which the constraint solver treats as immovable. Gaps of ball
and weld constraints are closed in one step; DART's default closes a hundredth of a gap per step.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from ...core.case.case import Case
from ...core.joints import Spherical
from ...core.trajectory import Array
from ..shared.stepped_tree import SteppedTree, Stepping, Tie
from .dart import Dart, DartModel

# Fraction of a gap that a step closes, and the largest velocity of the correction [m/s or rad/s],
# which is no limit in practice.
REDUCTION, FASTEST = 1.0, 1e9


class DartWorld(SteppedTree, DartModel):
    """The skeleton in a world, with a constraint for each tie."""

    def __init__(self, case: Case, steps: int) -> None:
        self.ties, dart = [], importlib.import_module("dartpy")
        DartModel.__init__(self, dart, case)
        self.set_off(case, steps)
        self.world = dart.simulation.World()
        self.world.setGravity(np.zeros(3))
        self.world.addSkeleton(self.skeleton)
        self.q = self.design()
        self.place()
        solver = self.world.getConstraintSolver()
        # kept here, because a constraint is deleted with its last Python reference
        self.constraints = [self.constraint(dart.constraint, tie) for tie in self.ties]
        for constraint in self.constraints:
            solver.addConstraint(constraint)
        self.motors = [self.joints[body] for body, _ in self.driven]
        for motor in self.motors:
            motor.setActuatorType(self.parts.ActuatorType.VELOCITY)

    def constraint(self, kinds: Any, tie: Tie) -> Any:
        """Return DART's constraint of a tie; the skeleton is at design."""
        nodes = [self.nodes[body] for body in tie.bodies if body]
        if tie.by is Spherical:
            made = kinds.BallJointConstraint(*nodes, np.array(tie.points[0]))
        else:
            made = kinds.WeldJointConstraint(*nodes)
        made.setErrorReductionParameter(REDUCTION)
        made.setMaxErrorReductionVelocity(FASTEST)
        return made

    def step(self, q: Array, v: Array, driven: Array, h: float) -> tuple[Array, Array]:
        skeleton = self.skeleton
        self.world.setTimeStep(h)
        skeleton.setPositions(q)
        skeleton.setVelocities(v)
        for motor, velocity in zip(self.motors, driven.tolist(), strict=True):
            motor.setCommand(0, velocity)
        self.world.step(False)
        return np.array(skeleton.getPositions()), np.array(skeleton.getVelocities())


class Steps(Stepping):
    """The engine `dart` in simulate mode."""

    projection, model = Dart, DartWorld
    described: ClassVar[Mapping[str, Any]] = {
        "solver": "World.step: semi-implicit Euler, boxed LCP of Dantzig",
        "constraints": f"error reduction {REDUCTION:g}, no bound on its velocity",
        "driven coordinates": "velocity actuators",
    }
