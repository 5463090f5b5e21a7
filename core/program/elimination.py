"""Gaussian elimination as traced operations, with the literal zeros and ones of the rows used up.

Rows and columns form a block-triangular matrix: blocks are solved one after the other (a chain of
loops costs its number of loops), and no pivot connects two blocks. The first pivots are those
without risk: literal constants of size one half or more (the +-I blocks of the simplified rows),
and entries alone in their row or column (there is no other choice). The rest of each block is a
small dense `Core`. Its partial pivoting is by compare-and-select, so every lane pivots for itself
without a branch. Rejected: a fixed pivot order without this; it met an exact zero pivot within one
crank turn of a four-bar.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from operator import add, mul

import numpy as np

from ..algebra import Scalar, is_literal_zero
from .tape import Traced, absolute, maximum, minimum, where_larger

# Larger cores are not judged by their comparison matrix.
COMPARED = 16


@dataclass(frozen=True)
class _CoreStep:
    """Elimination of one column of a core.

    Attributes:
        exchanges: row compared with the pivot row, and the two compared entries.
        multipliers: row and its multiplier.
    """

    exchanges: tuple[tuple[int, Scalar, Scalar], ...]
    multipliers: tuple[tuple[int, Scalar], ...]


class Core:
    """A dense block of rows and columns; its other entries belong to columns solved before it."""

    def __init__(
        self, entries: Sequence[Mapping[int, Scalar]], rows: Sequence[int], columns: Sequence[int]
    ) -> None:
        self.rows = list(rows)
        # columns with few entries first: fewer exchanges to decide
        self.columns = sorted(columns, key=lambda j: sum(j in entries[i] for i in rows))
        inside = set(columns)
        self.before = [[(j, x) for j, x in entries[i].items() if j not in inside] for i in rows]
        self.matrix: list[list[Scalar]] = [
            [entries[i].get(j, 0.0) for j in self.columns] for i in rows
        ]
        self.pivots: list[Scalar] = []
        self.steps = [self._eliminate(k) for k in range(len(rows))]
        self.inverses = [1.0 / self.matrix[k][k] for k in range(len(rows))]

    def _eliminate(self, k: int) -> _CoreStep:
        matrix, size = self.matrix, len(self.rows)
        exchanges, multipliers = list[tuple[int, Scalar, Scalar]](), list[tuple[int, Scalar]]()
        for i in range(k + 1, size):
            x, y = matrix[i][k], matrix[k][k]
            if is_literal_zero(x):
                continue
            exchanges.append((i, x, y))
            upper, lower = matrix[k], matrix[i]
            matrix[k] = [
                *upper[:k],
                *(where_larger(x, y, b, a) for a, b in zip(upper[k:], lower[k:], strict=True)),
            ]
            matrix[i] = [
                *lower[:k],
                *(where_larger(x, y, a, b) for a, b in zip(upper[k:], lower[k:], strict=True)),
            ]
        if is_literal_zero(matrix[k][k]):
            raise ZeroDivisionError(
                "the matrix is singular whatever the pose: a column of the core is empty"
            )
        self.pivots.append(matrix[k][k])
        inverse = 1.0 / matrix[k][k]
        for i in range(k + 1, size):
            if not is_literal_zero(matrix[i][k]):
                factor = matrix[i][k] * inverse
                multipliers.append((i, factor))
                matrix[i] = [
                    *matrix[i][: k + 1],
                    *(matrix[i][c] - factor * matrix[k][c] for c in range(k + 1, size)),
                ]
        return _CoreStep(tuple(exchanges), tuple(multipliers))

    @property
    def least_stretch(self) -> Scalar:
        """One over the largest column sum of the inverse of U, or over its bound for large cores.

        For cores up to order `COMPARED` the inverse of the comparison matrix gives the bound: the
        largest sum over all signs of the entries (Higham, Accuracy and Stability of Numerical
        Algorithms, 8.3). For a larger core this bound may be thousands of times too large.
        """
        reach = self._column_sums() if len(self.rows) > COMPARED else self._bounds_of_column_sums()
        return 1.0 / reduce(maximum, reach)

    def _bounds_of_column_sums(self) -> list[Scalar]:
        reach = list[Scalar]()
        for k, inverse in enumerate(self.inverses):
            above = (
                absolute(self.matrix[i][k]) * reach[i]
                for i in range(k)
                if not is_literal_zero(self.matrix[i][k])
            )
            reach.append(sum(above, 1.0) * absolute(inverse))
        return reach

    def _column_sums(self) -> Iterator[Scalar]:
        for k, inverse in enumerate(self.inverses):
            column: dict[int, Scalar] = {k: inverse}
            for i in reversed(range(k)):
                terms = (
                    self.matrix[i][c] * x
                    for c, x in column.items()
                    if not is_literal_zero(self.matrix[i][c])
                )
                value = reduce(add, terms, 0.0) * self.inverses[i]
                if not is_literal_zero(value):
                    column[i] = -value
            yield reduce(add, map(absolute, column.values()))

    def solve(self, b: Sequence[Scalar], x: list[Scalar]) -> None:
        """Write the solution of this block into x."""
        v = [b[i] for i in self.rows]
        for k, known in enumerate(self.before):
            for j, entry in known:
                v[k] = v[k] - entry * x[j]
        for k, step in enumerate(self.steps):
            for i, larger, other in step.exchanges:
                v[k], v[i] = _exchange(larger, other, v[k], v[i])
            for i, factor in step.multipliers:
                v[i] = v[i] - factor * v[k]
        for k in reversed(range(len(v))):
            for c in range(k + 1, len(v)):
                v[k] = v[k] - self.matrix[k][c] * v[c]
            v[k] = v[k] * self.inverses[k]
        for j, value in zip(self.columns, v, strict=True):
            x[j] = value

    def solve_transposed(self, c: list[Scalar], y: list[Scalar]) -> None:
        """Write the solution of the transposed block into y; take its part of earlier blocks off
        c.
        """
        v = [c[j] for j in self.columns]
        for k in range(len(v)):
            v[k] = v[k] * self.inverses[k]
            for j in range(k + 1, len(v)):
                v[j] = v[j] - self.matrix[k][j] * v[k]
        for k, step in reversed([*enumerate(self.steps)]):
            for i, factor in step.multipliers:
                v[k] = v[k] - factor * v[i]
            for i, larger, other in reversed(step.exchanges):
                v[k], v[i] = _exchange(larger, other, v[k], v[i])
        for i, known, value in zip(self.rows, self.before, v, strict=True):
            y[i] = value
            for j, entry in known:
                c[j] = c[j] - entry * value


def _exchange(x: Scalar, y: Scalar, a: Scalar, b: Scalar) -> tuple[Scalar, Scalar]:
    """Return a and b, exchanged where x is larger than y."""
    return where_larger(x, y, b, a), where_larger(x, y, a, b)


SAFE_LITERAL = 0.5
# Signs of more blocks share digits: as digits of a double they are exact up to this number.
DIGITS = 50


@dataclass(frozen=True)
class _Pivot:
    row: int
    column: int
    inverse: Scalar
    multipliers: tuple[tuple[int, Scalar], ...]
    rest: tuple[tuple[int, Scalar], ...]


def _sign(x: Scalar) -> Scalar:
    return where_larger(x + absolute(x), 0.0, 1.0, -1.0)


class Elimination:
    """A factored matrix. `pivots` are the traced ones; a small one means a nearly singular matrix.
    `cores` are what is left without sparse pivots, dense blocks.

    Args:
        rows: the square matrix, each row a mapping column -> entry without zeros.
    """

    def __init__(self, rows: Sequence[Mapping[int, Scalar]]) -> None:
        self.n = len(rows)
        self.pivots: list[Scalar] = []
        self._alone: list[tuple[int, Scalar]] = []  # traced pivots outside cores, with their rows
        self._block_of_row: dict[int, int] = {}
        entries = [dict(row) for row in rows]
        self._sparse = self._eliminate_sparse(entries)
        done_rows = {pivot.row for pivot in self._sparse}
        left_rows = [i for i in range(self.n) if i not in done_rows]
        self.cores = [Core(entries, *block) for block in _blocks(entries, left_rows)]
        for core in self.cores:
            self.pivots += core.pivots

    @property
    def sigma(self) -> Scalar:
        """Estimate of the smallest singular value, at most one: the minimum over all blocks."""
        return reduce(minimum, self.sigmas)

    @cached_property
    def sigmas(self) -> Sequence[Scalar]:
        """The same estimate of each block with traced pivots, at most one; a single one if there is
        none.

        It is the least stretch of the cores' upper triangles, and at most any pivot. The smallest
        pivot alone may stay constant while the matrix becomes singular: two rows of small pivots,
        connected by a large entry. Entries of the lower triangles are at most one and add little.
        """
        found = dict[int, Scalar]()
        sizes = [(row, absolute(x)) for row, x in self._alone] + [
            (core.rows[0], core.least_stretch) for core in self.cores
        ]
        for row, size in sizes:
            block = self._block_of_row[row]
            found[block] = minimum(found.get(block, 1.0), size)
        return [*found.values()] or [1.0]

    @property
    def orientation(self) -> Scalar:
        """Signs of the blocks' determinants as digits of one number, exact in all lanes.

        The sign of the whole determinant is not sufficient: two equal loops, singular at the same
        pose, change it twice.
        """
        signs = list(self._signs())
        digits = [reduce(mul, signs[k::DIGITS]) for k in range(min(DIGITS, len(signs)))]
        return sum((2.0**k * digit for k, digit in enumerate(digits)), 0.0)

    def determinant(self, per_pivot: float) -> Scalar:
        """Return the size of the determinant but for a constant; each pivot is multiplied by a
        number, so that the product stays in the range of floats.
        """
        return reduce(mul, (per_pivot * absolute(x) for x in self.pivots), 1.0)

    def _signs(self) -> Iterator[Scalar]:
        for _, x in self._alone:
            yield _sign(x)
        for core in self.cores:
            exchanged = (
                where_larger(x, y, -1.0, 1.0) for step in core.steps for _, x, y in step.exchanges
            )
            yield reduce(mul, exchanged, reduce(mul, (_sign(x) for x in core.pivots)))

    def _eliminate_sparse(self, entries: list[dict[int, Scalar]]) -> list[_Pivot]:
        rows, steps = set(range(self.n)), list[_Pivot]()
        block_of_row, block_of_column = self._block_of_row, dict[int, int]()
        for k, (block_rows, block_columns) in enumerate(_blocks(entries, range(self.n))):
            block_of_row |= dict.fromkeys(block_rows, k)
            block_of_column |= dict.fromkeys(block_columns, k)
        columns: dict[int, set[int]] = {j: set() for j in range(self.n)}
        for i, row in enumerate(entries):
            for j in row:
                columns[j].add(i)
        while (
            found := _safe_pivot(
                entries, rows, columns, lambda i, j: block_of_row[i] == block_of_column[j]
            )
        ) is not None:
            i, j = found
            if isinstance(entries[i][j], Traced):
                self.pivots.append(entries[i][j])
                self._alone.append((i, entries[i][j]))
            inverse = 1.0 / entries[i].pop(j)
            rest = tuple(entries[i].items())
            multipliers = list[tuple[int, Scalar]]()
            for x in sorted(columns.pop(j) - {i}):
                factor = entries[x].pop(j) * inverse
                multipliers.append((x, factor))
                for y, value in rest:
                    new = entries[x].get(y, 0.0) - factor * value
                    if is_literal_zero(new):
                        entries[x].pop(y, None)
                        columns[y].discard(x)
                    else:
                        entries[x][y] = new
                        columns[y].add(x)
            rows.remove(i)
            for y, _ in rest:
                columns[y].discard(i)
            steps.append(_Pivot(i, j, inverse, tuple(multipliers), rest))
        return steps

    def solve(self, b: Sequence[Scalar]) -> list[Scalar]:
        """Return the solution x for right-hand side b; literal zeros of b cost nothing."""
        b, x = list(b), [0.0] * self.n
        for pivot in self._sparse:
            if not is_literal_zero(b[pivot.row]):
                for i, factor in pivot.multipliers:
                    b[i] = b[i] - factor * b[pivot.row]
        for core in self.cores:
            core.solve(b, x)
        for pivot in reversed(self._sparse):
            value = b[pivot.row]
            for j, entry in pivot.rest:
                value = value - entry * x[j]
            x[pivot.column] = value * pivot.inverse
        return x

    def solve_transposed(self, c: Sequence[Scalar]) -> list[Scalar]:
        """Return the solution y of the transposed system, by rows; literal zeros of c cost nothing.

        These are the steps of `solve`, transposed, in reverse order.
        """
        c, y = list(c), [0.0] * self.n
        for pivot in self._sparse:
            y[pivot.row] = value = c[pivot.column] * pivot.inverse
            for j, entry in pivot.rest:
                c[j] = c[j] - entry * value
        for core in reversed(self.cores):
            core.solve_transposed(c, y)
        for pivot in reversed(self._sparse):
            for i, factor in pivot.multipliers:
                y[pivot.row] = y[pivot.row] - factor * y[i]
        return y


def _blocks(
    entries: Sequence[Mapping[int, Scalar]], rows: Sequence[int]
) -> list[tuple[list[int], list[int]]]:
    """Return rows and columns of the blocks; each block needs only earlier ones."""
    # scipy.sparse.csgraph has this, but its import takes longer than all other imports here
    row_of = _match({i: list(entries[i]) for i in rows})
    column_of = {i: j for j, i in row_of.items()}
    place = {i: k for k, i in enumerate(rows)}
    needs = np.eye(len(rows))
    for i in rows:
        needs[place[i], [place[row_of[j]] for j in entries[i]]] = 1.0
    for _ in range(len(rows).bit_length()):  # paths of twice the length
        needs = np.minimum(needs @ needs, 1.0)
    found: dict[bytes, list[int]] = {}
    # a block needs more columns than each of its prerequisites
    order: list[int] = np.argsort(needs.sum(axis=1), kind="stable").tolist()
    for k in order:
        found.setdefault((needs[k] * needs[:, k]).tobytes(), []).append(rows[k])
    return [(block, sorted(column_of[i] for i in block)) for block in found.values()]


def _match(columns: Mapping[int, Sequence[int]]) -> dict[int, int]:
    """Return the matched row of each column, from the columns of each row (Kuhn's augmenting
    paths).
    """
    row_of: dict[int, int] = {}

    def place(i: int, seen: set[int]) -> bool:
        for j in columns[i]:
            if j not in seen:
                seen.add(j)
                if j not in row_of or place(row_of[j], seen):
                    row_of[j] = i
                    return True
        return False

    for i in columns:
        if not place(i, set()):
            raise ZeroDivisionError(
                "the matrix is singular whatever the pose: its rows cannot be matched with its"
                " columns"
            )
    return row_of


def _safe_pivot(
    entries: Sequence[Mapping[int, Scalar]],
    rows: set[int],
    columns: Mapping[int, set[int]],
    inside: Callable[[int, int], bool],
) -> tuple[int, int] | None:
    """Return the safe pivot inside a block with the least fill-in (Markowitz), or None."""
    best: tuple[int, int, int] | None = None
    for i in sorted(rows):
        in_row = len(entries[i])
        for j, value in entries[i].items():
            in_column = len(columns[j])
            alone = in_row == 1 or in_column == 1
            if (alone or (not isinstance(value, Traced) and abs(value) >= SAFE_LITERAL)) and inside(
                i, j
            ):
                cost = (in_row - 1) * (in_column - 1)
                if best is None or cost < best[0]:
                    best = (cost, i, j)
    return None if best is None else best[1:]
