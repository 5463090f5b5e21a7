"""Couplers of linear relations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...joints.coupler import Coupler
from ...joints.gear import Gear
from ...joints.linear_coupler import LinearCoupler
from ...joints.polynomial import Polynomial
from ...joints.rack_pinion import RackPinion


def linear_relation(name: str, weights: Mapping[str, float], freedoms: Sequence[str]) -> Coupler:
    """Return the plainest coupler that keeps a weighted sum of coordinates at zero.

    Args:
        weights: by joint, not zero [by m or rad].
        freedoms: which coordinate of each joint.
    """
    if len(weights) > 2:
        return LinearCoupler(name, (*weights,), (*weights.values(),), freedoms=(*freedoms,))
    ((first, a), (second, b)), (one, other) = weights.items(), freedoms
    if one == other == "rotation":
        return Gear(name, (first, second), -b / a)
    if one == other:
        return Polynomial(name, (first, second), (0.0, -b / a), freedoms=(one, other))
    if one == "rotation":
        return RackPinion(name, (first, second), -a / b)
    return RackPinion(name, (second, first), -b / a)
