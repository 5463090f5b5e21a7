"""Programs as tables of integers for `llvm.interpreter`: they run without compilation.

A table is a list of stretches. A stretch holds the kind of an operation, the bytes of its rows, and
the rows: offsets of the result and of the operands, in bytes from the lanes. Stretches are long:
among the ready operations, all of one kind come first.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray

from .lowering import counts, lowered, unrolled
from .straight_line import Program
from .tape import Node, operands, place_of

ARITY = {
    **dict.fromkeys(("copy", "node", "neg", "abs", "sqrt", "sin", "cos"), 1),
    **dict.fromkeys(("+", "-", "*", "/", "min", "max", "umax", "larger", "before", "const"), 2),
    **dict.fromkeys(("fma", "fnma", "fms", "where"), 3),
}
"""Numbers in a row of an operation beside its result. A "const" has the two halves of its value."""
KINDS = {op: kind for kind, op in enumerate(ARITY, 1)}
"""Code of each operation; 0 ends a table."""


@dataclass(frozen=True)
class Bytecode:
    """A program as a table.

    Attributes:
        words: the table.
        cells: number of slots, after those of the lanes, for intermediate values.
    """

    words: NDArray[np.uint32]
    cells: int


def bytecode(program: Program, slots: int, width: int) -> Bytecode:
    """Return a program as a table, for lanes with a number of slots and a width.

    A value goes directly into its output slot if the program does not read this slot; otherwise
    into a cell, which is free again after its last reader.
    """
    program = lowered(unrolled(program))
    nodes, vector = [*program.nodes], 8 * width
    # an input that goes to another slot must survive the output that overwrites its own
    inputs = {k for k in program.outputs.values() if nodes[k][0] == "input"}
    copied = {k: len(nodes) + at for at, k in enumerate(inputs)}
    nodes += [("copy", k) for k in inputs]
    outputs = {slot * vector: copied.get(k, k) for slot, k in program.outputs.items()}
    read = {int(node[1]) * vector for node in nodes if node[0] in ("input", "node")}
    goes = {k: at for at, k in outputs.items() if at not in read}
    operated = [operands(node) for node in nodes]
    # output places are never free
    uses = counts(len(nodes), *operated, outputs.values())
    place = [int(node[1]) * vector if node[0] == "input" else 0 for node in nodes]
    words, free, cells = list[int](), list[int](), slots
    for op, stretch in _stretches(nodes, operated):
        words += (KINDS[op], _bytes(op, stretch))
        for k in stretch:
            if op == "const":
                numbers: Sequence[int] = _HALVES.unpack(_NUMBER.pack(nodes[k][1]))
            elif op == "node":
                numbers = (int(nodes[k][1]) * vector + 8 * place_of(int(nodes[k][2]), width)[1],)
            else:
                numbers = [place[x] for x in operated[k]]
                for x in operated[k]:
                    uses[x] -= 1
                    if not uses[x] and nodes[x][0] != "input":
                        free.append(place[x])
            if k in goes:
                place[k] = goes[k]
            elif free:
                place[k] = free.pop()
            else:
                place[k], cells = cells * vector, cells + 1
            words.append(place[k])
            words += numbers
    left = [(at, k) for at, k in outputs.items() if goes.get(k) != at]
    if left:
        words += (KINDS["copy"], _bytes("copy", left))
        for at, k in left:
            words += (at, place[k])
    return Bytecode(np.array([*words, 0, 0], np.uint32), cells - slots)


def packed(tables: Mapping[str, Bytecode]) -> bytes:
    """Return tables by name as bytes."""
    return msgspec.msgpack.encode(
        {name: (each.cells, each.words.tobytes()) for name, each in tables.items()}
    )


def unpacked(whole: bytes) -> dict[str, Bytecode]:
    """Return the tables of `packed`."""
    tables = msgspec.msgpack.decode(whole, type=dict[str, tuple[int, bytes]])
    return {
        name: Bytecode(np.frombuffer(words, np.uint32), cells)
        for name, (cells, words) in tables.items()
    }


_NUMBER, _HALVES = struct.Struct("<d"), struct.Struct("<II")


def _bytes(op: str, stretch: Sequence[object]) -> int:
    """Return the bytes of the rows of a stretch."""
    return 4 * (1 + ARITY[op]) * len(stretch)


def _stretches(
    nodes: Sequence[Node], operated: Sequence[Sequence[int]]
) -> Iterator[tuple[str, Sequence[int]]]:
    """Yield the operations in an executable order, grouped by kind."""
    readers: list[list[int]] = [[] for _ in nodes]
    missing = [0] * len(nodes)
    ready: dict[str, list[int]] = {}
    for k, (op, *_) in enumerate(nodes):
        if op == "input":
            continue
        for x in operated[k]:
            if nodes[x][0] != "input":
                readers[x].append(k)
                missing[k] += 1
        if not missing[k]:
            ready.setdefault(op, []).append(k)
    while ready:
        kind = max(ready, key=lambda op: len(ready[op]))
        stretch = ready.pop(kind)
        for k in stretch:  # the list grows during the loop
            for x in readers[k]:
                missing[x] -= 1
                if not missing[x]:
                    op = nodes[x][0]
                    (stretch if op == kind else ready.setdefault(op, [])).append(x)
        yield kind, stretch
