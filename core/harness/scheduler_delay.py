"""How long this thread was kept from running by others: what a time is freed of before it is
compared with another day's.
"""

from __future__ import annotations

from pathlib import Path

_ACCOUNT = Path("/proc/thread-self/schedstat")


def waited() -> float:
    """Seconds this thread has been ready to run and waited for a processor; always 0 where the
    system keeps no account (not Linux).

    Not the processor time instead of the clock's: a solve that sleeps, or waits for a disk or a
    lock, would count for nothing.
    """
    try:
        # fields: nanoseconds run, nanoseconds waited, number of turns (Linux,
        # Documentation/scheduler/sched-stats.rst)
        return 1e-9 * int(_ACCOUNT.read_text("ascii").split()[1])
    except (OSError, IndexError, ValueError):
        return 0.0
