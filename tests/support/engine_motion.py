"""Motions by any engine: of mechanisms whose loops are cut elsewhere, against closed forms, the
native engine, and their own differences.
"""

import math
from contextlib import nullcontext
from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
from kincheck import (
    Body,
    Case,
    Distance,
    Fixed,
    JointAngle,
    Mechanism,
    Point,
    Revolute,
    Spherical,
    Translational,
    Universal,
    adapters,
)
from kincheck import solve as solve_natively
from kincheck.core.case.case import TIME, Output, Sweep, Truth
from kincheck.core.mechanism.tree import SpanningTree, spanning_tree

from .joint_loops import TYPES
from .mechanisms import ORIGIN, X, Z

TOL = 1e-12
TREES = tuple(
    each for each in ("mujoco", "pinocchio", "drake", "dart", "simbody") if each in adapters.ENGINES
)
"""The simulators whose unknowns are the coordinates of a tree."""
SIMULATORS = ("exudyn", *TREES)
ENGINES = pytest.mark.parametrize("engine", SIMULATORS)
BOTH_ORDERS = pytest.mark.parametrize("mirrored", [False, True], ids=["ij", "ji"])
# Exudyn's coordinates are absolute: no joint is cut. The rows of cut joints are shared code, which
# the last three enter as Pinocchio does.
IN_TREE_OR_CUT = pytest.mark.parametrize(
    ("engine", "closing"),
    [
        *((engine, False) for engine in SIMULATORS),
        *((engine, True) for engine in TREES[:2]),
        *(pytest.param(engine, True, marks=pytest.mark.nightly) for engine in TREES[2:]),
    ],
    ids=lambda each: each if isinstance(each, str) else ("tree", "cut")[each],
)
# Positions, velocities and accelerations [m, s]: round-off, amplified at most a thousandfold by the
# mechanisms at these speeds. Exudyn's accelerations rest on differences.
TOLERANCES = (1e-13, 1e-12, 1e-11)
EXUDYN_TOLERANCES = (1e-12, 1e-11, 1e-9)


def way_by_day(engine, kind):
    """Return the way that the tests of a change solve a joint in a simulator, in turn: 2 or 3 with
    the bodies in the other order, 1 or 3 with the joint cut.
    """
    return (SIMULATORS.index(engine) + TYPES.index(kind)) % 4


def installed(name, mode="projection"):
    known = adapters.ENGINES if mode == "projection" else adapters.SIMULATIONS
    engine = adapters.engine(name, mode) if name in known else None
    if engine is None or engine.version() is None:
        pytest.skip(f"{name} is not installed")
    return engine


def motion_case(mechanism, values, rate=1.0, design=0.0, motions=None):
    """A sweep of the first driver, with all points wanted."""
    outputs = tuple(
        Output(f"{point.name}.{axis}", point.name, direction, False, 1e-9, 0.0, "")
        for point in mechanism.points
        for axis, direction in zip("xyz", np.eye(3).tolist(), strict=True)
    )
    values = np.array(values, dtype=float)
    swept = mechanism.drivers[0].name if mechanism.drivers else TIME
    sweep = Sweep(swept, values, rate, design, motions=motions or {})
    return Case(mechanism.name, "test", Truth.CONSENSUS_ONLY, mechanism, sweep, outputs)


def solved(engine, mechanism, values, rate=1.0, cut=(), **more):
    """The trajectory; every sample is there.

    Args:
        cut: joints that close loops in a tree; their bodies hang on others, or are free.
        more: see `motion_case`.
    """
    given, case = installed(engine), motion_case(mechanism, values, rate, **more)
    assert given.unsupported(case) is None
    with cutting(*cut) if cut else nullcontext():
        found = given.solve(given.build(case), case, TOL)
    assert found.message == ""
    assert found.solved.all()
    assert found.residual <= TOL
    return found


def cutting(*names):
    """Trees without these joints; the native engine, whose models are kept, has none."""

    def tree(mechanism, first=()):
        kept = [each for each in mechanism.joints if each.name not in names]
        bare = replace(mechanism, joints=kept, drivers=(), couplers=(), forces=())
        rest = spanning_tree(bare)
        return SpanningTree(rest.branches, (*rest.cut, *map(mechanism.joint, names)))

    return mock.patch("kincheck.adapters.shared.tree_plan.spanning_tree", tree)


def tolerances(engine):
    return EXUDYN_TOLERANCES if engine == "exudyn" else TOLERANCES


def assert_motion(motion, *expected, atol=TOLERANCES):
    """Position, and as far as given velocity and acceleration, as expected."""
    found = (motion.position, motion.velocity, motion.acceleration)
    for values, wanted, error in zip(found, expected, atol, strict=False):
        np.testing.assert_allclose(values, wanted, rtol=0, atol=error)


def planar(x, y):
    """Position, velocity and acceleration of a point in the plane z = 0, from jets."""
    return [np.column_stack([getattr(x, k), getattr(y, k), 0.0 * x.x]) for k in "xva"]


def assert_as_native(engine, mechanism, values, rate=1.0, cut=(), **more):
    """The motions of all points are those of the native engine; return the engine's trajectory."""
    found = solved(engine, mechanism, values, rate, cut, **more)
    native = solve_natively(mechanism, mechanism.drivers[0].name, values, rate=rate, **more)
    assert native.solved.all()
    for name, motion in native.points.items():
        expected = motion.position, motion.velocity, motion.acceleration
        assert_motion(found.points[name], *expected, atol=tolerances(engine))
    return found


def assert_consistent(motion, dt):
    """Velocity and acceleration against eighth-order differences over uniform samples."""
    weights, n = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280]), len(motion.position)
    for x, rates in ((motion.position, motion.velocity), (motion.velocity, motion.acceleration)):
        pairs = ((w, x[4 + k : n - 4 + k], x[4 - k : n - 4 - k]) for k, w in enumerate(weights, 1))
        found = sum(w * (after - before) for w, after, before in pairs) / dt
        # differences: round-off 1e-16 / dt of values about 1, times the mechanism's amplification
        assert np.abs(found - rates[4:-4]).max() <= 1e-10 * (1.0 + np.abs(rates).max())


def mechanism_of(joints, points, drivers, couplers=(), fixed=()):
    """Bodies are those of the joints; points: name -> (body, position)."""
    names = dict.fromkeys(body for joint in joints for body in joint.bodies if body != "ground")
    bodies = [Body(name, fixed=name in fixed) for name in names]
    places = [Point(name, body, tuple(position)) for name, (body, position) in points.items()]
    return Mechanism("test", bodies, joints, places, drivers, couplers)


def ordered(joint, mirrored):
    return joint.reversed() if mirrored else joint


def rotation(axis, angle):
    """Rodrigues' formula, shape (..., 3, 3)."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.asarray(angle)[..., None, None]
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)


# A crank turn, the last sample left out: periodic, so that differentiation by FFT is exact to
# round-off.
CRANK_TURN, CRANK_RATE = np.linspace(-math.pi, math.pi, 100, endpoint=False), 3.0
PERIODIC = (1e-13, 1e-11, 1e-9)


def periodic(x):
    """Samples over a crank turn with their first and second derivative by time."""
    k = 1j * np.fft.fftfreq(len(x), 1.0 / len(x))[:, None]
    rate, f = CRANK_RATE, np.fft.fft(x, axis=0)
    return x, *(np.fft.ifft((rate * k) ** n * f, axis=0).real for n in (1, 2))


def rocker(B, length):
    """C = D + 0.4 (0, cos f, sin f) at the distance of a rod from B: p cos f + q sin f = k."""
    d = np.array([0.6, 0.3, 0.1]) - B
    p, q, k = 0.8 * d[:, 1], 0.8 * d[:, 2], length**2 - 0.4**2 - (d * d).sum(axis=1)
    f = np.arctan2(q, p) + np.arccos(k / np.hypot(p, q))
    return np.stack([0.6 + 0 * f, 0.3 + 0.4 * np.cos(f), 0.1 + 0.4 * np.sin(f)], axis=1)


CRANK_PIN = 0.1 * np.stack([np.cos(CRANK_TURN), np.sin(CRANK_TURN), 0 * CRANK_TURN], axis=1)
B0 = np.array([[0.1, 0.0, 0.0]])
C0 = tuple(rocker(B0, 0.76)[0])
RSSR = (
    Revolute("a", "ground", "crank", ORIGIN, Z),
    Revolute("c", "rocker", "ground", (0.6, 0.3, 0.1), X),
    Distance("rod", "crank", "rocker", (tuple(B0[0]), C0)),
)


def slider_crank():
    """The spatial slider-crank of the IFToMM benchmarks, with a peg on the rod."""
    axes = ((0.48, 0.6, -0.64), (0.0, 0.64, 0.6))
    joints = [
        Revolute("pivot", "ground", "crank", (0.0, 0.1, 0.12), X),
        Spherical("pin", "crank", "rod", (0.0, 0.1, 0.2)),
        Universal("gudgeon", "rod", "slider", (0.2, 0.0, 0.0), axes),
        Translational("guide", "ground", "slider", (0.2, 0.0, 0.0), (2.0, 0.0, 0.0)),
        Fixed("glue", "rod", "peg"),
    ]
    points = {"slider": ("slider", (0.2, 0.0, 0.0)), "peg": ("peg", (0.1, 0.05, 0.2))}
    return mechanism_of(joints, points, [JointAngle("crank", "pivot")])


# The slider's x = sqrt(l^2 - y^2 - z^2) for the crank pin's y, z.
SLIDER = np.outer(
    np.sqrt(
        0.09 - (0.1 - 0.08 * np.sin(CRANK_TURN)) ** 2 - (0.12 + 0.08 * np.cos(CRANK_TURN)) ** 2
    ),
    [1.0, 0.0, 0.0],
)


def with_joints(mechanism, *joints, **others):
    """The mechanism with joints in front, instead of those of the same names."""
    names = {joint.name for joint in joints}
    kept = [each for each in mechanism.joints if each.name not in names]
    return replace(mechanism, joints=(*joints, *kept), **others)
