"""Progress display of the command line, and messages on missing engines."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

from ..case.io.escape import visible
from ..errors import shortened
from ..extras import how_to_install

if TYPE_CHECKING:
    from ..harness.record import Record, Results


def complain(lines: Iterable[str]) -> None:
    """Print each problem on a line of standard error, after the name of the tool."""
    for line in lines:
        print(f"kincheck: {visible(line)}", file=sys.stderr)


def progress(records: list[Record], *, quiet: bool = False) -> Callable[[Record, int, int], None]:
    """Return a function that collects records and shows them on standard error: as one changing
    line on a terminal, as plain lines elsewhere, not at all if quiet.
    """
    terminal = sys.stderr.isatty()

    def show(record: Record, done: int, total: int) -> None:
        records.append(record)
        if quiet:
            return
        line = visible(f"[{done}/{total}] {record.case} {record.engine}: {record.outcome.shown}")
        if terminal:
            line = f"\r\x1b[2K{line}" if done < total else "\r\x1b[2K"
        print(line, end="" if terminal else "\n", file=sys.stderr, flush=True)

    return show


def missing_requirements(
    results: Results, required: Sequence[str], named: Sequence[str] = ()
) -> list[str]:
    """Return messages on failures of required engines and on named engines that are missing."""
    from ..harness.labels import NAMED
    from ..harness.record import Outcome
    from .table import messages

    lines: list[str] = []
    for (engine, outcome, message), cases in messages(results).items():
        if engine in required and outcome is Outcome.UNAVAILABLE:
            lines.append(f"required engine {engine!r}: {message}; {how_to_install(engine)}")
        elif engine in required and outcome is Outcome.UNSUPPORTED:
            which = shortened([*map(repr, cases)], NAMED)
            which = f"case {which} is" if len(cases) == 1 else f"cases {which} are"
            lines.append(f"required engine {engine!r}: {which} unsupported: {message}")
    lines += [
        f"engine {record.engine!r} is requested, but missing: {record.message};"
        f" {how_to_install(record.engine)}"
        for record in results.records
        if record.engine in named
        and record.engine not in required
        and record.outcome is Outcome.UNAVAILABLE
    ]
    return list(dict.fromkeys(lines))


def explain_no_comparison(results: Results) -> list[str]:
    """Return the reason if a run has compared nothing, so that no result is right or wrong."""
    from ..harness.record import Outcome

    counts = Counter(record.outcome for record in results.records)
    if any(outcome.judged for outcome in counts):
        return []
    if not counts[Outcome.UNJUDGED] and any(outcome.bad for outcome in counts):
        return [
            "nothing was solved: every installed engine that supports a case ended in an error, a"
            " timeout or a crash"
        ]
    # the run was stopped, or its cases cannot be read, which another message reports
    if not counts or results.missing:
        return []
    found = ", ".join(
        f"{counts[outcome]} {outcome.shown}" for outcome in Outcome if counts[outcome]
    )
    remedy = "give the case a reference, or run another engine beside the native one"
    return [
        f"nothing was compared ({found});"
        f" {remedy if counts[Outcome.UNJUDGED] else 'run other engines'}"
    ]
