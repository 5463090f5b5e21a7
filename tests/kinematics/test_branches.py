"""Which zeros of a primitive are meant, and whether Newton's iteration finds them (formulation
sections 3 and 4).
"""

import numpy as np
import pytest
from kincheck.core import (
    Body,
    ConstantVelocity,
    Gear,
    JointAngle,
    Mechanism,
    Point,
    Revolute,
)
from kincheck.core import primitives as p
from kincheck.core.algebra import ZERO, Quat, Vec3, X, Y, Z, cross, turned_by
from kincheck.core.kinematics.one_design import solve
from kincheck.core.mechanism.motions import Ramp
from kincheck.core.primitives.base import GROUND_POSE, Drive, Pose

from ..oracles import naive
from ..support.mechanisms import ORIGIN, solve_all
from ..support.specimens import LANES, MAKERS, admissible, body, lanes, make, orientation, rotation


@pytest.fixture
def rng():
    return np.random.default_rng(943745)


SPURIOUS = [rotation(axis, np.pi) for axis in (X, Y, Z)] + [
    rotation((1.0 / np.sqrt(3.0)) * Vec3(a, b, c), 2.0 * np.pi / 3.0)
    for a, b, c in ((1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0))
]


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


def newton_from(q, primitive, rows, iterations):
    """Newton's iteration of body j against the ground, smallest step; the poses it reaches, lane by
    lane.
    """
    for _ in range(iterations):
        j = Pose.of(ZERO, q)
        J = np.array([lanes(row) for row in rows(j)]).transpose(2, 0, 1)
        phi = lanes(primitive.phi(GROUND_POSE, j)).T
        step = (np.linalg.pinv(J) @ phi[:, :, None])[:, :, 0].T
        q = turned_by(q, -0.5 * Vec3(*step))
    return Pose.of(ZERO, q)


def simplified(primitive):
    return lambda j: [row.pj for row in primitive.rows(GROUND_POSE, j)]


def exact(primitive):
    """The exact rows of a condition a . h_j on an axis of the ground: -(a x h_j)."""
    return lambda j: [-cross(a, j.turn(primitive.h)) for a in (primitive.g, primitive.f)]


def test_basin_of_dot12(rng):
    """From any orientation to the identity; formulation section 4 has the same of RotX with theta =
    0.

    Of the two quaternions of an orientation, that of the turn below 180 degrees: a march arrives
    with it.
    """
    q = orientation(rng)
    sign = np.sign(q.e0)
    reached = newton_from(Quat(sign * q.e0, sign * q.e), p.Dot12(), simplified(p.Dot12()), 5)
    assert np.abs([*reached.q.e]).max() < 1e-14


def test_basin_of_dot11(rng):
    """From any orientation to h_j = +h_i with the simplified rows; with the exact ones often to
    -h_i.
    """
    q, dot11 = orientation(rng), p.Dot11(X, Y, Z)
    reached = newton_from(q, dot11, simplified(dot11), 12)
    assert np.abs(dot11.phi(GROUND_POSE, reached)).max() < 1e-14
    assert dot11.branch(GROUND_POSE, reached)[0].min() > 0.0
    astray = newton_from(q, dot11, exact(dot11), 40)
    assert 0.1 < np.mean(dot11.branch(GROUND_POSE, astray)[0] < 0.0) < 0.9


@pytest.mark.parametrize("degrees", [1.0, 30.0, 66.0, 80.0, 100.0, 150.0, 179.0])
def test_newton_step_of_dot11(degrees):
    """Isolated, a misalignment a is turned back by 2 atan(sin(a) / 2) with the simplified rows,
    which always shrinks it, and by 2 atan(tan(a) / 2) with the exact ones: forward, beyond 90
    degrees. (Turned back by the full angle instead of its tangent, the exact ones fail beyond 66.8
    degrees; formulation section 3.)"""
    dot11, a = p.Dot11(X, Y, Z), np.radians(degrees)
    start = rotation(X, np.full(LANES, a))
    for rows, tangent in ((simplified, 0.5 * np.sin(a)), (exact, 0.5 * np.tan(a))):
        once = newton_from(start, dot11, rows(dot11), 1)
        left = 2.0 * np.arctan2(once.q.e.x, once.q.e0)
        assert left == pytest.approx(a - 2.0 * np.arctan(tangent), abs=1e-12)
        assert (np.abs(left) < a).all() == (rows is simplified or degrees < 90.0)


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
