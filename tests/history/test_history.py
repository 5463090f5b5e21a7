"""Histories, their exports and compared runs."""

import csv
import json
import math
import shutil
import sqlite3
import sys
import zlib
from base64 import b64decode
from pathlib import Path

import pytest
from kincheck import KincheckError, Outcome, Results
from kincheck.core.cli.main import main
from kincheck.core.harness.record import to_json
from kincheck.core.history.queries import NUMBERS, export, faultless, read
from kincheck.core.history.store import HistoryError, Store
from kincheck.core.report.figures import Past, trend_figures
from kincheck.core.report.trends import trends
from msgspec.structs import replace

from ..support.history_runs import (
    changed,
    history,
    keep,
    keep_changed,
    nights,
    records,
    reported,
    times,
)

FIRST_SCHEMA = Path(__file__).parents[1] / "data" / "history_1.sqlite"
"""Two runs of a crank in three and four engines, made by schema 1."""


# Files of another time


def test_first_schema_file_is_migrated(path):
    old = sqlite3.connect(FIRST_SCHEMA)
    assert old.execute("PRAGMA user_version").fetchone() == (1,)
    before = {
        name: old.execute(f"SELECT * FROM {name}").fetchall()
        for name in ("runs", "records", "documents", "attachments")
    }
    old.close()
    assert [len(rows) for rows in before.values()] == [2, 7, 1, 2]
    shutil.copy(FIRST_SCHEMA, path)
    with Store(path, writable=False) as store:
        for name, rows in before.items():
            found = store.connection.execute(f"SELECT * FROM {name}").fetchall()
            assert [row[: len(rows[0])] for row in found] == rows
        results = store.results(2)
        assert [(each.engine, each.outcome.value) for each in results.records] == [
            ("native", "pass"),
            ("wrong", "fail"),
            ("partial", "fail"),
        ]
        assert results.records[1].seconds.waited is None
        assert results.references["crank"]["x"].unit == "m"
        assert read(store).pairs["crank", "native", "projection"][0].seconds > 0
        assert store.connection.execute(
            "SELECT count(*), max(max_abs) > 0 FROM measured WHERE run = 2"
        ).fetchone() == (18, 1)


def test_migrated_history_takes_runs(path):
    shutil.copy(FIRST_SCHEMA, path)
    assert keep(path, records()) == 3
    with Store(path) as store:
        assert store.records(3) == records()
        assert store.connection.execute(
            "SELECT count(waited_seconds), count(*) FROM records"
        ).fetchone() == (4, 11)


def test_later_schema_is_refused(path, capsys):
    nights(path, 1)
    with Store(path) as store:
        store.connection.execute("PRAGMA user_version = 99")
    for command in ("history", "report"):
        assert main([command, "--history", str(path)]) == 2
        assert "its schema is version 99, this kincheck knows" in capsys.readouterr().err


# Lists


def test_history_lists_latest_run_first(path, capsys):
    nights(path, 2)
    keep(
        path,
        changed(records(), outcome=Outcome.CRASHED),
        status="running",
        git={"commit": "abcdef" * 7, "changed": True},
    )
    assert history(path) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["run", "3", "2", "1"]
    assert "3 pass, 1 crashed" in lines[1]
    assert "abcdefabcd+" in lines[1]
    assert "native 1.2, mujoco 4.0.0" in lines[2]
    assert history(path, "--last", 1) == 0
    assert len(capsys.readouterr().out.splitlines()) == 2


def test_trends_of_pair_with_steps(path, capsys):
    nights(path, 6)
    for _ in range(3):
        keep(path, changed(records(), **times(4.0)), numpy="2.1.0")
    assert history(path, "--case", "first", "--engine", "mujoco") == 0
    out = capsys.readouterr().out
    assert out.splitlines()[0].strip() == "first · mujoco"
    assert " ".join(out.split()).startswith(
        "first · mujoco error error error run version outcome m m/s m/s² us/step"
    )
    assert "2026-11-09 03:00 #9  4.0.0    pass     5e-13 " in out
    assert "worse: first · mujoco: time: " in out
    assert "since run 7 (2026-11-07 03:00); after run 6: numpy 2.0.0 → 2.1.0, commit" in out
    assert "second" not in out


def test_history_refuses_unknown_names_and_files(path, capsys, monkeypatch):
    monkeypatch.delenv("KINCHECK_HISTORY", raising=False)
    assert main(["history"]) == 2
    assert "no file is given. Give --history FILE, or set KINCHECK_HIST" in capsys.readouterr().err
    assert history(path) == 2
    assert "there is no such file" in capsys.readouterr().err
    nights(path, 1)
    assert history(path, "--case", "frist") == 2
    assert "there is no case 'frist'; did you mean 'first'?" in capsys.readouterr().err
    monkeypatch.setenv("KINCHECK_HISTORY", str(path))
    assert main(["history"]) == 0


def test_green_runs_have_passes_only(path):
    nights(path, 1)
    keep_changed(path, outcome=Outcome.TIMEOUT)
    keep_changed(path, outcome=Outcome.UNSUPPORTED)
    keep(path, [replace(each, outcome=Outcome.UNAVAILABLE) for each in records()])
    keep(path, records(), status="interrupted")
    with Store(path) as store:
        assert faultless(store, store.runs()) == {1, 3}


# Plots


def drawn(page):
    """The figures of a page, by name."""
    packed = page.read_text().split('id="report-data">')[1].split("<")[0]
    return json.loads(zlib.decompress(b64decode(packed)))["figures"]


def test_plot_has_numbers_of_history(path, tmp_path):
    nights(path, 4)
    page = tmp_path / "trends.html"
    assert history(path, "--engine", "mujoco", "--plot", page) == 0
    text = page.read_text()
    assert "http://" not in text.replace("http://www.w3.org/2000/svg", "")
    figures = drawn(page)
    assert [*figures] == [
        f"{what}-{case}"
        for case in (1, 2)
        for what in ("position-error", "velocity-error", "acceleration-error", "time")
    ]
    with Store(path) as store:
        past = trends(read(store))["first"]
    mine = [each for each in past if each.engine == "mujoco"]
    assert (
        figures["position-error-1"]["data"][0]["y"]
        == [each.errors["position"] for each in mine]
        == pytest.approx([5e-13 / 1e-9] * 4, rel=1e-3)
    )
    assert figures["time-1"]["data"][0]["y"] == [each.us_per_step for each in mine]
    assert figures["time-1"]["data"][0]["x"] == [each.run for each in mine]
    assert mine[0].run == "2026-11-01 03:00 #1"


def test_plot_marks_velocity_fault(path, tmp_path):
    """Whose positions are as before: with its step, and the version that came with it."""
    for night in range(1, 9):
        made = records()
        if night >= 4:
            fault = {"max_abs": 3e-6, "within": False}
            errors = made[1].errors["x"]
            errors = replace(errors, velocity=replace(errors.velocity, **fault))
            what = {"outcome": Outcome.FAIL, "version": "4.1.0"}
            made = changed(made, errors={**made[1].errors, "x": errors}, **what)
        if night == 6:
            gone = {"outcome": Outcome.TIMEOUT, "errors": {}, "us_per_step": None}
            made = changed(made, case="second", **gone)
        keep(path, made)
    page = tmp_path / "trends.html"
    assert history(path, "--plot", page) == 0
    figures = drawn(page)

    def failed(figure):
        return [
            (run[-2:], y)
            for trace in figures[figure]["data"]
            if trace["uid"] == "failed"
            for run, y in zip(trace["x"], trace["y"], strict=True)
        ]

    velocity = next(e for e in records()[1].errors["x"].items() if e[0] == "velocity")[1]
    assert failed("velocity-error-1") == [
        (f"#{night}", pytest.approx(3e-6 / velocity.tolerance)) for night in range(4, 9)
    ]
    assert failed("position-error-1") == failed("acceleration-error-1") == []
    assert failed("position-error-2") == [("#6", 1.0)]  # no error tells a timeout
    upright = [each for each in figures["velocity-error-1"]["layout"]["shapes"] if "yref" in each]
    assert {each["x0"][-2:] for each in upright} == {"#4"}
    assert {each["line"]["dash"] for each in upright} == {"dash", "dot"}
    text = page.read_text()
    assert "mujoco: version 4.0.0 → 4.1.0 since 2026-11-04 03:00 #4" in text
    assert "mujoco: x velocity error: 0 → 3e-6 m/s since run 4" in text


def test_zero_errors_are_drawn_on_floor(path, tmp_path):
    nights(path, 1)
    page = tmp_path / "trends.html"
    history(path, "--engine", "native", "--plot", page)
    figure = drawn(page)["position-error-1"]
    assert figure["data"][0]["y"] == [0.0]
    assert figure["layout"]["meta"]["floor"] > 0.0


def test_waiting_time_is_subtracted(path):
    made = [replace(each, seconds=replace(each.seconds, waited=0.004)) for each in records()]
    keep(path, made)
    with Store(path) as store:
        (entry,) = read(store).pairs["first", "mujoco", "projection"]
    assert math.isclose(entry.seconds, 0.006)


def test_quantities_without_values_are_not_drawn(path, tmp_path):
    def past(error, time):
        return [
            Past(run, "native", {} if error is None else {"velocity": error}, time)
            for run in ("1", "2")
        ]

    assert [*trend_figures(past(None, 2.0), {})] == ["time"]
    assert [*trend_figures(past(0.0, None), {})] == ["velocity-error"]
    assert trend_figures(past(None, None), {}) == {}
    keep(path, [replace(each, errors={}, us_per_step=None) for each in records()])
    assert history(path, "--plot", tmp_path / "trends.html") == 0
    text = (tmp_path / "trends.html").read_text()
    assert "1 run, oldest first" in text
    assert text.count("No engine has solved it in these runs.") == 2
    assert "data-figure" not in text.partition("<script")[0]


def test_time_axis_spans_decade():
    """Else a tenth looks like a step; a decade or more is drawn as it is."""
    for factor, spread, ticks in ((1.1, 1.0, "D2"), (20.0, None, "D2"), (2000.0, None, 1)):
        past = [
            Past(run=str(k), engine="native", errors={}, us_per_step=time)
            for k, time in enumerate((2.0, 2.0 * factor))
        ]
        axis = trend_figures(past, {})["time"]["layout"]["yaxis"]
        assert axis["dtick"] == ticks  # 1, 2 and 5 of a few decades
        if spread is None:
            assert "range" not in axis
        else:
            low, high = axis["range"]
            assert high - low == pytest.approx(spread)
            assert low < math.log10(2.0) < math.log10(2.2) < high


# Rules for the run to compare with, and files without a history


def test_baseline_rules(path):
    keep(path, records())
    keep(path, records(), git={"commit": "b" * 40, "branch": "topic", "changed": False})
    keep(path, records(), status="interrupted")
    keep_changed(path, outcome=Outcome.FAIL)
    keep(path, records(), git={"commit": "c" * 40, "branch": "main", "changed": True})
    keep(path, [replace(each, case="other") for each in records()])
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


def test_report_compares_files_without_history(tmp_path, capsys, monkeypatch):
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
    assert main(["report", now, "--against", before]) == 1
    assert (
        "10 → 20 ms a sweep (×2: by the spread from run to run, ×1.75 may be chance)"
        in capsys.readouterr().out
    )
    assert main(["report", before, "--against", now]) == 0
    assert main(["report", before]) == 0
    assert (
        "nothing to compare with: last-green needs a history, and none is given"
        in capsys.readouterr().out
    )
    assert main(["report"]) == 2
    assert (
        "no run without a history. Give --history FILE, or a results.json"
        in capsys.readouterr().err
    )


# Exports of a history hold every number


def exported(path, file):
    assert history(path, "--export", file) == 0
    if file.suffix == ".csv":
        with file.open(encoding="utf-8", newline="") as lines:
            return list(csv.DictReader(lines))
    return pytest.importorskip("pyarrow.parquet").read_table(file).to_pylist()


def test_exports_hold_every_number(path, tmp_path):
    nights(path, 2)
    keep(
        path,
        changed(records(), outcome=Outcome.UNAVAILABLE, errors={}, seconds=None, version=None),
        git=None,
    )
    table, text = exported(path, tmp_path / "all.parquet"), exported(path, tmp_path / "all.csv")
    # two runs of 4 pairs, 2 outputs, 3 motions, and one in which a pair has nothing but its outcome
    assert len(table) == len(text) == 2 * 24 + 18 + 3
    for typed, plain in zip(table, text, strict=True):
        for name, value in typed.items():
            assert plain[name] == (
                ""
                if value is None
                else str(value).lower()
                if isinstance(value, bool)
                else str(value)
            )
            assert isinstance(value, float | None) is (name in NUMBERS) or value is None
    expected = records()[1].errors["x"].velocity
    row = next(
        row
        for row in table
        if (row["run"], row["engine"], row["output"], row["motion"])
        == (1, "mujoco", "x", "velocity")
    )
    assert (row["max_abs"], row["rms"], row["tolerance"]) == (
        expected.max_abs,
        expected.rms,
        expected.tolerance,
    )
    assert (row["within"], row["git_branch"], row["calibration_seconds"]) == (True, "main", 0.02)
    missing = [row for row in table if row["outcome"] == "unavailable"]
    assert {
        (row["max_abs"], row["warm_seconds"], row["git_commit"], row["output"]) for row in missing
    } == {(None, None, None, None)}


def test_export_of_case_and_engine(path, tmp_path):
    nights(path, 1)
    with Store(path) as store:
        assert (
            export(store, tmp_path / "some.csv", cases=["first"], engines=["native", "mujoco"])
            == 12
        )


def test_impossible_exports_are_refused(path, tmp_path, monkeypatch):
    nights(path, 1)
    with Store(path) as store:
        with pytest.raises(
            KincheckError, match=r"ends in '.xlsx'. Give a file that ends in .parquet or .csv"
        ):
            export(store, tmp_path / "all.xlsx")
        with pytest.raises(KincheckError, match="cannot be written"):
            export(store, tmp_path / "no" / "all.csv")
        monkeypatch.setitem(sys.modules, "pyarrow", None)
        with pytest.raises(KincheckError, match="which is not installed: pip install 'pyarrow>="):
            export(store, tmp_path / "all.parquet")
        store.connection.execute("DROP VIEW measured")
        with pytest.raises(HistoryError, match="no such table: measured"):
            export(store, tmp_path / "all.csv")
