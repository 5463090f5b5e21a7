"""The command kincheck, also as `python -m kincheck`.

This folder is the package kincheck itself; its parts lie in folders of their own.

It takes signals before it imports the rest: an interrupt during imports is one line too.
"""

import os
import signal
import sys
from importlib import import_module
from types import FrameType

SIGNALS = 128
"""Exit status of a process that a signal has ended, less the signal's number, as shells have it."""


def leave(number: int, frame: FrameType | None) -> None:
    """End the process at a signal before the command begins or after it has ended."""
    os.write(
        2, b"kincheck: terminated\n" if number == signal.SIGTERM else b"kincheck: interrupted\n"
    )
    os._exit(SIGNALS + number)


def main() -> int:
    """Run the command line and return the exit status."""
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, leave)
    # by its name: relative to this file, as installed, it would be .core, which no checker finds in
    # the sources
    status: int = import_module("kincheck.core.cli.main").main()
    # Python would end by the signal itself if the interrupt has come while a text was executed
    if status > SIGNALS:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    # all is done; while Python ends, it would end by the signal
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return status


if __name__ == "__main__":
    sys.exit(main())
