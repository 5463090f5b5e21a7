"""Closed form of the IFToMM benchmark A02, N four-bars in a row.

All cranks stay parallel, and the bars between them level.
"""

from __future__ import annotations

from .jet import Jet, Motion, constant, cos, sin

N = 3  # 40 in the benchmark


def motion(turn: Jet) -> Motion:
    """Return the tips of the first and the last crank, all links 1 m long, the cranks turned from
    upright by `turn` about z [rad].
    """
    return {f"B{k}": (float(k) - sin(turn), cos(turn), constant(0.0, turn)) for k in (0, N)}
