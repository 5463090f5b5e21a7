"""Solution of pairs on a dask.distributed cluster: one task per pair, each in a worker process on
the cluster's machine, so that limits hold there too.

Tasks and answers are pickles: whoever runs or reaches the scheduler runs code on the workers and in
this process.
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from threading import Lock
from time import monotonic
from typing import Any
from urllib.parse import urlsplit
from uuid import uuid4

from ...cli.engine_source import WorkersError
from ...errors import KincheckError
from ...extras import library
from ...harness.execution import Attempt, Attempts, Failure, Pair, Solver, error_text
from ...harness.record import Outcome
from ...harness.resource_limits import Limits
from ...harness.workers.pool import WorkerSlot
from ...harness.workers.serve import pack
from ...version import VERSION

# Longest time for a port to answer [s], and then for its scheduler. Each takes milliseconds unless
# packets are lost, which are sent again after 1 s and after 3 s.
ANSWER = 5.0
# Longest time for a second answer of the scheduler, if a packet is lost [s].
CONNECT = 20.0
# Longest time without a heartbeat of a worker [s], and the shortest limit of it: up to 500 workers
# send one every 5 s or more often, and only a busy machine delays it.
SILENT, HEARTBEATS = 30.0, 10.0
# Interval between two looks at the workers [s].
LOOK = 1.0
# Most workers that may fall silent with a task.
TRIES = 3
LIBRARIES = "distributed", "tornado", "asyncio"
"""Loggers with tracebacks of a connection that breaks."""


class ClusterError(WorkersError):
    """A cluster cannot be reached, or was lost."""


def on_cluster(address: str, limits: Limits, silent: float = SILENT) -> Solver:
    """Return the solver on the workers of a scheduler.

    If a worker is lost or silent, another one solves its pair; each result is yielded once.

    Args:
        silent: longest time without a heartbeat of a worker [s], if the limit of time is not
            shorter.

    Raises:
        ClusterError: dask.distributed is not installed, the scheduler does not answer, or it was
            lost meanwhile.
    """

    def solve(pairs: Sequence[Pair]) -> Attempts:
        with connect_client(load_distributed(), address) as client:
            patience = min(silent, max(HEARTBEATS, limits.timeout))
            yield from _gather_answers(Tasks(client, address, patience), pairs, limits)

    return solve


@contextmanager
def connect_client(distributed: Any, address: str) -> Generator[Any]:
    """Yield a client of the scheduler. The log of the library is off: errors say what it says.

    Raises:
        ClusterError: the address is invalid, or no scheduler answers there.
    """
    with _without_log():
        try:
            # before the client, which waits for its scheduler without end; in a thread, since a
            # notebook's thread already has an event loop
            with ThreadPoolExecutor(1) as aside:
                aside.submit(
                    asyncio.run,
                    asyncio.wait_for(_try_connection(distributed, address), 2.0 * ANSWER),
                ).result()
            client = distributed.Client(address, timeout=CONNECT, set_as_default=False)
        except OSError as error:
            raise ClusterError(
                f"scheduler {address}: does not answer ({error_text(error)}). Start one with"
                " `dask scheduler` and workers with `dask worker ADDRESS`, where kincheck and the"
                " engines are installed."
            ) from error
        except (ValueError, TypeError) as error:
            raise ClusterError(
                f"scheduler {address}: found no address ({error_text(error)}), expected HOST:PORT"
                " or tcp://HOST:PORT. Write it as `dask scheduler` prints it."
            ) from error
        with client:
            yield client


async def _try_connection(distributed: Any, address: str) -> None:
    place = urlsplit(address if "://" in address else f"//{address}")
    # a port out of range raises ValueError on access
    if not place.hostname or place.port == 0:
        raise ValueError("no host and port")
    comm = await distributed.comm.connect(
        address, timeout=ANSWER, **distributed.Security().get_connection_args("client")
    )
    await comm.close()


@contextmanager
def _without_log() -> Generator[None]:
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] in LIBRARIES]
    loggers = [each for each in map(logging.getLogger, names) if not each.disabled]
    for each in loggers:
        each.disabled = True
    try:
        yield
    finally:
        for each in loggers:
            each.disabled = False


class Tasks:
    """Tasks on a cluster; each answer comes once, in any order.

    A task of a worker that dies or falls silent is done by another one.

    Args:
        patience: longest time without a heartbeat of a worker [s].
    """

    def __init__(self, client: Any, address: str, patience: float) -> None:
        self.threads = 1
        self._client, self._address, self._patience = client, address, patience
        self._name = f"kincheck-{uuid4().hex}"  # the scheduler treats equal names as one task
        self._calls: dict[Any, tuple[int, Sequence[Any]]] = {}
        self._moved, self._left = Counter[int](), list[Any]()
        self._finished: SimpleQueue[Any] = SimpleQueue()
        self._given_up: list[tuple[int, Exception]] = []
        self._heard: dict[str, tuple[float, float]] = {}
        self._looked = 0.0

    def __len__(self) -> int:
        return len(self._calls) + len(self._given_up)

    def submit(self, index: int, call: Sequence[Any], workers: Sequence[str] | None = None) -> None:
        """Submit a task: a function and its arguments; if possible to these workers."""
        key = f"{self._name}-{index}-{self._moved[index]}"
        among = {"workers": workers, "allow_other_workers": True} if workers else {}
        task = self._client.submit(*call, key=key, pure=False, **among)
        self._calls[task] = index, call
        task.add_done_callback(self._finished.put)

    def next(self) -> tuple[int, Any]:
        """Wait for the next answer; return the index of its task and the answer, or the exception
        in place of one: TimeoutError if no worker answers.

        Raises:
            ClusterError: the scheduler was lost.
        """
        while True:
            self._look()
            if self._given_up:
                return self._given_up.pop()
            try:
                task = self._finished.get(timeout=LOOK)
            except Empty:
                continue
            if task not in self._calls:  # done at last by a worker that had been silent
                continue
            try:
                answer = (task.exception if task.status == "error" else task.result)(self._patience)
            except TimeoutError:  # done, and its worker fell silent before it was fetched
                self._move([task], self._workers()[1])
            except Exception as error:  # cancelled: the connection is gone
                raise self._lost(error) from error
            else:
                index, _ = self._calls.pop(task)
                task.release()
                return index, answer

    def _look(self) -> None:
        """Move the tasks of silent workers to others."""
        if monotonic() < self._looked + LOOK:
            return
        silent, live = self._workers()
        self._looked = monotonic()
        if silent:
            held = self._ask("processing")
            keys = {key for worker in silent for key in held.get(worker, ())}
            self._move([task for task in self._calls if not live or task.key in keys], live)

    def _workers(self) -> tuple[list[str], list[str]]:
        """Return the silent workers and the others."""
        found, now = self._ask("identity")["workers"], monotonic()
        for worker, facts in found.items():
            if self._heard.get(worker, (None,))[0] != facts["last_seen"]:
                self._heard[worker] = facts["last_seen"], now
        live = [each for each in found if now - self._heard[each][1] <= self._patience]
        self.threads = max(1, sum(found[each]["nthreads"] for each in live))
        return [each for each in found if each not in live], live

    def _move(self, tasks: Sequence[Any], live: Sequence[str]) -> None:
        for task in tasks:
            index, call = self._calls.pop(task)
            # not cancelled: a silent worker with free threads would get further tasks
            self._left.append(task)
            self._moved[index] += 1
            if live and self._moved[index] < TRIES:
                self.submit(index, call, live)
            else:
                why = f"no answer within {self._patience:g} s: the cluster's worker was silent"
                self._given_up.append((index, TimeoutError(why)))

    def _ask(self, what: str) -> Any:
        try:
            if self._client.status != "running":  # a question would wait for a new connection
                raise ConnectionError("the connection is closed")
            return self._client.sync(
                getattr(self._client.scheduler, what), callback_timeout=CONNECT
            )
        except (OSError, RuntimeError, ValueError) as error:  # of a connection that closes
            raise self._lost(error) from error

    def _lost(self, error: Exception) -> ClusterError:
        return ClusterError(
            f"scheduler {self._address}: was lost ({error_text(error)}); repeat the command with"
            " --resume when it is back"
        )


def _gather_answers(tasks: Tasks, pairs: Sequence[Pair], limits: Limits) -> Attempts:
    for index, pair in enumerate(pairs):
        try:
            packed = pack(pair)
        except Exception as error:  # from the engine's own pickling
            why = f"cannot be sent to a cluster: {error_text(error)}; define it in a module"
            yield index, Attempt(None, Failure(Outcome.ERROR, why))
            continue
        engine = f"{pair.engine.name} {pair.engine.mode}"
        tasks.submit(index, (solve_there, packed, engine, limits, VERSION))
    while tasks:
        index, found = tasks.next()
        if type(found).__name__ == "KilledWorker":
            why = f"every worker that tried it was lost: {error_text(found)}"
            found = Attempt(None, Failure(Outcome.CRASHED, why))
        elif isinstance(found, TimeoutError):
            found = Attempt(None, Failure(Outcome.TIMEOUT, str(found)))
        # from the cluster, around the worker process, e.g. no process can be started
        elif isinstance(found, Exception):
            why = f"the cluster's worker cannot solve: {error_text(found)}"
            found = Attempt(None, Failure(Outcome.ERROR, why))
        yield index, found


def load_distributed() -> Any:
    """Return the package distributed.

    Raises:
        ClusterError: it is not installed.
    """
    try:
        return library("--scheduler", "distributed", "distributed")
    except KincheckError as error:
        raise ClusterError(str(error)) from error


_idle: dict[tuple[str, Limits], list[WorkerSlot]] = {}
_lock = Lock()


def solve_there(packed: bytes, engine: str, limits: Limits, version: str) -> Attempt:
    """Solve a packed pair in a process beside this cluster worker, kept for later pairs."""
    if version != VERSION:
        message = (
            f"kincheck {VERSION} on the cluster's worker, expected {version} as in the run; install"
            " the same there"
        )
        return Attempt(None, Failure(Outcome.ERROR, message))
    with _lock:
        idle = _idle.setdefault((engine, limits), [])
        slot = idle.pop() if idle else WorkerSlot(limits)
    found = slot.solve(packed)
    with _lock:
        idle.append(slot)
    return found
