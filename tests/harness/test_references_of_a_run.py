"""References of a run: the case's own, the native engine, or none."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core.case.case import Series, Truth
from kincheck.core.harness.compare import output_series
from kincheck.core.harness.record import Outcome
from kincheck.core.harness.run import run

from ..support.fakes import SAMPLES, Fake, crank, off, partial, raising
from .test_run import TOL, record_of


def test_without_a_reference_engines_are_compared_with_the_native_one():
    case = crank(truth=Truth.CLOSED_FORM, reference=False)
    wrong = Fake("wrong", answer=off("acceleration", lambda a: a * (1 + 1e-6)))
    results = run([case], [Fake(), wrong, Fake("native")], tol=TOL)
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


def test_without_reference_and_native_engine_the_record_is_not_judged():
    case = crank(reference=False)
    alone = record_of(Fake(), case)
    assert (alone.outcome, alone.message) == (
        Outcome.UNJUDGED,
        "the case has no reference, and the native engine is not in this run",
    )
    _, fake = run(
        [case], [Fake("native", answer=raising(ValueError("no"))), Fake()], tol=TOL
    ).records
    assert fake.outcome is Outcome.UNJUDGED
    assert (
        fake.message
        == "the case has no reference, and the native engine has no answer (error: ValueError: no)"
    )


def test_a_baseline_is_compared_with_and_not_recorded():
    native = Fake("native")
    wrong = Fake(answer=off("position", lambda p: 1.001 * p))
    (record,) = run([crank(reference=False)], [wrong], tol=TOL, baseline=native).records
    assert (record.engine, record.outcome) == ("fake", Outcome.FAIL)
    assert "against native" in record.message
    native.solves = 0
    run([crank()], [wrong], tol=TOL, baseline=native)
    assert native.solves == 0  # the reference has it all
    for lacking in ("velocity", "acceleration"):
        case = crank()
        case.reference["y"] = replace(case.reference["y"], **{lacking: None})
        (record,) = run(
            [case],
            [Fake(answer=off(lacking, lambda values: 1.001 * values))],
            tol=TOL,
            baseline=native,
        ).records
        assert getattr(record.errors["y"], lacking).against == "native"
        assert not getattr(record.errors["y"], lacking).within


def test_what_the_reference_lacks_is_compared_with_the_native_engine():
    case = crank()
    case.reference.pop("y")
    case.reference["x"] = Series(case.reference["x"].position)
    native, fake = run([case], [Fake("native"), Fake()], tol=TOL).records
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


def test_an_output_that_has_no_value_where_the_reference_has_one_is_no_pass(monkeypatch):
    def holed(case, output, trajectory, held):
        series = output_series(case, output, trajectory)
        return replace(series, position=np.where(np.arange(SAMPLES) == 3, np.nan, series.position))

    monkeypatch.setattr("kincheck.core.harness.execution.output_series", holed)
    # of the second it is said why samples are missing
    record, missing = record_of(Fake()), record_of(Fake(answer=partial))
    assert record.outcome is Outcome.FAIL
    assert record.message.startswith(
        "x: position has no value at samples where closed form has one"
    )
    assert "has no value" not in missing.message


@pytest.mark.parametrize("truth", list(Truth))
def test_only_truths_from_elsewhere_validate(truth):
    assert record_of(Fake(), crank(truth=truth)).validated is truth.validates


def test_a_reference_that_does_not_fit_is_an_error_not_a_pass():
    case = crank()
    case.reference["x"] = Series(np.zeros(1))
    assert "closed form has shape (1,), expected (9,)" in record_of(Fake(), case).message


def test_progress_hears_of_every_record():
    heard = []
    results = run(
        [crank("a"), crank("b")], [Fake()], tol=TOL, progress=lambda *news: heard.append(news)
    )
    assert heard == [(results.records[0], 1, 2), (results.records[1], 2, 2)]
