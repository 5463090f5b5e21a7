"""Labelled arrays with units: the one form of results for tables, curves and other libraries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Variable:
    """An array with named dimensions.

    Attributes:
        dims: a name for each dimension.
        values: numbers, or texts.
        unit: SI unit; empty for counts, names and truth values.
    """

    def __init__(self, dims: str | Sequence[str], values: ArrayLike, unit: str = "") -> None:
        self.dims = (dims,) if isinstance(dims, str) else tuple(dims)
        self.values: NDArray[Any] = np.asarray(values)
        self.unit = unit


AXIS = Variable("axis", ["x", "y", "z"])
"""Labels of the components of a vector."""


@dataclass(frozen=True, eq=False)
class Dataset:
    """Variables over common dimensions.

    Attributes:
        rows: the dimensions along the rows of a table; the labels of all others go into the names
            of its columns.
        coords: labels of dimensions, by their names, and values along them.
        variables: results by name.
        x: the coordinate along the axis of curves; empty if there are no curves.
        shown: variables that are drawn where none are named; empty: all.
    """

    rows: tuple[str, ...]
    coords: Mapping[str, Variable]
    variables: Mapping[str, Variable]
    x: str = ""
    shown: Sequence[str] = ()

    @property
    def sizes(self) -> dict[str, int]:
        """Length of every dimension."""
        every = (*self.coords.values(), *self.variables.values())
        return {
            name: n for each in every for name, n in zip(each.dims, each.values.shape, strict=True)
        }
