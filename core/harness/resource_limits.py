"""What a pair may take before it is given up."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass

# The slowest pair of the built-in cases takes 3 s. A hundred times that leaves room for a large
# mechanism on a busy machine, and ten pairs that hang are still over within the hour.
TIMEOUT = 300.0

# A simulator that has solved all built-in cases may write to 0.15 to 0.25 GB, as the data limit
# counts. Sixteen times that is a leak or a wrong size, and most machines have it to spare.
MEMORY = 4.0

# Of either: bytes are counted to 9.2e18, and a thread waits for 9.2e9 s at the most.
MOST = 1e9

# For an interpreter to start and load numpy on a machine that is busy with other things [s]; it
# takes a third of a second.
STARTUP = 120.0


@dataclass(frozen=True)
class Limits:
    """Wall-clock seconds of a pair, and memory of its process in GB (1e9 bytes), which Linux alone
    enforces.
    """

    timeout: float = TIMEOUT
    memory: float = MEMORY


def default_jobs() -> int:
    """Half the processors this process may use.

    Two of them are often one core, and the parent judges and writes while a worker solves: times
    are those of a quiet machine.
    """
    usable = (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    return max(1, usable // 2)


def restrict(gigabytes: float) -> None:
    """Let this process have no more memory than that; asking for more then fails there, as
    MemoryError or std::bad_alloc.

    The data limit, not the address space: that one counts libraries and what threads reserve and
    never touch.
    """
    if sys.platform == "linux":
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_DATA)
        most = int(gigabytes * 1e9)
        soft = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))
        # a crash is told by its signal and stack; the image of the memory would fill the working
        # folder
        resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))


def memory_limit() -> float | None:
    """What `restrict` has left this process [GB]; None where it was not restricted."""
    if sys.platform == "linux":
        import resource

        soft, _ = resource.getrlimit(resource.RLIMIT_DATA)
        return None if soft == resource.RLIM_INFINITY else soft / 1e9
    return None
