"""Runs of the command line that are kept in a history: killed at any moment, on a bad disk, and how
they are told apart.
"""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import msgspec
import numpy as np
import pytest
from kincheck.core.harness.provenance import calibration, git_state
from kincheck.core.history.runs import digest
from kincheck.core.history.store import Store

from ..harness.test_workers import timeless
from ..support.fakes import crank

ROOT = Path(__file__).parents[2]
MOMENTS = int(os.environ.get("KINCHECK_DRILL", "1"))
"""At which a run is killed: KINCHECK_DRILL=50 for the full drill."""


def kincheck(*arguments, limit=None, **environment):
    """The command line with made-up cases and engines: see drill.py. limit: on the size of files
    [bytes].
    """
    restrict = (
        f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit})); "
        if limit
        else ""
    )
    command = [
        sys.executable,
        "-c",
        f"{restrict}import sys; from tests.support.drill import main; sys.exit(main())",
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
        f"kincheck: history {path}: cannot be written: disk I/O error; check the disk: it may be"
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


def test_a_digest_is_of_content():
    assert digest(crank()) == digest(crank())
    assert digest({"a": 1}) != digest({"a": 1.0}) != digest({"a": True})
    assert digest(np.array([0.0])) != digest(np.array([-0.0]))
    assert digest([["a"], []]) != digest([["a", []]])
    assert len({digest(crank(rate=rate)) for rate in (1.0, 2.0)}) == 2


def test_the_state_of_a_repository(tmp_path):
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


def test_calibration_is_a_time():
    assert 0.0 < calibration() < 60.0


def test_state_of_repository_writes_no_index(tmp_path):
    """Its lock would stay if the time limit ends git."""
    git = ("git", "-C", tmp_path, "-c", "user.name=a", "-c", "user.email=a@b.c")
    (tmp_path / "case.toml").write_text("a")
    for words in (["init"], ["add", "."], ["commit", "-m", "first"]):
        subprocess.run([*git, *words], check=True, capture_output=True)
    index = tmp_path / ".git" / "index"
    before = index.read_bytes()
    os.utime(tmp_path / "case.toml", (1.0, 1.0))
    assert git_state(tmp_path)["changed"] is False
    assert index.read_bytes() == before
