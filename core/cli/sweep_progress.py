"""Progress of a sweep on standard error."""

from __future__ import annotations

import sys
from time import perf_counter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..studies.tolerance.sweep import Progress

# Seconds between lines of progress without a terminal.
EVERY = 10.0


class Teller:
    """Printer of a sweep's progress on standard error: one changing line on a terminal, else a line
    now and then.
    """

    def __init__(self) -> None:
        self.terminal = sys.stderr.isatty()
        self.told = perf_counter()

    def solved(self, progress: Progress) -> None:
        """Print the progress after a chunk."""
        rate = progress.solved / progress.seconds
        left = (progress.total - progress.done) / rate
        part = f"[{progress.done}/{progress.total}] {100 * progress.done / progress.total:.0f} %"
        line = f"{part}, {rate:.3g} variants/s, {left:.0f} s left"
        self._tell(line + (f", {progress.unsolved} unsolved" if progress.unsolved else ""))

    def checked(self, done: int, total: int) -> None:
        """Print the progress after a checked variant."""
        self._tell(f"[{done}/{total}] checked")

    def _tell(self, line: str) -> None:
        now = perf_counter()
        if now - self.told < (0.1 if self.terminal else EVERY):
            return
        self.told = now
        print(
            f"\r\x1b[2K{line}" if self.terminal else line,
            end="" if self.terminal else "\n",
            file=sys.stderr,
            flush=True,
        )

    def end(self) -> None:
        """Clear the line."""
        if self.terminal:
            print("\r\x1b[2K", end="", file=sys.stderr, flush=True)
