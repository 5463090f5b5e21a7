"""Equilibria along a path of loads and travel, from the design position.

Two walks lead to an equilibrium, all lanes together and each with its own steps. The first takes
away the unbalance at design (weight, springs, preload); the second brings loads and travel
in proportion. A step is accepted if

- Newton's corrections contract as Kantorovich's theorem asks,
- the determinant of the tangent keeps the signs of its blocks,
- points between its ends are near the path too, with the same signs, and
- the size of the determinant changes little from point to point.

Otherwise it is halved. So no walk leaps over a turning point of the load to an equilibrium far
away: there the stiffness has another sign between the ends, and the determinant goes through zero.
Its ratios, unlike sizes of corrections, show this of one body among others that move further.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...algebra import quat, vec
from ...errors import SolveError
from ...mechanism.mechanism import Mechanism
from ...primitives.base import Pose
from ...program.llvm.compiler import available
from ...program.llvm.executor import Executor, bind
from ...program.llvm.jit import LlvmCode, make_loops_ready
from ...trajectory import Array, BodyMotion
from ..formulation.cartesian import COLUMNS
from .equations import (
    BY,
    DETERMINANT,
    DRIVE,
    EFFORTS,
    LOAD,
    MULTIPLIERS,
    REST,
    SIGNS,
    STEP,
    LoadPoint,
    motion_of,
    null_space,
    put_design,
    static_equations,
)

Lanes = NDArray[np.bool_]

# Samples solved together: their numbers stay in a core's cache.
LANES = 256

# Newton's theorem (Kantorovich): if the second correction is at most a quarter of the first, a
# solution is near, is the only one there, and moves continuously to the start of the step.
CONTRACTION = 0.25
# Corrections are in units of the mechanism's size and in radians. Below the first number the next
# one is round-off, as it is the square; stiff bushings beside soft ones raise the round-off.
SETTLED, ROUND_OFF = 1e-8, 1e-13
# Steps of larger corrections are looked at in three places, others in their middle.
LONG = 1e-2
# Longest first correction of a step. In a longer one, a turning point could lie between the places
# that are looked at.
LONGEST = 0.25
# Largest ratio of the determinants at two places in line. A path that turns back between them has
# a zero there, and on its way to this zero the determinant falls by more.
STEADY = 2.0
MOST_ITERATIONS = 12
# Steps are halved to this part of the way so far. A turning point is then known to eleven digits.
SHORTEST = 2.0**-36
# The round-off of eigenvalues, as a part of the largest.
NEGATIVE = 1e-11


@dataclass(frozen=True, eq=False)
class Equilibria:
    """Equilibria at n samples, or the last ones on the way.

    Attributes:
        reached: whether the walk came to the end, shape (n,).
        share: the last part of loads and travel in equilibrium, shape (n,).
        states: of the formulation, by name, shape (numbers, n).
        efforts: of held drivers [N or N m], shape (n,).
        by_load: derivatives by force and torque at each load: of the motion of each body's internal
            origin [m/N, rad/N, ...], shape (n, unknowns, 6), and of efforts, shape (n, drivers, 6).
        by_driver: the same by each held driver, shape (n, unknowns) and (n, drivers).
        least: smallest eigenvalue of the reduced stiffness over the largest, shape (n,).
        unstable: the motion away by itself, by sample; empty for a stable equilibrium.
        iterations: Newton iterations, shape (n,).
    """

    model: StaticModel
    reached: Lanes
    share: Array
    states: Mapping[str, Array]
    efforts: Mapping[str, Array]
    by_load: Mapping[str, tuple[Array, Array]]
    by_driver: Mapping[str, tuple[Array, Array]]
    least: Array
    unstable: Sequence[str]
    iterations: NDArray[np.int64]

    @cached_property
    def bodies(self) -> Mapping[str, BodyMotion]:
        """Poses of the moving bodies at the last equilibrium."""
        n, frame, found = len(self.share), self.model.equations.frame, dict[str, BodyMotion]()
        for body in self.model.mechanism.moving:
            pose = self._pose(body.name)
            moved = frame.unit * (pose.u + pose.swing(frame.arm(body.name, body.origin)))
            r = np.array(body.origin) + np.stack([x + np.zeros(n) for x in moved], axis=1)
            p = np.stack([x + np.zeros(n) for x in pose.q * quat(body.euler_parameters)], axis=1)
            found[body.name] = BodyMotion(r, p, np.zeros((n, 6)), np.zeros((n, 6)))
        return found

    def place(self, body: str, position: Sequence[float]) -> Array:
        """Return a point of a body, given at design [m], shape (n, 3)."""
        frame = self.model.equations.frame
        arm = frame.arm(body, position)
        if body not in self.model.equations.columns:
            return np.tile(np.array(position), (len(self.share), 1))
        pose = self._pose(body)
        moved = frame.unit * (pose.u + pose.swing(arm))
        return np.array(position) + np.stack([x + np.zeros(len(self.share)) for x in moved], axis=1)

    def turned(self, body: str, direction: Sequence[float]) -> Array:
        """Return a direction fixed in a body, given at design [-], shape (n, 3)."""
        found = self._pose(body).turn(vec(direction))
        return np.stack([x + np.zeros(len(self.share)) for x in found], axis=1)

    def motion(self, step: Array, body: str, position: Sequence[float]) -> Array:
        """Return the motion of a point and the turn of its body [m, rad], shape (n, 6, ...), for
        motions of the unknowns, shape (n, unknowns, ...).
        """
        equations = self.model.equations
        found = np.zeros((len(step), 6, *step.shape[2:]))
        if body in equations.columns:
            first = equations.columns[body]
            pose = self._pose(body)
            arm = pose.turn(equations.frame.arm(body, position))
            reach = equations.frame.unit * np.stack([x + np.zeros(len(step)) for x in arm], axis=1)
            own = step[:, first : first + COLUMNS]
            found[:, 3:] = own[:, 3:]
            turns = np.moveaxis(own[:, 3:], 1, -1)
            swept = np.cross(turns, reach.reshape(len(step), *(1,) * (step.ndim - 2), 3))
            found[:, :3] = equations.frame.unit * own[:, :3] + np.moveaxis(swept, -1, 1)
        return found

    def _pose(self, body: str) -> Pose:
        u, q = self.states[f"u {body}"], self.states[f"q {body}"]
        return Pose.of(vec([*u]), quat([*q]))

    def require_reached(self, what: Callable[[int, float], str]) -> None:
        """Raise SolveError with the last equilibrium of the first sample out of reach.

        Args:
            what: describes a sample's loads and travel, at a share of them.
        """
        if self.reached.all():
            return
        k = int(np.argmin(self.reached))
        raise SolveError(
            f"no equilibrium at {what(k, 1.0)}: the last is at {what(k, float(self.share[k]))},"
            " where the path turns back (snap-through) or meets another one; give smaller loads or"
            " travel, or stiffer springs"
        )


class StaticModel:
    """A mechanism ready for statics. Its drivers are held; `Mechanism.released` has bushings in
    place of joints.

    Raises:
        SolveError: nothing holds a body, or weight and springs have no equilibrium near the design.
    """

    def __init__(self, mechanism: Mechanism, loads: Sequence[LoadPoint] = ()) -> None:
        self.mechanism, self.equations = mechanism, static_equations(mechanism, loads)
        self.drivers = [each.name for each in mechanism.drivers]
        vectors = self.equations.vectors
        names = [*self.equations.design, MULTIPLIERS]
        self._state = [slot for name in names for slot in vectors[name]]
        self._tests = [self.equations.plan.slots[name] for name in (STEP, SIGNS, DETERMINANT)]
        if compiled := available():
            make_loops_ready()
        self._code = LlvmCode(self.equations.plan) if compiled else None
        self._bound: dict[int, Executor] = {}
        self._signs, self._determinant = self._at_design()

    def executor(self, lanes: int) -> Executor:
        """Return the programs bound to lanes at design."""
        made = self._bound.get(lanes)
        if made is None:
            made = self._bound[lanes] = bind(self.equations.plan, lanes, self._code)
        for name in (REST, *(f"{LOAD}{each.name}" for each in self.equations.loads)):
            slots = self.equations.vectors[name]
            made.put(slots, np.zeros((len(slots), 1)))
        put_design(made, self.equations.vectors, self.equations.design, self.drivers)
        made.put(self.equations.vectors[MULTIPLIERS], self.equations.multipliers[:, None])
        return made

    @cached_property
    def rest(self) -> tuple[Array, float, float]:
        """State and multipliers in equilibrium without loads and travel, the share of weight and
        springs at the end of the walk, one unless there is no such equilibrium, and the determinant
        there.
        """
        executor = self.executor(1)
        put = partial(self._put_rest, executor)
        share, determinant, _ = self._walk(executor, put, self._determinant)
        return executor.get(self._state), float(share[0]), float(determinant[0])

    def _at_design(self) -> tuple[float, float]:
        """Return signs and size of the determinant at design, where what is out of balance is held.
        No walk changes the signs.
        """
        executor = self.executor(1)
        self._put_rest(executor, np.zeros(1))
        executor.run("newton")
        _, signs, determinant = executor.get(self._tests)[:, 0].tolist()
        return signs, determinant

    def _put_rest(self, executor: Executor, share: Array) -> None:
        left = self.equations.rest[:, None]
        executor.put(self.equations.vectors[REST], (1.0 - share) * left)

    def solve(
        self, loads: Mapping[str, Array], travel: Mapping[str, Array], *, slopes: bool = True
    ) -> Equilibria:
        """Return the equilibria of samples.

        Args:
            loads: force and torque by load point [N, N m], shape (n, 6).
            travel: values of held drivers from design [m or rad], shape (n,). Without loads and
                travel there is one sample.
            slopes: whether to compute compliance and stability, without which they are empty.
        """
        n = next((len(each) for each in (*loads.values(), *travel.values())), 1)
        parts = [
            self._solve(
                {name: np.asarray(x)[k : k + LANES] for name, x in loads.items()},
                {name: np.asarray(x)[k : k + LANES] for name, x in travel.items()},
                min(LANES, n - k),
                slopes,
            )
            for k in range(0, n, LANES)
        ]
        return parts[0] if len(parts) == 1 else _joined(parts)

    def _solve(
        self, loads: Mapping[str, Array], travel: Mapping[str, Array], n: int, slopes: bool
    ) -> Equilibria:
        state, settled, determinant = self.rest  # it takes an executor of one lane to itself
        executor, vectors = self.executor(n), self.equations.vectors
        if settled == 1.0:
            executor.put(self._state, state)
        elif not any(np.any(values) for values in loads.values()):
            raise SolveError(
                f"mechanism {self.mechanism.name!r}: no equilibrium at rest; from the design"
                f" position it follows {settled:.3g} of its weight and of its springs' forces;"
                " correct free lengths and preloads, hold a driver, or give loads"
            )
        else:
            determinant = self._determinant

        def put(share: Array) -> None:
            if settled < 1.0:  # only loads hold it: they come with weight and springs
                self._put_rest(executor, share)
            for name, values in loads.items():
                executor.put(vectors[f"{LOAD}{name}"], share * np.asarray(values).T)
            for name, values in travel.items():
                values = self._drive(name, share * values)
                executor.put(vectors[f"{DRIVE}{name}"][: len(values)], values)

        share, _, iterations = self._walk(executor, put, determinant)
        executor.run("compliance")
        return self._read(executor, share, iterations, slopes)

    def _drive(self, name: str, values: Array) -> Array:
        if self.mechanism.driver(name).turns:
            return np.array([values, np.cos(0.5 * values), np.sin(0.5 * values)])
        return values[None] / self.equations.frame.unit  # cosine and sine are of no angle

    def _walk(
        self, executor: Executor, put: Callable[[Array], None], start: float
    ) -> tuple[Array, Array, NDArray[np.int64]]:
        """Walk from share zero, with its determinant, to one; return the last share in equilibrium,
        the determinant there, and iterations.
        """
        n = executor.lanes
        share, step, count = np.zeros(n), np.ones(n), np.zeros(n, np.int64)
        determinant = np.full(n, start)
        state, signs = executor.get(self._state), self._signs
        while (active := (share < 1.0) & (step >= SHORTEST * np.maximum(share, SHORTEST))).any():
            target = np.where(active, np.minimum(1.0, share + step), share)
            put(target)
            accepted, used, first, end = self._newton(executor, signs)
            accepted &= active
            found, last = executor.get(self._state), determinant
            longest = first[accepted].max(initial=0.0)
            parts = (0.25, 0.5, 0.75) if longest > LONG else (0.5,) * int(longest > SETTLED)
            for part in parts:
                put(share + part * (target - share))
                executor.put(self._state, state + part * (found - state))
                executor.run("newton")
                size, at_part, here = executor.get(self._tests)
                accepted &= (size <= CONTRACTION * first + SETTLED) & (at_part == signs)
                accepted &= _steady(last, here)
                last = here
                used += 1
            accepted &= _steady(last, end)
            count += np.where(active, used, 0)
            state = np.where(accepted, found, state)
            determinant = np.where(accepted, end, determinant)
            executor.put(self._state, state)
            share = np.where(accepted, target, share)
            step = np.where(accepted, 2.0 * step, 0.5 * step)
        put(share)
        return share, determinant, count

    def _newton(
        self, executor: Executor, signs: float
    ) -> tuple[Lanes, NDArray[np.int64], Array, Array]:
        """Return the lanes with an equilibrium by contracting corrections, the iterations, the size
        of the first correction, and of the last determinant.
        """
        n = executor.lanes
        first = determinant = np.full(n, np.nan)
        last, used = np.full(n, np.inf), np.zeros(n, np.int64)
        good, settled = np.ones(n, np.bool_), np.zeros(n, np.bool_)
        for _ in range(MOST_ITERATIONS):
            executor.run("newton")
            size, found, determinant = executor.get(self._tests)
            first = np.where(np.isnan(first), size, first)
            used += good & ~settled
            good &= first <= LONGEST
            slow = ~(size <= CONTRACTION * last)
            settled |= good & (size <= SETTLED) & (slow | (size <= ROUND_OFF)) & (found == signs)
            good &= settled | ~(slow & ~((size <= SETTLED) & (found == signs)))
            last = size
            if (settled | ~good).all():
                break
        return good & settled, used, first, determinant

    def _read(
        self, executor: Executor, share: Array, iterations: NDArray[np.int64], slopes: bool
    ) -> Equilibria:
        equations, n = self.equations, len(share)

        def get(name: str) -> Array:
            return executor.get(equations.vectors[name])

        states = {name: get(name) for name in equations.design}
        m = len(self.drivers)
        efforts = get(EFFORTS) if m else np.empty((0, n))

        def by(names: Sequence[str]) -> tuple[Array, Array]:
            slots = [slot for name in names for slot in equations.vectors[f"{BY}{name}"]]
            found = executor.get(slots).reshape(len(names), -1, n).transpose(2, 1, 0)
            return found[:, : equations.unknowns], found[:, equations.unknowns :]

        by_load = {
            each.name: by([f"{each.name}.{k}" for k in range(6)])
            for each in equations.loads
            if slopes
        }
        by_driver = dict[str, tuple[Array, Array]]()
        for name in self.drivers if slopes else ():
            per = 1.0 if self.mechanism.driver(name).turns else 1.0 / equations.frame.unit
            step, of_efforts = by([name])
            by_driver[name] = per * step[..., 0], per * of_efforts[..., 0]
        least, unstable = np.full(n, np.nan), [""] * n
        if slopes:
            executor.run("tangent")
            least, unstable = self._stability(get("tangent"))
        return Equilibria(
            self,
            share >= 1.0,
            share,
            states,
            dict(zip(self.drivers, efforts, strict=True)),
            by_load,
            by_driver,
            least,
            unstable,
            iterations,
        )

    def _stability(self, entries: Array) -> tuple[Array, list[str]]:
        """Return the smallest eigenvalue of the reduced stiffness over the largest, and the motion
        of a negative one.
        """
        n, unknowns = entries.shape[1], self.equations.unknowns
        order = self.equations.order
        matrix = np.zeros((n, order, order))
        rows, columns = np.array(self.equations.tangent).T
        matrix[:, rows, columns] = entries.T
        least, said = np.full(n, np.nan), list[str]()
        for k in range(n):
            free = null_space(matrix[k, unknowns:, :unknowns], unknowns)
            if not free.shape[1]:
                said.append("")
                continue
            stiffness = matrix[k, :unknowns, :unknowns]
            values, modes = np.linalg.eigh(free.T @ (0.5 * (stiffness + stiffness.T)) @ free)
            largest = max(float(np.abs(values).max()), np.finfo(float).tiny)
            least[k] = values[0] / largest
            said.append(self._motion(free @ modes[:, 0]) if least[k] < -NEGATIVE else "")
        return least, said

    def _motion(self, motion: Any) -> str:
        return motion_of(self.equations.columns, motion)


def _steady(one: Array, other: Array) -> Lanes:
    return (one <= STEADY * other) & (other <= STEADY * one)


def _joined(parts: Sequence[Equilibria]) -> Equilibria:
    def rows(values: Sequence[Any]) -> Any:
        return np.concatenate(values, axis=0)

    def slopes(of: Callable[[Equilibria], Mapping[str, tuple[Array, Array]]]) -> Any:
        names = of(parts[0])
        return {x: tuple(rows([of(p)[x][k] for p in parts]) for k in (0, 1)) for x in names}

    first = parts[0]
    return Equilibria(
        first.model,
        rows([each.reached for each in parts]),
        rows([each.share for each in parts]),
        {x: np.concatenate([p.states[x] for p in parts], axis=1) for x in first.states},
        {x: rows([p.efforts[x] for p in parts]) for x in first.efforts},
        slopes(lambda each: each.by_load),
        slopes(lambda each: each.by_driver),
        rows([each.least for each in parts]),
        [way for each in parts for way in each.unstable],
        rows([each.iterations for each in parts]),
    )
