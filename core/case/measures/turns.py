"""Angles of joints and orientations of bodies with their turns: from the samples, or of coarse
sweeps from the way there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...algebra import Vec3
from ...jet import Jet
from ...kinematics import (
    followed_angle,
    followed_attitude,
    in_doubt,
    near_design,
)
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...trajectory import Array
from ..quantity import Quantity
from ..rotation import angular_velocity, floats, signed, signs, turns
from .body import Orientation
from .joint import JointAngle


def counted(
    mechanism: Mechanism,
    path: Path,
    output: Quantity,
    at: Mapping[str, Vec3],
    design: Mapping[str, Vec3],
) -> Jet:
    """Return an output over the samples of a path: an angle or an orientation with its turns since
    design, any other output as it is.

    Args:
        at, design: see `Quantity.of`; samples along the first axis.
    """
    if isinstance(output, Orientation):
        return oriented(mechanism, path, output, at, design)
    angle = output.of(at, design)
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


def oriented(
    mechanism: Mechanism,
    path: Path,
    output: Orientation,
    at: Mapping[str, Vec3],
    design: Mapping[str, Vec3],
    samples: NDArray[np.intp] | slice = slice(None),
) -> Jet:
    """Return the orientation of a body, the sign of its Euler parameters continuous from design.

    Samples near each other tell it by the angular velocities. Otherwise the native solver follows
    the body on the way from the design, and the sign is the one nearer to that.

    Args:
        at, design: see `Quantity.of`; samples along the first axis.
        samples: indices of these among the samples of the path.
    """
    e = output.parameters(at, design)
    part = replace(path, times=path.times[samples])
    values = floats(e)
    sign, doubt = signs(values, angular_velocity(e), part)
    moves = any(body.name == output.body for body in mechanism.moving)
    if moves and (doubt or not near_design(mechanism, path)):
        followed = followed_attitude(mechanism, path, output.body)
        near = None if followed is None else followed[samples]
        if near is not None and np.isfinite(near).any():
            lanes = (1,) * (values.ndim - 2)
            near = _completed(near, part.times).T.reshape(4, -1, *lanes)
            sign = np.where((near * values).sum(axis=0) < 0.0, -1.0, 1.0)
    return output.component_of(signed(sign, e))


def _completed(near: Array, times: Array) -> Array:
    """Return followed values, those not reached like the reached ones nearest in time."""
    known = np.flatnonzero(np.isfinite(near.reshape(len(near), -1)).all(axis=1))
    if len(known) == len(near):
        return near
    nearest = np.abs(times[:, None] - times[known]).argmin(axis=1)
    return near[known[nearest]]
