"""Krawczyk's test: a ball around an approximate pose with exactly one solution inside.

F(X) = 0 are the residuals of the traced equations over displacements, Euler parameters and
coordinates, and the lengths of the Euler parameters. With an approximate solution X, any matrix Y
near the inverse of F', and B the box of radius r around X, let

    c = |Y F(X)|            largest component
    k = |I - Y F'(B)|       largest row sum

both evaluated in balls. If c + k r < r, B holds exactly one zero of F; its distance from X is at
most c / (1 - k). F' is the derivative of the traced residuals, so nothing relies on the rows of the
solver. The sign of the branch tests proves that the zero is on the intended branch. Velocities and
accelerations follow from F(X(t), t) = 0, expanded in the time: linear systems with the matrix F'.

At a singular pose F' has no inverse, the test cannot succeed, and the sample is reported as not
proved.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...program import Program
from ...trajectory import Array
from .ball_executor import ORDER, Ball, evaluate, flint
from .exact import ExactEquations
from .exact_forces import EnclosedForces, UnprovedError, enclose_forces

# Radii of B to try, in units of the mechanism's size: the largest that succeeds bounds the region
# with a single solution.
RADII = tuple(2.0**-k for k in (7, 14, 21, 28, 35, 42, 49))
# A step of Newton's iteration gains three digits or more, except near a singular pose.
MOST_STEPS = 60
# Steps end this many bits above the working precision, at the level of their own round-off.
SPARE_BITS = 40


@dataclass(frozen=True, eq=False)
class Enclosure:
    """A proved sample.

    Attributes:
        points: position less that of the design [m], velocity [m/s] and acceleration [m/s^2] of
            each point, as balls, shape (3, 3).
        alone: radius of the box with a single solution [units of the mechanism's size, or rad].
        contraction: k of the test in that box: below one.
        left_out: residuals of the rows left out, at the solution: zero if the redundant rows agree.
        branch: the branch tests, all proved positive.
        forces: the forces wanted; None without.
    """

    points: Mapping[str, Sequence[Sequence[Ball]]]
    alone: float
    contraction: float
    left_out: Sequence[Ball]
    branch: Sequence[Ball]
    forces: EnclosedForces | None = None


def enclose(
    equations: ExactEquations,
    pose: Array,
    drives: Sequence[Sequence[Ball]],
    bits: int,
    angles: Sequence[float] = (),
) -> Enclosure:
    """Prove one sample, at the precision of the equations.

    Args:
        pose: approximate state, shape (size,).
        drives: for each moving driver value [units or rad], velocity and acceleration, as exact
            numbers or balls.
        bits: the precision.
        angles: approximate angles of the joints of torsional springs [rad]; forces need them.

    Raises:
        UnprovedError: the pose is singular, too far from a solution, or near one on another branch.
    """
    sample, start = _Sample(equations, drives), [flint().arb(x) for x in pose.tolist()]
    X, c, inverse = _refine(sample, start, bits)
    alone, contraction = _alone(sample, inverse, X, c)
    moved = _float(_largest([x - x0 for x, x0 in zip(X, start, strict=True)]))
    if moved > alone:
        raise UnprovedError(
            f"the solution that Newton's iteration reaches is {moved:.3g} of the mechanism's size"
            f" from the approximate pose, and proved to be the only one within {alone:.3g}: it may"
            " be another one"
        )
    solution = [x + _around(c / (1 - contraction)) for x in X]
    tests, count = sample.tests(solution), len(equations.left_out)
    left_out, branch = tests[:count], tests[count:]
    for value in branch:
        if not value > 0:
            raise UnprovedError(
                "the solution is not on the intended branch, axes are turned over: their cosine is"
                f" {value.str(5)}"
            )
    try:
        inverse = sample.derivative(solution).inv()
    except ZeroDivisionError:
        raise UnprovedError(
            "singular pose: the Jacobian is not proved to have an inverse"
        ) from None
    motion = sample.motion(solution, inverse)
    return Enclosure(
        dict(zip(equations.names, sample.points(motion), strict=True)),
        alone,
        _float(contraction),
        left_out,
        branch,
        sample.forces(motion, inverse, angles),
    )


class _Sample:
    """The equations at the drivers' values of one sample; vectors are columns of balls."""

    def __init__(self, equations: ExactEquations, drives: Sequence[Sequence[Ball]]) -> None:
        self._equations = equations
        arb, series = flint().arb, flint().arb_series
        self._still: list[Ball] = []
        self._moving: list[Ball] = []
        self._speeds = [arb(velocity) for _, velocity, _ in drives]
        self._none: list[Ball] = []
        if (forces := equations.forces) is not None:
            count = 2 * equations.size + forces.rows + len(drives) + len(forces.angles)
            self._none = [arb(0)] * count
        for value, velocity, acceleration in drives:
            half = arb(value) / 2
            self._still += [arb(value), half.cos(), half.sin()]
            moving = series([value, velocity, arb(acceleration) / 2], prec=ORDER)
            self._moving += [moving, (moving / 2).cos(), (moving / 2).sin()]

    def _run(self, name: str, state: Sequence[Ball], drives: Sequence[Ball]) -> dict[int, Ball]:
        inputs = [*state, *drives, *self._none, *self._equations.geometry]
        return evaluate(getattr(self._equations, name), inputs)

    def residuals(self, state: Sequence[Ball]) -> Any:
        """Return F, shape (size, 1)."""
        return _column([*self._run("residuals", state, self._still).values()])

    def derivative(self, state: Sequence[Ball]) -> Any:
        """Return F', shape (size, size)."""
        n = self._equations.size
        matrix = flint().arb_mat(n, n)
        for slot, value in self._run("derivative", state, self._still).items():
            matrix[divmod(slot, n)] = value
        return matrix

    def tests(self, state: Sequence[Ball]) -> list[Ball]:
        """Return the rows left out, then the branch tests."""
        return [*self._run("tests", state, self._still).values()]

    def motion(self, state: Sequence[Ball], inverse: Any) -> list[list[Ball]]:
        """Return the coefficients of the state's series in time.

        Args:
            inverse: of F'.
        """
        coefficients = [list(state)]
        for order in (1, 2):  # the unknown coefficient enters its own order through F' alone
            run = self._run("residuals", _series(coefficients), self._moving)
            rest = [_coefficient(x, order) for x in run.values()]
            coefficients.append((-inverse * _column(rest)).entries())
        return coefficients

    def points(self, motion: Sequence[Sequence[Ball]]) -> list[list[list[Ball]]]:
        """Return displacement, velocity and acceleration of each point, shape (points, 3, 3)."""
        moved = [*self._run("points", _series(motion), self._moving).values()]
        motions = [
            [factor * _coefficient(x, order) for x in moved]
            for order, factor in enumerate((1, 1, 2))
        ]
        return [[each[k : k + 3] for each in motions] for k in range(0, len(moved), 3)]

    def forces(
        self, motion: Sequence[Sequence[Ball]], inverse: Any, angles: Sequence[float]
    ) -> EnclosedForces | None:
        """Return the forces wanted, if any."""
        equations = self._equations
        if equations.forces is None:
            return None
        state, rates, halves = motion

        def run(program: Program, further: Sequence[Ball]) -> list[Ball]:
            inputs = [*state, *self._still, *further, *equations.geometry]
            return [*evaluate(program, inputs).values()]

        return enclose_forces(
            equations.forces,
            equations.kept,
            equations.left_out,
            run,
            (rates, [2 * x for x in halves]),
            self._speeds,
            angles,
            inverse,
        )


def _inverse(sample: _Sample, x: Sequence[Ball]) -> Array:
    """Return the inverse of F' in double precision."""
    try:
        inverse = np.linalg.inv(np.array(sample.derivative(x).tolist(), dtype=np.float64)).astype(
            np.float64
        )
    except np.linalg.LinAlgError:
        raise UnprovedError("singular pose: the Jacobian has no inverse") from None
    if not np.isfinite(inverse).all():
        raise UnprovedError("singular pose: the Jacobian has no finite inverse")
    return inverse


def _refine(sample: _Sample, start: Sequence[Ball], bits: int) -> tuple[list[Ball], Ball, Array]:
    """Return the pose after Newton's iteration, c there, and Y.

    Y is recomputed after a step that gains less than three digits.
    """
    x, inverse, before = list(start), _inverse(sample, start), float("inf")
    for _ in range(MOST_STEPS):
        step = flint().arb_mat(inverse.tolist()) * sample.residuals(x)
        c = _largest(step.entries())
        if c < flint().arb(2) ** (SPARE_BITS - bits):
            return x, c, inverse
        size = _float(c)
        if not size < 0.5 * before:
            break
        x = [(old - change).mid() for old, change in zip(x, step.entries(), strict=True)]
        if size > 1e-3 * before:
            inverse = _inverse(sample, x)
        before = size
    raise _singular(
        f"or no solution near: Newton's iteration stops at steps of {before:.1g}", inverse
    )


def _alone(sample: _Sample, inverse: Array, X: Sequence[Ball], c: Ball) -> tuple[float, Ball]:
    """Return the largest radius for which the test succeeds, and its k."""
    Y, identity, smallest = (
        flint().arb_mat(inverse.tolist()),
        flint().arb_mat(len(X), len(X), 1),
        float("inf"),
    )
    for radius in RADII:
        box = [x + _around(flint().arb(radius)) for x in X]
        rows = (identity - Y * sample.derivative(box)).tolist()
        k = _largest([sum((abs(x) for x in row), flint().arb(0)) for row in rows])
        if c + k * radius < radius:
            return radius, k
        smallest = min(smallest, _float(k))
    raise _singular(
        f"or near one: contraction {smallest:.3g} in the best box, expected below 1", inverse
    )


def _singular(how: str, inverse: Array) -> UnprovedError:
    smallest = 1.0 / float(np.linalg.norm(inverse, 2))
    return UnprovedError(
        f"singular pose, {how}; the smallest singular value of the Jacobian is {smallest:.2g}"
    )


def _column(values: Sequence[Ball]) -> Any:
    return flint().arb_mat(len(values), 1, list(values))


def _series(coefficients: Sequence[Sequence[Ball]]) -> list[Ball]:
    return [flint().arb_series(list(x), prec=ORDER) for x in zip(*coefficients, strict=True)]


def _coefficient(x: Ball, order: int) -> Ball:
    """Return a coefficient of a series; outputs independent of the time are constants."""
    if isinstance(x, flint().arb_series):
        return x[order]
    return x if order == 0 else flint().arb(0)


def _largest(values: Sequence[Ball]) -> Ball:
    """Return an upper bound of all |value|; infinite if a ball is not finite."""
    if not all(value.is_finite() for value in values):
        return flint().arb.pos_inf()
    return max((value.abs_upper() for value in values), default=flint().arb(0))


def _around(radius: Ball) -> Ball:
    """Return the ball of a radius around zero."""
    return flint().arb(0, radius.abs_upper())


def _float(x: Ball) -> float:
    """Return an upper bound as a float, for messages."""
    return float(np.nextafter(float(x.abs_upper()), np.inf))
