"""Destinations of results: standard output, files, a folder."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TextIO, TypeAlias

from ..case.io.atomic_files import Content, Named, unwritable
from ..case.io.table_file import WRITERS, lack
from ..harness.record import Results, to_json

if TYPE_CHECKING:  # drawing code is imported only for a report
    from ..report.figures import Effort, Past

    Trends: TypeAlias = Mapping[str, Sequence[Past]] | None
    """Earlier results of each case up to this run; None if unknown."""

REPORT = ("results.json", "report.html")
"""File names in a folder of results."""


@dataclass(frozen=True)
class Destinations:
    """Destinations of results; None for an unwanted one.

    Attributes:
        out: folder for the results and the report.
        json: a file, or "-" for standard output, which then holds nothing else.
        junit: a file.
        markdown: a file, for the matrix of cases and engines.
        store: a file, for values in bulk.
        csv, parquet, xlsx: files, for the curves.
        long: whether curves of hardpoint tables have a row per output and sample too.
    """

    out: Path | None = None
    json: str | None = None
    junit: Path | None = None
    markdown: Path | None = None
    store: Path | None = None
    csv: Path | None = None
    parquet: Path | None = None
    xlsx: Path | None = None
    long: bool = False

    @classmethod
    def of(cls, options: object) -> Destinations:
        """Return the destinations named by a command's options."""
        names = [each.name for each in fields(cls)]
        return cls(**{name: value for name, value in vars(options).items() if name in names})

    @property
    def wanted(self) -> bool:
        """Return whether any destination is wanted."""
        return self != Destinations(long=self.long)

    @property
    def curves(self) -> dict[str, Path]:
        """Return the files for the curves by their kinds."""
        files = {kind: getattr(self, kind) for kind in WRITERS}
        return {kind: file for kind, file in files.items() if file is not None}

    def problems(self, names: Sequence[str] = REPORT, history: Path | None = None) -> list[str]:
        """Create the folder, and return messages on unwritable destinations, before the work
        starts.

        Args:
            names: files of the folder.
        """
        found, files = list[str](), list[Named]()
        if self.out is not None:
            try:
                self.out.mkdir(parents=True, exist_ok=True)
                files += [("--out", self.out / name) for name in names]
            except OSError as error:
                found.append(
                    f"--out {self.out}: cannot be made a folder ({error.strerror}); give"
                    " another one"
                )
        files += [
            ("--json", self.json),
            ("--junit", self.junit),
            ("--markdown", self.markdown),
            ("--store", self.store),
        ]
        for kind, file in self.curves.items():
            files.append((f"--{kind}", file))
            missing = lack(kind, f"--{kind} {file}", "or give --csv FILE")
            found += [missing] if missing else []
        return found + unwritable(files, history)


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
    to: Destinations,
    *,
    show: Callable[[Results, TextIO], None] | None = None,
    precision: Mapping[str, Sequence[Effort]] | None = None,
    history: Callable[[], Trends] | None = None,
) -> None:
    """Print the results and write as many of the requested files as possible.

    Args:
        show: prints the results; default: `print_table`.
        precision: error against time at several efforts, by case, for the report.
        history: reads the trends for the report, after all other files; None without a history.
    """
    from ..report import terminal
    from ..report.table import print_table, to_markdown

    encoded = to_json(results) if to.out is not None or to.json is not None else b""
    contents = list[tuple[Path, Content]]()  # several destinations may be one pipe
    if to.junit is not None:
        from ..report.junit import to_junit

        contents.append((to.junit, lambda path: path.write_bytes(to_junit(results))))
    if to.markdown is not None:
        contents.append((to.markdown, lambda path: path.write_text(to_markdown(results), "utf-8")))
    if to.curves:
        from ..report.curves import write_curves

        contents += [
            (file, partial(write_curves, results, kind=kind, long=to.long))
            for kind, file in to.curves.items()
        ]
    if to.out is not None:
        contents.append((to.out / "results.json", encoded))
        contents.append(
            (to.out / "report.html", lambda path: _write_page(results, path, precision, history))
        )
    problems += terminal.deliver(contents, encoded, to.json, partial(show or print_table, results))


def _write_page(
    results: Results,
    path: Path,
    precision: Mapping[str, Sequence[Effort]] | None,
    history: Callable[[], Trends] | None,
) -> None:
    """Write the report; for a damaged history, write a note in place of the trends."""
    from ..report.report import WITHOUT_TRENDS, write_report

    past = None if history is None else history()
    limits = [WITHOUT_TRENDS] if history is not None and past is None else []
    write_report(results, path, history=past, precision=precision, limits=limits)
