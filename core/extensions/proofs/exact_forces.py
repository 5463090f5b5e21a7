"""The equations of forces of an exact mechanism, as programs for ball arithmetic, and the forces of
a proved sample as balls.

With F' the Jacobian of the traced residuals by the state, and G the generalised forces that the
motion demands (M a + h - Q by the scalars of the state), the multipliers solve F'^T mu = G, with
the inverse of F' that encloses the motion. A rate q' of Euler parameters is an angular velocity
w = 2 vec(q' q*), so a torque t has the generalised force 2 (t q), and the gradient g of a row by q
is the torque vec(g q*) / 2. The rows of joints and the efforts of drivers are derivatives of the
residuals: nothing relies on the rows and on nu of the solver.

The residual of a driver or coupler gives its effort, but not its line of action: residuals may
differ off the manifold alone, and then their gradients do. The wrenches of drivers and couplers are
therefore written by hand, from axes and points, and the joints carry the rest: the generalised
forces of the efforts are taken from G, and the same equations, solved again, give the reactions.
Redundant rows are left out and carry nothing. To find undetermined forces, each of them is given a
unit multiplier, and the solved rows balance it: what changes is undetermined.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import Any, TypeAlias

from ...algebra import ZERO, Quat, Scalar, quat, vec
from ...errors import KincheckError
from ...joints.base import Joint, unit
from ...kinematics.forces.equations import (
    NO_WRENCH,
    BodyStates,
    ForceEquations,
    Wrench,
    at_work,
    powers,
)
from ...kinematics.forces.wanted import WantedForces
from ...kinematics.formulation.cartesian import COLUMNS, Cartesian
from ...kinematics.formulation.constraints import Constraint, Frames
from ...kinematics.formulation.formulation import Acceleration, Configuration, Rows
from ...mechanism.loads import TorsionSpringDamper
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import JointDriver, PointCoordinate
from ...primitives.base import GROUND_POSE, Drive, Twist
from ...program import Program, Tape, Traced, program
from ...program.tape import Gradient
from .ball_executor import Ball, flint


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


def numbered_program(name: str, tape: Tape, values: Sequence[Scalar]) -> Program:
    """Return the program of values, in slots by their number."""
    return program(name, tape, dict(enumerate(values)))


@dataclass(frozen=True, eq=False)
class ExactForces(ForceEquations):
    """The equations of forces with rows that are derivatives of the residuals.

    Attributes:
        mechanism: with inputs of a tape as numbers of bodies, joints, points and loads.
        inputs: those of forces.
        gradients: derivatives of the rows by the state, then by the drives, three inputs each.
        drives: of the drivers.
        first: place of each vector of the state.
        size: number of scalars of the state.
    """

    inputs: ForceInputs
    gradients: Sequence[Gradient]
    drives: Mapping[str, Drive]
    first: Mapping[str, int]
    size: int

    @staticmethod
    def of(
        mechanism: Mechanism,
        frame: Frames,
        formulation: Cartesian,
        at: Configuration,
        inputs: ForceInputs,
        gradients: Sequence[Gradient],
        drives: Mapping[str, Drive],
    ) -> ExactForces:
        """Return the equations at a traced configuration; frames have inputs as numbers."""
        *ends, size = accumulate(map(len, at.state.values()), initial=0)
        first = dict(zip(at.state, ends, strict=True))
        twists: dict[str, Twist] = {}
        accelerations: dict[str, Acceleration] = {}
        for name, pose in at.poses.items():
            u, q = first[f"u {name}"], first[f"q {name}"]
            rates = inputs.rates, inputs.accelerations
            v, a = (vec(each[u : u + 3]) for each in rates)
            # the second derivative of q has no further part: q' q'* is a real number
            w, w_t = (2.0 * (quat(each[q : q + 4]) * pose.q.conjugate()).e for each in rates)
            twists[name], accelerations[name] = Twist(v, w), Acceleration(a, w_t)
        states = BodyStates(frame, at.poses, twists, accelerations)
        applied = at_work(mechanism, states, inputs.angles.__getitem__)
        return ExactForces(
            mechanism,
            formulation,
            at,
            states,
            applied,
            Cartesian((), ()),
            inputs,
            gradients,
            drives,
            first,
            size,
        )

    def programs(self, tape: Tape, wanted: WantedForces, left_out: Sequence[int]) -> ForcePrograms:
        """Return the programs of forces.

        Args:
            left_out: numbers of the rows that are not solved.
        """
        mechanism, multipliers, unit_of_length = (
            self.mechanism,
            self.inputs.multipliers,
            self.states.frame.unit,
        )
        efforts = {
            driver.name: self._effort_of(driver.name)
            * (1.0 if driver.turns else 1.0 / unit_of_length)
            for driver in mechanism.drivers
        }
        speeds = {
            driver.name: self.inputs.speeds[driver.name] * (1.0 if driver.turns else unit_of_length)
            for driver in mechanism.drivers
        }
        found: list[Scalar] = []
        for name in wanted.joints:
            force, moment = self.reaction(mechanism.joint(name), multipliers)
            found += [*((1.0 / unit_of_length) * force), *moment]
        found += [efforts[name] for name in wanted.drivers]
        found += [self.applied[name].amount for name in wanted.elements]
        found.append(sum(powers(mechanism, self.states, self.applied, efforts, speeds), 0.0))
        rows = [self.gradients[row].get(k, 0.0) for row in left_out for k in range(self.size)]
        acting = dict.fromkeys(self.formulation.columns, NO_WRENCH)
        for body, wrench in self._wrenches(efforts):
            if body in acting:
                acting[body] += wrench
        return ForcePrograms(
            wanted,
            len(self.gradients),
            len(self.gradients) - len(mechanism.couplers) - len(mechanism.drivers),
            [*self.inputs.angles],
            numbered_program("half angles", tape, [*self._half_angles()]),
            numbered_program("demand", tape, self._by_state(self.demand)),
            numbered_program("acting", tape, self._by_state(self.by_unknowns(acting))),
            numbered_program("rows left out", tape, rows),
            numbered_program("forces", tape, found),
        )

    @cached_property
    def rows(self) -> Rows:
        """The Jacobian of all rows by the unknowns, from the derivatives by the state."""
        first, found = self.first, Rows()
        for gradient in self.gradients:
            row: dict[int, Scalar] = {}
            for name, column in self.formulation.columns.items():
                by_u = [gradient.get(first[f"u {name}"] + k, 0.0) for k in range(3)]
                by_q = [gradient.get(first[f"q {name}"] + k, 0.0) for k in range(4)]
                torque = 0.5 * (quat(by_q) * self.at.poses[name].q.conjugate()).e
                row |= dict(enumerate([*by_u, *torque], column))
            for name, column in self.formulation.coordinates.items():
                row[column] = gradient.get(first[f"x {name}"], 0.0)
            found.append(row)
        return found

    def _parts(self, joint: Joint, multipliers: Sequence[Scalar]) -> Iterator[tuple[int, Scalar]]:
        """Yield all rows of a joint: the multipliers are those of joints alone."""
        for k, c in self._of_joints[joint.name]:
            if isinstance(c, Constraint):
                yield k, multipliers[k]

    def _wrenches(self, efforts: Mapping[str, Scalar]) -> Iterator[tuple[str, Wrench]]:
        """Yield the wrenches of drivers and couplers on bodies."""
        mechanism, states, multipliers = self.mechanism, self.states, self.inputs.multipliers
        for driver in mechanism.drivers:
            if isinstance(driver, PointCoordinate):
                point = mechanism.point(driver.point)
                push = efforts[driver.name] * vec([*unit(driver.direction)])
                yield point.body, Wrench.at(states.arm(point.body, point.position), push)
            elif isinstance(driver, JointDriver):
                yield from self._coordinate_wrenches(
                    driver.joint, driver.freedom, efforts[driver.name]
                )
        first = len(multipliers) - len(mechanism.drivers) - len(mechanism.couplers)
        for k, coupler in enumerate(mechanism.couplers, first):
            for joint, freedom, _ in coupler.terms:
                slope = self.gradients[k].get(self.first[f"x {joint}.{freedom}"], 0.0)
                unit_of = states.frame.unit if freedom == "translation" else 1.0
                yield from self._coordinate_wrenches(
                    joint, freedom, (1.0 / unit_of) * slope * multipliers[k]
                )

    def _coordinate_wrenches(
        self, name: str, freedom: str, load: Scalar
    ) -> Iterator[tuple[str, Wrench]]:
        """Yield the wrenches of a coordinate's load on both bodies: couples about the axis, or
        forces along it, at each body's own copy of the joint's point.
        """
        joint: Any = self.mechanism.joint(name)
        on_second = load * self.states.turn(joint.i, [*unit(joint.axis)])
        for body, push in ((joint.i, -on_second), (joint.j, on_second)):
            if freedom == "rotation":
                yield body, Wrench(ZERO, push)
            else:
                yield body, Wrench.at(self.states.arm(body, joint.point), push)

    def _by_state(self, demand: Sequence[Scalar]) -> list[Scalar]:
        """Return generalised forces by the state from those by the unknowns."""
        found: list[Scalar] = []
        for name, values in self.at.state.items():
            kind, body = name[0], name[2:]
            if kind == "x":
                found += [0.0] * len(values)
                continue
            first = self.formulation.columns[body]
            force, torque = demand[first : first + 3], vec(demand[first + 3 : first + COLUMNS])
            if kind == "u":
                found += force
            else:
                product = Quat(0.0, torque) * self.at.poses[body].q
                found += [2.0 * x for x in product]
        return found

    def _effort_of(self, driver: str) -> Scalar:
        """Return the effort of a driver [J / unit of its value]: minus mu dF/dc."""
        drive = self.drives[driver]
        first = self.size + 3 * [*self.drives].index(driver)
        weights = (1.0, -0.5 * drive.half_sin, 0.5 * drive.half_cos)  # of c, and cos and sin of c/2
        found: Scalar = 0.0
        for gradient, multiplier in zip(self.gradients, self.inputs.multipliers, strict=True):
            for k, weight in enumerate(weights):
                found = found - weight * gradient.get(first + k, 0.0) * multiplier
        return found

    def _half_angles(self) -> Iterator[Scalar]:
        for name in self.inputs.angles:
            joint: Any = self.mechanism.joint(name)
            i, j = (self.at.poses.get(body, GROUND_POSE) for body in joint.bodies)
            turn = i.q.conjugate() * j.q
            yield vec([*unit(joint.axis)]) @ turn.e
            yield turn.e0


WRENCH = 6
"""Numbers of a joint's reaction: force, then moment."""

Run = Callable[[Program, Sequence[Ball]], Sequence[Ball]]
"""Runs a program at the proved state, with rates, accelerations, multipliers, speeds and angles."""


class UnprovedError(KincheckError, ArithmeticError):
    """There is no proof for a sample; the message gives the reason."""


_Forces: TypeAlias = tuple[Mapping[str, Sequence[Ball]], Mapping[str, Ball], Sequence[Ball]]


@dataclass(frozen=True, eq=False)
class EnclosedForces:
    """Forces of a sample, as balls.

    Attributes:
        joints: force [N] and moment [N m] by joint, six balls.
        drivers, elements: effort or force by name [N or N m].
        free: for each row left out what a multiplier of one adds to the joints, with the unit of
            the frames in place of the metre.
        power: sum of the powers [W], which contains zero.
    """

    joints: Mapping[str, Sequence[Ball]]
    drivers: Mapping[str, Ball]
    elements: Mapping[str, Ball]
    free: Sequence[Mapping[str, Sequence[Ball]]]
    power: Ball


def enclose_forces(
    programs: ForcePrograms,
    kept: Sequence[int],
    left_out: Sequence[int],
    run: Run,
    motion: Sequence[Sequence[Ball]],
    speeds: Sequence[Ball],
    near: Sequence[float],
    inverse: Ball,
) -> EnclosedForces:
    """Return the forces of a sample.

    Args:
        kept, left_out: numbers of the rows solved, and of the others.
        motion: first and second derivative of the state by time.
        speeds: rates of the drivers [units/s or rad/s].
        near: approximate angles of the joints of torsional springs [rad], which count their turns.
        inverse: of F'.

    Raises:
        UnprovedError: an angle is not near the approximate one, or power is not balanced.
    """
    arb, matrix = flint().arb, flint().arb_mat
    size = len(motion[0])
    begin = [*motion[0], *motion[1]]
    nothing = [arb(0)] * programs.rows

    def further(multipliers: Sequence[Ball], angles: Sequence[Ball]) -> list[Ball]:
        return [*begin, *multipliers, *speeds, *angles]

    halves = run(programs.half_angles, further(nothing, [arb(0)] * len(near)))
    angles = [
        _angle(halves[2 * k], halves[2 * k + 1], about, programs.angles[k])
        for k, about in enumerate(near)
    ]

    rows = run(programs.left_out, further(nothing, angles))
    off = {row: rows[k * size : (k + 1) * size] for k, row in enumerate(left_out)}

    def balance(right: Sequence[Ball], given: Collection[int]) -> list[Ball]:
        """Return the multipliers of all rows: one of the given rows, zero of others left out."""
        column = [x - sum((off[row][k] for row in given), arb(0)) for k, x in enumerate(right)]
        solved = (inverse.transpose() * matrix(size, 1, column)).entries()
        found = list(nothing)
        for row, value in zip(kept, solved, strict=False):  # those of lengths come last
            found[row] = value
        for row in given:
            found[row] = arb(1)
        return found

    def forces(right: Sequence[Ball], given: Collection[int] = ()) -> tuple[_Forces, list[Ball]]:
        """Return the forces in balance with generalised forces, and the multipliers left to the
        rows of drivers and couplers: zero.
        """
        every = further(balance(right, given), angles)
        _, drivers, rest = _split(programs, run(programs.forces, every))
        left = [x - y for x, y in zip(right, run(programs.acting, every), strict=True)]
        own = balance(left, [row for row in given if row < programs.of_joints])
        joints, *_ = _split(programs, run(programs.forces, further(own, angles)))
        return (joints, drivers, rest), own[programs.of_joints :]

    (joints, drivers, rest), beside = forces(run(programs.demand, further(nothing, angles)))
    *amounts, power = rest
    if not power.contains(0):
        raise UnprovedError(
            f"the powers of drivers, masses and force elements sum up to {power.str(5)} W, expected"
            " zero: an equation of the forces is wrong, please report it"
        )
    if not all(each.contains(0) for each in beside):
        raise UnprovedError(
            "a driver or coupler measures another coordinate than the turn about its joint's axis"
            " or the displacement along it: see measured() of the joint's type"
        )
    free = [forces([arb(0)] * size, [row])[0][0] for row in left_out]
    return EnclosedForces(
        joints, drivers, dict(zip(programs.wanted.elements, amounts, strict=True)), free, power
    )


def _split(programs: ForcePrograms, values: Sequence[Ball]) -> _Forces:
    """Return values by joint and driver, and the others."""
    wanted = programs.wanted
    last = WRENCH * len(wanted.joints)
    joints = {name: values[WRENCH * k : WRENCH * (k + 1)] for k, name in enumerate(wanted.joints)}
    end = last + len(wanted.drivers)
    return joints, dict(zip(wanted.drivers, values[last:end], strict=True)), values[end:]


def _angle(sine: Ball, cosine: Ball, near: float, joint: str) -> Ball:
    """Return the angle of a joint near an approximate one."""
    principal, turn = 2 * flint().arb.atan2(sine, cosine), 2 * flint().arb.pi()
    angle = principal + round((near - float(principal.mid())) / math.tau) * turn
    if not abs(angle - near) < 0.5:
        raise UnprovedError(
            f"the angle of joint {joint!r}, {angle.str(5)}, is not near the approximate {near:.5g}"
        )
    return angle
