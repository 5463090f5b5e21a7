"""Reactions and efforts against ADAMS, a published benchmark and closed forms."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kincheck import (
    Body,
    BodyMotion,
    Gear,
    JointAngle,
    Mechanism,
    Point,
    Revolute,
    Screw,
    Trajectory,
    cases,
    solve,
)
from kincheck.core.kinematics import forces_of
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.one_design import prepare
from kincheck.core.mechanism import motions
from kincheck.core.mechanism.loads import Force, SpringDamper, Torque, TorsionSpringDamper

from ..oracles import naive, newton_euler
from ..support.adams_single_joints import CASES, right
from ..support.loads import GRAVITY, six
from ..support.mechanisms import ORIGIN, X, Z

DATA = Path(__file__).parents[1] / "data"
REACTIONS = json.loads((DATA / "adams_joint_reactions.json").read_text("utf-8"))["cases"]
ANDREWS = json.loads((DATA / "andrews_squeezer.json").read_text("utf-8"))


# ADAMS


@pytest.mark.parametrize("name", sorted(REACTIONS))
def test_reactions_agree_with_adams_records(name):
    """A body falls from one joint; the recorded motion gives the recorded reaction on the ground.

    The motion is printed with six digits, so reactions agree to a few parts in a million.
    """
    replayed, expected = CASES[name], REACTIONS[name]
    numbers = np.array(replayed["samples"])[:, 1:]
    r, p, v, w, v_t, w_t = np.split(numbers, [3, 7, 10, 13, 16], axis=1)
    p = p / np.linalg.norm(p, axis=1)[:, None]
    A = np.array([naive.A(each) for each in p])
    own = np.diag(expected["inertia_diagonal_body_frame"])
    inertia = six(A[0] @ own @ A[0].T)
    body = Body("body", tuple(r[0]), tuple(p[0]), mass=expected["mass"], inertia=inertia)
    joint = right(replayed)
    mechanism = Mechanism("m", [body], [joint], gravity=expected["gravity"])
    body_axes = [np.einsum("nji,nj->ni", A, each) for each in (w, w_t)]
    motion = BodyMotion(r, p, np.hstack([v, body_axes[0]]), np.hstack([v_t, body_axes[1]]))
    n = len(r)
    replay = Trajectory(
        {}, np.ones(n, dtype=bool), np.zeros(n, dtype=int), 0.0, bodies={"body": motion}
    )
    found = forces_of(mechanism, motions.Path({}, np.arange(n) * 0.1), replay).joints["joint"]
    on_ground = np.array(expected["reaction_force_on_ground"])
    torque = np.array(expected["reaction_torque_on_ground"])
    largest = np.abs(on_ground).max()
    assert np.abs(found.force + on_ground).max() <= 5e-6 * largest
    # recorded about the ground's point; ours is about the one that the body carries
    (on_body, *_), (fixed, *_) = joint.points_on("body"), joint.points_on("ground")
    arm = np.array([newton_euler.carried(body, motion, k, on_body) for k in range(n)]) - fixed
    about = found.moment + np.cross(arm, found.force)
    assert np.abs(about + torque).max() <= 5e-6 * max(np.abs(torque).max(), 2.0 * largest)


# Closed forms


def pendulum(**options):
    body = Body("arm", mass=2.0, center_of_mass=(0.5, 0.0, 0.0), inertia=(0.1, 0.3, 0.3, 0, 0, 0))
    hinge = Revolute("hinge", "ground", "arm", ORIGIN, Z)
    tip = Point("tip", "arm", X)
    return Mechanism("pendulum", [body], [hinge], [tip], [JointAngle("turn", "hinge")], **options)


ANGLES = np.linspace(-7.0, 7.0, 29)  # more than a turn to both sides
C, S = np.cos(ANGLES), np.sin(ANGLES)
HEAVY = pendulum(gravity=(0.0, -9.81, 0.0))


def turned(mechanism, sign=1.0, rate=3.0):
    return solve(mechanism, "turn", sign * ANGLES, rate=sign * rate, forces=True).forces


def test_pendulum_reactions_closed_form():
    found = turned(HEAVY)
    expected = np.stack([-9.0 * C, -9.0 * S + 2.0 * 9.81, 0 * C], axis=1)
    reaction = found.joints["hinge"]
    assert reaction.force == pytest.approx(expected, abs=1e-13)
    assert reaction.moment == pytest.approx(0.0, abs=1e-13)
    assert found.drivers["turn"] == pytest.approx(9.81 * C, abs=1e-13)


def test_reactions_of_reversed_joint_change_sign():
    """Then the reaction is what the arm exerts on the ground."""
    one = turned(HEAVY)
    other = turned(replace(HEAVY, joints=[HEAVY.joints[0].reversed()]), sign=-1.0)
    assert one.drivers["turn"] == pytest.approx(-other.drivers["turn"], abs=1e-13)
    one, other = one.joints["hinge"], other.joints["hinge"]
    assert one.force == pytest.approx(-other.force, abs=1e-13)
    assert one.moment == pytest.approx(-other.moment, abs=1e-13)


def test_pendulum_forces_of_each_element():
    """Each element alone on the pendulum; its torque is what the driver works against."""
    tip = np.stack([C, S, 0 * C], axis=1)
    d = tip - [0.0, 2.0, 0.0]
    length = np.linalg.norm(d, axis=1)
    rate = 3.0 * (d[:, 0] * -S + d[:, 1] * C) / length
    tension = 100.0 * (length - 0.7) + 5.0 * rate
    pull = -tension[:, None] * d / length[:, None]
    winding = -(10.0 * (ANGLES - 0.5) + 2.0 * 3.0)
    push, still = (0.0, 7.0, 0.0), turned(pendulum()).joints["hinge"].force
    for element, amount, torque, force in (
        (
            SpringDamper("x", "ground", "arm", ((0, 2, 0), X), 100.0, 5.0, 0.7),
            tension,
            tip[:, 0] * pull[:, 1] - tip[:, 1] * pull[:, 0],
            pull,
        ),
        (TorsionSpringDamper("x", "hinge", 10.0, 2.0, 0.5), winding, winding, 0.0),
        (Force("x", "arm", X, push), 7.0, 7.0 * C, push),
        (Force("x", "arm", X, push, "body"), 7.0, 7.0, np.stack([-7 * S, 7 * C, 0 * C], axis=1)),
        (Torque("x", "arm", (0.0, 3.0, 4.0)), 5.0, 4.0, 0.0),
    ):
        found = turned(pendulum(forces=[element]))
        for one, expected in (
            (found.elements["x"], amount),
            (-found.drivers["turn"], torque),
            (still - found.joints["hinge"].force, force),
        ):
            assert np.abs(one - expected).max() <= 1e-11
        assert np.abs(found.power).max() <= 1e-12 * max(found.largest_power.max(), 1.0)


def driven(mechanism, motion, times):
    """Motion of all bodies, and forces, by a motion of the driver."""
    (driver,) = mechanism.drivers
    path = motions.Path({driver.name: motion}, times)
    names = tuple(body.name for body in mechanism.moving)
    found = prepare(mechanism, Request((driver.name,), (), names, 2), path)(1e-12)
    return found, forces_of(mechanism, path, found)


SWUNG = np.linspace(0.1, 1.0, 5)


def test_gear_effort_carries_geared_inertia():
    """Two shafts: the effort carries the second one's inertia by the ratio squared."""
    bodies = [
        Body("one", mass=1.0, inertia=(1.0, 1.0, 0.3, 0, 0, 0)),
        Body("two", X, mass=1.0, inertia=(1.0, 1.0, 0.5, 0, 0, 0)),
    ]
    joints = [
        Revolute("first", "ground", "one", ORIGIN, Z),
        Revolute("second", "ground", "two", X, Z),
    ]
    gear = Gear("gear", ("first", "second"), 2.0)
    mechanism = Mechanism("m", bodies, joints, [], [JointAngle("turn", "first")], [gear])
    sine = motions.Sine(0.5, 0.3)
    motion, found = driven(mechanism, sine, SWUNG)
    acceleration = sine.at(SWUNG)[2]
    ratio = motion.bodies["two"].a[:, 5] / acceleration
    expected = (0.3 + ratio**2 * 0.5) * acceleration
    assert found.drivers["turn"] == pytest.approx(expected, abs=1e-12)
    for reaction in found.joints.values():
        assert reaction.moment == pytest.approx(0.0, abs=1e-12)


def test_screw_reaction_does_no_work():
    """Its thrust and its torque, times their rates, cancel."""
    axis = np.array([0.6, 0.0, 0.8])
    nut = Body("nut", mass=2.0, inertia=(1.0, 1.0, 1.0, 0, 0, 0))
    joint = Screw("screw", "ground", "nut", (0.1, 0.2, 0.3), tuple(axis), 0.05)
    mechanism = Mechanism("m", [nut], [joint], [], [JointAngle("turn", "screw")], gravity=GRAVITY)
    motion, found = driven(mechanism, motions.Sine(2.0, 0.3), SWUNG)
    reaction, moved = found.joints["screw"], motion.bodies["nut"]
    thrust, torque = reaction.force @ axis, reaction.moment @ axis
    slide = np.einsum("ni,i->n", moved.v[:, :3], axis)
    spin = np.array([naive.A(p) @ w @ axis for p, w in zip(moved.p, moved.v[:, 3:], strict=True)])
    # the nut's origin is off the axis: what turns about it moves along it no more
    assert np.abs(thrust * slide + torque * spin).max() <= 1e-12 * np.abs(thrust * slide).max()
    assert np.abs(thrust).min() > 1.0
    assert np.abs(found.power).max() <= 1e-12 * found.largest_power.max()


class Lifted(motions.Motion):
    """From rest at the design with a given acceleration."""

    type = "lifted"

    def __init__(self, acceleration):
        self.acceleration = acceleration

    def at(self, t):
        return 0.5 * self.acceleration * t**2, self.acceleration * t, self.acceleration + 0.0 * t


def test_andrews_squeezer_published_start_forces():
    """The published accelerations as a driven motion give back the published drive torque.

    And the published multipliers, which are the components of the force at E of the triangle.
    """
    torque, start = ANDREWS["parameters"]["mom"], ANDREWS["published"]["t0"]
    mechanism = cases.load("andrews_squeezer").mechanism
    _, found = driven(mechanism, Lifted(float(start["qdd"][0])), np.zeros(1))
    assert abs(found.drivers["crank"][0] - float(torque)) <= 1e-12
    multipliers = np.array([98.5668703962410896, -6.12268834425566265])
    force = found.joints["E3"]
    assert all(np.isfinite(force.along(axis)).all() for axis in np.eye(3)[:2])
    np.testing.assert_allclose(np.abs(force.force[0, :2]), np.abs(multipliers), rtol=1e-12)
    for name in ("E4", "E6"):
        assert np.abs(found.joints[name].force[0, :2]).max() <= 1e-10
