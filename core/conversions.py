"""Conversions of results to plain data, pandas, xarray and matplotlib."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

from .dataset import Dataset, Variable
from .errors import KincheckError, unknown
from .extras import library


def to_dict(result: object, dataset: Callable[[], Dataset]) -> dict[str, Any]:
    """Return a result as plain data: a file's content as in the file, any other by its arrays."""
    import msgspec

    if isinstance(result, msgspec.Struct):
        return cast("dict[str, Any]", msgspec.to_builtins(result))
    data = dataset()
    return {
        "dims": data.sizes,
        "coords": _arrays(data.coords),
        "data_vars": _arrays(data.variables),
    }


def _arrays(variables: Mapping[str, Variable]) -> dict[str, Any]:
    return {
        name: {
            "dims": each.dims,
            "attrs": {"units": each.unit} if each.unit else {},
            "data": _plain(each.values.tolist()),
        }
        for name, each in variables.items()
    }


def _plain(values: Any) -> Any:
    """Return nested lists with null for infinite and missing numbers."""
    if isinstance(values, list):
        return [_plain(each) for each in cast("list[Any]", values)]
    return None if isinstance(values, float) and not math.isfinite(values) else values


def to_dataframe(data: Dataset) -> Any:
    """Return a pandas table; see `Tabular.to_dataframe`."""
    frame = library("to_dataframe", "pandas", "pandas").DataFrame(data.table())
    frame.attrs["units"] = {name: each.unit for name, each in data.columns().items()}
    return frame


def to_xarray(data: Dataset, title: str) -> Any:
    """Return an xarray dataset; see `Tabular.to_xarray`."""
    found = library("to_xarray", "xarray", "xarray")

    def arrays(variables: Mapping[str, Variable]) -> dict[str, Any]:
        return {
            name: (each.dims, each.values, {"units": each.unit} if each.unit else {})
            for name, each in variables.items()
        }

    return found.Dataset(arrays(data.variables), arrays(data.coords), attrs={"title": title})


def to_figure(data: Dataset, names: Sequence[str], title: str) -> Any:
    """Return a matplotlib figure of the curves; see `Tabular.plot`."""
    curves = data.curves()
    for name in names:
        if name not in curves:
            raise KincheckError(unknown("curve", name, curves))
    figures = library("plot", "matplotlib.figure", "matplotlib")
    shown = names or tuple(curves)
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
    axes[0].set_title(title)
    return figure
