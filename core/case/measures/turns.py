"""Angles of joints with their turns: from the samples, or of coarse sweeps from the way there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...jet import Jet
from ...kinematics import followed_angle, in_doubt, near_design
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...trajectory import Array
from ..quantity import Quantity
from ..rotation import turns
from .joint import JointAngle


def counted(mechanism: Mechanism, path: Path, output: Quantity, angle: Jet) -> Jet:
    """Return an output that is an angle but for whole turns with its turns since design; any other
    output as it is.

    Args:
        path: of the samples.
        angle: samples along the first axis.
    """
    if not output.period:
        return angle
    count = turns_of(mechanism, path, output, angle.x, angle.v)
    return Jet(angle.x + output.period * count, angle.v, angle.a)


def turns_of(
    mechanism: Mechanism,
    path: Path,
    output: Quantity,
    x: Array,
    v: Array,
    samples: NDArray[np.intp] | slice = slice(None),
) -> Array:
    """Return the whole number of periods to add to an angle at the samples.

    Samples near each other tell it by their rates. Otherwise the native solver follows the joint on
    the way from the design, and the angle is the one near to that.

    Args:
        x, v: value and rate, samples along the first axis; NaN if unknown.
        samples: indices of these among the samples of the path.
    """
    part = replace(path, times=path.times[samples])
    count = turns(x, v, output.period, part)
    assert isinstance(output, JointAngle)
    if near_design(mechanism, path) and not in_doubt(x + output.period * count, v, part.times):
        return count
    followed = followed_angle(mechanism, path, output.joint)
    near = None if followed is None else followed[samples]
    if near is None or not np.isfinite(near).any():
        return count
    near = _completed(near, part.times).reshape(-1, *(1,) * (x.ndim - 1))
    # of the same solution the difference is zero; of a variant it changes little between samples
    return turns(x - near, np.full_like(x, np.nan), output.period, part)


def _completed(near: Array, times: Array) -> Array:
    """Return followed angles, those not reached like the reached ones nearest in time."""
    known = np.flatnonzero(np.isfinite(near))
    if len(known) == len(near):
        return near
    nearest = np.abs(times[:, None] - times[known]).argmin(axis=1)
    return near[known[nearest]]
