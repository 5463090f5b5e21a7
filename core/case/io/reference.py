"""Reference of a case: samples of its outputs from a table (CSV or .xlsx) beside the case file,
from rows inside it, or proved ones; read, and written as rows.

The first column holds driver values, see `Grid`. Further columns are OUTPUT, OUTPUT.velocity and
OUTPUT.acceleration, in the units of their heads, such as `toe [deg]`, or else in the units of the
case file. An output without a column has no reference, and the comparison says so. A file ending in
.json is a proved reference (`reference_file`), in SI units, on the grid of the sweep.

A file with columns of suspension outputs names their sign convention in a comment, for example "#
signs: iso8855". So people can read the file alone, and nobody takes it for one with other signs.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import number_of
from ...trajectory import QUANTITIES, Array
from ..case import Case, Origin, Quantity, Series, Truth
from ..curves import (
    FEWEST,
    FEWEST_DIGITS,
    Printed,
    bound_rounding,
    interpolate,
    is_even_grid,
    is_set,
    match_rows,
    slopes,
)
from ..units import Convert, FileUnits, Unit
from .document import fault, shown
from .readers import WORKBOOKS
from .reference_file import SAME_GRID, read, series, sha256
from .reference_samples import (
    RATES,
    Columns,
    Samples,
    driver_unit,
    inline_table,
    read_columns,
    read_table,
    samples_of,
)
from .schema import DIGEST, ReferenceKeys
from .toml_text import toml_table

PROVED = ".json"
"""Suffix of the files of proved references."""
CHOICE = 'sheet = "NAME" in [reference]'


def read_grid(case_file: Path, keys: ReferenceKeys, driver: Unit) -> Sequence[float]:
    """Return the driver values of a reference [SI].

    Args:
        driver: unit of the driver values, unless the head of their column gives another one.

    Raises:
        CaseError: the file is unreadable or lies elsewhere.
    """
    if keys.file is not None and keys.file.endswith(PROVED):
        grids = [*read(_reference_file(case_file, keys)).driver.values()]
        return grids[0] if grids else []
    if keys.file is None and keys.rows is not None and keys.columns is None:
        # the columns are the outputs, and `read_reference` checks them
        return [driver(row[0]) for row in keys.rows if row]
    samples = _samples(case_file, keys, (), Truth.THIRD_PARTY_DATA)
    _, driver = driver_unit(samples, driver)
    return [driver(x) for x in samples.numbers[:, 0].tolist()]


def _samples(
    case_file: Path, keys: ReferenceKeys, outputs: Sequence[Quantity], truth: Truth
) -> Samples:
    if keys.file is None:
        samples = samples_of(inline_table(case_file, keys, outputs))
        if truth is Truth.THIRD_PARTY_DATA:
            return samples
        # values of a formula: those with few digits, such as 0.5 and 1.0, are exact
        few = [each.significant < FEWEST_DIGITS for each in samples.printed]
        printed = [
            Printed() if rounded else each
            for rounded, each in zip(few, samples.printed, strict=True)
        ]
        return replace(samples, printed=printed)
    file = _reference_file(case_file, keys)
    if keys.sheet is not None and file.suffix.lower() not in WORKBOOKS:
        problem = f"found {shown(keys.sheet)}, but {keys.file} is no workbook (.xlsx)"
        raise fault(case_file, "reference.sheet", f"{problem}, expected none; remove it")
    return samples_of(read_table(file, keys.sheet, CHOICE))


def read_reference(
    case_file: Path,
    keys: ReferenceKeys,
    driver: Unit,
    units: FileUnits,
    case: Case,
    convention: str,
    *,
    own_grid: bool = False,
) -> Case:
    """Return the case with the true values by output name, in SI, and their origin.

    Args:
        driver: unit of the driver in the file.
        units: of the case file.
        case: with the kind of the reference.
        convention: sign convention of suspension outputs.
        own_grid: whether the sweep has the samples of the reference.

    Raises:
        CaseError: the file is unreadable or lies elsewhere, a column is unknown, the sweep has no
            sample within the grid, or the signs differ from the case's signs.
    """
    if keys.file is not None and keys.file.endswith(PROVED):
        file = _reference_file(case_file, keys)
        known = series(file, read(file), case.sweep.values, case.outputs)
        origin = replace(_origin(case_file, keys), signs=convention)
        return replace(case, reference=known, origin=origin)
    samples = _samples(case_file, keys, case.outputs, case.truth)
    columns = read_columns(samples, driver, units, case.outputs)
    if not any(output.signs for output in case.outputs if output.name in columns.of):
        convention = ""
    if keys.file is not None and convention not in ("", samples.signs):
        found = f"found {shown(samples.signs)}" if samples.signs else "found no convention"
        problem = (
            f'{found} of signs, expected {convention!r} as in [suspension]; write "# signs:'
            f' {convention}" if its signs are so'
        )
        raise fault(samples.file, "signs", problem)
    origin = _origin(case_file, keys)
    case = compare_at_samples(samples, columns, replace(case, origin=origin), own=own_grid)
    assert case.origin is not None
    return replace(case, origin=replace(case.origin, signs=samples.signs or convention))


def compare_at_samples(samples: Samples, columns: Columns, case: Case, *, own: bool) -> Case:
    """Return the case with the values of the columns at the samples of its sweep, and its origin
    with their units, grid and known errors.

    Args:
        own: whether the sweep has the samples of the reference.

    Raises:
        CaseError: no sample is within the range of the rows, or they cannot be interpolated.
    """
    grid = Grid(samples, columns.driver, case.sweep.values, own=own)
    known = dict[str, Series]()
    limits = dict[str, str]()
    for output in case.outputs:
        if output.name not in columns.of:
            continue
        found = {
            quantity: grid.column(columns.of[name].place, columns.of[name].convert)
            for quantity, ending in zip(QUANTITIES, RATES, strict=True)
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
    units = {columns.name: columns.driver.name} | {name: columns.of[name].unit for name in known}
    assert case.origin is not None
    origin = replace(case.origin, units=units, grid=grid.words, limits=limits)
    return replace(case, reference=known, origin=origin)


def _origin(case_file: Path, keys: ReferenceKeys) -> Origin:
    """Return the source of the true values, if the digest of their file is the given one."""
    citation = (keys.citation or "").strip()
    if keys.file is None:
        if keys.digest is not None:
            raise fault(
                case_file,
                "reference.digest",
                "found a digest beside rows, expected one of a file; remove it, for the rows are in"
                " the case file",
            )
        return Origin(citation)
    found = sha256(_reference_file(case_file, keys))
    if keys.digest not in (None, DIGEST + found):
        raise fault(
            case_file,
            "reference.digest",
            f"found {shown(keys.digest)}, but {keys.file} has {DIGEST}{found}, expected the same;"
            " get the file that was meant, or give its digest",
        )
    return Origin(citation, keys.file, found, own=keys.file.endswith(PROVED))


def _reference_file(case_file: Path, keys: ReferenceKeys) -> Path:
    """Return the path of the file, which must be the only source, in or below the case file's
    folder; any other path is refused.
    """
    if keys.rows is not None or keys.columns is not None:
        raise fault(
            case_file,
            "reference",
            "found file and rows or columns, expected one source; remove one of them",
        )
    name, folder = keys.file or "", case_file.parent.resolve()
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


@dataclass(frozen=True, eq=False)
class GridColumn:
    """A column of a reference at the samples of a sweep.

    Attributes:
        values, uncertainty: SI, shape (n,); NaN at a sample without a value.
        reasons: parts of the uncertainty, each with its largest value [SI].
    """

    values: Array
    uncertainty: Array
    reasons: Sequence[tuple[str, float]]


class Grid:
    """The rows of a reference, and the samples of a sweep.

    A row belongs to the sample with its driver value. If every row belongs to a sample, the
    reference is compared at these samples, possibly fewer than the sweep's. Otherwise it is
    interpolated at the samples within its range.

    Three known errors of the values enter the tolerance: half a unit of the last printed digit,
    that of the driver values times the slope, and the estimated error of the interpolation.

    Args:
        driver: unit of the driver values in the file.
        values: samples of the sweep [SI].
        own: whether the sweep has the samples of the reference.

    Raises:
        CaseError: no sample is within the range of the rows, or an interpolation has too few rows
            or two rows at one driver value.
    """

    def __init__(self, samples: Samples, driver: Unit, values: Array, *, own: bool) -> None:
        self._samples, self._at = samples, values
        self._written = samples.numbers[:, 0]
        rows = np.array([driver(x) for x in self._written.tolist()])
        self._allowed = allowed = SAME_GRID * float(np.max(np.abs(values)))
        self._index = np.arange(len(rows)) if own else match_rows(rows, values, allowed)
        self._full = any(printed.exact for printed in samples.printed[1:])
        printed = samples.printed[0]
        half = printed.half(self._written) * abs(driver(1.0))
        set_ = printed.as_set or is_set(self._written, printed.half(self._written))
        if (self._index is not None and not own) or set_:
            half = np.zeros_like(half)  # the driver values are exact as printed
        self._order = np.argsort(rows, kind="stable")
        self._x, self._half = rows[self._order], float(half.max())
        slack = max(allowed, self._half)
        self._within = (values >= self._x[0] - slack) & (values <= self._x[-1] + slack)
        if self._index is None:
            self._check(driver, values)

    def _check(self, driver: Unit, values: Array) -> None:
        """Refuse rows unfit for interpolation."""
        samples, at = self._samples, 'or take its samples: [sweep] at = "reference"'
        at += " in the case file, or --at-reference beside --reference"
        if not self._within.any():
            low, high = (driver.written(float(x)) for x in (self._x[0], self._x[-1]))
            ends = " to ".join(driver.written(float(x)) for x in (values[0], values[-1]))
            problem = f"found driver values from {low} to {high}, expected some within the sweep"
            raise fault(samples.file, samples.key, f"{problem}, {ends}; correct one, {at}")
        if len(self._x) < FEWEST:
            off = np.abs(self._x[:, None] - values).min(axis=1)
            k = int(self._order[off.argmax()])
            nearest = values[np.abs(values - driver(float(self._written[k]))).argmin()]
            problem = (
                f"found driver value {samples.driver_value(k)} {driver.name} at no sample of the"
                f" sweep, the nearest is {driver.written(float(nearest))}, expected {FEWEST} rows"
                f" or more to interpolate, found {len(self._x)}"
            )
            raise fault(samples.file, samples.places[k], f"{problem}; correct it, {at}")
        twice = np.flatnonzero(np.diff(self._x) <= 0.0)
        if twice.size:
            k = int(self._order[twice[0] + 1])
            problem = f"found driver value {samples.driver_value(k)} {driver.name} twice"
            raise fault(
                samples.file,
                samples.places[k],
                f"{problem}, expected it once where rows are interpolated; remove one, {at}",
            )

    @property
    def words(self) -> str:
        """The samples with a reference value, in words; empty for all samples."""
        rows, samples = len(self._x), len(self._at)
        if self._index is None:
            where = f"interpolated at {int(self._within.sum())} of {samples} samples"
            # the first row beyond an end is needed there; those behind it say nothing
            ends = self._x < self._at.min(), self._x > self._at.max()
            beyond = sum(max(int(each.sum()) - 1, 0) for each in ends)
            if beyond:
                where += f"; {number_of(beyond, 'row')} beyond the sweep not compared: widen it, or"
                where += " take the samples of the reference (--at-reference)"
            return f"{rows} rows on a grid of their own, {where}"
        there = int((self._index >= 0).sum())
        return "" if there == samples else f"rows for {there} of {samples} samples"

    def _within_filled(self, k: int, x: Array) -> NDArray[np.bool_]:
        """Return the samples within the rows with a number in a column, at these driver values."""
        samples, needed = self._samples, 1 if self._index is not None else FEWEST
        if len(x) < needed:
            problem = f"found {len(x)} numbers in column {shown(samples.columns[k])}"
            expected = "expected some" if needed == 1 else f"expected {needed} to interpolate"
            raise fault(samples.file, samples.key, f"{problem}, {expected}; add them")
        slack = max(self._allowed, self._half)
        return (self._at >= x[0] - slack) & (self._at <= x[-1] + slack)

    def column(self, k: int, scale: Convert) -> GridColumn:
        """Return a column at the samples.

        Args:
            scale: conversion from the unit of the file to SI.
        """
        written = self._samples.numbers[:, k]
        printed = self._samples.printed[k]
        y = np.array([scale(value) for value in written.tolist()])
        half = np.where(np.isnan(written), 0.0, printed.half(written)) * abs(scale(1.0))
        if self._full and is_even_grid(written):  # a file of all digits has them here too
            half = np.zeros_like(half)
        error = np.zeros_like(self._at)
        filled = self._order[~np.isnan(y[self._order])]
        x = self._x[~np.isnan(y[self._order])]
        within = self._within_filled(k, x)
        if self._index is not None:
            there = self._index >= 0
            values = np.where(there, y[self._index], np.nan)
            rounding = np.where(there, half[self._index], 0.0)
        else:
            values, error = interpolate(x, y[filled], self._at)
            values = np.where(within, values, np.nan)
            above = np.clip(np.searchsorted(x, self._at), 1, len(x) - 1)
            around = np.stack([above - 1, above])
            at_row = (np.abs(x[around] - self._at) <= self._allowed).any(axis=0)
            error = np.where(within & ~at_row, error, 0.0)
            rounding = bound_rounding(x, half[filled], self._at, within)
        shifted = np.zeros_like(self._at)
        if self._half and len(x) > 1:
            shifted = self._half * slopes(x, y[filled], self._at)
            shifted = np.where(np.isfinite(values), shifted, 0.0)
        parts = {
            f"printed to {printed.significant} digits": rounding,
            f"driver values printed to {self._samples.printed[0].significant} digits": shifted,
            f"interpolated between {len(self._x)} rows": error,
        }
        reasons = [(why, float(each.max())) for why, each in parts.items() if each.any()]
        return GridColumn(values, rounding + shifted + error, reasons)


def reference_lines(case: Case, driver_values: Array) -> list[str]:
    """Return the lines of [reference]; none without a reference, or if rows cannot hold it.

    Args:
        driver_values: swept values in the form of the file, shape (n,).
    """
    if reason_against(case):
        return []
    columns = _columns(case)
    known = np.isfinite(np.array([*columns.values()])).all(axis=0)
    table = np.column_stack([driver_values, *columns.values()])[known]
    keys: dict[str, Any] = {"columns": ["driver", *columns], "rows": table.tolist()}
    if case.origin and case.origin.citation and not case.origin.own:
        keys["citation"] = case.origin.citation
    return toml_table(keys, "reference")


def reason_against(case: Case) -> str:
    """Return the reason why rows cannot hold the reference of a case; empty if they can."""
    if not case.reference:
        return "there is none"
    if any(series.uncertainty for series in case.reference.values()):
        return "its values have uncertainties, from printed digits or interpolation"
    known = np.isfinite(np.array([*_columns(case).values()]))
    if (known != known[0]).any() or not known.any():
        return "its outputs are known at different samples"
    return ""


def _columns(case: Case) -> dict[str, Array]:
    """Return the columns of the known quantities, by name, shape (n,) each."""
    found = dict[str, Array]()
    for name, known in case.reference.items():
        quantities: Sequence[Array | None] = [getattr(known, each) for each in QUANTITIES]
        for ending, values in zip(RATES, quantities, strict=True):
            if values is not None:
                found[name + ending] = values
    return found
