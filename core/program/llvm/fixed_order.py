"""Sparse LU factors of several matrices at once, eliminated in one order: each number is a vector
of `LANES`, one for each matrix.

The order is known before the numbers: no pivot is chosen, and the caller judges by the growth.
The loops run over lists of places, row by row; they are the same for all matrices, and read a row
of eight or so columns in as many nanoseconds.
"""

from __future__ import annotations

from functools import cache, partial
from heapq import heapify, heappop, heappush

import numpy as np
from numpy.typing import NDArray

from ...trajectory import Array
from ..plan import BYTES, LINE, address, aligned
from .jit import Code, load
from .programs import Lines, declarations

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
        pattern = _filled(rows, columns, n)
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
        self._alive = starts, pivots, every, sources, pivots + 1, room
        at = [address(each) for each in self._alive[:5]]
        at_numbers = [address(each) for each in numbers]
        self._factor = partial(_code().calls["factor"], n, *at[:4], *at_numbers[:5])
        # first place of each row of L, and of U without its diagonal, the place after its last, and
        # what it is multiplied by
        table = at[2], at_numbers[1]
        self._lower = at[0], at[1], *table, at_numbers[5]
        self._upper = at[4], at[0] + BYTES, *table, at_numbers[2]

    def factor(self, numbers: Array) -> None:
        """Factor matrices with these numbers, shape (numbers, LANES)."""
        numbers.take(self._taken, axis=0, out=self._given[:-1], mode="clip")
        self._factor()

    def solve(self, b: Array, *, transposed: bool = False) -> Array:
        """Return solutions, of the matrices or of the transposed ones, shape (n, LANES)."""
        found = aligned(b.size).reshape(b.shape)
        found[:] = b
        name, first, last = (
            ("scatter", self._upper, self._lower)
            if transposed
            else ("gather", self._lower, self._upper)
        )
        run, n, there = _code().calls[name], self.n, address(found)
        run(n, 0, 1, *first, there)
        run(n, n - 1, -1, *last, there)
        return found

    @property
    def odd(self) -> NDArray[np.bool_]:
        """Whether the number of negative pivots of each matrix is odd."""
        return np.signbit(self._signs)


def _filled(rows: NDArray[np.intp], columns: NDArray[np.intp], n: int) -> list[set[int]]:
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
def _code() -> Code:
    def text() -> str:
        return "\n".join([_factor(), _sweep("gather"), _sweep("scatter"), declarations(LANES)])

    return load("fixed order", text, {"factor": 10, "gather": 9, "scatter": 9})


class _Loop(Lines):
    """Lines with tables of integers and of vectors."""

    def place(self, table: str, at: str) -> str:
        """Return an integer of a table."""
        return self.assign(f"load i64, ptr {self.number(table, at)}, align 8")

    def at(self, table: str, row: str) -> str:
        """Return the address of a vector of a table."""
        return self.let(f"getelementptr {self.vector}, ptr {table}, i64 {row}")

    def load(self, table: str, row: str) -> str:
        """Return a vector of a table."""
        return self.assign(f"load {self.vector}, ptr {self.at(table, row)}, align 8")

    def store(self, value: str, table: str, row: str) -> None:
        """Set a vector of a table."""
        self.lines.append(f"store {self.vector} {value}, ptr {self.at(table, row)}, align 8")

    def less(self, a: str, b: str, c: str) -> str:
        """Return c - a b."""
        return self.fused("fnma", a, b, c)


def _factor() -> str:
    """Return row by row (Doolittle): a row of the matrix less the rows above it."""
    row, copy, by, less, back, end = (
        _Loop(LANES, name) for name in ("row", "copy", "by", "less", "back", "end")
    )
    first, pivot = row.place("%starts", "%i"), row.place("%pivots", "%i")
    stop = row.place("%starts", row.sum("%i", 1))
    copy.store(
        copy.load("%given", copy.place("%sources", "%p")), "%work", copy.place("%columns", "%p")
    )
    k = by.place("%columns", "%l")
    multiplier = by.arithmetic("*", by.load("%work", k), by.load("%inverse", k))
    by.store(multiplier, "%work", k)
    largest = by.call("maximum", "%growth_now", by.call("fabs", multiplier))
    above, above_end = by.sum(by.place("%pivots", k), 1), by.place("%starts", by.sum(k, 1))
    j = less.place("%columns", "%u")
    less.store(less.less(multiplier, less.load("%table", "%u"), less.load("%work", j)), "%work", j)
    back.store(back.load("%work", back.place("%columns", "%q")), "%table", "%q")
    inverse = end.arithmetic("/", end.constant(1.0), end.load("%work", "%i"))
    end.store(inverse, "%inverse", "%i")
    longest = end.call("maximum", "%inverse_row", end.call("fabs", inverse))
    # the sign bits of all pivots: those of the other bits have no meaning
    words = f"<{LANES} x i64>"
    bits = end.let(f"bitcast {end.vector} {inverse} to {words}")
    signs = end.let(f"xor {words} {bits}, %signs_row")
    done = _Loop(LANES, "done")
    for k, value in enumerate(("%growth_now", longest)):
        done.store(value, "%growth", str(k))
    done.lines.append(f"store {words} {signs}, ptr {done.at('%growth', '2')}, align 8")
    places = "ptr %starts, ptr %pivots, ptr %columns, ptr %sources"
    numbers = "ptr %given, ptr %table, ptr %inverse, ptr %work, ptr %growth"
    return f"""define void @factor(i64 %n, {places}, {numbers}) {{
entry:
  br label %row
row:
  %i = phi i64 [0, %entry], [%i_next, %end]
  %growth_row = phi {row.vector} [zeroinitializer, %entry], [%growth_now, %end]
  %inverse_row = phi {row.vector} [zeroinitializer, %entry], [{longest}, %end]
  %signs_row = phi {words} [zeroinitializer, %entry], [{signs}, %end]
  {row.text}
  br label %copy
copy:
  %p = phi i64 [{first}, %row], [%p_next, %copy]
  {copy.text}
  %p_next = add i64 %p, 1
  %p_more = icmp slt i64 %p_next, {stop}
  br i1 %p_more, label %copy, label %below
below:
  %l = phi i64 [{first}, %copy], [%l_next, %by_end]
  %growth_now = phi {row.vector} [%growth_row, %copy], [{largest}, %by_end]
  %l_more = icmp slt i64 %l, {pivot}
  br i1 %l_more, label %by, label %back
by:
  {by.text}
  br label %update
update:
  %u = phi i64 [{above}, %by], [%u_next, %less]
  %u_more = icmp slt i64 %u, {above_end}
  br i1 %u_more, label %less, label %by_end
less:
  {less.text}
  %u_next = add i64 %u, 1
  br label %update
by_end:
  %l_next = add i64 %l, 1
  br label %below
back:
  %q = phi i64 [{first}, %below], [%q_next, %back]
  {back.text}
  %q_next = add i64 %q, 1
  %q_more = icmp slt i64 %q_next, {stop}
  br i1 %q_more, label %back, label %end
end:
  {end.text}
  %i_next = add i64 %i, 1
  %i_more = icmp slt i64 %i_next, %n
  br i1 %i_more, label %row, label %done
done:
  {done.text}
  ret void
}}
"""


def _sweep(name: str) -> str:
    """Return a substitution over the rows, up or down: each gathers what the rows before it give,
    or scatters what it gives to those after it.
    """
    row, run, end, gathers = _Loop(LANES, "row"), _Loop(LANES, "run"), _Loop(LANES, "end"), False
    gathers = name == "gather"
    first, stop = row.place("%begins", "%i"), row.place("%ends", "%i")
    own, scale = row.load("%b", "%i"), row.load("%scale", "%i")
    x = own if gathers else row.arithmetic("*", own, scale)
    if not gathers:
        row.store(x, "%b", "%i")
    column, entry = run.place("%columns", "%p"), run.load("%table", "%p")
    other = run.load("%b", column)
    found = run.less(entry, other if gathers else x, "%x" if gathers else other)
    if gathers:
        end.store(end.arithmetic("*", "%x", scale), "%b", "%i")
    else:
        run.store(found, "%b", column)
    head = "ptr %begins, ptr %ends, ptr %columns, ptr %table, ptr %scale, ptr %b"
    return f"""define void @{name}(i64 %n, i64 %start, i64 %step, {head}) {{
entry:
  br label %row
row:
  %k = phi i64 [0, %entry], [%k_next, %end]
  %i = phi i64 [%start, %entry], [%i_next, %end]
  {row.text}
  br label %next
next:
  %p = phi i64 [{first}, %row], [%p_next, %run]
  %x = phi {row.vector} [{x}, %row], [{found}, %run]
  %p_more = icmp slt i64 %p, {stop}
  br i1 %p_more, label %run, label %end
run:
  {run.text}
  %p_next = add i64 %p, 1
  br label %next
end:
  {end.text}
  %i_next = add i64 %i, %step
  %k_next = add i64 %k, 1
  %k_more = icmp slt i64 %k_next, %n
  br i1 %k_more, label %row, label %done
done:
  ret void
}}
"""
