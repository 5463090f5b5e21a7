"""Interrupts: Ctrl-C and SIGTERM stop the work of a command, and never what it writes of the work
that is done.
"""

from __future__ import annotations

import signal
from collections.abc import Generator
from contextlib import AbstractContextManager, contextmanager
from threading import current_thread, main_thread
from types import FrameType
from typing import Any


class Terminated(KeyboardInterrupt):
    """SIGTERM asks the command to end."""


def status_of(interrupt: KeyboardInterrupt) -> int:
    """Return the exit status of a command that was interrupted, as shells have it."""
    return 128 + (signal.SIGTERM if isinstance(interrupt, Terminated) else signal.SIGINT)


def words_of(interrupt: KeyboardInterrupt) -> str:
    """Return what a message says of an interrupt."""
    return str(interrupt) or ("terminated" if isinstance(interrupt, Terminated) else "interrupted")


class Interrupts:
    """What a command does at Ctrl-C and SIGTERM.

    The first one raises KeyboardInterrupt. One more is only noted, so that results are written; the
    next raises again.

    Attributes:
        held: the one that was noted, None without.
    """

    def __init__(self) -> None:
        self.held: KeyboardInterrupt | None = None
        self._holding = False

    def hold(self) -> None:
        """From now on results are written: note the first interrupt."""
        self._holding = True

    @contextmanager
    def deferred(self) -> Generator[None]:
        """Raise an interrupt that comes meanwhile only in the end."""
        holding, self._holding = self._holding, True
        try:
            yield
        finally:
            self._holding = holding
        if not holding and self.held is not None:
            held, self.held, self._holding = self.held, None, True
            raise held

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Take a signal."""
        interrupt = Terminated() if number == signal.SIGTERM else KeyboardInterrupt()
        if self._holding and self.held is None:
            self.held = interrupt
            return
        self._holding = True
        raise interrupt


_current = Interrupts()


def hold() -> None:
    """From now on the command writes its results: the first interrupt is noted, and acted on when
    they are written.
    """
    _current.hold()


def deferred() -> AbstractContextManager[None]:
    """What is done meanwhile is done whole: an interrupt is raised only in the end."""
    return _current.deferred()


@contextmanager
def listening() -> Generator[Interrupts]:
    """Take the signals of this process for a command; those that the process was started to ignore
    stay ignored.
    """
    global _current
    _current = found = Interrupts()
    before: dict[int, Any] = {}
    if current_thread() is main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) not in (signal.SIG_IGN, None):
                before[number] = signal.signal(number, found)
    try:
        yield found
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
