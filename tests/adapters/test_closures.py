"""Every joint in Pinocchio, in its tree and cut, against the native engine; and what cuts must do
besides.
"""

from __future__ import annotations

from collections.abc import Callable
from unittest import mock

import numpy as np
import pytest
from kincheck.adapters.shared.constraints import CLOSURES
from kincheck.core import (
    GROUND,
    Body,
    Distance,
    JointAngle,
    Mechanism,
    Point,
    PointCoordinate,
    Revolute,
    Universal,
)
from kincheck.core.mechanism.mechanism import Branch, SpanningTree, spanning_tree
from kincheck.core.trajectory import Trajectory

pytest.importorskip("pinocchio")

from ..support.joint_loops import (
    RATE,
    TOO_LOOSE,
    TURN,
    TYPES,
    assert_moves_natively,
    crank_only,
    on_crank,
)
from ..support.pinocchio_cases import rotation, solved


def derivative(x: np.ndarray, h: float) -> np.ndarray:
    """Central differences of order 8 along the first axis, four samples lost at each end."""
    n = len(x) - 8
    weights = (1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280)
    return sum(w * x[k : k + n] for k, w in enumerate(weights)) / h


def check_rates(found: Trajectory, h: float) -> None:
    """Velocities and accelerations are the derivatives of positions and velocities."""
    for motion in found.points.values():
        v, a = motion.velocity, motion.acceleration
        # h^8 x^(9) / 630 and the round-off 1e-16 / h are far below the tolerances for the steps
        # used here
        np.testing.assert_allclose(v[4:-4], derivative(motion.position, h), rtol=0, atol=1e-11)
        np.testing.assert_allclose(a[4:-4], derivative(v, h), rtol=0, atol=1e-10)


@pytest.mark.parametrize("tree", [spanning_tree, crank_only])
@pytest.mark.parametrize("bodies", [("A", "B"), ("B", "A")])
@pytest.mark.parametrize("kind", TYPES)
def test_every_joint_moves_as_in_the_native_engine(
    kind: str, bodies: tuple[str, str], tree: Callable[[Mechanism], SpanningTree]
) -> None:
    mechanism = on_crank(kind, *bodies)
    # the native engine, whose models are kept, has no tree
    with mock.patch("kincheck.adapters.shared.tree_plan.spanning_tree", tree):
        found = solved(mechanism, TURN, RATE)
    if tree is crank_only or kind in TOO_LOOSE:
        assert "tested" in found.details["closures"]
        assert found.details["rank"] == found.details["unknowns"] == 7
    else:
        # a screw is a slide and a turn tied by a row, a constant-velocity joint four by two
        spare = {"screw": 1, "constant_velocity": 2}.get(kind, 0)
        assert (
            found.details["rank"]
            == found.details["unknowns"]
            == 7 - mechanism.joint("tested").rows + spare
        )
    assert_moves_natively(found, kind, bodies)


def test_every_type_is_known() -> None:
    assert {each.type for each in CLOSURES} == set(TYPES)


def cardan_shaft(mechanism: Mechanism) -> SpanningTree:
    """Input shaft, cross, output shaft; the output's bearing is cut."""
    branches = (
        Branch(GROUND, "in", mechanism.joint("bearing")),
        Branch("in", "out", mechanism.joint("cross")),
    )
    return SpanningTree(branches, (mechanism.joint("seat"),))


@pytest.mark.parametrize("tree", [spanning_tree, cardan_shaft])
def test_cardan_joint(
    tree: Callable[[Mechanism], SpanningTree], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half a turn, a period, of shafts 0.6 rad apart. The output's arm is perpendicular to its
    axis and to the input's arm.

    With the bearing cut, a body that turns about two moving axes carries a closure: the only place
    where a direction has a bias from the angular acceleration.
    """
    monkeypatch.setattr("kincheck.adapters.shared.tree_plan.spanning_tree", tree)
    a, u, center = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([0.1, 0.2, 0.3])
    b = rotation(u, 0.6) @ a
    turn, rate = 0.02 * np.arange(-4, 162), 2.0
    arm = np.cross(b, np.einsum("nij,j->ni", rotation(a, turn), u))
    arm /= np.linalg.norm(arm, axis=1)[:, None]
    joints = [
        Revolute("bearing", GROUND, "in", tuple(center - a), tuple(a)),
        Universal("cross", "out", "in", tuple(center), (tuple(np.cross(b, u)), tuple(u))),
        Revolute("seat", "out", GROUND, tuple(center + b), tuple(b)),
    ]
    tip = Point("tip", "out", tuple(center + np.cross(b, u)))
    found = solved(
        Mechanism(
            "cardan", [Body("in"), Body("out")], joints, [tip], [JointAngle("turn", "bearing")]
        ),
        turn,
        rate,
    )
    assert set(found.details["closures"]) == {"cross" if tree is spanning_tree else "seat"}
    np.testing.assert_allclose(found.points["tip"].position, center + arm, rtol=0, atol=1e-13)
    check_rates(found, 0.02 / rate)


def test_free_body_on_five_rods_keeps_their_lengths() -> None:
    """One rod is longer than the distance of its points at design."""
    fixed = [
        (0.0, 0.4, 0.3),
        (0.3, 0.4, 0.3),
        (-0.1, 0.4, -0.2),
        (0.4, 0.4, -0.2),
        (-0.3, 0.5, 0.0),
    ]
    moving = [
        (0.1, 0.8, 0.25),
        (0.15, 0.8, 0.25),
        (0.1, 0.9, -0.2),
        (0.15, 0.9, -0.2),
        (-0.1, 0.85, 0.02),
    ]
    lengths = [None, None, None, None, 0.4]
    rods = [
        Distance(f"rod {k}", "B", GROUND, ends[:2], ends[2])
        for k, ends in enumerate(zip(moving, fixed, lengths, strict=True))
    ]
    points = [Point(f"P{k}", "B", P) for k, P in enumerate(moving)]
    bodies = [Body("B", (0.1, 0.9, 0.0)), Body("frame", fixed=True)]
    mechanism = Mechanism(
        "multilink", bodies, rods, points, [PointCoordinate("lift", "P0", (0.0, 0.2, 1.0))]
    )
    found = solved(mechanism, 0.0025 * np.arange(-16, 17))
    for k, rod in enumerate(rods):
        now = np.linalg.norm(found.points[f"P{k}"].position - fixed[k], axis=1)
        np.testing.assert_allclose(now, rod.rod_length, rtol=0, atol=1e-14)
    check_rates(found, 0.0025)
