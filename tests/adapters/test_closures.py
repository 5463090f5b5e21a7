"""Every joint in Pinocchio, in its tree and cut, against the native engine; and what cuts must do
besides.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from kincheck.adapters.shared.loop_closures import CLOSURES
from kincheck.core import (
    GROUND,
    Body,
    Distance,
    Joint,
    JointAngle,
    Mechanism,
    Point,
    PointCoordinate,
    Revolute,
    Universal,
    solve,
)
from kincheck.core import joints as library
from kincheck.core.mechanism.topology import Branch, SpanningTree, spanning_tree
from kincheck.core.trajectory import Trajectory

pytest.importorskip("pinocchio")

from .test_pinocchio import CRANK, HINGE, rotation, solved


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


# both sets chosen so that the joints they go with stay far from singular positions: the largest
# singular value is at most 30 times the smallest
RODS = (
    ((0.9, -0.8, 1.3), (0.2, -0.1, 0.6)),
    ((0.6, 0.6, -0.6), (0.7, 0.0, 0.4)),
    ((0.5, -0.5, -0.7), (0.2, 0.1, 0.3)),
    ((1.1, -0.4, -0.3), (0.6, 0.3, 0.5)),
    ((0.2, 0.6, 1.1), (0.7, -0.2, 0.4)),
)
OTHER_RODS = (
    ((1.2, -0.2, -1.3), (0.5, 0.1, 0.1)),
    ((-0.4, -1.1, 1.5), (0.3, -0.3, 0.4)),
    ((1.5, 0.0, 1.0), (0.1, 0.3, 0.7)),
    ((0.8, 0.6, -0.8), (0.8, -0.1, 0.5)),
    ((1.0, 0.3, 1.2), (0.3, -0.3, 0.0)),
)
WITH_OTHER_RODS = {
    "inline",
    "orientation_lock",
    "parallel_axes",
    "perpendicular_axes",
    "revolute_spherical",
}
ON_AXIS = {"point": HINGE, "axis": (0.4, 1.0, -0.7)}
ENDS = {"points": (HINGE, (0.35, 0.0, 0.4))}
# the axes of a cross, off the right angle by what rounding of a table may be
ROUNDED = {"axes": ((0.5, 1.0, 0.2), (1.0, -0.49, 0.0))}
GEOMETRY = {
    "constant_velocity": {"point": HINGE, "axes": ((1.0, 0.2, 0.0), (1.0, -0.3, 0.4))},
    "cylindrical": ON_AXIS,
    "distance": ENDS,
    "fixed": {},
    "in_plane": ON_AXIS,
    "inline": ON_AXIS,
    "orientation_lock": {},
    "parallel_axes": {"axis": ON_AXIS["axis"]},
    "perpendicular_axes": ROUNDED,
    "planar": ON_AXIS,
    "revolute": ON_AXIS,
    "revolute_spherical": ENDS | {"axis": ON_AXIS["axis"]},
    "screw": ON_AXIS | {"lead": 0.4},
    "spherical": {"point": HINGE},
    "translational": ON_AXIS,
    "universal": {"point": HINGE} | ROUNDED,
}
TYPES = sorted(
    name for name, kind in Joint.registry.items() if kind.__module__.startswith(library.__name__)
)
TOO_LOOSE = {
    "distance",
    "in_plane",
    "inline",
    "parallel_axes",
    "perpendicular_axes",
    "revolute_spherical",
}
"""Types of fewer than three rows, which carry no body."""


def on_crank(kind: str, first: str, second: str) -> Mechanism:
    """Body B on the crank A by one joint of that kind, its freedoms taken by rods to the ground."""
    assert kind in GEOMETRY, f"joint type {kind!r} is not tested: add it to GEOMETRY here"
    joint = Joint.registry[kind]("tested", first, second, **GEOMETRY[kind])
    rods = [
        Distance(f"rod {k}", GROUND, "B", ends)
        for k, ends in enumerate(
            (OTHER_RODS if kind in WITH_OTHER_RODS else RODS)[: 6 - joint.rows]
        )
    ]
    points = [
        Point(name, "B", P)
        for name, P in (("P", (0.4, 0.1, 0.3)), ("Q", (0.4, -0.3, 0.5)), ("S", (0.7, 0.1, 0.5)))
    ]
    return Mechanism(
        kind,
        [Body("A"), Body("B", (0.4, 0.0, 0.4))],
        [CRANK, joint, *rods],
        points,
        [JointAngle("turn", "crank")],
    )


def crank_only(mechanism: Mechanism) -> SpanningTree:
    """B is free, all joints but the crank's are cut."""
    branches = (Branch(GROUND, "A", mechanism.joint("crank")), Branch(GROUND, "B", None))
    return SpanningTree(
        branches, tuple(joint for joint in mechanism.joints if joint.name != "crank")
    )


@pytest.mark.parametrize("tree", [spanning_tree, crank_only])
@pytest.mark.parametrize("bodies", [("A", "B"), ("B", "A")])
@pytest.mark.parametrize("kind", TYPES)
def test_every_joint_moves_as_in_the_native_engine(
    kind: str,
    bodies: tuple[str, str],
    tree: Callable[[Mechanism], SpanningTree],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mechanism, turn = on_crank(kind, *bodies), np.linspace(-0.4, 0.4, 41)
    monkeypatch.setattr("kincheck.adapters.shared.tree_model.spanning_tree", tree)
    found, native = solved(mechanism, turn, 2.0), solve(mechanism, "turn", turn, rate=2.0)
    assert native.solved.all()
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
    for name, motion in found.points.items():
        assert np.ptp(motion.position, axis=0).max() > 0.05  # something moves
        # both are solved to round-off: 1e-16 of positions of 1 m and accelerations of 10 m/s^2,
        # times a conditioning of 41
        for quantity, atol in (("position", 1e-13), ("velocity", 1e-12), ("acceleration", 1e-11)):
            np.testing.assert_allclose(
                getattr(motion, quantity), getattr(native.points[name], quantity), rtol=0, atol=atol
            )


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
    """One turn of shafts 0.6 rad apart. The output's arm is perpendicular to its axis and to the
    input's arm.

    With the bearing cut, a body that turns about two moving axes carries a closure: the only place
    where a direction has a bias from the angular acceleration.
    """
    monkeypatch.setattr("kincheck.adapters.shared.tree_model.spanning_tree", tree)
    a, u, center = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([0.1, 0.2, 0.3])
    b = rotation(u, 0.6) @ a
    turn, rate = 0.02 * np.arange(-4, 320), 2.0
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
