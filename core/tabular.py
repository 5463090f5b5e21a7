"""Results as pictures, curves, tables and data of other libraries."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias, cast

from numpy.typing import NDArray

from .dataset import Dataset, Variable
from .doors import offers
from .errors import KincheckError, unknown
from .extras import library

# These libraries are optional, and a type checker may not find them.
DataFrame: TypeAlias = Any
XarrayDataset: TypeAlias = Any
Figure: TypeAlias = Any


def notebook(view: str, title: str, *what: Any) -> str:
    """Return a result or a mechanism as HTML for a notebook, or its title alone where the extension
    of notebooks is not there.
    """
    from html import escape

    offer = offers("views").get(view)
    return offer.load()(title, *what) if offer else f"<div><b>{escape(title)}</b></div>"


class Tabular:
    """Base of results. A class gives `summary`, one line, and `dataset`; the rest follows."""

    __slots__ = ()

    def summary(self) -> str:
        """Return the result in one line."""
        raise NotImplementedError

    def dataset(self) -> Dataset:
        """Return the result as labelled arrays with units."""
        raise NotImplementedError

    def drawn(self) -> Dataset:
        """Return the result as it is drawn and shown, in the units of its source."""
        return self.dataset()

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.summary()}>"

    def _repr_html_(self) -> str:
        """Return the table and the curves for a notebook."""
        return notebook("result", f"{type(self).__name__}: {self.summary()}", self.drawn())

    def to_html(self) -> str:
        """Return the table and the curves as HTML, as a notebook shows them."""
        return self._repr_html_()

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, ready for JSON: the content of a file as in the file, any other result
        as `xarray.Dataset.to_dict` has it. Missing numbers are null.
        """
        import msgspec

        if isinstance(self, msgspec.Struct):
            return cast("dict[str, Any]", msgspec.to_builtins(self))

        return self._arrays(lambda values: _plain(values.tolist()))

    def _arrays(self, written: Callable[[NDArray[Any]], Any]) -> dict[str, Any]:
        """Return the dataset in the form of xarray, with its values as a function writes them."""
        data = self.dataset()

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

    def to_dataframe(self) -> DataFrame:
        """Return a pandas table. The units of its columns are in `attrs["units"]`.

        Raises:
            KincheckError: pandas is not installed.
        """
        data = self.dataset()
        frame = library("to_dataframe", "pandas", "pandas").DataFrame(data.table())
        frame.attrs["units"] = {name: each.unit for name, each in data.columns().items()}
        return frame

    def to_xarray(self) -> XarrayDataset:
        """Return an xarray dataset. The unit of a variable is in its `attrs["units"]`.

        Raises:
            KincheckError: xarray is not installed.
        """
        found = library("to_xarray", "xarray", "xarray")

        arrays = self._arrays(lambda values: values)
        return found.Dataset.from_dict({**arrays, "attrs": {"title": self.summary()}})

    def plot(self, *names: str) -> Figure:
        """Draw the curves with matplotlib, one diagram for each variable, and return the figure.

        A record is drawn in the units of its case's file, everything else in SI.

        Args:
            names: variables to draw; by default all, or of a record the six that tell most.

        Raises:
            KincheckError: matplotlib is not installed, or there are no such curves.
        """
        data = self.drawn()
        curves = data.curves()
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
        axes[0].set_title(self.summary())
        return figure


def _plain(values: Any) -> Any:
    """Return nested lists with null for infinite and missing numbers."""
    if isinstance(values, list):
        return [_plain(each) for each in cast("list[Any]", values)]
    return None if isinstance(values, float) and not math.isfinite(values) else values
