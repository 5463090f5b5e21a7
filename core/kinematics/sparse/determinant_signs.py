"""Signs of determinants and smallest singular values of a large sparse matrix, by block;
`Elimination` has them of a small one.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ...trajectory import Array
from ..structure.sparse_lu import Indices


class Blocks:
    """The blocks of a pattern to be solved one after the other.

    All but the largest are assumed to be small: they are made dense.

    Attributes:
        count: number of sigmas.
        rows, columns: one for those of the largest block, zero for all others, shape (n, 1).
        start: a vector without a preferred direction, shape (n, 1).
    """

    def __init__(
        self, rows: Indices, columns: Indices, n: int, *, well_chosen: bool = True
    ) -> None:
        """Find the blocks.

        Args:
            rows, columns: of the entries of the pattern.
            n: rows, and columns, of the matrix.
            well_chosen: rows were chosen for being well conditioned; without, the largest block's
                singular values say nothing.
        """
        self._well_chosen = well_chosen
        sparse: Any = importlib.import_module("scipy.sparse")
        graphs: Any = importlib.import_module("scipy.sparse.csgraph")
        pattern = sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=(n, n))
        row_of: Indices = graphs.maximum_bipartite_matching(pattern, perm_type="row")
        needs = sparse.csr_array((np.ones(len(rows)), (rows, row_of[columns])), shape=(n, n))
        _, block = graphs.connected_components(needs, directed=True, connection="strong")
        sizes = np.bincount(block)
        largest = sizes.argmax()
        self.rows, self.columns = (
            (each == largest).astype(float)[:, None] for each in (block, block[row_of])
        )
        self.start = np.random.default_rng(0).normal(size=(n, 1))
        sizes[largest] = 0
        # of every row its place in its block, and of every column that of its row
        order = np.argsort(block, kind="stable")
        place = np.empty(n, np.intp)
        place[order] = np.arange(n) - np.searchsorted(block[order], block[order])
        inside = block[rows] == block[row_of[columns]]
        self.count = len(sizes) - (not well_chosen)
        self._groups: list[tuple[int, Indices, Indices]] = []
        for size in np.unique(sizes[sizes > 0]).tolist():
            number = np.where(sizes == size, np.cumsum(sizes == size) - 1, -1)
            entries = np.flatnonzero(inside & (number[block[rows]] >= 0))
            at = (number[block[rows[entries]]] * size + place[rows[entries]]) * size + place[
                row_of[columns[entries]]
            ]
            self._groups.append((size, entries, at))

    def orientation(self, values: Array, whole: Array) -> list[bytes]:
        """Return the sign of each block's determinant for several poses; each sign is right at all
        values, or at none.

        Args:
            values: of the entries, in the order of the pattern, shape (entries, poses).
            whole: sign of the whole determinant, which gives the largest block's, shape (poses,).
        """
        signs = [np.ones((len(whole), 1))]
        # most blocks are of one row
        signs += [
            np.sign(each[..., 0, 0]) if each.shape[-1] == 1 else np.linalg.slogdet(each)[0]
            for each in self._dense(values)
        ]
        small = np.concatenate(signs, axis=1)
        found = np.column_stack([small, np.sign(whole) * small.prod(axis=1)])
        return [each.tobytes() for each in found.astype(np.int8)]

    def sigmas(
        self,
        values: Array,
        solve: Callable[[Array], Array],
        solve_transposed: Callable[[Array], Array],
    ) -> Array:
        """Return the smallest singular value of each block for several poses, shape (poses,
        blocks).

        The value of the largest block, which comes first, is an estimate by a step of inverse
        iteration: never smaller, and closer the more singular the block is. It uses the whole
        matrix: blocks before have no effect on the right-hand side, and results of blocks behind
        are left out.

        Args:
            solve, solve_transposed: solve for right-hand sides of all poses, shape (n, poses).
        """
        found = [np.zeros((values.shape[1], 0))]
        if self._well_chosen:
            left: Array = self.rows * solve_transposed(
                np.repeat(self.columns * self.start, values.shape[1], axis=1)
            )
            right: Array = self.columns * solve(left)
            found.append((np.linalg.norm(left, axis=0) / np.linalg.norm(right, axis=0))[:, None])
        for each in self._dense(values):
            # what is no number is singular
            sound = np.where(np.isfinite(each).all(axis=(2, 3), keepdims=True), each, 0.0)
            found.append(
                np.abs(sound[..., 0, 0])
                if each.shape[-1] == 1
                else np.linalg.svd(sound, compute_uv=False)[..., -1]
            )
        return np.concatenate(found, axis=1)

    def _dense(self, values: Array) -> Iterator[Array]:
        """The blocks of each size, shape (poses, blocks, size, size)."""
        poses = values.shape[1]
        for size, entries, at in self._groups:
            dense = np.zeros((poses, at.max() // (size * size) + 1, size, size))
            dense.reshape(poses, -1)[:, at] = values.take(entries, axis=0).T
            yield dense
