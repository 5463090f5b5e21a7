"""The report of the engine benchmark: tables, conclusions, diagrams as Plotly JSON. Modes never
share a table or a diagram.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from msgspec.structs import astuple

from ....errors import number_of
from ....harness.engine import STANDARD
from ....harness.labels import against, motion_unit, number, value_words
from ....report.figures import Figure, Style, precision_figure, ticked_axis
from ....report.page_model import Plot
from ....report.sections import Diagram, Report, Section
from ....trajectory import QUANTITIES
from ....unit_text import with_unit
from ..paper.formulation import report as formulation_report
from .engines import NAME, Bench, effort
from .precision import ALONE, EVERYTHING, REQUIRED, Entry, Needed
from .processes import STAGES
from .rounds import Spread
from .size import Size, exponent, growth

LOOPS_RUN = {
    "python": "in Python, around calls into the simulator",
    "simulator": "inside the simulator",
    "compiled": "in machine code",
}
"""Phrases for the place of the loop over samples and iterations."""
ERRORS = tuple(with_unit(name, motion_unit("m", name)).replace(" [", "\n[") for name in QUANTITIES)
TIMED = (
    "Median and quartiles over the rounds, in µs per sample: warm, contestants in turns in one"
    " process. Errors are the largest over samples and outputs. An outcome is by the tolerances of"
    " the case, which a coarse effort is expected to miss."
)


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
    for case, mode in dict.fromkeys((entry.case, entry.mode) for entry in found.entries):
        sections += [_precision(found, case, mode), _required_times(found, case, mode)]
        if mode == "projection" and any(each.case == case for each in found.floors):
            sections.append(_floors(found, case))
    sections += [_levels(found, case) for case in dict.fromkeys(e.case for e in found.levels)]
    for rows, section in (
        (found.rates, _rates),
        (found.loops, _loops),
        (found.batches, _batches),
        (found.studies, _studies),
    ):
        sections += [section(found)] if rows else []
    sections += [
        _sizes(found, family) for family in dict.fromkeys(e.mechanism for e in found.sizes)
    ]
    sections += [_scalings(found)] if found.scalings else []
    sections += [_processes(found)] if found.processes else []
    sections += formulation_report(found.formulation).sections if found.formulation else []
    return Report(NAME, "Run time against error, measured", facts, sections)


def _table(
    title: str,
    note: str,
    labels: int,
    columns: Sequence[str],
    rows: Iterable[Sequence[Any]],
    sentences: Sequence[str] = (),
    diagrams: Sequence[Diagram] = (),
) -> Section:
    """Return a section of rows whose values are not yet text."""
    texts = [[str(value_words(value)) for value in row] for row in rows]
    return Section(title, sentences, (note,), columns, labels, texts, diagrams)


def _median_and_quartiles(us: Spread | None) -> tuple[float | None, str | None]:
    """Return median and quartiles."""
    return (None, None) if us is None else (us.median, f"{number(us.lower)} … {number(us.upper)}")


def _entries(found: Bench, case: str, mode: str) -> list[Entry]:
    return [entry for entry in found.entries if (entry.case, entry.mode) == (case, mode)]


def _precision(found: Bench, case: str, mode: str) -> Section:
    entries = _entries(found, case, mode)
    truths = [entry.against.split(", ") for entry in entries if entry.against]
    sentences = [
        (
            f"Errors are against: {', '.join(map(against, truths[0]))}."
            if truths
            else "No reference was available."
        )
    ]
    for loop, words in LOOPS_RUN.items():
        if engines := dict.fromkeys(entry.engine for entry in entries if entry.loop == loop):
            sentences.append(f"{loop}: {', '.join(engines)}: the loop runs {words}.")
    sentences += [
        f"{each.engine}: {each.outcome}: {each.message}" for each in entries if each.solved is None
    ]
    counted = "iterations" if mode == "projection" else "steps"
    timed = any(entry.us_per_sample for entry in entries)
    return _table(
        f"{case}, {mode}: work and precision",
        TIMED,
        4,
        (
            "engine",
            "effort",
            "loop",
            "outcome",
            *ERRORS,
            f"{counted}\na sample",
            "µs",
            "quartiles",
        ),
        [
            (
                e.engine,
                e.setting,
                e.loop,
                e.outcome,
                *astuple(e.errors),
                e.iterations,
                *_median_and_quartiles(e.us_per_sample),
            )
            for e in entries
        ],
        sentences,
        [precision_diagram(found, case, mode)] if timed else [],
    )


def _required_times(found: Bench, case: str, mode: str) -> Section:
    mine = [each for each in found.needed if (each.case, each.mode) == (case, mode)]
    rows: dict[str, list[str]] = {}
    for each in mine:
        us = each.us_per_sample
        time = "none" if us is None else f"{number(us)} · {each.setting}"
        rows.setdefault(each.engine, [each.engine, each.loop]).append(time)
    return _table(
        f"{case}, {mode}: time at a required error",
        "Time per sample [µs] of the fastest effort that reaches all samples within this"
        " position error, and that effort.",
        2,
        ("engine", "loop", *(f"{required:g} m" for required in REQUIRED)),
        rows.values(),
        _faster(mine) if mode == "projection" else [],
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
    floors = [floor for floor in found.floors if floor.case == case]
    alone = _level(found, case, ALONE)
    rows: list[Sequence[Any]] = []
    for floor in floors:
        finest = [
            entry.us_per_sample.median
            for entry in _entries(found, case, floor.mode)
            if entry.engine == floor.engine and entry.us_per_sample
        ]
        us = floor.us_per_sample
        ratio = None if alone is None else us / alone
        rows.append((floor.engine, finest[-1] if finest else None, us, ratio))
    return _table(
        f"{case}: floors",
        "A floor is the time of the simulator's compiled code alone, for a sample at its finest"
        " effort: a lower bound for any loop around it, in any language. The adapter's time"
        " includes a loop in Python. The last column is the floor over the time that the native"
        f" loops alone take{'' if alone is None else f', {number(alone)} µs'}, all bodies and"
        " tests included.",
        1,
        ("engine", "adapter [µs]", "floor [µs]", "floor / native loops"),
        rows,
        [f"{floor.counted}." for floor in floors],
    )


def _level(found: Bench, case: str, setting: str) -> float | None:
    times = [
        e.us_per_sample.median
        for e in found.levels
        if (e.case, e.setting) == (case, setting) and e.us_per_sample
    ]
    return times[0] if times else None


def _levels(found: Bench, case: str) -> Section:
    whole = _level(found, case, EVERYTHING)
    rows: list[Sequence[Any]] = []
    for entry in (each for each in found.levels if each.case == case):
        us = entry.us_per_sample
        part = None if us is None or whole is None else us.median / whole
        errors = astuple(entry.errors)
        rows.append(
            (entry.setting, entry.loop, entry.outcome, *errors, *_median_and_quartiles(us), part)
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
    return _table(
        f"{case}: the native engine in detail",
        "Whole calls including Python, except for the loops alone, in the same rounds as the"
        " engines. Part: fraction of the first line.",
        3,
        ("requested", "loop", "outcome", *ERRORS, "µs", "quartiles", "part"),
        rows,
        sentences,
    )


def _rates(found: Bench) -> Section:
    return _table(
        "Arithmetic",
        "Operations of the programs for accepted samples, including roots, comparisons and"
        " signs; a fused multiply-add counts as two. The peak is measured in the same rounds.",
        2,
        ("case", "", "µs a sample", "flops a sample", "Gflop/s", "of peak"),
        [(*astuple(e)[:5], f"{100 * e.of_peak:.1f} %") for e in found.rates],
    )


def _loops(found: Bench) -> Section:
    base = found.loops[0].base
    return _table(
        "Whole loops by engine",
        "Projection at full effort, warm, engines taking turns on each case. µs a sample:"
        f" median over the cases. The ratio is to {base} on the same case: median and extremes"
        " over the cases.",
        2,
        ("engine", "loop", "cases", "µs", f"times\n{base}", "from … to"),
        [
            (
                e.engine,
                e.loop,
                e.cases,
                e.us_per_sample,
                e.ratio,
                f"{number(e.lower)} … {number(e.upper)}",
            )
            for e in found.loops
        ],
    )


def _batches(found: Bench) -> Section:
    return _table(
        f"{found.batches[0].case}: cost against batch size",
        "All hardpoints vary by a thousandth of the mechanism's size; one core; time by sample"
        " and variant. Error: position of the first variant, which is the case itself. Retried:"
        " variants solved again alone.",
        1,
        ("variants", "µs", "quartiles", "Gflop/s", "of peak", "solved", "retried", "error [m]"),
        [
            (
                e.variants,
                *_median_and_quartiles(e.us_per_sample),
                e.gflops,
                None if e.of_peak is None else f"{100 * e.of_peak:.1f} %",
                f"{100 * e.solved:.4g} %",
                e.retried,
                e.error,
            )
            for e in found.batches
        ],
        diagrams=[
            _against(
                Plot(
                    "batch",
                    "time per sample against variants in a batch, both log axes",
                    "Variants of all hardpoints, solved together on one core; time by sample and"
                    " variant.",
                ),
                "variants in a batch",
                "time per sample and variant [µs]",
                [(STANDARD, e.variants, e.us_per_sample.median) for e in found.batches],
            )
        ],
    )


def _studies(found: Bench) -> Section:
    first = found.studies[0]
    return _table(
        f"{first.case}: a tolerance study by threads",
        f"{first.variants} variants drawn, solved and reduced as kincheck sweep does it, every"
        " hardpoint by a thousandth of the mechanism's size; µs of the whole machine by sample"
        " and variant. Times as fast: as on one thread, by round; the kernel that measures a"
        " core's peak tells what the machine gives at that time.",
        1,
        (
            "threads",
            "µs",
            "quartiles",
            "times as\nfast",
            "quartiles",
            "of the\npeak kernel",
            "unsolved",
        ),
        [
            (
                e.jobs,
                *_median_and_quartiles(e.us_per_sample),
                *_median_and_quartiles(e.times),
                e.peak_times and e.peak_times.median,
                e.unsolved,
            )
            for e in found.studies
        ],
    )


def _sizes(found: Bench, family: str) -> Section:
    sizes = [each for each in found.sizes if each.mechanism == family]
    many = family.rpartition(" ")[2]
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
    return _table(
        f"Cost against size: {family}",
        TIMED,
        2,
        (
            "engine",
            "loop",
            many,
            "bodies",
            "outcome",
            "error [m]",
            "residual",
            "µs",
            "quartiles",
        ),
        [
            (
                e.engine,
                e.loop,
                e.loops,
                e.bodies,
                e.outcome,
                e.error,
                e.residual,
                *_median_and_quartiles(e.us_per_sample),
            )
            for e in sizes
        ],
        sentences,
        [_size_diagram(family, many, sizes)],
    )


def _size_diagram(family: str, many: str, sizes: Sequence[Size]) -> Diagram:
    plot = Plot(
        family.replace(" ", "-"),
        f"{family}: time per sample against their number, both log axes",
        f"A {family}; time of one driver value, position, velocity and acceleration.",
    )
    timed = [
        (each.engine, each.loops, each.us_per_sample.median)
        for each in sizes
        if each.us_per_sample is not None
    ]
    return _against(plot, many, "time per sample [µs]", timed)


def _scalings(found: Bench) -> Section:
    sentences: list[str] = []
    for mechanism in dict.fromkeys(each.mechanism for each in found.scalings):
        small, *_, large = (each for each in found.scalings if each.mechanism == mechanism)
        power = exponent(small, large)
        sentences.append(
            f"{mechanism}: from {small.size} to {large.size} the cost grows as the unknowns to the"
            f" power of {power:.2f}."
        )
    return _table(
        "Cost against size: large mechanisms as one sparse system",
        "Median and quartiles, µs of a driver value: position, velocity and acceleration of one"
        " point far from the driver.",
        1,
        (
            "mechanism",
            "size",
            "bodies",
            "unknowns",
            "path",
            "error [m]",
            "residual",
            "µs",
            "quartiles",
        ),
        [
            (
                e.mechanism,
                e.size,
                e.bodies,
                e.unknowns,
                e.path,
                e.error,
                e.residual,
                *_median_and_quartiles(e.us_per_value),
            )
            for e in found.scalings
        ],
        sentences,
    )


def _processes(found: Bench) -> Section:
    return _table(
        "First use, whole processes and memory",
        "Seconds of fresh processes, files warm; stages are medians, beyond numpy: those after"
        " it, to the first solution. In the course of ten more solves programs are compiled"
        " that are not in the cache; until then they are interpreted. Memory: the most a"
        " process held; runs are of the first case, and in one process with their engine"
        " (--jobs 0).",
        1,
        (
            "process",
            "s",
            "quartiles",
            *(name.replace(" ", "\n") for name in STAGES),
            "beyond\nnumpy",
            "status",
            "memory\n[MB]",
        ),
        [
            (
                e.what,
                *_median_and_quartiles(e.seconds),
                *(e.stages[name].median if e.stages else None for name in STAGES),
                e.beyond_numpy,
                e.status,
                e.peak_mb,
            )
            for e in found.processes
        ],
        diagrams=[_stage_diagram(found)] if any(each.stages for each in found.processes) else [],
    )


def _stage_diagram(found: Bench) -> Diagram:
    """Return the stages of the first use, with empty and with filled cache side by side."""
    processes = [each for each in found.processes if each.stages]
    styles = _styles(processes[0].stages)
    bars: list[Figure] = [
        {
            "type": "bar",
            "orientation": "h",
            "name": style.name,
            "uid": style.key,
            "meta": style.name,
            "x": [each.stages[style.name].median for each in processes],
            "y": [each.what.rpartition(", ")[2] for each in processes],
            "marker": {"color": style.colour},
            "hovertemplate": "%{x:.3f} s",
        }
        for style in styles
    ]
    layout: Figure = {
        "barmode": "stack",
        "xaxis": {"title": {"text": "time [s]"}},
        "yaxis": {"autorange": "reversed"},
    }
    plot = Plot(
        "stages", "stages of the native engine's first use", "Medians over fresh processes."
    )
    return Diagram(plot, {"data": bars, "layout": layout}, styles)


def precision_diagram(found: Bench, case: str, mode: str) -> Diagram:
    """Return error against time for the engines of one mode on a case, with the floor of each
    simulator.
    """
    entries = _entries(found, case, mode)
    efforts = [each for entry in entries for each in effort(entry)]
    styles, floors = _styles(each.engine for each in efforts), ""
    for floor in found.floors:
        finest = [entry for entry in entries if entry.engine == floor.engine and effort(entry)]
        if (floor.case, floor.mode) == (case, mode) and finest:
            (best,) = effort(finest[-1])
            name = f"{best.engine}: floor"
            setting, us = f"floor of {best.setting}", floor.us_per_sample
            efforts.append(replace(best, engine=name, setting=setting, us_per_sample=us))
            own = next(style for style in styles if style.name == best.engine)
            styles.append(replace(own, name=name, symbol="x-thin-open", dash="3px,3px"))
            floors = " A cross is a simulator's floor: a lower bound, not a solver."
    drawn = [each for each in efforts if each.us_per_sample > 0.0]
    plot = Plot(
        f"{case}-{mode}",
        f"{case}, {mode}: error against time per sample, both log axes",
        f"Left is faster, down is more accurate; a point is one effort.{floors}",
    )
    return Diagram(plot, precision_figure(drawn, {style.name: style for style in styles}), styles)


def _against(
    plot: Plot, x_title: str, y_title: str, points: Sequence[tuple[str, int, float]]
) -> Diagram:
    styles = _styles(name for name, *_ in points)
    curves: list[Figure] = []
    for style in styles:
        x, y = zip(*((x, y) for name, x, y in points if name == style.name), strict=True)
        curves.append(style.curve([*x], [*y]) | {"hovertemplate": "%{x}: %{y:.3~g} µs"})
    axes: Figure = {
        "xaxis": ticked_axis(x_title, [x for _, x, _ in points]),
        "yaxis": ticked_axis(y_title, [y for *_, y in points]),
    }
    return Diagram(plot, {"data": curves, "layout": {**axes, "hovermode": "closest"}}, styles)


def _styles(names: Iterable[str]) -> list[Style]:
    return [Style.number(index, name) for index, name in enumerate(dict.fromkeys(names))]
