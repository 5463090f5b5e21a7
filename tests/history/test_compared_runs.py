"""Rules for the run to compare with, and files without a history."""

import msgspec
import pytest
from kincheck.core.cli import main
from kincheck.core.errors import KincheckError
from kincheck.core.harness.record import Outcome, Results, to_json

from ..support.nights import changed, keep, records, reported, times


def test_rules_find_the_run_to_compare_with(path):
    keep(path, records())
    keep(path, records(), git={"commit": "b" * 40, "branch": "topic", "changed": False})
    keep(path, records(), status="interrupted")
    keep(path, changed(records(), outcome=Outcome.FAIL))
    keep(path, records(), git={"commit": "c" * 40, "branch": "main", "changed": True})
    keep(path, [msgspec.structs.replace(each, case="other") for each in records()])
    keep(path, records())
    assert reported(path).against.name == "run 5 (last green)"
    assert reported(path, against="topic-baseline").against.name == "run 2 (topic baseline)"
    assert reported(path, against="main-baseline").against.name == "run 4 (main baseline)"
    assert reported(path, against="3").against.name == "run 3, interrupted"
    assert reported(path, run="2").against.number == 1
    nothing = reported(path, run="4", against="none-baseline")
    assert nothing.against is None
    assert nothing.regressed  # it has a failure, and nothing to excuse it
    with pytest.raises(KincheckError, match="run 7 cannot be compared with itself"):
        reported(path, against="7")
    with pytest.raises(KincheckError, match="there is no run 8"):
        reported(path, against="8")
    with pytest.raises(
        KincheckError,
        match=(
            r"there is no run 'green'. Give a number of the history, a results.json, last-green or"
        ),
    ):
        reported(path, against="green")


def test_files_can_be_compared_without_a_history(tmp_path, capsys, monkeypatch):
    monkeypatch.delenv("KINCHECK_HISTORY", raising=False)
    facts = {
        "host": "a-host",
        "processor": "a processor",
        "started": "now",
        "calibration_seconds": 0.02,
    }
    for name, made in {
        "before.json": records(),
        "now.json": changed(records(), **times(2.0)),
    }.items():
        (tmp_path / name).write_bytes(to_json(Results(run=facts, records=made)))
    before, now = str(tmp_path / "before.json"), str(tmp_path / "now.json")
    assert main.main(["report", now, "--against", before]) == 1
    assert (
        "10 → 20 ms a sweep (×2; by the spread from run to run, ×1.75 may be chance)"
        in capsys.readouterr().out
    )
    assert main.main(["report", before, "--against", now]) == 0
    assert main.main(["report", before]) == 0
    assert (
        "nothing to compare with: last-green needs a history, and none is given"
        in capsys.readouterr().out
    )
    assert main.main(["report"]) == 2
    assert (
        "no run without a history. Give --history FILE, or a results.json"
        in capsys.readouterr().err
    )
