"""Sweeps on a dask.distributed cluster: a real scheduler and two workers on loopback, one of which
is lost on the way.
"""

import importlib
import os
import signal
from importlib.util import find_spec

import msgspec
import pytest
from kincheck.core.extensions.cluster import distributed as ours
from kincheck.core.extensions.cluster.distributed import ClusterError
from kincheck.core.extensions.sweep import sweep as chunk_execution
from kincheck.core.extensions.sweep.study import Study
from kincheck.core.extensions.sweep.sweep import on_cluster, solve_there, sweep_designs
from kincheck.core.harness.workers.serve import pack

from ...support.fakes import crank
from ...support.variations import vary

# its own, of sockets and loops it leaves to the collector when a worker is killed
pytestmark = [
    pytest.mark.filterwarnings(
        "ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"
    ),
    pytest.mark.skipif(find_spec("distributed") is None, reason="distributed is not installed"),
]


def timeless(results):
    """All but how long it took and when."""
    return msgspec.json.encode(msgspec.structs.replace(results, run={}, measured={}))


@pytest.mark.nightly
def test_cluster_sweep_survives_lost_worker(cluster, tmp_path):
    """To the last bit, in whatever order the chunks were solved, and with those of the killed
    worker solved by the other.
    """
    case = crank()
    variation = vary(tmp_path, case, tip={"at": "tip", "sigma": 1})
    victim, *_ = cluster.workers.values()
    process, seen = victim.pid, []

    def hear(progress):
        seen.append(progress.done)
        if len(seen) == 5:
            victim.close_gracefully()  # starts no other process, which takes seconds
            os.kill(process, signal.SIGKILL)

    common = {"samples": 2_500, "seed": 5, "order": 1}
    there = sweep_designs(
        case, variation, source=on_cluster(cluster.scheduler_address), progress=hear, **common
    )
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)
    assert seen == [*range(64, 2_500, 64), 2_500]
    assert there.measured["seconds"] > 0
    assert timeless(there) == timeless(sweep_designs(case, variation, **common))


@pytest.mark.nightly
def test_cluster_sweep_survives_frozen_worker(cluster, tmp_path):
    case = crank()
    variation = vary(tmp_path, case, tip={"at": "tip", "sigma": 1})
    frozen = next(iter(cluster.workers.values())).pid

    def freeze(progress):
        if progress.done == 1024:
            os.kill(frozen, signal.SIGSTOP)

    source = on_cluster(cluster.scheduler_address, silent=4.0)
    common = {"samples": 6_000, "seed": 5}
    try:
        there = sweep_designs(case, variation, source=source, progress=freeze, **common)
    finally:
        os.kill(frozen, signal.SIGCONT)
    assert timeless(there) == timeless(sweep_designs(case, variation, **common))


def test_sweep_reports_lost_cluster(tmp_path, monkeypatch):
    """Its scheduler and worker are threads: processes that go are in the test above."""
    from distributed import LocalCluster  # takes most of a second, which reading the tests saves

    # the time that a client waits for it to come back, too
    monkeypatch.setattr(ours, "CONNECT", 1.0)
    case = crank()
    cluster = LocalCluster(
        n_workers=1, processes=False, protocol="tcp://", dashboard_address=":0", silence_logs=50
    )

    def hear(progress):
        if progress.done == 4096:
            cluster.close()

    gone = r"scheduler tcp://.+: (was lost|every worker that had)"
    with cluster, pytest.raises(ClusterError, match=gone):
        sweep_designs(
            case,
            vary(tmp_path, case, tip={"at": "tip", "sigma": 1}),
            samples=500_000,
            source=on_cluster(cluster.scheduler_address),
            progress=hear,
        )


def test_sweep_without_scheduler_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(ours, "ANSWER", 0.25)
    case = crank()
    variation = vary(tmp_path, case, tip={"at": "tip", "sigma": 1})
    with pytest.raises(
        ClusterError, match=r"scheduler tcp://127.0.0.1:1: does not answer \(.+\). Start one with"
    ):
        sweep_designs(case, variation, samples=5, source=on_cluster("tcp://127.0.0.1:1"))
    monkeypatch.setattr(
        importlib, "import_module", lambda name: (_ for _ in ()).throw(ImportError(name))
    )
    with pytest.raises(ClusterError, match="pip install 'distributed>="):
        sweep_designs(case, variation, samples=5, source=on_cluster("tcp://127.0.0.1:1"))


def test_cluster_worker_reuses_its_model(tmp_path):
    case = crank()
    packed = pack(Study(case, vary(tmp_path, case, tip={"at": "tip", "sigma": 1}), 600, 0))
    version = importlib.metadata.version("kincheck")
    assert [solve_there(packed, k, version).index for k in (1, 2)] == [1, 2]
    (kept,) = (ready for ready in chunk_execution._ready.values() if ready.study.samples == 600)
    solve_there(packed, 0, version)
    assert kept in chunk_execution._ready.values()
    with pytest.raises(
        ClusterError,
        match=r"on the cluster's worker, expected 0.0.1 as in the sweep. Install the same there",
    ):
        solve_there(packed, 0, "0.0.1")
