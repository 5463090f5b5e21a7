"""Proved forces: closed forms to all digits, every case with masses, and what is refused."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from kincheck import Ramp, Revolute, Translational, cases
from kincheck.core import primitives as p
from kincheck.core.algebra import ZERO, vec
from kincheck.core.extensions.proofs import exact_forces
from kincheck.core.extensions.proofs.ball_executor import precision
from kincheck.core.extensions.proofs.exact import as_decimal, as_double
from kincheck.core.extensions.proofs.krawczyk import Enclosure
from kincheck.core.extensions.proofs.proofs import prove
from kincheck.core.extensions.proofs.verified_reference import prove_case
from kincheck.core.joints import AxialJoint
from kincheck.core.joints.base import unit
from kincheck.core.kinematics.forces import equations
from kincheck.core.mechanism.motions import Path

from ...support.driven_chains import COUPLINGS, Link, at_origins, chain
from ...support.loaded_slider_crank import loaded, pushed

flint = pytest.importorskip("flint")
BITS = 200
# One exact rate, and angles on both sides of the design and beyond a turn.
RATE = 1.5
ANGLES = [-0.75, 0.0, 0.5, 7.0]


def proved(mechanism, values=ANGLES, rate=RATE, reading=as_double):
    """The samples of a sweep, and the native motion."""
    (driver,) = mechanism.drivers
    values = np.asarray(values, dtype=float)
    drives = {driver.name: [(Fraction(x), Fraction(rate), Fraction(0)) for x in values.tolist()]}
    members = (*mechanism.joints, *mechanism.drivers, *mechanism.forces)
    names = [each.name for each in members]
    path = Path({driver.name: Ramp(rate)}, values / rate)
    found = prove(mechanism, path, ["tip"], drives, reading, BITS, 1e-12, names)
    for each in found.samples:
        assert isinstance(each, Enclosure), each
    return found


def closed_form(angle):
    """Effort, rod's pull along x on the slider, and spring tension of `loaded`, by work alone."""
    # the angle grows in time at the rate; energies are series in the time
    a = flint.arb_series([angle, RATE], prec=3)
    half = flint.arb("0.5")
    s = -2 - half * a.sin() + (4 - (half * (1 - a.cos())) ** 2).sqrt()
    v, turned = s.derivative(), a.derivative()
    crank_x = flint.arb("0.125") * a.cos()
    stored = flint.arb("1.75") * v * v + half * 800 * (flint.arb("0.25") - s) ** 2
    stored += half * 4 * (a + flint.arb("0.25")) ** 2
    stored -= half * (2 * crank_x + flint.arb("3.5") * s)  # gravity along x is 0.5
    lost = 16 * v * v + half * turned * turned + 8 * v - 3 * turned
    effort = (stored.derivative() + lost)[0] / RATE
    tension = (800 * (flint.arb("0.25") - s) - 16 * v)[0]
    pull = flint.arb("3.5") * (v.derivative()[0] - half) - tension + 8
    return effort, pull, tension


@pytest.fixture(scope="module")
def slider_crank():
    return proved(loaded())


def test_force_enclosure_holds_closed_form(slider_crank):
    """Springs, dampers, constant loads, gravity: the truth is energy and one body's balance."""
    with precision(BITS):
        for angle, each in zip(ANGLES, slider_crank.samples, strict=True):
            effort, pull, tension = closed_form(angle)
            found = each.forces
            pairs = (
                (found.drivers["turn"], effort),
                (found.joints["rod"][0], pull),
                (found.elements["spring"], tension),
                (found.elements["clock"], -(4 * flint.arb(angle + 0.25) + flint.arb("0.5") * RATE)),
            )
            for ball, truth in pairs:
                assert ball.overlaps(truth)
                assert ball.rad() < 1e-40
            assert found.power.contains(0)


def test_force_enclosure_of_driven_point_effort():
    """The same slider-crank, pushed at its tip: at one pose and rate the powers are equal."""
    found = proved(pushed(), [0.25], 0.5)
    (each,) = found.samples
    effort = found.native.forces.drivers["push_tip"][0]
    assert abs(float(each.forces.drivers["push_tip"]) - effort) < 1e-12 * abs(effort)


def test_force_enclosure_reads_decimals_or_doubles():
    def tension(reading):
        mechanism = loaded()
        heavy = [replace(each, mass=0.1 * each.mass) for each in mechanism.bodies]
        sample = proved(replace(mechanism, bodies=heavy), [0.5], reading=reading).samples[0]
        with precision(BITS):
            return sample.forces.joints["rod"][0]

    difference = abs(float(tension(as_decimal) - tension(as_double)))
    assert 1e-20 < difference < 1e-14


CASES = [
    "andrews_squeezer",
    "bennett",
    "bricard",
    "four_bar",
    "hooke_joint",
    "mcpherson_strut_loaded",
    "modelica_four_bar_distance",
    "planar_slider_crank",
    "rssr",
    "rssr_other_branch",
    "spatial_slider_crank",
]


@pytest.mark.by_day(2)
@pytest.mark.parametrize("name", CASES)
def test_force_enclosure_of_library_cases(name):
    case = cases.load(name)
    values = case.sweep.values[[1, len(case.sweep.values) // 3]]
    outputs = tuple(each for each in case.outputs if each.forces)
    few = replace(case, sweep=replace(case.sweep, values=values), outputs=outputs, reference={})
    found, errors = prove_case(few, digits=30, numbers="double", tol=1e-12)
    assert found.proved == 2
    for output in outputs:
        series = found.outputs[output.name]
        assert series.reason is None
        assert series.radius[0] < 1e-30
        assert series.velocity == [None, None]
    largest = max(abs(float(x)) for each in found.outputs.values() for x in each.position)
    assert max(error.largest[0] for error in errors) < 1e-13 * largest


def test_undetermined_force_enclosure_has_reason():
    case = cases.load("four_bar")
    (pin, *_) = [each for each in case.outputs if each.name == "coupler_pin_force_e1"]
    loose = replace(pin, name="loose", direction=(0.3, 0.5, 0.7))
    values = case.sweep.values[[1, 30]]
    few = replace(
        case, sweep=replace(case.sweep, values=values), outputs=(pin, loose), reference={}
    )
    found, errors = prove_case(few, digits=30, numbers="double", tol=1e-12)
    assert found.outputs["coupler_pin_force_e1"].reason is None
    assert "3 of 6 of both" in found.outputs["loose"].reason
    assert found.outputs["loose"].position == [None, None]
    assert {error.output: error.largest[0] for error in errors}["loose"] is None


# Lines of action


def in_balls(made):
    """Forces at two samples, as balls."""
    drivers = [driver.name for driver in made.mechanism.drivers]
    members = (*made.mechanism.joints, *made.mechanism.drivers)
    path = replace(made.path, times=made.path.times[1:3])
    drives = {
        name: [tuple(map(Fraction, row)) for row in table.T.tolist()]
        for name, table in zip(drivers, path.drive(drivers, path.times).swapaxes(0, 1), strict=True)
    }
    names = [each.name for each in members]
    found = prove(made.mechanism, path, [], drives, as_double, BITS, 1e-12, names)
    for each in found.samples:
        assert isinstance(each, Enclosure), each
    return zip(path.times, found.samples, strict=True)


def off_by_hand(made):
    """The largest difference of the proved forces from free-body diagrams, as a part of the
    largest.
    """
    off, size = 0.0, 0.0
    for t, sample in in_balls(made):
        hand = made.by_hand(t)
        pairs = [(sample.forces.joints[name], wrench) for name, wrench in hand.joints.items()]
        pairs += [([sample.forces.drivers[name]], [x]) for name, x in hand.drivers.items()]
        for balls, numbers in pairs:
            found = np.array([float(each) for each in balls])
            off, size = max(off, np.abs(found - numbers).max()), max(size, np.abs(found).max())
    return off / size


@pytest.mark.parametrize(
    "coupled", [None, "rack", "rack that is a screw", "polynomial, translation by rotation"]
)
def test_force_enclosure_equals_free_body_diagrams(coupled):
    if coupled is None:
        made = chain([Link(Revolute), Link(Translational, flipped=True), Link(Revolute)])
    else:
        one, other, coupling = COUPLINGS[coupled]
        made = chain([Link(Revolute), replace(one, flipped=True), other], coupling, size=0.5)
    assert off_by_hand(made) < 1e-13


@pytest.mark.parametrize("coupled", [False, True])
def test_force_enclosure_ignores_shifted_driver_row(coupled, monkeypatch):
    """A slide driven beside its axis has the same motion: the proof keeps the line of action."""
    monkeypatch.setattr(AxialJoint, "measured", at_origins)
    slide = Link(Translational, flipped=True)
    links = [Link(Revolute), slide, Link(Revolute)]
    made = chain(links, COUPLINGS["rack"][2] if coupled else None, size=0.5)
    assert off_by_hand(made) < 1e-13


def test_force_enclosure_refuses_doubled_coordinate(monkeypatch):
    """One of twice the displacement."""

    def doubled(self, freedom, i, j):
        P, h = vec(self.point), unit(self.axis)
        return p.Dot20(2.0 * h, i.arm(P), j.arm(P), ZERO)

    monkeypatch.setattr(AxialJoint, "measured", doubled)
    made = chain([Link(Translational)])
    with pytest.raises(AssertionError, match="a driver or coupler measures another coordinate"):
        in_balls(made)


# Planted mistakes


def test_force_enclosure_refuses_wrong_gravity_sign(monkeypatch):
    right = equations.inertial
    monkeypatch.setattr(equations, "inertial", lambda body, at, g: right(body, at, -g))
    with pytest.raises(AssertionError, match="the powers of drivers, masses and force elements"):
        proved(loaded(), [0.5])


def test_force_enclosure_refuses_halved_torque(monkeypatch):
    right = exact_forces.ExactForces._by_state
    monkeypatch.setattr(
        exact_forces.ExactForces,
        "_by_state",
        lambda own, demand: [0.5 * x for x in right(own, demand)],
    )
    with pytest.raises(AssertionError, match="the powers of drivers, masses and force elements"):
        proved(loaded(), [0.5])
