"""History: what was kept stays, whatever ends the run, the disk or the process; and files of
another time or kind.
"""

import os
import sqlite3
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from kincheck.core.harness.run import run
from kincheck.core.history import database
from kincheck.core.history.runs import keep
from kincheck.core.history.store import Store, alive, owner

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


def test_pair_is_stored_once(path):
    keeping, results = kept(path, [crank()], ENGINES)
    with Store(path) as store:
        store.add_record(keeping.run, msgspec.structs.replace(results.records[0], message="again"))
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


def test_only_the_same_run_without_an_end_is_resumed(path, monkeypatch):
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
    number = store.begin_run("same", [(each.case, each.engine, each.mode) for each in records], {"started": "now", "command": ""})
    for record in records:
        store.add_record(number, record)
    store.finish(number)
    print(number, store.records(number) == records)
"""  # noqa: E501


def test_runs_at_once_do_not_disturb_each_other(path):
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
