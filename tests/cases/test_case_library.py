"""The case library: every case against its truth, the truths against published values, and truths
that must not pass.
"""

import csv
from dataclasses import replace
from decimal import Decimal
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from kincheck import Body, CaseError, Distance, JointAngle, Mechanism, Point, Revolute, cases, solve
from kincheck.adapters.native import Native
from kincheck.cases import (
    Jet,
    bennett,
    bricard,
    hooke_joint,
    modelica_four_bar,
    planar_slider_crank,
    rssr,
    spatial_slider_crank,
)
from kincheck.cases.jet import steady
from kincheck.cases.vectors import Circle
from kincheck.core.case.case import Output, Truth, without_forces
from kincheck.core.harness.compare import deviations, output_series

from ..support.examples import examples
from ..support.fakes import swept
from ..support.mechanisms import ORIGIN, X, Z

(REDUNDANT,) = examples(__file__, "redundant")

CASES = {name: cases.load(name) for name in cases.names()}


def coordinates(case):
    """The outputs that are coordinates of points."""
    return [output for output in case.outputs if isinstance(output, Output)]


CLOSED_FORMS = [name for name, case in CASES.items() if case.truth is Truth.CLOSED_FORM]
# What is asked of the native engine [m]; each derivative passes the equations, of pivots above
# 0.03, once more.
ROUND_OFF = 1e-14
LIMITS = {"position": ROUND_OFF, "velocity": 10 * ROUND_OFF, "acceleration": 100 * ROUND_OFF}


IN_HOUSE = {
    *("mcpherson_strut", "mcpherson_strut_loaded", "mcpherson_steered", "mcpherson_suspension"),
    *("chrono_macpherson", "chrono_macpherson_cylindrical", "chrono_double_wishbone"),
    *("chrono_sedan_double_wishbone", "chrono_multi_link", "chrono_multi_link_bodies"),
}


def test_case_names_and_truths():
    """Nobody publishes curves of suspensions: what the project computed for them must never read as
    validated.
    """
    for name, case in CASES.items():
        assert case.name == name
        in_house = name in IN_HOUSE
        assert case.truth is (Truth.IN_HOUSE_ORACLE if in_house else Truth.CLOSED_FORM)


def test_unknown_case_name_gets_suggestion():
    with pytest.raises(CaseError, match="did you mean 'four_bar'"):
        cases.load("fourbar")
    with pytest.raises(CaseError, match="not a built-in case"):
        cases.load("../cases/four_bar")


@pytest.mark.parametrize("name", CASES)
def test_case_outputs_have_full_reference(name):
    case = CASES[name]
    assert list(case.reference) == [output.name for output in case.outputs]
    for output in case.outputs:
        series = case.reference[output.name]
        for values in (series.position, series.velocity, series.acceleration)[: output.orders]:
            assert values.shape == case.sweep.values.shape
            assert np.isfinite(values).all()


@cache
def solved(name):
    """A case and its motion by the native engine."""
    case, engine = CASES[name], Native()
    return case, engine.solve(engine.build(case), case, 1e-12)


def off(case, name, found, reference):
    """The worst part of its tolerance that an output is off by."""
    (output,) = (each for each in case.outputs if each.name == name)
    series = output_series(case, output, found)
    against = deviations(case, output, series, [("truth", reference)])
    return max(each.max_abs / each.tolerance for _, each in against.items() if each)


@pytest.mark.by_day(3)
@pytest.mark.parametrize("name", CASES)
def test_native_engine_equals_case_truth(name):
    case, found = solved(name)
    assert found.solved.all(), found.message
    for output in coordinates(case):
        series = output_series(case, output, found)
        for order, limit in LIMITS.items():
            truth, values = getattr(case.reference[output.name], order), getattr(series, order)
            assert np.abs(values - truth).max() <= limit * max(1.0, np.abs(truth).max()), (
                output.name,
                order,
            )


@pytest.mark.parametrize("name", CASES)
def test_shifted_truth_fails(name):
    case, found = solved(name)
    for output in coordinates(case):
        series = case.reference[output.name]
        shifted = series.position.copy()
        shifted[len(shifted) // 3] += 2.0 * output.atol
        assert off(case, output.name, found, replace(series, position=shifted)) == pytest.approx(
            2.0, rel=1e-3
        )


def test_truth_of_other_branch_fails():
    """Both assemblies of one linkage meet no tolerance of each other, though each meets its own."""
    for one, other in (("rssr", "rssr_other_branch"), ("rssr_other_branch", "rssr")):
        (case, found), (there, _) = solved(one), solved(other)
        for output in without_forces(case).outputs:
            expected = 1.0 if output.point == "crank_pin" else 1e6
            assert (off(case, output.name, found, there.reference[output.name]) > expected) is (
                output.point != "crank_pin"
            )


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_closed_form_rates_equal_complex_step(name):
    """By the complex step, exact to round-off: an imaginary time of 1e-30 s leaves the derivative
    in the imaginary part.
    """
    case, motion = CASES[name], cases.closed_form(name)
    path, drivers = case.sweep.path, [driver.name for driver in case.mechanism.drivers]
    step = 1e-30
    at = path.drive(drivers, path.times[1:-1:7] + 1j * step)
    for output in coordinates(case):
        for jet in motion(*map(Jet, *at))[output.point]:
            assert jet.x.imag / step == pytest.approx(jet.v.real, rel=1e-12, abs=1e-12)
            assert jet.v.imag / step == pytest.approx(jet.a.real, rel=1e-12, abs=1e-11)


@pytest.mark.parametrize(
    ("name", "redundant"),
    REDUNDANT,
)
def test_case_redundant_rows_are_counted(name, redundant):
    _, found = solved(name)
    assert len(found.details["dof_account"]["redundant_rows"]) == redundant
    assert found.details["redundant_residual"] <= ROUND_OFF


# Published values


def angles(*degrees):
    return steady(np.radians(degrees), 1.0)


def test_hooke_joint_published_values():
    """tan t2 = tan t1 / cos b and the ratio of the rates, cos b / (1 - sin^2 b cos^2 t1), for b of
    30 and 60 degrees.
    """
    for bend, t2, ratio in (
        (30, 33.690067525979786914, 1.0658774200423860268),
        (60, 49.106605350869094395, 1.1428571428571428571),
    ):
        c, s = hooke_joint.driven(angles(30), np.cos(np.radians(bend)))
        assert np.degrees(np.arctan2(s.x, c.x)) == pytest.approx([t2], abs=1e-13)
        assert c.x * s.v - s.x * c.v == pytest.approx([ratio], abs=1e-14)


def test_slider_cranks_published_values():
    """Modelica's displacement s and its rate (Modelica Standard Library, Fourbar1), and the planar
    slider; 20 digits by mpmath.
    """
    x, _, _ = modelica_four_bar.motion(angles(0, 105, 330))["slider_pin"]
    assert x.x - 1.2 == pytest.approx(
        [-0.2, -0.35762291227269653612, -0.20340325067914869836], abs=1e-15
    )
    assert x.v == pytest.approx(
        [-0.02, -0.10852170964608418664, 0.032791088217557655035], abs=1e-15
    )
    x, _, _ = planar_slider_crank.motion(angles(75, 90, 345))["slider"]
    assert x.x == pytest.approx(
        [3.0990632772254874503, 2.8284271247461900976, 3.9547404244018751701], abs=1e-15
    )


def test_bricard_loop_closes():
    """Its last link comes back to the grounded one: P5 is a link from the origin; at the start the
    points are the cube's edges.
    """
    points = {
        name: np.stack([jet.x for jet in xyz], axis=1)
        for name, xyz in bricard.motion(angles(0, -60, 25)).items()
    }
    assert np.linalg.norm(points["P5"], axis=1) == pytest.approx(np.ones(3), abs=1e-15)
    start = {"P2": (1, -1, 0), "P3": (1, -1, 1), "P4": (0, -1, 1), "P5": Z}
    assert {name: tuple(np.round(xyz[0], 15)) for name, xyz in points.items()} == start


def test_bennett_loop_closes():
    """The follower's pin stays a link's length from the hinge on the ground, and square to it; at
    the design it is rational.
    """
    hinge, axis = np.array([-0.3, 0.0, 0.0]), np.array([0.0, 0.6, 0.8])
    pins = {
        name: np.stack([jet.x for jet in xyz], axis=1)
        for name, xyz in bennett.motion(angles(0, 77, 180, 301)).items()
    }
    arm = pins["follower_pin"] - hinge
    assert np.linalg.norm(arm, axis=1) == pytest.approx(np.full(4, bennett.B), abs=1e-15)
    assert arm @ axis == pytest.approx(np.zeros(4), abs=1e-15)
    assert np.linalg.norm(pins["follower_pin"] - pins["crank_pin"], axis=1) == pytest.approx(
        np.full(4, bennett.A), abs=1e-15
    )
    assert pins["follower_pin"][0] * 130.0 == pytest.approx([9.0, 16.0, -12.0], abs=1e-13)


def test_rssr_reach_ends_where_assembly_ends():
    """a = 2, b = 4, L = 7, O = (6, 1, 0.5): the crank only rocks; of the angles tried it reaches 75
    and 90 degrees (mpmath).
    """
    O, start = (6.0, 1.0, 0.5), 80.0  # noqa: E741
    crank = Circle(ORIGIN, (2.0, 0.0, 0.0), (0.0, 2.0, 0.0)).turned(angles(start))
    pin, rocker = (
        tuple(float(jet.x[0]) for jet in vec)
        for vec in (crank, Circle(O, (0.0, 4.0, 0.0), (0.0, 0.0, 4.0)).meet(crank, 7.0, 1.0))
    )
    mechanism = Mechanism(
        "rocking",
        [Body("crank"), Body("rocker")],
        [
            Revolute("in", "ground", "crank", ORIGIN, Z),
            Revolute("out", "ground", "rocker", O, X),
            Distance("rod", "crank", "rocker", (pin, rocker)),
        ],
        [Point("pin", "rocker", rocker)],
        [JointAngle("turn", "in")],
    )
    found = solve(mechanism, "turn", np.radians(np.array([60.0, 75.0, 90.0, 105.0]) - start))
    assert found.solved.tolist() == [False, True, True, False]
    assert "cannot be followed beyond" in found.message
    _, y, z = (found.points["pin"].position[1:3] - O).T
    assert np.degrees(np.arctan2(z, y)) == pytest.approx(
        [74.243600242217683299, 35.064891244316906268], abs=1e-12
    )


def test_spatial_slider_crank_iftomm_benchmark():
    """IFToMM benchmark 'Spatial rigid slider-crank mechanism' (Masoudi and McPhee), at the start,
    with the crank at 6 rad/s.
    """
    motion = spatial_slider_crank.motion(steady(np.zeros(1), 6.0))
    position, velocity = (
        {point: [jet.x[0] for jet in xyz] for point, xyz in motion.items()},
        {point: [jet.v[0] for jet in xyz] for point, xyz in motion.items()},
    )
    assert position["slider"] == pytest.approx([0.2, 0.0, 0.0], abs=1e-15)
    assert velocity["slider"] == pytest.approx([0.24, 0.0, 0.0], abs=1e-15)
    assert velocity["conrod_centre"] == pytest.approx([0.12, -0.24, 0.0], abs=1e-15)
    # the conrod's angular velocity, published as (1.92, -0.96, 0.48), shows in the point off its
    # line
    arm = np.subtract(position["conrod_side"], position["conrod_centre"])
    turning = np.cross([1.92, -0.96, 0.48], arm)
    assert np.subtract(velocity["conrod_side"], velocity["conrod_centre"]) == pytest.approx(
        turning, abs=1e-15
    )


def test_spatial_slider_crank_full_turn():
    """Slider x [m] and its derivatives at crank angles [deg], 6 rad/s: the closed form evaluated to
    50 digits with mpmath.
    """
    table = {
        45: (0.2386152935169978746, 0.31293248220898394129, -0.23970545635230388215),
        180: (0.28, -0.17142857142857142857, -1.3392419825072886297),
        315: (0.18522915888766953838, -0.036647713244260374687, 2.4114982994909980202),
    }
    slider, _, _ = spatial_slider_crank.motion(steady(np.radians([*table]), 6.0))["slider"]
    assert np.stack([slider.x, slider.v, slider.a], axis=1) == pytest.approx(
        np.array([*table.values()]), abs=1e-13
    )


def test_rssr_published_table():
    """Rocker angle [deg] at crank angles [deg], a = 1, b = 4, L = 5.5, O = (2, 1, 3).

    Formula of Hartenberg and Denavit (1964, ch. 12) in its arctangent form, evaluated to 50 digits
    with mpmath.
    """
    table = {
        0: 348.94609687978577331,
        90: -357.01449399425346206,
        195: 325.86625177583580752,
        330: 337.09754271028875053,
    }
    _, y, z = rssr.motion(steady(np.radians([*table]), 1.0))["rocker_pin"]
    found = np.degrees(np.arctan2(z.x - 3.0, y.x - 1.0)) % 360
    assert found == pytest.approx(np.array([*table.values()]) % 360, abs=360 * 1e-13)


def slope(x, h):
    """First derivative by seven-point central differences, of sixth order in h."""
    return (-x[:-6] + 9 * x[1:-5] - 45 * x[2:-4] + 45 * x[4:-2] - 9 * x[5:-1] + x[6:]) / (60 * h)


def test_mcpherson_derivatives_equal_differences():
    for series in CASES["mcpherson_strut"].reference.values():
        values = [series.position, series.velocity, series.acceleration]
        for each, derivative in pairwise(values):
            # with 2 mm the differences are off by 3e-11 (seen), so with 1 mm by 2^-6 of that, 5e-13
            assert derivative[3:-3] == pytest.approx(slope(each, 1e-3), abs=1e-12, rel=0)


def rows(name):
    lines = (cases.FOLDER / f"{name}.csv").read_text().splitlines()
    return [*csv.DictReader(line for line in lines if not line.startswith("#"))]


def test_mcpherson_samples_are_decimal_millimetres():
    strokes = [Decimal(row["stroke"]) for row in rows("mcpherson_strut")]
    assert strokes == [Decimal(k) / 1000 for k in range(-80, 81)]


def test_loaded_strut_moves_as_strut():
    for plain, loaded in zip(rows("mcpherson_strut"), rows("mcpherson_strut_loaded"), strict=True):
        assert plain.items() <= loaded.items()


def test_loaded_strut_file_equals_force_truth():
    follow_motion = pytest.importorskip(
        "kincheck.core.extensions.laboratory.truth.motion"
    ).follow_motion
    known_forces = pytest.importorskip(
        "kincheck.core.extensions.laboratory.truth.forces"
    ).known_forces
    case = CASES["mcpherson_strut_loaded"]
    few = swept(case, case.sweep.values[::8])
    known = known_forces(few, follow_motion(few))
    assert len(known) == 7
    for name, each in known.items():
        printed = case.reference[name].position[::8]
        assert each.determined.all()
        assert abs(printed - each.values).max() <= 1e-12 * abs(printed).max()
