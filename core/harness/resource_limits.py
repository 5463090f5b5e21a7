"""Limits of time and memory for one pair."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass

# Longest time of a pair [s]: a hundred times that of the slowest built-in pair (3 s). This leaves
# room for a large mechanism on a busy machine, and ten hanging pairs still end within the hour.
TIMEOUT = 300.0

# Memory of a process [GB]. After all built-in cases, a simulator holds 0.15 to 0.25 GB, as the data
# limit counts. Sixteen times as much shows a leak or a wrong size, and most machines have it.
MEMORY = 4.0

# Largest value of either limit: bytes are counted up to 9.2e18, and a thread waits at most 9.2e9 s.
MOST = 1e9

# Longest start of an interpreter with numpy [s] on a busy machine; usually it takes a third of a
# second.
STARTUP = 120.0


@dataclass(frozen=True)
class Limits:
    """The limits of a pair.

    Attributes:
        timeout: wall-clock time [s].
        memory: memory of its process [GB, 1e9 bytes]; enforced on Linux only.
    """

    timeout: float = TIMEOUT
    memory: float = MEMORY


def default_jobs() -> int:
    """Return half the number of processors usable by this process.

    Two processors often share a core, and the parent process judges and writes while workers solve.
    Half of them leave the machine quiet enough to measure times.
    """
    usable = (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    return max(1, usable // 2)


def restrict(gigabytes: float) -> None:
    """Limit the memory of this process [GB].

    A request beyond the limit fails with MemoryError or std::bad_alloc. The limit applies to data,
    not to the address space, which includes libraries and the reserved, unused memory of threads.
    """
    if sys.platform == "linux":
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_DATA)
        most = int(gigabytes * 1e9)
        soft = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))
        # signal and stack describe a crash; core files would fill the working folder
        resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))


def memory_limit() -> float | None:
    """Return the memory limit of this process [GB]; None if it is not limited."""
    if sys.platform == "linux":
        import resource

        soft, _ = resource.getrlimit(resource.RLIMIT_DATA)
        return None if soft == resource.RLIM_INFINITY else soft / 1e9
    return None
