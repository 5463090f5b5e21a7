"""Newton and Euler for one body at a time, from its motion in the paper's variables.

Nothing here comes from the code under test; every step is a plain matrix product for one sample.
"""

import numpy as np

from . import naive


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
    A_design = naive.A(np.array(body.euler_parameters))
    arm = np.array(position) - np.array(body.origin)
    return motion.r[k] + naive.A(motion.p[k]) @ A_design.T @ arm


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


def unit_wrenches(joint, axis, at, other):
    """Unit reactions of a joint on its second body: forces and moments about its point, six each.

    Args:
        axis: of a revolute or translational joint, now.
        at: the joint's point on its second body, now; other: that on its first.
    """
    none, across = np.zeros((3, 3)), np.linalg.svd(axis[None])[2][1:]
    match joint.type:
        case "spherical":
            forces, moments = np.eye(3), none
        case "revolute":
            forces, moments = np.eye(3), across
        case "translational":
            forces, moments = across, np.eye(3)
        case "distance":
            return np.array([[*(at - other) / np.linalg.norm(at - other), 0.0, 0.0, 0.0]])
    force = [[*each, 0.0, 0.0, 0.0] for each in forces]
    moment = [[0.0, 0.0, 0.0, *each] for each in moments if each.any()]
    return np.array(force + moment)


def reactions(mechanism, motions, k, pushes):
    """The force and moment of every joint on its second body, and the effort of the driver of a
    point: six equations a body, solved at once.

    Args:
        pushes: as for `left_over`.
    """
    bodies = {body.name: body for body in mechanism.bodies}
    rows = {name: 6 * n for n, name in enumerate(motions)}
    columns, widths, right = [], [], np.zeros(6 * len(motions))
    centers = {}
    for name, motion in motions.items():
        force, torque, C = demand(bodies[name], motion, k, mechanism.gravity)
        centers[name] = C
        for push, at, turn in pushes.get(name, ()):
            force, torque = force - push, torque - turn - np.cross(at - C, push)
        right[rows[name] : rows[name] + 6] = [*force, *torque]

    def on(name, at, wrenches, sign):
        found = np.zeros((len(right), len(wrenches)))
        if name in motions:
            forces, moments = wrenches[:, :3], wrenches[:, 3:]
            about = moments + np.cross(at - centers[name], forces)
            found[rows[name] : rows[name] + 6] = sign * np.hstack([forces, about]).T
        return found

    def now(name, position):
        return carried(bodies.get(name), motions.get(name), k, position)

    for joint in mechanism.joints:
        first, second = joint.points_on(joint.i)[0], joint.points_on(joint.j)[0]
        at, other = now(joint.j, second), now(joint.i, first)
        axis = np.array(getattr(joint, "axis", (0.0, 0.0, 1.0)))
        axis = now(joint.i, np.array(first) + axis) - other
        wrenches = unit_wrenches(joint, axis, at, other)
        widths.append((joint.name, wrenches))
        columns.append(on(joint.j, at, wrenches, 1.0) + on(joint.i, at, wrenches, -1.0))
    (driver,) = mechanism.drivers
    point = mechanism.point(driver.point)
    push = np.array([[*driver.direction, 0.0, 0.0, 0.0]])
    columns.append(on(point.body, now(point.body, point.position), push, 1.0))
    solution = np.linalg.solve(np.hstack(columns), right)
    found, start = {}, 0
    for name, wrenches in widths:
        found[name] = solution[start : start + len(wrenches)] @ wrenches
        start += len(wrenches)
    return found, solution[-1]
