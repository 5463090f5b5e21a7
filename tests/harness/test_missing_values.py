"""Outputs and rates without values: out of tolerance where they are defined."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from kincheck import cases
from kincheck.core.case.case import ORDERS, Output, Series
from kincheck.core.harness.compare import (
    deviations,
    output_series,
)
from kincheck.core.harness.record import Outcome
from kincheck.core.harness.run import run
from kincheck.core.report.junit import to_junit
from kincheck.core.report.report import headline, write_report
from msgspec import UNSET

from ..support.fakes import SAMPLES, Fake, crank, partial, solution


class Undefined(Output):
    """An output without a value, whose derivatives are known."""

    def of(self, at, design):
        return replace(super().of(at, design), x=np.full(SAMPLES, np.nan))


class Rate(Output):
    """The derivative of an output, made of velocities."""

    orders = 2

    def of(self, at, design):
        return super().of(at, design).dot


class UndefinedRate(Rate):
    """Nor has it a value."""

    def of(self, at, design):
        return replace(super().of(at, design), x=np.full(SAMPLES, np.nan))


@pytest.mark.parametrize("complete", [True, False])
def test_output_without_values_fails(complete):
    x, y = crank().outputs
    case = replace(crank(), outputs=(Undefined(**vars(x)), y))
    results = run([case], [Fake(answer=solution if complete else partial)], tol=1e-12)
    (record,) = results.records
    assert record.outcome is Outcome.FAIL
    assert record.errors["x"].position is None
    assert record.errors["x"].lost == (SAMPLES if complete else UNSET)
    assert (
        headline(results)
        == f"1 of 1 comparisons {'has outputs without a value' if complete else 'lacks samples'}"
    )
    assert (
        f"x: position: {SAMPLES} samples without a value where closed form has one"
        in record.message
    ) is complete
    failed = ElementTree.fromstring(to_junit(results)).findall(".//testcase[failure]")
    assert [test.get("name") for test in failed] == (["x"] if complete else ["x", "y"])


def test_engine_without_samples_in_headline(tmp_path):
    def nothing(case):
        return solution(
            case, solved=np.zeros(SAMPLES, dtype=bool), position=np.full((SAMPLES, 3), np.nan)
        )

    results = run([crank()], [Fake("native"), Fake("none", answer=nothing)], tol=1e-12)
    assert headline(results) == "1 of 2 comparisons lacks samples"
    write_report(results, tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text("utf-8")
    assert "<small>no sample solved</small>" in text
    assert "<small>nothing to compare with</small>" not in text


@pytest.mark.parametrize(
    "rates",
    [(), ("velocity",), ("velocity", "acceleration")],
    ids=["positions", "velocities", "all"],
)
def test_derivative_output_has_one_order_less(rates):
    case = crank()
    right, missing = (
        case.reference["x"],
        {name: None for name in ("velocity", "acceleration") if name not in rates},
    )
    standards = [("closed_form", Series(right.velocity, right.acceleration))]
    known, lost = (
        deviations(
            case,
            output,
            output_series(case, output, solution(case, **missing)),
            standards,
            complete=True,
        )
        for output in (kind(**vars(case.outputs[0])) for kind in (Rate, UndefinedRate))
    )
    assert [quantity for quantity, _ in known.items()] == ["position", "velocity"][: len(rates)]
    assert not known.lost
    assert lost.lost == (SAMPLES if rates else UNSET)
    assert (
        "position: the engine gives no velocities, on which it depends" in (lost.reason or "")
    ) is not bool(rates)


def test_complete_reference_needs_no_native():
    """Of outputs that are derivatives there is no acceleration."""
    case, native = cases.load("mcpherson_suspension"), Fake("native")
    assert any(output.orders < ORDERS for output in case.outputs)
    run([case], [Fake("mujoco", refusal="no")], tol=1e-12, baseline=native)
    assert native.solves == 0
