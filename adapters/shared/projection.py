"""Projection mode, shared by the simulators: one Newton loop over the samples with their residuals
and Jacobians.

The loop walks from the design position in both directions, with a predictor of second order.
Residual and finiteness decide on convergence, never a simulator's status; a step without
convergence, or to another assembly, is halved.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.case.case import Case, size
from ...core.errors import SolveError
from ...core.failures import FailureKind, PoseFailure
from ...core.kinematics import (
    LONGEST_TURN,
    ROUNDING,
    Start,
    continuous,
    is_continuation,
    regular_between,
    solve_from_start,
    start_of,
)
from ...core.mechanism.motions import Path, outwards
from ...core.trajectory import Array, PointMotion, Trajectory, largest_found
from .equivalents import GLOBAL, OwnFrame
from .force_solution import solved_forces
from .projection_model import ProjectionModel, SolvedPose

# Newton steps after one predictor of second order, by effort; None iterates to convergence.
EFFORTS: Mapping[str, int | None] = {
    "predictor only": 0,
    "1 Newton step": 1,
    "2 Newton steps": 2,
    "until converged": None,
}
# A failing step shorter than this fraction of the sample distance is the end of the motion, not a
# coarse grid. Change points missed by a fraction d of the size need steps of the root of d; with
# 2^-10, misses of 1e-8 would count as ends, or be passed over.
SMALLEST_STEP = 2.0**-20
# If a singular value of the Jacobian may have been zero on the way, a step is shortened to this
# fraction of the sample distance before it is accepted. Near a fold the motion turns back, while
# another assembly goes straight on. A motion that passes a singular pose passes it in such a step.
# The fraction is a few times the smallest step, so that the walk can still approach a pose that
# fails there. Closer to a singular pose than the root of round-off, rounding would choose the
# assembly.
FOLD = 8.0 * SMALLEST_STEP


def solve_by_projection(
    model: ProjectionModel,
    case: Case,
    tol: float,
    details: Mapping[str, Any] | None = None,
    corrections: int | None = None,
    frame: OwnFrame = GLOBAL,
) -> Trajectory:
    """Solve all samples of the case with the model; see `Engine.solve`.

    Args:
        corrections: exact number of Newton steps after the predictor, whatever the residual; None
            iterates until the residual meets tol.
        frame: the frame of the mechanism in the model.
    """
    walk, mechanism = Walk(model, case, tol, corrections, frame), case.mechanism
    start, exact = start_of(mechanism, walk.path), corrections is None
    return solve_from_start(
        *(start, mechanism, walk.path),
        lambda each: walk.trajectory(details or {}, each),
        compare=exact,
    )


MAX_ITERATIONS = 20
# Singular values below this fraction of the largest count as zero: far above round-off (1e-15), far
# below a regular mechanism (1e-2).
RANK_TOLERANCE = 1e-9
# Step at which least squares have converged: the remaining residual comes from contradictory rows.
ARRIVED = 1e-6
# After a step of this size the next is about its square. The factors of before turn that by about
# the size once more, below round-off.
NEAR = 1e-5
# Largest error of a pose that counts as round-off, of unknowns of size one.
EXACT = 4.0 * float(np.finfo(np.float64).eps)

LOST = PoseFailure(FailureKind.NOT_FOUND)
"""Failure of a pose without a known cause."""


@dataclass(frozen=True, eq=False)
class Sample(SolvedPose):
    """A solved pose with all data for the next step of the walk."""

    t: float
    x: Array
    rows: tuple[Array, Array, Array]
    jacobian: Array
    inverse: Array  # of the Jacobian
    corrected: Array


class Walk:
    """Newton's method on the rows of a model, and the walk along the motion of a case, sample by
    sample.
    """

    def __init__(
        self,
        model: ProjectionModel,
        case: Case,
        tol: float,
        corrections: int | None = None,
        frame: OwnFrame = GLOBAL,
    ) -> None:
        self.model, self.case, self.tol, self.corrections, self.frame = (
            model,
            case,
            tol,
            corrections,
            frame,
        )
        self.drivers = [driver.name for driver in case.mechanism.drivers]
        self.turns = np.array([driver.turns for driver in case.mechanism.drivers], dtype=np.bool_)
        self.units = np.where(self.turns, 1.0, frame.unit)[:, None]
        # the samples at once, because each call costs more than its values
        self.path = case.sweep.path
        samples = self.drive(self.path, self.path.times)
        self.driven = {float(t): samples[..., k] for k, t in enumerate(self.path.times)}
        self.size = size(case) / frame.unit
        self.lost = LOST  # failure of the last pose that was not found
        self.ended, self.failures = list[str](), list[FailureKind]()
        model.reset()
        model.residual(np.zeros(len(case.mechanism.drivers)))
        jacobian = model.jacobian()
        singular = np.linalg.svd(jacobian, compute_uv=False)
        self.rank = int((singular > RANK_TOLERANCE * singular[0]).sum())
        joints = jacobian[~np.any(model.driver_columns(), axis=1)]
        self.dof = jacobian.shape[1] - (
            int(np.linalg.matrix_rank(joints, tol=RANK_TOLERANCE * singular[0]))
            if len(joints)
            else 0
        )
        self.square = jacobian.shape == (self.rank, self.rank)
        self.rows, self.unknowns = jacobian.shape
        self.lapack: Any = importlib.import_module("scipy.linalg.lapack")
        if self.rank < self.unknowns:
            raise SolveError(
                f"case {case.name!r}: {self.unknowns - self.rank} of the {self.unknowns}"
                " coordinates of the simulator's model are left free at the design position. Add a"
                " driver or a joint. If their number is right, a driver cannot move it there (a"
                " lock-up): give the design in another pose",
                FailureKind.FREE,
            )

    def drive(self, path: Path, times: Array) -> Array:
        """Return values, rates and accelerations of the drivers in the units of the rows, shape (3,
        drivers, times).
        """
        return path.drive(self.drivers, times) / self.units

    def inverse(self, A: Array) -> Array | None:
        """Return the inverse of a matrix of the rows, or of its least squares; None if singular.

        The matrix may not be square, because point closures of a planar loop are redundant.
        """
        if not self.square:
            return self._least_squares(A, np.eye(self.rows))
        # LAPACK's solver of many right-hand sides starts threads, even for a few unknowns
        lu, pivots, singular = self.lapack.dgetrf(A)
        return None if singular else self.lapack.dgetri(lu, pivots)[0]

    def _least_squares(self, A: Array, b: Array) -> Array:
        # QR decomposition with a choice of columns
        free, work = np.zeros((self.unknowns, 1), dtype=np.int32), 64 * (self.rows + self.unknowns)
        return self.lapack.dgelsy(A, b, free, RANK_TOLERANCE, work)[1][: self.unknowns]

    def _step(self, r: Array, *, again: bool) -> Array:
        """Return Newton's step for residuals, with the factors of the last step again or not."""
        if not self.square:
            return self._least_squares(self.model.jacobian(), -r)
        if not again:
            self.factors = self.lapack.dgetrf(self.model.jacobian())
        lu, pivots, singular = self.factors
        step = math.nan * r if singular else self.lapack.dgetrs(lu, pivots, -r)[0]
        return np.asarray(step, dtype=np.float64)

    def newton(self, c: Array) -> tuple[Array, int, float] | None:
        """Return the sum of all steps, the iterations and the last residual at driver values c, or
        None.
        """
        self.lost, met = LOST, False
        worst, moved = 0.0, math.inf
        corrected = np.zeros(self.unknowns)
        for iteration in range(MAX_ITERATIONS):
            r, before = self.model.residual(c), worst
            worst = float(np.abs(r).max())
            if not math.isfinite(worst):
                return None
            if iteration == self.corrections:
                return corrected, iteration, worst
            if self.corrections is None:
                # the error is about the last step times the ratio of its residuals; if it is not
                # round-off, one more step makes it so, as convergence is quadratic
                exact = moved * worst <= EXACT * before
                if worst <= self.tol and (met or exact):
                    return corrected, iteration, worst
                if met:
                    break
                met = worst <= self.tol
            step = self._step(r, again=self.corrections is None and moved <= NEAR)
            moved = float(np.abs(step).max())
            if not math.isfinite(moved):
                return None
            self.model.move(step)
            corrected += step
        if worst <= ROUNDING:
            self.lost = PoseFailure(FailureKind.BELOW_ROUNDING, worst, self.tol)
        elif not self.square and moved <= ARRIVED:
            self.lost = PoseFailure(FailureKind.NO_POSE, worst, self.tol)
        return None

    def solve(self, path: Path, t: float) -> Sample | None:
        """Return the pose with its rates on a path at time t, starting from the current pose, or
        None.
        """
        known = self.driven.get(t) if path is self.path else None
        c, c_t, c_tt = self.drive(path, np.array([t]))[..., 0] if known is None else known
        done = self.newton(c)
        if done is None:
            return None
        corrected, iterations, residual = done
        jacobian, columns = np.array(self.model.jacobian()), self.model.driver_columns()
        nu = columns @ c_t
        if (inverse := self.inverse(jacobian)) is None:
            return None
        v = inverse @ nu
        gamma = columns @ c_tt - self.model.bias(v)
        a = inverse @ gamma
        # least squares would hide rates that do not satisfy the rows (a driver at a dead centre)
        if not (_satisfies(jacobian, v, nu) and _satisfies(jacobian, a, gamma)):
            self.lost = PoseFailure(FailureKind.DEAD_CENTRE)
            return None
        position, velocity, acceleration = (
            np.array(each, dtype=float) for each in zip(*self.model.points(v, a), strict=True)
        )
        return Sample(
            self.model.save(),
            c,
            v,
            a,
            iterations,
            residual,
            t,
            position.ravel(),
            (position, velocity, acceleration),
            jacobian,
            inverse,
            corrected,
        )

    def advance(self, path: Path, start: Sample, t: float, step: float) -> tuple[Sample, bool]:
        """Walk a path from start to time t with halved steps after failures; return the end, and
        whether it is at t.

        Args:
            step: time between samples; zero if all samples are at one time.
        """
        at, h = start, t - start.t
        while at.t != t:
            to = t if abs(t - at.t) <= abs(h) else at.t + h
            dt = to - at.t
            self.model.restore(at.saved)
            self.model.move(self.prediction(at, dt))
            new, whole = self.solve(path, to), step or abs(t - start.t)
            short = abs(dt) <= FOLD * whole
            if (
                new is not None
                and self.is_connected(at, new)
                and (short or self.is_regular(at, new))
            ):
                at, h = new, 2.0 * h
            else:
                h = 0.5 * min(abs(h), abs(t - at.t)) * math.copysign(1.0, h)
                if abs(h) < SMALLEST_STEP * whole:
                    return at, False
        return at, True

    @staticmethod
    def prediction(at: Sample, dt: float) -> Array:
        """Return the change of the unknowns over a time, to second order."""
        return dt * (at.v + (0.5 * dt) * at.a)

    def is_connected(self, at: Sample, new: Sample) -> bool:
        """Return whether output points and coordinates moved between two poses by their rates.

        At rest they do not show full turns of a driver, so turns have a separate limit.
        """
        if np.abs(new.c - at.c)[self.turns].max(initial=0.0) > LONGEST_TURN:
            return False
        dt = np.float64(new.t - at.t)
        watched = continuous(new.x - at.x, new.rows[1].ravel(), at.rows[1].ravel(), dt, self.size)
        change = self.prediction(at, float(dt)) + new.corrected
        everything = continuous(change, new.v, at.v, dt, self.size)
        return bool(watched & everything) and is_continuation(change, new.v, at.v, dt)

    def is_regular(self, at: Sample, new: Sample) -> bool:
        """Return whether no singular value of the Jacobian can have been zero between two poses."""
        return regular_between(at.inverse @ new.jacobian)

    def start(self, path: Path, begin: Start) -> tuple[Sample | None, str]:
        """Return the first pose of the walk, or None with the reason."""
        self.model.reset()
        design = self.solve(begin.lead, 0.0) if begin.lead else self.solve(path, begin.time)
        if design is None:
            match self.lost.kind:
                case FailureKind.DEAD_CENTRE:
                    return None, f"at the design position the {self.lost}"
                case FailureKind.NOT_FOUND:
                    why = "the model does not close there"
                case _:
                    why = str(self.lost)
            return None, f"no assembly at the design position: {why}"
        if begin.lead is None:
            return design, ""
        first, reached = self.advance(begin.lead, design, 1.0, 1.0)
        if not reached:
            return (
                None,
                (
                    f"the drivers reach only {first.t:.3g} of the way from the design to"
                    f" {begin.name}: {self.lost}; start nearer"
                ),
            )
        self.model.restore(first.saved)
        found = self.solve(path, begin.time)
        return (
            found,
            (
                ""
                if found
                else (
                    f"the pose at {begin.name} is reached, but its drivers cannot move there (a"
                    " dead centre)"
                )
            ),
        )

    @property
    def kind_at_start(self) -> FailureKind:
        """Return the kind of a failure at the start."""
        return FailureKind.NOT_CLOSED if self.lost.kind is FailureKind.NOT_FOUND else self.lost.kind

    def follow_samples(self, origin: Sample) -> Iterator[tuple[int, Sample]]:
        """Yield the samples reached from a pose, outwards; `ended` and `failures` have the ends."""
        path, times = self.path, self.path.times
        step = (
            float(np.abs(np.diff(times)).max()) if len(times) > 1 else abs(float(times[0])) or 1.0
        )
        for side in outwards(times, origin.t):
            at = origin
            last: float | None = None
            for k in side:
                at, reached = self.advance(path, at, float(times[k]), step)
                if not reached:
                    self.ended.append(path.end_message(at.t, float(times[k]), last, str(self.lost)))
                    self.failures.append(self.lost.kind)
                    break
                last = float(times[k])
                yield int(k), at

    def trajectory(self, details: Mapping[str, Any], begin: Start) -> Trajectory:
        path, points = self.path, self.case.points
        self.ended, self.failures = list[str](), list[FailureKind]()
        n = len(path.times)
        motion = np.full((3, n, len(points), 3), np.nan)
        iterations, residual = np.zeros(n, dtype=np.int64), np.zeros(n)
        samples = dict[int, Sample]()
        solved = np.zeros(n, dtype=np.bool_)
        origin, message = self.start(path, begin)
        if origin is None:
            self.ended.append(message)
            self.failures.append(self.kind_at_start)
        else:
            for k, at in self.follow_samples(origin):
                motion[:, k] = at.rows
                iterations[k], residual[k], solved[k] = at.iterations, at.residual, True
                samples[k] = at
        unit = self.frame.unit
        position, velocity, acceleration = (
            self.frame.back(motion[0]),
            unit * motion[1],
            unit * motion[2],
        )
        moves = {
            name: PointMotion(position[:, k], velocity[:, k], acceleration[:, k])
            for k, name in enumerate(points)
        }
        facts = {
            "rank": self.rank,
            "dof": self.dof,
            "unknowns": self.unknowns,
            "length_unit": unit,
            "origin": [*self.frame.origin],
            **details,
        }
        forces = None
        if self.case.forces:
            forces = solved_forces(self.model, self.case, samples, unit)
            self.ended += filter(None, [forces.message])
            facts["forces"] = {**forces.account(), "computed_by": dict(self.model.computed_by)}
        return Trajectory(
            moves,
            solved,
            iterations,
            largest_found(unit * residual[solved]),
            "; ".join(self.ended),
            facts,
            forces=forces,
            failures=self.failures,
        )


def _satisfies(jacobian: Array, v: Array, wanted: Array) -> bool:
    # a millionth: far above round-off, far below the error of an unsatisfied row
    return bool(np.abs(jacobian @ v - wanted).max() <= 1e-6 * (1.0 + np.abs(wanted).max()))
