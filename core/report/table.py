"""The records of a run as a printed table."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import groupby
from typing import IO, TextIO

from rich.cells import cell_len
from rich.console import Console
from rich.text import Text

from ..case.io.escape import visible
from ..errors import labelled, sentence
from ..harness.labels import (
    account,
    against,
    displayed,
    folded,
    motion_unit,
    notes,
    shorten_names,
    signs,
    suspects,
    unmade,
    unread,
    unsound,
)
from ..harness.record import Deviation, Facts, Outcome, Record, Results
from ..trajectory import QUANTITIES
from ..unit_text import FORCES, motion_word, with_unit
from . import terminal
from .axis import print_travel
from .terminal import FittingTable


def escape_markdown(text: str) -> str:
    """Return text that Markdown shows unchanged on a line or in a cell: without mark-up, links,
    HTML or notified users.
    """
    plain = (
        visible(" ".join(text.split()))
        .replace("&", "&amp;")
        .replace("<", "&lt;")
        .replace(">", "&gt;")
    )
    # an underscore inside a word and brackets without a target are plain text
    plain = re.sub(r"([\\`*~|]|(?<!\w)_|_(?!\w)|(?<=\])\()", r"\\\1", plain)
    return re.sub(r"(?<!\w)@(?=\w)", "@\N{WORD JOINER}", plain)


def code(name: str) -> str:
    """Return a name as code, where only a bar can be escaped."""
    shown = visible(name).replace("`", "'").replace("|", "\\|")
    return f"`{shown}`"


def row(cells: Iterable[str]) -> str:
    """Return a row of a table."""
    return f"| {' | '.join(cells)} |"


COLOURS = {
    Outcome.PASS: "green",
    Outcome.UNJUDGED: "yellow",
    Outcome.UNSUPPORTED: "yellow",
    Outcome.UNAVAILABLE: "yellow",
}
LENGTH = "m"


def print_table(results: Results, file: IO[str], *, reactions: bool = False) -> None:
    """Print the sign conventions, a line per record, every message, and outcome counts.

    If the console is too narrow for a line per record, the records stand below their case.

    Args:
        reactions: forces and moments have columns of their own, the first ones.
    """
    console = terminal.console(file)
    print_signs(results.run, console)
    several = len({record.mode for record in results.records}) > 1
    rows = [(record, _cells(record, several, reactions)) for record in results.records]
    units = [motion_unit(LENGTH, quantity) for quantity in QUANTITIES]
    errors = [f">error\n{unit}" for unit in (*(FORCES if reactions else ()), *units)]
    heads = "engine", "outcome", *errors, ">us/step"
    table = terminal.columns("case", *heads, "truth")
    for record, cells in rows:
        table.add_row(Text(visible(record.case)), *cells, Text(visible(truth(record))))
    if rows and table.natural_width(console, console.options) <= console.width:
        console.print(table)
    elif rows:
        standards = {
            case: _standard([record for record, _ in group])
            for case, group in groupby(rows, lambda row: row[0].case)
        }
        titled = [(record.case, standards[record.case], cells) for record, cells in rows]
        _print_below_titles(titled, heads, console)
    print_travel(results, console)
    print_messages(results, console)


def print_outputs(results: Results, file: TextIO) -> None:
    """Print a line for each output of each record with its largest errors and their tolerances, the
    reasons for missing errors, a line of facts for each record with an answer, then the messages of
    `print_table`.

    If the console is too narrow, the outputs stand below their case and engine.
    """
    console = terminal.console(file)
    rows = list[tuple[tuple[str, str], tuple[Text, ...]]]()
    for record in results.records:
        for name, errors in record.errors.items():
            unit = record.outputs[name].unit if name in record.outputs else LENGTH
            shown, factor = displayed(unit, results.run.get("cases", {}).get(record.case, {}))
            cells = (_of_tolerance(getattr(errors, quantity), factor) for quantity in QUANTITIES)
            cells = Text(visible(name)), *cells, Text(visible(shown or unit))
            rows.append(((record.case, record.engine), cells))
    # the first error of forces, which have no position, is called value
    words = {motion_word(QUANTITIES[0], cells[-1].plain) for _, cells in rows} or {QUANTITIES[0]}
    first = words.pop() if len(words) == 1 else "value"
    heads = "output", *(f">{head}" for head in (first, *QUANTITIES[1:])), "unit"
    table = terminal.columns("case", "engine", *heads)
    for names, cells in rows:
        table.add_row(*(Text(visible(each)) for each in names), *cells)
    if table.natural_width(console, console.options) <= console.width:
        console.print(table)
    else:
        titled = [(" · ".join(names), "", cells) for names, cells in rows]
        _print_below_titles(titled, heads, console)
    for record in results.records:
        for reason, outputs in _missing_reasons(record).items():
            line = f"–: {record.case} · {record.engine}: {shorten_names(outputs)}: {reason}"
            console.print(Text(visible(line)), soft_wrap=True)
    for record in results.records:
        if record.samples is not None:
            line = f"{record.case} · {record.engine}: {account(record)}"
            console.print(Text(visible(line), "dim"))
    print_table(results, file)


def _missing_reasons(record: Record) -> dict[str, list[str]]:
    """Return the reasons why quantities are not compared or have no values, each with its outputs.

    A reason about the comparison that only repeats the reason about the values is left out.
    """
    found: dict[str, list[str]] = {}
    for name, errors in record.errors.items():
        if errors.reason:
            found.setdefault(errors.reason, []).append(name)
        output = record.outputs.get(name)
        if output is None or not output.reason or None not in output.position:
            continue
        if not (errors.reason and errors.reason in output.reason):
            found.setdefault(output.reason, []).append(name)
    return found


def print_summary(results: Results, file: TextIO) -> None:
    """Print only the messages and the counts of outcomes."""
    print_messages(results, terminal.console(file))


def _of_tolerance(error: Deviation | None, factor: float) -> Text:
    if error is None:
        return Text("–")
    text = f"{factor * error.max_abs:.1e} of {factor * error.tolerance:.0e}"
    return Text(text, style="" if error.within else "bold red")


def _cells(record: Record, several: bool, reactions: bool) -> tuple[Text, ...]:
    """Return the cells of the table as text, with the engine's mode if there are several."""
    engine = f"{record.engine} · {record.mode}" if several else record.engine
    outcome = Text(record.outcome.shown, style=COLOURS.get(record.outcome, "bold red"))
    errors = [
        _error_text(worst(record, "position", of=lambda its, unit=unit: its == unit), f"[{unit}]")
        for unit in (FORCES if reactions else ())
    ]
    errors += [
        _error_text(worst(record, quantity, of=lambda its: not reactions or its not in FORCES))
        for quantity in QUANTITIES
    ]
    return Text(visible(engine)), outcome, *errors, Text(_time(record.us_per_step))


def _print_below_titles(
    rows: Sequence[tuple[str, str, tuple[Text, ...]]], heads: Sequence[str], console: Console
) -> None:
    """Print rows below their titles and remarks, in common columns."""
    lines = [head.removeprefix(">").split("\n") for head in heads]
    texts = [[*head, *(cells[k].plain for *_, cells in rows)] for k, head in enumerate(lines)]
    widths = [max(map(cell_len, column)) for column in texts]
    show_header = True
    for (title, remark), group in groupby(rows, lambda row: row[:2]):
        console.print(
            Text.assemble(
                (visible(title), "bold"), "  " if remark else "", (visible(remark), "dim")
            )
        )
        table = terminal.columns(*heads)
        for column, width in zip(table.columns, widths, strict=True):
            column.min_width = width
        for *_, cells in group:
            table.add_row(*cells)
        table.show_header, show_header = show_header, False
        console.print(terminal.indent_table(table))


def _standard(records: Sequence[Record]) -> str:
    """Return the standard of the records of a case; if engines have different ones, name them."""
    engines: dict[str, list[str]] = {}
    for record in records:
        engines.setdefault(truth(record), []).append(record.engine)
    if len(engines) == 1:
        return next(iter(engines))
    return "; ".join(f"{', '.join(names)}: {standard}" for standard, names in engines.items())


def _time(us: float | None) -> str:
    if us is None:
        return "–"
    return f"{us:.3g}" if us < 999.5 else f"{us:.0f}"


def print_signs(run: Facts, console: Console) -> None:
    """Print the sign conventions above a table of outputs."""
    for line in signs(run):
        console.print(Text(visible(line)), soft_wrap=True)


def print_messages(results: Results, console: Console) -> None:
    """Print notes on the cases, suspicions, every message, and a count of outcomes."""
    for case, note in notes(results.run):
        console.print(Text(visible(labelled(note, case))), soft_wrap=True)
    for case, why in suspects(results):
        console.print(Text(visible(f"suspect: {case}: {why}"), style="bold"), soft_wrap=True)
    said = list[str]()
    absent: dict[str, list[str]] = {}
    for (engine, outcome, message), cases in messages(results).items():
        if outcome is Outcome.UNAVAILABLE:
            absent.setdefault(message.removeprefix(f"{engine} is "), []).append(engine)
        else:
            whose = f"{outcome.shown}: {shorten_names(cases)} · {engine}"
            said.append(f"{whose}: {folded(message)}")
    said += [f"{Outcome.UNAVAILABLE}: {shorten_names(each)}: {why}" for why, each in absent.items()]
    for line in said:
        console.print(Text(visible(line, also="\n\t")), soft_wrap=True)
    counts = Counter(record.outcome for record in results.records)
    console.print(
        ", ".join(f"{count} {outcome.shown}" for outcome in Outcome if (count := counts[outcome]))
        or "nothing was run"
    )
    for lost in filter(None, (unmade(results), unread(results.run))):
        console.print(Text(visible(lost), style="bold red"), soft_wrap=True)


def truth(record: Record) -> str:
    """Return the standard of a record; "validated" means agreement with an independent truth."""
    said = "validated" if record.validated else unsound(record)
    return against(record.truth) + (f" ({said})" if said else "")


def _error_text(found: tuple[Deviation, str] | None, own: str = "") -> Text:
    if found is None:
        return Text("–")
    error, unit = found
    return Text(
        visible(f"{error.max_abs:.1e} {unit.removeprefix(own)}".rstrip()),
        style="" if error.within else "bold red",
    )


def worst(
    record: Record, quantity: str, of: Callable[[str], bool] = lambda unit: True
) -> tuple[Deviation, str] | None:
    """Return the largest error of a quantity over the outputs, and its output's unit, empty for the
    metre of the heads.

    Args:
        of: tells the units of the outputs.

    Errors out of tolerance come first, then lengths, because errors in different units cannot be
    compared. Return None if nothing was compared.
    """
    found: list[tuple[Deviation, str]] = []
    for output, errors in record.errors.items():
        unit = record.outputs[output].unit if output in record.outputs else LENGTH
        if not of(unit):
            continue
        found += [
            (each, "" if unit == LENGTH else f"[{unit}]")
            for name, each in errors.items()
            if name == quantity
        ]
    return max(
        found, key=lambda each: (not each[0].within, not each[1], each[0].max_abs), default=None
    )


def messages(results: Results) -> dict[tuple[str, Outcome, str], list[str]]:
    """Return the messages and their cases; a missing engine has one message, and a suspicion has a
    separate line.
    """
    said: dict[tuple[str, Outcome, str], list[str]] = {}
    for record in results.records:
        if record.message and not results.explains(record):
            said.setdefault((record.engine, record.outcome, record.message), []).append(record.case)
    return said


NOT_ASKED = "–"
# Characters between two columns of a table without rules.
GAP = 2


def print_matrix(results: Results, file: TextIO) -> None:
    """Print the sign conventions, a row per case and a column per engine, every message, and a
    count of outcomes. If the engines do not fit side by side, further tables follow.
    """
    console = terminal.console(file)
    print_signs(results.run, console)
    engines, rows = _engines_and_rows(results)
    for n, band in enumerate(_bands(engines, rows, console.width)):
        if n:
            console.print()
        table = FittingTable()
        table.add_column("case", overflow="fold")
        for engine in band:
            table.add_column(Text(visible(engine)), overflow="fold")
        for case, records in rows.items():
            cells = (
                _cell(records[engine]) if engine in records else Text(NOT_ASKED) for engine in band
            )
            table.add_row(Text(visible(case)), *cells)
        console.print(table)
    console.print(Text(visible(_legend(results)), style="italic"))
    print_messages(results, console)


def _bands(
    engines: Sequence[str], rows: Mapping[str, Mapping[str, Record]], width: int
) -> list[list[str]]:
    """Return the engines in groups whose columns fit beside the column of cases, at least one each,
    because truncated errors are useless.
    """
    left = width - max((cell_len(visible(case)) for case in ("case", *rows)), default=0)
    bands: list[list[str]] = [[]]
    free = left
    for engine in engines:
        cells = (cell(each[engine]) for each in rows.values() if engine in each)
        needed = GAP + max(cell_len(visible(each)) for each in (engine, NOT_ASKED, *cells))
        if bands[-1] and needed > free:
            bands.append([])
            free = left
        bands[-1].append(engine)
        free -= needed
    return bands


def to_markdown(results: Results) -> str:
    """Return the matrix in Markdown: engines with their versions, and a line for every message
    except those of passed pairs.
    """
    engines, rows = _engines_and_rows(results)
    versions = {record.engine: record.version for record in results.records if record.version}
    head = ["", *(f"{engine} {versions.get(engine, '')}".strip() for engine in engines)]
    lines = [line for each in signs(results.run) for line in (escape_markdown(f"{each}."), "")]
    lines += [row(map(escape_markdown, head)), row(["---"] * len(head))] if rows else []
    for case, records in rows.items():
        cells = (
            escape_markdown(cell(records[engine]) if engine in records else NOT_ASKED)
            for engine in engines
        )
        lines.append(row([code(case), *cells]))
    lines += ["", f"{escape_markdown(_legend(results))}."]
    lost = filter(None, (unmade(results), unread(results.run)))
    lines += [escape_markdown(f"{sentence}.") for sentence in lost]
    told = [labelled(note, case) for case, note in notes(results.run)]
    lines += [escape_markdown(f"{sentence(each)}.") for each in told]
    lines += [escape_markdown(f"Suspect: {case}: {why}.") for case, why in suspects(results)]
    lines += [
        escape_markdown(
            f"{outcome.shown.capitalize()}: {shorten_names(cases)} in {engine}: {folded(message)}."
        )
        for (engine, outcome, message), cases in messages(results).items()
        if outcome is not Outcome.PASS
    ]
    return "\n".join(lines) + "\n"


def cell(record: Record) -> str:
    """Return the result of an engine for a case as short text."""
    errors = [each for quantity in QUANTITIES if (each := worst(record, quantity)) is not None]
    if errors:
        verdict = "" if record.outcome is Outcome.PASS else f"{record.outcome.shown}: "
        return verdict + " · ".join(
            f"{error.max_abs:.0e} {unit}".rstrip() for error, unit in errors
        )
    if record.outcome is Outcome.UNJUDGED and record.residual_max is not None:
        return f"{record.outcome.shown}, residual {record.residual_max:.0e}"
    return record.outcome.shown


def _engines_and_rows(results: Results) -> tuple[list[str], dict[str, dict[str, Record]]]:
    """Return the engines, and the records by case and engine."""
    rows: dict[str, dict[str, Record]] = {}
    for record in results.records:
        rows.setdefault(record.case, {})[record.engine] = record
    return list(dict.fromkeys(record.engine for record in results.records)), rows


def _legend(results: Results) -> str:
    """Return a sentence on how to read the cells."""
    standards = sorted(
        {
            each.against
            for record in results.records
            for errors in record.errors.values()
            for _, each in errors.items()
        }
    )
    if not standards:
        return "No errors: nothing was compared with anything"
    units = " · ".join(
        with_unit(quantity, motion_unit(LENGTH, quantity)) for quantity in QUANTITIES
    )
    return f"Largest errors against {', '.join(map(against, standards))}: {units}"


def _cell(record: Record) -> Text:
    return Text(visible(cell(record)), COLOURS.get(record.outcome, "bold red"))
