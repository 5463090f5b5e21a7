"""Interface of a simulator's kinematics in projection mode."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from ...core.case.case import Case
from ...core.trajectory import Array


class ProjectionModel(Protocol):
    """A simulator's kinematics: unknowns x (tree or body coordinates), and rows for closures and
    drivers.

    Lengths are in the unit of the mechanism, metres or another. All methods refer to the current
    configuration. `residual` updates the data of the other methods.

    Attributes:
        case: the case of the model, in the frame of the model.
        details: facts for the record.
    """

    @property
    def case(self) -> Case: ...

    @property
    def details(self) -> Mapping[str, Any]: ...

    def reset(self) -> None:
        """Go back to the design configuration."""
        ...

    def save(self) -> Any:
        """Return a copy of the configuration."""
        ...

    def restore(self, saved: Any) -> None:
        """Go back to a saved configuration."""
        ...

    def move(self, dx: Array) -> None:
        """Advance the configuration by dx, shape (unknowns,)."""
        ...

    def residual(self, c: Array) -> Array:
        """Return all rows with the drivers at c, in the mechanism's order, relative to their design
        values, shape (rows,).
        """
        ...

    def jacobian(self) -> Array:
        """Return the derivative of the rows by dx, shape (rows, unknowns).

        The array is a copy, or valid until the next call.
        """
        ...

    def driver_columns(self) -> Array:
        """Return the negative derivative of the rows by c, J v = driver_columns c_t, shape (rows,
        drivers).
        """
        ...

    def bias(self, v: Array) -> Array:
        """Return Jdot v of all rows, shape (rows,)."""
        ...

    def points(self, v: Array, a: Array) -> Sequence[tuple[Array, Array, Array]]:
        """Return position, velocity and acceleration of each point of case.points, in order, global
        axes.
        """
        ...
