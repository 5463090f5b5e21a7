"""Hardpoints in a text table, see `rows`. Commas, semicolons, tabs, the sign of a line `sep=`, or
blanks separate the fields.

Comments give facts: `# units: mm`, `# axes: rearward,right,up`, `# template: mcpherson`.
Spreadsheets have dialects: a line `sep=;`, quotes, separators at the end of a line, a decimal
comma.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from pathlib import Path

from ...io.document import fault, shown
from ...io.workbook import Row, require_narrow
from .assignments import is_assignments, read_assignments
from .forms import is_number
from .head import HEAD, head_place
from .rows import MOST_ROWS, read_rows, remark
from .table import HardpointTable

COMMENTS = ("#", "%", "//")
DELIMITERS = ";\t,"
# Further ones hold no points.
MOST_LINES = 2 * MOST_ROWS
_SEPARATOR = re.compile(r"\"?sep=(.)\"?", re.IGNORECASE)
_BEFORE_UNIT = re.compile(r"\s+(?=[\[(])")
_SIGNS = re.compile(rf"[{DELIMITERS}]+")


def read_plain(file: Path, text: str, wanted: str | None = None) -> HardpointTable:
    """Return the points by name.

    Args:
        wanted: section of the names, if the text has assignments of several suspensions.

    Raises:
        CaseError: no head, or a row at odds with the head.
    """
    said: dict[str, str] = {}
    lines: list[tuple[str, str]] = []
    delimiters = DELIMITERS
    for k, line in enumerate(text.splitlines(), 1):
        bare = line.strip().lstrip('"')
        if bare.startswith(COMMENTS):
            bare = f"#{bare.lstrip(''.join(COMMENTS))}"
            if fact := remark(
                _SIGNS.sub(",", bare.rstrip(f'"{DELIMITERS}')).split(","), comment=True
            ):
                said.update([fact])
        elif not lines and (found := _SEPARATOR.fullmatch(line.strip(" \r"))):
            delimiters = found.group(1)
        elif line.strip(f" \r{DELIMITERS}"):
            lines.append((f"line {k}", line))
    if not lines:
        raise fault(
            file, "", f"is empty, expected a table of hardpoints; begin it with {','.join(HEAD)}"
        )
    if is_assignments(lines):
        return read_assignments(file, lines, said, wanted)
    if len(lines) > MOST_LINES:
        raise fault(
            file,
            "",
            f"found {len(lines)} lines, expected a suspension's, {MOST_LINES} at most; take out the"
            " others",
        )
    if wanted is not None:
        raise fault(
            file,
            "--sheet",
            f"found {shown(wanted)} for a table of text, expected none; leave it out",
        )
    if delimiters == DELIMITERS and not any(_SIGNS.search(line) for _, line in lines):
        return read_rows(file, "Text", [(where, _apart(line)) for where, line in lines], said)
    delimiter = _delimiter(file, lines, delimiters)
    return read_rows(file, "CSV", _rows(file, lines, delimiter), said, delimiter)


def _apart(line: str) -> list[str]:
    """Return the cells of a line with blanks between them; a name may have blanks if numbers
    follow it, or stand before it.
    """
    words = _BEFORE_UNIT.sub("", line).split()
    numbers = [*map(is_number, words)]
    first = next((k for k in range(len(words)) if all(numbers[k:])), len(words))
    last = next((k for k, each in enumerate(numbers) if not each), len(words))
    if first < len(words) and first:
        return [" ".join(words[:first]), *words[first:]]
    if 0 < last < len(words):
        return [*words[:last], " ".join(words[last:])]
    return words


def _delimiter(file: Path, lines: Sequence[tuple[str, str]], possible: str) -> str:
    """Return the separator of a head, or else the most frequent separator of the first line."""
    first = lines[0][1]
    for line in lines:
        for delimiter in sorted(possible, key=line[1].count, reverse=True):
            row = _rows(file, [line], delimiter)
            if head_place(file, row) is not None:
                return delimiter
            if sum(map(is_number, row[0][1])) >= 3:  # a point
                return max(possible, key=first.count)
    return max(possible, key=first.count)


def _rows(file: Path, lines: Sequence[tuple[str, str]], delimiter: str) -> list[Row]:
    require_narrow(file, lines, delimiter)
    rows: list[Row] = []
    for where, line in lines:
        try:
            cells = next(csv.reader([line], delimiter=delimiter))
        except csv.Error as error:
            raise fault(file, where, f"not valid CSV: {error}; correct the line") from None
        rows.append((where, [cell.strip() for cell in cells]))
    return rows
