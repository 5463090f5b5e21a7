"""The paper's two claims measured: fewer operations (Table 3), and less round-off. Nothing is
timed.

Round-off of rows: float64 against the same equations in 50-digit arithmetic, on exactly the same
inputs. Two bodies meet the condition up to a tilt as before Newton's last iteration: no product
cancels by luck. Their velocities are admissible, of 1 m/s and 1 rad/s in size. Poses are made from
Euler parameters in either arithmetic: the rounding of A(p) counts too.
"""

from __future__ import annotations

import importlib
import importlib.metadata
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, cast

import msgspec
import numpy as np
from msgspec.structs import astuple

from ....algebra import Quat, Vec3, cross
from ....case.case import Case
from ....errors import KincheckError, SolveError
from ....harness.compare import output_series
from ....harness.labels import motion_unit
from ....joints import Kind
from ....kinematics import solve, styles
from ....mechanism.mechanism import Mechanism, Vector
from ....primitives import Pose, Twist
from ....primitives.base import map_numbers
from ....report.sections import Report, Section
from ....trajectory import QUANTITIES, Array, Trajectory
from ....unit_text import with_unit
from .operations import (
    AXES,
    CONVENTIONS,
    DOTS,
    SIMPLIFIED,
    Condition,
    Counted,
    Operations,
    conditions,
    count_operations,
    verdict,
)

DIGITS = 50
DISTANCES = (1.0, 1e3, 1e6)
TILT = 1e-6
# Arms and positions are on a grid that holds all of 1e6 m in 53 digits: sums and differences of
# them are exact, and so all ways get the same inputs, be they displacements from the design or
# positions.
GRID = 2.0**32

WAYS = {"printed": "as printed", **AXES}
"""Row style -> how it is named. As printed, (22) is summed from the left; the row styles take r_j -
r_i first.
"""


class Error(msgspec.Struct, frozen=True):
    """Largest absolute error over the entries of the rows of one state: root mean square and
    maximum over the states.
    """

    rms: float
    max: float


class RoundOff(msgspec.Struct, frozen=True):
    """Errors of one condition in one way of writing it [m, m/s^2 or 1/s^2, or -].

    Attributes:
        rows: DOTS or SIMPLIFIED, as in `Counted`.
        distance: of the bodies from the global origin [m]; null if positions do not enter.
    """

    condition: str
    rows: str
    way: str
    distance: float | None
    residual: Error
    jacobian: Error
    gamma: Error


@dataclass(frozen=True)
class Moving:
    """A body on its way: position, Euler parameters, velocity and angular velocity, global axes;
    lanes of states.
    """

    u: Vec3
    q: Quat
    v: Vec3
    w: Vec3

    def motion(self, body_axes: bool) -> Twist:
        """The velocities in the order of the rows' columns."""
        return (
            Twist(self.v, Pose.of(self.u, self.q).A.T @ self.w)
            if body_axes
            else Twist(self.v, self.w)
        )


@dataclass(frozen=True)
class States:
    """Random joints between two bodies on their way; lanes of them.

    Attributes:
        e0: from the origin of body i to the origin of body j at design, with P_i at P_j.
    """

    conditions: tuple[Condition, ...]
    i: Moving
    j: Moving
    e0: Vec3


def measure_roundoff(seed: int, states: int) -> list[RoundOff]:
    """Return the errors of the conditions of Table 3 in all ways, over random states.

    Raises:
        KincheckError: mpmath is not installed.
    """
    try:
        mpmath: Any = importlib.import_module("mpmath")
    except ImportError:
        raise KincheckError(
            "bench formulation: mpmath is not installed, expected for the 50-digit arithmetic; pip"
            " install mpmath"
        ) from None
    found: list[RoundOff] = []
    with mpmath.workdps(DIGITS):
        for number, name in enumerate(("d10", "d11", "d12", "d20", "d21")):
            for distance in DISTANCES if name in ("d20", "d21") else DISTANCES[:1]:
                known = _states(
                    np.random.default_rng(seed), states, distance, turning=name in ("d10", "d11")
                )
                for rows, style, equations in _ways_to_write(known.conditions[number]):
                    j = replace(known.j, u=known.e0 + known.j.u) if style == "printed" else known.j
                    axes = style != "native"
                    errors = _errors_of(equations, known.i, j, mpmath.mpf, body_axes=axes)
                    far = distance if name in ("d20", "d21") else None
                    found.append(RoundOff(name, rows, WAYS[style], far, *errors))
    return found


def _ways_to_write(condition: Condition) -> Iterator[tuple[str, str, Sequence[Any]]]:
    """Return rows, style and equations of all ways to write a condition."""
    yield DOTS, "printed", condition.printed_rows(formed=True)
    for style in ("conventional", "paper", "native"):
        yield DOTS, style, condition.unsimplified_rows(style)
    for style in ("paper", "native") if condition.is_simplified else ():
        yield SIMPLIFIED, style, condition.simplified_rows(style)


def _errors_of(
    equations: Sequence[Any],
    i: Moving,
    j: Moving,
    exact: Callable[[Any], Any],
    *,
    body_axes: bool,
) -> list[Error]:
    """Return the errors of residual, Jacobian and gamma."""
    to_exact = cast("Callable[[Any], Any]", np.frompyfunc(exact, 1, 1))
    motions = [each.motion(body_axes) for each in (i, j)]
    rounded = _values(equations, (i, j), motions)
    exactly = _values(*(map_numbers(each, to_exact) for each in (list(equations), [i, j], motions)))
    found: list[Error] = []
    for values, true in zip(rounded, exactly, strict=True):
        off = [abs(to_exact(a) - b) for a, b in zip(values, true, strict=True)]
        lanes = [np.broadcast_to(np.asarray(each, dtype=np.float64), i.u.x.shape) for each in off]
        worst: Array = np.max(lanes, axis=0)
        found.append(Error(float(np.sqrt(np.mean(worst**2))), float(worst.max())))
    return found


def _values(
    equations: Sequence[Any], bodies: Sequence[Moving], motions: Sequence[Twist]
) -> tuple[list[Any], ...]:
    """Return residuals, entries of the Jacobian and right-hand sides."""
    pair = [Pose.of(body.u, body.q) for body in bodies]
    return (
        [x for each in equations for x in each.phi(*pair)],
        [x for each in equations for row in each.rows(*pair) for block in row for x in block],
        [x for each in equations for x in each.gamma(*pair, *motions)],
    )


def _states(rng: np.random.Generator, n: int, distance: float, *, turning: bool) -> States:
    """Return states in which one body turns about the other's h, or slides along it."""

    def vector() -> Vec3:
        return Vec3(*rng.normal(size=(3, n)))

    def unit(a: Vec3) -> Vec3:
        return (1.0 / np.sqrt(a @ a)) * a

    def rotation(axis: Vec3, angle: Array | float) -> Quat:
        return Quat(np.cos(0.5 * angle), np.sin(0.5 * angle) * axis)

    def snap_to_grid(a: Vec3) -> Vec3:
        return Vec3(*(np.round(x * GRID) / GRID for x in a))

    h = unit(vector())
    f = unit(cross(vector(), h))
    s_i, s_j = snap_to_grid(vector()), snap_to_grid(vector())
    u, q = (
        snap_to_grid(distance * unit(vector())),
        rotation(unit(vector()), rng.uniform(-np.pi, np.pi, n)),
    )
    i = Moving(u, q, vector(), vector())
    angle, slide, rate, tilt = (
        rng.uniform(-np.pi, np.pi, n),
        rng.normal(size=n),
        rng.normal(size=n),
        unit(vector()),
    )
    turn = Pose.of(i.u, i.q).turn
    e0, axis, w, tilted = s_i - s_j, turn(h), i.w + TILT * tilt, rotation(tilt, TILT) * i.q
    if turning:
        j = Moving(i.u, tilted * rotation(h, angle), i.v, w + rate * axis)
    else:
        e = turn(e0) + slide * axis
        j = Moving(snap_to_grid(i.u + e - e0), tilted, i.v + cross(i.w, e) + rate * axis, w)
    return States(conditions(f, cross(h, f), h, s_i, s_j), i, j, e0)


def verdict_on_roundoff(errors: Iterable[RoundOff]) -> list[str]:
    """Return the conclusions from the errors; each figure in it is an error or a ratio of two."""
    by = {(each.condition, each.rows, each.way, each.distance): each for each in errors}
    near = (("d11", None), ("d21", DISTANCES[0]))

    def gain(name: str, at: float | None, quantity: str, dots: str, simplified: str) -> float:
        rough, simple = (
            by[name, *key, at] for key in ((DOTS, WAYS[dots]), (SIMPLIFIED, WAYS[simplified]))
        )
        return getattr(rough, quantity).rms / getattr(simple, quantity).rms

    def gains(dots: str, simplified: str) -> str:
        return ", ".join(
            f"{name} {gain(name, at, 'gamma', dots, simplified):.1f}" for name, at in near
        )

    others = [
        gain(name, at, quantity, "printed", "paper")
        for name, at in near
        for quantity in ("residual", "jacobian")
    ]
    last, first = (
        [by["d20", DOTS, WAYS[way], at].residual.rms for at in DISTANCES]
        for way in ("printed", "conventional")
    )
    return [
        (
            f"rms error of gamma, dot products over simplified rows: {gains('printed', 'paper')} as"
            f" printed over the paper's; by vector products {gains('paper', 'paper')} in paper's"
            f" axes, {gains('native', 'native')} in native axes. Of residual and Jacobian, as"
            f" printed over the paper's: {min(others):.1f} to {max(others):.1f}."
        ),
        (
            "(22) as printed, positions summed one by one, loses digits with the distance:"
            f" {_by_distance(last)} m. With r_j - r_i first: {_by_distance(first)} m, unsimplified."
            " The order of the sum keeps the digits, not the simplification."
        ),
    ]


def _by_distance(values: Sequence[float]) -> str:
    return ", ".join(
        f"{value:.0e} at {distance:.0e}" for value, distance in zip(values, DISTANCES, strict=True)
    )


# The whole mechanism

FAR: Vector = (0.6e6, -0.7e6, 0.39e6)
AT_DESIGN, AWAY, BACK, DIFFERENCE = (
    "as designed",
    "1e6 m away",
    "moved back from there",
    "away less moved back",
)


class ProgramSize(msgspec.Struct, frozen=True):
    """Floating-point operations of a mechanism's programs: an iteration of Newton's, and rates with
    accelerations.
    """

    style: str
    newton: int
    motion: int


class SweepError(msgspec.Struct, frozen=True):
    """Largest error of the outputs over a sweep [m, m/s, m/s^2]; DIFFERENCE: between the sweeps
    away and back.
    """

    style: str
    place: str
    position: float
    velocity: float
    acceleration: float


def measure_whole(case: Case) -> tuple[list[ProgramSize], list[SweepError]]:
    """Return the program sizes of a case's mechanism and the errors of its sweep.

    Raises:
        SolveError: a sweep does not reach all its samples.
    """
    away = _shift_mechanism(case.mechanism, FAR)
    # exact: what was lost in going there stays lost
    back = _shift_mechanism(away, (-FAR[0], -FAR[1], -FAR[2]))
    places = {AT_DESIGN: case.mechanism, AWAY: away, BACK: back}
    programs: list[ProgramSize] = []
    sweeps: list[SweepError] = []
    for style in styles():
        found = {place: _solve_sweep(case, mechanism, style) for place, mechanism in places.items()}
        # where positions alone are asked for, rates are a program of their own: it is run where the
        # motion begins
        size = solve(
            case.mechanism,
            case.sweep.driver,
            [case.mechanism.design_value(case.sweep.driver)],
            order=0,
            style=style,
        ).details["program"]
        programs.append(ProgramSize(style, size["newton"]["flops"], size["tangent"]["flops"]))
        outputs = {
            place: _outputs(replace(case, mechanism=places[place]), each)
            for place, each in found.items()
        }
        reference = np.array(
            [
                [getattr(case.reference[output.name], name) for name in QUANTITIES]
                for output in case.outputs
            ]
        )
        errors = {place: found - reference for place, found in outputs.items()}
        errors[DIFFERENCE] = outputs[AWAY] - outputs[BACK]
        for place, each in errors.items():
            largest = np.abs(each).max(axis=(0, 2)).tolist()
            sweeps.append(SweepError(style, place, *largest))
    return programs, sweeps


def _solve_sweep(case: Case, mechanism: Mechanism, style: str) -> Trajectory:
    sweep = case.sweep
    values = sweep.change + mechanism.design_value(sweep.driver)
    found = solve(mechanism, sweep.driver, values, rate=sweep.rate, points=case.points, style=style)
    if not found.solved.all():
        raise SolveError(
            f"bench formulation: case {case.name!r}, style {style!r}: {found.message}. Choose a"
            " sweep it can finish."
        )
    return found


def _outputs(case: Case, found: Trajectory) -> Array:
    """Return position, velocity and acceleration of all outputs, shape (outputs, 3, samples)."""
    series = [output_series(case, output, found) for output in case.outputs]
    return np.array([[getattr(each, name) for name in QUANTITIES] for each in series])


def _shift_mechanism(mechanism: Mechanism, by: Vector) -> Mechanism:
    """Return the mechanism elsewhere: all points, origins and loads shifted."""

    def shift(point: Sequence[float]) -> Vector:
        x, y, z = (a + b for a, b in zip(point, by, strict=True))
        return x, y, z

    return mechanism.with_joints(
        lambda joint: replace(joint, **joint.mapped({Kind.POSITION: shift})),
        bodies=[body.in_frame(shift) for body in mechanism.bodies],
        points=[replace(point, position=shift(point.position)) for point in mechanism.points],
        forces=[force.in_frame(shift) for force in mechanism.forces],
    )


def verdict_on_programs(programs: Iterable[ProgramSize]) -> list[str]:
    """Return the conclusions from the sizes."""
    by = {each.style: each.newton for each in programs}
    full, paper, native = (by[style] for style in ("conventional", "paper", "native"))
    return [
        (
            f"One Newton iteration, elimination included: {full} operations conventional, {paper}"
            f" with the paper's rows ({full / paper:.1f} times fewer), {native} with the native"
            f" ones ({paper / native:.1f} times fewer again): in global axes their blocks are"
            " constants, which the elimination makes use of."
        ),
        (
            "All are traced alike: no grounded bodies, nothing twice, no arm where a body's origin"
            " is its joint. Rows alone differ."
        ),
    ]


def verdict_on_sweeps(sweeps: Iterable[SweepError]) -> list[str]:
    """Return the conclusions from the errors."""
    sweeps = list(sweeps)

    def errors(place: str, pick: Callable[[Iterable[float]], float] = max) -> str:
        values = (
            pick(getattr(each, name) for each in sweeps if each.place == place)
            for name in QUANTITIES
        )
        return ", ".join(
            f"{each:.1e} {motion_unit('m', name)}"
            for each, name in zip(values, QUANTITIES, strict=True)
        )

    return [
        (
            f"Errors of the best row style: {errors(AT_DESIGN, min)}; of the worst:"
            f" {errors(AT_DESIGN)}."
        ),
        (
            f"1e6 m away, at worst: {errors(AWAY)}; with the points as rounded there, moved back:"
            f" {errors(BACK)}; between the two: {errors(DIFFERENCE)}. Rounding the points, and"
            " positions on output, costs the digits; the rows do not see the distance."
        ),
    ]


NAME = "bench_formulation"
STATES = 250
"""Random states by default: a rms over as many is settled to a tenth."""
MEASURED = ("residual", "jacobian", "gamma")
STAGES = ("J", "velocity", "acceleration", "gamma")


class Formulation(msgspec.Struct, frozen=True, kw_only=True):
    """The results of this benchmark.

    Attributes:
        states: random states of each round-off figure.
        digits: of the arithmetic compared with float64.
        case: the case whose mechanism is solved in every row style.
        verdicts: conclusions from the figures, by section.
    """

    schema: Literal["kincheck-bench-formulation/1"] = "kincheck-bench-formulation/1"
    versions: dict[str, str]
    seed: int
    states: int
    digits: int
    case: str
    conventions: tuple[str, ...]
    operations: list[Counted]
    programs: list[ProgramSize]
    roundoff: list[RoundOff]
    sweeps: list[SweepError]
    verdicts: dict[str, list[str]]


def measure(case: Case, seed: int, states: int) -> Formulation:
    """Count operations, measure round-off and sweep the case in every row style.

    Args:
        case: has a reference for all its outputs, velocities and accelerations included.
        seed: of the random states.
        states: number of random states.

    Raises:
        KincheckError: mpmath is not installed, or a sweep does not reach all its samples.
    """
    roundoff = measure_roundoff(seed, states)
    operations = count_operations()
    programs, sweeps = measure_whole(case)
    return Formulation(
        versions={
            name: importlib.metadata.version(name) for name in ("kincheck", "numpy", "mpmath")
        },
        seed=seed,
        states=states,
        digits=DIGITS,
        case=case.name,
        conventions=CONVENTIONS,
        operations=operations,
        programs=programs,
        roundoff=roundoff,
        sweeps=sweeps,
        verdicts={
            "operations": verdict(operations),
            "programs": verdict_on_programs(programs),
            "roundoff": verdict_on_roundoff(roundoff),
            "sweeps": verdict_on_sweeps(sweeps),
        },
    )


def report(found: Formulation) -> Report:
    """Return the results as text and tables."""
    facts = [f"{name} {version}" for name, version in found.versions.items()]
    facts += [
        f"seed {found.seed}",
        f"{found.states} states",
        f"{found.digits} digits",
        f"case {found.case}",
    ]
    sections = [
        Section(
            "Operations of Table 3",
            found.verdicts["operations"],
            found.conventions,
            ("", "rows", "way", *STAGES, *(f"{stage}\nunit axes" for stage in STAGES)),
            3,
            [
                (c.condition, c.rows, c.way, *_counts(c.general_axes), *_counts(c.unit_axes))
                for c in found.operations
            ],
        ),
        Section(
            "Operations of the whole mechanism",
            found.verdicts["programs"],
            (
                (
                    "Floating-point operations of the traced programs for one sample; signs,"
                    " comparisons and roots included."
                ),
            ),
            ("row style", "Newton iteration", "velocities and accelerations"),
            1,
            [[*map(str, astuple(each))] for each in found.programs],
        ),
        Section(
            "Round-off of rows",
            found.verdicts["roundoff"],
            (
                (
                    f"Absolute error of float64 against {found.digits} digits: same equations, same"
                    " inputs, from Euler parameters on. Largest entry of the rows in each of"
                    f" {found.states} random states; root mean square and maximum over these. Arms,"
                    " velocities and rates are near one [m, m/s, rad/s]; dot products as printed"
                    " are multiplied out."
                ),
            ),
            (
                "",
                "rows",
                "way",
                "|r| [m]",
                *(f"{name}\n{kind}" for name in MEASURED for kind in ("rms", "max")),
            ),
            4,
            [
                (
                    e.condition,
                    e.rows,
                    e.way,
                    "–" if e.distance is None else f"{e.distance:.0e}",
                    *(
                        f"{x:.1e}"
                        for each in (e.residual, e.jacobian, e.gamma)
                        for x in astuple(each)
                    ),
                )
                for e in found.roundoff
            ],
        ),
        Section(
            "Errors of the whole sweep",
            found.verdicts["sweeps"],
            ("Largest error over outputs and samples, against the reference of the case.",),
            (
                "row style",
                "place",
                *(with_unit(name, motion_unit("m", name)) for name in QUANTITIES),
            ),
            2,
            [(s.style, s.place, *(f"{x:.1e}" for x in astuple(s)[2:])) for s in found.sweeps],
        ),
    ]
    return Report(NAME, "Operation counts and round-off of SAE 943745, measured", facts, sections)


def _counts(found: Operations | None) -> list[str]:
    if found is None:
        return ["–"] * len(STAGES)
    return ["–" if count is None else str(count) for count in astuple(found)]
