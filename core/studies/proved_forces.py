"""Values of force outputs from enclosed forces, and the reason where they are undetermined."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..forces import DETERMINED, Forces, Reaction
from ..kinematics import EnclosedForces, Enclosure, Proofs
from .native_error import Column

FORCES_NOTE = (
    " Forces are those of the solved rows; redundant rows, which are left out, carry nothing. A"
    " component is printed only if a unit multiplier of a redundant row changes it by at most"
    f" {DETERMINED:g}, and if the native engine finds it determined, which counts rows left out"
    " within the digits of the case too. Turns of torsional springs are counted as the native"
    " engine counts them."
)


def force_values(output: Any, found: Proofs) -> tuple[Sequence[Column], str | None]:
    """Return a force output's values at the samples, as balls, and the reason if there are none.

    A value is None where there is no proof, and where redundant rows leave it undetermined; there
    are no rates.
    """
    column: list[Any] = [None] * len(found.samples)
    none = [*column]
    there = {
        k: each.forces
        for k, each in enumerate(found.samples)
        if isinstance(each, Enclosure) and each.forces is not None
    }
    if not there:
        return [none] * 3, None
    native = found.native.forces
    assert native is not None  # forces are proved near the native ones
    determined = np.isfinite(output.values(native))
    values: list[Any] = output.values(_forces([*there.values()])).tolist()
    for k, value in zip(there, values, strict=True):
        column[k] = None if isinstance(value, float) or not determined[k] else value
    known = any(value is not None for value in column)
    return [column, none, none], None if known else output.undetermined(native) or None


def _forces(samples: Sequence[EnclosedForces]) -> Forces:
    """Return the forces over the samples, in arrays of balls."""
    first, n = samples[0], len(samples)

    def reaction(name: str) -> Reaction:
        table: Any = np.array([each.joints[name] for each in samples], dtype=object)
        free: Any = np.zeros((n, 6, len(first.free)), dtype=object)
        for k, each in enumerate(samples):
            for column, joints in enumerate(each.free):
                free[k, :, column] = joints[name]
        return Reaction(table[:, :3], table[:, 3:], free)

    def lanes(values: Sequence[Any]) -> Any:
        return np.array(values, dtype=object)

    return Forces(
        {name: reaction(name) for name in first.joints},
        {name: lanes([each.drivers[name] for each in samples]) for name in first.drivers},
        {name: lanes([each.elements[name] for each in samples]) for name in first.elements},
        lanes([each.power for each in samples]),
        np.zeros(n),
    )
