"""Labelled arrays with units: the one form of results for tables, curves and other libraries."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import KincheckError


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
PARAMETER = Variable("parameter", ["e0", "e1", "e2", "e3"])
"""Labels of Euler parameters."""


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

    def columns(self) -> dict[str, Variable]:
        """Return the columns of the table by name, values over the dimensions of the rows.

        Labels of further dimensions follow a variable's name: "position.end.x".
        """
        found = dict[str, Variable]()
        for name, each in (*self.coords.items(), *self.variables.items()):
            if not set(each.dims) <= set(self.coords) - set(self.rows):  # not the labels themselves
                found.update(self._unfold(name, each))
        return found

    def _unfold(self, name: str, each: Variable) -> Iterator[tuple[str, Variable]]:
        further = [dim for dim in each.dims if dim not in self.rows]
        dims = [dim for dim in self.rows if dim in each.dims]
        values = np.transpose(each.values, [each.dims.index(dim) for dim in (*further, *dims)])
        labels = [self.coords[dim].values.tolist() for dim in further]
        for place in product(*(range(len(each)) for each in labels)):
            texts = (str(label[k]) for label, k in zip(labels, place, strict=True))
            yield ".".join([name, *texts]), Variable(dims, values[place], each.unit)

    def table(self) -> dict[str, NDArray[Any]]:
        """Return the columns of a flat table by name, one value a row; the first dimension of the
        rows varies slowest. A dimension without labels is numbered.
        """
        sizes = self.sizes
        shape = tuple(sizes[dim] for dim in self.rows)
        columns = self.columns()
        first = {dim: columns.get(dim) or Variable(dim, np.arange(sizes[dim])) for dim in self.rows}
        found = dict[str, NDArray[Any]]()
        for name, each in (first | columns).items():
            wide = [slice(None) if dim in each.dims else None for dim in self.rows]
            found[name] = np.broadcast_to(each.values[tuple(wide)], shape).ravel()
        return found

    def curves(self) -> dict[str, dict[str, NDArray[Any]]]:
        """Return the curves over `x` by variable and column, shapes (n,), or (n, curves) if there
        are several of a column.

        Raises:
            KincheckError: there are no curves.
        """
        if not self.x:
            raise KincheckError(
                f"there is nothing to draw over {' and '.join(self.rows)}. Take to_dataframe."
            )
        (along,) = self.coords[self.x].dims
        found = dict[str, dict[str, NDArray[Any]]]()
        for name, each in self.variables.items():
            if along in each.dims and each.values.dtype.kind == "f":
                found[name] = {
                    column: np.moveaxis(one.values, one.dims.index(along), 0)
                    for column, one in self._unfold(name, each)
                }
        return found
