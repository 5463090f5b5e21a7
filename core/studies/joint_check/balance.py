"""Balance of the bodies of a loaded probe by Newton and Euler, from their motion alone.

The bodies of the probe have their frame at the global origin at design.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...algebra import quat, rotation_less_identity
from ...mechanism.body import inertia_matrix
from ...mechanism.loads import SpringDamper
from ...trajectory import Array, BodyMotion
from .loaded_probe import GRAVITY, Probe


def _turn(motion: BodyMotion) -> Array:
    """Return the rotation body -> global, shape (n, 3, 3)."""
    change = rotation_less_identity(quat(motion.p.T))
    return np.eye(3) + np.moveaxis(np.array([[*change.x], [*change.y], [*change.z]]), 2, 0)


def _moving(probe: Probe, body: str, point: Any) -> tuple[Array, Array, Array, Array]:
    """Return place, velocity and acceleration of a point of a body, and the body's angular
    velocity, global axes, shape (n, 3).
    """
    at = np.asarray(point, dtype=np.float64)
    motion = probe.motion.bodies.get(body)
    if motion is None:
        still = np.zeros((len(probe.motion.solved), 3))
        return still + at, still, still, still
    assert motion.v is not None
    assert motion.a is not None
    turn = _turn(motion)
    w, w_t = (np.einsum("nab,nb->na", turn, each[:, 3:]) for each in (motion.v, motion.a))
    arm = turn @ at
    v = motion.v[:, :3] + np.cross(w, arm)
    a = motion.a[:, :3] + np.cross(w_t, arm) + np.cross(w, np.cross(w, arm))
    return motion.r + arm, v, a, w


def work(probe: Probe) -> Array:
    """Return the power of the joint's reaction on both bodies [W], shape (n,)."""
    joint = probe.joint
    point = probe.mechanism.reaction_point(joint)
    place, v, _, w = _moving(probe, joint.j, point)
    origin, v_i, _, w_i = _moving(probe, joint.i, (0.0, 0.0, 0.0))
    there = v_i + np.cross(w_i, place - origin)
    force, moment = probe.reaction.force, probe.reaction.moment
    return (force * (v - there)).sum(axis=1) + (moment * (w - w_i)).sum(axis=1)


def speed(probe: Probe) -> float:
    """Return the largest velocity of any body's frame or turn, in one number [m/s, rad/s]."""
    motions = [each.v for each in probe.motion.bodies.values() if each.v is not None]
    return max(float(np.abs(each).max()) for each in motions)


def unbalanced(probe: Probe, name: str) -> Array:
    """Return what is missing to a body's balance by Newton and Euler, shape (n, 6)."""
    n = len(probe.motion.solved)
    if probe.mechanism.is_fixed(name):
        return np.zeros((n, 6))
    body, motion = probe.mechanism.body(name), probe.motion.bodies[name]
    assert motion.v is not None
    assert motion.a is not None
    assert body.inertia is not None
    centre, _, a, _ = _moving(probe, name, body.center_of_mass)
    force = body.mass * (np.array(GRAVITY) - a)
    inertia, w, w_t = inertia_matrix(body.inertia), motion.v[:, 3:], motion.a[:, 3:]
    change = w_t @ inertia + np.cross(w, w @ inertia)
    torque = -np.einsum("nab,nb->na", _turn(motion), change)
    for push, at, moment in _pushes(probe, name):
        force, torque = force + push, torque + moment + np.cross(at - centre, push)
    return np.hstack([force, torque])


def _pushes(probe: Probe, name: str) -> Iterator[tuple[Array, Array, Array]]:
    """Yield what joints, drivers and the spring do to a body: force, its place, moment."""
    mechanism, forces = probe.mechanism, probe.motion.forces
    assert forces is not None
    for joint in mechanism.joints:
        sign = {joint.j: 1.0, joint.i: -1.0}.get(name)
        if sign is not None:
            found = forces.joints[joint.name]
            place = _moving(probe, joint.j, mechanism.reaction_point(joint))[0]
            yield sign * found.force, place, sign * found.moment
    for driver in mechanism.drivers:
        effort = forces.drivers[driver.name][:, None]
        yield from _by_driver(probe, driver, effort, name)
    (spring,) = (each for each in mechanism.forces if isinstance(each, SpringDamper))
    if name == spring.j:
        start, v_i, *_ = _moving(probe, spring.i, spring.points[0])
        end, v_j, *_ = _moving(probe, spring.j, spring.points[1])
        length = np.linalg.norm(end - start, axis=1)
        along = (end - start) / length[:, None]
        rate = (along * (v_j - v_i)).sum(axis=1)
        tension = spring.stiffness * (length - (spring.free_length or 0.0)) + spring.damping * rate
        yield -tension[:, None] * along, end, 0.0 * end


def _by_driver(
    probe: Probe, driver: Any, effort: Array, name: str
) -> Iterator[tuple[Array, Array, Array]]:
    """Yield what a driver does: a couple about its joint's axis, or a force along it."""
    joint: Any = probe.mechanism.joint(driver.joint)
    if name not in joint.bodies:
        return
    tip, start = (_moving(probe, joint.i, at)[0] for at in (joint.axis, (0.0, 0.0, 0.0)))
    push = (1.0 if name == joint.j else -1.0) * effort * (tip - start)
    push /= np.linalg.norm(joint.axis)
    place = _moving(probe, joint.j, joint.point)[0]
    yield (0.0 * push, place, push) if driver.turns else (push, place, 0.0 * push)
