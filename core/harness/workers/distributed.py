"""Solution of pairs on a dask.distributed cluster: one task per pair, each in a worker process on
the cluster's machine, so that limits hold there too.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from threading import Lock
from typing import Any
from urllib.parse import urlsplit
from uuid import uuid4

from ...errors import KincheckError
from ...extras import library
from ...version import VERSION
from ..execution import Attempt, Attempts, Failure, Pair, Solver, error_text
from ..record import Outcome
from ..resource_limits import Limits
from .messages import pack
from .worker import WorkerSlot

# Longest time for a port to answer [s], and then for its scheduler. Each takes milliseconds unless
# packets are lost, which are sent again after 1 s and after 3 s.
ANSWER = 5.0
# Longest time for a second answer of the scheduler, if a packet is lost [s].
CONNECT = 20.0


class ClusterError(KincheckError):
    """A cluster cannot be reached, or was lost."""


def on_cluster(address: str, limits: Limits) -> Solver:
    """Return the solver on the workers of a scheduler.

    If a worker is lost, another one solves its pair; each result is yielded once.

    Raises:
        ClusterError: dask.distributed is not installed, the scheduler does not answer, or it was
            lost meanwhile.
    """

    def solve(pairs: Sequence[Pair]) -> Attempts:
        distributed = loaded()
        with connected(distributed, address) as client:
            yield from _gathered(distributed, client, address, pairs, limits)

    return solve


def connected(distributed: Any, address: str) -> Any:
    """Return a client of the scheduler, for use in a `with` statement.

    Raises:
        ClusterError: the address is invalid, or no scheduler answers there.
    """
    try:
        # before the client, which waits for its scheduler without end; in a thread, since a
        # notebook's thread already has an event loop
        with ThreadPoolExecutor(1) as aside:
            aside.submit(
                asyncio.run, asyncio.wait_for(_asked(distributed, address), 2.0 * ANSWER)
            ).result()
        return distributed.Client(address, timeout=CONNECT, set_as_default=False)
    except OSError as error:
        raise ClusterError(
            f"scheduler {address}: does not answer ({error_text(error)}); start one with"
            " `dask scheduler` and workers with `dask worker ADDRESS`, where kincheck and the"
            " engines are installed"
        ) from error
    except (ValueError, TypeError) as error:
        raise ClusterError(
            f"scheduler {address}: found no address ({error_text(error)}), expected HOST:PORT or"
            " tcp://HOST:PORT; write it as `dask scheduler` prints it"
        ) from error


async def _asked(distributed: Any, address: str) -> None:
    place = urlsplit(address if "://" in address else f"//{address}")
    # a port out of range raises ValueError on access
    if not place.hostname or place.port == 0:
        raise ValueError("no host and port")
    comm = await distributed.comm.connect(
        address, timeout=ANSWER, **distributed.Security().get_connection_args("client")
    )
    await comm.close()


def _gathered(
    distributed: Any, client: Any, address: str, pairs: Sequence[Pair], limits: Limits
) -> Attempts:
    # for tasks: the scheduler treats equal names as one task
    name = f"kincheck-{uuid4().hex}"
    tasks = dict[Any, int]()
    for index, pair in enumerate(pairs):
        try:
            packed = pack(pair)
        except Exception as error:  # from the engine's own pickling
            yield (
                index,
                Attempt(
                    None,
                    Failure(
                        Outcome.ERROR,
                        f"cannot be sent to a cluster: {error_text(error)}; define it in a module",
                    ),
                ),
            )
            continue
        engine = f"{pair.engine.name} {pair.engine.mode}"
        task = client.submit(
            solve_there, packed, engine, limits, VERSION, key=f"{name}-{index}", pure=False
        )
        tasks[task] = index
    for task in distributed.as_completed(tasks, loop=client.loop):
        try:
            found: Attempt = task.result()
        except distributed.scheduler.KilledWorker as error:
            found = Attempt(
                None,
                Failure(
                    Outcome.CRASHED, f"every worker that tried it was lost: {error_text(error)}"
                ),
            )
        except (OSError, distributed.CancelledError) as error:
            raise ClusterError(
                f"scheduler {address}: was lost ({error_text(error)}); run again with --resume when"
                " it is back"
            ) from error
        # from the cluster, around the worker process, e.g. no process can be started
        except Exception as error:
            found = Attempt(
                None,
                Failure(Outcome.ERROR, f"the cluster's worker cannot solve: {error_text(error)}"),
            )
        task.release()
        yield tasks[task], found


def loaded() -> Any:
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
