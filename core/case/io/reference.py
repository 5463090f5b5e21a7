"""Reference of a case: samples of its outputs from a table (CSV or .xlsx) beside the case file,
from rows inside it, or proved ones.

The first column holds driver values. If they differ from the sweep's values, the reference is
interpolated, or compared at its own samples only: see `reference_grid`. Further columns are OUTPUT,
OUTPUT.velocity and OUTPUT.acceleration, in the units of their heads, such as `toe [deg]`, or else
in the units of the case file. An output without a column
has no reference, and the comparison says so. A file ending in .json is a proved reference
(`reference_file`), in SI units, on the grid of the sweep.

A file with columns of suspension outputs names their sign convention in a comment, for example "#
signs: iso8855". So people can read the file alone, and nobody takes it for one with other signs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ...trajectory import QUANTITIES, Array
from ..case import Origin, Quantity, Series, Truth
from ..printed import Printed
from ..units import Unit
from .document import fault, shown
from .reference_columns import (
    DERIVATIVES,
    Columns,
    Convert,
    driver_unit,
    read_columns,
)
from .reference_file import read, series
from .reference_grid import Grid
from .reference_samples import (
    DIGEST,
    ReferenceKeys,
    Samples,
    beside,
    inline,
    only_beside,
    sha256,
)
from .reference_table import from_table
from .workbook import WORKBOOKS

PROVED = ".json"
"""Suffix of the files of proved references."""
# Of the rows of a formula, those with fewer digits are not rounded.
FEWEST = 4
CHOICE = 'sheet = "NAME" in [reference]'


def read_grid(case_file: Path, keys: ReferenceKeys, driver: Unit) -> Sequence[float]:
    """Return the driver values of a reference [SI].

    Args:
        driver: unit of the driver values, unless the head of their column gives another one.

    Raises:
        CaseError: the file is unreadable or lies elsewhere.
    """
    if keys.file is not None and keys.file.endswith(PROVED):
        proved = read(only_beside(case_file, keys)).driver
        return [value for values in [*proved.values()][:1] for value in values]
    if keys.file is None and keys.rows is not None and keys.columns is None:
        # the columns are the outputs, and `read_reference` checks them
        return [driver(row[0]) for row in keys.rows if row]
    samples = _samples(case_file, keys, (), Truth.THIRD_PARTY_DATA)
    _, driver = driver_unit(samples, driver)
    return [driver(row[0]) for _, row in samples.rows]


def _samples(
    case_file: Path, keys: ReferenceKeys, outputs: Sequence[Quantity], truth: Truth
) -> Samples:
    if keys.file is None:
        samples = inline(case_file, keys, outputs)
        if truth is Truth.THIRD_PARTY_DATA:
            return samples
        # values of a formula: those with few digits, such as 0.5 and 1.0, are exact
        printed = [each if each.significant >= FEWEST else Printed() for each in samples.printed]
        return replace(samples, printed=printed)
    file = only_beside(case_file, keys)
    if keys.sheet is not None and file.suffix.lower() not in WORKBOOKS:
        problem = f"found {shown(keys.sheet)}, but {keys.file} is no workbook (.xlsx)"
        raise fault(case_file, "reference.sheet", f"{problem}, expected none; remove it")
    return from_table(file, keys.sheet, CHOICE)


def read_reference(
    case_file: Path,
    keys: ReferenceKeys,
    driver: Unit,
    units: Mapping[str, Convert],
    values: Array,
    outputs: Sequence[Quantity],
    convention: str,
    truth: Truth,
    *,
    own_grid: bool = False,
) -> tuple[dict[str, Series], Origin]:
    """Return the true values by output name, in SI, and their origin.

    Args:
        driver: unit of the driver in the file.
        units: conversions from the file's units, by SI unit: m, rad and 1.
        values: grid of the sweep [m or rad], shape (n,).
        outputs: outputs of the case.
        convention: sign convention of suspension outputs.
        truth: kind of the reference.
        own_grid: whether the sweep has the samples of the reference.

    Raises:
        CaseError: the file is unreadable or lies elsewhere, a column is unknown, the sweep has no
            sample within the grid, or the signs differ from the case's signs.
    """
    if keys.file is not None and keys.file.endswith(PROVED):
        file = only_beside(case_file, keys)
        known = series(file, read(file), values, outputs)
        return known, replace(_origin(case_file, keys), signs=convention)
    samples = _samples(case_file, keys, outputs, truth)
    columns = read_columns(samples, driver, units, outputs)
    signed = any(output.signs for output in outputs if output.name in columns.of)
    if keys.file is not None:
        check_signs(samples, convention if signed else "")
    known, origin = compared(samples, columns, outputs, values, _origin(case_file, keys), own_grid)
    return known, replace(origin, signs=samples.signs or (convention if signed else ""))


def compared(
    samples: Samples,
    columns: Columns,
    outputs: Sequence[Quantity],
    values: Array,
    origin: Origin,
    own_grid: bool,
) -> tuple[dict[str, Series], Origin]:
    """Return the values of the columns at the samples of a sweep, by output name, and the origin
    with their units, grid and known errors.

    Raises:
        CaseError: no sample is within the range of the rows, or they cannot be interpolated.
    """
    grid = Grid(samples, columns.driver, values, own=own_grid)
    known: dict[str, Series] = {}
    limits: dict[str, str] = {}
    for output in outputs:
        if output.name not in columns.of:
            continue
        found = {
            quantity: grid.column(columns.of[name].place, columns.of[name].convert)
            for quantity, ending in zip(QUANTITIES, ("", *DERIVATIVES), strict=True)
            if (name := output.name + ending) in columns.of
        }
        known[output.name] = Series(
            found["position"].values,
            *(found[each].values if each in found else None for each in QUANTITIES[1:]),
            uncertainty={
                quantity: each.uncertainty
                for quantity, each in found.items()
                if each.uncertainty.any()
            },
        )
        if reasons := found["position"].reasons:
            of = columns.of[output.name]
            scale, unit = abs(of.convert(1.0)), of.unit.partition(", ")[0]
            limits[output.name] = "; ".join(
                f"{why}: {largest / scale:.2g} {unit}" for why, largest in reasons
            )
    units = {columns.name: columns.driver.name}
    return known, replace(
        origin,
        units=units | {name: columns.of[name].unit for name in known},
        grid=grid.words,
        limits=limits,
    )


def _origin(case_file: Path, keys: ReferenceKeys) -> Origin:
    """Return the source of the true values of a finished reference.

    Raises:
        CaseError: the digest of the file differs from the given one, or a digest is given without a
            file.
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
    file = beside(case_file, keys.file)
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
    return Origin(citation, keys.file, found, own=keys.file.endswith(PROVED))


def check_signs(samples: Samples, convention: str) -> None:
    """Refuse a table of suspension outputs if it names no sign convention, or another one.

    Args:
        convention: convention of the case; empty if no compared output has one.
    """
    if convention not in ("", samples.signs):
        found = f"found {shown(samples.signs)}" if samples.signs else "found no convention"
        problem = (
            f'{found} of signs, expected {convention!r} as in [suspension]; write "# signs:'
            f' {convention}" if its signs are so'
        )
        raise fault(samples.file, "signs", problem)
