"""The rows of a table as hardpoints of the case: which places of its geometry follow each row."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ....dual_numbers import Slope, derivatives
from ....kinematics import places
from ....mechanism.mechanism import Mechanism, Vector
from ...hardpoint import Hardpoint
from .table import Axes


def hardpoints_of(
    named: Mapping[str, str],
    at: Mapping[str, Vector],
    axes: Axes,
    mechanism_at: Callable[[Mapping[str, Vector]], Mechanism],
) -> tuple[Hardpoint, ...]:
    """Return a hardpoint for each row that fills a role.

    The template itself states what follows: its mechanism is made once more, of positions with
    their derivatives by the coordinates of the rows. Places are linear in positions.

    Args:
        named: names of the rows by role.
        at: positions by role [m], axes of the case.
        axes: of the table.
        mechanism_at: makes the mechanism from positions by role.
    """
    rows = list(dict.fromkeys(named.values()))
    by_table = np.zeros((len(rows), 3, 3 * len(rows)))
    for row, seeds in enumerate(by_table):
        for column, (k, sign) in enumerate(axes):
            seeds[k, 3 * row + column] = sign
    moving: dict[str, Any] = {
        role: tuple(
            Slope(x, seed) for x, seed in zip(place, by_table[rows.index(named[role])], strict=True)
        )
        for role, place in at.items()
    }
    found = places(mechanism_at(moving))
    slopes = {
        place: np.array([np.broadcast_to(derivatives(x), by_table.shape[2]) for x in value])
        for place, value in found.items()
    }
    return tuple(
        Hardpoint(
            name,
            tuple(role for role, filled in named.items() if filled == name),
            {
                place: each[:, 3 * row : 3 * row + 3]
                for place, each in slopes.items()
                if each[:, 3 * row : 3 * row + 3].any()
            },
        )
        for row, name in enumerate(rows)
    )
