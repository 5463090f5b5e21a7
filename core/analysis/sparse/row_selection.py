"""Which rows of a large mechanism to solve for, and what moves where they are too few: nothing dense, nothing quadratic.

Rows that repeat others are found by the Cholesky pivots of J J^T, sparse and in a sparse order: the pivot of a row of length one is
its squared distance from the rows eliminated before it. A little is added to the diagonal, so that the elimination can go on after
a row that has none. Squares lose half the digits: that the rows kept are independent is for their own factorisation to say, which
has all of them. Refused for this: orthogonal factorisation, which scipy has dense only.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...trajectory import Array
from ..structure.factors import NARROW, Indices
from .elements import Elements

# Added to the squared length, one, of every row. A repeated row keeps this times the number of rows it repeats, well below the
# pivots of independent ones, and far above round-off.
LIFT = 1e-13


@dataclass(frozen=True, eq=False)
class Jacobian:
    """The entries of all rows at one pose."""

    rows: Indices
    columns: Indices
    values: Array
    shape: tuple[int, int]

    @staticmethod
    def of(elements: Elements) -> Jacobian:
        """As last evaluated."""
        shape = len(elements.phi), elements.numbering.unknowns
        return Jacobian(elements.rows, elements.columns, elements.entries.copy(), shape)

    def among(self, kept: Indices) -> Indices:
        """The row of each entry in the order of the rows kept; -1 in rows that are not."""
        place = np.full(self.shape[0], -1, np.intp)
        place[kept] = np.arange(len(kept))
        return place[self.rows]

    def independent(self, last: int) -> Indices:
        """As many rows as there are columns, the most independent of them; all where there are no more.

        Args:
            last: so many rows at the end (the drivers) are judged after all others, and not at their expense.
        """
        count, wanted = self.shape
        if count <= wanted:
            return np.arange(count)
        sparse, linear = _modules()
        lengths = np.sqrt(np.bincount(self.rows, self.values**2, count))
        J = sparse.csr_matrix((self.values / lengths[self.rows], (self.rows, self.columns)), shape=self.shape)
        gram = (J @ J.T + LIFT * sparse.identity(count)).tocsc()
        options: Any = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True, "Equil": False}, **NARROW}
        order = np.argsort(linear.splu(gram, permc_spec="COLAMD", **options).perm_c)
        order = np.concatenate([order[order < count - last], np.arange(count - last, count)])
        factors = linear.splu(gram[order][:, order].tocsc(), permc_spec="NATURAL", **options)
        distance = np.empty(count)
        # the order may still be changed to an equivalent one, rows and columns alike
        distance[order] = np.abs(factors.U.diagonal())[factors.perm_c]
        return np.sort(np.argsort(-distance, kind="stable")[:wanted])


def _modules() -> tuple[Any, Any]:
    return importlib.import_module("scipy.sparse"), importlib.import_module("scipy.sparse.linalg")
