"""The command kincheck, also as `python -m kincheck`.

Signals are handled before the other imports, so that an interrupt during imports also prints one
line.
"""

import os
import signal
import sys
from importlib import import_module
from types import FrameType

SIGNALS = 128
"""Offset of the exit status after a signal, as in shells: add the signal's number."""


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
    # absolute: the relative name .core exists only as installed, so checkers miss it in the sources
    status: int = import_module("kincheck.core.cli.main").main()
    # Python would end by the signal itself if the interrupt came during `exec`
    if status > SIGNALS:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    # an interrupt must not change the status while Python exits
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return status


if __name__ == "__main__":
    sys.exit(main())
