"""The worker's side of a worker process: it reads pairs from its standard input and answers on its
standard output until the input ends.

Output printed by engines, from Python or from C, goes to standard error, which the parent always
reads to its end.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import pickle
import signal
import struct
import sys
from dataclasses import dataclass
from typing import Any, BinaryIO

from ..execution import Attempt, Failure, attempt, error_text
from ..record import Outcome
from ..resource_limits import restrict

LENGTH = struct.Struct("<Q")

# Longest message [bytes]; no answer reaches it (a million samples of a thousand outputs take 24 GB,
# and no case has them). A larger length is foreign data, written into the channel by mistake.
LONGEST = 1 << 34


def pack(message: Any) -> bytes:
    """Return a message as bytes."""
    return pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL)


def write(stream: BinaryIO, packed: bytes) -> None:
    """Send a packed message."""
    stream.write(LENGTH.pack(len(packed)))
    stream.write(packed)
    stream.flush()


def read(stream: BinaryIO) -> bytes:
    """Return the next message, packed.

    Raises:
        EOFError: the other side has ended, or sent no valid message.
    """
    head = stream.read(LENGTH.size)
    if len(head) < LENGTH.size or (length := LENGTH.unpack(head)[0]) > LONGEST:
        raise EOFError
    packed = stream.read(length)
    if len(packed) < length:
        raise EOFError
    return packed


READY = b"ready"


@dataclass(frozen=True)
class Setup:
    """The first message to a worker.

    Attributes:
        parent: process id of the parent.
        path: the parent's module search path.
        memory: largest memory of a pair [GB].
    """

    parent: int
    path: list[str]
    memory: float


def serve() -> None:
    """Answer pairs until the parent has ended, then end without the engines' exit handlers."""
    requests, answers = _channel()
    # a parent in the background ignores it; engines must behave alike in both
    signal.signal(signal.SIGINT, signal.default_int_handler)
    faulthandler.enable()  # a crash then prints its line of Python
    setup: Setup = pickle.loads(read(requests))
    sys.path[:] = setup.path
    _end_with(setup.parent)
    restrict(setup.memory)
    write(answers, READY)
    while True:
        try:
            packed = read(requests)
        except EOFError:
            os._exit(0)
        found = _solve(packed, answers)
        _flush()
        write(answers, _pack_answer(found))


def _channel() -> tuple[BinaryIO, BinaryIO]:
    """Return the pipes to the parent, which engines cannot reach."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)
    return requests, answers


def _solve(packed: bytes, answers: BinaryIO) -> Attempt:
    try:
        pair = pickle.loads(packed)  # imports the engine's module, which may run any code
        return attempt(pair, report=lambda facts: write(answers, pack(facts)))
    # KeyboardInterrupt too: the parent gets the terminal's, so this one is the engine's
    except BaseException as error:
        return Attempt(None, Failure(Outcome.ERROR, error_text(error)))


def _pack_answer(found: Attempt) -> bytes:
    try:
        return pack(found)
    except Exception as error:
        return pack(
            Attempt(
                found.facts,
                Failure(Outcome.ERROR, f"the answer cannot be sent: {error_text(error)}"),
            )
        )


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except Exception:  # an engine has closed or replaced it: there is nothing to flush
            continue
    if os.name == "posix":
        ctypes.CDLL(None).fflush(None)  # C prints only when its buffer is full


def _end_with(parent: int) -> None:
    """End this process with the parent: on Linux at once, even during a solve; elsewhere between
    pairs.
    """
    if sys.platform == "linux":
        library: Any = ctypes.CDLL(None)
        library.prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
        if os.getppid() != parent:  # the parent had already ended
            os._exit(0)
