"""Cases that cannot be read, in a run of others: named first, recorded; the others are solved."""

import re
from pathlib import Path
from xml.etree import ElementTree

import kincheck.adapters
import kincheck.cases
import kincheck.core
from kincheck import CaseError
from kincheck.core.cli.main import main
from kincheck.core.harness.results_file import read_results
from kincheck.core.report.report import caveats, headline

from ..support.fakes import Fake, crank
from .test_cli import RIGHT


def test_invalid_cases_are_reported_before_run(kincheck_main, capsys, tmp_path):
    first, second = tmp_path / "first.toml", tmp_path / "second.json"
    first.write_text('schema = "kincheck-case/9"\n')
    second.write_text("{")
    RIGHT.solves = 0
    assert kincheck_main("run", first, second, tmp_path / "third.toml") == 2
    captured = capsys.readouterr()
    said = captured.err.splitlines()
    assert [
        sum(name in line for line in said) for name in ("first.toml", "second.json", "third.toml")
    ] == [1, 1, 1]
    assert "Traceback" not in captured.err
    assert captured.out == ""
    assert RIGHT.solves == 0


def test_run_continues_beside_unreadable_case(kincheck_main, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    bad = "bad.toml"
    Path(bad).write_text('schema = "kincheck-case/9"\n')
    files = "--out out --junit junit.xml --history history".split()
    for _ in range(2):
        assert kincheck_main("run crank", bad, "crank_two", *files) == 2
    captured = capsys.readouterr()
    message = f"{bad}: line 1: schema: found"
    assert captured.err.count(message) == 2  # once each run
    assert captured.err.index(message) < captured.err.index("[1/2] crank native: pass")
    found = read_results(Path("out/results.json"))
    assert [record.case for record in found.records] == ["crank", "crank_two"]
    assert found.missing == [(bad, "native", "projection")]
    assert [*found.unread] == [bad]
    assert message in found.unread[bad]
    assert headline(found).endswith("within tolerance; 1 case could not be read")
    assert dict(caveats(found))[f"Not read: {bad}"].startswith(message)
    (error,) = (
        test.find("error")
        for test in ElementTree.parse("junit.xml").iter("testcase")
        if test.find("error") is not None
    )
    assert error.get("message") == found.unread[bad]
    # what is broken tonight is told, and tomorrow too
    assert kincheck_main("report --history history") == 1
    told = capsys.readouterr().out
    assert message.partition(":")[0].replace("_", r"\_") in told
    told = re.sub(r": \d slower, ", ": ", told)  # of sweeps of 0.05 ms, on a busy machine
    assert told.startswith("## run 2 against run 1 (last green): 1 case could not be read")
    # and is one fault, however many engines were to solve it
    engines = [RIGHT, Fake("other")]
    assert kincheck_main("run crank --history history", engines=engines) == 0
    assert kincheck_main("run crank", bad, "--history", "history", engines=engines) == 2
    capsys.readouterr()
    assert kincheck_main("report --history history") == 1
    told = capsys.readouterr().out.splitlines()[0]
    told = re.sub(r": \d slower, ", ": ", told)  # of sweeps of 0.05 ms, on a busy machine
    assert told == "## run 4 against run 3 (last green): 1 case could not be read"


def test_run_without_readable_case_is_stored(kincheck_main, capsys, tmp_path, monkeypatch):
    """Else the report would judge the night before, and its files would stand there as those of
    this one.
    """
    monkeypatch.chdir(tmp_path)
    files = "--out out --junit junit.xml --markdown cases.md --history history".split()
    for _ in range(2):
        assert kincheck_main("run crank", *files) == 0
    assert kincheck_main("run crank", *files, cases={"rod": crank("rod")}) == 2
    captured = capsys.readouterr()
    assert captured.err.count("there is no case 'crank'") == 1
    assert captured.out.endswith("nothing was run\n1 case could not be read: crank\n")
    found = read_results(Path("out/results.json"))
    assert (found.records, found.missing) == ([], [("crank", "native", "projection")])
    assert [test.get("name") for test in ElementTree.parse("junit.xml").iter("testcase")] == [
        "not run"
    ]
    assert "1 case could not be read: crank" in Path("cases.md").read_text()
    assert kincheck_main("report --history history") == 1
    assert capsys.readouterr().out.startswith(
        "## run 3: all 0 right, 1 case could not be read; nothing to compare with"
    )


def test_unknown_case_and_engine_are_reported(kincheck_main, capsys):
    RIGHT.solves = 0
    assert kincheck_main("run crank nosuch --engine nativ", engines=[RIGHT]) == 2
    assert [line[:29] for line in capsys.readouterr().err.splitlines()] == [
        "kincheck: there is no case 'n",
        "kincheck: there is no engine ",
    ]
    assert RIGHT.solves == 0


def test_invalid_built_in_case_is_reported(capsys, monkeypatch):
    def load(name):
        raise CaseError("crank.toml: sweep.steps = 0: expected at least 1")

    monkeypatch.setattr(kincheck.cases, "names", lambda: ("crank",))
    monkeypatch.setattr(kincheck.cases, "load", load)
    assert main(["run", "crank"]) == 2
    assert capsys.readouterr().err == "kincheck: crank.toml: sweep.steps = 0: expected at least 1\n"


def test_duplicate_case_names_are_refused(kincheck_main, capsys):
    assert kincheck_main("run", cases={"a": crank("same"), "b": crank("same")}) == 2
    assert "two cases named 'same'" in capsys.readouterr().err
