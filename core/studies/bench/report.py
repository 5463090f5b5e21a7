"""The report of the engine benchmark: tables, conclusions, diagrams. Modes never share a table."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import number_of
from ...harness.labels import against, motion_unit, number
from ...harness.standard import STANDARD
from ...report.sections import Report, Section
from ...trajectory import QUANTITIES
from ...unit_text import with_unit
from ..paper.formulation import report as formulation_report
from . import native_breakdown
from .diagrams import batch_diagram, entries_of, precision_diagram, size_diagram, stage_diagram
from .engines import NAME, Bench
from .precision import REQUIRED, Entry, Needed
from .processes import STAGES
from .rounds import Spread
from .size import exponent, growth

LOOPS_RUN = {
    "python": "in Python, around calls into the simulator",
    "simulator": "inside the simulator",
    "compiled": "in machine code",
}
"""Phrases for the place of the loop over samples and iterations."""


def report(found: Bench) -> Report:
    """Return the results as a report."""
    run = found.run
    facts = [
        f"kincheck {run['kincheck']}, numpy {run['numpy']}, Python {run['python']}",
        f"{run['processor']}, {run['cores']} processors",
        (
            f"vectors of {found.vector_width} doubles"
            if found.vector_width
            else "no compiler: numpy executor"
        ),
        f"load {number(run['load_before'])} before, {number(run['load_after'])} after",
        f"linear algebra threads: {run['linear_algebra_threads']}",
        number_of(found.rounds, "round"),
    ]
    sections: list[Section] = []
    for case, mode, entries in entries_of(found):
        sections += [_precision(found, case, mode, entries), _needed(found, case, mode)]
        sections += (
            [_floors(found, case)]
            if mode == "projection" and any(each.case == case for each in found.floors)
            else []
        )
    for case in dict.fromkeys(entry.case for entry in found.levels):
        sections.append(_levels(found, case))
    sections += [_rates(found)] if found.rates else []
    sections += [_loops(found)] if found.loops else []
    sections += [_batches(found)] if found.batches else []
    sections += [_studies(found)] if found.studies else []
    sections += [
        _sizes(found, family) for family in dict.fromkeys(each.mechanism for each in found.sizes)
    ]
    sections += [_scalings(found)] if found.scalings else []
    sections += [_processes(found)] if found.processes else []
    sections += formulation_report(found.formulation).sections if found.formulation else []
    return Report(NAME, "Run time against error, measured", facts, sections)


def _precision(found: Bench, case: str, mode: str, entries: Sequence[Entry]) -> Section:
    rows = [
        (
            entry.engine,
            entry.setting,
            entry.loop,
            str(entry.outcome),
            *(number(getattr(entry.errors, name)) for name in QUANTITIES),
            number(entry.iterations),
            *_cells(entry.us_per_sample),
        )
        for entry in entries
    ]
    truths = [entry.against.split(", ") for entry in entries if entry.against]
    sentences = [
        (
            f"Errors are against: {', '.join(map(against, truths[0]))}."
            if truths
            else "No reference was available."
        )
    ]
    sentences += [
        f"{loop}:"
        f" {', '.join(dict.fromkeys(entry.engine for entry in entries if entry.loop == loop))}: the"
        f" loop runs {words}."
        for loop, words in LOOPS_RUN.items()
        if any(entry.loop == loop for entry in entries)
    ]
    sentences += [
        f"{each.engine}: {each.outcome}: {each.message}" for each in entries if each.solved is None
    ]
    counted = "iterations" if mode == "projection" else "steps"
    headings = (
        "engine",
        "effort",
        "loop",
        "outcome",
        *(with_unit(name, motion_unit("m", name)).replace(" [", "\n[") for name in QUANTITIES),
        f"{counted}\na sample",
    )
    diagrams = (
        [precision_diagram(found, case, mode)]
        if any(entry.us_per_sample for entry in entries)
        else []
    )
    return Section(
        f"{case}, {mode}: work and precision",
        sentences,
        (TIMED,),
        (*headings, "µs", "quartiles"),
        4,
        rows,
        diagrams,
    )


def _needed(found: Bench, case: str, mode: str) -> Section:
    mine = [each for each in found.needed if (each.case, each.mode) == (case, mode)]
    rows: list[tuple[str, ...]] = []
    for engine in dict.fromkeys(each.engine for each in mine):
        here = [each for each in mine if each.engine == engine]
        rows.append((engine, here[0].loop, *(_time_needed(each) for each in here)))
    notes = (
        (
            "Time per sample [µs] of the fastest effort that reaches all samples within this"
            " position error, and that effort."
        ),
    )
    headings = ("engine", "loop", *(f"{required:g} m" for required in REQUIRED))
    sentences = _faster(mine) if mode == "projection" else []
    return Section(f"{case}, {mode}: time at a required error", sentences, notes, headings, 2, rows)


def _time_needed(each: Needed) -> str:
    return (
        "none" if each.us_per_sample is None else f"{number(each.us_per_sample)} · {each.setting}"
    )


def _faster(mine: Sequence[Needed]) -> list[str]:
    """Compare the native engine with the fastest other engine at each error, in sentences."""
    sentences: list[str] = []
    for required in REQUIRED:
        times = {
            each.engine: each.us_per_sample
            for each in mine
            if each.required == required and each.us_per_sample is not None
        }
        ours = times.pop(STANDARD, None)
        if ours is None or not times:
            continue
        best = min(times, key=lambda name: times[name])
        sentences.append(
            f"At {required:g} m the native engine is {times[best] / ours:.0f} times as fast as the"
            f" fastest other, {best}."
        )
    return sentences


def _floors(found: Bench, case: str) -> Section:
    rows: list[tuple[str, ...]] = []
    sentences: list[str] = []
    alone = _level(found, case, native_breakdown.ALONE)
    for floor in (each for each in found.floors if each.case == case):
        times = [
            e.us_per_sample.median
            for e in found.entries
            if (e.case, e.engine, e.mode) == (case, floor.engine, floor.mode) and e.us_per_sample
        ]
        beside = times[-1] if times else None
        ratio = None if alone is None else floor.us_per_sample / alone
        rows.append((floor.engine, number(beside), number(floor.us_per_sample), number(ratio)))
        sentences.append(f"{floor.counted}.")
    notes = (
        (
            "A floor is the time of the simulator's compiled code alone, for a sample at its finest"
            " effort: a lower bound for any loop around it, in any language. The adapter's time"
            " includes a loop in Python. The last column is the floor over the time that the native"
            f" loops alone take{'' if alone is None else f', {number(alone)} µs'}, all bodies and"
            " tests included."
        ),
    )
    return Section(
        f"{case}: floors",
        sentences,
        notes,
        ("engine", "adapter [µs]", "floor [µs]", "floor / native loops"),
        1,
        rows,
    )


def _level(found: Bench, case: str, setting: str) -> float | None:
    times = [
        e.us_per_sample.median
        for e in found.levels
        if (e.case, e.setting) == (case, setting) and e.us_per_sample
    ]
    return times[0] if times else None


def _levels(found: Bench, case: str) -> Section:
    whole = _level(found, case, native_breakdown.EVERYTHING)
    rows: list[tuple[str, ...]] = []
    for entry in (each for each in found.levels if each.case == case):
        us = entry.us_per_sample
        part = None if us is None or whole is None else us.median / whole
        errors = (number(getattr(entry.errors, name)) for name in QUANTITIES)
        rows.append(
            (entry.setting, entry.loop, str(entry.outcome), *errors, *_cells(us), number(part))
        )
    headings = (
        "requested",
        "loop",
        "outcome",
        *(with_unit(name, motion_unit("m", name)).replace(" [", "\n[") for name in QUANTITIES),
        "µs",
        "quartiles",
        "part",
    )
    notes = (
        (
            "Whole calls including Python, except for the loops alone, in the same rounds as the"
            " engines. Part: fraction of the first line."
        ),
    )
    others = [
        (e.us_per_sample, e)
        for e in found.needed
        if (e.case, e.mode, e.required) == (case, "projection", REQUIRED[-1])
        and e.engine != STANDARD
        and e.us_per_sample is not None
    ]
    sentences: list[str] = []
    if others and whole is not None:
        us, best = min(others, key=lambda each: each[0])
        sentences.append(
            f"With every body requested it is {us / whole:.0f} times as fast as the fastest other"
            f" engine that reaches {best.required:g} m, which gives the compared points only:"
            f" {best.engine}, {best.setting}."
        )
    return Section(f"{case}: the native engine in detail", sentences, notes, headings, 3, rows)


def _rates(found: Bench) -> Section:
    rows = [
        (
            e.case,
            e.what,
            number(e.us_per_sample),
            number(e.flops_per_sample),
            number(e.gflops),
            f"{100 * e.of_peak:.1f} %",
        )
        for e in found.rates
    ]
    notes = (
        (
            "Operations of the programs for accepted samples, including roots, comparisons and"
            " signs; a fused multiply-add counts as two. The peak is measured in the same rounds."
        ),
    )
    return Section(
        "Arithmetic",
        [],
        notes,
        ("case", "", "µs a sample", "flops a sample", "Gflop/s", "of peak"),
        2,
        rows,
    )


TIMED = (
    "Median and quartiles over the rounds, in µs per sample: warm, contestants in turns in one"
    " process. Errors are the largest over samples and outputs. An outcome is by the tolerances of"
    " the case, which a coarse effort is expected to miss."
)


def _cells(us: Spread | None) -> tuple[str, str]:
    """Return median and quartiles as text."""
    return (
        ("–", "–")
        if us is None
        else (number(us.median), f"{number(us.lower)} … {number(us.upper)}")
    )


def _loops(found: Bench) -> Section:
    rows = [
        (
            each.engine,
            each.loop,
            str(each.cases),
            number(each.us_per_sample),
            number(each.ratio),
            f"{number(each.lower)} … {number(each.upper)}",
        )
        for each in found.loops
    ]
    base = found.loops[0].base
    notes = (
        (
            "Projection at full effort, warm, engines taking turns on each case. µs a sample:"
            f" median over the cases. The ratio is to {base} on the same case: median and extremes"
            " over the cases."
        ),
    )
    headings = ("engine", "loop", "cases", "µs", f"times\n{base}", "from … to")
    return Section("Whole loops by engine", [], notes, headings, 2, rows)


def _batches(found: Bench) -> Section:
    rows = [
        (
            str(each.variants),
            *_cells(each.us_per_sample),
            number(each.gflops),
            "–" if each.of_peak is None else f"{100 * each.of_peak:.1f} %",
            f"{100 * each.solved:.4g} %",
            str(each.retried),
            number(each.error),
        )
        for each in found.batches
    ]
    notes = (
        (
            "All hardpoints vary by a thousandth of the mechanism's size; one core; time by sample"
            " and variant. Error: position of the first variant, which is the case itself. Retried:"
            " variants solved again alone."
        ),
    )
    headings = (
        "variants",
        "µs",
        "quartiles",
        "Gflop/s",
        "of peak",
        "solved",
        "retried",
        "error [m]",
    )
    return Section(
        f"{found.batches[0].case}: cost against batch size",
        [],
        notes,
        headings,
        1,
        rows,
        [batch_diagram(found)],
    )


def _studies(found: Bench) -> Section:
    rows = [
        (
            str(each.jobs),
            *_cells(each.us_per_sample),
            *_cells(each.times),
            "–" if each.peak_times is None else number(each.peak_times.median),
            str(each.unsolved),
        )
        for each in found.studies
    ]
    first = found.studies[0]
    notes = (
        (
            f"{first.variants} variants drawn, solved and reduced as kincheck sweep does it, every"
            " hardpoint by a thousandth of the mechanism's size; µs of the whole machine by sample"
            " and variant. Times as fast: as on one thread, by round; the kernel that measures a"
            " core's peak tells what the machine gives at that time."
        ),
    )
    headings = (
        "threads",
        "µs",
        "quartiles",
        "times as\nfast",
        "quartiles",
        "of the\npeak kernel",
        "unsolved",
    )
    return Section(f"{first.case}: a tolerance study by threads", [], notes, headings, 1, rows)


def _sizes(found: Bench, family: str) -> Section:
    sizes = [each for each in found.sizes if each.mechanism == family]
    many = family.rpartition(" ")[2]
    rows = [
        (
            e.engine,
            e.loop,
            str(e.loops),
            str(e.bodies),
            str(e.outcome or "–"),
            number(e.error),
            number(e.residual),
            *_cells(e.us_per_sample),
        )
        for e in sizes
    ]
    sentences: list[str] = []
    for engine in dict.fromkeys(each.engine for each in sizes):
        mine = [each for each in sizes if each.engine == engine]
        if (grown := growth(mine)) is not None:
            n, m, power = grown
            sentences.append(
                f"{engine}: from {n} to {m} {many} the cost grows as their number to the power of"
                f" {power:.2f}."
            )
        sentences += [
            f"{engine}, {each.loops} {many}: {each.message}"
            for each in mine
            if each.us_per_sample is None
        ]
    headings = (
        "engine",
        "loop",
        many,
        "bodies",
        "outcome",
        "error [m]",
        "residual",
        "µs",
        "quartiles",
    )
    return Section(
        f"Cost against size: {family}",
        sentences,
        (TIMED,),
        headings,
        2,
        rows,
        [size_diagram(family, sizes)],
    )


def _scalings(found: Bench) -> Section:
    rows = [
        (
            e.mechanism,
            str(e.size),
            str(e.bodies),
            str(e.unknowns),
            e.path,
            number(e.error),
            number(e.residual),
            *_cells(e.us_per_value),
        )
        for e in found.scalings
    ]
    sentences: list[str] = []
    for mechanism in dict.fromkeys(each.mechanism for each in found.scalings):
        small, *_, large = (each for each in found.scalings if each.mechanism == mechanism)
        power = exponent(small, large)
        sentences.append(
            f"{mechanism}: from {small.size} to {large.size} the cost grows as the unknowns to the"
            f" power of {power:.2f}."
        )
    notes = (
        (
            "Median and quartiles, µs of a driver value: position, velocity and acceleration of one"
            " point far from the driver."
        ),
    )
    headings = (
        "mechanism",
        "size",
        "bodies",
        "unknowns",
        "path",
        "error [m]",
        "residual",
        "µs",
        "quartiles",
    )
    return Section(
        "Cost against size: large mechanisms as one sparse system",
        sentences,
        notes,
        headings,
        1,
        rows,
    )


def _processes(found: Bench) -> Section:
    rows = [
        (
            each.what,
            *_cells(each.seconds),
            *(number(each.stages[name].median if each.stages else None) for name in STAGES),
            number(each.beyond_numpy),
            str(each.status),
            number(each.peak_mb),
        )
        for each in found.processes
    ]
    notes = (
        (
            "Seconds of fresh processes, files warm; stages are medians, beyond numpy: those after"
            " it, to the first solution. In the course of ten more solves programs are compiled"
            " that are not in the cache; until then they are interpreted. Memory: the most a"
            " process held; runs are of the first case, and in one process with their engine"
            " (--jobs 0)."
        ),
    )
    headings = (
        "process",
        "s",
        "quartiles",
        *(name.replace(" ", "\n") for name in STAGES),
        "beyond\nnumpy",
        "status",
        "memory\n[MB]",
    )
    diagrams = [stage_diagram(found)] if any(each.stages for each in found.processes) else []
    return Section("First use, whole processes and memory", [], notes, headings, 1, rows, diagrams)
