"""Reactions and efforts against ADAMS, a published benchmark and closed forms."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kincheck import cases
from kincheck.core import solve
from kincheck.core.joints import (
    Gear,
    Revolute,
    Screw,
)
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.forces.reactions import forces_of
from kincheck.core.kinematics.one_design import prepare
from kincheck.core.mechanism import motions
from kincheck.core.mechanism.body import Body
from kincheck.core.mechanism.loads import Force, SpringDamper, Torque, TorsionSpringDamper
from kincheck.core.mechanism.mechanism import Mechanism, Point
from kincheck.core.mechanism.motions import JointAngle
from kincheck.core.trajectory import BodyMotion, Trajectory

from ..oracles import naive, newton_euler
from ..support.adams_single_joints import CASES, right
from ..support.loads import GRAVITY, six
from ..support.mechanisms import X

DATA = Path(__file__).parents[1] / "data"
REACTIONS = json.loads((DATA / "adams_joint_reactions.json").read_text(encoding="utf-8"))["cases"]
ANDREWS = json.loads((DATA / "andrews_squeezer.json").read_text(encoding="utf-8"))


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
    hinge = Revolute("hinge", "ground", "arm", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    tip = Point("tip", "arm", X)
    return Mechanism("pendulum", [body], [hinge], [tip], [JointAngle("turn", "hinge")], **options)


ANGLES = np.linspace(-7.0, 7.0, 29)  # more than a turn to both sides


def test_pendulum_reactions_closed_form():
    mechanism = pendulum(gravity=(0.0, -9.81, 0.0))
    found = solve(mechanism, "turn", ANGLES, rate=3.0, forces=True).forces
    c, s = np.cos(ANGLES), np.sin(ANGLES)
    expected = np.stack([-2.0 * 0.5 * 9.0 * c, -2.0 * 0.5 * 9.0 * s + 2.0 * 9.81, 0 * c], axis=1)
    reaction = found.joints["hinge"]
    assert reaction.force == pytest.approx(expected, abs=1e-13)
    assert reaction.moment == pytest.approx(0.0, abs=1e-13)
    assert found.drivers["turn"] == pytest.approx(9.81 * c, abs=1e-13)


def test_reactions_of_reversed_joint_change_sign():
    """Then the reaction is what the arm exerts on the ground."""
    mechanism = pendulum(gravity=(0.0, -9.81, 0.0))
    reversed_ = replace(mechanism, joints=[mechanism.joints[0].reversed()])
    one = solve(mechanism, "turn", ANGLES, forces=True).forces
    other = solve(reversed_, "turn", -ANGLES, rate=-1.0, forces=True).forces
    for a, b in (
        (one.joints["hinge"].force, -other.joints["hinge"].force),
        (one.joints["hinge"].moment, -other.joints["hinge"].moment),
        (one.drivers["turn"], -other.drivers["turn"]),
    ):
        assert a == pytest.approx(b, abs=1e-13)


def test_pendulum_forces_of_each_element():
    """Each element alone on the pendulum; its torque is what the driver works against."""
    c, s = np.cos(ANGLES), np.sin(ANGLES)
    anchor = np.array([0.0, 2.0, 0.0])
    tip = np.stack([c, s, 0 * c], axis=1)
    d = tip - anchor
    length = np.linalg.norm(d, axis=1)
    rate = 3.0 * (d[:, 0] * -s + d[:, 1] * c) / length
    tension = 100.0 * (length - 0.7) + 5.0 * rate
    pull = -tension[:, None] * d / length[:, None]
    cases_of = [
        (
            SpringDamper("x", "ground", "arm", ((0, 2, 0), X), 100.0, 5.0, 0.7),
            tension,
            tip[:, 0] * pull[:, 1] - tip[:, 1] * pull[:, 0],
            pull,
        ),
        (
            TorsionSpringDamper("x", "hinge", 10.0, 2.0, 0.5),
            -(10.0 * (ANGLES - 0.5) + 2.0 * 3.0),
            -(10.0 * (ANGLES - 0.5) + 2.0 * 3.0),
            np.zeros((len(c), 3)),
        ),
        (
            Force("x", "arm", X, (0.0, 7.0, 0.0)),
            np.full(len(c), 7.0),
            7.0 * c,
            np.stack([0 * c, 7.0 + 0 * c, 0 * c], axis=1),
        ),
        (
            Force("x", "arm", X, (0.0, 7.0, 0.0), "body"),
            np.full(len(c), 7.0),
            7.0 + 0 * c,
            np.stack([-7.0 * s, 7.0 * c, 0 * c], axis=1),
        ),
        (Torque("x", "arm", (0.0, 3.0, 4.0)), np.full(len(c), 5.0), 4.0 + 0 * c, np.zeros((1, 3))),
    ]
    still = solve(pendulum(), "turn", ANGLES, rate=3.0, forces=True).forces
    for element, amount, torque, force in cases_of:
        found = solve(pendulum(forces=[element]), "turn", ANGLES, rate=3.0, forces=True).forces
        assert found.elements["x"] == pytest.approx(amount, abs=1e-12)
        assert found.drivers["turn"] == pytest.approx(-torque, abs=1e-11)
        reaction = found.joints["hinge"].force - still.joints["hinge"].force
        np.testing.assert_allclose(reaction, np.broadcast_to(-force, reaction.shape), atol=1e-11)
        assert np.abs(found.power).max() <= 1e-12 * max(found.largest_power.max(), 1.0)


def sine_driven(mechanism, sine):
    """Motion of all bodies, and forces, of a driver that follows a sine."""
    path = motions.Path({"turn": sine}, np.linspace(0.1, 1.0, 5))
    names = tuple(body.name for body in mechanism.moving)
    motion = prepare(mechanism, Request(("turn",), (), names, 2), path)(1e-12)
    return motion, forces_of(mechanism, path, motion), path.times


def test_gear_effort_carries_geared_inertia():
    """Two shafts: the effort carries the second one's inertia by the ratio squared."""
    z = (0.0, 0.0, 1.0)
    bodies = [
        Body("one", mass=1.0, inertia=(1.0, 1.0, 0.3, 0, 0, 0)),
        Body("two", X, mass=1.0, inertia=(1.0, 1.0, 0.5, 0, 0, 0)),
    ]
    joints = [
        Revolute("first", "ground", "one", (0.0, 0.0, 0.0), z),
        Revolute("second", "ground", "two", X, z),
    ]
    mechanism = Mechanism(
        "m",
        bodies,
        joints,
        [],
        [JointAngle("turn", "first")],
        [Gear("gear", ("first", "second"), 2.0)],
    )
    sine = motions.Sine(0.5, 0.3)
    motion, found, times = sine_driven(mechanism, sine)
    acceleration = sine.at(times)[2]
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
    motion, found, _ = sine_driven(mechanism, motions.Sine(2.0, 0.3))
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
    p = {k: float(v) for k, v in ANDREWS["parameters"].items()}
    start = ANDREWS["published"]["t0"]
    be, th, ga, ph, de, om, ep = map(float, start["q"])
    xa, ya, xb, yb = p["xa"], p["ya"], p["xb"], p["yb"]
    c, s = math.cos, math.sin
    e, f = p["e"] - p["ea"], p["zf"] - p["fa"]
    centers = [
        (p["ra"] * c(be), p["ra"] * s(be)),
        (p["rr"] * c(be) - p["da"] * c(be + th), p["rr"] * s(be) - p["da"] * s(be + th)),
        (xb + p["sa"] * s(ga) + p["sb"] * c(ga), yb - p["sa"] * c(ga) + p["sb"] * s(ga)),
        (xa + p["zt"] * c(de) + e * s(ph + de), ya + p["zt"] * s(de) - e * c(ph + de)),
        (xa + p["ta"] * c(de) - p["tb"] * s(de), ya + p["ta"] * s(de) + p["tb"] * c(de)),
        (xa + p["u"] * s(ep) + f * c(om + ep), ya - p["u"] * c(ep) + f * s(om + ep)),
        (xa + p["ua"] * s(ep) - p["ub"] * c(ep), ya - p["ua"] * c(ep) - p["ub"] * s(ep)),
    ]
    case = cases.load("andrews_squeezer")
    bodies = [
        # the plane motion needs Izz only
        Body(
            f"K{k}", mass=p[f"m{k}"], center_of_mass=(*at, 0.0), inertia=[p[f"i{k}"]] * 3 + [0] * 3
        )
        for k, at in enumerate(centers, start=1)
    ]
    D = case.mechanism.point("D").position
    ends = ((p["xc"], p["yc"], 0.0), D)
    spring = SpringDamper("spring", "ground", "K3", ends, p["c0"], free_length=p["l0"])
    mechanism = replace(case.mechanism, bodies=bodies, forces=[spring])
    driver = mechanism.drivers[0].name
    path = motions.Path({driver: Lifted(float(start["qdd"][0]))}, np.zeros(1))
    names = tuple(body.name for body in mechanism.moving)
    motion = prepare(mechanism, Request((driver,), (), names, 2), path)(1e-12)
    found = forces_of(mechanism, path, motion)
    assert abs(found.drivers[driver][0] - p["mom"]) <= 1e-12
    multipliers = np.array([98.5668703962410896, -6.12268834425566265])
    force = found.joints["E3"]
    assert all(np.isfinite(force.along(axis)).all() for axis in np.eye(3)[:2])
    np.testing.assert_allclose(np.abs(force.force[0, :2]), np.abs(multipliers), rtol=1e-12)
    for name in ("E4", "E6"):
        assert np.abs(found.joints[name].force[0, :2]).max() <= 1e-10
