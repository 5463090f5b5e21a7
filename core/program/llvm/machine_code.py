"""Whether machine code runs here: llvmlite is installed, loads, and compiles the loops. Where it
does not, numpy runs the same programs.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from functools import cache

from ...extras import how_to_install, installed_version
from . import jit


def available(load: Callable[[], object] = jit.load_loops) -> bool:
    """Return whether machine code runs here; print a note, once, if llvmlite is installed and
    fails.

    Args:
        load: loads the loops that are needed, compiled where the cache has none.
    """
    installed = importlib.util.find_spec("llvmlite") is not None
    return installed and not _noted(jit.load_loops) and not _noted(load)


@cache
def problem(load: Callable[[], object] = jit.load_loops) -> str:
    """Return why llvmlite, which is installed, makes no machine code here; empty if it does."""
    try:
        load()
    except Exception as error:  # what a library of another version raises has no common type
        said = " ".join(f"{type(error).__name__}: {error}".split("\n")[:2])
        return f"llvmlite {installed_version('fast')} makes no machine code here ({said})"
    return ""


@cache
def _noted(load: Callable[[], object]) -> str:
    if found := problem(load):
        print(
            f"kincheck: note: numpy solves, some fifty times slower: {found}:"
            f" {how_to_install('fast')}",
            file=sys.stderr,
        )
    return found
