"""Free motion against closed forms, third-party values, and laws of motion."""

import cmath
import csv
import math
from dataclasses import replace

import kincheck
import numpy as np
import pytest
from kincheck import (
    Body,
    CaseError,
    JointAngle,
    KincheckError,
    Mechanism,
    Point,
    PointCoordinate,
    Revolute,
    SolveError,
    Translational,
)
from kincheck.core.cli.main import main
from kincheck.core.extensions.free.free_dynamics import free_motion
from kincheck.core.mechanism.loads import SpringDamper, Torque, TorsionSpringDamper
from scipy.special import ellipj, ellipk

from ...support.examples import examples
from ...support.mechanisms import ORIGIN, X, Y, Z

(CASE,) = examples(__file__, "case")

G = 9.80665


def pendulum(length=0.7, start=1.2, **changes):
    """A point mass on a hinge about x, from rest at an angle from straight down."""
    tip = (0.0, length * math.sin(start), -length * math.cos(start))
    given = {
        "bodies": [Body("rod", mass=2.0, center_of_mass=tip)],
        "joints": [Revolute("hinge", "ground", "rod", ORIGIN, X)],
        "points": [Point("tip", "rod", tip)],
        "drivers": [JointAngle("turn", "hinge")],
        "gravity": (0.0, 0.0, -G),
    }
    return Mechanism("pendulum", **given | changes)


def swing(t, length, start):
    """The angle of a pendulum from rest by Jacobi's sn: sin(a/2) = k sn(K + w t, k^2)."""
    k = math.sin(start / 2)
    sn, _, _, _ = ellipj(ellipk(k * k) + math.sqrt(G / length) * t, k * k)
    return 2.0 * np.arcsin(k * sn)


def test_free_pendulum_swings_by_elliptic_functions():
    t = np.linspace(0.0, 1.5, 7)  # nearly a period
    found = free_motion(pendulum(), t)
    angle = swing(t, 0.7, 1.2)
    expected = 0.7 * np.stack([0.0 * t, np.sin(angle), -np.cos(angle)], axis=1)
    position = found.motion.points["tip"].position[found.samples]
    assert np.abs(position - expected).max() < 1e-13
    assert found.energy_error < 1e-12
    assert (found.freedoms, found.redundant) == (1, 0)


def test_pendulum_tension_follows_from_its_speed():
    t = np.linspace(0.0, 1.0, 5)
    found = free_motion(pendulum(), t)
    angle, force = swing(t, 0.7, 1.2), found.forces(["hinge"]).joints["hinge"].force[found.samples]
    along = np.stack([0.0 * t, -np.sin(angle), np.cos(angle)], axis=1)
    tension = 2.0 * (3.0 * G * np.cos(angle) - 2.0 * G * math.cos(1.2))
    assert (force * along).sum(axis=1) == pytest.approx(tension, abs=1e-10)


def test_reactions_with_redundant_rows_obey_newton():
    linkage = kincheck.load("four_bar").mechanism
    coupler = linkage.body("coupler")
    center = Point("center", "coupler", coupler.center_of_mass)
    found = free_motion(replace(linkage, points=[center]), np.linspace(0.0, 0.2, 3))
    forces = found.forces(["crank_pin", "coupler_pin"])
    pins = (forces.joints[name] for name in ("crank_pin", "coupler_pin"))
    accelerations = found.motion.points["center"].acceleration
    first, second = pins
    for way in ((1.0, 2.0, 0.0), (0.0, 2.0, 1.0)):  # in the plane, where they are determined
        unit = np.array(way) / np.linalg.norm(way)
        left = (first.along(unit) - second.along(unit)) / coupler.mass + linkage.gravity @ unit
        assert left == pytest.approx(accelerations @ unit, abs=1e-9)
    assert found.redundant == 3
    assert np.abs(forces.power).max() < 1e-10


@pytest.mark.nightly
def test_free_body_turns_by_jacobi_functions():
    # Landau & Lifshitz, Mechanics, section 37: M^2 > 2 E I2, started where w2 = 0
    I1, I2, I3 = 0.3, 0.5, 0.7
    w1, w3 = 0.4, 2.0
    body = Body("top", mass=1.0, center_of_mass=ORIGIN, inertia=(I1, I2, I3, 0, 0, 0))
    tips = {"c": ORIGIN, "x": X, "y": Y}
    ways = [("c", X), ("c", Y), ("c", Z)]
    ways += [("x", Y), ("x", Z), ("y", Z)]
    drivers = [PointCoordinate(f"d{k}", *each) for k, each in enumerate(ways)]
    top = Mechanism("top", [body], [], [Point(k, "top", x) for k, x in tips.items()])
    top = replace(top, drivers=drivers)
    t = np.linspace(0.0, 5.0, 11)
    # v of x is w3 y - w2 z, that of y is -w3 x + w1 z; 0.25 m/s along x besides
    rates = {"d0": 0.25, "d3": w3, "d4": 0.0, "d5": w1}
    found = free_motion(top, t, rates)
    E2, M2 = I1 * w1**2 + I3 * w3**2, (I1 * w1) ** 2 + (I3 * w3) ** 2
    rate = math.sqrt((I3 - I2) * (M2 - E2 * I1) / (I1 * I2 * I3))
    m = (I2 - I1) * (E2 * I3 - M2) / ((I3 - I2) * (M2 - E2 * I1))
    sn, cn, dn, _ = ellipj(rate * t, m)
    expected = [w1 * cn, math.sqrt((E2 * I3 - M2) / (I2 * (I3 - I2))) * sn, w3 * dn]
    motion = found.motion.bodies["top"]
    assert np.abs(motion.v[found.samples, 3:].T - expected).max() < 1e-13
    assert motion.r[found.samples, 0] == pytest.approx(0.25 * t, abs=1e-14)
    assert found.freedoms == 6


def slider(mass=2.0, **load):
    """A block on a slide along x, on a spring with a damper; also its closed form."""
    spring = SpringDamper("s", "ground", "block", ((-2.0, 0, 0), ORIGIN), **load)
    return Mechanism(
        "slider",
        [Body("block", mass=mass, center_of_mass=ORIGIN)],
        [Translational("slide", "ground", "block", ORIGIN, X)],
        points=[Point("p", "block", ORIGIN)],
        forces=[spring],
    )


@pytest.mark.parametrize(
    ("k", "c", "end", "method"),
    [
        pytest.param(40.0, 4000.0, 1.0, "Radau", marks=pytest.mark.nightly),
        (4e4, 200.0, 0.3, "DOP853"),
    ],
    ids=["creeps", "comes to rest"],
)
def test_damped_block_follows_its_closed_form(k, c, end, method):
    mass, ahead = 2.0, -0.1
    found = free_motion(
        slider(mass, stiffness=k, damping=c, free_length=2.0 + ahead), np.linspace(0.0, end, 4)
    )
    root = cmath.sqrt((c / mass) ** 2 - 4.0 * k / mass)
    slow, fast = -(2.0 * k / mass) / (c / mass + root), -(c / mass + root) / 2.0
    t = found.times
    expected = ahead + (-ahead) * (fast * np.exp(slow * t) - slow * np.exp(fast * t)) / (
        fast - slow
    )
    assert found.method == method
    assert np.abs(found.motion.points["p"].position[found.samples, 0] - expected.real).max() < 1e-13


@pytest.mark.nightly
def test_torsional_spring_swings_beyond_turns():
    spring = TorsionSpringDamper("s", "hinge", stiffness=3.0, free_angle=10.0)
    body = Body("rod", mass=1.0, center_of_mass=ORIGIN, inertia=(0.2, 0.3, 0.4, 0, 0, 0))
    wheel = pendulum(bodies=[body], forces=[spring])
    found = free_motion(wheel, np.linspace(0.0, 2.0, 3))
    angle = 10.0 * (1.0 - np.cos(math.sqrt(3.0 / 0.2) * found.times))
    p = found.motion.bodies["rod"].p[found.samples]
    assert np.abs(p[:, 1] - np.sin(0.5 * angle)).max() < 1e-12
    assert np.abs(p[:, 0] - np.cos(0.5 * angle)).max() < 1e-12


@pytest.mark.nightly
def test_andrews_squeezer_free_reaches_published_angles():
    # 80-bit floats, seven angles, order 16; the IVP test set prints them to about ten digits
    mechanism = kincheck.load("andrews_squeezer").mechanism
    torque = Torque("motor", "K1", vector=(0.0, 0.0, 0.033))
    pushed = replace(mechanism, forces=(*mechanism.forces, torque))
    found = free_motion(pushed, np.linspace(0.0, 0.03, 2))
    starts = {"K1": -0.0617138900142764496, "K3": 0.455279819163070380}
    ends = {"K1": 15.81077119515370, "K3": 0.04082224011964577}
    for body, start in starts.items():
        p = found.motion.bodies[body].p
        angle = start + np.unwrap(2.0 * np.arctan2(p[:, 3], p[:, 0]))[-1]
        # round-off of accelerations of 1e6 rad/s^2: 1e-14 to 4e-14, by the grid of the samples
        assert angle == pytest.approx(ends[body], abs=1e-13)
    assert found.motion.bodies["K1"].a[0, 5] == pytest.approx(14222.4439199541138, rel=1e-14)
    assert found.redundant == 9


def test_free_parallelogram_ends_at_change_point():
    joints = [
        Revolute(name, *bodies, point, Z)
        for name, bodies, point in (
            ("A", ("ground", "crank"), ORIGIN),
            ("B", ("crank", "rod"), Y),
            ("C", ("rod", "rocker"), (2.0, 1.0, 0.0)),
            ("D", ("ground", "rocker"), (2.0, 0.0, 0.0)),
        )
    ]
    bodies = [
        Body(name, mass=1.0, center_of_mass=at, inertia=(0.1, 0.1, 0.1, 0, 0, 0))
        for name, at in (("crank", (0, 0.5, 0)), ("rod", (1, 1, 0)), ("rocker", (2, 0.5, 0)))
    ]
    linkage = Mechanism("parallelogram", bodies, joints, [Point("p", "rod", (1, 1, 0))])
    found = free_motion(linkage, np.linspace(0.0, 2.0, 41), {"A": -1.0})
    # without gravity it turns evenly: flat after a quarter of a turn
    assert found.times[-1] == pytest.approx(1.55)
    assert float(found.message.split(" at ")[-1].split(" s:")[0]) == pytest.approx(
        math.pi / 2, abs=1e-6
    )
    turned = found.motion.points["p"].position[found.samples]
    assert turned[:, 0] == pytest.approx(1.0 + np.sin(found.times), abs=1e-12)


@pytest.mark.parametrize(
    ("changed", "rates", "message"),
    [
        ({"bodies": [Body("rod")]}, {}, "no moving body has mass"),
        ({}, {"hing": 1.0}, "hinge"),
        ({}, {"hinge": 1.0, "turn": 2.0}, "contradict"),
        (
            {"bodies": [Body("rod", mass=1.0)], "forces": [Torque("t", "rod", vector=X)]},
            {},
            "no inertia",
        ),
    ],
    ids=["massless", "unknown joint", "contradiction", "no inertia"],
)
def test_free_motion_without_law_is_refused(changed, rates, message):
    with pytest.raises(SolveError, match=message):
        free_motion(pendulum(**changed), np.linspace(0.0, 1.0, 3), rates)


@pytest.fixture
def case(tmp_path):
    file = tmp_path / "swing.toml"
    file.write_text(CASE)
    return file


def test_free_command_counts_turns_between_samples(case, tmp_path):
    out = tmp_path / "out.csv"
    assert main(["free", str(case), "--csv", str(out)]) == 0
    head, *rows = csv.reader(out.read_text().splitlines())
    assert head == ["time", "angle"]
    # beyond the top: sin(angle / 2) = sn(w0 t / 2, m), m = 4 g / (l w0^2)
    w0 = 3.0 * math.pi
    t = np.array([0.0, 1.0, 2.0])
    _, _, _, amplitude = ellipj(0.5 * w0 * t, 4.0 * G / (0.7 * w0**2))
    found = np.array([[float(x) for x in row] for row in rows])
    assert found[:, 0] == pytest.approx(t)
    assert found[:, 1] == pytest.approx(2.0 * amplitude, abs=1e-11)


def test_python_free_returns_case_outputs(case):
    found = kincheck.free(case)
    assert found.times.tolist() == [0.0, 1.0, 2.0]
    assert kincheck.free(case, duration=0.2, samples=2).times[-1] == 0.2
    assert found.facts["outputs"]["angle"] == found.outputs["angle"].tolist()


def test_free_case_file_round_trip(case, tmp_path):
    from kincheck.core.case.io.case_file import case_text, load_case
    from kincheck.core.extensions.free.section import free_in

    again = tmp_path / "again.toml"
    again.write_text(case_text(load_case(case)))
    assert free_in(load_case(again)) == free_in(load_case(case))
    assert free_in(load_case(case)).rates == {"hinge": pytest.approx(3.0 * math.pi)}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("hinge = 540.0", "knee = 540.0", "free.rates"),
        ("samples = 3", "samples = 1", "free.samples"),
        ("duration = 2.0", "", "free.duration: missing"),
    ],
)
def test_bad_free_table_names_its_key(case, old, new, message):
    case.write_text(CASE.replace(old, new))
    with pytest.raises(CaseError, match=message):
        kincheck.free(case)


def test_free_without_duration_is_refused(capsys):
    assert main(["free", "hooke_joint"]) == 2
    assert "--duration" in capsys.readouterr().err
    with pytest.raises(KincheckError, match="duration"):
        kincheck.free("hooke_joint")
