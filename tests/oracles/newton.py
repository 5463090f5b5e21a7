"""Newton's method in the least-squares sense, for any coordinates."""

import numpy as np

CONVERGED = 1e-13
LONGEST = 0.3
"""Longest step [rad or m]."""


def least_squares(rows, move, weak):
    """Move coordinates until the residuals do not shrink.

    Args:
        rows: residuals and their slopes in the present coordinates.
        move: takes a step of the unknowns.
        weak: singular values below this part of the largest are those of redundant rows.
    """
    for _ in range(60):
        residual, slope = rows()
        step = -np.linalg.lstsq(slope, residual, rcond=weak)[0]
        length = float(np.abs(step).max(initial=0.0))
        move(step * min(1.0, LONGEST / max(length, 1e-300)))
        if length < CONVERGED:
            return
