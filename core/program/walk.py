"""Programs as tables of whole numbers, which `llvm_walk` goes through: nothing has to be compiled before they can be run.

A table is a list of stretches: the kind of an operation, how many bytes its rows take, and the rows: where the result goes and where
the operands stand, in bytes from the lanes. Stretches are long: of what can be done next, all that is of one kind comes first.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .lowering import lowered, unrolled
from .straight_line import Program
from .trace import LEAVES, Node, place_of

ARITY = {"const": 2, "node": 1, "copy": 1, "before": 2, "larger": 2, "where": 3, "+": 2, "-": 2, "*": 2, "/": 2, "min": 2, "max": 2}
ARITY |= {"fma": 3, "fnma": 3, "fms": 3, "umax": 2, "neg": 1, "abs": 1, "sqrt": 1, "sin": 1, "cos": 1}
"""How many numbers a row of an operation holds beside its result. Those of "const" are the two halves of a number."""
KINDS = {op: kind for kind, op in enumerate(ARITY, 1)}
"""The number of each; 0 ends a table."""


@dataclass(frozen=True)
class Walk:
    """A program as a table.

    Attributes:
        words: the table.
        cells: how many slots after those of the lanes it keeps its values in.
    """

    words: NDArray[np.uint32]
    cells: int


def walk(program: Program, slots: int, width: int) -> Walk:
    """A program as a table, for lanes of so many slots and of that width."""
    program = lowered(unrolled(program))
    nodes, vector = [*program.nodes], 8 * width
    # an input that is put out elsewhere must survive the output that overwrites its slot
    copied = {k: len(nodes) + i for i, k in enumerate({k for k in program.outputs.values() if nodes[k][0] == "input"})}
    nodes += [("copy", k) for k in copied]
    outputs = {slot: copied.get(k, k) for slot, k in program.outputs.items()}
    read = {node[1] for node in nodes if node[0] in ("input", "node")}
    goes = {k: slot * vector for slot, k in outputs.items() if slot not in read}
    left = [(slot * vector, k) for slot, k in outputs.items() if goes.get(k) != slot * vector]
    uses = [0] * len(nodes)
    for node in nodes:
        if node[0] not in LEAVES:
            for k in node[1:]:
                uses[k] += 1  # type: ignore[index]
    for k in outputs.values():
        uses[k] += 1  # its place is never free
    place = [int(node[1]) * vector if node[0] == "input" else 0 for node in nodes]
    words, free, cells = list[int](), list[int](), slots
    for op, stretch in _stretches(nodes):
        words += (KINDS[op], 4 * (ARITY[op] + 1) * len(stretch))
        for k in stretch:
            node = nodes[k]
            if op == "const":
                numbers: Sequence[int] = _HALVES.unpack(_NUMBER.pack(node[1]))
            elif op == "node":
                numbers = (int(node[1]) * vector + 8 * place_of(int(node[2]), width),)
            else:
                numbers = [place[x] for x in node[1:]]  # type: ignore[index]
                for x in node[1:]:
                    uses[x] -= 1  # type: ignore[index]
                    if not uses[x] and nodes[x][0] != "input":  # type: ignore[index]
                        free.append(place[x])  # type: ignore[index]
            if k in goes:
                at = goes[k]
            elif free:
                at = free.pop()
            else:
                at, cells = cells * vector, cells + 1
            place[k] = at
            words.append(at)
            words += numbers
    if left:
        words += (KINDS["copy"], 8 * len(left))
        for slot, k in left:
            words += (slot, place[k])
    return Walk(np.array([*words, 0, 0], np.uint32), cells - slots)


_NUMBER, _HALVES = struct.Struct("<d"), struct.Struct("<II")


def _stretches(nodes: Sequence[Node]) -> Iterator[tuple[str, Sequence[int]]]:
    """The operations, in an order in which those of one kind stand together where they can."""
    readers: list[list[int]] = [[] for _ in nodes]
    missing = [0] * len(nodes)
    ready: dict[str, list[int]] = {}
    for k, node in enumerate(nodes):
        op = node[0]
        if op == "input":
            continue
        count = 0
        if op not in LEAVES:
            for x in node[1:]:
                if nodes[x][0] != "input":  # type: ignore[index]
                    readers[x].append(k)  # type: ignore[index]
                    count += 1
        missing[k] = count
        if not count:
            ready.setdefault(op, []).append(k)
    while ready:
        kind = max(ready, key=lambda op: len(ready[op]))
        stretch = ready.pop(kind)
        for k in stretch:  # grows as it is gone through
            for x in readers[k]:
                missing[x] -= 1
                if not missing[x]:
                    op = nodes[x][0]
                    if op == kind:
                        stretch.append(x)
                    else:
                        ready.setdefault(op, []).append(x)
        yield kind, stretch
