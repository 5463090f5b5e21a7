"""One motion, two mechanisms that have it: joints made of others, bodies left out, worlds mirrored
or far away. No oracle.
"""

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
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
    Polynomial,
    RackPinion,
    RevoluteSpherical,
    Screw,
    Spherical,
    Universal,
)
from kincheck.core.case.case import Case, Output, Sweep, Truth
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.joint_probe import probes

from ..support.mechanisms import A0, B0, C0, D0, four_bar, mcpherson, placed, slider_crank

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


# Worlds


def mirrored(mechanism):
    """The mechanism in a mirror, y -> -y: what turns right turns left."""

    def seen(a):
        return tuple(np.multiply(a, (1.0, -1.0, 1.0)).tolist())

    m = placed(mechanism, seen, seen)
    # an axis keeps its place and sense along itself, so a turn about it changes its sign, and what
    # ties a turn to a slide
    joints = [
        replace(joint, lead=-joint.lead) if isinstance(joint, Screw) else joint
        for joint in m.joints
    ]
    joints = [
        replace(joint, axes=tuple(map(seen, joint.axes))) if hasattr(joint, "axes") else joint
        for joint in joints
    ]
    couplers = [
        replace(each, radius=-each.radius)
        if isinstance(each, RackPinion)
        else each.in_units(1.0, -1.0)
        if isinstance(each, Polynomial)
        else each
        for each in m.couplers
    ]
    bodies = [
        replace(b, euler_parameters=tuple(np.multiply(b.euler_parameters, (1.0, -1.0, 1.0, -1.0))))
        for b in m.bodies
    ]
    return replace(m, joints=joints, couplers=couplers, bodies=bodies)


@pytest.mark.parametrize("engine", adapters.ENGINES)
def test_the_other_wheel_moves_as_this_one(engine):
    found = motion(mirrored(mcpherson()), STROKES, engine)
    assert_same(found * (1.0, -1.0, 1.0), motion(mcpherson(), STROKES), LIMITS[engine])


@pytest.mark.parametrize("case", probes(), ids=lambda each: each.name)
def test_every_joint_moves_as_its_mirror_image(case):
    """A turn backwards: the velocity changes its sign once more."""
    turns = np.linspace(-0.4, 0.4, 9)
    found, expected = motion(mirrored(case.mechanism), -turns), motion(case.mechanism, turns)
    # sums in another order: round-off over the smallest pivot of a probe, once more for each
    # derivative
    limits = 2.2e-16 * np.array([50.0, 50.0**2, 50.0**3])
    assert_same(
        found * (1.0, -1.0, 1.0) * np.array([1.0, -1.0, 1.0])[:, None, None], expected, limits
    )


FAR = np.array([1000.0, -1000.0, 500.0])


@pytest.mark.parametrize("engine", adapters.ENGINES)
@pytest.mark.parametrize(
    ("mechanism", "values"),
    [(mcpherson(), STROKES), (four_bar(), TURNS)],
    ids=["strut", "four_bar"],
)
def test_a_kilometre_away(mechanism, values, engine):
    """Every hardpoint is rounded at 1.1e-13 m there, and so is every sum that a simulator makes of
    them.
    """
    found = motion(placed(mechanism, lambda point: tuple((FAR + point).tolist())), values, engine)
    found[0] -= FAR
    assert_same(found, motion(mechanism, values), 1000.0 * NATIVE + LIMITS[engine])


LENGTHS = ("origin", "point", "points", "position", "length", "atol")


@pytest.mark.parametrize(("name", "swept"), [("mcpherson_strut", 1e3), ("rssr", np.pi / 180.0)])
def test_millimetres_and_degrees_move_as_metres_and_radians(name, swept, tmp_path):
    """The strut is in metres, the RSSR in metres and degrees; both once more in millimetres and
    radians.
    """
    file = Path(__file__).parents[2] / "cases" / f"{name}.toml"
    tables = tomllib.loads(file.read_text(encoding="utf-8"))
    for entry in (
        each
        for table in ("bodies", "joints", "points", "outputs")
        for each in tables[table].values()
    ):
        # a point may be a name
        lengths = {key for key in LENGTHS if not isinstance(entry.get(key, ""), str)}
        entry |= {key: np.multiply(1e3, entry[key]).tolist() for key in lengths}
    tables["sweep"] |= {key: swept * tables["sweep"][key] for key in ("start", "stop", "rate")}
    tables["units"] = {"length": "mm"}
    tables.pop("reference", None)
    (tmp_path / "case.json").write_text(json.dumps(tables))
    one, other = load_case(file), load_case(tmp_path / "case.json")
    assert other.sweep.rate == pytest.approx(one.sweep.rate, rel=1e-15)
    # numbers of the RSSR are up to 5.5 m, and it turns by up to 6.3 rad
    assert_same(
        motion(other.mechanism, other.sweep.change),
        motion(one.mechanism, one.sweep.change),
        6.0 * NATIVE,
    )


# Samples


@pytest.mark.parametrize("engine", adapters.ENGINES)
@pytest.mark.parametrize(
    ("mechanism", "values"),
    [(mcpherson(), STROKES), (slider_crank(), TURNS)],
    ids=["strut", "slider_crank"],
)
def test_samples_do_not_depend_on_their_order_nor_on_others(mechanism, values, engine):
    once = motion(mechanism, values, engine)
    assert_same(motion(mechanism, values[::-1], engine)[:, ::-1], once, LIMITS[engine])
    twice = np.linspace(values[0], values[-1], 2 * len(values) - 1)
    assert_same(motion(mechanism, twice, engine)[:, ::2], once, LIMITS[engine])


# Order and names


@given(data=st.data())
@settings(derandomize=True, max_examples=8, deadline=None)
def test_order_and_names_do_not_matter(data):
    base, values = data.draw(
        st.sampled_from(
            [(mcpherson(), STROKES), (four_bar(), TURNS), (with_all_of_them(mcpherson()), STROKES)]
        )
    )
    words = st.text("abcXYZ .-_\u00e9\u03b1", min_size=1, max_size=8)
    count = len(base.bodies) + len(base.joints) + len(base.points)
    names = iter(
        data.draw(
            st.lists(
                words.filter(lambda word: word != "ground"),
                min_size=count,
                max_size=count,
                unique=True,
            )
        )
    )
    of_bodies = {body.name: next(names) for body in base.bodies} | {"ground": "ground"}
    of_joints = {joint.name: next(names) for joint in base.joints}
    of_points = {point.name: next(names) for point in base.points}
    joints = [
        replace(each, name=of_joints[each.name], i=of_bodies[each.i], j=of_bodies[each.j])
        for each in base.joints
    ]
    (driver,) = base.drivers
    renamed = (
        {"point": of_points[driver.point]}
        if hasattr(driver, "point")
        else {"joint": of_joints[driver.joint]}
    )
    shuffled = replace(
        base,
        bodies=data.draw(
            st.permutations([replace(body, name=of_bodies[body.name]) for body in base.bodies])
        ),
        joints=data.draw(st.permutations(joints)),
        points=[
            replace(point, name=of_points[point.name], body=of_bodies[point.body])
            for point in base.points
        ],
        drivers=[replace(driver, **renamed)],
    )
    assert_same(motion(shuffled, values), motion(base, values))
