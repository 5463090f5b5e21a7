"""The paper's two claims measured: fewer operations (Table 3), and less round-off. Nothing is
timed.
"""

from __future__ import annotations

import importlib.metadata
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Literal

import msgspec
import numpy as np

from ...case.case import Case
from ...errors import SolveError
from ...harness.compare import output_series
from ...harness.labels import motion_unit
from ...joints import Kind
from ...kinematics import Style, solve
from ...mechanism.mechanism import Mechanism, Vector
from ...report.sections import Report, Section
from ...trajectory import QUANTITIES, Array, Trajectory
from ...unit_text import with_unit
from . import operations as bench_operations
from . import roundoff as bench_roundoff
from .operations import CONVENTIONS, Counted, Operations
from .roundoff import DIGITS, RoundOff

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
    away = _moved(case.mechanism, FAR)
    # exact: what was lost in going there stays lost
    back = _moved(away, (-FAR[0], -FAR[1], -FAR[2]))
    places = {AT_DESIGN: case.mechanism, AWAY: away, BACK: back}
    programs: list[ProgramSize] = []
    sweeps: list[SweepError] = []
    for style in Style:
        found = {place: _swept(case, mechanism, style) for place, mechanism in places.items()}
        # where positions alone are asked for, rates are a program of their own: it is run where the
        # motion begins
        size = solve(
            case.mechanism,
            case.sweep.driver,
            [case.mechanism.design_value(case.sweep.driver)],
            order=0,
            style=style,
        ).details["program"]
        programs.append(ProgramSize(style.value, size["newton"]["flops"], size["tangent"]["flops"]))
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
        for place in places:
            sweeps.append(SweepError(style.value, place, *_largest(outputs[place] - reference)))
        sweeps.append(SweepError(style.value, DIFFERENCE, *_largest(outputs[AWAY] - outputs[BACK])))
    return programs, sweeps


def _swept(case: Case, mechanism: Mechanism, style: str) -> Trajectory:
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


def _largest(differences: Array) -> list[float]:
    return [float(each) for each in np.abs(differences).max(axis=(0, 2))]


def _moved(mechanism: Mechanism, by: Vector) -> Mechanism:
    """Return the mechanism elsewhere: all points, origins and loads shifted."""

    def shifted(point: Sequence[float]) -> Vector:
        x, y, z = (a + b for a, b in zip(point, by, strict=True))
        return x, y, z

    return mechanism.with_joints(
        lambda joint: replace(joint, **joint.mapped({Kind.POSITION: shifted})),
        bodies=[body.in_frame(shifted) for body in mechanism.bodies],
        points=[replace(point, position=shifted(point.position)) for point in mechanism.points],
        forces=[force.in_frame(shifted) for force in mechanism.forces],
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
    roundoff = bench_roundoff.measure_roundoff(seed, states)
    operations = bench_operations.count_operations()
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
            "operations": bench_operations.verdict(operations),
            "programs": verdict_on_programs(programs),
            "roundoff": bench_roundoff.verdict(roundoff),
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
            [(each.style, str(each.newton), str(each.motion)) for each in found.programs],
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
                    *_errors(e),
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
            [
                (s.style, s.place, *(f"{getattr(s, name):.1e}" for name in QUANTITIES))
                for s in found.sweeps
            ],
        ),
    ]
    return Report(NAME, "Operation counts and round-off of SAE 943745, measured", facts, sections)


def _counts(found: Operations | None) -> list[str]:
    if found is None:
        return ["–"] * len(STAGES)
    counts = (found.jacobian, found.velocity, found.acceleration, found.gamma)
    return ["–" if count is None else str(count) for count in counts]


def _errors(found: RoundOff) -> list[str]:
    return [
        f"{value:.1e}"
        for each in (found.residual, found.jacobian, found.gamma)
        for value in (each.rms, each.max)
    ]
