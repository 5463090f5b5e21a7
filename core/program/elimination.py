"""Gaussian elimination written into a program: the zeros and ones of the rows are used up before anything is computed.

First the pivots that cost nothing in safety: literal constants of size one half and more (the +-I blocks of the simplified rows)
and entries that are alone in their row or column (there is no other choice). What is left is a small dense core, eliminated with
partial pivoting by compare-and-select, so that every lane pivots for itself without a branch. A fixed pivot order without this met
an exact zero pivot within one crank turn of a four-bar.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..algebra import Scalar
from .trace import Traced, where_larger

SAFE_LITERAL = 0.5


@dataclass(frozen=True)
class _Pivot:
    row: int
    column: int
    inverse: Scalar
    multipliers: tuple[tuple[int, Scalar], ...]
    rest: tuple[tuple[int, Scalar], ...]


@dataclass(frozen=True)
class _CoreStep:
    """One column of the core: exchanges (row against the pivot row, the two sizes compared) and then the multipliers."""

    exchanges: tuple[tuple[int, Scalar, Scalar], ...]
    multipliers: tuple[tuple[int, Scalar], ...]


def _is_zero(a: Scalar) -> bool:
    return not isinstance(a, Traced) and a == 0.0


class Elimination:
    """The factored matrix. `pivots` are the traced ones: where one is small the matrix is nearly singular.

    Args:
        rows: the square matrix, each row a mapping column -> entry without zeros.
    """

    def __init__(self, rows: Sequence[Mapping[int, Scalar]]) -> None:
        self.n = len(rows)
        self.pivots: list[Scalar] = []
        entries = [dict(row) for row in rows]
        self._sparse = self._eliminate_sparse(entries)
        done_rows = {pivot.row for pivot in self._sparse}
        done_columns = {pivot.column for pivot in self._sparse}
        self._core_rows = [i for i in range(self.n) if i not in done_rows]
        core_columns = [j for j in range(self.n) if j not in done_columns]
        # columns with few entries first: fewer exchanges to decide
        self._core_columns = sorted(core_columns, key=lambda j: sum(j in entries[i] for i in self._core_rows))
        self._core = [[entries[i].get(j, 0.0) for j in self._core_columns] for i in self._core_rows]
        self._core_steps = [self._eliminate_core_column(k) for k in range(len(self._core))]
        self._core_inverse = [1.0 / self._core[k][k] for k in range(len(self._core))]

    @property
    def core_size(self) -> int:
        """Order of the dense core that was left."""
        return len(self._core)

    def _eliminate_sparse(self, entries: list[dict[int, Scalar]]) -> list[_Pivot]:
        rows, steps = set(range(self.n)), list[_Pivot]()
        columns: dict[int, set[int]] = {j: set() for j in range(self.n)}
        for i, row in enumerate(entries):
            for j in row:
                columns[j].add(i)
        while (found := _safe_pivot(entries, rows, columns)) is not None:
            i, j = found
            if isinstance(entries[i][j], Traced):
                self.pivots.append(entries[i][j])
            inverse = 1.0 / entries[i].pop(j)
            rest = tuple(entries[i].items())
            multipliers = list[tuple[int, Scalar]]()
            for x in sorted(columns.pop(j) - {i}):
                factor = entries[x].pop(j) * inverse
                multipliers.append((x, factor))
                for y, value in rest:
                    new = entries[x].get(y, 0.0) - factor * value
                    if _is_zero(new):
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

    def _eliminate_core_column(self, k: int) -> _CoreStep:
        core, size = self._core, len(self._core)
        exchanges, multipliers = list[tuple[int, Scalar, Scalar]](), list[tuple[int, Scalar]]()
        for i in range(k + 1, size):
            x, y = core[i][k], core[k][k]
            if _is_zero(x):
                continue
            exchanges.append((i, x, y))
            upper, lower = core[k], core[i]
            core[k] = [*upper[:k], *(where_larger(x, y, b, a) for a, b in zip(upper[k:], lower[k:], strict=True))]
            core[i] = [*lower[:k], *(where_larger(x, y, a, b) for a, b in zip(upper[k:], lower[k:], strict=True))]
        self.pivots.append(core[k][k])
        if _is_zero(core[k][k]):
            raise ZeroDivisionError("the matrix is singular whatever the pose: a column of the core is empty")
        inverse = 1.0 / core[k][k]
        for i in range(k + 1, size):
            if not _is_zero(core[i][k]):
                factor = core[i][k] * inverse
                multipliers.append((i, factor))
                core[i] = [*core[i][: k + 1], *(core[i][c] - factor * core[k][c] for c in range(k + 1, size))]
        return _CoreStep(tuple(exchanges), tuple(multipliers))

    def solve(self, b: Sequence[Scalar]) -> list[Scalar]:
        """The solution x for right-hand side b; zeros of b cost nothing."""
        b, x = list(b), [0.0] * self.n
        for pivot in self._sparse:
            if not _is_zero(b[pivot.row]):
                for i, factor in pivot.multipliers:
                    b[i] = b[i] - factor * b[pivot.row]
        core = self._solve_core([b[i] for i in self._core_rows])
        for j, value in zip(self._core_columns, core, strict=True):
            x[j] = value
        for pivot in reversed(self._sparse):
            value = b[pivot.row]
            for j, entry in pivot.rest:
                value = value - entry * x[j]
            x[pivot.column] = value * pivot.inverse
        return x

    def _solve_core(self, v: list[Scalar]) -> list[Scalar]:
        for k, step in enumerate(self._core_steps):
            for i, x, y in step.exchanges:
                v[k], v[i] = where_larger(x, y, v[i], v[k]), where_larger(x, y, v[k], v[i])
            for i, factor in step.multipliers:
                v[i] = v[i] - factor * v[k]
        for k in reversed(range(len(v))):
            for c in range(k + 1, len(v)):
                v[k] = v[k] - self._core[k][c] * v[c]
            v[k] = v[k] * self._core_inverse[k]
        return v


def _safe_pivot(entries: Sequence[Mapping[int, Scalar]], rows: set[int], columns: Mapping[int, set[int]]) -> tuple[int, int] | None:
    """The safe pivot that fills in least (Markowitz), or None."""
    best: tuple[int, int, int] | None = None
    for i in sorted(rows):
        in_row = len(entries[i])
        for j, value in entries[i].items():
            in_column = len(columns[j])
            alone = in_row == 1 or in_column == 1
            if alone or (not isinstance(value, Traced) and abs(value) >= SAFE_LITERAL):
                cost = (in_row - 1) * (in_column - 1)
                if best is None or cost < best[0]:
                    best = (cost, i, j)
    return None if best is None else best[1:]
