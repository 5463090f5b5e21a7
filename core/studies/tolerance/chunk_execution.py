"""Execution of a study's chunks in threads or on a cluster: in order, a few at a time."""

from __future__ import annotations

import hashlib
import pickle
from collections import OrderedDict, deque
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from threading import Lock
from typing import Any, TypeAlias

from ...harness.execution import error_text
from ...harness.workers.distributed import SILENT, ClusterError, Tasks, connected, loaded
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


def on_cluster(address: str, silent: float = SILENT) -> Source:
    """Return the source on the workers of a dask.distributed scheduler.

    If a worker is lost or silent, other workers repeat its tasks.

    Args:
        silent: longest time without a heartbeat of a worker [s].

    Raises:
        ClusterError: dask.distributed is not installed, the scheduler does not answer or
            disappeared, every worker of a task was lost, or a worker cannot solve.
    """

    def solve(study: Study, first: int = 0) -> Chunks:
        packed, ready = pack(study), dict[int, Chunk]()
        with connected(loaded(), address) as client:
            tasks = Tasks(client, address, silent)
            waiting = iter(range(first, study.chunks))
            for index in range(first, study.chunks):
                while index not in ready:
                    # asked each time: workers may come and go
                    more = AHEAD * tasks.threads - len(tasks) - len(ready)
                    for late in islice(waiting, max(0, more)):
                        tasks.submit(late, (solve_there, packed, late, VERSION))
                    number, found = tasks.next()
                    ready[number] = _answered(found, address)
                yield ready.pop(index)

    return solve


def _answered(found: Chunk | Exception, address: str) -> Chunk:
    """Return a chunk; raise an exception in its place with an explanation."""
    if isinstance(found, Chunk):
        return found
    if isinstance(found, ClusterError):
        raise found
    why = error_text(found)
    if type(found).__name__ == "KilledWorker":
        why = f"every worker that had some chunks was lost: {why}"
    elif not isinstance(found, TimeoutError):
        why = f"a worker cannot solve: {why}"
    raise ClusterError(f"scheduler {address}: {why}") from found


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
