"""New files with other numbers: the user's own file is never written."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Sequence
from io import StringIO
from pathlib import Path

from ...case.io.reader_options import Supplied
from ...case.models.files import read_hardpoints
from ...errors import CaseError, KincheckError
from .table import HardpointTable, unit_of

NAME = re.compile(r"[^\W_][\w .+-]{0,80}\.csv")
"""A plain name: no folder, no hidden file."""


def free_name(file: Path) -> str:
    """Return a free name beside a file."""
    names = (f"{file.stem}_{k}.csv" for k in range(2, 1000))
    return next((name for name in names if not (file.parent / name).exists()), "")


def save_table(
    table: HardpointTable, supplied: Supplied, points: Sequence[Sequence[float]], name: str
) -> Path:
    """Write a table with other numbers to a new file beside its own.

    The text keeps all else; a table of another format is written as CSV with its unit, axes and
    template. The new file is read back.

    Raises:
        KincheckError: the name is not plain, the file exists, or cannot be written.
    """
    if not NAME.fullmatch(name):
        raise KincheckError(
            f"save {name!r}: expected a plain name that ends in .csv, of letters, digits, dots,"
            " dashes and blanks; give another"
        )
    return write_table(table, supplied, points, table.file.parent / name, f"save {name}")


def write_table(
    table: HardpointTable,
    supplied: Supplied,
    points: Sequence[Sequence[float]],
    path: Path,
    option: str,
) -> Path:
    """Write a table with other numbers to a new CSV file, as `save_table` does.

    Args:
        option: what the user gave, for messages.

    Raises:
        KincheckError: the file exists, or cannot be written.
    """
    content = _text_with_changes(table, points) or _new_text(table, supplied, points)
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0)
    try:
        with open(os.open(path, flags, 0o644), "w", encoding="utf-8", newline="") as file:
            file.write(content)
    except FileExistsError:
        raise KincheckError(f"{option}: the file exists and stays; give another name") from None
    except OSError as error:
        raise KincheckError(
            f"{option}: cannot be written ({error.strerror}); give another name, or start"
            " kincheck with a file in a folder that is writable"
        ) from None
    if not _reads_back(path, supplied, table, points):
        path.unlink()
        raise KincheckError(
            f"{option}: the file would be read with other numbers; nothing was written: save"
            " the table from the program that made it"
        )
    return path


def _reads_back(
    path: Path, supplied: Supplied, table: HardpointTable, points: Sequence[Sequence[float]]
) -> bool:
    """Return whether a file is read as these points."""
    try:
        found = read_hardpoints(path, supplied)
    except CaseError:
        return False
    angles = (found.static_toe, found.static_camber) == (table.static_toe, table.static_camber)
    positions = {name: each.position for name, each in found.points.items()}
    wanted = {name: tuple(row) for name, row in zip(table.points, points, strict=True)}
    return angles and positions == wanted


def _text_with_changes(table: HardpointTable, points: Sequence[Sequence[float]]) -> str | None:
    """Return the text of a table with the changed numbers replaced; None unless each point is a
    line of text with plain numbers.
    """
    if table.file.suffix.lower() != ".csv":
        return None
    lines = table.file.read_text("utf-8").splitlines(keepends=True)
    for (name, old), row in zip(table.points.items(), points, strict=True):
        if tuple(row) == old.position:
            continue
        where = re.fullmatch(r"line (\d+)", old.where)
        if where is None:
            return None
        k = int(where[1]) - 1
        fields = re.split(r"([,;\t])", lines[k].rstrip("\r\n"))
        first = next((j for j, each in enumerate(fields) if each.strip(' "') == name), None)
        if first is None or len(fields) < first + 7:
            return None
        for axis, (number, before) in enumerate(zip(row, old.position, strict=True)):
            if number != before:
                fields[first + 2 * axis + 2] = _number_text(number)
        end = lines[k][len(lines[k].rstrip("\r\n")) :]
        lines[k] = "".join(fields) + end
    return "".join(lines)


def _new_text(table: HardpointTable, supplied: Supplied, points: Sequence[Sequence[float]]) -> str:
    """Return a new table as CSV, with unit, axes and template."""
    known = {
        "template": table.template or supplied.template,
        "units": unit_of(table, supplied.units).name,
        "axes": table.axes or supplied.axes,
    }
    text = StringIO()
    text.write("".join(f"# {key}: {value}\n" for key, value in known.items() if value))
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["name", "x", "y", "z"])
    for name, row in zip(table.points, points, strict=True):
        writer.writerow([name, *map(_number_text, row)])
    return text.getvalue()


def _number_text(number: float) -> str:
    """Return the shortest exact text of a number."""
    return str(int(number)) if number == int(number) and abs(number) < 1e15 else repr(number)
