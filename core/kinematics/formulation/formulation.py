"""What a formulation is: its unknowns, what they mean for the poses of the bodies, and the
equations over them.

Newton's iteration, velocities, accelerations, prediction and the selection of rows are the same for
all formulations; they are written once, over this interface.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

from ...algebra import ZERO, Scalar, Vec3, cross
from ...primitives.base import Pose, Twist

State: TypeAlias = Mapping[str, Sequence[Scalar]]
"""Named vectors that fix the configuration (for Cartesian coordinates: displacement and Euler
parameters of every body).
"""

EULER_PARAMETERS = 4
"""Numbers of a vector of a state that is Euler parameters."""

Rows: TypeAlias = list[dict[int, Scalar]]
"""A matrix by rows; each row maps a column to its entry, literal zeros left out."""


@dataclass(frozen=True, eq=False)
class Configuration:
    """A state and the poses of the moving bodies that follow from it."""

    state: State
    poses: Mapping[str, Pose]


@dataclass(frozen=True, slots=True)
class Condition:
    """Rows that say something together, such as that two axes stay parallel.

    Attributes:
        remote: joints between its bodies and the ground, those of both bodies summed.
        steady: the rows do not turn with a body.
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
        """Acceleration of the point at the end of the (turned) arm, while the body moves so."""
        return self.v_t + cross(self.w_t, arm) + twist.centripetal(arm)


GROUND_ACCELERATION = Acceleration(ZERO, ZERO)


class Formulation(Protocol):
    """The equations of a mechanism over the unknowns of one formulation: joints first, drivers
    last.

    Attributes:
        unknowns: number of unknowns (columns).
        design: the state at the design position.
        owners: for every row the joint or driver, and the primitive, it belongs to.
        conditions: the rows that say something together, in order.
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
        """The poses that a state means."""
        ...

    def retract(self, at: Configuration, step: Sequence[Scalar]) -> State:
        """The state after a step of the unknowns, exact to second order."""
        ...

    def phi(self, at: Configuration) -> list[Scalar]:
        """All residuals."""
        ...

    def branch(self, at: Configuration) -> list[Scalar]:
        """All branch tests: positive on the intended branch."""
        ...

    def rows(self, at: Configuration) -> Rows:
        """The Jacobian by the unknowns."""
        ...

    def nu(self, at: Configuration) -> list[Scalar]:
        """Right-hand sides of the velocity equations."""
        ...

    def gamma(self, at: Configuration, v: Sequence[Scalar]) -> list[Scalar]:
        """Right-hand sides of the acceleration equations at unknown rates v."""
        ...

    def twists(self, at: Configuration, v: Sequence[Scalar]) -> Mapping[str, Twist]:
        """How the bodies move at unknown rates v."""
        ...

    def accelerations(
        self, at: Configuration, v: Sequence[Scalar], a: Sequence[Scalar]
    ) -> Mapping[str, Acceleration]:
        """How the bodies accelerate at unknown rates v and accelerations a."""
        ...


def row_names(formulation: Formulation) -> list[str]:
    """Return a name of every row to read: its joint or driver, and its primitive."""
    return [f"{owner}: {primitive}" for owner, primitive in formulation.owners]
