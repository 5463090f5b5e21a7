"""Execution of a study's chunks in threads or on a cluster: in order, a few at a time."""

from __future__ import annotations

import hashlib
import pickle
from collections import OrderedDict, deque
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import Lock
from typing import Any, TypeAlias
from uuid import uuid4

from ...errors import KincheckError
from ...harness.execution import error_text
from ...harness.workers.distributed import ClusterError, connected, loaded
from ...harness.workers.messages import pack
from ...version import VERSION
from .chunk import Chunk
from .study import Ready, Study

Chunks: TypeAlias = Generator[Chunk]
Source: TypeAlias = Callable[[Study, int], Chunks]
"""Solves the chunks of a study from an index on, and yields each chunk once, in order."""

# Chunks in progress for each thread: the thread solves one, the others wait for their turn.
AHEAD = 3


def on_threads(ready: Ready, jobs: int) -> Source:
    """Return the source in threads of this process; the programs run without Python's lock."""

    def solve(study: Study, first: int = 0) -> Chunks:
        if jobs == 1:
            yield from map(ready.chunk, range(first, study.chunks))
            return
        waiting = deque[Any]()
        with ThreadPoolExecutor(jobs) as pool:
            try:
                for index in range(first, study.chunks):
                    waiting.append(pool.submit(ready.chunk, index))
                    if len(waiting) >= AHEAD * jobs:
                        yield waiting.popleft().result()
                while waiting:
                    yield waiting.popleft().result()
            finally:
                pool.shutdown(wait=True, cancel_futures=True)

    return solve


def on_cluster(address: str) -> Source:
    """Return the source on the workers of a dask.distributed scheduler.

    If a worker is lost, other workers repeat its tasks.

    Raises:
        ClusterError: dask.distributed is not installed, the scheduler does not answer or
            disappeared, every worker of a task was lost, or a worker cannot solve.
    """

    def solve(study: Study, first: int = 0) -> Chunks:
        distributed = loaded()
        packed = pack(study)
        # the scheduler takes tasks with equal names for one task
        name = f"kincheck-sweep-{uuid4().hex}"
        with connected(distributed, address) as client, _explained(distributed, address):
            waiting = deque[Any]()
            for index in range(first, study.chunks):
                task: Any = client.submit(
                    solve_there, packed, index, VERSION, key=f"{name}-{index}", pure=False
                )
                waiting.append(task)
                # asked each time: workers may come and go
                if len(waiting) >= AHEAD * max(1, sum(client.nthreads().values())):
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()

    return solve


@contextmanager
def _explained(distributed: Any, address: str) -> Generator[None]:
    """Turn errors of a cluster into errors with an explanation."""
    try:
        yield
    except KincheckError:
        raise
    except distributed.scheduler.KilledWorker as error:
        raise ClusterError(
            f"scheduler {address}: every worker that had some chunks was lost: {error_text(error)}"
        ) from error
    except (OSError, distributed.CancelledError, TimeoutError) as error:
        raise ClusterError(
            f"scheduler {address}: was lost ({error_text(error)}); sweep again when it is back"
        ) from error
    except Exception as error:
        raise ClusterError(
            f"scheduler {address}: a worker cannot solve: {error_text(error)}"
        ) from error


_ready: OrderedDict[bytes, Ready] = OrderedDict()
_lock = Lock()


def solve_there(packed: bytes, index: int, version: str) -> Chunk:
    """Solve a chunk in a worker of a cluster. The worker keeps the compiled model for later chunks.

    Raises:
        ClusterError: the worker has another version of kincheck.
    """
    if version != VERSION:
        raise ClusterError(
            f"kincheck {VERSION} on the cluster's worker, expected {version} as in the sweep;"
            " install the same there"
        )
    key = hashlib.sha256(packed).digest()
    with _lock:  # a worker's threads share the model; a worker keeps the models of two studies
        if key not in _ready:
            _ready[key] = Ready.of(pickle.loads(packed))
            if len(_ready) > 2:
                _ready.popitem(last=False)
        ready = _ready[key]
    return ready.chunk(index)
