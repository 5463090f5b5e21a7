"""Projection mode, shared by the simulators: one Newton loop over the samples with their residuals
and Jacobians.

The loop walks from the design position in both directions, with a predictor of second order.
Residual and finiteness decide on convergence, never a simulator's status; a step without
convergence, or to another assembly, is halved.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from ...core.case.case import Case
from ...core.failures import FailureKind
from ...core.joints import Joint
from ...core.kinematics import (
    LONGEST_TURN,
    Start,
    continued,
    continuous,
    regular_between,
    solve_from_start,
    start_of,
)
from ...core.mechanism.motions import Driver, Path, outwards
from ...core.trajectory import Array, PointMotion, Trajectory, largest_found
from .equivalents import GLOBAL, OwnFrame
from .force_solution import ForceModel, solved_forces
from .pose_solver import PoseSolver, ProjectionModel, Sample

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


def without_counterpart(
    case: Case, simulator: str, joints: Collection[type[Joint]], drivers: Collection[type[Driver]]
) -> str | None:
    """Return a message on the first joint or driver that has none of these exact types, or None.

    A subclass may have another meaning.
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


class Walk(PoseSolver):
    """The walk of a model along the motion of a case, sample by sample."""

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
            self.model.move(self.predicted(at, dt))
            new, whole = self.solve(path, to), step or abs(t - start.t)
            short = abs(dt) <= FOLD * whole
            if new is not None and self.connected(at, new) and (short or self.regular(at, new)):
                at, h = new, 2.0 * h
            else:
                h = 0.5 * min(abs(h), abs(t - at.t)) * math.copysign(1.0, h)
                if abs(h) < SMALLEST_STEP * whole:
                    return at, False
        return at, True

    @staticmethod
    def predicted(at: Sample, dt: float) -> Array:
        """Return the change of the unknowns over a time, to second order."""
        return dt * (at.v + (0.5 * dt) * at.a)

    def connected(self, at: Sample, new: Sample) -> bool:
        """Return whether output points and coordinates moved between two poses by their rates.

        At rest they do not show full turns of a driver, so turns have a separate limit.
        """
        if np.abs(new.c - at.c)[self.turns].max(initial=0.0) > LONGEST_TURN:
            return False
        dt = np.float64(new.t - at.t)
        watched = continuous(new.x - at.x, new.rows[1].ravel(), at.rows[1].ravel(), dt, self.size)
        change = self.predicted(at, float(dt)) + new.corrected
        everything = continuous(change, new.v, at.v, dt, self.size)
        return bool(watched & everything) and continued(change, new.v, at.v, dt)

    def regular(self, at: Sample, new: Sample) -> bool:
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

    def trajectory(self, details: Mapping[str, Any], begin: Start) -> Trajectory:
        path, points = self.path, self.case.points
        times, n = path.times, len(path.times)
        motion = np.full((3, n, len(points), 3), np.nan)
        iterations, residual = np.zeros(n, dtype=np.int64), np.zeros(n)
        samples = dict[int, Sample]()
        solved, messages = np.zeros(n, dtype=np.bool_), list[str]()
        failures = list[FailureKind]()
        origin, message = self.start(path, begin)
        if origin is None:
            messages.append(message)
            failures.append(self.kind_at_start)
        else:
            step = float(np.abs(np.diff(times)).max()) if n > 1 else abs(float(times[0])) or 1.0
            for side in outwards(times, origin.t):
                at = origin
                last: float | None = None
                for k in side:
                    at, reached = self.advance(path, at, float(times[k]), step)
                    if not reached:
                        messages.append(path.ended(at.t, float(times[k]), last, str(self.lost)))
                        failures.append(self.lost.kind)
                        break
                    last = float(times[k])
                    motion[:, k] = at.rows
                    iterations[k], residual[k], solved[k] = at.iterations, at.residual, True
                    samples[int(k)] = at
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
        if self.case.forces and isinstance(self.model, ForceModel):
            forces = solved_forces(self.model, self.case, samples, unit)
            messages += filter(None, [forces.message])
            facts["forces"] = {**forces.account(), "computed_by": dict(self.model.computed_by)}
        return Trajectory(
            moves,
            solved,
            iterations,
            largest_found(unit * residual[solved]),
            "; ".join(messages),
            facts,
            forces=forces,
            failures=failures,
        )
