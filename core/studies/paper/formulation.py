"""The paper's two claims measured: fewer operations (Table 3), and less round-off. Nothing is
timed.
"""

from __future__ import annotations

import importlib.metadata
from typing import Literal

import msgspec

from ...case.case import Case
from ...harness.labels import motion_unit
from ...report.sections import Report, Section
from ...trajectory import QUANTITIES
from ...unit_text import with_unit
from . import formulation_runtime as bench_whole
from . import operations as bench_operations
from . import roundoff as bench_roundoff
from .formulation_runtime import ProgramSize, SweepError
from .operations import CONVENTIONS, Counted, Operations
from .roundoff import DIGITS, RoundOff

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
    programs, sweeps = bench_whole.measure_whole(case)
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
            "programs": bench_whole.verdict_on_programs(programs),
            "roundoff": bench_roundoff.verdict(roundoff),
            "sweeps": bench_whole.verdict_on_sweeps(sweeps),
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
