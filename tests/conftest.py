"""What several rooms are tested with."""

from pathlib import Path

import pytest


@pytest.fixture
def cluster(monkeypatch):
    """A dask.distributed cluster of two workers, with a real scheduler, on loopback."""
    distributed = pytest.importorskip("distributed")
    monkeypatch.syspath_prepend(str(Path(__file__).parent.parent))  # for its workers too, which are spawned from here
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as found:
        yield found
