"""Large sparse matrices: factors by SuperLU, and their blocks.

The columns are in COLAMD's order. Times for a ring of N spatial loops, without any decomposition,
and a chain (least of 15, one Zen 4 core, N = 1,000, ring and chain): COLAMD 2.4 and 1.7 ms, minimum
degree of A^T A 3.0 and 1.6, reverse Cuthill-McKee of the bodies 2.9 and 1.5. Minimum degree of
A + A^T is unsuitable for these matrices, whose diagonals have no meaning: it took 1.6 s.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from ...caches import keep_last
from ...trajectory import Array
from .degrees_of_freedom import NARROW, Indices


class SingularError(ArithmeticError):
    """The matrix cannot be factored."""


class Pattern:
    """A square pattern of entries."""

    def __init__(self, rows: Indices, columns: Indices, n: int) -> None:
        sparse: Any = importlib.import_module("scipy.sparse")
        self._splu: Any = importlib.import_module("scipy.sparse.linalg").splu
        self._matrix = sparse.csc_matrix(
            (np.arange(len(rows)) + 0.0, (rows, columns)), shape=(n, n)
        )
        self._entries = self._matrix.data.astype(np.intp)

    def factor(self, values: Array) -> Factors:
        """Return the factors of a matrix of these entries.

        Raises:
            SingularError: the matrix is singular, or digits are lost in the elimination.
        """
        self._matrix.data[:] = values[self._entries]
        try:
            return Factors(self._splu(self._matrix, permc_spec="COLAMD", **NARROW))
        except RuntimeError as error:
            # the second message means a loss of digits in the elimination
            if any(said in str(error) for said in ("singular", "failed to factorize")):
                raise SingularError("exactly singular") from error
            raise


class Factors:
    """The factors of a square matrix, as SuperLU has them."""

    def __init__(self, factors: Any) -> None:
        self._factors = factors

    @property
    def entries(self) -> int:
        """The number of entries of both factors together."""
        return self._factors.nnz

    def solve(self, b: Array) -> Array:
        """Solve for a right-hand side."""
        return self._factors.solve(b)

    def solve_transposed(self, b: Array) -> Array:
        """Solve with the transposed matrix."""
        return self._factors.solve(b, "T")

    @property
    def sign(self) -> float:
        """The sign of the determinant, or for all values of a pattern the opposite: its columns are
        always in the same order.
        """
        odd = np.count_nonzero(self._factors.U.diagonal() < 0.0)
        odd += _exchanges(self._factors.perm_r.tobytes())
        return -1.0 if odd % 2 else 1.0


class Blocks:
    """The blocks of a pattern to be solved one after the other.

    Attributes:
        count: number of blocks.
    """

    def __init__(self, rows: Indices, columns: Indices, n: int) -> None:
        sparse, graphs = (
            importlib.import_module(name) for name in ("scipy.sparse", "scipy.sparse.csgraph")
        )
        pattern = sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=(n, n))
        row_of: Indices = graphs.maximum_bipartite_matching(pattern, perm_type="row")
        needs = sparse.csr_array((np.ones(len(rows)), (rows, row_of[columns])), shape=(n, n))
        self.count, self._of_rows = graphs.connected_components(
            needs, directed=True, connection="strong"
        )
        self._of_columns = self._of_rows[row_of]
        self._inside = np.flatnonzero(self._of_rows[rows] == self._of_columns[columns])
        self._pattern = Pattern(rows[self._inside], columns[self._inside], n)
        self._start = np.random.default_rng(0).normal(size=n)

    def sigmas(self, values: Array) -> tuple[Array, float]:
        """Return an estimate of the smallest singular value of each block, and the sign of the
        determinant, for entries of the pattern.

        The estimate is by a step of inverse iteration: of one row exact, else never smaller, and
        closer the more singular a block is.

        Raises:
            SingularError: a block is singular.
        """
        factors = self._pattern.factor(values[self._inside])
        left = factors.solve_transposed(self._start)
        right = factors.solve(left)
        sizes = (
            np.sqrt(np.bincount(of, x**2))
            for of, x in ((self._of_rows, left), (self._of_columns, right))
        )
        return np.divide(*sizes), factors.sign


@keep_last(64)
def _exchanges(content: bytes) -> int:
    """Return the number of exchanges that a permutation takes: its length less its cycles.

    Neighbouring poses mostly have the same.
    """
    permutation = np.frombuffer(content, np.intc)
    n = len(permutation)
    sparse, graphs = (
        importlib.import_module(name) for name in ("scipy.sparse", "scipy.sparse.csgraph")
    )
    graph = sparse.csr_matrix((np.ones(n), permutation, np.arange(n + 1)), shape=(n, n))
    return n - int(graphs.connected_components(graph, directed=False, return_labels=False))
