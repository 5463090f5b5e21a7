"""Gears, planets and racks in Pinocchio, whether their joints are in the tree or cut."""

from __future__ import annotations

import math

import numpy as np
import pytest
from kincheck.core import (
    GROUND,
    Body,
    Distance,
    Gear,
    Joint,
    JointAngle,
    Mechanism,
    Point,
    RackPinion,
    Revolute,
    Translational,
)

from ..support.pinocchio_cases import rotation, solved
from ..support.pinocchio_joints import AXIS, TURNS, P, Q, carried, same_as_native, sign_of

pytest.importorskip("pinocchio")


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
