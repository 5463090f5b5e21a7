"""Which zeros of a primitive are meant, and whether Newton's iteration finds them (formulation
sections 3 and 4).
"""

import numpy as np
import pytest
from kincheck import (
    Body,
    ConstantVelocity,
    Gear,
    JointAngle,
    Mechanism,
    Point,
    Ramp,
    Revolute,
    solve,
)
from kincheck.core import primitives as p
from kincheck.core.algebra import ZERO, Vec3, X, Y, Z
from kincheck.core.primitives import GROUND_POSE, Drive, Pose

from ..oracles import naive
from ..support.mechanisms import ORIGIN, solve_all
from ..support.specimens import LANES, MAKERS, SPURIOUS, admissible, body, make, rotation


@pytest.fixture
def rng():
    return np.random.default_rng(943745)


@pytest.mark.parametrize("turn", SPURIOUS, ids=["x", "y", "z", "+++", "+--", "-+-", "--+"])
def test_dot12_has_no_spurious_zeros(turn):
    """(17) vanishes at seven wrong rotations, of 180 and 120 degrees; the Euler parameters do not
    (formulation section 3).
    """
    at = naive.Body(np.zeros(3), np.array([*turn]))
    wrong = min(
        np.abs(naive.dot12(naive.GROUND, other, np.eye(3), np.eye(3))).max()
        for other in (at, transposed(at))
    )
    assert wrong <= 1e-15
    assert np.linalg.norm(p.Dot12().phi(GROUND_POSE, Pose.of(ZERO, turn))) > 1.7


def transposed(body):
    return naive.Body(body.r, body.p * [1.0, -1.0, -1.0, -1.0])


def test_branch_of_dot11(rng):
    """h_j = -h_i solves (13) too; the branch test is the cosine and names it."""
    f, g, h = X, Y, Z
    dot11 = p.Dot11(f, g, h)
    for angle in (0.0, 0.4, 1.5, 1.6, np.pi):
        overturned = Pose.of(ZERO, rotation(f, angle))
        (branch,) = dot11.branch(GROUND_POSE, overturned)
        assert branch == pytest.approx(np.cos(angle), abs=1e-15)
    assert np.abs(dot11.phi(GROUND_POSE, overturned)).max() < 1e-15
    assert branch < 0.0
    specimen = make(p.Dot11, rng)
    i, j = admissible(specimen, rng)
    assert np.abs(specimen.primitive.branch(i.pose, j.pose)[0] - 1.0).max() < 1e-14


def test_branch_of_constant_velocity():
    """A half turn about an axis near the shaft has no twist either; bent to 175 degrees the branch
    is still the intended one.
    """
    shafts = p.ConstantVelocity(X, Y, X, Y)
    bends = [
        rotation(axis, angle)
        for axis in (X, Y, Vec3(0.6, 0.8, 0.0))
        for angle in (0.0, 1.5, -1.5, 2.2, 3.05)
    ]
    half_turns = [
        rotation(axis, np.pi) for axis in (Z, Vec3(0.6, 0.0, 0.8), Vec3(0.0, -0.96, 0.28))
    ]
    for turn in (*bends, *half_turns):
        over = Pose.of(ZERO, turn)
        assert abs(shafts.phi(GROUND_POSE, over)[0]) < 1e-15
        assert (shafts.branch(GROUND_POSE, over)[0] > 0.0) == (turn in bends)


def test_constant_velocity_shaft_bends_to_fold():
    """Two shafts of one speed, the second on a carrier that is turned from straight to 175 degrees:
    their turns stay the same.
    """
    joints = [
        Revolute("spin", "ground", "first", ORIGIN, (0.0, 0.0, 1.0)),
        Revolute("bend", "ground", "carrier", ORIGIN, (1.0, 0.0, 0.0)),
        Revolute("bearing", "carrier", "second", ORIGIN, (0.0, 0.0, 1.0)),
        ConstantVelocity("cv", "first", "second", ORIGIN, ((0.0, 0.0, 1.0), (0.0, 0.0, 1.0))),
    ]
    bodies = [Body(name) for name in ("first", "carrier", "second")]
    drivers = [JointAngle("turn", "spin"), JointAngle("fold", "bend")]
    mechanism = Mechanism(
        "shafts", bodies, joints, [Point("rim", "second", (1.0, 0.0, 0.0))], drivers
    )
    fold = np.radians(np.linspace(0.0, 175.0, 36))
    found = solve_all(mechanism, "fold", fold, motions={"turn": Ramp(0.7)})
    s, c = np.sin(0.7 * fold), np.cos(0.7 * fold)
    expected = np.column_stack([c, s * np.cos(fold), s * np.sin(fold)])
    assert np.abs(found.points["rim"].position - expected).max() <= 1e-12


def test_primitives_with_branch_test(rng):
    i, j = body(rng), body(rng)
    assert [kind for kind in MAKERS if make(kind, rng).primitive.branch(i.pose, j.pose)] == [
        p.ConstantVelocity,
        p.Dot11,
        p.DrivenAngle,
    ]


def test_driven_angle_over_three_turns():
    """phi = 2 sin((theta - c) / 2): smooth, no unwrapping, no second zero half a turn away."""
    theta = np.linspace(-6.0 * np.pi, 6.0 * np.pi, LANES)
    i = Pose.of(ZERO, rotation(X, 0.7))
    h = Vec3(0.6, 0.0, 0.8)
    j = Pose.of(ZERO, i.q * rotation(h, theta))

    def phi(c):
        return p.DrivenAngle(h, Drive(c, 0.0, 0.0, np.cos(0.5 * c), np.sin(0.5 * c))).phi(i, j)[0]

    assert np.abs(phi(theta)).max() < 1e-14
    for error in (-3.0, -1e-3, 1e-3, 1.0, np.pi):
        assert np.abs(phi(theta + error) + 2.0 * np.sin(0.5 * error)).max() < 1e-14


@pytest.mark.parametrize("coupled", [False, True])
def test_branch_of_driven_angle(coupled):
    """A turn too few or too many is a zero as well, from which the rows lead away; of a coordinate
    it is asked at its own value.
    """
    theta = np.linspace(-6.0, 6.0, LANES)
    j = Pose.of(ZERO, rotation(Z, theta))
    for turns, sign in ((0, 1.0), (1, -1.0), (-1, -1.0)):
        c = theta + 2.0 * np.pi * turns
        driven = p.DrivenAngle(Z, Drive(c, 0.0, 0.0, np.cos(0.5 * c), np.sin(0.5 * c)))
        assert np.abs(driven.phi(GROUND_POSE, j)).max() < 1e-14
        assert driven.branch(GROUND_POSE, j)[0] == pytest.approx(sign)
    joints = [
        Revolute("first", "ground", "wheel", ORIGIN, (0.0, 0.0, 1.0)),
        Revolute("second", "ground", "other", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    ]
    used, gear = 1 + coupled, Gear("gear", ("second", "first"), 0.5)
    mechanism = Mechanism(
        "wheels",
        [Body("wheel"), Body("other")][:used],
        joints[:used],
        [Point("rim", "wheel", (1.0, 0.0, 0.0))],
        [JointAngle("turn", "first")],
        [gear][: used - 1],
    )
    turn = np.linspace(-20.0, 20.0, 9)
    found = solve(mechanism, "turn", turn)
    assert found.points["rim"].position[:, 0] == pytest.approx(np.cos(turn), abs=1e-14)
