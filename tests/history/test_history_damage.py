"""A history with a fault costs one message and status 2: never a result, and where one run is
damaged, never the others.
"""

import json
import sqlite3
from contextlib import closing

import pytest
from kincheck.core.cli.main import main
from kincheck.core.history.database import MIGRATIONS
from kincheck.core.history.store import Store

from ..support.examples import examples
from ..support.fakes import crank
from ..support.history_runs import history, nights, report

(DAMAGE,) = examples(__file__, "damage")

NO_TRENDS = "The history cannot be read, so this page shows no earlier runs."


def change(path, statement):
    connection = sqlite3.connect(path)
    connection.execute(statement)
    connection.commit()
    connection.close()


def directory(path, monkeypatch):
    path.mkdir()


def no_database(path, monkeypatch):
    path.write_bytes(b"not a database at all" * 100)


def of_another_program(path, monkeypatch):
    change(path, "CREATE TABLE mine (a)")


def of_a_later_version(path, monkeypatch):
    Store(path).close()
    change(path, f"PRAGMA user_version = {len(MIGRATIONS) + 1}")


def cut_off(path, monkeypatch):
    nights(path, 2)
    path.write_bytes(path.read_bytes()[:5000])


def locked(path, monkeypatch):
    nights(path, 1)
    monkeypatch.setattr("kincheck.core.history.database.BUSY", 0.2)
    holder = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
    holder.execute("BEGIN EXCLUSIVE")
    HELD.append(holder)


def full(path, monkeypatch):
    nights(path, 1)

    monkeypatch.setattr(Store, "_attach", no_room)


def no_room(*_):
    raise sqlite3.OperationalError("database or disk is full")


HELD = []

WHOLE_FILE = [directory, no_database, of_another_program, of_a_later_version, cut_off, locked, full]


@pytest.mark.by_day(2)
@pytest.mark.parametrize("fault", WHOLE_FILE)
def test_unusable_history_costs_no_result(
    kincheck_main, path, tmp_path, capsys, monkeypatch, fault
):
    fault(path, monkeypatch)
    out, junit = tmp_path / "out", tmp_path / "junit.xml"
    files = ["--history", path, "--out", out, "--junit", junit]
    assert kincheck_main("run crank", *files) == 2
    while HELD:
        HELD.pop().close()
    told, said = capsys.readouterr()
    (problem,) = [line for line in said.splitlines() if line.startswith("kincheck: ")]
    assert problem.startswith(f"kincheck: history {path}: cannot be ")
    kept = f"; the run is not in the history: its results are in {junit} and {out}"
    assert problem.endswith(kept)
    assert "1 pass" in told
    assert len(json.loads((out / "results.json").read_text())["records"]) == 1
    assert "crank" in junit.read_text()
    assert NO_TRENDS in (out / "report.html").read_text()


def pages(path, change):
    """Change every fifth page of a history but the first, and yield what a run then says."""
    nights(path, 4)
    whole = path.read_bytes()
    for begin in range(2 * 4096, len(whole), 5 * 4096):
        path.write_bytes(
            whole[:begin] + change(whole[begin : begin + 4096]) + whole[begin + 4096 :]
        )
        yield begin


@pytest.mark.parametrize(
    "change",
    [lambda page: bytes(len(page)), lambda page: page[:300] + page[300:][::-1]],
    ids=["zeros", "turned around"],
)
def test_history_of_damaged_pages(kincheck_main, path, capsys, change):
    """Nothing is written into a file that cannot be read; damaged records are told."""
    for begin in pages(path, change):
        before = path.read_bytes()
        status = kincheck_main("run crank --quiet --history", path)
        said = capsys.readouterr().err
        if "; the run is not in the history: say --out DIR to keep it" in said:
            assert (status, path.read_bytes()) == (2, before), begin
        elif status == 2:
            assert "cannot be read" in said
        else:
            assert main(["report", "--history", str(path)]) < 2, begin
        assert [*path.parent.glob(f"{path.name}-*")] == []
        capsys.readouterr()


@pytest.mark.parametrize("command", ["report", "history"])
def test_damaged_history_is_only_read(path, capsys, command):
    """The states of its runs are not stored yet; a sound file gets them."""
    for begin in pages(path, lambda page: page[:300] + page[300:][::-1]):
        before = path.read_bytes()
        with closing(sqlite3.connect(path)) as reader:
            damaged = reader.execute("PRAGMA quick_check(1)").fetchone() != ("ok",)
        main([command, "--history", str(path)])
        assert not damaged or path.read_bytes() == before, begin
        assert [*path.parent.glob(f"{path.name}-*")] == []
    capsys.readouterr()
    path.unlink()
    nights(path, 2)
    before = path.read_bytes()
    assert main([command, "--history", str(path)]) == 0
    assert [*path.parent.glob(f"{path.name}-*")] == []
    with Store(path, writable=False) as store:
        (count,) = store.connection.execute("SELECT count(*) FROM states").fetchone()
    assert path.read_bytes() != before
    assert count == 8


@pytest.fixture(params=DAMAGE)
def damaged(request, path):
    """A history of three runs, of which the second is damaged."""
    nights(path, 3)
    change(path, DAMAGE[request.param])
    return path


def passed_over(capsys, path):
    """The one line that says which run was passed over, and how to be rid of it."""
    told, said = capsys.readouterr()
    (problem,) = [line for line in said.splitlines() if not line.startswith("[")]
    assert problem.startswith(f"kincheck: history {path}: run 2 cannot be read (")
    assert f"kincheck history --history {path} --remove 2" in problem
    return told


@pytest.mark.by_day(2)
def test_run_beside_damaged_run_is_stored(kincheck_main, damaged, tmp_path, capsys):
    out = tmp_path / "out"
    assert kincheck_main("run crank --history", damaged, "--out", out) == 2
    assert "1 pass" in passed_over(capsys, damaged)
    assert NO_TRENDS not in (out / "report.html").read_text()
    with Store(damaged, writable=False) as store:
        assert store.runs()[0].id == 4
        assert len(store.records(4)) == 1


def test_history_passes_over_damaged_run(damaged, tmp_path, capsys):
    table, plot = tmp_path / "all.csv", tmp_path / "plot.html"
    command = ["history", "--history", str(damaged)]
    assert main([*command, "--export", str(table), "--plot", str(plot)]) == 2
    told = passed_over(capsys, damaged)
    assert f"{table}: " in told
    rows = [line.split(",")[0] for line in table.read_text().splitlines()[1:]]
    assert {*rows} == {"1", "3"}
    assert rows.count("1") == rows.count("3")
    assert plot.exists()
    assert main([*command, "--case", "first", "--engine", "native"]) == 2
    passed_over(capsys, damaged)


def test_report_passes_over_damaged_run(damaged, tmp_path, capsys):
    assert report(damaged, "--out", tmp_path / "out") == 2
    assert "run 3 against run 1 (last green)" in passed_over(capsys, damaged)
    assert (tmp_path / "out" / "report.html").exists()


def test_report_skips_run_with_damaged_record(path, capsys):
    nights(path, 3)
    change(path, "UPDATE records SET record = x'00' WHERE run_id = 2")
    assert report(path) == 2
    assert "run 3 against run 1 (last green)" in passed_over(capsys, path)
    assert report(path, "2") == 2
    passed_over(capsys, path)


def test_removed_run_is_not_reported(damaged, capsys):
    assert history(damaged, "--remove", "2") == 0
    assert "run 2 is removed" in capsys.readouterr().out
    with Store(damaged) as store:
        assert [row.id for row in store.runs()] == [3, 1]
        assert store.connection.execute(
            "SELECT count(*) FROM records WHERE run_id = 2"
        ).fetchone() == (0,)
        assert len(store.records(3)) == 4
    assert history(damaged, "--remove", "2") == 2
    assert "there is no run 2" in capsys.readouterr().err


def test_many_damaged_runs_are_summed_up(path, capsys):
    nights(path, 9)
    change(path, "UPDATE runs SET plan = '(' WHERE id > 1")
    assert history(path) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 6
    assert "3 more runs cannot be read: 4, 3, 2" in said[-1]


def test_damage_during_run_costs_no_result(kincheck_main, path, tmp_path, capsys, monkeypatch):
    add = Store.add_record

    def damage_then_add(self, run, record):
        if record.case == "b":
            self.connection.execute("DROP TABLE records")
        add(self, run, record)

    monkeypatch.setattr(Store, "add_record", damage_then_add)
    out = tmp_path / "out"
    cases = {name: crank(name) for name in "abc"}
    assert kincheck_main("run", *cases, "--history", path, "--out", out, cases=cases) == 2
    said = [line for line in capsys.readouterr().err.splitlines() if not line.startswith("[")]
    assert len(said) == 1
    assert "The records before b native are stored as run 1" in said[0]
    assert len(json.loads((out / "results.json").read_text())["records"]) == 3
    assert NO_TRENDS in (out / "report.html").read_text()


def test_damaged_run_is_not_resumed(kincheck_main, path, capsys):
    command = ["run", "crank", "--history", path]
    assert kincheck_main(*command) == 0
    change(path, "UPDATE runs SET status = 'interrupted', plan = '('")
    capsys.readouterr()
    assert kincheck_main(*command, "--resume") == 2
    said = capsys.readouterr().err
    assert "run 2 is new" in said
    assert "run 1 cannot be read" in said
