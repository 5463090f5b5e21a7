"""kincheck history: list the stored runs, and the trends of a case and an engine."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from ..errors import KincheckError, unknown
from ..options import (
    destination,
    option,
    options,
    whole,
)
from ..report.progress import complain
from .parser import Command
from .registry import Registry, Status
from .run_options import HISTORY

if TYPE_CHECKING:
    from ..history.queries import History
    from ..history.store import RunRow, Store

LAST = 20  # runs shown by default
WRITTEN = f"written by kincheck run --history; default: the environment variable {HISTORY}"


@options
class ListRuns(Command):
    """List the runs, the latest first; for a case or an engine, list its errors and times over the
    runs, and their steps.
    """

    about: ClassVar[str] = "list the stored runs, their trends and their steps"
    history: Path | None = destination(f"history file, {WRITTEN}", Path, environment=HISTORY)
    case: tuple[str, ...] = option("trends of these cases only", metavar="NAME", several="together")
    engine: tuple[str, ...] = option(
        "trends of these engines only", metavar="NAME", several="together"
    )
    last: int = option(
        "number of latest runs; default %(default)s; 0: all", whole(0), "N", default=LAST
    )
    remove: tuple[int, ...] = option(
        "remove these runs, for example damaged ones", whole(1), "RUN", several="once"
    )
    plot: Path | None = destination(
        "draw errors and times over the runs as an HTML page", Path, "FILE.html"
    )
    export: Path | None = destination("write all runs as a table: FILE.parquet or FILE.csv", Path)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..case.io.atomic_files import require_writable
        from ..history.queries import read
        from ..history.store import Store

        if self.history is None:
            raise KincheckError(f"history: no file is given; give --history FILE, or set {HISTORY}")
        require_writable([("--plot", self.plot), ("--export", self.export)], self.history)
        with Store(Path(self.history), writable=bool(self.remove)) as store:
            for run in self.remove:
                store.remove(run)
                print(f"run {run} is removed")
            chosen: dict[str, Any] = {"cases": self.case, "engines": self.engine}
            _check_names(store, **chosen)
            history = read(store, last=self.last or None, **chosen)
            if self.case or self.engine:
                _print_trends(history)
            else:
                _print_runs(store, store.runs()[: self.last or None])
            if self.plot is not None:
                from ..report.trends import write_plot

                write_plot(
                    history,
                    self.plot,
                    title=f"{Path(self.history).name}: errors and times over the runs",
                )
                print(
                    f"{self.plot}: trends of {len(history.pairs)} pairs over {len(history.runs)}"
                    " runs"
                )
            if self.export is not None:
                from ..history.queries import export

                count = export(store, self.export, **chosen)
                print(f"{self.export}: {count} rows")
            complain(store.damage)
            return Status.FAILED if store.damage else Status.WITHIN


def _check_names(store: Store, cases: Sequence[str], engines: Sequence[str]) -> None:
    plans = [pair for row in store.runs() for pair in row.plan]
    for what, place, names in (("case", 0, cases), ("engine", 1, engines)):
        known = sorted({pair[place] for pair in plans})
        for name in names:
            if name not in known:
                raise KincheckError(f"history {store.path}: {unknown(what, name, known)}")


def _print_runs(store: Store, rows: Sequence[RunRow]) -> None:
    from ..report.terminal import columns, page

    table = columns(">run", "started", "status", "outcomes", "engines", "commit", "host", "command")
    for row in rows:
        with store.sparing(), store.explained("read", row.id):
            table.add_row(*_cells(store, row))
    page(None).print(table)
    if not rows:
        print("no runs yet")


def _cells(store: Store, row: RunRow) -> list[str]:
    from ..harness.record import Outcome
    from ..history.database import OUTCOME

    found = store.connection.execute(
        f"SELECT {OUTCOME}, engine, version FROM records WHERE run_id = ? ORDER BY rowid", (row.id,)
    ).fetchall()
    counts = Counter(outcome for outcome, _, _ in found)
    told = [f"{counts[outcome]} {outcome.shown}" for outcome in Outcome if counts[outcome]]
    missing = len(row.plan) - len(found)
    versions = {engine: version for _, engine, version in found if version}
    told += [f"{missing} missing"] if missing else []
    return [
        str(row.id),
        row.started[:16].replace("T", " "),
        row.status,
        ", ".join(told) or "–",
        ", ".join(f"{engine} {version}" for engine, version in versions.items()) or "–",
        str(row.git.get("commit") or "–")[:10] + ("+" if row.git.get("changed") else ""),
        str(row.key["host"] or "–"),
        row.command,
    ]


def _print_trends(history: History) -> None:
    from ..harness.labels import number, product
    from ..history.steps import steps
    from ..report.regressions import step_says
    from ..report.terminal import columns, page
    from ..report.trends import largest_errors, run_name

    console = page(None)
    for (case, engine, mode), entries in history.pairs.items():
        rows = [history.runs[entry.run] for entry in entries]
        errors = [
            largest_errors(entry, case, row) for entry, row in zip(entries, rows, strict=True)
        ]
        units = [*dict.fromkeys(unit for each in errors for unit in each)] or ["m"]
        table = columns(
            "run",
            "version",
            "outcome",
            *(f">error\n{unit}" for unit in units),
            ">us/step",
            title=f"{case} · {product(engine, mode)}",
        )
        for row, entry, error in zip(rows, entries, errors, strict=True):
            table.add_row(
                run_name(row),
                entry.version or "–",
                entry.outcome.shown,
                *(number(error.get(unit)) for unit in units),
                number(entry.us_per_step),
            )
        console.print(table)
    for step in steps(history):
        sign = "worse" if step.worse else "better"
        console.print(
            f"{sign}: {step.case} · {product(step.engine, step.mode)}: {step_says(step)}",
            soft_wrap=True,
        )
    if not history.pairs:
        print("no runs of these cases and engines")
