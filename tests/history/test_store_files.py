"""History files of another time or kind, and full disks."""

import sqlite3

import pytest
from kincheck.core.cli.main import main
from kincheck.core.harness.run import run
from kincheck.core.history import database
from kincheck.core.history.runs import keep
from kincheck.core.history.store import HistoryError, Store

from ..support.fakes import crank
from .test_store import ENGINES, TOL, kept


def test_a_migration_that_fails_changes_nothing(path, monkeypatch):
    keeping, results = kept(path, [crank()], ENGINES)
    with monkeypatch.context() as patch:
        patch.setattr(
            database,
            "MIGRATIONS",
            (*database.MIGRATIONS, "DROP TABLE records; CREATE TABLE runs (id INTEGER);"),
        )
        with pytest.raises(HistoryError, match="table runs already exists"):
            Store(path)
    with Store(path) as store:
        assert store.results(keeping.run) == results


def test_a_file_of_another_program_is_left_alone(path):
    other = sqlite3.connect(path)
    other.execute("CREATE TABLE bookmarks (url TEXT)")
    other.close()
    before = path.read_bytes()
    with pytest.raises(HistoryError, match=r"a database of another program. Give another file"):
        Store(path)
    assert path.read_bytes() == before
    path.write_bytes(b"not a database at all" * 100)
    with pytest.raises(HistoryError, match="file is not a database; give another file"):
        Store(path)


@pytest.mark.parametrize("command", ["history", "report"])
def test_an_empty_file_is_left_empty(path, command, capsys):
    path.touch()
    assert main([command, "--history", str(path)]) == 2
    assert "it is empty; `kincheck run --history FILE` stores runs" in capsys.readouterr().err
    assert not path.read_bytes()


def test_impossible_history_files_are_refused(tmp_path):
    with pytest.raises(
        HistoryError, match="unable to open database file; give a file in a folder that exists"
    ):
        Store(tmp_path / "no" / "history.sqlite")
    with pytest.raises(HistoryError, match="there is no such file"):
        Store(tmp_path / "none.sqlite", writable=False)
    with (
        Store(tmp_path / "empty.sqlite") as store,
        pytest.raises(HistoryError, match="there is no run 7"),
    ):
        store.results(7)


# Disks


def full_after(path, pages):
    """A history file that can grow by so many pages: SQLite then says what it says of a full
    disk.
    """
    store = Store(path)
    (count,) = store.connection.execute("PRAGMA page_count").fetchone()
    store.connection.execute(f"PRAGMA max_page_count = {count + pages}")
    return store


def test_full_disk_keeps_stored_records(path):
    cases = [crank(f"c{k}") for k in range(40)]
    keeping = keep(path, cases, ENGINES[:1], tol=TOL, command="", settings={}, resume=False)
    keeping.store.close()
    keeping.store = full_after(path, pages=8)
    results = run(cases, ENGINES[:1], tol=TOL, progress=lambda record, *_: keeping.add(record))
    keeping.end(results, interrupted=False)
    (problem,) = keeping.problems
    assert problem.startswith(
        f"history {path}: cannot be written: database or disk is full; make room; the records"
        " before "
    )
    assert len(results.records) == 40  # the run went on
    with Store(path) as store:
        found = store.records(keeping.run)
        assert 0 < len(found) < 40
        assert found == results.records[: len(found)]
        assert store.connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
