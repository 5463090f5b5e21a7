"""Large runs by workers and by a cluster are killed and resumed; an engine hangs in one case."""

import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections import Counter

import pytest
from kincheck import Outcome
from kincheck.core.history.store import Store

from ..support.sources import ROOT

SIZES = ["6x3", pytest.param("500x7", marks=pytest.mark.nightly)]
"""Cases and engines."""


def command(path, size, *words):
    """A process of `kincheck run --resume`."""
    main = "import sys; from tests.support.fake_command import main; sys.exit(main())"
    argv = [sys.executable, "-c", main, "run", "--resume", "--history", str(path)]
    argv += ["--timeout", "3", *words]
    known = {name: x for name, x in os.environ.items() if not name.startswith("KINCHECK")}
    paths = os.pathsep.join(filter(None, (str(ROOT), known.get("PYTHONPATH"))))
    environment = {**known, "SIZE": size, "PYTHONPATH": paths}
    return subprocess.Popen(argv, cwd=ROOT, env=environment, stdout=subprocess.DEVNULL)


def stored(path):
    """The number of records."""
    try:
        with sqlite3.connect(f"{path.as_uri()}?mode=ro", uri=True) as connection:
            return connection.execute("SELECT count(*) FROM records").fetchone()[0]
    except sqlite3.OperationalError:  # not yet made
        return 0


def check_resumed(path, size, *words):
    """Kill a run when it has a third of its records, a large one again at two thirds; resume it."""
    cases, engines = map(int, size.split("x"))
    pairs = (cases + 1) * engines
    for part in (1, 2) if cases > 9 else (1,):
        process = command(path, size, *words)
        while stored(path) < part * pairs // 3:
            assert process.poll() is None
            time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert command(path, size, *words).wait() == 1  # the engine that hangs
    with Store(path) as store:
        (row,) = store.runs()
        records = store.results(row.id).records
    assert row.status == "finished"
    assert len({record.pair for record in records}) == len(records) == pairs
    assert Counter(record.outcome for record in records) == {
        Outcome.PASS: pairs - 1,
        Outcome.TIMEOUT: 1,
    }


@pytest.mark.parametrize("size", SIZES)
def test_large_run_by_workers_resumes(path, size):
    check_resumed(path, size, "--jobs", "2")


@pytest.mark.nightly
@pytest.mark.parametrize("size", ["4x2", "400x5"])
def test_large_run_by_cluster_resumes(cluster, path, size):
    check_resumed(path, size, "--scheduler", cluster.scheduler_address)
