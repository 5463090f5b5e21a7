"""Suspension outputs: formulas, conventions of signs, and samples without a value."""

import csv
import tomllib
from dataclasses import replace
from itertools import islice

import mpmath as mp
import numpy as np
import pytest
from kincheck import cases
from kincheck.adapters.native import Native
from kincheck.cases import (
    chrono_double_wishbone_arm,
    chrono_macpherson_arm,
    chrono_sedan_double_wishbone_arm,
    mcpherson_arm,
)
from kincheck.cases.jet import Jet
from kincheck.core import Distance
from kincheck.core.case.case import Case, Output, Sweep, Truth
from kincheck.core.case.quantity import with_markers
from kincheck.core.extensions.hardpoints.suspension import (
    Axle,
    Convention,
    Reaction,
    Side,
    SuspensionOutput,
    Vehicle,
)
from kincheck.core.extensions.hardpoints.suspension_section import with_slopes
from kincheck.core.harness.compare import deviations, output_series
from kincheck.core.joints import Revolute
from kincheck.core.mechanism.mechanism import Body, Mechanism, Point
from kincheck.core.mechanism.motions import JointAngle
from mpmath import mpf

from ...oracles import strut_oracle
from ...support.suspension_files import AXES, STRUT, loaded, mirrored, unreferenced

TOL = 1e-12
ROUND_OFF = 1e-14
"""A hundred roundings of numbers near one, for values; derivatives are sums of a few products of
such numbers.
"""


def solved(case):
    """Every output of a case by the native engine, by name."""
    engine = Native()
    trajectory = engine.solve(engine.build(case), case, TOL)
    assert trajectory.solved.all()
    return {output.name: output_series(case, output, trajectory) for output in case.outputs}


def hinged(center, hinge, axis, angles, types, rate=1.0, points=(), between=None, **vehicle):
    """A wheel carrier on one hinge, turned through the angles: outputs by type, each with its
    slope.
    """
    car = {
        "convention": Convention.ISO_8855,
        "side": Side.LEFT,
        "forward": (1.0, 0.0, 0.0),
        "up": (0.0, 0.0, 1.0),
        "wheel_center": "wheel",
        "wheel_radius": 0.3,
    }
    wheel = Vehicle(**car | vehicle)
    outputs = [
        SuspensionOutput.registry[each](
            each,
            wheel,
            1e-9,
            0.0,
            "test",
            **({"between": between} if each == "motion_ratio" else {}),
        )
        for each in types.split()
    ]
    mechanism = Mechanism(
        "hinged",
        [Body("carrier"), Body("chassis", fixed=True)],
        [Revolute("hinge", "ground", "carrier", hinge, axis)],
        [Point("wheel", "carrier", center), *points],
        [JointAngle("turn", "hinge")],
    )
    markers, sweep = with_markers(mechanism, outputs), Sweep("turn", np.asarray(angles), rate)
    outputs = with_slopes(outputs, 1.0)
    return solved(Case("hinged", "test", Truth.CONSENSUS_ONLY, markers, sweep, outputs))


def assert_positions(found, true, atol=ROUND_OFF):
    for name, values in true.items():
        assert found[name].position == pytest.approx(values, abs=atol), name


ANGLES = np.linspace(-0.3, 0.4, 8)


def test_horizontal_wheel_has_no_toe():
    """Its axis of rotation is vertical, but for round-off: no direction in the road plane."""
    rolled, types = [0.5 * np.pi, 1.5 * np.pi, 0.3], "toe steer_angle half_track_change"
    found = hinged((0.0, 0.7, 0.3), (0.0, 0.6, 0.3), (1, 0, 0), rolled, f"{types} camber")
    for values in (*(found[each].position for each in types.split()), found["camber"].velocity):
        assert np.isnan(values).tolist() == [True, True, False]
    assert np.abs(found["camber"].position[:2]) == pytest.approx(0.5 * np.pi, abs=ROUND_OFF)


@pytest.mark.parametrize(
    ("axis", "gone", "kept"),
    [
        ((1, 0, 0), "caster", "kingpin_inclination"),
        ((0, 1, 0), "kingpin_inclination", "caster"),
    ],
    ids=["rolled", "pitched"],
)
def test_steering_axis_along_view_is_nan(axis, gone, kept):
    ends = Point("low", "carrier", (0.0, 0.6, 0.1)), Point("high", "carrier", (0.0, 0.6, 0.5))
    place = (0.0, 0.7, 0.3), (0.0, 0.6, 0.3), axis, [0.5 * np.pi, 0.1]
    found = hinged(*place, f"{gone} {kept} scrub_radius", 1.0, ends, kingpin=("low", "high"))
    assert np.isfinite(found[kept].position).all()
    for each in (gone, "scrub_radius"):
        assert np.isfinite(found[each].position).tolist() == [False, True]


def test_half_turn_of_toe_is_positive():
    """Engines agree to round-off, which must not choose between two ends of the range."""
    about = np.pi * (1.0 + np.array([-1e-12, 0.0, 1e-12]))
    place = (0.0, 0.7, 0.3), (0.0, 0.6, 0.3), (0, 0, 1), [*-about, *about]
    assert_positions(hinged(*place, "toe steer_angle"), {"toe": np.pi, "steer_angle": np.pi}, 1e-11)


def test_swing_axle_outputs_in_closed_form():
    """A left wheel on an arm about x: it cambers as the arm turns, and its instant centre is the
    hinge.
    """
    # hinge p outboard and h above the wheel centre at design
    half, p, h, radius = 0.75, 0.2, 0.08, 0.3
    rod = Point("foot", "carrier", (0.1, 0.5, 0.0)), Point("top", "chassis", (0.1, 0.4, 0.6))
    types = "camber toe half_track_change roll_center_height motion_ratio"
    place = (0.1, half, 0.0), (0.0, p, h), (1, 0, 0), ANGLES
    found = hinged(*place, types, 2.0, rod, ("foot", "top"))
    c, s = np.cos(ANGLES), np.sin(ANGLES)

    def turned(y, z):
        return p + c * (y - p) - s * (z - h), h + s * (y - p) + c * (z - h)

    y, z = turned(half, 0.0)
    up = y - p  # dz by the angle, for a turn about the hinge
    at_road = y + radius * s, z - radius * c
    # the line from the contact centre through the hinge, cut with the centre plane
    slope = (h - at_road[1]) / (at_road[0] - p)
    foot = turned(0.5, 0.0)
    way = np.subtract((0.4, 0.6), np.transpose(foot))
    rate = np.stack([-(foot[1] - h), foot[0] - p], axis=1)  # of the foot, by the angle
    true = {
        "camber": -ANGLES,  # jounce tips the top inboard
        "camber.per_travel": -1.0 / up,
        "toe": 0.0,
        "half_track_change": at_road[0] - half,
        "roll_center_height": slope * at_road[0],
        "motion_ratio": (way * rate).sum(1) / np.linalg.norm(way, axis=1) / up,
    }
    assert_positions(found, true)
    assert found["camber"].velocity == pytest.approx(-2.0, abs=ROUND_OFF)
    # d(-1/up)/dangle = up'/up^2, and up' = -(z - h); by time, twice that
    rates = found["camber.per_travel"].velocity
    assert rates == pytest.approx(-2.0 * (z - h) / up**2, abs=ROUND_OFF)
    assert found["roll_center_height"].acceleration is None


@pytest.mark.parametrize("side", Side)
def test_trailing_arm_outputs_in_closed_form(side):
    """A rear wheel behind a lateral hinge: no camber, no track change, and anti-effects by the
    slope up to the hinge.
    """
    y = 0.7 * side.left
    ahead, above = 0.5, 0.1
    car = {
        "axle": Axle.REAR,
        "wheelbase": 2.5,
        "cg_height": 0.5,
        "brake_share": 0.4,
        "drive_share": 1.0,
        "side": side,
    }
    none = "camber toe half_track_change roll_center_height"
    place = (-1.0, y, 0.3), (-1.0 + ahead, 0.0, 0.3 + above), (0, 1, 0), ANGLES
    found = hinged(*place, f"{none} wheelbase_change anti_squat anti_lift", **car)
    outboard = hinged(*place, "anti_squat", **car | {"drive": Reaction.OUTBOARD})
    c, s = np.cos(ANGLES), np.sin(ANGLES)
    x, z = -ahead * c - above * s, ahead * s - above * c  # of the wheel centre from the hinge
    # rearward lengthens
    assert_positions(found, dict.fromkeys(none.split(), 0.0) | {"wheelbase_change": -(x + ahead)})
    at_road = 2.5 / 0.5 * ((0.3 - z) / -x)
    anti = {"anti_squat": 2.5 / 0.5 * (-z / -x), "anti_lift": 0.4 * at_road}
    assert_positions(found, anti, 1e-13)
    assert_positions(outboard, {"anti_squat": at_road}, 1e-13)


def test_leading_arm_anti_dive():
    """A front wheel ahead of its hinge does not dive: the way to the instant centre rises
    rearward.
    """
    car = {"axle": Axle.FRONT, "wheelbase": 2.5, "cg_height": 0.5, "brake_share": 0.6}
    found = hinged((0.0, 0.7, 0.3), (-0.5, 0.0, 0.4), (0, 1, 0), [0.0], "anti_dive", **car)
    assert_positions(found, {"anti_dive": 0.6 * 2.5 / 0.5 * 0.4 / 0.5}, 1e-13)


@pytest.mark.parametrize("side", Side)
def test_steered_wheel_outputs_in_closed_form(side):
    """Toe, camber, trail and scrub radius of a wheel turned about an oblique kingpin, by a rotation
    matrix.
    """
    out = side.left
    low, high = np.array([0.02, 0.6 * out, 0.1]), np.array([-0.03, 0.55 * out, 0.5])
    center, toe, camber, radius = np.array([0.0, 0.7 * out, 0.3]), 0.01, -0.02, 0.3
    pins = Point("low", "carrier", tuple(low)), Point("high", "chassis", tuple(high))
    car = {"static_toe": toe, "static_camber": camber, "kingpin": ("low", "high"), "side": side}
    fixed = "caster kingpin_inclination"
    types = f"{fixed} toe camber scrub_radius mechanical_trail steer_angle"
    found = hinged(tuple(center), tuple(low), tuple(high - low), ANGLES, types, points=pins, **car)
    assert_positions(found, dict.fromkeys(fixed.split(), np.arctan(0.05 / 0.4)))
    k = (high - low) / np.linalg.norm(high - low)
    spin = np.array(
        [np.sin(toe) * np.cos(camber), out * np.cos(toe) * np.cos(camber), -np.sin(camber)]
    )
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    for n, angle in enumerate(ANGLES):
        turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross  # Rodrigues
        s, c = turn @ spin, low + turn @ (center - low)
        ahead = np.cross([0, 0, 1], -out * s)  # left wheel: s to the left, ahead = s x z
        ahead /= np.linalg.norm(ahead)
        steer = np.arcsin(ahead[1])  # to the left
        aside = np.array([-ahead[1], ahead[0], 0.0]) * out
        down = s[2] * s - np.array([0.0, 0.0, 1.0])
        contact = c + radius * down / np.linalg.norm(down)
        meets = low + (contact[2] - low[2]) / (high[2] - low[2]) * (high - low)
        true = {
            "steer_angle": steer,
            "toe": -out * steer,
            "camber": -np.arcsin(s[2]),
            "mechanical_trail": (meets - contact) @ ahead,
            "scrub_radius": (contact - meets) @ aside,
        }
        assert {name: found[name].position[n] for name in true} == pytest.approx(
            true, abs=ROUND_OFF
        )


def test_strut_outputs_match_reference():
    """Every output, rate, second rate and slope of the built-in case; its tolerances are far wider
    than what is seen.
    """
    case = loaded(STRUT)
    found = solved(case)
    assert [*case.reference] == [output.name for output in case.outputs]
    for output in case.outputs:
        errors = deviations(
            case, output, found[output.name], [("reference", case.reference[output.name])]
        )
        assert len(errors.items()) == output.orders
        for order, (quantity, error) in enumerate(errors.items(), start=3 - output.orders):
            # the pose is good to 1e-16 m, directions to that over 0.25 m; every further derivative,
            # of which a slope is one, is some ten times as large
            assert error.max_abs < (2e-15, 1e-14, 5e-14)[order], (output.name, quantity)
            assert error.within


def test_strut_reference_matches_sixty_digits():
    lines = [
        line
        for line in cases.file("mcpherson_suspension").with_suffix(".csv").read_text().splitlines()
        if not line.startswith("#")
    ]
    table = [row for row in csv.DictReader(lines) if float(row["stroke"]) in (-0.08, 0.045)]
    assert len(table) == 2
    rows = strut_oracle.rows([mpf(row["stroke"]) for row in table])
    for written, made in zip(table, rows, strict=True):
        assert written.keys() == made.keys()
        for name, value in made.items():
            # 17 digits are printed
            assert abs(mpf(written[name]) - value) <= mpf("1e-16") * abs(value) + mpf("1e-40"), name


# Spin axis of Project Chrono's generic MacPherson strut (BSD-3-Clause) over the stroke: a solution
# of its rods and its strut's line to 40 digits that shares nothing with this project. A left wheel,
# x forward, y left, z up.
CHRONO = {
    -0.07: (0.036703185761281249241, 0.99905916117216708365, -0.023101269076367991694),
    -0.02: (0.011149989625884017296, 0.99992233617913548656, -0.0055677052187265087943),
    0.01: (-0.0058210759742222245227, 0.99998009489428534666, 0.0024341096356585819382),
}


def test_chrono_strut_toes_out_in_jounce():
    data = tomllib.loads((cases.FOLDER / "chrono_macpherson.toml").read_text())
    data |= {
        "suspension": AXES | {"side": "left"},
        "outputs": {"toe": {"type": "toe"}, "camber": {"type": "camber"}},
    }
    case = loaded(unreferenced(data))
    case = replace(case, sweep=replace(case.sweep, values=np.array([*CHRONO])))
    found = solved(case)
    x, y, z = np.array([*CHRONO.values()]).T
    assert_positions(found, {"toe": np.arctan(x / y), "camber": -np.arcsin(z)})


ONE_SIGN = {"steer_angle", "wheel_center_y"}
"""Outputs that tell left from right, or one convention from the other."""


def test_mirror_image_gives_other_wheel():
    right, left = solved(loaded(STRUT)), solved(loaded(mirrored(STRUT)))
    assert right.keys() == left.keys()
    for name, series in right.items():
        sign = -1.0 if name.split(".")[0] in ONE_SIGN else 1.0
        assert left[name].position == pytest.approx(sign * series.position, abs=ROUND_OFF)
        if series.velocity is not None:
            assert left[name].velocity == pytest.approx(sign * series.velocity, abs=ROUND_OFF)
    assert np.ptp(right["toe"].position) > 0.05  # and it is no strut at rest


def test_sae_convention_turns_lateral_outputs():
    iso, sae = (
        loaded(unreferenced(STRUT | {"suspension": STRUT["suspension"] | {"convention": each}}))
        for each in Convention
    )
    assert "y left, z up" in iso.signs
    assert "y right, z down" in sae.signs
    found, turned = solved(iso), solved(sae)
    for name, series in found.items():
        assert turned[name].position == pytest.approx(
            (-1.0 if name.split(".")[0] in ONE_SIGN else 1.0) * series.position, abs=1e-15
        )
    senses = [{output.name: output.sense for output in case.outputs} for case in (iso, sae)]
    assert {name for name, sense in senses[0].items() if senses[1][name] != sense} == {
        name for name in found if name.split(".")[0] in ONE_SIGN
    }


def test_suspension_outputs_in_other_axes():
    """The same car drawn with x to the left, y rearward and z up, or with z down."""
    for turn in (np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.diag([1, -1, -1])):
        turned = mirrored(STRUT, turn)
        turned["suspension"] |= {"side": "right"}
        true = {name: series.position for name, series in solved(loaded(STRUT)).items()}
        assert_positions(solved(loaded(turned)), true)


def test_slopes_need_velocities():
    case = loaded(STRUT)
    engine = Native()
    full = engine.solve(engine.build(case), case, TOL)
    bare = replace(
        full,
        points={
            name: replace(each, velocity=None, acceleration=None)
            for name, each in full.points.items()
        },
    )
    found = {output.name: output_series(case, output, bare) for output in case.outputs}
    assert np.isfinite(found["toe"].position).all()
    assert found["toe"].velocity is None
    for name in ("toe.per_travel", "roll_center_height", "motion_ratio"):
        assert np.isnan(found[name].position).all()


def test_slopes_at_turning_point_are_nan():
    """A swing axle whose wheel passes the top of its way: travel stops there, and camber does
    not.
    """
    angles = np.linspace(np.pi / 2 - 0.2, np.pi / 2 + 0.2, 5)
    place = (0.0, 0.75, 0.0), (0.0, 0.2, 0.0), (1, 0, 0), angles
    found = hinged(*place, "camber roll_center_height")
    assert np.isfinite(found["camber"].position).all()
    for name in ("camber.per_travel", "roll_center_height"):
        assert np.isnan(found[name].position).tolist() == [False, False, True, False, False]


def test_markers_do_not_widen_tolerances():
    case = loaded(STRUT)
    plain = replace(
        case,
        outputs=(
            Output("x", "wheel_center", (1.0, 0.0, 0.0), True, 1e-9, case.outputs[0].rtol, "test"),
        ),
    )
    one = next(islice((output for output in case.outputs if output.name == "toe.per_travel"), 1))
    series = solved(case)["toe"]
    tolerance = deviations(plain, plain.outputs[0], series, [("x", series)]).velocity.tolerance
    assert deviations(
        case, case.outputs[0], series, [("x", series)]
    ).velocity.tolerance == pytest.approx(tolerance)
    assert one.atol == pytest.approx(1e-9 / 0.61)  # the strut from ball to top


def test_relative_output_counts_from_design():
    """A wheel with static angles, each output once as it is and once relative."""
    data = STRUT | {
        "suspension": STRUT["suspension"] | {"static_toe": 0.02, "static_camber": -0.03}
    }
    types = ("toe", "camber", "caster", "scrub_radius")
    outputs = {
        f"{each}{end}": {"type": each, "relative": bool(end)}
        for each in types
        for end in ("", "_change")
    }
    found = solved(loaded(unreferenced(data | {"outputs": outputs})))
    middle = 16  # the design is the middle of the sweep
    for each, design in zip(types, (0.02, -0.03, 0.05306489, 0.0), strict=True):
        absolute, relative = found[each], found[f"{each}_change"]
        assert relative.position == pytest.approx(
            absolute.position - absolute.position[middle], abs=ROUND_OFF
        )
        assert relative.velocity == pytest.approx(absolute.velocity, abs=ROUND_OFF)
        if design:
            assert absolute.position[middle] == pytest.approx(design, abs=1e-8)  # the digits above


# Round-off of metres, through a division by the wheel's rate of rise over the arm's angle, 0.3 m,
# for each derivative.
LIMITS = {"position": 1e-15, "velocity": 1e-14, "acceleration": 1e-13}


ARMS = {
    "chrono_double_wishbone": chrono_double_wishbone_arm,
    "chrono_macpherson": chrono_macpherson_arm,
    "chrono_sedan_double_wishbone": chrono_sedan_double_wishbone_arm,
    "mcpherson_steered": mcpherson_arm,
    "mcpherson_strut": mcpherson_arm,
}


def turned(motion, height):
    """The arm's motion that lifts the wheel to that height: Newton's iteration for its angle, then
    twice the chain rule.
    """
    angle, still = np.zeros_like(height.x), np.zeros_like(height.x)

    def z(rate):
        return motion(Jet(angle, rate, still))["wheel_center"].z

    for _ in range(8):
        slope = z(still + 1.0).v - z(still).v
        angle = angle - (z(still).x - height.x) / slope
    slope = z(still + 1.0).v - z(still).v
    rate = (height.v - z(still).v) / slope
    return Jet(angle, rate, (height.a - z(rate).a) / slope)


@pytest.mark.parametrize("name", ARMS)
def test_reference_samples_by_arm_closed_form(name):
    case = cases.load(name)
    design = case.mechanism.point("wheel_center").position
    stroke, rack = (
        Jet(*each)
        for each in case.sweep.path.drive(["stroke", "rack"], case.sweep.path.times).swapaxes(0, 1)
    )

    def motion(turn):
        steered = (rack,) if name.startswith("mcpherson") else ()
        return ARMS[name].motion(turn, *steered)

    turn = turned(motion, stroke + design[2])
    assert np.ptp(turn.x) > 0.2
    wheel = motion(turn)["wheel_center"]
    found = {"wheelbase_change": wheel.x - design[0], "half_track_change": wheel.y - design[1]}
    for output, jet in found.items():
        for (order, limit), values in zip(LIMITS.items(), (jet.x, jet.v, jet.a), strict=True):
            truth = getattr(case.reference[output], order)
            off = np.abs(values - truth).max() / max(1.0, np.abs(truth).max())
            assert off <= limit, (output, order)


def test_decompositions_share_reference():
    for one, other in (
        ("chrono_macpherson", "chrono_macpherson_cylindrical"),
        ("chrono_multi_link", "chrono_multi_link_bodies"),
    ):
        (first, second) = (cases.load(name) for name in (one, other))
        assert {type(joint) for joint in first.mechanism.joints} != {
            type(joint) for joint in second.mechanism.joints
        }
        for name, series in first.reference.items():
            assert (series.position == second.reference[name].position).all()


# The multi-link by five distances


def rods(case):
    """Both ends of each, the inner first; the arm is two rods from its hinge to its ball."""
    hinge, ball = case.mechanism.joint("upper_pivot"), case.mechanism.joint("upper_ball")
    found = [
        (joint.points[0], joint.points[1])
        for joint in case.mechanism.joints
        if isinstance(joint, Distance)
    ]
    found += [
        (hinge.point, ball.point),
        (np.subtract(hinge.point, hinge.axis).tolist(), ball.point),
    ]
    return [(mp.matrix([*inner]), mp.matrix([*outer])) for inner, outer in found]


def upright(case, stroke, near):
    """Shift and half of the rotation's vector (Cayley's) of the upright with the wheel centre
    lifted by the stroke.
    """
    centre, links = mp.matrix([*case.mechanism.point("wheel_center").position]), rods(case)

    def closure(*x):
        a, b, c = x[3:]
        skew = mp.matrix([[0, -c, b], [c, 0, -a], [-b, a, 0]])
        turn = mp.inverse(mp.eye(3) - skew) * (mp.eye(3) + skew)
        arms = [
            (centre + mp.matrix(x[:3]) + turn * (outer - centre) - inner, outer - inner)
            for inner, outer in links
        ]
        return [*((now.T * now)[0] - (before.T * before)[0] for now, before in arms), x[2] - stroke]

    return list(mp.findroot(closure, near))


@pytest.mark.parametrize("sample", [3, 24])
def test_multi_link_reference_by_five_distances(sample):
    case = cases.load("chrono_multi_link")
    with mp.workdps(40):
        stroke, near = mp.mpf(case.sweep.values[sample]), [0] * 6
        for part in range(1, 5):
            near = upright(case, stroke * part / 4, near)
        for k, name in enumerate(("wheelbase_change", "half_track_change")):
            for order, limit in LIMITS.items():

                def coordinate(t, k=k):
                    return upright(case, t, near)[k]

                expected = float(mp.diff(coordinate, stroke, list(LIMITS).index(order)))
                assert getattr(case.reference[name], order)[sample] == pytest.approx(
                    expected, abs=limit
                ), (name, order)
