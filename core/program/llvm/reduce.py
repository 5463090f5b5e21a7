"""Reduction of the numbers of many lanes to a few totals as LLVM code."""

from __future__ import annotations

from .plan import function, over


def fold(width: int) -> str:
    """Return the LLVM function of `Executor.fold`: totals stay in the L1 cache, inputs are read
    once.
    """
    body = f"""%all = mul i64 %columns, {width}
  %step = mul i64 %plan_taken_count, {width}
  br label %column
column:
  %k = phi i64 [0, %entry], [%next, %end_column]
  %out_at = mul i64 %k, {width}
  %out_here = getelementptr double, ptr %out, i64 %out_at
  {over("take", "kept", "ptr %out_here", "i64 %all")}
  %column_at = mul i64 %k, %room
  %table_here = getelementptr double, ptr %table, i64 %column_at
  br label %some
some:
  %at = phi i64 [0, %column], [%next_at, %some]
  %from = getelementptr double, ptr %table_here, i64 %at
  {over("take", "taken", "ptr %from", f"i64 {width}")}
  {over("calls", "after")}
  %next_at = add i64 %at, %step
  %more = icmp slt i64 %next_at, %room
  br i1 %more, label %some, label %end_column
end_column:
  {over("keep", "kept", "ptr %out_here", "i64 %all")}
  %next = add i64 %k, 1
  %more_columns = icmp slt i64 %next, %columns
  br i1 %more_columns, label %column, label %end
end:
  ret void"""
    return function(
        "void @fold(ptr %plan, ptr %lane, ptr %table, i64 %columns, i64 %room, ptr %out)", body
    )
