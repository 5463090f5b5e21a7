"""Sparse LU factorisation in a fixed order, as operations on rows of memory; each entry is a row, a
vector of numbers.

No pivot is chosen at run time, so all operations are known before the numbers. A caller checks the
order afterwards by the smallest pivot and the largest multiplier. Independent pivots are eliminated
in the same stage.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .linker import Linker, Rows, Words, numbers


class FixedOrder:
    """Structure of the factors L and U, stored in place of the matrix; L has a diagonal of ones.

    Args:
        rows, columns: of the entries of the matrix, in the order of elimination.
        n: rows of the matrix.

    Attributes:
        count: number of entries: first those of the matrix, then the fill-in.
        pivots: positions of the diagonal of U among the entries.

    Raises:
        ValueError: a pivot is zero by structure in this order.
    """

    def __init__(self, rows: Sequence[int], columns: Sequence[int], n: int) -> None:
        self._given = self.count = len(rows)
        place: list[dict[int, int]] = [{} for _ in range(n)]
        holding: list[list[int]] = [[] for _ in range(n)]
        for at, (i, j) in enumerate(zip(rows, columns, strict=True)):
            place[i][j] = at
            holding[j].append(i)
        level, pivots = [0] * n, list[int]()
        below, above, updates = (
            list[tuple[int, ...]](),
            list[tuple[int, ...]](),
            list[tuple[int, ...]](),
        )
        for k in range(n):
            if k not in place[k]:
                raise ValueError(f"pivot {k} of {n} is zero by structure")
            pivots.append(place[k][k])
            right = [(j, at) for j, at in place[k].items() if j > k]
            later = [i for i in holding[k] if i > k]
            for other in (*later, *(j for j, _ in right)):
                level[other] = max(level[other], level[k] + 1)
            above += [(j, k, at) for j, at in right]
            for i in later:
                row = place[i]
                multiplier = row[k]
                below.append((k, i, multiplier))
                for j, entry in right:
                    at = row.get(j)
                    if at is None:
                        at = row[j] = self.count
                        holding[j].append(i)
                        self.count += 1
                    updates.append((k, at, multiplier, entry))
        self._level, self.pivots, self._last = (
            np.array(level),
            np.array(pivots),
            max(level, default=0),
        )
        # each with its pivot: entries of L with their rows, entries of U with theirs, and updated
        # entries with their two factors
        self._below, self._above = (
            np.array(each, np.intp).reshape(-1, 3).T for each in (below, above)
        )
        self._updates: Rows = np.array(updates, np.intp).reshape(-1, 4).T

    @property
    def multipliers(self) -> Rows:
        """Positions of the entries of L among all entries."""
        return self._below[2]

    def factor(
        self, link: Linker, matrix: Rows, entries: slice, inverse: slice, constants: tuple[int, int]
    ) -> list[Words]:
        """Return the tables of a factorisation.

        Args:
            matrix: rows of the matrix entries.
            entries, inverse: rows for the entries of the factors, and for the inverses of the
                pivots.
            constants: a row of zeros, and a row of ones.
        """
        at, inverses, (zero, one) = numbers(entries), numbers(inverse), constants
        (pivot, _, multiplier), (by, updated, factor, other) = self._below, self._updates
        elimination = link.staged(
            self._last + 1,
            ("/", self._level, (inverses, one, at[self.pivots])),
            ("*", self._level[pivot], (at[multiplier], at[multiplier], inverses[pivot])),
            ("fnma", self._level[by], (at[updated], at[factor], at[other], at[updated])),
        )
        return [
            link.operations("copy", at[: self._given], matrix),
            link.operations("copy", at[self._given :], zero),
            elimination,
        ]

    def solve(
        self,
        link: Linker,
        entries: slice,
        inverse: slice,
        right: slice,
        *,
        transposed: bool = False,
    ) -> list[Words]:
        """Return the tables of a solve, of the matrix or its transpose, in the rows `right`, in the
        order of elimination.
        """
        at, inverses = numbers(right), numbers(inverse)

        def less(of: tuple[Rows, Rows, Rows] | Rows) -> tuple[Rows, Rows, Rows, Rows]:
            pivot, row, entry = of
            return at[row], entries.start + entry, at[pivot], at[row]

        stages, back = self._last + 1, self._last - self._level
        if transposed:  # dependencies are reversed
            (j, i, upper), (k, below, lower) = self._above, self._below
            return [
                link.staged(
                    stages,
                    ("*", self._level, (at, at, inverses)),
                    ("fnma", self._level[i], less((i, j, upper))),
                ),
                link.staged(stages, ("fnma", back[below], less((below, k, lower)))),
            ]
        return [
            link.staged(stages, ("fnma", self._level[self._below[0]], less(self._below))),
            link.staged(
                stages,
                ("*", back, (at, at, inverses)),
                ("fnma", back[self._above[0]], less(self._above)),
            ),
        ]
