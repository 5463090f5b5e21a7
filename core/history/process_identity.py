"""Which process writes a run, and whether it still does."""

from __future__ import annotations

import os
import platform
from pathlib import Path

from ..harness.provenance import readable


def owner() -> str:
    """This process: host, number, and when it began, as numbers are given again."""
    return f"{readable(platform.node())}|{os.getpid()}|{_begun(os.getpid())}"


def alive(owner: str) -> bool:
    """Whether that process is still there. One of another host counts as gone: it cannot be seen
    from here.
    """
    host, number, begun = owner.rsplit("|", 2)
    if host != readable(platform.node()):
        return False
    try:
        os.kill(int(number), 0)  # asks only
    except ProcessLookupError:
        return False
    except OSError:  # it is another user's, or the system cannot say
        pass
    return _begun(int(number)) == begun


def _begun(number: int) -> str:
    """Clock ticks from the start of the system to that of the process; empty where there is no
    /proc, or it has ended and nobody has asked how (in containers nobody may)."""
    try:
        # the second field is the program's name in brackets, and may hold anything
        state, *fields = (
            Path(f"/proc/{number}/stat").read_text("utf-8", "replace").rpartition(")")[2].split()
        )
        return "" if state in "ZX" else fields[18]
    except (OSError, ValueError, IndexError):
        return ""
