"""Tolerances of outputs in a case file, and their defaults."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from .document import fault, join
from .reference_columns import Convert
from .schema import ToleranceKeys

# Hardpoints are measured to about a micrometre; double precision rounds coordinates of metre-sized
# mechanisms at 1e-16 m.
DEFAULT_ATOL = 1e-9
# The driver's pace scales `atol`. Near a dead centre, outputs and their errors change thousands of
# times as fast as the driver. Example: a loop of a revolute, a cylindrical joint and a pin in a
# slot has 1,855 m/s^2 at a pace of 0.5 /s. Engines are proved to be within 3e-10 m/s^2; 1e-9 m at
# this pace allows less.
DEFAULT_RTOL = 1e-9
_OF_RANGE = "; and of values whose range is larger, as much of the range"
# For mechanisms below a millimetre: some are as small as a nanometre.
PART_OF_SIZE = 1e-6
DEFAULT_WHY = (
    "the default of 1e-9 m, or a millionth of the size of mechanisms below a millimetre: a"
    " thousandth of the micrometre that hardpoints are measured to, and millions of times the"
    f" round-off of metre-sized coordinates in double precision{_OF_RANGE}"
)
FORCES = ("N", "N m")
_OF_LOADS = (
    "the default of 1e-9 of the loads (weights, inertia at the drivers' pace, springs, applied"
    " forces): a thousandth of what load cells resolve, and a thousand times the round-off of the"
    f" least exact engine, which differentiates its rows numerically{_OF_RANGE}"
)
_DEFAULTS: Mapping[str, str] = {
    "m": DEFAULT_WHY,
    "rad": (
        "the default of 1e-9 rad: a nanometre, the default of lengths, at a metre; a"
        " hundred-thousandth of the hundredth of a degree that wheel alignment is measured to, and"
        f" millions of times the round-off of an angle in double precision{_OF_RANGE}"
    ),
    "1": (
        "the default of 1e-9 of a ratio: a nanometre, the default of lengths, in a metre, and"
        f" millions of times the round-off of a ratio near one in double precision{_OF_RANGE}"
    ),
    **dict.fromkeys(FORCES, _OF_LOADS),
}
"""Reason for the default, by the unit of the output."""


def default(size: float, unit: str = "m") -> tuple[float, float, str]:
    """Return the default atol [unit], rtol [-] and their reason.

    Args:
        size: size of the mechanism [m]; for a force or torque, the loads [unit].
    """
    least = {"m": min(DEFAULT_ATOL, PART_OF_SIZE * size)}
    return (
        least.get(unit, DEFAULT_ATOL * (size if unit in FORCES else 1.0)),
        DEFAULT_RTOL,
        _DEFAULTS[unit],
    )


def tolerance(
    file: Path, key: str, keys: ToleranceKeys, convert: Convert, size: float, unit: str = "m"
) -> tuple[float, float, str]:
    """Return atol [unit], rtol [-] and their reason.

    Args:
        convert: conversion from the file's unit of the output to SI.
        size: see `default`.

    Raises:
        CaseError: a tolerance without a reason, or a reason without a tolerance.
    """
    if keys.atol is None and keys.rtol is None:
        if keys.why is not None:
            raise fault(
                file,
                join(key, "why"),
                "found a reason without a tolerance, expected both; add atol or rtol",
            )
        return default(size, unit)
    if keys.why is None:
        raise fault(
            file,
            join(key, "why"),
            "missing, expected the reason for the tolerance; add the key 'why'",
        )
    return convert(keys.atol or 0.0), keys.rtol or 0.0, keys.why
