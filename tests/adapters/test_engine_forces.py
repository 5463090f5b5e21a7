"""Forces of every engine: against closed forms, the native engine, free bodies, and mistakes."""

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
from kincheck import (
    GROUND,
    Body,
    Cylindrical,
    Gear,
    JointAngle,
    Mechanism,
    Planar,
    Polynomial,
    Revolute,
    Screw,
    Translational,
    cases,
)
from kincheck.core.case.case import TIME, Sweep

from ..support.driven_chains import (
    COUPLINGS,
    Link,
    Swing,
    chain,
    deviation,
    direction,
    heavy,
    pushed_slide,
)
from ..support.engine_forces import Beside, force_case, pushed, sweep_case, values
from ..support.engine_motion import SIMULATORS, installed, way_by_day
from ..support.joint_loops import TYPES, on_crank
from ..support.loads import loaded
from ..support.mechanisms import ORIGIN

TIMES = np.array([-0.5, 0.0, 0.7])
# Of the travel for which the mechanism is made: most meet no singular pose there.
NEAR = 0.15
KINDS = (Revolute, Translational, Translational, Cylindrical, Screw)


def random_case(seed):
    """A mechanism with masses, springs and loads, all its forces as outputs."""
    random_mechanism = pytest.importorskip(
        "kincheck.core.extensions.laboratory.stress.families.loops"
    ).random_mechanism
    random_arm = pytest.importorskip(
        "kincheck.core.extensions.laboratory.stress.families.arms"
    ).random_arm
    rng = np.random.default_rng(seed)
    if rng.random() < 0.4:
        mechanism, _ = random_arm(rng, int(rng.integers(2, 6)), KINDS)
        reach = 1.0
    else:
        mechanism, reach = random_mechanism(rng, lambda: int(rng.integers(2, 7)), most=3)
    mechanism = _curved(rng, _turned_round(rng, mechanism))
    bodies = [heavy(rng, body.name, _near(mechanism, body)) for body in mechanism.bodies]
    gravity = tuple(9.81 * direction(rng))
    mechanism = pushed(replace(mechanism, bodies=bodies, gravity=gravity), seed)
    motions = {
        driver.name: Swing(NEAR * reach * rng.uniform(0.5, 1.0), rng.uniform(0.5, 3.0))
        for driver in mechanism.drivers
    }
    return sweep_case(mechanism, Sweep(TIME, TIMES, motions=motions))


def _near(mechanism, body):
    """A point of a joint of the body; some bodies have none."""
    points = [point for joint in mechanism.joints for point in joint.points_on(body.name)]
    return np.array(points[0] if points else (0.2, 0.1, -0.3))


def _turned_round(rng, mechanism):
    """The first and the second body exchanged in some joints; in all coupled ones or in none."""
    coupled = {name for coupler in mechanism.couplers for name in coupler.joints}
    both = rng.random() < 0.5
    joints = [
        joint.reversed() if (both if joint.name in coupled else rng.random() < 0.5) else joint
        for joint in mechanism.joints
    ]
    return replace(mechanism, joints=joints)


def _curved(rng, mechanism):
    """Some gears and racks as polynomials with the same slope at the design."""
    couplers = []
    for each in mechanism.couplers:
        if rng.random() < 0.5:
            couplers.append(each)
            continue
        is_gear = isinstance(each, Gear)
        joints = each.joints if is_gear else each.joints[::-1]
        freedoms = ("rotation" if is_gear else "translation", "rotation")
        law = (0.0, each.ratio if is_gear else each.radius, *rng.uniform(-0.3, 0.3, 3).tolist())
        couplers.append(Polynomial(each.name, joints, law, freedoms=freedoms))
    return replace(mechanism, couplers=couplers)


ENGINES = SIMULATORS
# Of the largest force. Exudyn has no acceleration: it is a difference of Jacobians.
AGREE = dict.fromkeys(["native", *ENGINES], 1e-12) | {"exudyn": 1e-9}
OF_ENGINES = pytest.mark.parametrize("engine", ENGINES)


@cache
def natively(make, *given):
    case = make(*given)
    return case, values(case, "native")[0]


def assert_as_native(engine, make, *given, least=0.0):
    """The forces are those of the native engine; return both, and the engine's trajectory."""
    case, native = natively(make, *given)
    found, solution = values(case, engine)
    compared = Beside(native, found)
    assert compared.same_missing
    assert compared.worst <= max(AGREE[engine], least)
    return compared, solution


def joint_case(kind, bodies):
    """A joint of that kind in a loop, with masses and force elements of all types."""
    return force_case(pushed(loaded(on_crank(kind, *bodies))), (-0.3, 0.0, 0.2), rate=2.0)


def in_loops(engines, kinds, orders):
    """Every joint in every engine: by day with the order of bodies that its motion is not solved
    in, see `way_by_day`.
    """
    found = []
    for engine, kind, order in product(engines, kinds, orders):
        daily = (order == "AB") == (way_by_day(engine, kind) > 1)
        marks = () if daily else pytest.mark.nightly
        found.append(pytest.param(kind, order, engine, marks=marks))
    return found


@pytest.mark.by_day(3)
@pytest.mark.parametrize(("kind", "bodies", "engine"), in_loops(ENGINES, TYPES, ["AB", "BA"]))
def test_joint_reactions_equal_native(kind, bodies, engine):
    _, solution = assert_as_native(engine, joint_case, kind, bodies)
    assert solution.details["forces"]["power_missing"] <= 1e-10
    assert solution.details["forces"]["computed_by"]


def pendulum(length=0.75, at=ORIGIN):
    """A pendulum about y, its mass beside the hinge along x at design; gravity along -z."""
    x, y, z = at
    body = Body("arm", at, mass=2.0, center_of_mass=(x + length, y, z), inertia=(1, 1, 1, 0, 0, 0))
    hinge = Revolute("hinge", GROUND, "arm", point=at, axis=(0.0, -1.0, 0.0))
    return Mechanism(
        *("pendulum", [body], [hinge]),
        drivers=[JointAngle("swing", "hinge")],
        gravity=(0.0, 0.0, -10.0),
    )


@pytest.mark.parametrize("engine", AGREE)
@pytest.mark.parametrize(("length", "at"), [(0.75, ORIGIN), (96.0, (1e3, 0.0, -5e2))])
def test_reactions_of_pendulum_are_exact(engine, length, at):
    """F = m (a - g); the torque lifts the mass."""
    angle, rate = np.array([-0.5, 0.0, 1.0]), 3.0
    case = force_case(pendulum(length, at), angle, rate)
    found = values(case, engine)[0]
    m, g = 2.0, 10.0
    pull = -m * length * rate**2
    expected = np.zeros((7, 3))
    expected[0], expected[2] = pull * np.cos(angle), pull * np.sin(angle) + m * g
    expected[6] = m * g * length * np.cos(angle)
    largest = np.abs(expected).max()
    np.testing.assert_allclose(found, expected, rtol=0, atol=AGREE[engine] * largest)


def built_in_case(name):
    case = cases.load(name)
    few = case.sweep.values[:: len(case.sweep.values) // 4]
    return sweep_case(loaded(case.mechanism), replace(case.sweep, values=few))


@OF_ENGINES
@pytest.mark.parametrize("name", ["four_bar", "bennett", "mcpherson_strut"])
def test_undetermined_reactions_equal_native(name, engine):
    compared, _ = assert_as_native(engine, built_in_case, name)
    assert np.isnan(compared.native).any() == (name != "mcpherson_strut")


@OF_ENGINES
def test_forces_absent_without_force_outputs(engine):
    plain, given = cases.load("mcpherson_strut"), installed(engine)
    case = replace(plain, mechanism=loaded(plain.mechanism))
    found, bare = (given.solve(given.build(each), each, 1e-12) for each in (case, plain))
    assert found.forces is None
    assert found.details == bare.details
    for name, motion in bare.points.items():
        np.testing.assert_array_equal(found.points[name].acceleration, motion.acceleration)


# Mistakes


# Where drivers and couplers act in every engine, against free-body diagrams


HINGE = Link(Revolute)
DRIVEN = {
    "translational": Link(Translational),
    "cylindrical": Link(Cylindrical),
    "screw, by its turn": Link(Screw),
    "screw, by its slide": Link(Screw, screws_by="translation"),
}
CHAINS = {
    "planar joint": chain([Link(Planar, flipped=True), HINGE]),
    "pushed point": pushed_slide(Link(Translational)),
    "pushed point, flipped": pushed_slide(Link(Translational, flipped=True)),
}
for name, link in DRIVEN.items():
    CHAINS[name] = chain([HINGE, link, HINGE], size=2.0)
    CHAINS[f"{name}, flipped"] = chain([HINGE, replace(link, flipped=True), HINGE], size=2.0)
for name, (one, other, coupling) in COUPLINGS.items():
    CHAINS[name] = chain([HINGE, replace(one, flipped=True), other], coupling, size=0.8)


@pytest.mark.parametrize("engine", AGREE)
@pytest.mark.by_day(3)
@pytest.mark.parametrize("name", CHAINS)
def test_driver_efforts_equal_free_bodies(name, engine):
    made = CHAINS[name]
    sweep = Sweep(TIME, made.path.times, motions=made.path.motions)
    _, solution = values(sweep_case(made.mechanism, sweep), engine)
    assert deviation(made, solution.forces) < AGREE[engine]


# Forces of random mechanisms with slides, screws, racks and polynomials, in every engine


# Arms and loops; racks in 1, 21 and 37, polynomials in 9, 27, 45 and 63, a gear in 45.
SEEDS = (0, 1, 9, 21, 24, 27, 32, 37, 45, 63)


@pytest.mark.by_day(2)
@OF_ENGINES
@pytest.mark.parametrize("seed", SEEDS)
def test_forces_of_random_mechanisms_equal_native(seed, engine):
    # of the largest force: round-off over a smallest singular value of a hundredth
    compared, _ = assert_as_native(engine, random_case, seed, least=1e-11)
    assert np.isfinite(compared.native).all()
