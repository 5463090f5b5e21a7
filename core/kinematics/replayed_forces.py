"""Forces needed by a motion from elsewhere: reactions of joints, and forces without a bearer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..forces import Forces
from ..mechanism.mechanism import Mechanism
from ..mechanism.motions import Path
from ..trajectory import Array, BodyMotion, Trajectory
from .forces.reactions import ForceRows, MotionLanes, forces_of

# Of the largest singular value of the rows, what is none.
_REDUNDANT = 1e-9


@dataclass(frozen=True, eq=False)
class Needed:
    """Forces for the masses and loads of a mechanism to move as given.

    Attributes:
        forces: reactions of joints and forces of elements; None without a joint.
        free: by body, force and torque without a joint or driver to carry it, torques over the
            mechanism's unit of length [N], shape (n, 6). Zero for a motion of these masses and
            loads, NaN for a spring without length.
        largest: largest force of the motion, to compare with [N].
    """

    forces: Forces | None
    free: Mapping[str, Array]
    largest: float


def needed_forces(mechanism: Mechanism, motions: Mapping[str, BodyMotion], times: Array) -> Needed:
    """Return the forces needed by a motion from elsewhere; drivers carry those along them.

    Args:
        motions: of all moving bodies, with accelerations.
        times: of the samples [s], shape (n,): torsion springs count their turns along them.

    Raises:
        SolveError: the motion lacks a body or its accelerations.
    """
    count = len(times)
    solved, none = np.ones(count, dtype=np.bool_), np.zeros(count, dtype=np.int64)
    motion, path = Trajectory({}, solved, none, 0.0, bodies=motions), Path({}, times)
    passive = replace(mechanism, drivers=())
    with np.errstate(divide="ignore", invalid="ignore"):  # a spring without a length, for once
        demand = ForceRows(MotionLanes(passive, path, motion)).demand
        lines = ForceRows(MotionLanes(mechanism, path, motion))
    left, unit = np.array(demand), lines.lanes.frame.unit
    if lines.matrix.shape[1]:
        _, sizes, right = np.linalg.svd(lines.matrix, full_matrices=False)
        held = sizes > _REDUNDANT * sizes[:, :1]
        along = np.where(held, np.einsum("nru,nu->nr", right, demand), 0.0)
        left = left - np.einsum("nru,nr->nu", right, along)
    columns = lines.formulation.columns
    free = {name: left[:, first : first + 6] / unit for name, first in columns.items()}
    bodies = demand[:, : 6 * len(columns)]
    known = np.abs(bodies)[np.isfinite(bodies)]
    largest = float(known.max(initial=0.0)) / unit
    forces = forces_of(passive, path, motion) if passive.joints else None
    return Needed(forces, free, largest)
