"""Tables of costs of the engine benchmark: by batch size, by mechanism size, and per process."""

from __future__ import annotations

from ...harness.labels import number
from ...report.sections import Section
from .cold_start import STAGES
from .diagrams import batch_diagram, size_diagram, stage_diagram
from .engines import Bench
from .rounds import Spread
from .scaling import exponent
from .size import growth

TIMED = (
    "Median and quartiles over the rounds, in µs per sample: warm, contestants in turns in one"
    " process. Errors are the largest over samples and outputs. An outcome is by the tolerances of"
    " the case, which a coarse effort is expected to miss."
)


def cells(us: Spread | None) -> tuple[str, str]:
    """Return median and quartiles as text."""
    return (
        ("–", "–")
        if us is None
        else (number(us.median), f"{number(us.lower)} … {number(us.upper)}")
    )


def loops(found: Bench) -> Section:
    """Return the comparison of the engines' whole loops over all cases."""
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


def batches(found: Bench) -> Section:
    """Return cost against batch size."""
    rows = [
        (
            str(each.variants),
            *cells(each.us_per_sample),
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


def studies(found: Bench) -> Section:
    """Return the cost of a tolerance study against the number of threads."""
    rows = [
        (
            str(each.jobs),
            *cells(each.us_per_sample),
            *cells(each.times),
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


def sizes(found: Bench, family: str) -> Section:
    """Return cost against the size of one family of mechanisms, by engine."""
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
            *cells(e.us_per_sample),
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


def scalings(found: Bench) -> Section:
    """Return cost against size for large mechanisms."""
    rows = [
        (
            e.mechanism,
            str(e.size),
            str(e.bodies),
            str(e.unknowns),
            e.path,
            number(e.error),
            number(e.residual),
            *cells(e.us_per_value),
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


def processes(found: Bench) -> Section:
    """Return the costs of first use, and memory."""
    rows = [
        (
            each.what,
            *cells(each.seconds),
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
