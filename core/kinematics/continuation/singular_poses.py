"""Singular poses: distance from one, dependent rows, motions possible with the drivers held, and
the passage over one.

J is the Jacobian of the kept rows, in units with rows and unknowns of size one. Its smallest
singular value sigma belongs to a motion z of all bodies, hardly resisted by the rows, J z = sigma
y, and to a nearly dependent combination y of rows. If the rows of the joints alone are independent,
a driver is among those of y: it has come to the end of its travel (lock-up, a limit point of the
motion). If they are not, the motion may continue in several ways (bifurcation).

The equations at the pose do not determine it, but the motion is smooth there. Eight poses around
it, followed from before to beyond, give it by Lagrange's formula. If they belong to two different
motions, or the motion turns back, the formula does not hold or there are no eight. If the motion
turns a corner too narrow for these poses, or has a gap as narrow, the last followed pose before the
singular one does not lie on the polynomial.

`pass_over` is for every solver that can go from a pose to a time; `bridge` is it for one program.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import shortened
from ...mechanism.motions import Path
from ...trajectory import QUANTITIES, Array
from ..compiled.compiled_model import Model
from ..compiled.dense_equations import System, system_of
from ..compiled.request import FROM, RATE, SIGMA, TESTS, TIME, slots_of
from ..compiled.routes import Route
from ..formulation.acceptance_criteria import AMPLIFIED, EPSILON, WORSE
from .pseudo_arclength import PLACES
from .walk import follow_samples, lane_at_start, time_of

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
        owners = list_names(self.owners)
        if self.regular:
            return (
                f"smallest singular value {self.sigma:.3g} of the rows that were chosen at the"
                f" design position, of {owners}, and {self.of_all:.3g} of all rows:"
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
            f" {owners}; free to first order with the drivers held: {list_names(how)}"
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


def list_names(names: Sequence[str]) -> str:
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


def examine_lane(route: Route, lane: Array, time: float) -> Singularity:
    """Return the singularity nearest to the pose of a lane, with the drivers at a time."""
    system = system_of(route.model)
    return examine(system, system.state(lane[:, None]), route.sampled(np.array([time])))


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
        state = system.stepped(best, -_least_solution(found.jacobian, found.phi).T)
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
    rate = _least_solution(found.jacobian, found.nu)
    gamma = system.gamma(state, sample, rate.T)[[*system.tracer.selection.chosen]]
    return rate, _least_solution(found.jacobian, gamma.T)


def _least_solution(jacobian: Array, b: Array) -> Array:
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


# The motion from each of the eight to the next [units of the mechanism's size, rad]. Long ways cost
# accuracy by the motion's curvature, short ones by the poses' own nearness to the singular one; the
# first that is accurate enough is taken.
NODES = (0.02, 0.01, 0.005, 0.002)
# Lagrange's weights at the middle of the eight, and of the inner six: the values differ by the
# error of the latter. Rounding adds up to 2.7 times its size in a value, to 0.46 times in the
# difference, which may be less by chance: thirty differences cover both.
EIGHT = np.array([-1.0, 8.0, -28.0, 56.0, 56.0, -28.0, 8.0, -1.0]) / 70.0
SIX = np.array([0.0, 1.0, -6.0, 15.0, 15.0, -6.0, 1.0, 0.0]) / 20.0
COVERED = 30.0
# A smallest singular value above this part of its largest is sound enough to look over a singular
# pose from.
SOUND = 0.1
# Of all states and rates, whatever is wanted of them, it is enough to see that they are on one
# curve: other assemblies are farther off.
SMOOTH = 1e-7
# The last pose before is followed to where rounding leaves rates uncertain by a hundredth: itself
# by this.
NEARLY = 1e-7
# Number of the first of the eight that is beyond.
BEYOND = 4


class Numbers(NamedTuple):
    """A pose as numbers: its state, and the rates of it with their rates."""

    state: Array
    rates: Array


@dataclass(frozen=True, eq=False)
class Anchor:
    """A pose of a motion that goes on from it.

    Attributes:
        time: of the pose on its path [s].
        pose: as its solver keeps it.
        motions: the wanted motions there, shape (rows,); none if they were not taken along.
        error: a bound of its error by its tests [units].
    """

    time: float
    pose: Any
    _numbers: Callable[[Any], Numbers]
    motions: Array = field(default_factory=lambda: np.empty(0))
    error: float = 0.0

    @property
    def numbers(self) -> Numbers:
        """The numbers of the pose."""
        return self._numbers(self.pose)


@dataclass(frozen=True, eq=False)
class PassedSingularity:
    """A singular pose on a motion.

    Attributes:
        poses: eight around it, half of them beyond.
        motions: those wanted, interpolated there, shape (rows,).
        error: bound of their errors: of the pose by the mechanism's size, of rates by their own.
    """

    poses: Sequence[Anchor]
    motions: Array
    error: float


Reach = Callable[[Anchor, float, bool], Anchor | None]
"""Goes from a pose to a time, over a singular pose if that is true; None if it is out of reach."""


def pass_over(
    sound: Anchor,
    near: tuple[Array, float] | None,
    time: float,
    way: float,
    reach: Reach,
    measure: Callable[[Array, float], float],
    limit: float,
) -> PassedSingularity | None:
    """Return the passage over a singular pose, or None if the motion is not known to go on, or not
    well enough.

    Args:
        sound: the last pose far from singular.
        near: state of the last followed pose at or right before the singular one, and its error: it
            must be on the same curve. Without one, the interpolated pose may be accepted, but not
            the continuation of the motion.
        time: of the singular pose.
        way: its sign is the direction of the motion.
        measure: bounds the errors of motions interpolated between eight, shape (rows, 8), at a
            largest rate, see `interpolation_error`.
        limit: of the errors.
    """
    speed = float(np.abs(sound.numbers.rates).max(initial=0.0))
    for node in NODES if speed > 0.0 else ():
        poses = _eight(sound, time + np.copysign(node / speed, way) * PLACES, reach)
        if poses is None:
            continue
        whole, state, rates = (
            np.stack(each, axis=1)
            for each in zip(*((pose.motions, *pose.numbers) for pose in poses), strict=True)
        )
        smooth = all(
            np.abs(x @ (EIGHT - SIX)).max() <= SMOOTH * max(1.0, np.abs(x).max())
            for x in (state, rates)
        )
        error = max(*(pose.error for pose in poses), measure(whole, speed))
        middle, on_curve = state @ EIGHT, True
        if near is not None:
            known = COVERED * np.abs(state @ (EIGHT - SIX)) + near[1]
            on_curve = (np.abs(middle - near[0]) <= known).all()
        if smooth and error <= limit and on_curve:
            return PassedSingularity(poses, whole @ EIGHT, error)
    return None


def _eight(sound: Anchor, times: Array, reach: Reach) -> Sequence[Anchor] | None:
    here, found = sound, list[Anchor]()
    for k, time in enumerate(times.tolist()):
        after = reach(here, time, k == BEYOND)
        if after is None:
            return None
        found.append(here := after)
    return found


def onward(model: Model, lane: Array, path: Path) -> Route:
    """Return the route from a lane on a path along it."""
    return Route(model, path, lane_at_start(model, lane), time_of(model, lane))


def bridge(
    route: Route, lane: Array, time: float, tol: float, near: Array | None, *, rates: bool = True
) -> PassedSingularity | None:
    """Pass a time on a route, from a lane; see `pass_over`. Its motions are the kept rows
    (`Model.rows`).

    Args:
        near: last followed lane.
        rates: whether they are wanted there too. A passage needs only the pose, even if the request
            wants rates elsewhere.
    """
    model, known = route.model, None
    state = slots_of(model.vectors, (FROM + name for name in model.state))

    def numbers(lane: Array) -> Numbers:
        return Numbers(lane[state], lane[model.vectors[FROM + RATE]])

    def reach(at: Anchor, time: float, crossing: bool) -> Anchor | None:
        there = replace(route.path, times=np.array([time]))
        found = follow_samples(onward(model, at.pose, there), tol, {0}, crossing=crossing)
        if not found.visited:
            return None
        closure, sigma = (found.kept[model.rows[name].start, 0] for name in ("closure", SIGMA))
        error = WORSE * float(max(closure, EPSILON) / sigma)
        after = found.visited[0]
        return Anchor(time_of(model, after), after, numbers, found.kept[:, 0], error)

    if near is not None:
        system, at = system_of(model), near[[model.slots[FROM + TIME]]]
        solved = solve_closely(system, system.state(near[:, None]), route.sampled(at))
        known = solved.state[:, 0], WORSE * float(solved.error[0, 0])
    sound = Anchor(time_of(model, lane), lane, numbers)
    measure = partial(interpolation_error, model.rows, model.frame.unit, rates=rates)
    return pass_over(sound, known, time, time - sound.time, reach, measure, AMPLIFIED * tol)


ORDERS = {"velocity": 1, "rdot": 1, "omega": 1, "acceleration": 2, "rddot": 2, "omega_t": 2}


def interpolation_error(
    rows: Mapping[str, slice], unit: float, whole: Array, speed: float, *, rates: bool = True
) -> float:
    """Return a bound of the errors of motions interpolated between eight poses: of positions by the
    mechanism's size, of rates by their own.

    Args:
        rows: of every motion; tests are left out.
        unit: the mechanism's size [m].
        whole: the motions at the poses, shape (rows, 8).
        speed: largest rate of the unknowns.
        rates: whether they are wanted.
    """
    differences, off = np.abs(whole @ (EIGHT - SIX)), 0.0
    for name, at in rows.items():
        label = name.split(" ")[0]
        order = ORDERS.get(label, 0)
        if label in TESTS or (order and not rates):
            continue
        length = unit if label in (*QUANTITIES, "r", "rdot", "rddot") else 1.0
        own = float(np.abs(whole[at]).max()) if order else 0.0
        off = max(off, COVERED * float(differences[at].max()) / max(own, length * speed**order))
    return off
