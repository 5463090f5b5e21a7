"""The matrix of cases and engines, on the terminal and as Markdown, and that of all joint types in
the documentation.
"""

import re
from pathlib import Path

import pytest
from kincheck import Joint, Results
from kincheck.core.joints import Coupler
from kincheck.core.report.table import print_matrix

from ..support.fakes import Fake, crank, off, raising
from ..support.printed import Terminal
from ..support.strut_results import GRID, record

ENGINES_PAGE = Path(__file__).parents[2] / "docs" / "pages" / "reference" / "engines.md"
BUILT_IN = [
    name
    for registry in (Joint.registry, Coupler.registry)
    for name, each in registry.items()
    if each.__module__.startswith("kincheck.")
]


@pytest.fixture
def run(kincheck_main, tmp_path, capsys):
    """Runs the command line with fake engines; (exit status, what it printed, the Markdown it
    wrote).
    """

    def run(*argv, engines, case):
        file = tmp_path / "matrix.md"
        cases = {case.name: case}
        status = kincheck_main("run", *argv, "--markdown", file, engines=engines, cases=cases)
        return status, capsys.readouterr().out, file.read_text("utf-8")

    return run


ENGINES = (
    Fake("native"),
    Fake("close", answer=off("velocity", lambda v: v + 3e-11)),
    Fake("wrong", answer=off("position", lambda p: p + 2e-3)),
    Fake("unable", refusal="joint 'pivot' (revolute) has no | counterpart"),
    Fake("broken", answer=raising(ValueError("no [axis] there"))),
    Fake("missing", installed=None),
)


def test_matrix_cells_have_errors_or_reasons(run):
    status, _, markdown = run(engines=ENGINES, case=crank(reference=False))
    assert status == 1
    head, _, row = (
        [cell.strip() for cell in line.split("|")[1:-1]] for line in markdown.splitlines()[:3]
    )
    assert head == ["", *(f"{each.name} {each.installed or ''}".strip() for each in ENGINES)]
    assert row == [
        "`crank`",
        "not judged, residual 1e-15",
        "0e+00 · 3e-11 · 0e+00",
        "fail: 2e-03 · 0e+00 · 0e+00",
        "unsupported",
        "error",
        "unavailable",
    ]
    assert "against native: position [m]" in markdown
    assert (
        r"Unsupported: crank in unable: joint 'pivot' (revolute) has no \| counterpart." in markdown
    )
    assert "no [axis] there" in markdown


def test_run_joints_prints_matrix(run):
    """A fake engine has no such points, so every cell is an error; what counts here is which cells
    there are.
    """
    _, printed, markdown = run("--joints", engines=[Fake("native"), Fake("other")], case=crank())
    found = re.findall(r"^\| `(\w+)` \|", markdown, re.MULTILINE)
    assert sorted(found) == sorted([*Joint.registry, *Coupler.registry])
    lines = [line.split() for line in printed.splitlines()]
    assert lines[0] == ["case", "native", "other"]
    assert [line[0] for line in lines[1 : len(found) + 1]] == found


def test_narrow_matrix_is_split_by_engines(monkeypatch):
    names = ("native", "mujoco", "pinocchio", "exudyn", "drake", "dart", "simbody", "my_engine")
    records = [
        record(case, "closed_form", name, 1e-12, GRID)
        for case in ("one", "with_a_longer_name")
        for name in names
    ]
    monkeypatch.setenv("COLUMNS", "100")
    screen = Terminal()
    print_matrix(Results(run={}, records=records), screen)
    lines = re.sub(r"\x1b\[[0-9;]*m", "", screen.getvalue()).splitlines()
    assert max(map(len, lines)) <= 100
    assert "…" not in screen.getvalue()
    heads = [line.split()[1:] for line in lines if line.startswith("case ")]
    assert len(heads) > 1
    assert [name for head in heads for name in head] == [*names]
    assert sum(line.startswith("with_a_longer_name ") for line in lines) == len(heads)


def test_matrix_without_comparison(run):
    _, _, markdown = run(engines=[Fake("native")], case=crank(reference=False))
    assert "No errors: nothing was compared with anything" in markdown
    assert "Largest errors" not in markdown


def test_run_joints_with_case(run):
    _, _, markdown = run("--joints", "crank", engines=[Fake("native")], case=crank())
    assert "| `crank` |" in markdown
    assert "| `revolute` |" in markdown


def test_documentation_lists_joint_types():
    """`kincheck run --joints --markdown FILE` makes the table anew."""
    if not ENGINES_PAGE.exists():
        pytest.skip("the documentation is not here")
    text = ENGINES_PAGE.read_text("utf-8")
    found = re.search(r"<!-- joints:begin -->(.*)<!-- joints:end -->", text, re.DOTALL)
    rows = re.findall(r"^\| `(\w+)` \|(.*)$", found[1], re.MULTILINE)
    assert sorted(name for name, _ in rows) == sorted(BUILT_IN)
    assert [name for name, cells in rows if "fail" in cells or "error" in cells] == []
