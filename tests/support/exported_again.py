"""A case, exported as a model and read again: both move alike."""

import numpy as np
from kincheck.core.case.case import Case

from ..oracles import naive
from .model_poses import solution


def same_motion(case: Case, again: Case) -> float:
    """Return the largest distance of three points of each body that both have [m]."""
    here, there = solution(case), solution(again)
    common = [body for body in case.mechanism.moving if body.name in there.bodies]
    assert len(common) == len(case.mechanism.moving)
    worst = 0.0
    for body in common:
        other = again.mechanism.body(body.name)
        for arm in np.eye(3):
            P = np.add(body.origin, arm)
            paths = [
                moved(found.bodies[body.name], own, P)
                for found, own in ((here, body), (there, other))
            ]
            worst = max(worst, float(np.abs(paths[0] - paths[1]).max()))
    return worst


def moved(motion, body, P):
    """The path of a point of a body that is at P at design, shape (samples, 3)."""
    e = np.array(body.euler_parameters)
    arm = naive.A(e).T @ (P - np.array(body.origin))
    return np.array([r + naive.A(p) @ arm for r, p in zip(motion.r, motion.p, strict=True)])
