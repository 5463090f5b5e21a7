"""Pinocchio in simulate mode: accelerations from its `constraintDynamics`, integrated by a
Runge-Kutta method of fourth order.

Pinocchio has no time stepping; the loop over the steps is ours. Every joint is a chain of slides,
hinges and balls (see `tree_plan`), and one rigid constraint, of a point or of a whole frame,
closes each loop. Driven coordinates have an armature far above all moving masses, and are set to
their values, rates and forces at every step.
"""

from __future__ import annotations

import importlib
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.case.case import Case
from ...core.joints import Fixed
from ...core.trajectory import Array
from ..pinocchio.pinocchio import Pinocchio, PinocchioModel
from ..shared.tree_plan import Chain, Closure, Link, Relation
from .simulation import SimulatedPose, SteppedTree, Stepping, TiedTree

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
        # Depth first: Pinocchio's inertia algorithms require consecutive joint numbers in a
        # subtree. In any other order the results of constraintDynamics are silently wrong.
        parts = [*super().plan()]
        chains = [part for part in parts if isinstance(part, Chain)]

        def chains_on(bodies: Collection[str]) -> Iterator[Chain]:
            for chain in chains:
                if chain.parent in bodies:
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
