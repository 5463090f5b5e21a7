"""Whether a mechanism of any size has as many drivers as degrees of freedom, which is found before
anything is solved.

A small one is counted by its dense Jacobian (see `freedom`), whose cost grows by the fourth power
of its size: 27 bodies 0.03 s, 101 bodies 1.5 s, 301 bodies two minutes. A large one is counted by
what its drivers leave over and what they ask too much, at the design position: motions that no row
resists, A x = 0, and rates of the drivers that the rows contradict, A^T y = 0, where A has the rows
of joints and drivers. With u of the first and o of the second there are drivers + u - o degrees of
freedom.

Both are what is left of random vectors where every singular value s of A passes by e^2 / (s^2 +
e^2). That is a solution with the symmetric matrix [[e I, A], [A^T, -e I]]: its eigenvalues are
+-sqrt(s^2 + e^2), so that nothing is squared, e can be as small as `RANK_TOLERANCE`, and the matrix
is never singular.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import SolveError
from ...mechanism.mechanism import Mechanism
from ...trajectory import Array
from ..formulation.cartesian import COLUMNS, Cartesian
from ..formulation.constraints import frames, measured
from .degrees_of_freedom import account, driven_account, mismatch
from .redundancy import RANK_TOLERANCE
from .sparse_lu import NARROW

# Up to as many bodies the dense count takes some 20 ms.
DENSE = 25
# Filtered as often, singular values from 1e-6 leave 1e-12 of a vector or less. What is in a null
# space is left whole; the rate of a driver has a part there of one over the root of the rows that
# share in the contradiction: of a million, 1e-3.
ROUNDS, LEFT = 2, 1e-6
FEW = 5
"""Names listed in a message, at most."""


def require_driven(mechanism: Mechanism) -> None:
    """Make sure that a mechanism has as many drivers as degrees of freedom.

    Raises:
        SolveError: it has more or fewer, or nothing moves; the message names what can still move,
            or what contradicts.
    """
    if len(mechanism.moving) <= DENSE:
        driven_account(mechanism, frames(mechanism))
        return
    found = _balance(mechanism)
    if found.dof != len(mechanism.drivers):
        raise SolveError(
            f"{mismatch(mechanism, found.dof, found.formulation.unknowns)}; {found.remedy}"
        )


def degrees_of_freedom(mechanism: Mechanism) -> int:
    """Degrees of freedom at the design position, its drivers apart."""
    return (
        account(mechanism, frames(mechanism)).dof
        if len(mechanism.moving) <= DENSE
        else _balance(mechanism).dof
    )


def locked_drivers(mechanism: Mechanism) -> str:
    """Drivers that do not move it at design, as other rows prescribe the same; empty if there are
    none. Of any size.
    """
    return _balance(mechanism).dependent


@dataclass(frozen=True, eq=False)
class _Balance:
    """What the drivers of a mechanism leave over and ask too much.

    Attributes:
        formulation: its rows, those of the drivers last.
        free: motions that are left with all drivers held, orthonormal, shape (unknowns, motions).
        excess: contradictions, orthonormal over all rows, and of each the share of each driver,
            shape (drivers, contradictions).
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
        """What is free and to be driven, or which drivers are too many."""
        if self.dof < len(self.mechanism.drivers):
            many = len(self.mechanism.drivers) - self.dof
            return f"not independent are {self.dependent}; remove {many} or free the mechanism"
        bodies = self.formulation.bodies
        blocks = self.free[: COLUMNS * len(bodies)].reshape(len(bodies), -1)
        free = _largest(np.linalg.norm(blocks, axis=1), bodies) or "a joint coordinate"
        advice = "add a driver, or join what spins freely (a rod between two balls: use distance)"
        return f"what can still move is most of all {free}; {advice}"


def _largest(sizes: Array, names: Sequence[str]) -> str:
    """The names of the largest sizes."""
    order: list[int] = np.argsort(-sizes, kind="stable").tolist()
    found = [repr(names[k]) for k in order if sizes[k] > LEFT]
    return ", ".join([*found[:FEW], "..."] if len(found) > FEW else found)


def _balance(mechanism: Mechanism) -> _Balance:
    frame = measured(mechanism)[1]
    formulation = Cartesian.of(mechanism, frame)
    rows = formulation.rows(formulation.configuration(formulation.design))
    null = _NullSpaces(rows, formulation.unknowns)
    drivers = len(mechanism.drivers)
    excess = null.contradictions(drivers)[len(rows) - drivers :]
    return _Balance(mechanism, formulation, null.motions(), excess)


class _NullSpaces:
    """Both null spaces of a sparse matrix, its rows made one long."""

    def __init__(self, rows: Sequence[Any], unknowns: int) -> None:
        sparse, linear = (
            importlib.import_module(name) for name in ("scipy.sparse", "scipy.sparse.linalg")
        )
        self._rows, self._unknowns = len(rows), unknowns
        at = (
            np.array([(k, column) for k, row in enumerate(rows) for column in row], dtype=np.intp)
            .reshape(-1, 2)
            .T
        )
        values = np.array([value for row in rows for value in row.values()], dtype=np.float64)
        lengths = np.sqrt(np.bincount(at[0], values**2, len(rows)))
        A = sparse.csc_matrix(
            (values / lengths[at[0]], (at[0], at[1])), shape=(len(rows), unknowns)
        )
        sides = [
            [RANK_TOLERANCE * sparse.identity(len(rows)), A],
            [A.T, -RANK_TOLERANCE * sparse.identity(unknowns)],
        ]
        self._factors: Any = linear.splu(
            sparse.bmat(sides, format="csc"), permc_spec="COLAMD", **NARROW
        )
        self._random = np.random.default_rng(0)

    def motions(self) -> Array:
        """x with A x = 0, orthonormal, shape (unknowns, motions)."""
        here = slice(self._rows, self._rows + self._unknowns)
        return self._remains(here, self._unknowns)

    def contradictions(self, last: int) -> Array:
        """y with A^T y = 0 that vectors over so many last rows have a part in, orthonormal, shape
        (rows, contradictions).
        """
        return self._remains(slice(0, self._rows), last)

    def _remains(self, here: slice, last: int) -> Array:
        """What is left of random vectors, of which only so many last numbers are not zero; more are
        tried until none is lost.
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
