"""The Pinocchio adapter against closed forms and an independent reference; every joint as a closure
is in test_closures.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from kincheck.adapters.pinocchio import pinocchio as adapter
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
    Spherical,
    Translational,
    Universal,
)
from kincheck.core.mechanism.motions import Driver

from ..support.joint_loops import CRANK, HINGE
from ..support.pinocchio_cases import ENGINE, TOL, case_of, rotation, solved

pytest.importorskip("pinocchio")


def strut() -> Mechanism:
    """McPherson strut of SAE 943745, Tables 4 and 5, joint points reconstructed."""
    K, U, W = (0.97772, 0.605, 0.18), (1.0, 0.55, 0.6), (0.975, 0.715, 0.101)
    return Mechanism(
        "strut",
        [
            Body("chassis", fixed=True),
            Body("rack", fixed=True),
            Body("lca"),
            Body("knuckle", W),
            Body("strut", U),
        ],
        [
            Revolute("lca_pivot", "chassis", "lca", (1.17, 0.353, 0.005), (2.0, 0.0, 0.0)),
            Spherical("ball", "lca", "knuckle", (0.9676, 0.66, -0.01)),
            Translational("slide", "knuckle", "strut", K, tuple(np.subtract(U, K))),
            Spherical("top", "strut", "chassis", U),
            Distance("tie_rod", "knuckle", "rack", ((1.115, 0.665, 0.118), (1.14, 0.355, 0.1455))),
        ],
        [Point("wheel_center", "knuckle", W)],
        [PointCoordinate("stroke", "wheel_center", (0.0, 0.0, 3.0))],
    )


# sample: x, y [m], vx, vy [m/s], ax, ay [m/s^2] of the wheel centre at 1 m/s; four unknowns,
# extended precision, residual 1e-19
STRUT = {
    0: (
        0.9784216847140831,
        0.7046021168519804,
        -0.054481022483195,
        0.248050444550955,
        0.29813886646731,
        -3.14246535307487,
    ),
    37: (
        0.9766070515140639,
        0.7116985944500784,
        -0.043656631859606,
        0.137191973228145,
        0.29005802468944,
        -2.874169716598,
    ),
    80: (0.975, 0.715, -0.031003511378626, 0.017471831311365, 0.30211302579786, -2.71882612855285),
    119: (
        0.9740271073049935,
        0.71362560081833,
        -0.018690573418323,
        -0.087839818318594,
        0.33260964363673,
        -2.70155690142503,
    ),
    160: (
        0.9735541231204234,
        0.7077296192455841,
        -0.003999789054857,
        -0.200645146299785,
        0.38865414362756,
        -2.83130086954583,
    ),
}


def test_strut_agrees_with_an_independent_solution(capfd: pytest.CaptureFixture[str]) -> None:
    found = solved(strut(), np.linspace(-0.08, 0.08, 161))
    motion = found.points["wheel_center"]
    for k, (x, y, vx, vy, ax, ay) in STRUT.items():
        np.testing.assert_allclose(
            motion.position[k], [x, y, 0.101 - 0.08 + 0.001 * k], rtol=0, atol=1e-14
        )
        np.testing.assert_allclose(motion.velocity[k], [vx, vy, 1.0], rtol=0, atol=1e-13)
        np.testing.assert_allclose(motion.acceleration[k], [ax, ay, 0.0], rtol=0, atol=1e-12)
    assert found.details["closures"] == {
        "top": "points coincide (3 rows)",
        "tie_rod": "points at constant distance (1 row)",
    }
    assert found.details["rank"] == found.details["unknowns"] == 5
    assert capfd.readouterr() == ("", "")


def test_solving_again_gives_the_same() -> None:
    case = case_of(strut(), np.linspace(-0.08, 0.08, 17))
    model = ENGINE.build(case)
    first, second = (ENGINE.solve(model, case, TOL).points["wheel_center"] for _ in range(2))
    for name in ("position", "velocity", "acceleration"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_unreachable_stroke_is_reported_and_not_invented() -> None:
    case = case_of(strut(), 0.001 * np.arange(601))
    found = ENGINE.solve(ENGINE.build(case), case, TOL)
    assert found.solved[:294].all()
    assert not found.solved[294:].any()
    assert "last reachable sample at stroke = 0.293;" in found.message
    motion = found.points["wheel_center"]
    for rows in (motion.position, motion.velocity, motion.acceleration):
        assert np.isfinite(rows[:294]).all()
        assert np.isnan(rows[294:]).all()


def test_four_revolutes_in_a_tilted_plane() -> None:
    """Redundant: five rows close a planar loop, of which two are independent."""
    a, b, c, d, start = 0.1, 0.35, 0.3, 0.4, 0.3
    R, origin = rotation((1.0, 2.0, 0.5), 0.8), np.array([0.3, -0.2, 0.7])
    turn = np.linspace(0.0, 2 * math.pi, 181)
    crank = a * np.stack([np.cos(start + turn), np.sin(start + turn)], axis=-1)
    line = np.array([d, 0.0]) - crank
    distance = np.linalg.norm(line, axis=1)
    # the rocker's pin, left of the line from the crank's pin to the rocker's pivot
    angle = np.arctan2(line[:, 1], line[:, 0]) + np.arccos(
        (b**2 + distance**2 - c**2) / (2 * b * distance)
    )
    pin = crank + b * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    A, B, C, D = (
        tuple(origin + R @ np.array([*p, 0.0]))
        for p in (np.zeros(2), crank[0], pin[0], np.array([d, 0.0]))
    )
    n = tuple(5.0 * R[:, 2])
    mechanism = Mechanism(
        "four-bar",
        [Body("crank"), Body("coupler"), Body("rocker")],
        [
            Revolute("A", GROUND, "crank", A, n),
            Revolute("B", "crank", "coupler", B, n),
            Revolute("C", "coupler", "rocker", C, n),
            Revolute("D", "rocker", GROUND, D, n),
        ],
        [Point("pin", "rocker", C)],
        [JointAngle("turn", "A")],
    )
    found = solved(mechanism, turn)
    expected = origin + np.column_stack([pin, np.zeros(len(pin))]) @ R.T
    np.testing.assert_allclose(found.points["pin"].position, expected, rtol=0, atol=1e-11)
    assert found.details["rank"] == found.details["unknowns"] == 3  # of six rows


def test_two_revolutes_and_a_rod() -> None:
    """RSSR, one turn of the crank."""
    radius, arm, P = 0.1, 0.35, np.array([0.6, 0.3, 0.1])
    e, f, axis = (rotation((0.3, 1.0, -0.2), 1.1)[:, k] for k in range(3))
    turn = np.linspace(0.0, 2 * math.pi, 181)
    B = radius * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1)
    C0 = P + arm * (math.cos(0.4) * e + math.sin(0.4) * f)
    L = float(np.linalg.norm(C0 - B[0]))
    # |P + arm (e cos + f sin) - B| = L
    u = P - B
    p, q, r = 2 * arm * (u @ e), 2 * arm * (u @ f), L**2 - arm**2 - (u * u).sum(axis=1)
    both = np.arctan2(q, p) + np.array([[1.0], [-1.0]]) * np.arccos(r / np.hypot(p, q))
    angle = both[np.argmin(abs(np.exp(1j * both[:, 0]) - np.exp(0.4j)))]
    C = P + arm * (np.cos(angle)[:, None] * e + np.sin(angle)[:, None] * f)
    mechanism = Mechanism(
        "RSSR",
        [Body("crank"), Body("rocker")],
        [
            Revolute("pivot", GROUND, "crank", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
            Revolute("swing", "rocker", GROUND, tuple(P), tuple(axis)),
            Distance("rod", "rocker", "crank", (tuple(C0), tuple(B[0]))),
        ],
        [Point("rod end", "rocker", tuple(C0))],
        [JointAngle("turn", "pivot")],
    )
    found = solved(mechanism, turn)
    np.testing.assert_allclose(found.points["rod end"].position, C, rtol=0, atol=1e-11)


@pytest.mark.parametrize("second", [Revolute, Spherical, Universal])
def test_a_door_on_two_hinges(second: type[Joint]) -> None:
    """A tree of one freedom: of its Jacobians of one column Pinocchio makes vectors."""
    z, top = (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)
    how = {Revolute: (z,), Spherical: (), Universal: ((z, (1.0, 0.0, 0.0)),)}[second]
    joints = [
        Revolute("lower", GROUND, "door", (0.0, 0.0, 0.0), z),
        second("upper", GROUND, "door", top, *how),
    ]
    handle, turn = (0.8, 0.0, 0.5), np.linspace(-1.0, 2.0, 7)
    mechanism = Mechanism(
        "door",
        [Body("door")],
        joints,
        [Point("handle", "door", handle)],
        [JointAngle("turn", "lower")],
    )
    found = solved(mechanism, turn).points["handle"]
    np.testing.assert_allclose(found.position, rotation(z, turn) @ handle, rtol=0, atol=1e-14)


@dataclass(frozen=True)
class Wind(Driver):
    type = "wind"


def test_unsupported_names_the_driver_or_joint(monkeypatch: pytest.MonkeyPatch) -> None:
    def reason(joints: Sequence[Joint], drivers: Sequence[Driver]) -> str:
        found = ENGINE.unsupported(case_of(Mechanism("x", [Body("A")], joints, [], drivers), [0.0]))
        assert found is not None
        return found

    monkeypatch.setattr(Joint, "registry", dict(Joint.registry))

    @dataclass(frozen=True)
    class Latch(Revolute):
        type = "latch"

    latch = Latch("bolt", GROUND, "A", HINGE, (0.0, 0.0, 1.0))
    assert "'bolt' (latch)" in reason([latch], [JointAngle("turn", "bolt")])
    assert "'gust' (wind)" in reason([CRANK], [Wind("gust")])


def test_version_is_none_where_pinocchio_does_not_import(monkeypatch: pytest.MonkeyPatch) -> None:
    assert isinstance(ENGINE.version(), str)
    monkeypatch.setattr(
        adapter.importlib, "import_module", lambda name: SimpleNamespace(__version__="0.4")
    )
    assert ENGINE.version() is None  # another package of that name

    def broken(name: str) -> object:
        raise OSError("libpinocchio.so: cannot open shared object file")

    monkeypatch.setattr(adapter.importlib, "import_module", broken)
    assert ENGINE.version() is None
