"""Poses of a simulator's model by Newton's method, with velocities and accelerations."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.case.case import Case, size
from ...core.errors import SolveError
from ...core.failures import FailureKind, PoseFailure
from ...core.kinematics import ROUNDING
from ...core.mechanism.motions import Path
from ...core.trajectory import Array
from .length_scaling import GLOBAL, OwnFrame
from .projection_model import ProjectionModel

MAX_ITERATIONS = 20
# Singular values below this fraction of the largest count as zero: far above round-off (1e-15), far
# below a regular mechanism (1e-2).
RANK_TOLERANCE = 1e-9
# Step at which least squares have converged: the remaining residual comes from contradictory rows.
ARRIVED = 1e-6

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
        if self.rank < self.unknowns:
            raise SolveError(
                f"case {case.name!r}: {self.unknowns - self.rank} of the {self.unknowns}"
                " coordinates of the simulator's model are left free by joints and drivers at the"
                " design position; add a driver or a joint; if their number is"
                " right a driver does not move it there (a lock-up): give the design in another"
                " pose",
                FailureKind.FREE,
            )

    def linear(self, A: Array, b: Array) -> Array:
        """Solve A x = b, which may not be square: point closures of a planar loop are redundant."""
        if self.square:
            return np.asarray(np.linalg.solve(A, b), dtype=np.float64)
        return np.asarray(np.linalg.lstsq(A, b, rcond=RANK_TOLERANCE)[0], dtype=np.float64)

    def newton(self, c: Array) -> tuple[Array, int, float] | None:
        """Return the sum of all steps, the iterations and the last residual at driver values c, or
        None.
        """
        self.lost = LOST
        met, worst, step, corrected = (
            False,
            math.inf,
            np.full(self.unknowns, math.inf),
            np.zeros(self.unknowns),
        )
        for iteration in range(1, MAX_ITERATIONS + 1):
            r = self.model.residual(c)
            worst = float(np.abs(r).max()) if np.isfinite(r).all() else math.inf
            if not math.isfinite(worst):
                return None
            if iteration - 1 == self.corrections:
                return corrected, iteration - 1, worst
            # one step after the tolerance is met: quadratic convergence makes it exact to round-off
            if met and self.corrections is None:
                if worst <= self.tol:
                    return corrected, iteration - 1, worst
                break
            met = worst <= self.tol
            try:
                step = self.linear(self.model.jacobian(), -r)
            except np.linalg.LinAlgError:
                return None
            if not np.isfinite(step).all():
                return None
            self.model.move(step)
            corrected += step
        if worst <= ROUNDING:
            self.lost = PoseFailure(FailureKind.BELOW_ROUNDING, worst, self.tol)
        elif not self.square and np.abs(step).max() <= ARRIVED:
            self.lost = PoseFailure(FailureKind.NO_POSE, worst, self.tol)
        return None

    def solve(self, path: Path, t: float) -> Sample | None:
        """Return the pose with its rates on a path at time t, starting from the current pose, or
        None.
        """
        c, c_t, c_tt = (path.drive(self.drivers, np.array([t])) / self.units)[..., 0]
        done = self.newton(c)
        if done is None:
            return None
        jacobian, columns = np.array(self.model.jacobian()), self.model.driver_columns()
        nu = columns @ c_t
        try:
            v = self.linear(jacobian, nu)
            gamma = columns @ c_tt - self.model.bias(v)
            a = self.linear(jacobian, gamma)
        except np.linalg.LinAlgError:
            return None
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
            *done,
        )


def _met(jacobian: Array, v: Array, wanted: Array) -> bool:
    # a millionth: far above round-off, far below the error of an unsatisfied row
    return bool(np.abs(jacobian @ v - wanted).max() <= 1e-6 * (1.0 + np.abs(wanted).max()))
