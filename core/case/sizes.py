"""Improbable sizes of mechanisms and drives, most often a sign of a wrong unit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..mechanism.mechanism import Vector
from .case import MARKER, Case
from .units import ANGLES, LENGTHS, Unit

# Points closer than this fraction of their coordinates coincide.
ROUNDING = 1e-12
_TAKEN_FOR: dict[tuple[str, bool], str] = {
    ("mm", True): "metres declared as mm",
    ("cm", True): "metres declared as cm",
    ("inch", True): "metres declared as inch",
    ("foot", True): "metres declared as foot",
    ("m", False): "mm declared as m",
    ("m", True): "mm converted to m twice",
    ("deg", True): "radians declared as deg",
    ("rad", False): "degrees declared as rad",
    ("rad", True): "degrees converted to radians twice",
}
"""Probable cause of an improbable size, by its unit and whether it is too small."""


@dataclass(frozen=True)
class Range:
    """Probable sizes [SI], and their description if the message needs one."""

    least: float
    most: float
    what: str = ""

    def improbable(self, size: float, unit: Unit) -> str:
        """Return the size in its unit, the expected range and a probable cause; empty for a
        probable size.
        """
        if self.least <= size <= self.most:
            return ""
        expected = " to ".join(
            unit.written(each) for each in (self.least, self.most) if math.isfinite(each)
        )
        if not math.isfinite(self.most):
            expected += " or more"
        taken = _TAKEN_FOR.get((unit.name, size < self.least), "numbers of another unit")
        return f"{unit.written(size)}, expected {self.what}{expected}: {taken}?"


MECHANISMS = Range(5e-3, 100.0)
SUSPENSIONS = Range(0.03, 10.0, "a suspension of ")
"""From model cars to haulage trucks. A wrong unit is an error by a factor of 1000, or at least 40.
"""
# Strokes relative to the mechanism's size, from some hundredths to some times as long.
STROKES = Range(5e-4, 20.0)
# From degrees converted to radians twice, or once, up to a few turns.
TURNS = {"rad": Range(1.7e-3, 38.0), "deg": Range(math.radians(1.0), math.inf)}


def size_notes(case: Case) -> Iterator[str]:
    """Yield notes on an improbable size of the mechanism or range of a moving driver."""
    length, angle = LENGTHS[case.length_unit], ANGLES[case.angle_unit]
    positions = [
        point.position for point in case.mechanism.points if not point.name.startswith(MARKER)
    ]
    extent = spanned(
        [*positions, *(each for joint in case.mechanism.joints for each in joint.points_on())]
    )
    if extent and (found := MECHANISMS.improbable(extent, length)):
        yield f"the mechanism spans {found}"
    for name, values in case.sweep.moved.items():
        if name not in case.sweep.path.motions:  # time
            continue
        low, high, way = float(values.min()), float(values.max()), float(np.ptp(values))
        turns = case.mechanism.driver(name).turns
        unit = angle if turns else length
        probable = (
            TURNS[angle.name] if turns else Range(STROKES.least * extent, STROKES.most * extent)
        )
        if way and (turns or extent) and (found := probable.improbable(way, unit)):
            beside = "" if turns else f" beside a mechanism of {length.written(extent)}"
            yield (
                f"driver {name!r} goes from {unit.written(low)} to {unit.written(high)}{beside}, a"
                f" way of {found}"
            )


def spanned(positions: Sequence[Vector]) -> float:
    """Return the largest extent of positions along a global axis [m], zero if all coincide but for
    rounding.
    """
    if not positions:
        return 0.0
    extent = float(np.ptp(np.array(positions), axis=0).max())
    return extent if extent > ROUNDING * float(np.abs(positions).max()) else 0.0
