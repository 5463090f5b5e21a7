"""Kinematics of a simulator in projection mode, and Newton's method for one pose."""

from __future__ import annotations

import importlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ...core.case.case import Case, size
from ...core.errors import SolveError
from ...core.failures import FailureKind, PoseFailure
from ...core.kinematics import ROUNDING
from ...core.mechanism.motions import Path
from ...core.trajectory import Array
from .equivalents import GLOBAL, OwnFrame


class ProjectionModel(Protocol):
    """A simulator's kinematics: unknowns x (tree or body coordinates), and rows for closures and
    drivers.

    Lengths are in the unit of the mechanism, metres or another. All methods refer to the current
    configuration. `residual` updates the data of the other methods.

    Attributes:
        case: the case of the model, in the frame of the model.
        details: facts for the record.
    """

    @property
    def case(self) -> Case: ...

    @property
    def details(self) -> Mapping[str, Any]: ...

    def reset(self) -> None:
        """Go back to the design configuration."""
        ...

    def save(self) -> Any:
        """Return a copy of the configuration."""
        ...

    def restore(self, saved: Any) -> None:
        """Go back to a saved configuration."""
        ...

    def move(self, dx: Array) -> None:
        """Advance the configuration by dx, shape (unknowns,)."""
        ...

    def residual(self, c: Array) -> Array:
        """Return all rows with the drivers at c, in the mechanism's order, relative to their design
        values, shape (rows,).
        """
        ...

    def jacobian(self) -> Array:
        """Return the derivative of the rows by dx, shape (rows, unknowns).

        The array is a copy, or valid until the next call.
        """
        ...

    def driver_columns(self) -> Array:
        """Return the negative derivative of the rows by c, J v = driver_columns c_t, shape (rows,
        drivers).
        """
        ...

    def bias(self, v: Array) -> Array:
        """Return Jdot v of all rows, shape (rows,)."""
        ...

    def points(self, v: Array, a: Array) -> Sequence[tuple[Array, Array, Array]]:
        """Return position, velocity and acceleration of each point of case.points, in order, global
        axes.
        """
        ...


MAX_ITERATIONS = 20
# Singular values below this fraction of the largest count as zero: far above round-off (1e-15), far
# below a regular mechanism (1e-2).
RANK_TOLERANCE = 1e-9
# Step at which least squares have converged: the remaining residual comes from contradictory rows.
ARRIVED = 1e-6
# Largest error of a pose that counts as round-off, of unknowns of size one.
EXACT = 4.0 * float(np.finfo(np.float64).eps)

LOST = PoseFailure(FailureKind.NOT_FOUND)
"""Failure of a pose without a known cause."""


@dataclass(frozen=True, eq=False)
class Sample:
    """A solved pose with all data for the next step of the walk."""

    t: float
    c: Array  # of the drivers
    saved: Any
    x: Array
    v: Array
    a: Array
    rows: tuple[Array, Array, Array]
    jacobian: Array
    inverse: Array  # of the Jacobian
    corrected: Array
    iterations: int
    residual: float


class PoseSolver:
    """Newton's method on the rows of a model."""

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
                " coordinates of the simulator's model are left free by joints and drivers at the"
                " design position; add a driver or a joint; if their number is"
                " right a driver does not move it there (a lock-up): give the design in another"
                " pose",
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

    def _step(self, r: Array) -> Array:
        """Return Newton's step for residuals."""
        A = self.model.jacobian()
        if not self.square:
            return self._least_squares(A, -r)
        *_, step, singular = self.lapack.dgesv(A, -r)
        return np.asarray(step if not singular else math.nan * r, dtype=np.float64)

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
            step = self._step(r)
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
        jacobian, columns = np.array(self.model.jacobian()), self.model.driver_columns()
        nu = columns @ c_t
        if (inverse := self.inverse(jacobian)) is None:
            return None
        v = inverse @ nu
        gamma = columns @ c_tt - self.model.bias(v)
        a = inverse @ gamma
        # least squares would hide rates that do not satisfy the rows (a driver at a dead centre)
        if not (_met(jacobian, v, nu) and _met(jacobian, a, gamma)):
            self.lost = PoseFailure(FailureKind.DEAD_CENTRE)
            return None
        position, velocity, acceleration = (
            np.array(each, dtype=float) for each in zip(*self.model.points(v, a), strict=True)
        )
        return Sample(
            t,
            c,
            self.model.save(),
            position.ravel(),
            v,
            a,
            (position, velocity, acceleration),
            jacobian,
            inverse,
            *done,
        )


def _met(jacobian: Array, v: Array, wanted: Array) -> bool:
    # a millionth: far above round-off, far below the error of an unsatisfied row
    return bool(np.abs(jacobian @ v - wanted).max() <= 1e-6 * (1.0 + np.abs(wanted).max()))
