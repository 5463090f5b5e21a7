"""Memory layout of a plan for the loops over lanes: integers of eight bytes, and addresses of
tables; and the loops over the rows of those tables, as LLVM text.
"""

from __future__ import annotations

import ctypes
import re
import struct
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...program.plan import DONE, ITERATIONS, MARGIN, Plan, shifted
from ...trajectory import Array

SLOTS = {"residual": "residual", "iterations": ITERATIONS, "done": DONE, "margin": MARGIN}
"""Slots that loops read and write, by their names in the plan."""
NUMBERS = ("stride", *SLOTS, "tolerance", "most", "behind", "quick", "past", "state")
"""Slots and control numbers of the loops; "stride" is the number of slots between groups of lanes,
and "state" the number of remembered slots. "behind" is zero without extrapolation.
"""
PROGRAMS = ("newton", "predict", "extrapolate", "extend")
"""Addresses of calls: each holds the address of a function of lanes and a table, and of the table.
"""
CALLS = ("after", "alone", "joined", "onward", "remaining")
PAIRS = ("carried", "returned", "moves", "continued", "remembered", "shifted")
TABLES: Mapping[str, int] = {
    **dict.fromkeys(CALLS, 1),
    **dict.fromkeys(PAIRS, 2),
    **dict.fromkeys(("targets", "sampled", "kept", "fixed", "taken"), 1),
    "left": 2,
    "given": 2,
    "worst": 3,  # slot; 1, or -1 for the smallest; start value
}
"""Columns of each table. A table takes two numbers of the plan: its address and its number of rows.
"""
PAGE = 64
"""Slots of vectors of eight numbers in a page of memory."""
TOGETHER = 4
"""Pairs of slots copied at a time; the last pair of a table is repeated to a multiple of this."""
FIELDS = [*NUMBERS, *PROGRAMS, *(field for name in TABLES for field in (name, f"{name}_count"))]


def function(head: str, body: str) -> str:
    """Return a function of a plan; fields named "%plan_..." in its body are read at its entry."""
    named = set(re.findall(r"%plan_(\w+)", body))
    kinds = {"tolerance": "double", **dict.fromkeys((*TABLES, *PROGRAMS), "ptr")}
    fields = [f"{kinds.get(name, 'i64')} plan_{name}" if name in named else "" for name in FIELDS]
    return f"""define {head} {{
entry:
  {fields_of("plan", fields)}
  {body}
}}
"""


def fields_of(name: str, fields: Sequence[str]) -> str:
    """Return lines to read fields of a struct, each a kind and a name; empty ones are left out.

    Each field takes eight bytes.
    """
    return "\n  ".join(
        f"%{name}_at_{k} = getelementptr i64, ptr %{name}, i64 {k}\n"
        f"  %{field.split()[1]} = load {field.split()[0]}, ptr %{name}_at_{k}, align 8"
        for k, field in enumerate(fields)
        if field
    )


def call(prefix: str, program: str) -> str:
    """Return lines to call a program, given the address of its call."""
    return f"""%{prefix}_code = load ptr, ptr {program}, align 8
  %{prefix}_table_at = getelementptr ptr, ptr {program}, i64 1
  %{prefix}_table = load ptr, ptr %{prefix}_table_at, align 8
  call void %{prefix}_code(ptr %lane, ptr %{prefix}_table)"""


def over(name: str, table: str, *arguments: str) -> str:
    """Return a call of a loop over the rows of a table of the plan."""
    rows = f"ptr %lane, ptr %plan_{table}, i64 %plan_{table}_count"
    return f"call void @{name}({', '.join((rows, *arguments))})"


def each_row(name: str, arguments: str, body: str, step: int = 1) -> str:
    """Return a loop over the rows of a table, one or several at a time, as a function."""
    return f"""define internal void @{name}(ptr %lane, ptr %table, i64 %count{arguments}) {{
entry:
  %any = icmp ne i64 %count, 0
  br i1 %any, label %loop, label %end
loop:
  %row = phi i64 [0, %entry], [%next, %loop]
  {body}
  %next = add i64 %row, {step}
  %more = icmp ult i64 %next, %count
  br i1 %more, label %loop, label %end
end:
  ret void
}}
"""


def each_slot(name: str, arguments: str, body: str, columns: int = 1) -> str:
    """Return a loop over `%slot`, named in the first column of a table."""
    place = f"""%place_at = mul i64 %row, {columns}
  %place = getelementptr i64, ptr %table, i64 %place_at
  %bytes = load i64, ptr %place, align 8
  %slot = getelementptr i8, ptr %lane, i64 %bytes"""
    return each_row(name, arguments, f"{place}\n  {body}")


def each_number(name: str, body: str, columns: int = 1, arguments: str = "") -> str:
    """Return a loop over `%slot` and `%number`, its place in a table of numbers by rows."""
    number = """%number_at = mul i64 %stride, %row
  %number = getelementptr double, ptr %numbers, i64 %number_at"""
    return each_slot(
        name, f", ptr %numbers, i64 %stride{arguments}", f"{number}\n  {body}", columns
    )


def each_pair(name: str, arguments: str, body: str) -> str:
    """Return a loop over pairs of slots, `TOGETHER` at a time; its body is of one pair,
    `%from#` and `%to#`.
    """
    lines = """%source_at# = getelementptr [2 x i64], ptr %pairs, i64 #, i64 0
  %target_at# = getelementptr [2 x i64], ptr %pairs, i64 #, i64 1
  %source# = load i64, ptr %source_at#, align 8
  %target# = load i64, ptr %target_at#, align 8
  %from# = getelementptr i8, ptr %lane, i64 %source#
  %to# = getelementptr i8, ptr %lane, i64 %target#
  """
    pairs = "%pairs = getelementptr [2 x i64], ptr %table, i64 %row"
    unrolled = [(lines + body).replace("#", str(k)) for k in range(TOGETHER)]
    return each_row(name, arguments, "\n  ".join([pairs, *unrolled]), TOGETHER)


def all_lanes(width: int, name: str) -> str:
    """Return lines for a vector `%name_all` of equal numbers."""
    vector, zeros = f"<{width} x double>", f"<{width} x i32> zeroinitializer"
    return f"""%{name}_one = insertelement {vector} poison, double %{name}, i64 0
  %{name}_all = shufflevector {vector} %{name}_one, {vector} poison, {zeros}"""


SIGN = """%sign_at = getelementptr double, ptr %place, i64 1
  %sign = load double, ptr %sign_at, align 8"""
"""Lines to read the sign of a row of the table "worst"."""


def rows(width: int) -> str:
    """Return functions on slots of a table, and the function that calls the programs of a table."""
    vector = f"<{width} x double>"
    load, store = f"load {vector}, ptr", f"store {vector}"
    calls = f"""%program_at = getelementptr ptr, ptr %table, i64 %row
  %program = load ptr, ptr %program_at, align 8
  {call("row", "%program")}"""
    copy = f"""%value# = {load} %from#, align 8
  {store} %value#, ptr %to#, align 8"""
    spread = f"""%lane_at# = getelementptr double, ptr %from#, i64 %k
  %value# = load double, ptr %lane_at#, align 8
  {all_lanes(width, "value#")}
  {store} %value#_all, ptr %to#, align 8"""
    give = f"""%value = load double, ptr %number, align 8
  {all_lanes(width, "value")}
  {store} %value_all, ptr %slot, align 8"""
    take = f"""%value = {load} %number, align 8
  {store} %value, ptr %slot, align 8"""
    keep = f"""%value = {load} %slot, align 8
  {store} %value, ptr %number, align 8"""
    put = """%value = load double, ptr %slot, align 8
  store double %value, ptr %number, align 8"""
    # NaN if either is
    worsen = f"""{SIGN}
  {all_lanes(width, "sign")}
  %value = {load} %slot, align 8
  %before = {load} %number, align 8
  %signed = fmul {vector} %value, %sign_all
  %signed_before = fmul {vector} %before, %sign_all
  %larger = call nsz {vector} @llvm.maximum.v{width}f64({vector} %signed, {vector} %signed_before)
  %worst = fmul {vector} %larger, %sign_all
  {store} %worst, ptr %number, align 8"""
    return "".join(
        [
            each_row("calls", "", calls),
            each_pair("copy", "", copy),
            each_pair("spread", ", i64 %k", spread),
            each_number("give", give),
            each_number("take", take),
            each_number("keep", keep),
            each_number("put", put),
            each_number("worsen", worsen, 3),
        ]
    )


class PlanInMemory:
    """A plan in memory; see `function`.

    Attributes:
        address: address of the plan.
        calls: by program, its row of `entries`.
        entries: the addresses of a function of lanes and a table, and of the table; they may change
            while programs run.
    """

    def __init__(self, plan: Plan, width: int, stride: int) -> None:
        names = list(plan.programs)
        self.calls: Mapping[str, int] = {name: k for k, name in enumerate(names)}
        self.entries = np.zeros((len(names), 2), np.int64)
        self._entries_at: int = self.entries.ctypes.data
        extrapolates = plan.extrapolates(width)
        pairs: dict[str, Sequence[tuple[int, ...]]] = {
            "carried": plan.carried,
            "returned": [pair[::-1] for pair in reversed(plan.carried)],
            "moves": in_order(plan.moves if extrapolates else plan.carried),
            "continued": in_order(plan.carried_on),
            "remembered": [(slot, k) for k, slot in enumerate(plan.remembered)],
            "shifted": shifted(plan.past, plan.remembered, plan.behind),
        }
        vector, worst = 8 * width, [(plan.largest, 1.0, 0.0), (plan.smallest, -1.0, -np.inf)]
        self._tables: dict[str, NDArray[np.int64]] = {
            **{
                name: _table([self.entry(each) for each in getattr(plan, name)], 1)
                for name in CALLS
            },
            **{
                name: vector * _table([*each, *[*each[-1:]] * (-len(each) % TOGETHER)], 2)
                for name, each in pairs.items()
            },
            "targets": vector * _table([target for _, target in plan.carried], 1),
            **{
                name: vector * _table(getattr(plan, name), 1)
                for name in ("sampled", "kept", "fixed", "taken")
            },
            "left": _table(plan.fixed_from(plan.kept), 2),
            "given": _table(plan.fixed_from(plan.sampled), 2),
            "worst": _table(
                [
                    (vector * x, _bits(sign), _bits(start))
                    for slots, sign, start in worst
                    for x in slots
                ],
                3,
            ),
        }
        found = {
            "stride": stride,
            **{name: plan.slots.get(slot, 0) for name, slot in SLOTS.items()},
            "tolerance": _bits(plan.tolerance),
            "most": plan.most,
            "behind": plan.behind if extrapolates else 0,
            "quick": extrapolates or not plan.remaining,
            "past": plan.past,
            "state": len(plan.remembered),
            **{name: self.entry(name) if name in self.calls else 0 for name in PROGRAMS},
            **{name: table.ctypes.data for name, table in self._tables.items()},
            **{f"{name}_count": len(table) for name, table in self._tables.items()},
        }
        self._words = np.array([found[name] for name in FIELDS], np.int64)
        self.address: int = self._words.ctypes.data

    def entry(self, name: str) -> int:
        """Return the address of the call of a program."""
        return self._entries_at + 16 * self.calls[name]


def in_order(pairs: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return slot pairs in an order without a read soon after a write a whole number of pages away.

    Processors first take both for the same address, and wait: a twentieth of a sweep. Slots that
    move by up to half a page go upwards, the others downwards. Unmoved slots are left out; a slot
    that is both source and target is read first.
    """
    targets = {target for _, target in pairs}
    first, up, down = list[tuple[int, int]](), list[tuple[int, int]](), list[tuple[int, int]]()
    for source, target in pairs:
        if source != target:
            near = (source - target) % PAGE < PAGE // 2
            (first if source in targets else up if near else down).append((source, target))
    return first + up + down[::-1]


def _bits(x: float) -> int:
    return struct.unpack("<q", struct.pack("<d", x))[0]


def _table(rows: Sequence[Any], columns: int) -> NDArray[np.int64]:
    return np.array(rows, np.int64).reshape(-1, columns)


LINE, BYTES = 8, 8
"""Numbers in a cache line, and bytes of a number."""


def aligned(count: int) -> Array:
    """Return an array that starts at a cache line, so no vector crosses two lines."""
    room = np.empty(count + LINE)
    start = -(address(room) // BYTES) % LINE
    return room[start : start + count]


def address(array: NDArray[Any]) -> int:
    """Return the address of a contiguous array; four times faster than its own `ctypes`."""
    return ctypes.addressof(ctypes.c_char.from_buffer(array.data))
