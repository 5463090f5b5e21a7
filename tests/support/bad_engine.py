"""An engine that breaks in a way of its own for each case: deliberately, and as real ones do."""

import ctypes
import os
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .fakes import Fake, off, solution


class Weird(Exception):
    """Neither its text nor its pickle can be had, and it is huge."""

    def __init__(self):
        super().__init__(lambda: None, "x" * 50_000_000)

    def __str__(self):
        return 42

    def __reduce__(self):
        raise TypeError("no")


def deaf(case):
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    if told := os.environ.get("KINCHECK_TEST_DEAF"):  # a file, for who waits for it to be so
        Path(told).touch()
    while True:
        time.sleep(0.01)


def flooding(case):
    for _ in range(1600):
        os.write(1, b"x" * 65535 + b"\n")  # 105 MB in all, by the file descriptor
    print("the end of the flood", file=sys.stderr)
    return solution(case)


def weird(case):
    raise Weird


def lengthy(case):
    raise ValueError("y" * 50_000_000)


KINDS = {
    "right": solution,
    "segfault": lambda case: ctypes.string_at(0),
    "abort": lambda case: os.abort(),
    "system_exit": lambda case: sys.exit(0),
    "exit": lambda case: os._exit(3),
    "deaf": deaf,
    "memory": lambda case: np.ones(10**9),
    "flood": flooding,
    "shapes": off("position", lambda p: p[1:]),
    "nan": off("velocity", lambda v: v * np.nan),
    "weird": weird,
    "lengthy": lengthy,
    "interrupt": lambda case: signal.raise_signal(signal.SIGINT),
}


@dataclass
class Bad(Fake):
    """Right where the case's name is not one of its kinds."""

    name: str = "bad"

    def solve(self, model, case, tol):
        print(f"solving {case.name}")
        return KINDS.get(case.name, solution)(case)


@dataclass
class Elsewhere(Fake):
    """Says which process it is in; crashes there in the case of that name."""

    name: str = "elsewhere"

    def solve(self, model, case, tol):
        if case.name == "segfault":
            os.kill(os.getpid(), signal.SIGSEGV)
        answer = solution(case)
        return type(answer)(**{**vars(answer), "details": {"process": os.getpid()}})


@dataclass
class Unimportable(Fake):
    """Its simulator cannot be imported."""

    name: str = "unimportable"

    def version(self):
        import no_such_simulator_anywhere  # noqa: F401


@dataclass
class Leaking(Fake):
    """Keeps more with every pair, as if for later: some pairs on there is no more."""

    name: str = "leaking"
    kept = []  # noqa: RUF012

    def solve(self, model, case, tol):
        self.kept.append(np.ones(5 * 10**7 // 8))  # 0.05 GB
        return solution(case)
