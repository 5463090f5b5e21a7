"""Random masses for any mechanism, its forces, and what drivers do to its bodies."""

from dataclasses import replace

import numpy as np
from kincheck import JointAngle, PointCoordinate
from kincheck.core.kinematics import Method, NativeSolver, with_forces

from ..oracles import newton_euler

GRAVITY = (0.3, -2.0, -9.6)


def six(matrix):
    """The entries Ixx, Iyy, Izz, Ixy, Iyz, Ixz."""
    return [*np.diag(matrix), matrix[0, 1], matrix[1, 2], matrix[0, 2]]


def random_inertia(rng):
    """Entries of the inertia of six points."""
    points = 0.1 * rng.normal(size=(6, 3))
    return six(np.trace(points.T @ points) * np.eye(3) - points.T @ points)


def loaded(mechanism, seed=1, gravity=GRAVITY):
    """The mechanism with random masses, with products of inertia."""
    random, bodies = np.random.default_rng(seed), []
    for body in mechanism.bodies:
        if not body.fixed:
            inertia = random_inertia(random)
            center = np.array(body.origin) + random.normal(size=3) * 0.2
            mass = random.uniform(1.0, 5.0)
            body = replace(body, mass=mass, center_of_mass=tuple(center), inertia=inertia)
        bodies.append(body)
    return replace(mechanism, bodies=bodies, gravity=gravity)


def solved(mechanism, case, style="native"):
    path, names = case.sweep.path, tuple(body.name for body in mechanism.moving)
    motion = NativeSolver(style=style).prepare(mechanism, path, bodies=names)(1e-12)
    assert motion.solved.all(), motion.message
    return with_forces(mechanism, path, motion, bodies=names)


def traced(mechanism, case, style="native", compiled=False):
    """As `solved`, by the mechanism's own program, traced anew."""
    names = tuple(body.name for body in mechanism.moving)
    members = (*mechanism.joints, *mechanism.drivers, *mechanism.forces)
    solver = NativeSolver(style=style, compiled=compiled, method=Method.ONE_PROGRAM)
    found = solver.prepare(
        mechanism, case.sweep.path, bodies=names, forces=[each.name for each in members]
    )(1e-12)
    assert found.solved.all(), found.message
    return found


def pushes(mechanism, trajectory, k):
    """What drivers do to the bodies: by body, force, point and torque."""
    found = {}

    def add(name, force, at, torque):
        found.setdefault(name, []).append((np.array(force), np.array(at), np.array(torque)))

    for driver in mechanism.drivers:
        effort = trajectory.forces.drivers[driver.name][k]
        if isinstance(driver, PointCoordinate):
            point = mechanism.point(driver.point)
            d = np.array(driver.direction) / np.linalg.norm(driver.direction)
            body = mechanism.body(point.body)
            at = newton_euler.carried(body, trajectory.bodies[point.body], k, point.position)
            add(point.body, effort * d, at, np.zeros(3))
            continue
        joint = mechanism.joint(driver.joint)
        axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
        if joint.i in trajectory.bodies:
            first = trajectory.bodies[joint.i]
            axis = newton_euler.turn_of(mechanism.body(joint.i), first, k) @ axis
        for name, sign in ((joint.i, -1.0), (joint.j, 1.0)):
            if isinstance(driver, JointAngle):
                add(name, np.zeros(3), np.zeros(3), sign * effort * axis)
            else:
                second = trajectory.bodies.get(joint.j)
                body = mechanism.body(joint.j) if second else None
                at = newton_euler.carried(body, second, k, joint.point)
                add(name, sign * effort * axis, at, np.zeros(3))
    return found
