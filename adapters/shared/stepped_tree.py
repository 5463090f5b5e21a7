"""Simulate mode of simulators that step a tree of links and close its loops by their own
constraints.

A cut joint has its chain on its first body (see `tree_plan`), and one tie of a point or of a
whole frame to its second body. Both simulators solve for velocities at the end of a step and move
the configuration along them. So a driven coordinate with its mean velocity over the step has its
value after it, a gap of the constraints closes a step later, and velocities belong to the middle of
the step. Accelerations are the change of velocities over the last step.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, ClassVar, Self

import numpy as np

from ...core.case.case import Case
from ...core.errors import SolveError
from ...core.joints import Coupler, Distance, Joint
from ...core.mechanism.mechanism import Vector
from ...core.trajectory import Array, Trajectory
from .joint_equivalents import fits, jointed
from .loop_closures import CLOSURES
from .simulation import Leg, SimulatedPose, SimulationEndedError, simulated, start_of, uneven
from .tree_engine import TreeEngine
from .tree_model import TreeModel
from .tree_plan import Closure, relations


@dataclass(frozen=True)
class Stepping:
    """Time stepping of a simulator, with steps of equal length between samples.

    Attributes:
        steps: between samples.
        projection: the engine of the same simulator in projection mode.
        model: class of the simulator's model.
        described: description of solver, constraints and drivers.
        rods: whether the simulator has a distance constraint; otherwise rods are bodies.
        couples: whether the simulator has a constraint that couples two coordinates.
        equal: whether all steps of a simulation have the same length.
    """

    steps: int = 4
    projection: ClassVar[type[TreeEngine]]
    model: ClassVar[type[SteppedTree]]
    described: ClassVar[Mapping[str, Any]]
    rods: ClassVar[bool] = False
    couples: ClassVar[bool] = False
    equal: ClassVar[bool] = False
    mode = "simulate"
    loop = "python"

    @property
    def name(self) -> str:
        """The name of the simulator."""
        return self.projection.name

    @property
    def settings(self) -> Mapping[str, Any]:
        """Solver, steps, drivers and rods."""
        rods = "distance constraints" if self.rods else "bodies between a cross and a ball"
        return {**self.described, "steps per sample": self.steps, "rods": rods}

    def version(self) -> str | None:
        """Return the version of the simulator, or None if the import fails."""
        return self.projection().version()

    def unsupported(self, case: Case) -> str | None:
        """Return a message on the joint, coupler or driver without a constraint here, or None."""
        engine = self.projection()
        case = engine.known(case)
        if (reason := engine.unsupported(case)) is not None:
            return reason
        for joint in case.mechanism.joints:
            if relations(joint) and not self.couples:
                return self._without(joint, "that couples coordinates")
            if isinstance(joint, Distance) and not self.rods and not fits(joint):
                return self._without(joint, "of another distance than at design")
        for coupler in case.mechanism.couplers:
            if not self.couples:
                return self._without(coupler, "that couples coordinates")
            if coupler.curve:
                return self._without(coupler, "that keeps a polynomial")
        return uneven(case, engine.title) if self.equal else None

    def _without(self, joint: Joint | Coupler, what: str) -> str:
        title = self.projection.title
        return f"{joint}: the steps of {title} have no constraint {what}; use projection"

    def efforts(self) -> Mapping[str, Self]:
        """Return the efforts by the number of steps."""
        return {f"{n} steps a sample": replace(self, steps=n) for n in (1, 2, 4, 8, 16)}

    def floor(self, case: Case) -> None:
        """Return None: the bound on its steps is that of projection."""

    def build(self, case: Case) -> SteppedTree:
        """Return tree, constraints and start."""
        mechanism = jointed(self.projection().known(case).mechanism, rods=self.rods)
        return self.model(replace(case, mechanism=mechanism), self.steps)

    def solve(self, model: SteppedTree, case: Case, tol: float) -> Trajectory:
        """Solve all reachable samples, however far the constraints drift; see `Engine.solve`."""
        return simulated(case, model.start, model.run, model.details)


@dataclass(frozen=True)
class Tie:
    """A constraint between two bodies, by their numbers.

    Attributes:
        by: a ball, a whole frame, or a distance.
        points: points on the first and the second body, global at design [m].
        length: length of a rod [m].
    """

    by: type[Joint]
    bodies: tuple[int, int]
    points: tuple[Vector, Vector]
    length: float = 0.0


class TiedTree(TreeModel):
    """A tree whose loops a simulator closes by constraints of its own.

    The constructor of a simulator's class sets `ties` before it makes the model.

    Attributes:
        ties: constraints that close loops.
        has: what the simulator has for them.
    """

    gives_forces = False
    whole = (Distance,)
    ties: list[Tie]
    has: ClassVar[str] = "constraint"

    def close(self, closure: Closure) -> None:
        length = closure.joint.rod_length if isinstance(closure.joint, Distance) else 0.0
        tie = Tie(closure.by, self.bodies_of(closure), closure.points, length)
        self.tie(closure.joint.name, tie, closure.joint)

    def tie(self, name: str, tie: Tie, joint: Any = None) -> None:
        """Add a tie under the name of its joint."""
        self.ties.append(tie)
        closure = CLOSURES[tie.by]
        self.closures[name] = f"{self.has}, {closure.text}"
        frames = map(self.add_frame, tie.bodies, tie.points)
        self.conditions += closure.conditions(joint, *frames)


class SteppedTree(TiedTree):
    """A tree with ties and given velocities of the driven coordinates.

    The constructor makes the model and calls `set_off`.

    Attributes:
        driven_at: indices of the driven coordinates in q.
        signs: signs of the driven coordinates in the tree.
    """

    @abstractmethod
    def __init__(self, case: Case, steps: int) -> None:
        """Create the model of a case that has only joint drivers, with a number of steps between
        samples.
        """

    def set_off(self, case: Case, steps: int) -> None:
        """Find the start.

        Args:
            steps: between samples.
        """
        self.steps, self.start = steps, start_of(self, case)
        self.driven_at = [self.coordinate(body)[0] for body, _ in self.driven]
        self.signs = np.array([float(sign) for _, sign in self.driven])

    @abstractmethod
    def step(self, q: Array, v: Array, driven: Array, h: float) -> tuple[Array, Array]:
        """Return the configuration and the velocities after a step.

        Args:
            driven: velocities of the driven coordinates over the step [their units per second].
            h: length of the step [s].

        Raises:
            SimulationEndedError: the simulator cannot continue.
        """

    def close(self, closure: Closure) -> None:
        i, j = self.bodies_of(closure)
        if i == j and closure.by is not Distance:
            raise SolveError(
                f"case {self.case.name!r}: {closure.joint} closes a loop of one body with itself,"
                " and the simulator has no such constraint; use the projection mode"
            )
        super().close(closure)

    def run(self, leg: Leg) -> Iterator[SimulatedPose]:
        """Yield the poses of a leg."""
        q, v, a = self.start.configuration, leg.sign * self.start.v, self.start.a
        yield self.pose(q, v, a, leg.drive(leg.times[:1])[0, :, 0], 0)
        parts = np.arange(self.steps + 1) / self.steps
        for t, until in pairwise(leg.times.tolist()):
            h = abs(until - t) / self.steps
            values = leg.drive(t + (until - t) * parts)[0]
            for aim in values[:, 1:].T if h else ():  # samples may be repeated
                before = v
                q, v = self.step(q, v, (self.signs * aim - q[self.driven_at]) / h, h)
                if not np.isfinite(v).all():
                    raise SimulationEndedError("its velocities are not finite")
                a = (v - before) / h
            yield self.pose(q, v, a, values[:, -1], self.steps)

    def pose(self, q: Array, v: Array, a: Array, driven: Array, steps: int) -> SimulatedPose:
        """Return the pose at this state, with the number of steps since the previous sample."""
        self.q = q
        residual = float(np.abs(self.residual(driven)).max())
        return SimulatedPose(np.array(self.points(v, a)).swapaxes(0, 1), residual, steps)
