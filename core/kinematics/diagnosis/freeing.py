"""Joints that over-constrain a mechanism."""

from __future__ import annotations

import numpy as np

from ..structure.redundancy import independent_rows
from .rank import Ranks


def freeing(ranks: Ranks) -> tuple[list[str], int]:
    """Return the joints and couplers of which any one, taken out alone, frees all blocked drivers,
    and the number of motions that are free then with the drivers held.

    Of all that free the drivers, those that leave the fewest motions free; none if none frees them.
    """
    joints, drives = ranks.matrix[: ranks.joint_rows], ranks.matrix[ranks.joint_rows :]
    owners = [row.owner for row in ranks.rows[: ranks.joint_rows]]
    left: dict[str, int] = {}
    for name in dict.fromkeys(owners):
        others = joints[[owner != name for owner in owners]]
        rank = len(independent_rows(np.vstack((others, drives)), 0))
        if rank == len(independent_rows(others, 0)) + len(drives):
            left[name] = ranks.matrix.shape[1] - rank
    least = min(left.values(), default=0)
    return [name for name, count in left.items() if count == least], least
