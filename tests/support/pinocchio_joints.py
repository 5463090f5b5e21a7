"""Mechanisms of joints on one axis, solved by Pinocchio and natively."""

from __future__ import annotations

import numpy as np
from kincheck.core import (
    GROUND,
    Mechanism,
    solve,
)
from kincheck.core.trajectory import Trajectory

from .pinocchio_cases import rotation

Q, AXIS = (0.2, -0.1, 0.3), (0.4, 1.0, -0.7)
P = (0.5, 0.6, 0.1)
TURNS = np.linspace(-15.0, 15.0, 61)
"""Angles over nearly five turns, half a radian apart."""


H = np.array(AXIS) / np.linalg.norm(AXIS)


def sign_of(bodies: tuple[str, str]) -> float:
    """Of the moving body's motion, where a joint's coordinate is that of its second body."""
    return 1.0 if bodies[0] == GROUND else -1.0


def carried(turn: np.ndarray | float, slide: np.ndarray | float) -> np.ndarray:
    """Where P goes that turns about the axis through Q and slides along it, shape (n, 3)."""
    return Q + rotation(AXIS, turn) @ np.subtract(P, Q) + np.multiply.outer(slide, H)


def same_as_native(mechanism: Mechanism, found: Trajectory, values: np.ndarray) -> None:
    native = solve(mechanism, mechanism.drivers[0].name, values)
    assert native.solved.all()
    for name, motion in found.points.items():
        for quantity in ("position", "velocity", "acceleration"):
            # both are solved to round-off of positions of 1 m and accelerations of a few m/s^2
            np.testing.assert_allclose(
                getattr(motion, quantity),
                getattr(native.points[name], quantity),
                rtol=0,
                atol=1e-12,
            )
