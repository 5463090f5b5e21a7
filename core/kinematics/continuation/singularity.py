"""Singular poses: distance from one, dependent rows, and motions possible with the drivers held.

J is the Jacobian of the kept rows, in units with rows and unknowns of size one. Its smallest
singular value sigma belongs to a motion z of all bodies, hardly resisted by the rows, J z = sigma
y, and to a nearly dependent combination y of rows. If the rows of the joints alone are independent,
a driver is among those of y: it has come to the end of its travel (lock-up, a limit point of the
motion). If they are not, the motion may continue in several ways (bifurcation).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import shortened
from ...trajectory import Array
from ..compiled.dense_equations import System
from ..formulation.acceptance_criteria import EPSILON

# Of what is largest, in a combination of rows or a motion: smaller shares are not named.
SHARE = 0.1
# Joint rows that are this much farther from dependence than all rows together: then it is a
# driver's row that depends on them.
APART = 10.0
# Above this a smallest singular value explains nothing: rates have all but four of their digits
# there.
REGULAR = 1e-2
NAMED = 4
"""Names in a message; the record has all."""
CONTINUED = "the branch followed is the continuation of the motion"


@dataclass(frozen=True)
class Singularity:
    """The smallest singular value at a pose and its vectors.

    Attributes:
        lock_up: a driver's row depends on the joints'; else the joints' rows on each other.
        sigma: smallest singular value of the kept rows.
        of_all: smallest singular value of all rows, redundant ones included: if it is not small the
            mechanism is regular, and only the rows chosen at the design depend on each other.
        owners: joints and drivers of the dependent rows, the largest shares first.
        moves: moving bodies: velocity of a point [m] and angular velocity [rad], the largest number
            one.
    """

    lock_up: bool
    sigma: float
    of_all: float
    owners: tuple[str, ...]
    moves: Mapping[str, tuple[tuple[float, ...], tuple[float, ...]]]

    @property
    def regular(self) -> bool:
        """Whether the choice of rows is singular, and the mechanism is not."""
        return self.sigma < REGULAR < self.of_all

    @property
    def kind(self) -> str:
        """The kind of singularity in a word or two."""
        return "choice of rows" if self.regular else "lock-up" if self.lock_up else "bifurcation"

    @property
    def words(self) -> str:
        """The dependent rows and the moving bodies, for a message after a place."""
        if self.regular:
            return (
                f"smallest singular value {self.sigma:.3g} of the rows that were chosen at the"
                f" design position, of {listed(self.owners)}, and {self.of_all:.3g} of all rows:"
                " the mechanism is regular there; it has more rows than it needs; let the design"
                " be nearer, or have joints that constrain nothing twice (kincheck explain names"
                " the rows)"
            )
        what = (
            "a driver's row depends on the joints'"
            if self.lock_up
            else "rows of joints depend on each other"
        )
        how = [
            f"{body} {'turns' if any(turn) else 'moves'}" for body, (_, turn) in self.moves.items()
        ]
        return (
            f"smallest singular value {self.sigma:.3g}: {what} ({self.kind}), of"
            f" {listed(self.owners)}; free to first order with the drivers held: {listed(how)}"
        )

    @property
    def facts(self) -> dict[str, Any]:
        """The same as a record has it."""
        direction = {
            body: {"moves": list(v), "turns": list(w)} for body, (v, w) in self.moves.items()
        }
        return {
            "kind": self.kind,
            "smallest_singular_value": self.sigma,
            "rows_of": list(self.owners),
            "direction": direction,
        }


def listed(names: Sequence[str]) -> str:
    """Names in a sentence, the first few."""
    return shortened(names, NAMED)


def examine(system: System, state: Array, sample: Array) -> Singularity:
    """Return the singularity nearest to one pose; shapes (numbers, 1) and (sampled, 1)."""
    found = system.equations(state, sample)
    jacobian = found.jacobian[0]
    y, sigma, z = np.linalg.svd(jacobian)
    of_all = np.linalg.svd(np.concatenate([jacobian, found.redundant[0]]), compute_uv=False)[-1]
    joints = jacobian[~system.driven]
    held = np.linalg.svd(joints, compute_uv=False).min(initial=np.inf)
    weights: dict[str, float] = {}
    for owner, weight in zip(system.owners, np.abs(y[:, -1]).tolist(), strict=True):
        weights[owner] = max(weight, weights.get(owner, 0.0))
    return Singularity(
        lock_up=bool(held > APART * sigma[-1]),
        sigma=float(sigma[-1]),
        of_all=float(of_all),
        owners=tuple(_shares(weights)),
        moves=_moves(system, state[:, 0], z[-1]),
    )


def _shares(weights: Mapping[str, float]) -> list[str]:
    least = SHARE * max(weights.values())
    return sorted(
        (name for name, weight in weights.items() if weight >= least),
        key=lambda name: -weights[name],
    )


def _moves(
    system: System, state: Array, z: Array
) -> dict[str, tuple[tuple[float, ...], tuple[float, ...]]]:
    """Return the bodies by name, the fastest first; negligible shares are zero."""
    unit = system.tracer.frame.unit
    rates = {
        name: (np.array([*twist.v]), np.array([*twist.w]))
        for name, twist in system.twists(state, z).items()
    }
    sizes = {name: float(max(np.abs(v).max(), np.abs(w).max())) for name, (v, w) in rates.items()}
    largest = max(sizes.values())

    def share(x: Array, factor: float) -> tuple[float, ...]:
        kept = np.where(np.abs(x) >= SHARE * largest, x / largest * factor, 0.0)
        return tuple(float(each) for each in kept)

    return {
        name: (share(rates[name][0], unit), share(rates[name][1], 1.0)) for name in _shares(sizes)
    }


@dataclass(frozen=True, eq=False)
class Solved:
    """Poses solved by orthogonal factors (singular value decomposition), as closely as the numbers
    allow.

    Attributes:
        state: shape (numbers, m).
        rate, rate_t: of the unknowns, shape (m, n).
        sigma: smallest singular value, shape (m,).
        error: bounds of the errors of poses [units, rad], of rates and of their rates (both
            relative to the largest), shape (3, m).
    """

    state: Array
    rate: Array
    rate_t: Array
    sigma: Array
    error: Array


# Steps of size EPSILON ** (1/3) lose as much to rounding as to curvature in a central difference.
DIFFERENCE = EPSILON ** (1.0 / 3.0)
# Each of Newton's steps at least halves the distance to a solution, whatever its multiplicity; five
# halvings more than from a sample's residual tolerance (1e-6 of an angle at a dead centre) to where
# rounding ends it are enough.
POLISH = 12


def smallest_singular_values(system: System, state: Array, sample: Array) -> tuple[Array, Array]:
    """Return the smallest singular values of the kept rows at m states, and of all rows; shape (m,)
    each.
    """
    found = system.equations(state, sample)
    every = np.concatenate([found.jacobian, found.redundant], axis=1)
    kept, of_all = (
        np.linalg.svd(_finite(rows), compute_uv=False)[:, -1].astype(np.float64)
        for rows in (found.jacobian, every)
    )
    return kept, of_all


def solve_closely(system: System, state: Array, sample: Array) -> Solved:
    """Iterate poses near states until their residuals get no smaller; return them with bounds of
    their errors.

    Residuals of rows of size one are known to EPSILON, which along z is EPSILON / sigma of the
    pose. Differences along z give the effect of such an error on the rates.
    """
    best, closure = state, np.full(state.shape[1], np.inf)
    for _ in range(POLISH):
        found = system.equations(state, sample)
        better = found.closure < closure
        best, closure = np.where(better, state, best), np.where(better, found.closure, closure)
        if not better.any():
            break
        state = system.stepped(best, -_solved(found.jacobian, found.phi).T)
    _, sigma, z = np.linalg.svd(_finite(system.equations(best, sample).jacobian))
    rate, rate_t = _rates(system, best, sample)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        error = np.maximum(closure, EPSILON) / sigma[:, -1]
        ahead, behind = (
            _rates(system, system.stepped(best, h * z[:, -1].T), sample)
            for h in (DIFFERENCE, -DIFFERENCE)
        )
        part = error / (2.0 * DIFFERENCE)
        speed = np.abs(rate).max(axis=1)
        changes = [np.abs(a - b).max(axis=1) for a, b in zip(ahead, behind, strict=True)]
        scales = [speed, np.maximum(np.abs(rate_t).max(axis=1), speed**2)]
        relative = [
            np.where(change == 0.0, 0.0, part * change / scale)
            for change, scale in zip(changes, scales, strict=True)
        ]
    return Solved(
        best, rate, rate_t, sigma[:, -1], np.nan_to_num(np.array([error, *relative]), nan=np.inf)
    )


def _rates(system: System, state: Array, sample: Array) -> tuple[Array, Array]:
    found = system.equations(state, sample)
    rate = _solved(found.jacobian, found.nu)
    gamma = system.gamma(state, sample, rate.T)[[*system.tracer.selection.chosen]]
    return rate, _solved(found.jacobian, gamma.T)


def _solved(jacobian: Array, b: Array) -> Array:
    """Return the least solution by singular values, without those at the level of rounding; NaN if
    anything is not finite.
    """
    y, sigma, z = np.linalg.svd(_finite(jacobian))
    kept: NDArray[np.bool_] = sigma > jacobian.shape[1] * EPSILON * sigma[:, :1]
    inverse = np.where(kept, 1.0 / np.where(kept, sigma, 1.0), 0.0)
    with np.errstate(invalid="ignore"):
        return np.einsum("mji,mj->mi", z, inverse * np.einsum("mji,mj->mi", y, b))


def _finite(jacobian: Array) -> Array:
    """Matrices of NaN as zeros: LAPACK refuses them; their right-hand sides are NaN too."""
    return np.nan_to_num(jacobian, nan=0.0, posinf=0.0, neginf=0.0)
