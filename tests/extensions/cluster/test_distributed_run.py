"""Runs on a dask.distributed cluster: a real scheduler and workers on loopback, and what happens
when they are lost.
"""

import importlib
import os
import signal
import socket
import subprocess
import sys
from collections import Counter
from importlib.util import find_spec

import pytest
from kincheck import Outcome
from kincheck.core.extensions.cluster import distributed as ours
from kincheck.core.extensions.cluster.distributed import ClusterError, on_cluster
from kincheck.core.harness.resource_limits import Limits
from kincheck.core.harness.run import run
from kincheck.core.harness.workers.serve import pack

from ...harness.test_workers import timeless
from ...support.bad_engine import Bad
from ...support.fake_command import Slow
from ...support.fakes import Fake, crank, raising, run_case

TOL = 1e-12
LIMITS = Limits(timeout=60.0, memory=1.0)
# its own, of sockets and loops it leaves to the collector when a worker is killed
pytestmark = [
    pytest.mark.filterwarnings(
        "ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"
    ),
    pytest.mark.skipif(find_spec("distributed") is None, reason="distributed is not installed"),
]


@pytest.mark.nightly
def test_cluster_run_survives_lost_worker(cluster):
    """A worker is killed in the middle, with a pair on it: another has it, nothing is lost and
    nothing comes twice. A cluster that goes is a message.
    """
    cases = [crank(f"c{k}", reference=k % 2 == 0) for k in range(6)]
    crashing = cases[3] = crank("segfault")
    engines = [
        Slow("native", seconds=0.03),
        Fake(),
        Bad(),
        Fake("lambda", answer=raising(ValueError())),
    ]
    heard = Counter()
    victims = [nanny.pid for nanny in cluster.workers.values()]

    def hear(record, done, total):
        heard[record.case, record.engine] += 1
        if done == 8:
            os.kill(victims[0], signal.SIGKILL)

    there = run(
        cases,
        engines[:3],
        tol=TOL,
        solver=on_cluster(cluster.scheduler_address, LIMITS),
        progress=hear,
    )
    assert victims[0] not in [nanny.pid for nanny in cluster.workers.values()]
    crash = next(k for k, each in enumerate(there.records) if each.outcome is Outcome.CRASHED)
    assert there.records[crash].message.startswith("the process died of SIGSEGV in ")
    cases.remove(crashing)
    here = run(cases, engines[:3], tol=TOL).records
    assert [each for each in timeless(there.records) if each.case != "segfault"] == timeless(here)
    assert set(heard.values()) == {1}
    assert len(heard) == 18
    assert {each.outcome for each in there.records if each.case == "segfault"} == {
        Outcome.PASS,
        Outcome.CRASHED,
    }
    # what cannot be sent, or is another kincheck there, errs
    (record,) = run(
        cases[:1], engines[3:], tol=TOL, solver=on_cluster(cluster.scheduler_address, LIMITS)
    ).records
    assert record.message.startswith("cannot be sent to a cluster: ")

    def close(record, done, total):
        if done == 1:
            cluster.close()

    cases = [crank(f"c{k}") for k in range(20)]
    with pytest.raises(ClusterError, match="was lost"):
        run(
            cases,
            [Slow("slow", seconds=0.05)],
            tol=TOL,
            solver=on_cluster(cluster.scheduler_address, LIMITS),
            progress=close,
        )


def test_cluster_run_survives_frozen_worker(cluster):
    cases = [crank(f"c{k}") for k in range(8)]
    workers = [nanny.pid for nanny in cluster.workers.values()]

    def solved(frozen):
        def freeze(record, done, total):
            if done == 2:
                os.kill(frozen, signal.SIGSTOP)

        solver = on_cluster(cluster.scheduler_address, LIMITS, silent=4.0)
        found = run(cases, [Slow("native", seconds=0.1)], tol=TOL, solver=solver, progress=freeze)
        return Counter(record.outcome for record in found.records), found.records[-1].message

    try:
        assert solved(workers[0]) == ({Outcome.PASS: 8}, "")
        outcomes, message = solved(workers[1])
        assert outcomes[Outcome.PASS] >= 2
        assert outcomes[Outcome.PASS] + outcomes[Outcome.TIMEOUT] == 8
        assert message == "no answer within 4 s: the cluster's worker was silent"
    finally:
        for worker in workers:
            os.kill(worker, signal.SIGCONT)


SCHEDULER = """
from distributed import LocalCluster
cluster = LocalCluster(
    n_workers=1, processes=False, protocol="tcp://", dashboard_address=":0", silence_logs=50
)
print(cluster.scheduler_address, flush=True)
input()
"""


def test_lost_scheduler_is_one_message():
    with subprocess.Popen(
        [sys.executable, "-c", SCHEDULER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as scheduler:
        address = scheduler.stdout.readline().strip()
        command = [sys.executable, "-m", "kincheck", "run", "--engine", "native"]
        with subprocess.Popen(
            [*command, "--scheduler", address],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        ) as running:
            while not running.stderr.readline().startswith("[1/"):
                assert running.poll() is None
            scheduler.kill()
            _, said = running.communicate()
    *progress, message = said.splitlines()
    assert running.returncode == 2
    assert all(line.startswith(("[", "kincheck: ")) for line in progress)
    assert message.startswith(f"kincheck: scheduler {address}: was lost (")


def forbid_clients(monkeypatch):
    def client(*_, **__):
        raise AssertionError("a client without a scheduler")

    monkeypatch.setattr(importlib.import_module("distributed"), "Client", client)


def test_silent_scheduler_is_reported(monkeypatch):
    """Where nobody listens, and where somebody does who is none and says nothing."""
    monkeypatch.setattr(ours, "ANSWER", 0.25)
    with pytest.raises(
        ClusterError, match=r"scheduler tcp://127.0.0.1:1: does not answer \(.+\). Start one with"
    ):
        run_case(crank(), Fake(), solver=on_cluster("tcp://127.0.0.1:1", LIMITS))
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"127.0.0.1:{silent.getsockname()[1]}"
        with pytest.raises(
            ClusterError, match=rf"scheduler {address}: does not answer \(TimeoutError"
        ):
            run_case(crank(), Fake(), solver=on_cluster(address, LIMITS))


@pytest.mark.parametrize(
    "address",
    [
        "foo",
        "",
        "nonsense://",
        "nonsense://a:1",
        "tcp://:8786",
        "127.0.0.1:99999",
        "127.0.0.1:0",
        "127.0.0.1:a",
        "inproc://x",
    ],
)
def test_invalid_scheduler_address_is_refused(address, monkeypatch):
    """Who had waited in vain would be told that nobody answers."""
    forbid_clients(monkeypatch)
    with pytest.raises(ClusterError) as caught:
        run_case(crank(), Fake(), solver=on_cluster(address, LIMITS))
    message = str(caught.value)
    assert message.startswith(f"scheduler {address}: found no address (")
    assert message.endswith(
        "), expected HOST:PORT or tcp://HOST:PORT. Write it as `dask scheduler` prints it."
    )


@pytest.mark.parametrize(
    "command", ["run", pytest.param("sweep", marks=pytest.mark.needs("sweep"))]
)
def test_commands_refuse_invalid_scheduler(kincheck_main, capsys, tmp_path, monkeypatch, command):
    """And no client is made, for whose end the process would wait."""
    forbid_clients(monkeypatch)
    (tmp_path / "vary.toml").write_text(
        'schema = "kincheck-vary/1"\nmode = "monte_carlo"\n[hardpoints.tip]\nat = "tip"\nsigma'
        " = 1\n"
    )
    more = {
        "run": ["--history", tmp_path / "h.db"],
        "sweep": ["--vary", tmp_path / "vary.toml", "--samples", 3],
    }[command]
    assert kincheck_main(command, "crank", "--scheduler", "foo", *more, jobs=None) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    (line,) = captured.err.splitlines()
    assert line.startswith("kincheck: scheduler foo: found no address (")
    assert not (tmp_path / "h.db").exists()


def test_cluster_decides_number_of_jobs(kincheck_main, capsys):
    assert kincheck_main("run crank --scheduler tcp://there:8786", jobs="2") == 2
    said = "--scheduler: the cluster decides how many pairs run at a time. Leave out --jobs"
    assert said in capsys.readouterr().err


def test_missing_dask_names_package(monkeypatch):
    def absent(name):
        raise ImportError(name)

    monkeypatch.setattr(importlib, "import_module", absent)
    with pytest.raises(ClusterError, match="pip install 'distributed>="):
        run_case(crank(), Fake(), solver=on_cluster("tcp://127.0.0.1:1", LIMITS))


def test_cluster_version_mismatch_is_error():
    from kincheck.core.harness.execution import Pair

    found = ours.solve_there(pack(Pair(crank(), Fake(), TOL)), "fake", LIMITS, "0.0.1")
    assert found.result.outcome is Outcome.ERROR
    assert "expected 0.0.1 as in the run; install the same there" in found.result.message
