"""The identity of the process that writes a run, and a test whether it is alive."""

from __future__ import annotations

import os
import platform
from pathlib import Path

from ..harness.provenance import readable


def owner() -> str:
    """Return host, process id and start of this process; systems reuse process ids."""
    return f"{readable(platform.node())}|{os.getpid()}|{_begun(os.getpid())}"


def alive(owner: str) -> bool:
    """Return whether a process still runs. A process of another host counts as ended."""
    host, number, begun = owner.rsplit("|", 2)
    if host != readable(platform.node()):
        return False
    try:
        os.kill(int(number), 0)  # signal 0 only tests the process
    except ProcessLookupError:
        return False
    except OSError:  # the process is another user's, or the system cannot tell
        pass
    return _begun(int(number)) == begun


def _begun(number: int) -> str:
    """Return the clock ticks from the start of the system to the start of the process.

    Empty without /proc, and for an ended process whose exit status nobody has read.
    """
    try:
        # the second field is the program's name in brackets, which may hold any character
        state, *fields = (
            Path(f"/proc/{number}/stat").read_text("utf-8", "replace").rpartition(")")[2].split()
        )
        return "" if state in "ZX" else fields[18]
    except (OSError, ValueError, IndexError):
        return ""
