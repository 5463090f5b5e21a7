"""Programs as LLVM code: functions of a vector of lanes.

`ordered` puts the operations with the longest chain of dependent operations first. A processor
begins several operations per cycle, but looks only a few hundred ahead for ready ones. The pivots
of an elimination form a chain, each with a division. The other operations of a program belong
between them, but are traced before or after. The method is list scheduling by the longest path to
the end (Hu, Parallel sequencing and assembly line problems, Operations Research 9, 1961).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from heapq import heappop, heappush

from ..straight_line import Program, lowered
from ..tape import LEAVES, Node, operands, place_of
from .ir_writer import Lines

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


# Values held at once, of 32 registers: LLVM's own schedule moves lines. With 16 registers and
# narrower vectors, LLVM alone does as well.
HELD, WIDE = 24, 8
# Spill and reload lines per node that cost as much as waiting for divisions.
PUT_AWAY = 0.4


def function(program: Program, width: int) -> str:
    """Return a program as a function of its W lanes.

    The order with the shortest waits is used if 32 registers allow it: with 16 it takes up to half
    as long again.
    """
    program = lowered(program)
    if program.times > 1:
        return _repeated(program, width)
    straight = _Straight(program, width)
    if width == WIDE and (waiting := ordered(program)) is not program:
        other = _Straight(waiting, width)
        if len(other.lines) - len(straight.lines) <= PUT_AWAY * len(program.nodes):
            straight = other
    return (
        f"define void @{program.name}(ptr noalias %lane, ptr %table) {{\n  {straight.text}\n  ret"
        " void\n}\n"
    )


def _repeated(program: Program, width: int) -> str:
    """Return a repeated program as a loop that keeps the largest of each output."""
    body, end = Lines(width, lane="%here"), Lines(width, "e")
    values = list[str]()
    for node in program.nodes:
        known = (
            body.read(int(node[1]))
            if node[0] == "input"
            else body.constant(float(node[1]))
            if node[0] == "const"
            else None
        )
        values.append(known or body.operation(node[0], [values[k] for k in operands(node)]))
    largest = list[str]()
    for k, (slot, number) in enumerate(program.outputs.items()):
        found = body.umax(f"%largest{k}", values[number])
        largest.append(
            f"%largest{k} = phi {body.vector} [zeroinitializer, %entry], [{found}, %run]"
        )
        end.write(slot, found)
    phis = "\n  ".join(largest)
    return f"""define void @{program.name}(ptr noalias %lane, ptr %table) {{
entry:
  br label %run
run:
  %k = phi i64 [0, %entry], [%next, %run]
  {phis}
  %here = getelementptr {body.vector}, ptr %lane, i64 %k
  {body.text}
  %next = add i64 %k, 1
  %more = icmp ult i64 %next, {program.times}
  br i1 %more, label %run, label %end
end:
  {end.text}
  ret void
}}
"""


class _Straight(Lines):
    """Lines of a program that holds no more values at once than there are registers.

    Excess values are spilled: first the one with the farthest next use (Belady 1966); inputs are
    reloaded from their slots. Without this LLVM's allocator takes as long as all other passes
    together, and its code is a few percent slower.
    """

    def __init__(self, program: Program, width: int) -> None:
        super().__init__(width)
        self._nodes, self._most = program.nodes, HELD if width == WIDE else len(program.nodes)
        self._held, self._masks = dict[int, str](), dict[int, str]()
        self._stacked, self._free, self._room = dict[int, int](), list[int](), 0
        self._due, writes = _uses(program)
        for number, node in enumerate(program.nodes):
            if node[0] not in LEAVES:
                self._step(number, node)
                if number in writes:
                    self._write_all(writes[number])
        self._write_all(writes.get(len(program.nodes), ()))
        if self._room:
            self.lines.insert(0, f"%stack = alloca {self.vector}, i64 {self._room}, align 64")

    def _step(self, number: int, node: Node) -> None:
        wanted = operands(node)
        values = [self._held.get(k) or self._fetched(k, wanted) for k in wanted]
        result = self.operation(node[0], values)
        self._used(wanted)
        if node[0] == "larger":
            self._masks[number] = result
        else:
            self._hold(number, result, ())

    def _write_all(self, writes: Sequence[tuple[int, int]]) -> None:
        """Write slots; all reads of old values come first."""
        values = [(slot, self._held.get(k) or self._fetched(k, ())) for slot, k in writes]
        for slot, value in values:
            self.write(slot, value)
        self._used(k for _, k in writes)

    def _fetched(self, k: int, wanted: Sequence[int]) -> str:
        """Return the name of a value loaded again; no operand in `wanted` is spilled for it."""
        node = self._nodes[k]
        if node[0] == "const":
            return self.constant(float(node[1]))
        if node[0] == "larger":
            return self._masks[k]
        if node[0] == "node":
            place = self.number(self.slot(int(node[1])), place_of(int(node[2]), self.width)[1])
            name = self.spread(self.assign(f"load double, ptr {place}, align 8"))
        else:
            place = self.slot(int(node[1])) if node[0] == "input" else self._place(self._stacked[k])
            name = self.assign(f"load {self.vector}, ptr {place}, align 8")
        self._hold(k, name, wanted)
        return name

    def _hold(self, k: int, name: str, wanted: Sequence[int]) -> None:
        if len(self._held) >= self._most:
            last = max((x for x in self._held if x not in wanted), key=lambda x: self._due[x][-1])
            value = self._held.pop(last)
            if self._nodes[last][0] not in LEAVES and last not in self._stacked:
                if not self._free:
                    self._free.append(self._room)
                    self._room += 1
                self._stacked[last] = self._free.pop()
                self.lines.append(
                    f"store {self.vector} {value}, ptr {self._place(self._stacked[last])}, align 8"
                )
        self._held[k] = name

    def _used(self, values: Iterable[int]) -> None:
        """Release the places of values without a further use."""
        for k in values:
            due = self._due[k]
            due.pop()
            if not due:
                self._held.pop(k, None)
                if k in self._stacked:
                    self._free.append(self._stacked.pop(k))

    def _place(self, number: int) -> str:
        return self.let(f"getelementptr {self.vector}, ptr %stack, i64 {number}")


def _uses(program: Program) -> tuple[list[list[int]], dict[int, list[tuple[int, int]]]]:
    """Return the users of each value, the first one last, and the slot writes after each operation,
    with their values.

    A slot is written as soon as its value exists and its old value has no further reader.
    """
    nodes, end = program.nodes, len(program.nodes)
    due: list[list[int]] = [[] for _ in nodes]
    for number in reversed(range(end)):
        for k in operands(nodes[number]):
            due[k].append(number)
    last_read: dict[int, int] = {}
    for k, node in enumerate(nodes):
        if node[0] in ("input", "node") and due[k]:
            last_read[int(node[1])] = max(due[k][0], last_read.get(int(node[1]), 0))
    stands = {
        slot: int(nodes[k][1])
        for slot, k in program.outputs.items()
        if nodes[k][0] in ("input", "node")
    }
    # an input with another slot as output is written at its last use, if its target has no reader
    read = last_read.keys() | stands.values()
    early = {slot for slot in stands if due[program.outputs[slot]] and slot not in read}
    last_read |= {source: end for slot, source in stands.items() if slot not in early}
    writes: dict[int, list[tuple[int, int]]] = {}
    for slot, k in program.outputs.items():
        when = (
            due[k][0]
            if slot in early
            else end
            if nodes[k][0] in LEAVES
            else max(k, last_read.get(slot, 0))
        )
        writes.setdefault(when, []).append((slot, k))
        due[k] = sorted([*due[k], when], reverse=True)
    return due, writes
