"""Put a solution of kincheck into MuJoCo, which has loaded the model itself: coordinates, equality
residuals, places of bodies.
"""

import numpy as np
from kincheck.core.algebra import Quat, vec
from kincheck.core.kinematics import solve


def solution(case):
    """The native solution of a case, with all bodies that move."""
    names = [body.name for body in case.mechanism.moving]
    return solve(case.mechanism, case.sweep.driver, case.sweep.change, bodies=names)


def _turn(mechanism, found, name, k):
    """The turn of a body since its design, global axes."""
    if mechanism.is_fixed(name):
        return Quat(1.0, vec((0.0, 0.0, 0.0)))
    now, then = found.bodies[name].p[k], mechanism.body(name).euler_parameters
    return Quat(now[0], vec(now[1:])) * Quat(then[0], vec(then[1:])).conjugate()


def _shift(mechanism, found, name, point, k):
    """Where a body has a point that was at that place at design."""
    if mechanism.is_fixed(name):
        return np.array(point)
    turn, body = _turn(mechanism, found, name, k), mechanism.body(name)
    arm = Quat(0.0, vec(np.subtract(point, body.origin)))
    return found.bodies[name].r[k] + np.array([*(turn * arm * turn.conjugate()).e])


def coordinate(mechanism, found, joint, k):
    """A joint's coordinate since its design, from the poses of its bodies: angle, displacement, or
    the quaternion of a ball.
    """
    outer, inner = (_turn(mechanism, found, name, k) for name in joint.bodies)
    # a rod for a body on a ball: the shortest turn that points it where it has to
    if joint.type == "distance":
        ends = [
            _shift(mechanism, found, name, point, k)
            for name, point in zip(joint.bodies, joint.points, strict=True)
        ]
        then, now = (
            np.array(a) / np.linalg.norm(a)
            for a in (np.subtract(*joint.points[::-1]), ends[1] - ends[0])
        )
        now = np.array([*(outer.conjugate() * Quat(0.0, vec(now)) * outer).e])
        q = np.array([1.0 + then @ now, *np.cross(then, now)])
        q /= np.linalg.norm(q)
        return Quat(q[0], vec(q[1:]))
    between = outer.conjugate() * inner
    if joint.type == "spherical":
        return between
    axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
    if joint.type == "revolute":
        return 2.0 * np.arctan2(axis @ [*between.e], between.e0)
    apart = _shift(mechanism, found, joint.bodies[1], joint.point, k) - _shift(
        mechanism, found, joint.bodies[0], joint.point, k
    )
    along = outer * Quat(0.0, vec(axis)) * outer.conjugate()
    return apart @ [*along.e]


def mujoco_errors(mujoco, xml, case, samples):
    """Largest equality residual in MuJoCo [m, rad], and largest distance of a body's origin from
    kincheck's [m].

    A body's origin is compared where the mechanism has it.
    """
    model = mujoco.MjModel.from_xml_path(str(xml))
    data, found, mechanism = mujoco.MjData(model), solution(case), case.mechanism
    assert found.solved.all(), found.message
    residual, distance = 0.0, 0.0
    names = {joint.name for joint in mechanism.joints}
    for k in samples:
        data.qpos[:] = model.qpos0
        for j in range(model.njnt):
            name, at = (
                model.joint(j).name or model.body(model.jnt_bodyid[j]).name,
                model.jnt_qposadr[j],
            )
            if name not in names or mechanism.joint(name).type not in (
                "revolute",
                "translational",
                "spherical",
                "distance",
            ):
                continue
            value = coordinate(mechanism, found, mechanism.joint(name), k)
            if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_BALL:
                # MuJoCo has the turn in the axes of the body, as the pose of the file has them
                mujoco.mj_kinematics(model, home := mujoco.MjData(model))
                frame = Quat(
                    home.xquat[model.jnt_bodyid[j]][0], vec(home.xquat[model.jnt_bodyid[j]][1:])
                )
                data.qpos[at : at + 4] = [*(frame.conjugate() * value * frame)]
            else:
                data.qpos[at] += value
        driven = data.qpos[model.joint(case.sweep.driver).qposadr[0]]
        assert abs(driven - case.sweep.values[k]) < 1e-12, (
            "the swept coordinate is not the model's own"
        )
        mujoco.mj_forward(model, data)
        rows = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        residual = max(residual, np.abs(data.efc_pos[rows]).max(initial=0.0))
        for name, motion in found.bodies.items():
            b = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
            if b >= 0:
                distance = max(distance, np.linalg.norm(data.xpos[b] - motion.r[k]))
    assert rows.any()
    return residual, distance
