"""Solution of pairs in worker processes of this machine, several at a time."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from queue import SimpleQueue
from threading import Lock, Thread

from ..engine import Engine, may_run_here
from ..execution import Attempt, Attempts, Failure, Pair, Solver, error_text, here
from ..record import Outcome
from ..resource_limits import Limits, default_jobs
from .messages import pack
from .worker import WorkerSlot


def solver_for(
    engines: Sequence[Engine], jobs: int | None = None, limits: Limits | None = None
) -> tuple[Solver, int]:
    """Return the solver of pairs of these engines, and its number of worker processes.

    Args:
        jobs: number of worker processes; 0 solves in this process, without limits. By default half
            the processors, and 0 if every engine may run in this process and no limit is given: a
            process would cost more time than most cases take natively.
    """
    if jobs is None:
        jobs = 0 if limits is None and all(map(may_run_here, engines)) else default_jobs()
    return (in_workers(jobs, limits or Limits()), jobs) if jobs else (here, 0)


def in_workers(jobs: int, limits: Limits) -> Solver:
    """Return the solver with `jobs` worker processes, each kept for one engine at a time."""

    def solve(pairs: Sequence[Pair]) -> Attempts:
        waiting = _Waiting(pairs)
        through: SimpleQueue[tuple[int, Attempt] | BaseException] = SimpleQueue()
        threads = [
            _SlotThread(waiting, pairs, limits, through) for _ in range(min(jobs, len(pairs)))
        ]
        try:
            for thread in threads:
                thread.start()
            for _ in pairs:
                found = through.get()
                if isinstance(found, BaseException):
                    raise found
                yield found
        finally:
            waiting.clear()
            for thread in threads:
                thread.stop()
            for thread in threads:
                thread.join()

    return solve


class _Waiting:
    """The pairs not yet taken, by engine."""

    def __init__(self, pairs: Sequence[Pair]) -> None:
        self.lock = Lock()
        self.queues: dict[str, deque[int]] = {}
        self.takers: dict[str, int] = {}
        for index, pair in enumerate(pairs):
            self.queues.setdefault(f"{pair.engine.name} {pair.engine.mode}", deque()).append(index)

    def take(self, engine: str | None) -> tuple[str, int] | None:
        """Return the next pair of the engine; if it has none left, one of the engine with the
        fewest workers.
        """
        with self.lock:
            if engine is None or not self.queues.get(engine):
                left = [name for name, queue in self.queues.items() if queue]
                if not left:
                    return None
                engine = min(left, key=lambda name: self.takers.get(name, 0))
                self.takers[engine] = self.takers.get(engine, 0) + 1
            return engine, self.queues[engine].popleft()

    def clear(self) -> None:
        """Remove all pairs."""
        with self.lock:
            self.queues.clear()


class _SlotThread(Thread):
    """Thread that solves one pair at a time with one worker; see `Worker`."""

    def __init__(
        self,
        waiting: _Waiting,
        pairs: Sequence[Pair],
        limits: Limits,
        through: SimpleQueue[tuple[int, Attempt] | BaseException],
    ) -> None:
        super().__init__(daemon=True)
        self.waiting, self.pairs, self.through = waiting, pairs, through
        self.slot = WorkerSlot(limits)

    def run(self) -> None:
        engine: str | None = None
        try:
            while taken := self.waiting.take(engine):
                if taken[0] != engine:
                    self.slot.close()
                engine, index = taken
                self.through.put((index, solve_packed(self.pairs[index], self.slot)))
        except (
            BaseException
        ) as error:  # a defect of kincheck, for the run: exceptions end in their thread
            self.through.put(error)
        finally:
            self.slot.close()

    def stop(self) -> None:
        """Stop soon, even during a solve."""
        self.slot.stop()


def solve_packed(pair: Pair, slot: WorkerSlot) -> Attempt:
    """Solve a pair with a worker; a pair that cannot be pickled fails."""
    try:
        packed = pack(pair)
    except Exception as error:  # from the engine's own pickling
        message = (
            f"cannot be sent to a worker process: {error_text(error)}; define it in a module, or"
            " solve in this process (--jobs 0)"
        )
        return Attempt(None, Failure(Outcome.ERROR, message))
    return slot.solve(packed)
