"""Angles with their turns, of sweeps whose samples are far apart or far from the design."""

import math

import numpy as np
import pytest
from kincheck.core import solve
from kincheck.core.case.case import Case, Sweep, Truth
from kincheck.core.case.measures import JointAngle as Angle
from kincheck.core.case.quantity import with_markers
from kincheck.core.harness.compare import output_series
from kincheck.core.joints import Cylindrical, Revolute, Spherical, Translational, Universal
from kincheck.core.kinematics import (
    NativeSolver,
    angle_with_turns,
    followed,
    follower,
    forces_of,
    in_doubt,
    near_design,
)
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.one_design import prepare as prepare_one
from kincheck.core.mechanism.loads import TorsionSpringDamper
from kincheck.core.mechanism.mechanism import Body, Mechanism, Point
from kincheck.core.mechanism.motions import JointAngle, JointDisplacement, Path, Ramp, Sine

from ..support.mechanisms import X, Z

BEND = 0.8  # cosine of the angle between the shafts


def shafts() -> Mechanism:
    """Hooke's joint between two shafts, with a torsional spring on the driven one."""
    return Mechanism(
        "shafts",
        [Body("first", mass=1.0), Body("second", mass=1.0)],
        [
            Revolute("a", "ground", "first", (0.0, 0.0, 0.0), X),
            Universal("u", "first", "second", X, (Z, (-0.6, 0.8, 0.0))),
            Cylindrical("b", "ground", "second", (1.8, 0.6, 0.0), (0.8, 0.6, 0.0)),
        ],
        [Point("P", "second", (1.8, 0.6, 0.0))],
        [JointAngle("turn", "a")],
        forces=[TorsionSpringDamper("spring", "b", stiffness=1.0)],
    )


def driven(x):
    """The closed form: tan(b) = tan(a) cos(bend), b turning with a."""
    x = np.asarray(x, dtype=float)
    less = (BEND - 1) * np.sin(x) * np.cos(x)
    return x + np.arctan2(less, np.cos(x) ** 2 + BEND * np.sin(x) ** 2)


def angles(sweep: Sweep, joint: str):
    output = Angle("angle", 1e-9, 0.0, "test", joint)
    mechanism = with_markers(shafts(), [output])
    case = Case("shafts", "test", Truth.CONSENSUS_ONLY, mechanism, sweep, (output,))
    path = sweep.path
    motions = {name: each for name, each in path.motions.items() if name != "turn"}
    if sweep.driver == "time":
        motion = NativeSolver().prepare(mechanism, path, list(case.points))(1e-12)
    else:
        motion = solve(mechanism, "turn", sweep.values, motions=motions)
    return output_series(case, output, motion).position


@pytest.mark.parametrize(
    "values",
    [
        [0.0, 6 * math.pi],
        np.linspace(-10 * math.pi, 50 * math.pi, 7),
        [101.0, 60.0, -40.0],
        [60.0],
    ],
)
def test_turns_are_counted_between_samples_far_apart(values):
    found = angles(Sweep("turn", np.array(values)), "b")
    np.testing.assert_allclose(found, driven(values), rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    "motion",
    [Sine(10.0, 1.0, math.pi / 2), Sine(-40.0, 0.3, 0.5)],
)
def test_turns_are_counted_from_the_design_where_the_motion_starts_elsewhere(motion):
    times = np.array([0.0, 0.1, 0.2])
    values = motion.at(times)[0]
    sweep = Sweep("time", times, motions={"turn": motion})
    np.testing.assert_allclose(angles(sweep, "a"), values, rtol=0, atol=1e-9)
    np.testing.assert_allclose(angles(sweep, "b"), driven(values), rtol=0, atol=1e-9)


def test_torsional_springs_of_a_solved_motion_count_the_same_turns():
    mechanism, values = shafts(), np.array([0.0, 20.0, 60.0])
    path = Path({"turn": Ramp(1.0)}, values)
    motion = solve(mechanism, "turn", values, bodies=["first", "second"])
    follow = follower(mechanism, path, motion.solved)
    found = forces_of(mechanism, path, motion, ["spring"], follow).elements["spring"]
    np.testing.assert_allclose(found, -driven(values), rtol=0, atol=1e-9)


def test_short_steps_from_the_design_need_no_further_samples():
    mechanism = shafts()
    assert near_design(mechanism, Path({"turn": Ramp(1.0)}, np.linspace(0.0, 7.0, 36)))
    assert not near_design(mechanism, Path({"turn": Ramp(1.0)}, np.linspace(5.0, 7.0, 36)))
    times = np.linspace(0.0, 7.0, 36)
    assert not in_doubt(driven(times), np.gradient(driven(times), times), times)
    assert in_doubt(driven(times) + 2 * math.pi * (times > 3), np.ones(36), times)


def test_rates_without_bound_towards_a_fold_are_no_turns():
    """A slider-crank driven by its slide, to the dead centre."""
    crank = Mechanism(
        "crank",
        [Body("crank"), Body("rod"), Body("slide")],
        [
            Revolute("pivot", "ground", "crank", (0.0, 0.0, 0.0), Z),
            Spherical("pin", "crank", "rod", (0.6, 0.8, 0.0)),
            Revolute("wrist", "rod", "slide", (2.1, 0.8, 0.0), Z),
            Translational("guide", "ground", "slide", (2.1, 0.8, 0.0), X),
        ],
        [],
        [JointDisplacement("push", "guide")],
    )
    end = math.sqrt(2.5**2 - 0.8**2) - 2.1  # crank and rod in line
    values = np.array([0.0, end / 2, end * (1 - 1e-7)])
    found = angle_with_turns(crank, Path({"push": Ramp(1.0)}, values), "pivot")
    assert found is not None
    x = 2.1 + values  # of the wrist, 0.8 above the pivot
    to_wrist, beside = np.hypot(x, 0.8), np.arctan2(0.8, x)
    cosine = (1.0 + to_wrist**2 - 1.5**2) / (2 * to_wrist)
    first = math.atan2(0.8, 0.6)
    wanted = beside + np.arccos(np.clip(cosine, -1, 1)) - first
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-4)


def test_angles_of_a_path_are_followed_at_once(monkeypatch):
    asked: list[int] = []

    def prepare(mechanism: Mechanism, request: Request, path: Path):
        asked.append(len(request.bodies))
        return prepare_one(mechanism, request, path)

    monkeypatch.setattr(followed, "prepare_motion", prepare)
    path = Path({"turn": Ramp(7.5)}, np.array([1.0]))
    first, second = (angle_with_turns(shafts(), path, joint) for joint in "ab")
    assert asked == [2]
    assert first == pytest.approx([7.5])
    assert second == pytest.approx(driven([7.5]))
