"""Equilibria by a simulator's own kinematics, gravity and rows: J^T lambda = demand, at rest.

Newton's method begins at the design position. There it takes away the forces that are out of
balance; then it walks outwards through the samples. Its unknowns are the motions that the rows
leave free, so redundant rows do no harm. The stiffness along these motions comes from central
differences of demand - J^T lambda; their errors only slow the convergence, because the result is
where the simulator's own forces balance.

A step of the walk is accepted if it is short, Newton's corrections contract, and the stiffness
keeps its number of negative eigenvalues; otherwise it is halved. So no walk leaps to an
equilibrium far away.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.case.case import Case
from ...core.errors import SolveError, UnsupportedError
from ...core.failures import FailureKind
from ...core.forces import Forces
from ...core.mechanism.loads import Force, ForceElement, Torque
from ...core.trajectory import Array, PointMotion, Trajectory
from ..shared.equivalents import own_frame
from ..shared.force_solution import places, solved_forces
from ..shared.projection import RANK_TOLERANCE
from ..shared.projection_engine import ProjectionEngine
from ..shared.projection_model import ProjectionModel, SolvedPose

# As in the native walk: the ratio of two corrections that proves a solution nearby (Kantorovich),
# a correction whose square is round-off, and round-off.
CONTRACTION, SETTLED, ROUND_OFF = 0.25, 1e-8, 1e-13
# Longest first correction of a step, in units of the mechanism's size and in radians.
LONG = 0.1
MOST_ITERATIONS = 12
# Step of the differences: the truncation is its square, and round-off 1e-16 over it.
DIFFERENCE = 1e-5
# Steps are halved to this part of the way: a turning point is then known to seven digits.
SHORTEST = 2.0**-24


@dataclass(frozen=True, eq=False)
class Rest(SolvedPose):
    """A configuration in equilibrium, with the case's points, shape (points, 3); residual in SI."""

    points: Array


def with_loads(case: Case, sample: int) -> Case:
    """Return the case with the loads of a sample as force elements of its mechanism."""
    assert case.balance is not None
    further = list[ForceElement]()
    for place in case.balance.places:
        force, torque = np.split(case.balance.loads[place.name][sample], 2)
        if force.any():
            x, y, z = force.tolist()
            further.append(Force(f"{place.name}: force", place.body, place.position, (x, y, z)))
        if torque.any():
            x, y, z = torque.tolist()
            further.append(Torque(f"{place.name}: torque", place.body, (x, y, z)))
    forces = [*case.mechanism.forces, *further]
    return replace(case, mechanism=replace(case.mechanism, forces=forces), balance=None)


def equilibria(
    case: Case, solve: Callable[[Case, Sequence[int]], tuple[Mapping[int, Rest], Forces, str]]
) -> Trajectory:
    """Return the equilibria of a case.

    Args:
        solve: returns the equilibria of samples with the same loads, by the case with these loads,
            their forces, and why others are missing.
    """
    assert case.balance is not None
    n, groups = len(case.sweep.values), dict[bytes, list[int]]()
    for k in range(n):
        loads = b"".join(each[k].tobytes() for each in case.balance.loads.values())
        groups.setdefault(loads, []).append(k)
    points, count = np.full((n, len(case.points), 3), np.nan), np.zeros(n, np.int64)
    names, unknown = [each.name for each in case.mechanism.drivers], np.full(n, np.nan)
    efforts, residual = {name: unknown.copy() for name in names}, 0.0
    messages = list[str]()
    for group in groups.values():
        found, forces, message = solve(with_loads(case, group[0]), group)
        messages += [message] if message else []
        for k, each in found.items():
            points[k], count[k], residual = (
                each.points,
                each.iterations,
                max(residual, each.residual),
            )
        for name, values in forces.drivers.items():
            efforts[name] = np.where(np.isfinite(values), values, efforts[name])
    solved = np.array([bool(np.isfinite(each).all()) for each in points], np.bool_)
    return Trajectory(
        {name: PointMotion(points[:, k], None, None) for k, name in enumerate(case.points)},
        solved,
        count,
        residual if solved.any() else np.nan,
        "; ".join(dict.fromkeys(messages)),
        forces=Forces({}, {k: efforts[k] for k in names if k in case.forces}, {}, unknown, unknown),
        failures=[FailureKind.NOT_FOUND] if messages else [],
    )


class Walk:
    """The walk of a model through samples.

    Args:
        model: with the loads as force elements, built for the case in its own frame.
        case: the same case in SI.
    """

    def __init__(self, model: ProjectionModel, case: Case) -> None:
        self.model, self.case, self.frame = model, case, own_frame(case)
        drivers, path = case.mechanism.drivers, case.sweep.path
        units = np.array([1.0 if each.turns else self.frame.unit for each in drivers])
        values = path.drive([each.name for each in drivers], path.times)[0]
        self.values: Array = values.T / units
        model.reset()
        self.rest, self.share, self.negative = np.zeros(0), 0.0, -1
        self.c, self.iterations = np.zeros(len(drivers)), 0
        _, J, demand = self._at()
        sizes: Any = np.linalg.svd(J, compute_uv=False) if len(J) else np.zeros(0)
        self.rank = int((sizes > RANK_TOLERANCE * sizes.max(initial=0.0)).sum())
        self.unknowns = J.shape[1]
        ends = [at for each in case.mechanism.forces for _, at in places(each, case.mechanism)]
        extent = float(np.ptp(ends, axis=0).max()) if ends else 0.0
        self.long = LONG * max(1.0, extent / self.frame.unit)
        self.rest = demand - J.T @ self._multipliers(J, demand)

    def solve(self, group: Sequence[int]) -> tuple[Mapping[int, Rest], Forces, str]:
        """Return samples in equilibrium, each reached from the nearest one, their forces, and why
        others are missing.
        """
        found, messages = dict[int, Rest](), list[str]()
        design = np.zeros(self.values.shape[1])
        near = [(design, self.model.save())] if self._advance(design, design, 0.0) else []
        if not near:
            messages.append(
                "no equilibrium is found at the design position: the walk takes away only"
                f" {self.share:.3g} of the forces that are out of balance there"
            )
        size = np.linalg.norm(self.values, axis=1)
        for k in sorted(group if near else (), key=lambda k: float(size[k])):
            to = self.values[k]
            start, saved = min(near, key=lambda each: float(np.linalg.norm(each[0] - to)))
            self.model.restore(saved)
            if not self._advance(start, to, 1.0):
                messages.append(f"no equilibrium on the way to sample {k}")
                continue
            found[k], self.iterations = self._rest(to), 0
            near.append((to, found[k].saved))
        freedoms = self.unknowns - self.rank
        forces = Forces({}, {}, {}, np.zeros(0), np.zeros(0))
        if self.rank:
            forces = solved_forces(self.model, self.case, found, self.frame.unit, freedoms)
        return found, forces, "; ".join(filter(None, [*messages[:1], forces.message]))

    def _rest(self, c: Array) -> Rest:
        still, unit = np.zeros(self.unknowns), self.frame.unit
        residual = float(np.abs(self.model.residual(c)).max(initial=0.0))
        points = [self.frame.back(x) for x, _, _ in self.model.points(still, still)]
        return Rest(
            *(self.model.save(), c, still, still, self.iterations, unit * residual),
            np.array(points).reshape(-1, 3),
        )

    def _advance(self, start: Array, to: Array, share: float) -> bool:
        """Walk from driver values to others; from a share of zero, take the unbalance away. Return
        whether the walk arrives.
        """
        done, step, grows = 0.0, 1.0, 2.0
        saved = self.model.save()
        if not share:  # for the signs at design, where forces that are out of balance are held
            self.share, self.c = 0.0, start
            self.negative = self._newton()[1]
            self.model.restore(saved)
        while done < 1.0:
            target = min(1.0, done + step)
            self.c, self.share = start + target * (to - start), max(share, target)
            arrived, negative = self._newton()
            if arrived and negative == self.negative:
                done, step, grows, saved = target, grows * step, 2.0, self.model.save()
                continue
            self.model.restore(saved)
            grows = 1.0  # what fails once, fails soon again
            step = 0.5 * (target - done)
            if step < SHORTEST:
                self.share = max(share, done)
                return False
        return True

    def _newton(self) -> tuple[bool, int]:
        """Correct the configuration; return whether it arrives, and how many eigenvalues of the
        stiffness are negative.
        """
        last, negative = np.inf, -1
        for k in range(MOST_ITERATIONS):
            self.iterations += 1
            step, negative = self._correction()
            size = float(np.abs(step).max(initial=0.0))
            slow = not size <= CONTRACTION * last
            if (not k and size > self.long) or (slow and not size <= SETTLED):
                return False, negative
            self.model.move(step)
            if size <= (SETTLED if slow else ROUND_OFF):
                return True, negative
            last = size
        return last <= SETTLED, negative

    def _at(self) -> tuple[Array, Array, Array]:
        """Return residual, its derivative, and the forces that rows have to carry."""
        phi = np.array(self.model.residual(self.c))
        J, still = np.array(self.model.jacobian()), np.zeros(self.model.jacobian().shape[1])
        demand = np.array(self.model.dynamics(still, still).demand)
        return phi, J, demand - (1.0 - self.share) * self.rest if self.rest.size else demand

    def _multipliers(self, J: Array, demand: Array) -> Array:
        if not len(J):
            return np.zeros(0)
        found: Any = np.linalg.lstsq(J.T, demand, rcond=RANK_TOLERANCE)[0]
        return np.asarray(found, np.float64)

    def _correction(self) -> tuple[Array, int]:
        """Return Newton's step, and how many eigenvalues of the stiffness are negative."""
        phi, J, demand = self._at()
        if not np.isfinite(phi).all():
            return np.inf * np.ones(self.unknowns), -1
        u, sizes, vh = np.linalg.svd(J) if len(J) else (J[:, :0], J[:, 0], np.eye(J.shape[1]))
        closing = -vh[: self.rank].T @ ((u[:, : self.rank].T @ phi) / sizes[: self.rank])
        free = vh[self.rank :].T
        multipliers = self._multipliers(J, demand)
        saved = self.model.save()

        def unbalance_rate(way: Array) -> Array:
            """Return the derivative of the forces that are out of balance."""
            ends = list[Array]()
            for h in (DIFFERENCE, -DIFFERENCE):
                self.model.restore(saved)
                self.model.move(h * way)
                _, J, demand = self._at()
                ends.append(demand - J.T @ multipliers)
            return (ends[0] - ends[1]) / (2.0 * DIFFERENCE)

        stiffness = (
            free.T @ np.array([unbalance_rate(way) for way in free.T]).reshape(-1, len(vh)).T
        )
        left = demand - J.T @ multipliers
        if length := float(np.linalg.norm(closing)):
            left = left + length * unbalance_rate(closing / length)
        self.model.restore(saved)
        values = np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T))
        try:
            step = closing - free @ np.linalg.solve(stiffness, free.T @ left)
        except np.linalg.LinAlgError:
            raise SolveError(
                "nothing holds a body: the stiffness is singular. Add a joint, a spring or a"
                " bushing"
            ) from None
        return step, int((values < 0.0).sum())


def of_engine(engine: ProjectionEngine, case: Case) -> Trajectory:
    """Return the equilibria of a case; see `harness.engine.Balancing`."""

    def solve(case: Case, group: Sequence[int]) -> tuple[Mapping[int, Rest], Forces, str]:
        model = engine.build(case)
        if not case.forces:
            raise UnsupportedError(f"{engine.title} gives no forces of case {case.name!r}")
        return Walk(model, engine.with_known_joints(case)).solve(group)

    return equilibria(case, solve)
