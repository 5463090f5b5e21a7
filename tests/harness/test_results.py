"""Files of results, and comparisons of records."""

import json
import struct
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from kincheck import CaseError, Mechanism, PointCoordinate
from kincheck.core.case.case import NO_SIZE, Output, Series, size
from kincheck.core.cli import main
from kincheck.core.harness.compare import (
    Curve,
    as_numbers,
    describe,
    deviation,
    deviations,
    output_series,
    pace,
)
from kincheck.core.harness.record import from_json, to_json
from kincheck.core.harness.run import run
from kincheck.core.report.junit import to_junit
from kincheck.core.report.table import print_table

from ..support.fakes import (
    RADIUS,
    SAMPLES,
    Fake,
    crank,
    exact,
    off,
    partial,
    raising,
    run_case,
    solution,
)
from ..support.printed import junit_tests

TOL = 1e-12


def test_json_has_schema_and_digits():
    p = exact(crank())[0]
    results = run_case(
        crank(),
        Fake(),
        Fake("partial", answer=partial),
        Fake("missing", installed=None),
        command="kincheck run",
    )
    text = to_json(results)
    read = json.loads(text)
    assert list(read) == ["schema", "run", "records", "references", "scenes", "suspects"]
    assert read["schema"] == "kincheck-results/1"
    assert read["run"]["engines"] == {"fake": "1.2", "partial": "1.2", "missing": None}
    first = read["records"][0]
    bits = [struct.pack("d", value) for value in first["outputs"]["y"]["position"]]
    assert bits == [struct.pack("d", value) for value in p[:, 1]]
    assert (
        read["references"]["crank"]["x"]["acceleration"]
        == crank().reference["x"].acceleration.tolist()
    )
    assert read["run"]["cases"]["crank"]["driver"]["type"] == "joint_angle"
    assert from_json(text) == results


def test_json_keeps_lists_on_lines():
    message = 'list [1,2,\t3] of "quoted, [4,5]" numbers'
    results = run_case(crank(), Fake(answer=raising(ValueError(message))))
    text = to_json(results)
    assert from_json(text).records[0].message == f"ValueError: {message}"
    assert b'"angle": [' not in text
    lines = to_json(run_case(crank(), Fake())).decode().splitlines()
    assert any(line.strip().startswith('"angle": [-1.0, ') and line.endswith("]") for line in lines)


def test_foreign_results_are_refused():
    with pytest.raises(msgspec.ValidationError, match=r"kincheck-results/2"):
        from_json(b'{"schema": "kincheck-results/2", "run": {}, "records": []}')


def test_undecodable_message_in_json_and_junit():
    results = run_case(
        crank(), Fake(answer=raising(ValueError("bad \udcff and \x00"))), command="kincheck \udcff"
    )
    assert from_json(to_json(results)) == results
    ET.fromstring(to_junit(results))


def test_junit_has_testcase_per_output():
    engines = [
        Fake("right"),
        Fake("wrong", answer=off("position", lambda p: p * [1.0, -1.0, 1.0])),
        Fake("partial", answer=partial),
        Fake("broken", answer=raising(ValueError("no"))),
        Fake("missing", installed=None),
        Fake("unable", refusal="no such joint"),
    ]
    text = to_junit(run([crank("a"), crank("b")], engines, tol=TOL))
    found = junit_tests(text)
    assert len(found) == 2 * 6 * 2
    assert b'<testsuite name="a" tests="12" failures="3" errors="2" skipped="4">' in text
    assert found["a.right.projection x"] == []
    assert found["a.wrong.projection x"] == []  # only y is wrong
    ((kind, message),) = found["a.wrong.projection y"]
    assert (kind, "y: position is off by" in message) == ("failure", True)
    assert found["a.partial.projection x"] == [
        (
            "failure",
            (
                "7 of 9 samples solved: cannot be followed beyond 0.5; closed form has values at 2"
                " of the others"
            ),
        )
    ]
    assert found["b.broken.projection y"] == [("error", "error: ValueError: no")]
    assert found["b.missing.projection y"] == [
        (
            "skipped",
            (
                "unavailable: missing is not installed, or cannot be imported: kincheck doctor says"
                " which"
            ),
        )
    ]
    assert found["b.unable.projection y"] == [("skipped", "unsupported: no such joint")]


def test_table_keeps_long_message_whole(capsys):
    message = "row " * 200
    print_table(run_case(crank(), Fake(answer=raising(ValueError(message)))), sys.stdout)
    assert message.strip() in capsys.readouterr().out


def test_table_sums_up_missing_engines(capsys):
    engines = [Fake("one"), Fake("two", installed=None), Fake("three", installed=None)]
    found = run([crank(), crank("other")], engines, tol=TOL)
    print_table(found, sys.stdout)
    said = capsys.readouterr().out
    assert "unavailable: two, three: not installed, or cannot be imported" in said
    assert [said.count(name) for name in ("two", "three")] == [3, 3]


def test_table_names_modes_if_several(capsys):
    print_table(run_case(crank(), Fake("one"), Fake("two")), sys.stdout)
    assert "projection" not in capsys.readouterr().out
    print_table(run_case(crank(), Fake("one"), Fake("two", mode="simulate")), sys.stdout)
    assert "two · simulate" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('{"run": {"a": ' + "[" * 100_000, "recursion"),
        ("{}", "expected results"),
        ('{"schema": "other"}', "expected results"),
    ],
    ids=["nested", "empty", "another schema"],
)
def test_report_refuses_file_without_results(tmp_path, capsys, text, said):
    file = tmp_path / "results.json"
    file.write_text(text)
    assert main.main(["report", str(file)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"kincheck: {file}: found ")
    assert said in line
    assert line.endswith("write the file again with kincheck run --json")


# Comparing: projections, tolerances, and deviations that must not be missed


REFERENCE = np.array([0.0, 1.0, 3.0, 2.0])


def reference_off(error, atol, rtol=0.0):
    """The deviation of the reference with these errors."""
    return deviation(Curve(REFERENCE + error, atol, rtol), Curve(REFERENCE), "closed_form")


def test_output_is_projection_minus_design():
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


def test_missing_derivative_is_null_with_reason():
    case = crank()
    series = output_series(case, case.outputs[0], solution(case, velocity=None, acceleration=None))
    numbers = as_numbers(series, case.outputs[0])
    assert numbers.velocity is None
    assert numbers.reason == "there is no velocity; there is no acceleration"
    found = deviations(case, case.outputs[0], series, [("closed_form", case.reference["x"])])
    assert found.position is not None
    assert (found.velocity, found.acceleration) == (None, None)
    assert found.reason == "velocity: the engine gives none; acceleration: the engine gives none"


def test_deviation_has_worst_sample():
    found = reference_off([0.0, 3e-3, -4e-3, 0.0], 1e-3, 1e-3)
    assert found is not None
    assert found.max_abs == pytest.approx(4e-3, rel=1e-12)
    assert found.rms == pytest.approx(2.5e-3, rel=1e-12)  # sqrt((9 + 16) / 4) e-3
    assert found.worst_step == 2
    assert found.tolerance == pytest.approx(1e-3 + 1e-3 * 3.0)  # the range is 3
    assert found.against == "closed_form"


@pytest.mark.parametrize(("error", "within"), [(0.9e-3, True), (1.1e-3, False), (-1.1e-3, False)])
def test_deviation_within_tolerance(error, within):
    assert reference_off([0, 0, 0, error], 1e-3).within is within


def test_deviation_compares_common_samples():
    nan = np.nan
    one, other = (Curve(np.array(each)) for each in ([nan, 1.0], [0.0, nan]))
    known = Curve(np.array([0.0, 1.0, 3.0, nan]))
    found = deviation(Curve(np.array([nan, 1.5, 3.0, 9.0]), rtol=0.1), known)
    assert (found.max_abs, found.worst_step) == (0.5, 1)
    assert found.tolerance == pytest.approx(0.2)  # the range over the compared samples is 2, not 3
    assert found.rms == pytest.approx(0.5 / np.sqrt(2))
    assert deviation(one, other) is None
    # without any error the worst sample is still one that was compared
    assert deviation(one, one).worst_step == 1


def test_reference_of_wrong_length_is_refused():
    with pytest.raises(CaseError, match=r"closed form has shape \(1,\), expected \(4,\)"):
        deviation(Curve(REFERENCE), Curve(np.zeros(1)), "closed_form")


def test_derivative_tolerance_scales_with_rate():
    assert pace(crank(rate=2.0)) == 2.0
    assert pace(crank(rate=-2.0)) == 2.0
    case = crank(rate=3.0)
    found = deviations(
        case, case.outputs[0], case.reference["x"], [("closed_form", case.reference["x"])]
    )
    assert [each.tolerance for _, each in found.items()] == pytest.approx([1e-9, 3e-9, 9e-9])


def test_coincident_points_have_no_size():
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
    found = reference_off([0.0, 0.0, 4e-3, 0.0], 1e-3)
    said = describe("half_track_change", "velocity", found, "stroke", [-0.1, 0.0, 0.1, 0.2])
    assert (
        said
        == "half_track_change: velocity is off by 0.004 m/s at sample 2 (stroke = 0.1), tolerance"
        " 0.001 m/s, against closed form"
    )
