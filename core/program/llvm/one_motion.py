"""Loop along one motion as LLVM code; lanes are samples."""

from __future__ import annotations

from collections.abc import Sequence

from .ir_writer import Lines
from .plan import Rows, call, function, over

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
    """Return the LLVM functions of `Track.follow`: W samples at a time, on from the last accepted
    one. An anchor remains at the end only if the motion stays there.

    Extrapolated groups begin at a multiple of W: the group after a fully accepted one ends there.
    With few lanes, several such groups must precede.
    """
    vector, test = f"<{width} x double>", Lines(width, "test")
    accepted = test.let(f"fcmp ogt {vector} {test.read('%plan_margin')}, zeroinitializer")
    body = f"""{_read_fields("motion", MOTION)}
  {_read_fields("side", SIDE)}
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
  {test.text}
  %bits = bitcast <{width} x i1> {accepted} to i{width}
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
    turned = Rows(width)
    place = turned.number("%numbers", turned.product("%stride", "%row"))
    turned.lines.append(
        f"store {vector} {turned.turned(turned.read(turned.entry()))}, ptr {place}, align 8"
    )
    places = "ptr %plan, ptr %motion, ptr %side, ptr %place, i64 %from, i64 %stop"
    stay = f"""  %at = call i64 @go({places}, i1 true)
  ret i64 %at"""
    return f"""declare i64 @llvm.cttz.i64(i64, i1)
declare i64 @llvm.smin.i64(i64, i64)
declare i64 @llvm.smax.i64(i64, i64)
{turned.function("keep_turned", "ptr %numbers", "i64 %stride")}{_worst(width)}{_run()}""" + "".join(
        [
            function(f"internal i64 @go({places}, i1 %stays)", body),
            function(f"i64 @follow({places})", stay),
        ]
    )


def _run() -> str:
    """Return the function that follows every side and counts the sides that end early."""
    return f"""define i64 @run(ptr %plan, ptr %motion, ptr %table) {{
entry:
  {_read_fields("motion", MOTION)}
  br label %head
head:
  %k = phi i64 [0, %entry], [%next, %one]
  %early = phi i64 [0, %entry], [%early_now, %one]
  %more = icmp ult i64 %k, %sides
  br i1 %more, label %one, label %end
one:
  %offset = mul i64 %k, {len(SIDE)}
  %side = getelementptr i64, ptr %table, i64 %offset
  {_read_fields("side", SIDE)}
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


def _read_fields(name: str, fields: Sequence[str]) -> str:
    """Return lines that read the fields of a struct, each under its own name."""
    lines = Lines(0, f"{name}_")
    for k, (kind, field) in enumerate(each.split() for each in fields):
        lines.lines.append(f"%{field} = load {kind}, ptr {lines.number(f'%{name}', k)}, align 8")
    return lines.text


def _index(fields: Sequence[str], name: str) -> int:
    return [each.split()[1] for each in fields].index(name)


def _worst(width: int) -> str:
    """Return functions for the largest of slots, times a sign, over accepted lanes; vectors until
    the end.

    They begin, update by a group, and write the largest to its place.
    """
    begin, update, end = (Rows(width) for _ in range(3))
    vector, words = begin.vector, f"<{width} x i64>"
    here, *_ = [
        rows.let(f"getelementptr {vector}, ptr %here, i64 %row") for rows in (begin, update, end)
    ]
    new, sign = begin.let("icmp ne i64 %forget, 0"), begin.entry(1, 3, "double")
    so_far = begin.let(f"load double, ptr {begin.number('%found', '%row')}, align 8")
    so_far = begin.let(f"fmul double {so_far}, {sign}")
    start = begin.spread(
        begin.let(f"select i1 {new}, double {begin.entry(2, 3, 'double')}, double {so_far}")
    )
    begin.lines.append(f"store {vector} {start}, ptr {here}, align 64")
    numbers = ", ".join(f"i64 {k}" for k in range(width))
    one = update.let(f"insertelement {words} poison, i64 %accepted, i64 0")
    wanted = update.let(
        f"shufflevector {words} {one}, {words} poison, <{width} x i32> zeroinitializer"
    )
    kept = update.let(f"icmp ult {words} <{numbers}>, {wanted}")
    before = update.let(f"load {vector}, ptr {here}, align 64")
    signed = update.arithmetic(
        "*", update.read(update.entry(0, 3)), update.spread(update.entry(1, 3, "double"))
    )
    value = update.choose(kept, signed, before)
    worse = update.let(f"fcmp ogt {vector} {value}, {before}")
    update.lines.append(
        f"store {vector} {update.choose(worse, value, before)}, ptr {here}, align 64"
    )
    largest = end.let(f"load {vector}, ptr {here}, align 64")
    largest = end.let(f"call nnan double @llvm.vector.reduce.fmax.v{width}f64({vector} {largest})")
    largest = end.let(f"fmul double {largest}, {end.entry(1, 3, 'double')}")
    end.lines.append(f"store double {largest}, ptr {end.number('%found', '%row')}, align 8")
    return f"""declare double @llvm.vector.reduce.fmax.v{width}f64({vector})
{begin.function("begin_worst", "ptr %here", "ptr %found", "i64 %forget")}{
        update.function("update_worst", "ptr %here", "i64 %accepted")
    }{end.function("end_worst", "ptr %here", "ptr %found")}"""
