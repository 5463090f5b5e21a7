"""Results as tables, data of other libraries, and pictures."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from itertools import product
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from ...dataset import Dataset, Variable
from ...errors import KincheckError, unknown
from ...extras import library
from ...tabular import Tabular


def data_of(result: Tabular) -> dict[str, Any]:
    """Return plain data, ready for JSON. Missing numbers are null."""
    return _arrays(result, lambda values: _plain(values.tolist()))


def frame_of(result: Tabular) -> Any:
    """Return a pandas table; see `Tabular.to_dataframe`."""
    data = result.dataset()
    frame = library("to_dataframe", "pandas", "pandas").DataFrame(table_of(data))
    frame.attrs["units"] = {name: each.unit for name, each in columns_of(data).items()}
    return frame


def arrays_of(result: Tabular) -> Any:
    """Return an xarray dataset; see `Tabular.to_xarray`."""
    found = library("to_xarray", "xarray", "xarray")
    arrays = _arrays(result, lambda values: values)
    return found.Dataset.from_dict({**arrays, "attrs": {"title": result.summary()}})


def figure_of(result: Tabular, *names: str) -> Any:
    """Draw the curves with matplotlib; see `Tabular.plot`."""
    data = result.drawn()
    curves = curves_of(data)
    for name in names:
        if name not in curves:
            raise KincheckError(unknown("curve", name, curves))
    figures = library("plot", "matplotlib.figure", "matplotlib")
    shown = names or tuple(data.shown) or tuple(curves)
    figure = figures.Figure(figsize=(7.0, 2.4 * len(shown)), layout="constrained")
    axes = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    x = data.coords[data.x]
    for each, name in zip(axes, shown, strict=True):
        for column, values in curves[name].items():
            across = values.reshape(len(values), math.prod(values.shape[1:]))
            lines = each.plot(x.values, across, label=column.removeprefix(f"{name}."))
            for line in lines[1:]:  # one colour and one entry in the legend for all of a column
                line.set(color=lines[0].get_color(), label=None)
        unit = data.variables[name].unit
        each.set_ylabel(f"{name} [{unit}]" if unit else name)
        each.grid(visible=True, alpha=0.3)
        if len(curves[name]) > 1:
            each.legend(fontsize="small", ncols=max(1, round(math.sqrt(len(curves[name])))))
    axes[-1].set_xlabel(f"{data.x} [{x.unit}]" if x.unit else data.x)
    axes[0].set_title(result.summary())
    return figure


def _arrays(result: Tabular, written: Callable[[NDArray[Any]], Any]) -> dict[str, Any]:
    """Return the dataset in the form of xarray, with its values as a function writes them."""
    data = result.dataset()

    def arrays(variables: Mapping[str, Variable]) -> dict[str, Any]:
        return {
            name: {
                "dims": each.dims,
                "attrs": {"units": each.unit} if each.unit else {},
                "data": written(each.values),
            }
            for name, each in variables.items()
        }

    coords, variables = arrays(data.coords), arrays(data.variables)
    return {"dims": data.sizes, "coords": coords, "data_vars": variables}


def _plain(values: Any) -> Any:
    """Return nested lists with null for infinite and missing numbers."""
    if isinstance(values, list):
        return [_plain(each) for each in cast("list[Any]", values)]
    return None if isinstance(values, float) and not math.isfinite(values) else values


def columns_of(data: Dataset) -> dict[str, Variable]:
    """Return the columns of the table by name, values over the dimensions of the rows.

    Labels of further dimensions follow a variable's name: "position.end.x".
    """
    found = dict[str, Variable]()
    for name, each in (*data.coords.items(), *data.variables.items()):
        if not set(each.dims) <= set(data.coords) - set(data.rows):  # not the labels themselves
            found.update(_unfold(data, name, each))
    return found


def _unfold(data: Dataset, name: str, each: Variable) -> Iterator[tuple[str, Variable]]:
    further = [dim for dim in each.dims if dim not in data.rows]
    dims = [dim for dim in data.rows if dim in each.dims]
    values = np.transpose(each.values, [each.dims.index(dim) for dim in (*further, *dims)])
    labels = [data.coords[dim].values.tolist() for dim in further]
    for place in product(*(range(len(each)) for each in labels)):
        texts = (str(label[k]) for label, k in zip(labels, place, strict=True))
        yield ".".join([name, *texts]), Variable(dims, values[place], each.unit)


def table_of(data: Dataset) -> dict[str, NDArray[Any]]:
    """Return the columns of a flat table by name, one value a row; the first dimension of the
    rows varies slowest. A dimension without labels is numbered.
    """
    sizes = data.sizes
    shape = tuple(sizes[dim] for dim in data.rows)
    columns = columns_of(data)
    first = {dim: columns.get(dim) or Variable(dim, np.arange(sizes[dim])) for dim in data.rows}
    found = dict[str, NDArray[Any]]()
    for name, each in (first | columns).items():
        wide = [slice(None) if dim in each.dims else None for dim in data.rows]
        found[name] = np.broadcast_to(each.values[tuple(wide)], shape).ravel()
    return found


def curves_of(data: Dataset) -> dict[str, dict[str, NDArray[Any]]]:
    """Return the curves over `x` by variable and column, shapes (n,), or (n, curves) if there
    are several of a column.

    Raises:
        KincheckError: there are no curves.
    """
    if not data.x:
        raise KincheckError(
            f"there is nothing to draw over {' and '.join(data.rows)}. Take to_dataframe."
        )
    (along,) = data.coords[data.x].dims
    found = dict[str, dict[str, NDArray[Any]]]()
    for name, each in data.variables.items():
        if along in each.dims and each.values.dtype.kind == "f":
            found[name] = {
                column: np.moveaxis(one.values, one.dims.index(along), 0)
                for column, one in _unfold(data, name, each)
            }
    return found
