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
    Joint,
    JointAngle,
    JointDisplacement,
    Mechanism,
    Point,
    Revolute,
    Screw,
    Sine,
    Universal,
)
from kincheck.core.case.case import Sweep
from kincheck.core.mechanism.mechanism import Branch, SpanningTree, spanning_tree
from kincheck.core.mechanism.motions import Driver
from kincheck.core.trajectory import Trajectory

from ..support.pinocchio_cases import ENGINE, TOL, case_of, solved
from ..support.pinocchio_joints import AXIS, TURNS, P, Q, carried, same_as_native, sign_of

pytest.importorskip("pinocchio")


def on_axis(joints: Sequence[Joint], drivers: Sequence[Driver], **more: Sequence) -> Mechanism:
    """One body B on joints that share an axis."""
    bodies = more.pop("bodies", ())
    return Mechanism("on axis", [Body("B"), *bodies], joints, [Point("P", "B", P)], drivers, **more)


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
    monkeypatch.setattr("kincheck.adapters.shared.tree_plan.spanning_tree", tree)
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
