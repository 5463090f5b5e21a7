"""A case, exported as a model and read again: both move alike."""

import numpy as np
from kincheck.core.case.case import Case

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
    arm = matrix(e).T @ (P - np.array(body.origin))
    return np.array([r + matrix(p) @ arm for r, p in zip(motion.r, motion.p, strict=True)])


def matrix(p):
    """The rotation matrix of Euler parameters."""
    e0, e = p[0], np.asarray(p[1:])
    cross = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    return (2 * e0**2 - 1) * np.eye(3) + 2 * (np.outer(e, e) + e0 * cross)
