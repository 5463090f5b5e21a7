"""`unjudged`: a solved pair that nothing was compared with, neither a pass nor a fault, in the same
words on every surface.
"""

import re
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from kincheck.core.case.case import Series
from kincheck.core.harness.record import Outcome
from kincheck.core.harness.results_file import read_results
from kincheck.core.harness.run import run
from kincheck.core.report import junit, table
from kincheck.core.report.report import caveats, headline, write_report

from ..support.fakes import Fake, crank, off

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


def test_many_cases_are_named_by_the_first(kincheck_main, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    cases = {f"c{k:03}": crank(f"c{k:03}", reference=False) for k in range(200)}
    engines = [RIGHT, UNABLE]
    files = ("--markdown", "cases.md", "--json", "all.json")
    assert kincheck_main("run", "--require", "unable", *files, engines=engines, cases=cases) == 2
    told = capsys.readouterr()
    eight = ", ".join([*cases][:8])
    assert f"not judged: {eight} and 192 more · native: {WHY}\n" in told.out
    assert f"Not judged: {eight} and 192 more in native: {WHY}." in Path("cases.md").read_text()
    quoted = ", ".join(map(repr, [*cases][:8]))
    assert f"required engine 'unable': cases {quoted} and 192 more are unsupported: " in told.err
    write_report(read_results(Path("all.json")), Path("page.html"))
    assert f"on {eight} and 192 more" in Path("page.html").read_text("utf-8")
    titles = [title for title, _ in caveats(read_results(Path("all.json")))]
    assert max(map(len, titles)) < 250


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
def test_run_without_comparison_has_status_2(kincheck_main, capsys, engines, status):
    assert kincheck_main("run", engines=engines, cases=UNREFERENCED) == status
    assert ("kincheck: nothing was compared (1 not judged" in capsys.readouterr().err) is (
        status == 2
    )


def test_unjudged_case_keeps_status_0(kincheck_main, capsys):
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


def test_broken_native_leaves_others_unjudged(kincheck_main, capsys):
    def broken(case):
        raise ValueError("no")

    assert (
        kincheck_main("run", engines=[Fake("native", answer=broken), Fake()], cases=UNREFERENCED)
        == 2
    )
    assert "nothing was compared (1 not judged, 1 error)" in capsys.readouterr().err


# Series with holes


def test_a_reference_without_any_value_judges_nothing():
    case = crank()
    unknown = np.full(len(case.sweep.values), np.nan)
    case.reference.update(dict.fromkeys(("x", "y"), Series(unknown, unknown, unknown)))
    (record,) = run([case], [RIGHT], tol=TOL).records
    assert record.outcome is Outcome.UNJUDGED
    assert "position: no sample is known to both the engine and closed form" in record.message
