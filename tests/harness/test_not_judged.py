"""`unjudged`: a solved pair that nothing was compared with, neither a pass nor a fault, in the same
words on every surface.
"""

import json
import re
import sqlite3
import zlib
from contextlib import closing
from xml.etree import ElementTree as ET

import msgspec
import numpy as np
import pytest
from kincheck.core.case.case import Series
from kincheck.core.cli import main
from kincheck.core.harness.record import Outcome, from_json, to_json
from kincheck.core.harness.results_file import read_results
from kincheck.core.harness.run import run
from kincheck.core.history.queries import green, read
from kincheck.core.history.regression.findings import Kind
from kincheck.core.history.store import Store
from kincheck.core.report import junit, matrix
from kincheck.core.report.caveats import caveats
from kincheck.core.report.regression_junit import to_regression_junit
from kincheck.core.report.regression_summary import to_markdown
from kincheck.core.report.report import headline, write_report

from ..support.fakes import Fake, crank, off
from ..support.nights import changed, keep, records, reported

TOL = 1e-12
RIGHT, MISSING = Fake("native"), Fake("missing", installed=None)
UNABLE, WRONG = (
    Fake("unable", refusal="no counterpart"),
    Fake("wrong", answer=off("position", lambda p: p + 1e-3)),
)
WHY = "the case has no reference"
UNREFERENCED = {"crank": crank(reference=False)}


def unjudged():
    return run([crank(reference=False)], [RIGHT, Fake()], tol=TOL)


def test_the_outcome_is_neither_bad_nor_judged():
    native, fake = unjudged().records
    assert (native.outcome, native.message, fake.outcome) == ("unjudged", WHY, "pass")
    assert not native.outcome.bad
    assert not native.outcome.judged
    assert not native.validated
    assert json.loads(to_json(unjudged()))["records"][0]["outcome"] == "unjudged"


def test_every_surface_has_the_same_words(tmp_path, kincheck_main, capsys):
    results = unjudged()
    assert kincheck_main("run", engines=[RIGHT, Fake()], cases=UNREFERENCED) == 0
    told = capsys.readouterr()
    assert "crank native: not judged" in told.err
    assert re.search(r"^crank +native +not judged +–", told.out, re.MULTILINE)
    assert f"not judged: crank · native: {WHY}\n" in told.out
    assert told.out.rstrip().endswith("1 pass, 1 not judged")
    skips = [skip.get("message") for skip in ET.fromstring(junit.to_junit(results)).iter("skipped")]
    assert skips == [f"not judged: {WHY}"] * 2  # an output each
    assert f"Not judged: crank in native: {WHY}." in matrix.to_markdown(results)
    assert "| not judged, residual 1e-15 |" in matrix.to_markdown(results)
    assert (f"Not judged: {RIGHT.name} on crank", WHY) in caveats(results)
    assert headline(results) == "The one comparison is within tolerance, 1 not judged"
    write_report(results, tmp_path / "page.html")
    page = re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", (tmp_path / "page.html").read_text()))
    assert "? not judged 1" in page
    assert f"? not judged native on crank: {WHY}" in page
    for text in (told.out, page, matrix.to_markdown(results)):
        assert "unjudged" not in text
        assert "compared with nothing" not in text


def test_an_output_that_was_not_judged_is_skipped_beside_those_that_were():
    case = crank()
    del case.reference["y"]
    (record,) = run([case], [RIGHT], tol=TOL).records
    assert (record.outcome, record.message) == (
        Outcome.PASS,
        "not judged: y: the reference does not have it",
    )
    results = run([case], [RIGHT, WRONG], tol=TOL)
    tests = {
        (test.get("classname"), test.get("name")): [
            (child.tag, child.get("message")) for child in test
        ]
        for test in ET.fromstring(junit.to_junit(results)).iter("testcase")
    }
    assert tests["crank.native.projection", "x"] == []
    assert tests["crank.native.projection", "y"] == [
        ("skipped", "not judged: the reference does not have it")
    ]
    assert [tag for tag, _ in tests["crank.wrong.projection", "x"]] == ["failure"]


def test_a_fault_of_the_whole_pair_fails_every_output():
    def answer(case):
        found = RIGHT.answer(case)
        found.__dict__["residual"] = 1e-3
        return found

    root = ET.fromstring(junit.to_junit(run([crank()], [Fake(answer=answer)], tol=TOL)))
    assert [failure.get("message", "")[:12] for failure in root.iter("failure")] == [
        "the residual"
    ] * 2


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
def test_a_run_that_compares_nothing_has_not_done_its_work(kincheck_main, capsys, engines, status):
    assert kincheck_main("run", engines=engines, cases=UNREFERENCED) == status
    assert ("kincheck: nothing was compared (1 not judged" in capsys.readouterr().err) is (
        status == 2
    )


def test_a_case_that_is_not_judged_beside_one_that_is_changes_no_status(kincheck_main, capsys):
    cases = {"crank": crank(), "bare": crank("bare", reference=False)}
    assert kincheck_main("run", engines=[RIGHT], cases=cases) == 0
    assert "1 pass, 1 not judged" in capsys.readouterr().out


def test_an_engine_that_is_named_is_required(kincheck_main, capsys):
    engines = [RIGHT, MISSING]
    assert kincheck_main("run", engines=engines) == 0
    assert kincheck_main("run", "--engine", "native", engines=engines) == 0
    capsys.readouterr()
    assert kincheck_main("run", "--engine", "native", "missing", engines=engines) == 2
    assert (
        "kincheck: engine 'missing' is requested, but missing: missing is not installed"
        in capsys.readouterr().err
    )
    assert kincheck_main("run", "--engine", "missing", engines=engines) == 2
    assert kincheck_main("run", "--engine", "native", "unable", engines=[RIGHT, UNABLE]) == 0
    capsys.readouterr()
    assert (
        kincheck_main(
            "run", "--engine", "native", "missing", "--require", "missing", engines=engines
        )
        == 2
    )
    told = [
        line for line in capsys.readouterr().err.splitlines() if "missing is not installed" in line
    ]
    assert len(told) == 1  # not once for each option


def test_native_that_breaks_leaves_the_others_unjudged(kincheck_main, capsys):
    def broken(case):
        raise ValueError("no")

    assert (
        kincheck_main("run", engines=[Fake("native", answer=broken), Fake()], cases=UNREFERENCED)
        == 2
    )
    assert "nothing was compared (1 not judged, 1 error)" in capsys.readouterr().err


# Histories and results of before


def as_of_before(results):
    """Results as older versions wrote them: a pass, compared with nothing."""
    passed = [
        msgspec.structs.replace(each, outcome=Outcome.PASS) if each.outcome == "unjudged" else each
        for each in results.records
    ]
    return msgspec.structs.replace(results, records=passed)


def test_results_of_before_are_read_as_what_they_are(tmp_path):
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


def test_a_history_of_before_is_read_as_what_it_is(path, capsys):
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
        assert green(store) == []
    assert main.main(["history", "--history", str(path)]) == 0
    assert "1 not judged" in capsys.readouterr().out
    assert main.main(["history", "--history", str(path), "--case", "first"]) == 0
    assert "not judged" in capsys.readouterr().out


def test_names_that_look_like_deviations_are_none(path):
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


def test_runs_of_unjudged_pairs_alone_are_not_green(path):
    all_bare = bare(records(), "native")
    keep(path, [each for each in all_bare if each.outcome is Outcome.UNJUDGED])
    with Store(path) as store:
        assert green(store) == []
    keep(path, all_bare)
    with Store(path) as store:
        assert [row.id for row in green(store)] == [2]


# Reports


def test_a_pair_that_is_no_longer_judged_is_a_regression(path):
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
        suite = ET.fromstring(to_regression_junit(store.results(2), found))
    assert [failure.get("message") for failure in suite.iter("failure")] == [
        f"no longer judged: pass → not judged: {WHY}"
    ]
    # as long as it is so, it is told: the run that compared most is the one to compare with
    keep(path, bare(records()))
    assert [each.kind for each in reported(path).findings] == [Kind.UNJUDGED]


def test_a_failure_that_is_no_longer_judged_is_not_fixed(path):
    keep(path, changed(records(), outcome=Outcome.FAIL, message="off"))
    keep(path, bare(records()))
    found = reported(path, against="1")
    assert [each.kind for each in found.findings] == [Kind.UNJUDGED]
    assert not found.steps or all(step.quantity != "outcome" or step.worse for step in found.steps)


def test_what_is_judged_again_says_so_and_is_no_regression(path):
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


def test_an_upgrade_is_no_regression(path):
    """The native pair was a pass in the older version, and is not judged today."""
    keep(path, bare(records(), outcome=Outcome.PASS))
    keep(path, bare(records()))
    assert (reported(path).findings, reported(path).regressed) == ([], False)


def test_a_first_report_counts_only_what_was_judged(path, capsys):
    keep(path, bare(records()))
    assert main.main(["report", "--history", str(path)]) == 0
    assert "all 3 right, 1 not judged; nothing to compare with" in capsys.readouterr().out


# Series with holes


def test_a_reference_without_any_value_judges_nothing():
    case = crank()
    unknown = np.full(len(case.sweep.values), np.nan)
    case.reference.update(dict.fromkeys(("x", "y"), Series(unknown, unknown, unknown)))
    (record,) = run([case], [RIGHT], tol=TOL).records
    assert record.outcome is Outcome.UNJUDGED
    assert "position: no sample is known to both the engine and closed form" in record.message
