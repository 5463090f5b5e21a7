"""Tables of whole numbers in LLVM code, and loops over their rows."""

from __future__ import annotations

from collections.abc import Sequence

from .llvm_code import Lines


class Rows(Lines):
    """A loop over the rows of tables of whole numbers: its lines are those of one row."""

    def __init__(self, width: int, name: str) -> None:
        super().__init__(width, name)
        self.row, self.count, self.constants = f"%{name}_row", 0, ""

    def table(self, *columns: Sequence[int]) -> list[str]:
        """Go through these columns; names of their entries in the row."""
        entries: list[str] = []
        for k, column in enumerate(columns):
            self.count = len(column)
            numbers = ", ".join(f"i64 {x}" for x in column)
            self.constants += f"@{self.prefix}_{k} = internal constant [{self.count} x i64] [{numbers}]\n"
            place = self.let(f"getelementptr i64, ptr @{self.prefix}_{k}, i64 {self.row}")
            entries.append(self.let(f"load i64, ptr {place}, align 8"))
        return entries

    def loop(self, before: str) -> str:
        """The loop, to be entered from the block before; what follows stands in the block "NAME_end"."""
        name = self.prefix
        return f"""br label %{name}
{name}:
  {self.row} = phi i64 [0, %{before}], [%{name}_next, %{name}]
  {self.text}
  %{name}_next = add i64 {self.row}, 1
  %{name}_more = icmp ult i64 %{name}_next, {self.count}
  br i1 %{name}_more, label %{name}, label %{name}_end
{name}_end:"""
