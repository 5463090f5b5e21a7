"""Memory layout of a plan for the loops over lanes: integers of eight bytes, and addresses of
tables.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..plan import DONE, ITERATIONS, MARGIN, Plan, shifted
from .programs import Lines

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
    """Return a function of a plan: the fields that its body names as "%plan_..." are read at its
    entry.
    """
    named, lines = set(re.findall(r"%plan_(\w+)", body)), Lines(0, "plan")
    for k, name in enumerate(FIELDS):
        if name in named:
            kind = (
                "double"
                if name == "tolerance"
                else "ptr"
                if name in TABLES or name in PROGRAMS
                else "i64"
            )
            lines.lines.append(
                f"%plan_{name} = load {kind}, ptr {lines.number('%plan', k)}, align 8"
            )
    return f"""define {head} {{
entry:
  {lines.text}
  {body}
}}
"""


def call(prefix: str, program: str) -> str:
    """Return lines that call a program, given the address of its call."""
    lines = Lines(0, f"{prefix}_call")
    function = lines.let(f"load ptr, ptr {program}, align 8")
    table = lines.let(f"load ptr, ptr {lines.number(program, 1)}, align 8")
    lines.lines.append(f"call void {function}(ptr %lane, ptr {table})")
    return lines.text


class Rows(Lines):
    """A loop over the rows of a table; its lines are those of one row, or of `step` rows."""

    def __init__(self, width: int, step: int = 1) -> None:
        super().__init__(width, "r")
        self._step, self.at = step, "%row"

    def entry(self, column: int = 0, columns: int = 1, kind: str = "i64") -> str:
        """Return a number of the row."""
        at = self.sum(self.product(self.at, columns), column)
        return self.let(f"load {kind}, ptr {self.number('%table', at)}, align 8")

    def slot(self, number: str | int) -> str:
        """Return the address of a slot, given its byte offset from the lanes."""
        return self.let(f"getelementptr i8, ptr %lane, i64 {number}")

    def function(self, name: str, *arguments: str) -> str:
        """Return the loop as a function of lanes and a table."""
        head = ", ".join(("ptr %lane, ptr %table, i64 %count", *arguments))
        return f"""define internal void @{name}({head}) {{
entry:
  %any = icmp ne i64 %count, 0
  br i1 %any, label %loop, label %end
loop:
  %row = phi i64 [0, %entry], [%next, %loop]
  {self.text}
  %next = add i64 %row, {self._step}
  %more = icmp ult i64 %next, %count
  br i1 %more, label %loop, label %end
end:
  ret void
}}
"""


def over(name: str, table: str, *arguments: str) -> str:
    """Return a call of such a function for a table of the plan."""
    rows_of = f"ptr %lane, ptr %plan_{table}, i64 %plan_{table}_count"
    return f"call void @{name}({', '.join((rows_of, *arguments))})"


def rows(width: int) -> str:
    """Return functions on slots of a table, and the function that calls the programs of a table."""
    vector = f"<{width} x double>"
    calls, give, take, keep, put, worsen = (Rows(width) for _ in range(6))
    copy, spread = Rows(width, TOGETHER), Rows(width, TOGETHER)
    calls.lines.append(call("row", calls.entry(kind="ptr")))
    for k in range(TOGETHER):
        copy.at, spread.at = copy.sum("%row", k), spread.sum("%row", k)
        copy.write(
            copy.entry(1, 2),
            copy.assign(f"load {vector}, ptr {copy.slot(copy.entry(0, 2))}, align 8"),
        )
        number = spread.number(spread.slot(spread.entry(0, 2)), "%k")
        spread.write(
            spread.entry(1, 2), spread.spread(spread.assign(f"load double, ptr {number}, align 8"))
        )
    here = [
        each.number("%numbers", each.product("%stride", "%row")) for each in (give, take, keep, put)
    ]
    give.write(give.entry(), give.spread(give.let(f"load double, ptr {here[0]}, align 8")))
    take.write(take.entry(), take.let(f"load {vector}, ptr {here[1]}, align 8"))
    keep.lines.append(f"store {vector} {keep.read(keep.entry())}, ptr {here[2]}, align 8")
    first = put.let(f"load double, ptr {put.slot(put.entry())}, align 8")
    put.lines.append(f"store double {first}, ptr {here[3]}, align 8")
    sign, worst = (
        worsen.spread(worsen.entry(1, 3, "double")),
        worsen.number("%numbers", worsen.product("%stride", "%row")),
    )
    values = worsen.read(worsen.entry(0, 3)), worsen.let(f"load {vector}, ptr {worst}, align 8")
    # NaN if either is
    worse = worsen.call("maximum", *(worsen.arithmetic("*", sign, each) for each in values))
    worsen.lines.append(
        f"store {vector} {worsen.arithmetic('*', sign, worse)}, ptr {worst}, align 8"
    )
    numbers = "ptr %numbers", "i64 %stride"
    return "".join(
        [
            calls.function("calls"),
            copy.function("copy"),
            spread.function("spread", "i64 %k"),
            give.function("give", *numbers),
            take.function("take", *numbers),
            keep.function("keep", *numbers),
            put.function("put", *numbers),
            worsen.function("worsen", *numbers),
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
            "moves": in_order(plan.moved if extrapolates else plan.carried),
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
            "left": _table([(vector * slot, k) for slot, k in plan.left], 2),
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
    first = [pair for pair in pairs if pair[0] in targets and pair[0] != pair[1]]
    rest = [pair for pair in pairs if pair not in first and pair[0] != pair[1]]
    up = [pair for pair in rest if (pair[0] - pair[1]) % PAGE < PAGE // 2]
    return first + up + [pair for pair in reversed(rest) if pair not in up]


def _bits(x: float) -> int:
    return struct.unpack("<q", struct.pack("<d", x))[0]


def _table(rows: Sequence[Any], columns: int) -> NDArray[np.int64]:
    return np.array(rows, np.int64).reshape(-1, columns)
