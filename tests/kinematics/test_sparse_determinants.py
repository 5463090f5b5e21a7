"""Signs of determinants of sparse matrices, of the whole and of every block."""

import numpy as np
import pytest
from kincheck.core.kinematics.sparse.determinant_signs import Blocks
from kincheck.core.kinematics.structure.sparse_lu import Order


@pytest.mark.parametrize("n", [6, 40])
def test_the_sign_of_the_determinant(n):
    """Of matrices of one pattern it is that of the signed pivot, or always the other."""
    rng = np.random.default_rng(n)
    rows, columns = np.nonzero(
        (rng.random((n, n)) < 3.0 / n) | np.eye(n, k=1, dtype=bool) | np.eye(n, k=1 - n, dtype=bool)
    )
    order = Order(rows, columns, rng.normal(size=len(rows)), n)
    products: set[float] = set()
    signs: set[float] = set()
    for _ in range(50):
        values = rng.normal(size=len(rows))
        factors = order.factor(values)
        dense = np.zeros((n, n))
        dense[rows, columns] = values
        sign = np.linalg.slogdet(dense)[0]
        signs.add(float(sign))
        products.add(float(np.sign(factors.signed_pivot) * sign))
    assert len(products) == 1
    assert len(signs) == 2


def test_orientation_tells_the_sign_of_every_block():
    """Of blocks solved one after the other, rows and columns mixed: of each that of its
    determinant, or always the other.
    """
    sizes = [1, 2, 5, 1, 2, 3]
    rng, n = np.random.default_rng(4), sum(sizes)
    block = np.repeat(np.arange(len(sizes)), sizes)
    i, j = np.nonzero(block[:, None] >= block)
    rows, columns = rng.permutation(n), rng.permutation(n)
    blocks = Blocks(rows[i], columns[j], n)
    known: list[tuple[float, ...]] = []
    found: list[bytes] = []
    for _ in range(64):
        matrix, mixed = rng.normal(size=(n, n)), np.zeros((n, n))
        mixed[rows[i], columns[j]] = matrix[i, j]
        known.append(
            tuple(
                float(np.linalg.slogdet(matrix[np.ix_(at, at)])[0])
                for at in (np.flatnonzero(block == k) for k in range(6))
            )
        )
        found.append(
            blocks.orientation(matrix[i, j, None], np.array([np.linalg.slogdet(mixed)[0]]))[0]
        )
    # one answer for each combination of signs
    assert len(set(known)) == len(set(found)) == len(set(zip(known, found, strict=True))) > 20
