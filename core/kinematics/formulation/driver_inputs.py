"""Inputs of drivers to the equations: the numbers of a `Drive` from values in SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Driver, Path
from ...primitives.base import Drive
from ...trajectory import Array


def drive_numbers(drivers: Sequence[Driver], drive: Array, unit: float) -> Array:
    """Return the numbers of a `Drive` for each driver, shape (5 * drivers, n).

    Lengths are in the mechanism's unit.

    Args:
        drive: value from the design, velocity and acceleration [SI], shape (3, drivers, n).
    """
    found = np.empty((len(drivers), 5, drive.shape[-1]))
    for numbers, driver, motion in zip(found, drivers, drive.swapaxes(0, 1), strict=True):
        numbers[:3] = motion * (1.0 if driver.turns else 1.0 / unit)
        numbers[3], numbers[4] = np.cos(0.5 * motion[0]), np.sin(0.5 * motion[0])
    return found.reshape(5 * len(drivers), drive.shape[-1])


def samples(
    mechanism: Mechanism, drivers: Sequence[str], unit: float, path: Path, times: Array
) -> Array:
    """Return the times, and the numbers of a `Drive` for each named driver at these times of a
    path, shape (1 + 5 * drivers, n).
    """
    numbers = drive_numbers([*map(mechanism.driver, drivers)], path.drive(drivers, times), unit)
    return np.concatenate([times[None], numbers])


def turns(mechanism: Mechanism, drivers: Sequence[str]) -> list[str]:
    """Return the names of a lane's scalars that hold angles of drivers [rad from the design]."""
    return [f"drive {name}.0" for name in drivers if mechanism.driver(name).turns]


def standing_drives(
    mechanism: Mechanism, unit: float, change: Mapping[str, float]
) -> dict[str, Drive]:
    """Return the drives, by name, of drivers at rest at values from the design [SI]."""
    values = np.array([[*change.values()], *np.zeros((2, len(change)))])[..., None]
    numbers = (
        drive_numbers([mechanism.driver(name) for name in change], values, unit)
        .reshape(-1, 5)
        .tolist()
    )
    return {name: Drive(*each) for name, each in zip(change, numbers, strict=True)}
