"""Dense cores of an elimination, as traced operations.

Partial pivoting is by compare-and-select, so every lane pivots for itself without a branch.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add

from ..algebra import Scalar, is_literal_zero
from .tape import absolute, maximum, where_larger

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
                v[k], v[i] = (
                    where_larger(larger, other, v[i], v[k]),
                    where_larger(larger, other, v[k], v[i]),
                )
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
                v[k], v[i] = (
                    where_larger(larger, other, v[i], v[k]),
                    where_larger(larger, other, v[k], v[i]),
                )
        for i, known, value in zip(self.rows, self.before, v, strict=True):
            y[i] = value
            for j, entry in known:
                c[j] = c[j] - entry * value
