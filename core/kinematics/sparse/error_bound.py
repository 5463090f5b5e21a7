"""Bounds of the errors of a solved pose of a sparse system."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...trajectory import Array
from ..formulation.acceptance_criteria import EPSILON
from .sparse_equations import PoseError, SparseEquations
from .step_state import Stand, distance

# Steps of inverse iteration: each divides what is left of other directions by the square of how
# much better they are determined.
STEPS = 3


def uncertain(model: SparseEquations, at: Stand, drives: Array) -> Sequence[float]:
    """Return bounds of the errors of a pose by its residuals [of the mechanism's size], and of its
    rates and accelerations [of their own].

    The pose is displaced as far as the residuals allow, in the direction least determined by the
    rows. The smallest singular value alone would put all samples of a large ring in doubt, although
    they are known well.
    """
    residual, left = max(at.closure, EPSILON), np.ones(len(model.kept))
    try:
        with np.errstate(all="ignore"):  # what overflows is no number
            model.evaluate(at.state, drives)
            here = model.motion()
            for _ in range(STEPS):
                left = model.factors.solve_transposed(
                    model.factors.solve(left / np.abs(left).max())
                )
            moved = model.moved(at.state, model.factors.solve(residual * np.sign(left)))
            model.evaluate(moved, drives)
            there = model.motion()
    except PoseError:  # singular to rounding, here or there
        return math.inf, math.inf, math.inf
    speed, acceleration = (float(np.abs(each).max(initial=0.0)) for each in here)
    sizes = speed, max(acceleration, speed**2)
    off = [
        float(np.abs(a - b).max()) / (size or 1.0)
        for a, b, size in zip(there, here, sizes, strict=True)
    ]
    return float(distance(moved - at.state, model.scale)), *off
