"""Loops of plans as LLVM code: Newton's iteration, and parts of a mechanism; for motions, see
`follow` and `fan`.

They are the same for all plans and read the plan from memory: see `plan`.
"""

from __future__ import annotations

import math

from .ir_writer import Lines
from .plan import Rows, call, function, over


def settle(width: int) -> str:
    """Return the attempt at W predicted lanes without its test: iterate until each converged or is
    not finite.
    """
    vector, mask, lines = f"<{width} x double>", f"<{width} x i1>", Lines(width)
    at = {name: lines.slot(f"%plan_{name}") for name in ("residual", "iterations", "done")}
    tolerance = lines.spread("%plan_tolerance")
    body = f"""{lines.text}
  br label %iterate
iterate:
  %pass = phi i64 [1, %entry], [%next_pass, %iterate]
  %done = phi {mask} [zeroinitializer, %entry], [%now_done, %iterate]
  %count = phi {vector} [zeroinitializer, %entry], [%now_count, %iterate]
  {call("newton", "%plan_newton")}
  %residual = load {vector}, ptr {at["residual"]}, align 8
  %more_count = fadd {vector} %count, {lines.constant(1.0)}
  %now_count = select {mask} %done, {vector} %count, {vector} %more_count
  %met = fcmp olt {vector} %residual, {tolerance}
  %now_done = or {mask} %done, %met
  %finite = fcmp olt {vector} %residual, {lines.constant(math.inf)}
  %lost = xor {mask} %finite, <{", ".join(["i1 true"] * width)}>
  %settled = or {mask} %now_done, %lost
  %all = call i1 @llvm.vector.reduce.and.v{width}i1({mask} %settled)
  %next_pass = add i64 %pass, 1
  %spent = icmp sgt i64 %next_pass, %plan_most
  %stop = or i1 %all, %spent
  br i1 %stop, label %finish, label %iterate
finish:
  {over("calls", "after")}
  store {vector} %now_count, ptr {at["iterations"]}, align 8
  %done_number = select {mask} %now_done, {vector} {lines.constant(1.0)}, {vector} zeroinitializer
  store {vector} %done_number, ptr {at["done"]}, align 8
  ret void"""
    reduction = f"declare i1 @llvm.vector.reduce.and.v{width}i1({mask})\n"
    return reduction + function("internal void @settle(ptr %plan, ptr %lane)", body)


def run(width: int) -> str:
    """Return functions that attempt, run a program (given the address of its call) or carry, for
    every group of W lanes.
    """
    head = "void @{}(ptr %plan, ptr %memory, i64 %groups{})"
    attempt = function(head.format("attempt", ""), _over_groups(_ALONE, width))
    carry = function(head.format("carry", ""), _over_groups(over("copy", "carried"), width))
    once = function(
        head.format("run_program", ", ptr %program"), _over_groups(call("once", "%program"), width)
    )
    return attempt + carry + once


_ALONE = f"""{call("first", "%plan_predict")}
  call void @settle(ptr %plan, ptr %lane)
  {over("calls", "alone")}"""


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


def parts(width: int) -> str:
    """Return the LLVM functions of `Executor.parts`."""
    source = Rows(width)
    row = source.let(f"load i64, ptr {source.number('%rows', '%row')}, align 8")
    place = source.number("%world", source.product("%room", row))
    source.write(source.entry(), source.let(f"load <{width} x double>, ptr {place}, align 8"))
    leave = Rows(width)
    last = leave.let(
        f"load double, ptr {leave.number(leave.slot(leave.entry(0, 2)), width - 1)}, align 8"
    )
    leave.lines.append(
        f"store double {last}, ptr {leave.number('%ahead', leave.entry(1, 2))}, align 8"
    )
    tables = (
        "ptr %members, ptr %own_all, ptr %ahead_all, ptr %samples, i64 %room, ptr %sources_all, ptr"
        " %world"
    )
    body = f"""%bytes = mul i64 %plan_stride, {8 * width}
  br label %part
part:
  %k = phi i64 [0, %entry], [%next_part, %end_part]
  %place = getelementptr i64, ptr %members, i64 %k
  %member = load i64, ptr %place, align 8
  %own_at = mul i64 %member, %plan_fixed_count
  %own = getelementptr double, ptr %own_all, i64 %own_at
  %ahead = getelementptr double, ptr %ahead_all, i64 %own_at
  %sources_at = mul i64 %k, %plan_taken_count
  %sources = getelementptr i64, ptr %sources_all, i64 %sources_at
  %rows_before = mul i64 %member, %plan_kept_count
  %first_row = add i64 %base, %rows_before
  %first_at = mul i64 %first_row, %room
  br label %group
group:
  %g = phi i64 [0, %part], [%next, %group]
  %offset = mul i64 %g, %bytes
  %lane = getelementptr i8, ptr %memory, i64 %offset
  %first = mul i64 %g, {width}
  %given = getelementptr double, ptr %samples, i64 %first
  %from = getelementptr double, ptr %world, i64 %first
  %to = getelementptr double, ptr %from, i64 %first_at
  %worst_here = getelementptr double, ptr %worst, i64 %first
  {over("give", "fixed", "ptr %own", "i64 1")}
  {over("take", "sampled", "ptr %given", "i64 %room")}
  {over("source", "taken", "ptr %sources", "ptr %from", "i64 %room")}
  {_ALONE}
  {over("keep", "kept", "ptr %to", "i64 %room")}
  {over("worsen", "worst", "ptr %worst_here", "i64 %room")}
  %next = add i64 %g, 1
  %more = icmp slt i64 %next, %groups
  br i1 %more, label %group, label %end_part
end_part:
  {over("leave", "left", "ptr %ahead")}
  %next_part = add i64 %k, 1
  %more_parts = icmp slt i64 %next_part, %count
  br i1 %more_parts, label %part, label %end
end:
  ret void"""
    head = (
        f"void @parts(ptr %plan, ptr %memory, i64 %count, {tables}, i64 %base, ptr %worst, i64"
        " %groups)"
    )
    rows = [
        source.function("source", "ptr %rows", "ptr %world", "i64 %room"),
        leave.function("leave", "ptr %ahead"),
    ]
    return "".join([*rows, function(head, body)])
