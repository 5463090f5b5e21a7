"""Parts of a step that fails, where they are looked for one by one."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ...trajectory import Array

# A failing step is tried at its halves, quarters, ... down to this many halvings, and so many at
# once: to 1e-12 of it, for a crank that passes within 1e-9 of its length beside a pivot turns its
# rocker by half a turn over such a part of a sweep.
HALVINGS, AT_ONCE = 40, 8
# The next part is looked for among those up to so many times as long as the last: towards a limit
# they get shorter and shorter.
LONGER = 8.0
# A step is gone in at most so many parts. Of a slider-crank a part is 0.7 rad: a step of 1,000 rad
# is gone to its end, one of 1,500 is not.
MOST_PARTS = 2000
TOO_MANY = (
    f"{MOST_PARTS} parts of the step were taken, and the next sample was not reached; give samples"
    " in between"
)


def longest(margins: Array) -> int | None:
    """The longest part of a step to go, of parts each half of the one before: one that was
    accepted, and its half too.

    Of so many parts one may be accepted by chance, at a pose of another assembly; two such are not
    halves of each other.
    """
    good = np.flatnonzero((margins[:-1] > 0.0) & (margins[1:] > 0.0))
    return int(good[0]) if len(good) else None


def part_of_step(
    here: float,
    wanted: float,
    attempt: Callable[[Array], Array],
    lanes: int,
    length: float = math.inf,
) -> tuple[int, float] | None:
    """A part of a step that can be gone: the lane that goes it, and the time where it stands then;
    None where none can.

    Args:
        attempt: sends as many lanes to as many times, longest part first; returns their margins.
        length: of the longest part to try [s].
    """
    whole = wanted - here
    start = max(1, math.ceil(math.log2(abs(whole) / length))) if 0.0 < length < abs(whole) else 1
    for first in range(start, HALVINGS, lanes - 1):  # a part counts if its half is reached too
        times: Array = here + whole * 0.5 ** np.arange(float(first), first + lanes)
        part = longest(attempt(times)[: HALVINGS + 1 - first])
        if part is not None:
            return part, float(times[part])
    return None
