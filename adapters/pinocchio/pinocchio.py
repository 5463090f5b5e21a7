"""Pinocchio in projection mode: its joints as a spanning tree, its frames to close the loops; the
same code for Pinocchio 3.9 and 4. And in simulate mode: accelerations from its
`constraintDynamics`, integrated by a Runge-Kutta method of fourth order.

In projection Pinocchio's own constraint models are not used: their signatures and the update of
their data changed between 3 and 4, the axes of their rows depend on the kind, and none is a
distance. The adapter uses quantities with the same meaning in both versions: placement, Jacobian,
velocity and classical acceleration of a frame. `constraints` makes the rows of any joint from them.

Pinocchio has no time stepping; the loop over the steps is ours. Every joint is a chain of slides,
hinges and balls (see `tree_plan`), and one rigid constraint, of a point or of a whole frame,
closes each loop. Driven coordinates have an armature far above all moving masses, and are set to
their values, rates and forces at every step.
"""

from __future__ import annotations

import importlib
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...core.case.case import Case
from ...core.joints import Fixed
from ...core.mechanism.mechanism import Vector
from ...core.trajectory import Array
from ..shared.simulation import SimulatedPose, SteppedTree, Stepping, TiedTree
from ..shared.tree_forces import Mass, mass_properties
from ..shared.tree_model import TreeEngine, TreeModel
from ..shared.tree_plan import Chain, Closure, Link, Relation


class Pinocchio(TreeEngine):
    """The engine `pinocchio`."""

    name, title = "pinocchio", "Pinocchio"

    def version_of(self, simulator: Any) -> str | None:
        """Return the version; None for PyPI's unrelated "pinocchio", which has no Model.

        The simulator's package on PyPI is "pin".
        """
        return super().version_of(simulator) if hasattr(simulator, "Model") else None

    def model_of(self, case: Case) -> PinocchioModel:
        """Return tree, frames and conditions of the case."""
        return PinocchioModel(importlib.import_module("pinocchio"), case)


class PinocchioModel(TreeModel):
    """The tree in Pinocchio: a joint for each link, an operational frame for each frame."""

    computed_by: ClassVar[Mapping[str, str]] = {
        "inverse dynamics": "rnea",
        "reactions of tree joints": "rnea: data.f",
        "reactions of cut joints": "rows by getFrameJacobian",
        "force elements": "of the adapter, by frames of Pinocchio",
    }

    def __init__(self, pin: Any, case: Case) -> None:
        self.pin, self.model, self.axes = pin, pin.Model(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        super().__init__(case)

    def add_link(self, parent: int, link: Link, offset: Array) -> None:
        pin, axis = self.pin, np.array(link.axis)
        match link.move:
            case "slide":
                joint = pin.JointModelPrismaticUnaligned(axis)
            case "hinge":
                joint = pin.JointModelRevoluteUnaligned(axis)
            case "ball":
                joint = pin.JointModelSpherical()
        name = f"joint {self.model.njoints}"
        self.model.addJoint(parent, joint, pin.SE3(np.eye(3), offset), name)

    def make_frame(self, body: int, offset: Array) -> int:
        pin = self.pin
        # numbered, because a second frame with the same name would silently be the first
        name = f"frame {self.model.nframes}"
        placement = pin.SE3(np.eye(3), offset)
        return self.model.addFrame(pin.Frame(name, body, 0, placement, pin.FrameType.OP_FRAME))

    def finish(self) -> None:
        self.data = self.model.createData()

    @property
    def unknowns(self) -> int:
        return self.model.nv

    def coordinate(self, body: Any) -> tuple[int, int]:
        joint = self.model.joints[body]
        return joint.idx_q, joint.idx_v

    def design(self) -> Array:
        return self.pin.neutral(self.model)

    def configuration_after(self, dx: Array) -> Array:
        return self.pin.integrate(self.model, self.q, dx)

    def place(self) -> None:
        self.pin.computeJointJacobians(self.model, self.data, self.q)
        self.pin.updateFramePlacements(self.model, self.data)

    def rate(self, v: Array, a: Array) -> None:
        self.pin.forwardKinematics(self.model, self.data, self.q, v, a)

    def placement(self, handle: int) -> tuple[Array, Array]:
        frame = self.data.oMf[handle]
        return frame.translation, frame.rotation

    def slope(self, handle: int) -> Array:
        # Pinocchio returns a matrix of one column as a vector
        return self.pin.getFrameJacobian(self.model, self.data, handle, self.axes).reshape(6, -1)

    def motion(self, handle: int) -> tuple[Array, Array]:
        given = self.model, self.data, handle, self.axes
        return (
            self.pin.getFrameVelocity(*given).vector,
            self.pin.getFrameClassicalAcceleration(*given).vector,
        )

    def set_loads(self, gravity: Vector, masses: Sequence[Mass]) -> None:
        pin, at_origin = self.pin, self.pin.SE3.Identity()
        for each in masses:
            link: int = each.frame.body
            inertia = pin.Inertia(*mass_properties(each.body, self.origin[link]))
            self.model.appendBodyToJoint(link, inertia, at_origin)
        self.model.gravity.linear = np.array(gravity)

    def inverse_dynamics(self, v: Array, a: Array) -> Array:
        self.rate(v, a)
        return np.array(self.pin.rnea(self.model, self.data, self.q, v, a))

    def passed_on(self, body: int, point: Array) -> Array:
        wrench = self.data.oMi[body].act(self.data.f[body])
        return np.concatenate([wrench.linear, wrench.angular - np.cross(point, wrench.linear)])


# Inertia of driven coordinates [kg or kg m2] next to bodies with unit inertia: reactions change
# their motion by a billionth.
ARMATURE = 1e9
# Damping of the proximal iteration for redundant loops: without it the iteration does not converge,
# with 1e-4 not always, with this value in a few rounds.
MU = 1e-8
ROUNDS = 50
ACCURACY = 1e-14
# Time constant of gap closure, in steps. Shorter times pass the error of every step on to the
# accelerations (on an RSSR linkage 1e-2 m/s^2 at 4 steps, 6e-7 at 50); without gap closure, gaps
# accumulate over the samples.
DECAY = 50.0


class PinocchioSteps(SteppedTree, PinocchioModel):
    """The mechanism with masses, and its loops as rigid constraints."""

    has = "rigid constraint"
    not_finite = "constraintDynamics diverges to non-finite numbers"
    close = TiedTree.close  # of one body with itself too

    def __init__(self, case: Case, steps: int) -> None:
        pin: Any = importlib.import_module("pinocchio")
        self.ties, self.stabilised = [], 0.0
        PinocchioModel.__init__(self, pin, case)
        self.set_off(case, steps)
        armature = np.array(self.model.armature)
        armature[self.driven_v] = ARMATURE
        self.model.armature = armature
        self.model.gravity = pin.Motion.Zero()
        self.dynamics = self.model.createData()
        self.proximal = pin.ProximalSettings(
            ACCURACY, ACCURACY, *((0.0, 1) if self.start.independent else (MU, ROUNDS))
        )
        self.constraints, self.found = (
            pin.StdVec_RigidConstraintModel(),
            pin.StdVec_RigidConstraintData(),
        )
        kinds = pin.ContactType
        for tie in self.ties:
            kind = kinds.CONTACT_6D if tie.by is Fixed else kinds.CONTACT_3D
            ends = [
                (at, pin.SE3(np.eye(3), np.array(point) - self.origin[at]))
                for at, point in zip(tie.bodies, tie.points, strict=True)
            ]
            self.constraints.append(
                pin.RigidConstraintModel(
                    kind, self.model, *ends[0], *ends[1], pin.ReferenceFrame.LOCAL
                )
            )
        for constraint in self.constraints:
            self.found.append(constraint.createData())
        pin.initConstraintDynamics(self.model, self.dynamics, self.constraints, self.found)

    def add_link(self, parent: int, link: Link, offset: Array) -> None:
        super().add_link(parent, link, offset)
        self.model.appendBodyToJoint(
            self.model.njoints - 1,
            self.pin.Inertia(1.0, np.zeros(3), np.eye(3)),
            self.pin.SE3.Identity(),
        )

    def plan(self) -> Iterable[Chain | Relation | Closure]:
        # Depth first, with the links of a closure right after the body that carries them:
        # Pinocchio's inertia algorithms require consecutive joint numbers in a subtree. In any
        # other order the results of constraintDynamics are silently wrong.
        parts = [*super().plan()]
        chains = [part for part in parts if isinstance(part, Chain)]

        def chains_on(bodies: Collection[str]) -> Iterator[Chain]:
            on = [chain for chain in chains if chain.parent in bodies]
            for chain in sorted(on, key=lambda chain: not chain.cut):
                yield chain
                yield from chains_on([chain.child])

        yield from chains_on([*self.carrier])  # before any chain, those are the ground
        yield from (part for part in parts if not isinstance(part, Chain))

    def stabilise(self, h: float) -> None:
        """Set the stabilisation, critically damped, for steps of length h [s]."""
        rate, self.stabilised = 1.0 / (DECAY * h), h
        for constraint in self.constraints:
            parameters = constraint.m_baumgarte_parameters
            parameters.Kp, parameters.Kd = rate**2, 2.0 * rate

    def put(self, q: Array, v: Array, driven: Array) -> tuple[Array, Array, Array]:
        """Return q, v and tau with the driven coordinates at their values, rates and forces."""
        q, v, tau = q.copy(), v.copy(), np.zeros(self.model.nv)
        q[self.driven_q], v[self.driven_v], tau[self.driven_v] = (
            self.signs * driven * np.array([[1.0], [1.0], [ARMATURE]])
        )
        return q, v, tau

    def acceleration(self, q: Array, v: Array, tau: Array) -> Array:
        """Return the accelerations of the coordinates, shape (unknowns,)."""
        pin = self.pin
        return pin.constraintDynamics(
            self.model, self.dynamics, q, v, tau, self.constraints, self.found, self.proximal
        )

    def step(self, q: Array, v: Array, driven: Array, h: float) -> tuple[Array, Array]:
        """Return the state after one Runge-Kutta step, with the configuration moved along its rates
        from the start of the step.
        """
        if h != self.stabilised:
            self.stabilise(h)
        q, v, _ = self.put(q, v, driven[..., 0])
        rates, accelerations = list[Array](), list[Array]()
        for part, moment in ((0.0, 0), (0.5, 1), (0.5, 1), (1.0, 2)):
            at, rate = q, v
            if part:
                at, rate = (
                    self.pin.integrate(self.model, q, part * h * rates[-1]),
                    v + part * h * accelerations[-1],
                )
            at, rate, tau = self.put(at, rate, driven[..., moment])
            rates.append(rate)
            accelerations.append(self.acceleration(at, rate, tau))
        weights = np.array([1.0, 2.0, 2.0, 1.0]) / 6.0
        return self.pin.integrate(self.model, q, h * (weights @ np.array(rates))), v + h * (
            weights @ np.array(accelerations)
        )

    def pose(self, q: Array, v: Array, a: Array, driven: Array, steps: int) -> SimulatedPose:
        q, v, tau = self.put(q, v, driven)
        self.q, a = q, self.acceleration(q, v, tau)
        self.pin.framesForwardKinematics(self.model, self.data, q)
        points = np.array(self.points(v, a)).swapaxes(0, 1)
        gaps = [
            self.pin.log6(found.c1Mc2).vector[: model.residualSize()]
            for found, model in zip(self.found, self.constraints, strict=True)
        ]
        return SimulatedPose(
            points, max((float(np.abs(gap).max()) for gap in gaps), default=0.0), steps
        )


@dataclass(frozen=True)
class Dynamics(Stepping):
    """Pinocchio's constrained forward dynamics."""

    steps: int = 2
    projection, model = Pinocchio, PinocchioSteps
    counts = (1, 2, 4, 8)

    @property
    def settings(self) -> Mapping[str, Any]:
        """Integrator, stabilisation and steps."""
        return {
            "acceleration": "constraintDynamics",
            "integrator": "Runge-Kutta, fourth order, of the adapter",
            "steps per sample": self.steps,
            "stabilisation": f"Baumgarte, critically damped, decay in {DECAY:g} steps",
            "proximal": f"mu {MU:g} where rows are redundant, else none",
            "driven coordinates": f"set at every step, armature {ARMATURE:g}",
            "rods": "bodies between a cross and a ball",
        }

    def unsupported(self, case: Case) -> str | None:
        """Return a message on the joint or driver that is not supported here, or None."""
        if (self.version() or "").startswith("3."):
            return "constraintDynamics of Pinocchio 3 has another signature; install Pinocchio 4"
        return super().unsupported(case)
