"""Degrees of freedom: the paper's count, the numerical rank, and the choice of rows to solve.

Redundant rows (four spatial revolutes of a planar loop) are found once, at the design pose, and
left out of the solution; they stay as a diagnostic, evaluated at every sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...errors import SolveError
from ...failures import FailureKind
from ...mechanism.mechanism import Mechanism
from ...trajectory import Array
from ..formulation.cartesian import COLUMNS, Cartesian
from ..formulation.constraints import Frames
from ..formulation.formulation import Formulation, row_names
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
    def counted(self) -> str:
        """The paper's count (Table 5)."""
        return f"{self.coordinates} - {self.equations} = {self.coordinates - self.equations}"

    @property
    def details(self) -> dict[str, Any]:
        """Entries for the record of a solution."""
        account = {
            "bodies": self.bodies,
            "coordinates": self.coordinates,
            "equations": self.equations,
            "paper": self.counted,
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
    names = row_names(formulation)
    redundant = [names[k] for k in range(joint_rows) if k not in kept]
    return counted(mechanism, formulation.unknowns, joint_rows, redundant)


def counted(
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

    `driver_count.require_driven` checks mechanisms of any size.

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
        raise SolveError(_mismatch(mechanism, frame, found), imbalance(mechanism, found.dof))
    return found


def select_rows(
    mechanism: Mechanism, frame: Frames, formulation: Formulation, wanted: Sequence[int] = ()
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
        raise SolveError(_locked(mechanism, formulation, matrix), FailureKind.LOCKED)
    taken = set(kept)
    dropped = tuple(k for k in range(len(matrix)) if k not in taken)
    names = row_names(formulation)
    # drivers first and in this formulation, other rows may be left out
    found = replace(found, redundant_rows=tuple(names[k] for k in dropped))
    return Selection(found, tuple(kept), dropped)


def _locked(mechanism: Mechanism, formulation: Formulation, matrix: Array) -> str:
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


def mismatch(mechanism: Mechanism, dof: int, unknowns: int) -> str:
    """Return the message with the numbers of degrees of freedom and of drivers."""
    drivers = len(mechanism.drivers)
    return (
        f"mechanism {mechanism.name!r}: {dof} degree{'s' * (dof != 1)} of freedom ({unknowns}"
        f" coordinates - rank {unknowns - dof}) but {drivers} driver{'s' * (drivers != 1)}"
    )


def imbalance(mechanism: Mechanism, dof: int) -> FailureKind:
    """Return the kind of a mismatch between degrees of freedom and drivers."""
    return FailureKind.FREE if dof > len(mechanism.drivers) else FailureKind.OVERDRIVEN


def _mismatch(mechanism: Mechanism, frame: Frames, found: FreedomAccount) -> str:
    """Return the message on a mismatch, with the bodies still free while the drivers hold.

    These bodies move in the null space of all rows.
    """
    matrix, drivers = _matrix(mechanism, frame)[1], len(mechanism.drivers)
    head = mismatch(mechanism, found.dof, found.moving_coordinates)
    if found.dof < drivers:
        return f"{head}; remove {drivers - found.dof} or free the mechanism"
    motions = np.linalg.svd(matrix, full_matrices=True)[2][len(independent_rows(matrix, 0)) :]
    free: list[str] = []
    for k, body in enumerate(mechanism.moving):
        block = np.linalg.norm(motions[:, COLUMNS * k : COLUMNS * (k + 1)], axis=0)
        if block.max() > STILL:
            how = "move" if block[:3].max() > STILL else "turn"
            free.append(f"{body.name!r} can {how}")
    return (
        f"{head}; {', '.join(free)}; add a driver, or join what spins freely (a rod between two"
        " balls: use distance)"
    )
