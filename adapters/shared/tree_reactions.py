"""Reactions of the joints of a tree whose loops are closed by rows.

A simulator's recursion gives the wrench that a joint of the tree transmits to all carried bodies.
Rows, drivers, couplers and force elements also act on the carried bodies, so their wrenches are
subtracted. A cut joint exerts the wrenches of its own rows. Forces of drivers and couplers along a
joint's coordinate do not belong to its reaction.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.joints import Joint
from ...core.joints.base import unit
from ...core.mechanism.mechanism import Mechanism
from ...core.trajectory import Array
from .frame_constraints import Frame, skew


@dataclass(frozen=True, eq=False)
class RowWrench:
    """Wrenches of unit multipliers on a body.

    Attributes:
        rows: indices of the rows.
        body: number of the body.
        point: point of the body, global.
        wrenches: wrench of each row, force over moment about the point, shape (rows, 6).
    """

    rows: slice
    body: int
    point: Array
    wrenches: Array


@dataclass(frozen=True, eq=False)
class Carried:
    """A joint of the tree.

    Attributes:
        bodies: numbers of all carried bodies, the joint's body first.
        sign: minus if this body is the joint's first.
    """

    bodies: list[int]
    sign: int


@dataclass(frozen=True, eq=False)
class Cut:
    """A joint at the closure of a loop.

    Attributes:
        second: number of the joint's second body.
        rows: rows of the joint.
    """

    second: int
    rows: Collection[slice]


@dataclass(frozen=True, eq=False)
class Site:
    """A joint whose reaction is requested, and a frame at its point on its second body.

    Attributes:
        parts: the joint itself, or what holds its rows.
    """

    joint: Joint
    frame: Frame
    parts: Sequence[Carried | Cut]

    def reaction(
        self, passed_on: Callable[[int, Array], Array], exerted: Array, loads: Array
    ) -> tuple[Array, Array]:
        """Return the wrench on the second body without multipliers, shape (6,), and its derivative
        by the multipliers, shape (6, rows); both still include the coordinate's share.

        Args:
            passed_on: returns the wrench that the joint of a body transmits to it and all carried
                bodies, about a point.
            exerted: wrenches of unit multipliers on each body, about the origin, shape (bodies, 6,
                rows).
            loads: wrenches of force elements on each body, about the origin, shape (bodies, 6).
        """
        to_point = from_origin(self.frame.position)
        alone, by_multiplier = np.zeros(6), np.zeros(exerted.shape[1:])
        for part in self.parts:
            if isinstance(part, Cut):
                for rows in part.rows:
                    by_multiplier[:, rows] += to_point @ exerted[part.second][:, rows]
                continue
            total = passed_on(part.bodies[0], self.frame.position)
            alone += part.sign * (total - to_point @ loads[part.bodies].sum(axis=0))
            by_multiplier -= part.sign * (to_point @ exerted[part.bodies].sum(axis=0))
        return alone, by_multiplier

    def along(self, freedom: str) -> Array:
        """Return the wrench of a unit force or torque of a coordinate on the second body."""
        joint: Any = self.joint
        h, none = self.frame.rotation @ np.array([*unit(joint.axis)]), np.zeros(3)
        return np.concatenate([h, none] if freedom == "translation" else [none, h])


def about_origin(point: Array, wrenches: Array) -> Array:
    """Return wrenches about a point, shape (n, 6), as columns about the origin, shape (6, n)."""
    return np.vstack([wrenches[:, :3].T, wrenches[:, 3:].T + skew(point) @ wrenches[:, :3].T])


def from_origin(point: Array) -> Array:
    """Return the matrix from wrenches about the origin to wrenches about a point."""
    found = np.eye(6)
    found[3:, :3] = -skew(point)
    return found


def carried_by(body: int, parents: Sequence[int]) -> list[int]:
    """Return a body of a tree and all carried bodies; parents are numbered before children."""
    found = [body]
    for child in range(body + 1, len(parents)):
        if parents[child] in found:
            found.append(child)
    return found


def of_relations(
    mechanism: Mechanism, rows: Mapping[int, Sequence[tuple[str, str]]]
) -> dict[str, list[tuple[int, str]]]:
    """Return, by joint, the rows and freedoms of its coordinates that do not belong to its
    reaction.

    Args:
        rows: joint and freedom of the coordinates in each row. A row with two coordinates of one
            joint is the joint's own (a screw).
    """
    found: dict[str, list[tuple[int, str]]] = {joint.name: [] for joint in mechanism.given_joints}
    for row, terms in rows.items():
        if len(terms) > 1 and len({joint for joint, _ in terms}) == 1:
            continue
        for joint, freedom in terms:
            found[joint].append((row, freedom))
    return found
