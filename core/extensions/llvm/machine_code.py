"""Machine code of plans, by llvmlite: whether it runs here, and the programs of a plan."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from functools import cache, partial

from ...extras import how_to_install, installed_version
from ...program.executor import Bind
from ...program.plan import Plan
from . import compiler, jit
from .executor import LlvmExecutor


class Llvm:
    """The compiler of plans that llvmlite gives; see `program.executor.Compiler`."""

    @property
    def width(self) -> int:
        """The doubles in a vector register of this processor."""
        return compiler.vector_width()

    def works(self) -> bool:
        """Return whether machine code runs here."""
        return works()

    def problem(self) -> str:
        """Return why llvmlite, which is installed, makes no machine code here."""
        return problem()

    def compile(self, plan: Plan) -> Bind:
        """Make a plan ready: interpreted at first, and compiled if it runs often."""
        return partial(LlvmExecutor, jit.LlvmCode(plan))


LLVM = Llvm()


def works(load: Callable[[], object] = jit.load_loops) -> bool:
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
