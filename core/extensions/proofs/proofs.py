"""Proofs: samples of a sweep, with balls proved to contain the exact solutions near the native
ones, and single poses, from the caller's own state.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from ...algebra import Vec3
from ...kinematics.compiled.compiled_model import compile_model
from ...kinematics.compiled.request import Request
from ...kinematics.compiled.routes import start_of
from ...kinematics.continuation.segments import choose_rows
from ...kinematics.continuation.sweep import sweep
from ...kinematics.forces.reactions import Follow, ForceRows, with_forces
from ...kinematics.forces.wanted import WantedForces, wanted_forces
from ...kinematics.formulation.cartesian import Cartesian
from ...kinematics.formulation.constraints import frames
from ...kinematics.formulation.state_vectors import displaced, jacobian, standing_drives, state_of
from ...kinematics.structure.degrees_of_freedom import select_rows
from ...mechanism.loads import TorsionSpringDamper
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path, outwards
from ...trajectory import Array, Trajectory
from .ball_executor import Ball, flint, precision
from .exact import Reading, as_double, equations, exact_mechanism
from .krawczyk import Enclosure, UnprovedError, enclose


@dataclass(frozen=True)
class PoseState:
    """The scalars that fix a pose of a mechanism.

    Attributes:
        names: of the vectors in their order: "u BODY" (displacement of its origin), "q BODY" (Euler
            parameters) and "x JOINT.rotation" or "x JOINT.translation" (a coordinate).
        unit: of lengths [m].
        origins: of the moving bodies at the design position [units].
    """

    names: Sequence[str]
    unit: float
    origins: Mapping[str, Vec3]

    @staticmethod
    def of(mechanism: Mechanism) -> PoseState:
        """Return the state of a mechanism."""
        frame = frames(mechanism)
        names = [*Cartesian.of(mechanism, frame).design]
        return PoseState(names, frame.unit, frame.origins)


def prove_pose(
    mechanism: Mechanism,
    points: Sequence[str],
    pose: Array,
    drives: Mapping[str, Sequence[Fraction]],
    bits: int,
) -> Enclosure:
    """Prove one pose of a mechanism, its numbers read as doubles.

    Args:
        mechanism: the mechanism.
        points: names of the output points.
        pose: the approximate state, as `PoseState` orders it.
        drives: value from the design, velocity and acceleration of the moving drivers [SI].
        bits: working precision.

    Raises:
        UnprovedError: the pose is singular, or too far from a solution.
        KincheckError: python-flint is not installed, or the rows cannot be selected.
    """
    frame = frames(mechanism)
    change = {name: float(value) for name, (value, *_) in drives.items()}
    selected = select_rows(mechanism, frame, Cartesian.of(mechanism, frame)).chosen
    kept = choose_rows_at(mechanism, change, pose, selected)
    with precision(bits):
        traced = equations(exact_mechanism(mechanism, as_double), tuple(drives), points, kept)
        driven = _balls(mechanism, traced.frame.unit, drives)
        return enclose(traced, pose, driven, bits)


def _balls(
    mechanism: Mechanism, unit: float, drives: Mapping[str, Sequence[Fraction]]
) -> list[list[Ball]]:
    """Return the values of drives [SI] as balls [units or rad]."""
    per = {name: 1 if mechanism.driver(name).turns else Fraction(unit) for name in drives}
    return [
        [flint().arb(flint().fmpq(*(x / per[name]).as_integer_ratio())) for x in drive]
        for name, drive in drives.items()
    ]


Drives = Mapping[str, Sequence[tuple[Fraction, Fraction, Fraction]]]
"""Value from the design, velocity and acceleration [SI] of each moving driver at every sample."""


@dataclass(frozen=True, eq=False)
class Proofs:
    """Proofs of all samples.

    Attributes:
        samples: in the order of the path.
        seconds: of each sample, without the native solution [s].
        native: the native solution, the start of the proofs; they do not rely on it.
        rows: the proved equations, as "joint: primitive".
        redundant: those left out as redundant at the design position.
        others: by sample, those left out if the choice at the design is unnecessarily poor there.
    """

    samples: Sequence[Enclosure | UnprovedError]
    seconds: Sequence[float]
    native: Trajectory
    rows: Sequence[str]
    redundant: Sequence[str]
    others: Mapping[int, Sequence[str]]


def prove(
    mechanism: Mechanism,
    path: Path,
    points: Sequence[str],
    drives: Drives,
    reading: Reading,
    bits: int,
    tol: float,
    forces: Collection[str] = (),
    follower: Callable[[Mechanism, Path, NDArray[np.bool_]], Follow] | None = None,
) -> Proofs:
    """Prove the samples of a path.

    Args:
        points: names of the output points.
        drives: exact values of the moving drivers; the path has them as doubles.
        reading: interpretation of the numbers of the mechanism.
        bits: working precision.
        tol: of the native solution; see `solve`.
        forces: names of joints, drivers and force elements whose forces to enclose.
        follower: makes what counts the turns of torsional springs at the solved samples.

    Raises:
        SolveError: as `solve`.
        KincheckError: python-flint is not installed.
    """
    flint()
    model = compile_model(
        mechanism,
        Request(tuple(path.motions), tuple(points), tuple(body.name for body in mechanism.moving)),
    )
    native = sweep(model, path, tol)
    wanted: WantedForces | None = None
    angles = np.empty((len(native.solved), 0))
    if forces:
        wanted = wanted_forces(mechanism, forces)
        zero = Fraction(0)
        still = [(zero, zero, zero)] * len(native.solved)
        drives = {each.name: drives.get(each.name, still) for each in mechanism.drivers}
        follow = follower(mechanism, path, native.solved) if follower else None
        angles = _angles(mechanism, path, native, follow)
        native = with_forces(mechanism, path, native, forces, native.bodies, follow)
    poses = _states(mechanism, native, path.times, start_of(mechanism, path).time)
    samples: list[Enclosure | UnprovedError] = []
    seconds: list[float] = []
    others: dict[int, Sequence[str]] = {}
    names = Cartesian.of(mechanism, model.frame).row_names
    with precision(bits):
        exact, kept = exact_mechanism(mechanism, reading), model.selection.chosen
        traced = {kept: equations(exact, tuple(drives), points, kept, wanted)}
        unit = traced[kept].frame.unit
        for k, reached in enumerate(native.solved):
            started = perf_counter()
            driven = _balls(mechanism, unit, {name: each[k] for name, each in drives.items()})
            try:
                if not reached:
                    raise UnprovedError(
                        f"there is no approximate pose to start from: {native.message}"
                    )
                change = {name: float(drives[name][k][0]) for name in drives}
                rows = (
                    choose_rows_at(mechanism, change, poses[k], kept)
                    if model.selection.dropped
                    else kept
                )
                if rows not in traced:
                    traced[rows] = equations(exact, tuple(drives), points, rows, wanted)
                if rows != kept:
                    others[k] = [names[row] for row in range(len(names)) if row not in rows]
                near = angles[k].tolist()
                samples.append(enclose(traced[rows], poses[k], driven, bits, near))
            except UnprovedError as error:
                samples.append(error)
            seconds.append(perf_counter() - started)
    solved, redundant = ([names[k] for k in each] for each in (kept, model.selection.dropped))
    return Proofs(samples, seconds, native, solved, redundant, others)


def _angles(mechanism: Mechanism, path: Path, native: Trajectory, follow: Follow | None) -> Array:
    """Return the native angles of the joints of torsional springs [rad], shape (n, joints)."""
    joints = dict.fromkeys(
        each.joint for each in mechanism.forces if isinstance(each, TorsionSpringDamper)
    )
    found = np.full((len(native.solved), len(joints)), np.nan)
    if joints:
        lines = ForceRows(mechanism, path, native, follow)
        found[native.solved] = np.stack([lines.angle(name) for name in joints], axis=1)
    return found


def _states(mechanism: Mechanism, native: Trajectory, times: Array, start: float = 0.0) -> Array:
    """Return the state scalars (`Cartesian.design`) from the bodies' motion, shape (n, size)."""
    frame = frames(mechanism)
    poses = displaced(
        mechanism, frame, {name: (motion.r, motion.p) for name, motion in native.bodies.items()}
    )
    state = state_of(Cartesian.of(mechanism, frame), mechanism, frame, poses, {})
    for turn in (
        vector[0]
        for name, vector in state.items()
        if name.startswith("x ") and name.endswith(".rotation")
    ):
        # turns are counted from the start outwards; the proof fails for a sweep too coarse to count
        # them
        for side in outwards(times, start):
            outward = side[native.solved[side]]
            turn[outward] = np.unwrap([0.0, *turn[outward]])[1:]
    return np.stack([x for vector in state.values() for x in vector], axis=1)


def choose_rows_at(
    mechanism: Mechanism, change: Mapping[str, float], state: Array, known: tuple[int, ...]
) -> tuple[int, ...]:
    """As `choose_rows`, at a pose of the native formulation.

    Args:
        change: of the moving drivers from the design [SI].
        state: the scalars of the pose, in the order of `Cartesian.design`.
    """
    frame = frames(mechanism)
    formulation = Cartesian.of(mechanism, frame, standing_drives(mechanism, frame.unit, change))
    numbers = iter(state.tolist())
    at = formulation.configuration(
        {name: [next(numbers) for _ in value] for name, value in formulation.design.items()}
    )
    return choose_rows(
        jacobian(formulation, at), [known], len(mechanism.drivers), formulation.conditions
    )
