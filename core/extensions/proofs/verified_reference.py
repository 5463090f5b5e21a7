"""Proof of a case: every output at every sample to a number of digits, and the
native engine's errors.

Each native solution is proved to lie near exactly one solution of the case's
equations (`kinematics.verified.krawczyk`). The equations are kincheck's own, so the
reference is an in_house_oracle.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from ...algebra import Vec3
from ...case.case import HELD_BUT, Case, Quantity
from ...case.io.reference_file import ProvedSeries, Reference, Sample
from ...case.measures import Orientation
from ...case.pose_measures import with_signs
from ...case.quantity import known_at
from ...case.turns import signs_of, turns_of
from ...forces import DETERMINED, Forces, Reaction
from ...harness.compare import output_series
from ...jet import Jet
from ...kinematics import follower
from ...trajectory import Array
from ...version import VERSION
from .ball_executor import Ball, flint, precision
from .exact import Exact, Reading, as_decimal, as_double
from .exact_forces import EnclosedForces, UnprovedError
from .krawczyk import Enclosure
from .proofs import Drives, Proofs, prove

Column = Sequence[Ball | None]
"""A quantity at the samples; None where it is not known."""


@dataclass(frozen=True)
class NativeError:
    """Largest native errors over the samples, of an output's position, velocity and acceleration.

    Attributes:
        largest: [SI]; None if there is no such derivative.
        ulps: in units in the last place of the largest value of any output of the same unit: an
            output may be zero throughout, by symmetry.
    """

    output: str
    unit: str
    largest: Sequence[float | None]
    ulps: Sequence[float | None]


def native_errors(
    case: Case, found: Proofs, values: Mapping[str, Sequence[Column]]
) -> list[NativeError]:
    """Return the native errors of every proved output."""
    outputs = [output for output in case.outputs if output.name in values]
    sizes: dict[tuple[str, int], float] = {}
    for output in outputs:
        for order, column in enumerate(values[output.name]):
            known = [
                sizes.get((output.unit, order), 0.0),
                *(upper(ball) for ball in column if ball is not None),
            ]
            sizes[output.unit, order] = max(known)
    errors: list[NativeError] = []
    for output in outputs:
        native = output_series(case, output, found.native)
        largest: list[float | None] = []
        ulps: list[float | None] = []
        for order, given in enumerate((native.position, native.velocity, native.acceleration)):
            numbers: list[float] = [] if given is None else given.tolist()
            pairs = zip(numbers, values[output.name][order], strict=given is not None)
            off = [
                upper(flint().arb(x) - ball)
                for x, ball in pairs
                if ball is not None and math.isfinite(x)
            ]
            size = sizes[output.unit, order]
            largest.append(max(off, default=None))
            ulps.append(max(off) / float(np.spacing(size)) if off and size > 0.0 else None)
        errors.append(NativeError(output.name, output.unit, largest, ulps))
    return errors


def upper(ball: Ball) -> float:
    """Return a float not below |ball|."""
    return float(np.nextafter(float(ball.abs_upper()), np.inf))


FORCES_NOTE = (
    " Forces are those of the solved rows; redundant rows, which are left out, carry nothing. A"
    " component is printed only if a unit multiplier of a redundant row changes it by at most"
    f" {DETERMINED:g}, and if the native engine finds it determined, which counts rows left out"
    " within the digits of the case too. Turns of torsional springs are counted as the native"
    " engine counts them."
)


def force_values(output: Any, found: Proofs) -> tuple[Sequence[Column], str | None]:
    """Return a force output's values at the samples, as balls, and the reason if there are none.

    A value is None where there is no proof, and where redundant rows leave it undetermined; there
    are no rates.
    """
    column: list[Any] = [None] * len(found.samples)
    none = [*column]
    there = {
        k: each.forces
        for k, each in enumerate(found.samples)
        if isinstance(each, Enclosure) and each.forces is not None
    }
    if not there:
        return [none] * 3, None
    native = found.native.forces
    assert native is not None  # forces are proved near the native ones
    determined = np.isfinite(output.values(native))
    values: list[Any] = output.values(_forces([*there.values()])).tolist()
    for k, value in zip(there, values, strict=True):
        column[k] = None if isinstance(value, float) or not determined[k] else value
    known = any(value is not None for value in column)
    return [column, none, none], None if known else output.undetermined(native) or None


def _forces(samples: Sequence[EnclosedForces]) -> Forces:
    """Return the forces over the samples, in arrays of balls."""
    first, n = samples[0], len(samples)

    def reaction(name: str) -> Reaction:
        table: Any = np.array([each.joints[name] for each in samples], dtype=object)
        free: Any = np.zeros((n, 6, len(first.free)), dtype=object)
        for k, each in enumerate(samples):
            for column, joints in enumerate(each.free):
                free[k, :, column] = joints[name]
        return Reaction(table[:, :3], table[:, 3:], free)

    def lanes(values: Sequence[Any]) -> Any:
        return np.array(values, dtype=object)

    return Forces(
        {name: reaction(name) for name in first.joints},
        {name: lanes([each.drivers[name] for each in samples]) for name in first.drivers},
        {name: lanes([each.elements[name] for each in samples]) for name in first.elements},
        lanes([each.power for each in samples]),
        np.zeros(n),
    )


NUMBERS: Mapping[str, Reading] = {"double": as_double, "decimal": as_decimal}
"""Readings of a case's numbers: as the engines' doubles, or as the decimals of
their shortest print.
"""

# Bits beyond the digits: Newton's iteration ends 40 above the precision; nearly singular poses take
# the rest.
GUARD_BITS = 100
# Extra digits printed, so that printing does not use up the bound.
SPARE_DIGITS = 2

NOTE = (
    "Krawczyk's test in ball arithmetic: the equations `rows`, or all but those that a sample has"
    " `left_out`, have exactly one solution in the box of radius `alone` around it, the native pose"
    " is in that box, and all printed numbers are within 10^-digits of those of the solution. The"
    " numbers of the mechanism and the swept values are taken exactly as `numbers` says, directions"
    " and lengths made of them in ball arithmetic. Motions of further drivers, directions of"
    " outputs and the pi in the lead of a screw are their doubles."
)


def prove_case(
    case: Case, *, digits: int, numbers: str, tol: float
) -> tuple[Reference, list[NativeError]]:
    """Prove the samples of a case, and measure the native engine's errors.

    Args:
        digits: outputs are enclosed to 10^-digits, absolutely [SI].
        numbers: a key of `NUMBERS`.
        tol: of the native solution.

    Raises:
        SolveError: the native engine cannot begin.
        KincheckError: python-flint is not installed.
    """
    bits = math.ceil(digits * math.log2(10.0)) + GUARD_BITS
    found = prove(
        case.mechanism,
        case.sweep.path,
        case.points,
        _drives(case, numbers),
        NUMBERS[numbers],
        bits,
        tol,
        {name for output in case.outputs for name in output.forces},
        follower,
    )
    with precision(bits):
        values: dict[str, Sequence[Column]] = {}
        reasons: dict[str, str] = {}
        for output in case.outputs:
            if HELD_BUT in output.facts:
                reasons[output.name] = (
                    "is a derivative with other drivers held, which is no proof's"
                )
                continue
            if output.forces:
                values[output.name], reason = force_values(output, found)
                if reason is not None:
                    reasons[output.name] = reason
                continue
            try:
                values[output.name] = _values(case, output, found, numbers)
            except (TypeError, AttributeError) as error:
                reasons[output.name] = f"computes what balls cannot: {error}"
        samples = [
            _sample(each, k, values, digits, found.others.get(k))
            for k, each in enumerate(found.samples)
        ]
        outputs = {
            output.name: _series(
                output, values.get(output.name), reasons.get(output.name), samples, digits
            )
            for output in case.outputs
        }
        errors = native_errors(case, found, values)
    made = Reference(
        case=case.name,
        kincheck=VERSION,
        numbers=numbers,
        note=NOTE + FORCES_NOTE * any(output.forces for output in case.outputs),
        digits=digits,
        bits=bits,
        rows=list(found.rows),
        redundant=list(found.redundant),
        driver={name: moved.tolist() for name, moved in case.sweep.moved.items()},
        outputs=outputs,
        samples=samples,
        seconds=sum(found.seconds),
    )
    return made, errors


def _drives(case: Case, numbers: str) -> Drives:
    """Return the moving drivers' values at the samples: exact for the swept one,
    doubles for others.
    """
    path, sweep, reading = case.sweep.path, case.sweep, NUMBERS[numbers]
    table = path.drive([*path.motions], path.times)
    drives: dict[str, Sequence[tuple[Fraction, Fraction, Fraction]]] = {
        name: [
            (Fraction(c), Fraction(c_t), Fraction(c_tt)) for c, c_t, c_tt in table[:, k].T.tolist()
        ]
        for k, name in enumerate(path.motions)
    }
    if sweep.driver in drives:
        design, rate = reading(sweep.design), reading(sweep.rate)
        drives[sweep.driver] = [
            (value - design, rate, Fraction(0)) for value in _grid(sweep.values, numbers)
        ]
    return drives


def _grid(values: Array, numbers: str) -> list[Fraction]:
    """Return the sweep's samples; a grid even up to its decimals is made even."""
    each, last = list(map(NUMBERS[numbers], values.tolist())), len(values) - 1
    if numbers == "double" or last < 1:
        return each
    even = [each[0] + (each[-1] - each[0]) * k / last for k in range(last + 1)]
    rounding = 4.0 * np.spacing(np.abs(values).max())  # of start + k * step in doubles
    return even if all(abs(a - b) <= rounding for a, b in zip(even, each, strict=True)) else each


def _values(case: Case, output: Quantity, found: Proofs, numbers: str) -> Sequence[Column]:
    """Return an output's position, velocity and acceleration at the samples, as balls."""
    reading, still = NUMBERS[numbers], Exact.of(Fraction(0))
    proved = [k for k, each in enumerate(found.samples) if isinstance(each, Enclosure)]
    at: dict[str, Vec3] = {}
    design: dict[str, Vec3] = {}
    for name in output.points:
        position = [Exact.of(reading(x)) for x in case.mechanism.point(name).position]
        motions = [each.points[name] for each in found.samples if isinstance(each, Enclosure)]
        moved = [
            [[Exact(motion[order][axis]) for motion in motions] for order in range(3)]
            for axis in range(3)
        ]
        at[name] = Vec3(
            *(
                _jet([start + x for x in xs], v, a)
                for start, (xs, v, a) in zip(position, moved, strict=True)
            )
        )
        design[name] = Vec3(*(_jet([x], [still], [still]) for x in position))
    columns: list[list[Ball | None]] = [[None] * len(found.samples) for _ in range(3)]
    if proved:
        jet = _output_jet(case, output, at, design, proved)
        for column, values in zip(columns, (jet.x, jet.v, jet.a), strict=True):
            for k, value in zip(
                proved,
                np.broadcast_to(np.asarray(values, dtype=object), (len(proved),)),
                strict=True,
            ):
                ball = value.ball if isinstance(value, Exact) else flint().arb(float(value))
                column[k] = ball if ball.is_finite() else None
    return columns


def _jet(*columns: Sequence[Exact]) -> Jet:
    x, v, a = (np.array(column, dtype=object) for column in columns)
    return Jet(x, v, a)


def _sample(
    found: Enclosure | UnprovedError,
    k: int,
    values: Mapping[str, Sequence[Column]],
    digits: int,
    others: Sequence[str] | None,
) -> Sample:
    """Return the proof, unless an output's enclosure is too wide."""
    if isinstance(found, UnprovedError):
        return Sample(proved=False, reason=str(found))
    balls = {
        name: ball
        for name, columns in values.items()
        for column in columns
        if (ball := column[k]) is not None
    }
    for name, ball in balls.items():
        if not ball.rad() < flint().arb(10) ** -(digits + SPARE_DIGITS):
            width = float(ball.rad())
            return Sample(
                proved=False,
                reason=(
                    f"{name} is enclosed to {width:.2g} only: nearly singular pose; ask for more"
                    " digits"
                ),
            )
    return Sample(
        proved=True,
        alone=found.alone,
        contraction=found.contraction,
        branch=min((float(each.lower()) for each in found.branch), default=None),
        redundant=max((upper(each) for each in found.left_out), default=None),
        contradicted=sum(not each.contains(0) for each in found.left_out),
        left_out=None if others is None else list(others),
    )


def _output_jet(
    case: Case,
    output: Quantity,
    at: Mapping[str, Vec3],
    design: Mapping[str, Vec3],
    proved: Sequence[int],
) -> Jet:
    """Return an output, an angle or an orientation with its turns along the path."""
    if isinstance(output, Orientation):
        terms, path = output.terms(at, design), case.sweep.path
        sign = signs_of(case.mechanism, path, output, terms, np.array(proved))
        return output.component_of(with_signs(sign, terms))
    jet = known_at(output, at, design)
    if not output.period:
        return jet
    x, v = (np.asarray(each).astype(np.float64) for each in (jet.x, jet.v))
    count = turns_of(case.mechanism, case.sweep.path, output, x, v, np.array(proved))
    whole = 2 * flint().arb.pi()  # of a period, which is a whole turn
    return jet + np.array([Exact(int(n) * whole) for n in count], dtype=object)


def _series(
    output: Quantity,
    values: Sequence[Column] | None,
    reason: str | None,
    samples: Sequence[Sample],
    digits: int,
) -> ProvedSeries:
    printed: list[list[str | None]] = []
    radii: list[float | None] = []
    for column in values or [[None] * len(samples)] * 3:
        known = [
            ball if sample.proved else None for ball, sample in zip(column, samples, strict=True)
        ]
        texts = [None if ball is None else _decimal_text(ball, digits) for ball in known]
        bounds = [
            upper(ball - flint().arb(text))
            for ball, text in zip(known, texts, strict=True)
            if ball is not None
        ]
        printed.append(texts)
        radii.append(max(bounds, default=None))
    if reason is None and not any(text for texts in printed for text in texts):
        reason = "its value is not known at any proved sample"
    position, velocity, acceleration = printed
    return ProvedSeries(
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        radius=radii,
        unit=output.unit,
        signs=output.signs,
        reason=reason,
    )


def _decimal_text(ball: Ball, digits: int) -> str:
    """Return a decimal with an error below 10^-digits."""
    whole = max(0, math.ceil(math.log10(1.0 + abs(float(ball.mid())))))
    return ball.mid().str(digits + SPARE_DIGITS + whole, radius=False)
