"""Simbody: its own constraints against the native solver and closed forms, its ball joints at the
angles where OpenSim's lock, and what ends its process elsewhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from kincheck import adapters, cases
from kincheck.core import (
    Body,
    Distance,
    Fixed,
    Gear,
    JointAngle,
    Mechanism,
    Point,
    Revolute,
    Spherical,
    solve,
)
from kincheck.core.case.case import Case, Output, Sweep, Truth
from kincheck.core.joints import Joint
from kincheck.core.mechanism.mechanism import SpanningTree, spanning_tree

from ..joints.test_joints import EXAMPLES, TYPES

pytest.importorskip("opensim", reason="OpenSim is not installed: pip install 'kincheck[simbody]'")

from kincheck.adapters.shared.poses import euler_angles
from kincheck.adapters.simbody.simbody import turned

ENGINE = adapters.engine("simbody")
# Round-off, amplified at most a thousandfold by the mechanisms here [m, m/s, m/s^2].
ROUND_OFF = {"position": 1e-13, "velocity": 1e-12, "acceleration": 1e-11}


def solved(mechanism, values, rate=1.0):
    """The sweep of the first driver with all points wanted; all samples are solved."""
    outputs = tuple(
        Output(point.name, point.name, (1.0, 0.0, 0.0), False, 0.0, 0.0, "unused here")
        for point in mechanism.points
    )
    sweep = Sweep(mechanism.drivers[0].name, np.array(values), rate)
    case = Case("test", "made here", Truth.CONSENSUS_ONLY, mechanism, sweep, outputs)
    assert ENGINE.unsupported(case) is None
    found = ENGINE.solve(ENGINE.build(case), case, 1e-12)
    assert found.message == ""
    assert found.solved.all()
    return found


def assert_as_native(mechanism, values, rate=1.0):
    found = solved(mechanism, values, rate)
    expected = solve(mechanism, mechanism.drivers[0].name, values, rate=rate)
    assert expected.solved.all()
    for name, motion in expected.points.items():
        for order, atol in ROUND_OFF.items():
            np.testing.assert_allclose(
                getattr(found.points[name], order), getattr(motion, order), rtol=0, atol=atol
            )
    return found


def cut(monkeypatch, *names):
    """Let these joints close loops; their bodies hang on others, or are free."""

    def tree(mechanism):
        kept = [each for each in mechanism.joints if each.name not in names]
        rest = spanning_tree(replace(mechanism, joints=kept, drivers=(), couplers=()))
        return SpanningTree(rest.branches, (*rest.cut, *map(mechanism.joint, names)))

    monkeypatch.setattr("kincheck.adapters.shared.tree_plan.spanning_tree", tree)


def test_strut_is_the_truth_to_round_off():
    case = cases.load("mcpherson_strut")
    model = ENGINE.build(case)
    found = ENGINE.solve(model, case, 1e-12)
    assert found.details["closures"] == {
        "strut_top": "PointConstraint",
        "tie_rod": "ConstantDistanceConstraint",
    }
    assert found.details["unknowns"] == found.details["rank"] == 5
    again = ENGINE.solve(model, case, 1e-12)
    for output in case.outputs:
        truth, motion = case.reference[output.name], found.points[output.point]
        start = np.array(case.mechanism.point(output.point).position)
        moved = {"position": motion.position - start, "velocity": motion.velocity}
        moved["acceleration"] = motion.acceleration
        for (order, rows), atol in zip(moved.items(), (1e-14, 1e-13, 1e-12), strict=True):
            np.testing.assert_allclose(
                rows @ output.direction, getattr(truth, order), rtol=0, atol=atol
            )
        np.testing.assert_array_equal(motion.position, again.points[output.point].position)


# ends of rods on a body and on the ground, far from a lock-up with any joint that needs them
ON_BODY = ((-0.4, 0.7, 0.4), (-0.3, -0.4, 1.3), (0.6, 0.6, 0.1), (0.4, -0.8, 0.7), (0.0, -0.7, 0.1))
ON_GROUND = (
    (-1.4, -0.6, 0.0),
    (-1.9, 0.6, 1.4),
    (-0.7, 0.1, -0.9),
    (0.2, -2.7, 2.1),
    (-1.0, -0.9, 1.8),
)


def between(joint):
    """A body on a driven revolute, the joint, and a second body on as many rods as the joint has
    freedoms.
    """
    ends = zip(ON_BODY[: 6 - joint.rows], ON_GROUND, strict=False)
    rods = [Distance(f"rod {k}", "b", "ground", each) for k, each in enumerate(ends)]
    pivot = Revolute("pivot", "ground", "a", (0.1, 0.0, 0.4), (0.3, 1.0, -0.4))
    places = {"p": (0.9, 0.2, 0.4), "q": (0.2, -0.4, 0.9), "r": (0.3, 0.3, 0.0)}
    return Mechanism(
        "tested",
        [Body("a", (0.1, 0.2, 0.3)), Body("b", (0.5, -0.1, 0.6), (0.5, 0.5, -0.5, 0.5))],
        [pivot, joint, *rods],
        [Point(name, "b", P) for name, P in places.items()],
        [JointAngle("turn", "pivot")],
    )


@pytest.mark.parametrize("closing", [False, True], ids=["tree", "cut"])
@pytest.mark.parametrize("name", TYPES)
def test_every_joint_moves_as_natively(name, closing, monkeypatch):
    joint = replace(EXAMPLES[name](Joint.registry[name]), name="tested", i="a", j="b")
    if closing:
        cut(monkeypatch, "tested")
    for each in (joint, joint.reversed()):
        found = assert_as_native(between(each), np.linspace(-0.4, 0.4, 5))
        assert ("tested" in found.details["closures"]) == (closing or joint.rows < 3)


@pytest.mark.parametrize("cut_joint", ["", "large"])
@pytest.mark.parametrize("ratio", [-0.3, 2.5])
def test_gears_are_coordinate_couplers(ratio, cut_joint, monkeypatch):
    """Several turns; the larger factor is on either side, the second wheel's pivot reversed."""
    if cut_joint:
        cut(monkeypatch, cut_joint)
    z = (0.0, 0.0, 1.0)
    mechanism = Mechanism(
        "gears",
        [Body("a"), Body("b")],
        [
            Revolute("small", "ground", "a", (0.0, 0.0, 0.0), z),
            Revolute("large", "b", "ground", (1.0, 0.0, 0.0), z),
        ],
        [Point("rim", "b", (1.0, 0.5, 0.0))],
        [JointAngle("turn", "small")],
        [Gear("mesh", ("large", "small"), ratio)],
    )
    turn = np.linspace(-7.0, 7.0, 15)
    found = solved(mechanism, turn).points["rim"]
    angle = -ratio * turn  # of the ground against the wheel, seen from the ground
    expected = np.stack([1.0 - 0.5 * np.sin(angle), 0.5 * np.cos(angle), 0.0 * angle], axis=-1)
    np.testing.assert_allclose(found.position, expected, rtol=0, atol=1e-13)


def test_a_ball_passes_the_angles_where_euler_angles_lock(monkeypatch):
    """A body on a ball stops where its turn about y is a right angle: OpenSim's second angle."""
    corner = (0.8, 0.1, 0.5)
    mechanism = Mechanism(
        "door",
        [Body("door")],
        [
            Spherical("ball", "ground", "door", (0.0, 0.0, 0.0)),
            Revolute("hinge", "ground", "door", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
        ],
        [Point("corner", "door", corner)],
        [JointAngle("turn", "hinge")],
    )
    cut(monkeypatch, "hinge")
    turn = 0.5 * math.pi * np.arange(-4, 5) / 2
    found = solved(mechanism, turn, rate=2.0).points["corner"]
    c, s = np.cos(turn), np.sin(turn)
    x, y, z = corner
    expected = np.stack([c * x + s * z, 0.0 * c + y, c * z - s * x], axis=-1)
    across = expected * [1.0, 0.0, 1.0]
    rate = np.stack([c * z - s * x, 0.0 * c, -c * x - s * z], axis=-1)
    np.testing.assert_allclose(found.position, expected, rtol=0, atol=1e-14)
    np.testing.assert_allclose(found.velocity, 2.0 * rate, rtol=0, atol=1e-13)
    np.testing.assert_allclose(found.acceleration, -4.0 * across, rtol=0, atol=1e-13)


def rotation(p):
    """Return the rotation matrix of Euler parameters."""
    e0, e = p[0], np.array(p[1:])
    skew = np.cross(np.eye(3), e)
    return (e0**2 - e @ e) * np.eye(3) + 2.0 * np.outer(e, e) + 2.0 * e0 * skew


def test_euler_angles_give_the_rotation_back_at_any_angle():
    rng = np.random.default_rng(0)
    lock = math.sqrt(0.5)
    poses = [*rng.normal(size=(50, 4)), [lock, 0.0, lock, 0.0], [lock, 0.0, -lock, 0.0]]
    poses += [[lock, 1e-9, lock, 2e-9], [0.5, 0.5, 0.5, -0.5], [0.5, -0.5, 0.5, 0.5], [0, 0, 1, 0]]
    for p in poses:
        p = np.array(p) / np.linalg.norm(p)
        R = np.eye(3)
        for angle, e in zip(euler_angles(p.tolist()), np.eye(3), strict=True):
            R = R @ rotation([math.cos(angle / 2), *(math.sin(angle / 2) * e)])
        np.testing.assert_allclose(R, rotation(p), rtol=0, atol=2e-15)


def test_turning_is_by_the_axes_of_the_parent():
    p, turn = np.array([0.5, 0.5, -0.5, 0.5]), np.array([0.4, -0.2, 0.9])
    angle = np.linalg.norm(turn)
    step = [math.cos(angle / 2), *(math.sin(angle / 2) / angle * turn)]
    found = turned(p.tolist(), turn.tolist())
    np.testing.assert_allclose(rotation(found), rotation(step) @ rotation(p), rtol=0, atol=1e-15)
    assert turned(p.tolist(), [0.0, 0.0, 0.0]) == tuple(p)


@pytest.mark.parametrize("second", [Spherical, Distance, Fixed, Revolute])
def test_a_joint_within_one_body_has_rows_of_its_own(second):
    """OpenSim ends the process at a constraint of a body with itself."""
    how = {
        Distance: {"points": ((0.1, 0.0, 0.0), (0.2, 0.1, 0.0))},
        Revolute: {"point": (0.1, 0.0, 0.0), "axis": (0.0, 0.0, 1.0)},
    }.get(second, {"point": (0.1, 0.0, 0.0)})
    mechanism = Mechanism(
        "plates",
        [Body("a"), Body("b")],
        [
            Revolute("pivot", "ground", "a", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
            Fixed("glue", "a", "b", (0.1, 0.0, 0.0)),
            second("again", "a", "b", **how),
        ],
        [Point("tip", "b", (0.5, 0.2, 0.1))],
        [JointAngle("turn", "pivot")],
    )
    assert_as_native(mechanism, np.linspace(-1.0, 1.0, 5))


def test_a_stroke_out_of_reach_is_a_message_and_no_number():
    case = cases.load("mcpherson_strut")
    far = replace(case, sweep=Sweep("stroke", 0.01 * np.arange(40)))
    found = ENGINE.solve(ENGINE.build(far), far, 1e-12)
    assert found.solved[:30].all()
    assert not found.solved[30:].any()
    assert "last reachable sample at stroke = 0.29" in found.message
    assert np.isnan(found.points["wheel_center"].position[30:]).all()


def test_unsupported_names_the_joint(monkeypatch):
    monkeypatch.setattr(Joint, "registry", dict(Joint.registry))

    @dataclass(frozen=True)
    class Latch(Revolute):
        type = "latch"

    case = cases.load("mcpherson_strut")
    latch = Latch("bolt", "ground", "lca", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    other = replace(case.mechanism, joints=[*case.mechanism.joints, latch])
    assert "'bolt' (latch)" in ENGINE.unsupported(replace(case, mechanism=other))
    assert ENGINE.unsupported(case) is None


def test_settings_and_floor_say_what_is_simbody_s_own():
    case = cases.load("mcpherson_strut")
    assert ENGINE.settings["residual"].startswith("getQErr")
    floor = ENGINE.floor(replace(case, sweep=Sweep("stroke", np.linspace(-0.02, 0.02, 5))))
    assert floor.us_per_sample > 0.0
    assert {"realizePosition", "calcG", "calcBiasForAccelerationConstraints"} <= set(floor.parts)
    assert floor.parts["calcFrameJacobian"] > 0.0  # of the wheel centre
    assert ENGINE.version().startswith("4.")
    assert next(iter(ENGINE.efforts())) == "predictor only"
