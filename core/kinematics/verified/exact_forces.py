"""The equations of forces of an exact mechanism, as programs for ball arithmetic.

With F' the Jacobian of the traced residuals by the state, and G the generalised forces that the
motion demands (M a + h - Q by the scalars of the state), the multipliers solve F'^T mu = G. A rate
q' of Euler parameters is an angular velocity w = 2 vec(q' q*), so a torque t has the generalised
force 2 (t q), and the gradient g of a row by q is the torque vec(g q*) / 2. The rows of joints and
the efforts of drivers are derivatives of the residuals: nothing relies on the rows and on nu of the
solver.

The residual of a driver or coupler gives its effort, but not its line of action: residuals may
differ off the manifold alone, and then their gradients do. The wrenches of drivers and couplers are
therefore written by hand, from axes and points, and the joints carry the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import accumulate
from typing import Any, cast

from ...algebra import ZERO, Quat, Scalar, quat, vec
from ...joints.base import Joint, unit
from ...mechanism.drivers import JointDriver, PointCoordinate
from ...mechanism.loads import TorsionSpringDamper
from ...mechanism.mechanism import Mechanism
from ...primitives.base import GROUND_POSE, Drive, Twist
from ...program import Program, Tape, Traced, program
from ...program.derivative import Gradient
from ..forces.demand import NO_WRENCH, BodyStates, Wrench
from ..forces.elements import at_work
from ..forces.equations import ForceEquations
from ..forces.power import powers
from ..forces.wanted import WantedForces
from ..formulation.cartesian import COLUMNS, Cartesian
from ..formulation.constraints import Constraint, Frames
from ..formulation.formulation import Acceleration, Configuration, Rows


def converted(item: Any, change: Callable[[Any], Any]) -> Any:
    """Return a body, joint or force element with its numbers passed to a function.

    They are checked already; their own checks take doubles.
    """
    new: Any = object.__new__(cast("type[Any]", type(item)))
    for each in fields(item):
        object.__setattr__(new, each.name, change(getattr(item, each.name)))
    return new


@dataclass(frozen=True, eq=False)
class ForceInputs:
    """The inputs of the programs of forces, beside state, drives and geometry.

    Attributes:
        rates, accelerations: first and second derivative of the state by time.
        multipliers: of all rows [J].
        speeds: rates of the drivers [units/s or rad/s].
        angles: of the joints of torsional springs [rad].
    """

    rates: Sequence[Traced]
    accelerations: Sequence[Traced]
    multipliers: Sequence[Traced]
    speeds: Mapping[str, Traced]
    angles: Mapping[str, Traced]

    @staticmethod
    def of(
        mechanism: Mechanism,
        size: int,
        rows: int,
        drivers: Sequence[str],
        vector: Callable[[int], list[Traced]],
    ) -> ForceInputs:
        """Return new inputs, in the order of the attributes."""
        joints = dict.fromkeys(
            each.joint for each in mechanism.forces if isinstance(each, TorsionSpringDamper)
        )
        rates, accelerations, multipliers = (vector(n) for n in (size, size, rows))
        speeds = dict(zip(drivers, vector(len(drivers)), strict=True))
        angles = dict(zip(joints, vector(len(joints)), strict=True))
        return ForceInputs(rates, accelerations, multipliers, speeds, angles)


@dataclass(frozen=True, eq=False)
class ForcePrograms:
    """The programs of forces.

    Attributes:
        wanted: the forces of the outputs, in their order: of joints six numbers each, of drivers
            and force elements one each.
        rows: number of all rows; the multipliers are theirs.
        of_joints: number of the rows of joints, which come first.
        angles: joints whose angles are inputs.
        half_angles: of each of these joints sine and cosine of half the angle, or of half the angle
            and half a turn.
        demand: generalised forces by the state [J].
        acting: those of drivers and couplers.
        left_out: derivatives of the rows left out by the state, row by row.
        forces: the forces wanted [N or N m], then the sum of the powers [W], which is zero.
    """

    wanted: WantedForces
    rows: int
    of_joints: int
    angles: Sequence[str]
    half_angles: Program
    demand: Program
    acting: Program
    left_out: Program
    forces: Program


@dataclass(frozen=True, eq=False)
class TracedRows:
    """The traced residuals of all rows.

    Attributes:
        parts: the state's vectors by name.
        gradients: derivatives of the rows by the state, then by the drives, three inputs each.
        drives: of the drivers.
        left_out: numbers of the rows that are not solved.
    """

    formulation: Cartesian
    at: Configuration
    parts: Mapping[str, Sequence[Traced]]
    gradients: Sequence[Gradient]
    drives: Mapping[str, Drive]
    left_out: Sequence[int]

    @property
    def size(self) -> int:
        """Number of scalars of the state."""
        return sum(len(each) for each in self.parts.values())


def force_programs(
    tape: Tape,
    mechanism: Mechanism,
    frame: Frames,
    traced: TracedRows,
    given: ForceInputs,
    wanted: WantedForces,
) -> ForcePrograms:
    """Return the programs of forces.

    Args:
        mechanism: with inputs of the tape as numbers of bodies, joints, points and loads.
        frame: with inputs of the tape as numbers.
    """
    states = _states(frame, traced, given)
    applied = at_work(mechanism, states, given.angles.__getitem__)
    none = Cartesian((), ())
    equations = _Equations(mechanism, traced.formulation, traced.at, states, applied, none, traced)
    efforts = {
        driver.name: _effort(traced, driver.name, given.multipliers)
        * (1.0 if driver.turns else 1.0 / frame.unit)
        for driver in mechanism.drivers
    }
    speeds = {
        driver.name: given.speeds[driver.name] * (1.0 if driver.turns else frame.unit)
        for driver in mechanism.drivers
    }
    found: list[Scalar] = []
    for name in wanted.joints:
        force, moment = equations.reaction(mechanism.joint(name), given.multipliers)
        found += [*((1.0 / frame.unit) * force), *moment]
    found += [efforts[name] for name in wanted.drivers]
    found += [applied[name].amount for name in wanted.elements]
    found.append(sum(powers(mechanism, states, applied, efforts, speeds), 0.0))
    left_out = [
        traced.gradients[row].get(k, 0.0) for row in traced.left_out for k in range(traced.size)
    ]
    return ForcePrograms(
        wanted,
        len(traced.gradients),
        len(traced.gradients) - len(mechanism.couplers) - len(mechanism.drivers),
        [*given.angles],
        _program("half angles", tape, _half_angles(mechanism, traced.at, given.angles)),
        _program("demand", tape, _by_state(traced, equations.demand)),
        _program("acting", tape, _by_state(traced, equations.acting(efforts, given.multipliers))),
        _program("rows left out", tape, left_out),
        _program("forces", tape, found),
    )


def _program(name: str, tape: Tape, values: Sequence[Scalar]) -> Program:
    return program(name, tape, dict(enumerate(values)))


@dataclass(frozen=True, eq=False)
class _Equations(ForceEquations):
    """The equations of forces with rows that are derivatives of the residuals."""

    traced: TracedRows

    @cached_property
    def rows(self) -> Rows:
        """The Jacobian of all rows by the unknowns, from the derivatives by the state."""
        traced, found = self.traced, Rows()
        first = _first(traced.parts)
        for gradient in traced.gradients:
            row: dict[int, Scalar] = {}
            for name, column in traced.formulation.columns.items():
                by_u = [gradient.get(first[f"u {name}"] + k, 0.0) for k in range(3)]
                by_q = [gradient.get(first[f"q {name}"] + k, 0.0) for k in range(4)]
                torque = 0.5 * (quat(by_q) * traced.at.poses[name].q.conjugate()).e
                row |= dict(enumerate([*by_u, *torque], column))
            for name, column in traced.formulation.coordinates.items():
                row[column] = gradient.get(first[f"x {name}"], 0.0)
            found.append(row)
        return found

    def _parts(self, joint: Joint, multipliers: Sequence[Scalar]) -> Iterator[tuple[int, Scalar]]:
        """Yield all rows of a joint: the multipliers are those of joints alone."""
        for k, c in self._of_joints[joint.name]:
            if isinstance(c, Constraint):
                yield k, multipliers[k]

    def acting(self, efforts: Mapping[str, Scalar], multipliers: Sequence[Scalar]) -> list[Scalar]:
        """Return the generalised forces of drivers and couplers by the unknowns [J]."""
        total = dict.fromkeys(self.formulation.columns, NO_WRENCH)
        for body, wrench in self._wrenches(efforts, multipliers):
            if body in total:
                total[body] += wrench
        return self.by_unknowns(total)

    def _wrenches(
        self, efforts: Mapping[str, Scalar], multipliers: Sequence[Scalar]
    ) -> Iterator[tuple[str, Wrench]]:
        mechanism, traced, states = self.mechanism, self.traced, self.states
        for driver in mechanism.drivers:
            if isinstance(driver, PointCoordinate):
                point = mechanism.point(driver.point)
                push = efforts[driver.name] * vec([*unit(driver.direction)])
                yield point.body, Wrench.at(states.arm(point.body, point.position), push)
            elif isinstance(driver, JointDriver):
                yield from self._along(driver.joint, driver.freedom, efforts[driver.name])
        first = len(multipliers) - len(mechanism.drivers) - len(mechanism.couplers)
        slots = _first(traced.parts)
        for k, coupler in enumerate(mechanism.couplers, first):
            for joint, freedom, _ in coupler.terms:
                slope = traced.gradients[k].get(slots[f"x {joint}.{freedom}"], 0.0)
                unit_of = states.frame.unit if freedom == "translation" else 1.0
                yield from self._along(joint, freedom, (1.0 / unit_of) * slope * multipliers[k])

    def _along(self, name: str, freedom: str, load: Scalar) -> Iterator[tuple[str, Wrench]]:
        """Yield the wrenches of a coordinate's load on both bodies: couples about the axis, or
        forces along it, at each body's own copy of the joint's point.
        """
        joint: Any = self.mechanism.joint(name)
        on_second = load * self.states.turned(joint.i, [*unit(joint.axis)])
        for body, push in ((joint.i, -on_second), (joint.j, on_second)):
            if freedom == "rotation":
                yield body, Wrench(ZERO, push)
            else:
                yield body, Wrench.at(self.states.arm(body, joint.point), push)


def _first(parts: Mapping[str, Sequence[Any]]) -> dict[str, int]:
    """Return the place of each vector of the state."""
    ends = accumulate(map(len, parts.values()), initial=0)
    return dict(zip(parts, ends, strict=False))


def _states(frame: Frames, traced: TracedRows, given: ForceInputs) -> BodyStates:
    first = _first(traced.parts)
    twists: dict[str, Twist] = {}
    accelerations: dict[str, Acceleration] = {}
    for name, pose in traced.at.poses.items():
        u, q = first[f"u {name}"], first[f"q {name}"]
        v, a = (vec(each[u : u + 3]) for each in (given.rates, given.accelerations))
        # the second derivative of q has no further part: q' q'* is a real number
        w, w_t = (
            2.0 * (quat(each[q : q + 4]) * pose.q.conjugate()).e
            for each in (given.rates, given.accelerations)
        )
        twists[name], accelerations[name] = Twist(v, w), Acceleration(a, w_t)
    return BodyStates(frame, traced.at.poses, twists, accelerations)


def _by_state(traced: TracedRows, demand: Sequence[Scalar]) -> list[Scalar]:
    """Return generalised forces by the state from those by the unknowns."""
    found: list[Scalar] = []
    for name, values in traced.parts.items():
        kind, body = name[0], name[2:]
        if kind == "x":
            found += [0.0] * len(values)
            continue
        first = traced.formulation.columns[body]
        force, torque = demand[first : first + 3], vec(demand[first + 3 : first + COLUMNS])
        if kind == "u":
            found += force
        else:
            product = Quat(0.0, torque) * traced.at.poses[body].q
            found += [2.0 * x for x in product]
    return found


def _effort(traced: TracedRows, name: str, multipliers: Sequence[Scalar]) -> Scalar:
    """Return the effort of a driver [J / unit of its value]: minus mu dF/dc."""
    drive = traced.drives[name]
    first = traced.size + 3 * [*traced.drives].index(name)
    weights = (1.0, -0.5 * drive.half_sin, 0.5 * drive.half_cos)  # of c, and cos and sin of c/2
    found: Scalar = 0.0
    for gradient, multiplier in zip(traced.gradients, multipliers, strict=True):
        for k, weight in enumerate(weights):
            found = found - weight * gradient.get(first + k, 0.0) * multiplier
    return found


def _half_angles(
    mechanism: Mechanism, at: Configuration, joints: Mapping[str, Traced]
) -> list[Scalar]:
    found: list[Scalar] = []
    for name in joints:
        joint: Any = mechanism.joint(name)
        i, j = (at.poses.get(body, GROUND_POSE) for body in joint.bodies)
        turn = i.q.conjugate() * j.q
        found += [vec([*unit(joint.axis)]) @ turn.e, turn.e0]
    return found
