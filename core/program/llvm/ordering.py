"""Order of the operations in machine code: first those with the longest chain of dependent
operations.

A processor begins several operations per cycle, but looks only a few hundred ahead for ready ones.
The pivots of an elimination form a chain, each with a division. The other operations of a program
belong between them, but are traced before or after. The method is list scheduling by the longest
path to the end (Hu, Parallel sequencing and assembly line problems, Operations Research 9, 1961).
"""

from __future__ import annotations

from dataclasses import replace
from heapq import heappop, heappush

from ..straight_line import Program
from ..tape import LEAVES, operands

CYCLES = {"/": 24, "sqrt": 32, "larger": 5, "before": 3, "umax": 3, "where": 1, "abs": 1, "neg": 1}
"""Latency [cycles] on vectors of eight on Intel's Golden Cove (uops.info); `OTHERS` for all other
operations.
"""
OTHERS = 4
AT_ONCE = 2
"""Operations on such vectors that begin in one cycle."""
PART = 0.65
"""Threshold of the critical path, relative to the time of all operations. Programs with a shorter
path gain little and lose more: many values are computed too early.
"""


def ordered(program: Program) -> Program:
    """Return the same program, rescheduled if its critical path dominates; else unchanged."""
    nodes = program.nodes
    reads = [operands(node) for node in nodes]
    cycles = [0 if node[0] in LEAVES else CYCLES.get(node[0], OTHERS) for node in nodes]
    users: list[list[int]] = [[] for _ in nodes]
    for k, read in enumerate(reads):
        for x in read:
            users[x].append(k)
    to_end = [0] * len(nodes)
    for k in reversed(range(len(nodes))):
        to_end[k] = cycles[k] + max((to_end[x] for x in users[k]), default=0)
    if AT_ONCE * max(to_end, default=0) <= PART * sum(map(bool, cycles)):
        return program
    order, there = list[int](), [0] * len(nodes)
    missing = [len(read) for read in reads]
    ready, waiting = list[tuple[int, int]](), list[tuple[int, int]]()
    cycle, room = 0, AT_ONCE

    def done(k: int) -> None:
        order.append(k)
        there[k] = cycle + cycles[k]
        for x in users[k]:
            missing[x] -= 1
            if not missing[x]:
                heappush(waiting, (max(there[y] for y in reads[x]), x))

    for k, node in enumerate(nodes):
        if node[0] in LEAVES:
            done(k)
    while ready or waiting:
        while waiting and waiting[0][0] <= cycle:
            _, k = heappop(waiting)
            heappush(ready, (-to_end[k], k))
        if ready and room:
            done(heappop(ready)[1])
            room -= 1
        else:
            cycle, room = (cycle + 1 if ready else waiting[0][0]), AT_ONCE
    place = {k: number for number, k in enumerate(order)}
    found = (
        nodes[k] if nodes[k][0] in LEAVES else (nodes[k][0], *(place[x] for x in reads[k]))
        for k in order
    )
    outputs = {slot: place[k] for slot, k in program.outputs.items()}
    return replace(program, nodes=tuple(found), outputs=outputs)
