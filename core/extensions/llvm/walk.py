"""The walk over the parts of a mechanism as LLVM code: lanes are samples."""

from __future__ import annotations

from .loops import ALONE
from .plan import all_lanes, each_row, each_slot, fields_of, function, over

PART = (
    "ptr plan",
    "ptr memory",
    "i64 count",
    "ptr members",
    "ptr own_all",
    "ptr samples",
    "i64 stride",
    "ptr sources_all",
    "ptr world",
    "i64 room",
    "i64 base",
    "ptr worst",
)
"""Fields of parts with a common plan, see `Parts`, eight bytes each."""
WALK = (
    "ptr parts",
    "i64 count",
    "i64 many",
    "ptr world",
    "ptr worst",
    "i64 room",
    "ptr best",
    "ptr wanted",
    "i64 wanted_count",
    "ptr tests",
    "i64 tests_count",
    "ptr out",
    "i64 columns",
    "ptr closures",
    "ptr sigmas",
    "ptr margins",
    "double least",
    "double bound",
)
"""Fields of a walk: tables of parts; rows of the world that are wanted, and of the tests, and the
values of both; the tests that decide; the least residual that counts, and its bound by the square
of sigma.
"""


def parts(width: int) -> str:
    """Return the LLVM functions of `parts` of an executor, and `walk`: follow samples, many at a
    time, on from the last accepted one, up to the first that is rejected or uncertain.
    """
    vector = f"<{width} x double>"
    source = f"""%row_at = getelementptr i64, ptr %rows, i64 %row
  %world_row = load i64, ptr %row_at, align 8
  %world_at = mul i64 %room, %world_row
  %value_at = getelementptr double, ptr %world, i64 %world_at
  %value = load {vector}, ptr %value_at, align 8
  store {vector} %value, ptr %slot, align 8"""
    leave = """%place_at = mul i64 %row, 2
  %place = getelementptr i64, ptr %table, i64 %place_at
  %source = load i64, ptr %place, align 8
  %target_at = getelementptr i64, ptr %place, i64 1
  %target = load i64, ptr %target_at, align 8
  %from_at = mul i64 %stride, %source
  %from_here = getelementptr double, ptr %from, i64 %from_at
  %value = load double, ptr %from_here, align 8
  %to = getelementptr double, ptr %own, i64 %target
  store double %value, ptr %to, align 8"""
    body = f"""{fields_of("fields", ["", *PART[1:]])}
  %bytes = mul i64 %plan_stride, {8 * width}
  %at_before = sub i64 %at, 1
  %sample_before = getelementptr double, ptr %samples, i64 %at_before
  %samples_here = getelementptr double, ptr %samples, i64 %at
  %follows = icmp sge i64 %from_lane, 0
  %attempts = icmp sgt i64 %groups, 0
  br label %part
part:
  %k = phi i64 [0, %entry], [%next_part, %end_part]
  %place = getelementptr i64, ptr %members, i64 %k
  %member = load i64, ptr %place, align 8
  %own_at = mul i64 %member, %plan_fixed_count
  %own = getelementptr double, ptr %own_all, i64 %own_at
  %sources_at = mul i64 %k, %plan_taken_count
  %sources = getelementptr i64, ptr %sources_all, i64 %sources_at
  %rows_before = mul i64 %member, %plan_kept_count
  %first_row = add i64 %base, %rows_before
  %first_at = mul i64 %first_row, %room
  br i1 %follows, label %go_on, label %stand
go_on:
  %solved_at = add i64 %first_at, %from_lane
  %solved = getelementptr double, ptr %world, i64 %solved_at
  call void @leave(ptr null, ptr %plan_left, i64 %plan_left_count, ptr %solved, i64 %room, ptr %own)
  call void @leave(ptr null, ptr %plan_given, i64 %plan_given_count, ptr %sample_before,
    i64 %stride, ptr %own)
  br label %stand
stand:
  br i1 %attempts, label %group, label %end_part
group:
  %g = phi i64 [0, %stand], [%next, %group]
  %offset = mul i64 %g, %bytes
  %lane = getelementptr i8, ptr %memory, i64 %offset
  %first = mul i64 %g, {width}
  %given = getelementptr double, ptr %samples_here, i64 %first
  %from = getelementptr double, ptr %world, i64 %first
  %to = getelementptr double, ptr %from, i64 %first_at
  %worst_here = getelementptr double, ptr %worst, i64 %first
  {over("give", "fixed", "ptr %own", "i64 1")}
  {over("take", "sampled", "ptr %given", "i64 %stride")}
  {over("source", "taken", "ptr %sources", "ptr %from", "i64 %room")}
  {ALONE}
  {over("keep", "kept", "ptr %to", "i64 %room")}
  {over("worsen", "worst", "ptr %worst_here", "i64 %room")}
  %next = add i64 %g, 1
  %more = icmp slt i64 %next, %groups
  br i1 %more, label %group, label %end_part
end_part:
  %next_part = add i64 %k, 1
  %more_parts = icmp slt i64 %next_part, %count
  br i1 %more_parts, label %part, label %end
end:
  ret void"""
    head = "void @parts(ptr %plan, ptr %fields, i64 %at, i64 %from_lane, i64 %groups)"
    rows = [
        each_slot("source", ", ptr %rows, ptr %world, i64 %room", source),
        each_row("leave", ", ptr %from, i64 %stride, ptr %own", leave),
    ]
    return "".join([*rows, function(head, body), _walk(width)])


def _walk(width: int) -> str:
    vector = f"<{width} x double>"
    part = f"""%place_at = mul i64 %row, {len(PART)}
  %part = getelementptr ptr, ptr %table, i64 %place_at
  %plan = load ptr, ptr %part, align 8
  call void @parts(ptr %plan, ptr %part, i64 %at, i64 %from_lane, i64 %groups)"""
    begin = f"""%best_at = getelementptr double, ptr %best, i64 %row
  %best_one = load double, ptr %best_at, align 8
  {all_lanes(width, "best_one")}
  %place_at = mul i64 %row, %room
  %place = getelementptr double, ptr %here, i64 %place_at
  store {vector} %best_one_all, ptr %place, align 8"""
    copy = f"""%place = getelementptr i64, ptr %table, i64 %row
  %from_row = load i64, ptr %place, align 8
  %from_at = mul i64 %room, %from_row
  %from_here = getelementptr double, ptr %from, i64 %from_at
  %value = load {vector}, ptr %from_here, align 8
  %to_at = mul i64 %columns, %row
  %to_here = getelementptr double, ptr %to, i64 %to_at
  store {vector} %value, ptr %to_here, align 8"""
    copied = ", ptr %from, i64 %room, ptr %to, i64 %columns"
    read = [
        f"%{name}_at = getelementptr double, ptr %{name}s, i64 %lane\n"
        f"  %{name} = load double, ptr %{name}_at, align 8"
        for name in ("margin", "closure", "sigma")
    ]
    lines = "\n  ".join(read)
    body = f"""{fields_of("walk", WALK)}
  br label %head
head:
  %at = phi i64 [0, %entry], [%next, %kept]
  %from_lane = phi i64 [-1, %entry], [%last, %kept]
  %left = sub i64 %stop, %at
  %here = call i64 @llvm.smin.i64(i64 %left, i64 %many)
  %more = icmp sgt i64 %here, 0
  %padded = add i64 %here, {width - 1}
  %groups = sdiv i64 %padded, {width}
  br i1 %more, label %begin, label %attempt
begin:
  %g = phi i64 [0, %head], [%g_next, %begin]
  %begin_at = mul i64 %g, {width}
  %worst_here = getelementptr double, ptr %worst, i64 %begin_at
  call void @begin(ptr null, ptr null, i64 %tests_count, ptr %best, ptr %worst_here, i64 %room)
  %g_next = add i64 %g, 1
  %g_more = icmp slt i64 %g_next, %groups
  br i1 %g_more, label %begin, label %attempt
attempt:
  call void @each_part(ptr null, ptr %parts, i64 %count, i64 %at, i64 %from_lane, i64 %groups)
  br label %test
test:
  %lane = phi i64 [0, %attempt], [%next_lane, %pass]
  %inside = icmp slt i64 %lane, %here
  br i1 %inside, label %look, label %tested
look:
  {lines}
  %accepted = fcmp ogt double %margin, 0.0
  %squared = fmul double %sigma, %sigma
  %limit = fmul double %bound, %squared
  %counted = call double @llvm.maximum.f64(double %closure, double %least)
  %certain = fcmp ole double %counted, %limit
  %both = and i1 %accepted, %certain
  %next_lane = add i64 %lane, 1
  br i1 %both, label %pass, label %tested
pass:
  br label %test
tested:
  %next = add i64 %at, %lane
  %last = sub i64 %lane, 1
  %some = icmp sgt i64 %lane, 0
  br i1 %some, label %keep, label %end
keep:
  %n = phi i64 [0, %tested], [%n_next, %keep]
  %keep_at = mul i64 %n, {width}
  %to_at = add i64 %at, %keep_at
  %world_here = getelementptr double, ptr %world, i64 %keep_at
  %tests_here = getelementptr double, ptr %worst, i64 %keep_at
  %to = getelementptr double, ptr %out, i64 %to_at
  %wanted_room = mul i64 %wanted_count, %columns
  %to_tests = getelementptr double, ptr %to, i64 %wanted_room
  call void @pick(ptr null, ptr %wanted, i64 %wanted_count, ptr %world_here, i64 %room, ptr %to,
    i64 %columns)
  call void @pick(ptr null, ptr %tests, i64 %tests_count, ptr %tests_here, i64 %room,
    ptr %to_tests, i64 %columns)
  %n_next = add i64 %n, 1
  %n_more = icmp slt i64 %n_next, %groups
  br i1 %n_more, label %keep, label %kept
kept:
  br label %head
end:
  ret i64 %at"""
    return f"""declare i64 @llvm.smin.i64(i64, i64)
declare double @llvm.maximum.f64(double, double)
{each_row("each_part", ", i64 %at, i64 %from_lane, i64 %groups", part)}{
        each_row("begin", ", ptr %best, ptr %here, i64 %room", begin)
    }{each_row("pick", copied, copy)}{
        function("i64 @walk(ptr %plan, ptr %walk, i64 %stop)", body)
    }"""
