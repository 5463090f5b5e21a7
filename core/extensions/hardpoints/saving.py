"""New files with other numbers: the user's own file is never written."""

from __future__ import annotations

import codecs
import csv
import math
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from io import StringIO
from pathlib import Path

from ...case.io.document import number_or_nan, read_text
from ...case.io.table import DELIMITERS, numeral
from ...errors import CaseError, KincheckError
from .options import WheelOptions
from .reader import read_hardpoints
from .table import Hardpoint, HardpointTable, axes_of, unit_of

NAME = re.compile(r"[^\W_][\w .+-]{0,80}\.csv")
"""A plain name: no folder, no hidden file."""


def free_name(file: Path) -> str:
    """Return a free name beside a file."""
    names = (f"{file.stem}_{k}.csv" for k in range(2, 1000))
    return next((name for name in names if not (file.parent / name).exists()), "")


def save_table(
    table: HardpointTable, supplied: WheelOptions, points: Sequence[Sequence[float]], name: str
) -> Path:
    """Write a table with other numbers to a new file beside its own.

    The text keeps all else; a table of another format is written as CSV with its unit, axes, side
    and template. The new file is read back.

    Raises:
        KincheckError: the name is not plain, the file exists, or cannot be written.
    """
    if not NAME.fullmatch(name):
        raise KincheckError(
            f"save {name!r}: expected a plain name that ends in .csv, of letters, digits, dots,"
            " dashes and blanks. Give another"
        )
    return write_table(table, supplied, points, table.file.parent / name, f"save {name}")


def write_table(
    table: HardpointTable,
    supplied: WheelOptions,
    points: Sequence[Sequence[float]],
    path: Path,
    option: str,
) -> Path:
    """Write a table with other numbers to a new file, as `save_table` does.

    Args:
        option: what the user gave, for messages.

    Raises:
        KincheckError: the file exists, cannot be written, or would be read with other numbers.
    """
    alone = replace(supplied, sheet=None, corner=None)  # the new file has one table
    tries = [*_texts_with_changes(table, points), new_text(table, supplied, points)]
    for content, said in zip(tries, [*[supplied] * (len(tries) - 1), alone], strict=True):
        _write(path, content, option)
        if _reads_back(path, said, supplied, table, points):
            return path
        path.unlink()
    raise KincheckError(
        f"{option}: the file would be read with other numbers. Nothing was written: save the"
        " table from the program that made it"
    )


def _write(path: Path, content: bytes, option: str) -> None:
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0)
    try:
        with open(os.open(path, flags | getattr(os, "O_BINARY", 0), 0o644), "wb") as file:
            file.write(content)
    except FileExistsError:
        raise KincheckError(f"{option}: the file exists and stays. Give another name") from None
    except OSError as error:
        raise KincheckError(
            f"{option}: cannot be written ({error.strerror}). Give another name, or start"
            " kincheck with a file in a folder that is writable"
        ) from None


def _reads_back(
    path: Path,
    said: WheelOptions,
    supplied: WheelOptions,
    table: HardpointTable,
    points: Sequence[Sequence[float]],
) -> bool:
    """Return whether a file is read as these points of the same wheel.

    Args:
        said: facts for the new file.
        supplied: facts of the table.
    """
    try:
        found = read_hardpoints(path, said)
        facts = [
            (
                *(unit_of(each, given.units).size, axes_of(each, given.axes), each.side),
                *(each.template or given.template, each.static_toe, each.static_camber),
                each.wheel_radius,
            )
            for each, given in ((found, said), (table, supplied))
        ]
    except CaseError:
        return False
    positions = {name: each.position for name, each in found.points.items()}
    wanted = {name: tuple(row) for name, row in zip(table.points, points, strict=True)}
    return facts[0] == facts[1] and positions == wanted


def _texts_with_changes(
    table: HardpointTable, points: Sequence[Sequence[float]]
) -> Iterator[bytes]:
    """Yield the text of a table with the changed numbers replaced, by each sign between fields and
    decimal sign with which the lines have the numbers of the points; none unless each point is a
    line of text.
    """
    if table.file.suffix.lower() != ".csv":
        return
    data = table.file.read_bytes()
    text = read_text(table.file, len(data), "", of_spreadsheet=True)
    encoding = next(
        name for name in ("utf-8", "utf-16", "cp1252") if _decoded(data, name).endswith(text)
    )
    mark = data[:3] if data.startswith(codecs.BOM_UTF8) else b""
    for delimiter in DELIMITERS:
        for sign in ".,":
            lines = text.splitlines(keepends=True)
            rows = zip(table.points.items(), points, strict=True)
            if delimiter != sign and all(
                _change(lines, name, old, row, delimiter, sign) for (name, old), row in rows
            ):
                yield mark + "".join(lines).encode(encoding)


def _decoded(data: bytes, encoding: str) -> str:
    """Return the text of data; empty in another encoding."""
    try:
        return data.decode(encoding)
    except UnicodeError:
        return ""


def _change(
    lines: list[str],
    name: str,
    old: Hardpoint,
    row: Sequence[float],
    delimiter: str,
    sign: str,
) -> bool:
    """Change the numbers of a point in its line; return whether the line has the old ones."""
    where = re.fullmatch(r"line (\d+)", old.where)
    if where is None:
        return False
    if tuple(row) == old.position:
        return True
    k = int(where[1]) - 1
    end = lines[k][len(lines[k].rstrip("\r\n")) :]
    fields = lines[k].removesuffix(end).split(delimiter)
    first = next((j for j, each in enumerate(fields) if each.strip(' "') == name), len(fields))
    places = range(first + 1, first + 4)
    if len(fields) < places.stop:
        return False
    for j, number, before in zip(places, row, old.position, strict=True):
        if number_or_nan(numeral(fields[j].strip(' "'), sign)) != before:
            return False
        if number != before:
            fields[j] = _number_text(number).replace(".", sign)
    lines[k] = delimiter.join(fields) + end
    return True


def new_text(
    table: HardpointTable, supplied: WheelOptions, points: Sequence[Sequence[float]]
) -> bytes:
    """Return a new table as CSV, with unit, axes, side and template."""
    known = {
        "template": table.template or supplied.template,
        "units": unit_of(table, supplied.units).name,
        "axes": table.axes or supplied.axes,
        "side": table.side,
        "wheel_radius": table.wheel_radius,
        "static_toe": table.static_toe and _degrees_text(table.static_toe),
        "static_camber": table.static_camber and _degrees_text(table.static_camber),
    }
    text = StringIO()
    text.write("".join(f"# {key}: {value}\n" for key, value in known.items() if value))
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["name", "x", "y", "z"])
    for name, row in zip(table.points, points, strict=True):
        writer.writerow([name, *map(_number_text, row)])
    return text.getvalue().encode()


def _degrees_text(angle: float) -> str:
    """Return an angle [rad] as text that is read as the same number, if one of 15 digits is."""
    text = f"{math.degrees(angle):.15g}"
    return f"{text if math.radians(float(text)) == angle else repr(math.degrees(angle))} deg"


def _number_text(number: float) -> str:
    """Return the shortest exact text of a number."""
    return str(int(number)) if number == int(number) and abs(number) < 1e15 else repr(number)
