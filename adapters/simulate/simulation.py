"""Simulate mode, shared by the simulators: start, direction and acceptance of samples; trees for
steps with a simulator's own constraints.

A simulator starts at the reachable sample nearest to the design, with pose and rates of its
projection model, because no simulator checks its initial values, and runs from there in two legs.
The backward leg is the motion in reversed time: rates change their sign, accelerations do not. A
simulator reports its own motion, including soft constraints and drift.

In a stepped tree a cut joint has its links on its first body (see `tree_plan`), and one tie of a
point or of a whole frame to its second body. Drake and DART solve for velocities at the end of a
step and move the configuration along them. So a driven coordinate with its mean velocity over the
step has its value after it, a gap of the constraints closes a step later, and velocities belong to
the middle of the step. Accelerations are the change of velocities over the last step.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from ...core.algebra import triple
from ...core.case.case import Case
from ...core.errors import KincheckError, SolveError
from ...core.joints import Coupler, Distance, Joint, Spherical, Translational, Universal
from ...core.joints.base import triad, unit
from ...core.kinematics import notes_on_start
from ...core.kinematics import start_of as where_from
from ...core.mechanism.mechanism import GROUND, Body, Mechanism, Vector
from ...core.mechanism.motions import Driver, JointDisplacement, PointCoordinate, outwards
from ...core.trajectory import Array, PointMotion, Trajectory, largest_found
from ..shared.constraints import closure_conditions, closure_text
from ..shared.equivalents import SAME_LENGTH, cross_of
from ..shared.projection import Walk
from ..shared.projection_engine import ProjectionEngine
from ..shared.projection_model import ProjectionModel
from ..shared.tree_model import TreeModel
from ..shared.tree_plan import Closure, relations

# A loop that is open by more than this fraction of the mechanism's size is torn: the pose does not
# belong to the mechanism. The softest simulator, MuJoCo with default settings, stays below it on
# most built-in cases.
TORN = 1e-2
# Largest difference in the spacing of equidistant samples, relative to the spacing: round-off.
EQUIDISTANT = 1e-6
# Residual of the start pose, which projection reaches.
START = 1e-12


class SimulationEndedError(KincheckError):
    """A simulator cannot continue; the message gives the reason."""


@dataclass(frozen=True, eq=False)
class Start:
    """A consistent pose at a sample near the design.

    Attributes:
        sample: index of the sample.
        configuration: the result of the model's `save` there.
        v, a: rates and accelerations of the unknowns there.
        points: position, velocity and acceleration of each point of case.points there, shape (3,
            points, 3).
        residual: residual of the projection model there [m or -].
        size: size of the mechanism [m].
        independent: whether the rows of the model are independent.
        facts: facts on the start for the record.
    """

    sample: int
    configuration: Any
    v: Array
    a: Array
    points: Array
    residual: float
    size: float
    independent: bool
    facts: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class Leg:
    """The samples on one side of the start, in the order of the simulation, the start first.

    Attributes:
        sign: -1 if time is reversed.
    """

    case: Case
    samples: NDArray[np.intp]
    sign: float

    @property
    def times(self) -> Array:
        """The times of the samples in the case [s]."""
        return self.case.sweep.path.times[self.samples]

    def drive(self, times: Array) -> Array:
        """Return values, rates and accelerations of the drivers at times of the case, in the time
        of the leg, shape (3, drivers, times).
        """
        moved = self.case.sweep.path.drive(
            [driver.name for driver in self.case.mechanism.drivers], times
        )
        moved[1] *= self.sign
        return moved


@dataclass(frozen=True, eq=False)
class SimulatedPose:
    """The result of a simulator at a sample, in the time of its leg.

    Attributes:
        points: position, velocity and acceleration of each point of case.points, shape (3, points,
            3); NaN if missing.
        residual: the largest violation of its constraints [m or -].
        steps: number of steps of the solver since the previous sample.
    """

    points: Array
    residual: float
    steps: int


Simulator = Callable[[Leg], Iterator[SimulatedPose]]
"""Function that yields the poses of a leg, the start first, and raises SimulationEndedError if it
cannot continue.
"""


def start_of(model: ProjectionModel, case: Case) -> Start:
    """Return the start of a simulation.

    Raises:
        SolveError: the design does not close, or no sample next to it can be reached.
    """
    walk, path = Walk(model, case, START), case.sweep.path
    begin = where_from(case.mechanism, path)
    origin, message = walk.start(path, begin)
    notes: list[str] = []
    if origin is None and begin.other is not None:
        notes.append(f"no sample can be reached by way of {begin.name} ({message})")
        begin = begin.other
        origin, _ = walk.start(path, begin)
    if origin is None:
        raise SolveError(f"case {case.name!r}: {message}", walk.kind_at_start)
    notes += notes_on_start(begin, path)
    facts = {"start": begin.facts, **({"notes": notes} if notes else {})}
    nearest = [int(side[0]) for side in outwards(path.times, origin.t) if len(side)]
    for k in sorted(nearest, key=lambda k: abs(float(path.times[k]) - origin.t)):
        aim = float(path.times[k])
        at, reached = walk.advance(path, origin, aim, abs(aim - origin.t))
        if reached:
            return Start(
                k,
                at.saved,
                at.v,
                at.a,
                np.array(at.rows),
                at.residual,
                walk.size,
                walk.rows == walk.rank,
                facts,
            )
    raise SolveError(
        f"case {case.name!r}: no sample next to the design can be reached; let the sweep come"
        " nearer to it",
        walk.lost.kind,
    )


def uneven_samples(case: Case, title: str) -> str | None:
    """Return the reason why steps of equal length miss the samples, or None."""
    gaps = np.abs(np.diff(case.sweep.path.times))
    if len(gaps) and np.ptp(gaps) > EQUIDISTANT * gaps.max():
        return (
            f"samples are not equidistant in time, and {title}'s steps are; give the sweep by"
            " start, stop and steps"
        )
    return None


def simulate_legs(
    case: Case, start: Start, simulator: Simulator, details: Mapping[str, Any]
) -> Trajectory:
    """Simulate both legs; see `Engine.solve`."""
    n = len(case.sweep.path.times)
    motion = np.full((3, n, len(case.points), 3), np.nan)
    solved, steps = np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.int64)
    residuals, messages = list[float](), list[str]()
    for leg in legs(case, start.sample):
        reached = 0
        try:
            for k, pose in zip(leg.samples, simulator(leg), strict=False):
                if not (np.isfinite(pose.points[0]).all() and pose.residual <= TORN * start.size):
                    raise SimulationEndedError(
                        f"its constraints are violated by {pose.residual:.3g}, more than {TORN:g}"
                        " of its size"
                    )
                motion[:, k], solved[k], reached = pose.points, True, reached + 1
                motion[1, k] *= leg.sign
                steps[k] = pose.steps
                residuals.append(pose.residual)
        except SimulationEndedError as why:
            where = case.sweep.path.where
            last = (
                f"last sample reached at {where(leg.times[reached - 1])}"
                if reached
                else "no sample reached on this side"
            )
            messages.append(
                f"cannot be followed to {where(leg.times[min(reached, len(leg.times) - 1)])}:"
                f" {why}; {last}"
            )
    known = [not np.isnan(motion[order][solved]).any() for order in range(3)]
    points = {
        name: PointMotion(
            motion[0, :, k],
            motion[1, :, k] if known[1] else None,
            motion[2, :, k] if known[2] else None,
        )
        for k, name in enumerate(case.points)
    }
    return Trajectory(
        points,
        solved,
        steps,
        largest_found(np.array(residuals)),
        "; ".join(messages),
        {**details, **start.facts},
    )


def legs(case: Case, start: int) -> list[Leg]:
    """Return the legs from a sample to both ends of the sweep.

    Samples at the same time as the start are in the first leg. A start without other samples is one
    leg.
    """
    times = case.sweep.path.times
    sides = [
        np.concatenate([[start], side[side != start]])
        for side in outwards(times, float(times[start]))
    ]
    ways = [Leg(case, side, sign) for side, sign in zip(sides, (1.0, -1.0), strict=True)]
    return [leg for leg in ways if len(leg.samples) > 1] or ways[:1]


class Simulation:
    """An engine in simulate mode; see `Engine`.

    Attributes:
        projection: the engine of the same simulator in projection mode.
    """

    projection: ClassVar[type[ProjectionEngine]]
    mode = "simulate"

    def version(self) -> str | None:
        """Return the version of the simulator, or None if the import fails."""
        return self.projection().version()

    def unsupported(self, case: Case) -> str | None:
        """Return a message on the joint or driver that is not supported here, or None."""
        return self.projection().unsupported(case)

    def solve(self, model: Any, case: Case, tol: float) -> Trajectory:
        """Simulate all reachable samples with the simulator's own tolerance (see `settings`),
        however far the constraints drift.
        """
        return simulate_legs(case, model.start, model.run, model.details)


@dataclass(frozen=True)
class Stepping(Simulation):
    """Time stepping of a simulator, with steps of equal length between samples.

    Attributes:
        steps: between samples.
        model: class of the simulator's model.
        described: description of solver, constraints and drivers.
        counts: numbers of steps of the efforts.
        rods: whether the simulator has a distance constraint; otherwise rods are bodies.
        couples: whether the simulator has a constraint that couples two coordinates.
        equal: whether all steps of a simulation have the same length.
    """

    steps: int = 4
    model: ClassVar[type[SteppedTree]]
    described: ClassVar[Mapping[str, Any]]
    counts: ClassVar[Sequence[int]] = (1, 2, 4, 8, 16)
    rods: ClassVar[bool] = False
    couples: ClassVar[bool] = False
    equal: ClassVar[bool] = False
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

    def unsupported(self, case: Case) -> str | None:
        """Return a message on the joint, coupler or driver without a constraint here, or None."""
        engine = self.projection()
        case = engine.with_known_joints(case)
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
                return self._without(coupler, "that keeps a curve")
            if len(coupler.joints) > 2:
                return self._without(coupler, "that couples more than two coordinates")
        return uneven_samples(case, engine.title) if self.equal else None

    def _without(self, joint: Joint | Coupler, what: str) -> str:
        title = self.projection.title
        return f"{joint}: the steps of {title} have no constraint {what}; use projection"

    def efforts(self) -> Mapping[str, Self]:
        """Return the efforts by the number of steps."""
        return {f"{n} steps a sample": replace(self, steps=n) for n in self.counts}

    def build(self, case: Case) -> SteppedTree:
        """Return tree, constraints and start."""
        mechanism = with_joints_alone(
            self.projection().with_known_joints(case).mechanism, rods=self.rods
        )
        return self.model(replace(case, mechanism=mechanism), self.steps)


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
        self.closures[name] = f"{self.has}, {closure_text(tie.by)}"
        i, j = map(self.add_frame, tie.bodies, tie.points)
        self.conditions += closure_conditions(tie.by, joint, i, j)


class SteppedTree(TiedTree):
    """A tree with ties and given values of the driven coordinates.

    The constructor makes the model and calls `set_off`.

    Attributes:
        driven_q, driven_v: indices of the driven coordinates in q and v.
        signs: signs of the driven coordinates in the tree.
    """

    not_finite: ClassVar[str] = "its velocities are not finite"

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
        places = [self.coordinate(body) for body, _ in self.driven]
        self.driven_q, self.driven_v = [q for q, _ in places], [v for _, v in places]
        self.signs = np.array([float(sign) for _, sign in self.driven])

    @abstractmethod
    def step(self, q: Array, v: Array, driven: Array, h: float) -> tuple[Array, Array]:
        """Return the configuration and the velocities after a step.

        Args:
            driven: values, rates and accelerations of the drivers at the beginning, the middle and
                the end of the step, shape (3, drivers, 3).
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
        yield self.pose(q, v, a, leg.drive(leg.times[:1])[..., 0], 0)
        parts = np.arange(2 * self.steps + 1) / (2 * self.steps)
        for t, until in pairwise(leg.times.tolist()):
            h = abs(until - t) / self.steps
            driven = leg.drive(t + (until - t) * parts)
            for k in range(0, 2 * self.steps, 2) if h else ():  # samples may be repeated
                before = v
                q, v = self.step(q, v, driven[..., k : k + 3], h)
                if not np.isfinite(v).all():
                    raise SimulationEndedError(self.not_finite)
                a = (v - before) / h
            yield self.pose(q, v, a, driven[..., -1], self.steps)

    def mean_rates(self, q: Array, driven: Array, h: float) -> Array:
        """Return the velocities of the driven coordinates over a step."""
        return (self.signs * driven[0, :, 2] - q[self.driven_q]) / h

    def pose(self, q: Array, v: Array, a: Array, driven: Array, steps: int) -> SimulatedPose:
        """Return the pose at this state, with the number of steps since the previous sample."""
        self.q = q
        residual = float(np.abs(self.residual(driven[0])).max())
        return SimulatedPose(np.array(self.points(v, a)).swapaxes(0, 1), residual, steps)


def with_joints_alone(mechanism: Mechanism, *, rods: bool = False) -> Mechanism:
    """Return the mechanism with joint drivers only and without rods.

    Rods whose length differs from the design remain. Added bodies have no mass.

    Args:
        rods: whether all rods remain.
    """
    bodies, joints, drivers = list(mechanism.bodies), list[Joint](), list[Driver]()
    for joint in mechanism.joints:
        if isinstance(joint, Distance) and fits(joint) and not rods:
            rod = Body(f"{joint.name}: rod", joint.points[0])
            bodies.append(rod)
            joints += _rod(mechanism, joint, rod.name)
        else:
            joints.append(joint)
    for driver in mechanism.drivers:
        if isinstance(driver, PointCoordinate):
            point = mechanism.point(driver.point)
            f, g, h = triad(driver.direction)
            names = [f"{driver.name}: {way}" for way in ("along", "across", "beyond")]
            bodies += [Body(name, point.position) for name in names]
            for below, name, axis in zip((GROUND, *names), names, (h, f, g), strict=False):
                joints.append(
                    Translational(name, below, name, point=point.position, axis=triple(axis))
                )
            joints.append(
                Spherical(f"{driver.name}: ball", names[-1], point.body, point=point.position)
            )
            drivers.append(JointDisplacement(driver.name, names[0], driver.relative))
        else:
            drivers.append(driver)
    return replace(mechanism, bodies=bodies, joints=joints, drivers=drivers)


def fits(rod: Distance) -> bool:
    """Return whether a rod has its length at design."""
    return abs(rod.rod_length - rod.design_distance) <= SAME_LENGTH * rod.design_distance


def _rod(mechanism: Mechanism, joint: Distance, rod: str) -> list[Joint]:
    (i, j), (P_i, P_j) = joint.bodies, joint.points
    if mechanism.is_fixed(j):  # the cross is on the body that turns least
        (i, j), (P_i, P_j) = (j, i), (P_j, P_i)
    axes = cross_of(mechanism, i, unit([b - a for a, b in zip(P_i, P_j, strict=True)]))
    return [
        Universal(f"{joint.name}: cross", i, rod, point=P_i, axes=axes),
        Spherical(f"{joint.name}: ball", rod, j, point=P_j),
    ]
