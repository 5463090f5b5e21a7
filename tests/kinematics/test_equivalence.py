"""One motion, two mechanisms that have it: joints made of others, bodies left out, worlds mirrored
or far away. No oracle.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import adapters
from kincheck.core import (
    Body,
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
)
from kincheck.core.case.case import Case, Output, Sweep, Truth

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


def changed(mechanism, *joints, without=(), bodies=(), lost=(), **others):
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


def with_cylinder_and_cross(m):
    cross = Universal("top", "strut", "chassis", TOP, (tuple(np.cross(SLIDE, X)), X))
    return changed(
        m,
        Cylindrical("slide", "knuckle", "strut", LOWER, SLIDE),
        cross,
        without=["slide", "strut_top"],
    )


def with_a_line_through_the_top(m):
    line = Inline("strut", "knuckle", "chassis", TOP, SLIDE)
    return changed(m, line, without=["slide", "strut_top"], lost=["strut"])


def with_a_line_and_a_lock(m):
    line = Inline("line", "knuckle", "strut", LOWER, SLIDE)
    return changed(m, line, OrientationLock("lock", "strut", "knuckle"), without=["slide"])


def with_a_rod_on_a_cross(m):
    ends = [
        Spherical("outer", "rod", "knuckle", ROD[0]),
        Universal("inner", "rack", "rod", ROD[1], (ACROSS, UPRIGHT)),
    ]
    return changed(m, *ends, without=["tie_rod"], bodies=[Body("rod", ROD[1])])


def with_a_rod_on_balls(m):
    ends = [Spherical("outer", "rod", "knuckle", ROD[0]), Spherical("inner", "rack", "rod", ROD[1])]
    spin = PerpendicularAxes("spin", "rack", "rod", (ACROSS, UPRIGHT))
    return changed(m, *ends, spin, without=["tie_rod"], bodies=[Body("rod", ROD[0])])


def with_two_rods_for_an_arm(m):
    rods = [
        Distance(f"arm_{k}", "chassis", "knuckle", ((PIVOT[0] + k, *PIVOT[1:]), BALL))
        for k in (-0.4, 0.1)
    ]
    return changed(m, *rods, without=["lca_pivot", "ball"], lost=["lca"])


def with_a_link_for_an_arm(m):
    link = RevoluteSpherical("arm", "chassis", "knuckle", (PIVOT, BALL), X)
    return changed(m, link, without=["lca_pivot", "ball"], lost=["lca"])


def with_a_pivot_of_ball_and_axes(m):
    return changed(
        m,
        Spherical("at", "lca", "chassis", PIVOT),
        ParallelAxes("along", "chassis", "lca", X),
        without=["lca_pivot"],
    )


def with_a_pivot_of_two_bearings(m):
    bearing = Inline("bearing", "chassis", "lca", (PIVOT[0] + 0.3, *PIVOT[1:]), X)
    return changed(m, Spherical("at", "lca", "chassis", PIVOT), bearing, without=["lca_pivot"])


def with_a_ball_of_three_planes(m):
    planes = [
        InPlane(f"plane_{k}", "lca", "knuckle", BALL, axis)
        for k, axis in enumerate((SLIDE, ROD[0], X))
    ]
    return changed(m, *planes, without=["ball"])


def with_all_of_them(m):
    return with_a_rod_on_balls(with_two_rods_for_an_arm(with_cylinder_and_cross(m)))


STRUTS = (
    with_cylinder_and_cross,
    with_a_line_through_the_top,
    with_a_line_and_a_lock,
    with_a_rod_on_a_cross,
    with_a_rod_on_balls,
    with_two_rods_for_an_arm,
    with_a_link_for_an_arm,
    with_a_pivot_of_ball_and_axes,
    with_a_pivot_of_two_bearings,
    with_a_ball_of_three_planes,
    with_all_of_them,
)

# Decompositions of the four-bar, whose revolute joints say three things twice; these say all once


def coupled_by_ball_and_cross(m):
    return changed(
        m,
        Spherical("B", "crank", "coupler", B0),
        Universal("C", "coupler", "rocker", C0, (Y, X)),
        without=["B", "C"],
    )


def coupled_by_cylinder_and_ball(m):
    return changed(
        m,
        Cylindrical("B", "coupler", "crank", B0, Y),
        Spherical("C", "coupler", "rocker", C0),
        without=["B", "C"],
    )


def coupled_by_a_rod(m):
    rod = Distance("rod", "crank", "rocker", (B0, C0))
    return changed(m, rod, without=["B", "C"], lost=["coupler"], points=[Point("C", "rocker", C0)])


def coupled_in_a_plane(m):
    planes = [Planar(f"plane_{body}", "ground", body, A0, Y) for body in ("coupler", "rocker")]
    pins = [
        Inline("B", "crank", "coupler", B0, Y),
        Inline("C", "coupler", "rocker", C0, Y),
        Inline("D", "rocker", "ground", D0, Y),
    ]
    return changed(m, *planes, *pins, without=["B", "C", "D"])


FOUR_BARS = (
    coupled_by_ball_and_cross,
    coupled_by_cylinder_and_ball,
    coupled_by_a_rod,
    coupled_in_a_plane,
)


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


@pytest.mark.parametrize("engine", adapters.ENGINES)
@pytest.mark.parametrize("variant", STRUTS, ids=lambda each: each.__name__)
def test_the_strut_moves_alike_however_it_is_composed(variant, engine):
    assert_same(
        motion(variant(mcpherson()), STROKES, engine), motion(mcpherson(), STROKES), LIMITS[engine]
    )


@pytest.mark.parametrize("engine", adapters.ENGINES)
@pytest.mark.parametrize("variant", FOUR_BARS, ids=lambda each: each.__name__)
def test_the_four_bar_moves_alike_however_it_is_composed(variant, engine):
    assert_same(
        motion(variant(four_bar()), TURNS, engine), motion(four_bar(), TURNS), LIMITS[engine]
    )
