"""The case library: every case against its truth, the truths against published values, and truths
that must not pass.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from kincheck import cases
from kincheck.adapters.native import Native
from kincheck.cases import (
    bennett,
    bricard,
    hooke_joint,
    modelica_four_bar,
    planar_slider_crank,
)
from kincheck.cases.jet import Jet, steady
from kincheck.cases.vectors import Circle
from kincheck.core import Body, Distance, JointAngle, Mechanism, Point, Revolute, solve
from kincheck.core.case.case import Output, Truth, without_forces
from kincheck.core.harness.compare import deviations, output_series

from ..support.case_library import CASES

COORDINATES = [
    name
    for name, case in CASES.items()
    if all(isinstance(output, Output) for output in case.outputs)
]


CLOSED_FORMS = [name for name in COORDINATES if CASES[name].truth is Truth.CLOSED_FORM]
# What is asked of the native engine [m]; each derivative passes the equations, of pivots above
# 0.03, once more.
ROUND_OFF = 1e-14
LIMITS = {"position": ROUND_OFF, "velocity": 10 * ROUND_OFF, "acceleration": 100 * ROUND_OFF}


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


@pytest.mark.parametrize("name", COORDINATES)
def test_native_engine_equals_case_truth(name):
    case, found = solved(name)
    assert found.solved.all(), found.message
    for output in case.outputs:
        series = output_series(case, output, found)
        for order, limit in LIMITS.items():
            truth, values = getattr(case.reference[output.name], order), getattr(series, order)
            assert np.abs(values - truth).max() <= limit * max(1.0, np.abs(truth).max()), (
                output.name,
                order,
            )


@pytest.mark.parametrize("name", COORDINATES)
def test_shifted_truth_fails(name):
    case, found = solved(name)
    for output in case.outputs:
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
    for output in case.outputs:
        assert isinstance(output, Output)
        for jet in motion(*map(Jet, *at))[output.point]:
            assert jet.x.imag / step == pytest.approx(jet.v.real, rel=1e-12, abs=1e-12)
            assert jet.v.imag / step == pytest.approx(jet.a.real, rel=1e-12, abs=1e-11)


@pytest.mark.parametrize(
    ("name", "redundant"),
    [
        ("four_bar", 3),
        ("planar_slider_crank", 3),
        ("five_bar", 3),
        ("hooke_joint", 3),
        ("double_cardan", 1),
        ("bricard", 1),
        ("bennett", 3),
        ("andrews_squeezer", 9),
        ("iftomm_n_four_bar", 9),
        ("gough_platform", 0),
    ],
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
    start = {"P2": (1, -1, 0), "P3": (1, -1, 1), "P4": (0, -1, 1), "P5": (0, 0, 1)}
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
    crank = Circle((0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 2.0, 0.0)).turned(angles(start))
    pin, rocker = (
        tuple(float(jet.x[0]) for jet in vec)
        for vec in (crank, Circle(O, (0.0, 4.0, 0.0), (0.0, 0.0, 4.0)).meet(crank, 7.0, 1.0))
    )
    mechanism = Mechanism(
        "rocking",
        [Body("crank"), Body("rocker")],
        [
            Revolute("in", "ground", "crank", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
            Revolute("out", "ground", "rocker", O, (1.0, 0.0, 0.0)),
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
