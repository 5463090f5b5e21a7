"""kincheck site over documents in a folder."""

import re
from datetime import datetime

import pytest
from kincheck.core.cli.main import main
from kincheck.core.extensions.bisect.results import Bisection, CaseChange, Change
from kincheck.core.extensions.board.results import Board, Row
from kincheck.core.harness.record import to_json
from msgspec.structs import replace

from ...support.fakes import Fake, crank, off, run_case


def put(out, name, found):
    """Write a document."""
    file = out / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(to_json(found))


def bisection(out, right):
    """Write a search with a change at 7.0 and its reproducer."""
    put(out, "wobble/wobble-6.0-7.0/README.md", {})
    case = CaseChange(kind="result", outcomes=("pass", "fail"), messages=("", ""), right=right)
    change = Change(
        earlier="6.0",
        later="7.0",
        kind="result",
        cases={"crank": case},
        right=right,
        repeat="kincheck bisect wobble crank.toml --from 6.0 --to 7.0",
        reproducer="wobble-6.0-7.0",
    )
    found = Bisection(
        kincheck="1",
        engine="wobble",
        package="wobble-sim",
        ends=("1.0", "12.0"),
        releases=12,
        every=False,
        command="kincheck bisect wobble",
        changes=[change],
        not_installable=[],
        reasons={},
        tried=["1.0", "6.0", "7.0", "12.0"],
    )
    put(out, "wobble/bisect.json", found)


def red(out):
    """Texts of the rows in red."""
    page = (out / "index.html").read_text()
    return [
        re.sub(r"<.*?>", " ", row) for row in re.findall(r'<tr class="wrong">.*?</tr>', page, re.S)
    ]


@pytest.mark.parametrize(
    ("right", "wrong"), [("6.0", 1), ("neither", 1), ("7.0", 0), ("unknown", 0)]
)
def test_wrong_release_is_red(tmp_path, right, wrong):
    bisection(tmp_path, right)
    assert main(["site", "--out", str(tmp_path)]) == wrong
    rows = red(tmp_path)
    assert len(rows) == wrong
    assert all("wobble-sim 6.0 → 7.0" in row for row in rows)


def test_site_links_resolve(tmp_path):
    bisection(tmp_path, "6.0")
    assert main(["run", "four_bar", "--engine", "native", "-q", "--out", f"{tmp_path}/run"]) == 0
    put(tmp_path, "without_page/results.json", run_case(crank(), Fake("right")))
    page = tmp_path / "docs/findings/simulators.html"
    page.parent.mkdir(parents=True)
    page.write_text("<title>Simulators &amp; more - kincheck</title>")
    row = Row(
        case="bricard",
        engine="mujoco",
        integrator="RK4",
        group="",
        loop="",
        ties="",
        precision="",
        design_order=None,
        column="best",
        settings={},
        state="crashed",
        folder="a",
    )
    put(tmp_path, "board/board.json", replace(Board.begun(datetime.now().astimezone()), rows=[row]))
    (tmp_path / "board/a").mkdir()
    (tmp_path / "board/a/run.py").write_text("")
    assert main(["site", "--out", str(tmp_path)]) == 1
    text = (tmp_path / "index.html").read_text()
    links = [each for each in re.findall(r'href="([^"#]+)"', text) if not each.startswith("data:")]
    assert len(set(links)) == 5
    assert all((tmp_path / each).is_file() for each in links)
    assert "Simulators &amp; more" in text
    assert [row.split()[0] for row in red(tmp_path)] == ["wobble", "bricard"]


def test_failed_run_is_red(tmp_path):
    wrong = Fake("wobble", off("position", lambda values: values + 1.0), "7.0")
    results = run_case(crank(), Fake("right"), wrong)
    put(tmp_path, "results.json", results)
    assert main(["site", "--out", str(tmp_path)]) == 1
    (row,) = red(tmp_path)
    assert row.split()[:4] == ["wobble", "7.0", "fail", "crank"]


def test_site_without_results_is_refused(tmp_path, capsys):
    (tmp_path / "other.json").write_text('{"schema": "something/1"}')
    assert main(["site", "--out", str(tmp_path)]) == 2
    assert "found no results of kincheck" in capsys.readouterr().err
    (tmp_path / "damaged.json").write_text('{"schema": "kincheck-bisect/1"}')
    assert main(["site", "--out", str(tmp_path)]) == 2
    assert "damaged.json" in capsys.readouterr().err
