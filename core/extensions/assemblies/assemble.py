"""Assembly from estimates: closed poses from open ones, many estimates at once.

The mixed rows are used, because their only zero is the intended one of every joint: simplified rows
lead from any misalignment back to it, exact rows end on spurious branches (formulation sections 3
and 4). They do not choose between the legitimate assemblies of a loop; the estimate
does.

Each step is a damped one, (J^T J + mu I) s = -J^T phi with mu growing as |phi|^2: far away,
with a Jacobian that may be singular, it is short; near the solution it is Newton's. With
every body of the strut turned by 0.8 rad and shifted by about 0.2 m, damped steps reach the
intended assembly from all of 200 estimates, undamped ones from 92 %; with 1 m, from 81 % and 21 %.
A cap on the turn of a step (0.15 to 1.2 rad) was tried besides: it changes these shares by a
percent and costs iterations.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from ...dataset import AXIS, Dataset, Variable
from ...errors import SolveError, number_of
from ...input_checks import real, require_kind, require_known, require_positive
from ...kinematics.compiled.dense_equations import System
from ...kinematics.compiled.programs import Tracer
from ...kinematics.compiled.request import CONSISTENT, Request
from ...kinematics.formulation.state_vectors import displaced, standing_drives, state_of
from ...kinematics.formulation.styles import MIXED, require_style
from ...mechanism.mechanism import Mechanism
from ...primitives.base import Pose
from ...tabular import Tabular
from ...trajectory import Array, BodyMotion

PARAMETER = Variable("parameter", ["e0", "e1", "e2", "e3"])
"""Labels of Euler parameters."""
MAX_ITERATIONS = 100
# mu over |phi|^2: 0.01 to 1 serve alike on the strut; less lets singular Jacobians throw bodies
# far, more takes twice the steps.
DAMPING = 0.1
# mu at most: the size of rows. Unlimited, bodies that are ten mechanism sizes away come home by a
# hundredth of the way each step.
LARGEST_DAMPING = 1.0
# Below this residual the redundant rows have done their work, which is to lead there; Newton's own
# steps end it, as in a sweep.
NEAR = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class Assembled(Tabular):
    """Results of n estimates.

    Attributes:
        bodies: poses of the moving bodies; NaN without convergence.
        converged: whether each estimate ended in an assembly, on the intended branch of every
            joint, shape (n,).
        spurious: whether it ended at a zero of the rows without an assembly: axes turned over, or
            redundant rows contradicted.
        residual: largest constraint residual, relative to the mechanism's size, shape (n,).
        iterations: shape (n,).
    """

    bodies: Mapping[str, BodyMotion]
    converged: NDArray[np.bool_]
    spurious: NDArray[np.bool_]
    residual: Array
    iterations: NDArray[np.int64]

    def summary(self) -> str:
        """Return how many estimates ended in an assembly."""
        count, closed = len(self.converged), int(self.converged.sum())
        ended = f"{closed} of {number_of(count, 'estimate')} closed"
        return f"{ended}, {int(self.spurious.sum())} spurious"

    def dataset(self) -> Dataset:
        """Return the outcome of each estimate and the poses of its bodies."""
        coords = {
            "body": Variable("body", [*self.bodies]),
            "axis": AXIS,
            "parameter": PARAMETER,
        }
        variables = {
            name: Variable("estimate", getattr(self, name))
            for name in ("converged", "spurious", "residual", "iterations")
        }
        dims = ("estimate", "body")
        if self.bodies:
            r, p = (
                np.stack([getattr(each, name) for each in self.bodies.values()], axis=1)
                for name in ("r", "p")
            )
            variables["origin"] = Variable((*dims, "axis"), r, "m")
            variables["euler_parameters"] = Variable((*dims, "parameter"), p)
        return Dataset(("estimate",), coords, variables)


def assemble(
    mechanism: Mechanism,
    estimates: Mapping[str, tuple[Array, Array]],
    values: Mapping[str, float] | None = None,
    *,
    tol: float = 1e-12,
    style: str = MIXED,
) -> Assembled:
    """Close a mechanism from estimated poses.

    Args:
        estimates: by body, origin r [m], shape (n, 3), and Euler parameters p [-], shape (n, 4);
            bodies left out start at design. For unknown poses,
            `find_assemblies` tries many.
        values: of the drivers, from their design values [m or rad]; those left out hold theirs.
        tol: largest accepted residual, relative to the mechanism's size.
        style: how the rows are written; "mixed" leads to the intended branch from farthest.

    Raises:
        SolveError: drivers and degrees of freedom do not match, there is no moving body or driver
            of a name, or an estimate has another shape, or the tolerance is not positive and
            finite.
    """
    require_named("assemble", mechanism, estimates, values or {})
    require_positive("assemble", "tol", tol)
    origins = (
        real("assemble", f"origin r of body {name!r}", r, "of shape (n, 3)")
        for name, (r, _) in estimates.items()
    )
    n = next((len(np.atleast_2d(r)) for r in origins), 1)
    require_shapes("assemble", estimates, (n,))
    closing = Closing(mechanism, values or {}, style)
    return closing.run(displaced(mechanism, closing.tracer.frame, estimates), n, tol)


def require_named(
    who: str, mechanism: Mechanism, bodies: Iterable[str], drivers: Iterable[str]
) -> None:
    """Raise SolveError unless there are moving bodies and drivers of these names."""
    require_kind(who, "mechanism", mechanism, Mechanism)
    require_known(who, "moving body", bodies, mechanism.moving)
    require_known(who, "driver", drivers, mechanism.drivers)


def require_shapes(
    who: str, estimates: Mapping[str, tuple[Array, Array]], lanes: tuple[int, ...]
) -> None:
    """Raise SolveError unless all origins and Euler parameters are given for these lanes."""
    for name, pose in estimates.items():
        for what, numbers, count in zip(
            ("origin r", "Euler parameters p"), pose, (3, 4), strict=True
        ):
            shape = real(
                who, f"{what} of body {name!r}", numbers, f"of shape {(*lanes, count)}"
            ).shape
            if shape != (*lanes, count):
                raise SolveError(
                    f"{who}: {what} of body {name!r}: shape {shape}, expected {(*lanes, count)}"
                )


class Closing:
    """The equations to close a mechanism at values of its drivers."""

    def __init__(
        self, mechanism: Mechanism, values: Mapping[str, float], style: str = MIXED
    ) -> None:
        self.values, self.moving = values, tuple(body.name for body in mechanism.moving)
        self.tracer = Tracer(
            mechanism, Request(tuple(values), (), self.moving, order=0, style=require_style(style))
        )
        self.system = System(self.tracer)
        self.kept = [*self.tracer.selection.chosen]

    def run(self, poses: Mapping[str, Pose], n: int, tol: float) -> Assembled:
        """Close from n poses of each body, scalars of shape (n,); bodies left out start at
        design.
        """
        system, tracer = self.system, self.tracer
        start = state_of(tracer.formulation, tracer.mechanism, tracer.frame, poses, self.values)
        drives = standing_drives(tracer.mechanism, tracer.frame.unit, self.values).values()
        state: Array = np.array(
            [np.broadcast_to(x, (n,)) for value in start.values() for x in value]
        )
        sample = np.array([[0.0, *(x for drive in drives for x in astuple(drive))]] * n).T
        iterations, done = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.bool_)
        for _ in range(MAX_ITERATIONS):
            phi, _, entries = system.evaluate(state, sample)
            active = np.flatnonzero(~done & np.isfinite(phi).all(axis=0))
            if not len(active):
                break
            iterations[active] += 1
            # and this step, still taken, makes it round-off
            done |= np.abs(phi[self.kept]).max(axis=0) < tol
            matrix = system.jacobian(entries[:, active])
            step = np.zeros((n, system.unknowns))
            step[active] = self._steps(phi.T[active], matrix)
            state = system.stepped(state, step.T)
        found = system.equations(state, sample)
        none = np.zeros((system.unknowns, n))
        outputs = system.outputs(state, sample, none, none)
        residual: Array = np.abs(found.phi).max(axis=1)
        closes = done & (residual <= tol)
        sound = (outputs["branch"][0] > 0.0) & (found.leftover <= max(CONSISTENT, tol))
        r, p = (
            {
                name: np.where(closes & sound, outputs[f"{label} {name}"], np.nan).T
                for name in self.moving
            }
            for label in ("r", "p")
        )
        bodies = {name: BodyMotion(r[name], p[name], None, None) for name in self.moving}
        return Assembled(bodies, closes & sound, closes & ~sound, residual, iterations)

    def _steps(self, phi: Array, matrix: Array) -> Array:
        """Steps of lanes, shape (n, unknowns), from their residuals, shape (n, rows), and
        Jacobians.
        """
        step = np.empty((len(phi), matrix.shape[2]))
        near = np.abs(phi).max(axis=1) < NEAR
        far, identity = ~near, np.eye(matrix.shape[2])
        if far.any():
            rows, f = matrix[far], phi[far]
            mu = np.minimum(DAMPING * (f * f).sum(axis=1), LARGEST_DAMPING)
            damped = rows.swapaxes(1, 2) @ rows + mu[:, None, None] * identity
            step[far] = -np.linalg.solve(damped, rows.swapaxes(1, 2) @ f[:, :, None])[:, :, 0]
        # normal equations would square the condition; a damping at round-off keeps R regular at
        # singular poses
        if near.any():
            rows, f = matrix[near][:, self.kept], phi[near][:, self.kept]
            floor = np.broadcast_to(
                np.finfo(np.float64).eps * identity, (len(rows), *identity.shape)
            )
            Q, R = np.linalg.qr(np.concatenate([rows, floor], axis=1))
            rotated = Q[:, : rows.shape[1]].swapaxes(1, 2) @ f[:, :, None]
            step[near] = -np.linalg.solve(R, rotated)[:, :, 0]
        return step
