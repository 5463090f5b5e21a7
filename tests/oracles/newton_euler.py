"""Newton and Euler for one body at a time, from its motion in the paper's variables.

Nothing here comes from the code under test; every step is a plain matrix product for one sample.
"""

import numpy as np

from . import naive


def turn_of(body, motion, k):
    """The rotation of a body since design."""
    return naive.A(motion.p[k]) @ naive.A(np.array(body.euler_parameters)).T


def demand(body, motion, k, gravity):
    """The force [N] and the torque about the centre of mass [N m] that a body's motion demands.

    Also the centre of mass, global [m].
    """
    A_design = naive.A(np.array(body.euler_parameters))
    A = naive.A(motion.p[k])
    to_center = np.array(body.center_of_mass) - np.array(body.origin)
    arm = A @ A_design.T @ to_center
    # body axes: w' and w'dot as they are given, the inertia turned back to them
    omega, omega_t = motion.v[k][3:], motion.a[k][3:]
    wt, w = naive.tilde(omega_t), naive.tilde(omega)
    acceleration = motion.a[k][:3] + A @ (wt + w @ w) @ A.T @ arm
    force = body.mass * (acceleration - np.array(gravity))
    torque = np.zeros(3)
    if body.inertia is not None:
        xx, yy, zz, xy, yz, xz = body.inertia
        at_design = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        own = A_design.T @ at_design @ A_design
        torque = A @ (own @ omega_t + w @ own @ omega)
    return force, torque, motion.r[k] + arm


def carried(body, motion, k, position):
    """Where a point of a body is at a sample; its position at design is given."""
    if motion is None:
        return np.array(position)
    arm = np.array(position) - np.array(body.origin)
    return motion.r[k] + turn_of(body, motion, k) @ arm


def left_over(mechanism, trajectory, k, pushes):
    """The wrench missing to each body's equilibrium, about its centre of mass, by body.

    Args:
        pushes: by body, forces with the point they act at, and torques, that nothing else says.
    """
    bodies = {body.name: body for body in mechanism.bodies}
    motions = trajectory.bodies
    found = {}
    for name, motion in motions.items():
        force, torque, C = demand(bodies[name], motion, k, mechanism.gravity)
        f, t = -force, -torque
        for joint in mechanism.joints:
            sign = {joint.j: 1.0, joint.i: -1.0}.get(name)
            if sign is None:
                continue
            reaction = trajectory.forces.joints[joint.name]
            points = joint.points_on(joint.j)
            on = joint.j if joint.j in motions else joint.i
            at = (
                carried(bodies.get(joint.j), motions.get(joint.j), k, points[0])
                if points
                else motions[on].r[k]
            )
            f = f + sign * reaction.force[k]
            t = t + sign * (reaction.moment[k] + np.cross(at - C, reaction.force[k]))
        for force, at, torque in pushes.get(name, ()):
            f = f + force
            t = t + torque + np.cross(at - C, force)
        found[name] = (f, t)
    return found
