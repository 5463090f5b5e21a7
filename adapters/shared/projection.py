"""Projection mode, shared by the simulators: their residuals and Jacobians in one Newton loop over
the samples.

The loop walks from the design position outwards, both ways, with a tangent predictor. Convergence
is judged here, by residual and finiteness, never by a simulator's own word; a step that does not
converge, or converges to another assembly, is halved.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.case.case import Case, size
from ...core.errors import SolveError
from ...core.joints import Joint
from ...core.kinematics.compiled.motion_start import Start, by_ways, start_of
from ...core.kinematics.formulation.acceptance_criteria import (
    LONGEST_TURN,
    ROUNDING,
    continued,
    continuous,
    regular_between,
)
from ...core.mechanism.drivers import Driver
from ...core.mechanism.motions import Path, outwards
from ...core.trajectory import Array, PointMotion, Trajectory, largest_found
from .length_scaling import GLOBAL, OwnFrame
from .projection_model import ProjectionModel

MAX_ITERATIONS = 20
# Newton steps of the efforts of a projection, after one tangent predictor; none is Euler's method.
# None is as many as it takes.
EFFORTS: Mapping[str, int | None] = {
    "predictor only": 0,
    "1 Newton step": 1,
    "2 Newton steps": 2,
    "until converged": None,
}
# A step shorter than this part of the sample distance that still fails is the end of the motion,
# not a coarse grid. Change points that are missed by a part d of the size ask for steps of the root
# of d; with 2^-10 those by 1e-8 were ends, or passed over.
SMALLEST_STEP = 2.0**-20
# Singular values below this part of the largest count as zero: far above round-off (1e-15), far
# below a sound mechanism (1e-2).
RANK_TOLERANCE = 1e-9
# Where a singular value of the Jacobian may have been zero on the way, a step is shortened to this
# part of the sample distance before it is believed. Beside a fold the motion turns round, and
# another assembly goes straight on. A motion that really passes a singular pose passes it in such a
# step. It is a few times the smallest step, so that a pose that fails there can still be
# approached. Closer to a singular pose than the root of round-off, rounding would choose the
# assembly.
FOLD = 8.0 * SMALLEST_STEP
# Least squares have arrived where a step is this short: no more is to be gained, and what is left
# are rows that contradict others.
ARRIVED = 1e-6


@dataclass(frozen=True, eq=False)
class _Sample:
    """A solved pose: everything the walk needs to go on from there."""

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


def without_counterpart(
    case: Case, simulator: str, joints: Collection[type[Joint]], drivers: Collection[type[Driver]]
) -> str | None:
    """Say which joint or driver of the case is of none of these exact types, or None; a subclass
    may mean something else.
    """
    for what, known in (
        *((joint, joints) for joint in case.mechanism.joints),
        *((d, drivers) for d in case.mechanism.drivers),
    ):
        if type(what) not in known:
            who = str(what) if isinstance(what, Joint) else f"driver {what.name!r} ({what.type})"
            return (
                f"{who} has no counterpart in {simulator} here; known:"
                f" {', '.join(each.type for each in known)}"
            )
    return None


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
        corrections: exactly so many Newton steps after the predictor, whatever residual they leave;
            None: until it meets tol.
        frame: in which the model has the mechanism.
    """
    walk, mechanism, path = (
        Walk(model, case, tol, corrections, frame),
        case.mechanism,
        case.sweep.path,
    )
    start, exact = start_of(mechanism, path), corrections is None
    return by_ways(
        start, mechanism, path, lambda each: walk.trajectory(details or {}, each), compare=exact
    )


LOST = "Newton does not converge or jumps to another assembly"
"""Why a motion ends, where nothing more is known."""
STUCK = (
    "drivers cannot move: it is a dead centre, or the motions that joints leave contradict each"
    " other"
)
"""Why it ends where it closes."""


class Walk:
    """The way of a model through a case, sample by sample."""

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
        self.lost = LOST  # why the last pose that was looked for was not found
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
                " design position; add a driver, or join what moves freely; if their number is"
                " right a driver does not move it there (a lock-up): give the design in another"
                " pose"
            )

    def linear(self, A: Array, b: Array) -> Array:
        """Solve A x = b; never assumed square: point closures of a planar loop are redundant."""
        if self.square:
            return np.asarray(np.linalg.solve(A, b), dtype=np.float64)
        return np.asarray(np.linalg.lstsq(A, b, rcond=RANK_TOLERANCE)[0], dtype=np.float64)

    def newton(self, c: Array) -> tuple[Array, int, float] | None:
        """Sum of all steps, iterations and final residual at driver values c, or None."""
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
            # one step after meeting the tolerance: quadratic convergence makes it exact to
            # round-off
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
            self.lost = (
                f"the residual {worst:.3g} is rounding, and the tolerance {self.tol:.3g} is less;"
                " allow more"
            )
        elif not self.square and np.abs(step).max() <= ARRIVED:
            ends = "the motion ends, or joints contradict each other"
            self.lost = (
                f"no pose near there closes better than to {worst:.3g} of the mechanism's size:"
                f" {ends}"
            )
        return None

    def solve(self, path: Path, t: float) -> _Sample | None:
        """Position, velocity and acceleration on a path at time t from the current configuration,
        or None.
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
        # least squares would hide rates that no row set can meet (a driver pushed at a dead centre)
        if not (_met(jacobian, v, nu) and _met(jacobian, a, gamma)):
            self.lost = STUCK
            return None
        position, velocity, acceleration = (
            np.array(each, dtype=float) for each in zip(*self.model.points(v, a), strict=True)
        )
        return _Sample(
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

    def advance(self, path: Path, start: _Sample, t: float, step: float) -> tuple[_Sample, bool]:
        """Walk a path from start to time t, halving steps that fail; (where it ended, whether that
        is t).

        Args:
            step: between samples; zero where all are one.
        """
        at, h = start, t - start.t
        while at.t != t:
            to = t if abs(t - at.t) <= abs(h) else at.t + h
            dt = to - at.t
            self.model.restore(at.saved)
            self.model.move(dt * at.v)
            new, whole = self.solve(path, to), step or abs(t - start.t)
            short = abs(dt) <= FOLD * whole
            if new is not None and self.connected(at, new) and (short or self.regular(at, new)):
                at, h = new, 2.0 * h
            else:
                h = 0.5 * min(abs(h), abs(t - at.t)) * math.copysign(1.0, h)
                if abs(h) < SMALLEST_STEP * whole:
                    return at, False
        return at, True

    def connected(self, at: _Sample, new: _Sample) -> bool:
        """Whether the points that are watched, and all coordinates, went from one pose to the other
        as their rates say.

        Where all stands still they say nothing of a driver that made whole turns in between.
        """
        if np.abs(new.c - at.c)[self.turns].max(initial=0.0) > LONGEST_TURN:
            return False
        dt = np.float64(new.t - at.t)
        watched = continuous(new.x - at.x, new.rows[1].ravel(), at.rows[1].ravel(), dt, self.size)
        change = dt * at.v + new.corrected
        everything = continuous(change, new.v, at.v, dt, self.size)
        return bool(watched & everything) and continued(change, new.v, at.v, dt)

    def regular(self, at: _Sample, new: _Sample) -> bool:
        """Return whether no singular value of the Jacobian can have been zero between two poses."""
        try:
            return regular_between(self.linear(at.jacobian, new.jacobian))
        except np.linalg.LinAlgError:
            return False

    def start(self, path: Path, begin: Start) -> tuple[_Sample | None, str]:
        """Return the pose the samples are reached from, and why there is none."""
        self.model.reset()
        design = self.solve(begin.lead, 0.0) if begin.lead else self.solve(path, begin.time)
        if design is None:
            if self.lost is STUCK:
                return None, f"at the design position the {STUCK}"
            return (
                None,
                (
                    "no assembly at the design position:"
                    f" {'the model does not close there' if self.lost is LOST else self.lost}"
                ),
            )
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

    def trajectory(self, details: Mapping[str, Any], begin: Start) -> Trajectory:
        path, points = self.case.sweep.path, self.case.points
        times, n = path.times, len(path.times)
        motion = np.full((3, n, len(points), 3), np.nan)
        iterations, residual = np.zeros(n, dtype=np.int64), np.zeros(n)
        solved, messages = np.zeros(n, dtype=np.bool_), list[str]()
        origin, message = self.start(path, begin)
        if origin is None:
            messages.append(message)
        else:
            step = float(np.abs(np.diff(times)).max()) if n > 1 else abs(float(times[0])) or 1.0
            for side in outwards(times, origin.t):
                at = origin
                last: float | None = None
                for k in side:
                    at, reached = self.advance(path, at, float(times[k]), step)
                    if not reached:
                        messages.append(path.ended(at.t, float(times[k]), last, self.lost))
                        break
                    last = float(times[k])
                    motion[:, k] = at.rows
                    iterations[k], residual[k], solved[k] = at.iterations, at.residual, True
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
        return Trajectory(
            moves,
            solved,
            iterations,
            largest_found(unit * residual[solved]),
            "; ".join(messages),
            facts,
        )


def _met(jacobian: Array, v: Array, wanted: Array) -> bool:
    # a millionth: far above round-off, far below a row that is not met
    return bool(np.abs(jacobian @ v - wanted).max() <= 1e-6 * (1.0 + np.abs(wanted).max()))
