"""Drivers of Pinocchio's adapter against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from kincheck.core import (
    GROUND,
    Body,
    JointAngle,
    JointDisplacement,
    Mechanism,
    Point,
    PointCoordinate,
    Revolute,
    Translational,
)
from kincheck.core.mechanism.motions import Driver

from ..support.joint_loops import HINGE
from ..support.pinocchio_cases import rotation, solved

pytest.importorskip("pinocchio")


@pytest.mark.parametrize("bodies", [(GROUND, "B"), ("B", GROUND)])
def test_joint_angle_is_that_of_the_second_body(bodies: tuple[str, str]) -> None:
    """Several turns about an axis that is not a unit vector."""
    hinge, P = Revolute("hinge", *bodies, HINGE, (0.4, 1.0, -0.7)), (0.5, 0.6, 0.1)
    turn = np.linspace(-7.0, 7.0, 57)
    found = solved(
        Mechanism(
            "pivot", [Body("B")], [hinge], [Point("P", "B", P)], [JointAngle("turn", "hinge")]
        ),
        turn,
    )
    sign = 1.0 if bodies[1] == "B" else -1.0
    expected = HINGE + rotation(hinge.axis, sign * turn) @ np.subtract(P, HINGE)
    np.testing.assert_allclose(found.points["P"].position, expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("bodies", [(GROUND, "B"), ("B", GROUND)])
def test_joint_displacement_is_that_of_the_second_body(bodies: tuple[str, str]) -> None:
    slide, P = Translational("slide", *bodies, HINGE, (0.4, 1.0, -0.7)), (0.5, 0.6, 0.1)
    mechanism = Mechanism(
        "slider", [Body("B")], [slide], [Point("P", "B", P)], [JointDisplacement("push", "slide")]
    )
    push = np.linspace(-1.0, 1.0, 9)
    found = solved(mechanism, push, 3.0).points["P"]
    along = np.array(slide.axis) / np.linalg.norm(slide.axis) * (1.0 if bodies[1] == "B" else -1.0)
    np.testing.assert_allclose(found.position, P + push[:, None] * along, rtol=0, atol=1e-15)
    np.testing.assert_allclose(
        found.velocity, np.broadcast_to(3.0 * along, (9, 3)), rtol=0, atol=1e-15
    )


def test_oblique_point_driver() -> None:
    """A slider pushed along another direction k moves by c / (k . axis)."""
    axis, k = np.array([0.4, 1.0, -0.7]), np.array([3.0, 2.0, 1.0])
    slide, P = Translational("slide", GROUND, "B", HINGE, tuple(axis)), (0.5, 0.6, 0.1)
    mechanism = Mechanism(
        "slider",
        [Body("B")],
        [slide],
        [Point("P", "B", P)],
        [PointCoordinate("push", "P", tuple(k))],
    )
    push = np.linspace(-0.3, 0.3, 7)
    expected = P + push[:, None] * axis / (k / np.linalg.norm(k) @ axis)
    np.testing.assert_allclose(
        solved(mechanism, push).points["P"].position, expected, rtol=0, atol=1e-14
    )


@pytest.mark.parametrize(
    "hold", [JointAngle("hold", "elbow"), PointCoordinate("hold", "tip", (0.0, 0.0, 1.0))]
)
def test_other_drivers_hold_their_design_value(hold: Driver) -> None:
    """Second arm about a horizontal axis: with its angle or its tip's height held, the tip
    describes a circle.
    """
    joints = [
        Revolute("shoulder", GROUND, "upper", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        Revolute("elbow", "lower", "upper", (0.4, 0.0, 0.1), (0.0, 1.0, 0.0)),
    ]
    tip, turn = (0.7, 0.0, 0.5), np.linspace(-1.0, 2.0, 7)
    drivers = [JointAngle("turn", "shoulder"), hold]
    mechanism = Mechanism(
        "arm", [Body("upper"), Body("lower")], joints, [Point("tip", "lower", tip)], drivers
    )
    found = solved(mechanism, turn).points["tip"]
    np.testing.assert_allclose(
        found.position, rotation((0.0, 0.0, 1.0), turn) @ tip, rtol=0, atol=1e-14
    )
