"""A plan ready to run on this processor: loops common to all plans, and programs interpreted or
compiled; machine code is cached by content, processor and version.
"""

from __future__ import annotations

import ctypes
import hashlib
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from threading import Lock
from typing import Any

import msgspec

from ...caches import cache_last
from ...program import disk_cache, plan, straight_line, tape
from ...program.executor import at_once
from ...program.plan import Plan
from . import compiler
from .bytecode import Bytecode, bytecode, pack, unpack
from .loops import follow, run, run_motions, settle
from .plan import PlanInMemory, rows
from .programs import declarations, function, interpret
from .walk import parts


class Code:
    """Machine code of functions; calls release the GIL.

    Args:
        signatures: number of arguments by function: addresses and integers. All return an integer,
            which is meaningless for functions without a result. Other functions are reached by
            address only.

    Attributes:
        address: return the address of a function by name.
        calls: functions with a signature; each keeps the code alive.
    """

    def __init__(self, code: bytes, signatures: Mapping[str, int]) -> None:
        self.address = (
            compiler.load_image(msgspec.msgpack.decode(code, type=compiler.Image))
            if compiler.possible()
            else compiler.load_object(code)
        )
        # integers are passed as addresses: ctypes takes a third of the time for those
        types = {
            name: ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * count)
            for name, count in signatures.items()
        }
        self.calls: dict[str, Callable[..., int]] = {}
        for name, kind in types.items():
            call: Any = kind(self.address(name))
            call.alive = self.address
            self.calls[name] = call


def load(
    content: str, text: Callable[[], str], signatures: Mapping[str, int] | None = None
) -> Code:
    """Return the cached code of a content; compile the text if there is none."""
    return disk_cache.load_or_make(
        cache_key(content), lambda: _emit(text()), lambda code: Code(code, signatures or {})
    )


def find(content: str) -> Code | None:
    """Return the cached code of a content, or None."""
    return disk_cache.find(cache_key(content), lambda code: Code(code, {}))


def cache_key(content: str) -> bytes:
    """Return the cache key: content, processor, compiler, and the sources that write its text."""
    return "\n".join(
        (*compiler.processor(), str(compiler.possible()), _sources(), content)
    ).encode()


def _emit(text: str) -> bytes:
    file = compiler.emit(text)
    return msgspec.msgpack.encode(compiler.image_of(file)) if compiler.possible() else file


_NEEDED = rows, settle
LOOPS: Mapping[str, tuple[Sequence[Callable[[int], str]], Mapping[str, int]]] = {
    "interpret": ([interpret], {"interpret": 2}),
    "follow": (
        [*_NEEDED, run, follow],
        {"run_program": 4, "attempt": 3, "carry": 3, "follow": 6, "run": 3},
    ),
    "fan": ([*_NEEDED, run_motions], {"fan": 12}),
    "parts": ([*_NEEDED, parts], {"parts": 5, "walk": 3}),
}
"""Modules of loops: their writers, and their functions with the number of arguments."""
OFTEN, AGAIN, OPERATIONS = 150, 20, 3000
"""Limits of interpretation, in groups of lanes, for programs up to `OPERATIONS` operations;
proportionally more for longer ones, which take longer to compile. `OFTEN` holds for new plans: a
sweep of 161 samples is 21 groups of eight, so `kincheck run` interprets six sweeps to the end.
`AGAIN` holds for plans with tables in the cache: they come back often, so they are compiled in the
first sweep.
"""


class LlvmCode:
    """A plan ready to run on this processor; its programs are interpreted first, and compiled if
    run often.

    Args:
        often: limit of interpretation, see `OFTEN`; infinite for programs that are never compiled.
        tables: of programs, if they are known; those are never compiled.
        width: lanes of a vector, by default those of a register.

    Attributes:
        stride: slots of a lane, with the cells of intermediate values after `Plan.slots`.
        memory: the plan, as loops read it.
        interpreted: whether programs are not compiled yet.
    """

    def __init__(
        self,
        plan: Plan,
        often: float = OFTEN,
        tables: Mapping[str, Bytecode] | None = None,
        width: int = 0,
    ) -> None:
        self.width, self.plan, self._lock = width or compiler.vector_width(), plan, Lock()
        # content of the code as a key: writing the text takes longer than loading the code
        self._content = repr([plan.programs, self.width])
        code = None if tables else find(self._content)
        again = not tables and code is None and disk_cache.contains(self._of_tables)
        self.interpreted, tables = code is None, tables or ({} if code else self._tables())
        self.stride = len(plan.slots) + max((each.cells for each in tables.values()), default=0)
        self.memory = PlanInMemory(plan, self.width, self.stride)
        if code:
            self._take(code)
        else:
            self._interpret(tables)
        operations = sum(len(each.nodes) for each in plan.programs.values())
        if often == OFTEN:
            often = 0 if at_once() else AGAIN if again else OFTEN
        self._left: float = often * max(OPERATIONS, operations) // OPERATIONS

    def call(self, loop: str, name: str) -> Callable[..., int]:
        """Return a function of a loop, bound to this plan."""
        return partial(_loop(loop, self.width).calls[name], self.memory.address)

    def count(self, groups: int) -> None:
        """Count groups of lanes run so far, and compile at the limit."""
        if not self.interpreted:
            return
        self._left -= groups  # an update lost between two threads only delays compilation
        if self._left <= 0:
            with self._lock:  # do not replace compiled code that other threads run
                if self.interpreted and self._left < math.inf:
                    self._compile()

    def _compile(self) -> None:
        try:
            self._take(load(self._content, self._text))
            self.interpreted = False
        except Exception as error:  # the interpreter gives the same bits, more slowly
            self._left = math.inf
            print(f"kincheck: note: a program stays interpreted: {error}", file=sys.stderr)

    def _interpret(self, tables: Mapping[str, Bytecode]) -> None:
        loop = _loop("interpret", self.width)
        for name, table in tables.items():
            self.memory.entries[self.memory.calls[name]] = (
                loop.address("interpret"),
                table.words.ctypes.data,
            )
        self._alive = tables, loop  # keeps their addresses valid

    def _take(self, code: Code) -> None:
        self._code = code
        for name, at in self.memory.calls.items():
            # a compiled function needs no table
            self.memory.entries[at, 0] = code.address(name)

    def _tables(self) -> dict[str, Bytecode]:
        slots = len(self.plan.slots)

        def make() -> bytes:
            tables = {
                name: bytecode(each, slots, self.width) for name, each in self.plan.programs.items()
            }
            return pack(tables)

        return disk_cache.load_or_make(self._of_tables, make, unpack)

    @property
    def _of_tables(self) -> bytes:
        return f"tables {len(self.plan.slots)} {_sources()} {self._content}".encode()

    def _text(self) -> str:
        programs = (function(program, self.width) for program in self.plan.programs.values())
        return "\n".join([*programs, declarations(self.width)])


def load_loops() -> None:
    """Load the loops of all plans, compiled where the cache has none."""
    for name in LOOPS:
        _loop(name, compiler.vector_width())


def _loop(name: str, width: int) -> Code:
    with _LOCK:
        return _load_loops(name, width)


_LOCK = Lock()


@cache_last(2 * len(LOOPS))
def _load_loops(name: str, width: int) -> Code:
    """Return functions that run any plan."""
    writers, signatures = LOOPS[name]
    text = partial("\n".join, [*(write(width) for write in writers), declarations(width)])
    return load(_content(name, width), text, signatures)


def _content(name: str, width: int) -> str:
    return repr([name, width])


@cache
def _sources() -> str:
    """Return a digest of all writers of text or tables: this folder, and the modules it uses."""
    files = (
        *sorted(Path(__file__).parent.glob("*.py")),
        *(Path(str(each.__file__)) for each in (plan, straight_line, tape)),
    )
    return hashlib.sha256(b"".join(each.read_bytes() for each in files)).hexdigest()
