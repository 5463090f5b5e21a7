"""Planar loops of revolutes in a tilted plane: all are solved, whatever rows are matched."""

import random

import numpy as np
import pytest
from kincheck.core.joints import Revolute
from kincheck.core.kinematics import solve
from kincheck.core.mechanism.mechanism import Body, Mechanism, Point
from kincheck.core.mechanism.motions import JointAngle

TILT = np.array([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3
LOOPS, START = 22, 0.3


def tilted(*point: float) -> tuple[float, float, float]:
    x, y, z = (TILT @ np.array(point)).tolist()
    return x, y, z


def parallel_cranks(seed: int) -> Mechanism:
    """Unit cranks at (k, 0), each joined to the next by a bar of one; joints in any order.

    Three rows of each loop are redundant.
    """
    s, c, axis = np.sin(START), np.cos(START), tilted(0.0, 0.0, 1.0)
    joints = [
        Revolute(f"p{k}", "ground", f"c{k}", tilted(k, 0.0, 0.0), axis) for k in range(LOOPS + 1)
    ]
    for k in range(LOOPS):
        for name, crank, x in (("a", k, k + s), ("b", k + 1, k + 1 + s)):
            joints.append(Revolute(f"{name}{k}", f"c{crank}", f"r{k}", tilted(x, c, 0.0), axis))
    names = [*(f"c{k}" for k in range(LOOPS + 1)), *(f"r{k}" for k in range(LOOPS))]
    order = random.Random(seed)
    order.shuffle(joints)
    order.shuffle(names)
    tip = Point("tip", f"c{LOOPS}", tilted(LOOPS + s, c, 0.0))
    bodies = [Body(name) for name in names]
    return Mechanism("cranks", bodies, joints, [tip], [JointAngle("drive", "p0")])


@pytest.mark.parametrize("seed", [1, 2])
def test_tilted_components_with_redundant_rows(seed: int):
    found = solve(parallel_cranks(seed), "drive", np.array([0.0, 0.2]))
    assert found.solved.all()
    # positive angles turn y towards -x
    angle = START - 0.2
    expected = TILT @ np.array([LOOPS + np.sin(angle), np.cos(angle), 0.0])
    assert found.points["tip"].position[-1] == pytest.approx(expected, abs=1e-13)
