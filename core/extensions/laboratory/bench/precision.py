"""Work and precision: error and run time of each engine on a case at each effort, judged as in a
run; and the cost of its whole loop over the cases, as a multiple of another engine's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from statistics import median
from typing import Any

import msgspec

from ....case.case import Case, Truth
from ....case.io.reference_file import series
from ....doors import offers
from ....errors import SolveError
from ....harness.engine import Engine
from ....harness.native_engine import NativeEngine
from ....harness.record import Outcome, Record
from ....harness.run import run
from ....kinematics import Method, NativeSolver, ProgramSize
from ....kinematics.compiled import step_programs
from ....kinematics.compiled.compiled_model import compile_model
from ....kinematics.compiled.routes import Route
from ....kinematics.continuation.walk import marcher
from ....trajectory import Array, Trajectory
from ...proofs.verified_reference import prove_case
from .rounds import Spread, take_turns

# Digits of a proved reference: more than a double has.
DIGITS = 20

REQUIRED = (1e-3, 1e-6, 1e-9, 1e-12)
"""Position errors for which the table gives the least time [m]."""


class Errors(msgspec.Struct, frozen=True, kw_only=True):
    """Largest errors over all samples and all outputs in metres [m, m/s, m/s^2]; null if nothing
    was compared.
    """

    position: float | None = None
    velocity: float | None = None
    acceleration: float | None = None


class Entry(msgspec.Struct, frozen=True, kw_only=True):
    """The result of an engine for a case at one effort.

    Attributes:
        setting: the effort as text; settings: all settings of the engine.
        outcome, message: as in a run, by the tolerances of the case, which a coarse effort is
            expected to exceed.
        against: the standard of the errors.
        residual: the engine's own largest constraint residual [m or -].
        iterations: Newton iterations per sample; in simulate mode, steps.
        us_per_sample: warm time per sample [us]; null unless all samples were reached.
    """

    case: str
    engine: str
    mode: str
    loop: str
    version: str | None
    setting: str
    settings: dict[str, Any]
    outcome: Outcome
    message: str
    against: str | None
    errors: Errors
    solved: int | None
    samples: int
    residual: float | None
    iterations: float | None
    us_per_sample: Spread | None = None


class Needed(msgspec.Struct, frozen=True, kw_only=True):
    """The least time of an engine for a required error; null, with the reason, if no effort reaches
    it.

    Attributes:
        required: largest allowed position error [m].
    """

    case: str
    engine: str
    mode: str
    loop: str
    required: float
    setting: str | None
    us_per_sample: float | None
    reason: str | None = None


class FloorOf(msgspec.Struct, frozen=True, kw_only=True):
    """A simulator's floor on a case, a lower bound of its time; see `adapters.floors`."""

    case: str
    engine: str
    mode: str
    us_per_sample: float
    counted: str
    parts: dict[str, float]


@dataclass(frozen=True)
class Contestant:
    """An entry and its work: one warm solve of all samples; None if nothing can be timed."""

    entry: Entry
    work: Callable[[], Trajectory] | None

    def timed(self, seconds: Spread | None) -> Entry:
        """Return the entry with the time of its work."""
        if seconds is None:
            return self.entry
        return msgspec.structs.replace(
            self.entry, us_per_sample=seconds.times(1e6 / self.entry.samples)
        )


def with_truth(case: Case, tol: float) -> Case:
    """Return the case with a reference for its positions: its own, or a proved one.

    Raises:
        KincheckError: there is none, and proving one needs python-flint, which is missing.
    """
    if all(output.name in case.reference for output in case.outputs):
        return case
    proved, _ = prove_case(case, digits=DIGITS, numbers="double", tol=tol)
    truth = series(Path(f"{case.name} as proved"), proved, case.sweep.values, case.outputs)
    return replace(case, truth=Truth.IN_HOUSE_ORACLE, reference=truth)


def contestants(case: Case, engines: Mapping[str, Engine], tol: float) -> list[Contestant]:
    """Return each engine at several efforts, after one solve of the case; only one effort if it
    cannot solve the case.

    Args:
        case: the case with its reference.
    """
    found: list[Contestant] = []
    for setting, engine in engines.items():
        (record,) = run([case], [engine], tol=tol, residuals=False).records
        work = None if record.us_per_step is None else _work(case, engine, tol)
        found.append(Contestant(_entry(case, record, setting), work))
        if record.outcome in (Outcome.UNAVAILABLE, Outcome.UNSUPPORTED):
            break
    return found


def _work(case: Case, engine: Engine, tol: float) -> Callable[[], Trajectory]:
    model = engine.build(case)
    return lambda: engine.solve(model, case, tol)


def _entry(case: Case, record: Record, setting: str) -> Entry:
    lengths = {output.name for output in case.outputs if output.unit == "m"}
    largest: dict[str, float] = {}
    against: list[str] = []
    for name, each in record.errors.items():
        for quantity, deviation in each.items() if name in lengths else []:
            largest[quantity] = max(largest.get(quantity, 0.0), deviation.max_abs)
            against.append(deviation.against)
    return Entry(
        case=case.name,
        engine=record.engine,
        mode=record.mode,
        loop=record.loop,
        version=record.version,
        setting=setting,
        settings=record.settings,
        outcome=record.outcome,
        message=record.message,
        against=", ".join(dict.fromkeys(against)) or None,
        errors=Errors(**largest),
        solved=record.solved,
        samples=len(case.sweep.values),
        residual=record.residual_max,
        iterations=(
            None
            if record.iterations is None or not record.solved
            else record.iterations / record.solved
        ),
    )


def fastest_efforts(entries: Sequence[Entry]) -> list[Needed]:
    """Return the fastest sufficient effort of each engine for each required error, on each case."""
    found: list[Needed] = []
    for key in dict.fromkeys((e.case, e.engine, e.mode) for e in entries):
        mine = [e for e in entries if (e.case, e.engine, e.mode) == key]
        timed = [(e.us_per_sample.median, e) for e in mine if e.us_per_sample is not None]
        judged = [
            (e.errors.position, us, e.setting) for us, e in timed if e.errors.position is not None
        ]
        if judged:
            reason = f"no effort reaches it: the best error is {min(judged)[0]:.1e} m"
        elif timed:
            reason = "no position error is known"
        else:
            reason = f"{mine[0].outcome}: {mine[0].message}"
        for required in REQUIRED:
            meeting = [(us, setting) for error, us, setting in judged if error <= required]
            us, setting = min(meeting, key=lambda each: each[0], default=(None, None))
            case, engine, mode = key
            found.append(
                Needed(
                    case=case,
                    engine=engine,
                    mode=mode,
                    loop=mine[0].loop,
                    required=required,
                    setting=setting,
                    us_per_sample=us,
                    reason=None if meeting else reason,
                )
            )
    return found


def floors(case: Case, engines: Iterable[Engine]) -> list[FloorOf]:
    """Return the floors of the engines on the case."""
    found: list[FloorOf] = []
    for engine in engines:
        able = engine.version() is not None and not engine.unsupported(case)
        known = offers("floors").get(engine.name) if engine.mode == "projection" else None
        if able and known:
            floor = asdict(known.load()(engine, case))
            found.append(FloorOf(case=case.name, engine=engine.name, mode=engine.mode, **floor))
    return found


# Base of the ratios: its simulator adds the least work to its kinematics.
BASE = "pinocchio"


class LoopTime(msgspec.Struct, frozen=True, kw_only=True):
    """Time of an engine in projection mode over the cases that both it and the base solve.

    Attributes:
        base: name of the engine that the ratios refer to.
        cases: number of the cases.
        us_per_sample: warm time per sample, median over the cases [us].
        ratio, lower, upper: ratio of the time to the base's time on the same case, median and
            extremes.
    """

    engine: str
    loop: str
    base: str
    cases: int
    us_per_sample: float
    ratio: float
    lower: float
    upper: float


def measure_loops(
    cases: Iterable[Case],
    engines: Sequence[Engine],
    tol: float,
    rounds: int,
    progress: Callable[[str], object],
) -> list[LoopTime]:
    """Return the times of all engines, which take turns on each case; without Pinocchio the base is
    the first engine.

    The least time of the rounds counts, so that other processes do not affect the ratios.
    """
    able = [engine for engine in engines if engine.version() is not None]
    if not able:
        return []
    base = min(able, key=lambda engine: engine.name != BASE).name
    found: dict[str, list[tuple[float, float]]] = {engine.name: [] for engine in able}
    for case in cases:
        progress(f"{case.name}: loops of {len(able)} engines")
        work = {e.name: _work(case, e, tol) for e in able if e.unsupported(case) is None}
        if base in work:
            least = {name: each.least for name, each in take_turns(work, rounds).items()}
            for name, each in least.items():
                us = 1e6 * each / len(case.sweep.values)
                found[name].append((us, each / least[base]))
    return [
        LoopTime(
            engine=engine.name,
            loop=engine.loop,
            base=base,
            cases=len(times),
            us_per_sample=median(us for us, _ in times),
            ratio=median(ratio for _, ratio in times),
            lower=min(ratio for _, ratio in times),
            upper=max(ratio for _, ratio in times),
        )
        for engine in able
        if (times := found[engine.name])
    ]


# The native engine in detail: by requested quantities, by executor, and with or without the Python
# around its loops

EVERYTHING = "every body and point: position, velocity, acceleration"
"""The base level of the comparison."""
ALONE = f"{EVERYTHING}; loops alone"
NUMPY = f"{EVERYTHING}; numpy executor"
FORCES = f"{EVERYTHING}; all forces"


def level(
    *, order: int = 2, bodies: bool = True, compiled: bool = True, forces: bool = False
) -> NativeEngine:
    """Return the native engine with requested quantities, as one program, prepared again.

    Args:
        order: 0 for positions, 1 also velocities, 2 also accelerations.
        bodies: also solve every body in the paper's variables, instead of only the compared points.
        compiled: run machine code; else numpy.
        forces: also solve the forces of all joints, drivers and force elements.
    """
    solver = NativeSolver(order=order, compiled=compiled, method=Method.ONE_PROGRAM)
    return NativeEngine(solver, every_body=bodies, every_force=forces)


LEVELS: Mapping[str, NativeEngine] = {
    EVERYTHING: level(),
    "every body and point: position, velocity": level(order=1),
    "every body and point: position": level(order=0),
    "compared points: position, velocity, acceleration": level(bodies=False),
    "compared points: position": level(order=0, bodies=False),
    NUMPY: level(compiled=False),
    "every body and point: position; numpy executor": level(order=0, compiled=False),
}
"""Levels that are timed as a whole call, by requested quantities."""
WITH_FORCES: Mapping[str, NativeEngine] = {
    FORCES: level(forces=True),
    f"{FORCES}; numpy executor": level(forces=True, compiled=False),
}
"""Further levels for cases with masses or force elements."""


def levels(case: Case) -> Mapping[str, NativeEngine]:
    """Return the timed levels of a case."""
    return {**LEVELS, **(WITH_FORCES if case.mechanism.has_loads else {})}


def loops_alone(case: Case, tol: float) -> Callable[[], Array]:
    """Return a function that runs the executor's loops over all samples with everything requested:
    two calls from Python, without results.

    It is the native engine's floor, including tests and copying.

    Raises:
        SolveError: a step must be halved, which needs Python.
    """
    whole, path = level(), case.sweep.path
    solver = whole.solver
    request = solver.request(case.mechanism, path, case.points, whole.bodies(case))
    route = Route(compile_model(case.mechanism, request), path)
    track = marcher(route, tol, crossing=False).track

    def work() -> Array:
        kept = track.begin()
        for went, side in zip(track.run(), route.sides, strict=True):
            if went < side.count:
                raise SolveError(
                    f"mechanism {case.mechanism.name!r}: the loops alone end after {went} of"
                    f" {side.count} samples on one side"
                )
        return kept

    return work


def program_size(case: Case) -> ProgramSize:
    """Return the size of the programs with everything requested."""
    whole = level()
    return whole.solver.program_size(
        case.mechanism, case.sweep.path, case.points, whole.bodies(case)
    )


def flops_of_sample(size: ProgramSize, iterations: float, *, motions: bool = False) -> float:
    """Return the floating-point operations of a sample: predictor, Newton's iterations, rates,
    outputs and the test of a solution.

    Operations of rejected lanes, and further iterations for a neighbour's sake, do not count.

    Args:
        iterations: Newton's iterations of the sample.
        motions: lanes are motions of their own, of varied geometry, and not samples of one motion;
            the first few samples of a motion use other programs.
    """
    tests = ("extend", *step_programs.ALONE) if motions else ("extrapolate", *step_programs.JOINED)
    return iterations * size.flops["newton"] + sum(size.flops[x] for x in ("outputs", *tests))
