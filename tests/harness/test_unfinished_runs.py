"""Runs that ended before all was made, engines that are gone for long: no report says that all is
well.
"""

import os
import re
import shutil
import tempfile
from contextlib import contextmanager
from itertools import islice
from pathlib import Path

import msgspec
import pytest
from kincheck import CaseError, KincheckError, Outcome, Results
from kincheck.core.cli import main
from kincheck.core.harness.execution import solve_in_process
from kincheck.core.harness.record import to_json
from kincheck.core.harness.results_file import read_results
from kincheck.core.history.findings import Kind
from kincheck.core.history.store import HistoryError, Store
from kincheck.core.report.junit import to_junit, to_regression_junit
from kincheck.core.report.regressions import to_markdown
from kincheck.core.report.report import caveats, headline

from ..support.history_runs import (
    FACTS,
    changed,
    history,
    keep,
    kinds,
    nights,
    records,
    report,
    reported,
)
from ..support.printed import junit_tests

GONE = {"outcome": Outcome.UNAVAILABLE, "message": "not installed", "seconds": None, "errors": {}}
UNMADE = "not run: the run ended before this pair"


def killed(path, made, *, owner="a-host-that-is-no-more|1|1"):
    """A run of all pairs that ended by force after so many; with an owner of None, one that goes
    on.
    """
    run = keep(path, records(), status="running")
    with Store(path) as store:
        store.connection.execute(
            "DELETE FROM records WHERE run_id = ? AND rowid > (SELECT max(rowid) FROM records) - ?",
            (run, 4 - made),
        )
        if owner is not None:
            store.connection.execute("UPDATE runs SET owner = ? WHERE id = ?", (owner, run))
    return run


# Runs that were killed


def test_killed_run_is_reported(path, capsys):
    nights(path, 2)
    killed(path, 3)
    found = reported(path)
    assert found.run.name == "run 3, without an end"
    assert [(each.kind, each.case, each.engine, each.message) for each in found.findings] == [
        (Kind.LOST, "second", "mujoco", UNMADE)
    ]
    assert report(path) == 1
    assert (
        "run 3, without an end against run 2 (last green): 1 with something lost"
        in capsys.readouterr().out
    )


def test_running_run_is_not_reported(path):
    nights(path, 2)
    killed(path, 3, owner=None)
    assert reported(path).run.name == "run 2"


def test_killed_run_without_records_is_reported(path):
    nights(path, 1)
    killed(path, 0)
    found = reported(path)
    assert len(found.regressions) == 4
    assert to_markdown(found).startswith(
        "## run 2, without an end: all 0 right, 4 not run; nothing to compare with"
    )


def test_missing_pairs_without_earlier_run(path, capsys):
    killed(path, 1)
    assert report(path) == 1
    assert "all 1 right, 3 not run; nothing to compare with" in capsys.readouterr().out


def test_every_format_names_missing_pairs(path):
    nights(path, 1)
    killed(path, 1)
    with Store(path) as store:
        results = store.results(2)
    assert results.missing == [
        ("first", "mujoco", "projection"),
        ("second", "native", "projection"),
        ("second", "mujoco", "projection"),
    ]
    assert headline(results).endswith("; the run ended before 3 more")
    said = dict(caveats(results))["Not run: 3"]
    assert said.endswith(
        "There are no results for mujoco on first; native on second; mujoco on second."
    )
    for text in (to_junit(results), to_regression_junit(results, reported(path))):
        assert b'name="first" tests="3" failures="0" errors="1"' in text
        assert b'name="second" tests="2" failures="0" errors="2"' in text
        assert [found for name, found in junit_tests(text).items() if "not run" in name] == [
            [("error", UNMADE)]
        ] * 3


def test_file_of_interrupted_run_is_reported(path, tmp_path):
    """What the command writes where it is interrupted."""
    nights(path, 1)
    pairs = [[*each.pair] for each in records()[1:]]
    file = tmp_path / "results.json"
    file.write_bytes(
        to_json(Results(run={**FACTS, "started": "now", "missing": pairs}, records=records()[:1]))
    )
    assert kinds(reported(path, str(file), "1")) == [(Kind.LOST, *pair[:2]) for pair in pairs]
    for key, value in {"missing": [["first", "mujoco"]], "git": "main", "tol": "small"}.items():
        file.write_bytes(to_json(Results(run={**FACTS, key: value}, records=records()[:1])))
        with pytest.raises(CaseError, match=rf"run\.{key}: found"):
            reported(path, str(file), "1")


def test_interrupted_run_lists_missing_pairs(tmp_path, monkeypatch):
    def stopped(pairs):
        yield from islice(solve_in_process(pairs), 1)
        raise KeyboardInterrupt

    monkeypatch.setattr("kincheck.core.cli.shared_options.solver", lambda *_: (stopped, {}))
    file = tmp_path / "results.json"
    assert main.main(f"run rssr bennett --engine native --json {file}".split()) == 130
    assert read_results(file).missing == [("bennett", "native", "projection")]


# Engines that are gone


def test_missing_engine_is_reported_every_night(path):
    nights(path, 2)
    for night in range(3):
        keep(path, changed(changed(records(), **GONE), case="second", **GONE))
        found = reported(path)
        # the pairs that are still there have their own last good run
        each = f"the last good run of each pair (runs 2 to {2 + night})"
        assert found.against.name == ("run 2 (last green)" if night == 0 else each)
        assert {(each.kind, each.engine) for each in found.regressions} == {
            (Kind.LOST, "mujoco")
        }, night
    keep(path, records())
    assert not reported(path).regressed
    keep(path, records())
    assert reported(path).against.name == "run 6 (last green)"


def test_engine_never_installed_is_no_regression(path):
    for _ in range(3):
        keep(path, changed(changed(records(), **GONE), case="second", **GONE))
    found = reported(path)
    assert (found.against.name, found.findings) == ("run 2 (last green)", [])


def test_unknown_branch_lists_known_ones(path):
    nights(path, 2)
    assert (
        reported(path, against="mian-baseline").reason
        == "no earlier run of branch 'mian', without changes to its files, with any of its pairs."
        " The history has branches main"
    )


# Histories that cannot be read whole


@contextmanager
def unwritable(folder):
    """The folder as one in which this process, even the superuser's, can write nothing."""
    folder.chmod(0o555)
    superuser = hasattr(os, "geteuid") and os.geteuid() == 0
    if superuser:
        os.seteuid(65534)
    try:
        yield
    finally:
        if superuser:
            os.seteuid(0)
        folder.chmod(0o755)


@pytest.mark.skipif(os.name != "posix", reason="folders have other permissions there")
@pytest.mark.parametrize("merged", [True, False])
def test_unwritable_history_is_read_whole(path, merged):
    nights(path, 1)
    with tempfile.TemporaryDirectory() as name:
        there = Path(name) / path.name
        with Store(path) as store:
            store.connection.execute("PRAGMA wal_autocheckpoint = 0")
            keep(path, records())
            if merged:
                store.connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            shutil.copy(path, there)
            shutil.copy(f"{path}-wal", f"{there}-wal")
        for file in there.parent.iterdir():
            file.chmod(0o444)
        with unwritable(there.parent):
            if merged:
                with Store(there, writable=False) as store:
                    assert len(store.runs()) == 2
            else:
                with pytest.raises(
                    HistoryError,
                    match=(
                        r"its latest records are still in history.sqlite-wal, .* Copy both files"
                        " to a writable folder.$"
                    ),
                ):
                    Store(there, writable=False)


def test_report_of_empty_history(path):
    Store(path).close()
    with pytest.raises(KincheckError, match=r"no run to report\. `kincheck run --history"):
        reported(path)


def test_step_has_unit_of_output(path, capsys):
    facts = {"first": {"outputs": {"x": {"unit": "deg"}}}}
    nights(path, 2)
    grown = {"errors": lambda errors: errors | {"x": _grown(errors["x"])}}
    keep(path, changed(records(), **grown), cases=facts)
    assert history(path, "--case", "first") == 0
    assert " → 1e-10 °/s² since run 3" in capsys.readouterr().out


def test_trend_is_in_units_of_file(path, capsys):
    units = {"length": "mm", "angle": "deg"}
    facts = {"first": {"outputs": {"x": {"unit": "m"}, "y": {"unit": "rad"}}, "units": units}}
    nights(path, 1)
    shifted = {"errors": lambda errors: errors | {"x": _grown(errors["x"])}}
    keep(path, changed(records(), **shifted), cases=facts)
    assert history(path, "--case", "first") == 0
    said = capsys.readouterr().out
    assert re.search(r"outcome +mm +mm/s +mm/s² +° +°/s +°/s² +us/step", said)
    assert re.search(r"#1 .*pass +5e-10 ", said)  # of before
    assert re.search(r"#2 .*pass +5e-10 +0 +1e-7 ", said)


def _grown(deviations):
    return msgspec.structs.replace(
        deviations, acceleration=msgspec.structs.replace(deviations.acceleration, max_abs=1e-10)
    )
