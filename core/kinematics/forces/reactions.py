"""Reactions of joints and efforts of drivers from a solved motion: J^T lambda = M a + h - Q.

J has all native rows, of joints and of drivers. On the manifold the simplified rows of a whole
joint span what the exact ones span, so the wrench of a joint does not depend on the row style; the
forces of all styles and solvers are computed here, from the motion of the bodies. All samples are
evaluated at once, as numpy lanes.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...errors import SolveError, unknown
from ...forces import Forces, Reaction
from ...joints.base import Joint
from ...mechanism.drivers import Driver
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...trajectory import Array, Trajectory
from .force_rows import ForceRows
from .motion_lanes import MotionLanes
from .power import balance

Lanes: TypeAlias = NDArray[np.bool_]
# Numbers of a matrix of rows over all samples that are solved at once: some 64 MB.
AT_ONCE = 8_000_000


def with_forces(
    mechanism: Mechanism,
    path: Path,
    motion: Trajectory,
    names: Collection[str] | None = None,
    bodies: Collection[str] = (),
) -> Trajectory:
    """Return a solved motion with its forces, of the bodies only those named; see `forces_of`.

    Its details tell the balance of power, and the joints whose reaction is not wholly determined.
    """
    found = forces_of(mechanism, path, motion, names)
    return Trajectory(
        motion.points,
        motion.solved,
        motion.iterations,
        motion.residual,
        "; ".join(filter(None, (motion.message, found.message))),
        {**motion.details, "forces": _account(found)},
        {name: motion.bodies[name] for name in bodies},
        found,
        failures=motion.failures,
    )


def _account(found: Forces) -> dict[str, Any]:
    """Return the facts of the forces for the record."""
    known = np.isfinite(found.power)
    largest = float(found.largest_power[known].max(initial=0.0))
    missing = float(np.abs(found.power[known]).max(initial=0.0))
    counts = {name: each.determined() for name, each in found.joints.items()}
    return {
        "power_missing": missing / largest if largest else 0.0,
        "determined_directions": {
            name: {"force": force, "moment": moment, "wrench": wrench}
            for name, (force, moment, wrench) in counts.items()
            if wrench < 6
        },
    }


def forces_of(
    mechanism: Mechanism, path: Path, motion: Trajectory, names: Collection[str] | None = None
) -> Forces:
    """Return the forces of a solved motion.

    Args:
        mechanism: with masses, gravity and force elements.
        path: of the drivers, that the motion follows.
        motion: of all moving bodies, with accelerations.
        names: of joints, drivers and force elements; all unless given.

    Raises:
        SolveError: a name is unknown, or the motion lacks a body.
    """
    wanted = _wanted(mechanism, names)
    solved = motion.solved
    lanes = MotionLanes(mechanism, path, motion)
    lines = ForceRows(lanes)
    step = max(1, AT_ONCE // max(1, lines.count * lines.formulation.unknowns))
    parts = [lines.solve(slice(k, k + step)) for k in range(0, max(1, lanes.n), step)]
    multipliers = np.concatenate([each.multipliers for each in parts])
    null = np.concatenate([each.null for each in parts])
    singular = np.concatenate([each.singular for each in parts])
    efforts = {each.name: lines.effort(each, multipliers, null) for each in mechanism.drivers}
    elements = {name: each.amount + np.zeros(lanes.n) for name, each in lanes.applied.items()}
    power, largest = balance(mechanism, lanes.at, lanes.applied, efforts, lanes.rates, lanes.n)
    spread = _Spread(solved, singular)
    return Forces(
        {
            joint.name: Reaction(*map(spread, lines.reaction(joint, multipliers, null)))
            for joint in wanted.joints
        },
        {each.name: spread(efforts[each.name]) for each in wanted.drivers},
        {name: spread(elements[name], ill=False) for name in wanted.elements},
        spread(power),
        spread(largest),
        _said(singular, lanes.times),
    )


@dataclass(frozen=True)
class _Wanted:
    joints: Sequence[Joint]
    drivers: Sequence[Driver]
    elements: Sequence[str]


def _wanted(mechanism: Mechanism, names: Collection[str] | None) -> _Wanted:
    if isinstance(names, str):
        raise SolveError(f"forces is {names!r}, expected a list of names, or True for all")
    known = [each.name for each in (*mechanism.joints, *mechanism.drivers, *mechanism.forces)]
    for name in names or ():
        if name not in known:
            what = unknown("joint, driver or force element", name, known)
            raise SolveError(f"forces of mechanism {mechanism.name!r}: {what}")
    given = known if names is None else names
    return _Wanted(
        [each for each in mechanism.joints if each.name in given],
        [each for each in mechanism.drivers if each.name in given],
        [each.name for each in mechanism.forces if each.name in given],
    )


@dataclass(frozen=True, eq=False)
class _Spread:
    """Puts values of the solved samples at their places among all samples, NaN elsewhere."""

    solved: Lanes
    singular: Lanes

    def __call__(self, values: Array, *, ill: bool = True) -> Array:
        found = np.full((len(self.solved), *values.shape[1:]), np.nan)
        keep = ~self.singular if ill else np.ones_like(self.singular)
        shown = np.where(keep.reshape(-1, *(1,) * (values.ndim - 1)), values, np.nan)
        found[self.solved] = shown
        return found


def _said(singular: Lanes, times: Array) -> str:
    if not singular.any():
        return ""
    at = float(times[int(np.flatnonzero(singular)[0])])
    return (
        f"no forces at {int(singular.sum())} samples, the first at time {at:.9g}: the pose is"
        " singular, and rigid bodies determine no finite force there; leave these samples out"
    )
