"""A worker process from outside, and the seat that always has one: warm while all goes well,
another after a failure.
"""

from __future__ import annotations

import os
import pickle
import re
import signal
import subprocess
import sys
from collections.abc import Generator
from contextlib import contextmanager, suppress
from dataclasses import replace
from threading import Lock, Thread, Timer
from typing import IO, BinaryIO, cast

from ..execution import Attempt, Facts, Failure, bounded
from ..provenance import THREADS, readable
from ..record import Outcome
from ..resource_limits import STARTUP, Limits
from .messages import pack, read, write
from .serve import READY, Setup

COMMAND = "from kincheck.core.harness.workers.serve import serve; serve()"

# Bytes of output kept: the stack of a crash and the lines before it. The rest is read, so that
# nobody waits, and dropped.
TAIL = 8192

# For a process that is as good as gone, and its output, to go [s].
GOING = 5.0


class _Tail(Thread):
    """Reads a stream to its end, and keeps the last of it."""

    def __init__(self, stream: IO[bytes]) -> None:
        super().__init__(daemon=True)
        self.stream, self.kept = stream, b""

    def run(self) -> None:
        with self.stream:
            while chunk := os.read(self.stream.fileno(), 1 << 16):
                self.kept = (self.kept + chunk)[-TAIL:]

    @property
    def text(self) -> str:
        """What was kept; addresses, which are others every time, are left out."""
        return re.sub(r"0x[0-9a-f]{6,}", "0x...", self.kept.decode("utf-8", "replace")).strip()


class Worker:
    """A process that solves one pair at a time. It dies with the thread that made it."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self.fresh = True
        self.late: float | None = None
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", COMMAND],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            # threads that wait for each other, and for those of other workers, would be the
            # simulators' times
            env={**dict.fromkeys(THREADS, "1"), **os.environ},
            start_new_session=True,  # the terminal's interrupt is for the parent; and its children can be killed with it
        )
        self._in, self._out = (
            cast(BinaryIO, self.process.stdin),
            cast(BinaryIO, self.process.stdout),
        )
        self._tail = _Tail(cast(IO[bytes], self.process.stderr))
        self._tail.start()

    def solve(self, packed: bytes) -> Attempt:
        """Solve a packed pair. After a failure that is harmful the process is gone or should go."""
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
        except Exception:  # its end of the pipe is closed, or what came is no message
            return Attempt(facts, self._post_mortem())
        self.fresh = False
        return replace(message, facts=message.facts or facts)

    def close(self) -> str:
        """Kill the process and what it has started, and give the last that they printed."""
        self.kill()
        self.process.wait()
        # longer only where a process that has left the group keeps the pipe open
        self._tail.join(GOING)
        for stream in (self._in, self._out):
            with suppress(OSError):  # what is left unsent has nobody to go to
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
        # still there although it will not answer: close() ends it
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


class Seat:
    """A place for a worker of one engine. A failure in a worker that was used before is tried once
    more in a new one.

    So no pair pays for what another has left behind, and which pairs came before does not show in
    the outcome.
    """

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self._lock = Lock()
        self._worker: Worker | None = None
        self._stopped = False

    def solve(self, packed: bytes) -> Attempt:
        """Solve a packed pair."""
        while True:
            worker = self._seated()
            if worker is None:
                return Attempt(None, Failure(Outcome.ERROR, "stopped"))
            used = not worker.fresh
            found = worker.solve(packed)
            failure = (
                found.result if isinstance(found.result, Failure) and found.result.harmful else None
            )
            if failure is None and worker.late is None:
                return found
            printed = self.close()
            if failure is None:
                return found
            if not used:
                failure = replace(failure, printed=failure.printed or readable(printed))
                return replace(found, result=failure)

    def _seated(self) -> Worker | None:
        with self._lock:
            if self._worker is None and not self._stopped:
                self._worker = Worker(self.limits)
            return self._worker

    def close(self) -> str:
        """Have no worker, and give the last that it printed."""
        with self._lock:
            worker, self._worker = self._worker, None
        return worker.close() if worker else ""

    def stop(self) -> None:
        """Have no worker any more, from another thread: what is being solved fails, and the thread
        that solves it tidies up.
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
    """The last that was said before the end, and the line of Python where that was, if faulthandler
    has told.
    """
    before, _, stack = printed.partition("Fatal Python error:")
    lines = [line.strip() for line in before.splitlines() if line.strip()]
    at = re.search(r"^ *File (.+)$", stack, re.MULTILINE)
    return (f" in {at[1]}" if at else "") + (
        f"; it last printed: {bounded(lines[-1])}" if lines else ""
    )
