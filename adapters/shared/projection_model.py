"""What a simulator gives to the Newton walk: the kinematics of its model, and its forces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

from ...core.case.case import Case
from ...core.trajectory import Array


@dataclass(frozen=True, eq=False)
class Dynamics:
    """Forces of a simulator at a sample, in kg, s and the model's unit of length.

    Attributes:
        demand: M a + h - Q for the unknowns, shape (unknowns,).
        reactions: by joint, the wrench on its second body about the joint's point, force over
            moment: the part without multipliers, shape (6,), and the derivative by the multipliers,
            of the rows left out last, shape (6, rows).
        elements: the force of each force element.
        left_out: derivative by dx of the rows left out within digits, shape (rows, unknowns).
    """

    demand: Array
    reactions: Mapping[str, tuple[Array, Array]]
    elements: Mapping[str, float]
    left_out: Array


@dataclass(frozen=True, eq=False)
class SolvedPose:
    """A pose of a model that a walk has found.

    Attributes:
        saved: the saved configuration.
        c: values of the drivers, in the unit of the rows.
        v, a: rates and accelerations of the unknowns.
        iterations: number of Newton's steps.
        residual: largest of the rows, in the unit of the walk's caller.
    """

    saved: Any
    c: Array
    v: Array
    a: Array
    iterations: int
    residual: float


class ProjectionModel(Protocol):
    """A simulator's kinematics: unknowns x (tree or body coordinates), and rows for closures and
    drivers.

    Lengths are in the unit of the mechanism, metres or another. All methods refer to the current
    configuration. `residual` updates the data of the other methods.

    Attributes:
        case: the case of the model, in the frame of the model.
        details: facts for the record.
        computed_by: for the record, the forces that the simulator computes, with its calls.
    """

    computed_by: ClassVar[Mapping[str, str]]

    @property
    def case(self) -> Case: ...

    @property
    def unknowns(self) -> int: ...

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

    def dynamics(self, v: Array, a: Array) -> Dynamics:
        """Return the simulator's forces at velocities and accelerations, at the current
        configuration, after calls of `residual` and `jacobian`, if the case needs forces.
        """
        ...
