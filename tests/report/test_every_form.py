"""Every number, unit, note and reason of a result is on the terminal, in JSON, in JUnit and on the
page. What a form leaves out on purpose is listed here, with the reason.
"""

import html

import msgspec
import pytest
from kincheck import Outcome
from kincheck.core.harness.record import Explanation, Suspect
from kincheck.core.history.findings import Change, Finding, Kind, Loose, Regressions, RunName, Step
from kincheck.core.report import junit, regressions, report, table

from ..support.examples import examples
from ..support.planted import as_json, missing, on_terminal, text_of_page, unexplained, unfilled
from ..support.strut_results import results

OF_RUN, OF_REPORT = examples(__file__, "of_run", "of_report")

replace = msgspec.structs.replace


@pytest.fixture(autouse=True)
def wide(monkeypatch):
    monkeypatch.setenv("COLUMNS", "1000")


def filled(record):
    """The record with all that a record may say."""
    found = {
        name: replace(each, sense="outward is positive", acceleration=[0.5] * len(each.position))
        for name, each in record.outputs.items()
    }
    errors = {
        name: replace(
            each, acceleration=replace(each.position, max_abs=7.7e-7), lost=3, contradicted=2
        )
        for name, each in record.errors.items()
    }
    evidence = replace(
        record.evidence,
        units={"half_track_change": "inch"},
        signs="outward",
        grid="3 of 21 samples",
        limits={"half_track_change": "0.1 mm of reading"},
    )
    return replace(
        record,
        outputs=found,
        errors=errors,
        evidence=evidence,
        seconds=replace(record.seconds, compare=0.3, waited=0.4),
        faults=["balance of power off by 3 W"],
        table={"length": "mm"},
    )


def a_run():
    """A run with every outcome, notes, signs, reasons, and pairs that were not run."""
    run = results()
    native, one, two = run.records
    native = replace(filled(native), message="passes a pose", reasons={"rank": "it has none"})
    one = filled(one)
    more = [
        replace(two, engine=each, outcome=outcome, message=f"{each} says why")
        for each, outcome in (("three", Outcome.ERROR), ("four", Outcome.UNSUPPORTED))
    ]
    facts = run.run["cases"]["strut"] | {"notes": ["a rod is long"], "signs": "x is forward"}
    explained = Explanation(
        outputs=["half_track_change"],
        quantities=["position"],
        change="with another sign",
        difference=1.5e-10,
        tolerance=1e-9,
        unit="m",
    )
    suspect = Suspect(
        engines=["one"],
        agreement=1e-12,
        output="half_track_change",
        quantity="position",
        sample=3,
        difference=2.5e-3,
        tolerance=1e-9,
        unit="m",
        outputs={"half_track_change": ["velocity"]},
        explanations=[explained],
        unexplained=["wheelbase_change"],
        message="the reference is off; with another sign it fits",
    )
    about = {"cases": {"strut": facts, "other": {}}, "missing": [["other", "five", "projection"]]}
    return replace(
        run, run=run.run | about, records=[native, one, two, *more], suspects={"other": suspect}
    )


def page_of_run(result, tmp_path):
    report.write_report(result, file := tmp_path / "report.html")
    return text_of_page(file.read_text("utf-8"))


def test_run_reaches_every_form(tmp_path):
    forms = {
        "terminal": on_terminal(table.print_outputs),
        "json": as_json,
        "junit": lambda result: html.unescape(junit.to_junit(result).decode()),
        "page": lambda result: page_of_run(result, tmp_path),
    }
    ours = ("strut", "other", "half_track_change", "wheelbase_change")
    run = a_run()
    assert unfilled(run) == {"Results.scenes"}
    assert unexplained(missing(run, forms, ours), OF_RUN) == ([], [])
    for outcome in Outcome:
        if not outcome.judged:
            last = replace(run.records[-1], outcome=outcome)
            changed = replace(run, records=[*run.records[:-1], last])
            for name, form in forms.items():
                assert (outcome.value if name == "json" else outcome.shown) in form(changed)


def a_change():
    """Changes between two runs, one of every sort."""
    name = {
        "name": "run 7",
        "number": 7,
        "started": "2026-11-28T03:17",
        "host": "h",
        "commit": None,
    }
    version = Change(what="mujoco", before="3.6.0", now="3.7.0")
    pair = {"case": "strut", "engine": "one", "mode": "projection"}
    drifted = Finding(
        **pair, kind=Kind.DRIFTED, message="x is worse", output="x", motion="position", since=5
    )
    lost = Finding(**pair, kind=Kind.FAILURE, message="fails now")
    step = Step(
        **pair,
        quantity="position",
        output="x",
        unit="m",
        first=5,
        started="2026-11-26T03:17",
        last=3,
        before=2.5e-12,
        now=4.5e-9,
        worse=True,
        changes=[version],
    )
    over = replace(step, quantity="time", output=None, before=0.25, now=0.75, repaired=6)
    return Regressions(
        run=RunName(**name),
        against=RunName(**name | {"name": "run 3", "number": 3}),
        reason="",
        pairs=12,
        failing=[("strut", "one", "projection"), ("strut", "two", "projection")],
        unjudged=[("strut", "three", "projection")],
        passed_by=[9],
        time_limit=1.3,
        findings=[drifted, lost],
        changes=[version],
        steps=[step, over],
        loose=[Loose(case="strut", output="x", runs=4, largest=2e-3, factor=500.0, why="old")],
    )


def test_report_reaches_every_form():
    run = results()
    forms = {
        "terminal": on_terminal(regressions.print_regressions),
        "markdown": regressions.to_markdown,
        "json": as_json,
        "junit": lambda found: html.unescape(junit.to_regression_junit(run, found).decode()),
        "page": lambda found: html.unescape(str(regressions.to_markup(found))),
    }
    assert unexplained(missing(a_change(), forms, ["strut"]), OF_REPORT) == ([], [])
