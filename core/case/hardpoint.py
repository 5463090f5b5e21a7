"""A hardpoint of a case: a row of a table, and the places that follow it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..trajectory import Array


@dataclass(frozen=True, eq=False)
class Hardpoint:
    """A row of a table of hardpoints. Joints, axes and points follow it, on both sides of an axle.

    Attributes:
        name: as in the table.
        roles: names in the template of the suspension.
        moves: derivatives of the numbers of each following place, see `kinematics.places`, by x, y
            and z of the table [m/m], shape (numbers, 3). They are constant.
    """

    name: str
    roles: tuple[str, ...]
    moves: Mapping[str, Array]
