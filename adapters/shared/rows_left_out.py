"""Rows that are left out within the digits of a case, as simulators have them.

No engine solves them. They are conditions on frames of a simulator's bodies, and count where forces
are undetermined.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.joints import Joint
from ...core.mechanism.mechanism import Mechanism, Vector
from ...core.trajectory import Array
from .loop_closures import CLOSURES
from .tree_plan import ends_of
from .tree_reactions import RowWrench
from .tree_rows import BodyFrame, by_frame


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Conditions that are left out.

    Attributes:
        of: name of the joint that they belong to, as given.
        joint: a joint with these conditions.
        frames: of a simulator on its bodies; see `frame_constraints.Frame`.
    """

    of: str
    joint: Joint
    frames: Sequence[Any]

    def rows(self, first: int) -> tuple[Array, list[RowWrench]]:
        """Return the rows of the conditions, and what unit multipliers exert on the bodies.

        Args:
            first: index of the first row.
        """
        i, j = (
            BodyFrame(each.body, None, each.position, each.rotation, each.jacobian)
            for each in self.frames
        )
        found, exerted = list[Array](), list[RowWrench]()
        for condition in CLOSURES[type(self.joint)].conditions(self.joint, i, j):
            found.append(np.atleast_2d(condition.rows()[1]))
            rows = slice(first, first := first + len(found[-1]))
            exerted += [
                RowWrench(rows, frame.body, frame.position, wrenches)
                for frame, wrenches in zip((i, j), by_frame(condition, (i, j)), strict=True)
            ]
        return np.vstack(found), exerted


def left_out_of(mechanism: Mechanism, frame: Callable[[str, Vector], Any]) -> list[LeftOut]:
    """Return the conditions left out of a mechanism.

    Args:
        frame: returns a frame on a body, at a point, global at design.
    """
    return [
        LeftOut(each.joint.name, joint, [*map(frame, joint.bodies, ends_of(mechanism, joint))])
        for each in mechanism.reduced
        for joint in each.left_out
    ]
