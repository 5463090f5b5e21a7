"""Executors of plans: machine code by the compiler of an extension, or numpy."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial
from typing import Protocol, TypeAlias

from ..doors import offers
from ..trajectory import Array
from .numpy_executor import NumpyExecutor
from .plan import Parts, Plan, Side


class Track(Protocol):
    """One motion along both sides of its start; see `NumpyTrack`."""

    anchors: Array
    worst: Array

    def begin(self) -> Array: ...

    def run(self) -> Sequence[int]: ...

    def follow(self, side: int, at: int, stop: int, *, anew: bool) -> int: ...


class Executor(Protocol):
    """A plan bound to lanes; see `NumpyExecutor`."""

    lanes: int
    group: int
    margin: int

    def clear(self) -> None: ...

    def put(self, slots: Sequence[int], values: Array) -> None: ...

    def get(self, slots: Sequence[int]) -> Array: ...

    def window(self, slots: range) -> Array: ...

    def run(self, name: str) -> None: ...

    def attempt(self) -> None: ...

    def carry(self) -> None: ...

    def track(self, sides: Sequence[Side], start: Array, n: int) -> Track: ...

    @property
    def room(self) -> int: ...

    def table(self, columns: int) -> Array: ...

    def run_motions(
        self, samples: Array, out: Array, worst: Array, first: int, step: int
    ) -> None: ...

    def groups(self, lanes: int) -> int: ...

    def parts(self, parts: Parts) -> Callable[[int, int], object]: ...


Bind: TypeAlias = Callable[[int], Executor]
"""Binds a plan, made ready for this processor, to a number of lanes."""


class Compiler(Protocol):
    """Makes machine code of plans."""

    @property
    def width(self) -> int:
        """The doubles in a vector register of this processor."""
        ...

    def works(self) -> bool:
        """Return whether it makes machine code here; print a note, once, if it is installed and
        fails.
        """
        ...

    def problem(self) -> str:
        """Return why it fails, though it is installed; empty if it works."""
        ...

    def compile(self, plan: Plan) -> Bind:
        """Make a plan ready; see `compiled_at_once`."""
        ...


def compiler() -> Compiler | None:
    """Return a compiler in working order; None if numpy has to run the programs."""
    offered: list[Compiler] = [offer.load() for offer in offers("compilers").values()]
    return next((each for each in offered if each.works()), None)


def ready(plan: Plan, *, compiled: bool = True) -> Bind:
    """Return a plan ready to be bound to lanes, by machine code or else by numpy."""
    found = compiler() if compiled else None
    return found.compile(plan) if found else partial(NumpyExecutor, plan)


_AT_ONCE = ContextVar("at once", default=False)


def at_once() -> bool:
    """Return whether programs are compiled after their first run."""
    return _AT_ONCE.get()


@contextmanager
def compiled_at_once() -> Generator[None]:
    """Compile programs made in this block after their first run, to measure the warm cost."""
    before = _AT_ONCE.set(True)
    try:
        yield
    finally:
        _AT_ONCE.reset(before)
