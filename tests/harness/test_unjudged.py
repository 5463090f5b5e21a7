"""Outputs that are not judged: in a run, in histories, and values that an engine lacks."""

import json
import re
import sqlite3
import zlib
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from kincheck import Outcome, cases
from kincheck.core.case.case import ORDERS, Output, Series
from kincheck.core.harness.compare import deviations, output_series
from kincheck.core.harness.record import from_json, to_json
from kincheck.core.harness.results_file import read_results
from kincheck.core.history.findings import Kind
from kincheck.core.history.queries import faultless, read
from kincheck.core.history.store import Store
from kincheck.core.report import table
from kincheck.core.report.junit import to_junit, to_regression_junit
from kincheck.core.report.regressions import to_markdown
from kincheck.core.report.report import caveats, headline, write_report
from msgspec import UNSET

from ..support.examples import examples
from ..support.fakes import SAMPLES, Fake, crank, off, partial, record_of, run_case, solution
from ..support.history_runs import changed, history, keep, records, report, reported
from ..support.printed import junit_messages, junit_tests

(NAMED,) = examples(__file__, "named")

TOL = 1e-12
RIGHT, MISSING = Fake("native"), Fake("missing", installed=None)
UNABLE, WRONG = (
    Fake("unable", refusal="no counterpart"),
    Fake("wrong", answer=off("position", lambda p: p + 1e-3)),
)
WHY = "the case has no reference"
UNREFERENCED = {"crank": crank(reference=False)}


def unjudged():
    return run_case(crank(reference=False), RIGHT, Fake())


def test_many_unjudged_cases_are_summarised(kincheck_main, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    cases = {f"c{k:03}": crank(f"c{k:03}", reference=False) for k in range(30)}
    engines = [RIGHT, UNABLE]
    files = ("--markdown", "cases.md", "--json", "all.json")
    assert kincheck_main("run", "--require", "unable", *files, engines=engines, cases=cases) == 2
    told = capsys.readouterr()
    eight = ", ".join([*cases][:8])
    assert f"not judged: {eight} and 22 more · native: {WHY}\n" in told.out
    assert f"Not judged: {eight} and 22 more in native: {WHY}." in Path("cases.md").read_text()
    quoted = ", ".join(map(repr, [*cases][:8]))
    assert f"required engine 'unable': cases {quoted} and 22 more are unsupported: " in told.err
    write_report(read_results(Path("all.json")), Path("page.html"))
    assert f"on {eight} and 22 more" in Path("page.html").read_text("utf-8")
    titles = [title for title, _ in caveats(read_results(Path("all.json")))]
    assert max(map(len, titles)) < 250


def test_not_judged_wording_in_every_format(tmp_path, kincheck_main, capsys):
    results = unjudged()
    assert kincheck_main("run", engines=[RIGHT, Fake()], cases=UNREFERENCED) == 0
    told = capsys.readouterr()
    assert "crank native: not judged" in told.err
    assert re.search(r"^crank +native +not judged +–", told.out, re.MULTILINE)
    assert f"not judged: crank · native: {WHY}\n" in told.out
    assert told.out.rstrip().endswith("1 pass, 1 not judged")
    skips = junit_messages(to_junit(results), "skipped")
    assert skips == [f"not judged: {WHY}"] * 2  # an output each
    assert f"Not judged: crank in native: {WHY}." in table.to_markdown(results)
    assert "| not judged, residual 1e-15 |" in table.to_markdown(results)
    assert (f"Not judged: {RIGHT.name} on crank", WHY) in caveats(results)
    assert headline(results) == "The one comparison is within tolerance, 1 not judged"
    write_report(results, tmp_path / "page.html")
    page = re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", (tmp_path / "page.html").read_text()))
    assert "? not judged 1" in page
    assert f"? not judged native on crank: {WHY}" in page
    for text in (told.out, page, table.to_markdown(results)):
        assert "unjudged" not in text
        assert "compared with nothing" not in text


def test_unjudged_output_is_skipped_in_junit():
    case = crank()
    del case.reference["y"]
    record = record_of(RIGHT, case)
    assert (record.outcome, record.message) == (
        Outcome.PASS,
        "not judged: y: the reference does not have it",
    )
    results = run_case(case, RIGHT, WRONG)
    tests = junit_tests(to_junit(results))
    assert tests["crank.native.projection x"] == []
    assert tests["crank.native.projection y"] == [
        ("skipped", "not judged: the reference does not have it")
    ]
    assert [kind for kind, _ in tests["crank.wrong.projection x"]] == ["failure"]


def test_large_residual_fails_every_output():
    def answer(case):
        found = RIGHT.answer(case)
        found.__dict__["residual"] = 1e-3
        return found

    failures = junit_messages(to_junit(run_case(crank(), Fake(answer=answer))), "failure")
    assert [message[:12] for message in failures] == ["the residual"] * 2


# Exit status


@pytest.mark.parametrize(
    ("engines", "status"),
    [
        ([RIGHT], 2),
        ([RIGHT, Fake()], 0),
        ([RIGHT, MISSING], 2),
        ([RIGHT, UNABLE, MISSING], 2),
        ([RIGHT, WRONG], 1),
        ([RIGHT, Fake(), MISSING], 0),
    ],
    ids=["native", "two", "missing", "unable", "wrong", "two and missing"],
)
def test_run_without_comparison_has_status_2(kincheck_main, capsys, engines, status):
    assert kincheck_main("run", engines=engines, cases=UNREFERENCED) == status
    assert ("kincheck: nothing was compared (1 not judged" in capsys.readouterr().err) is (
        status == 2
    )


def test_unjudged_case_keeps_status_0(kincheck_main, capsys):
    cases = {"crank": crank(), "bare": crank("bare", reference=False)}
    assert kincheck_main("run", engines=[RIGHT], cases=cases) == 0
    assert "1 pass, 1 not judged" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("named", "status"),
    NAMED,
)
def test_named_engine_is_required(kincheck_main, capsys, named, status):
    assert kincheck_main("run", *named.split(), engines=[RIGHT, MISSING, UNABLE]) == status
    lines = capsys.readouterr().err.splitlines()
    told = [line for line in lines if "missing is not installed" in line and "engine '" in line]
    assert len(told) == (status == 2)
    assert all(line.startswith("kincheck: ") for line in told)


def test_broken_native_leaves_engines_unjudged(kincheck_main, capsys):
    def broken(case):
        raise ValueError("no")

    assert (
        kincheck_main("run", engines=[Fake("native", answer=broken), Fake()], cases=UNREFERENCED)
        == 2
    )
    assert "nothing was compared (1 not judged, 1 error)" in capsys.readouterr().err


# Series with holes


def test_reference_without_values_is_unjudged():
    case = crank()
    unknown = np.full(len(case.sweep.values), np.nan)
    case.reference.update(dict.fromkeys(("x", "y"), Series(unknown, unknown, unknown)))
    record = record_of(RIGHT, case)
    assert record.outcome is Outcome.UNJUDGED
    assert "position: no sample is known to both the engine and closed form" in record.message


# Unjudged pairs in histories and results, of earlier versions too, and in regression reports


def as_of_before(results):
    """Results as older versions wrote them: a pass, compared with nothing."""
    passed = [
        msgspec.structs.replace(each, outcome=Outcome.PASS) if each.outcome == "unjudged" else each
        for each in results.records
    ]
    return msgspec.structs.replace(results, records=passed)


def test_old_results_are_read_as_unjudged(tmp_path):
    file = tmp_path / "old.json"
    file.write_bytes(to_json(as_of_before(unjudged())))
    assert [each.outcome for each in read_results(file).records] == ["unjudged", "pass"]
    assert [each.outcome for each in from_json(file.read_bytes()).records] == ["unjudged", "pass"]


def bare(all_records, engine="mujoco", *, outcome=Outcome.UNJUDGED):
    """The records with a pair that nothing is compared with."""
    nothing = {"position": None, "velocity": None, "acceleration": None, "reason": WHY}

    def emptied(errors):
        return {name: msgspec.structs.replace(each, **nothing) for name, each in errors.items()}

    return changed(all_records, engine=engine, outcome=outcome, message=WHY, errors=emptied)


def test_old_history_is_read_as_unjudged(path, capsys):
    keep(
        path,
        [
            each
            for each in bare(records(), outcome=Outcome.PASS)
            if (each.case, each.engine) == ("first", "mujoco")
        ],
    )
    with closing(sqlite3.connect(path)) as raw:  # it is as the older version left it
        ((outcome, record),) = raw.execute("SELECT outcome, record FROM records")
    assert (outcome, json.loads(zlib.decompress(record))["outcome"]) == ("pass", "pass")
    with Store(path) as store:
        assert [each.outcome for each in store.records(1)] == ["unjudged"]
        assert [entry.outcome for entries in read(store).pairs.values() for entry in entries] == [
            "unjudged"
        ]
        assert faultless(store, store.runs()) == set()
    assert history(path) == 0
    assert "1 not judged" in capsys.readouterr().out
    assert history(path, "--case", "first") == 0
    assert "not judged" in capsys.readouterr().out


def test_output_named_max_abs_is_unjudged(path):
    nothing = {"position": None, "velocity": None, "acceleration": None}
    odd = msgspec.structs.replace(
        next(iter(records()[0].errors.values())), **nothing, reason='"max_abs":1'
    )
    keep(
        path, changed(records(), outcome=Outcome.PASS, errors={'"max_abs":1': odd, "max_abs": odd})
    )
    with Store(path) as store:
        outcomes = {pair[:2]: entries[0].outcome for pair, entries in read(store).pairs.items()}
    assert outcomes["first", "mujoco"] == "unjudged"
    assert outcomes["first", "native"] == "pass"


def test_unjudged_run_is_not_green(path):
    all_bare = bare(records(), "native")
    keep(path, [each for each in all_bare if each.outcome is Outcome.UNJUDGED])
    with Store(path) as store:
        assert faultless(store, store.runs()) == set()
    keep(path, all_bare)
    with Store(path) as store:
        assert faultless(store, store.runs()) == {2}


# Reports


def test_pair_losing_judgement_is_regression(path):
    keep(path, records())
    keep(path, bare(records()))
    found = reported(path)
    assert [(each.kind, each.case, each.engine, each.message) for each in found.findings] == [
        (Kind.UNJUDGED, "first", "mujoco", f"pass → not judged: {WHY}")
    ]
    assert found.regressed
    assert found.unjudged == [("first", "mujoco", "projection")]
    assert "1 no longer judged" in to_markdown(found)
    with Store(path) as store:
        text = to_regression_junit(store.results(2), found)
    assert junit_messages(text, "failure") == [f"no longer judged: pass → not judged: {WHY}"]
    # as long as it is so, it is told: the run that compared most is the one to compare with
    keep(path, bare(records()))
    assert [each.kind for each in reported(path).findings] == [Kind.UNJUDGED]


def test_unjudged_failure_is_not_fixed(path):
    keep(path, changed(records(), outcome=Outcome.FAIL, message="off"))
    keep(path, bare(records()))
    found = reported(path, against="1")
    assert [each.kind for each in found.findings] == [Kind.UNJUDGED]
    assert not found.steps or all(step.quantity != "outcome" or step.worse for step in found.steps)


def test_regained_judgement_is_no_regression(path):
    keep(path, bare(records()))
    keep(path, records())
    found = reported(path, against="1")
    assert [(each.kind, each.message) for each in found.findings] == [
        (Kind.JUDGED, "not judged → pass")
    ]
    assert not found.regressed
    assert "1 judged again" in to_markdown(found)
    keep(path, changed(records(), outcome=Outcome.FAIL, message="off"))
    assert [each.message for each in reported(path, against="1").findings] == [
        "not judged → fail: off"
    ]


def test_old_unjudged_pass_is_no_regression(path):
    """The native pair was a pass in the older version, and is not judged today."""
    keep(path, bare(records(), outcome=Outcome.PASS))
    keep(path, bare(records()))
    assert (reported(path).findings, reported(path).regressed) == ([], False)


def test_first_report_counts_judged_pairs(path, capsys):
    keep(path, bare(records()))
    assert report(path) == 0
    assert "all 3 right, 1 not judged; nothing to compare with" in capsys.readouterr().out


# Outputs and rates without values: out of tolerance where they are defined


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
    results = run_case(case, Fake(answer=solution if complete else partial))
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
    failed = [name[-1] for name, found in junit_tests(to_junit(results)).items() if found]
    assert failed == (["x"] if complete else ["x", "y"])


def test_engine_without_samples_in_headline(tmp_path):
    def nothing(case):
        return solution(
            case, solved=np.zeros(SAMPLES, dtype=bool), position=np.full((SAMPLES, 3), np.nan)
        )

    results = run_case(crank(), Fake("native"), Fake("none", answer=nothing))
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


@pytest.mark.needs("hardpoints")
def test_complete_reference_needs_no_native():
    """Of outputs that are derivatives there is no acceleration."""
    case, native = cases.load("mcpherson_suspension"), Fake("native")
    assert any(output.orders < ORDERS for output in case.outputs)
    run_case(case, Fake("mujoco", refusal="no"), baseline=native)
    assert native.solves == 0
