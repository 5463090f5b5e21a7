"""Time spent waiting for a processor, which is subtracted before times of different days are
compared.
"""

from __future__ import annotations

from pathlib import Path

_ACCOUNT = Path("/proc/thread-self/schedstat")


def waited() -> float:
    """Return the seconds this thread was ready and waited for a processor; 0 except on Linux.

    Processor time does not replace wall-clock time: it misses the time in which a solve sleeps, or
    waits for a disk or a lock.
    """
    try:
        # fields: nanoseconds run, nanoseconds waited, time slices (Linux,
        # Documentation/scheduler/sched-stats.rst)
        return 1e-9 * int(_ACCOUNT.read_text("ascii").split()[1])
    except (OSError, IndexError, ValueError):
        return 0.0
