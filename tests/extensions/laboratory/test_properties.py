"""Random closed loops of every joint type, written otherwise: moved, turned, scaled, shuffled,
renamed. The motion is the same.

No oracle, and no tolerance by experience: hardpoints are doubles, so that a motion is known to what
the rounding of its hardpoints changes it by. That is measured for each loop, by shifting all of
them by known amounts.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from kincheck import PointCoordinate, Sine, adapters
from kincheck.core.extensions.laboratory.stress.families.base import bodies, swept
from kincheck.core.extensions.laboratory.stress.families.loops import random_mechanism
from kincheck.core.extensions.laboratory.stress.verdicts import with_numpy_executor
from scipy.spatial.transform import Rotation

from ...support import mechanisms

ENGINE = with_numpy_executor(adapters.engine("native"))
LOOPS, LARGEST, SAMPLES = 8, 5, 5
# The part of the loop's own reach that is driven: far from where it may lock up, and where rounding
# is magnified without bound.
PART = 0.05
SHIFT = 1e-7
# Random shifts add up as their root, roundings may all go to the worse side: of a hundred numbers
# that is ten times as far. And each is rounded some ten times: when it is written otherwise
# (turned: three products and sums), and in the equations, twice.
MARGIN = 100.0
EPS = 2.2e-16


def loop(seed):
    """A random loop as a case, a little way to both sides of its design position."""
    rng = np.random.default_rng(seed)
    mechanism, reach = random_mechanism(rng, lambda: bodies(rng, LARGEST))
    motions = {d.name: Sine(PART * 0.1 * reach, 0.7) for d in mechanism.drivers[1:]}
    ends = -PART * reach, PART * reach
    return swept("loop", mechanism, None, *ends, SAMPLES, motions=motions).case


@cache
def known(seed):
    """A random loop, its motion, and what rounding of hardpoints and axes may change that by, shape
    (3,): by its derivatives.
    """
    case, rng = loop(seed), np.random.default_rng(seed)
    expected = motion(case)
    if expected is None:
        return case, None, None

    def shifted(a):
        return tuple(np.add(a, SHIFT * rng.uniform(-1.0, 1.0, 3)).tolist())

    found = motion(placed(case, shifted, shifted))
    change = np.zeros(3) if found is None else np.abs(found - expected).max(axis=(0, 2, 3))
    own = np.abs(expected).max(axis=(0, 2, 3))
    # an acceleration of zero is a difference of numbers of this size
    own[2] = max(own[2], own[1] ** 2 / own[0])
    return case, expected, MARGIN * EPS * (change / SHIFT + own)


def motion(case):
    """Position, velocity and acceleration of all points, shape (points, 3, n, 3); None where the
    loop locks up on the way.
    """
    found = ENGINE.solve(ENGINE.build(case), case, 1e-12)
    if not found.solved.all():
        return None
    order = [point.name for point in case.mechanism.points]
    return np.array(
        [
            [found.points[p].position, found.points[p].velocity, found.points[p].acceleration]
            for p in order
        ]
    )


def placed(case, where, turned=tuple, factor=1.0):
    """The case with its points sent through `where`, its directions through `turned`, its lengths
    multiplied by the factor.
    """
    m = mechanisms.placed(case.mechanism, where, turned, factor)
    mechanism = replace(
        m,
        drivers=[
            replace(d, direction=turned(d.direction)) if isinstance(d, PointCoordinate) else d
            for d in m.drivers
        ],
        couplers=[each.scaled(factor) for each in m.couplers],
    )
    by = {driver.name: 1.0 if driver.type == "joint_angle" else factor for driver in m.drivers}
    sweep, swept = case.sweep, by[case.sweep.driver]
    motions = {
        name: replace(each, amplitude=by[name] * each.amplitude)
        for name, each in sweep.motions.items()
    }
    sweep = replace(sweep, values=swept * sweep.values, rate=swept * sweep.rate, motions=motions)
    return replace(case, mechanism=mechanism, sweep=sweep)


def assert_same(found, expected, allowed):
    assert found is not None
    off = np.abs(found - expected).max(axis=(0, 2, 3))
    assert (off <= allowed).all(), off / allowed


def for_random_loops(test):
    """The same few in every run, and for every property: most of the time goes into what their
    rounding may change.
    """

    def on_loop(seed):
        case, expected, allowed = known(seed)
        if expected is not None:
            test(np.random.default_rng(seed), case, expected, allowed)

    run = settings(derandomize=True, max_examples=LOOPS, deadline=None, phases=[Phase.generate])
    return run(given(seed=st.integers(0, LOOPS - 1))(on_loop))


@pytest.mark.nightly
@for_random_loops
def test_random_loop_moved_rigidly(rng, case, expected, allowed):
    turn, shift = Rotation.random(random_state=rng), rng.normal(size=3)

    def turned(a):
        return tuple(turn.apply(a).tolist())

    def moved(p):
        return tuple((turn.apply(p) + shift).tolist())

    found = motion(placed(case, moved, turned))
    found[:, 0] -= shift
    assert_same(turn.inv().apply(found.reshape(-1, 3)).reshape(found.shape), expected, allowed)


@for_random_loops
def test_random_loop_scaled(rng, case, expected, allowed):
    """From a tenth of a millimetre to kilometres; not by powers of two, so that every number is
    rounded anew.
    """
    factor = 10.0 ** rng.uniform(-4.0, 4.0)
    found = motion(placed(case, lambda p: tuple((factor * np.array(p)).tolist()), factor=factor))
    assert_same(found / factor, expected, allowed)


@for_random_loops
def test_random_loop_shuffled_and_renamed(rng, case, expected, allowed):
    m = case.mechanism
    words = {
        name: f"{k} {name[::-1]}"
        for k, name in enumerate(rng.permutation([each.name for each in (*m.bodies, *m.joints)]))
    }
    words["ground"] = "ground"

    def shuffled(parts):
        return [parts[k] for k in rng.permutation(len(parts))]

    mechanism = replace(
        m,
        bodies=shuffled([replace(body, name=words[body.name]) for body in m.bodies]),
        joints=shuffled(
            [
                replace(each, name=words[each.name], i=words[each.i], j=words[each.j])
                for each in m.joints
            ]
        ),
        points=[replace(point, body=words[point.body]) for point in m.points],
        drivers=shuffled(
            [replace(d, joint=words[d.joint]) if hasattr(d, "joint") else d for d in m.drivers]
        ),
        couplers=shuffled(
            [
                replace(each, joints=tuple(words[name] for name in each.joints))
                for each in m.couplers
            ]
        ),
    )
    assert_same(motion(replace(case, mechanism=mechanism)), expected, allowed)


@for_random_loops
def test_random_loop_with_reversed_joints(rng, case, expected, allowed):
    """Of those that are the same both ways; where a joint is driven or coupled, it is the sign of
    its coordinate.
    """
    m = case.mechanism
    signed = {name for each in m.couplers for name in each.joints} | {
        getattr(driver, "joint", "") for driver in m.drivers
    }
    joints = [
        joint.reversed() if joint.symmetric and joint.name not in signed else joint
        for joint in m.joints
    ]
    found = motion(replace(case, mechanism=replace(m, joints=joints)))
    assert_same(found, expected, allowed)


@for_random_loops
def test_random_loop_at_other_speed(rng, case, expected, allowed):
    speed = float(rng.uniform(-3.0, 3.0))
    motions = {
        name: Sine(each.amplitude, speed * each.frequency)
        for name, each in case.sweep.motions.items()
    }
    found = motion(
        replace(case, sweep=replace(case.sweep, rate=speed * case.sweep.rate, motions=motions))
    )
    powers = np.array([1.0, speed, speed**2])
    assert_same(found / powers[:, None, None], expected, allowed)


def test_random_loops_cover_joint_types():
    """Else the properties would hold of nothing."""
    found = [known(seed) for seed in range(LOOPS)]
    types = {joint.type for case, _, _ in found for joint in case.mechanism.joints}
    assert len(types) >= 12
    assert sum(expected is not None for _, expected, _ in found) >= 7
