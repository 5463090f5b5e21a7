"""Forces of a solved motion: reactions of joints and efforts of drivers.

All samples are evaluated at once, as numpy lanes. Singular values show singular poses and the
forces left undetermined by redundant rows.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...forces import Forces, Reaction, in_wrenches
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...trajectory import Array, Trajectory
from .force_rows import ForceRows
from .motion_lanes import Follow, MotionLanes
from .power import powers
from .wanted import wanted_forces

Lanes: TypeAlias = NDArray[np.bool_]


def with_forces(
    mechanism: Mechanism,
    path: Path,
    motion: Trajectory,
    names: Collection[str] | None = None,
    bodies: Collection[str] = (),
    follow: Follow | None = None,
) -> Trajectory:
    """Return a solved motion with its forces and only the named bodies; see `forces_of`."""
    found = forces_of(mechanism, path, motion, names, follow)
    return Trajectory(
        motion.points,
        motion.solved,
        motion.iterations,
        motion.residual,
        "; ".join(filter(None, (motion.message, found.message))),
        motion.details,
        {name: motion.bodies[name] for name in bodies},
        found,
        failures=motion.failures,
    )


def forces_of(
    mechanism: Mechanism,
    path: Path,
    motion: Trajectory,
    names: Collection[str] | None = None,
    follow: Follow | None = None,
) -> Forces:
    """Return the forces of a solved motion.

    Args:
        mechanism: mechanism with masses, gravity and force elements.
        path: drivers' path followed by the motion.
        motion: motion of all moving bodies, with accelerations.
        names: names of joints, drivers and force elements; by default all.
        follow: counts the turns of joints with torsional springs; by default their rates do.

    Raises:
        SolveError: a name is unknown, or the motion lacks a body.
    """
    wanted = wanted_forces(mechanism, names)
    solved = motion.solved
    lanes = MotionLanes(mechanism, path, motion, follow)
    lines = ForceRows(lanes)
    solution = lines.solve()
    efforts = {each.name: lines.effort(each, solution) for each in mechanism.drivers}
    elements = {name: each.amount + np.zeros(lanes.n) for name, each in lanes.applied.items()}
    every = powers(mechanism, lanes.at, lanes.applied, efforts, lanes.rates)
    # its shape is given: without a mass, or without a solved sample, the list alone has none
    table: Array = np.array([each + np.zeros(lanes.n) for each in every])
    table = table.reshape(len(every), lanes.n)
    spread = _Spread(solved, solution.singular)
    joints = [j for j in mechanism.given_joints if mechanism.reduced or j.name in wanted.joints]
    free = {joint.name: lines.free(joint, solution) for joint in joints}
    if mechanism.reduced:
        free = in_wrenches(free, solution.known)
    known = spread(solution.known)

    def reaction(name: str) -> Reaction:
        force, moment = map(spread, lines.wrench(mechanism.joint(name), solution.values))
        return Reaction(force / lanes.frame.unit, moment, spread(free[name]), known)

    return Forces(
        {name: reaction(name) for name in wanted.joints},
        {name: spread(efforts[name]) for name in wanted.drivers},
        {name: spread(elements[name], ill=False) for name in wanted.elements},
        spread(table.sum(axis=0)),
        spread(np.abs(table).max(axis=0, initial=0.0)),
        solution.message(lanes.times),
    )


@dataclass(frozen=True, eq=False)
class _Spread:
    """Place values of the solved samples among all samples, with NaN at the others."""

    solved: Lanes
    singular: Lanes

    def __call__(self, values: Array, *, ill: bool = True) -> Array:
        found = np.full((len(self.solved), *values.shape[1:]), np.nan)
        keep = ~self.singular if ill else np.ones_like(self.singular)
        shown = np.where(keep.reshape(-1, *(1,) * (values.ndim - 1)), values, np.nan)
        found[self.solved] = shown
        return found
