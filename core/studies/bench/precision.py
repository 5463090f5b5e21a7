"""Work and precision: error and run time of each engine on a case at each effort, judged as in a
run; and the cost of its whole loop over the cases, as a multiple of another engine's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from ...case.case import Case, Truth
from ...case.io.reference_file import series
from ...harness.engine import Engine, Measurable
from ...harness.record import Outcome, Record
from ...harness.run import run
from ...trajectory import Trajectory
from ..verified_reference import prove_case
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
    """A simulator's floor on a case; see `Floor`."""

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


def efforts_of(engine: Engine) -> Mapping[str, Engine]:
    """Return the engine at all its efforts, or alone if it has no efforts."""
    return engine.efforts() if isinstance(engine, Measurable) else {"default": engine}


def contestants(case: Case, engines: Mapping[str, Engine], tol: float) -> list[Contestant]:
    """Return each engine at several efforts, after one solve of the case; only one effort if it
    cannot solve the case.

    Args:
        case: the case with its reference.
    """
    found: list[Contestant] = []
    for setting, engine in engines.items():
        (record,) = run([case], [engine], tol=tol, residuals=False).records
        entry = _entry(case, record, setting)
        found.append(
            Contestant(entry, _work(case, engine, tol) if record.us_per_step is not None else None)
        )
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
        iterations=record.iterations / record.solved
        if record.iterations is not None and record.solved
        else None,
    )


def needed(entries: Sequence[Entry]) -> list[Needed]:
    """Return the fastest sufficient effort of each engine for each required error, on each case."""
    found: list[Needed] = []
    for key in dict.fromkeys((e.case, e.engine, e.mode) for e in entries):
        mine = [e for e in entries if (e.case, e.engine, e.mode) == key]
        for required in REQUIRED:
            found.append(_fastest(mine, required))
    return found


def _fastest(mine: Sequence[Entry], required: float) -> Needed:
    timed = [(e.us_per_sample.median, e) for e in mine if e.us_per_sample is not None]
    meeting = [
        (us, e)
        for us, e in timed
        if e.errors.position is not None and e.errors.position <= required
    ]
    first = mine[0]
    of: dict[str, Any] = {
        "case": first.case,
        "engine": first.engine,
        "mode": first.mode,
        "loop": first.loop,
        "required": required,
    }
    if meeting:
        us, best = min(meeting, key=lambda each: each[0])
        return Needed(**of, setting=best.setting, us_per_sample=us)
    errors = [e.errors.position for _, e in timed if e.errors.position is not None]
    if errors:
        reason = f"no effort reaches it: the best error is {min(errors):.1e} m"
    elif timed:
        reason = "no position error is known"
    else:
        reason = f"{first.outcome}: {first.message}"
    return Needed(**of, setting=None, us_per_sample=None, reason=reason)


def floors(case: Case, engines: Iterable[Engine]) -> list[FloorOf]:
    """Return the floors of the engines on the case."""
    found: list[FloorOf] = []
    for engine in engines:
        if (
            not isinstance(engine, Measurable)
            or engine.version() is None
            or engine.unsupported(case)
        ):
            continue
        if (floor := engine.floor(case)) is None:
            continue
        found.append(
            FloorOf(
                case=case.name,
                engine=engine.name,
                mode=engine.mode,
                us_per_sample=floor.us_per_sample,
                counted=floor.counted,
                parts=dict(floor.parts),
            )
        )
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
    names = [engine.name for engine in able]
    if not able:
        return []
    base = BASE if BASE in names else names[0]
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in names}
    for case in cases:
        progress(f"{case.name}: loops of {len(able)} engines")
        work = {e.name: _work(case, e, tol) for e in able if e.unsupported(case) is None}
        if base not in work:
            continue
        us = {
            name: 1e6 * each.least / len(case.sweep.values)
            for name, each in take_turns(work, rounds).items()
        }
        for name, each in us.items():
            found[name].append((each, each / us[base]))
    return [_summary(engine, base, found) for engine in able if found[engine.name]]


def _summary(
    engine: Engine, base: str, found: Mapping[str, Sequence[tuple[float, float]]]
) -> LoopTime:
    us, ratios = np.array(found[engine.name]).T
    return LoopTime(
        engine=engine.name,
        loop=engine.loop,
        base=base,
        cases=len(us),
        us_per_sample=float(np.median(us)),
        ratio=float(np.median(ratios)),
        lower=float(ratios.min()),
        upper=float(ratios.max()),
    )
