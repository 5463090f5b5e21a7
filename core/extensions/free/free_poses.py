"""Free motion: poses that a mechanism reaches without drivers, and bodies placed to fit others.

Walks follow the motions left by the native rows, the null space of their Jacobian, and return to
the rows by Newton's steps. They need no drivers and no order of the joints.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...kinematics.formulation.cartesian import COLUMNS, Cartesian
from ...kinematics.formulation.constraints import frames
from ...kinematics.formulation.formulation import Configuration
from ...kinematics.formulation.state_vectors import (
    columns_of,
    dense,
    displaced,
    placed_bodies,
    state_of,
)
from ...mechanism.mechanism import Mechanism
from ...primitives.base import Pose
from ...trajectory import Array

Bools: TypeAlias = NDArray[np.bool_]
Poses: TypeAlias = Mapping[str, Array]
"""By moving body: origin, global [m], and Euler parameters, shape (n, 7)."""

# Largest change of an unknown in a step of a walk [rad, units of length].
STEP = 0.25
# Steps tried for each that is wanted.
TRIES = 3
# Newton's steps: their number, their largest change, and the change that ends them.
MOST_STEPS, LONGEST, SHORTEST = 20, 0.5, 1e-14
# Rows up to this hold [units of length]; a step that ends elsewhere has left the branch.
HOLDS = 1e-12
# Of the largest singular value: smaller ones are of redundant rows.
RANK = 1e-7


@dataclass(frozen=True, eq=False)
class Walked:
    """Poses of a mechanism on walks from its design, one walk after the other.

    Attributes:
        poses: those reached, the design first.
        wanted: number of steps.
        freedom: number of motions left by the rows, the least of all poses.
    """

    poses: Poses
    wanted: int
    freedom: int

    @property
    def reached(self) -> int:
        """Number of poses but the design."""
        return len(next(iter(self.poses.values()))) - 1


class FreePoses:
    """The native rows of a mechanism without its drivers and loads.

    Attributes:
        size: extent of its joints [m].
        unit: its unit of length, near its size [m].
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = replace(mechanism, drivers=(), forces=())
        self.frame = frames(self.mechanism)
        self.size, self.unit = self.mechanism.size, self.frame.unit
        self.formulation = Cartesian.of(self.mechanism, self.frame)

    def walk(self, walks: int, steps: int, seed: int, outside: Callable[[Poses], Array]) -> Walked:
        """Return poses along random directions, kept until a step cannot be made.

        Args:
            walks: number of walks.
            steps: number of steps of each.
            outside: distance of poses from the allowed ones, shape (n,); no step enlarges it.
        """
        f, random = self.formulation, np.random.default_rng(seed)
        at = f.configuration({k: [np.full(walks, x) for x in v] for k, v in f.design.items()})
        everywhere = np.arange(f.unknowns, dtype=np.intp)
        drift = random.normal(size=(walks, f.unknowns))
        lengths, freedom = np.full(walks, STEP), f.unknowns
        out, found, kept = outside(self._poses(at)), list[Poses](), list[Bools]()
        counts = np.zeros(walks, dtype=np.int64)
        for _ in range(TRIES * steps):
            if int(counts.min()) >= steps:
                break
            _, sizes, right = np.linalg.svd(self._rows(at)[1])
            ranks = (sizes > RANK * sizes.max(axis=1, initial=0.0)[:, None]).sum(axis=1)
            freedom = min(freedom, f.unknowns - int(ranks.max()))
            step = np.stack(
                [(v[r:] @ d) @ v[r:] for v, r, d in zip(right, ranks, drift, strict=True)]
            )
            largest = np.abs(step).max(axis=1, initial=0.0)[:, None]
            step *= lengths[:, None] / np.maximum(largest, SHORTEST)
            trial, left = self._close(self._step(at, step), everywhere)
            poses = self._poses(trial)
            far = outside(poses)
            good = (left < HOLDS) & (far <= out + HOLDS) & (counts < steps)
            at = f.configuration(
                {
                    key: [np.where(good, x, y) for x, y in zip(value, at.state[key], strict=True)]
                    for key, value in trial.state.items()
                }
            )
            out, counts = np.where(good, far, out), counts + good
            # back, and elsewhere, by a shorter step
            drift[~good] = random.normal(size=(int((~good).sum()), f.unknowns)) - drift[~good]
            lengths = np.where(good, np.minimum(1.5 * lengths, STEP), 0.5 * lengths)
            found.append(poses)
            kept.append(good)
        return Walked(self._order_walks(found, np.array(kept)), walks * steps, freedom)

    def placed(self, poses: Poses) -> Poses:
        """Return poses of all moving bodies; those without given ones fit the rows best."""
        f, mechanism = self.formulation, self.mechanism
        given = {name: (each[:, :3], each[:, 3:]) for name, each in poses.items()}
        lanes = len(next(iter(poses.values())))
        bodies = displaced(mechanism, self.frame, given)
        missing = [name for name in f.bodies if name not in poses]
        for name in missing:  # begins as a neighbour moves
            near = [b for j in mechanism.joints if name in j.bodies for b in j.bodies]
            if known := next((b for b in near if b in bodies), None):
                pose, arm = bodies[known], self.frame.origins[name] - self.frame.origins[known]
                bodies[name] = Pose.of(pose.u + pose.swing(arm), pose.q)
        state = state_of(f, mechanism, self.frame, bodies, {})
        at = f.configuration({k: [x + np.zeros(lanes) for x in v] for k, v in state.items()})
        columns = [k for name in missing for k in range(f.columns[name], f.columns[name] + COLUMNS)]
        own = [*range(COLUMNS * len(f.bodies), f.unknowns)]
        return (
            self._poses(self._close(at, np.array(columns + own, dtype=np.intp))[0])
            if missing
            else poses
        )

    def _rows(self, at: Configuration) -> tuple[Array, Array]:
        """Return the residuals and the Jacobian, shapes (n, rows) and (n, rows, unknowns)."""
        f, lanes = self.formulation, len(next(iter(at.state.values()))[0])
        return columns_of(f.phi(at), lanes), dense(f.rows(at), f.unknowns, lanes)

    def _step(self, at: Configuration, step: Array) -> Configuration:
        return self.formulation.configuration(self.formulation.retract(at, [*step.T]))

    def _close(self, at: Configuration, columns: NDArray[np.intp]) -> tuple[Configuration, Array]:
        """Return the nearest configuration on the rows, and their residual, shape (n,)."""
        residuals, rows = self._rows(at)
        for _ in range(MOST_STEPS):
            if not residuals.shape[1]:
                break
            step = np.zeros((len(rows), rows.shape[2]))
            inverse: Any = np.linalg.pinv(rows[:, :, columns], rcond=RANK)
            step[:, columns] = -np.einsum("nur,nr->nu", inverse, residuals)
            at = self._step(at, np.clip(step, -LONGEST, LONGEST))
            residuals, rows = self._rows(at)
            if np.abs(step).max() < SHORTEST:
                break
        return at, np.abs(residuals).max(axis=1, initial=0.0)

    def _poses(self, at: Configuration) -> Poses:
        lanes = len(next(iter(at.state.values()))[0])
        found = placed_bodies(self.mechanism, self.frame, at.poses, lanes)
        return {name: np.hstack(pair) for name, pair in found.items()}

    def _order_walks(self, found: Sequence[Poses], kept: Bools) -> Poses:
        """Return the kept poses walk by walk, after the design."""
        return {
            body.name: np.concatenate(
                [
                    np.array([[*body.origin, *body.euler_parameters]]),
                    *(
                        np.array([p[body.name][walk] for p in found])[kept[:, walk]]
                        for walk in range(kept.shape[1])
                    ),
                ]
            )
            for body in self.mechanism.moving
        }
