"""The reference of a case: samples of its outputs, from a CSV file beside the case file or from
rows inside it, or proved ones.

First column: driver values, on the grid of the sweep, for nothing is interpolated. Further columns:
OUTPUT, OUTPUT.velocity, OUTPUT.acceleration, in the units of the case file. Outputs without a
column have no reference, and the comparison says so. A file ending in .json is a proved reference
(`harness.references`), in SI units.

A file with columns of suspension outputs names the convention of their signs in a comment, "#
signs: iso8855" for one, so that it can be read by itself and is not taken for one with other signs.
"""

from __future__ import annotations

import csv
import math
import re
from array import array
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeAlias

import msgspec
import numpy as np
from msgspec import Meta

from ...errors import remedy
from ...trajectory import Array
from ..case import PER_TRAVEL, Origin, Quantity, Series
from ..units import Unit
from .document import LARGEST, decimal, fault, read_text, sha256, shown
from .reference_file import read, series

LARGEST_FILE = 64_000_000
# As many samples as a sweep can have, and as many lines between them.
MOST_LINES = 2_000_000
DERIVATIVES = (".velocity", ".acceleration")
# Twelve digits of a driver value: what is off by less moves no output by as much as a tolerance; a
# rounded table is off by more.
SAME_GRID = 1e-12
SIGNS = re.compile(r"\s*#\s*signs:\s*(\w+)")

CITATION = "a text that says where the true values come from: author, title, page or address"
DIGEST = "sha256:"

Convert: TypeAlias = Callable[[float], float]
"""From the unit of a file to SI."""


class ReferenceKeys(msgspec.Struct, forbid_unknown_fields=True):
    """Keys of [reference]: `file`, or `rows` with `columns` (default: the driver, then all outputs
    in order), and their source.

    Attributes:
        citation: where the true values come from; without, agreement with them validates nothing.
        digest: of the file; one of another content is refused.
    """

    file: (
        Annotated[
            str, Meta(min_length=1, description="the name of a CSV file beside the case file")
        ]
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


@dataclass(frozen=True)
class _Samples:
    """Columns by name, rows with the place to name in messages, the key of all of them, and the
    convention that a comment names.

    Attributes:
        lines: of a file of its own, for messages.
    """

    file: Path
    header: str
    columns: Sequence[str]
    rows: Sequence[tuple[str, Sequence[float]]]
    key: str = ""
    signs: str = ""
    lines: Sequence[str] = ()

    def driver_value(self, k: int) -> str:
        """The driver value of a row as it is written."""
        where, row = self.rows[k]
        line = self.lines[int(where.removeprefix("line ")) - 1] if self.lines else ""
        cell = line.partition(",")[0].strip().strip('"').strip()
        with suppress(ValueError):  # inline, or of several lines
            if decimal(cell) == row[0]:
                return cell
        return repr(row[0])


def is_derivative(name: str) -> bool:
    """Whether a column of that name holds a velocity or acceleration."""
    return name.endswith(DERIVATIVES)


def read_reference(
    case_file: Path,
    keys: ReferenceKeys,
    driver: Unit,
    units: Mapping[str, Convert],
    values: Array,
    outputs: Sequence[Quantity],
    convention: str,
) -> dict[str, Series]:
    """True values by output name, SI.

    Args:
        driver: the unit of the driver in the file.
        units: from the file's units to SI, by the unit there: m, rad and 1.
        values: the grid of the sweep [m or rad], shape (n,).
        outputs: those of the case.
        convention: of the signs of those outputs that have one.

    Raises:
        CaseError: the file cannot be read or lies elsewhere, a column is unknown, the grid is not
            that of the sweep, or signs are not those of the case.
    """
    by_name = {output.name: output for output in outputs}
    if keys.file is not None and keys.file.endswith(".json"):
        file = _only_beside(case_file, keys)
        return series(file, read(file), values, outputs)
    samples = _inline(case_file, keys, outputs) if keys.file is None else _from_csv(case_file, keys)
    names = list(samples.columns[1:])
    _check_columns(samples, names, [*by_name])
    _check_grid(samples, driver, values)
    if keys.file is not None:
        _check_signs(
            samples,
            convention if any(by_name[name].signs for name in names if name in by_name) else "",
        )
    column = {name: [row[k] for _, row in samples.rows] for k, name in enumerate(names, start=1)}
    return {
        output.name: Series(
            _in_si(column[output.name], output.unit, units),
            *(
                (
                    _in_si(column[name], output.unit, units)
                    if (name := output.name + ending) in column
                    else None
                )
                for ending in DERIVATIVES
            ),
        )
        for output in outputs
        if output.name in column
    }


def read_origin(case_file: Path, keys: ReferenceKeys) -> Origin:
    """Where the true values come from, of a reference that has been read.

    Raises:
        CaseError: the file has another digest than the one given, or there is no file to have one.
    """
    citation = (keys.citation or "").strip()
    if keys.file is None:
        if keys.digest is not None:
            problem = (
                "found a digest beside rows, expected one of a file; remove it, for the rows are in"
                " the case file"
            )
            raise fault(case_file, "reference.digest", problem)
        return Origin(citation)
    file = _beside(case_file, keys.file)
    found = sha256(file)
    if keys.digest not in (None, DIGEST + found):
        problem = (
            f"found {shown(keys.digest)}, but {keys.file} has {DIGEST}{found}, expected the same"
        )
        raise fault(
            case_file,
            "reference.digest",
            f"{problem}; get the file that was meant, or give its digest",
        )
    return Origin(citation, keys.file, found, own=keys.file.endswith(".json"))


def _in_si(column: Sequence[float], unit: str, units: Mapping[str, Convert]) -> Array:
    above, _, below = unit.partition("/")
    scale = units[below](1.0) if below else 1.0
    return np.array([units[above](value) / scale for value in column])


def _check_signs(samples: _Samples, convention: str) -> None:
    """A table of outputs that have a convention says whose signs it has, and they are the
    case's.
    """
    if convention not in ("", samples.signs):
        found = f"found {shown(samples.signs)}" if samples.signs else "found no convention"
        problem = (
            f'{found} of signs, expected {convention!r} as in [suspension]; write "# signs:'
            f' {convention}" if its signs are so'
        )
        raise fault(samples.file, "signs", problem)


def _inline(file: Path, keys: ReferenceKeys, outputs: Sequence[Quantity]) -> _Samples:
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
    samples = _Samples(file, "reference.columns", columns, rows, key)
    for where, row in rows:
        _check_width(samples, where, len(row))
    return samples


def _from_csv(case_file: Path, keys: ReferenceKeys) -> _Samples:
    file = _only_beside(case_file, keys)
    text = read_text(file, LARGEST_FILE, "thin out the samples")
    lines = text.splitlines()
    if len(lines) > MOST_LINES:
        raise fault(
            file,
            "",
            f"found {len(lines)} lines, expected a row for each sample of the sweep; thin out the"
            " samples",
        )
    signs = next((found[1] for line in lines if (found := SIGNS.match(line))), "")
    # comment lines are blanked, not dropped, so that the reader's line numbers are those of the
    # file
    lines = ["" if line.lstrip().startswith("#") else line for line in lines]
    reader = csv.reader(lines, skipinitialspace=True, strict=True)
    samples: _Samples | None = None
    rows: list[tuple[str, Sequence[float]]] = []
    try:
        for cells in filter(None, reader):
            where = f"line {reader.line_num}"
            if samples is None:
                samples = _Samples(
                    file, where, [cell.strip() for cell in cells], rows, signs=signs, lines=lines
                )
                continue
            _check_width(samples, where, len(cells))
            # numbers at once: the cells of a large file as texts would take many times its size
            numbers = (
                _number(file, where, name, cell)
                for name, cell in zip(samples.columns, cells, strict=True)
            )
            rows.append((where, array("d", numbers)))
    except csv.Error as error:
        raise fault(
            file, f"line {reader.line_num}", f"not valid CSV: {error}; correct the line"
        ) from None
    if samples is None:
        raise fault(
            file,
            "",
            "found no samples, expected a line of column names and rows of numbers; add them",
        )
    return samples


def _only_beside(case_file: Path, keys: ReferenceKeys) -> Path:
    """The file, which must be the only source."""
    if keys.rows is not None or keys.columns is not None:
        raise fault(
            case_file,
            "reference",
            "found file and rows or columns, expected one source; remove one of them",
        )
    return _beside(case_file, keys.file or "")


def _beside(case_file: Path, name: str) -> Path:
    """The file of that name in the folder of the case file or below; nothing else is ever
    opened.
    """
    folder = case_file.parent.resolve()
    try:
        file = (folder / name).resolve()
        inside = not Path(name).is_absolute() and file.is_relative_to(folder)
    except (OSError, ValueError, RuntimeError):  # a null byte, a loop of links
        inside = False
        file = folder
    if not inside:
        raise fault(
            case_file,
            "reference.file",
            f"found {shown(name)}, expected a file in the folder of the case file or below; put it"
            " there and give its name",
        )
    with suppress(OSError):  # what cannot be asked for is told where it is read
        if not file.exists():
            raise fault(
                case_file,
                "reference.file",
                f"found {shown(name)}, but there is no such file; check the name",
            )
    return file


def _number(file: Path, line: str, column: str, cell: str) -> float:
    try:
        number = decimal(cell)
    except ValueError:
        number = math.nan
    if not abs(number) <= LARGEST:
        expected = f"expected a finite number, at most {LARGEST:g}"
        raise fault(
            file,
            f"{line}, column {column}",
            f"found {shown(cell)}, {expected}; correct it or leave the column out",
        )
    return number


def _check_width(samples: _Samples, where: str, found: int) -> None:
    if found != len(samples.columns):
        expected = f"{len(samples.columns)} ({', '.join(samples.columns)})"
        raise fault(
            samples.file, where, f"found {found} numbers, expected {expected}; complete the row"
        )


def _check_columns(samples: _Samples, names: Sequence[str], outputs: Sequence[str]) -> None:
    known = {name + suffix: None for name in outputs for suffix in ("", *DERIVATIVES)}
    counts = Counter(names)
    if not names:
        raise fault(
            samples.file,
            samples.header,
            f"found no column of an output, expected some of {', '.join(outputs)}; add one",
        )
    if samples.columns[0] in known:
        problem = (
            f"found {samples.columns[0]!r} first, the name of an output, expected the driver values"
        )
        problem += "; put their column first, or name it otherwise"
        raise fault(samples.file, samples.header, problem)
    for name in names:
        if counts[name] > 1:
            raise fault(
                samples.file,
                samples.header,
                f"found the column {name!r} twice, expected it once; remove one",
            )
        if name not in known:
            problem = (
                f"found the column {shown(name)}, expected outputs of the case;"
                f" {remedy(name, known)}"
            )
            raise fault(samples.file, samples.header, problem)
        stem = name.removesuffix(".velocity").removesuffix(".acceleration")
        if stem not in counts:
            problem = f"found {name!r} alone, expected its positions too; add the column {stem!r}"
            raise fault(samples.file, samples.header, problem)


def _check_grid(samples: _Samples, driver: Unit, values: Array) -> None:
    allowed = SAME_GRID * float(np.max(np.abs(values)))
    advice = "give a row for each sample of the sweep, driver values to 13 digits or more"
    for k, ((where, row), there) in enumerate(zip(samples.rows, values.tolist(), strict=False)):
        if abs(driver(row[0]) - there) > allowed:
            found = f"driver value {samples.driver_value(k)} {driver.name} of sample {k}"
            raise fault(
                samples.file,
                where,
                f"{found}, expected {driver.written(there)} as in the sweep; {advice}",
            )
    if len(samples.rows) != len(values):
        problem = (
            f"found {len(samples.rows)} rows, expected {len(values)}, the steps of the sweep;"
            f" {advice}"
        )
        raise fault(samples.file, samples.key, problem)
