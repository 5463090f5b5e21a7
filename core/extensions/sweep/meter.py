"""Progress of long work."""

from __future__ import annotations

import sys
from time import perf_counter
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from ...case.io.escape import visible


class Meter:
    """A bar on a terminal, elsewhere lines at intervals.

    Only calls draw it: a drawing thread would disturb measured times.

    Args:
        name: name of the command, before each line.
        quiet: print nothing.
        every: interval between lines without a terminal [s]; 0 for all lines.
    """

    def __init__(self, name: str, *, quiet: bool = False, every: float = 0.0) -> None:
        self.name, self.quiet, self.every = name, quiet, every
        self.begun, self.shown_at = perf_counter(), -every
        self.bar = None
        if sys.stderr.isatty() and not quiet:
            self.bar = Progress(
                TextColumn("{task.description}", markup=False),
                BarColumn(bar_width=20),
                TaskProgressColumn(),
                TimeRemainingColumn(compact=True),
                TextColumn("left"),
                console=Console(file=sys.stderr),
                auto_refresh=False,
                transient=True,
            )
            self.task = self.bar.add_task(name, total=1.0)

    def __enter__(self) -> Self:
        if self.bar is not None:
            self.bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self.bar is not None:
            self.bar.stop()

    def __call__(self, what: str, done: float) -> None:
        """Show the current work, and the finished share of all work, from 0 to 1."""
        if self.bar is not None:
            self.bar.update(self.task, description=visible(what), completed=done, refresh=True)
            return
        now = perf_counter() - self.begun
        if self.quiet or now - self.shown_at < self.every:
            return
        self.shown_at = now
        left = f", about {_time(now * (1.0 - done) / done)} left" if 0.0 < done < 1.0 else ""
        print(
            f"{self.name}: {visible(what)} ({100 * done:.0f} %{left})", file=sys.stderr, flush=True
        )


def _time(seconds: float) -> str:
    """Return a time as text with at most two units."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
