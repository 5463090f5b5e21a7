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
from . import cost_report as cost
from . import native_breakdown
from .cost_report import TIMED, cells
from .diagrams import entries_of, precision_diagram
from .engines import NAME, Bench
from .precision import REQUIRED, Entry, Needed

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
    sections += [cost.loops(found)] if found.loops else []
    sections += [cost.batches(found)] if found.batches else []
    sections += [cost.studies(found)] if found.studies else []
    sections += [
        cost.sizes(found, family)
        for family in dict.fromkeys(each.mechanism for each in found.sizes)
    ]
    sections += [cost.scalings(found)] if found.scalings else []
    sections += [cost.processes(found)] if found.processes else []
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
            *cells(entry.us_per_sample),
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
            (entry.setting, entry.loop, str(entry.outcome), *errors, *cells(us), number(part))
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
