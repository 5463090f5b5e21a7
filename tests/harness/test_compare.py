"""Comparing: projections, tolerances, and deviations that must not be missed."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core.case.case import NO_SIZE, Output, Series, size
from kincheck.core.errors import CaseError
from kincheck.core.harness.compare import (
    as_numbers,
    describe,
    deviation,
    deviations,
    output_series,
    pace,
)
from kincheck.core.mechanism.mechanism import Mechanism
from kincheck.core.mechanism.motions import PointCoordinate

from ..support.fakes import RADIUS, SAMPLES, crank, exact, solution

REFERENCE = np.array([0.0, 1.0, 3.0, 2.0])


def test_an_output_is_the_projection_less_the_design_value():
    case = crank()
    position, velocity, acceleration = exact(case)
    d = np.array([0.6, 0.8, 0.0])
    oblique = Output("oblique", "tip", (0.6, 0.8, 0.0), True, 1e-9, 0.0, "")
    series = output_series(case, oblique, solution(case))
    # three products and two sums of numbers below one: a few roundings of 1e-16
    np.testing.assert_allclose(series.position, position @ d - 0.6 * RADIUS, atol=1e-15)
    np.testing.assert_allclose(series.velocity, velocity @ d, atol=1e-15)
    np.testing.assert_allclose(series.acceleration, acceleration @ d, atol=1e-15)
    absolute = output_series(case, replace(oblique, relative=False), solution(case))
    np.testing.assert_allclose(absolute.position, position @ d, atol=1e-15)


def test_unsolved_samples_are_nan():
    case = crank()
    solved = np.arange(SAMPLES) != 4
    series = output_series(case, case.outputs[0], solution(case, solved=solved))
    assert (
        np.isnan(series.position).tolist()
        == np.isnan(series.acceleration).tolist()
        == (~solved).tolist()
    )
    numbers = as_numbers(series, case.outputs[0])
    assert numbers.position[4] is None
    assert numbers.position[3] == series.position[3]
    assert numbers.reason == "samples without a value are null"


def test_missing_derivatives_are_null_with_a_reason():
    case = crank()
    series = output_series(case, case.outputs[0], solution(case, velocity=None, acceleration=None))
    numbers = as_numbers(series, case.outputs[0])
    assert numbers.velocity is None
    assert numbers.reason == "there is no velocity; there is no acceleration"
    found = deviations(case, case.outputs[0], series, [("closed_form", case.reference["x"])])
    assert found.position is not None
    assert (found.velocity, found.acceleration) == (None, None)
    assert found.reason == "velocity: the engine gives none; acceleration: the engine gives none"


def test_deviation_measures_and_names_the_worst_sample():
    found = deviation(REFERENCE + [0.0, 3e-3, -4e-3, 0.0], REFERENCE, 1e-3, 1e-3, "closed_form")
    assert found is not None
    assert found.max_abs == pytest.approx(4e-3, rel=1e-12)
    assert found.rms == pytest.approx(2.5e-3, rel=1e-12)  # sqrt((9 + 16) / 4) e-3
    assert found.worst_step == 2
    assert found.tolerance == pytest.approx(1e-3 + 1e-3 * 3.0)  # the range is 3
    assert found.against == "closed_form"


@pytest.mark.parametrize(("error", "within"), [(0.9e-3, True), (1.1e-3, False), (-1.1e-3, False)])
def test_the_verdict_turns_at_the_tolerance(error, within):
    assert deviation(REFERENCE + [0, 0, 0, error], REFERENCE, 1e-3, 0.0, "x").within is within


def test_only_samples_both_have_are_compared():
    nan = np.nan
    found = deviation(np.array([nan, 1.5, 3.0, 9.0]), np.array([0.0, 1.0, 3.0, nan]), 0.0, 0.1, "x")
    assert (found.max_abs, found.worst_step) == (0.5, 1)
    assert found.tolerance == pytest.approx(0.2)  # the range over the compared samples is 2, not 3
    assert found.rms == pytest.approx(0.5 / np.sqrt(2))
    assert deviation(np.array([nan, 1.0]), np.array([0.0, nan]), 1.0, 0.0, "x") is None
    # without any error the worst sample is still one that was compared
    assert deviation(np.array([nan, 1.0]), np.array([nan, 1.0]), 0.0, 0.0, "x").worst_step == 1


def test_a_reference_of_another_length_is_refused_not_broadcast():
    with pytest.raises(CaseError, match=r"closed form has shape \(1,\), expected \(4,\)"):
        deviation(REFERENCE, np.zeros(1), 1e-9, 0.0, "closed_form")


def test_derivatives_scale_with_the_rate_per_radian():
    assert pace(crank(rate=2.0)) == 2.0
    assert pace(crank(rate=-2.0)) == 2.0
    case = crank(rate=3.0)
    found = deviations(
        case, case.outputs[0], case.reference["x"], [("closed_form", case.reference["x"])]
    )
    assert [each.tolerance for _, each in found.items()] == pytest.approx([1e-9, 3e-9, 9e-9])


def test_points_that_coincide_to_rounding_have_no_size():
    case = crank()
    m, at = case.mechanism, (0.1, 0.2, 0.3)
    joints = [joint.changed(point=at) for joint in m.joints]
    for tip, expected in (
        (at, NO_SIZE),
        ((0.1, 0.2, 0.1 + 0.2), NO_SIZE),
        ((0.1, 0.2, 0.3 + 1e-9), 1e-9),
    ):
        points = [replace(point, position=tip) for point in m.points]
        assert size(
            replace(case, mechanism=Mechanism(m.name, m.bodies, joints, points, m.drivers))
        ) == pytest.approx(expected, rel=1e-6)


def test_pace_is_rate_over_size():
    case = crank(rate=1.0)
    lift = PointCoordinate("lift", "tip", (0.0, 1.0, 0.0))
    m = case.mechanism
    case = replace(case, mechanism=Mechanism(m.name, m.bodies, m.joints, m.points, [lift]))
    case = replace(case, sweep=replace(case.sweep, driver="lift", values=np.linspace(-0.1, 0.1, 3)))
    assert pace(case) == pytest.approx(1.0 / RADIUS)
    # a slide of 2 m makes a mechanism of 2 m
    assert pace(
        replace(case, sweep=replace(case.sweep, values=np.array([-1.0, 1.0])))
    ) == pytest.approx(0.5)
    # a sweep of nothing, as of one sample, leaves the tolerance as it is
    assert pace(replace(case, sweep=replace(case.sweep, values=np.zeros(1)))) == pytest.approx(
        1.0 / RADIUS
    )


@pytest.mark.parametrize("complete", [True, False])
def test_missing_value_of_solved_sample_fails(complete):
    case, right = crank(), crank().reference["x"]
    holed = Series(
        right.position,
        np.where(np.arange(SAMPLES) == 3, np.nan, right.velocity),
        right.acceleration,
    )
    found = deviations(case, case.outputs[0], holed, [("closed_form", right)], complete=complete)
    assert found.position.within
    assert found.velocity.within is not complete
    if complete:
        assert found.reason == "velocity: 1 sample without a value where closed form has one"
        said = describe("x", "velocity", found.velocity, "angle", [0.0] * SAMPLES)
        assert said == "x: velocity has no value at samples where closed form has one"
    # what the standard does not have either is no loss
    assert deviations(
        case, case.outputs[0], holed, [("closed_form", holed)], complete=True
    ).velocity.within


def test_deviation_text_names_sample_and_tolerance():
    found = deviation(REFERENCE + [0.0, 0.0, 4e-3, 0.0], REFERENCE, 1e-3, 0.0, "closed_form")
    said = describe("half_track_change", "velocity", found, "stroke", [-0.1, 0.0, 0.1, 0.2])
    assert (
        said
        == "half_track_change: velocity is off by 0.004 m/s at sample 2 (stroke = 0.1), tolerance"
        " 0.001 m/s, against closed form"
    )
