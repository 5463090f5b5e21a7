"""Loop along many motions through the same samples as LLVM code; lanes are motions."""

from __future__ import annotations

import math

from ..plan import LINE
from ..tape import NODES
from .ir_writer import Lines
from .plan import TOGETHER, Rows, call, function, over


def fan(width: int) -> str:
    """Return the LLVM functions of `Executor.fan`: a group of W motions passes all samples while
    its slots are in the L1 cache.

    After `NODES` samples a group is predicted by `extend`. If this fails for a live motion, the
    group goes back and is predicted by its rates.
    """
    vector, mask, test = f"<{width} x double>", f"<{width} x i1>", Lines(width, "test")
    accepted = test.let(f"fcmp ogt {vector} {test.read('%plan_margin')}, zeroinitializer")
    given = over("give", "sampled", "ptr %samples_here", "i64 %stride")
    body = f"""%bytes = mul i64 %plan_stride, {8 * width}
  %plane = mul i64 %columns, %lanes
  %ahead = mul i64 %step, %lanes
  br label %group
group:
  %g = phi i64 [0, %entry], [%next_group, %end_group]
  %offset = mul i64 %g, %bytes
  %lane = getelementptr i8, ptr %memory, i64 %offset
  %group_at = mul i64 %g, {width}
  %worst_here = getelementptr double, ptr %worst, i64 %group_at
  br label %sample
sample:
  %k = phi i64 [0, %group], [%next, %carry]
  %alive = phi {mask} [<{", ".join(["i1 true"] * width)}>, %group], [%still, %carry]
  %samples_here = getelementptr double, ptr %samples, i64 %k
  {given}
  %smooth = icmp uge i64 %k, {NODES}
  br i1 %smooth, label %extend, label %predict
extend:
  {call("on", "%plan_extend")}
  br label %attempt
return:
  %before_here = getelementptr double, ptr %samples_here, i64 -1
  {over("copy", "returned")}
  {over("give", "sampled", "ptr %before_here", "i64 %stride")}
  {over("calls", "onward")}
  {over("copy", "carried")}
  {given}
  br label %predict
predict:
  {call("ahead", "%plan_predict")}
  br label %attempt
attempt:
  %extended = phi i1 [true, %extend], [false, %predict]
  call void @settle(ptr %plan, ptr %lane)
  {over("calls", "alone")}
  {test.text}
  %still = and {mask} %alive, {accepted}
  %lost = xor {mask} %alive, %still
  %any = call i1 @llvm.vector.reduce.or.v{width}i1({mask} %lost)
  %missed = and i1 %any, %extended
  br i1 %missed, label %return, label %keep
keep:
  %steps = mul i64 %step, %k
  %column = add i64 %first, %steps
  %column_at = mul i64 %column, %lanes
  %in_plane = add i64 %column_at, %group_at
  %out_here = getelementptr double, ptr %out, i64 %in_plane
  {over("worsen", "worst", "ptr %worst_here", "i64 %lanes")}
  {over("keep_alive", "kept", "ptr %out_here", "i64 %plane", f"{mask} %still", "i64 %ahead")}
  %next = add i64 %k, 1
  %enough = icmp uge i64 %next, {NODES}
  br i1 %enough, label %continue, label %onward
continue:
  {over("copy", "continued")}
  br label %carry
onward:
  {over("calls", "remaining")}
  {over("copy", "carried")}
  br label %carry
carry:
  %turn = urem i64 %k, {NODES}
  %turned = mul i64 %turn, %plan_state
  %past_slot = add i64 %plan_past, %turned
  %past = mul i64 %past_slot, {8 * width}
  {over("remember", "remembered", "i64 %past")}
  %more = icmp slt i64 %next, %wanted
  br i1 %more, label %sample, label %end_group
end_group:
  {over("lose", "worst", "ptr %worst_here", "i64 %lanes", f"{mask} %still")}
  %next_group = add i64 %g, 1
  %more_groups = icmp slt i64 %next_group, %groups
  br i1 %more_groups, label %group, label %end
end:
  fence seq_cst
  ret void"""
    inputs = "ptr %memory, i64 %groups, ptr %samples, i64 %stride, i64 %wanted"
    head = (
        f"void @fan(ptr %plan, {inputs}, ptr %out, i64 %columns, i64 %lanes, i64 %first, i64 %step,"
        " ptr %worst)"
    )
    declared = (
        "declare void @llvm.prefetch.p0(ptr, i32, i32, i32)\ndeclare i1"
        f" @llvm.vector.reduce.or.v{width}i1({mask})\n"
    )
    return f"{declared}{_kept(width)}{function(head, body)}"


def _kept(width: int) -> str:
    """Return functions that store a sample (NaN for an ended motion), remember it, and mark ended
    motions in the worst.
    """
    keep, lose, remember = Rows(width), Rows(width), Rows(width, TOGETHER)
    # whole cache lines bypass the caches: a fetch before each overwrite takes a third of all time
    whole = width == LINE
    past_caches = ", !nontemporal !{i32 1}" if whole else ""
    place = keep.number("%numbers", keep.product("%stride", "%row"))
    value = keep.choose("%still", keep.read(keep.entry()), keep.constant(math.nan))
    keep.lines.append(f"store {keep.vector} {value}, ptr {place}, align {8 * width}{past_caches}")
    # partial lines are prefetched a sample ahead; collecting them into whole lines takes as long
    # as waiting
    if not whole:
        keep.lines.append(
            f"call void @llvm.prefetch.p0(ptr {keep.number(place, '%ahead')}, i32 1, i32 3, i32 1)"
        )
    worst = lose.number("%numbers", lose.product("%stride", "%row"))
    known = lose.choose(
        "%still", lose.let(f"load {lose.vector}, ptr {worst}, align 8"), lose.constant(math.nan)
    )
    lose.lines.append(f"store {lose.vector} {known}, ptr {worst}, align 8")
    for k in range(TOGETHER):
        remember.at = remember.sum("%row", k)
        to = remember.sum("%past", remember.entry(1, 2))
        remember.write(
            to,
            remember.assign(
                f"load {remember.vector}, ptr {remember.slot(remember.entry(0, 2))}, align 8"
            ),
        )
    kept = keep.function(
        "keep_alive", "ptr %numbers", "i64 %stride", f"<{width} x i1> %still", "i64 %ahead"
    )
    lost = lose.function("lose", "ptr %numbers", "i64 %stride", f"<{width} x i1> %still")
    return kept + lost + remember.function("remember", "i64 %past")
