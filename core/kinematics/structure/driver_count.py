"""Number of drivers against degrees of freedom, checked before the solution at any size.

A small mechanism is counted by its dense Jacobian (see `degrees_of_freedom`), at a cost of the
fourth power of its size: 27 bodies 0.03 s, 101 bodies 1.5 s, 301 bodies two minutes. A large one is
counted by two null spaces at the design position: motions without resistance, A x = 0, and driver
rates in contradiction to other rows, A^T y = 0. A holds the rows of joints and drivers. With u
motions and o contradictions there are drivers + u - o degrees of freedom.

Both null spaces remain of random vectors after a filter of e^2 / (s^2 + e^2) for every singular
value s of A. The filter is a solution with the symmetric matrix [[e I, A], [A^T, -e I]]. Its
eigenvalues are +-sqrt(s^2 + e^2): nothing is squared, e can be as small as `RANK_TOLERANCE`, and
the matrix is never singular.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SolveError
from ...mechanism.mechanism import Mechanism
from ...trajectory import Array
from ..formulation.cartesian import COLUMNS, Cartesian
from ..formulation.constraints import frames, measured
from .degrees_of_freedom import account, driven_account, imbalance, mismatch
from .redundancy import RANK_TOLERANCE

# Up to this number of bodies the dense count takes some 20 ms.
DENSE = 25
# After these rounds of the filter, singular values from 1e-6 leave at most 1e-12 of a vector. A
# null space passes unchanged; a driver's part in it is one over the root of the number of rows in
# the contradiction: 1e-3 for a million rows.
ROUNDS, LEFT = 2, 1e-6
FEW = 5
"""Largest number of names in a message."""
# Supernodes of these matrices are a few columns wide; SuperLU's own settings (10 and 20) double the
# time.
NARROW = {"relax": 4, "panel_size": 4}
Indices = NDArray[np.intp]


def require_driven(mechanism: Mechanism) -> None:
    """Require as many drivers as degrees of freedom.

    Raises:
        SolveError: there are more or fewer drivers, or nothing moves; the message names the free
            bodies or the contradicting drivers.
    """
    if len(mechanism.moving) <= DENSE:
        driven_account(mechanism, frames(mechanism))
        return
    found = _balance(mechanism)
    if found.dof != len(mechanism.drivers):
        raise SolveError(
            f"{mismatch(mechanism, found.dof, found.formulation.unknowns)}; {found.remedy}",
            imbalance(mechanism, found.dof),
        )


def degrees_of_freedom(mechanism: Mechanism) -> int:
    """Return the degrees of freedom at the design position, without drivers."""
    return (
        account(mechanism, frames(mechanism)).dof
        if len(mechanism.moving) <= DENSE
        else _balance(mechanism).dof
    )


def locked_drivers(mechanism: Mechanism) -> str:
    """Return the drivers, at any size, that duplicate other rows at design; empty without any."""
    return _balance(mechanism).dependent


@dataclass(frozen=True, eq=False)
class _Balance:
    """Freedoms left by the drivers of a mechanism, and contradictions among them.

    Attributes:
        formulation: its rows, those of the drivers last.
        free: remaining motions with all drivers held, orthonormal, shape (unknowns, motions).
        excess: share of each driver in each contradiction, shape (drivers, contradictions); the
            contradictions are orthonormal over all rows.
    """

    mechanism: Mechanism
    formulation: Cartesian
    free: Array
    excess: Array

    @property
    def dof(self) -> int:
        return len(self.mechanism.drivers) + self.free.shape[1] - self.excess.shape[1]

    @property
    def dependent(self) -> str:
        """The drivers that contradict other rows."""
        return _largest(
            np.linalg.norm(self.excess, axis=1), [driver.name for driver in self.mechanism.drivers]
        )

    @property
    def remedy(self) -> str:
        """Advice for the message: bodies that need a driver, or drivers to remove."""
        if self.dof < len(self.mechanism.drivers):
            many = len(self.mechanism.drivers) - self.dof
            return f"not independent are {self.dependent}; remove {many} or free the mechanism"
        bodies = self.formulation.bodies
        blocks = self.free[: COLUMNS * len(bodies)].reshape(len(bodies), -1)
        free = _largest(np.linalg.norm(blocks, axis=1), bodies) or "a joint coordinate"
        advice = "add a driver, or join what spins freely (a rod between two balls: use distance)"
        return f"what can still move is most of all {free}; {advice}"


def _largest(sizes: Array, names: Sequence[str]) -> str:
    """Return the names with the largest sizes."""
    order: list[int] = np.argsort(-sizes, kind="stable").tolist()
    found = [repr(names[k]) for k in order if sizes[k] > LEFT]
    return ", ".join([*found[:FEW], "..."] if len(found) > FEW else found)


def _balance(mechanism: Mechanism) -> _Balance:
    frame = measured(mechanism)[1]
    formulation = Cartesian.of(mechanism, frame)
    rows = formulation.rows(formulation.configuration(formulation.design))
    at = np.array([(k, column) for k, row in enumerate(rows) for column in row], np.intp)
    values = np.array([value for row in rows for value in row.values()], dtype=np.float64)
    at = at.reshape(-1, 2)
    null = NullSpaces(at[:, 0], at[:, 1], values, (len(rows), formulation.unknowns))
    drivers = len(mechanism.drivers)
    excess = null.contradictions(drivers)[len(rows) - drivers :]
    return _Balance(mechanism, formulation, null.motions(), excess)


class NullSpaces:
    """Both null spaces of a sparse matrix with rows scaled to length one.

    Args:
        rows, columns, values: of the entries.
        shape: rows and unknowns.
    """

    def __init__(
        self, rows: Indices, columns: Indices, values: Array, shape: tuple[int, int]
    ) -> None:
        sparse, linear = (
            importlib.import_module(name) for name in ("scipy.sparse", "scipy.sparse.linalg")
        )
        self._rows, self._unknowns = shape
        lengths = np.sqrt(np.bincount(rows, values**2, shape[0]))
        A = sparse.csc_matrix((values / lengths[rows], (rows, columns)), shape=shape)
        sides = [
            [RANK_TOLERANCE * sparse.identity(shape[0]), A],
            [A.T, -RANK_TOLERANCE * sparse.identity(shape[1])],
        ]
        self._factors: Any = linear.splu(
            sparse.bmat(sides, format="csc"), permc_spec="COLAMD", **NARROW
        )
        self._random = np.random.default_rng(0)

    def independent_rows(self, drivers: int) -> Indices | None:
        """Return as many independent rows as there are unknowns, those of the drivers, the last
        ones, among them; None if there are fewer, or a driver repeats other rows.

        Rows with most weight in the vanishing sums are left out, by pivoted QR (rank-revealing):
        the others are well conditioned.
        """
        sums, joints = self.contradictions(self._rows), self._rows - drivers
        redundant = sums.shape[1]
        repeated = np.abs(sums[joints:]).max(initial=0.0) > LEFT
        if self._rows - redundant < self._unknowns or repeated:
            return None
        qr: Any = importlib.import_module("scipy.linalg").qr
        _, order = qr(sums[:joints].T, mode="r", pivoting=True)
        return np.setdiff1d(np.arange(self._rows), order[:redundant])

    def motions(self) -> Array:
        """Return x with A x = 0, orthonormal, shape (unknowns, motions)."""
        here = slice(self._rows, self._rows + self._unknowns)
        return self._remains(here, self._unknowns)

    def contradictions(self, last: int) -> Array:
        """Return y with A^T y = 0, orthonormal, shape (rows, contradictions).

        Only solutions with a part in the given number of last rows are found.
        """
        return self._remains(slice(0, self._rows), last)

    def _remains(self, here: slice, last: int) -> Array:
        """Return an orthonormal basis of the filtered random vectors.

        Only the given number of last components is nonzero at first. More vectors are tried until
        none is missed.
        """
        size, tried = here.stop - here.start, min(4, last)
        while True:
            vectors = np.zeros((size, tried))
            vectors[size - last :] = np.linalg.qr(self._random.normal(size=(last, tried)))[0]
            for _ in range(ROUNDS):
                whole = np.zeros((self._rows + self._unknowns, tried))
                whole[here] = vectors
                vectors = RANK_TOLERANCE * self._factors.solve(whole)[here]
            basis, sizes, _ = np.linalg.svd(vectors, full_matrices=False)
            count = int((sizes > LEFT).sum())
            if count < tried or tried == last:
                return basis[:, :count]
            tried = min(2 * tried, last)
