"""LLVM text over a vector of lanes, line by line: programs as functions, and the interpreter of
their tables (see `bytecode`).

The text calls LLVM instructions only: no library, no runtime. Sine and cosine are reduced and
summed in place. The W lanes of a vector are contiguous, slot by slot: a program touches one stretch
of a few kilobytes.

`reschedule` puts the operations with the longest chain of dependent operations first. A processor
begins several operations per cycle, but looks only a few hundred ahead for ready ones. The pivots
of an elimination form a chain, each with a division. The other operations of a program belong
between them, but are traced before or after. The method is list scheduling by the longest path to
the end (Hu, Parallel sequencing and assembly line problems, Operations Research 9, 1961).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Sequence
from dataclasses import replace
from heapq import heappop, heappush

from ...program.straight_line import Program
from ...program.tape import LEAVES, Node, operands, place_of
from .bytecode import ARITY, FUSED, KINDS, lower, unroll

# The first term left out, x^19/19! or x^18/18!, is below 1e-17 at pi/4, the largest argument after
# reduction.
SINE_TERMS, COSINE_TERMS = 9, 9
# pi / 2 in three parts of 33 bits: a multiple of up to 2^20 times each is exact (Cody and Waite).
HALF_PI = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
# Coefficients in z = t^2 of atan(t) / t, interpolated at Chebyshev's nodes of 0 <= t <= tan(pi/8),
# the largest argument after reduction; the error is below 3e-18.
ARC_TANGENT = (
    *(1.0, -0.33333333333333326, 0.19999999999997015, -0.1428571428532971, 0.11111111085322109),
    *(-0.09090908059031191, 0.07692281099937744, -0.06666205259976526, 0.05876834004614161),
    *(-0.05217312574061591, 0.04499500728984032, -0.03338782450121195, 0.015113765096600925),
)
BINARY = {"+": "fadd", "-": "fsub", "*": "fmul", "/": "fdiv"}
EXTREMES = frozenset({"minimum", "maximum"})
CALLS = {"sqrt": "sqrt", "abs": "fabs", "min": "minimum", "max": "maximum"}


class Lines:
    """Body of a function over vectors of W lanes, line by line in static single assignment."""

    def __init__(self, width: int, prefix: str = "x") -> None:
        self.width, self.prefix, self.lines = width, prefix, list[str]()
        self.vector = f"<{width} x double>"
        self._known: dict[str, str] = {}

    def let(self, text: str) -> str:
        """Return the name of an expression's value, computed once."""
        if text not in self._known:
            self._known[text] = self.assign(text)
        return self._known[text]

    def assign(self, text: str) -> str:
        """Return the name of an expression's value, computed here even if computed before."""
        name = f"%{self.prefix}{len(self.lines)}"
        self.lines.append(f"{name} = {text}")
        return name

    @property
    def text(self) -> str:
        """The lines, indented."""
        return "\n  ".join(self.lines)

    def number(self, pointer: str, index: str | int) -> str:
        """Return the address of a number in an array."""
        return self.let(f"getelementptr double, ptr {pointer}, i64 {index}")

    def spread(self, x: str) -> str:
        """Return a vector of W times the same number."""
        one = self.let(f"insertelement {self.vector} poison, double {x}, i64 0")
        return self.let(
            f"shufflevector {self.vector} {one}, {self.vector} poison, <{self.width} x i32>"
            " zeroinitializer"
        )

    def slot(self, number: str | int) -> str:
        """Return the address of a slot."""
        return self.let(f"getelementptr {self.vector}, ptr %lane, i64 {number}")

    def read(self, number: str | int) -> str:
        """Return the value of a slot."""
        return self.let(f"load {self.vector}, ptr {self.slot(number)}, align 8")

    def write(self, number: str | int, value: str) -> None:
        """Set a slot."""
        self.lines.append(f"store {self.vector} {value}, ptr {self.slot(number)}, align 8")

    def constant(self, x: float) -> str:
        """Return a vector of equal numbers, exact to the last bit."""
        bits = struct.unpack("<Q", struct.pack("<d", x))[0]
        return "<" + ", ".join([f"double 0x{bits:016X}"] * self.width) + ">"

    def call(self, name: str, *operands: str) -> str:
        """Call one of LLVM's vector functions."""
        arguments = ", ".join(f"{self.vector} {x}" for x in operands)
        # of two zeros either may be the smaller: their order costs three more instructions.
        # Elsewhere nsz would let LLVM turn the sign of a zero in compiled programs, which would
        # then differ from interpreted ones.
        flags = " nsz" if name in EXTREMES else ""
        return self.let(f"call{flags} {self.vector} @llvm.{name}.v{self.width}f64({arguments})")

    def umax(self, a: str, b: str) -> str:
        """Return the larger of two numbers without a sign, or NaN: their bits have the same order,
        NaN last.

        The comparison is of signed integers, although the numbers have no sign: AVX2 compares only
        those, and takes four instructions for unsigned ones.
        """
        words = f"<{self.width} x i64>"
        x, y = (self.let(f"bitcast {self.vector} {each} to {words}") for each in (a, b))
        larger = self.let(f"call {words} @llvm.smax.v{self.width}i64({words} {x}, {words} {y})")
        return self.let(f"bitcast {words} {larger} to {self.vector}")

    def arithmetic(self, op: str, a: str, b: str) -> str:
        """Return a op b."""
        return self.let(f"{BINARY[op]} {self.vector} {a}, {b}")

    def fused(self, op: str, a: str, b: str, c: str) -> str:
        """Return a product and a sum, rounded once if the processor can."""
        first = self.let(f"fneg {self.vector} {a}") if op == "fnma" else a
        last = self.let(f"fneg {self.vector} {c}") if op == "fms" else c
        return self.call("fmuladd", first, b, last)

    def choose(self, mask: str, p: str, q: str) -> str:
        """Return p if the mask is true, else q."""
        return self.let(f"select <{self.width} x i1> {mask}, {self.vector} {p}, {self.vector} {q}")

    def polynomial(self, x: str, coefficients: Sequence[float]) -> str:
        """Return a polynomial by Horner's rule, lowest coefficient first."""
        total = self.constant(coefficients[-1])
        for c in reversed(coefficients[:-1]):
            total = self.fused("fma", total, x, self.constant(c))
        return total

    def trigonometric(self, x: str, quadrant: float) -> str:
        """Return sin(x + quadrant * pi/2)."""
        k = self.call("rint", self.arithmetic("*", x, self.constant(2.0 / math.pi)))
        y = x
        for part in HALF_PI:
            # not fused: the products are exact, and the differences must see them as such
            y = self.arithmetic("-", y, self.arithmetic("*", k, self.constant(part)))
        z = self.arithmetic("*", y, y)
        odd = [(-1.0) ** n / math.factorial(2 * n + 1) for n in range(SINE_TERMS)]
        even = [(-1.0) ** n / math.factorial(2 * n) for n in range(COSINE_TERMS)]
        sine, cosine = self.arithmetic("*", y, self.polynomial(z, odd)), self.polynomial(z, even)
        turn = self.arithmetic("+", k, self.constant(quadrant))
        quarter = self.arithmetic("*", turn, self.constant(0.25))
        q = self.arithmetic(
            "-", turn, self.arithmetic("*", self.call("floor", quarter), self.constant(4.0))
        )
        half = self.arithmetic("*", q, self.constant(0.5))
        swapped = self.let(f"fcmp one {self.vector} {self.call('floor', half)}, {half}")
        negative = self.let(f"fcmp oge {self.vector} {q}, {self.constant(2.0)}")
        value = self.choose(swapped, cosine, sine)
        return self.choose(negative, self.let(f"fneg {self.vector} {value}"), value)

    def arc_tangent(self, y: str, x: str) -> str:
        """Return the angle of the direction (x, y), in -pi..pi; NaN of zero."""
        flat, high = self.call("fabs", x), self.call("fabs", y)
        small, large = self.call("minimum", flat, high), self.call("maximum", flat, high)
        # atan(t) = pi/4 + atan((t - 1) / (t + 1)) halves the angle, with one division for both
        steep = self.let(
            f"fcmp ogt {self.vector} {small},"
            f" {self.arithmetic('*', large, self.constant(math.tan(math.pi / 8.0)))}"
        )
        t = self.arithmetic(
            "/",
            self.choose(steep, self.arithmetic("-", small, large), small),
            self.choose(steep, self.arithmetic("+", small, large), large),
        )
        angle = self.arithmetic("*", t, self.polynomial(self.arithmetic("*", t, t), ARC_TANGENT))
        turned = self.arithmetic("+", angle, self.constant(math.pi / 4.0))
        angle = self.choose(steep, turned, angle)
        across = self.let(f"fcmp ogt {self.vector} {high}, {flat}")
        rest = self.arithmetic("-", self.constant(math.pi / 2.0), angle)
        angle = self.choose(across, rest, angle)
        behind = self.let(f"fcmp olt {self.vector} {x}, {self.constant(0.0)}")
        rest = self.arithmetic("-", self.constant(math.pi), angle)
        return self.call("copysign", self.choose(behind, rest, angle), y)

    def operation(self, op: str, operands: Sequence[str]) -> str:
        """Return the value of a traced operation."""
        if op in BINARY:
            return self.arithmetic(op, *operands)
        if op in FUSED:
            return self.fused(op, *operands)
        if op == "umax":
            return self.umax(*operands)
        if op in CALLS:
            return self.call(CALLS[op], *operands)
        if op == "atan2":
            return self.arc_tangent(*operands)
        if op == "neg":
            return self.let(f"fneg {self.vector} {operands[0]}")
        if op == "larger":
            return self.let(
                f"fcmp ogt {self.vector} {self.call('fabs', operands[0])},"
                f" {self.call('fabs', operands[1])}"
            )
        if op == "where":
            return self.choose(*operands)
        if op == "before":
            order = ", ".join(f"i32 {k}" for k in (self.width, *range(self.width - 1)))
            return self.let(
                f"shufflevector {self.vector} {operands[0]}, {self.vector} {operands[1]},"
                f" <{self.width} x i32> <{order}>"
            )
        return self.trigonometric(operands[0], {"sin": 0.0, "cos": 1.0}[op])


def declarations(width: int) -> str:
    """Return the declarations of LLVM's vector functions that programs use."""
    vector = f"<{width} x double>"
    one = "\n".join(
        f"declare {vector} @llvm.{name}.v{width}f64({vector})"
        for name in ("sqrt", "fabs", "rint", "floor")
    )
    two = "\n".join(
        f"declare {vector} @llvm.{name}.v{width}f64({vector}, {vector})"
        for name in ("minimum", "maximum", "copysign")
    )
    words, three = (
        f"<{width} x i64>",
        f"declare {vector} @llvm.fmuladd.v{width}f64({vector}, {vector}, {vector})",
    )
    return f"{one}\n{two}\n{three}\ndeclare {words} @llvm.smax.v{width}i64({words}, {words})\n"


MASK = "larger"
"""The operation with a boolean result: all bits of a number set, or none."""


def interpret(width: int) -> str:
    """Return the LLVM function of W lanes and a table."""
    kinds = "\n    ".join(f"i32 {kind}, label %kind{kind}" for kind in KINDS.values())
    ends = ", ".join(f"[%end, %kind{kind}_run]" for kind in KINDS.values())
    return f"""define void @interpret(ptr %lane, ptr %table) {{
entry:
  br label %next
next:
  %at = phi ptr [%table, %entry], {ends}
  %kind = load i32, ptr %at, align 4
  %bytes_at = getelementptr i32, ptr %at, i64 1
  %bytes_short = load i32, ptr %bytes_at, align 4
  %bytes = zext i32 %bytes_short to i64
  %rows = getelementptr i32, ptr %at, i64 2
  %end = getelementptr i8, ptr %rows, i64 %bytes
  switch i32 %kind, label %done [
    {kinds}
  ]
{"".join(_stretch(op, width) for op in ARITY)}done:
  ret void
}}
"""


def _stretch(op: str, width: int) -> str:
    """Return the loop over the rows of one kind of operation."""
    name = f"kind{KINDS[op]}"
    row = _Row(width, f"{name}_")
    row.result(row.value(op))
    return f"""{name}:
  br label %{name}_run
{name}_run:
  %{name}_row = phi ptr [%rows, %{name}], [%{name}_next, %{name}_run]
  {row.text}
  %{name}_next = getelementptr i32, ptr %{name}_row, i64 {ARITY[op] + 1}
  %{name}_more = icmp ult ptr %{name}_next, %end
  br i1 %{name}_more, label %{name}_run, label %next
"""


class _Row(Lines):
    """Lines of one row of a table."""

    def place(self, k: int) -> str:
        """Return the address that entry k of the row names."""
        word = self.let(f"getelementptr i32, ptr %{self.prefix}row, i64 {k}")
        offset = self.let(f"zext i32 {self.let(f'load i32, ptr {word}, align 4')} to i64")
        return self.let(f"getelementptr i8, ptr %lane, i64 {offset}")

    def operand(self, k: int, kind: str = "double") -> str:
        """Return a vector that the row names."""
        return self.let(f"load <{self.width} x {kind}>, ptr {self.place(k)}, align 8")

    def value(self, op: str) -> str:
        """Return the result of the row's operation."""
        if op == "const":
            number = self.let(f"getelementptr i32, ptr %{self.prefix}row, i64 1")
            return self.spread(self.let(f"load double, ptr {number}, align 4"))
        if op == "node":
            return self.spread(self.let(f"load double, ptr {self.place(1)}, align 8"))
        if op == "copy":
            return self.operand(1)
        if op == "where":
            mask = self.let(
                f"icmp slt <{self.width} x i64> {self.operand(1, 'i64')}, zeroinitializer"
            )
            return self.choose(mask, self.operand(2), self.operand(3))
        value = self.operation(op, [self.operand(k) for k in range(1, ARITY[op] + 1)])
        if op == MASK:
            words = self.let(f"sext <{self.width} x i1> {value} to <{self.width} x i64>")
            return self.let(f"bitcast <{self.width} x i64> {words} to {self.vector}")
        return value

    def result(self, value: str) -> None:
        """Store the result at its place."""
        self.lines.append(f"store {self.vector} {value}, ptr {self.place(0)}, align 8")


CYCLES = {
    "atan2": 90,
    "/": 24,
    "sqrt": 32,
    "larger": 5,
    "before": 3,
    "umax": 3,
    "where": 1,
    "abs": 1,
    "neg": 1,
}
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


def reschedule(program: Program) -> Program:
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
    program = lower(unroll(program))
    straight = _Straight(program, width)
    if width == WIDE and (waiting := reschedule(program)) is not program:
        other = _Straight(waiting, width)
        if len(other.lines) - len(straight.lines) <= PUT_AWAY * len(program.nodes):
            straight = other
    return (
        f"define void @{program.name}(ptr noalias %lane, ptr %table) {{\n  {straight.text}\n  ret"
        " void\n}\n"
    )


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
        values = [self._held.get(k) or self._fetch(k, wanted) for k in wanted]
        result = self.operation(node[0], values)
        self._release(wanted)
        if node[0] == "larger":
            self._masks[number] = result
        else:
            self._hold(number, result, ())

    def _write_all(self, writes: Sequence[tuple[int, int]]) -> None:
        """Write slots; all reads of old values come first."""
        values = [(slot, self._held.get(k) or self._fetch(k, ())) for slot, k in writes]
        for slot, value in values:
            self.write(slot, value)
        self._release(k for _, k in writes)

    def _fetch(self, k: int, wanted: Sequence[int]) -> str:
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

    def _release(self, values: Iterable[int]) -> None:
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
