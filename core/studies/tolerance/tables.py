"""The results of a study on the terminal, in the units of its file."""

from __future__ import annotations

from typing import TextIO

from rich.console import Console
from rich.text import Text

from ...harness.labels import notes, number
from ...report import terminal
from ...report.fitting_table import FittingTable
from ...report.table import print_signs
from .histograms import sparkline
from .limit_words import interval, limit_notes, other_yield, percent
from .page import effect, headline
from .results import Envelope, Numbers, SweepResults


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
    table = FittingTable()
    for name in ("output", "unit"):
        table.add_column(name)
    for name in ("least", "variant", "most", "variant", "largest\nst. dev.", "largest\n1-99 %"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("largest effect\n(gradient x scale)")
    for name, each in results.outputs.items():
        unit, scale = results.shown_unit(each.unit)
        bands = zip(each.quantiles["0.01"], each.quantiles["0.99"], strict=True)
        widths = [high - low for low, high in bands if low is not None and high is not None]
        known = (g for g in results.gradients if g.output == name and g.largest is not None)
        top = max(known, key=effect, default=None)
        table.add_row(
            Text(name),
            unit,
            *(_shown(scale, min(_known(each.min), default=None)), _count(each.min_variant)),
            *(_shown(scale, max(_known(each.max), default=None)), _count(each.max_variant)),
            _shown(scale, max(_known(each.standard_deviation), default=None)),
            _shown(scale, max(widths, default=None)),
            Text("–" if top is None else f"{top.coordinate} {_shown(scale, effect(top))}"),
        )
    return table


def _distributions(results: SweepResults) -> FittingTable:
    swept = next(iter(results.driver))
    driver_unit, factor = results.shown_driver
    table = FittingTable(title="Distribution at one sample")
    table.add_column("output")
    table.add_column("unit")
    table.add_column(f"at {swept}\n[{driver_unit}]", justify="right", no_wrap=True)
    for name in ("mean", "st. dev.", "1 %", "50 %", "99 %"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("histogram", no_wrap=True)
    for name, each in results.outputs.items():
        found = each.histogram
        if found is None:
            continue
        unit, scale = results.shown_unit(each.unit)
        values = [column[found.sample] for column in _columns(each)]
        table.add_row(
            Text(name),
            unit,
            _shown(factor, results.driver[swept][found.sample]),
            *(_shown(scale, value) for value in values),
            sparkline(found),
        )
    return table


def _columns(each: Envelope) -> list[Numbers]:
    quantiles = (each.quantiles[p] for p in ("0.01", "0.5", "0.99"))
    return [each.mean, each.standard_deviation, *quantiles]


def _print_limits(results: SweepResults, console: Console) -> None:
    table = FittingTable(title="Specification limits")
    table.add_column("output")
    table.add_column("unit")
    other = other_yield(results)
    beside = [head.replace(" of", "\nof") for head, _ in other]
    for name in ("low", "high", "below", "above", "yield", "95 % interval", *beside, "Cp", "Cpk"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("Cpk by\nquantiles", justify="right", no_wrap=True)
    for each in results.limits:
        unit, scale = results.shown_unit(each.unit)
        table.add_row(
            Text(each.output or "all together"),
            unit,
            *(_shown(scale, value) for value in (each.low, each.high)),
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


def _known(values: Numbers) -> list[float]:
    return [value for value in values if value is not None]


def _shown(scale: float, value: float | None) -> str:
    return number(None if value is None else scale * value)


def _count(number: int | None) -> str:
    return "–" if number is None else str(number)


def remarks(results: SweepResults) -> list[str]:
    """Return remarks on the numbers, a line each."""
    lines = [f"note: {note}" for _, note in notes(results.run)]
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
    rough = sum(not each.accurate for each in results.gradients)
    if rough:
        lines.append(
            f"{rough} of {len(results.gradients)} gradients are not known to 1e-6; the results say"
            " which, and how well"
        )
    lines += [
        f"no gradient by {name}: {message}" for name, message in results.gradient_messages.items()
    ]
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
