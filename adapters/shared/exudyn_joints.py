"""Joints as objects of Exudyn, for its adapter and for the writer of its scripts.

Rows of Exudyn, measured on version 1.13.6 against rotation matrices; markers 0 and 1 are at p0 and
p1, d = p1 - p0:

    object                  constrained axes            rows
    generic joint           some translations           those of x0 . d, y0 . d, z0 . d
                            all translations            d, global
                            rotations x, y              z0 . x1, z0 . y1
                            rotations x, y, z           z0 . y1, z0 . x1, x0 . y1
                            rotation z                  x0 . y1
    revolute joint Z                                    d, z0 . x1, z0 . y1
    prismatic joint X                                   y0 . d, z0 . d, z0 . y1, z0 . x1, x0 . y1

A free axis of a generic joint gives an empty row, which is dropped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core import joints as j
from ...core.joints.base import triad, unit
from ...core.mechanism.mechanism import Vector
from ...core.trajectory import Array

# Constrained axes of a generic joint.
X, Y, Z, ABOUT_X, ABOUT_Y, ABOUT_Z = range(6)
ROWS = {
    "ObjectJointSpherical": 3,
    "ObjectJointRevoluteZ": 5,
    "ObjectJointPrismaticX": 5,
    "ObjectConnectorDistance": 1,
}
"""Number of rows of the objects that are no generic joints."""

GENERIC: Mapping[type[j.Joint], tuple[int, Sequence[int]]] = {
    j.Cylindrical: (2, (X, Y, ABOUT_X, ABOUT_Y)),
    j.InPlane: (0, (X,)),
    j.Inline: (2, (X, Y)),
    j.ParallelAxes: (2, (ABOUT_X, ABOUT_Y)),
    j.Planar: (2, (Z, ABOUT_X, ABOUT_Y)),
    j.Screw: (2, (X, Y, ABOUT_X, ABOUT_Y)),  # and its relation
}
"""Joints about one axis as generic joints: the axis of the frame that is the joint's axis, and the
constrained axes.
"""

JOINTS = (
    *GENERIC,
    *(j.ConstantVelocity, j.Distance, j.Fixed, j.OrientationLock, j.PerpendicularAxes),
    *(j.Revolute, j.RevoluteSpherical, j.Spherical, j.Translational, j.Universal),
)
"""Known types; a subclass may have another meaning."""


@dataclass(frozen=True, eq=False)
class JointObject:
    """An object of Exudyn between the two bodies of a joint.

    Attributes:
        kind: its class.
        points: of its markers, global at design [m].
        frames: rotation matrices of its markers at design; None is parallel to the global axes.
        axes: constrained axes of a generic joint.
        length: of a distance [m].
        keeps: value of the last row [m or -]; the other rows are zero.
    """

    kind: str
    points: tuple[Vector, Vector]
    frames: tuple[Array | None, Array | None] = (None, None)
    axes: Sequence[int] = ()
    length: float = 0.0
    keeps: float = 0.0

    @property
    def options(self) -> dict[str, Any]:
        """The options of the object besides its markers."""
        if self.kind in ROWS:
            return {"distance": self.length} if self.length else {}
        return {"constrainedAxes": [int(axis in self.axes) for axis in range(6)]}

    @property
    def rows(self) -> Sequence[int]:
        """Indices of the rows that are not empty."""
        return range(ROWS[self.kind]) if self.kind in ROWS else self.axes


def frame_along(axis: Sequence[float], column: int) -> Array:
    """Return a right-handed frame with the unit vector of the axis in a column, shape (3, 3)."""
    return np.roll(np.column_stack([tuple(e) for e in triad(axis)]), column - 2, axis=1)


def objects_of(joint: j.Joint, points: tuple[Vector, Vector]) -> list[JointObject]:
    """Return the objects of a joint; of a constant-velocity joint, only the ball.

    Args:
        points: of the joint on its bodies, global at design [m]; see `tree_plan.ends_of`.
    """

    def generic(*axes: int, first: Any = None, second: Any = None, keeps: float = 0.0) -> Any:
        frames = first, first if second is None else second
        return JointObject("ObjectJointGeneric", points, frames, axes, keeps=keeps)

    def rod(length: float) -> JointObject:
        return JointObject("ObjectConnectorDistance", points, length=length)

    match joint:
        case j.Spherical() | j.ConstantVelocity():
            return [JointObject("ObjectJointSpherical", points)]
        case j.Revolute():
            frame = frame_along(joint.axis, 2)
            return [JointObject("ObjectJointRevoluteZ", points, (frame, frame))]
        case j.Translational():
            frame = frame_along(joint.axis, 0)
            return [JointObject("ObjectJointPrismaticX", points, (frame, frame))]
        case j.Universal() | j.PerpendicularAxes():
            # the last row is x0 . y1, the cosine of the cross: an angle rounded by a table is kept
            at_point = (X, Y, Z) if isinstance(joint, j.Universal) else ()
            first, second = frame_along(joint.axes[0], 0), frame_along(joint.axes[1], 1)
            cosine = unit(joint.axes[0]) @ unit(joint.axes[1])
            return [generic(*at_point, ABOUT_Z, first=first, second=second, keeps=cosine)]
        case j.Fixed():
            return [generic(*range(6))]
        case j.OrientationLock():
            return [generic(ABOUT_X, ABOUT_Y, ABOUT_Z)]
        case j.Distance():
            return [rod(joint.rod_length)]
        case j.RevoluteSpherical():
            frame, link = frame_along(joint.axis, 0), np.subtract(points[1], points[0])
            along = float(frame[:, 0] @ link)
            return [rod(float(np.linalg.norm(link))), generic(X, first=frame, keeps=along)]
        case _:
            column, axes = GENERIC[type(joint)]
            return [generic(*axes, first=frame_along(vars(joint)["axis"], column))]
