"""A large sparse matrix of fixed pattern, factored by SuperLU in an order found once.

The order is COLAMD's, with the row pivots of the first factorisation. Times in a given order for a
ring of N spatial loops, without any decomposition, and a chain (least of 15, one Zen 4 core, N =
1,000, ring and chain): COLAMD 2.4 and 1.7 ms, minimum degree of A^T A 3.0 and 1.6, reverse
Cuthill-McKee of the bodies 2.9 and 1.5. COLAMD wins on the ring, the critical case; a new order at
every factorisation costs a quarter more. Minimum degree of A + A^T is unsuitable for these
matrices, whose diagonals have no meaning: it took 1.6 s.
"""

from __future__ import annotations

import importlib
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...trajectory import Array

Indices = NDArray[np.intp]
# Supernodes of these matrices are a few columns wide; SuperLU's own settings (10 and 20) double the
# time.
NARROW = {"relax": 4, "panel_size": 4}
# Smallest pivot relative to the largest entry of its column: rows keep the order found first.
PIVOT_THRESHOLD = 0.1


class SingularError(ArithmeticError):
    """The matrix cannot be factored."""


class Ordered(NamedTuple):
    """A pattern in an order of elimination.

    Attributes:
        rows, columns: of the entries.
        row, column: position of every original row and column.
    """

    rows: Indices
    columns: Indices
    row: Indices
    column: Indices


class Order:
    """A square pattern in an order of elimination, found at some values.

    Raises:
        SingularError: the matrix is singular at the values given.
    """

    def __init__(self, rows: Indices, columns: Indices, values: Array, n: int) -> None:
        sparse: Any = importlib.import_module("scipy.sparse")
        self._splu: Any = importlib.import_module("scipy.sparse.linalg").splu
        first = self._factored(
            sparse.csc_matrix((values, (rows, columns)), shape=(n, n)), permc_spec="COLAMD"
        )
        self.row: Indices = first.perm_r
        self.column: Indices = first.perm_c
        numbered = sparse.csc_matrix(
            (np.arange(len(values)) + 1.0, (self.row[rows], self.column[columns])), shape=(n, n)
        )
        numbered.sort_indices()
        self._entries: Indices = numbered.data.astype(np.intp) - 1
        self._matrix, self._rows, self._columns = numbered, rows, columns

    def _factored(self, matrix: Any, **options: Any) -> Any:
        try:
            return self._splu(matrix, diag_pivot_thresh=PIVOT_THRESHOLD, **NARROW, **options)
        except RuntimeError as error:
            # the second message means a loss of digits in the elimination
            if any(said in str(error) for said in ("singular", "failed to factorize")):
                raise SingularError("exactly singular") from error
            raise

    def places(self, factors: Factors) -> Ordered:
        """Return the pattern in the order of factors, with the rows that they exchanged."""
        row, column = factors.row[self.row], factors.column[self.column]
        return Ordered(row[self._rows], column[self._columns], row, column)

    def factor(self, values: Array) -> Factors:
        """Return the factors of a matrix, its entries in the original order.

        Raises:
            SingularError: the matrix is singular.
        """
        self._matrix.data[:] = values[self._entries]
        return Factors(self._factored(self._matrix, permc_spec="NATURAL"), self.row, self.column)


class Factors:
    """The factors of a square matrix.

    Args:
        factors: as SuperLU has them.
        row, column: place of every original row and column in the order of elimination.
    """

    def __init__(self, factors: Any, row: Indices, column: Indices) -> None:
        self._factors, self._row, self._column = factors, row, column

    @property
    def row(self) -> Indices:
        """Places of the rows after exchanges."""
        return self._factors.perm_r

    @property
    def column(self) -> Indices:
        """Places of the columns."""
        return self._factors.perm_c

    @cached_property
    def signed_pivot(self) -> float:
        """The smallest pivot, with the sign of the determinant or always its opposite."""
        diagonal = self._factors.U.diagonal()
        odd = np.count_nonzero(diagonal < 0.0) + len(diagonal) - _cycles(self._factors.perm_r)
        smallest = float(np.abs(diagonal).min())
        return -smallest if odd % 2 else smallest

    @property
    def log_determinant(self) -> float:
        """The logarithm of the determinant's absolute value."""
        return float(np.log(np.abs(self._factors.U.diagonal())).sum())

    @property
    def entries(self) -> int:
        """The number of entries of both factors together."""
        return self._factors.nnz

    def solve(self, b: Array) -> Array:
        """Solve for a right-hand side."""
        placed = np.empty_like(b)
        placed[self._row] = b
        return self._factors.solve(placed)[self._column]

    def solve_transposed(self, b: Array) -> Array:
        """Solve with the transposed matrix."""
        placed = np.empty_like(b)
        placed[self._column] = b
        return self._factors.solve(placed, "T")[self._row]


def _cycles(permutation: Indices) -> int:
    """Return the number of cycles of a permutation; n less this is its number of exchanges."""
    n = len(permutation)
    if (permutation == np.arange(n)).all():
        return n
    sparse, graphs = (
        importlib.import_module(name) for name in ("scipy.sparse", "scipy.sparse.csgraph")
    )
    graph = sparse.csr_matrix((np.ones(n), permutation, np.arange(n + 1)), shape=(n, n))
    return int(graphs.connected_components(graph, directed=False, return_labels=False))
