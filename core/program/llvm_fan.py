"""Following many motions through the same samples as LLVM code, lanes as motions."""

from __future__ import annotations

import math

from .executor import LINE, MARGIN, Plan
from .llvm_code import Lines
from .llvm_loops import calls
from .llvm_tables import Rows
from .trace import NODES


def fan(plan: Plan, width: int) -> str:
    """See `Executor.fan`: every group of W motions goes through all samples while its slots are in the nearest cache.

    A group that has come through `NODES` samples is extended by what is remembered of them. Where that fails for a motion that goes
    on, the group goes back, and is predicted by its rates.
    """
    vector, mask = f"<{width} x double>", f"<{width} x i1>"
    # whole cache lines go straight to memory: to have each fetched first, only to be overwritten, takes a third of all time
    past_caches = ", !nontemporal !{i32 1}" if width == LINE else ""
    test, keep, carry = (Lines(width, prefix) for prefix in "tkm")
    accepted = test.let(f"fcmp ogt {vector} {test.read(plan.slots[MARGIN])}, zeroinitializer")
    column = keep.sum("%first", keep.product("%step", "%k"))
    place_in_plane = keep.sum(keep.product(column, "%lanes"), keep.product("%g", width))
    plane = keep.product("%columns", "%lanes")
    for row, slot in enumerate(plan.kept):
        place = keep.number("%out", keep.sum(keep.product(plane, row), place_in_plane))
        value = keep.choose("%still", keep.read(slot), keep.constant(math.nan))
        keep.lines.append(f"store {vector} {value}, ptr {place}, align {8 * width}{past_caches}")
    past = carry.product(carry.let(f"urem i64 %k, {NODES}"), len(plan.remembered))
    for k, slot in enumerate(plan.remembered):
        carry.write(carry.sum(past, plan.past + k), carry.read(slot))
    for source, target in plan.moves:  # one by one: read all at once they would not fit into the registers
        if source not in plan.rates:
            carry.write(target, carry.read(source))
    rates = [pair for pair in plan.carried if pair[0] in plan.rates]
    back, again, move = (Rows(width, f"fan_{name}") for name in ("back", "again", "move"))
    for rows, pairs in ((back, [pair[::-1] for pair in reversed(plan.carried)]), (again, plan.carried), (move, rates)):
        source, target = rows.table(*zip(*pairs, strict=True))
        rows.write(target, rows.read(source))
    inputs = "ptr %memory, i64 %groups, ptr %samples, i64 %stride, i64 %wanted"
    return f"""{back.constants}
{again.constants}
{move.constants}
declare i1 @llvm.vector.reduce.or.v{width}i1({mask})
define void @fan({inputs}, ptr %out, i64 %columns, i64 %lanes, i64 %first, i64 %step) {{
entry:
  br label %group
group:
  %g = phi i64 [0, %entry], [%next_group, %end_group]
  %offset = mul i64 %g, {len(plan.slots) * width}
  %lane = getelementptr double, ptr %memory, i64 %offset
  br label %sample
sample:
  %k = phi i64 [0, %group], [%next, %carry]
  %alive = phi {mask} [<{", ".join(["i1 true"] * width)}>, %group], [%still, %carry]
  {_given(plan, width, "b", "%k")}
  %smooth = icmp uge i64 %k, {NODES}
  br i1 %smooth, label %extend, label %predict
extend:
  call void @extend(ptr %lane)
  br label %attempt
return:
  {back.loop("return")}
  {_given(plan, width, "r", "%before")}
  {calls(plan.onward)}
  {again.loop("fan_back_end")}
  {_given(plan, width, "a", "%k")}
  br label %predict
predict:
  call void @predict(ptr %lane)
  br label %attempt
attempt:
  %extended = phi i1 [true, %extend], [false, %predict]
  call void @settle(ptr %lane)
  {calls(plan.alone)}
  {test.text}
  %still = and {mask} %alive, {accepted}
  %lost = xor {mask} %alive, %still
  %any = call i1 @llvm.vector.reduce.or.v{width}i1({mask} %lost)
  %missed = and i1 %any, %extended
  %before = sub i64 %k, 1
  br i1 %missed, label %return, label %keep
keep:
  {keep.text}
  %next = add i64 %k, 1
  %ready = icmp uge i64 %next, {NODES}
  br i1 %ready, label %carry, label %onward
onward:
  {calls(plan.remaining)}
  {move.loop("onward")}
  br label %carry
carry:
  {carry.text}
  %more = icmp slt i64 %next, %wanted
  br i1 %more, label %sample, label %end_group
end_group:
  %next_group = add i64 %g, 1
  %more_groups = icmp slt i64 %next_group, %groups
  br i1 %more_groups, label %group, label %end
end:
  fence seq_cst
  ret void
}}
"""


def _given(plan: Plan, width: int, prefix: str, sample: str) -> str:
    """Take what is given at a sample."""
    lines = Lines(width, prefix)
    for row, slot in enumerate(plan.sampled):
        place = lines.number("%samples", lines.sum(lines.product("%stride", row), sample))
        lines.write(slot, lines.spread(lines.let(f"load double, ptr {place}, align 8")))
    return lines.text
