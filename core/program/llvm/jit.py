"""A plan that this processor can run: loops that are the same for all plans, and programs,
interpreted or compiled.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache, partial
from pathlib import Path
from threading import Lock, Thread

from .. import bytecode, disk_cache, lowering, tape
from .. import plan as executor
from ..plan import Plan
from . import code_cache, compiler
from .interpreter import interpret
from .ir_writer import declarations
from .loops import parts, run, settle
from .many_motions import fan
from .one_motion import follow
from .plan import PlanInMemory, rows
from .programs import function
from .reduce import fold

_NEEDED = rows, settle
LOOPS: Mapping[str, tuple[Sequence[Callable[[int], str]], Mapping[str, int]]] = {
    "interpret": ([interpret], {"interpret": 2}),
    "follow": (
        [*_NEEDED, run, follow],
        {"run_program": 4, "attempt": 3, "carry": 3, "follow": 6, "run": 3},
    ),
    "fan": ([*_NEEDED, fan], {"fan": 12}),
    "fold": ([rows, fold], {"fold": 6}),
    "parts": ([*_NEEDED, parts], {"parts": 13}),
}
"""What runs the programs of any plan: what writes it, and its functions with how many arguments
they take.
"""
OFTEN, AGAIN, OPERATIONS = 150, 20, 3000
"""Programs of so many operations are interpreted for so many groups of lanes; longer ones, which
take longer to compile, for more. Whoever comes back after that comes many times: a sweep of 161
samples is 21 groups of eight, and six sweeps of `kincheck run` are interpreted to the end. For
those whose tables are in the cache somebody did come back: they are compiled after the second
number, in the first sweep."""
_AT_ONCE = ContextVar("at once", default=False)


@contextmanager
def compiled_at_once() -> Generator[None]:
    """Have programs that are made meanwhile compiled when they have run once: for whoever measures
    what they cost warm.
    """
    before = _AT_ONCE.set(True)
    try:
        yield
    finally:
        _AT_ONCE.reset(before)


class LlvmCode:
    """A plan that this processor can run: its programs are interpreted at first, and compiled where
    they are run often.

    Raises ImportError where llvmlite is missing.

    Attributes:
        stride: slots of a lane, with those after `Plan.slots` that programs keep their values in.
        memory: the plan, as loops read it.
        interpreted: whether programs are not compiled yet.
    """

    def __init__(self, plan: Plan) -> None:
        self.width, self.plan, self._lock = compiler.vector_width(), plan, Lock()
        # what determines the code; writing its text takes longer than loading it
        self._content = repr([plan.programs, self.width, _sources()])
        code = code_cache.find(self._content)
        again = code is None and disk_cache.known(self._of_tables)
        self.interpreted, tables = code is None, {} if code else self._tables()
        self.stride = len(plan.slots) + max((each.cells for each in tables.values()), default=0)
        self.memory = PlanInMemory(plan, self.width, self.stride)
        if code:
            self._take(code)
        for name, table in tables.items():
            self.memory.entries[self.memory.calls[name]] = (
                _loop("interpret", self.width).address("interpret"),
                table.words.ctypes.data,
            )
        operations = sum(len(each.nodes) for each in plan.programs.values())
        often = 0 if _AT_ONCE.get() else AGAIN if again else OFTEN
        self._alive, self._left = tables, often * max(OPERATIONS, operations) // OPERATIONS

    def call(self, loop: str, name: str) -> Callable[..., int]:
        """A function of a loop, for this plan."""
        return partial(_loop(loop, self.width).calls[name], self.memory.address)

    def count(self, groups: int) -> None:
        """Said by whoever has run programs for so many groups of lanes."""
        if not self.interpreted:
            return
        self._left -= groups  # what is lost where two threads do so at once only delays compiling
        if self._left <= 0:
            with self._lock:  # what one thread compiled is not taken away from others that run it
                if self.interpreted:
                    self._take(code_cache.load(self._content, self._text))
                    self.interpreted = False

    def _take(self, code: code_cache.Code) -> None:
        self._code = code
        for name, at in self.memory.calls.items():
            # a function that is compiled needs no table
            self.memory.entries[at, 0] = code.address(name)

    def _tables(self) -> dict[str, bytecode.Bytecode]:
        slots = len(self.plan.slots)

        def made() -> bytes:
            return pickle.dumps(
                {
                    name: bytecode.bytecode(each, slots, self.width)
                    for name, each in self.plan.programs.items()
                }
            )

        return pickle.loads(disk_cache.kept(self._of_tables, made))

    @property
    def _of_tables(self) -> bytes:
        return f"tables {len(self.plan.slots)} {self._content}".encode()

    def _text(self) -> str:
        programs = (function(program, self.width) for program in self.plan.programs.values())
        return "\n".join([*programs, declarations(self.width)])


@cache
def make_loops_ready() -> None:
    """Compile what is needed first, if it never was, while programs are traced: the compiler does
    not wait for Python's lock.

    To import and to read files does: in a thread, beside whatever else Python does, that would take
    three times as long.
    """
    width = compiler.vector_width()
    missing = [
        name
        for name in ("interpret", "follow")
        if not disk_cache.known(code_cache.told(_content(name, width)))
    ]
    if missing:
        compiler.llvm()
        Thread(target=lambda: [_loop(name, width) for name in missing]).start()


def interpreter(width: int) -> Callable[..., int]:
    """A function that goes through a table: of the addresses of lanes and table."""
    return _loop("interpret", width).calls["interpret"]


def _loop(name: str, width: int) -> code_cache.Code:
    with _LOCK:
        return _made(name, width)


_LOCK = Lock()


@cache
def _made(name: str, width: int) -> code_cache.Code:
    """Functions that run any plan."""
    writers, signatures = LOOPS[name]
    text = partial("\n".join, [*(write(width) for write in writers), declarations(width)])
    return code_cache.load(_content(name, width), text, signatures)


def _content(name: str, width: int) -> str:
    return repr([name, width, _sources()])


@cache
def _sources() -> str:
    """A digest of all that writes text or tables: this room, and what it takes from others."""
    files = (
        *sorted(Path(__file__).parent.glob("*.py")),
        *(Path(str(each.__file__)) for each in (executor, lowering, tape, bytecode)),
    )
    return hashlib.sha256(b"".join(each.read_bytes() for each in files)).hexdigest()
