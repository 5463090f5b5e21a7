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
"""Ratio of errors: a decimal digit. Another order of summation changes round-off by a factor of 3
in measurements.
"""

DRIFT_FLOOR = 1e-6
"""Fraction of the tolerance below which errors do not matter. At the usual 1e-9 m this is 1e-15 m,
a few units in the last place of a metre.
"""

RESIDUAL = 1e3
"""Ratio of residuals: three digits. Newton's last step may gain or lose two if a sample barely
meets its tolerance.
"""

RESIDUAL_FLOOR = 2.0**-52
"""Floor of residuals, the last place of a metre or of one: a smaller residual is indistinguishable
from zero. So growth from 1e-17 to 1e-14 is insignificant, and growth from 5e-16 to 1e-8 is a
constraint that is met less well.
"""

UNJUDGED = 1e-6
"""Fraction of the largest value: unjudged values that differ by more belong to another motion.
Round-off is a millionth of this.
"""

SAME_SAMPLE = 1e-12
"""Fraction of a driver's largest value: thousands of units in its last place, and less than any
useful step of a sweep.
"""

TIME = 1.75
"""Smallest ratio of times. In 25 equal runs of 20 pairs on two processors with five busy processes,
with times that exclude waiting, 99.9 % of all 6000 ratios of two runs are below 1.75, and the
largest ratio to the median of the runs is 1.71.
"""

TIME_FLOOR = 5e-5
"""Smallest difference of warm solves [s]. In the same runs the fastest pairs, 0.05 to 0.3 ms per
solve, are up to 0.04 ms late.
"""

ENOUGH = 5
"""Fewest runs that give the spread of times; with fewer, `TIME` is the limit."""

WIDE = 3.0
"""Exponent in the limit of times: the ratio of successive runs that 9 in 10 do not exceed, to this
power. With normal logarithms that ratio lies at 1.64 standard deviations, and the limit at five,
which is exceeded once in a million; a busy machine has heavier tails.
"""

HEADROOM = 10.0
"""Factor of a tolerance on the largest error seen: the next simulator or processor may be a digit
worse.
"""

LOOSE = 1e3
"""Fraction of a tolerance below which all errors of a loose one stay: a thousandth, since a digit
or two of headroom is normal.
"""

SEEN = 10
"""Fewest runs before a tolerance is called loose: a week and a half of nights."""


def drifted(before: float, now: float, tolerance: float) -> bool:
    """Return whether an error has grown by more than floor and round-off explain."""
    return now > max(DRIFT_FLOOR * tolerance, DRIFT * before)


def slowest(history: History) -> float:
    """Return the largest ratio of times that is not slower, by the spread of all pairs from run to
    run.

    The spread is that of ratios of successive runs, so a true change of speed counts once; about a
    median it would count in every later run.
    """
    ratios = [ratio for entries in history.pairs.values() for ratio in _ratios(entries)]
    if len(history.runs) < ENOUGH or len(ratios) < 2:
        return TIME
    usual = statistics.quantiles(ratios, n=10)[-1]
    return max(TIME, math.exp(WIDE * math.log(max(usual, 1.0))))


def _ratios(entries: Sequence[Entry]) -> list[float]:
    times = [entry.seconds for entry in entries if entry.seconds]
    return [max(a, b) / min(a, b) for a, b in pairwise(times)]
