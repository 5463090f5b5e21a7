"""Runs: pairs of cases and engines, their records and references."""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck import CaseError, Outcome, SolveError
from kincheck.core.case.case import Series, Truth
from kincheck.core.harness.run import NULL_REASONS, run
from kincheck.core.report.curves import wide

from ..support.fakes import (
    SAMPLES,
    Fake,
    at,
    crank,
    exact,
    off,
    partial,
    raising,
    record_of,
    run_case,
    solution,
)

TOL = 1e-12


def fail_after(count, error):
    """Right at first, then raising."""
    left = iter(range(count))

    def answer(case):
        if next(left, None) is None:
            raise error
        return solution(case)

    return answer


def test_right_answer_passes_with_record():
    record = record_of(Fake(settings={"scheme": np.float64(0.5)}))
    assert (record.outcome, record.message) == (Outcome.PASS, "")
    assert record.validated
    names = record.case, record.engine, record.mode, record.loop, record.version
    assert names == ("crank", "fake", "projection", "python", "1.2")
    assert record.driver == {"angle": np.linspace(-1.0, 1.0, SAMPLES).tolist()}
    assert record.outputs["y"].position == exact(crank())[0][:, 1].tolist()
    assert (record.rank, record.dof, record.iterations, record.residual_max) == (
        6,
        1,
        3 * SAMPLES,
        1e-15,
    )
    assert (record.solved, record.samples) == (SAMPLES, SAMPLES)
    assert record.details == {"condition": 0.1, "pivots": [0, 1, 2]}
    assert record.settings == {"scheme": 0.5}
    deviation = record.errors["x"].velocity
    assert (deviation.max_abs, deviation.against, deviation.within) == (0.0, "closed_form", True)


def test_duplicate_names_are_refused():
    with pytest.raises(CaseError, match="two cases named 'crank'"):
        run([crank(), crank()], [Fake()], tol=TOL)
    with pytest.raises(CaseError, match=r"two engines named 'fake \(projection\)'"):
        run_case(crank(), Fake(), Fake())


def test_wrong_sign_fails():
    record = record_of(Fake(answer=off("position", lambda p: p * [1.0, -1.0, 1.0])))
    assert record.outcome is Outcome.FAIL
    # y = 0.5 sin, at -1 rad and wrong by its double
    assert (
        record.message
        == f"y: position is off by {math.sin(1.0):.3g} m at sample 0 (angle = -1), tolerance 1e-09"
        " m, against closed form"
    )
    assert record.errors["x"].position.within


@pytest.mark.parametrize(
    ("quantity", "unit", "tolerance"),
    [("velocity", "m/s", "2e-09"), ("acceleration", "m/s²", "4e-09")],
)
def test_relative_error_of_millionth_fails(quantity, unit, tolerance):
    record = record_of(Fake(answer=off(quantity, lambda values: values * (1.0 + 1e-6))))
    assert record.outcome is Outcome.FAIL
    assert f"{quantity} is off by" in record.message
    assert (
        f"tolerance {tolerance} {unit}, against closed form (worst of 2 quantities out of"
        " tolerance)" in record.message
    )


def test_single_deviating_sample_is_located():
    record = record_of(Fake(answer=off("position", lambda p: p + at(6, 1, 1e-6)(0 * p))))
    assert "y: position is off by 1e-06 m at sample 6 (angle = 0.5)" in record.message
    assert record.errors["y"].position.worst_step == 6


def test_messages_have_units_of_file():
    """Its curves stay long: a wide table of them is one of hardpoints."""
    case = replace(crank("case"), length_unit="mm", angle_unit="deg")
    off_by = Fake(answer=off("position", lambda p: p + at(6, 1, 1e-6)(0 * p)))
    results = run([case], [off_by], tol=TOL)
    assert "y: position is off by 0.001 mm at sample 6 (angle = 28.6" in results.records[0].message
    assert results.run["cases"]["case"]["units"] == {"length": "mm", "angle": "deg"}
    assert wide(results) is None


@pytest.mark.parametrize("count", [0, 1], ids=["cold solve", "warm solve"])
def test_exception_costs_one_pair(count):
    broken = Fake("broken", answer=fail_after(count, SolveError("row 7 contradicts row 3")))
    results = run([crank("a"), crank("b")], [broken, Fake()], tol=TOL)
    assert [(each.case, each.engine, each.outcome) for each in results.records] == [
        ("a", "broken", Outcome.ERROR),
        ("a", "fake", Outcome.PASS),
        ("b", "broken", Outcome.ERROR),
        ("b", "fake", Outcome.PASS),
    ]
    assert results.records[0].message == "SolveError: row 7 contradicts row 3"
    assert results.records[0].errors["x"].reason == "error: SolveError: row 7 contradicts row 3"
    assert results.records[0].outputs == {}
    assert results.records[0].us_per_step is None


def test_engine_exceptions_become_records():
    for method in ("version", "unsupported", "build"):
        engine = Fake()
        setattr(engine, method, lambda *_: 1 / 0)
        assert record_of(engine).message == "ZeroDivisionError: division by zero"


def test_interrupt_ends_run():
    with pytest.raises(KeyboardInterrupt):
        record_of(Fake(answer=raising(KeyboardInterrupt())))


def test_missing_and_unable_engines_have_reasons():
    missing = record_of(Fake(installed=None))
    said = "fake is not installed, or cannot be imported: kincheck doctor says which"
    assert (missing.outcome, missing.message, missing.version) == (Outcome.UNAVAILABLE, said, None)
    unable = record_of(Fake(refusal="joint 'cv' (universal) has no counterpart"))
    assert (unable.outcome, unable.message) == (
        Outcome.UNSUPPORTED,
        "joint 'cv' (universal) has no counterpart",
    )
    assert unable.version == "1.2"
    for record in (missing, unable):
        assert not record.outcome.bad
        assert not record.validated
        assert set(record.errors) == {"x", "y"}
        assert record.errors["x"].items() == []


def test_partial_answer_fails_with_comparison():
    record = record_of(Fake(answer=partial))
    assert record.outcome is Outcome.FAIL
    assert (
        record.message
        == "7 of 9 samples solved: cannot be followed beyond 0.5; closed form has values at 2 of"
        " the others"
    )
    assert (record.solved, record.samples) == (7, 9)
    assert record.outputs["x"].position[7:] == [None, None]
    assert record.outputs["x"].position[:7] == record_of(Fake()).outputs["x"].position[:7]
    assert record.outputs["x"].reason is not None
    assert record.errors["x"].position.within
    assert record.us_per_step is None  # a time per sample would count samples that were not made
    assert record.seconds.warm > 0


@pytest.mark.parametrize(
    ("engine", "reasons"),
    [
        (Fake(), {}),
        (Fake(answer=partial), {"us_per_step": NULL_REASONS["us_per_step"]}),
        (
            Fake(answer=lambda case: solution(case, solved=np.zeros(SAMPLES, dtype=bool))),
            {key: NULL_REASONS[key] for key in ("residual_max", "iterations", "us_per_step")},
        ),
        (
            Fake(answer=lambda case: replace(solution(case), details={})),
            {key: NULL_REASONS[key] for key in ("rank", "dof")},
        ),
        (Fake(answer=raising(ValueError("no"))), dict.fromkeys(NULL_REASONS, "error: see message")),
        (Fake(installed=None), dict.fromkeys(NULL_REASONS, "unavailable: see message")),
    ],
    ids=["all", "some samples", "no sample", "no details", "error", "unavailable"],
)
def test_null_numbers_have_reasons(engine, reasons):
    record = record_of(engine)
    assert record.reasons == reasons
    assert {key for key in NULL_REASONS if getattr(record, key) is None} == set(reasons)


def test_partial_answer_shows_deviation():
    def answer(case):
        trajectory = partial(case)
        trajectory.points["tip"].position[2, 1] += 1e-3
        return trajectory

    message = record_of(Fake(answer=answer)).message
    assert "7 of 9 samples solved" in message
    assert "y: position is off by 0.001 m at sample 2" in message


def test_unsolved_answer_fails_without_numbers():
    nan = np.full((SAMPLES, 3), np.nan)

    def answer(case):
        solved = np.zeros(SAMPLES, dtype=bool)
        return solution(case, solved=solved, position=nan, velocity=None, acceleration=None)

    record = record_of(Fake(answer=answer))
    assert (
        record.message
        == "0 of 9 samples solved: the engine gives no reason; its adapter must report one; closed"
        " form has values at 9 of the others"
    )
    assert (record.residual_max, record.iterations, record.errors["x"].position) == (
        None,
        None,
        None,
    )


# References of a run: the case's own, the native engine, or none


def test_case_without_reference_uses_native():
    case = crank(truth=Truth.CLOSED_FORM, reference=False)
    wrong = Fake("wrong", answer=off("acceleration", lambda a: a * (1 + 1e-6)))
    results = run_case(case, Fake(), wrong, Fake("native"))
    native, fake, bad = results.records  # the native engine comes first: the others need it
    assert [native.engine, fake.engine, bad.engine] == ["native", "fake", "wrong"]
    assert (native.outcome, native.message) == (Outcome.UNJUDGED, "the case has no reference")
    assert native.errors["x"].items() == []
    assert (fake.outcome, fake.errors["x"].velocity.against) == (Outcome.PASS, "native")
    assert bad.outcome is Outcome.FAIL
    assert "against native" in bad.message
    # whatever the case claims
    assert {record.truth for record in results.records} == {"consensus_only"}
    assert not any(record.validated for record in results.records)


def test_case_without_any_standard_is_unjudged():
    case = crank(reference=False)
    alone = record_of(Fake(), case)
    assert (alone.outcome, alone.message) == (
        Outcome.UNJUDGED,
        "the case has no reference, and the native engine is not in this run",
    )


def test_baseline_is_not_recorded():
    native = Fake("native")
    wrong = Fake(answer=off("position", lambda p: 1.001 * p))
    record = record_of(wrong, crank(reference=False), baseline=native)
    assert (record.engine, record.outcome) == ("fake", Outcome.FAIL)
    assert "against native" in record.message
    native.solves = 0
    run_case(crank(), wrong, baseline=native)
    assert native.solves == 0  # the reference has it all
    for lacking in ("velocity", "acceleration"):
        case = crank()
        case.reference["y"] = replace(case.reference["y"], **{lacking: None})
        record = record_of(
            Fake(answer=off(lacking, lambda values: 1.001 * values)), case, baseline=native
        )
        assert getattr(record.errors["y"], lacking).against == "native"
        assert not getattr(record.errors["y"], lacking).within


def test_native_completes_reference():
    case = crank()
    case.reference.pop("y")
    case.reference["x"] = Series(case.reference["x"].position)
    native, fake = run_case(case, Fake("native"), Fake()).records
    assert [each.against for _, each in fake.errors["x"].items()] == [
        "closed_form",
        "native",
        "native",
    ]
    assert [each.against for _, each in fake.errors["y"].items()] == ["native"] * 3
    missing = "velocity: closed form gives none; acceleration: closed form gives none"
    assert (native.outcome, native.message) == (
        Outcome.PASS,
        f"not judged: x: {missing}; y: the reference does not have it",
    )
    # one output met a truth, the other only another engine
    assert not fake.validated
    assert native.truth == "closed_form"


@pytest.mark.parametrize("truth", list(Truth))
def test_only_truths_from_elsewhere_validate(truth):
    assert record_of(Fake(), crank(truth=truth)).validated is truth.validates
