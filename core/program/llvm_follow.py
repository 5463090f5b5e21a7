"""Following one motion as LLVM code, lanes as samples."""

from __future__ import annotations

from collections.abc import Sequence

from .executor import MARGIN, Plan
from .llvm_code import Lines
from .llvm_loops import calls
from .llvm_tables import Rows

MOTION = ("ptr lane", "ptr start", "ptr worst", "ptr out", "i64 row", "i64 forget", "i64 sides")
SIDE = ("ptr samples", "i64 stride", "i64 first", "i64 step", "i64 count", "ptr anchor", "i64 reached")
"""What is told of a motion and of each of its sides, eight bytes each: few arguments make a quick call. A call that is told to
forget begins the worst anew, and clears that field: the calls after it go on. `run` writes how far it came.
"""


def follow(plan: Plan, width: int) -> str:
    """See `Track`: W samples at a time, and on from the last one accepted.

    What is extrapolated begins at a multiple of W: the group after one that was accepted whole ends there.
    """
    vector, begin, test, given = f"<{width} x double>", *(Lines(width, prefix) for prefix in "btg")
    # loops over tables: written out row by row they would be a quarter of all that is to be compiled, and no faster
    loops = {name: Rows(width, name) for name in ("enter", "up", "down", "back", "move", "pass", "leave")}
    enter, up, down, back, move, carry, leave = loops.values()
    sources, targets = zip(*plan.carried, strict=True)
    extrapolates = plan.extrapolates(width)
    quick = extrapolates or not plan.remaining
    rates = plan.rates if extrapolates else ()
    source, target = carry.table(*zip(*[pair for pair in plan.moves if pair[0] not in rates], strict=True))
    carry.write(target, carry.spread(carry.let(f"load double, ptr {carry.number(carry.slot(source), width - 1)}, align 8")))
    (slot,) = enter.table(targets)
    enter.write(slot, enter.spread(enter.let(f"load double, ptr {enter.number('%place', enter.row)}, align 8")))
    (slot,) = leave.table(targets)
    value = leave.let(f"load double, ptr {leave.slot(slot)}, align 8")
    leave.lines.append(f"store double {value}, ptr {leave.number('%anchor', leave.row)}, align 8")
    for row, slot in enumerate(plan.sampled):
        place = begin.number("%samples", begin.sum(begin.product("%stride", row), "%at"))
        begin.write(slot, begin.let(f"load {vector}, ptr {place}, align 8"))
        place = given.number("%samples", given.sum(given.sum(given.product("%stride", row), "%at"), -1))
        given.write(slot, given.spread(given.let(f"load double, ptr {place}, align 8")))
    accepted = test.let(f"fcmp ogt {vector} {test.read(plan.slots[MARGIN])}, zeroinitializer")
    for keep in (up, down):
        (slot,) = keep.table(plan.kept)
        value = keep.turned(keep.read(slot)) if keep is down else keep.read(slot)
        place = keep.number("%out", keep.sum(keep.product("%row", keep.row), f"%{keep.prefix}_column"))
        keep.lines.append(f"store {vector} {value}, ptr {place}, align 8")
    source, target = move.table(sources, targets)
    move.write(target, move.spread(move.let(f"load double, ptr {move.number(move.slot(source), '%last')}, align 8")))
    source, target = back.table(sources[::-1], targets[::-1])
    back.write(source, back.read(target))
    tables = "\n".join(each.constants for each in loops.values())
    worst = _Worst(plan, width)
    return f"""{tables}
{worst.declarations}
declare i64 @llvm.cttz.i64(i64, i1)
declare i64 @llvm.smin.i64(i64, i64)
declare i64 @llvm.smax.i64(i64, i64)
{_run()}
define i64 @follow(ptr %motion, ptr %side, ptr %place, i64 %from, i64 %stop) {{
entry:
  {_fields("motion", MOTION)}
  {_fields("side", SIDE)}
  {worst.enter}
  %descending = icmp slt i64 %step, 0
  {enter.loop("entry")}
  br label %head
head:
  %at = phi i64 [%from, %enter_end], [%next, %pass_end], [%next, %move_end]
  %smooth = phi i1 [false, %enter_end], [{str(extrapolates).lower()}, %pass_end], [false, %move_end]
  %whole_before = phi i1 [false, %enter_end], [false, %pass_end], [%onto, %move_end]
  %more = icmp slt i64 %at, %stop
  br i1 %more, label %begin, label %end
begin:
  {begin.text}
  br i1 %smooth, label %extrapolate, label %predict
extrapolate:
  call void @{"extrapolate" if extrapolates else "predict"}(ptr %lane)
  br label %attempt
predict:
  call void @predict(ptr %lane)
  br label %attempt
attempt:
  call void @settle(ptr %lane)
  {calls(plan.joined)}
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
  %full = icmp eq i64 %accepted, {width if quick else -1}
  %further = icmp slt i64 %next, %stop
  %onto = and i1 %full, {str(extrapolates).lower()}
  %aligned = icmp ule i64 %offset, {0 if extrapolates else width}
  %going = and i1 %full, %further
  %whole = and i1 %going, %aligned
  %none = icmp eq i64 %accepted, 0
  br i1 %none, label %missed, label %keep
missed:
  br i1 %smooth, label %return, label %end
return:
  {back.loop("return")}
  {given.text}
  {calls(plan.onward)}
  br label %take
keep:
  {worst.update}
  %up_column = add i64 %first, %at
  %down_first = sub i64 %first, %at
  %down_column = sub i64 %down_first, {width - 1}
  br i1 %descending, label %backward, label %forward
forward:
  {up.loop("forward")}
  br label %kept
backward:
  {down.loop("backward")}
  br label %kept
kept:
  br i1 %whole, label %carry, label %onward
carry:
  {carry.loop("carry")}
  br label %head
onward:
  {calls(plan.remaining)}
  br label %take
take:
  %before = sub i64 %accepted, 1
  %last = call i64 @llvm.smax.i64(i64 %before, i64 0)
  {move.loop("take")}
  br label %head
end:
  {leave.loop("end")}
  {worst.leave}
  ret i64 %at
}}
"""


def _run() -> str:
    """Follow every side from the start to its end; how many of them ended early."""
    end = Lines(0, "end")
    end.lines.append(f"store i64 %at, ptr {end.number('%side', SIDE.index('i64 reached'))}, align 8")
    return f"""define i64 @run(ptr %motion, ptr %table) {{
entry:
  {_fields("motion", MOTION)}
  br label %head
head:
  %k = phi i64 [0, %entry], [%next, %one]
  %early = phi i64 [0, %entry], [%early_now, %one]
  %more = icmp ult i64 %k, %sides
  br i1 %more, label %one, label %end
one:
  %offset = mul i64 %k, {len(SIDE)}
  %side = getelementptr i64, ptr %table, i64 %offset
  {_fields("side", SIDE)}
  %at = call i64 @follow(ptr %motion, ptr %side, ptr %start, i64 0, i64 %count)
  {end.text}
  %ended = icmp ne i64 %at, %count
  %counted = zext i1 %ended to i64
  %early_now = add i64 %early, %counted
  %next = add i64 %k, 1
  br label %head
end:
  ret i64 %early
}}
"""


def _fields(name: str, fields: Sequence[str]) -> str:
    """Read what stands at an address, each under its own name."""
    lines = Lines(0, f"{name}_")
    for k, (kind, field) in enumerate(each.split() for each in fields):
        lines.lines.append(f"%{field} = load {kind}, ptr {lines.number(f'%{name}', k)}, align 8")
    return lines.text


class _Worst:
    """The largest and the smallest of slots over the lanes that are kept, in vectors on the stack until the end."""

    def __init__(self, plan: Plan, width: int) -> None:
        enter, update, leave = (Lines(width, f"worst_{part}") for part in ("enter", "update", "leave"))
        vector, words = enter.vector, f"<{width} x i64>"
        enter.lines.append("%nothing = icmp ne i64 %forget, 0")
        enter.lines.append(f"store i64 0, ptr {enter.number('%motion', MOTION.index('i64 forget'))}, align 8")
        numbers = ", ".join(f"i64 {k}" for k in range(width))
        one = update.let(f"insertelement {words} poison, i64 %accepted, i64 0")
        count = update.let(f"shufflevector {words} {one}, {words} poison, <{width} x i32> zeroinitializer")
        kept = update.let(f"icmp ult {words} <{numbers}>, {count}")
        for k, (slot, kind) in enumerate([*((x, "max") for x in plan.largest), *((x, "min") for x in plan.smallest)]):
            place, here = enter.number("%worst", k), enter.anew(f"alloca {vector}, align 64")
            nothing = "0.0" if kind == "max" else "0x7FF0000000000000"
            start = enter.let(f"load double, ptr {place}, align 8")
            start = enter.spread(enter.let(f"select i1 %nothing, double {nothing}, double {start}"))
            enter.lines.append(f"store {vector} {start}, ptr {here}, align 64")
            so_far = update.let(f"load {vector}, ptr {here}, align 64")
            value = update.choose(kept, update.read(slot), so_far)
            worse = update.let(f"fcmp {'ogt' if kind == 'max' else 'olt'} {vector} {value}, {so_far}")
            update.lines.append(f"store {vector} {update.choose(worse, value, so_far)}, ptr {here}, align 64")
            found = leave.let(f"load {vector}, ptr {here}, align 64")
            found = leave.let(f"call nnan double @llvm.vector.reduce.f{kind}.v{width}f64({vector} {found})")
            leave.lines.append(f"store double {found}, ptr {place}, align 8")
        self.enter, self.update, self.leave = enter.text, update.text, leave.text
        reductions = (f"declare double @llvm.vector.reduce.f{kind}.v{width}f64({vector})" for kind in ("max", "min"))
        self.declarations = "\n".join(reductions)
