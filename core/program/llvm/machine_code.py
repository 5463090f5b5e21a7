"""Whether machine code runs here: llvmlite is installed, loads, and compiles every loop. Where it
does not, numpy runs the same programs.
"""

from __future__ import annotations

import importlib.util
import sys
from functools import cache

from ...extras import how_to_install, installed_version
from . import fixed_order, jit


def available() -> bool:
    """Return whether machine code runs here; print a note, once, if llvmlite is installed and
    fails.
    """
    return importlib.util.find_spec("llvmlite") is not None and not _noted()


@cache
def problem() -> str:
    """Return why llvmlite, which is installed, makes no machine code here; empty if it does.

    All loops are loaded for that; they are compiled once on a machine, and the cache keeps them.
    """
    try:
        jit.load_loops()
        fixed_order.load_loops()
    except Exception as error:  # what a library of another version raises has no common type
        said = " ".join(f"{type(error).__name__}: {error}".split("\n")[:2])
        return f"llvmlite {installed_version('fast')} makes no machine code here ({said})"
    return ""


@cache
def _noted() -> str:
    if found := problem():
        print(
            f"kincheck: note: numpy solves, some fifty times slower: {found}:"
            f" {how_to_install('fast')}",
            file=sys.stderr,
        )
    return found
