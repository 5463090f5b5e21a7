"""What a regression report is written as: Markdown, JSON, JUnit and a page, from one comparison."""

import xml.etree.ElementTree as ET

import msgspec
from kincheck.core.cli import main
from kincheck.core.harness.record import Outcome
from kincheck.core.history.findings import Regressions
from kincheck.core.history.store import Store
from kincheck.core.report.regression_junit import to_regression_junit
from kincheck.core.report.regression_labels import headline, rows
from kincheck.core.report.regression_summary import to_markdown
from kincheck.core.report.regression_text import print_regressions

from ..support.nights import changed, keep, nights, records, reported, times, worse
from ..support.printed import Terminal, coloured


def test_the_command_writes_every_format(path, tmp_path, capsys):
    nights(path, 6)
    keep(path, changed(records(), **worse(20.0), message="<script>alert(1)</script> | *x*"))
    out = tmp_path / "report"
    assert main.main(f"report --history {path} --out {out}".split()) == 1
    text = (out / "regressions.md").read_text()
    assert capsys.readouterr().out == text
    found = msgspec.json.decode((out / "regressions.json").read_bytes(), type=Regressions)
    assert found == reported(path)
    assert found.findings[0].since == 7
    page = (out / "report.html").read_text()
    assert page.index("1 less accurate") < page.index('id="overview"')
    assert "x position error 5e-13 → 1e-11 m" in page
    assert "case-0-trend-time" in page
    root = ET.parse(out / "junit.xml").getroot()
    failed = [
        (test.get("classname"), test.get("name"))
        for test in root.iter("testcase")
        if test.find("failure") is not None
    ]
    assert failed == [("first.mujoco.projection", "x")]
    assert len(list(root.iter("testcase"))) == 8


def test_regression_junit_keeps_skips(path):
    nights(path, 6)
    made = changed(
        changed(records(), **times(2.0)),
        case="second",
        outcome=Outcome.UNAVAILABLE,
        message="not installed",
        seconds=None,
    )
    keep(
        path,
        changed(made, case="first", engine="native", outcome=Outcome.CRASHED, message="signal 11"),
    )
    found = reported(path)
    with Store(path) as store:
        root = ET.fromstring(to_regression_junit(store.results(7), found))
    failed = {
        f"{test.get('classname')} {test.get('name')}"
        for test in root.iter("testcase")
        if test.find("failure") is not None
    }
    assert failed == {"first.mujoco.projection slower", "second.mujoco.projection lost"}
    assert [suite.get("failures") for suite in root] == ["1", "1"]
    assert [suite.get("skipped") for suite in root] == ["0", "2"]
    assert [(suite.get("tests"), suite.get("errors")) for suite in root] == [("5", "2"), ("5", "0")]


def test_regression_markdown_escapes_and_folds(path):
    nights(path, 1)
    message = "</details> | `x` @team"
    keep(
        path,
        [
            msgspec.structs.replace(each, outcome=Outcome.ERROR, message=message)
            for each in records()
        ],
    )
    text = to_markdown(reported(path))
    assert (
        "| native, mujoco | first, second | pass → error: &lt;/details&gt; \\| \\`x\\` @\u2060team"
        in text
    )
    assert text.startswith("## run 2 against run 1 (last green): 4 new failures\n")


def test_pairs_that_no_engine_can_solve_are_not_right(path):
    first, *others = records()
    gone = [msgspec.structs.replace(each, outcome=Outcome.UNAVAILABLE) for each in others]
    keep(path, [first, *gone])
    assert f": all 1 right, {len(others)} unavailable or unsupported;" in headline(reported(path))


def test_a_terminal_shows_tables_without_marks(path, capsys, monkeypatch):
    nights(path, 6)
    keep(path, changed(records(), **worse(20.0), message="<script> | *x*")[:-1])
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("TERM", "dumb")  # no colours
    monkeypatch.setenv("COLUMNS", "200")
    assert main.main(["report", "--history", str(path)]) == 1
    shown = capsys.readouterr().out
    for mark in ("<details>", "<summary>", "## ", "| ", "**", "&lt;"):
        assert mark not in shown
    found = reported(path)
    assert shown.startswith(headline(found))
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    print_regressions(found, screen := Terminal())
    kinds = dict.fromkeys(each.kind for each in found.findings)
    red = [kind for kind in kinds if found.fails(kind)]
    assert len(red) == 1 < len(kinds)
    assert [line.split(" (")[0] for line in coloured(screen.getvalue())["red"]] == red
    for row in rows(found.findings):
        assert row.engine in shown
        assert row.where in shown
        assert " ".join(row.what.split()) in " ".join(shown.split())
