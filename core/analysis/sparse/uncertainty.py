"""How well a motion of a sparse system is known where it stands."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...trajectory import Array
from ..continuity import EPSILON
from .model import FailedError, SparseModel
from .stand import Stand, distance

# Steps of inverse iteration: each divides what is left of other directions by the square of how much better they are determined.
STEPS = 3


def uncertain(model: SparseModel, at: Stand, drives: Array) -> Sequence[float]:
    """By how much what is left of residuals may have moved a pose [of the mechanism's size], its rates and accelerations [of their
    own].

    That is seen where the pose is moved as far as they can move it, in the direction that the rows determine least. By the smallest
    singular value itself all samples of a large ring would be in doubt, which are known well.
    """
    model.evaluate(at.state, drives)
    rates, accelerations = model.motion()
    left, residual = np.ones(len(model.kept)), max(at.closure, EPSILON)
    for _ in range(STEPS):
        left = model.factors.solve_transposed(model.factors.solve(left / np.abs(left).max()))
    moved = model.moved(at.state, model.factors.solve(residual * np.sign(left)))
    model.evaluate(moved, drives)
    try:
        there = model.motion()
    except FailedError:
        return math.inf, math.inf, math.inf
    speed = float(np.abs(rates).max(initial=0.0))
    sizes = speed, max(float(np.abs(accelerations).max(initial=0.0)), speed**2)
    off = [float(np.abs(a - b).max()) / (size or 1.0) for a, b, size in zip(there, (rates, accelerations), sizes, strict=True)]
    return float(distance(moved - at.state, model.scale)), *off
