"""A mechanism with exact numbers, and its equations as programs for ball arithmetic.

Coordinates, axes and lengths are fractions: their doubles, or the decimals that print them.
Quantities that joints derive from them (differences, directions, lengths) stay fractions up to the
first root and are balls from there on, so no rounding is ignored. A joint type that calls `math`
itself rounds to a double; the joint types of kincheck do not. Pi of a screw's lead is its double.

The residuals are the only equations of the primitives in use: the Jacobian is the derivative of the
traced residuals, and the unit length of the Euler parameters is an equation of its own. Proofs
therefore check rows, nu and gamma and do not rely on them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from fractions import Fraction
from typing import Any, cast

from ...algebra import Scalar, Vec3, power, quat
from ...errors import SolveError
from ...joints import Spline
from ...kinematics.forces.wanted import WantedForces
from ...kinematics.formulation.cartesian import Cartesian
from ...kinematics.formulation.constraints import Frames, constraints, frames
from ...mechanism.loads import Law
from ...mechanism.mechanism import Mechanism
from ...primitives.base import GROUND_POSE, Drive, map_numbers
from ...program import Program, Tape, Traced, program
from ...program.tape import jacobian
from .ball_executor import Ball, flint
from .exact_forces import ExactForces, ForceInputs, ForcePrograms, numbered_program

Reading = Callable[[float], Fraction]
"""Interpretation of a float of a description as a fraction."""


def as_double(x: float) -> Fraction:
    """Return the double itself, the number given to every engine."""
    return Fraction(x)


def as_decimal(x: float) -> Fraction:
    """Return the shortest decimal that denotes the double.

    It is the number of a case file with 15 digits or fewer in SI units.
    """
    return Fraction(repr(float(x)))


class Exact:
    """A fraction, or a ball after the first root."""

    __slots__ = ("value",)

    def __init__(self, value: Any) -> None:
        self.value = value

    @staticmethod
    def of(x: Fraction) -> Exact:
        """Return the number of a fraction."""
        return Exact(flint().fmpq(x.numerator, x.denominator))

    @property
    def ball(self) -> Ball:
        """The number at the precision of the enclosing block."""
        return flint().arb(self.value)

    @property
    def trivial(self) -> float | None:
        """The number as a float if it is 0, 1 or -1, else None.

        Products with these numbers, and their sums, are exact in double precision.
        """
        return next(
            (x for x in (0.0, 1.0, -1.0) if not self._is_ball and self.value == int(x)), None
        )

    @property
    def _is_ball(self) -> bool:
        return isinstance(self.value, flint().arb)

    def __add__(self, b: Any) -> Exact:
        return Exact(self.value + _value(b))

    def __sub__(self, b: Any) -> Exact:
        return Exact(self.value - _value(b))

    def __mul__(self, b: Any) -> Any:
        return NotImplemented if isinstance(b, Vec3) else Exact(self.value * _value(b))

    def __truediv__(self, b: Any) -> Exact:
        return Exact(self.value / _value(b))

    def __rsub__(self, a: Any) -> Exact:
        return Exact(_value(a) - self.value)

    def __rtruediv__(self, a: Any) -> Exact:
        return Exact(_value(a) / self.value)

    __radd__, __rmul__ = __add__, __mul__

    __pow__ = power

    def __neg__(self) -> Exact:
        return Exact(-self.value)

    def __abs__(self) -> Exact:
        return Exact(abs(self.value))

    # choices of a description (the axis nearest to perpendicular) may fall either way if balls
    # overlap
    def __lt__(self, b: Any) -> bool:
        return bool((self - b).ball < 0)

    def __gt__(self, b: Any) -> bool:
        return bool((self - b).ball > 0)

    def __le__(self, b: Any) -> bool:
        return bool((self - b).ball <= 0)

    def __ge__(self, b: Any) -> bool:
        return bool((self - b).ball >= 0)

    def __bool__(self) -> bool:
        return bool(self.value != 0)

    def __float__(self) -> float:
        return float(self.value)

    def sqrt(self) -> Exact:
        """Return the square root, a fraction if possible; of a ball, that of its part >= 0."""
        if not self._is_ball and self.value.p.is_square() and self.value.q.is_square():
            return Exact(self.value.sqrt())
        return Exact(self.ball.nonnegative_part().sqrt())

    def arctan2(self, x: Any) -> Exact:
        """Return the angle of the direction (x, self) [rad]; numpy calls this name."""
        return Exact(flint().arb.atan2(self.ball, flint().arb(_value(x))))


def _value(b: Any) -> Any:
    if isinstance(b, Exact):
        return b.value
    if isinstance(b, float) and math.isfinite(b):
        return flint().fmpq(*b.as_integer_ratio())
    return Exact.of(Fraction(b)).value if math.isfinite(b) else flint().arb(b)


def exact_mechanism(mechanism: Mechanism, reading: Reading) -> Mechanism:
    """Return the mechanism with `Exact` numbers.

    Raises:
        SolveError: a force element has a law without an enclosure.
    """
    for force in mechanism.forces:
        if getattr(force, "curve", None) or getattr(force, "law", None) is Law.CARDAN:
            raise SolveError(
                f"{force} has a curve or Cardan angles, and proofs know neither; give a stiffness"
                " and the law 'euler_parameters'"
            )

    for coupler in mechanism.couplers:
        if isinstance(coupler, Spline):
            raise SolveError(
                f"{coupler} is a spline, and proofs know none; give a polynomial in its place"
            )

    def number(value: Any) -> Any:
        if isinstance(value, float):
            return Exact.of(reading(value))
        whole = isinstance(value, int) and not isinstance(value, bool)
        return Exact.of(Fraction(value)) if whole else value

    return _convert(mechanism, number)


def _convert(mechanism: Mechanism, number: Callable[[Any], Any]) -> Mechanism:
    """Return a mechanism with its numbers passed to a function.

    They are checked already: the checks of its members take doubles.
    """

    def member(item: Any) -> Any:
        new: Any = object.__new__(cast("type[Any]", type(item)))
        for each in fields(item):
            object.__setattr__(new, each.name, map_numbers(getattr(item, each.name), number))
        return new

    kinds = ("points", "drivers", "couplers", "bodies", "forces")
    changes = {kind: [*map(member, getattr(mechanism, kind))] for kind in kinds}
    gravity = map_numbers(mechanism.gravity, number)
    return mechanism.with_joints(member, grounded=(), gravity=gravity, **changes)


class _Inputs:
    """The slots of the programs: state, drivers, then geometry in the order of use."""

    def __init__(self) -> None:
        self.tape = Tape()
        self.count = 0
        self.geometry: list[Ball] = []

    def vector(self, count: int) -> list[Traced]:
        first, self.count = self.count, self.count + count
        return [self.tape.input(slot) for slot in range(first, self.count)]

    def lift(self, value: Any) -> Any:
        """Return a value with its exact numbers as program inputs, or literals if trivial."""
        return map_numbers(value, self.number)

    def number(self, value: Any) -> Any:
        """Return an exact number as an input, or a literal if it is trivial."""
        if isinstance(value, float) and value not in (0.0, 1.0, -1.0):
            value = Exact.of(Fraction(value))
        if not isinstance(value, Exact):
            return value
        if value.trivial is not None:
            return value.trivial
        self.geometry.append(value.ball)
        return self.vector(1)[0]


@dataclass(frozen=True, eq=False)
class ExactEquations:
    """The equations of a mechanism for a proof; inputs are state, drivers, those of forces, then
    `geometry`. Each moving driver has three: value [units or rad], cosine and sine of its half.
    With forces the drivers that stand still are among them.

    Attributes:
        names: of the output points.
        state: names and sizes of the vectors of the state: displacement "u BODY" [units], Euler
            parameters "q BODY", coordinates "x JOINT.FREEDOM" [units or rad].
        geometry: values of the further inputs.
        residuals: as many as scalars of the state: the kept rows, then the lengths of the Euler
            parameters.
        derivative: their Jacobian; the slot of an entry is row * size + column, zeros are left out.
        points: displacement of each point from the design [m], three slots each.
        tests: the rows left out, then the branch tests.
        kept, left_out: numbers of the rows solved, and of the others.
        forces: programs of forces; None unless wanted.
    """

    frame: Frames
    names: Sequence[str]
    state: Mapping[str, int]
    geometry: Sequence[Ball]
    residuals: Program
    derivative: Program
    points: Program
    tests: Program
    kept: Sequence[int]
    left_out: Sequence[int]
    forces: ForcePrograms | None

    @property
    def size(self) -> int:
        """Number of scalars of the state."""
        return sum(self.state.values())


def equations(
    mechanism: Mechanism,
    drivers: Sequence[str],
    points: Sequence[str],
    kept: Sequence[int],
    wanted: WantedForces | None = None,
) -> ExactEquations:
    """Return the programs of an exact mechanism.

    Args:
        mechanism: from `exact_mechanism`; the call sets the precision of the geometry.
        drivers: names of the moving drivers; of all if forces are wanted.
        points: names of the output points.
        kept: the rows to solve; the others are tests.
        wanted: forces to enclose.
    """
    frame, inputs = frames(mechanism), _Inputs()
    design = Cartesian.of(mechanism, frame).design
    parts = {name: inputs.vector(len(value)) for name, value in design.items()}
    state = [x for part in parts.values() for x in part]
    driven = {name: inputs.vector(3) for name in drivers}
    drives = {name: Drive(c, 0.0, 0.0, *half) for name, (c, *half) in driven.items()}
    rows = len(Cartesian.of(mechanism, frame).owners)
    given = wanted and ForceInputs.of(mechanism, len(state), rows, drivers, inputs.vector)
    formulation = Cartesian(
        [inputs.lift(c) for c in constraints(mechanism, frame, drives)], frame.moving
    )
    at = formulation.configuration(parts)
    phi = formulation.phi(at)
    lengths = [
        0.5 * (q.e0 * q.e0 + q.e @ q.e - 1.0)
        for q in (quat(p) for n, p in parts.items() if n[0] == "q")
    ]
    taken = set(kept)
    left_out = [k for k in range(len(phi)) if k not in taken]
    moved: list[Scalar] = []
    for name in points:
        point = mechanism.point(name)
        pose, arm = (
            at.poses.get(point.body, GROUND_POSE),
            inputs.lift(frame.arm(point.body, point.position)),
        )
        moved += inputs.lift(Exact.of(Fraction(frame.unit))) * (pose.u + pose.swing(arm))
    inputs_of_rows = [*state, *(x for each in driven.values() for x in each)]
    gradients = jacobian(inputs.tape, [*phi, *lengths], inputs_of_rows)
    solved = [*(gradients[k] for k in kept), *gradients[len(phi) :]]
    entries = {
        row * len(state) + column: value
        for row, gradient in enumerate(solved)
        for column, value in gradient.items()
        if column < len(state)
    }
    forces: ForcePrograms | None = None
    if wanted is not None and given is not None:
        exact = ExactForces.of(
            _convert(mechanism, inputs.number),
            inputs.lift(frame),
            formulation,
            at,
            given,
            gradients[: len(phi)],
            drives,
        )
        forces = exact.programs(inputs.tape, wanted, left_out)
    return ExactEquations(
        frame,
        points,
        {name: len(value) for name, value in design.items()},
        inputs.geometry,
        numbered_program("residuals", inputs.tape, [*(phi[k] for k in kept), *lengths]),
        program("derivative", inputs.tape, entries),
        numbered_program("points", inputs.tape, moved),
        numbered_program(
            "tests", inputs.tape, [*(phi[k] for k in left_out), *formulation.branch(at)]
        ),
        kept,
        left_out,
        forces,
    )
