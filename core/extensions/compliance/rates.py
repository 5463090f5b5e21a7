"""Curves of a study, and the rates of a suspension from its matrix of wheel rates.

K gives the upward forces that hold the wheels' centres by their upward travels [N/m]: of one wheel
1 x 1, of an axle 2 x 2, left wheel first. Off its diagonal are an anti-roll bar and all else that
couples both wheels. With a tire of rate c under each wheel, K becomes c (K + c)^-1 K.

    both wheels alike            (1, 1) K (1, 1) / 2
    against each other           k = (1, -1) K (1, -1) / 2,    roll stiffness t^2 k / 2
    part that couples them       -2 (K_lr + K_rl) / ((1, -1) K (1, -1))

The track t is that of the wheels' centres at design.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...trajectory import Array

SIDES = ("left", "right")

_ALIKE, _OPPOSITE = np.array([1.0, 1.0]), np.array([1.0, -1.0])


def without_side(name: str) -> str:
    """Return a name of an axle without its side."""
    for side in SIDES:
        name = name.removeprefix(f"{side}_")
    return name


@dataclass(frozen=True, eq=False)
class Curve:
    """A quantity over the samples [SI], shape (n,); NaN without an equilibrium."""

    values: Array
    unit: str
    sense: str = ""


def wheel_rates(matrix: Array, track: float, other: float, tire: float | None) -> dict[str, Curve]:
    """Return the rates of one wheel or of an axle by their names, without stiffness NaN.

    Args:
        matrix: K, shape (n, wheels, wheels) [N/m].
        track: twice the distance from the middle for one wheel [m].
        other: travel of the right wheel per travel of the left one, in the axle's motion.
        tire: rate of each tire [N/m]; None without.
    """
    count = matrix.shape[1]
    found = {
        "wheel_rate": Curve(
            _rate(matrix, _ALIKE),
            "N/m",
            "upward force per upward travel of the wheel's centre"
            + (", both wheels alike, the mean of both" if count > 1 else ""),
        )
    }
    if count > 1:
        moved = np.array([1.0, other])
        for side, values in zip(SIDES, (moved * (matrix @ moved)).T, strict=True):
            sense = "upward force per upward travel of this wheel's centre, in the axle's motion"
            found[f"wheel_rate_{side}"] = Curve(values, "N/m", sense)
        opposite = _rate(matrix, _OPPOSITE)
        found["wheel_rate_opposite"] = Curve(opposite, "N/m", "both wheels against each other")
        coupled = -(matrix[:, 0, 1] + matrix[:, 1, 0])
        share = coupled / np.where(opposite == 0.0, np.nan, opposite)
        sense = "part of the roll stiffness that couples both wheels"
        found["anti_roll_share"] = Curve(share, "1", sense)
    across = 0.5 * track * track
    if track:
        sense = "torque per roll angle of both wheels' centres"
        found["roll_stiffness"] = Curve(across * _rate(matrix, _OPPOSITE), "N m/rad", sense)
    if tire is None:
        return found
    on_tires: Array = tire * np.asarray(
        np.linalg.solve(matrix + tire * np.eye(count), matrix), dtype=np.float64
    )
    sense = "wheel rate in series with the tire's"
    found["ride_rate"] = replace(found["wheel_rate"], values=_rate(on_tires, _ALIKE), sense=sense)
    if track:
        sense = "roll stiffness with the tires'"
        found["roll_rate"] = Curve(across * _rate(on_tires, _OPPOSITE), "N m/rad", sense)
    return found


def _rate(matrix: Array, motion: Array) -> Array:
    """Return the mean rate of the wheels that move so, shape (n,)."""
    moved = motion[: matrix.shape[1]]
    return np.asarray(np.einsum("i,nij,j->n", moved, matrix, moved)) / len(moved)
