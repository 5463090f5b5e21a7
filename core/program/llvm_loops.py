"""The loops of a plan as LLVM code: Newton's iteration, and parts of a mechanism; for motions, see llvm_follow and llvm_fan."""

from __future__ import annotations

import math
from collections.abc import Iterable

from .executor import DONE, ITERATIONS, Plan
from .llvm_code import Lines


def settle(plan: Plan, width: int) -> str:
    """An attempt at W lanes that are predicted, but for the test: iterate until every one has met the tolerance or is lost."""
    vector, mask, lines = f"<{width} x double>", f"<{width} x i1>", Lines(width)
    at = {name: lines.slot(plan.slots[name]) for name in ("residual", ITERATIONS, DONE)}
    places = "\n  ".join(lines.lines)
    return f"""declare i1 @llvm.vector.reduce.and.v{width}i1({mask})
define internal void @settle(ptr %lane) {{
entry:
  {places}
  br label %iterate
iterate:
  %pass = phi i64 [1, %entry], [%next_pass, %iterate]
  %done = phi {mask} [zeroinitializer, %entry], [%now_done, %iterate]
  %count = phi {vector} [zeroinitializer, %entry], [%now_count, %iterate]
  call void @newton(ptr %lane)
  %residual = load {vector}, ptr {at["residual"]}, align 8
  %more_count = fadd {vector} %count, {lines.constant(1.0)}
  %now_count = select {mask} %done, {vector} %count, {vector} %more_count
  %met = fcmp olt {vector} %residual, {lines.constant(plan.tolerance)}
  %now_done = or {mask} %done, %met
  %finite = fcmp olt {vector} %residual, {lines.constant(math.inf)}
  %lost = xor {mask} %finite, <{", ".join(["i1 true"] * width)}>
  %settled = or {mask} %now_done, %lost
  %all = call i1 @llvm.vector.reduce.and.v{width}i1({mask} %settled)
  %next_pass = add i64 %pass, 1
  %spent = icmp sgt i64 %next_pass, {plan.most}
  %stop = or i1 %all, %spent
  br i1 %stop, label %finish, label %iterate
finish:
  {calls(plan.after)}
  store {vector} %now_count, ptr {at[ITERATIONS]}, align 8
  %done_number = select {mask} %now_done, {vector} {lines.constant(1.0)}, {vector} zeroinitializer
  store {vector} %done_number, ptr {at[DONE]}, align 8
  ret void
}}
"""


def over_groups(name: str, functions: Iterable[str], slots: int, width: int) -> str:
    """A function that calls others on every group of W lanes."""
    return f"""define void @{name}(ptr %memory, i64 %groups) {{
entry:
  br label %group
group:
  %g = phi i64 [0, %entry], [%next, %group]
  %offset = mul i64 %g, {slots * width}
  %lane = getelementptr double, ptr %memory, i64 %offset
  {calls(functions)}
  %next = add i64 %g, 1
  %more = icmp slt i64 %next, %groups
  br i1 %more, label %group, label %end
end:
  ret void
}}
"""


def parts(plan: Plan, width: int) -> str:
    """See `Executor.parts`."""
    vector, begin, keep = f"<{width} x double>", Lines(width, "b"), Lines(width, "k")
    for k, slot in enumerate(plan.fixed):
        begin.write(slot, begin.spread(begin.let(f"load double, ptr {begin.number('%own', k)}, align 8")))
    for row, slot in enumerate(plan.sampled):
        place = begin.number("%samples", begin.sum(begin.product("%room", row), "%first"))
        begin.write(slot, begin.let(f"load {vector}, ptr {place}, align 8"))
    for k, slot in enumerate(plan.taken):
        row = begin.let(f"load i64, ptr {begin.let(f'getelementptr i64, ptr %sources, i64 {k}')}, align 8")
        place = begin.number("%world", begin.sum(begin.product("%room", row), "%first"))
        begin.write(slot, begin.let(f"load {vector}, ptr {place}, align 8"))
    for row, slot in enumerate(plan.kept):
        place = keep.number("%world", keep.sum(keep.product("%room", keep.sum("%row", row)), "%first"))
        keep.lines.append(f"store {vector} {keep.read(slot)}, ptr {place}, align 8")
    tables = "ptr %members, ptr %fixed, ptr %samples, i64 %room, ptr %taken, ptr %world"
    return f"""define void @parts(ptr %memory, i64 %count, {tables}, i64 %base, i64 %groups) {{
entry:
  br label %part
part:
  %k = phi i64 [0, %entry], [%next_part, %end_part]
  %place = getelementptr i64, ptr %members, i64 %k
  %member = load i64, ptr %place, align 8
  %own_at = mul i64 %member, {len(plan.fixed)}
  %own = getelementptr double, ptr %fixed, i64 %own_at
  %sources_at = mul i64 %k, {len(plan.taken)}
  %sources = getelementptr i64, ptr %taken, i64 %sources_at
  %rows_before = mul i64 %member, {len(plan.kept)}
  %row = add i64 %base, %rows_before
  br label %group
group:
  %g = phi i64 [0, %part], [%next, %group]
  %offset = mul i64 %g, {len(plan.slots) * width}
  %lane = getelementptr double, ptr %memory, i64 %offset
  %first = mul i64 %g, {width}
  {begin.text}
  call void @predict(ptr %lane)
  call void @settle(ptr %lane)
  {calls(plan.alone)}
  {keep.text}
  %next = add i64 %g, 1
  %more = icmp slt i64 %next, %groups
  br i1 %more, label %group, label %end_part
end_part:
  %next_part = add i64 %k, 1
  %more_parts = icmp slt i64 %next_part, %count
  br i1 %more_parts, label %part, label %end
end:
  ret void
}}
"""


def calls(names: Iterable[str]) -> str:
    """Calls of functions of a lane, one after the other."""
    return "\n  ".join(f"call void @{name}(ptr %lane)" for name in names)
