"""Interpreter of program tables as LLVM code: see `bytecode`."""

from __future__ import annotations

from ..bytecode import ARITY, KINDS
from .ir_writer import Lines

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
