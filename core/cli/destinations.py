"""Destinations of results: standard output, files, a folder."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO, TypeAlias

from ..case.io.atomic_files import Content, Named, unwritable
from ..case.io.table_file import WRITERS, lack
from ..harness.record import Results, to_json
from .forms import contents_of_forms, files_of_forms

if TYPE_CHECKING:  # drawing code is imported only for a report
    from ..report.figures import Effort, Past

    Trends: TypeAlias = Mapping[str, Sequence[Past]] | None
    """Earlier results of each case up to this run; None if unknown."""

REPORT = ("results.json", "report.html")
"""File names in a folder of results."""


FILES = ("json", "junit", "markdown", "store", "plot", "export")
"""Options with a file to write, in every command that has them, besides those for curves."""


def files_of(options: object) -> dict[str, str | Path]:
    """Return the requested files by their options."""
    given: dict[str, Any] = {name: vars(options).get(name) for name in (*FILES, *WRITERS)}
    kinds = {name: str if name == "json" else Path for name in given}
    found = {name: file for name, file in given.items() if isinstance(file, kinds[name])}
    return found | files_of_forms(options)


def not_in_history(options: object, why: object) -> str:
    """Return a message on a run that its history does not store, and where its results are."""
    places = [*files_of(options).values(), vars(options).get("out")]
    kept = [str(each) for each in places if each is not None and str(each) != "-"]
    where = f"its results are in {' and '.join(kept)}" if kept else "say --out DIR to keep it"
    return f"{why}; the run is not in the history: {where}"


def curves_of(options: object) -> dict[str, Path]:
    """Return the requested files for curves by their kinds."""
    return {kind: Path(file) for kind, file in files_of(options).items() if kind in WRITERS}


def unwritable_of(options: object, names: Sequence[str]) -> list[str]:
    """Create the folder of --out, and return messages on unwritable destinations of a command,
    before the work starts.

    Args:
        names: files of the folder; with none, --out is a file.
    """
    found, files = list[str](), list[Named]()
    out: Path | None = vars(options).get("out")
    if out is not None and names:
        try:
            out.mkdir(parents=True, exist_ok=True)
            files += [("--out", out / name) for name in names]
        except OSError as error:
            found.append(
                f"--out {out}: cannot be made a folder ({error.strerror}); give another one"
            )
    for name, file in files_of(options).items():
        files.append((f"--{name}", file))
        missing = lack(name, f"--{name} {file}", "or give --csv FILE") if name in WRITERS else None
        found += [missing] if missing else []
    if out is not None and not names:
        files.append(("--out", out))
    return found + unwritable(files, vars(options).get("history"))


@contextmanager
def json_only() -> Generator[None]:
    """Reserve standard output for the JSON: output of simulators, from Python or C, goes to
    standard error.
    """
    import ctypes

    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        if os.name == "posix":
            ctypes.CDLL(None).fflush(None)  # C buffers its output
        os.dup2(kept, 1)
        os.close(kept)


def deliver(
    results: Results,
    problems: list[str],
    options: object,
    *,
    show: Callable[[Results, TextIO], None] | None = None,
    precision: Mapping[str, Sequence[Effort]] | None = None,
    history: Callable[[], Trends] | None = None,
) -> None:
    """Print the results and write as many of the requested files as possible.

    Args:
        options: of the command.
        show: prints the results; default: `print_table`.
        precision: error against time at several efforts, by case, for the report.
        history: reads the trends for the report, after all other files; None without a history.
    """
    from ..report import terminal
    from ..report.table import print_table, to_markdown

    given = vars(options)
    out, json, junit, markdown = (given.get(name) for name in ("out", "json", "junit", "markdown"))
    encoded = to_json(results) if out is not None or json is not None else b""
    contents = list[tuple[Path, Content]]()  # several destinations may be one pipe
    if junit is not None:
        from ..report.junit import to_junit

        contents.append((junit, lambda path: path.write_bytes(to_junit(results))))
    if markdown is not None:
        contents.append((markdown, lambda path: path.write_text(to_markdown(results), "utf-8")))
    if curves := curves_of(options):
        from ..report.curves import write_curves

        contents += [
            (file, partial(write_curves, results, kind=kind, long=bool(given.get("long"))))
            for kind, file in curves.items()
        ]

    def write_page(path: Path) -> None:
        from ..report.report import WITHOUT_TRENDS, write_report

        past = None if history is None else history()
        # a damaged history is a note in place of the trends
        limits = [WITHOUT_TRENDS] if history is not None and past is None else []
        write_report(results, path, history=past, precision=precision, limits=limits)

    if out is not None:
        contents += [(out / "results.json", encoded), (out / "report.html", write_page)]
    contents += contents_of_forms(options, results)
    problems += terminal.deliver(contents, encoded, json, partial(show or print_table, results))
