"""Thresholds of significant differences between two runs: ratios, and floors below which a ratio
means nothing.

Errors repeat exactly on one machine (25 runs of 5 cases in 4 engines, 20 pairs: not a bit
differed). Another processor or linear algebra library sums in another order, and changes errors of
pure round-off by a small factor. Times do not repeat: see `TIME`.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from itertools import pairwise

from ..queries import Entry, History

DRIFT = 10.0
"""Ratio of errors: a decimal digit. Sums in another order have been seen to move round-off by a
factor of 3.
"""

DRIFT_FLOOR = 1e-6
"""Of the tolerance: what is below matters to nobody. At the usual 1e-9 m this is 1e-15 m, a few
last places of a metre.
"""

RESIDUAL = 1e3
"""Ratio of residuals: three digits. Newton's last step may gain or lose two where a sample only
just meets its tolerance.
"""

RESIDUAL_FLOOR = 2.0**-52
"""The last place of a metre, or of one: a smaller residual cannot be told from zero, and counts as
this. So what grows from 1e-17 to 1e-14 is nothing, and from 5e-16 to 1e-8 is a constraint that is
no longer met as it was."""

UNJUDGED = 1e-6
"""Of the largest value: what differs by more, where nothing judges it, is another motion. Round-off
is a millionth of that.
"""

SAME_SAMPLE = 1e-12
"""Of a driver's largest value: thousands of its last places, and no step of a sweep that anybody
would take.
"""

TIME = 1.75
"""Ratio of times, at least. On two processors shared by five busy processes, the loads of others
kept out of the times, 25 equal runs of 20 pairs: 99.9 % of all 6000 ratios of two runs are below
1.75, and the largest ratio to the median of the runs is 1.71."""

TIME_FLOOR = 5e-5
"""Seconds of a warm solve. In the same runs the fastest pairs, 0.05 to 0.3 ms a solve, came up to
0.04 ms late.
"""

ENOUGH = 5
"""Runs from which the spread of times is taken; from fewer, `TIME` is all there is."""

WIDE = 3.0
"""How far beyond the usual a time is not by chance: the power of the ratio of successive runs that
9 in 10 do not exceed. Were logarithms normal, that were 1.64 standard deviations, and five are
exceeded once in a million; a busy machine has heavier tails."""

HEADROOM = 10.0
"""A tolerance is left as wide as ten times the largest error seen: the next simulator, or
processor, may be another digit worse.
"""

LOOSE = 1e3
"""A tolerance is worth naming where errors stay below a thousandth of it, or it would be named for
every digit of headroom.
"""

SEEN = 10
"""Runs before a tolerance is called loose: what no run of a week and a half has needed."""


def drifted(before: float, now: float, tolerance: float) -> bool:
    """Return whether an error has grown by more than its floor and round-off explain."""
    return now > max(DRIFT_FLOOR * tolerance, DRIFT * before)


def slowest(history: History) -> float:
    """Return the largest ratio of times not called slower, by the spread of all pairs from run to
    run.

    The spread is of ratios of successive runs, not about a median: a true change of pace counts
    once, not in every later run.
    """
    ratios = [ratio for entries in history.pairs.values() for ratio in _ratios(entries)]
    if len(history.runs) < ENOUGH or len(ratios) < 2:
        return TIME
    usual = statistics.quantiles(ratios, n=10)[-1]
    return max(TIME, math.exp(WIDE * math.log(max(usual, 1.0))))


def _ratios(entries: Sequence[Entry]) -> list[float]:
    times = [entry.seconds for entry in entries if entry.seconds]
    return [max(a, b) / min(a, b) for a, b in pairwise(times)]
