"""Every joint type in MuJoCo, in its tree and closing a loop, against the native solver, which shares no equation with it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck.adapters import mujoco_spec
from kincheck.core import Body, JointAngle, JointDisplacement, Mechanism, Point, PointCoordinate
from kincheck.core import solve as solve_natively
from kincheck.core.joints import (
    ConstantVelocity,
    Cylindrical,
    Distance,
    Gear,
    Joint,
    RackPinion,
    Revolute,
    Screw,
    Spherical,
    Translational,
)
from kincheck.core.topology import SpanningTree, spanning_tree

from .test_joints import EXAMPLES, TYPES
from .test_mujoco import case, solve

pytest.importorskip("mujoco", reason="MuJoCo is not installed")

# Of both engines together: residuals of 1e-12 times the amplification of a sound mechanism, and one and two times its speed.
POSITION, RATES = 1e-10, 1e-9


def figures(mechanism, driver, values, rate=1.0):
    """MuJoCo's solution, and its largest differences from the native one in position, velocity and acceleration."""
    bodies = [body.name for body in mechanism.bodies]
    stub = case([], {"x": ("ground", (0.0, 0.0, 0.0))}, mechanism.drivers, values, rate)
    outputs = tuple(replace(stub.outputs[0], name=point.name, point=point.name) for point in mechanism.points)
    sweep = replace(stub.sweep, driver=driver)
    assert bodies
    found = solve(replace(stub, mechanism=mechanism, outputs=outputs, sweep=sweep))
    expected = solve_natively(mechanism, driver, values, rate=rate)
    assert expected.solved.all()
    pairs = [(found.points[name], expected.points[name]) for name in expected.points]
    worst = [
        max(np.abs(getattr(one, what) - getattr(other, what)).max() for one, other in pairs)
        for what in ("position", "velocity", "acceleration")
    ]
    return found, worst


def assert_agrees(mechanism, driver, values, rate=1.0):
    found, worst = figures(mechanism, driver, values, rate)
    assert worst[0] <= POSITION
    assert max(worst[1:]) <= RATES
    return found


def cut(monkeypatch, *names):
    """These joints close loops; their bodies hang on others, or are free."""

    def tree(mechanism):
        kept = [each for each in mechanism.joints if each.name not in names]
        rest = spanning_tree(replace(mechanism, joints=kept, drivers=(), couplers=()))
        return SpanningTree(rest.branches, (*rest.cut, *map(mechanism.joint, names)))

    monkeypatch.setattr(mujoco_spec, "spanning_tree", tree)


# Ends of rods on a body and on the ground, in no plane and parallel to nothing.
ON_BODY = ((0.6, 0.1, 0.9), (0.1, 0.5, 0.6), (0.7, -0.5, 0.3), (-0.2, -0.3, 0.8), (0.4, 0.3, 0.1))
ON_GROUND = ((0.9, 0.4, 2.1), (0.3, 1.7, 0.9), (1.9, -0.7, 0.0), (-1.1, -0.4, 1.5), (0.5, 0.8, -1.1))


def tested(joint, reversed=False):
    """A body on a driven revolute, the joint, and a second body on as many rods as the joint has freedoms."""
    joint = replace(joint, name="tested", i="a", j="b")
    rods = [Distance(f"rod {k}", "b", "ground", (ON_BODY[k], ON_GROUND[k])) for k in range(6 - joint.rows)]
    return Mechanism(
        "tested",
        [Body("a", (0.1, 0.2, 0.3)), Body("b", (0.5, -0.1, 0.6), (0.5, 0.5, -0.5, 0.5))],
        [
            Revolute("pivot", "ground", "a", (0.0, 0.4, 0.2), (0.3, 1.0, -0.4)),
            joint.reversed() if reversed else joint,
            *rods,
        ],
        [Point("p", "b", (0.9, 0.2, 0.4)), Point("q", "b", (0.2, -0.4, 0.9)), Point("r", "b", (0.3, 0.3, 0.0))],
        [JointAngle("turn", "pivot")],
    )


ANGLES = np.linspace(-0.4, 0.4, 17)


@pytest.mark.parametrize("closing", [False, True], ids=["tree", "cut"])
@pytest.mark.parametrize("reversed", [False, True], ids=["ij", "ji"])
@pytest.mark.parametrize("name", TYPES)
def test_joint_moves_as_natively(name, reversed, closing, monkeypatch):
    joint = EXAMPLES[name](Joint.registry[name])
    if closing:
        cut(monkeypatch, "tested")
    found = assert_agrees(tested(joint, reversed), "turn", ANGLES)
    assert ("tested" in found.details["closures"]) == (closing or joint.rows < 3)
