"""Degrees of freedom: the paper's count, the numerical rank, and the choice of rows to solve; the
number of drivers against them, checked before the solution at any size.

Redundant rows (four spatial revolutes of a planar loop) are found once, at the design pose, and
left out of the solution; they stay as a diagnostic, evaluated at every sample.

A small mechanism is counted by its dense Jacobian, at a cost of the fourth power of its size: 27
bodies 0.03 s, 101 bodies 1.5 s, 301 bodies two minutes. A large one is counted by two null spaces
at the design position: motions without resistance, A x = 0, and driver rates in contradiction to
other rows, A^T y = 0. A holds the rows of joints and drivers. With u motions and o contradictions
there are drivers + u - o degrees of freedom.

Both null spaces remain of random vectors after a filter of e^2 / (s^2 + e^2) for every singular
value s of A. The filter is a solution with the symmetric matrix [[e I, A], [A^T, -e I]]. Its
eigenvalues are +-sqrt(s^2 + e^2): nothing is squared, e can be as small as `RANK_TOLERANCE`, and
the matrix is never singular.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SolveError
from ...failures import FailureKind
from ...mechanism.mechanism import Mechanism
from ...trajectory import Array
from ..formulation.cartesian import COLUMNS, Cartesian
from ..formulation.constraints import Frames, frames, measured
from ..formulation.state_vectors import jacobian
from .redundancy import RANK_TOLERANCE, SHARE, independent_joint_rows, independent_rows

COORDINATES = 7
"""Coordinates of a body in the paper's count: r and p."""
# A body with a smaller part of an orthonormal basis of the free motions is at rest: round-off of
# the basis is far below.
STILL = 1e-6


@dataclass(frozen=True)
class FreedomAccount:
    """The degrees of freedom of a mechanism without its drivers.

    Attributes:
        bodies: number of bodies, fixed ones included, without the ground.
        coordinates: 7 for each body: position and Euler parameters.
        equations: joint rows, 6 ground rows for each fixed body, 1 normalisation for each body.
        moving_coordinates: 6 for each moving body, 1 for each coupled joint coordinate: the
            unknowns of the native formulation.
        rows: joint rows, and rows that define and couple coordinates.
        rank: numerical rank of the joint rows.
        redundant_rows: joint rows left out of the solution, as "joint: primitive".
    """

    bodies: int
    coordinates: int
    equations: int
    moving_coordinates: int
    rows: int
    rank: int
    redundant_rows: tuple[str, ...]

    @property
    def dof(self) -> int:
        """Degrees of freedom by the numerical rank."""
        return self.moving_coordinates - self.rank

    @property
    def paper_count(self) -> str:
        """The paper's count (Table 5)."""
        return f"{self.coordinates} - {self.equations} = {self.coordinates - self.equations}"

    @property
    def details(self) -> dict[str, Any]:
        """Entries for the record of a solution."""
        account = {
            "bodies": self.bodies,
            "coordinates": self.coordinates,
            "equations": self.equations,
            "paper": self.paper_count,
            "moving_coordinates": self.moving_coordinates,
            "rows": self.rows,
            "rank": self.rank,
            "dof": self.dof,
            "redundant_rows": list(self.redundant_rows),
        }
        return {"rank": self.rank, "dof": self.dof, "dof_account": account}


@dataclass(frozen=True, eq=False)
class Selection:
    """The rows to solve: as many as there are unknowns, drivers among them."""

    account: FreedomAccount
    chosen: tuple[int, ...]
    dropped: tuple[int, ...]


def account(mechanism: Mechanism, frame: Frames) -> FreedomAccount:
    """Count the degrees of freedom at the design pose, with the numerical rank."""
    formulation, matrix = _matrix(mechanism, frame)
    joint_rows = len(matrix) - len(mechanism.drivers)
    kept = set(independent_joint_rows(formulation, matrix[:joint_rows]))
    names = formulation.row_names
    redundant = [names[k] for k in range(joint_rows) if k not in kept]
    return freedom_account(mechanism, formulation.unknowns, joint_rows, redundant)


def freedom_account(
    mechanism: Mechanism, unknowns: int, rows: int, redundant_rows: Sequence[str]
) -> FreedomAccount:
    """Return the account of a mechanism from its unknowns, joint rows and redundant rows."""
    bodies, fixed = len(mechanism.bodies), len(mechanism.bodies) - len(mechanism.moving)
    return FreedomAccount(
        bodies=bodies,
        coordinates=COORDINATES * bodies,
        equations=sum(joint.rows for joint in mechanism.joints)
        + len(mechanism.couplers)
        + COLUMNS * fixed
        + bodies,
        moving_coordinates=unknowns,
        rows=rows,
        rank=rows - len(redundant_rows),
        redundant_rows=tuple(redundant_rows),
    )


def driven_account(mechanism: Mechanism, frame: Frames) -> FreedomAccount:
    """Return the account of a mechanism, with as many drivers as degrees of freedom.

    `require_driven` checks mechanisms of any size.

    Raises:
        SolveError: the numbers of drivers and degrees of freedom differ, or nothing moves.
    """
    if not mechanism.moving:
        raise SolveError(
            f"mechanism {mechanism.name!r}: no body can move; declare a body that is not fixed",
            FailureKind.OVERDRIVEN,
        )
    found = account(mechanism, frame)
    if found.dof != len(mechanism.drivers):
        why = "" if found.dof < len(mechanism.drivers) else _still_free(mechanism, frame)
        raise _mismatch(mechanism, found.dof, found.moving_coordinates, why)
    return found


def select_rows(
    mechanism: Mechanism, frame: Frames, formulation: Cartesian, wanted: Sequence[int] = ()
) -> Selection:
    """Select the rows of a formulation to solve, drivers first.

    They are the wanted rows, or without any the independent rows at the design.

    Raises:
        SolveError: drivers and degrees of freedom do not match, or a driver moves no free
            coordinate.
    """
    found, drivers = driven_account(mechanism, frame), len(mechanism.drivers)
    matrix = jacobian(formulation)
    kept = wanted or independent_rows(matrix, drivers, formulation.conditions)
    if len(kept) < formulation.unknowns:
        raise SolveError(_locked_message(mechanism, formulation, matrix), FailureKind.LOCKED)
    # drivers first and in this formulation, other rows may be left out
    return selection_of(found, formulation, kept)


def selection_of(found: FreedomAccount, formulation: Cartesian, kept: Sequence[int]) -> Selection:
    """Return the selection of rows, with the names of the others in the account."""
    names, solved = formulation.row_names, set(kept)
    dropped = tuple(k for k in range(len(names)) if k not in solved)
    redundant = tuple(names[k] for k in dropped)
    return Selection(replace(found, redundant_rows=redundant), tuple(kept), dropped)


def _locked_message(mechanism: Mechanism, formulation: Cartesian, matrix: Array) -> str:
    """Return the message on drivers that do not move the mechanism at the design position.

    The message names these drivers, and the joints and drivers that hold them.
    """
    joint_rows = len(matrix) - len(mechanism.drivers)
    rows = [*independent_rows(matrix[:joint_rows], 0), *range(joint_rows, len(matrix))]
    # vanishing combinations of rows; those of joints are independent, so each contains a driver
    left, sizes, _ = np.linalg.svd(matrix[rows])
    sums = left[:, int((sizes > RANK_TOLERANCE * sizes.max()).sum()) :]
    share = np.linalg.norm(sums, axis=1)
    involved = dict.fromkeys(
        formulation.owners[k][0] for k, x in zip(rows, share, strict=True) if x > SHARE
    )
    drivers = [repr(each.name) for each in mechanism.drivers if each.name in involved]
    joints = [repr(name) for name in involved if repr(name) not in drivers]
    many = len(drivers) > 1
    what = " and ".join([*filter(None, [", ".join(joints)]), *["each other"] * many])
    return (
        f"mechanism {mechanism.name!r}: driver{'s' * many} {', '.join(drivers)}"
        f" do{'es' * (not many)} not move it at the design position (lock-up or dead centre): what"
        f" {'they prescribe' if many else 'it prescribes'} there follows already from {what}; give"
        " the design in another pose, some degrees on, and sweep from there, or drive another"
        " coordinate"
    )


def _matrix(mechanism: Mechanism, frame: Frames) -> tuple[Cartesian, Array]:
    formulation = Cartesian.of(mechanism, frame)
    return formulation, jacobian(formulation)


def _mismatch(mechanism: Mechanism, dof: int, unknowns: int, why: str) -> SolveError:
    """Return the error of a mechanism with more or fewer drivers than degrees of freedom."""
    drivers = len(mechanism.drivers)
    advice = (
        f"remove {drivers - dof} or free the mechanism"
        if dof < drivers
        else "add a driver, or join what spins freely (a rod between two balls: use distance)"
    )
    return SolveError(
        f"mechanism {mechanism.name!r}: {dof} degree{'s' * (dof != 1)} of freedom ({unknowns}"
        f" coordinates - rank {unknowns - dof}) but {drivers} driver{'s' * (drivers != 1)};"
        f" {why}{advice}",
        FailureKind.FREE if dof > drivers else FailureKind.OVERDRIVEN,
    )


def _still_free(mechanism: Mechanism, frame: Frames) -> str:
    """Return the bodies still free while the drivers hold: they move in the null space of all
    rows.
    """
    matrix = _matrix(mechanism, frame)[1]
    motions = np.linalg.svd(matrix, full_matrices=True)[2][len(independent_rows(matrix, 0)) :]
    free: list[str] = []
    for k, body in enumerate(mechanism.moving):
        block = np.linalg.norm(motions[:, COLUMNS * k : COLUMNS * (k + 1)], axis=0)
        if block.max() > STILL:
            how = "move" if block[:3].max() > STILL else "turn"
            free.append(f"{body.name!r} can {how}")
    return f"{', '.join(free)}; "


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
    found = _Balance(mechanism)
    if found.dof != len(mechanism.drivers):
        why = (
            f"not independent are {found.dependent}; "
            if found.dof < len(mechanism.drivers)
            else f"what can still move is most of all {found.movable}; "
        )
        raise _mismatch(mechanism, found.dof, found.unknowns, why)


def degrees_of_freedom(mechanism: Mechanism) -> int:
    """Return the degrees of freedom at the design position, without drivers."""
    return (
        account(mechanism, frames(mechanism)).dof
        if len(mechanism.moving) <= DENSE
        else _Balance(mechanism).dof
    )


def locked_drivers(mechanism: Mechanism) -> str:
    """Return the drivers, at any size, that duplicate other rows at design; empty without any."""
    return _Balance(mechanism).dependent


class _Balance:
    """Freedoms left by the drivers of a mechanism, and contradictions among them.

    Attributes:
        unknowns: number of unknowns.
        dof: degrees of freedom.
        dependent: the drivers that contradict other rows.
        movable: the bodies that move most with all drivers held.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        formulation = Cartesian.of(mechanism, measured(mechanism)[1])
        rows = formulation.rows(formulation.configuration(formulation.design))
        at = np.array([(k, column) for k, row in enumerate(rows) for column in row], np.intp)
        values = np.array([value for row in rows for value in row.values()], dtype=np.float64)
        at, self.unknowns = at.reshape(-1, 2), formulation.unknowns
        null = NullSpaces(at[:, 0], at[:, 1], values, (len(rows), self.unknowns))
        names = [driver.name for driver in mechanism.drivers]
        # the contradictions are orthonormal over all rows
        excess = null.contradictions(len(names))[len(rows) - len(names) :]
        free, bodies = null.motions(), formulation.bodies
        self.dof = len(names) + free.shape[1] - excess.shape[1]
        self.dependent = _largest(excess, names)
        blocks = free[: COLUMNS * len(bodies)].reshape(len(bodies), -1)
        self.movable = _largest(blocks, bodies) or "a joint coordinate"


def _largest(rows: Array, names: Sequence[str]) -> str:
    """Return the names with the largest rows."""
    sizes = np.linalg.norm(rows, axis=1)
    order: list[int] = np.argsort(-sizes, kind="stable").tolist()
    found = [repr(names[k]) for k in order if sizes[k] > LEFT]
    return ", ".join([*found[:FEW], "..."] if len(found) > FEW else found)


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
