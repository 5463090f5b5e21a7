"""Simbody: its ball joints at the angles where OpenSim's lock, and its settings and floor."""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck import JointAngle, Revolute, Spherical, adapters, cases
from kincheck.adapters.shared.axis_angles import euler_angles
from kincheck.adapters.simbody.simbody import turn_parameters
from kincheck.core.case.case import Sweep
from kincheck.core.doors import offers

from ...oracles.naive import A
from ...support.engine_motion import assert_motion, mechanism_of, rotation, solved
from ...support.mechanisms import ORIGIN, Y

pytest.importorskip("opensim", reason="OpenSim is not installed: pip install 'kincheck[simbody]'")


ENGINE = adapters.engine("simbody")


def test_spherical_joint_passes_gimbal_lock():
    """A body on a ball stops where its turn about y is a right angle: OpenSim's second angle."""
    corner = (0.8, 0.1, 0.5)
    joints = [
        Spherical("ball", "ground", "door", ORIGIN),
        Revolute("hinge", "ground", "door", ORIGIN, Y),
    ]
    mechanism = mechanism_of(joints, {"corner": ("door", corner)}, [JointAngle("turn", "hinge")])
    turn = 0.5 * math.pi * np.arange(-4, 5) / 2
    found = solved("simbody", mechanism, turn, 2.0, ["hinge"]).points["corner"]
    expected, h = rotation(Y, turn) @ corner, np.array([0.0, 1.0, 0.0])
    rates = 2.0 * np.cross(h, expected), 4.0 * np.cross(h, np.cross(h, expected))
    assert_motion(found, expected, *rates, atol=(1e-14, 1e-13, 1e-13))


def test_euler_angles_restore_any_rotation():
    rng = np.random.default_rng(0)
    lock = math.sqrt(0.5)
    poses = [*rng.normal(size=(50, 4)), [lock, 0.0, lock, 0.0], [lock, 0.0, -lock, 0.0]]
    poses += [[lock, 1e-9, lock, 2e-9], [0.5, 0.5, 0.5, -0.5], [0.5, -0.5, 0.5, 0.5], [0, 0, 1, 0]]
    for p in poses:
        p = np.array(p) / np.linalg.norm(p)
        R = np.eye(3)
        for angle, e in zip(euler_angles(p.tolist()), np.eye(3), strict=True):
            R = R @ A([math.cos(angle / 2), *(math.sin(angle / 2) * e)])
        np.testing.assert_allclose(R, A(p), rtol=0, atol=2e-15)


def test_turn_by_parent_axes():
    p, turn = np.array([0.5, 0.5, -0.5, 0.5]), np.array([0.4, -0.2, 0.9])
    angle = np.linalg.norm(turn)
    step = [math.cos(angle / 2), *(math.sin(angle / 2) / angle * turn)]
    found = turn_parameters(p.tolist(), turn.tolist())
    np.testing.assert_allclose(A(found), A(step) @ A(p), rtol=0, atol=1e-15)
    assert turn_parameters(p.tolist(), [0.0, 0.0, 0.0]) == tuple(p)


def test_simbody_settings_and_floor():
    case = cases.load("mcpherson_strut")
    assert ENGINE.settings["residual"].startswith("getQErr")
    few = replace(case, sweep=Sweep("stroke", np.linspace(-0.02, 0.02, 5)))
    floor = offers("floors")["simbody"].load()(ENGINE, few)
    assert floor.us_per_sample > 0.0
    assert {"realizePosition", "calcG", "calcBiasForAccelerationConstraints"} <= set(floor.parts)
    assert floor.parts["calcFrameJacobian"] > 0.0  # of the wheel centre
    assert ENGINE.version().startswith("4.")
    assert next(iter(ENGINE.efforts())) == "predictor only"
