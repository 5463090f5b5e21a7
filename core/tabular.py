"""Results as pictures, curves, tables and data of other libraries."""

from __future__ import annotations

from typing import Any, TypeAlias

from .dataset import Dataset

# These libraries are optional, and a type checker may not find them.
DataFrame: TypeAlias = Any
XarrayDataset: TypeAlias = Any
Figure: TypeAlias = Any


class Tabular:
    """Base of results. A class gives `summary`, one line, and `dataset`; the rest follows."""

    __slots__ = ()

    def summary(self) -> str:
        """Return the result in one line."""
        raise NotImplementedError

    def dataset(self) -> Dataset:
        """Return the result as labelled arrays with units."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.summary()}>"

    def _repr_html_(self) -> str:
        """Return the table and the curves for a notebook."""
        from .notebook_view import to_html

        return to_html(f"{type(self).__name__}: {self.summary()}", self.dataset())

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, ready for JSON: the content of a file as in the file, any other result
        as `xarray.Dataset.to_dict` has it. Missing numbers are null.
        """
        from .conversions import to_dict

        return to_dict(self, self.dataset)

    def to_dataframe(self) -> DataFrame:
        """Return a pandas table. The units of its columns are in `attrs["units"]`.

        Raises:
            KincheckError: pandas is not installed.
        """
        from .conversions import to_dataframe

        return to_dataframe(self.dataset())

    def to_xarray(self) -> XarrayDataset:
        """Return an xarray dataset. The unit of a variable is in its `attrs["units"]`.

        Raises:
            KincheckError: xarray is not installed.
        """
        from .conversions import to_xarray

        return to_xarray(self.dataset(), self.summary())

    def plot(self, *names: str) -> Figure:
        """Draw the curves with matplotlib, one diagram for each variable, and return the figure.

        Args:
            names: variables to draw; all by default.

        Raises:
            KincheckError: matplotlib is not installed, or there are no such curves.
        """
        from .conversions import to_figure

        return to_figure(self.dataset(), names, self.summary())
