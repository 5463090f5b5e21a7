"""Results to where they were asked for: standard output, files, a folder."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING

from ..record import Results, to_json

if TYPE_CHECKING:  # what draws is imported where a report is asked for
    from .measures import Effort, Past


def check_destinations(
    problems: list[str],
    *,
    out: Path | None,
    json: str | None,
    junit: Path | None = None,
    markdown: Path | None = None,
    store: Path | None = None,
    names: Sequence[str] = ("results.json", "report.html"),
) -> None:
    """Find out before the work, not after it, what cannot be written; makes the folder `out`, for files of these names."""
    if out is not None:
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            problems.append(f"--out {out}: cannot be made a folder ({error.strerror}); give another one")
            return
    files = [] if out is None else [("--out", out / name) for name in names]
    files += [("--json", Path(json))] if json not in (None, "-") else []
    files += [("--junit", junit)] if junit is not None else []
    files += [(option, file) for option, file in (("--markdown", markdown), ("--store", store)) if file is not None]
    for option, path in files:
        if path.is_dir() or not path.parent.is_dir() or not os.access(path if path.exists() else path.parent, os.W_OK):
            problems.append(f"{option} {path}: cannot be written; give a file in a folder that exists and is writable")


@contextmanager
def json_only() -> Generator[None]:
    """Keep standard output for the JSON: what simulators print meanwhile, from Python or from C, goes to standard error."""
    import ctypes

    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        if os.name == "posix":
            ctypes.CDLL(None).fflush(None)  # C keeps what it prints until it has a bufferful
        os.dup2(kept, 1)
        os.close(kept)


def deliver(
    results: Results,
    problems: list[str],
    *,
    matrix: bool,
    out: Path | None,
    json: str | None,
    junit: Path | None,
    markdown: Path | None,
    precision: Mapping[str, Sequence[Effort]] | None = None,
    history: Mapping[str, Sequence[Past]] | None = None,
) -> None:
    """Print the table and write what was asked for; a file that cannot be written does not keep back the others.

    Args:
        matrix: print a line for each case, and a column for each engine, rather than a line for each pair.
        out: folder for results.json and report.html.
        json: a file, or "-" for standard output, which then has nothing else.
        junit: a file.
        markdown: a file, for the matrix of cases and engines.
        precision: error against time at several efforts, by case, for report.html.
        history: what the engines made of each case in the runs up to this one, likewise.
    """
    from .matrix import print_matrix, to_markdown
    from .table import print_table

    def write(path: Path, content: Callable[[Path], object]) -> None:
        try:
            content(path)
        except OSError as error:
            problems.append(f"{path}: cannot be written ({error.strerror}); the other results are kept")

    def write_json(path: Path) -> None:
        path.write_bytes(to_json(results))

    if junit is not None:
        from .junit import to_junit

        write(junit, lambda path: path.write_bytes(to_junit(results)))
    if markdown is not None:
        write(markdown, lambda path: path.write_text(to_markdown(results), "utf-8"))
    if out is not None:
        write(out / "results.json", write_json)
    if json not in (None, "-"):
        write(Path(json), write_json)
    (print_matrix if matrix else print_table)(results, sys.stderr if json == "-" else sys.stdout)
    if json == "-":
        sys.stdout.write(to_json(results).decode())
        sys.stdout.flush()
    if out is not None:
        from .report import write_report

        write(out / "report.html", lambda path: write_report(results, path, history=history, precision=precision))
