"""Loops of plans as LLVM code: Newton's iteration, one motion (lanes are samples), many motions
(lanes are motions), and totals of many lanes.

They are the same for all plans and read the plan from memory: see `plan`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...program.tape import NODES
from .plan import (
    LINE,
    SIGN,
    all_lanes,
    call,
    each_number,
    each_pair,
    each_slot,
    fields_of,
    function,
    over,
)
from .programs import Lines


def settle(width: int) -> str:
    """Return the attempt at W predicted lanes without its test: iterate until each converged or is
    not finite.
    """
    vector, mask, constant = f"<{width} x double>", f"<{width} x i1>", Lines(width).constant
    body = f"""%residual_at = getelementptr {vector}, ptr %lane, i64 %plan_residual
  %iterations_at = getelementptr {vector}, ptr %lane, i64 %plan_iterations
  %done_at = getelementptr {vector}, ptr %lane, i64 %plan_done
  {all_lanes(width, "plan_tolerance")}
  br label %iterate
iterate:
  %pass = phi i64 [1, %entry], [%next_pass, %iterate]
  %done = phi {mask} [zeroinitializer, %entry], [%now_done, %iterate]
  %count = phi {vector} [zeroinitializer, %entry], [%now_count, %iterate]
  {call("newton", "%plan_newton")}
  %residual = load {vector}, ptr %residual_at, align 8
  %more_count = fadd {vector} %count, {constant(1.0)}
  %now_count = select {mask} %done, {vector} %count, {vector} %more_count
  %met = fcmp olt {vector} %residual, %plan_tolerance_all
  %now_done = or {mask} %done, %met
  %finite = fcmp olt {vector} %residual, {constant(math.inf)}
  %lost = xor {mask} %finite, <{", ".join(["i1 true"] * width)}>
  %settled = or {mask} %now_done, %lost
  %all = call i1 @llvm.vector.reduce.and.v{width}i1({mask} %settled)
  %next_pass = add i64 %pass, 1
  %spent = icmp sgt i64 %next_pass, %plan_most
  %stop = or i1 %all, %spent
  br i1 %stop, label %finish, label %iterate
finish:
  {over("calls", "after")}
  store {vector} %now_count, ptr %iterations_at, align 8
  %done_number = select {mask} %now_done, {vector} {constant(1.0)}, {vector} zeroinitializer
  store {vector} %done_number, ptr %done_at, align 8
  ret void"""
    reduction = f"declare i1 @llvm.vector.reduce.and.v{width}i1({mask})\n"
    return reduction + function("internal void @settle(ptr %plan, ptr %lane)", body)


def run(width: int) -> str:
    """Return functions that attempt, run a program (given the address of its call) or carry, for
    every group of W lanes.
    """
    head = "void @{}(ptr %plan, ptr %memory, i64 %groups{})"
    attempt = function(head.format("attempt", ""), _over_groups(ALONE, width))
    carry = function(head.format("carry", ""), _over_groups(over("copy", "carried"), width))
    once = function(
        head.format("run_program", ", ptr %program"), _over_groups(call("once", "%program"), width)
    )
    return attempt + carry + once


ALONE = f"""{call("first", "%plan_predict")}
  call void @settle(ptr %plan, ptr %lane)
  {over("calls", "alone")}"""
"""Lines that attempt a group of lanes: predict, settle, and what the plan does after it."""


def _over_groups(body: str, width: int) -> str:
    return f"""%bytes = mul i64 %plan_stride, {8 * width}
  br label %group
group:
  %g = phi i64 [0, %entry], [%next, %group]
  %offset = mul i64 %g, %bytes
  %lane = getelementptr i8, ptr %memory, i64 %offset
  {body}
  %next = add i64 %g, 1
  %more = icmp slt i64 %next, %groups
  br i1 %more, label %group, label %end
end:
  ret void"""


MOTION = ("ptr lane", "ptr start", "ptr worst", "ptr out", "i64 row", "i64 forget", "i64 sides")
SIDE = (
    "ptr samples",
    "i64 stride",
    "i64 first",
    "i64 step",
    "i64 count",
    "ptr anchor",
    "i64 reached",
)
"""Fields of a motion and of each side, eight bytes each: few arguments make a call fast. If
`forget` is set, a call restarts `worst` and clears the field, so later calls continue. `run` writes
the number of samples it reached.
"""


def follow(width: int) -> str:
    """Return the LLVM functions of `follow` of a track: W samples at a time, on from the last
    accepted one. An anchor remains at the end only if the motion stays there.

    Extrapolated groups begin at a multiple of W: the group after a fully accepted one ends there.
    With few lanes, several such groups must precede.
    """
    vector = f"<{width} x double>"
    body = f"""{fields_of("motion", MOTION)}
  {fields_of("side", SIDE)}
  %descending = icmp slt i64 %step, 0
  %extrapolates = icmp ne i64 %plan_behind, 0
  %quick = icmp ne i64 %plan_quick, 0
  %forget_at = getelementptr i64, ptr %motion, i64 {_index(MOTION, "forget")}
  store i64 0, ptr %forget_at, align 8
  %worst_here = alloca {vector}, i64 %plan_worst_count, align 64
  {over("begin_worst", "worst", "ptr %worst_here", "ptr %worst", "i64 %forget")}
  {over("give", "targets", "ptr %place", "i64 1")}
  br label %head
head:
  %at = phi i64 [%from, %entry], [%next, %pass], [%next, %take]
  %smooth = phi i1 [false, %entry], [%extrapolates, %pass], [false, %take]
  %whole_before = phi i1 [false, %entry], [false, %pass], [%onto, %take]
  %behind = phi i64 [0, %entry], [%behind_now, %pass], [%behind_now, %take]
  %more = icmp slt i64 %at, %stop
  br i1 %more, label %attempt, label %end
attempt:
  %samples_here = getelementptr double, ptr %samples, i64 %at
  {over("take", "sampled", "ptr %samples_here", "i64 %stride")}
  %first_call = select i1 %smooth, ptr %plan_extrapolate, ptr %plan_predict
  {call("first", "%first_call")}
  call void @settle(ptr %plan, ptr %lane)
  {over("calls", "joined")}
  {_test(width)}
  %bits = bitcast <{width} x i1> %passed to i{width}
  %wide = zext i{width} %bits to i64
  %rejected = xor i64 %wide, {2 ** (width + 1) - 1}
  %leading = call i64 @llvm.cttz.i64(i64 %rejected, i1 true)
  %offset = and i64 %at, {width - 1}
  %short = sub i64 {width}, %offset
  %room = select i1 %whole_before, i64 %short, i64 {width}
  %wanted = sub i64 %stop, %at
  %left = call i64 @llvm.smin.i64(i64 %room, i64 %wanted)
  %accepted = call i64 @llvm.smin.i64(i64 %leading, i64 %left)
  %next = add i64 %at, %accepted
  %every = icmp eq i64 %accepted, {width}
  %full = and i1 %every, %quick
  %further = icmp slt i64 %next, %stop
  %onto = and i1 %full, %extrapolates
  %aligned = icmp eq i64 %offset, 0
  %counts = and i1 %every, %aligned
  %one_more = add i64 %behind, 1
  %behind_now = select i1 %counts, i64 %one_more, i64 0
  %enough = icmp uge i64 %behind_now, %plan_behind
  %going = and i1 %full, %further
  %whole = and i1 %going, %enough
  %none = icmp eq i64 %accepted, 0
  br i1 %none, label %missed, label %keep
missed:
  br i1 %smooth, label %return, label %end
return:
  %before_here = getelementptr double, ptr %samples_here, i64 -1
  {over("copy", "returned")}
  {over("give", "sampled", "ptr %before_here", "i64 %stride")}
  {over("calls", "onward")}
  br label %take
keep:
  {over("update_worst", "worst", "ptr %worst_here", "i64 %accepted")}
  %up_column = add i64 %first, %at
  %down_first = sub i64 %first, %at
  %down_column = sub i64 %down_first, {width - 1}
  %column = select i1 %descending, i64 %down_column, i64 %up_column
  %out_here = getelementptr double, ptr %out, i64 %column
  br i1 %descending, label %backward, label %forward
forward:
  {over("keep", "kept", "ptr %out_here", "i64 %row")}
  br label %kept
backward:
  {over("keep_turned", "kept", "ptr %out_here", "i64 %row")}
  br label %kept
kept:
  br i1 %whole, label %pass, label %other
other:
  %there = xor i1 %further, true
  %leaves = xor i1 %stays, true
  %over = and i1 %there, %leaves
  br i1 %over, label %leave, label %onward
leave:
  {over("end_worst", "worst", "ptr %worst_here", "ptr %worst")}
  ret i64 %next
pass:
  {over("spread", "moves", f"i64 {width - 1}")}
  br label %head
onward:
  {over("copy", "shifted")}
  {over("calls", "remaining")}
  br label %take
take:
  %before = sub i64 %accepted, 1
  %last = call i64 @llvm.smax.i64(i64 %before, i64 0)
  {over("spread", "carried", "i64 %last")}
  br label %head
end:
  {over("put", "targets", "ptr %anchor", "i64 1")}
  {over("end_worst", "worst", "ptr %worst_here", "ptr %worst")}
  ret i64 %at"""
    order = ", ".join(f"i32 {k}" for k in reversed(range(width)))
    turned = f"""%value = load {vector}, ptr %slot, align 8
  %turned = shufflevector {vector} %value, {vector} poison, <{width} x i32> <{order}>
  store {vector} %turned, ptr %number, align 8"""
    places = "ptr %plan, ptr %motion, ptr %side, ptr %place, i64 %from, i64 %stop"
    stay = f"""  %at = call i64 @go({places}, i1 true)
  ret i64 %at"""
    return f"""declare i64 @llvm.cttz.i64(i64, i1)
declare i64 @llvm.smin.i64(i64, i64)
declare i64 @llvm.smax.i64(i64, i64)
{each_number("keep_turned", turned)}{_worst(width)}{_run()}""" + "".join(
        [
            function(f"internal i64 @go({places}, i1 %stays)", body),
            function(f"i64 @follow({places})", stay),
        ]
    )


def _test(width: int) -> str:
    """Return lines to find the accepted lanes, `%passed`."""
    vector = f"<{width} x double>"
    return f"""%margin_at = getelementptr {vector}, ptr %lane, i64 %plan_margin
  %margin = load {vector}, ptr %margin_at, align 8
  %passed = fcmp ogt {vector} %margin, zeroinitializer"""


def _run() -> str:
    """Return the function that follows every side and counts the sides that end early."""
    return f"""define i64 @run(ptr %plan, ptr %motion, ptr %table) {{
entry:
  {fields_of("motion", MOTION)}
  br label %head
head:
  %k = phi i64 [0, %entry], [%next, %one]
  %early = phi i64 [0, %entry], [%early_now, %one]
  %more = icmp ult i64 %k, %sides
  br i1 %more, label %one, label %end
one:
  %offset = mul i64 %k, {len(SIDE)}
  %side = getelementptr i64, ptr %table, i64 %offset
  {fields_of("side", SIDE)}
  %at = call i64 @go(ptr %plan, ptr %motion, ptr %side, ptr %start, i64 0, i64 %count, i1 false)
  %reached_at = getelementptr i64, ptr %side, i64 {_index(SIDE, "reached")}
  store i64 %at, ptr %reached_at, align 8
  %ended = icmp ne i64 %at, %count
  %counted = zext i1 %ended to i64
  %early_now = add i64 %early, %counted
  %next = add i64 %k, 1
  br label %head
end:
  ret i64 %early
}}
"""


def _index(fields: Sequence[str], name: str) -> int:
    return [each.split()[1] for each in fields].index(name)


def _worst(width: int) -> str:
    """Return functions for the largest of slots, times a sign, over accepted lanes; vectors until
    the end.

    They begin, update by a group, and write the largest to its place.
    """
    vector, words = f"<{width} x double>", f"<{width} x i64>"
    here = f"""%here_at = getelementptr {vector}, ptr %here, i64 %row
  {SIGN}"""
    begin = f"""{here}
  %start_at = getelementptr double, ptr %place, i64 2
  %start = load double, ptr %start_at, align 8
  %found_at = getelementptr double, ptr %found, i64 %row
  %so_far = load double, ptr %found_at, align 8
  %signed = fmul double %so_far, %sign
  %new = icmp ne i64 %forget, 0
  %first = select i1 %new, double %start, double %signed
  {all_lanes(width, "first")}
  store {vector} %first_all, ptr %here_at, align 64"""
    numbers = ", ".join(f"i64 {k}" for k in range(width))
    update = f"""{here}
  {all_lanes(width, "sign")}
  %one = insertelement {words} poison, i64 %accepted, i64 0
  %wanted = shufflevector {words} %one, {words} poison, <{width} x i32> zeroinitializer
  %kept = icmp ult {words} <{numbers}>, %wanted
  %before = load {vector}, ptr %here_at, align 64
  %value = load {vector}, ptr %slot, align 8
  %signed = fmul {vector} %value, %sign_all
  %counted = select <{width} x i1> %kept, {vector} %signed, {vector} %before
  %worse = fcmp ogt {vector} %counted, %before
  %worst = select <{width} x i1> %worse, {vector} %counted, {vector} %before
  store {vector} %worst, ptr %here_at, align 64"""
    end = f"""{here}
  %values = load {vector}, ptr %here_at, align 64
  %largest = call nnan double @llvm.vector.reduce.fmax.v{width}f64({vector} %values)
  %signed = fmul double %largest, %sign
  %found_at = getelementptr double, ptr %found, i64 %row
  store double %signed, ptr %found_at, align 8"""
    return f"""declare double @llvm.vector.reduce.fmax.v{width}f64({vector})
{each_slot("begin_worst", ", ptr %here, ptr %found, i64 %forget", begin, 3)}{
        each_slot("update_worst", ", ptr %here, i64 %accepted", update, 3)
    }{each_slot("end_worst", ", ptr %here, ptr %found", end, 3)}"""


def run_motions(width: int) -> str:
    """Return the LLVM functions `fan`, of `run_motions` of an executor: a group of W motions passes
    all samples while its slots are in the L1 cache.

    After `NODES` samples a group is predicted by `extend`. If this fails for a live motion, the
    group goes back and is predicted by its rates.
    """
    mask = f"<{width} x i1>"
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
  {_test(width)}
  %still = and {mask} %alive, %passed
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
    return f"{declared}{_keep(width)}{function(head, body)}"


def _keep(width: int) -> str:
    """Return functions that store a sample (NaN for an ended motion), remember it, and mark ended
    motions in the worst.
    """
    vector, still = f"<{width} x double>", f"<{width} x i1> %still"
    lost = Lines(width).constant(math.nan)
    # whole cache lines bypass the caches: a fetch before each overwrite takes a third of all time
    whole = width == LINE
    past_caches = ", !nontemporal !{i32 1}" if whole else ""
    # partial lines are prefetched a sample ahead; collecting them into whole lines takes as long
    # as waiting
    prefetch = (
        ""
        if whole
        else """
  %next_number = getelementptr double, ptr %number, i64 %ahead
  call void @llvm.prefetch.p0(ptr %next_number, i32 1, i32 3, i32 1)"""
    )
    keep = f"""%value = load {vector}, ptr %slot, align 8
  %kept = select {still}, {vector} %value, {vector} {lost}
  store {vector} %kept, ptr %number, align {8 * width}{past_caches}{prefetch}"""
    lose = f"""%known = load {vector}, ptr %number, align 8
  %kept = select {still}, {vector} %known, {vector} {lost}
  store {vector} %kept, ptr %number, align 8"""
    remember = f"""%past# = getelementptr i8, ptr %to#, i64 %past
  %value# = load {vector}, ptr %from#, align 8
  store {vector} %value#, ptr %past#, align 8"""
    return "".join(
        [
            each_number("keep_alive", keep, arguments=f", {still}, i64 %ahead"),
            each_number("lose", lose, 3, f", {still}"),
            each_pair("remember", ", i64 %past", remember),
        ]
    )
