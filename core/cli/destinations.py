"""Destinations of results: standard output, files, a folder."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TextIO, TypeAlias

from ..case.io.atomic_files import Content, Named, to_standard_output, unwritable, write_all
from ..case.io.table_file import no_parquet
from ..harness.record import Results, to_json

if TYPE_CHECKING:  # drawing code is imported only for a report
    from ..report.figure_data import Effort, Past

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
        csv, parquet: files, for the curves.
    """

    out: Path | None = None
    json: str | None = None
    junit: Path | None = None
    markdown: Path | None = None
    store: Path | None = None
    csv: Path | None = None
    parquet: Path | None = None

    @classmethod
    def of(cls, options: argparse.Namespace) -> Destinations:
        """Return the destinations named by a command's options."""
        return cls(**{each.name: getattr(options, each.name, None) for each in fields(cls)})

    @property
    def wanted(self) -> bool:
        """Return whether any destination is wanted."""
        return any(getattr(self, each.name) is not None for each in fields(self))

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
            ("--csv", self.csv),
            ("--parquet", self.parquet),
        ]
        if self.parquet is not None:
            lack = no_parquet(f"--parquet {self.parquet}", "or give --csv FILE")
            found += [lack] if lack else []
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
    from ..report.matrix import to_markdown
    from ..report.table import print_table

    encoded = to_json(results) if to.out is not None or to.json is not None else b""
    contents = list[tuple[Path, Content]]()  # several destinations may be one pipe
    if to.junit is not None:
        from ..report.junit import to_junit

        contents.append((to.junit, lambda path: path.write_bytes(to_junit(results))))
    if to.markdown is not None:
        contents.append((to.markdown, lambda path: path.write_text(to_markdown(results), "utf-8")))
    if to.json not in (None, "-"):
        contents.append((Path(to.json), encoded))
    if to.csv is not None or to.parquet is not None:
        from ..report.curves import write_curves_csv, write_curves_parquet

        kinds = (to.csv, write_curves_csv), (to.parquet, write_curves_parquet)
        contents += [(file, partial(kind, results)) for file, kind in kinds if file is not None]
    if to.out is not None:
        contents.append((to.out / "results.json", encoded))
        contents.append(
            (to.out / "report.html", lambda path: _write_page(results, path, precision, history))
        )
    problems += write_all(contents)
    # last: the reader of standard output may have closed it
    (show or print_table)(results, sys.stderr if to.json == "-" else sys.stdout)
    if to.json == "-":
        to_standard_output(encoded)


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
