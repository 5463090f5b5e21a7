"""Defects of a motion of bodies from any source, by the constraints of the mechanism."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...trajectory import QUANTITIES, Array, BodyMotion, Trajectory
from .force_rows import ForceRows
from .motion_lanes import MotionLanes


def motion_defects(mechanism: Mechanism, path: Path, motion: Trajectory) -> Mapping[str, Array]:
    """Return what the bodies of a motion leave of the constraints of joints, couplers and drivers,
    and their distance from the named points.

    Velocities and accelerations are judged if every body has them.

    Returns:
        By quantity and place in words, the largest defect at each solved sample, shape (n,): of
        positions relative to the mechanism's size, of rates relative to those of the constraints.

    Raises:
        SolveError: the motion lacks a body.
    """
    bodies = {name: motion.bodies[name] for name in motion.bodies}
    orders = min(1 + (each.v is not None) * (1 + (each.a is not None)) for each in bodies.values())
    whole = Trajectory(
        motion.points,
        motion.solved,
        motion.iterations,
        motion.residual,
        bodies={name: _with_rates(each) for name, each in bodies.items()},
    )
    lines = ForceRows(MotionLanes(mechanism, path, whole))
    found: dict[str, Array] = {}
    for quantity, defects in zip(QUANTITIES[:orders], _defects(lines), strict=False):
        for (owner, _), row in zip(lines.formulation.owners, np.abs(defects).T, strict=True):
            label = f"{quantity} at {owner!r}"
            found[label] = np.maximum(row, found.get(label, 0.0))
    for point in mechanism.points:
        if point.name in motion.points:
            there = motion.points[point.name].position[motion.solved] - np.array(point.position)
            off = there - lines.stacked(lines.lanes.at.place(point.body, point.position))
            distance = np.linalg.norm(off, axis=1) / lines.lanes.frame.unit
            label = f"position of points on {point.body!r}"
            found[label] = np.maximum(distance, found.get(label, 0.0))
    return found


def _defects(lines: ForceRows) -> Iterator[Array]:
    """Yield what is left of the constraints by order of the motion, shape (n, rows)."""
    lanes, formulation, at = lines.lanes, lines.formulation, lines.equations.at
    names, carried = formulation.bodies, lanes.at.accelerations
    yield lines.stacked(formulation.phi(at))
    v = lines.stacked([x for k in names for x in (*lanes.at.twists[k].v, *lanes.at.twists[k].w)])
    nu = lines.stacked(formulation.nu(at))
    speed = float(np.abs(nu).max(initial=0.0)) or 1.0
    own, off = _left(lines.matrix, v, nu)
    yield off / speed
    a = lines.stacked([x for k in names for x in (*carried[k].v_t, *carried[k].w_t)])
    gamma = lines.stacked(formulation.gamma(at, [*np.hstack([v, own]).T]))
    _, off = _left(lines.matrix, a, gamma)
    yield off / max(float(np.abs(gamma).max(initial=0.0)), speed**2)


def _with_rates(motion: BodyMotion) -> BodyMotion:
    """Return the motion with zero for rates that are not given."""
    none = np.zeros((len(motion.r), 6))
    v, a = (none if each is None else each for each in (motion.v, motion.a))
    return replace(motion, v=v, a=a)


def _left(matrix: Array, of_bodies: Array, right: Array) -> tuple[Array, Array]:
    """Return the rates of the joints' own coordinates that fit best, and what is left of the rows.

    Args:
        matrix: shape (n, rows, unknowns): bodies, then coordinates.
        of_bodies: rates of the bodies, shape (n, 6 bodies).
    """
    bodies, own = np.split(matrix, [of_bodies.shape[1]], axis=2)
    wanted = right - np.einsum("nrk,nk->nr", bodies, of_bodies)
    rates: Array = np.einsum("nkr,nr->nk", np.linalg.pinv(own), wanted)
    return rates, wanted - np.einsum("nrk,nk->nr", own, rates)
