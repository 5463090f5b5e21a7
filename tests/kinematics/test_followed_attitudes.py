"""Orientations with their turns, of sweeps whose samples are far apart or far from the design."""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck import adapters
from kincheck.core.case.case import Case, Sweep, Truth
from kincheck.core.case.measures import Component, Orientation
from kincheck.core.case.quantity import with_markers
from kincheck.core.harness.compare import output_series
from kincheck.core.harness.record import Outcome
from kincheck.core.harness.run import run
from kincheck.core.joints import Gear, Revolute
from kincheck.core.kinematics import NativeSolver
from kincheck.core.mechanism.mechanism import Body, Mechanism
from kincheck.core.mechanism.motions import JointAngle, Ramp, Sine
from kincheck.core.studies.verified_reference import prove_case

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
            Revolute("hinge", "ground", "disc", (1.0, 0.0, 0.0), tuple(AXES[0])),
            Revolute("elbow", "disc", "arm", (1.0, 1.0, 0.0), tuple(AXES[1])),
        ],
        [],
        [JointAngle("turn", "hinge"), JointAngle("bend", "elbow")],
    ),
    OUTPUTS,
)


def case(sweep: Sweep) -> Case:
    return Case("tumbler", "test", Truth.CONSENSUS_ONLY, MECHANISM, sweep, tuple(OUTPUTS))


def swept(values) -> Case:
    return case(Sweep("turn", np.array(values, dtype=float), motions={"bend": Ramp(RATIO)}))


def found(of: Case, order: int = 2):
    solver = NativeSolver(order=order)
    motion = solver.prepare(of.mechanism, of.sweep.path, list(of.points))(1e-12)
    return np.array([output_series(of, output, motion).position for output in of.outputs])


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
)
@pytest.mark.parametrize("order", [0, 2])
def test_orientation_is_followed_from_design(values, order):
    wanted = tumbled(values, RATIO * np.array(values))
    assert found(swept(values), order) == pytest.approx(wanted, abs=1e-9)


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
)
def test_orientation_of_fast_geared_wheel(sweep):
    """A wheel that turns 32 times as fast as its driver, by the samples alone and followed."""
    output = Orientation("wheel", 1e-9, 0.0, "test", "wheel", Component.E0)
    mechanism = Mechanism(
        "gear",
        [Body("slow"), Body("wheel")],
        [
            Revolute("drive", "ground", "slow", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
            Revolute("spin", "ground", "wheel", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        ],
        [],
        [JointAngle("turn", "drive")],
        couplers=[Gear("mesh", ("drive", "spin"), 1.0 / 32.0)],
    )
    of = replace(case(sweep), mechanism=with_markers(mechanism, [output]), outputs=(output,))
    turned = sweep.motions["turn"].at(QUARTER)[0] if sweep.motions else sweep.values
    assert found(of)[0] == pytest.approx(np.cos(16.0 * turned), abs=1e-9)


@pytest.mark.parametrize("start", [4.0, -7.0, 11.0])
def test_orientation_from_offset_start(start):
    """The drivers go straight from the design to the start."""
    motions = {"turn": Sine(start, 1.0, math.pi / 2), "bend": Sine(-start, 0.5, math.pi / 2)}
    times = np.array([0.0, 0.1, 0.2])
    turn, bend = (motion.at(times)[0] for motion in motions.values())
    of = case(Sweep("time", times, motions=motions))
    assert found(of) == pytest.approx(tumbled(turn, bend), abs=1e-9)


@pytest.mark.parametrize("name", [name for name in adapters.ENGINES if name != "native"])
@pytest.mark.parametrize("steps", [3, 4, 8, 25])
def test_orientations_agree_in_all_engines(steps, name):
    """Half and whole turns are among the samples."""
    tested = adapters.engine(name)
    if tested.version() is None:
        pytest.skip(f"{name} is not installed")
    of = swept(np.linspace(-3.0 * math.pi, 4.0 * math.pi, steps))
    native, other = run([of], [adapters.engine("native"), tested], tol=1e-12).records
    assert other.outcome is Outcome.PASS, other.message
    for output in of.outputs:
        vector = np.array(native.outputs[output.name].position)
        assert np.abs(vector).max() <= math.pi + 1e-9


def test_proved_orientations_follow_turns():
    pytest.importorskip("flint")
    values = [0.5, 4.0, 8.0]
    of = replace(swept(values), outputs=tuple(OUTPUTS[7:14]))
    reference, _ = prove_case(of, digits=12, numbers="double", tol=1e-12)
    proved = [reference.outputs[output.name].position for output in of.outputs]
    wanted = tumbled(values, RATIO * np.array(values))[7:14]
    assert np.array(proved, dtype=float) == pytest.approx(wanted, abs=1e-11)
