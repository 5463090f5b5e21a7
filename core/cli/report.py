"""kincheck report: show changes since another run."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from ..errors import KincheckError
from ..options import (
    argument,
    destination,
    json_file,
    option,
    options,
    switch,
    verbosity,
)
from ..report.progress import complain
from .history import HISTORY, WRITTEN
from .parser import Command
from .registry import Registry, Status

if TYPE_CHECKING:
    from ..history.findings import Regressions
    from ..history.runs import Subject
    from ..history.store import Store

OUT = ("regressions.json", "regressions.md", "junit.xml", "report.html")


@options
class ReportChanges(Command):
    """Report the changes since another run: new failures, fixes, lost results, lower accuracy,
    longer times, changed versions, the first run of each change, and tolerances to tighten.

    Exit status: 0 no regression, 1 a regression, 2 the tool could not do its work.
    """

    about: ClassVar[str] = "report the changes since another run"
    subject: str | None = argument(
        "number of a run in the history, or a results.json; default: the latest run, or an"
        " earlier one of another selection that failed and was not green since",
        "RUN",
        "?",
    )
    against: str = option(
        "run to compare with: a number or file, last-green (an earlier run without faults and"
        " with the most of the run's comparisons, the latest of several) or BRANCH-baseline"
        " (likewise, on that branch without uncommitted changes); default %(default)s",
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
        from ..history.comparison import regressions
        from ..history.runs import find, find_against
        from ..history.store import Store
        from ..report.regressions import print_regressions, to_markdown
        from .destinations import Destinations

        if problems := Destinations.of(self).problems(OUT, self.history):
            raise KincheckError("\n".join(problems))
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
            file = sys.stderr if self.json == "-" else sys.stdout
            if file.isatty() and not self.quiet:
                print_regressions(found, file)
            else:
                text = to_markdown(found)
                headline = text.partition("\n")[0].removeprefix("## ") + "\n"
                print(headline if self.quiet else text, end="", file=file)
            _write(self, subject, found, store, problems)
            problems += store.damage if store is not None else []
        complain(problems)
        if problems:
            return Status.FAILED
        return Status.DEVIATES if found.regressed else Status.WITHIN


def _write(
    options: ReportChanges,
    subject: Subject,
    found: Regressions,
    store: Store | None,
    problems: list[str],
) -> None:
    """Write as many of the requested files as possible."""
    from ..case.io.atomic_files import to_standard_output, written
    from ..harness.record import to_json
    from ..history.queries import NIGHTS, read
    from ..report.junit import to_regression_junit
    from ..report.regressions import to_markdown, to_markup
    from ..report.report import write_report
    from ..report.trends import trends

    def page(path: Path) -> None:
        past = trends(read(store, last=NIGHTS, like=subject.facts)) if store is not None else None
        write_report(subject.results, path, history=past, changes=to_markup(found))

    contents: dict[str, Callable[[Path], object]] = {
        "regressions.json": lambda path: path.write_bytes(to_json(found)),
        "regressions.md": lambda path: path.write_text(to_markdown(found), "utf-8"),
        "junit.xml": lambda path: path.write_bytes(to_regression_junit(subject.results, found)),
        "report.html": page,
    }
    wanted = (
        [(options.out / name, write) for name, write in contents.items()]
        if options.out is not None
        else []
    )
    named = (
        ("regressions.json", options.json),
        ("regressions.md", options.markdown),
        ("junit.xml", options.junit),
    )
    wanted += [(Path(path), contents[name]) for name, path in named if path not in (None, "-")]
    for path, write in wanted:
        problems += written(path, write)
    if options.json == "-":
        to_standard_output(to_json(found))
