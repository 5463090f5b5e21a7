"""Forces of every engine: against closed forms, the native engine, free bodies, and mistakes."""

from dataclasses import replace
from functools import cache
from pkgutil import resolve_name
from types import SimpleNamespace

import numpy as np
import pytest
from kincheck import adapters, cases
from kincheck.core.case.case import TIME, Case, Sweep, Truth
from kincheck.core.case.quantity import with_markers
from kincheck.core.joints import (
    Cylindrical,
    Fixed,
    Gear,
    Planar,
    Polynomial,
    RackPinion,
    Revolute,
    Screw,
    Translational,
)
from kincheck.core.mechanism.body import Body
from kincheck.core.mechanism.loads import TorsionSpringDamper
from kincheck.core.mechanism.mechanism import GROUND, Mechanism
from kincheck.core.mechanism.motions import JointAngle
from kincheck.core.studies.stress.families.arms import random_arm
from kincheck.core.studies.stress.families.loops import random_mechanism

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
from ..support.engine_forces import Beside, every_force, force_case, pushed, values
from ..support.joint_loops import TYPES, crank_only, on_crank
from ..support.loads import loaded

TIMES = np.array([-0.5, 0.0, 0.7])
# Of the travel for which the mechanism is made: most meet no singular pose there.
NEAR = 0.15
KINDS = (Revolute, Translational, Translational, Cylindrical, Screw)


def random_case(seed):
    """A mechanism with masses, springs and loads, all its forces as outputs."""
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
    outputs = every_force(mechanism)
    return Case(
        f"random {seed}",
        "made here",
        Truth.CONSENSUS_ONLY,
        with_markers(mechanism, outputs),
        Sweep(TIME, TIMES, motions=motions),
        outputs,
    )


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


ENGINES = ["exudyn", "mujoco", "pinocchio", "dart", "drake", "simbody"]
# Of the largest force. Exudyn has no acceleration: it is a difference of Jacobians.
AGREE = dict.fromkeys(ENGINES, 1e-12) | {"exudyn": 1e-9}


def here(engine):
    if adapters.engine(engine).version() is None:
        pytest.skip(f"{engine} is not installed")
    return engine


@cache
def specimen(kind, bodies):
    """A joint of that kind in a loop, with masses and force elements of all types, and its forces
    by the native engine.
    """
    case = force_case(pushed(loaded(on_crank(kind, *bodies))), (-0.3, 0.0, 0.2), rate=2.0)
    return case, values(case, "native")[0]


NIGHTLY = pytest.mark.nightly  # the other order of bodies, in the engines on the shared tree


@pytest.mark.parametrize(
    ("engine", "bodies"),
    [
        *((engine, ("A", "B")) for engine in ENGINES),
        *((engine, ("B", "A")) for engine in ENGINES[:3]),
        *(pytest.param(engine, ("B", "A"), marks=NIGHTLY) for engine in ENGINES[3:]),
    ],
)
@pytest.mark.parametrize("kind", TYPES)
def test_joint_reactions_equal_native(kind, bodies, engine):
    case, native = specimen(kind, bodies)
    found, solution = values(case, here(engine))
    compared = Beside(native, found)
    assert compared.same_missing
    assert compared.worst <= AGREE[engine]
    assert solution.details["forces"]["power_missing"] <= 1e-10
    assert solution.details["forces"]["computed_by"]


@pytest.mark.parametrize("engine", ["mujoco", "pinocchio"])
@pytest.mark.parametrize("kind", TYPES)
def test_reactions_of_cut_joints_equal_native(kind, engine, monkeypatch):
    monkeypatch.setattr("kincheck.adapters.shared.tree_plan.spanning_tree", crank_only)
    case, native = specimen(kind, ("A", "B"))
    compared = Beside(native, values(case, here(engine))[0])
    assert compared.same_missing
    assert compared.worst <= AGREE[engine]


def pendulum(length=0.75, at=(0.0, 0.0, 0.0)):
    """A pendulum about y, its mass beside the hinge along x at design; gravity along -z."""
    x, y, z = at
    body = Body("arm", at, mass=2.0, center_of_mass=(x + length, y, z), inertia=(1, 1, 1, 0, 0, 0))
    hinge = Revolute("hinge", GROUND, "arm", point=at, axis=(0.0, -1.0, 0.0))
    return Mechanism(
        *("pendulum", [body], [hinge]),
        drivers=[JointAngle("swing", "hinge")],
        gravity=(0.0, 0.0, -10.0),
    )


@pytest.mark.parametrize("engine", ["native", *ENGINES])
@pytest.mark.parametrize(("length", "at"), [(0.75, (0.0, 0.0, 0.0)), (96.0, (1e3, 0.0, -5e2))])
def test_reactions_of_pendulum_are_exact(engine, length, at):
    """F = m (a - g); the torque lifts the mass."""
    angle, rate = np.array([-0.5, 0.0, 1.0]), 3.0
    case = force_case(pendulum(length, at), angle, rate)
    found = values(case, here(engine))[0]
    m, g = 2.0, 10.0
    pull = -m * length * rate**2
    expected = np.zeros((7, 3))
    expected[0], expected[2] = pull * np.cos(angle), pull * np.sin(angle) + m * g
    expected[6] = m * g * length * np.cos(angle)
    largest = np.abs(expected).max()
    np.testing.assert_allclose(found, expected, rtol=0, atol=AGREE.get(engine, 1e-12) * largest)


def geared():
    """Two wheels in mesh, a rack on the second, and a plate welded to the rack."""
    bodies = [
        Body("pinion"),
        Body("wheel", (0.5, 0.0, 0.0)),
        Body("rack", (0.5, 0.25, 0.0)),
        Body("plate", (0.5, 0.5, 0.25)),
        Body("foot", (0.0, 0.5, 0.0)),
    ]
    along, y = {"point": (0.5, 0.25, 0.0), "axis": (1.0, 0.0, 0.0)}, (0.0, 0.0, 1.0)
    return Mechanism(
        "geared",
        bodies,
        [
            Revolute("first", GROUND, "pinion", point=(0.0, 0.0, 0.0), axis=y),
            Revolute("second", "wheel", GROUND, point=(0.5, 0.0, 0.0), axis=y),
            Translational("guide", GROUND, "rack", **along),
            Fixed("weld", "plate", "rack"),
            Fixed("anchor", "foot", GROUND),
        ],
        drivers=[JointAngle("turn", "first")],
        couplers=[
            Gear("mesh", ("first", "second"), ratio=2.0),
            RackPinion("teeth", ("second", "guide"), radius=-0.25),
        ],
    )


@cache
def gear_train():
    case = force_case(pushed(loaded(geared())), (-0.4, 0.0, 7.0), rate=2.0)
    return case, values(case, "native")[0]


@pytest.mark.parametrize("engine", ENGINES)
def test_reactions_of_gear_train_equal_native(engine):
    case, native = gear_train()
    compared = Beside(native, values(case, here(engine))[0])
    assert compared.same_missing
    assert compared.worst <= AGREE[engine]


@cache
def few_samples(name):
    case = cases.load(name)
    few = case.sweep.values[:: len(case.sweep.values) // 4]
    judged = force_case(loaded(case.mechanism), few, case.sweep.rate)
    judged = replace(judged, sweep=replace(case.sweep, values=few))
    return judged, values(judged, "native")[0]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ["four_bar", "bennett", "mcpherson_strut"])
def test_undetermined_reactions_equal_native(name, engine):
    case, native = few_samples(name)
    compared = Beside(native, values(case, here(engine))[0])
    assert compared.same_missing
    assert np.isnan(compared.native).any() == (name != "mcpherson_strut")
    assert compared.worst <= AGREE[engine]


@cache
def wound_up():
    case = cases.load("four_bar")
    spring = TorsionSpringDamper("clock", "crank_pin", 2.0, damping=0.3, free_angle=0.2)
    mechanism = replace(loaded(case.mechanism), forces=[spring])
    judged = force_case(mechanism, np.linspace(0.0, 9.0, 19), case.sweep.rate, names=["crank_pin"])
    return judged, values(judged, "native")[0]


@pytest.mark.parametrize("engine", ENGINES)
def test_spring_on_cut_joint_counts_turns(engine):
    """The hinge that closes the loop turns round twice; its spring is wound up."""
    case, native = wound_up()
    compared = Beside(native, values(case, here(engine))[0])
    assert compared.worst <= AGREE[engine]
    assert np.ptp(compared.native[-1]) > 2.0 * 2.0 * np.pi


@pytest.mark.parametrize("engine", ENGINES)
def test_forces_absent_without_force_outputs(engine):
    plain, given = cases.load("mcpherson_suspension"), adapters.engine(here(engine))
    case = replace(plain, mechanism=loaded(plain.mechanism))
    found = given.solve(given.build(case), case, 1e-12)
    bare = given.solve(given.build(plain), plain, 1e-12)
    assert found.forces is None
    assert found.details == bare.details
    for name, motion in bare.points.items():
        np.testing.assert_array_equal(found.points[name].acceleration, motion.acceleration)


# Mistakes


def still(right):
    """Newton and Euler without w x I w."""

    def mistaken(body, frame, gravity):
        seen = SimpleNamespace(acceleration=frame.acceleration, rotation=frame.rotation)
        seen.velocity = np.zeros(6)
        return right(body, seen, gravity)

    return mistaken


def upwards(right):
    return lambda self, gravity, masses: right(self, tuple(-g for g in gravity), masses)


def other_axes(right):
    """Products of inertia with the other sign."""

    def mistaken(body, origin):
        mass, center, inertia = right(body, origin)
        return mass, center, 2.0 * np.diag(np.diag(inertia)) - inertia

    return mistaken


def unshared(right):
    return lambda mechanism, rows: {joint.name: [] for joint in mechanism.joints}


MISTAKES = {
    "gravity upwards, pinocchio": ("pinocchio.pinocchio.PinocchioModel.set_loads", upwards),
    "gravity upwards, mujoco": ("mujoco.mujoco.MuJoCoModel.set_loads", upwards),
    "gravity upwards, dart": ("dart.dart.DartModel.set_loads", upwards),
    "gravity upwards, drake": ("drake.drake.DrakeModel.set_loads", upwards),
    "gravity upwards, simbody": ("simbody.simbody.SimbodyModel.set_loads", upwards),
    "no gyroscopic term, drake": ("shared.tree_forces.demand_of", still),
    "no gyroscopic term, simbody": ("shared.tree_forces.demand_of", still),
    "inertia in other axes, pinocchio": ("pinocchio.pinocchio.mass_properties", other_axes),
    "inertia in other axes, mujoco": ("mujoco.mujoco.mass_properties", other_axes),
    "inertia in other axes, exudyn": ("exudyn.rows.mass_properties", other_axes),
    "moment about the origin, pinocchio": (
        "shared.tree_forces.from_origin",
        lambda right: lambda point: right(0.0 * point),
    ),
    "moment about the origin, exudyn": (
        "exudyn.exudyn.Loads._rates",
        lambda right: lambda self, body, point: right(self, body, 0.0 * point),
    ),
    "reaction on the first body, mujoco": (
        "shared.tree_forces.Site.reaction",
        lambda right: lambda self, *given: tuple(-each for each in right(self, *given)),
    ),
    "driver's torque in the reaction, pinocchio": ("shared.tree_forces.of_relations", unshared),
    "inertia at the body's frame, mujoco": (
        "mujoco.mujoco.mass_properties",
        lambda right: lambda body, origin: (body.mass, *right(body, np.array(body.origin))[1:]),
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_planted_force_mistake_is_found(mistake, monkeypatch):
    engine, (where, wrong) = here(mistake.split(", ")[1]), MISTAKES[mistake]
    case, native = specimen("universal", ("A", "B"))
    target = f"kincheck.adapters.{where}"
    monkeypatch.setattr(target, wrong(resolve_name(target)))
    assert Beside(native, values(case, engine)[0]).worst > 1e-4


# Where drivers and couplers act in every engine, against free-body diagrams


AGREE_ACTION = {"native": 1e-12} | AGREE
HINGE = Link(Revolute)
DRIVEN = {
    "translational": Link(Translational),
    "cylindrical": Link(Cylindrical),
    "screw, by its turn": Link(Screw),
    "screw, by its slide": Link(Screw, screws_by="translation"),
}


def forces(made, engine):
    outputs = every_force(made.mechanism)
    sweep = Sweep(TIME, made.path.times, motions=made.path.motions)
    mechanism = with_markers(made.mechanism, outputs)
    case = Case("chain", "made here", Truth.CONSENSUS_ONLY, mechanism, sweep, outputs)
    given = adapters.engine(here(engine))
    assert given.unsupported(case) is None
    found = given.solve(given.build(case), case, 1e-12)
    assert found.solved.all(), found.message
    return found.forces


@pytest.mark.parametrize("engine", AGREE_ACTION)
@pytest.mark.parametrize("flipped", [False, True], ids=["", "flipped"])
@pytest.mark.parametrize("kind", DRIVEN)
def test_effort_of_driven_slide(kind, flipped, engine):
    made = chain([HINGE, replace(DRIVEN[kind], flipped=flipped), HINGE], size=2.0)
    assert deviation(made, forces(made, engine)) < AGREE_ACTION[engine]


@pytest.mark.parametrize("engine", AGREE_ACTION)
def test_effort_of_driven_planar_joint(engine):
    made = chain([Link(Planar, flipped=True), HINGE])
    assert deviation(made, forces(made, engine)) < AGREE_ACTION[engine]


@pytest.mark.parametrize("engine", AGREE_ACTION)
@pytest.mark.parametrize("flipped", [False, True], ids=["", "flipped"])
def test_effort_of_pushed_point(flipped, engine):
    made = pushed_slide(Link(Translational, flipped=flipped))
    assert deviation(made, forces(made, engine)) < AGREE_ACTION[engine]


@pytest.mark.parametrize("engine", AGREE_ACTION)
@pytest.mark.parametrize("name", COUPLINGS)
def test_effort_of_coupled_joint(name, engine):
    one, other, coupling = COUPLINGS[name]
    links = [HINGE, replace(one, flipped=True), other]
    made = chain(links, coupling, size=0.8)
    assert deviation(made, forces(made, engine)) < AGREE_ACTION[engine]


# Forces of random mechanisms with slides, screws, racks and polynomials, in every engine


# Of the largest force: round-off over a smallest singular value of a hundredth.
AGREE_MECHANISMS = {name: max(limit, 1e-11) for name, limit in AGREE.items()}
# Arms and loops; racks in 1, 21 and 37, polynomials in 9, 27, 45 and 63, a gear in 45.
SEEDS = (0, 1, 9, 21, 24, 27, 32, 37, 45, 63)


@cache
def native(seed):
    case = random_case(seed)
    return case, values(case, "native")[0]


@pytest.mark.parametrize("engine", AGREE_MECHANISMS)
@pytest.mark.parametrize("seed", SEEDS)
def test_forces_of_random_mechanisms_equal_native(seed, engine):
    case, expected = native(seed)
    compared = Beside(expected, values(case, here(engine))[0])
    assert np.isfinite(expected).all()
    assert compared.same_missing
    assert compared.worst < AGREE_MECHANISMS[engine]
