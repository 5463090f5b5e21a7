"""References of a run: the case's own, the native engine, or none."""

from dataclasses import replace

import pytest
from kincheck.core.case.case import Series, Truth
from kincheck.core.harness.record import Outcome
from kincheck.core.harness.run import run

from ..support.fakes import Fake, crank, off
from .test_run import TOL, record_of


def test_case_without_reference_uses_native():
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


def test_native_completes_the_reference():
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


@pytest.mark.parametrize("truth", list(Truth))
def test_only_truths_from_elsewhere_validate(truth):
    assert record_of(Fake(), crank(truth=truth)).validated is truth.validates
