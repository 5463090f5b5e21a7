"""Reference of a case: samples of its outputs from a CSV file beside the case file, from rows
inside it, or proved ones.

The first column holds driver values on the grid of the sweep; nothing is interpolated. Further
columns are OUTPUT, OUTPUT.velocity and OUTPUT.acceleration, in the units of the case file. Outputs
without a column have no reference, and the comparison says so. A file ending in .json is a proved
reference (`reference_file`), in SI units.

A file with columns of suspension outputs names their sign convention in a comment, for example "#
signs: iso8855". So it is readable by itself, and not mistaken for one with other signs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np

from ...errors import remedy
from ...trajectory import Array
from ..case import Origin, Quantity, Series
from ..units import Unit
from .document import fault, sha256, shown
from .reference_file import read, series
from .reference_samples import (
    DIGEST,
    ReferenceKeys,
    Samples,
    beside,
    from_csv,
    inline,
    only_beside,
)

DERIVATIVES = (".velocity", ".acceleration")
# Twelve digits of a driver value: a smaller error moves no output by as much as a tolerance; a
# rounded table has a larger error.
SAME_GRID = 1e-12

Convert: TypeAlias = Callable[[float], float]
"""Conversion from the unit of a file to SI."""


def is_derivative(name: str) -> bool:
    """Return whether a column of this name holds a velocity or acceleration."""
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
    """Return the true values by output name, in SI.

    Args:
        driver: unit of the driver in the file.
        units: conversions from the file's units, by SI unit: m, rad and 1.
        values: grid of the sweep [m or rad], shape (n,).
        outputs: outputs of the case.
        convention: sign convention of the outputs that have one.

    Raises:
        CaseError: the file is unreadable or lies elsewhere, a column is unknown, or grid or signs
            differ from those of the case.
    """
    by_name = {output.name: output for output in outputs}
    if keys.file is not None and keys.file.endswith(".json"):
        file = only_beside(case_file, keys)
        return series(file, read(file), values, outputs)
    samples = inline(case_file, keys, outputs) if keys.file is None else from_csv(case_file, keys)
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
    """Return the source of the true values of a reference after it was read.

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
    return Origin(citation, keys.file, found, own=keys.file.endswith(".json"))


def _in_si(column: Sequence[float], unit: str, units: Mapping[str, Convert]) -> Array:
    above, _, below = unit.partition("/")
    scale = units[below](1.0) if below else 1.0
    return np.array([units[above](value) / scale for value in column])


def _check_signs(samples: Samples, convention: str) -> None:
    """Refuse a table of outputs with a sign convention if it names none or another one."""
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


def _check_grid(samples: Samples, driver: Unit, values: Array) -> None:
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
