"""kincheck bench formulation: tables, JSON and page, what is missing and what cannot be written."""

import json
import sys

import pytest
from kincheck.core.cli import main
from kincheck.core.report.sections import Report, Section, page
from kincheck.core.studies.paper import formulation as bench_formulation

# The command


@pytest.fixture
def few(monkeypatch):
    monkeypatch.setattr(bench_formulation, "STATES", 3)


@pytest.mark.usefixtures("few")
def test_command_writes_tables_json_and_page(tmp_path, capsys):
    assert main.main(f"bench formulation --seed 7 --json - --out {tmp_path / 'new'}".split()) == 0
    captured = capsys.readouterr()
    found = json.loads(captured.out)
    assert found["schema"] == "kincheck-bench-formulation/1"
    assert (found["seed"], found["states"], found["digits"]) == (7, 3, 50)
    written = tmp_path / "new" / "bench_formulation.json"
    assert json.loads(written.read_text("utf-8")) == found
    html = (tmp_path / "new" / "bench_formulation.html").read_text("utf-8")
    for text in (captured.err, html):
        assert "as printed, multiplied out" in text
        assert "conventional" in text
        assert "moved back from there" in text
    assert "acceleration [m/s²]" in captured.err  # brackets are no markup
    assert "--paper:" in html  # the style sheet of the report
    assert "{%" not in html
    assert "http:" not in html
    assert "https:" not in html
    assert html.count("<table>") == 4


@pytest.mark.usefixtures("few")
def test_missing_mpmath_is_named(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "mpmath", None)
    assert main.main(["bench", "formulation"]) == 2
    said = capsys.readouterr().err
    assert "pip install mpmath" in said
    assert "Traceback" not in said


def test_bad_destinations_are_named_before_the_work(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(bench_formulation, "measure", lambda *_: pytest.fail("worked"))
    (tmp_path / "file").write_text("")
    (tmp_path / "bench_formulation.html").mkdir()
    for options in (
        ["--out", tmp_path / "file"],
        ["--out", tmp_path],
        ["--json", tmp_path / "no" / "x.json"],
    ):
        assert main.main(["bench", "formulation", *map(str, options)]) == 2
        assert "file" in capsys.readouterr().err


def test_page_escapes():
    section = Section("<b>", ["<i>"], ["&"], ["<u>", "n"], 1, [["<script>", "1"]])
    html = page(Report("x", "<title>", ["<s>"], [section]))
    assert "<script>" not in html
    for tag in ("<b>", "<i>", "<u>", "<s>"):
        assert tag not in html
    assert '<td class="number">1</td>' in html
