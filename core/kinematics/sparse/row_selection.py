"""Choice of the solved rows of a large mechanism: nothing dense, and nothing quadratic in many
redundant rows.

Redundancy shows in J J^T, sparse and in a sparse order, with a small addition to the diagonal so
that the elimination can continue after a row without a pivot. The inverse of this matrix turns any
vectors into null vectors of J^T: weights of sums of rows equal to zero. Pivoted QR of these vectors
(rank-revealing) selects the rows to leave out: those with most weight, so the kept ones are well
conditioned.

If redundant rows are many, the pivots themselves are used: the pivot of a row of length one is its
squared distance from the rows eliminated before it. The kept rows are independent, and may be badly
conditioned: in a chain of loops rows are left out at one end.

Squares lose half the digits: the factorisation of the kept rows, with all digits, decides on their
independence. Rejected: orthogonal factorisation of J, which scipy has for dense matrices only.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...trajectory import Array
from ..structure.sparse_lu import NARROW, Indices

# Added to the squared length, one, of every row. A repeated row keeps this times the number of rows
# it repeats, well below the pivots of independent ones, and far above round-off.
LIFT = 1e-13
# Numbers that are looked at together, 80 MB. Each redundant row takes a solution as long as the
# rows.
TOGETHER = 10**7
# Vectors beyond those that are needed, so that none is missed by chance. Sums that are smaller than
# the second are taken for zero, before drivers are taken to repeat joints: geometry that is nearly
# redundant is often meant to be so.
SPARE, NEARLY = 8, 1e-3


@dataclass(frozen=True, eq=False)
class Jacobian:
    """The entries of all rows at one pose."""

    rows: Indices
    columns: Indices
    values: Array
    shape: tuple[int, int]

    def among(self, kept: Indices) -> Indices:
        """Return the row of each entry in the order of the kept rows; -1 for rows left out."""
        place = np.full(self.shape[0], -1, np.intp)
        place[kept] = np.arange(len(kept))
        return place[self.rows]

    @property
    def well_chosen(self) -> bool:
        """Whether redundant rows are few enough for the kept ones to be well conditioned."""
        count, wanted = self.shape
        return (count - wanted) * count <= TOGETHER

    def independent(self, last: int) -> Indices:
        """Return as many rows as there are columns, the most independent ones; all rows if there
        are no more.

        Args:
            last: number of rows at the end (the drivers), judged after all others and not at their
                expense.
        """
        count, wanted = self.shape
        if count <= wanted:
            return np.arange(count)
        joints = count - last
        sparse, linear, dense = _modules()
        lengths = np.sqrt(np.bincount(self.rows, self.values**2, count))
        J = sparse.csr_matrix(
            (self.values / lengths[self.rows], (self.rows, self.columns)), shape=self.shape
        )
        gram = (J @ J.T + LIFT * sparse.identity(count)).tocsc()
        options: Any = {
            "diag_pivot_thresh": 0.0,
            "options": {"SymmetricMode": True, "Equil": False},
            **NARROW,
        }
        if self.well_chosen:
            found = linear.splu(gram[:joints, :joints], permc_spec="COLAMD", **options)
            some = np.random.default_rng(0).normal(size=(joints, count - wanted + SPARE))
            basis, rest = np.linalg.qr(LIFT * found.solve(some))
            u, sizes, _ = np.linalg.svd(rest)
            redundant = int((sizes[: count - wanted] > LIFT / NEARLY**2).sum())
            _, order = dense.qr((basis @ u[:, :redundant]).T, mode="r", pivoting=True)
            return np.sort(np.append(order[redundant:], np.arange(joints, count)))[:wanted]
        order = np.argsort(linear.splu(gram, permc_spec="COLAMD", **options).perm_c)
        order = np.concatenate([order[order < joints], np.arange(joints, count)])
        factors = linear.splu(gram[order][:, order].tocsc(), permc_spec="NATURAL", **options)
        distance = np.empty(count)
        # the order may still be changed to an equivalent one, rows and columns alike
        distance[order] = np.abs(factors.U.diagonal())[factors.perm_c]
        return np.sort(np.argsort(-distance, kind="stable")[:wanted])


def _modules() -> tuple[Any, Any, Any]:
    sparse, linear, dense = (
        importlib.import_module(name)
        for name in ("scipy.sparse", "scipy.sparse.linalg", "scipy.linalg")
    )
    return sparse, linear, dense
