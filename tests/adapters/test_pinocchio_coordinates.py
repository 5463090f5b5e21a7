"""Coordinates of joints in Pinocchio: driven, coupled and threaded ones, whether their joints are
in the tree or cut.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from kincheck.core import (
    GROUND,
    Body,
    Cylindrical,
    Distance,
    Gear,
    Joint,
    JointAngle,
    JointDisplacement,
    Mechanism,
    Point,
    RackPinion,
    Revolute,
    Screw,
    Sine,
    Translational,
    Universal,
    solve,
)
from kincheck.core.case.case import Sweep
from kincheck.core.mechanism.drivers import Driver
from kincheck.core.mechanism.topology import Branch, SpanningTree, spanning_tree
from kincheck.core.trajectory import Trajectory

pytest.importorskip("pinocchio")

from .test_pinocchio import ENGINE, TOL, case_of, rotation, solved

Q, AXIS = (0.2, -0.1, 0.3), (0.4, 1.0, -0.7)
P = (0.5, 0.6, 0.1)
TURNS = np.linspace(-15.0, 15.0, 61)
"""Angles over nearly five turns, half a radian apart."""
H = np.array(AXIS) / np.linalg.norm(AXIS)


def sign_of(bodies: tuple[str, str]) -> float:
    """Of the moving body's motion, where a joint's coordinate is that of its second body."""
    return 1.0 if bodies[0] == GROUND else -1.0


def carried(turn: np.ndarray | float, slide: np.ndarray | float) -> np.ndarray:
    """Where P goes that turns about the axis through Q and slides along it, shape (n, 3)."""
    return Q + rotation(AXIS, turn) @ np.subtract(P, Q) + np.multiply.outer(slide, H)


def on_axis(joints: Sequence[Joint], drivers: Sequence[Driver], **more: Sequence) -> Mechanism:
    """One body B on joints that share an axis."""
    bodies = more.pop("bodies", ())
    return Mechanism("on axis", [Body("B"), *bodies], joints, [Point("P", "B", P)], drivers, **more)


def same_as_native(mechanism: Mechanism, found: Trajectory, values: np.ndarray) -> None:
    native = solve(mechanism, mechanism.drivers[0].name, values)
    assert native.solved.all()
    for name, motion in found.points.items():
        for quantity in ("position", "velocity", "acceleration"):
            # both are solved to round-off of positions of 1 m and accelerations of a few m/s^2
            np.testing.assert_allclose(
                getattr(motion, quantity),
                getattr(native.points[name], quantity),
                rtol=0,
                atol=1e-12,
            )


@pytest.mark.parametrize("bodies", [(GROUND, "B"), ("B", GROUND)])
@pytest.mark.parametrize("lead", [0.4, -0.05])
def test_screw_driven_by_its_angle_over_several_turns(lead: float, bodies: tuple[str, str]) -> None:
    """Right-handed: body and other body change places without changing the hand of the thread."""
    mechanism = on_axis([Screw("thread", *bodies, Q, AXIS, lead)], [JointAngle("turn", "thread")])
    turn = sign_of(bodies) * TURNS
    found = solved(mechanism, TURNS)
    np.testing.assert_allclose(
        found.points["P"].position, carried(turn, lead * turn / (2 * math.pi)), rtol=0, atol=1e-14
    )
    same_as_native(mechanism, found, TURNS)


@pytest.mark.parametrize("bodies", [(GROUND, "B"), ("B", GROUND)])
def test_screw_driven_by_its_displacement(bodies: tuple[str, str]) -> None:
    push = np.linspace(-0.5, 0.5, 41)
    slide = sign_of(bodies) * push
    found = solved(
        on_axis([Screw("thread", *bodies, Q, AXIS, 0.2)], [JointDisplacement("push", "thread")]),
        push,
    )
    np.testing.assert_allclose(
        found.points["P"].position, carried(2 * math.pi * slide / 0.2, slide), rtol=0, atol=1e-13
    )


@pytest.mark.parametrize("bodies", [(GROUND, "B"), ("B", GROUND)])
@pytest.mark.parametrize("lead", [0.4, -0.05, 0.0])
def test_cut_screw_over_several_turns(lead: float, bodies: tuple[str, str]) -> None:
    """A driven cylindrical joint takes the place in the tree; without lead the screw is a hinge."""
    joints = [Cylindrical("sleeve", GROUND, "B", Q, AXIS), Screw("thread", *bodies, Q, AXIS, lead)]
    found = solved(on_axis(joints, [JointAngle("turn", "sleeve")]), TURNS)
    assert set(found.details["closures"]) == {"thread"}
    expected = carried(TURNS, lead * TURNS / (2 * math.pi))
    np.testing.assert_allclose(found.points["P"].position, expected, rtol=0, atol=1e-13)


@pytest.mark.parametrize("bodies", [(GROUND, "B"), ("B", GROUND)])
def test_both_freedoms_of_a_cylindrical_joint_driven(bodies: tuple[str, str]) -> None:
    drivers = [JointAngle("turn", "sleeve"), JointDisplacement("push", "sleeve")]
    mechanism = on_axis([Cylindrical("sleeve", *bodies, Q, AXIS)], drivers)
    found = swept_with(mechanism, TURNS, Sine(0.3, 0.05))
    t, sign = TURNS, sign_of(bodies)
    slide = 0.3 * np.sin(0.1 * math.pi * t)
    np.testing.assert_allclose(
        found.points["P"].position, carried(sign * t, sign * slide), rtol=0, atol=1e-14
    )


@pytest.mark.parametrize("bodies", [(GROUND, "B"), ("B", GROUND)])
@pytest.mark.parametrize("swept", ["turn", "push"])
def test_driven_joint_that_closes_a_loop(swept: str, bodies: tuple[str, str]) -> None:
    """Two sleeves on one axis, the angle of one and the displacement of the other driven: one of
    them is cut.
    """
    joints = [Cylindrical("one", GROUND, "B", Q, AXIS), Cylindrical("two", *bodies, Q, AXIS)]
    drivers = [JointAngle("turn", "two"), JointDisplacement("push", "one")]
    mechanism = on_axis(joints, drivers[:: 1 if swept == "turn" else -1])
    assert [joint.name for joint in spanning_tree(mechanism).cut] == ["two"]
    found = swept_with(mechanism, TURNS, Sine(0.3, 0.05))
    waved = 0.3 * np.sin(0.1 * math.pi * TURNS)
    turn, push = (TURNS, waved) if swept == "turn" else (waved, TURNS)
    np.testing.assert_allclose(
        found.points["P"].position, carried(sign_of(bodies) * turn, push), rtol=0, atol=1e-13
    )
    assert found.details["closures"]["two"].startswith("on a copy of")


def swept_with(mechanism: Mechanism, values: np.ndarray, other: Sine) -> Trajectory:
    """Sweep of the first driver while the second follows a motion."""
    swept, moved = (driver.name for driver in mechanism.drivers)
    case = case_of(mechanism, values)
    case = type(case)(**vars(case) | {"sweep": Sweep(swept, values, motions={moved: other})})
    found = ENGINE.solve(ENGINE.build(case), case, TOL)
    assert found.message == ""
    return found


@pytest.mark.parametrize("flip", [1, -1])
def test_gear_train_with_a_rack(flip: int) -> None:
    """Wheel, wheel on an inclined axis, rack; body orders of all joints as they come and
    exchanged.
    """

    def ends(body: str) -> tuple[str, str]:
        return (GROUND, body)[::flip]

    joints = [
        Revolute("first", *ends("A"), Q, AXIS),
        Revolute("second", *ends("B"), (0.0, 0.4, 0.2), (1.0, 0.2, 0.3)),
        Translational("guide", *ends("R"), (0.1, 0.0, 0.0), (0.0, 3.0, 4.0)),
    ]
    couplers = [
        Gear("teeth", ("second", "first"), -2.5),
        RackPinion("rack", ("second", "guide"), 0.03),
    ]
    points = [Point(name, body, P) for name, body in (("a", "A"), ("b", "B"), ("r", "R"))]
    bodies = [Body("A"), Body("B"), Body("R")]
    mechanism = Mechanism("train", bodies, joints, points, [JointAngle("turn", "first")], couplers)
    found = solved(mechanism, TURNS)
    second = -2.5 * TURNS
    np.testing.assert_allclose(
        found.points["a"].position, carried(flip * TURNS, 0.0 * TURNS), rtol=0, atol=1e-14
    )
    center = np.array([0.0, 0.4, 0.2])
    expected = center + rotation((1.0, 0.2, 0.3), flip * second) @ (P - center)
    np.testing.assert_allclose(found.points["b"].position, expected, rtol=0, atol=1e-13)
    expected = P + np.multiply.outer(flip * 0.03 * second, [0.0, 0.6, 0.8])
    np.testing.assert_allclose(found.points["r"].position, expected, rtol=0, atol=1e-14)
    same_as_native(mechanism, found, TURNS)


def test_planetary_gear() -> None:
    """The planet turns on its carrier, and rolls on a fixed sun of twice its size: three turns for
    one of the carrier.
    """
    z, hub = (0.0, 0.0, 1.0), (0.3, 0.0, 0.0)
    joints = [
        Revolute("main", GROUND, "carrier", (0.0, 0.0, 0.0), z),
        Revolute("hub", "carrier", "planet", hub, z),
    ]
    bodies, tip = [Body("carrier"), Body("planet")], (0.4, 0.0, 0.0)
    gear, drive = Gear("teeth", ("hub", "main"), 2.0), JointAngle("turn", "main")
    found = solved(
        Mechanism("planetary", bodies, joints, [Point("tip", "planet", tip)], [drive], [gear]),
        TURNS,
    )
    expected = rotation(z, TURNS) @ hub + rotation(z, 3 * TURNS) @ np.subtract(tip, hub)
    np.testing.assert_allclose(found.points["tip"].position, expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("bodies", [(GROUND, "B"), ("B", GROUND)])
def test_coupled_joint_that_closes_a_loop(bodies: tuple[str, str]) -> None:
    """A second hinge on the driven axis is cut; the wheel geared to it counts its turns."""
    joints = [
        Revolute("first", GROUND, "B", Q, AXIS),
        Revolute("again", *bodies, Q, AXIS),
        Revolute("wheel", GROUND, "W", P, AXIS),
    ]
    mechanism = Mechanism(
        "cut gear",
        [Body("B"), Body("W")],
        joints,
        [Point("rim", "W", Q)],
        [JointAngle("turn", "first")],
        [Gear("teeth", ("wheel", "again"), 0.3)],
    )
    found = solved(mechanism, TURNS)
    assert set(found.details["closures"]) == {"again"}
    turn = 0.3 * sign_of(bodies) * TURNS
    np.testing.assert_allclose(
        found.points["rim"].position,
        P + rotation(AXIS, turn) @ np.subtract(Q, P),
        rtol=0,
        atol=1e-13,
    )


@pytest.mark.parametrize("flip", [1, -1])
def test_rack_and_pinion_steering(flip: int) -> None:
    """An inclined column, a rack across the car, tie rods to two knuckles on inclined kingpins: two
    turns of the wheel and more.
    """
    left, right = (np.array([-0.2, y, 0.3]) for y in (0.7, -0.7))
    pins = {"left": (left, (-0.1, -0.2, 1.0)), "right": (right, (-0.1, 0.2, 1.0))}
    joints: list[Joint] = [
        Revolute("column", *(GROUND, "pinion")[::flip], (0.3, 0.3, 0.35), (1.0, 0.0, 0.6)),
        Translational("housing", *(GROUND, "rack")[::flip], (-0.05, 0.0, 0.25), (0.0, 1.0, 0.0)),
    ]
    points = [Point("end", "rack", (-0.05, 0.35, 0.25))]
    for side, (at, axis) in pins.items():
        inwards = -math.copysign(1.0, at[1])
        ends = ((-0.05, -0.35 * inwards, 0.25), (at[0] + 0.15, at[1] + 0.05 * inwards, 0.27))
        joints += [Revolute(side, *(GROUND, f"{side} knuckle")[::flip], tuple(at), axis)]
        joints += [Distance(f"{side} rod", *("rack", f"{side} knuckle"), ends)]
        points += [Point(f"{side} wheel", f"{side} knuckle", (at[0], at[1] - 0.1 * inwards, 0.3))]
    bodies = [Body(name) for name in ("pinion", "rack", "left knuckle", "right knuckle")]
    drive, gear = JointAngle("wheel", "column"), RackPinion("gear", ("column", "housing"), 0.008)
    mechanism, turn = (
        Mechanism("steering", bodies, joints, points, [drive], [gear]),
        np.linspace(-8.0, 8.0, 65),
    )
    found = solved(mechanism, turn)
    expected = np.array([-0.05, 0.35, 0.25]) + np.multiply.outer(
        flip * 0.008 * turn, [0.0, 1.0, 0.0]
    )
    np.testing.assert_allclose(found.points["end"].position, expected, rtol=0, atol=1e-14)
    assert np.ptp(found.points["left wheel"].position[:, 0]) > 0.05
    same_as_native(mechanism, found, turn)


def nut_on_lever(mechanism: Mechanism) -> SpanningTree:
    """The thread is cut, and the nut hangs on the lever."""
    base, bearing, thread, eye, pivot = mechanism.joints
    branches = [
        (GROUND, "housing", base),
        ("housing", "spindle", bearing),
        (GROUND, "lever", pivot),
        ("lever", "nut", eye),
    ]
    return SpanningTree(tuple(Branch(*each) for each in branches), (thread,))


@pytest.mark.parametrize("bodies", [("spindle", "nut"), ("nut", "spindle")])
@pytest.mark.parametrize("tree", [spanning_tree, nut_on_lever])
def test_spindle_lifts_a_lever(
    tree: Callable[[Mechanism], SpanningTree],
    bodies: tuple[str, str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A thread in a closed loop in space, between two Hooke's joints that let the spindle swing;
    over several turns.

    With the thread cut, bodies that turn about several moving axes carry it: the only place where
    its angle has a bias.
    """
    monkeypatch.setattr("kincheck.adapters.shared.tree_model.spanning_tree", tree)
    along, eye = (0.1, 0.2, 1.0), (0.05, 0.1, 0.5)
    joints = [
        Universal("base", GROUND, "housing", (0.0, 0.0, 0.0), ((1.0, 0.0, -0.1), (0.02, 1.0, 0.2))),
        Revolute("bearing", "housing", "spindle", (0.0, 0.0, 0.0), along),
        Screw("thread", *bodies, (0.0, 0.0, 0.0), along, 0.02),
        Universal("eye", "lever", "nut", eye, ((0.1, 1.0, 0.0), (1.0, -0.1, 0.3))),
        Revolute("pivot", GROUND, "lever", (0.6, 0.0, 0.4), (0.3, 1.0, 0.2)),
    ]
    parts = [Body(name) for name in ("housing", "spindle", "nut", "lever")]
    points = [
        Point("end", "spindle", (0.2, 0.0, 0.6)),
        Point("nut", "nut", (0.1, 0.2, 0.5)),
        Point("tip", "lever", (0.9, 0.0, 0.2)),
    ]
    mechanism, turn = (
        Mechanism("jack", parts, joints, points, [JointAngle("turn", "bearing")]),
        np.linspace(-15.0, 15.0, 121),
    )
    found = solved(mechanism, turn)
    assert ("thread" in found.details["closures"]) == (tree is nut_on_lever)
    assert np.ptp(found.points["tip"].position[:, 2]) > 0.02
    same_as_native(mechanism, found, turn)
