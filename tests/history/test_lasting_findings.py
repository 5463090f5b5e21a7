"""Reports over many nights: what stays wrong is told every night, what grows slowly is told, and
nothing is made up.
"""

import os
from pathlib import Path

import pytest
from kincheck import Outcome
from kincheck.core.case.io.atomic_files import written
from kincheck.core.harness.record import to_json
from kincheck.core.history.findings import Kind
from kincheck.core.history.runs import find, find_against
from kincheck.core.history.runs import keep as begin
from kincheck.core.history.store import Store
from msgspec.structs import replace

from ..harness.test_unfinished_runs import killed
from ..support.fakes import Fake, crank
from ..support.history_runs import (
    FIRST,
    changed,
    history,
    keep,
    keep_changed,
    nights,
    records,
    report,
    reported,
    worse,
)


def held_to(factor):
    """A change of errors: all tolerances grow."""

    def one(deviation):
        return deviation and replace(deviation, tolerance=factor * deviation.tolerance)

    def change(errors):
        return {
            output: replace(each, **{motion: one(deviation) for motion, deviation in each.items()})
            for output, each in errors.items()
        }

    return {"errors": change}


def without(motion):
    """A change of errors: a motion is not compared any more."""
    return {
        "errors": lambda errors: {
            output: replace(each, **{motion: None}) for output, each in errors.items()
        }
    }


def told(found):
    return {(each.kind, each.case, each.engine) for each in found.regressions}


def test_changed_tolerance_is_no_step(path):
    """Errors far below the floor, and a tolerance that makes the floor higher than they ever
    were.
    """
    tiny = worse(1e-4)
    for _ in range(3):
        keep_changed(path, **tiny)
    grown = changed(changed(records(), **tiny), **held_to(1e4))
    keep(path, grown)
    found = reported(path)
    assert (found.steps, found.regressions) == ([], [])
    assert {each.kind for each in found.findings} == {Kind.TOLERANCE}
    assert {each.since for each in found.findings} == {None}


def test_results_file_is_found_in_history(path, tmp_path):
    nights(path, 1)
    keep_changed(path, **worse(450.0))
    nights(path, 1)
    with Store(path) as store:
        file = tmp_path / "results.json"
        file.write_bytes(to_json(store.results(2)))
        subject = find(str(file), store)
        assert (subject.number, find_against("last-green", subject, store)[0].number) == (2, 1)
        other = replace(store.results(2), run=store.results(2).run | {"host": "elsewhere"})
        file.write_bytes(to_json(other))
        # of another machine, and begun when run 2 was: run 3 is later
        subject = find(str(file), store)
        assert (subject.number, subject.before) == (None, 3)
    assert told(reported(path, str(file), "1")) == {(Kind.DRIFTED, *FIRST)}


@pytest.mark.parametrize(
    "gone",
    [
        *(
            pytest.param(
                {"outcome": outcome, "errors": {}, "solved": None, "seconds": None},
                marks=pytest.mark.nightly,
                id=outcome.value,
            )
            for outcome in (Outcome.UNAVAILABLE, Outcome.UNSUPPORTED)
        ),
        pytest.param(without("acceleration"), id="acceleration"),
    ],
)
def test_lost_results_stay_reported(path, gone):
    nights(path, 1)
    for _ in range(62):
        keep_changed(path, **gone)
    for run in ("2", "3", "63"):
        found = reported(path, run)
        assert told(found) == {(Kind.LOST, *FIRST)}
        assert {(each.against, each.since) for each in found.regressions} == {(1, 2)}


def test_removed_output_stays_until_accepted(path):
    nights(path, 1)
    fewer = {
        "errors": lambda errors: {"x": errors["x"]},
        "outputs": lambda outputs: {"x": outputs["x"]},
    }
    for _ in range(2):
        keep_changed(path, **fewer)
    assert told(reported(path, "2")) == {(Kind.LOST, *FIRST)}
    assert told(reported(path, "3")) == {(Kind.LOST, *FIRST)}
    assert history(path, "--accept", "first:mujoco", "--reason", "y is of no use") == 0
    assert told(reported(path, "3")) == set()


def test_partial_runs_hide_no_drift(path):
    nights(path, 1)
    for _ in range(62):
        keep(path, [each for each in records() if each.case == "second"])
    keep_changed(path, **worse(450.0))
    assert told(reported(path)) == {(Kind.DRIFTED, *FIRST)}


def test_slow_drift_is_reported(path):
    for night in range(4):
        keep_changed(path, **worse(5.0**night))
    assert told(reported(path, "2")) == set()
    for run in ("3", "4"):
        found = reported(path, run)
        assert told(found) == {(Kind.DRIFTED, *FIRST)}
        assert "gradually since run 1" in found.regressions[0].message
    (finding,) = found.regressions
    assert finding.now == pytest.approx(125.0 * finding.before)


def test_step_stays_until_repaired(path):
    nights(path, 3)
    for _ in range(3):
        keep_changed(path, **worse(100.0))
    assert [told(reported(path, run)) for run in ("4", "5", "6")] == [
        {(Kind.DRIFTED, *FIRST)},
        {(Kind.DRIFTED, *FIRST)},
        {(Kind.DRIFTED, *FIRST)},
    ]
    assert [(step.first, step.last) for step in reported(path).steps] == [(4, 3)]
    assert [(each.since, each.against) for each in reported(path).regressions] == [(4, 3)]
    nights(path, 1)
    assert told(reported(path)) == set()


def test_widened_tolerance_keeps_step(path):
    for factor, wide in ((1.0, 1.0), (1.0, 1.0), (100.0, 1.0), (100.0, 1e4)):
        keep(path, changed(changed(records(), **worse(factor)), **held_to(wide)))
    assert [(step.first, step.now / step.before) for step in reported(path).steps] == [
        (3, pytest.approx(100.0))
    ]


def test_first_bad_run_may_be_killed(path, capsys):
    nights(path, 2)
    bad = changed(records(), outcome=Outcome.FAIL)
    run = keep(path, bad, status="running")
    with Store(path) as store:
        store.connection.execute(
            "UPDATE runs SET owner = 'a-host-that-is-no-more|1|1' WHERE id = ?", (run,)
        )
    keep(path, bad)
    (finding,) = reported(path).regressions
    assert finding.since == run
    assert history(path) == 0
    assert " killed " in capsys.readouterr().out
    export = path.with_suffix(".csv")
    assert history(path, "--export", export) == 0
    assert ",killed," in export.read_text("utf-8")


def test_report_refuses_running_run(path, capsys):
    nights(path, 1)
    killed(path, 3, owner=None)
    assert report(path, "2") == 2
    assert "run 2 is still running. Report it when it has ended" in capsys.readouterr().err


def test_killed_run_page_names_missing_pairs(path, tmp_path):
    case, engines = crank("first"), [Fake("native"), Fake("mujoco")]
    kept = begin(
        path,
        [case, crank("second")],
        engines,
        tol=1e-12,
        command="kincheck run",
        settings={},
        resume=False,
    )
    kept.add(next(each for each in records() if (each.case, each.engine) == ("first", "native")))
    kept.store.connection.execute("UPDATE runs SET owner = 'a-host-that-is-no-more|1|1'")
    kept.store.close()
    with Store(path, writable=False) as store:
        assert store.results(1).references["first"].keys() == case.reference.keys()
    assert report(path, "--out", tmp_path) == 1
    page = (tmp_path / "report.html").read_text("utf-8")
    assert "not run" in page
    assert "not requested" not in page
    assert "Lost (3)" in page  # in two rows


def test_changed_edits_are_reported(path):
    git = {"commit": "ab" * 20, "branch": "main", "changed": True}
    for edits in ("one", "two"):
        keep(path, records(), git=git | {"edits": edits})
    assert [str(change) for change in reported(path).changes] == ["uncommitted edits one → two"]


def test_zero_errors_have_loose_tolerance(path):
    for _ in range(10):
        keep_changed(path, **worse(0.0))
    (loose,) = [each for each in reported(path).loose if each.largest == 0.0]
    assert (loose.case, loose.output, loose.factor) == ("first", "x", None)


def test_failed_write_keeps_old_file(tmp_path):
    def half(path):
        path.write_text("half of it")
        raise OSError(28, "No space left on device")

    file = tmp_path / "report.html"
    file.write_text("yesterday's")
    assert written(file, half) == [
        f"{file}: cannot be written (No space left on device); what else was asked for is tried"
    ]
    assert (file.read_text(), [*tmp_path.iterdir()]) == ("yesterday's", [file])
    link = tmp_path / "latest.html"
    link.symlink_to(file)
    assert written(link, lambda path: path.write_text("today's")) == []
    assert (link.is_symlink(), file.read_text()) == (True, "today's")
    assert written(Path(os.devnull), lambda path: path.write_text("nowhere")) == []
    assert not Path(os.devnull).is_file()
