"""Forces of a motion, from any engine: reactions of joints, efforts of drivers, force elements."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .errors import number_of

Array: TypeAlias = NDArray[np.float64]

# A basis of undetermined multipliers is orthonormal to round-off over the smallest singular value,
# which is above 1e-6 in sound linkages. A larger component is real.
DETERMINED = 1e-8
BALANCED = 1e-9
"""Largest accepted part of the powers that is missing to their balance: the default tolerance of
outputs, and a hundred thousand times the round-off of the engines.
"""
# Rows that are redundant but for digits have a singular value of the size of these digits in place
# of zero. They turn what is undetermined by up to 3.5 times this value over the smallest other one,
# measured in seven engines for 111 random linkages with all points and axes off by 3e-7 to 1e-4.
TURNED = 5.0
# The pose is singular if a singular value of the rows is below this part of the largest, or below
# this many times the digits: the balancing effort is then infinite or not unique, or has no two
# digits.
SINGULAR, BLURRED = 1e-9, 100.0
# Numbers of a file have six digits and more. Forces that multiply an error of the last one by this,
# which leaves one digit, are told.
AMPLIFIED = 1e5


@dataclass(frozen=True, eq=False)
class Multipliers:
    """Multipliers of rows at n samples.

    Attributes:
        values: shape (n, rows); zero of rows left out within digits.
        free: orthonormal basis of the multipliers that balance each other, shape (n, rows,
            redundant rows). No driver takes part: where drivers determine the motion, their rows
            are independent of those of joints.
        digits: largest singular value of the joint rows that is zero but for digits, shape (n,).
        regular: smallest other one, shape (n,).
        least, largest: singular values of the rows that are solved, shape (n,).
    """

    values: Array
    free: Array
    digits: Array
    regular: Array
    least: Array
    largest: Array

    @staticmethod
    def of(
        rows: Array, demand: Array, drivers: Sequence[int], left_out: int, freedoms: int = 0
    ) -> Multipliers:
        """Return the shortest multipliers with J^T values = demand, and what is free beside them.

        Args:
            rows: J, shape (n, rows, unknowns). The solved ones are as many as unknowns or more, or
                all independent.
            demand: shape (n, unknowns).
            drivers: indices of the drivers' rows.
            left_out: number of rows at the end that are redundant but for digits. They carry
                nothing, but what others carry may as well be theirs.
            freedoms: number of degrees of freedom that no row holds, in a free motion.
        """
        n, count, unknowns = rows.shape
        solved = rows[:, : count - left_out]
        held = min(unknowns - freedoms, count - left_out)
        rank = held - len(drivers)
        u, sizes, vh = np.linalg.svd(solved, full_matrices=False)
        inverse = 1.0 / np.where(sizes > SINGULAR * sizes[:, :1], sizes, np.inf)
        values = np.zeros((n, count))
        values[:, : count - left_out] = np.einsum(
            "nru,nu->nr", u, inverse * np.einsum("nuk,nk->nu", vh, demand)
        )
        joints = [k for k in range(count) if k not in drivers]
        u, of_joints, _ = np.linalg.svd(rows[:, joints], full_matrices=True)
        # without rows beyond the rank, none is redundant
        of_joints = np.pad(of_joints, ((0, 0), (0, 1)))
        free = np.zeros((n, count, len(joints) - rank))
        free[:, joints] = u[:, :, rank:]
        regular = of_joints[:, rank - 1] if rank else np.ones(n)
        least = sizes[:, held - 1]
        return Multipliers(values, free, of_joints[:, rank], regular, least, sizes[:, 0])

    @property
    def singular(self) -> NDArray[np.bool_]:
        """Whether the pose is singular, shape (n,)."""
        least = np.minimum(self.least, self.regular)
        return least <= np.maximum(SINGULAR * self.largest, BLURRED * self.digits.max(initial=0.0))

    @property
    def known(self) -> Array:
        """See `Reaction.known`. Digits show differently from pose to pose: the largest count."""
        regular = np.maximum(self.regular, SINGULAR)  # where it is smaller there are no forces
        return np.maximum(DETERMINED, TURNED * self.digits.max(initial=0.0) / regular)

    def message(self, times: Array) -> str:
        """Return the message on samples without forces, and on forces that multiply digits.

        Args:
            times: of the samples [s], shape (n,).
        """
        singular, said = self.singular, list[str]()
        if singular.any():
            said.append(
                f"no forces {_at(times[singular])}: the pose is singular, and rigid bodies"
                " determine no finite force there; leave these samples out"
            )
        large = ~singular & (self.largest > AMPLIFIED * self.least)
        if large.any():
            said.append(
                f"forces {_at(times[large])}, multiply the digits of points and axes by up to"
                f" {float((self.largest[large] / self.least[large]).max()):.1g}: the pose is nearly"
                " singular, or rows are nearly redundant; kincheck explain names them"
            )
        return "; ".join(said)


def _at(times: Array) -> str:
    return f"at {number_of(times.size, 'sample')}, the first at time {float(times[0]):.9g}"


@dataclass(frozen=True, eq=False)
class Reaction:
    """The wrench of a joint over n samples: of its first body on its second, global axes.

    Attributes:
        force: [N], shape (n, 3).
        moment: about the joint's point as carried by the second body [N m], shape (n, 3).
        free: directions of wrenches (force, then moment per unit of length) left undetermined by
            redundant rows, shape (n, 6, redundant rows).
        known: largest component of `free` along which the wrench is determined, shape (n,).
    """

    force: Array
    moment: Array
    free: Array
    known: Array | float = DETERMINED

    def along(self, direction: Sequence[float] | Array, *, moment: bool = False) -> Array:
        """Return the component of force or moment along a unit direction, shape (n,).

        It is NaN at samples with this component undetermined by redundant rows.

        Args:
            direction: shape (3,), or (n, 3) for one at each sample.
        """
        part = slice(3, 6) if moment else slice(0, 3)
        d = np.asarray(direction, dtype=np.float64)
        if d.ndim == 1:
            loose: Array = np.einsum("i,nik->nk", d, self.free[:, part])
            values: Array = (self.moment if moment else self.force) @ d
        else:
            loose = np.einsum("ni,nik->nk", d, self.free[:, part])
            values = np.einsum("ni,ni->n", self.moment if moment else self.force, d)
        # not by a power, which is not defined for a ball around zero
        return np.where((loose * loose).sum(axis=1) <= self.known**2, values, np.nan)

    def about(self, arm: Array) -> Reaction:
        """Return the same wrench with its moment about another point.

        Args:
            arm: from that point to the joint's [m], shape (n, 3).
        """
        moved = self.free.copy()
        moved[:, 3:] += np.cross(arm[:, None], self.free[:, :3].swapaxes(1, 2)).swapaxes(1, 2)
        return Reaction(self.force, self.moment + np.cross(arm, self.force), moved, self.known)

    def determined(self) -> tuple[int, int, int]:
        """Return how many directions of force, of moment and of the wrench are determined.

        They are the fewest over the samples, of 3, 3 and 6.
        """
        there = np.isfinite(self.free).all(axis=(1, 2))
        free, known = self.free[there], np.broadcast_to(self.known, there.shape)[there]
        force, moment, wrench = (
            int(np.linalg.matrix_rank(free[:, part], tol=known).max(initial=0)) if free.size else 0
            for part in (slice(0, 3), slice(3, 6), slice(0, 6))
        )
        return 3 - force, 3 - moment, 6 - wrench


@dataclass(frozen=True, eq=False)
class Forces:
    """Forces over n samples; NaN at samples unreached or without forces.

    Attributes:
        joints: reaction by joint.
        drivers: effort by driver, [N] or, if it turns, [N m], shape (n,): effort times rate is the
            power put in by the driver.
        elements: force by force element, shape (n,): tension of a spring-damper [N]; torque of a
            torsional one on the joint's second body [N m]; amount of a force [N] or torque [N m].
        power: of the drivers less the change of energy and the dissipation [W], shape (n,): zero
            but for round-off.
        largest_power: the largest of the summed powers [W], shape (n,).
        message: empty, or why forces are missing.
    """

    joints: Mapping[str, Reaction]
    drivers: Mapping[str, Array]
    elements: Mapping[str, Array]
    power: Array
    largest_power: Array
    message: str = ""

    def has(self, names: Collection[str]) -> bool:
        """Return whether all named joints, drivers and force elements have their forces here."""
        return all(
            name in self.joints or name in self.drivers or name in self.elements for name in names
        )

    def account(self) -> dict[str, Any]:
        """Return facts for the record: the power missing, as a part of the largest (None if it is
        not known at any sample), and the joints whose reaction is not wholly determined, with the
        determined directions.
        """
        known = np.isfinite(self.power)
        largest = float(self.largest_power[known].max(initial=0.0))
        missing = float(np.abs(self.power[known]).max(initial=0.0))
        counts = {name: each.determined() for name, each in self.joints.items()}
        return {
            "power_missing": (missing / largest if largest else missing) if known.any() else None,
            "determined_directions": {
                name: {"force": force, "moment": moment, "wrench": wrench}
                for name, (force, moment, wrench) in counts.items()
                if wrench < 6
            },
        }


def in_wrenches(free: Mapping[str, Array], known: Array) -> dict[str, Array]:
    """Return what is undetermined as orthonormal wrenches of all joints together, so that its
    components are of one size in all formulations.

    Args:
        free: of all joints, shape (n, 6, redundant rows) each.
        known: see `Reaction.known`; wrenches within it are none.
    """
    u, sizes, _ = np.linalg.svd(np.concatenate([*free.values()], axis=1), full_matrices=False)
    kept = np.where(sizes > known[:, None], 1.0, 0.0)[:, None]
    return dict(zip(free, np.split(kept * u, len(free), axis=1), strict=True))
