"""Drake in projection mode: the tree of a MultibodyPlant, with loops closed by conditions on its
frames; and in simulate mode: the steps of a discrete MultibodyPlant, whose SAP solver uses Drake's
constraints to close loops.

Drake's own constraints are soft or belong to its inverse kinematics, and have no Jdot v. A ball is
Drake's quaternion floating joint with zero displacement, because Drake's ball joint has roll, pitch
and yaw, which lock at a right angle.

Drake supports constraints only in discrete plants. They are nearly rigid, with a fixed softness. A
ball is there a floating joint with a constraint of its point. A driven coordinate has an armature
far above all masses, and is set to its value and velocity at every step.
"""

from __future__ import annotations

import importlib
import importlib.metadata
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.case.case import Case
from ...core.joints import Fixed, Spherical
from ...core.mechanism.mechanism import Vector
from ...core.trajectory import Array
from ..shared.tree_forces import Mass, mass_properties
from ..shared.tree_model import TreeEngine, TreeModel
from ..shared.tree_plan import Chain, Link, Relation
from ..simulate.simulation import SimulationEndedError, SteppedTree, Stepping, Tie

# Drake puts rotational components above translational ones.
ROWS = np.array([3, 4, 5, 0, 1, 2])


class Drake(TreeEngine):
    """The engine `drake`."""

    name, title, package = "drake", "Drake", "pydrake.multibody.plant"

    def version_of(self, simulator: Any) -> str | None:
        """Return the version of the distribution, since the package has none."""
        return importlib.metadata.version("drake")

    def model_of(self, case: Case) -> DrakeModel:
        """Return tree, frames and conditions of the case."""
        return DrakeModel(case)


class DrakeModel(TreeModel):
    """The tree in Drake: a body with its joint for each link, a fixed offset frame for each frame.

    Attributes:
        held: whether the displacements of balls are excluded from the unknowns.
        turning: indices of the unknown velocities.
        balls: index of each ball's quaternion in Drake's positions.
        inertias: inertias of bodies, by body number.
    """

    held: ClassVar[bool] = True
    recursion = False
    computed_by: ClassVar[Mapping[str, str]] = {
        "inverse dynamics": "CalcInverseDynamics",
        "reactions of tree joints": (
            "Newton and Euler, of the adapter, by velocities and accelerations of Drake's bodies"
        ),
        "reactions of cut joints": "rows by CalcJacobianSpatialVelocity",
        "force elements": "of the adapter, by frames of Drake",
    }

    def __init__(self, case: Case, time_step: float = 0.0) -> None:
        load = importlib.import_module
        self.tree, plant = load("pydrake.multibody.tree"), load("pydrake.multibody.plant")
        self.shift = load("pydrake.math").RigidTransform
        self.plant = plant.MultibodyPlant(time_step)
        self.world, self.kind = self.plant.world_frame(), self.tree.JacobianWrtVariable.kV
        self.bodies: list[Any] = [self.plant.world_body()]
        self.joints: list[Any] = [None]  # the world has none
        self.inertias: list[tuple[int, Any]] = []
        self.zero = np.zeros(3)
        super().__init__(case)

    def add_link(self, parent: int, link: Link, offset: Array) -> None:
        tree, n, axis = self.tree, len(self.bodies), np.array(link.axis)
        # masses do not matter without forces, but Drake requires them
        whole = tree.SpatialInertia(1.0, np.zeros(3), tree.UnitInertia(1.0, 1.0, 1.0))
        inertia = tree.SpatialInertia.Zero() if self.loaded else whole
        body = self.plant.AddRigidBody(f"body {n}", inertia)
        ends = f"joint {n}", self._frame(parent, offset), body.body_frame()
        match link.move:
            case "slide":
                joint = tree.PrismaticJoint(*ends, axis)
            case "hinge":
                joint = tree.RevoluteJoint(*ends, axis)
            case "ball":
                joint = tree.QuaternionFloatingJoint(*ends)
        self.joints.append(self.plant.AddJoint(joint))
        self.bodies.append(body)

    def make_frame(self, body: int, offset: Array) -> Any:
        return self._frame(body, offset)

    def _frame(self, body: int, offset: Array) -> Any:
        name = f"frame {self.plant.num_frames()}"
        return self.plant.AddFrame(
            self.tree.FixedOffsetFrame(name, self.bodies[body], self.shift(offset))
        )

    def finish(self) -> None:
        self.plant.Finalize()
        self.context = self.plant.CreateDefaultContext()
        for number, inertia in self.inertias:
            self.bodies[number].SetSpatialInertiaInBodyFrame(self.context, inertia)
        balls = [joint for joint in self.joints if joint and joint.num_velocities() == 6]
        self.balls = [slice(at, at + 4) for at in (each.position_start() for each in balls)]
        idle = [each.velocity_start() + k for each in balls for k in (3, 4, 5) if self.held]
        self.turning: NDArray[np.intp] = np.setdiff1d(
            np.arange(int(self.plant.num_velocities())), idle
        )
        # rows and unknowns of a Jacobian, which Drake stores by columns
        self.chosen = ROWS[:, None] + len(ROWS) * self.turning
        self.places = {int(full): k for k, full in enumerate(self.turning)}

    @property
    def unknowns(self) -> int:
        return len(self.turning)

    def coordinate(self, body: Any) -> tuple[int, int]:
        joint = self.joints[body]
        return joint.position_start(), self.places[joint.velocity_start()]

    def design(self) -> Array:
        return self.plant.GetPositions(self.plant.CreateDefaultContext())

    def full(self, v: Array) -> Array:
        """Return all velocities of the plant from the unknown ones."""
        found = np.zeros(self.plant.num_velocities())
        found[self.turning] = v
        return found

    def configuration_after(self, dx: Array) -> Array:
        self.plant.SetPositions(self.context, self.q)
        q = self.q + self.plant.MapVelocityToQDot(self.context, self.full(dx))
        for ball in self.balls:
            q[ball] /= np.linalg.norm(q[ball])
        return q

    def place(self) -> None:
        self.plant.SetPositions(self.context, self.q)

    def rate(self, v: Array, a: Array) -> None:
        self.plant.SetVelocities(self.context, self.full(v))
        self.a = a

    def placement(self, handle: Any) -> tuple[Array, Array]:
        pose = handle.CalcPoseInWorld(self.context).GetAsMatrix34()
        return pose[:, 3], pose[:, :3]

    def slope(self, handle: Any) -> Array:
        columns = self.plant.CalcJacobianSpatialVelocity(
            self.context, self.kind, handle, self.zero, self.world, self.world
        )
        return columns.T.reshape(-1).take(self.chosen)

    def motion(self, handle: Any) -> tuple[Array, Array]:
        velocity = handle.CalcSpatialVelocityInWorld(self.context).get_coeffs()[ROWS]
        bias = self.plant.CalcBiasSpatialAcceleration(
            self.context, self.kind, handle, self.zero, self.world, self.world
        ).get_coeffs()[ROWS]
        # accelerations of the coordinates are needed only for the few output points
        return velocity, bias + self.slope(handle) @ self.a if self.a.any() else bias

    def set_loads(self, gravity: Vector, masses: Sequence[Mass]) -> None:
        tree = self.tree
        self.plant.mutable_gravity_field().set_gravity_vector(np.array(gravity))
        for each in masses:
            link: int = each.frame.body
            mass, c, central = mass_properties(each.body, self.origin[link])
            about_origin = central / mass + (c @ c) * np.eye(3) - np.outer(c, c)
            entries = about_origin[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
            # bodies are already checked, with an allowance for rounded tables
            whole = tree.SpatialInertia(mass, c, tree.UnitInertia(*entries), True)
            self.inertias.append((link, whole))

    def inverse_dynamics(self, v: Array, a: Array) -> Array:
        self.rate(v, a)
        forces = self.tree.MultibodyForces(self.plant)
        self.plant.CalcForceElementsContribution(self.context, forces)  # of gravity
        found = self.plant.CalcInverseDynamics(self.context, self.full(a), forces)
        return np.array(found)[self.turning]


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
        if relation.curve or len(relation.terms) > 2:  # a row of the projection; steps refuse it
            return
        one, other, function = relation.follower(signed=True)
        factor = function.at(0.0)[1]
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
        change = self.mean_rates(q, driven, h) - v[self.driven_v]
        forces[self.driven_v] = ARMATURE * change / h
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
