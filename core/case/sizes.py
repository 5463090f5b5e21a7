"""Sizes that are improbable for their unit: most often the numbers are of another one."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..mechanism.mechanism import Vector
from .case import MARKER, Case
from .units import ANGLES, LENGTHS, Unit

# Points that are closer than this part of their coordinates coincide.
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
"""What an improbable size in a unit may be, by the unit and whether it is too small."""


@dataclass(frozen=True)
class Range:
    """Sizes that are probable [SI], and of what, where that is not said elsewhere."""

    least: float
    most: float
    what: str = ""

    def improbable(self, size: float, unit: Unit) -> str:
        """Return the size in its unit, what was expected, and what it may be; empty where it is
        probable.
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
"""Those of model cars and of haulage trucks; a unit taken for another is a thousandfold mistake, or
forty at least.
"""
# Of the mechanism's size: strokes are some hundredths to some times as long.
STROKES = Range(5e-4, 20.0)
# From degrees taken for radians twice over, or once, up to a few turns.
TURNS = {"rad": Range(1.7e-3, 38.0), "deg": Range(math.radians(1.0), math.inf)}


def size_notes(case: Case) -> Iterator[str]:
    """Yield what is improbable of the size of a mechanism, and of the way of each moving driver."""
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
    """Return the largest extent of positions along a global axis [m]; zero where all coincide, to
    rounding.
    """
    if not positions:
        return 0.0
    extent = float(np.ptp(np.array(positions), axis=0).max())
    return extent if extent > ROUNDING * float(np.abs(positions).max()) else 0.0
