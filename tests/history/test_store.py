"""The store of runs, its files, and the runs that are kept."""

import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from kincheck.core.cli.main import main
from kincheck.core.harness.provenance import calibration, git_state
from kincheck.core.harness.run import run
from kincheck.core.history import database
from kincheck.core.history.runs import digest, keep
from kincheck.core.history.store import HistoryError, Store, alive, owner
from msgspec.structs import replace as replaced

from ..harness.test_workers import timeless
from ..support.fakes import Fake, crank, off, partial, raising

ROOT = Path(__file__).parents[2]
TOL = 1e-12
ENGINES = [
    Fake("native"),
    Fake("wrong", answer=off("velocity", lambda v: 1.1 * v)),
    Fake("partial", answer=partial),
    Fake("broken", answer=raising(ValueError("no"))),
    Fake("missing", installed=None),
]


def kept(path, cases, engines, *, resume=False, stop=None):
    """A run in a history, which ends by force after so many records; the run's number and what it
    gave.
    """
    keeping = keep(
        path, cases, engines, tol=TOL, command="kincheck run", settings={"jobs": 0}, resume=resume
    )

    def made(record, done, total):
        keeping.add(record)
        if done == stop:
            raise KeyboardInterrupt

    try:
        results = run(
            cases, engines, tol=TOL, progress=made, made=keeping.made, facts=keeping.facts
        )
        keeping.end(results, interrupted=False)
    except KeyboardInterrupt:
        keeping.store.close()
        return keeping, None
    return keeping, results


def test_stored_run_reads_back(path):
    cases = [crank("a"), crank("b", reference=False)]
    keeping, results = kept(path, cases, ENGINES)
    with Store(path, writable=False) as store:
        (row,) = store.runs()
        assert store.results(keeping.run) == results
        columns = (
            "outcome, validated, version, build_seconds, warm_seconds, solved, json_extract(errors,"
            " '$.y.velocity.max_abs')"
        )
        query = f"SELECT {columns} FROM records WHERE case_name = 'a' AND engine = ?"
        assert store.connection.execute(query, ["broken"]).fetchone()[:3] == ("error", 0, "1.2")
        wrong = store.connection.execute(query, ["wrong"]).fetchone()
        assert wrong[0] == "fail"
        assert wrong[-1] == results.records[1].errors["y"].velocity.max_abs
        assert wrong[4] == results.records[1].seconds.warm
    assert (row.status, row.command) == ("finished", "kincheck run")
    assert row.started <= row.finished
    assert row.circumstances["calibration_seconds"] > 0
    assert set(row.circumstances) >= {
        "host",
        "processor",
        "python",
        "numpy",
        "kincheck",
        "git",
        "jobs",
        "tol",
    }


def test_equal_references_are_stored_once(path):
    for _ in range(3):
        kept(path, [crank()], ENGINES)
    with Store(path) as store:
        assert store.connection.execute("SELECT count(*) FROM documents").fetchone() == (1,)
        assert [row.id for row in store.runs()] == [3, 2, 1]
        assert len({str(store.results(row.id).references) for row in store.runs()}) == 1


def test_damaged_text_becomes_whole_again(path):
    """Else the run that shares a damaged text could not be read."""
    kept(path, [crank()], ENGINES)
    with Store(path) as store:
        before = store.results(1).references
        store.connection.execute("UPDATE documents SET content = zeroblob(length(content))")
    kept(path, [crank()], ENGINES)
    with Store(path) as store:
        assert store.results(1).references == store.results(2).references == before


def test_pair_is_stored_once(path):
    keeping, results = kept(path, [crank()], ENGINES)
    with Store(path) as store:
        store.add_record(keeping.run, replaced(results.records[0], message="again"))
        assert store.records(keeping.run) == results.records


@pytest.mark.parametrize(
    "stop", [1, 5, 6, 9, *(pytest.param(k, marks=pytest.mark.nightly) for k in (2, 3, 4, 7, 8))]
)
def test_stopped_run_resumes_to_equal_records(path, stop):
    cases = [crank("a", reference=False), crank("b")]
    undisturbed = run(cases, ENGINES, tol=TOL)
    first, _ = kept(path, cases, ENGINES, stop=stop)
    solved = [engine.solves for engine in ENGINES]
    second, results = kept(path, cases, ENGINES, resume=True)
    assert second.run == first.run
    assert second.resumed
    assert len(second.made) == stop
    # both native answers are there from then on
    assert (ENGINES[0].solves == solved[0]) is (stop > 5)
    assert timeless(results.records) == timeless(undisturbed.records)
    assert results.run == second.facts | {"engines": undisturbed.run["engines"]}
    with Store(path) as store:
        assert store.results(second.run) == results
        assert store.run(second.run).status == "finished"


def test_only_equal_unfinished_run_is_resumed(path, monkeypatch):
    # the same code everywhere, with or without a repository
    here = {"commit": "a" * 40, "changed": False}
    monkeypatch.setattr("kincheck.core.harness.provenance.git_state", lambda _: here)
    case = crank()
    stopped, _ = kept(path, [case], ENGINES, stop=1)
    others = {
        "case": ([replace(case, name="other")], ENGINES),
        "grid": (
            [
                replace(
                    case, sweep=replace(case.sweep, values=case.sweep.values * (1 + 1e-16) + 1e-17)
                )
            ],
            ENGINES,
        ),
        "engines": ([case], ENGINES[:-1]),
        "version": ([case], [Fake("native", installed="9"), *ENGINES[1:]]),
    }
    for cases, engines in others.values():
        assert not kept(path, cases, engines, resume=True)[0].resumed
    for git in ({"commit": "b" * 40, "changed": False}, None):
        with monkeypatch.context() as elsewhere:
            elsewhere.setattr("kincheck.core.harness.provenance.git_state", lambda _, git=git: git)
            # other code may give other records
            assert not kept(path, [case], ENGINES, resume=True)[0].resumed
    assert kept(path, [crank()], ENGINES, resume=True)[0].run == stopped.run  # equal, and made anew
    assert not kept(path, [case], ENGINES, resume=True)[0].resumed  # it has an end now


def test_running_run_is_not_resumed(path):
    with Store(path) as store:
        run_number = store.begin_run("same", [], {"started": "now", "command": ""})
        other = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
        with other:
            theirs = (
                owner().replace(f"|{os.getpid()}|", f"|{other.pid}|").rpartition("|")[0]
                + "|"
                + begun(other.pid)
            )
            assert alive(theirs)
            store.connection.execute("UPDATE runs SET owner = ?", [theirs])
            assert store.resume_run("same") is None
            other.kill()
            # it has ended, and nobody has asked how
            os.waitid(os.P_PID, other.pid, os.WEXITED | os.WNOWAIT)
            assert not alive(theirs)
        assert not alive(theirs)
        assert store.resume_run("same").id == run_number
        # the number of a process is given again; when it began is not
        store.connection.execute("UPDATE runs SET owner = ?", [owner() + "0"])
        assert store.resume_run("same").id == run_number


def begun(process):
    return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[19]


WRITER = """
import sys
from pathlib import Path
from kincheck.core.history.store import Store
from kincheck.core.harness.run import run
from tests.support.fakes import Fake, crank
records = run([crank(f"c{k}") for k in range(20)], [Fake()], tol=1e-12).records
with Store(Path(sys.argv[1])) as store:
    number = store.begin_run("same", [each.pair for each in records], {"started": "now", "command": ""})
    for record in records:
        store.add_record(number, record)
    store.finish(number)
    print(number, store.records(number) == records)
"""  # noqa: E501


def test_concurrent_runs_are_stored(path):
    """From the making of the file on."""
    writers = [
        subprocess.Popen(
            [sys.executable, "-c", WRITER, path], cwd=ROOT, stdout=subprocess.PIPE, text=True
        )
        for _ in range(2)
    ]
    said = [writer.communicate()[0].split() for writer in writers]
    assert sorted(said) == [["1", "True"], ["2", "True"]]


OPENERS = """
import os, sys, time
from pathlib import Path
from kincheck.core.history.store import Store
for k in range(20):
    at, children = time.time() + 0.004, []
    for c in range(4):
        child = os.fork()
        if not child:
            time.sleep(max(0.0, at + 0.0007 * c - time.time()))
            try:
                with Store(Path(sys.argv[1]) / f"{k}.sqlite"):
                    os._exit(0)
            except BaseException as error:
                print(error, flush=True)
                os._exit(1)
        children.append(child)
    for child in children:
        os.waitpid(child, 0)
"""


def test_new_history_opens_concurrently(tmp_path):
    """A thousandth of a second apart, while one of them is making the tables."""
    ran = subprocess.run(
        [sys.executable, "-c", OPENERS, tmp_path],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert ran.stdout == ""
    assert len(list(tmp_path.glob("*.sqlite"))) == 20


def test_schema_check_is_one_statement(path):
    """Between two statements another process may make the tables, and half of them would show."""
    statements = []
    connection = sqlite3.connect(path)
    connection.set_trace_callback(statements.append)
    assert database.check(connection) == 0
    connection.close()
    # those of the functions inside a statement are comments
    assert len([each for each in statements if not each.startswith("--")]) == 1


# History files of another time or kind, and full disks


def test_failed_migration_changes_nothing(path, monkeypatch):
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


def test_foreign_database_is_unchanged(path):
    other = sqlite3.connect(path)
    other.execute("CREATE TABLE bookmarks (url TEXT)")
    other.close()
    before = path.read_bytes()
    with pytest.raises(HistoryError, match=r"a database of another program. Give another file"):
        Store(path)
    assert path.read_bytes() == before
    path.write_bytes(b"not a database at all" * 100)
    with pytest.raises(HistoryError, match=r"file is not a database\. Give another file"):
        Store(path)


@pytest.mark.parametrize("command", ["history", "report"])
def test_empty_history_file_stays_empty(path, command, capsys):
    path.touch()
    assert main([command, "--history", str(path)]) == 2
    assert "it is empty. `kincheck run --history FILE` stores runs" in capsys.readouterr().err
    assert not path.read_bytes()


def test_impossible_history_files_are_refused(tmp_path):
    with pytest.raises(
        HistoryError, match=r"unable to open database file\. Give a file in a folder that exists"
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
        f"history {path}: cannot be written: database or disk is full. Make room. The records"
        " before "
    )
    assert len(results.records) == 40  # the run went on
    with Store(path) as store:
        found = store.records(keeping.run)
        assert 0 < len(found) < 40
        assert found == results.records[: len(found)]
        assert store.connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)


# Runs of the command line that are kept in a history: killed at any moment, on a bad disk, and how


MOMENTS = int(os.environ.get("KINCHECK_DRILL", "1"))
"""At which a run is killed: KINCHECK_DRILL=50 for the full drill."""


def kincheck(*arguments, limit=None, **environment):
    """The command line of fake_command.py. limit: on the size of files
    [bytes].
    """
    restrict = (
        f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit})); "
        if limit
        else ""
    )
    command = [
        sys.executable,
        "-B",  # a limit would cut files of bytecode
        "-c",
        f"{restrict}import sys; from tests.support.fake_command import main; sys.exit(main())",
        *map(str, arguments),
    ]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(
        command, cwd=ROOT, env={**os.environ, "KINCHECK_HISTORY": "", **environment}, **pipes
    )


@pytest.mark.skipif(os.name != "posix", reason="limits the size of files as POSIX does")
def test_disk_error_during_run_keeps_results(path):
    """The limit leaves room for some records."""
    Store(path).close()
    process = kincheck(
        "run", "--jobs", 0, "--engine", "native", "--history", path, "--json", "-", limit=52_000
    )
    out, err = process.communicate()
    assert process.returncode == 2
    assert (
        f"kincheck: history {path}: cannot be written: disk I/O error. Check the disk: it may be"
        " full" in err
    )
    assert len(msgspec.json.decode(out)["records"]) == 3
    with Store(path) as store:
        (row,) = store.runs()
        assert 0 < len(store.records(row.id)) < 3


def test_resume_takes_history_from_environment(path):
    process = kincheck("run", "--resume")
    assert (
        "--resume needs a history. Give --history FILE, or set KINCHECK_HISTORY."
        in process.communicate()[1]
    )
    assert process.returncode == 2
    process = kincheck("run", "first", "--engine", "native", "--resume", KINCHECK_HISTORY=str(path))
    assert "no unfinished run to resume: run 1 is new" in process.communicate()[1]
    assert process.returncode == 0
    with Store(path) as store:
        assert len(store.runs()) == 1


# Kills


@pytest.mark.nightly
def test_killed_run_resumes_to_equal_records(tmp_path):
    """The moments are drawn over the whole of a run and its ways in and out; one run in three is
    killed twice.
    """
    arguments = "run --jobs 2 --history".split()
    begin = time.monotonic()
    undisturbed = kincheck(*arguments, tmp_path / "undisturbed.sqlite")
    undisturbed.communicate()
    lasted = time.monotonic() - begin
    with Store(tmp_path / "undisturbed.sqlite") as store:
        expected = store.results(1)
    assert len(expected.records) == 6
    moments = random.Random(943745)
    for number in range(MOMENTS):
        path = tmp_path / f"{number}.sqlite"
        for _ in range(1 + (number % 3 == 0)):
            process = kincheck(*arguments, path, "--resume")
            time.sleep(moments.uniform(0.0, lasted))
            process.send_signal(signal.SIGKILL)
            process.communicate()
        process = kincheck(*arguments, path, "--resume")
        err = process.communicate()[1]
        assert process.returncode == 1, err  # the segmentation fault
        with Store(path) as store:
            assert store.connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
            finished = [row for row in store.runs() if row.status == "finished"]
            results = store.results(finished[0].id)
            assert timeless(results.records) == timeless(expected.records)
            assert results.references == expected.references
            # begun at most once more than needed: where the kill came after the end
            assert len(store.runs()) == len(finished)


# What a run is told by


def test_digest_depends_on_content():
    assert digest(crank()) == digest(crank())
    assert digest({"a": 1}) != digest({"a": 1.0}) != digest({"a": True})
    assert digest(np.array([0.0])) != digest(np.array([-0.0]))
    assert digest([["a"], []]) != digest([["a", []]])
    assert len({digest(crank(rate=rate)) for rate in (1.0, 2.0)}) == 2


def test_git_state_of_repository(tmp_path):
    def git(*arguments):
        name = ["-c", "user.name=a", "-c", "user.email=a@b.c", "-c", "init.defaultBranch=trunk"]
        return subprocess.run(
            ["git", "-C", tmp_path, *name, *arguments], check=True, capture_output=True, text=True
        ).stdout.strip()

    assert git_state(tmp_path) is None
    git("init")
    (tmp_path / "case.toml").write_text("a")
    git("add", ".")
    git("commit", "-m", "first")
    assert git_state(tmp_path) == {
        "commit": git("rev-parse", "HEAD"),
        "branch": "trunk",
        "changed": False,
    }
    (tmp_path / "case.toml").write_text("b")
    git("checkout", "--detach")
    found = git_state(tmp_path)
    edits = found.pop("edits")
    assert found == {"commit": git("rev-parse", "HEAD"), "branch": None, "changed": True}
    assert git_state(tmp_path)["edits"] == edits
    (tmp_path / "case.toml").write_text("c")
    assert git_state(tmp_path)["edits"] != edits
    # programs that a repository's configuration names are not started
    (tmp_path / ".gitattributes").write_text("* diff=own")
    for option in ("core.fsmonitor", "diff.external", "diff.own.textconv"):
        git("config", option, f"touch {tmp_path}/started #")
    git_state(tmp_path)
    assert not (tmp_path / "started").exists()


def test_calibration_gives_seconds():
    assert 0.0 < calibration() < 60.0
