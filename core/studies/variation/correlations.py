"""Correlated coordinates: a Gaussian copula.

Each coordinate is a function of a standard normal number z: its quantile at the share of z, the
probability of a smaller number. The matrix correlates the numbers z. So normal coordinates have
exactly these correlations. Others have nearly the same: for two uniform coordinates the correlation
is 6/pi asin(r/2) instead of r, a difference of 0.018 at most.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...trajectory import Array

# Matrices in files have rounded digits: this is the largest accepted negative eigenvalue.
DIGITS = 1e-9


@dataclass(frozen=True, eq=False)
class Correlation:
    """Correlation of some coordinates, by a matrix.

    Attributes:
        rows: indices of the coordinates, each once.
        matrix: symmetric, positive semidefinite, ones on the diagonal, shape (rows, rows).
    """

    rows: tuple[int, ...]
    matrix: Array

    @cached_property
    def factor(self) -> Array:
        """The lower triangle L of the matrix L L^T; a column is zero if its coordinate depends on
        earlier coordinates alone.
        """
        size = len(self.matrix)
        found = np.zeros((size, size))
        for k in range(size):
            rest = self.matrix[k:, k] - found[k:, :k] @ found[k, :k]
            if rest[0] > DIGITS:
                found[k:, k] = rest / np.sqrt(rest[0])
        return found

    def mixed(self, independent: Array) -> Array:
        """Return correlated standard normal numbers from independent ones, shape (rows, V).

        The sum is computed term by term, as the rounding of a matrix product may depend on the
        number of columns and on the machine.
        """
        found = np.zeros_like(independent)
        for row, column in np.argwhere(self.factor).tolist():
            found[row] += self.factor[row, column] * independent[column]
        return found


def problem_of(matrix: Sequence[Sequence[float]], names: Sequence[str]) -> str:
    """Return the reason why a matrix is no correlation matrix of the named coordinates, and the
    expectation; empty if it is one.
    """
    size = len(names)
    lengths = [len(row) for row in matrix]
    if lengths != [size] * size:
        rows = ", ".join(map(str, lengths))
        return (
            f"found {len(lengths)} rows of {rows} numbers, expected {size} rows of {size}, as there"
            f" are {size} coordinates; complete the matrix"
        )
    values = np.array(matrix, dtype=np.float64)
    for i, j in np.argwhere(~(np.abs(values) <= 1.0)).tolist():
        return (
            f"found {matrix[i][j]:g} for {names[i]} and {names[j]}, expected a number from -1 to 1;"
            " correct it"
        )
    for k in range(size):
        if values[k, k] != 1.0:
            return (
                f"found {matrix[k][k]:g} on the diagonal for {names[k]}, expected 1; give"
                " correlations, not covariances"
            )
    for i, j in np.argwhere(values != values.T).tolist():
        return (
            f"found {matrix[i][j]:g} for {names[i]} and {names[j]}, but {matrix[j][i]:g} for"
            f" {names[j]} and {names[i]}, expected a symmetric matrix; correct one"
        )
    least = float(np.linalg.eigvalsh(values)[0])
    if least < -DIGITS:
        return (
            f"found the eigenvalue {least:.3g}, expected a positive semidefinite matrix, as all"
            " correlations of data are; bring the numbers closer to zero"
        )
    return ""
