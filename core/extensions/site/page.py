"""The page of a site: changes by release, runs, boards and pages, each row with its repetition."""

from __future__ import annotations

import html
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from ...errors import number_of
from ...harness.labels import number, product
from ...harness.record import Outcome, Results
from ...report.sections import Report, Section
from ...version import VERSION
from ..bisect.results import NEITHER, Bisection
from ..board.results import Board
from .documents import Document

Line = tuple[tuple[str, ...], str, bool]
"""Cells of a row, its link, and whether it is wrong."""

COLUMNS: Mapping[str, Sequence[str]] = {
    "Changes by release": ("engine", "change", "kind", "cases", "right", "field", "repeat by"),
    "Runs": ("engine", "release", "outcome", "cases", "repeat by"),
    "Board": ("case", "stepper", "release", "outcome", "error [m]"),
    "Speed": ("case", "engine", "release", "us/step"),
    "Pages": ("kind", "page"),
}
LABELS = {"Board": 4, "Speed": 3}
RUN_PAGES = "report.html", "kc.html"
PAGES = "findings", "gallery", "benchmarks"


def report(folder: Path, found: Sequence[tuple[Path, Document]]) -> Report:
    """Return the page over the documents of a folder."""
    lines: dict[str, list[Line]] = {name: [] for name in COLUMNS}
    for path, document in found:
        if isinstance(document, Bisection):
            lines["Changes by release"] += _changes(folder, path, document)
        elif isinstance(document, Board):
            lines["Board"] += _board(folder, path, document)
        else:
            link = _link(folder, path, *map(path.with_name, RUN_PAGES))
            lines["Runs"] += _runs(link, document)
            lines["Speed"] += _speed(link, document)
    lines["Pages"] += _pages(folder)
    wrong = sum(bad for each in lines.values() for _, _, bad in each)
    return Report(
        "index",
        f"{number_of(wrong, 'row')} wrong" if wrong else "Nothing is wrong",
        [f"kincheck {VERSION}", number_of(len(found), "document")],
        [_section(name, each) for name, each in lines.items() if each],
        linked=True,
    )


def _link(folder: Path, document: Path, *pages: Path) -> str:
    """Return the first of these pages that is in the folder, else the document itself; a link to a
    folder would list its files when the page is opened from the disk.
    """
    return next((each for each in pages if (folder / each).is_file()), document).as_posix()


def _section(name: str, lines: Sequence[Line]) -> Section:
    lines = sorted(lines, key=lambda line: not line[2])
    columns = COLUMNS[name]
    rows = [cells for cells, _, _ in lines]
    return Section(
        name,
        [f"Wrong: {' · '.join(cells[:4])}" for cells, _, bad in lines if bad],
        [],
        columns,
        LABELS.get(name, len(columns)),
        rows,
        links=[link for _, link, _ in lines],
        wrong=[place for place, (_, _, bad) in enumerate(lines) if bad],
    )


def _changes(folder: Path, path: Path, found: Bisection) -> Iterator[Line]:
    """Yield the changes; one for the worse is wrong. Without changes, one row says so."""
    page = path.with_suffix(".html")
    for each in found.changes:
        name = f"{found.package} {each.earlier} → {each.later}"
        made = [path.parent / each.reproducer / "README.md"] if each.reproducer else []
        worse = each.kind == "result" and each.right in (each.earlier, NEITHER)
        link = _link(folder, path, *made, page)
        cells = (each.kind, ", ".join(each.cases), each.right, each.field or "", each.repeat)
        yield (found.engine, name, *cells), link, worse
    if not found.changes:
        name = f"{found.package} {' → '.join(found.ends)}"
        tried = f"none in {number_of(len(found.tried), 'release')}"
        link = _link(folder, path, page)
        yield (found.engine, name, tried, "", "", "", found.command), link, False


def _runs(link: str, found: Results) -> Iterator[Line]:
    """Yield the cases of each engine and outcome."""
    groups: dict[tuple[str, str, Outcome], list[str]] = {}
    for each in found.records:
        key = product(each.engine, each.mode), each.version or "", each.outcome
        groups.setdefault(key, []).append(each.case)
    for (engine, version, outcome), cases in groups.items():
        bad = outcome.bad
        names = ", ".join(cases) if bad else number_of(len(cases), "case")
        repeat = f"kincheck run {' '.join(cases)} --engine {engine.partition(' ')[0]}" * bad
        yield (engine, version, outcome.shown, names, repeat), link, bad


def _speed(link: str, found: Results) -> Iterator[Line]:
    for each in found.records:
        if each.us_per_step is not None:
            name = product(each.engine, each.mode)
            cells = each.case, name, each.version or "", number(each.us_per_step)
            yield cells, link, False


def _board(folder: Path, path: Path, found: Board) -> Iterator[Line]:
    for each in found.rows:
        error = number(each.runs[-1].error if each.runs else None)
        made = [path.parent / each.folder / "run.py"] if each.folder else []
        own = [path.with_name("index.html")] if path.parent.name else []
        link = _link(folder, path, *made, *own)
        bad = each.state in ("timeout", "crashed")
        yield (each.case, each.name, each.version, each.state, error), link, bad


def _pages(folder: Path) -> Iterator[Line]:
    """Yield the documentation's pages of findings, gallery and speed, if it is built there."""
    for name in PAGES:
        for file in sorted(
            [*folder.glob(f"docs/{name}.html"), *folder.glob(f"docs/{name}/**/*.html")]
        ):
            title = re.search(r"<title>(.*?)( - kincheck)?</title>", file.read_text("utf-8"), re.S)
            text = html.unescape(title[1]).strip() if title else file.parent.name
            yield (name, text), file.relative_to(folder).as_posix(), False
