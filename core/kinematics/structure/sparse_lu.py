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


class Ordered(NamedTuple):
    """A pattern in an order of elimination.

    Attributes:
        rows, columns: of the entries, in that order.
        entries: their indices among the original entries.
        row, column: position of every original row and column.
    """

    rows: Indices
    columns: Indices
    entries: Indices
    row: Indices
    column: Indices


class SingularError(ArithmeticError):
    """The matrix cannot be factored."""


class Factors:
    """A square matrix and its factors, which are outdated from an update to the next factorisation.

    Raises:
        SingularError: the matrix is singular at the values given.
    """

    def __init__(self, rows: Indices, columns: Indices, values: Array, n: int) -> None:
        sparse: Any = importlib.import_module("scipy.sparse")
        self._splu: Any = importlib.import_module("scipy.sparse.linalg").splu
        first = self._factored(
            sparse.csc_matrix((values, (rows, columns)), shape=(n, n)), permc_spec="COLAMD"
        )
        self._row: Indices = first.perm_r
        self._column: Indices = first.perm_c
        numbered = sparse.csc_matrix(
            (np.arange(len(values)) + 1.0, (self._row[rows], self._column[columns])), shape=(n, n)
        )
        numbered.sort_indices()
        self._order: Indices = numbered.data.astype(np.intp) - 1
        self._matrix = numbered
        self.update(values)
        self.factor()

    def _factored(self, matrix: Any, **options: Any) -> Any:
        try:
            return self._splu(matrix, diag_pivot_thresh=PIVOT_THRESHOLD, **NARROW, **options)
        except RuntimeError as error:
            # the second message means a loss of digits in the elimination
            if any(said in str(error) for said in ("singular", "failed to factorize")):
                raise SingularError("exactly singular") from error
            raise

    @property
    def ordered(self) -> Ordered:
        """The entries in the order of the last factorisation."""
        factors, by_place = self._factors, self._matrix.tocoo()
        rows, columns = factors.perm_r[by_place.row], factors.perm_c[by_place.col]
        return Ordered(
            rows, columns, self._order, factors.perm_r[self._row], factors.perm_c[self._column]
        )

    def update(self, values: Array) -> None:
        """Set the matrix to other values, in the original order; the factors stay."""
        self._matrix.data[:] = values[self._order]

    def factor(self) -> None:
        """Factor the current matrix. Raises SingularError."""
        self._factors = self._factored(self._matrix, permc_spec="NATURAL")

    @property
    def signed_pivot(self) -> float:
        """The smallest pivot, with the sign of the determinant or always its opposite.

        The cost is half a factorisation. The smallest singular value, by a step of inverse
        iteration with these factors, is a better measure for a small matrix, but useless for a
        large one: for a regular chain of 60 planar loops it is 1e-23, because redundant rows are
        left out at one end.
        """
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
        """Solve for a right-hand side; outdated factors give an approximation."""
        placed = np.empty_like(b)
        placed[self._row] = b
        return self._factors.solve(placed)[self._column]

    def solve_transposed(self, b: Array) -> Array:
        """Solve with the transposed matrix; several right-hand sides are columns."""
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
