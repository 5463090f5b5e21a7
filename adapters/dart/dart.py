"""DART in projection mode: the tree of a Skeleton, with loops closed by conditions on its body
nodes; and in simulate mode: the steps of its `World`, with its own constraints to close loops.

DART's own constraints act on the velocities of its time steps, and give no residual of a pose. In a
world a driven joint is a velocity actuator, which the constraint solver treats as immovable. Gaps
of ball and weld constraints are closed in one step; DART's default closes a hundredth of a gap per
step.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from ...core.case.case import Case
from ...core.joints import Spherical
from ...core.mechanism.mechanism import Vector
from ...core.trajectory import Array
from ..shared.tree_forces import NO_MASS, Mass, mass_properties
from ..shared.tree_model import TreeEngine, TreeModel
from ..shared.tree_plan import Link
from ..simulate.simulation import SteppedTree, Stepping, Tie

# DART puts rotational components above translational ones.
ROWS = np.array([3, 4, 5, 0, 1, 2])
BALL = 3
# DART's rotations by less than a thousandth of a radian lack the third power of the angle, up to
# 1.7e-10. The rotation vector of a ball joint therefore starts far from zero.
START = np.array([1.0, 0.0, 0.0])


class Dart(TreeEngine):
    """The engine `dart`."""

    name, title, package = "dart", "DART", "dartpy"

    def model_of(self, case: Case) -> DartModel:
        """Return tree, points and conditions of the case."""
        return DartModel(importlib.import_module("dartpy"), case)


class DartModel(TreeModel):
    """The tree in DART: a body node with its joint for each link, a simple frame for each frame."""

    computed_by: ClassVar[Mapping[str, str]] = {
        "inverse dynamics": "computeInverseDynamics",
        "reactions of tree joints": "computeInverseDynamics: getBodyForce",
        "reactions of cut joints": "rows by getWorldJacobian",
        "force elements": "of the adapter, by frames of DART",
    }

    def __init__(self, dart: Any, case: Case) -> None:
        self.parts, self.transform = dart.dynamics, dart.math.Isometry3
        self.from_start = dart.math.eulerXYZToMatrix(-START)
        self.skeleton = self.parts.Skeleton("mechanism")
        self.nodes: list[Any] = [None]
        self.joints: list[Any] = [None]
        super().__init__(case)

    def add_link(self, parent: int, link: Link, offset: Array) -> None:
        parts, skeleton = self.parts, self.skeleton
        match link.move:
            case "slide":
                given = parts.PrismaticJointProperties()
                create = skeleton.createPrismaticJointAndBodyNodePair
            case "hinge":
                given = parts.RevoluteJointProperties()
                create = skeleton.createRevoluteJointAndBodyNodePair
            case "ball":
                given = parts.BallJointProperties()
                create = skeleton.createBallJointAndBodyNodePair
        placed = self._at(offset)
        if link.move == "ball":
            placed.set_rotation(self.from_start)
        else:
            given.mAxis = np.array(link.axis)
        given.mName, given.mT_ParentBodyToJoint = f"joint {len(self.joints)}", placed
        joint, node = create(self.nodes[parent], given)
        self.joints.append(joint)
        self.nodes.append(node)

    def make_frame(self, body: int, offset: Array) -> Any:
        node = self.nodes[body]
        # in the Python binding, a body node's frame methods take ten times as long
        return self.parts.SimpleFrame(node, "frame", self._at(offset)), node, offset

    def _at(self, offset: Array) -> Any:
        placed = self.transform()
        placed.set_translation(offset)
        return placed

    def finish(self) -> None:
        pass  # a skeleton needs no finalisation

    @property
    def unknowns(self) -> int:
        return self.skeleton.getNumDofs()

    def coordinate(self, body: Any) -> tuple[int, int]:
        at = self.joints[body].getIndexInSkeleton(0)
        return at, at

    def design(self) -> Array:
        found = np.zeros(self.unknowns)
        for joint in self.joints[1:]:
            if joint.getNumDofs() == BALL:
                first = joint.getIndexInSkeleton(0)
                found[first : first + BALL] = START
        return found

    def configuration_after(self, dx: Array) -> Array:
        self.skeleton.setPositions(self.q)
        self.skeleton.setVelocities(dx)
        self.skeleton.integratePositions(1.0)
        return self.skeleton.getPositions()

    def place(self) -> None:
        self.skeleton.setPositions(self.q)

    def rate(self, v: Array, a: Array) -> None:
        self.skeleton.setVelocities(v)
        self.skeleton.setAccelerations(a)

    def placement(self, handle: Any) -> tuple[Array, Array]:
        pose = handle[0].getWorldTransform()
        return pose.translation(), pose.rotation()

    def slope(self, handle: Any) -> Array:
        _, node, offset = handle
        return self.skeleton.getWorldJacobian(node, offset).take(ROWS, 0)

    def motion(self, handle: Any) -> tuple[Array, Array]:
        frame = handle[0]
        return (
            np.concatenate([frame.getLinearVelocity(), frame.getAngularVelocity()]),
            np.concatenate([frame.getLinearAcceleration(), frame.getAngularAcceleration()]),
        )

    def set_loads(self, gravity: Vector, masses: Sequence[Mass]) -> None:
        # DART warns about bodies without mass or inertia
        for node in self.nodes[1:]:
            node.setInertia(self.parts.Inertia(NO_MASS, np.zeros(3), NO_MASS * np.eye(3)))
        for each in masses:
            link: int = each.frame.body
            mass, center, inertia = mass_properties(each.body, self.origin[link])
            about_center = inertia if inertia.any() else NO_MASS * np.eye(3)
            self.nodes[link].setInertia(self.parts.Inertia(mass, center, about_center))
        self.skeleton.setGravity(np.array(gravity))

    def inverse_dynamics(self, v: Array, a: Array) -> Array:
        self.rate(v, a)
        self.skeleton.computeInverseDynamics()
        return np.array(self.skeleton.getForces())

    def passed_on(self, body: int, point: Array) -> Array:
        node = self.nodes[body]
        pose = node.getWorldTransform()
        moment, force = (pose.rotation() @ part for part in np.split(node.getBodyForce(), 2))
        return np.concatenate([force, moment + np.cross(pose.translation() - point, force)])


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
        rates = self.mean_rates(q, driven, h).tolist()
        for motor, velocity in zip(self.motors, rates, strict=True):
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
