"""Programs as LLVM code: straight lines over vectors of lanes, and the loop of an attempt around them.

The text calls nothing but LLVM's own instructions: no library, no runtime. Sine and cosine are reduced and summed in place.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Mapping, Sequence

from .trace import Node, Program

# The first term left out, x^19/19! or x^18/18!, is below 1e-17 at pi/4, the largest argument after reduction.
SINE_TERMS, COSINE_TERMS = 9, 9
# pi / 2 in three parts of 33 bits: a multiple of up to 2^20 times each is exact (Cody and Waite).
HALF_PI = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
BINARY = {"+": "fadd contract", "-": "fsub contract", "*": "fmul contract", "/": "fdiv contract"}
CALLS = {"sqrt": "sqrt", "abs": "fabs", "min": "minimum", "max": "maximum"}


class Lines:
    """The body of a function over vectors of W lanes, written line by line in single assignment."""

    def __init__(self, width: int) -> None:
        self.width, self.lines = width, list[str]()
        self.vector = f"<{width} x double>"
        self._known: dict[str, str] = {}

    def let(self, text: str) -> str:
        """The name of the value of an expression, computed once."""
        if text not in self._known:
            self._known[text] = f"%x{len(self._known)}"
            self.lines.append(f"{self._known[text]} = {text}")
        return self._known[text]

    def constant(self, x: float) -> str:
        """A vector of equal numbers, exact to the last bit."""
        bits = struct.unpack("<Q", struct.pack("<d", x))[0]
        return "<" + ", ".join([f"double 0x{bits:016X}"] * self.width) + ">"

    def call(self, name: str, *operands: str) -> str:
        """One of LLVM's own vector functions."""
        arguments = ", ".join(f"{self.vector} {x}" for x in operands)
        return self.let(f"call {self.vector} @llvm.{name}.v{self.width}f64({arguments})")

    def arithmetic(self, op: str, a: str, b: str) -> str:
        """a op b."""
        return self.let(f"{BINARY[op]} {self.vector} {a}, {b}")

    def choose(self, mask: str, p: str, q: str) -> str:
        """p where the mask is true, else q."""
        return self.let(f"select <{self.width} x i1> {mask}, {self.vector} {p}, {self.vector} {q}")

    def polynomial(self, x: str, coefficients: Sequence[float]) -> str:
        """By Horner, lowest coefficient first."""
        total = self.constant(coefficients[-1])
        for c in reversed(coefficients[:-1]):
            total = self.arithmetic("+", self.arithmetic("*", total, x), self.constant(c))
        return total

    def trigonometric(self, x: str, quadrant: float) -> str:
        """sin(x + quadrant * pi/2)."""
        k = self.call("rint", self.arithmetic("*", x, self.constant(2.0 / math.pi)))
        y = x
        for part in HALF_PI:
            # not contracted into one rounding: the products are exact, the differences must be seen as such
            y = self.let(f"fsub {self.vector} {y}, {self.let(f'fmul {self.vector} {k}, {self.constant(part)}')}")
        z = self.arithmetic("*", y, y)
        odd = [(-1.0) ** n / math.factorial(2 * n + 1) for n in range(SINE_TERMS)]
        even = [(-1.0) ** n / math.factorial(2 * n) for n in range(COSINE_TERMS)]
        sine, cosine = self.arithmetic("*", y, self.polynomial(z, odd)), self.polynomial(z, even)
        turn = self.arithmetic("+", k, self.constant(quadrant))
        quarter = self.arithmetic("*", turn, self.constant(0.25))
        q = self.arithmetic("-", turn, self.arithmetic("*", self.call("floor", quarter), self.constant(4.0)))
        half = self.arithmetic("*", q, self.constant(0.5))
        swapped = self.let(f"fcmp one {self.vector} {self.call('floor', half)}, {half}")
        negative = self.let(f"fcmp oge {self.vector} {q}, {self.constant(2.0)}")
        value = self.choose(swapped, cosine, sine)
        return self.choose(negative, self.let(f"fneg {self.vector} {value}"), value)

    def operation(self, node: Node, operands: Sequence[str]) -> str:
        """The value of a traced operation."""
        op = node[0]
        if op in BINARY:
            return self.arithmetic(op, *operands)
        if op in CALLS:
            return self.call(CALLS[op], *operands)
        if op == "neg":
            return self.let(f"fneg {self.vector} {operands[0]}")
        if op == "larger":
            return self.let(f"fcmp ogt {self.vector} {self.call('fabs', operands[0])}, {self.call('fabs', operands[1])}")
        if op == "where":
            return self.choose(*operands)
        return self.trigonometric(operands[0], {"sin": 0.0, "cos": 1.0}[op])


def function(program: Program, width: int, stride: int) -> str:
    """A program as a function of the first of its W lanes; slots are `stride` numbers apart."""
    body = Lines(width)

    def slot(number: int) -> str:
        return body.let(f"getelementptr double, ptr %lane, i64 {number * stride}")

    values: list[str] = []
    for node in program.nodes:
        if node[0] == "input":
            values.append(body.let(f"load {body.vector}, ptr {slot(int(node[1]))}, align 8"))
        elif node[0] == "const":
            values.append(body.constant(float(node[1])))
        else:
            values.append(body.operation(node, [values[int(k)] for k in node[1:]]))
    for number, position in program.outputs.items():
        pointer = slot(number)
        body.lines.append(f"store {body.vector} {values[position]}, ptr {pointer}, align 8")
    text = "\n  ".join(body.lines)
    return f"define internal void @{program.name}(ptr %lane) {{\n  {text}\n  ret void\n}}\n"


def entry(name: str, width: int) -> str:
    """A function that runs a program over groups of W lanes."""
    return f"""define void @run_{name}(ptr %block, i64 %groups) {{
entry:
  br label %group
group:
  %g = phi i64 [0, %entry], [%next, %group]
  %offset = mul i64 %g, {width}
  %lane = getelementptr double, ptr %block, i64 %offset
  call void @{name}(ptr %lane)
  %next = add i64 %g, 1
  %more = icmp slt i64 %next, %groups
  br i1 %more, label %group, label %end
end:
  ret void
}}
"""


def attempt(slots: Mapping[str, int], after: Iterable[str], width: int, stride: int, tolerance: float, most: int) -> str:
    """Predict, iterate until every lane has met the tolerance or is lost, then run what comes after; group by group."""
    vector, mask = f"<{width} x double>", f"<{width} x i1>"
    numbers = Lines(width)
    finish = "\n  ".join(f"call void @{name}(ptr %lane)" for name in after)
    return f"""declare i1 @llvm.vector.reduce.and.v{width}i1({mask})
define void @attempt(ptr %block, i64 %groups) {{
entry:
  br label %group
group:
  %g = phi i64 [0, %entry], [%next, %end_group]
  %offset = mul i64 %g, {width}
  %lane = getelementptr double, ptr %block, i64 %offset
  call void @predict(ptr %lane)
  %at_residual = getelementptr double, ptr %lane, i64 {slots["residual"] * stride}
  %at_iterations = getelementptr double, ptr %lane, i64 {slots["iterations"] * stride}
  %at_done = getelementptr double, ptr %lane, i64 {slots["done"] * stride}
  br label %iterate
iterate:
  %pass = phi i64 [1, %group], [%next_pass, %iterate]
  %done = phi {mask} [zeroinitializer, %group], [%now_done, %iterate]
  %count = phi {vector} [zeroinitializer, %group], [%now_count, %iterate]
  call void @newton(ptr %lane)
  %residual = load {vector}, ptr %at_residual, align 8
  %more_count = fadd {vector} %count, {numbers.constant(1.0)}
  %now_count = select {mask} %done, {vector} %count, {vector} %more_count
  %met = fcmp olt {vector} %residual, {numbers.constant(tolerance)}
  %now_done = or {mask} %done, %met
  %finite = fcmp olt {vector} %residual, {numbers.constant(math.inf)}
  %lost = xor {mask} %finite, <{", ".join(["i1 true"] * width)}>
  %settled = or {mask} %now_done, %lost
  %all = call i1 @llvm.vector.reduce.and.v{width}i1({mask} %settled)
  %next_pass = add i64 %pass, 1
  %spent = icmp sgt i64 %next_pass, {most}
  %stop = or i1 %all, %spent
  br i1 %stop, label %end_group, label %iterate
end_group:
  {finish}
  store {vector} %now_count, ptr %at_iterations, align 8
  %done_number = select {mask} %now_done, {vector} {numbers.constant(1.0)}, {vector} zeroinitializer
  store {vector} %done_number, ptr %at_done, align 8
  %next = add i64 %g, 1
  %more = icmp slt i64 %next, %groups
  br i1 %more, label %group, label %end
end:
  ret void
}}
"""


def declarations(width: int) -> str:
    """LLVM's own vector functions that programs use."""
    vector = f"<{width} x double>"
    one = "\n".join(f"declare {vector} @llvm.{name}.v{width}f64({vector})" for name in ("sqrt", "fabs", "rint", "floor"))
    two = "\n".join(f"declare {vector} @llvm.{name}.v{width}f64({vector}, {vector})" for name in ("minimum", "maximum"))
    return f"{one}\n{two}\n"
