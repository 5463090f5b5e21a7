"""Results as pictures, curves, tables and data of other libraries."""

from __future__ import annotations

from typing import Any, TypeAlias, cast

from .dataset import Dataset
from .doors import offers
from .errors import KincheckError

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


def _view(view: str, *what: Any) -> Any:
    """Return another form of a result.

    Raises:
        KincheckError: the extension of this form is not there.
    """
    if (offer := offers("views").get(view)) is None:
        raise KincheckError(f"There is no {view} of results: its extension is not installed.")
    return offer.load()(*what)


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

        return _view("data", self)

    def to_dataframe(self) -> DataFrame:
        """Return a pandas table. The units of its columns are in `attrs["units"]`.

        Raises:
            KincheckError: pandas is not installed.
        """
        return _view("frame", self)

    def to_xarray(self) -> XarrayDataset:
        """Return an xarray dataset. The unit of a variable is in its `attrs["units"]`.

        Raises:
            KincheckError: xarray is not installed.
        """
        return _view("arrays", self)

    def plot(self, *names: str) -> Figure:
        """Draw the curves with matplotlib, one diagram for each variable, and return the figure.

        A record is drawn in the units of its case's file, everything else in SI.

        Args:
            names: variables to draw; by default all, or of a record the six that tell most.

        Raises:
            KincheckError: matplotlib is not installed, or there are no such curves.
        """
        return _view("figure", self, *names)
