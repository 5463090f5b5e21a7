"""The same mechanism written differently, or of another size, in another place, at another rate:
the same motion.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from kincheck import (
    Body,
    Joint,
    Mechanism,
    ParallelAxes,
    Point,
    PointCoordinate,
    Revolute,
    Screw,
    Translational,
    cases,
    solve,
)
from kincheck.core.joints import AxialJoint
from kincheck.core.joints.base import position
from kincheck.core.kinematics import places
from kincheck.core.kinematics.formulation.constraints import frames

from ..support.mechanisms import (
    ORIGIN,
    Y,
    Z,
    mcpherson,
    placed,
    slider_crank,
    swapped,
    without_fixed_bodies,
)

TURNS = 2.0 * np.pi * np.linspace(-1.0, 1.0, 31)
STROKES = np.linspace(-0.08, 0.08, 33)


STRUT = mcpherson()


def wheel(mechanism=STRUT, values=STROKES, **options):
    """Position, velocity and acceleration, shape (3, n, 3)."""
    found = solve(mechanism, "stroke", values, **options)
    assert found.solved.all(), found.message
    motion = found.points["wheel"]
    return np.array([motion.position, motion.velocity, motion.acceleration])


def assert_same(found, expected, limits=(2e-16, 2e-15, 5e-14)):
    """Two motions that differ by round-off: numbers near one, amplified by the condition (36)."""
    assert (np.abs(found - expected).max(axis=(1, 2)) <= limits).all()


@pytest.mark.parametrize("rate", [0.25, -2.0, 1e3])
def test_rate_scales_derivatives(rate):
    assert_same(wheel(rate=rate) / rate ** np.arange(3.0)[:, None, None], wheel())
    once, scaled = (solve(STRUT, "stroke", STROKES, rate=x).iterations for x in (1.0, rate))
    # predicted as well; a negative rate starts at the other side
    assert sorted(once) == sorted(scaled)


def exchanged(*numbers):
    joints = [x.reversed() if k in numbers else x for k, x in enumerate(STRUT.joints)]
    return replace(STRUT, joints=joints)


def shuffled(seed):
    rng = np.random.default_rng(seed)
    bodies, joints = (
        [each[k] for k in rng.permutation(5)] for each in (STRUT.bodies, STRUT.joints)
    )
    return replace(STRUT, bodies=bodies, joints=joints)


DRAWN = PointCoordinate("stroke", "wheel", (0.0, 0.0, 4.0))
WRITTEN = {
    **{f"joint {k} reversed": exchanged(k) for k in range(5)},
    "all joints reversed": exchanged(*range(5)),
    **{f"order {seed}": shuffled(seed) for seed in range(3)},
    "long axes": placed(STRUT, tuple, lambda axis: tuple(137.0 * np.array(axis))),
    "ground for fixed bodies": without_fixed_bodies(STRUT),
    "long direction": replace(STRUT, drivers=[DRAWN]),
}


@pytest.mark.parametrize("way", WRITTEN)
def test_motion_invariant_to_description(way):
    exact = way in ("ground for fixed bodies", "long direction")
    assert_same(wheel(WRITTEN[way]), wheel(), *[[0.0] * 3] * exact)


def test_reversed_driven_joint_changes_sign():
    forward, back = (
        solve(m, "turn", a).points["pin"]
        for m, a in ((slider_crank(), TURNS), (swapped(slider_crank()), -TURNS))
    )
    assert np.abs(back.position - forward.position).max() <= 1e-15
    assert np.abs(back.velocity + forward.velocity).max() <= 1e-15


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
        a, b = once.points[point], twice.points[point]
        # some round-offs of numbers near one, amplified by conditions of up to 40
        assert np.abs(b.position - a.position).max() <= 5e-15
        scale = 1.0 + np.abs(a.acceleration).max()
        assert np.abs(b.acceleration - a.acceleration).max() <= 5e-14 * scale


# Scaling and turning round every hardpoint once, which moves the result by the condition times
# 1e-16.
ROUNDED = 3e-15, 5e-15, 5e-14


@pytest.mark.parametrize("factor", [1e-6, 1e-3, 7.0, 1e3])
def test_motion_scales_with_size(factor):
    """All lengths, the stroke and the rate scaled: everything scales, to the same relative
    accuracy.
    """
    small = placed(STRUT, lambda point: tuple(factor * np.array(point)), factor=factor)
    assert_same(wheel(small, factor * STROKES, rate=factor) / factor, wheel(), ROUNDED)


@pytest.mark.parametrize("offset", [(1e6, 0.0, 0.0), (-1e6, 1e6, 2e6)], ids=str)
def test_motion_invariant_to_distant_place(offset):
    """A thousand kilometres away: only the sum with the position rounds, at 1e-10 m; the motion
    keeps all its digits. Hardpoints are rounded to 2^-30 m, so that their sums are exact.
    """
    here = placed(STRUT, lambda point: tuple(np.round(np.array(point) * 2.0**30) / 2.0**30))
    away = placed(here, lambda point: tuple(np.add(point, offset)))
    found = wheel(away)
    found[0] -= offset
    assert_same(found, wheel(here), (2.4e-10, 0.0, 0.0))


def test_motion_invariant_to_orientation():
    """The strut turned in space, and the direction of its driver with it."""
    turn = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)

    def turned(point):
        return tuple(turn @ point)

    m = placed(STRUT, turned, turned)
    m = replace(m, drivers=[PointCoordinate("stroke", "wheel", turned(Z))])
    assert_same(wheel(m) @ turn, wheel(), ROUNDED)


@pytest.mark.parametrize("size", [1e-9, 1e-6, 1e-3, 1.0, 1e3])
@pytest.mark.parametrize(
    "joint",
    [Revolute("r", "ground", "a", ORIGIN, Z), ParallelAxes("r", "ground", "a", Z)],
    ids=["revolute", "parallel axes"],
)
def test_length_unit_of_single_joint(size, joint):
    """A single pivot, or axes that are nowhere: measured in metres, a point a micrometre away would
    be no way away.
    """
    free = () if isinstance(joint, Revolute) else np.eye(3).tolist()
    mechanism = Mechanism(
        "pivot",
        [Body("a")],
        [joint],
        [Point("P", "a", (size, 0.0, 0.0)), Point("O", "a", ORIGIN)],
        [
            PointCoordinate("y", "P", Y),
            *(PointCoordinate(f"at {k}", "O", tuple(axis)) for k, axis in enumerate(free)),
        ],
    )
    sine = np.linspace(-0.9, 0.9, 7)
    found = solve(mechanism, "y", sine * size, rate=size)
    assert found.solved.all(), found.message
    cosine, motion = np.sqrt(1.0 - sine**2), found.points["P"]
    x = motion.position[:, 0], motion.velocity[:, 0], motion.acceleration[:, 0]
    closed = cosine, -sine / cosine, -1.0 / cosine**3
    for one, expected, off in zip(x, closed, (2e-15, 2e-14, 1e-12), strict=True):
        assert one / size == pytest.approx(expected, abs=off)


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
    corners = [(x * size, y * size, 0.0) for x, y in ((0, 0), (0, 1), (3, 2), (2, 0))]
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
