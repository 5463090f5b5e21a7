"""Commands for stored runs: kincheck history and report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from ..errors import KincheckError, refuse, unknown
from ..options import argument, destination, json_file, option, options, switch, verbosity, whole
from ..report.progress import complain
from .parser import Command
from .registry import Registry, Status
from .shared_options import HISTORY

if TYPE_CHECKING:
    from ..case.io.atomic_files import Content
    from ..history.findings import Regressions
    from ..history.queries import History
    from ..history.runs import Subject
    from ..history.store import RunRow, Store


LAST = 20  # runs shown by default
WRITTEN = f"written by kincheck run --history; default: the environment variable {HISTORY}"


@options
class ListRuns(Command):
    """List the runs, the latest first; for a case or an engine, list its errors and times over the
    runs, and their steps.
    """

    about = "list the stored runs, their trends and their steps"
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
    accept: tuple[str, ...] = option(
        "accept what is worse in the last run of a case in an engine, which becomes their"
        " baseline; needs --reason",
        metavar="CASE:ENGINE",
        several="once",
    )
    reason: str | None = option("why it is accepted, for the next report", metavar="TEXT")
    plot: Path | None = destination(
        "draw errors and times over the runs as an HTML page", Path, "FILE.html"
    )
    export: Path | None = destination("write all runs as a table: FILE.parquet or FILE.csv", Path)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..history.judging import accept
        from ..history.queries import read
        from ..history.store import Store
        from ..report.regressions import accepted_says

        if self.history is None:
            raise KincheckError(
                f"history: no file is given. Give --history FILE, or set {HISTORY}."
            )
        refuse(self.unwritable())
        reason = (self.reason or "").strip()
        if bool(self.accept) != bool(reason):
            raise KincheckError(
                "history: --accept and --reason belong together. Give both, for example --accept"
                ' crank:mujoco --reason "MuJoCo 4 sums in another order".'
            )
        with Store(Path(self.history), writable=bool(self.remove or self.accept)) as store:
            for run in self.remove:
                store.remove(run)
                print(f"run {run} is removed")
            for found in accept(store, self.accept, reason):
                print(accepted_says(found))
            chosen: dict[str, Any] = {"cases": self.case, "engines": self.engine}
            plans = [pair for row in store.runs() for pair in row.plan]
            for place, (what, names) in enumerate((("case", self.case), ("engine", self.engine))):
                known = sorted({pair[place] for pair in plans})
                for name in names:
                    if name not in known:
                        raise KincheckError(f"history {store.path}: {unknown(what, name, known)}")
            history = read(store, last=self.last or None, **chosen)
            if self.case or self.engine:
                _print_trends(history)
            else:
                _print_runs(store, store.runs()[: self.last or None])
            if self.plot is not None:
                from ..case.io.atomic_files import write
                from ..report.trends import page

                title = f"{Path(self.history).name}: errors and times over the runs"
                write("--plot", self.plot, page(history, title).encode())
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
        told = zip(entries, rows, strict=True)
        errors = [largest_errors(entry, row, rows[-1]) for entry, row in told]
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


OUT = ("regressions.json", "regressions.md", "junit.xml", "report.html")


@options
class ReportChanges(Command):
    """Report the changes since another run: new failures, fixes, lost results, lower accuracy,
    longer times, changed versions, the first run of each change, and tolerances to tighten.

    Exit status: 0 no regression, 1 a regression, 2 the tool could not do its work.
    """

    about = "report the changes since another run"
    subject: str | None = argument(
        "number of a run in the history, or a results.json; default: the latest run, or an"
        " earlier one of another selection that failed and was not green since",
        "RUN",
        "?",
    )
    against: str = option(
        "run to compare with: a number or file, last-green (of each pair the last run that was no"
        " worse than the one before, or was accepted) or BRANCH-baseline (the run of that branch,"
        " without uncommitted changes, with most of its pairs); default %(default)s",
        metavar="RUN",
        default="last-green",
    )
    missing_is_failure: bool = switch(
        "exit with status 1 also if a case or an engine is missing that is in the run compared"
        " with, or in the last run of the same selection; for nightly runs"
    )
    history: Path | None = destination(
        f"history of the runs, their steps and their spread, {WRITTEN}", Path, environment=HISTORY
    )
    out: Path | None = destination(f"write {', '.join(OUT)} there", Path, "DIR")
    json: str | None = json_file("the changes")
    junit: Path | None = destination(
        "write the run as JUnit XML, with a failure for every regression", Path
    )
    markdown: Path | None = destination(
        "write the summary as Markdown, for a pull request or an e-mail", Path
    )
    quiet: bool = verbosity("print only the headline")

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..harness.record import to_json
        from ..history.comparison import regressions
        from ..history.runs import find, find_against
        from ..history.store import Store
        from ..report.regressions import print_regressions, to_markdown
        from ..report.terminal import deliver

        refuse(self.unwritable(*OUT))
        problems = list[str]()
        with ExitStack() as open_files:
            store = (
                open_files.enter_context(Store(Path(self.history), writable=False))
                if self.history
                else None
            )
            subject = find(self.subject, store)
            against, reason = find_against(self.against, subject, store)
            found = regressions(
                subject, against, reason, store, missing_is_failure=self.missing_is_failure
            )

            def show(file: TextIO) -> None:
                if file.isatty() and not self.quiet:
                    print_regressions(found, file)
                    return
                text = to_markdown(found)
                headline = text.partition("\n")[0].removeprefix("## ") + "\n"
                print(headline if self.quiet else text, end="", file=file)

            contents = _contents(self, subject, found, store)
            problems += deliver(contents, to_json(found), self.json, show)
            problems += store.damage if store is not None else []
        complain(problems)
        if problems:
            return Status.FAILED
        return Status.DEVIATES if found.regressed else Status.WITHIN


def _contents(
    options: ReportChanges, subject: Subject, found: Regressions, store: Store | None
) -> list[tuple[Path, Content]]:
    """Return the requested files."""
    from ..harness.record import to_json
    from ..history.queries import NIGHTS, read
    from ..report.junit import to_regression_junit
    from ..report.regressions import to_markdown, to_markup
    from ..report.report import write_report
    from ..report.trends import trends

    def page(path: Path) -> None:
        past = trends(read(store, last=NIGHTS, like=subject.facts)) if store is not None else None
        write_report(subject.results, path, history=past, changes=to_markup(found))

    def markdown(path: Path) -> None:
        path.write_text(to_markdown(found), "utf-8")

    def junit(path: Path) -> None:
        path.write_bytes(to_regression_junit(subject.results, found))

    folder = zip(OUT, (to_json(found), markdown, junit, page), strict=True)
    wanted = [] if options.out is None else [(options.out / name, each) for name, each in folder]
    named = ((options.markdown, markdown), (options.junit, junit))
    return [*wanted, *((path, each) for path, each in named if path is not None)]
