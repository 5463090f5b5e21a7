"""Mechanisms that are written as models, each with the end of its sweep."""

from dataclasses import replace
from functools import cache

import numpy as np
from kincheck import (
    Body,
    Case,
    Cylindrical,
    Distance,
    Gear,
    JointAngle,
    Mechanism,
    Point,
    RackPinion,
    Revolute,
    Screw,
    Spherical,
    Translational,
    Universal,
)
from kincheck.core.case.case import Sweep, Truth
from kincheck.core.case.joint_probe import probes
from kincheck.core.extensions.exports.model_writer import way_to

from ..joints.test_planar_drive import ladder
from ..oracles import naive
from .mechanisms import ORIGIN, X, Z, four_bar, mcpherson, slider_crank, swapped

# Roundings of numbers of a few metres: some twenty of 2.2e-16 each, through a chain of ten bodies
# at most.
ROUND_OFF = 5e-15


def case(mechanism, stop):
    return Case(
        mechanism.name,
        "made up",
        Truth.CONSENSUS_ONLY,
        mechanism,
        Sweep(mechanism.drivers[0].name, np.array([stop])),
        (),
    )


def rssr():
    """With the rod as a body that cannot spin: the cross at its end is rounded off the right angle,
    as tables do.
    """
    ends = (X, (2.0, 4.9, 2.2))
    rod = np.subtract(ends[1], ends[0])
    across = np.cross(rod, (0.3, -0.2, 1.0))
    return Mechanism(
        "rssr",
        [
            Body("crank", (0.2, 0.1, 0.0), (0.8, 0.0, 0.6, 0.0)),
            Body("rod", ends[0], (0.5, 0.5, -0.5, 0.5)),
            Body("rocker", ends[1]),
        ],
        [
            Revolute("input", "ground", "crank", ORIGIN, Z),
            Revolute("output", "ground", "rocker", (2.0, 1.0, 3.0), X),
            Spherical("ball", "crank", "rod", ends[0]),
            Universal(
                "cross",
                "rocker",
                "rod",
                ends[1],
                (tuple(np.round(across, 1)), tuple(np.cross(rod, across))),
            ),
        ],
        [Point("end", "rocker", ends[1])],
        [JointAngle("turn", "input")],
    )


def gear_train():
    """Turned several times: a pinion on a screw, whose nut is kept from turning, with a rack and a
    further wheel.
    """
    return Mechanism(
        "gear_train",
        [
            Body("bed", fixed=True, origin=(0.0, 0.5, 0.0)),
            Body("pinion"),
            Body("rack"),
            Body("nut", (0.1, 0.2, 0.3)),
            Body("wheel"),
        ],
        [
            Revolute("shaft", "ground", "pinion", ORIGIN, Z),
            Translational("guide", "rack", "bed", (0.0, 0.1, 0.0), X),
            Translational("key", "ground", "nut", (0.3, 0.0, 0.5), Z),
            Screw("thread", "nut", "pinion", (0.0, 0.0, 0.5), Z, 0.01),
            Cylindrical("bearing", "wheel", "bed", (0.7, 0.0, 0.2), Z),
            Distance("stop", "wheel", "bed", ((0.7, 0.0, 0.2), (0.7, 0.0, 1.2))),
        ],
        [Point("rim", "wheel", (1.0, 0.0, 0.2)), Point("edge", "nut", (0.2, 0.0, 0.5))],
        [JointAngle("turn", "shaft")],
        [RackPinion("mesh", ("shaft", "guide"), 0.02), Gear("pair", ("shaft", "bearing"), -1.7)],
    )


def coupled_loop():
    """Two four-bars whose coupled joints close their loops, so that their coordinates are not those
    of a tree.
    """
    one = four_bar()
    names = {body.name: f"{body.name}_2" for body in one.bodies} | {"ground": "ground"}
    other = [
        replace(joint, name=f"{joint.name}2", i=names[joint.i], j=names[joint.j])
        for joint in one.joints
    ]
    bodies = [*one.bodies, *(replace(body, name=names[body.name]) for body in one.bodies)]
    couplers = [
        Gear(f"{name}_{joint}", (joint, f"{joint}2"), 1.0)
        for name, joint in (("pair", "A"), ("again", "B"), ("again", "C"), ("again", "D"))
    ]
    return replace(
        one,
        name="coupled_loop",
        bodies=bodies,
        joints=[*one.joints, *other],
        couplers=[*one.couplers, *couplers],
    )


CASES = {
    each.name: each
    for each in (
        case(mcpherson(), 0.08),
        case(replace(swapped(mcpherson()), name="strut_swapped"), -0.05),
        case(four_bar(), -2.0),
        case(slider_crank(), 15.0),
        case(rssr(), 2.5),
        case(gear_train(), 150.0),
        case(coupled_loop(), 5.0),
        case(ladder(("ladder", "ground"), Z), 8.0),
        *probes(),
    )
}


@cache
def way(name, elsewhere):
    each = CASES[name]
    return way_to(each, float(each.sweep.values[-1]) if elsewhere else 0.0)


def assert_read(found, mechanism, path, elsewhere):
    """It closes, is as free as it has drivers (so nothing is missing that would have to close), and
    is where it should be.
    """
    assert np.abs(found.residuals).max(initial=0.0) <= ROUND_OFF * (10.0 if elsewhere else 1.0)
    assert found.freedom == len(mechanism.drivers)
    for body in mechanism.moving:
        r, A = found.bodies[body.name]
        assert np.abs(r - path[body.name].r[-1]).max() <= 10.0 * ROUND_OFF
        assert np.abs(A - naive.A(path[body.name].p[-1])).max() <= 10.0 * ROUND_OFF
    for point in mechanism.points:
        body = mechanism.body(point.body)
        start = naive.Body(np.array(body.origin), np.array(body.euler_parameters))
        now = naive.Body(path[body.name].r[-1], path[body.name].p[-1])
        expected = now.r + now.A @ start.A.T @ (np.array(point.position) - start.r)
        assert np.abs(found.points[point.name] - expected).max() <= 10.0 * ROUND_OFF
