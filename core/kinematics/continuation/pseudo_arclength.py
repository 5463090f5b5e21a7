"""Follow the curve of poses by its length, not by a driver: beyond lock-ups, at which the driver
turns back, and over bifurcations.

Pseudo-arclength continuation. The unknowns are the pose q and the path's time t. A step of length h
along the tangent (dq, dt), |dq| = 1 [units of the mechanism's size, rad], is corrected across the
tangent by Newton's iteration on

    phi(q, t) = 0,   dq . (q - q_predicted) = 0        Jacobian  B = [ J  -nu ; dq^T  0 ]

B is regular at limit points, J is not. Limit points are zeros of dt along the curve. At
bifurcations [J -nu] loses rank, and the determinant of B changes its sign if an odd number of
branches cross. Without a bifurcation it keeps its sign, so a step with a change of sign where the
branches miss each other has gone over to the other one: shorter steps follow the bend between them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np

from ...mechanism.motions import Path
from ...trajectory import Array
from ..compiled.dense_equations import Equations, System
from ..compiled.request import CONSISTENT
from ..formulation.acceptance_criteria import LARGEST_DEVIATION

# The tangent turns by less than this [rad] in a step, so that the correction is a tenth of it:
# another branch is farther away.
LARGEST_TURN = 0.2
COSINE = np.cos(LARGEST_TURN)
# A curve that turned by more than this since a bifurcation ahead of it was in doubt has bent away
# from it: three times what a step may turn.
BENT = np.cos(3.0 * LARGEST_TURN)
# A step below this is round-off beside the residuals that are corrected.
SHORTEST = 1e-9
CORRECTIONS = 10
# False position gains a digit and more each time. The driver is stationary at a limit point: where
# dt is this, by the motion per length, the driver's value is off by the square of it.
REFINEMENTS, ROUNDING = 40, 1e-12
# Where no such spot is found because the curve branches there too, it is off by more than this.
STATIONARY = 1e-9
# Beside a bifurcation, poses are taken at multiples of this: there sigma, about as large, costs two
# digits, and a polynomial through eight of them is exact to about 1e-16.
NODE = 0.01
PLACES = np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
"""Eight places around a singular pose, in parts of a way beside it."""
# Cubics through the four nodes on either side are off by about NODE ** 4 where the nodes begin:
# their zeros meet at a bifurcation.
MEETS = 1e-6
# A step is at most this long [units of the mechanism's size, rad]: poses far enough apart to be
# cheap, near enough to be drawn.
LONGEST = 0.05
# A march that fails is left this near [units of the mechanism's size, rad] to the limit point that
# stopped it, or it was something else.
NEARBY = 0.5
# Ten times the steps that such a way takes; equations whose rows are wrong would have it creep on
# and on.
ATTEMPTS = 100


@dataclass(frozen=True, eq=False)
class CurvePoint:
    """A pose on the curve.

    Attributes:
        state: shape (numbers, 1).
        time: of the path.
        dq, dt: unit tangent, shape (n,), and its component along time.
        arc: length from the beginning of the walk.
        sigma: smallest singular value of [J -nu]: zero at branch points.
        sign: of the determinant of B.
    """

    state: Array
    time: float
    dq: Array
    dt: float
    arc: float
    sigma: float
    sign: float


@dataclass(frozen=True, eq=False)
class NearbyPoint:
    """A singular pose on the curve: its length and time, and the nearest spot reached by
    corrections.
    """

    spot: CurvePoint
    arc: float
    time: float


class ArclengthWalk:
    """Steps along the curve of poses of a system on a path."""

    def __init__(self, system: System, path: Path, tol: float) -> None:
        self.system, self.path, self.tol = system, path, tol

    def sample(self, time: float) -> Array:
        """Return a sample of the drivers, shape (sampled, 1)."""
        return self.system.samples(self.path, np.array([time]))

    def begin(self, state: Array, time: float, direction: float) -> CurvePoint:
        """A pose as the first of a walk, with time growing or falling from there.

        Raises:
            np.linalg.LinAlgError: the pose is singular to the last digit: it says no direction.
        """
        found = self.system.equations(state, self.sample(time))
        dq = direction * _solution(found.jacobian[0], found.nu[0])
        return _spot(found, state, time, dq / np.linalg.norm(dq), 0.0)

    def advance(self, spot: CurvePoint, h: float) -> CurvePoint | None:
        """Return the pose at about the length h from a spot; None if corrections do not converge
        nearby, or not to a solution.

        Corrections are across the tangent of the spot: h is measured along it.
        """
        state = self.system.stepped(spot.state, h * spot.dq[:, None])
        time, moved, closure = spot.time + h * spot.dt, 0.0, np.inf
        found = self.system.equations(state, self.sample(time))
        for _ in range(CORRECTIONS):
            if not found.closure[0] < 0.5 * closure:
                break  # the last step gained nothing: rounding
            closure = float(found.closure[0])
            try:
                across = _border(found.jacobian[0], found.nu[0], spot.dq)
                step = _solution(across, np.append(-found.phi[0], 0.0))
            except np.linalg.LinAlgError:
                return None
            moved += float(np.abs(step[:-1]).max())
            if moved > LARGEST_DEVIATION * abs(h) + self.tol:
                return None
            state, time = self.system.stepped(state, step[:-1, None]), time + float(step[-1])
            found = self.system.equations(state, self.sample(time))
        try:
            after = _spot(found, state, time, spot.dq, spot.arc + h)
        except np.linalg.LinAlgError:
            return None
        return after if self._is_solution(after) else None

    def _is_solution(self, spot: CurvePoint) -> bool:
        zero, sample = np.zeros((self.system.unknowns, 1)), self.sample(spot.time)
        tests = self.system.equations(spot.state, sample)
        (branch,) = self.system.outputs(spot.state, sample, zero, zero)["branch"]
        closure, leftover = tests.closure[0], tests.leftover[0]
        return bool(
            closure <= self.tol and leftover <= max(CONSISTENT, self.tol) and branch[0] > 0.0
        )

    def spots_after(
        self, spot: CurvePoint, length: float, longest: float, attempts: int | None = None
    ) -> Iterator[CurvePoint]:
        """Yield spots after one, up to a length from the beginning of the walk; stop early if steps
        get too short or too many.
        """
        h = 0.1 * longest
        for _ in count() if attempts is None else range(attempts):
            if spot.arc >= length:
                return
            after = self.advance(spot, min(h, length - spot.arc))
            turn = np.arccos(min(1.0, float(after.dq @ spot.dq))) if after else np.inf
            if after is None or turn > LARGEST_TURN:
                h *= 0.5
                if h < SHORTEST:
                    return
                continue
            if after.sign != spot.sign and (bend := self._bend(spot, after)):
                yield from bend
                spot, h = bend[-1], bend[-1].arc - (bend[-2] if bend[1:] else spot).arc
                continue
            h = min(longest, h * float(np.clip(0.5 * LARGEST_TURN / max(turn, 1e-9), 0.5, 2.0)))
            spot = after
            yield spot

    def _bend(self, before: CurvePoint, after: CurvePoint) -> list[CurvePoint]:
        """Return spots round the bend that a step with a change of sign cut off; empty if there is
        none, and the branches meet within the tolerance.
        """
        spots, spot, h = list[CurvePoint](), before, 0.5 * (after.arc - before.arc)
        while h >= np.sqrt(self.tol):  # of branches nearer to each other, each solves the equations
            ahead = self.advance(spot, h)
            if ahead is None or ahead.sign != spot.sign or ahead.dq @ spot.dq < COSINE:
                h *= 0.5
                continue
            spot, h = ahead, 1.5 * h
            spots.append(spot)
            if spot.dq @ before.dq < BENT or spot.arc > 2.0 * after.arc - before.arc:
                return spots
        return []

    def limit(self, before: CurvePoint, after: CurvePoint) -> NearbyPoint:
        """Return the turning point of the driver between two spots: the zero of dt, by false
        position (Illinois), to round-off.

        If the curve also branches there, corrections do not converge: the zero is interpolated.
        """
        a, b, f_a, f_b = 0.0, after.arc - before.arc, before.dt, after.dt
        # which end the last spot replaced: an end that stays twice weighs half
        last_b: bool | None = None
        best = min(before, after, key=lambda spot: abs(spot.dt))
        for _ in range(REFINEMENTS):
            h = (a * f_b - b * f_a) / (f_b - f_a)
            spot = self.advance(before, h)
            if spot is None:
                break
            best = min(best, spot, key=lambda spot: abs(spot.dt))
            if abs(spot.dt) <= ROUNDING:
                break
            is_b = (spot.dt > 0.0) == (f_b > 0.0)
            weight = 0.5 if is_b is last_b else 1.0
            a, f_a, b, f_b = (
                (a, weight * f_a, h, spot.dt) if is_b else (h, spot.dt, b, weight * f_b)
            )
            last_b = is_b
        far = abs(best.dt) > STATIONARY
        if far and (nodes := self.nodes(before, after, best.arc - before.arc)) is not None:
            offsets, spots = nodes
            root = root_near(offsets, np.array([spot.dt for spot in spots]))
            if np.isfinite(root):
                return NearbyPoint(best, best.arc + root, time_between(offsets, spots, root))
        return NearbyPoint(best, best.arc, best.time)

    def nodes(
        self, before: CurvePoint, after: CurvePoint, centre: float
    ) -> tuple[Array, list[CurvePoint]] | None:
        """Return spots on both sides of a length from the first, and their lengths; None if any is
        not reached.
        """
        offsets = min(NODE, 0.125 * (after.arc - before.arc)) * PLACES
        found = [self.advance(before, centre + offset) for offset in offsets.tolist()]
        spots = [spot for spot in found if spot is not None]
        return (offsets, spots) if len(spots) == len(found) else None


def _spot(found: Equations, state: Array, time: float, along: Array, arc: float) -> CurvePoint:
    """Return a pose with its tangent.

    Args:
        found: equations at the pose.
        along: the tangent has a positive component along this, shape (n,).

    Raises:
        np.linalg.LinAlgError: the curve has no single tangent there.
    """
    bordered = _border(found.jacobian[0], found.nu[0], along)
    tangent = _solution(bordered, np.append(np.zeros(len(along)), 1.0))
    tangent /= np.linalg.norm(tangent[:-1])
    sigma = float(np.linalg.svd(bordered[:-1], compute_uv=False)[-1])
    sign = float(np.linalg.slogdet(_border(found.jacobian[0], found.nu[0], tangent[:-1]))[0])
    return CurvePoint(state, time, tangent[:-1], float(tangent[-1]), arc, sigma, sign)


def _border(jacobian: Array, nu: Array, dq: Array) -> Array:
    n = len(dq)
    found = np.zeros((n + 1, n + 1))
    found[:n, :n], found[:n, n], found[n, :n] = jacobian, -nu, dq
    return found


def _solution(matrix: Array, b: Array) -> Array:
    return np.asarray(np.linalg.solve(matrix, b), dtype=np.float64)


def time_between(offsets: Array, spots: Sequence[CurvePoint], at: float) -> float:
    """The time at an offset among spots, interpolated."""
    times = [spot.time for spot in spots]
    return float(np.polynomial.Polynomial.fit(offsets, times, len(times) - 1)(at))


def root_near(x: Array, y: Array) -> float:
    """Return the zero nearest to zero of the polynomial through points, or NaN."""
    roots = np.polynomial.Polynomial.fit(x, y, len(x) - 1).roots()
    real = roots.real[np.abs(roots.imag) <= MEETS]
    return float(real[np.abs(real).argmin()]) if len(real) else np.nan


def limit_ahead(
    system: System, path: Path, state: Array, time: float, direction: int, tol: float
) -> NearbyPoint | None:
    """Return the limit point close ahead of a pose in a direction of time, or None."""
    walk = ArclengthWalk(system, path, tol)
    try:
        spot = walk.begin(state, time, direction)
    except np.linalg.LinAlgError:
        return None
    for after in walk.spots_after(spot, NEARBY, LONGEST, ATTEMPTS):
        if turns_back(spot, after):
            return walk.limit(spot, after)
        spot = after
    return None


def turns_back(before: CurvePoint, after: CurvePoint) -> bool:
    """Return whether the driver's value is stationary between two spots; a spot counts once."""
    return (before.dt < 0.0) != (after.dt < 0.0)
