"""Solution of pairs in worker processes of this machine, several at a time."""

from __future__ import annotations

import os
import pickle
import re
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Generator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from queue import SimpleQueue
from threading import Lock, Thread, Timer
from typing import IO, BinaryIO, cast

from ...extras import THREADS
from ..engine import Engine, runs_in_process
from ..execution import (
    Attempt,
    Attempts,
    Facts,
    Failure,
    Pair,
    Solver,
    error_text,
    shorten_text,
    solve_in_process,
)
from ..provenance import readable
from ..record import Outcome
from ..resource_limits import STARTUP, Limits, default_jobs
from .serve import READY, Setup, pack, read, write

COMMAND = "from kincheck.core.harness.workers.serve import serve; serve()"

# Bytes of output kept: the stack of a crash and the lines before it. The rest is read, so that no
# writer blocks, and discarded.
TAIL = 8192

# Longest wait for the output of an ended process to close [s].
GOING = 5.0


class _Tail(Thread):
    """Thread for a stream: it reads to the end and keeps the last part."""

    def __init__(self, stream: IO[bytes]) -> None:
        super().__init__(daemon=True)
        self.stream, self.kept = stream, b""

    def run(self) -> None:
        with self.stream:
            while chunk := os.read(self.stream.fileno(), 1 << 16):
                self.kept = (self.kept + chunk)[-TAIL:]

    @property
    def text(self) -> str:
        """The kept text without memory addresses, which differ from run to run."""
        return re.sub(r"0x[0-9a-f]{6,}", "0x...", self.kept.decode("utf-8", "replace")).strip()


class Worker:
    """A process for one pair at a time. It ends with its parent thread."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self.fresh = True
        self.late: float | None = None
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", COMMAND],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            # otherwise threads wait for each other and for other workers' threads, and times
            # include this
            env={**dict.fromkeys(THREADS, "1"), **os.environ},
            # the terminal's interrupt is for the parent; the group lets the parent kill children of
            # the worker too
            start_new_session=True,
        )
        self._in, self._out = (
            cast(BinaryIO, self.process.stdin),
            cast(BinaryIO, self.process.stdout),
        )
        self._tail = _Tail(cast(IO[bytes], self.process.stderr))
        self._tail.start()

    def solve(self, packed: bytes) -> Attempt:
        """Solve a packed pair. After a harmful failure the process must be closed."""
        facts: Facts | None = None
        try:
            if self.fresh:
                with self._within(STARTUP):
                    write(self._in, pack(Setup(os.getpid(), sys.path, self.limits.memory)))
                    if read(self._out) != READY:
                        raise EOFError
            with self._within(self.limits.timeout):
                write(self._in, packed)
                while not isinstance(message := pickle.loads(read(self._out)), Attempt):
                    facts = message
        except Exception:  # its end of the pipe is closed, or the bytes are no message
            return Attempt(facts, self._post_mortem())
        self.fresh = False
        return replace(message, facts=message.facts or facts)

    def close(self) -> str:
        """Kill the process and its children, and return the end of their output."""
        self.kill()
        self.process.wait()
        # it stays open only if a process outside the group holds the pipe
        self._tail.join(GOING)
        for stream in (self._in, self._out):
            with suppress(OSError):  # unsent data has no receiver
                stream.close()
        return self._tail.text

    def kill(self) -> None:
        """Kill the process and its children at once."""
        if hasattr(os, "killpg"):
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.process.pid, signal.SIGKILL)
        if self.process.returncode is None:
            self.process.kill()

    @contextmanager
    def _within(self, seconds: float) -> Generator[None]:
        def give_up() -> None:
            self.late = seconds
            self.kill()

        timer = Timer(seconds, give_up)
        timer.daemon = True
        timer.start()
        try:
            yield
        finally:
            timer.cancel()

    def _post_mortem(self) -> Failure:
        # still running without an answer: close() ends it
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(GOING)
        status = self.process.returncode
        printed = self.close()
        if self.late is not None:
            how = f"no answer within {self.late:g} s; the process was killed"
            return Failure(Outcome.TIMEOUT, how + _last(printed), readable(printed))
        if status is None:
            how = "the process no longer answers"
        elif status < 0:
            how = f"the process died of {_name(-status)}"
        else:
            how = f"the process ended with status {status} before it had an answer"
        return Failure(Outcome.CRASHED, how + _last(printed), readable(printed))


class WorkerSlot:
    """A slot for a worker of one engine.

    A pair that fails in a used worker is repeated once in a new one, so no outcome depends on
    earlier pairs.
    """

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self._lock = Lock()
        self._worker: Worker | None = None
        self._stopped = False

    def solve(self, packed: bytes) -> Attempt:
        """Solve a packed pair."""
        while True:
            worker = self._take_worker()
            if worker is None:
                return Attempt(None, Failure(Outcome.ERROR, "stopped"))
            used = not worker.fresh
            found = worker.solve(packed)
            # a failure that may leave the process in a corrupt state
            result = found.result
            failure = result if isinstance(result, Failure) and result.outcome.bad else None
            if failure is None and worker.late is None:
                return found
            printed = self.close()
            if failure is None:
                return found
            if not used:
                failure = replace(failure, printed=failure.printed or readable(printed))
                return replace(found, result=failure)

    def _take_worker(self) -> Worker | None:
        with self._lock:
            if self._worker is None and not self._stopped:
                self._worker = Worker(self.limits)
            return self._worker

    def close(self) -> str:
        """Remove the worker and return the end of its output."""
        with self._lock:
            worker, self._worker = self._worker, None
        return worker.close() if worker else ""

    def stop(self) -> None:
        """Stop the worker from another thread: the current pair fails, and the solving thread
        cleans up.
        """
        with self._lock:
            self._stopped = True
            if self._worker is not None:
                self._worker.kill()


def _name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:  # real-time signals have no names
        return f"signal {number}"


def _last(printed: str) -> str:
    """Return the last line printed before the end, and faulthandler's line of Python, if any."""
    before, _, stack = printed.partition("Fatal Python error:")
    lines = [line.strip() for line in before.splitlines() if line.strip()]
    at = re.search(r"^ *File (.+)$", stack, re.MULTILINE)
    return (f" in {at[1]}" if at else "") + (
        f"; it last printed: {shorten_text(lines[-1])}" if lines else ""
    )


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
        jobs = 0 if limits is None and all(map(runs_in_process, engines)) else default_jobs()
    return (in_workers(jobs, limits or Limits()), jobs) if jobs else (solve_in_process, 0)


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
                thread.slot.stop()
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
