"""Forces of a motion, from any engine: reactions of joints, efforts of drivers, force elements."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .errors import number_of

Array: TypeAlias = NDArray[np.float64]

# The null space of redundant rows is orthonormal to round-off over the smallest singular value,
# which is above 1e-6 in sound linkages. A larger component is real.
DETERMINED = 1e-8
BALANCED = 1e-9
"""Largest accepted part of the powers that is missing to their balance: the default tolerance of
outputs, and a hundred thousand times the round-off of the engines.
"""


@dataclass(frozen=True, eq=False)
class Reaction:
    """The wrench of a joint over n samples: of its first body on its second, global axes.

    Attributes:
        force: [N], shape (n, 3).
        moment: about the joint's point as carried by the second body [N m], shape (n, 3).
        free: directions of wrenches (force, then moment per unit of length) left undetermined by
            redundant rows, shape (n, 6, redundant rows).
    """

    force: Array
    moment: Array
    free: Array

    def along(self, direction: Sequence[float] | Array, *, moment: bool = False) -> Array:
        """Return the component of force or moment along a unit direction, shape (n,).

        It is NaN at samples with this component undetermined by redundant rows.
        """
        part = slice(3, 6) if moment else slice(0, 3)
        d = np.asarray(direction, dtype=np.float64)
        loose = np.abs(np.einsum("i,nik->nk", d, self.free[:, part])).max(axis=1, initial=0.0)
        values: Array = (self.moment if moment else self.force) @ d
        return np.where(loose <= DETERMINED, values, np.nan)

    def determined(self) -> tuple[int, int, int]:
        """Return how many directions of force, of moment and of the wrench are determined.

        They are the fewest over the samples, of 3, 3 and 6.
        """
        parts = (slice(0, 3), slice(3, 6), slice(0, 6))
        known = self.free[np.isfinite(self.free).all(axis=(1, 2))]
        loose = [
            int(np.linalg.matrix_rank(known[:, part], tol=DETERMINED).max(initial=0))
            if known.size
            else 0
            for part in parts
        ]
        return 3 - loose[0], 3 - loose[1], 6 - loose[2]


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


def no_forces_at(times: Array) -> str:
    """Return the message on samples at singular poses, by their times [s]; empty for none."""
    if not times.size:
        return ""
    return (
        f"no forces at {number_of(times.size, 'sample')}, the first at time"
        f" {float(times[0]):.9g}: the pose is singular, and rigid bodies determine no finite force"
        " there; leave these samples out"
    )
