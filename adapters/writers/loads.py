"""Masses and loads for model files; small numbers replace missing masses."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from ...core.mechanism.body import Body, inertia_matrix
from ...core.mechanism.mechanism import Mechanism, Vector
from ...core.trajectory import Array
from ..shared.poses import direction

# Simulators require mass and inertia of every moving body [kg, kg m^2].
STAND_IN = 1e-6
PLAIN = "Masses and inertias are placeholders."
LOADED = (
    f"Masses are in kg; {STAND_IN:g} kg and {STAND_IN:g} kg m^2 are placeholders for missing ones."
)


def mass_of(body: Body) -> float:
    """Return the mass of a body, or its placeholder [kg]."""
    return body.mass or STAND_IN


def center_of(body: Body) -> Vector:
    """Return the centre of mass, global at design [m]."""
    return body.center_of_mass or body.origin


def inertia_of(body: Body, missing: float = STAND_IN) -> Array:
    """Return the inertia about the centre of mass, global axes at design [kg m^2], shape (3, 3).

    Args:
        missing: principal moments of a body without one.
    """
    return missing * np.eye(3) if body.inertia is None else inertia_matrix(body.inertia)


def own_inertia(body: Body) -> Array:
    """Return the inertia about the centre of mass in the body's axes [kg m^2], shape (3, 3)."""
    turn = np.column_stack([direction(body, axis) for axis in np.eye(3).tolist()])
    return turn @ inertia_of(body) @ turn.T


def six(matrix: Array) -> list[float]:
    """Return the entries xx, yy, zz, xy, xz, yz of a symmetric matrix."""
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    return [float(0.5 * (matrix[pair] + matrix[pair[::-1]])) for pair in pairs]


def inertia_at_origin(body: Body) -> Array:
    """Return the inertia about the body's origin, global axes at design [kg m^2], shape (3, 3)."""
    arm = np.subtract(center_of(body), body.origin)
    moved = arm @ arm * np.eye(3) - np.outer(arm, arm)
    return inertia_of(body) + mass_of(body) * moved


def left_out(mechanism: Mechanism, names: Collection[str], gravity: bool) -> str:
    """Return a sentence on the loads that a format cannot hold.

    Args:
        names: force elements in the file.
        gravity: whether the file has gravity.
    """
    missing = [str(each) for each in mechanism.forces if each.name not in names]
    if any(mechanism.gravity) and not gravity:
        missing.insert(0, f"gravity {[*mechanism.gravity]} m/s^2")
    return f" Left out: {', '.join(missing)}." if missing else ""
