"""The records of a run as a table for people."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any, TextIO

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..case.io.escape import visible
from ..harness.labels import against, motion_unit, notes, signs, suspects, unread, unsound
from ..harness.record import Deviation, Outcome, Record, Results
from ..trajectory import QUANTITIES
from . import terminal

COLOURS = {
    Outcome.PASS: "green",
    Outcome.UNJUDGED: "yellow",
    Outcome.UNSUPPORTED: "yellow",
    Outcome.UNAVAILABLE: "yellow",
}
LENGTH = "m"


def print_table(results: Results, file: TextIO) -> None:
    """Print the conventions of signs, a line per record, every message, and outcome counts."""
    console = terminal.console(file)
    print_signs(results.run, console)
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("case", overflow="fold")
    for name in ("engine", "outcome"):
        table.add_column(name, no_wrap=True)
    for quantity in QUANTITIES:
        table.add_column(f"error\n{motion_unit(LENGTH, quantity)}", justify="right", no_wrap=True)
    table.add_column("truth", overflow="fold")
    table.add_column("us/step", justify="right", no_wrap=True)
    several = len({record.mode for record in results.records}) > 1
    for record in results.records:
        outcome = Text(record.outcome.shown, style=COLOURS.get(record.outcome, "bold red"))
        errors = [_error(record, quantity) for quantity in QUANTITIES]
        time = "–" if record.us_per_step is None else f"{record.us_per_step:.3g}"
        engine = f"{record.engine} · {record.mode}" if several else record.engine
        # texts, not strings: those would be taken for mark-up, in which [red] is a colour
        case, engine, judge = (Text(visible(each)) for each in (record.case, engine, truth(record)))
        table.add_row(case, engine, outcome, *errors, judge, time)
    if results.records:
        console.print(table)
    print_messages(results, console)


def print_signs(run: Mapping[str, Any], console: Console) -> None:
    """Print the heading of every table of outputs with a convention of signs."""
    for line in signs(run):
        console.print(Text(visible(line)), soft_wrap=True)


def print_messages(results: Results, console: Console) -> None:
    """Print notes on the cases, suspected references, every message, and a count of outcomes."""
    for case, note in notes(results.run):
        console.print(Text(visible(f"note: {case}: {note}")), soft_wrap=True)
    for case, why in suspects(results):
        console.print(Text(visible(f"suspect: {case}: {why}"), style="bold"), soft_wrap=True)
    for (engine, outcome, message), cases in messages(results).items():
        console.print(
            Text(
                visible(f"{outcome.shown}: {', '.join(cases)} · {engine}: {message}", also="\n\t")
            ),
            soft_wrap=True,
        )
    counts = Counter(record.outcome for record in results.records)
    console.print(
        ", ".join(f"{count} {outcome.shown}" for outcome in Outcome if (count := counts[outcome]))
        or "nothing was run"
    )
    if said := unread(results.run):
        console.print(Text(visible(said), style="bold red"), soft_wrap=True)


def truth(record: Record) -> str:
    """Return the standard of a record; "validated" is kept for agreement with truths from
    elsewhere.
    """
    said = "validated" if record.validated else unsound(record)
    return against(record.truth) + (f" ({said})" if said else "")


def _error(record: Record, quantity: str) -> Text:
    found = worst(record, quantity)
    if found is None:
        return Text("–")
    error, unit = found
    return Text(
        visible(f"{error.max_abs:.1e} {unit}".rstrip()), style="" if error.within else "bold red"
    )


def worst(record: Record, quantity: str) -> tuple[Deviation, str] | None:
    """Return the largest error of a quantity over the outputs, and its output's unit, empty for the
    metre of the heads.

    Out of tolerance comes first, then lengths: errors in different units are not to be compared.
    None if nothing was compared.
    """
    found: list[tuple[Deviation, str]] = []
    for output, errors in record.errors.items():
        unit = record.outputs[output].unit if output in record.outputs else LENGTH
        found += [
            (each, "" if unit == LENGTH else f"[{unit}]")
            for name, each in errors.items()
            if name == quantity
        ]
    return max(
        found, key=lambda each: (not each[0].within, not each[1], each[0].max_abs), default=None
    )


def messages(results: Results) -> dict[tuple[str, Outcome, str], list[str]]:
    """Messages, and the cases they are about; a missing engine says so once, and a suspected
    reference in a line of its own.
    """
    said: dict[tuple[str, Outcome, str], list[str]] = {}
    for record in results.records:
        if record.message and not results.blames_reference(record):
            said.setdefault((record.engine, record.outcome, record.message), []).append(record.case)
    return said
