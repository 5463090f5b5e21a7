"""Samples of a reference table, the keys of its place, and the reader of rows in a case file."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from ..case import PER_TRAVEL, Quantity
from ..printed import Printed
from .document import decimal, fault, shown

CITATION = "a text that says where the true values come from: author, title, page or address"
DIGEST = "sha256:"


class ReferenceKeys(msgspec.Struct, forbid_unknown_fields=True):
    """Keys of [reference]: `file`, or `rows` with `columns` (default: the driver, then all outputs
    in order), and their source.

    Attributes:
        citation: source of the true values; without it, agreement with them validates nothing.
        digest: digest of the file; a file with another digest is refused.
        sheet: sheet of a workbook with several tables.
    """

    file: (
        Annotated[
            str,
            Meta(min_length=1, description="the name of a CSV or .xlsx file beside the case file"),
        ]
        | None
    ) = None
    sheet: (
        Annotated[str, Meta(min_length=1, description="the name of a sheet of an .xlsx file")]
        | None
    ) = None
    columns: (
        Annotated[
            list[str], Meta(min_length=2, description="a list of column names, the driver first")
        ]
        | None
    ) = None
    rows: (
        Annotated[
            list[list[int | float]], Meta(min_length=1, description="a list of rows of numbers")
        ]
        | None
    ) = None
    citation: Annotated[str, Meta(pattern=r"\S", description=CITATION)] | None = None
    digest: (
        Annotated[
            str,
            Meta(
                pattern=f"^{DIGEST}[0-9a-f]{{64}}$",
                description=f'"{DIGEST}" and 64 hexadecimal digits',
            ),
        ]
        | None
    ) = None


ROWS = "expected rows of numbers, one for each sample; add them"


@dataclass(frozen=True)
class Samples:
    """Columns by name, and rows with their place for messages.

    Attributes:
        key: key of all rows.
        signs: sign convention named in a comment.
        lines: lines of a separate file, for messages.
        printed: digits of the numbers, by column.
    """

    file: Path
    header: str
    columns: Sequence[str]
    rows: Sequence[tuple[str, Sequence[float]]]
    key: str = ""
    signs: str = ""
    lines: Sequence[str] = ()
    printed: Sequence[Printed] = ()

    def driver_value(self, k: int) -> str:
        """Return the driver value of a row as written."""
        where, row = self.rows[k]
        line = self.lines[int(where.removeprefix("line ")) - 1] if self.lines else ""
        cell = line.partition(",")[0].strip().strip('"').strip()
        with suppress(ValueError):  # rows in the case file, or a row of several lines
            if decimal(cell) == row[0]:
                return cell
        return repr(row[0])


def inline(file: Path, keys: ReferenceKeys, outputs: Sequence[Quantity]) -> Samples:
    """Return the samples of the rows in a case file."""
    if keys.rows is None:
        raise fault(
            file,
            "reference",
            "found neither file nor rows, expected one of them; name a CSV file or give the rows",
        )
    columns = keys.columns or [
        "driver",
        *(output.name for output in outputs if not output.name.endswith(PER_TRAVEL)),
    ]
    key = "reference.rows"
    rows = [(f"{key}[{k}]", row) for k, row in enumerate(keys.rows)]
    printed = [Printed() for _ in columns]
    if not rows:
        raise fault(file, key, f"found none, {ROWS}")
    samples = Samples(file, "reference.columns", columns, rows, key, printed=printed)
    for where, row in rows:
        check_width(file, where, len(row), columns)
        for column, number in zip(printed, row, strict=True):
            column.add(repr(number))
    return samples


def only_beside(case_file: Path, keys: ReferenceKeys) -> Path:
    """Return the path of the file; it must be the only source."""
    if keys.rows is not None or keys.columns is not None:
        raise fault(
            case_file,
            "reference",
            "found file and rows or columns, expected one source; remove one of them",
        )
    return beside(case_file, keys.file or "")


def beside(case_file: Path, name: str) -> Path:
    """Return the path of a file in or below the case file's folder; any other path is refused."""
    folder = case_file.parent.resolve()
    try:
        file = (folder / name).resolve()
        inside = not Path(name).is_absolute() and file.is_relative_to(folder)
    except (OSError, ValueError, RuntimeError):  # a null byte, a loop of links
        inside = False
        file = folder
    with suppress(OSError):  # the reader reports an inaccessible file
        inside = inside and not file.is_symlink()  # a loop of links: Python 3.13 resolves it
    if not inside:
        raise fault(
            case_file,
            "reference.file",
            f"found {shown(name)}, expected a file in the folder of the case file or below; put it"
            " there and give its name",
        )
    with suppress(OSError):  # the reader reports an inaccessible file
        if not file.exists():
            raise fault(
                case_file,
                "reference.file",
                f"found {shown(name)}, but there is no such file; check the name",
            )
    return file


def sha256(file: Path) -> str:
    """Return the digest of a file, as `sha256sum` prints it."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def check_width(file: Path, where: str, found: int, columns: Sequence[str]) -> None:
    """Refuse a row without a number for each column."""
    if found != len(columns):
        expected = f"{len(columns)} ({', '.join(columns)})"
        raise fault(file, where, f"found {found} numbers, expected {expected}; complete the row")
