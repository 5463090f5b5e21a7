"""The engine benchmark: run time against error, and other influences on time and memory."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping, Sequence
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from typing import Any, Literal

import msgspec

from ....case.case import Case, without_forces
from ....errors import KincheckError, number_of
from ....extras import THREADS
from ....harness.engine import Engine, Measurable
from ....harness.labels import product
from ....harness.native_engine import NativeEngine
from ....harness.provenance import circumstances
from ....program.executor import compiled_at_once, compiler
from ....report.figures import Effort
from ..paper.formulation import Formulation
from .designs import Batch, StudyRate, measure_batches, measure_studies
from .precision import (
    ALONE,
    EVERYTHING,
    Contestant,
    Entry,
    FloorOf,
    LoopTime,
    Needed,
    contestants,
    fastest_efforts,
    floors,
    flops_of_sample,
    levels,
    loops_alone,
    measure_loops,
    program_size,
    with_truth,
)
from .processes import Process, measure_processes
from .rounds import Peak, Spread, Work, prepare, take_turns
from .size import Scaling, Size, measure_scalings, measure_sizes

NAME = "bench"
PARTS = ("work", "loop", "batch", "study", "size", "processes")
"""Parts of the benchmark: work against precision, whole loops by engine, cost of batches and of a
study, cost against mechanism size, first use and memory.
"""

# Sizes of chain and ring as one sparse system. A round takes seconds: interruptions hardly matter.
LARGE, LARGE_ROUNDS = (100, 1000), 3


class Rate(msgspec.Struct, frozen=True, kw_only=True):
    """Rate of arithmetic operations.

    Attributes:
        us_per_sample: median time [us]; null for the peak.
        flops_per_sample: operations of the programs for an accepted sample.
        gflops: operations per nanosecond; of_peak: fraction of the peak in the same rounds.
    """

    case: str
    what: str
    us_per_sample: float | None
    flops_per_sample: float | None
    gflops: float
    of_peak: float


class Bench(msgspec.Struct, frozen=True, kw_only=True):
    """The results of this benchmark; a part not requested is empty.

    Attributes:
        run: circumstances; load: load of the machine over the last minute, before and after.
        vector_width: number of doubles in a vector of compiled code; null without a compiler.
        entries: each engine at each effort, on each case; levels: the native engine in detail.
    """

    schema: Literal["kincheck-bench/1"] = "kincheck-bench/1"
    run: dict[str, Any]
    rounds: int
    vector_width: int | None
    entries: list[Entry] = []
    needed: list[Needed] = []
    floors: list[FloorOf] = []
    levels: list[Entry] = []
    rates: list[Rate] = []
    loops: list[LoopTime] = []
    batches: list[Batch] = []
    studies: list[StudyRate] = []
    sizes: list[Size] = []
    scalings: list[Scaling] = []
    processes: list[Process] = []
    formulation: Formulation | None = None


@compiled_at_once()
def measure(
    cases: Mapping[str, Case],
    engines: Sequence[Engine],
    *,
    tol: float,
    rounds: int,
    parts: Collection[str],
    command: str,
    progress: Callable[[str, float], object],
) -> Bench:
    """Measure the requested parts; batches, studies and processes use only the first case.

    Args:
        cases: cases by their names on the command line; at least one.
        engines: engines of both modes.
        tol: largest accepted constraint residual, as for `Engine.solve`.
        progress: called with the name of each measurement and the finished share, from 0 to 1.

    Raises:
        KincheckError: a case has no reference, and none can be proved.
    """
    started, before = datetime.now(UTC), _load()
    peak = prepare() if compiler() else None
    found: dict[str, Any] = {}
    true = {name: with_truth(without_forces(case), tol) for name, case in cases.items()}
    native = any(isinstance(engine, NativeEngine) for engine in engines)
    several = {"work": 2 * len(true), "loop": len(true), "size": 2 if native else 1}
    steps, numbers = sum(several.get(part, 1) for part in parts), count()

    def begin(what: str) -> Callable[[float], object]:
        number = next(numbers)
        progress(what, number / steps)
        return lambda done: progress(what, (number + done) / steps)

    if "work" in parts:
        for case in true.values():
            for what, rows in _measure_work(case, engines, tol, rounds, peak, begin).items():
                found.setdefault(what, []).extend(rows)
    name, first = next(iter(true.items()))
    projections = [each for each in engines if each.mode == "projection"]
    if "loop" in parts:
        found["loops"] = measure_loops(true.values(), projections, tol, rounds, begin)
    if "batch" in parts:
        begin(f"{first.name}: batches of variants")
        found["batches"] = measure_batches(first, tol, rounds, peak)
    if "study" in parts:
        begin(f"{first.name}: a study by threads")
        found["studies"] = measure_studies(first, tol, rounds, peak)
    if "size" in parts:
        begin("chains and rings of loops")
        found["sizes"] = measure_sizes(projections, tol, rounds)
        if native:
            begin("large mechanisms")
            found["scalings"] = measure_scalings(LARGE, tol, min(rounds, LARGE_ROUNDS))
    if "processes" in parts:
        begin(f"{first.name}: separate processes")
        # variants of a simulator need the same memory
        names = {engine.name for engine in projections}
        own = [engine for engine in engines if engine.name in names]
        found["processes"] = measure_processes(first, name, own, tol, rounds)
    run = circumstances([*true.values()], started=started, tol=tol, command=command)
    run |= {
        "cores": os.cpu_count(),
        "load_before": before,
        "load_after": _load(),
        "linear_algebra_threads": os.environ.get(THREADS[0], "not limited"),
    }
    return Bench(run=run, rounds=rounds, vector_width=peak and peak.width, **found)


def _measure_work(
    case: Case,
    engines: Sequence[Engine],
    tol: float,
    rounds: int,
    peak: Peak | None,
    begin: Callable[[str], Callable[[float], object]],
) -> dict[str, Sequence[Any]]:
    """Measure work and precision of a case, its floors, and the native engine in detail, all in the
    same rounds; return the rows by the attributes of `Bench`.
    """
    entering: dict[tuple[str, str], Contestant] = {}
    for engine in engines:
        efforts = engine.efforts() if isinstance(engine, Measurable) else {"default": engine}
        for each in contestants(case, efforts, tol):
            entering[f"{engine.name} {engine.mode}", each.entry.setting] = each
    detailed = any(isinstance(engine, NativeEngine) for engine in engines)
    if detailed:
        for each in contestants(case, levels(case), tol):
            entering["levels", each.entry.setting] = each
    work: dict[tuple[str, str], Work] = {
        key: each.work for key, each in entering.items() if each.work is not None
    }
    if detailed and compiler():
        work["levels", ALONE] = loops_alone(case, tol)
    if peak is not None:
        work["peak", ""] = peak
    told = begin(f"{case.name}: {number_of(len(work), 'contestant')}, {number_of(rounds, 'round')}")
    seconds = take_turns(work, rounds, told)
    timed = {key: each.timed(seconds.get(key)) for key, each in entering.items()}
    entries = [entry for (kind, _), entry in timed.items() if kind != "levels"]
    native = {setting: entry for (kind, setting), entry in timed.items() if kind == "levels"}
    if ("levels", ALONE) in seconds:
        whole = native[EVERYTHING]
        alone = seconds["levels", ALONE].times(1e6 / whole.samples)
        native[ALONE] = msgspec.structs.replace(whole, setting=ALONE, us_per_sample=alone)
    begin(f"{case.name}: floors")
    return {
        "entries": entries,
        "needed": fastest_efforts(entries),
        "levels": [*native.values()],
        "floors": floors(case, engines),
        "rates": [] if peak is None else _rates(case, native, peak, seconds["peak", ""]),
    }


def _rates(case: Case, native: Mapping[str, Entry], peak: Peak, seconds: Spread) -> list[Rate]:
    most = 1e-9 * peak.rate(seconds)
    vectors = f"vectors of {peak.width} doubles"
    found: list[tuple[str, float | None, float | None, float]] = [
        (f"peak of one core: multiply and add, {vectors}", None, None, most)
    ]
    for setting in (EVERYTHING, ALONE):
        entry = native.get(setting)
        if entry is not None and entry.us_per_sample is not None:
            flops = flops_of_sample(program_size(case), entry.iterations or 0.0)
            us = entry.us_per_sample.median
            found.append((f"one sweep, {setting}", us, flops, 1e-3 * flops / us))
    return [
        Rate(
            case=case.name,
            what=what,
            us_per_sample=us,
            flops_per_sample=flops,
            gflops=gflops,
            of_peak=gflops / most,
        )
        for what, us, flops, gflops in found
    ]


def _load() -> float | None:
    """Return the number of runnable processes over the last minute; None if it is unknown."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


def efforts_in(file: Path) -> dict[str, list[Effort]]:
    """Return the diagram data from a file of this benchmark: error and time of each engine's
    efforts, by case.

    Raises:
        KincheckError: the file cannot be read, or holds no results of this benchmark.
    """
    try:
        found = msgspec.json.decode(file.read_bytes(), type=Bench)
    except (OSError, msgspec.DecodeError) as error:
        raise KincheckError(
            f"--bench {file}: {error}; give a bench.json written by kincheck bench"
        ) from None
    efforts: dict[str, list[Effort]] = {}
    for entry in found.entries:
        efforts.setdefault(entry.case, []).extend(effort(entry))
    return efforts


def effort(entry: Entry) -> list[Effort]:
    """Return the entry's point in a diagram of error against time; empty without a time or an
    error.
    """
    if entry.us_per_sample is None or entry.errors.position is None:
        return []
    name, us = product(entry.engine, entry.mode), entry.us_per_sample.median
    return [Effort(name, entry.setting, entry.errors.position, us, entry.mode)]
