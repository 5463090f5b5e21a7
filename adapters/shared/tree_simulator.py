"""Interface of a simulator of trees of links; see `tree_model`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from ...core.mechanism.mechanism import Vector
from ...core.trajectory import Array
from .tree_forces import Mass
from .tree_plan import Link
from .tree_rows import BodyFrame


class TreeSimulator(ABC):
    """A simulator of trees of links.

    Attributes:
        q: the configuration, never changed in place.
        recursion: whether the simulator gives the wrenches of its joints.
        computed_by: the forces that the simulator computes, with its calls.
    """

    q: Array
    recursion: ClassVar[bool] = True
    computed_by: ClassVar[Mapping[str, str]]

    @abstractmethod
    def add_link(self, parent: int, link: Link, offset: Array) -> None:
        """Add a body that moves by a link relative to its parent, at an offset from the parent's
        origin [m].
        """

    @abstractmethod
    def make_frame(self, body: int, offset: Array) -> Any:
        """Return a handle of a frame of a body other than the ground, at an offset from its origin
        [m].
        """

    @abstractmethod
    def finish(self) -> None:
        """Finish the model for solving; no link and no frame follows."""

    @property
    @abstractmethod
    def unknowns(self) -> int:
        """The number of velocities."""

    @abstractmethod
    def coordinate(self, body: Any) -> tuple[int, int]:
        """Return the indices of a slide's or hinge's coordinate in q and in v."""

    @abstractmethod
    def design(self) -> Array:
        """Return the configuration at design, zero for slides and hinges."""

    @abstractmethod
    def moved(self, dx: Array) -> Array:
        """Return the configuration q advanced by dx, shape (unknowns,)."""

    @abstractmethod
    def place(self) -> None:
        """Update the simulator's poses and Jacobians to q."""

    @abstractmethod
    def rate(self, v: Array, a: Array) -> None:
        """Update the simulator's velocities and accelerations to v and a, at the q last placed."""

    @abstractmethod
    def placement(self, handle: Any) -> tuple[Array, Array]:
        """Return the position of a frame [m], shape (3,), and the rotation since design, shape
        (3, 3).
        """

    @abstractmethod
    def slope(self, handle: Any) -> Array:
        """Return the Jacobian of a frame's point over that of its rotation, global axes, shape
        (6, unknowns).
        """

    @abstractmethod
    def motion(self, handle: Any) -> tuple[Array, Array]:
        """Return velocity and acceleration of a frame's point, over the angular velocity and
        acceleration, global axes, each of shape (6,).

        Without accelerations of the coordinates, the acceleration is Jdot v.
        """

    @abstractmethod
    def set_loads(self, gravity: Vector, masses: Sequence[Mass]) -> None:
        """Set the masses of these bodies, zero mass for others, and the gravity of the model."""

    @abstractmethod
    def inverse_dynamics(self, v: Array, a: Array) -> Array:
        """Return M a + h at v and a, at the q last placed, shape (unknowns,).

        It also updates velocities and accelerations, as `rate` does.
        """

    def passed_on(self, body: int, point: Array) -> Array:
        """Return the wrench that a body's joint transmits to it and all carried bodies, after
        `inverse_dynamics`: force over moment about a global point, shape (6,).

        Only simulators with a recursion implement it.
        """
        raise NotImplementedError

    def look(self, frame: BodyFrame) -> None:
        """Read pose, Jacobian and motion of a frame."""
        if frame.handle is not None:
            frame.position, frame.rotation = self.placement(frame.handle)
            frame.jacobian = self.slope(frame.handle)
            frame.velocity, frame.acceleration = self.motion(frame.handle)
