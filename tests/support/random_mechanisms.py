"""Random mechanisms with forces: arms and closed loops of every joint type, driven anywhere.

A seed makes the same mechanism anywhere. Their joints and drivers are independent at the design by
the conditions of the stress run, which share nothing with the rows of the solver.
"""

from dataclasses import replace

import numpy as np
from kincheck.core.case.case import TIME, Case, Sweep, Truth
from kincheck.core.case.quantity import with_markers
from kincheck.core.joints import Cylindrical, Gear, Polynomial, Revolute, Screw, Translational
from kincheck.core.studies.stress.families.arms import random_arm
from kincheck.core.studies.stress.families.loops import random_mechanism

from .driven_chains import Swing, direction, heavy
from .engine_forces import every_force, pushed

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
