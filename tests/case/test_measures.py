"""Outputs of joints, bodies and pairs of points, against closed forms and in every engine."""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck import Point, Ramp, Sine
from kincheck.adapters.native import Native
from kincheck.core.case.case import Sweep
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.measures import (
    Angle,
    Component,
    Distance,
    JointAngle,
    JointDisplacement,
    Orientation,
)
from kincheck.core.case.quantity import with_markers
from kincheck.core.harness.compare import output_series
from kincheck.core.harness.run import run
from scipy.spatial.transform import Rotation

from ..support.case_texts import BASE, complains, edited, write
from ..support.examples import examples
from ..support.measure_cases import AXIS, RATE, arm
from ..support.written_again import written_again

WRONG, MEASURES = examples(__file__, "wrong", "measures")

TOLERANCE = (1e-9, 0.0, "test")


def series(case, *outputs):
    case = replace(case, mechanism=with_markers(case.mechanism, outputs), outputs=outputs)
    engine = Native()
    trajectory = engine.solve(engine.build(case), case, 1e-12)
    first, *others = (output_series(case, output, trajectory) for output in outputs)
    return [first, *others] if others else first


def close(found, position, velocity, acceleration, atol=1e-13):
    np.testing.assert_allclose(found.position, position, rtol=0, atol=atol)
    np.testing.assert_allclose(found.velocity, velocity, rtol=0, atol=atol)
    np.testing.assert_allclose(found.acceleration, acceleration, rtol=0, atol=10 * atol)


TURNS = np.linspace(-4.0 * math.pi, 4.0 * math.pi, 33)
"""Of the driver: eight samples a turn, and the slide turns by 135 degrees the other way."""
HINGE, BORE = (JointAngle(joint, *TOLERANCE, joint) for joint in ("hinge", "bore"))


@pytest.mark.parametrize(
    "values",
    [TURNS, np.random.default_rng(1).permutation(TURNS), np.arange(-4, 5) * math.pi + 0.3],
    ids=["in order", "unordered", "coarse, without the design"],
)
def test_joint_angle_counts_turns(values):
    """By velocities where a turn and a half goes from sample to sample."""
    driven, spun = series(arm(values), HINGE, BORE)
    close(driven, values, RATE, 0.0)
    close(spun, -3.0 * values, -3.0 * RATE, 0.0)


def test_joint_angle_of_offset_start():
    """Its driver is a sine with a phase: at time zero it is not at the design."""
    turn, times = Sine(4.0, 1.0, 0.5), np.linspace(0.0, 0.1, 9)
    motions = {"turn": turn, "spin": Ramp(0.0), "push": Ramp(0.0)}
    found = series(arm([0.0], sweep=Sweep("time", times, 1.0, 0.0, motions)), HINGE)
    np.testing.assert_allclose(found.position, turn.at(times)[0], atol=1e-12)


def test_joint_displacement_along_axis():
    found = series(arm(TURNS), JointDisplacement("d", *TOLERANCE, "bore"))
    close(found, 0.25 * TURNS / RATE, 0.25, 0.0)


def test_joint_angle_of_reversed_joint():
    case = arm(TURNS)
    hinge, *others = case.mechanism.joints
    mechanism = replace(case.mechanism, joints=[hinge.reversed(), *others])
    found = series(replace(case, mechanism=mechanism), HINGE)
    close(found, TURNS, RATE, 0.0)  # of the driver of the joint, which is reversed too


def rotated(angle, component):
    """Return a component of the rotation, with its first and second derivative by the angle."""
    n = np.array(AXIS) / 3.0
    cos, sin = np.cos(angle / 2.0), np.sin(angle / 2.0)
    if component in ("x", "y", "z"):  # half a turn has the direction of the Euler parameters
        sign = np.where(cos < -1e-9, -1.0, 1.0)
        along = n["xyz".index(component)]
        return along * 2.0 * np.arctan2(sign * sin, sign * cos), along, 0.0
    e = [cos, *(each * sin for each in n)][int(component[1])]
    rate = [-0.5 * sin, *(0.5 * each * cos for each in n)][int(component[1])]
    return e, rate, -0.25 * e


@pytest.mark.parametrize("component", Component)
def test_orientation_components_over_turns(component):
    """Through half turns, whole ones, and the design, where the axis of a rotation is unknown."""
    angle = np.linspace(-3.0 * math.pi, 4.0 * math.pi, 71)
    found = series(arm(angle), Orientation("o", *TOLERANCE, "disc", component))
    position, rate, second = rotated(angle, component)
    close(found, position, RATE * rate, RATE**2 * second, atol=1e-12)
    assert np.abs(found.position).max() <= math.pi


@pytest.mark.parametrize("beyond", [-1e-6, -1e-12, 0.0, 1e-12, 1e-6])
def test_rotation_vector_at_half_turn(beyond):
    """Beyond the tolerance, the smaller rotation is the one the other way round."""
    found = series(arm([math.pi + beyond]), Orientation("o", 1e-9, 0.0, "t", "disc", Component.Z))
    wanted = beyond - math.pi if beyond > 1e-9 else math.pi + beyond
    assert found.position == pytest.approx([AXIS[2] / 3.0 * wanted], abs=1e-12)


@pytest.mark.parametrize("away", [1e-9, 1e-5, 0.0316, 0.0633, 0.0634, 1.0])
def test_rotation_vector_near_design(away):
    found = series(arm([away]), Orientation("o", *TOLERANCE, "disc", Component.Z))
    close(found, AXIS[2] / 3.0 * away, AXIS[2] / 3.0 * RATE, 0.0, atol=1e-13)


def test_rates_of_vanishing_lengths():
    """Directions that become opposite or parallel, points that meet: what is left is round-off."""
    case = arm([math.pi, 2.0 * math.pi, math.pi + 1e-8, 1.0])
    meeting = [Point("A", "ground", (1.0, 1.0, 0.0)), *case.mechanism.points[1:]]
    case = replace(case, mechanism=replace(case.mechanism, points=meeting))
    normal = ((0.0, 1.0, -1.0), (0.0, 2.0, -2.0))
    width, apart = series(
        case,
        Angle("w", *TOLERANCE, ("ground", "disc"), normal),
        Distance("l", *TOLERANCE, ("A", "B")),
    )
    np.testing.assert_allclose(width.position, [math.pi, 0.0, math.pi - 1e-8, 1.0], atol=1e-12)
    for rates in (width.velocity, width.acceleration):
        assert np.isnan(rates).tolist() == [True, True, True, False]
    assert np.isnan(apart.velocity).tolist() == [False, True, False, False]


def test_distance_and_angle_measures():
    angle = np.linspace(0.2, 3.0, 15)
    start, place = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])
    turn = Rotation.from_rotvec(np.outer(angle, AXIS) / 3.0)
    B = place + turn.apply(start)
    length, change, opened = series(
        arm(angle),
        Distance("l", *TOLERANCE, ("A", "B")),
        Distance("c", *TOLERANCE, ("A", "B"), relative=True),
        Angle("w", *TOLERANCE, ("ground", "disc"), ((0.0, 3.0, 0.0), (0.0, 1.0, 0.0))),
    )
    expected = np.linalg.norm(B, axis=1)
    np.testing.assert_allclose(length.position, expected, atol=1e-14)
    np.testing.assert_allclose(change.position, expected - math.sqrt(2.0), atol=1e-14)
    np.testing.assert_allclose(opened.position, np.arccos((B - place) @ start), atol=1e-12)
    for each in (length, opened):  # the rates are those of the values
        for values, rates, atol in (
            (each.position, each.velocity, 0.03),
            (each.velocity, each.acceleration, 0.1),
        ):
            slopes = np.gradient(values, angle / RATE)
            np.testing.assert_allclose(rates[2:-2], slopes[2:-2], atol=atol)


def test_measure_without_points():
    case = arm([0.1])
    case = replace(case, mechanism=replace(case.mechanism, points=[]))
    close(series(case, HINGE), 0.1, RATE, 0.0)


OUTPUT = (
    '[outputs.tip_x]\npoint = "tip"\ncomponent = "x"\natol = 1e-9\nwhy = "made up for this test"\n'
)


MM = BASE.replace(OUTPUT, '[units]\nlength = "mm"\nangle = "deg"\n')


def test_measures_in_case_file(tmp_path):
    case = load_case(write(tmp_path, MM + MEASURES))
    written_again(case, tmp_path)
    length, stroke, turn, e2, wide = case.outputs
    assert length == Distance("length", length.atol, 1e-9, length.why, ("home", "tip"), True)
    assert stroke == JointDisplacement("stroke", 5e-4, 0.0, "test", "guide")
    assert turn.atol == math.radians(2.0)
    assert (turn.unit, e2.unit, wide.unit) == ("rad", "1", "rad")
    assert wide.directions == ((1.0, 0.0, 0.0), (0.0, 0.5, 0.0))
    results = run([case], [Native()], tol=1e-12)
    outputs = results.records[0].outputs
    assert outputs["stroke"].position == pytest.approx([-1e-4, 0.0, 1e-4], abs=1e-15)
    assert outputs["open"].position == pytest.approx([math.pi / 2.0] * 3)
    assert outputs["e2"].position == [0.0, 0.0, 0.0]
    middle = 2e-3 * 1.5 / math.hypot(1.5, 2, 3)
    assert outputs["length"].velocity[1] == pytest.approx(middle, rel=1e-9)


FREE = ('"joint_displacement"\njoint = "guide"\natol', '"joint_angle"\njoint = "guide"\natol')
NOBODY = ('body = "slider"\ncomponent = "e2"', 'body = "bed"\ncomponent = "e2"')
FEW = ("[[1, 0, 0], [0, 0.5, 0]]", "[[1, 0, 0]]")


@pytest.mark.parametrize(("change", "fragments"), WRONG, ids=str)
def test_wrong_measure_is_refused(tmp_path, change, fragments):
    complains(write(tmp_path, edited(change, base=MM + MEASURES)), fragments)
