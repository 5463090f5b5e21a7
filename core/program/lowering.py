"""Programs in the operations of a processor: a product and a sum become one operation, rounded
once.

This module decides the fusion, not the compiler: compiled and interpreted programs give the same
numbers to the last bit.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from .straight_line import Program
from .tape import LEAVES, Node, operands

FUSED = frozenset({"fma", "fnma", "fms"})
"""a b + c, c - a b and a b - c, of operands a, b, c."""
SUMS = {"+": ("fma", "fma"), "-": ("fnma", "fms")}
"""Fused form of a sum or difference with a product as second operand, or as first."""
SIZES = frozenset({"abs", "umax"})
"""Operations with results that are never negative. "umax" is the larger of two such numbers, or NaN
if either is.
"""


def lowered(program: Program) -> Program:
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


def unrolled(program: Program) -> Program:
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
