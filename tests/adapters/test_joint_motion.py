"""Every joint in every simulator, in its tree and closing a loop, against the native engine and
closed forms.
"""

import math
from itertools import product

import numpy as np
import pytest
from kincheck import (
    Cylindrical,
    Distance,
    Fixed,
    JointAngle,
    JointDisplacement,
    PointCoordinate,
    Revolute,
    Screw,
    Sine,
    Spherical,
    Universal,
)

from ..support.engine_motion import (
    BOTH_ORDERS,
    ENGINES,
    IN_TREE_OR_CUT,
    SIMULATORS,
    TREES,
    assert_as_native,
    assert_motion,
    mechanism_of,
    ordered,
    rotation,
    solved,
    tolerances,
    way_by_day,
)
from ..support.joint_loops import RATE, TOO_LOOSE, TURN, TYPES, assert_moves_natively, on_crank
from ..support.mechanisms import ORIGIN, X, Z

TURNS = np.linspace(-7.0, 7.0, 29)
AXIS, TIP = (1.0, 2.0, -2.0), np.array([0.3, -0.2, 0.4])


def all_loops():
    """Every joint, order and cut. The day takes one of four ways for each joint and simulator, in
    turn; the reactions take the other order.
    """
    found = []
    for engine, kind, mirrored, closing in product(SIMULATORS, TYPES, (0, 1), (0, 1)):
        if engine == "exudyn" and closing:
            continue
        way = way_by_day(engine, kind)
        daily = way // 2 == mirrored and (way % 2 == closing or engine == "exudyn")
        marks = () if daily else pytest.mark.nightly
        name = f"{engine}-{kind}-{'ji' if mirrored else 'ij'}-{'cut' if closing else 'tree'}"
        given = engine, kind, "BA" if mirrored else "AB", bool(closing)
        found.append(pytest.param(*given, id=name, marks=marks))
    return found


@pytest.mark.by_day(3)
@pytest.mark.parametrize(("engine", "kind", "bodies", "closing"), all_loops())
def test_joint_in_loop_moves_as_native(engine, kind, bodies, closing):
    mechanism = on_crank(kind, *bodies)
    found = solved(engine, mechanism, TURN, RATE, ["tested"] if closing else [])
    assert_moves_natively(found, kind, tuple(bodies), tolerances(engine))
    if engine == "exudyn":
        return
    assert found.details["rank"] == found.details["unknowns"]
    assert ("tested" in found.details["closures"]) == (closing or kind in TOO_LOOSE)
    if engine == "pinocchio" and not closing and kind not in TOO_LOOSE:
        # a screw is a slide and a turn tied by a row, a constant-velocity joint four by two
        spare = {"screw": 1, "constant_velocity": 2}.get(kind, 0)
        assert found.details["unknowns"] == 7 - mechanism.joint("tested").rows + spare


def on_screw(theta, axis, point, lead, rate):
    """Position, velocity and acceleration of a point that turns about an axis through the origin
    and moves along it.
    """
    h = np.array(axis) / np.linalg.norm(axis)
    along, across = (point @ h) * h, point - (point @ h) * h
    c, s = np.cos(theta)[:, None], np.sin(theta)[:, None]
    n, p = np.cross(h, across), lead / (2.0 * math.pi)
    return (
        along + c * across + s * n + np.outer(p * theta, h),
        rate * (c * n - s * across + p * h),
        -(rate**2) * (c * across + s * n),
    )


@IN_TREE_OR_CUT
@BOTH_ORDERS
@pytest.mark.by_day(2)
@pytest.mark.parametrize("lead", [0.05, -9.0])
@pytest.mark.parametrize("driver", [JointAngle, JointDisplacement, PointCoordinate])
def test_screw_over_turns_is_helix(driver, lead, mirrored, engine, closing):
    """By either of its coordinates or a point, with a lead above and below one radian a metre."""
    thread = Screw("thread", "ground", "nut", ORIGIN, AXIS, lead)
    by_point = driver is PointCoordinate
    # exchanged bodies measure the spindle from the nut; a point is where it is
    sign, unit = -1.0 if mirrored else 1.0, 1.0 if driver is JointAngle else lead / (2.0 * math.pi)
    mechanism = mechanism_of(
        [ordered(thread, mirrored)],
        {"tip": ("nut", TIP), "hub": ("nut", ORIGIN)},
        [PointCoordinate("drive", "hub", AXIS) if by_point else driver("drive", "thread")],
    )
    values = unit * TURNS * (sign if by_point else 1.0)
    cut = ["thread"] if closing else []
    found = solved(engine, mechanism, values, (sign if by_point else 1.0) * unit * 2.0, cut)
    expected = on_screw(sign * TURNS, AXIS, TIP, lead, sign * 2.0)
    assert_motion(found.points["tip"], *expected, atol=(1e-12, 1e-12, 1e-10))


CLOSED_BY = {
    "mujoco": "weld to an auxiliary body that carries the joint's slides and hinges",
    "simbody": "WeldConstraint, on a body that slide and hinge move on",
}


@ENGINES
@BOTH_ORDERS
def test_driven_joint_closes_loop(mirrored, engine):
    """Two sleeves on one axis, the angle of one and the displacement of the other driven; a hinge
    that a screw without lead repeats.
    """
    two = Cylindrical("two", "ground", "rod", ORIGIN, AXIS)
    joints = [Cylindrical("one", "ground", "rod", ORIGIN, AXIS), ordered(two, mirrored)]
    drivers = [JointAngle("turn", "two"), JointDisplacement("push", "one")]
    mechanism = mechanism_of(joints, {"tip": ("rod", TIP)}, drivers)
    found = solved(engine, mechanism, TURNS, motions={"push": Sine(0.3, 0.05)})
    push = np.outer(0.3 * np.sin(0.1 * math.pi * TURNS), np.array(AXIS) / 3.0)
    turn = -TURNS if mirrored else TURNS
    assert_motion(found.points["tip"], rotation(AXIS, turn) @ TIP + push)
    if engine in TREES:
        (name, text), *_ = found.details["closures"].items()
        assert (name, len(found.details["closures"])) == ("two", 1)
        assert CLOSED_BY.get(engine, "on a copy of ") in text
    joints[1] = ordered(Screw("flat", "ground", "rod", ORIGIN, AXIS, 0.0), mirrored)
    mechanism = mechanism_of(joints, {"tip": ("rod", TIP)}, [JointAngle("turn", "one")])
    assert_motion(
        solved(engine, mechanism, TURNS, 2.0).points["tip"],
        *on_screw(TURNS, AXIS, TIP, 0.0, 2.0),
        atol=tolerances(engine),
    )


@ENGINES
@pytest.mark.parametrize("second", [Distance, Fixed, Revolute, Spherical, Universal])
def test_second_joint_between_same_bodies(second, engine):
    """Rows of a constraint within one rigid body, or on an axis that is there already: zeros, which
    OpenSim and MuJoCo treat apart.
    """
    z, place = Z, (0.0, 0.0, 0.3)
    how = {
        Distance: (((0.1, 0.0, 0.0), (0.2, 0.1, 0.0)),),
        Revolute: (place, z),
        Universal: (place, (z, X)),
    }.get(second, (place,))
    pivot = Revolute("pivot", "ground", "a", ORIGIN, z)
    glued = [pivot, Fixed("glue", "a", "b", (0.1, 0.0, 0.0)), second("again", "a", "b", *how)]
    tip, turn = (0.5, 0.2, 0.1), np.linspace(-1.0, 2.0, 7)
    hinged = [pivot, second("again", "ground", "a", *how)]
    for joints, body in ((glued, "b"), *([] if second in (Distance, Fixed) else [(hinged, "a")])):
        mechanism = mechanism_of(joints, {"tip": (body, tip)}, [JointAngle("turn", "pivot")])
        found = assert_as_native(engine, mechanism, turn)
        assert_motion(found.points["tip"], rotation(z, turn) @ tip)
