"""Programs with fused operations, and as tables for the interpreter.

`lower` fuses a product and a sum into one operation, rounded once. It decides the fusion, not the
compiler: compiled and interpreted programs give the same numbers to the last bit.

`bytecode` writes a program as a table of integers for the interpreter: it runs without compilation.
A table is a list of stretches. A stretch holds the kind of an operation, the bytes of its rows, and
the rows: offsets of the result and of the operands, in bytes from the lanes. Stretches are long:
among the ready operations, all of one kind come first.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from ...program.straight_line import Program
from ...program.tape import LEAVES, Node, operands, place_of

FUSED = frozenset({"fma", "fnma", "fms"})
"""a b + c, c - a b and a b - c, of operands a, b, c."""
SUMS = {"+": ("fma", "fma"), "-": ("fnma", "fms")}
"""Fused form of a sum or difference with a product as second operand, or as first."""
SIZES = frozenset({"abs", "umax"})
"""Operations with results that are never negative. "umax" is the larger of two such numbers, or NaN
if either is.
"""


def lower(program: Program) -> Program:
    """Return the same program, with each product of a single sum or difference fused into it."""
    nodes = program.nodes
    operated = [operands(node) for node in nodes]
    uses = counts(len(nodes), *operated, program.outputs.values())
    taken: dict[int, int] = {}
    for k, node in enumerate(nodes):
        if node[0] in SUMS:
            # of two products the later one: the earlier has had more time to finish
            products = [x for x in operated[k] if nodes[x][0] == "*" and uses[x] == 1]
            if products:
                taken[k] = max(products)
    parts, sizes, place = set(taken.values()), set[int](), [0] * len(nodes)
    found = list[Node]()
    for k, node in enumerate(nodes):
        if k in parts:
            continue
        op, read = node[0], operated[k]
        if k in taken:
            product, (a, b) = taken[k], read
            op, last = (SUMS[op][0], a) if b == product else (SUMS[op][1], b)
            read = (*operated[product], last)
        elif op == "max" and sizes.issuperset(read):
            op = "umax"
        if op in SIZES:
            sizes.add(k)
        place[k] = len(found)
        found.append(node if op in LEAVES else (op, *[place[x] for x in read]))
    outputs = {slot: place[k] for slot, k in program.outputs.items()}
    return replace(program, nodes=tuple(found), outputs=outputs)


def counts(size: int, *uses: Iterable[int]) -> list[int]:
    """Return the number of occurrences of each number below `size`."""
    found = [0] * size
    for each in uses:
        for k in each:
            found[k] += 1
    return found


def unroll(program: Program) -> Program:
    """Return a repeated program written out."""
    nodes, outputs = list(program.nodes), dict(program.outputs)
    for k in range(1, program.times):
        first = len(nodes)
        for op, *rest in program.nodes:
            moved = (
                rest
                if op == "const"
                else [rest[0] + k, *rest[1:]]
                if op in LEAVES
                else [x + first for x in rest]
            )
            nodes.append((op, *moved))
        for slot, number in program.outputs.items():
            nodes.append(("umax", outputs[slot], number + first))
            outputs[slot] = len(nodes) - 1
    return Program(program.name, tuple(nodes), outputs)


ARITY = {
    **dict.fromkeys(("copy", "node", "neg", "abs", "sqrt", "sin", "cos"), 1),
    **dict.fromkeys(
        ("+", "-", "*", "/", "atan2", "min", "max", "umax", "larger", "before", "const"), 2
    ),
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
    program = lower(unroll(program))
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


def pack(tables: Mapping[str, Bytecode]) -> bytes:
    """Return tables by name as bytes."""
    return msgspec.msgpack.encode(
        {name: (each.cells, each.words.tobytes()) for name, each in tables.items()}
    )


def unpack(whole: bytes) -> dict[str, Bytecode]:
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


ABREAST = 8
"""Elements interleaved operation by operation, so that no operation waits for the one before."""


def repeated(
    parts: Sequence[tuple[Bytecode, NDArray[np.intp]]], slots: int, width: int
) -> Bytecode:
    """Return tables repeated for many elements each as one table.

    Args:
        parts: a table for one lane, and the slot of each of its slots by element, shape (slots of
            the table, elements).
        slots: number of slots of a lane; intermediate values come after them.
        width: lanes of a vector.
    """
    words, cells = [np.zeros(0, np.intp)], 0
    for table, places in parts:
        elements = places.shape[1]
        abreast = min(ABREAST, elements)
        # the last group repeats the last element, which gives the same again
        number = np.arange(-(-elements // abreast) * abreast, dtype=np.intp)
        groups = number.clip(max=elements - 1).reshape(-1, abreast)
        own = slots + np.arange(table.cells * abreast).reshape(-1, 1, abreast)
        own = np.broadcast_to(own, (table.cells, *groups.shape))
        at: NDArray[np.intp] = np.concatenate([places[:, groups], own]) * (8 * width)
        cells, given, here = max(cells, table.cells * abreast), table.words.astype(np.intp), 0
        of_groups = list[NDArray[np.intp]]()
        while given[here]:
            op, size = _OPS[int(given[here])], int(given[here + 1]) // 4
            rows = given[here + 2 : here + 2 + size].reshape(-1, 1 + ARITY[op])
            placed = np.empty((len(groups), len(rows), abreast, rows.shape[1]), np.intp)
            # the operands of a constant are its value
            named = 1 if op == "const" else rows.shape[1]
            placed[..., :named] = at[rows[:, :named] // 8].transpose(2, 0, 3, 1)
            placed[..., named:] = rows[:, None, named:]
            head = KINDS[op], 4 * placed[0].size
            of_groups += [np.tile(head, (len(groups), 1)), placed.reshape(len(groups), -1)]
            here += 2 + size
        words.append(np.concatenate(of_groups, axis=1).ravel())
    return Bytecode(np.concatenate([*words, np.zeros(2, np.intp)]).astype(np.uint32), cells)


_OPS = {kind: op for op, kind in KINDS.items()}
