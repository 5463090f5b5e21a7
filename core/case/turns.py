"""Angles of joints and orientations of bodies with their turns: from the samples, or of coarse
sweeps from the way there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..algebra import Vec3, quat
from ..jet import Jet
from ..kinematics import (
    DOUBTFUL,
    agreement,
    angle_with_turns,
    attitude_with_turns,
    in_doubt,
    near_design,
)
from ..mechanism.mechanism import Mechanism
from ..mechanism.motions import Path
from ..trajectory import Array
from .measures import JointAngle, Orientation
from .pose_measures import angular_velocity, floats, with_signs
from .quantity import Quantity, where_moving

Completion: TypeAlias = Callable[[Sequence[Jet]], Jet]


def over_sweep(
    mechanism: Mechanism,
    path: Path,
    output: Quantity,
    terms: Sequence[Jet],
    speeds: tuple[Array, Array] | None,
) -> Completion:
    """Return what makes an output of its terms over the samples of a path: it adds the turns of an
    angle since design, gives Euler parameters the sign that goes on from there, and leaves out
    samples at rest. It serves other derivatives of the same terms too.

    Args:
        terms, speeds: of the output, see `Quantity`; samples along the first axis.
    """
    if isinstance(output, Orientation):
        sign = signs_of(mechanism, path, output, terms)
        return lambda e: output.component_of(with_signs(sign, e))
    if not output.period:
        return lambda given: where_moving(given[0], speeds)
    turned = output.period * turns_of(mechanism, path, output, terms[0].x, terms[0].v)
    return lambda given: given[0] + turned


def output_over_sweep(
    mechanism: Mechanism,
    path: Path,
    output: Quantity,
    at: Mapping[str, Vec3],
    design: Mapping[str, Vec3],
) -> Jet:
    """Return an output over the samples of a path, from its points; see `Quantity.of`."""
    terms, speeds = output.terms(at, design), output.resting(at)
    return over_sweep(mechanism, path, output, terms, speeds)(terms)


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
    assert isinstance(output, JointAngle)
    part, x = _at(path, samples), x - output.at_design
    count = turns(x, v, output.period, part)
    if near_design(mechanism, path) and not in_doubt(x + output.period * count, v, part.times):
        return count
    near = _fill_unreached(angle_with_turns(mechanism, path, output.joint), samples, part.times)
    if near is None:
        return count
    near = near.reshape(-1, *(1,) * (x.ndim - 1))
    # of the same solution the difference is zero; of a variant it changes little between samples
    return turns(x - near, np.full_like(x, np.nan), output.period, part)


def signs_of(
    mechanism: Mechanism,
    path: Path,
    output: Orientation,
    e: Sequence[Jet],
    samples: NDArray[np.intp] | slice = slice(None),
) -> Array:
    """Return the signs of the Euler parameters of a body, continuous from design.

    Samples near each other tell it by the angular velocities. Otherwise the native solver follows
    the body on the way from the design, and the sign is the one nearer to that.

    Args:
        e: its terms; samples along the first axis.
        samples: indices of these among the samples of the path.
    """
    part = _at(path, samples)
    values = floats(e)
    sign, doubt = signs(values, angular_velocity(e), part)
    if not mechanism.is_fixed(output.body) and (doubt or not near_design(mechanism, path)):
        near = _fill_unreached(
            attitude_with_turns(mechanism, path, output.body), samples, part.times
        )
        if near is not None:
            near = near.T.reshape(4, -1, *(1,) * (values.ndim - 2))
            sign = np.where((near * values).sum(axis=0) < 0.0, -1.0, 1.0)
    return sign


def _at(path: Path, samples: NDArray[np.intp] | slice) -> Path:
    """Return a path at some of its samples; all of them are the path itself, whose values at the
    design are known.
    """
    whole = isinstance(samples, slice) and samples == slice(None)
    return path if whole else replace(path, times=path.times[samples])


def _fill_unreached(
    followed: Array | None, samples: NDArray[np.intp] | slice, times: Array
) -> Array | None:
    """Return followed values at samples, those not reached like the reached ones nearest in time;
    None if none is reached.
    """
    if followed is None:
        return None
    near = followed[samples]
    known = np.flatnonzero(np.isfinite(near.reshape(len(near), -1)).all(axis=1))
    if len(known) == len(near):
        return near
    if not known.size:
        return None
    return near[known[np.abs(times[:, None] - times[known]).argmin(axis=1)]]


def turns(x: Array, v: Array, period: float, path: Path) -> Array:
    """Return the whole number of periods to add to values known but for a multiple of the period.

    From sample to sample in time the change is the one nearest to that by the velocities; without
    velocities, the smallest. Time zero is the design and has the value zero, unless the path starts
    elsewhere: then the sample nearest to it has the smallest value.

    Args:
        x, v: values and velocities, samples along the first axis; NaN if unknown.
    """
    order, t, before, first = _in_time(path, np.isfinite(x))
    x, v = x[order], v[order]
    change = x - np.take_along_axis(x, before, 0)
    speed = 0.5 * (v + np.take_along_axis(v, before, 0))
    gone = speed * (t - np.take_along_axis(t, before, 0))
    count = np.cumsum(_whole((np.nan_to_num(gone) - change) / period), axis=0)
    x0, v0, n0, since = (np.take_along_axis(each, first, 0) for each in (x, v, count, t))
    expected = np.nan_to_num(v0 * since) * float(path.passes_design)
    count = count - n0 + _whole((expected - x0) / period)
    found = np.empty_like(x)
    found[order] = count
    return found


def signs(e: Array, rate: Array, path: Path) -> tuple[Array, bool]:
    """Return the signs of Euler parameters of the same rotations, shape (n, ...), and whether the
    angular velocities leave one in doubt.

    They are chosen like `turns`: from sample to sample in time the rotation is the one nearest to
    that by the angular velocities; without these, the smallest.

    Args:
        e: Euler parameters, either sign, shape (4, n, ...); NaN if unknown.
        rate: angular velocity [rad/s], shape (3, n, ...); NaN if unknown.
    """
    order, t, before, first = _in_time(path, np.isfinite(e.sum(axis=0)))
    e, rate = e[:, order], rate[:, order]
    last, rate_there = (np.take_along_axis(each, before[None], 1) for each in (e, rate))
    change = quat(e) * quat(last).conjugate()
    mean = 0.5 * (rate + rate_there)
    agrees = agreement(change, mean, t - np.take_along_axis(t, before, 0))
    # nothing contradicts what is unknown
    doubt = bool((np.isfinite(mean.sum(axis=0)) & (np.abs(agrees) < DOUBTFUL)).any())
    sign = np.cumprod(np.where(agrees < 0.0, -1.0, 1.0), axis=0)
    e0, rate0 = (np.take_along_axis(each, first[None], 1) for each in (e, rate))
    since = np.take_along_axis(t, first, 0) * float(path.passes_design)
    own = np.where(agreement(quat(e0), rate0, since) < 0.0, -1.0, 1.0)
    found = np.empty(sign.shape)
    found[order] = sign * np.take_along_axis(sign, first, 0) * own
    return found, doubt


def _whole(x: Array) -> Array:
    return np.nan_to_num(np.rint(x))


def _in_time(
    path: Path, known: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], Array, NDArray[np.int64], NDArray[np.intp]]:
    """Return the order of samples in time; and in this order, along the first axis, their times,
    the index of the last known sample before each, and that of the known one nearest to time zero.
    """
    order = np.argsort(path.times, kind="stable")
    times, known = path.times[order], known[order]
    shape = (-1, *(1,) * (known.ndim - 1))
    last = np.where(known, np.arange(len(known)).reshape(shape), 0)
    last = np.maximum.accumulate(last, axis=0)
    nearest = np.argsort(np.abs(times), kind="stable")
    first = nearest[np.argmax(known[nearest], axis=0)][None]
    before = np.concatenate([last[:1], last[:-1]])
    return order, np.broadcast_to(times.reshape(shape), known.shape), before, first
