"""The interface of a formulation: unknowns, the poses they stand for, and the equations.

Newton's iteration, velocities, accelerations, prediction and row selection are written once over
this interface, for all formulations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

from ...algebra import ZERO, Scalar, Vec3, cross
from ...primitives.base import Pose, Twist

State: TypeAlias = Mapping[str, Sequence[Scalar]]
"""Named vectors that define the configuration (for Cartesian coordinates: displacement and Euler
parameters of every body).
"""

EULER_PARAMETERS = 4
"""Length of a state vector of Euler parameters."""

Rows: TypeAlias = list[dict[int, Scalar]]
"""A matrix by rows; each row maps a column to its entry, literal zeros left out."""


@dataclass(frozen=True, eq=False)
class Configuration:
    """A state and the poses of the moving bodies that follow from it."""

    state: State
    poses: Mapping[str, Pose]


@dataclass(frozen=True, slots=True)
class Condition:
    """Rows that form one geometric condition, such as two parallel axes.

    Attributes:
        remote: joints between its bodies and the ground, summed over both bodies.
        steady: whether the rows keep their direction when a body turns.
    """

    rows: Sequence[int]
    remote: int = 0
    steady: bool = False


@dataclass(frozen=True, slots=True)
class Acceleration:
    """vdot of a body's origin and wdot, global axes."""

    v_t: Vec3
    w_t: Vec3

    def of(self, arm: Vec3, twist: Twist) -> Vec3:
        """Return the acceleration of the end of a (turned) arm on the body."""
        return self.v_t + cross(self.w_t, arm) + twist.centripetal(arm)


GROUND_ACCELERATION = Acceleration(ZERO, ZERO)


class Formulation(Protocol):
    """The equations of a mechanism over the unknowns of one formulation: joints, then drivers.

    Attributes:
        unknowns: number of unknowns (columns).
        design: the state at the design position.
        owners: for every row, its joint or driver and its primitive.
        conditions: the geometric conditions of the rows, in order.
    """

    @property
    def unknowns(self) -> int: ...
    @property
    def design(self) -> Mapping[str, Sequence[float]]: ...
    @property
    def owners(self) -> Sequence[tuple[str, str]]: ...
    @property
    def conditions(self) -> Sequence[Condition]: ...

    def configuration(self, state: State) -> Configuration:
        """Return the poses of a state."""
        ...

    def retract(self, at: Configuration, step: Sequence[Scalar]) -> State:
        """Return the state after a step of the unknowns, exact to second order."""
        ...

    def phi(self, at: Configuration) -> list[Scalar]:
        """Return all residuals."""
        ...

    def branch(self, at: Configuration) -> list[Scalar]:
        """Return all branch tests: positive on the intended branch."""
        ...

    def rows(self, at: Configuration) -> Rows:
        """Return the Jacobian by the unknowns."""
        ...

    def nu(self, at: Configuration) -> list[Scalar]:
        """Return the right-hand sides of the velocity equations."""
        ...

    def gamma(self, at: Configuration, v: Sequence[Scalar]) -> list[Scalar]:
        """Return the right-hand sides of the acceleration equations at unknown rates v."""
        ...

    def twists(self, at: Configuration, v: Sequence[Scalar]) -> Mapping[str, Twist]:
        """Return the twists of the bodies at unknown rates v."""
        ...

    def accelerations(
        self, at: Configuration, v: Sequence[Scalar], a: Sequence[Scalar]
    ) -> Mapping[str, Acceleration]:
        """Return the accelerations of the bodies at unknown rates v and accelerations a."""
        ...


def row_names(formulation: Formulation) -> list[str]:
    """Return a readable name of every row: its joint or driver, and its primitive."""
    return [f"{owner}: {primitive}" for owner, primitive in formulation.owners]
