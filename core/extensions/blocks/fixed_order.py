"""Sparse LU factors of several matrices at once, eliminated in one order: each number is a vector
of `LANES`, one for each matrix.

The order is known before the numbers: no pivot is chosen, and the caller judges by the growth.
The loops run over lists of places, row by row; they are the same for all matrices, and read a row
of eight or so columns in as many nanoseconds.
"""

from __future__ import annotations

from functools import cache, partial
from heapq import heapify, heappop, heappush
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...trajectory import Array
from ..llvm.jit import Code, load
from ..llvm.plan import BYTES, LINE, address, aligned, call, each_row, fields_of
from ..llvm.programs import Lines, declarations

LANES = LINE
"""Matrices at once."""


class FixedOrder:
    """A pattern in an order of elimination, and the factors L and U of the last matrices in one
    table, row by row.

    Args:
        rows, columns: of the entries, in that order, each place once.
        n: number of rows.
        given: places of the entries among the numbers of a matrix.

    Attributes:
        growth: the largest entry of L of each matrix, NaN where its elimination broke off.
        inverse: the largest inverse of a pivot, infinite where one is zero.
    """

    def __init__(
        self,
        rows: NDArray[np.intp],
        columns: NDArray[np.intp],
        n: int,
        given: NDArray[np.intp],
    ) -> None:
        pattern = _fill_in(rows, columns, n)
        sizes = [len(row) for row in pattern]
        every = np.fromiter((j for row in pattern for j in sorted(row)), np.int64)
        row, starts = np.repeat(np.arange(n), sizes), np.cumsum([0, *sizes])
        pivots = np.flatnonzero(row == every)
        places, self.n, self._taken = row * n + every, n, given
        # what fills in is read from a last row of zeros
        sources = np.full(len(places), len(rows))
        sources[np.searchsorted(places, rows * n + columns)] = np.arange(len(rows))
        counts = len(rows) + 1, len(places), n, n, 3, n
        room = aligned(sum(counts) * LANES).reshape(-1, LANES)
        numbers = np.split(room, np.cumsum(counts)[:-1])
        self._given, _, _, _, (self.growth, self.inverse, self._signs), ones = numbers
        self._given[-1], ones[:] = 0.0, 1.0
        self._sources, self._alive = sources, (starts, pivots, every, sources, pivots + 1, room)
        at = [address(each) for each in self._alive[:5]]
        at_numbers = [address(each) for each in numbers]
        self._factor = partial(load_loops().calls["factor"], n, *at[:4], *at_numbers[:5])
        # first place of each row of L, and of U without its diagonal, the place after its last, and
        # what it is multiplied by
        table = at[2], at_numbers[1]
        self._lower = at[0], at[1], *table, at_numbers[5]
        self._upper = at[4], at[0] + BYTES, *table, at_numbers[2]
        self._places, self._numbers = at[:3], at_numbers[1:4]

    def factor(self, numbers: Array) -> None:
        """Factor matrices with these numbers, shape (numbers, LANES)."""
        numbers.take(self._taken, axis=0, out=self._given[:-1], mode="clip")
        self._factor()

    def solve(self, b: Array, *, transposed: bool = False) -> Array:
        """Return solutions, of the matrices or of the transposed ones, shape (n, LANES)."""
        found = aligned(b.size).reshape(b.shape)
        found[:] = b
        name, first, last = self._sweeps(transposed=transposed)
        run, n, there = load_loops().calls[name], self.n, address(found)
        run(n, 0, 1, *first, there)
        run(n, n - 1, -1, *last, there)
        return found

    def _sweeps(self, *, transposed: bool) -> tuple[str, tuple[int, ...], tuple[int, ...]]:
        """Return the name of the loop of a solution, and its tables on the way down and up."""
        if transposed:
            return "scatter", self._upper, self._lower
        return "gather", self._lower, self._upper

    def factoring(self, slots: NDArray[np.intp], out: NDArray[np.intp]) -> list[NDArray[np.int64]]:
        """Return the table of `factor_lanes`, and its arrays. One straying matrix is reason to look
        at all of them: each has the largest growth and inverse of all.

        Args:
            slots: of the numbers of a matrix, and of zero.
            out: first of three slots, see `growth`, `inverse` and `odd`.
        """
        sources = slots[np.append(self._taken, len(slots) - 1)][self._sources].astype(np.int64)
        fields = self.n, *self._places, address(sources), *self._numbers, *out
        return [np.array(fields, np.int64), sources]

    def solving(
        self, given: NDArray[np.intp], found: NDArray[np.intp], *, transposed: bool
    ) -> list[NDArray[Any]]:
        """Return the table of `solve_lanes`, and its arrays; the slots of right-hand sides and
        solutions are in the order of elimination.
        """
        name, first, last = self._sweeps(transposed=transposed)
        work, places = aligned(self.n * LANES), [x.astype(np.int64) for x in (given, found)]
        at = [address(each) for each in (work, *places)]
        fields = self.n, load_loops().address(name), *first, *last, *at
        return [np.array(fields, np.int64), work, *places]

    @property
    def odd(self) -> NDArray[np.bool_]:
        """Whether the number of negative pivots of each matrix is odd."""
        return self._signs < 0.0


def _fill_in(rows: NDArray[np.intp], columns: NDArray[np.intp], n: int) -> list[set[int]]:
    """Return the columns of the factors' entries in each row."""
    pattern = [{k} for k in range(n)]
    places: list[tuple[int, int]] = np.stack([rows, columns], axis=1).tolist()
    for i, j in places:
        pattern[i].add(j)
    upper = list[set[int]]()
    for i, row in enumerate(pattern):
        waiting = [j for j in row if j < i]
        heapify(waiting)
        while waiting:
            fill = upper[heappop(waiting)] - row
            row |= fill
            for j in fill:
                if j < i:
                    heappush(waiting, j)
        upper.append({j for j in row if j > i})
    return pattern


@cache
def load_loops() -> Code:
    """Return the loops, compiled if the cache has none of their text."""
    sweeps = _sweep("gather"), _sweep("scatter")
    text = "\n".join([_factor(), *sweeps, _in_lanes(), declarations(LANES)])
    return load(text, lambda: text, {"factor": 10, "gather": 9, "scatter": 9})


VECTOR, WORDS = f"<{LANES} x double>", f"<{LANES} x i64>"


def _load(name: str, table: str, at: str, kind: str = "i64") -> str:
    """Return lines to read a number of a table, or a vector."""
    return f"""%{name}_at = getelementptr {kind}, ptr {table}, i64 {at}
  %{name} = load {kind}, ptr %{name}_at, align 8"""


def _store(value: str, table: str, at: str, kind: str = VECTOR) -> str:
    """Return lines to write a vector of a table."""
    place = f"{value}_{table[1:]}"
    return f"""{place} = getelementptr {kind}, ptr {table}, i64 {at}
  store {kind} {value}, ptr {place}, align 8"""


def _largest(value: str, so_far: str) -> str:
    """Return lines for `%value_largest`: the larger of the size of a vector and another one."""
    return f"""%{value}_size = call {VECTOR} @llvm.fabs.v{LANES}f64({VECTOR} %{value})
  %{value}_largest = call nsz {VECTOR} @llvm.maximum.v{LANES}f64({VECTOR} {so_far}, {VECTOR}
    %{value}_size)"""


def _less(name: str, a: str, b: str, c: str) -> str:
    """Return lines for c - a b."""
    numbers = f"{VECTOR} %{name}_minus, {VECTOR} {b}, {VECTOR} {c}"
    return f"""%{name}_minus = fneg {VECTOR} {a}
  %{name} = call {VECTOR} @llvm.fmuladd.v{LANES}f64({numbers})"""


def _factor() -> str:
    """Return row by row (Doolittle): a row of the matrix less the rows above it."""
    places = "ptr %starts, ptr %pivots, ptr %columns, ptr %sources"
    numbers = "ptr %given, ptr %table, ptr %inverse, ptr %work, ptr %growth"
    one = Lines(LANES).constant(1.0)
    return f"""define void @factor(i64 %n, {places}, {numbers}) {{
entry:
  br label %row
row:
  %i = phi i64 [0, %entry], [%i_next, %end]
  %growth_row = phi {VECTOR} [zeroinitializer, %entry], [%growth_now, %end]
  %inverse_row = phi {VECTOR} [zeroinitializer, %entry], [%reciprocal_largest, %end]
  %signs_row = phi {WORDS} [zeroinitializer, %entry], [%signs, %end]
  %i_next = add i64 %i, 1
  {_load("start", "%starts", "%i")}
  {_load("pivot", "%pivots", "%i")}
  {_load("stop", "%starts", "%i_next")}
  br label %copy
copy:
  %p = phi i64 [%start, %row], [%p_next, %copy]
  {_load("source", "%sources", "%p")}
  {_load("column", "%columns", "%p")}
  {_load("entry_given", "%given", "%source", VECTOR)}
  {_store("%entry_given", "%work", "%column")}
  %p_next = add i64 %p, 1
  %p_more = icmp slt i64 %p_next, %stop
  br i1 %p_more, label %copy, label %below
below:
  %l = phi i64 [%start, %copy], [%l_next, %by_end]
  %growth_now = phi {VECTOR} [%growth_row, %copy], [%multiplier_largest, %by_end]
  %l_more = icmp slt i64 %l, %pivot
  br i1 %l_more, label %by, label %back
by:
  {_load("k", "%columns", "%l")}
  {_load("left", "%work", "%k", VECTOR)}
  {_load("scale", "%inverse", "%k", VECTOR)}
  %multiplier = fmul {VECTOR} %left, %scale
  {_store("%multiplier", "%work", "%k")}
  {_largest("multiplier", "%growth_now")}
  %k_next = add i64 %k, 1
  {_load("above", "%pivots", "%k")}
  %above_first = add i64 %above, 1
  {_load("above_end", "%starts", "%k_next")}
  br label %update
update:
  %u = phi i64 [%above_first, %by], [%u_next, %less]
  %u_more = icmp slt i64 %u, %above_end
  br i1 %u_more, label %less, label %by_end
less:
  {_load("j", "%columns", "%u")}
  {_load("entry_above", "%table", "%u", VECTOR)}
  {_load("entry_here", "%work", "%j", VECTOR)}
  {_less("rest", "%multiplier", "%entry_above", "%entry_here")}
  {_store("%rest", "%work", "%j")}
  %u_next = add i64 %u, 1
  br label %update
by_end:
  %l_next = add i64 %l, 1
  br label %below
back:
  %q = phi i64 [%start, %below], [%q_next, %back]
  {_load("column_back", "%columns", "%q")}
  {_load("entry_back", "%work", "%column_back", VECTOR)}
  {_store("%entry_back", "%table", "%q")}
  %q_next = add i64 %q, 1
  %q_more = icmp slt i64 %q_next, %stop
  br i1 %q_more, label %back, label %end
end:
  {_load("diagonal", "%work", "%i", VECTOR)}
  %reciprocal = fdiv {VECTOR} {one}, %diagonal
  {_store("%reciprocal", "%inverse", "%i")}
  {_largest("reciprocal", "%inverse_row")}
  ; the sign bits of all pivots: those of the other bits have no meaning
  %bits = bitcast {VECTOR} %reciprocal to {WORDS}
  %signs = xor {WORDS} %bits, %signs_row
  %i_more = icmp slt i64 %i_next, %n
  br i1 %i_more, label %row, label %done
done:
  {_store("%growth_now", "%growth", "0")}
  {_store("%reciprocal_largest", "%growth", "1")}
  %sign = bitcast {WORDS} %signs to {VECTOR}
  %unit = call {VECTOR} @llvm.copysign.v{LANES}f64({VECTOR} {one}, {VECTOR} %sign)
  {_store("%unit", "%growth", "2")}
  ret void
}}
"""


def _sweep(name: str) -> str:
    """Return a substitution over the rows, up or down: each gathers what the rows before it give,
    or scatters what it gives to those after it.
    """
    scaled = f"""%scaled = fmul {VECTOR} {"%x" if name == "gather" else "%own"}, %scale_here
  {_store("%scaled", "%b", "%i")}"""
    if name == "gather":
        before, first, found, after = "", "%own", "%left", scaled
        run = _less("left", "%entry_here", "%other", "%x")
    else:
        before, first, found, after = scaled, "%scaled", "%x", ""
        run = f"""{_less("left", "%entry_here", "%scaled", "%other")}
  {_store("%left", "%b", "%column")}"""
    head = "ptr %begins, ptr %ends, ptr %columns, ptr %table, ptr %scale, ptr %b"
    return f"""define void @{name}(i64 %n, i64 %start, i64 %step, {head}) {{
entry:
  br label %row
row:
  %k = phi i64 [0, %entry], [%k_next, %end]
  %i = phi i64 [%start, %entry], [%i_next, %end]
  {_load("first", "%begins", "%i")}
  {_load("stop", "%ends", "%i")}
  {_load("own", "%b", "%i", VECTOR)}
  {_load("scale_here", "%scale", "%i", VECTOR)}
  {before}
  br label %next
next:
  %p = phi i64 [%first, %row], [%p_next, %run]
  %x = phi {VECTOR} [{first}, %row], [{found}, %run]
  %p_more = icmp slt i64 %p, %stop
  br i1 %p_more, label %run, label %end
run:
  {_load("column", "%columns", "%p")}
  {_load("entry_here", "%table", "%p", VECTOR)}
  {_load("other", "%b", "%column", VECTOR)}
  {run}
  %p_next = add i64 %p, 1
  br label %next
end:
  {after}
  %i_next = add i64 %i, %step
  %k_next = add i64 %k, 1
  %k_more = icmp slt i64 %k_next, %n
  br i1 %k_more, label %row, label %done
done:
  ret void
}}
"""


JOINED = {
    "squares": f"%found = call {VECTOR} @llvm.fmuladd.v{LANES}f64({VECTOR} %value, {VECTOR} %value,"
    f" {VECTOR} %before)",
    "largest": _largest("value", "%before").replace("%value_largest", "%found"),
    "least": f"%found = call {VECTOR} @llvm.minimum.v{LANES}f64({VECTOR} %before, {VECTOR} %value)",
}
"""Functions of lanes and a table of pairs of slots: the first of each is joined to the second. Its
square is added, or the larger size or the smaller number taken; NaN if either is.
"""


def _in_lanes() -> str:
    """Return functions of lanes and a table, see `plan.call`: a sequence of others, factors and
    solutions of numbers in slots, the polynomial through eight lanes, and `JOINED`.
    """
    factoring = "ptr starts", "ptr pivots", "ptr columns", "ptr sources"
    factors = "ptr numbers", "ptr inverse", "ptr work"
    sweep = [f"ptr {name}" for name in ("begins", "ends", "columns", "table", "scale")]
    first, last = ([f"{each}_{k}" for each in sweep] for k in (1, 2))
    sweeps = (", ".join(each.replace("ptr ", "ptr %") for each in side) for side in (first, last))
    down, up = sweeps
    factor = f"""{fields_of("table", ["i64 n", *factoring, *factors, "i64 out"])}
  %growth = getelementptr {VECTOR}, ptr %lane, i64 %out
  call void @factor(i64 %n, ptr %starts, ptr %pivots, ptr %columns, ptr %sources, ptr %lane,
    ptr %numbers, ptr %inverse, ptr %work, ptr %growth)
  {_of_all("growth", 0)}
  {_of_all("inverse", 1)}"""
    tables = "ptr b", "ptr given", "ptr found"
    solve = f"""{fields_of("table", ["i64 n", "ptr run", *first, *last, *tables])}
  %last = sub i64 %n, 1
  call void @bring(ptr %lane, ptr %given, i64 %n, ptr %b)
  call void %run(i64 %n, i64 0, i64 1, {down}, ptr %b)
  call void %run(i64 %n, i64 %last, i64 -1, {up}, ptr %b)
  call void @take_back(ptr %lane, ptr %found, i64 %n, ptr %b)"""
    bring = f"""{_load("slot", "%table", "%row")}
  {_load("value", "%lane", "%slot", VECTOR)}
  {_store("%value", "%b", "%row")}"""
    take_back = f"""{_load("slot", "%table", "%row")}
  {_load("value", "%b", "%row", VECTOR)}
  {_store("%value", "%lane", "%slot")}"""
    pair = f"""%first_row = mul i64 %row, 2
  %second_row = add i64 %first_row, 1
  {_load("source", "%table", "%first_row")}
  {_load("target", "%table", "%second_row")}
  {_load("value", "%lane", "%source", VECTOR)}"""
    weigh = "\n  ".join(
        f"""{_load(f"weight{k}", "%weights", str(k), VECTOR)}
  %node{k} = shufflevector {VECTOR} %here, {VECTOR} poison, <{LANES} x i32> <{
            ", ".join([f"i32 {k}"] * LANES)
        }>
  %sum{k + 1} = call {VECTOR} @llvm.fmuladd.v{LANES}f64({VECTOR} %node{k}, {VECTOR} %weight{k},
    {VECTOR} {f"%sum{k}" if k else "zeroinitializer"})"""
        for k in range(LANES)
    )
    polynomial = f"""{pair}
  {_load("here", "%past", "%row", VECTOR)}
  {weigh}
  %found = select <{LANES} x i1> %known, {VECTOR} %sum{LANES}, {VECTOR} %value
  {_store("%found", "%lane", "%target")}"""
    goes_on = f"""{fields_of("table", ["i64 count", "ptr past", "i64 first", "i64 whether"])}
  %rows = getelementptr i64, ptr %table, i64 4
  %weights = getelementptr {VECTOR}, ptr %lane, i64 %first
  {_load("flag", "%lane", "%whether", VECTOR)}
  %known = fcmp ogt {VECTOR} %flag, zeroinitializer
  call void @each_number(ptr %lane, ptr %rows, i64 %count, ptr %past, ptr %weights,
    <{LANES} x i1> %known)"""
    every = f"""{fields_of("table", ["i64 count"])}
  %rows = getelementptr i64, ptr %table, i64 1"""
    calls = f"""%call_at = mul i64 %row, 2
  %call = getelementptr ptr, ptr %table, i64 %call_at
  {call("row", "%call")}"""
    found = [
        each_row("bring", ", ptr %b", bring),
        each_row("take_back", ", ptr %b", take_back),
        each_row("each_call", "", calls),
        each_row("each_number", f", ptr %past, ptr %weights, <{LANES} x i1> %known", polynomial),
        _of_lanes("factor_lanes", factor),
        _of_lanes("solve_lanes", solve),
        _of_lanes("continue", goes_on),
        _of_lanes(
            "sequence",
            f"{every}\n  call void @each_call(ptr %lane, ptr %rows, i64 %count)",
        ),
    ]
    for name, line in JOINED.items():
        body = f"""{pair}
  {_load("before", "%lane", "%target", VECTOR)}
  {line}
  {_store("%found", "%lane", "%target")}"""
        one = f"{every}\n  call void @each_{name}(ptr %lane, ptr %rows, i64 %count)"
        found += [each_row(f"each_{name}", "", body), _of_lanes(name, one)]
    return f"declare i64 @llvm.vector.reduce.smax.v{LANES}i64({WORDS})\n" + "\n".join(found)


def _of_all(name: str, k: int) -> str:
    """Return lines to give all lanes the largest of numbers without a sign, or NaN: their bits have
    the same order.
    """
    return f"""{_load(f"{name}_here", "%growth", str(k), WORDS)}
  %{name}_most = call i64 @llvm.vector.reduce.smax.v{LANES}i64({WORDS} %{name}_here)
  %{name}_one = insertelement {WORDS} poison, i64 %{name}_most, i64 0
  %{name}_all = shufflevector {WORDS} %{name}_one, {WORDS} poison, <{LANES} x i32> zeroinitializer
  {_store(f"%{name}_all", "%growth", str(k), WORDS)}"""


def _of_lanes(name: str, body: str) -> str:
    return f"""define void @{name}(ptr %lane, ptr %table) {{
entry:
  {body}
  ret void
}}
"""
