"""Degrees of freedom: the paper's count, the numerical rank, and which rows are kept.

Rows that say what others say already (four spatial revolutes of a planar loop) are found once, at
the design pose, and left out of the solution; they stay as a diagnostic, evaluated at every sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...errors import SolveError
from ...mechanism.mechanism import Mechanism
from ...trajectory import Array
from ..formulation.cartesian import COLUMNS, Cartesian
from ..formulation.constraints import Frames
from ..formulation.formulation import Formulation, row_names
from ..formulation.state_vectors import jacobian
from .redundancy import RANK_TOLERANCE, SHARE, independent_joint_rows, independent_rows

COORDINATES = 7
"""Coordinates of a body in the paper's count: r and p."""
# A body whose part of an orthonormal basis of the free motions is below this stands still:
# round-off of the basis is far below.
STILL = 1e-6


@dataclass(frozen=True)
class FreedomAccount:
    """The degrees of freedom of a mechanism without its drivers.

    Attributes:
        bodies: all bodies, fixed ones included (the ground itself is none).
        coordinates: 7 per body: position and Euler parameters.
        equations: joint rows, 6 ground rows per fixed body, 1 normalisation per body.
        moving_coordinates: 6 per moving body, 1 per joint coordinate that is coupled: the unknowns
            of the native formulation.
        rows: joint rows, and those that name and couple coordinates.
        rank: numerical rank of the joint rows.
        redundant_rows: joint rows that are left out, as "joint: primitive".
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
        """What the record of a solution says of it."""
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
    """The rows that are solved: as many as there are unknowns, drivers among them."""

    account: FreedomAccount
    chosen: tuple[int, ...]
    dropped: tuple[int, ...]


def account(mechanism: Mechanism, frame: Frames) -> FreedomAccount:
    """Count and measure the degrees of freedom at the design pose."""
    formulation, matrix = _matrix(mechanism, frame)
    joint_rows = len(matrix) - len(mechanism.drivers)
    kept = set(independent_joint_rows(formulation, matrix[:joint_rows]))
    names = row_names(formulation)
    redundant = [names[k] for k in range(joint_rows) if k not in kept]
    return counted(mechanism, formulation.unknowns, joint_rows, redundant)


def counted(
    mechanism: Mechanism, unknowns: int, rows: int, redundant_rows: Sequence[str]
) -> FreedomAccount:
    """The account of a mechanism of which so many unknowns and joint rows are known, and which rows
    are redundant.
    """
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
    """The account of a mechanism that has as many drivers as degrees of freedom; for any size there
    is `driven.require_driven`.

    Raises:
        SolveError: it has more or fewer, or nothing moves.
    """
    if not mechanism.moving:
        raise SolveError(
            f"mechanism {mechanism.name!r}: no body can move; declare a body that is not fixed"
        )
    found = account(mechanism, frame)
    if found.dof != len(mechanism.drivers):
        raise SolveError(_mismatch(mechanism, frame, found))
    return found


def select_rows(
    mechanism: Mechanism, frame: Frames, formulation: Formulation, wanted: Sequence[int] = ()
) -> Selection:
    """The rows of a formulation to solve for: those wanted, or if none are those independent at the
    design, drivers first.

    Raises:
        SolveError: drivers and degrees of freedom do not match, or a driver does not move what is
            free.
    """
    found, drivers = driven_account(mechanism, frame), len(mechanism.drivers)
    matrix = jacobian(formulation)
    kept = wanted or independent_rows(matrix, drivers, formulation.conditions)
    if len(kept) < formulation.unknowns:
        raise SolveError(_locked(mechanism, formulation, matrix))
    taken = set(kept)
    dropped = tuple(k for k in range(len(matrix)) if k not in taken)
    names = row_names(formulation)
    # taken with the drivers first, and in this formulation, the rows that are left out may be
    # others
    found = replace(found, redundant_rows=tuple(names[k] for k in dropped))
    return Selection(found, tuple(kept), dropped)


def _locked(mechanism: Mechanism, formulation: Formulation, matrix: Array) -> str:
    """Says which drivers do not move the mechanism at the design position, and which joints and
    drivers hold them.
    """
    joint_rows = len(matrix) - len(mechanism.drivers)
    rows = [*independent_rows(matrix[:joint_rows], 0), *range(joint_rows, len(matrix))]
    # the sums of rows that vanish; those of joints are independent, so there is a driver in each
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
    """Says how many degrees of freedom and how many drivers there are."""
    drivers = len(mechanism.drivers)
    return (
        f"mechanism {mechanism.name!r}: {dof} degree{'s' * (dof != 1)} of freedom ({unknowns}"
        f" coordinates - rank {unknowns - dof}) but {drivers} driver{'s' * (drivers != 1)}"
    )


def _mismatch(mechanism: Mechanism, frame: Frames, found: FreedomAccount) -> str:
    """Says what is still free with the drivers held, by name: the bodies that move in the null
    space of all rows.
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
