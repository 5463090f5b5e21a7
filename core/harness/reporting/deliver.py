"""Results to where they were asked for: standard output, files, a folder."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias
from uuid import uuid4

from ..record import Results, to_json

if TYPE_CHECKING:  # what draws is imported where a report is asked for
    from .measures import Effort, Past


REPORT = ("results.json", "report.html")
"""The files of a folder of results."""

Named: TypeAlias = tuple[str, Path | str | None]
"""An option and the file that it names, "-" for standard output; None where it was not given."""


@dataclass(frozen=True)
class Destinations:
    """Where results are to go; None where they are not wanted.

    Attributes:
        out: folder for the results and the report.
        json: a file, or "-" for standard output, which then has nothing else.
        junit: a file.
        markdown: a file, for the matrix of cases and engines.
        store: a file, for values in bulk.
    """

    out: Path | None = None
    json: str | None = None
    junit: Path | None = None
    markdown: Path | None = None
    store: Path | None = None

    @classmethod
    def of(cls, options: argparse.Namespace) -> Destinations:
        """Those that a command's options name."""
        return cls(**{each.name: getattr(options, each.name, None) for each in fields(cls)})

    def problems(self, names: Sequence[str] = REPORT, history: Path | None = None) -> list[str]:
        """What cannot be written, found before the work and not after it; makes the folder, for files of these names."""
        found, files = list[str](), list[Named]()
        if self.out is not None:
            try:
                self.out.mkdir(parents=True, exist_ok=True)
                files += [("--out", self.out / name) for name in names]
            except OSError as error:
                found.append(f"--out {self.out}: cannot be made a folder ({error.strerror}); give another one")
        files += [("--json", self.json), ("--junit", self.junit), ("--markdown", self.markdown), ("--store", self.store)]
        return found + unwritable(files, history)


def unwritable(files: Iterable[Named], history: Path | None = None) -> list[str]:
    """What cannot be written of the files that options name, or would be written over by the next.

    Args:
        history: kept in a file of its own, which is none of these.
    """
    found = list[str]()
    seen = {} if history is None else {history.resolve(): "--history"}
    for option, name in files:
        if name in (None, "-"):
            continue
        path = Path(name)
        if path.is_dir() or not path.parent.is_dir() or not os.access(path if path.exists() else path.parent, os.W_OK):
            found.append(f"{option} {path}: cannot be written; give a file in a folder that exists and is writable")
        elif path.exists() and not path.is_file():
            continue  # a pipe or a device takes what several have to say
        elif (other := seen.setdefault(path.resolve(), option)) != option:
            found.append(f"{option} {path}: found the file of {other}, expected one of its own; give another")
    return found


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


def written(path: Path, content: Callable[[Path], object]) -> list[str]:
    """Write a file whole or not at all, what stood there until then; or why it cannot be.

    Args:
        content: writes to the path that it is given.
    """
    whole = path.resolve()  # what a link leads to
    if whole.exists() and not (whole.is_file() and os.access(whole.parent, os.W_OK)):  # a pipe, a device, or in a folder of others
        whole, part = path, path
    else:
        part = whole.with_name(f".{whole.name}.{uuid4().hex}.part")  # another run may be writing the same file
    try:
        try:
            content(part)
            if part != whole:
                part.replace(whole)
        finally:
            if part != whole:
                part.unlink(missing_ok=True)
    except OSError as error:
        return [f"{path}: cannot be written ({error.strerror}); what else was asked for is tried"]
    return []


def write_all(contents: Mapping[Path, bytes]) -> list[str]:
    """Write files, each whole or not at all; why some could not be."""

    def put(path: Path, content: bytes) -> list[str]:
        return written(path, lambda part: part.write_bytes(content))

    return [problem for path, content in contents.items() for problem in put(path, content)]


def deliver(
    results: Results,
    problems: list[str],
    to: Destinations,
    *,
    matrix: bool = False,
    precision: Mapping[str, Sequence[Effort]] | None = None,
    history: Mapping[str, Sequence[Past]] | None = None,
) -> None:
    """Print the table and write what was asked for; a file that cannot be written does not keep back the others.

    Args:
        matrix: print a line for each case, and a column for each engine, rather than a line for each pair.
        precision: error against time at several efforts, by case, for the report.
        history: what the engines made of each case in the runs up to this one, likewise.
    """
    from .matrix import print_matrix, to_markdown
    from .table import print_table

    def write(path: Path, content: Callable[[Path], object]) -> None:
        problems.extend(written(path, content))

    def write_json(path: Path) -> None:
        path.write_bytes(to_json(results))

    if to.junit is not None:
        from .junit import to_junit

        write(to.junit, lambda path: path.write_bytes(to_junit(results)))
    if to.markdown is not None:
        write(to.markdown, lambda path: path.write_text(to_markdown(results), "utf-8"))
    if to.out is not None:
        write(to.out / "results.json", write_json)
    if to.json not in (None, "-"):
        write(Path(to.json), write_json)
    if to.out is not None:
        from .report import write_report

        write(to.out / "report.html", lambda path: write_report(results, path, history=history, precision=precision))
    # last: who reads it may have gone
    (print_matrix if matrix else print_table)(results, sys.stderr if to.json == "-" else sys.stdout)
    if to.json == "-":
        sys.stdout.write(to_json(results).decode())
        sys.stdout.flush()
