"""Angles and orientations with their turns, of sweeps whose samples are far apart or far from the
design.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck import (
    Body,
    Case,
    Cylindrical,
    Gear,
    JointAngle,
    JointDisplacement,
    Mechanism,
    Point,
    Ramp,
    Revolute,
    Sine,
    Spherical,
    Translational,
    Universal,
    solve,
)
from kincheck.core.case.case import Sweep, Truth
from kincheck.core.case.measures import Component, Orientation
from kincheck.core.case.measures import JointAngle as Angle
from kincheck.core.case.quantity import with_markers
from kincheck.core.harness.compare import output_series
from kincheck.core.kinematics import (
    NativeSolver,
    angle_with_turns,
    followed,
    follower,
    forces_of,
    in_doubt,
    near_design,
)
from kincheck.core.kinematics.one_design import prepare as prepare_one
from kincheck.core.mechanism.loads import TorsionSpringDamper
from kincheck.core.mechanism.motions import Path

from ..support.mechanisms import ORIGIN, X, Z

BEND = 0.8  # cosine of the angle between the shafts


def shafts(bend=BEND):
    """Hooke's joint between two shafts, with a torsional spring on the driven one."""
    across = math.sqrt(1 - bend**2)
    return Mechanism(
        "shafts",
        [Body("first", mass=1.0), Body("second", mass=1.0)],
        [
            Revolute("a", "ground", "first", ORIGIN, X),
            Universal("u", "first", "second", X, (Z, (-across, bend, 0.0))),
            Cylindrical("b", "ground", "second", (1 + bend, across, 0.0), (bend, across, 0.0)),
        ],
        [Point("P", "second", (1.8, 0.6, 0.0))],
        [JointAngle("turn", "a")],
        forces=[TorsionSpringDamper("spring", "b", stiffness=1.0)],
    )


def driven(x, bend=BEND):
    """The closed form: tan(b) = tan(a) cos(bend), b turning with a."""
    x = np.asarray(x, dtype=float)
    less = (bend - 1) * np.sin(x) * np.cos(x)
    return x + np.arctan2(less, np.cos(x) ** 2 + bend * np.sin(x) ** 2)


def series(case, order=2):
    """Values of the outputs of a case, shape (outputs, n)."""
    solver = NativeSolver(order=order)
    motion = solver.prepare(case.mechanism, case.sweep.path, list(case.points))(1e-12)
    return np.array([output_series(case, output, motion).position for output in case.outputs])


def angles(sweep, joint):
    output = Angle("angle", 1e-9, 0.0, "test", joint)
    mechanism = with_markers(shafts(), [output])
    return series(Case("shafts", "test", Truth.CONSENSUS_ONLY, mechanism, sweep, (output,)))[0]


@pytest.mark.parametrize(
    "values",
    [[0.0, 6 * math.pi], np.linspace(-10 * math.pi, 50 * math.pi, 7), [101.0, 60.0, -40.0], [60.0]],
    ids=str,
)
def test_angle_turns_between_distant_samples(values):
    turned = angles(Sweep("turn", np.array(values)), "b")
    assert turned == pytest.approx(driven(values), abs=1e-9)


@pytest.mark.parametrize("motion", [Sine(10.0, 1.0, math.pi / 2), Sine(-40.0, 0.3, 0.5)], ids=str)
def test_angle_turns_from_offset_start(motion):
    times = np.array([0.0, 0.1, 0.2])
    values = motion.at(times)[0]
    sweep = Sweep("time", times, motions={"turn": motion})
    assert angles(sweep, "a") == pytest.approx(values, abs=1e-9)
    assert angles(sweep, "b") == pytest.approx(driven(values), abs=1e-9)


def test_quick_turns_before_start_are_followed():
    """Between shafts almost at a right angle, the driven one turns half round in 0.1 rad."""
    bend, motion = 0.02, Sine(10.0, 1.0, math.pi / 2)
    path = Path({"turn": motion}, np.array([0.0, 0.01]))
    found = angle_with_turns(shafts(bend), path, "b")
    assert found == pytest.approx(driven(motion.at(path.times)[0], bend), abs=1e-6)


def test_torsion_spring_counts_turns():
    mechanism, values = shafts(), np.array([0.0, 20.0, 60.0])
    path = Path({"turn": Ramp(1.0)}, values)
    motion = solve(mechanism, "turn", values, bodies=["first", "second"])
    follow = follower(mechanism, path, motion.solved)
    found = forces_of(mechanism, path, motion, ["spring"], follow).elements["spring"]
    assert found == pytest.approx(-driven(values), abs=1e-9)


def test_short_steps_are_not_followed():
    mechanism = shafts()
    assert near_design(mechanism, Path({"turn": Ramp(1.0)}, np.linspace(0.0, 7.0, 36)))
    assert not near_design(mechanism, Path({"turn": Ramp(1.0)}, np.linspace(5.0, 7.0, 36)))
    times = np.linspace(0.0, 7.0, 36)
    assert not in_doubt(driven(times), np.gradient(driven(times), times), times)
    assert in_doubt(driven(times) + 2 * math.pi * (times > 3), np.ones(36), times)


def test_angle_at_fold_adds_no_turn():
    """A slider-crank driven by its slide, to the dead centre."""
    crank = Mechanism(
        "crank",
        [Body("crank"), Body("rod"), Body("slide")],
        [
            Revolute("pivot", "ground", "crank", ORIGIN, Z),
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
    assert found == pytest.approx(wanted, abs=1e-4)


def test_angles_share_one_followed_motion(monkeypatch):
    asked: list[int] = []

    def prepare(mechanism, request, path):
        asked.append(len(request.bodies))
        return prepare_one(mechanism, request, path)

    monkeypatch.setattr(followed, "prepare_motion", prepare)
    path = Path({"turn": Ramp(7.5)}, np.array([1.0]))
    first, second = (angle_with_turns(shafts(), path, joint) for joint in "ab")
    assert asked == [2]
    assert first == pytest.approx([7.5])
    assert second == pytest.approx(driven([7.5]))


RATIO = -2.5
AXES = np.array([[1.0, 2.0, 2.0], [2.0, -1.0, 2.0]]) / 3.0
OUTPUTS = [
    Orientation(f"{body} {component}", 1e-9, 0.0, "test", body, component)
    for body in ("disc", "arm", "ground")
    for component in Component
]
MECHANISM = with_markers(
    Mechanism(
        "tumbler",
        [Body("disc"), Body("arm")],
        [
            Revolute("hinge", "ground", "disc", X, tuple(AXES[0])),
            Revolute("elbow", "disc", "arm", (1.0, 1.0, 0.0), tuple(AXES[1])),
        ],
        [],
        [JointAngle("turn", "hinge"), JointAngle("bend", "elbow")],
    ),
    OUTPUTS,
)


def case(sweep):
    return Case("tumbler", "test", Truth.CONSENSUS_ONLY, MECHANISM, sweep, tuple(OUTPUTS))


def swept(values):
    return case(Sweep("turn", np.array(values, dtype=float), motions={"bend": Ramp(RATIO)}))


def half(axis, angle):
    return np.array([np.cos(0.5 * angle), *(axis[:, None] * np.sin(0.5 * angle))])


def tumbled(turn, bend):
    """The closed form: products of Euler parameters of half the angles, without a choice."""
    turn, bend = np.array(turn, dtype=float), np.array(bend, dtype=float)
    p, q = half(AXES[0], turn), half(AXES[1], bend)
    both = np.array(
        [
            p[0] * q[0] - (p[1:] * q[1:]).sum(axis=0),
            *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:], axis=0)),
        ]
    )
    rows = []
    for e in (p, both, half(AXES[0], 0.0 * turn)):
        size = np.sqrt((e[1:] ** 2).sum(axis=0))
        sign = np.where(e[0] < 0.0, -1.0, 1.0)
        vector = (
            2.0 * np.arctan2(size, sign * e[0]) * sign * e[1:] / np.where(size > 0.0, size, 1.0)
        )
        rows += [*vector, *e]
    return np.array(rows)


@pytest.mark.parametrize(
    "values",
    [
        [0.0, 4.0, 8.0],
        [-30.0, 4.0, -4.0, 8.0, 0.5],
        [4.0],
        [4.0, 4.2, 4.4, 4.6, 5.0],
        np.arange(0.3, 6.2, 0.1),
        [4.0, 4.0 + 3 * math.pi],
    ],
    ids=str,
)
@pytest.mark.parametrize("order", [0, 2])
def test_orientation_is_followed_from_design(values, order):
    wanted = tumbled(values, RATIO * np.array(values))
    assert series(swept(values), order) == pytest.approx(wanted, abs=1e-9)


QUARTER = np.array([0.0, 0.25])


@pytest.mark.parametrize(
    "sweep",
    [
        Sweep("turn", np.array([0.25, 0.5, 0.0])),
        Sweep("turn", np.array([0.5, 0.6, 5.0])),
        # the rates at both ends tell 12 of 15 radians
        Sweep("time", QUARTER, motions={"turn": Sine(0.48, 1.0, 0.0)}),
        # a short way of the driver from the design to the start
        Sweep("time", QUARTER, motions={"turn": Sine(0.2, 1.0, -math.pi / 2)}),
    ],
    ids=["back to design", "long last step", "half period", "short way to start"],
)
def test_orientation_of_fast_geared_wheel(sweep):
    """A wheel that turns 32 times as fast as its driver, by the samples alone and followed."""
    output = Orientation("wheel", 1e-9, 0.0, "test", "wheel", Component.E0)
    mechanism = Mechanism(
        "gear",
        [Body("slow"), Body("wheel")],
        [Revolute("drive", "ground", "slow", ORIGIN, Z), Revolute("spin", "ground", "wheel", X, Z)],
        [],
        [JointAngle("turn", "drive")],
        couplers=[Gear("mesh", ("drive", "spin"), 1.0 / 32.0)],
    )
    of = replace(case(sweep), mechanism=with_markers(mechanism, [output]), outputs=(output,))
    turned = sweep.motions["turn"].at(QUARTER)[0] if sweep.motions else sweep.values
    assert series(of)[0] == pytest.approx(np.cos(16.0 * turned), abs=1e-9)


def test_proved_orientations_follow_turns():
    prove_case = pytest.importorskip(
        "kincheck.core.extensions.proofs.verified_reference"
    ).prove_case
    pytest.importorskip("flint")
    values = [0.5, 4.0, 8.0]
    of = replace(swept(values), outputs=tuple(OUTPUTS[7:14]))
    reference, _ = prove_case(of, digits=12, numbers="double", tol=1e-12)
    proved = [reference.outputs[output.name].position for output in of.outputs]
    wanted = tumbled(values, RATIO * np.array(values))[7:14]
    assert np.array(proved, dtype=float) == pytest.approx(wanted, abs=1e-11)
