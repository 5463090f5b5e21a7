"""The results of a study on the terminal and as CSV, in the units of its file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, TextIO

from rich.console import Console
from rich.text import Text

from ...case.io.table_file import Kind, csv_text
from ...errors import labelled, number_of, shortened
from ...harness.labels import notes, number
from ...report import terminal
from ...report.table import print_signs
from ...report.terminal import FittingTable
from .conformance import Capability, sparkline
from .results import Gradient, SweepResults
from .study_choices import Incomplete, Mode


def limit_notes(results: SweepResults) -> list[str]:
    """Return the assumptions of the table of limits, a line each."""
    lines = ["A variant counts as inside if it is inside the limits at every sample."]
    if any(each.cpk is not None for each in results.limits):
        lines.append(
            "Cp and Cpk assume a normal distribution; the last column does not. Each index is the"
            " smallest over the samples."
        )
    if any(each.interval for each in results.limits) and results.sampling != "random":
        lines.append(
            f"The confidence interval assumes independent variants; for {results.sampling}"
            " sampling it is usually too wide."
        )
    if some := _incomplete(results):
        variants = number_of(some, "variant")
        lines.append(
            f"Incomplete, and left out: {variants} without all samples."
            if results.incomplete == Incomplete.IGNORE
            else f"Incomplete, and so outside: {variants} without all samples; --incomplete ignore"
            " leaves them out."
        )
        if any(each.cpk is not None for each in results.limits):
            lines.append("Cp and Cpk are of all variants with a value at the sample.")
    return lines


def _incomplete(results: SweepResults) -> int:
    return max((each.incomplete for each in results.limits), default=0)


def other_yield(results: SweepResults) -> list[tuple[str, str]]:
    """Return head and attribute of the yield that is not judged; none without incomplete variants,
    as both are equal.
    """
    if not _incomplete(results):
        return []
    if results.incomplete == Incomplete.IGNORE:
        return [("yield of all", "share_of_all")]
    return [("yield of complete", "share_of_complete")]


def percent(share: float | None) -> str:
    """Return a share in percent, to a ten-thousandth; a dash for None."""
    return "–" if share is None else f"{100.0 * share:.2f} %"


def interval(each: Capability) -> str:
    """Return the confidence interval of a yield as text; a dash for None."""
    if each.interval is None:
        return "–"
    low, high = each.interval
    return f"{100.0 * low:.2f} to {100.0 * high:.2f} %"


def print_sweep(results: SweepResults, file: TextIO) -> None:
    """Print the signs of outputs, a line for each output, histograms, limits, unsolved variants,
    deviating variants, and the speed.
    """
    console = terminal.console(file)
    console.print(Text(headline(results), style="bold"))
    print_signs(results.run, console)
    console.print(_extremes(results))
    if any(each.histogram for each in results.outputs.values()):
        console.print()
        print_signs(results.run, console)
        console.print(_distributions(results))
    if results.limits:
        _print_limits(results, console)
    for line in remarks(results):
        console.print(Text(line), soft_wrap=True)


def _extremes(results: SweepResults) -> FittingTable:
    by = "offset" if results.mode == Mode.ONE_AT_A_TIME else "st. dev."
    table = terminal.columns(
        *("output", "unit", ">least", ">variant", ">most", ">variant"),
        *(">largest\nst. dev.", ">largest\n1-99 %", f"largest effect\n(gradient x {by})"),
    )
    for name, each in results.outputs.items():
        unit, scale = results.shown_unit(each.unit)
        least, most, spread = (scaled_number(scale, value) for value in each.ends)
        bands = zip(each.quantiles["0.01"], each.quantiles["0.99"], strict=True)
        widths = [high - low for low, high in bands if low is not None and high is not None]
        known = (g for g in results.gradients if g.output == name and g.largest is not None)
        top = max(known, key=effect, default=None)
        table.add_row(
            Text(name),
            unit,
            *(least, _count(each.min_variant), most, _count(each.max_variant), spread),
            scaled_number(scale, max(widths, default=None)),
            Text("–" if top is None else f"{top.coordinate} {scaled_number(scale, effect(top))}"),
        )
    return table


def _count(number: int | None) -> str:
    return "–" if number is None else str(number)


def _distributions(results: SweepResults) -> FittingTable:
    swept = next(iter(results.driver))
    driver_unit, factor = results.shown_driver
    table = terminal.columns(
        *("output", "unit", f">at {swept}\n[{driver_unit}]", ">mean", ">st. dev."),
        *(">1 %", ">50 %", ">99 %", "histogram"),
        title="Distribution at one sample",
    )
    for name, each in results.outputs.items():
        if each.histogram is None:
            continue
        unit, scale = results.shown_unit(each.unit)
        k = each.histogram.sample
        quantiles = (each.quantiles[p] for p in ("0.01", "0.5", "0.99"))
        columns = (each.mean, each.standard_deviation, *quantiles)
        table.add_row(
            Text(name),
            unit,
            scaled_number(factor, results.driver[swept][k]),
            *(scaled_number(scale, column[k]) for column in columns),
            sparkline(each.histogram),
        )
    return table


def _print_limits(results: SweepResults, console: Console) -> None:
    other = other_yield(results)
    table = terminal.columns(
        *("output", "unit", ">low", ">high", ">below", ">above", ">yield", ">95 % interval"),
        *(f">{head}".replace(" of", "\nof") for head, _ in other),
        *(">Cp", ">Cpk", ">Cpk by\nquantiles"),
        title="Specification limits",
    )
    for each in results.limits:
        unit, scale = results.shown_unit(each.unit)
        table.add_row(
            Text(each.output or "all together"),
            unit,
            *(scaled_number(scale, value) for value in (each.low, each.high)),
            *(str(each.below), str(each.above)),
            percent(each.share),
            interval(each),
            *(percent(getattr(each, share)) for _, share in other),
            *(number(value) for value in (each.cp, each.cpk, each.by_quantiles)),
        )
    console.print()
    console.print(table)
    for line in limit_notes(results):
        console.print(Text(line), soft_wrap=True)


def scaled_number(scale: float, value: float | None) -> str:
    """Return a number times a factor, to three digits; a dash for None."""
    return number(None if value is None else scale * value)


def without_gradients(results: SweepResults) -> list[str]:
    """Return a line on the outputs without gradients, if there are any."""
    known = {each.output for each in results.gradients if each.largest is not None}
    names = [name for name in results.outputs if name not in known]
    why = (
        "they have no value at the nominal design, or are forces near a singular pose or of rows"
        " redundant but for digits"
    )
    return [f"no gradients of {shortened(names, 5)}: {why}"] if names else []


def remarks(results: SweepResults) -> list[str]:
    """Return remarks on the numbers, a line each."""
    lines = [labelled(note) for _, note in notes(results.run)]
    lines += [
        f"unsolved: variant {each.variant}, {each.samples} samples: {each.message}"
        for each in results.failed[:10]
    ]
    if results.unsolved > 10:
        lines.append(
            f"unsolved: {results.unsolved} in all, the first {len(results.failed)} in the results"
        )
    replay = f"--seed {results.seed} --replay"
    lines += [
        f"{each.outcome}: variant {each.variant} ({replay} {each.variant}): {each.message}"
        for each in results.deviating[:10]
    ]
    if len(results.deviating) > 10:
        lines.append(f"deviating: {len(results.deviating)} in all, listed in the results")
    lines += without_gradients(results)
    if results.quantiles_of < results.samples:
        lines.append(
            f"quantiles are of a random subset of {results.quantiles_of} variants, with their"
            " standard errors in the results"
        )
    if results.sampling == "sobol" and results.asked & (results.asked - 1):
        lines.append(
            f"a Sobol sequence is balanced at powers of two; {results.asked} is none, so the means"
            f" converge more slowly: {1 << results.asked.bit_length()} would be"
        )
    if len(results.failed) < results.samples and (
        empty := [name for name, each in results.outputs.items() if not any(each.count)]
    ):
        lines.append(
            f"no variant has a value of {', '.join(empty)}; kincheck run CASE --engine native"
            " --verbose says why"
        )
    if results.retried:
        lines.append(f"{results.retried} variants needed divided steps")
    speed = ", ".join(
        f"{key.replace('_', ' ')} {number(value)}" for key, value in results.measured.items()
    )
    return [*lines, speed]


def headline(results: SweepResults) -> str:
    """Return one sentence about the study."""
    said = f"{results.partial or results.samples} variants of {results.case}"
    said += ", partial: the sweep was stopped" if results.partial else ""
    said += (
        f", {results.unsolved} without a solution somewhere" if results.unsolved else ", all solved"
    )
    if results.checked:
        off = len(results.deviating)
        said += f"; {len(results.checked)} checked with {results.check_engine}, " + (
            f"{off} deviate" if off else "none deviates"
        )
        said += f", {results.unjudged} not judged" if results.unjudged else ""
        said += f"; {results.partly_judged}" if results.partly_judged else ""
    return said


def effect(gradient: Gradient) -> float:
    """Return the size of a bar: the largest gradient times the standard deviation of its
    coordinate, or the largest offset if one coordinate at a time varies [unit of the output].
    """
    return abs(gradient.largest or 0.0) * gradient.deviation


# CSV: a missing value is an empty field.

_STATISTICS = ("nominal", "count", "min", "max", "mean", "standard_deviation")


def envelope_csv(results: SweepResults) -> str:
    """Return a line for each output and sample."""
    swept = next(iter(results.driver))
    probabilities = list(next(iter(results.outputs.values())).quantiles)
    errors = any(each.standard_errors for each in results.outputs.values())
    columns = ["output", "unit", "sample", swept, "driver_unit", *_STATISTICS]
    columns += [f"quantile_{p}" for p in probabilities]
    columns += [f"standard_error_{p}" for p in probabilities] if errors else []
    columns += ["partial"] if results.partial else []
    partial = [f"{results.partial} variants"] if results.partial else []
    driver_unit, driver_scale = results.shown_driver
    rows: list[Sequence[Any]] = []
    for name, each in results.outputs.items():
        unit, scale = results.shown_unit(each.unit)
        numbers = [
            getattr(each, key) if key == "count" else scale_values(scale, getattr(each, key))
            for key in _STATISTICS
        ]
        quantiles = [*each.quantiles.values(), *(each.standard_errors or {}).values()]
        numbers += [scale_values(scale, column) for column in quantiles]
        for k, value in enumerate(scale_values(driver_scale, results.driver[swept])):
            found = (column[k] for column in numbers)
            rows.append([name, unit, k, value, driver_unit, *found, *partial])
    return _csv(columns, rows)


def gradient_csv(results: SweepResults) -> str:
    """Return a line for each output and coordinate."""
    columns = ["output", "coordinate", "unit", "at_design", "largest", "sample"]
    columns += ["scale", "scale_unit", "standard_deviation", "effect", "effect_unit"]
    rows: list[Sequence[Any]] = []
    for each in results.gradients:
        unit, scale = results.shown_unit(results.outputs[each.output].unit)
        its, factor = results.shown_unit(results.unit_of(each.coordinate))
        at, largest = scale_values(scale / factor, [each.at_design, each.largest])
        rows.append(
            [
                *(each.output, each.coordinate, f"({unit})/({its})"),
                *(at, largest, each.sample),
                *(factor * each.scale, its, factor * each.deviation, scale * effect(each), unit),
            ]
        )
    return _csv(columns, rows)


def _csv(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    return csv_text(dict.fromkeys(columns, Kind.TEXT), [rows], "\n")


def limits_csv(results: SweepResults) -> str:
    """Return a line for each limited output, and one for all limits together."""
    columns = ["output", "unit", "low", "high", "known", "below", "above", "outside", "incomplete"]
    columns += ["yield", "yield_from", "yield_to", "yield_of_all", "yield_of_complete"]
    columns += ["cp", "cpk", "cpk_by_quantiles", "sample"]
    rows: list[Sequence[Any]] = []
    for each in results.limits:
        unit, scale = results.shown_unit(each.unit)
        counts = (each.known, each.below, each.above, each.outside, each.incomplete)
        interval = each.interval or (None, None)
        indices = (each.cp, each.cpk, each.by_quantiles, each.sample)
        limits = scale_values(scale, [each.low, each.high])
        name = each.output or "all"
        shares = (each.share_of_all, each.share_of_complete)
        rows.append([name, unit, *limits, *counts, each.share, *interval, *shares, *indices])
    return _csv(columns, rows)


def scale_values(scale: float, values: Iterable[float | None]) -> list[float | None]:
    """Return numbers times a factor; None stays None."""
    return [None if value is None else scale * value for value in values]
