"""The elimination of a sparse matrix in a given order, as operations on rows of memory: every entry is a row, a vector of numbers.

No pivot is chosen, so that what is done is known before any number is: whether the order serves them is to be asked afterwards, of
the smallest pivot and the largest multiplier. Pivots of which none needs another are eliminated side by side.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .linked import Linker, Rows, Words


class FixedOrder:
    """Which entries the factors L and U have; they take the place of the matrix, L below a diagonal of ones.

    Args:
        rows, columns: of the entries of the matrix, in the order of elimination.
        n: rows of the matrix.

    Attributes:
        count: of all entries: first those of the matrix, then those that fill in.
        pivots: places of the diagonal of U among them.

    Raises:
        ValueError: a pivot is zero by structure in that order.
    """

    def __init__(self, rows: Sequence[int], columns: Sequence[int], n: int) -> None:
        self._given = self.count = len(rows)
        place: list[dict[int, int]] = [{} for _ in range(n)]
        holding: list[list[int]] = [[] for _ in range(n)]
        for at, (i, j) in enumerate(zip(rows, columns, strict=True)):
            place[i][j] = at
            holding[j].append(i)
        level, pivots = [0] * n, list[int]()
        below, above, updates = list[tuple[int, ...]](), list[tuple[int, ...]](), list[tuple[int, ...]]()
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
        self._level, self.pivots = np.array(level), np.array(pivots)
        # by the pivot they belong to: entries of L with their rows, those of U with theirs, and entries with what is taken from them
        self._below, self._above = (np.array(each, np.intp).reshape(-1, 3) for each in (below, above))
        self._updates = np.array(updates, np.intp).reshape(-1, 4)

    @property
    def multipliers(self) -> Rows:
        """Places of the entries of L among all."""
        return self._below[:, 2]

    def factor(self, link: Linker, matrix: Rows, entries: slice, inverse: slice, constants: tuple[int, int]) -> list[Words]:
        """Factor a matrix.

        Args:
            matrix: rows that hold its entries.
            entries, inverse: rows for those of the factors, and for the pivots' inverses.
            constants: a row of zeros, and one of ones.
        """
        at, (zero, one) = np.arange(entries.start, entries.stop), constants
        found = [link.operations("copy", at[: self._given], matrix), link.operations("copy", at[self._given :], zero)]
        every = self._levels(np.arange(len(self.pivots))), self._levels(self._below[:, 0]), self._levels(self._updates[:, 0])
        for pivots, below, updates in zip(*every, strict=True):
            found.append(link.operations("/", inverse.start + pivots, one, at[self.pivots[pivots]]))
            pivot, _, multiplier = self._below[below].T
            found.append(link.operations("*", at[multiplier], at[multiplier], inverse.start + pivot))
            _, updated, multiplier, other = self._updates[updates].T
            found.append(link.operations("fnma", at[updated], at[multiplier], at[other], at[updated]))
        return found

    def solve(self, link: Linker, entries: slice, inverse: slice, right: slice) -> list[Words]:
        """Solve for what stands in the rows `right`, in the order of elimination."""
        found: list[Words] = []

        def less(of: Rows) -> None:
            pivot, row, at = of.T
            found.append(link.operations("fnma", right.start + row, entries.start + at, right.start + pivot, right.start + row))

        for below in self._levels(self._below[:, 0]):
            less(self._below[below])
        for pivots, above in reversed(
            [*zip(self._levels(np.arange(len(self.pivots))), self._levels(self._above[:, 0]), strict=True)]
        ):
            found.append(link.operations("*", right.start + pivots, right.start + pivots, inverse.start + pivots))
            less(self._above[above])
        return found

    def _levels(self, pivots: Rows) -> list[Rows]:
        """Which belong to pivots of each level, in order."""
        level = self._level[pivots]
        order = np.argsort(level, kind="stable")
        return np.split(order, np.searchsorted(level[order], np.arange(1, self._level.max(initial=0) + 1)))
