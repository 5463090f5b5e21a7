"""Inputs of the equations: poses of bodies and states of a formulation from results and estimates,
and the numbers of a `Drive` from values in SI units.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, cast

import numpy as np

from ...algebra import ZERO, Scalar, angle_about, quat, vec
from ...joints import AxialJoint
from ...joints.base import unit
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Driver, JointAngle, Path
from ...primitives.base import GROUND_POSE, Drive, Pose
from ...trajectory import Array
from .cartesian import COLUMNS, Cartesian
from .constraints import Frames
from .formulation import Configuration, Rows, position_of


def drive_numbers(drivers: Sequence[Driver], drive: Array, unit: float) -> Array:
    """Return the numbers of a `Drive` for each driver, shape (5 * drivers, n).

    Lengths are in the mechanism's unit.

    Args:
        drive: value from the design, velocity and acceleration [SI], shape (3, drivers, n).
    """
    found = np.empty((len(drivers), 5, drive.shape[-1]))
    for numbers, driver, motion in zip(found, drivers, drive.swapaxes(0, 1), strict=True):
        numbers[:3] = motion * (1.0 if driver.turns else 1.0 / unit)
        numbers[3], numbers[4] = np.cos(0.5 * motion[0]), np.sin(0.5 * motion[0])
    return found.reshape(5 * len(drivers), drive.shape[-1])


def samples(
    mechanism: Mechanism, drivers: Sequence[str], unit: float, path: Path, times: Array
) -> Array:
    """Return the times, and the numbers of a `Drive` for each named driver at these times of a
    path, shape (1 + 5 * drivers, n).
    """
    numbers = drive_numbers([*map(mechanism.driver, drivers)], path.drive(drivers, times), unit)
    return np.concatenate([times[None], numbers])


def turns(mechanism: Mechanism, drivers: Sequence[str]) -> list[str]:
    """Return the names of a lane's scalars that hold angles of drivers [rad from the design]."""
    return [f"drive {name}.0" for name in drivers if mechanism.driver(name).turns]


def standing_drives(
    mechanism: Mechanism, unit: float, change: Mapping[str, float]
) -> dict[str, Drive]:
    """Return the drives, by name, of drivers at rest at values from the design [SI]."""
    values = np.array([[*change.values()], *np.zeros((2, len(change)))])[..., None]
    numbers = (
        drive_numbers([mechanism.driver(name) for name in change], values, unit)
        .reshape(-1, 5)
        .tolist()
    )
    return {name: Drive(*each) for name, each in zip(change, numbers, strict=True)}


def displaced(
    mechanism: Mechanism, frame: Frames, placed: Mapping[str, tuple[Array, Array]]
) -> dict[str, Pose]:
    """Return the poses of bodies, by name, relative to design.

    Args:
        placed: by body, origins r [m], shape (..., 3), and Euler parameters p [-], shape (..., 4).
    """
    found: dict[str, Pose] = {}
    for name, (r, p) in placed.items():
        body = mechanism.body(name)
        q = quat(np.moveaxis(np.asarray(p), -1, 0)) * quat(body.euler_parameters).conjugate()
        shift = np.moveaxis(np.asarray(r) - np.array(body.origin), -1, 0) / frame.unit
        swung = Pose.of(ZERO, q).swing(frame.arm(name, body.origin))
        found[name] = Pose.of(vec([*shift]) - swung, q)
    return found


def placed_bodies(
    mechanism: Mechanism, frame: Frames, poses: Mapping[str, Pose], n: int
) -> dict[str, tuple[Array, Array]]:
    """Return origins [m], shape (n, 3), and Euler parameters, shape (n, 4), of the moving bodies at
    poses relative to design, scalars or lanes.
    """
    found: dict[str, tuple[Array, Array]] = {}
    for body in mechanism.moving:
        pose, arm = poses[body.name], frame.arm(body.name, body.origin)
        r = position_of(body.origin, arm, frame.unit, pose)
        p = pose.q * quat(body.euler_parameters)
        found[body.name] = columns_of(r, n), columns_of(p, n)
    return found


def columns_of(scalars: Iterable[Scalar], n: int) -> Array:
    """Return scalars or lanes as columns, shape (n, scalars)."""
    found = [x + np.zeros(n) for x in scalars]
    return np.stack(found, axis=1) if found else np.empty((n, 0))


def state_of(
    formulation: Cartesian,
    mechanism: Mechanism,
    frame: Frames,
    poses: Mapping[str, Pose],
    values: Mapping[str, float],
) -> dict[str, Any]:
    """Return the state vectors of a Cartesian formulation at poses, with joint coordinates.

    Args:
        poses: of moving bodies, as floats or arrays of lanes; missing bodies are at design.
        values: of the drivers, from design [m or rad]. Poses determine an angle only up to two
            turns: the one nearest to the driver's value is taken.
    """
    state: dict[str, Any] = dict(formulation.design)
    for name, pose in poses.items():
        state[f"u {name}"], state[f"q {name}"] = (*pose.u,), (pose.q.e0, *pose.q.e)
    driven = {
        d.joint: values.get(d.name, 0.0) for d in mechanism.drivers if isinstance(d, JointAngle)
    }
    for joint in mechanism.joints:
        if isinstance(joint, AxialJoint) and not state.keys().isdisjoint(
            {f"x {joint.name}.{freedom}" for freedom in joint.freedoms}
        ):
            i, j = (poses.get(body, GROUND_POSE) for body in joint.bodies)
            h, relative = unit(joint.axis), i.q.conjugate() * j.q
            s_i, s_j = (frame.arm(body, joint.point) for body in joint.bodies)
            apart = (j.u - i.u) + (j.swing(s_j) - i.swing(s_i))
            angle = cast("Array", np.asarray(angle_about(h, relative)))
            angle = angle + 4.0 * np.pi * np.round(
                (driven.get(joint.name, 0.0) - angle) / (4.0 * np.pi)
            )
            for freedom, value in (("rotation", angle), ("translation", i.turn(h) @ apart)):
                if f"x {joint.name}.{freedom}" in state:
                    state[f"x {joint.name}.{freedom}"] = (value,)
    return state


def jacobian(formulation: Cartesian, at: Configuration | None = None) -> Array:
    """Return the Jacobian of all rows at a configuration, or at design [units of the frames].

    The shape is (rows, unknowns).
    """
    rows = formulation.rows(at or formulation.configuration(formulation.design))
    return dense(rows, formulation.unknowns, 1)[0]


def dense(rows: Rows, unknowns: int, n: int) -> Array:
    """Return rows of scalars or lanes as matrices, shape (n, rows, unknowns)."""
    found = np.zeros((n, len(rows), unknowns))
    for k, row in enumerate(rows):
        for column, value in row.items():
            found[:, k, column] = value
    return found


def moved_most(columns: Mapping[str, int], motion: Array) -> tuple[str, Array]:
    """Return the body moved most by a motion of the unknowns, and its part (dr, dpi)."""
    name, first = max(
        columns.items(), key=lambda each: float(np.linalg.norm(motion[each[1] : each[1] + COLUMNS]))
    )
    return name, motion[first : first + COLUMNS]
