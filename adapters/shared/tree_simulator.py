"""What a simulator of trees of links does and holds.

A simulator adds links and frames and reports their motion. It knows a body by the number of its
link; the ground is body 0. The axes of every body are global at design, and its origin is the point
of its link there.

A constructor prepares the simulator's empty model and then calls the constructor of `TreeModel`,
which calls `add_link` for every link, parents first, `make_frame` for every frame, and finally
`finish`. Then the model is solved: `design` and `moved` return configurations q, `place` and `rate`
update the simulator's data, which `placement`, `slope` and `motion` read frame by frame.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Any, ClassVar

import numpy as np

from ...core.case.case import Case
from ...core.mechanism.body import Body
from ...core.mechanism.mechanism import Vector
from ...core.trajectory import Array
from .constraints import BodyFrame, Condition, DrivenPoint, by_frame
from .force_solution import RowWrench
from .tree_plan import Link, Relation


@dataclass(frozen=True, eq=False)
class Mass:
    """A body with mass, and a frame at its centre of mass."""

    body: Body
    frame: BodyFrame


class TreeSimulator(ABC):
    """A simulator of trees of links.

    Attributes:
        q: the configuration, never changed in place.
        v: the velocities last set.
        origin: origin of each body, global at design [m].
        carrier: name of a body of the mechanism -> number of its body here.
        coordinates: joint and freedom -> the simulator's coordinate, by default the number of the
            body that it moves, and its sign.
        frames: all frames.
        conditions: all rows, the rows of drivers last.
        slices, J: rows of each condition, and the Jacobian of all.
        closures: name of a cut joint -> description of its rows.
        parents: number of the carrier of each body; the ground carries itself.
        branch_of: joint of the tree -> carried body, and its sign: -1 if it is the joint's first.
        tied: conditions between frames, with their joint and frames.
        related: rows of coordinates, with their relation.
        own: the simulator's own constraints, whose rows come first: their number, and what they
            keep, the name of a cut joint or a relation.
        recursion: whether the simulator gives the wrenches of its joints.
        computed_by: the forces that the simulator computes, with its calls.
    """

    case: Case
    q: Array
    v: Array
    J: Array
    origin: list[Array]
    carrier: dict[str, int]
    coordinates: dict[tuple[str, str], tuple[Any, int]]
    frames: list[BodyFrame]
    conditions: list[Condition]
    slices: list[slice]
    closures: dict[str, str]
    parents: list[int]
    branch_of: dict[str, tuple[int, int]]
    tied: list[tuple[str, Condition, tuple[BodyFrame, BodyFrame]]]
    related: list[tuple[Condition, Relation]]
    own: list[tuple[int, str | Relation]]
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

    # methods of the base

    def add_frame(self, body: int, at: Vector) -> BodyFrame:
        """Add a frame to a body, at a point, global at design [m]."""
        handle = self.make_frame(body, np.array(at) - self.origin[body]) if body else None
        self.frames.append(BodyFrame(body, handle, np.array(at)))
        return self.frames[-1]

    @property
    def own_rows(self) -> list[tuple[slice, str | Relation]]:
        """Return the rows of the simulator's own constraints, and what they keep."""
        ends = accumulate((n for n, _ in self.own), initial=0)
        kept = (what for _, what in self.own)
        return [(slice(*pair), what) for pair, what in zip(pairwise(ends), kept, strict=True)]

    @property
    def own_count(self) -> int:
        """Return the number of rows of the simulator's own constraints."""
        return sum(n for n, _ in self.own)

    def rows_of(self, condition: Condition) -> slice:
        """Return the rows of a condition."""
        return self.slices[self.conditions.index(condition)]

    def exerted(self) -> list[RowWrench]:
        """Return the wrenches of unit multipliers of rows between bodies."""
        found = [
            RowWrench(self.rows_of(condition), frame.body, frame.position, wrenches)
            for _, condition, frames in self.tied
            for frame, wrenches in zip(frames, by_frame(condition, frames), strict=True)
        ]
        return found + [
            RowWrench(self.rows_of(each), each.frame.body, each.frame.position, each.pull)
            for each in self.conditions
            if isinstance(each, DrivenPoint)
        ]
