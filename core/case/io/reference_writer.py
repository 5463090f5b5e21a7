"""Writer of the [reference] table of a case file: rows of numbers at the samples of the sweep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...trajectory import QUANTITIES, Array
from ..case import Case
from .reference_columns import DERIVATIVES


def reference_table(case: Case, driver_values: Array) -> Mapping[str, Any]:
    """Return the keys of [reference]; empty without a reference, or if rows cannot hold it.

    Args:
        driver_values: swept values in the form of the file, shape (n,).
    """
    if reason_against(case):
        return {}
    columns = _columns(case)
    known = np.isfinite(np.array([*columns.values()])).all(axis=0)
    table = np.column_stack([driver_values, *columns.values()])[known]
    keys = {"columns": ["driver", *columns], "rows": table.tolist()}
    if case.origin and case.origin.citation and not case.origin.own:
        keys["citation"] = case.origin.citation
    return keys


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
    found: dict[str, Array] = {}
    for name, series in case.reference.items():
        quantities: Sequence[Array | None] = [getattr(series, each) for each in QUANTITIES]
        for ending, values in zip(("", *DERIVATIVES), quantities, strict=True):
            if values is not None:
                found[name + ending] = values
    return found
