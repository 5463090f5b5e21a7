"""Mechanisms solved by Pinocchio's adapter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from kincheck.adapters.pinocchio import pinocchio as adapter
from kincheck.core import (
    Mechanism,
)
from kincheck.core.case.case import Case, Output, Sweep, Truth
from kincheck.core.trajectory import Trajectory

TOL = 1e-12
ENGINE = adapter.Pinocchio()


def case_of(mechanism: Mechanism, values: Sequence[float] | np.ndarray, rate: float = 1.0) -> Case:
    """Sweep of the first driver, with all points wanted."""
    outputs = tuple(
        Output(p.name, p.name, (1.0, 0.0, 0.0), False, 0.0, 0.0, "unused here")
        for p in mechanism.points
    )
    sweep = Sweep(mechanism.drivers[0].name, np.asarray(values, dtype=float), rate)
    return Case(mechanism.name, "made here", Truth.CONSENSUS_ONLY, mechanism, sweep, outputs)


def solved(
    mechanism: Mechanism, values: Sequence[float] | np.ndarray, rate: float = 1.0
) -> Trajectory:
    case = case_of(mechanism, values, rate)
    assert ENGINE.unsupported(case) is None
    found = ENGINE.solve(ENGINE.build(case), case, TOL)
    assert found.message == ""
    assert found.solved.all()
    assert found.residual <= TOL
    return found


def rotation(axis: Sequence[float], angle: float | np.ndarray) -> np.ndarray:
    """Rodrigues' formula, shape (..., 3, 3)."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.asarray(angle)[..., None, None]
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)
