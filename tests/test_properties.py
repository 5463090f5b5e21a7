"""Random closed loops of every joint type, written otherwise: moved, turned, scaled, shuffled, renamed. The motion is the same.

No oracle, and no tolerance by experience: hardpoints are doubles, so that a motion is known to what the rounding of its hardpoints
changes it by. That is measured for each loop, by shifting all of them by known amounts.
"""

from dataclasses import fields, replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from kincheck import adapters
from kincheck.core import PointCoordinate
from kincheck.core.harness.stress.families.loops import Loops
from kincheck.core.harness.stress.solving import Interpreted
from kincheck.core.joints import Kind
from kincheck.core.motions import Sine
from scipy.spatial.transform import Rotation

ENGINE = Interpreted(adapters.engine("native"))
LARGEST, SAMPLES = 8, 5
# The part of the loop's own reach that is driven: far from where it may lock up, and where rounding is magnified without bound.
PART = 0.2
SHIFT, SHIFTS = 1e-7, 4
# Rounding of all hardpoints together is no worse than the largest of a few random shifts of the same size, times this: each of up
# to a hundred numbers is rounded several times on the way (turned: three products and sums), here and there.
MARGIN = 30.0
EPS = 2.2e-16


def loop(seed):
    """A random loop as a case, a little way to both sides of its design position."""
    rng = np.random.default_rng(seed)
    while True:
        specimen = Loops().specimen(rng, SAMPLES)
        if dict(specimen.facts)["bodies"] <= LARGEST:
            case = specimen.describe()
            motions = {name: replace(motion, amplitude=PART * motion.amplitude) for name, motion in case.sweep.motions.items()}
            return replace(case, sweep=replace(case.sweep, values=PART * case.sweep.values, motions=motions))


def motion(case):
    """Position, velocity and acceleration of all points, shape (points, 3, n, 3); None where the loop locks up on the way."""
    found = ENGINE.solve(ENGINE.build(case), case, 1e-12)
    if not found.solved.all():
        return None
    order = [point.name for point in case.mechanism.points]
    return np.array([[found.points[p].position, found.points[p].velocity, found.points[p].acceleration] for p in order])


def placed(case, where, turned=tuple, factor=1.0):
    """The case with its points sent through `where`, its directions through `turned`, its lengths multiplied by the factor."""
    ways = {
        Kind.POSITION: where,
        Kind.POSITIONS: lambda pair: tuple(map(where, pair)),
        Kind.DIRECTION: turned,
        Kind.DIRECTIONS: lambda pair: tuple(map(turned, pair)),
        Kind.LENGTH: lambda length: factor * length,
    }

    def sent(part):
        given = {each.name: (each.metadata["kind"], getattr(part, each.name)) for each in fields(part) if "kind" in each.metadata}
        return replace(part, **{name: ways[kind](value) for name, (kind, value) in given.items() if value is not None})

    m = case.mechanism
    mechanism = replace(
        m,
        bodies=[replace(body, origin=where(body.origin)) for body in m.bodies],
        joints=[*map(sent, m.joints)],
        points=[replace(point, position=where(point.position)) for point in m.points],
        drivers=[replace(d, direction=turned(d.direction)) if isinstance(d, PointCoordinate) else d for d in m.drivers],
        couplers=[*map(sent, m.couplers)],
    )
    by = {driver.name: 1.0 if driver.type == "joint_angle" else factor for driver in m.drivers}
    sweep, swept = case.sweep, by[case.sweep.driver]
    motions = {name: replace(each, amplitude=by[name] * each.amplitude) for name, each in sweep.motions.items()}
    sweep = replace(sweep, values=swept * sweep.values, rate=swept * sweep.rate, motions=motions)
    return replace(case, mechanism=mechanism, sweep=sweep)


def limits(case, expected, seed):
    """What rounding of hardpoints and axes by 1e-16 of their size may change the motion by, shape (3,): by its derivatives."""
    rng = np.random.default_rng(seed)

    def shifted(a):
        return tuple(np.add(a, SHIFT * rng.uniform(-1.0, 1.0, 3)).tolist())

    changes = [motion(placed(case, shifted, shifted)) for _ in range(SHIFTS)]
    changes = [np.abs(found - expected).max(axis=(0, 2, 3)) for found in changes if found is not None]
    own = np.abs(expected).max(axis=(0, 2, 3))
    return MARGIN * EPS * (np.max([*changes, np.zeros(3)], axis=0) / SHIFT + own)


def assert_same(found, expected, allowed):
    assert found is not None
    off = np.abs(found - expected).max(axis=(0, 2, 3))
    assert (off <= allowed).all(), off / allowed


def for_random_loops(examples):
    """The same seeds in every run."""

    def decorate(test):
        return settings(derandomize=True, max_examples=examples, deadline=None, database=None)(given(st.integers(0, 10**6))(test))

    return decorate


@for_random_loops(12)
def test_rigid_motion_moves_the_motion(seed):
    case = loop(seed)
    if (expected := motion(case)) is None:
        return
    turn, shift = Rotation.random(random_state=seed % 2**32), np.random.default_rng(seed).normal(size=3)

    def turned(a):
        return tuple(turn.apply(a).tolist())

    def moved(p):
        return tuple((turn.apply(p) + shift).tolist())

    found = motion(placed(case, moved, turned))
    assert found is not None
    found[:, 0] -= shift
    assert_same(turn.inv().apply(found.reshape(-1, 3)).reshape(found.shape), expected, limits(case, expected, seed))


@for_random_loops(12)
def test_size_scales_the_motion(seed):
    """From a tenth of a millimetre to kilometres; not by powers of two, so that every number is rounded anew."""
    case = loop(seed)
    if (expected := motion(case)) is None:
        return
    factor = 10.0 ** np.random.default_rng(seed).uniform(-4.0, 4.0)
    found = motion(placed(case, lambda p: tuple((factor * np.array(p)).tolist()), factor=factor))
    assert found is not None
    assert_same(found / factor, expected, limits(case, expected, seed))


@for_random_loops(12)
def test_order_and_names_do_not_matter(seed):
    case = loop(seed)
    if (expected := motion(case)) is None:
        return
    rng, m = np.random.default_rng(seed), case.mechanism
    words = {name: f"{k} {name[::-1]}" for k, name in enumerate(rng.permutation([each.name for each in (*m.bodies, *m.joints)]))}
    words["ground"] = "ground"

    def shuffled(parts):
        return [parts[k] for k in rng.permutation(len(parts))]

    mechanism = replace(
        m,
        bodies=shuffled([replace(body, name=words[body.name]) for body in m.bodies]),
        joints=shuffled([replace(each, name=words[each.name], i=words[each.i], j=words[each.j]) for each in m.joints]),
        points=[replace(point, body=words[point.body]) for point in m.points],
        drivers=shuffled([replace(d, joint=words[d.joint]) if hasattr(d, "joint") else d for d in m.drivers]),
        couplers=shuffled([replace(each, joints=tuple(words[name] for name in each.joints)) for each in m.couplers]),
    )
    assert_same(motion(replace(case, mechanism=mechanism)), expected, limits(case, expected, seed))


@for_random_loops(12)
def test_order_of_the_bodies_of_joints_does_not_matter(seed):
    """Of those that are neither driven nor coupled: there it is the sign."""
    case = loop(seed)
    if (expected := motion(case)) is None:
        return
    m = case.mechanism
    signed = {name for each in m.couplers for name in each.joints} | {getattr(driver, "joint", "") for driver in m.drivers}
    joints = [joint if joint.name in signed else joint.reversed() for joint in m.joints]
    found = motion(replace(case, mechanism=replace(m, joints=joints)))
    assert_same(found, expected, limits(case, expected, seed))


@for_random_loops(8)
def test_speed_scales_velocities_and_accelerations(seed):
    case = loop(seed)
    if (expected := motion(case)) is None:
        return
    speed = float(np.random.default_rng(seed).uniform(-3.0, 3.0))
    motions = {name: Sine(each.amplitude, speed * each.frequency) for name, each in case.sweep.motions.items()}
    found = motion(replace(case, sweep=replace(case.sweep, rate=speed * case.sweep.rate, motions=motions)))
    powers = np.array([1.0, speed, speed**2])
    assert found is not None
    assert_same(found / powers[:, None, None], expected, limits(case, expected, seed))


def test_random_loops_are_of_every_joint_type_and_most_can_be_driven():
    """Else the properties would hold of nothing."""
    cases = [loop(seed) for seed in range(12)]
    types = {joint.type for case in cases for joint in case.mechanism.joints}
    assert len(types) >= 14
    assert sum(motion(case) is not None for case in cases) >= 9
