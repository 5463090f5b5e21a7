"""The matrix of cases and engines: each cell has the largest position, velocity and acceleration
error, or the reason for none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TextIO

from rich.cells import cell_len
from rich.text import Text

from ..case.io.escape import visible
from ..harness.labels import against, motion_unit, named, notes, signs, suspects, unread
from ..harness.record import Outcome, Record, Results
from ..trajectory import QUANTITIES
from ..unit_text import with_unit
from . import terminal
from .fitting_table import FittingTable
from .markdown import code, escaped, row
from .table import COLOURS, LENGTH, messages, print_messages, print_signs, worst

NOT_ASKED = "–"
# Characters between two columns of a table without rules.
GAP = 2


def print_matrix(results: Results, file: TextIO) -> None:
    """Print the sign conventions, a row per case and a column per engine, every message, and a
    count of outcomes. If the engines do not fit side by side, further tables follow.
    """
    console = terminal.console(file)
    print_signs(results.run, console)
    engines, rows = _laid_out(results)
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
    console.print(Text(visible(_reading(results)), style="italic"))
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
    engines, rows = _laid_out(results)
    versions = {record.engine: record.version for record in results.records if record.version}
    head = ["", *(f"{engine} {versions.get(engine, '')}".strip() for engine in engines)]
    lines = [line for each in signs(results.run) for line in (escaped(f"{each}."), "")]
    lines += [row(map(escaped, head)), row(["---"] * len(head))] if rows else []
    for case, records in rows.items():
        cells = (
            escaped(cell(records[engine]) if engine in records else NOT_ASKED) for engine in engines
        )
        lines.append(row([code(case), *cells]))
    lines += ["", f"{escaped(_reading(results))}."]
    lines += [escaped(f"{sentence}.") for sentence in [unread(results.run)] if sentence]
    lines += [escaped(f"Note: {case}: {note}.") for case, note in notes(results.run)]
    lines += [escaped(f"Suspect: {case}: {why}.") for case, why in suspects(results)]
    lines += [
        escaped(f"{outcome.shown.capitalize()}: {named(cases)} in {engine}: {message}.")
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


def _laid_out(results: Results) -> tuple[list[str], dict[str, dict[str, Record]]]:
    """Return the engines, and the records by case and engine."""
    rows: dict[str, dict[str, Record]] = {}
    for record in results.records:
        rows.setdefault(record.case, {})[record.engine] = record
    return list(dict.fromkeys(record.engine for record in results.records)), rows


def _reading(results: Results) -> str:
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
