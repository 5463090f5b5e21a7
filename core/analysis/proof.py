"""Proved samples of a sweep: the native solution of each sample, and the ball that is proved to hold the true one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from time import perf_counter

import numpy as np

from ..algebra import IDENTITY, ZERO, Quat, vec
from ..mechanism import Mechanism
from ..motions import Path
from ..primitives.base import GROUND_POSE, Drive, Pose
from ..program.ball_executor import Ball, flint, precision
from ..trajectory import Array, BodyMotion, Trajectory
from .enclosure import Enclosure, Unproved, enclose
from .equations import Constraint, Frames, constraints, frames
from .exact import Reading, equations, exact_mechanism
from .freedom import Selection
from .model import compile_model
from .programs import Request
from .solve import sweep

Drives = Mapping[str, Sequence[tuple[Fraction, Fraction, Fraction]]]
"""Value from the design, velocity and acceleration [SI] of each moving driver at every sample."""


@dataclass(frozen=True, eq=False)
class Proofs:
    """Proofs of all samples.

    Attributes:
        samples: in the order of the path.
        seconds: of each sample, without the native solution [s].
        native: the native solution, from which the proofs start; they do not rest on it.
        selection: the rows that the proofs are about, and those left out.
    """

    samples: Sequence[Enclosure | Unproved]
    seconds: Sequence[float]
    native: Trajectory
    selection: Selection


def prove(mechanism: Mechanism, path: Path, points: Sequence[str], drives: Drives, reading: Reading, bits: int, tol: float) -> Proofs:
    """Prove the samples of a path.

    Args:
        points: names of the points whose motion is wanted.
        drives: the exact values of the moving drivers, which the path has as doubles.
        reading: how the numbers of the mechanism are understood.
        bits: working precision.
        tol: of the native solution; see `solve`.

    Raises:
        SolveError: as `solve`.
        KincheckError: python-flint is not installed.
    """
    flint()
    model = compile_model(mechanism, Request(tuple(path.motions), tuple(points), tuple(body.name for body in mechanism.moving)))
    native = sweep(model, path, tol)
    poses = _states(mechanism, native, path.times)
    samples: list[Enclosure | Unproved] = []
    seconds: list[float] = []
    with precision(bits):
        traced = equations(exact_mechanism(mechanism, reading), tuple(drives), points, model.selection.kept)
        units = [1 if mechanism.driver(name).type == "joint_angle" else Fraction(traced.frame.unit) for name in drives]
        for k, solved in enumerate(native.solved):
            started = perf_counter()
            if solved:
                driven = [[_ball(x / unit) for x in drives[name][k]] for name, unit in zip(drives, units, strict=True)]
                samples.append(enclose(traced, points, poses[k], driven, bits))
            else:
                samples.append(Unproved(f"there is no approximate pose to start from: {native.message}"))
            seconds.append(perf_counter() - started)
    return Proofs(samples, seconds, native, model.selection)


def _ball(x: Fraction) -> Ball:
    return flint().arb(flint().fmpq(x.numerator, x.denominator))


def _states(mechanism: Mechanism, native: Trajectory, times: Array) -> Array:
    """The scalars that fix the configuration (`Cartesian.design`), from the motion of the bodies, shape (n, size)."""
    frame = frames(mechanism)
    poses = {name: _pose(mechanism, frame, name, motion) for name, motion in native.bodies.items()}
    found = [x for name in frame.moving for x in poses[name].u]
    found += [x for name in frame.moving for x in poses[name].q]
    for c in constraints(mechanism, frame, {}):
        if isinstance(c, Constraint) and c.coordinate:
            found.append(_coordinate(c, poses, times, native))
    return np.stack(found, axis=1)


def _pose(mechanism: Mechanism, frame: Frames, name: str, motion: BodyMotion) -> Pose:
    """Displacement of the internal origin [units] and rotation since the design, from the motion of the body's own frame."""
    body = mechanism.body(name)
    e0, *e = body.euler_parameters
    q = Quat(motion.p.T[0], vec(motion.p.T[1:])) * Quat(e0, vec(e)).conjugate()
    turned = Pose.of(ZERO, q)
    lever = frame.origins[name] - (1.0 / frame.unit) * vec(body.origin)
    return Pose.of((1.0 / frame.unit) * (vec(motion.r.T) - vec(body.origin)) + turned.swing(lever), q)
