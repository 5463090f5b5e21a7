"""Reference of a case: samples of its outputs from a table (CSV or .xlsx) beside the case file,
from rows inside it, or proved ones.

The first column holds driver values. If they differ from the sweep's values, the reference is
interpolated, or compared at its own samples only: see `reference_grid`. Further columns are OUTPUT,
OUTPUT.velocity and OUTPUT.acceleration, in the units of the case file. An output without a column
has no reference, and the comparison says so. A file ending in .json is a proved reference
(`reference_file`), in SI units, on the grid of the sweep.

A file with columns of suspension outputs names their sign convention in a comment, for example "#
signs: iso8855". So people can read the file alone, and nobody takes it for one with other signs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

from ...errors import remedy
from ...trajectory import QUANTITIES, Array
from ..case import Origin, Quantity, Series
from ..units import Unit
from .document import fault, sha256, shown
from .reference_file import read, series
from .reference_grid import Grid
from .reference_samples import (
    DIGEST,
    ReferenceKeys,
    Samples,
    beside,
    inline,
    only_beside,
)
from .reference_table import from_table

DERIVATIVES = (".velocity", ".acceleration")
PROVED = ".json"
"""Suffix of the files of proved references."""

Convert: TypeAlias = Callable[[float], float]
"""Conversion from the unit of a file to SI."""


def is_derivative(name: str) -> bool:
    """Return whether a column of this name holds a velocity or acceleration."""
    return name.endswith(DERIVATIVES)


def read_grid(case_file: Path, keys: ReferenceKeys) -> Sequence[float]:
    """Return the driver values of a reference in the units of the case file, or in SI for a proved
    reference.

    Raises:
        CaseError: the file is unreadable or lies elsewhere.
    """
    if keys.file is not None and keys.file.endswith(PROVED):
        proved = read(only_beside(case_file, keys)).driver
        return [value for values in [*proved.values()][:1] for value in values]
    if keys.file is None and keys.rows is not None and keys.columns is None:
        # the columns are the outputs, and `read_reference` checks them
        return [row[0] for row in keys.rows if row]
    samples = inline(case_file, keys, ()) if keys.file is None else from_table(case_file, keys)
    return [row[0] for _, row in samples.rows]


def read_reference(
    case_file: Path,
    keys: ReferenceKeys,
    driver: Unit,
    units: Mapping[str, Convert],
    values: Array,
    outputs: Sequence[Quantity],
    convention: str,
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
        own_grid: whether the sweep has the samples of the reference.

    Raises:
        CaseError: the file is unreadable or lies elsewhere, a column is unknown, the sweep has no
            sample within the grid, or the signs differ from the case's signs.
    """
    by_name = {output.name: output for output in outputs}
    if keys.file is not None and keys.file.endswith(PROVED):
        file = only_beside(case_file, keys)
        known = series(file, read(file), values, outputs)
        return known, replace(_origin(case_file, keys), signs=convention)
    samples = inline(case_file, keys, outputs) if keys.file is None else from_table(case_file, keys)
    names = list(samples.columns[1:])
    _check_columns(samples, names, [*by_name])
    signed = any(by_name[name].signs for name in names if name in by_name)
    if keys.file is not None:
        _check_signs(samples, convention if signed else "")
    grid = Grid(samples, driver, values, own=own_grid)
    known: dict[str, Series] = {}
    limits: dict[str, str] = {}
    for output in outputs:
        if output.name not in names:
            continue
        unit, scale = unit_of(output.unit, units)
        found = {
            quantity: grid.column(1 + names.index(name), scale)
            for quantity, ending in zip(QUANTITIES, ("", *DERIVATIVES), strict=True)
            if (name := output.name + ending) in names
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
            limits[output.name] = "; ".join(
                f"{why}: {largest / scale(1.0):.2g} {unit}" for why, largest in reasons
            )
    own = {samples.columns[0]: driver.name}
    return known, replace(
        _origin(case_file, keys),
        units=own | {name: unit_of(by_name[name].unit, units)[0] for name in known},
        signs=samples.signs or (convention if signed else ""),
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


def unit_of(unit: str, units: Mapping[str, Convert]) -> tuple[str, Convert]:
    """Return the unit of an output in the file, and the conversion of its numbers to SI."""
    above, _, below = unit.partition("/")
    convert = units[above]
    name, per = (getattr(units[each], "name", each) if each else "" for each in (above, below))
    if not below:
        return name, convert
    scale = units[below](1.0)
    return f"{name}/{per}", lambda number: convert(number) / scale


def _check_signs(samples: Samples, convention: str) -> None:
    """Refuse a table of suspension outputs if it names no sign convention, or another one."""
    if convention not in ("", samples.signs):
        found = f"found {shown(samples.signs)}" if samples.signs else "found no convention"
        problem = (
            f'{found} of signs, expected {convention!r} as in [suspension]; write "# signs:'
            f' {convention}" if its signs are so'
        )
        raise fault(samples.file, "signs", problem)


def _check_columns(samples: Samples, names: Sequence[str], outputs: Sequence[str]) -> None:
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
