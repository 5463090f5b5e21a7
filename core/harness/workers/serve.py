"""A worker process from inside: it reads pairs from its standard input and answers on its standard
output until that ends.

What engines print, from Python or from C, goes to standard error, which the parent reads to its end
at all times.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import pickle
import signal
import sys
from dataclasses import dataclass
from typing import Any, BinaryIO

from ..execution import Attempt, Failure, attempt, said
from ..record import Outcome
from ..resource_limits import restrict
from .messages import pack, read, write

READY = b"ready"


@dataclass(frozen=True)
class Setup:
    """The first message to a worker: its parent, where that finds modules, and how much memory a
    pair may take [GB].
    """

    parent: int
    path: list[str]
    memory: float


def serve() -> None:
    """Answer pairs until there is no parent any more. Ends the process, without the simulators' own
    ways of going down.
    """
    requests, answers = _channel()
    # a parent in the background has it ignored; engines shall not differ
    signal.signal(signal.SIGINT, signal.default_int_handler)
    faulthandler.enable()  # a crash then tells the line of Python it came from
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
        write(answers, _packed(found))


def _channel() -> tuple[BinaryIO, BinaryIO]:
    """The pipes to the parent, out of the engines' way."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)
    return requests, answers


def _solve(packed: bytes, answers: BinaryIO) -> Attempt:
    try:
        pair = pickle.loads(packed)  # imports the engine's module, which may do anything
        return attempt(pair, tell=lambda facts: write(answers, pack(facts)))
    except BaseException as error:  # KeyboardInterrupt too: the terminal's goes to the parent, so this one is the engine's
        return Attempt(None, Failure(Outcome.ERROR, said(error)))


def _packed(found: Attempt) -> bytes:
    try:
        return pack(found)
    except Exception as error:
        return pack(
            Attempt(
                found.facts, Failure(Outcome.ERROR, f"the answer cannot be sent: {said(error)}")
            )
        )


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except Exception:  # an engine has closed or replaced it: there is nothing to flush
            continue
    if os.name == "posix":
        ctypes.CDLL(None).fflush(None)  # C keeps what it prints until it has a bufferful


def _end_with(parent: int) -> None:
    """Be killed with the parent, even in the middle of a pair that will never end. Elsewhere than
    on Linux, only between pairs.
    """
    if sys.platform == "linux":
        library: Any = ctypes.CDLL(None)
        library.prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
        if os.getppid() != parent:  # it was gone before
            os._exit(0)
