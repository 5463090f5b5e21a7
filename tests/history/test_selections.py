"""What a report judges: the latest run of the same selection, red until the same thing is green."""

import pytest
from kincheck import Outcome
from kincheck.core.harness.results_file import read_results
from kincheck.core.history.store import Store

from ..support.examples import examples
from ..support.fakes import Fake, crank, off
from ..support.history_runs import changed, keep, records, reported, worse

(AGAIN,) = examples(__file__, "again")

# untimed: a busy machine is slower, which a report names too
RIGHT = Fake("native", untimed=True)
WRONG = Fake("native", answer=off("position", lambda p: p + 1.0), untimed=True)
NIGHT, OTHER = ("crank",), ("crank_two",)
FILE = """
schema = "kincheck-case/1"
name = "swing"
source = "made up for this test"
truth = "closed_form"
bodies.arm = {}
joints.pivot = {type = "revolute", bodies = ["ground", "arm"], point = [0, 0, 0], axis = [0, 0, 1]}
points.tip = {body = "arm", position = [0.5, 0, 0]}
drivers.angle = {type = "joint_angle", joint = "pivot"}
sweep = {driver = "angle", start = 0, stop = 1, steps = 2}
reference = {columns = ["angle", "tip.x"], rows = [[0.0, 0.5]], citation = "a circle's radius"}
"""


@pytest.fixture
def run(kincheck_main, tmp_path):
    """A run of these cases with these options, right or wrong, in a history."""

    def run(*argv, right=True, **how):
        argv = ("run", *argv, "--history", str(tmp_path / "kept"))
        return kincheck_main(*argv, engines=[RIGHT if right else WRONG], **how)

    return run


@pytest.fixture
def report(kincheck_main, tmp_path, capsys):
    """The status of a report, and what it says."""

    def report():
        capsys.readouterr()
        status = kincheck_main("report --history", str(tmp_path / "kept"))
        return status, capsys.readouterr().out

    return report


@pytest.mark.parametrize("nights", [1, 3])
def test_unlike_selection_repairs_nothing(run, report, nights):
    for _ in range(nights - 1):
        run(*NIGHT)
    run(*NIGHT, right=False)
    run(*OTHER)
    status, said = report()
    assert status == 1
    assert said.startswith(f"## run {nights}")
    assert f"Not judged: run {nights + 1}, of another selection" in said
    run(*NIGHT)
    assert report()[0] == 0


def test_unlike_selection_breaks_nothing(run, report):
    run(*NIGHT)
    run(*OTHER, right=False)
    assert report()[0] == 0
    run(*OTHER, right=False)  # a second time: it is run every night, too
    assert report()[0] == 1
    run(*NIGHT)
    assert report()[0] == 1
    run(*OTHER)
    assert report()[0] == 0


@pytest.mark.by_day(2)
@pytest.mark.parametrize(
    ("again", "status"),
    AGAIN.values(),
    ids=AGAIN,
)
def test_same_selection_repairs_run(run, report, monkeypatch, tmp_path, again, status):
    monkeypatch.chdir(tmp_path)
    run(*NIGHT)
    run(*NIGHT, right=False)
    run(*again)
    assert report()[0] == status


def test_run_with_mistyped_case_is_unstored(run, report, capsys, tmp_path):
    run(*NIGHT)
    for mistyped in (("crnk",), (*NIGHT, "crnk", "--out", str(tmp_path / "out")), ("crnk*",)):
        assert run(*mistyped) == 2
        assert "no such case; the run is not in the history" in capsys.readouterr().err
    assert len(read_results(tmp_path / "out" / "results.json").records) == 1
    assert report()[0] == 0
    with Store(tmp_path / "kept", writable=False) as store:
        assert [row.plan for row in store.runs()] == [[("crank", "native", "projection")]]


def test_undecodable_names_are_stored(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run(*NIGHT, "--reference", "\udcff.csv")
    (tmp_path / "\udcff.toml").write_text("no case")
    assert run("\udcff.toml", *NIGHT) == 2
    with Store(tmp_path / "kept", writable=False) as store:
        (row,) = store.runs()
    assert row.circumstances["selection"]["cases"] == ["?.toml", "crank"]


def test_run_without_readable_case_is_unstored(run, report, capsys, tmp_path):
    (tmp_path / "broken.toml").write_text("no case")
    run(*NIGHT)
    for _ in range(2):
        assert run(str(tmp_path / "broken.toml")) == 2
        assert "no case could be read; the run is not in the history" in capsys.readouterr().err
    assert report()[0] == 0


@pytest.mark.parametrize(
    ("again", "status"), [("b/swing.toml", 1), ("./a/swing.toml", 0)], ids=["other", "same"]
)
def test_same_name_in_folders(run, report, monkeypatch, tmp_path, again, status):
    monkeypatch.chdir(tmp_path)
    for folder in "ab":
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "swing.toml").write_text(FILE)
    run("a/swing.toml")
    run("a/swing.toml", right=False)
    run(again)
    assert report()[0] == status


@pytest.mark.parametrize(
    "more",
    [
        pytest.param(("--static",), id="static"),
        pytest.param(
            ("--engine-command", "true {case} {samples} {out}"),
            id="engine command",
            marks=pytest.mark.needs("recorded"),
        ),
    ],
)
def test_task_options_change_selection(run, tmp_path, more):
    run(*NIGHT)
    run(*NIGHT, *more)
    with Store(tmp_path / "kept", writable=False) as store:
        first, second = (row.key["selection"]["options"] for row in store.runs())
    assert first != second


def test_mistyped_case_makes_no_history(run, tmp_path):
    assert run("crnk") == 2
    assert not (tmp_path / "kept").exists()


def test_unreadable_case_is_regression(run, report):
    run(*NIGHT, *OTHER)
    assert run(*NIGHT, *OTHER, cases={"crank": crank()}) == 2
    status, said = report()
    assert status == 1
    assert said.startswith("## run 2 against run 1 (last green): 1 case could not be read")


def test_old_run_needs_all_pairs_repaired(path):
    keep(path, records()[:2])
    keep(path, changed(records(), outcome=Outcome.FAIL)[:2])
    keep(path, records()[2:], command="kincheck run second")
    assert reported(path).run.number == 2
    keep(path, records(), selection={"cases": [], "engines": [], "options": {}})
    assert reported(path).run.number == 4


def test_runs_with_changed_options_are_ignored(path):
    night = {"cases": ["first"], "engines": [], "options": {"run": {"tol": 1e-12}}}
    coarse = night | {"options": {"run": {"tol": 1e-3}}}
    for selection in (night, night, night, coarse, night):
        errors = worse(100.0) if selection is coarse else {}
        keep(path, changed(records(), **errors), selection=selection)
    found = reported(path)
    assert (found.against.number, found.findings, found.steps) == (3, [], [])


def test_failed_run_counts_sixty_runs(path):
    keep(path, changed(records(), outcome=Outcome.FAIL), command="kincheck run once")
    for _ in range(59):
        keep(path, records()[:2])
    assert reported(path).run.number == 1
    keep(path, records()[:2])
    assert reported(path).run.number == 61


def test_history_lists_run_without_records(path, kincheck_main, capsys):
    keep(path, [])
    with Store(path) as store:
        facts = {"started": "2026-11-02T03:00", "command": "kincheck run"}
        store.begin_run("none", [("a", "b", "projection")], facts)
    assert kincheck_main("history --history", str(path)) == 0
    found = [line.split()[4:6] for line in capsys.readouterr().out.splitlines()[1:]]
    assert found == [["1", "missing"], ["–", "–"]]
