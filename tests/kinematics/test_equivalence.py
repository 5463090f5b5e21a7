"""One motion, two mechanisms that have it: joints made of others, bodies left out, worlds mirrored
or far away. No oracle.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import (
    Body,
    Case,
    Cylindrical,
    Distance,
    Inline,
    InPlane,
    OrientationLock,
    ParallelAxes,
    PerpendicularAxes,
    Planar,
    Point,
    RevoluteSpherical,
    Spherical,
    Universal,
    adapters,
)
from kincheck.core.case.case import Output, Sweep, Truth

from ..support.mechanisms import A0, B0, C0, D0, four_bar, mcpherson

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
STROKES = np.linspace(-0.08, 0.08, 17)
TURNS = np.linspace(-2.0, 4.0, 25)

# Position, velocity and acceleration, per unit of speed: what a change of any coordinate of any
# hardpoint changes them by, summed over all of them, is no more than this times the change
# (measured by moving each by a micrometre; the larger of strut and four-bar, whose sums are 1.1,
# 16, 88 and 8.6, 10, 24).
SENSITIVITY = np.array([9.0, 17.0, 88.0])
# Both mechanisms round each of their numbers, which are below 2 m.
NATIVE = 2 * 2.2e-16 * SENSITIVITY
# Simulators stop at residuals of 1e-12. Exudyn's accelerations come from differences.
SIMULATED = 1e-12 * SENSITIVITY
LIMITS = dict.fromkeys(adapters.ENGINES, SIMULATED) | {
    "native": NATIVE,
    "exudyn": np.maximum(SIMULATED, (0.0, 0.0, 1e-8)),
}


def changed(mechanism, joints, without=(), bodies=(), lost=(), **others):
    """The mechanism with joints instead of some of its own, further bodies, and without others."""
    kept = [joint for joint in mechanism.joints if joint.name not in without]
    left = [body for body in mechanism.bodies if body.name not in lost]
    return replace(mechanism, joints=[*kept, *joints], bodies=[*left, *bodies], **others)


PIVOT, BALL, TOP, LOWER = (
    (1.17, 0.353, 0.005),
    (0.9676, 0.660, -0.010),
    (1.0, 0.55, 0.6),
    (0.97772, 0.605, 0.180),
)
SLIDE = tuple(np.subtract(TOP, LOWER))
ROD = ((1.115, 0.665, 0.118), (1.14, 0.355, 0.1455))
ALONG = np.subtract(*ROD)
ACROSS = tuple(np.cross(ALONG, X))
UPRIGHT = tuple(np.cross(ALONG, ACROSS))


STRUTS = {
    "cylinder and cross": {
        "joints": [
            Cylindrical("slide", "knuckle", "strut", LOWER, SLIDE),
            Universal("top", "strut", "chassis", TOP, (tuple(np.cross(SLIDE, X)), X)),
        ],
        "without": ["slide", "strut_top"],
    },
    "a line through the top": {
        "joints": [Inline("strut", "knuckle", "chassis", TOP, SLIDE)],
        "without": ["slide", "strut_top"],
        "lost": ["strut"],
    },
    "a line and a lock": {
        "joints": [
            Inline("line", "knuckle", "strut", LOWER, SLIDE),
            OrientationLock("lock", "strut", "knuckle"),
        ],
        "without": ["slide"],
    },
    "a rod on a cross": {
        "joints": [
            Spherical("outer", "rod", "knuckle", ROD[0]),
            Universal("inner", "rack", "rod", ROD[1], (ACROSS, UPRIGHT)),
        ],
        "without": ["tie_rod"],
        "bodies": [Body("rod", ROD[1])],
    },
    "a rod on balls": {
        "joints": [
            Spherical("outer", "rod", "knuckle", ROD[0]),
            Spherical("inner", "rack", "rod", ROD[1]),
            PerpendicularAxes("spin", "rack", "rod", (ACROSS, UPRIGHT)),
        ],
        "without": ["tie_rod"],
        "bodies": [Body("rod", ROD[0])],
    },
    "two rods for an arm": {
        "joints": [
            Distance(f"arm_{k}", "chassis", "knuckle", ((PIVOT[0] + k, *PIVOT[1:]), BALL))
            for k in (-0.4, 0.1)
        ],
        "without": ["lca_pivot", "ball"],
        "lost": ["lca"],
    },
    "a link for an arm": {
        "joints": [RevoluteSpherical("arm", "chassis", "knuckle", (PIVOT, BALL), X)],
        "without": ["lca_pivot", "ball"],
        "lost": ["lca"],
    },
    "a pivot of ball and axes": {
        "joints": [
            Spherical("at", "lca", "chassis", PIVOT),
            ParallelAxes("along", "chassis", "lca", X),
        ],
        "without": ["lca_pivot"],
    },
    "a pivot of two bearings": {
        "joints": [
            Spherical("at", "lca", "chassis", PIVOT),
            Inline("bearing", "chassis", "lca", (PIVOT[0] + 0.3, *PIVOT[1:]), X),
        ],
        "without": ["lca_pivot"],
    },
    "a ball of three planes": {
        "joints": [
            InPlane(f"plane_{k}", "lca", "knuckle", BALL, axis)
            for k, axis in enumerate((SLIDE, ROD[0], X))
        ],
        "without": ["ball"],
    },
}
ALL = "a rod on balls", "two rods for an arm", "cylinder and cross"


def composed(*names):
    """The strut with joints changed, by the names of `STRUTS`."""
    mechanism = mcpherson()
    for name in names:
        mechanism = changed(mechanism, **STRUTS[name])
    return mechanism


FOUR_BARS = {
    "ball and cross": {
        "joints": [
            Spherical("B", "crank", "coupler", B0),
            Universal("C", "coupler", "rocker", C0, (Y, X)),
        ],
        "without": ["B", "C"],
    },
    "cylinder and ball": {
        "joints": [
            Cylindrical("B", "coupler", "crank", B0, Y),
            Spherical("C", "coupler", "rocker", C0),
        ],
        "without": ["B", "C"],
    },
    "a rod": {
        "joints": [Distance("rod", "crank", "rocker", (B0, C0))],
        "without": ["B", "C"],
        "lost": ["coupler"],
        "points": [Point("C", "rocker", C0)],
    },
    "planes": {
        "joints": [
            *(Planar(f"plane_{body}", "ground", body, A0, Y) for body in ("coupler", "rocker")),
            Inline("B", "crank", "coupler", B0, Y),
            Inline("C", "coupler", "rocker", C0, Y),
            Inline("D", "rocker", "ground", D0, Y),
        ],
        "without": ["B", "C", "D"],
    },
}
"""Decompositions of the four-bar, whose revolute joints say three things twice; these say all
once.
"""


def case_of(mechanism, values):
    """The first driver swept, the first point watched; its motion does not depend on the
    outputs.
    """
    point = mechanism.points[0].name
    outputs = tuple(
        Output(axis, point, along, False, 1e-9, 0.0, "")
        for axis, along in zip("xyz", (X, Y, Z), strict=True)
    )
    sweep = Sweep(mechanism.drivers[0].name, np.asarray(values))
    return Case(mechanism.name, "", Truth.CONSENSUS_ONLY, mechanism, sweep, outputs)


def motion(mechanism, values, engine="native"):
    """Position, velocity and acceleration of the first point, shape (3, n, 3)."""
    solver, case = adapters.engine(engine), case_of(mechanism, values)
    if solver.version() is None:
        pytest.skip(f"{engine} is not installed")
    found = solver.solve(solver.build(case), case, 1e-12)
    assert found.solved.all(), found.message
    (moved,) = found.points.values()
    return np.array([moved.position, moved.velocity, moved.acceleration])


def assert_same(found, expected, limits=NATIVE):
    assert (np.abs(found - expected).max(axis=(1, 2)) <= limits).all(), (
        np.abs(found - expected).max(axis=(1, 2)) / limits
    )


@pytest.mark.by_day(3)
@pytest.mark.parametrize("engine", adapters.ENGINES)
@pytest.mark.parametrize("variant", [*STRUTS, ALL], ids=str)
def test_strut_motion_of_equivalent_joints(variant, engine):
    mechanism = composed(*(variant if variant is ALL else [variant]))
    assert_same(motion(mechanism, STROKES, engine), motion(mcpherson(), STROKES), LIMITS[engine])


@pytest.mark.by_day(3)
@pytest.mark.parametrize("engine", adapters.ENGINES)
@pytest.mark.parametrize("variant", FOUR_BARS)
def test_four_bar_motion_of_equivalent_joints(variant, engine):
    mechanism = changed(four_bar(), **FOUR_BARS[variant])
    assert_same(motion(mechanism, TURNS, engine), motion(four_bar(), TURNS), LIMITS[engine])
