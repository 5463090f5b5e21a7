"""The same mechanism written differently, or of another size, in another place, at another rate:
the same motion.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from kincheck import cases
from kincheck.core import Body, Mechanism, Point, PointCoordinate, Revolute, Translational
from kincheck.core.joints import AxialJoint, Joint, ParallelAxes, Screw
from kincheck.core.joints.base import position
from kincheck.core.kinematics.formulation.constraints import frames
from kincheck.core.kinematics.formulation.parameters import places
from kincheck.core.kinematics.one_design import solve

from ..support.mechanisms import (
    ORIGIN,
    Z,
    mcpherson,
    placed,
    slider_crank,
    swapped,
    without_fixed_bodies,
)

TURNS = 2.0 * np.pi * np.linspace(-1.0, 1.0, 31)
STROKES = np.linspace(-0.08, 0.08, 33)


def wheel(mechanism=None, values=STROKES, **options):
    found = solve(mechanism or mcpherson(), "stroke", values, **options)
    assert found.solved.all(), found.message
    return found.points["wheel"]


def assert_same(found, expected, position=2e-16, velocity=2e-15, acceleration=2e-14):
    """Two motions of a point that differ by round-off: numbers near one, amplified by the condition
    (36).
    """
    assert np.abs(found.position - expected.position).max() <= position
    assert np.abs(found.velocity - expected.velocity).max() <= velocity
    assert np.abs(found.acceleration - expected.acceleration).max() <= acceleration


@pytest.mark.parametrize("rate", [0.25, -2.0, 1e3])
def test_rate_scales_derivatives(rate):
    expected, found = wheel(), wheel(rate=rate)
    once, scaled = (
        solve(mcpherson(), "stroke", STROKES, rate=each).iterations for each in (1.0, rate)
    )
    # predicted as well; a negative rate starts at the other side
    assert sorted(once) == sorted(scaled)
    assert np.abs(found.position - expected.position).max() <= 2e-16
    assert found.velocity == pytest.approx(
        rate * expected.velocity, rel=1e-13, abs=1e-15 * abs(rate)
    )
    assert found.acceleration == pytest.approx(
        rate**2 * expected.acceleration, rel=1e-13, abs=1e-14 * rate**2
    )


@pytest.mark.parametrize("number", range(6))
def test_motion_invariant_to_joint_reversal(number):
    """Each joint exchanged by itself, and all of them."""
    m = mcpherson()
    exchanged = [
        joint.reversed() if number in (k, 5) else joint for k, joint in enumerate(m.joints)
    ]
    assert_same(wheel(replace(m, joints=exchanged)), wheel())


def test_reversed_driven_joint_changes_sign():
    forward, back = (
        solve(m, "turn", a) for m, a in ((slider_crank(), TURNS), (swapped(slider_crank()), -TURNS))
    )
    assert np.abs(back.points["pin"].position - forward.points["pin"].position).max() <= 1e-15
    assert np.abs(back.points["pin"].velocity + forward.points["pin"].velocity).max() <= 1e-15


@pytest.mark.parametrize("seed", range(3))
def test_motion_invariant_to_member_order(seed):
    rng, m = np.random.default_rng(seed), mcpherson()
    bodies, joints = (
        [m.bodies[k] for k in rng.permutation(5)],
        [m.joints[k] for k in rng.permutation(5)],
    )
    assert_same(wheel(replace(m, bodies=bodies, joints=joints)), wheel(), acceleration=5e-14)


@pytest.mark.parametrize(
    "name",
    ["andrews_squeezer", "bricard", "four_bar", "mcpherson_strut", "planar_slider_crank", "rssr"],
)
def test_motion_invariant_to_duplicate_joints(name):
    """Some again, hinges and slides elsewhere on their axes, all in another order: which rows are
    left out does not matter.
    """
    case, rng = cases.load(name), np.random.default_rng(0)
    m, found = case.mechanism, list[Joint](case.mechanism.joints)
    for k in rng.permutation(len(found))[:3]:
        joint = m.joints[k].changed(name=f"{m.joints[k].name} again")
        if isinstance(joint, AxialJoint):
            along = rng.uniform(-0.2, 0.2) * np.array(joint.axis) / np.linalg.norm(joint.axis)
            joint = joint.changed(point=tuple(np.add(joint.point, along).tolist()))
        found.append(joint.reversed() if joint.symmetric and rng.random() < 0.5 else joint)
    doubled = replace(m, joints=[found[k] for k in rng.permutation(len(found))])
    once, twice = (
        solve(each, case.sweep.driver, case.sweep.change[::9], points=case.points)
        for each in (m, doubled)
    )
    assert twice.solved.all()
    for point in case.points:
        # some round-offs of numbers near one, amplified by conditions of up to 40
        assert np.abs(twice.points[point].position - once.points[point].position).max() <= 5e-15
        scale = 1.0 + np.abs(once.points[point].acceleration).max()
        assert (
            np.abs(twice.points[point].acceleration - once.points[point].acceleration).max()
            <= 5e-14 * scale
        )


def test_motion_invariant_to_fixed_bodies():
    assert_same(wheel(without_fixed_bodies(mcpherson())), wheel(), 0.0, 0.0, 0.0)


@pytest.mark.parametrize("factor", [1e-6, 1e-3, 7.0, 1e3])
def test_motion_scales_with_size(factor):
    """All lengths, the stroke and the rate scaled: everything scales, to the same relative
    accuracy.
    """
    small = placed(mcpherson(), lambda point: tuple(factor * np.array(point)), factor=factor)
    found, expected = wheel(small, factor * STROKES, rate=factor), wheel()
    # scaling rounds every hardpoint once, which moves the result by the condition times 1e-16
    assert found.position / factor == pytest.approx(expected.position, abs=3e-15)
    assert found.velocity / factor == pytest.approx(expected.velocity, abs=3e-15)
    assert found.acceleration / factor == pytest.approx(expected.acceleration, abs=5e-14)


def snapped(point):
    """Rounded to 2^-30 m, so that whole numbers of metres up to 2^22 can be added without
    rounding.
    """
    return tuple(np.round(np.array(point) * 2.0**30) / 2.0**30)


@pytest.mark.parametrize("offset", [(1e6, 0.0, 0.0), (-1e6, 1e6, 2e6)])
def test_motion_invariant_to_distant_place(offset):
    """A thousand kilometres away: only the sum with the position rounds, at 1e-10 m; the motion
    keeps all its digits.
    """
    here = placed(mcpherson(), snapped)
    away = placed(here, lambda point: tuple(np.add(point, offset)))
    found, expected = wheel(away), wheel(here)
    assert np.abs(found.position - (expected.position + offset)).max() <= 2.4e-10
    assert (found.velocity == expected.velocity).all()
    assert (found.acceleration == expected.acceleration).all()


def test_motion_invariant_to_orientation():
    """The strut turned in space, and the direction of its driver with it."""
    turn = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)

    def turned(point):
        return tuple(turn @ point)

    m = placed(mcpherson(), turned, turned)
    m = replace(m, drivers=[PointCoordinate("stroke", "wheel", turned(Z))])
    found, expected = wheel(m), wheel()
    # turning rounds every hardpoint, as scaling does
    assert found.position @ turn == pytest.approx(expected.position, abs=3e-15)
    assert found.velocity @ turn == pytest.approx(expected.velocity, abs=5e-15)
    assert found.acceleration @ turn == pytest.approx(expected.acceleration, abs=5e-14)


def test_motion_invariant_to_axis_length():
    m = mcpherson()
    long = placed(m, tuple, lambda axis: tuple(137.0 * np.array(axis)))
    assert_same(wheel(long), wheel())
    drawn = replace(m, drivers=[PointCoordinate("stroke", "wheel", (0.0, 0.0, 4.0))])
    assert_same(wheel(drawn), wheel(), 0.0, 0.0, 0.0)


@pytest.mark.parametrize("size", [1e-9, 1e-6, 1e-3, 1.0, 1e3])
@pytest.mark.parametrize(
    "joint",
    [
        Revolute("r", "ground", "a", ORIGIN, Z),
        ParallelAxes("r", "ground", "a", Z),
    ],
)
def test_length_unit_of_single_joint(size, joint):
    """A single pivot, or axes that are nowhere: measured in metres, a point a micrometre away would
    be no way away.
    """
    across, along = (size, 0.0, 0.0), (0.0, 1.0, 0.0)
    free = (
        []
        if isinstance(joint, Revolute)
        else [(f"at {k}", tuple(map(float, np.eye(3)[k]))) for k in range(3)]
    )
    mechanism = Mechanism(
        "pivot",
        [Body("a")],
        [joint],
        [Point("P", "a", across), Point("O", "a", ORIGIN)],
        [
            PointCoordinate("y", "P", along),
            *(PointCoordinate(name, "O", direction) for name, direction in free),
        ],
    )
    sine = np.linspace(-0.9, 0.9, 7)
    found = solve(mechanism, "y", sine * size, rate=size)
    assert found.solved.all(), found.message
    cosine, motion = np.sqrt(1.0 - sine**2), found.points["P"]
    np.testing.assert_allclose(motion.position[:, 0], size * cosine, rtol=2e-15)
    np.testing.assert_allclose(
        motion.velocity[:, 0], -size * sine / cosine, rtol=0, atol=2e-14 * size
    )
    np.testing.assert_allclose(motion.acceleration[:, 0], -size / cosine**3, rtol=1e-13)


def test_length_unit_reads_position_fields():
    """Whatever a joint calls them, they are what the mechanism is measured by: a metre would be a
    million times its size.
    """

    @dataclass(frozen=True, kw_only=True)
    class Pinned(Revolute):
        point: None = None
        pin: tuple[float, float, float] = position()

        def primitives(self, i, j):
            return Revolute(self.name, self.i, self.j, self.pin, self.axis).primitives(i, j)

    size = 2.0**-20
    corners = [
        ORIGIN,
        (0.0, size, 0.0),
        (3.0 * size, 2.0 * size, 0.0),
        (2.0 * size, 0.0, 0.0),
    ]
    links = ["ground", "crank", "coupler", "rocker", "ground"]
    pins = [
        Pinned(f"pin {k}", *links[k : k + 2], axis=Z, pin=corner)
        for k, corner in enumerate(corners)
    ]
    mechanism = Mechanism("four-bar", [Body(name) for name in links[1:4]], pins)
    assert frames(mechanism).unit == 4.0 * size  # three wide, to a power of two
    assert [joint.points_on("coupler") for joint in pins] == [[each] for each in corners]
    assert places(mechanism)["joints.pin 2.pin"] == corners[2]


def test_step_of_many_turns_message():
    """A fine thread: its smallest singular value is small all along, and nothing is wrong with any
    pose.
    """
    axis, lead = Z, 0.05
    mechanism = Mechanism(
        "jack",
        [Body("spindle"), Body("nut")],
        [
            Revolute("bearing", "ground", "spindle", ORIGIN, axis),
            Screw("thread", "spindle", "nut", ORIGIN, axis, lead=lead),
            Translational("guide", "ground", "nut", (4.0, 0.0, 0.0), axis),
        ],
        [Point("top", "nut", (4.0, 0.0, 0.0))],
        [PointCoordinate("height", "top", axis)],
    )
    assert solve(mechanism, "height", [0.0, 60.0 * lead]).solved.all()
    found = solve(mechanism, "height", [0.0, lead, 3000.0 * lead])
    assert found.solved.tolist() == [True, True, False]
    assert (
        "parts of the step were taken, and the next sample was not reached; give samples in between"
        in found.message
    )
    # and names no row that depends on others
    assert found.message.endswith("shorten the sweep or drive another coordinate")
