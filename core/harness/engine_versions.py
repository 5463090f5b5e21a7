"""Versions of engines, each queried in a separate process: a broken library may end, block or crash
its process.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

from .engine import Engine, may_run_here

# This marker precedes the version: a library may also print, and may end its process with status 0.
MARKER = "its version is "
COMMAND = f"""
import pickle, sys
sys.path[:] = pickle.load(sys.stdin.buffer)
version = pickle.load(sys.stdin.buffer).version()
print({MARKER!r}, version or "", sep="")
"""

# Longest import [s]; a slower one counts as hanging. The slowest needs some seconds on a cold disk.
PATIENCE = 60.0


def versions(engines: Sequence[Engine], patience: float = PATIENCE) -> list[str | None]:
    """Return the version of each engine, in order; None if not installed, or if its process gives
    no answer.

    Args:
        patience: longest time for an answer [s].
    """
    with ThreadPoolExecutor(max(1, len(engines))) as threads:
        return list(threads.map(partial(_version, patience=patience), engines))


def _version(engine: Engine, patience: float) -> str | None:
    if may_run_here(engine):
        return engine.version()
    ask = partial(
        subprocess.run, [sys.executable, "-P", "-c", COMMAND], capture_output=True, check=True
    )
    try:
        ended = ask(input=pickle.dumps(sys.path) + pickle.dumps(engine), timeout=patience)
    except (subprocess.TimeoutExpired, subprocess.CalledProcessError):
        return None
    except (
        pickle.PicklingError,
        AttributeError,
        TypeError,
    ):  # the engine's pairs cannot be sent either, and their records say so
        return None
    _, marker, version = ended.stdout.decode("utf-8", "replace").rpartition(MARKER)
    return version.strip() or None if marker else None
