"""Travels of a suspension over the samples, from the options --travel and --rack."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ....mechanism.motions import Motion, Ramp, Table
from ....trajectory import Array
from ...io.document import decimal, fault, shown
from ...io.schema import MOST_SAMPLES

# The middle of the wheel travel of passenger cars, which is about 0.08 m each way; samples every
# 2.5 mm.
TRAVEL, SAMPLES = 0.05, 41
# No wheel and no rack of the largest lorry goes so far: a larger number is in millimetres.
FARTHEST = 1.0


@dataclass(frozen=True, eq=False)
class Travels:
    """Travels over the samples [m].

    Attributes:
        wheel: upward travel of the wheel, or of the left wheel of an axle, or travel of the rack
            alone in steering; shape (n,).
        rack: travel of the rack to the left at the first and at the last sample, linear in the
            wheel's travel; None if the rack stands still.
    """

    wheel: Array
    rack: tuple[float, float] | None = None

    @property
    def of_rack(self) -> Motion:
        """Return the motion of the rack; its time is the wheel's travel."""
        assert self.rack is not None
        (low, high), (first, last) = (self.wheel[0], self.wheel[-1]), self.rack
        if first * high == last * low:
            return Ramp(float(last / high if high else first / low))
        return Table((float(low), float(high)), (first, last))


def read_travels(file: Path, travel: str | None, rack: str | None) -> Travels:
    """Return the travels given by options; by default, the travel of a passenger car's wheel.

    Raises:
        CaseError: an option is not a travel.
    """
    if travel is None:
        return Travels(np.linspace(-TRAVEL, TRAVEL, SAMPLES), _ends(file, rack))
    parts = travel.split(":")
    samples = SAMPLES
    try:
        if len(parts) > 1:
            samples = int(parts.pop())
        ends = _interval([decimal(each) for each in parts])
    except ValueError:
        ends = None
    if ends is None or ends[0] == ends[1] or not 1 < samples <= MOST_SAMPLES:
        raise fault(
            file,
            "--travel",
            f"found {shown(travel)}, expected METRES or METRES:SAMPLES, 2 to {MOST_SAMPLES} of"
            f" them, or START:STOP:SAMPLES, up to {FARTHEST:g} m; say --travel 0.05 for 50 mm up"
            " and down",
        )
    return Travels(np.linspace(*ends, samples), _ends(file, rack))


def _ends(file: Path, rack: str | None) -> tuple[float, float] | None:
    """Return the first and the last travel of the rack."""
    if rack is None:
        return None
    try:
        ends = _interval([decimal(each) for each in rack.split(":")])
    except ValueError:
        ends = None
    if ends is None:
        raise fault(
            file,
            "--rack",
            f"found {shown(rack)}, expected METRES or START:STOP, up to {FARTHEST:g} m; say --rack"
            " 0.04 for 40 mm to the right, then to the left",
        )
    return ends


def _interval(numbers: list[float]) -> tuple[float, float] | None:
    """Return the ends of METRES, which goes both ways, or of START:STOP; None for another text."""
    if len(numbers) == 1 and numbers[0] > 0.0:
        numbers = [-numbers[0], numbers[0]]
    if len(numbers) != 2 or not all(abs(each) <= FARTHEST for each in numbers):
        return None
    return numbers[0], numbers[1]
