"""Exports of a history hold every number."""

import csv
import sys

import pytest
from kincheck.core.errors import KincheckError
from kincheck.core.harness.record import Outcome
from kincheck.core.history.queries import NUMBERS, export
from kincheck.core.history.store import HistoryError, Store

from ..support.nights import changed, keep, nights, records
from .test_history import history


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


def test_an_export_can_be_of_a_case_and_an_engine(path, tmp_path):
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
