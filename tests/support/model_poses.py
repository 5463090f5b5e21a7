"""The native solution of a case, and coordinates of its joints by the poses of their bodies."""

from functools import partial

import numpy as np
from kincheck.core.kinematics import NativeSolver
from scipy.spatial.transform import Rotation

EXACT = 1e-13
"""Rounding of metre-sized coordinates, some operations deep."""
near = partial(np.allclose, rtol=0.0, atol=EXACT)


def solution(case):
    """The native solution of a case, with all bodies that move; all samples are solved."""
    names = [body.name for body in case.mechanism.moving]
    solver = NativeSolver(compiled=False)
    found = solver.prepare(case.mechanism, case.sweep.path, bodies=names, points=case.points)(1e-12)
    assert found.solved.all(), found.message
    return found


def coordinate(case, found, name):
    """The coordinate of a hinge or slide since its design, at every sample."""
    joint = case.mechanism.joint(name)
    (outer, start), (inner, end) = (_carried(case, found, joint, body) for body in joint.bodies)
    axis = joint.axis / np.linalg.norm(joint.axis)
    if joint.type == "revolute":
        return (outer.inv() * inner).as_rotvec() @ axis
    return np.sum((end - start) * outer.apply(axis), axis=-1)


def _carried(case, found, joint, name):
    """The turn of a body since its design, and its point that was in the joint there."""
    if case.mechanism.is_fixed(name):
        return Rotation.identity(), np.array(joint.point)
    body, motion = case.mechanism.body(name), found.bodies[name]
    now, then = (
        Rotation.from_quat(p, scalar_first=True) for p in (motion.p, body.euler_parameters)
    )
    turn = now * then.inv()
    return turn, motion.r + turn.apply(np.subtract(joint.point, body.origin))
