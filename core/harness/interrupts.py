"""Interrupts: Ctrl-C and SIGTERM stop the work of a command, never the writing of its results."""

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
    """Return the exit status of an interrupted command, as shells define it."""
    return 128 + (signal.SIGTERM if isinstance(interrupt, Terminated) else signal.SIGINT)


def words_of(interrupt: KeyboardInterrupt) -> str:
    """Return the text of a message about an interrupt."""
    return str(interrupt) or ("terminated" if isinstance(interrupt, Terminated) else "interrupted")


class Interrupts:
    """The response of a command to Ctrl-C and SIGTERM.

    The first signal raises KeyboardInterrupt. The second is only noted, so the results are
    written; the third raises again.

    Attributes:
        held: the noted interrupt; None if there is none.
    """

    def __init__(self) -> None:
        self.held: KeyboardInterrupt | None = None
        self._holding = False

    def hold(self) -> None:
        """Postpone the next interrupt while results are written."""
        self._holding = True

    @contextmanager
    def deferred(self) -> Generator[None]:
        """Complete the enclosed work, and raise an interrupt only at its end."""
        holding, self._holding = self._holding, True
        try:
            yield
        finally:
            self._holding = holding
        if not holding and self.held is not None:
            held, self.held, self._holding = self.held, None, True
            raise held

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal."""
        interrupt = Terminated() if number == signal.SIGTERM else KeyboardInterrupt()
        if self._holding and self.held is None:
            self.held = interrupt
            return
        self._holding = True
        raise interrupt


_current = Interrupts()


def hold() -> None:
    """Postpone the next interrupt until the results are written."""
    _current.hold()


def deferred() -> AbstractContextManager[None]:
    """Complete the enclosed work, and raise an interrupt only at its end."""
    return _current.deferred()


@contextmanager
def listening() -> Generator[Interrupts]:
    """Handle the signals of this process during a command. Signals ignored before stay ignored."""
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
