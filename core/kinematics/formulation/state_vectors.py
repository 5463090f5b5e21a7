"""Poses of bodies and states of a formulation, computed from results and estimates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import numpy as np

from ...algebra import ZERO, angle_about, quat, vec
from ...joints import AxialJoint
from ...joints.base import unit
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import JointAngle
from ...primitives.base import GROUND_POSE, Pose
from ...trajectory import Array
from .constraints import Frames
from .formulation import Configuration, Formulation


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


def state_of(
    formulation: Formulation,
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


def jacobian(formulation: Formulation, at: Configuration | None = None) -> Array:
    """Return the Jacobian of all rows at a configuration, or at design [units of the frames].

    The shape is (rows, unknowns).
    """
    rows = formulation.rows(at or formulation.configuration(formulation.design))
    matrix = np.zeros((len(rows), formulation.unknowns))
    for k, row in enumerate(rows):
        matrix[k, list(row)] = list(row.values())
    return matrix
