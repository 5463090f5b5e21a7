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

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from ...algebra import quat, vec
from ...errors import SolveError
from ...forces import Forces, Multipliers, Reaction, in_wrenches
from ...kinematics.compiled.request import slots_of
from ...kinematics.forces.equations import BodyStates, ForceEquations
from ...kinematics.forces.reactions import free_wrench
from ...kinematics.formulation.cartesian import COLUMNS, Cartesian
from ...kinematics.formulation.constraints import constraints_left_out
from ...kinematics.formulation.state_vectors import columns_of, dense, placed_bodies
from ...mechanism.mechanism import Mechanism, Point
from ...primitives.base import Drive, Pose
from ...program.executor import Executor, ready
from ...trajectory import Array, BodyMotion
from .equations import (
    BY,
    DETERMINANT,
    DRIVE,
    EFFORTS,
    FORCE,
    LOAD,
    MULTIPLIERS,
    REST,
    SIGNS,
    STEP,
    StaticEquations,
    motion_of,
    null_space,
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
        wanted: by force element or joint, the amount, shape (1, n), or force and moment on the
            second body, shape (6, n) [N, N m].
        held: the numbers of held drivers, by name, shape (3, n).
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
    wanted: Mapping[str, Array]
    held: Mapping[str, Array]

    @cached_property
    def forces(self) -> Forces:
        """The wanted forces. Of redundant rows some carry all: a rank test tells what else does."""
        n, equations = len(self.share), self.model.equations
        unknown, wanted = np.full(n, np.nan), equations.wanted
        free, known = self._free() if wanted.joints else ({}, unknown)

        def reaction(name: str) -> Reaction:
            values = self.wanted[name]
            return Reaction(values[:3].T, values[3:].T, free[name], known)

        return Forces(
            {name: reaction(name) for name in wanted.joints},
            self.efforts,
            {name: self.wanted[name][0] for name in wanted.elements},
            unknown,
            unknown,
        )

    def _free(self) -> tuple[dict[str, Array], Array]:
        """Return the undetermined directions of the wanted joints' wrenches, and `Reaction.known`,
        which is NaN at singular poses.
        """
        mechanism, equations, n = self.model.mechanism, self.model.equations, len(self.share)
        joints = [mechanism.joint(name) for name in equations.wanted.joints]
        if not (equations.dropped or mechanism.reduced):
            return {joint.name: np.empty((n, 6, 0)) for joint in joints}, np.zeros(n)
        formulation = equations.formulated(
            {name: Drive(c, 0.0, 0.0, *half) for name, (c, *half) in self.held.items()}
        )
        left_out = Cartesian(constraints_left_out(mechanism, equations.frame), formulation.bodies)
        state = {name: [*values] for name, values in self.states.items()}
        rows = ForceEquations(
            mechanism, formulation, formulation.configuration(state), self._at, {}, left_out
        )
        matrix, last = dense(rows.rows, formulation.unknowns, n), len(formulation.owners)
        found = Multipliers.of(
            matrix,
            np.zeros((n, formulation.unknowns)),
            range(last - len(mechanism.drivers), last),
            matrix.shape[1] - last,
            formulation.unknowns - len(equations.chosen),
        )
        if mechanism.reduced:
            joints = mechanism.given_joints
        free = {joint.name: free_wrench(rows, joint, found) for joint in joints}
        if mechanism.reduced:
            free = in_wrenches(free, found.known)
        return free, np.where(found.singular, np.nan, found.known)

    @cached_property
    def _at(self) -> BodyStates:
        poses = {
            name: Pose.of(vec([*self.states[f"u {name}"]]), quat([*self.states[f"q {name}"]]))
            for name in self.model.equations.columns
        }
        return BodyStates(self.model.equations.frame, poses, {}, {})

    @cached_property
    def bodies(self) -> Mapping[str, BodyMotion]:
        """Poses of the moving bodies at the last equilibrium."""
        still = np.zeros((len(self.share), 6))
        mechanism, at = self.model.mechanism, self._at
        return {
            name: BodyMotion(r, p, still, still)
            for name, (r, p) in placed_bodies(mechanism, at.frame, at.poses, len(still)).items()
        }

    def place(self, body: str, position: Sequence[float]) -> Array:
        """Return a point of a body, given at design [m], shape (n, 3)."""
        return np.array(position) + columns_of(self._at.place(body, position), len(self.share))

    def direction(self, body: str, design: Sequence[float]) -> Array:
        """Return a direction fixed in a body, given at design [-], shape (n, 3)."""
        return columns_of(self._at.turn(body, design), len(self.share))

    def motion(self, step: Array, body: str, position: Sequence[float]) -> Array:
        """Return the motion of a point and the turn of its body [m, rad], shape (n, 6, ...), for
        motions of the unknowns, shape (n, unknowns, ...).
        """
        found = np.zeros((len(step), 6, *step.shape[2:]))
        first = self.model.equations.columns.get(body)
        if first is not None:
            reach = columns_of(self._at.arm(body, position), len(step))
            own = step[:, first : first + COLUMNS]
            found[:, 3:] = own[:, 3:]
            turns = np.moveaxis(own[:, 3:], 1, -1)
            swept = np.cross(turns, reach.reshape(len(step), *(1,) * (step.ndim - 2), 3))
            found[:, :3] = self._at.frame.unit * own[:, :3] + np.moveaxis(swept, -1, 1)
        return found

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
    """A mechanism ready for statics. Its drivers are held; `compliance.released` has bushings in
    place of joints.

    Raises:
        SolveError: nothing holds a body, or weight and springs have no equilibrium near the design.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        loads: Sequence[Point] = (),
        forces: Collection[str] = (),
    ) -> None:
        self.mechanism, self.equations = mechanism, StaticEquations(mechanism, loads, forces)
        self.drivers = [each.name for each in mechanism.drivers]
        vectors = self.equations.vectors
        names = [*self.equations.design, MULTIPLIERS]
        self._state = slots_of(vectors, names)
        self._tests = slots_of(vectors, (STEP, SIGNS, DETERMINANT))
        self._bind = ready(self.equations.plan)
        self._bound: dict[int, Executor] = {}
        # no walk changes the signs
        executor = self.executor(1)
        self._put_rest(executor, np.zeros(1))
        executor.run("newton")
        _, self._signs, self._determinant = executor.get(self._tests)[:, 0].tolist()

    def executor(self, lanes: int) -> Executor:
        """Return the programs bound to lanes at design."""
        made = self._bound.get(lanes)
        if made is None:
            made = self._bound[lanes] = self._bind(lanes)
        for name in (REST, *(f"{LOAD}{each.name}" for each in self.equations.loads)):
            slots = self.equations.vectors[name]
            made.put(slots, np.zeros((len(slots), 1)))
        self.equations.set_to_design(made)
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
            slopes: whether to compute compliance, stability and wanted forces, without which they
                are empty.
        """
        n = next((len(each) for each in (*loads.values(), *travel.values())), 1)
        kept = [*self.equations.design, EFFORTS]
        if slopes:
            wanted = (BY, FORCE, DRIVE)
            kept += [name for name in self.equations.vectors if name.startswith(wanted)]
            kept += ["tangent"]
        ends = [0, *np.cumsum([len(self.equations.vectors[name]) for name in kept]).tolist()]
        parts = [
            self._solve(
                {name: np.asarray(x)[k : k + LANES] for name, x in loads.items()},
                {name: np.asarray(x)[k : k + LANES] for name, x in travel.items()},
                min(LANES, n - k),
                kept,
            )
            for k in range(0, n, LANES)
        ]
        share, iterations, table = (np.concatenate(x, axis=-1) for x in zip(*parts, strict=True))
        found = {
            name: table[first:last] for name, first, last in zip(kept, ends, ends[1:], strict=False)
        }
        return self._read(share, iterations, found)

    def _solve(
        self,
        loads: Mapping[str, Array],
        travel: Mapping[str, Array],
        n: int,
        kept: Sequence[str],
    ) -> tuple[Array, NDArray[np.int64], Array]:
        """Return shares and iterations of samples, and their values of vectors."""
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
                slots, values = vectors[f"{DRIVE}{name}"], share * values
                if self.mechanism.driver(name).turns:
                    halves = np.cos(0.5 * values), np.sin(0.5 * values)
                    executor.put(slots, np.array([values, *halves]))
                else:  # cosine and sine are of no angle
                    executor.put(slots[:1], values[None] / self.equations.frame.unit)

        share, _, iterations = self._walk(executor, put, determinant)
        executor.run("compliance")
        if "tangent" in kept:
            executor.run("tangent")
        return share, iterations, executor.get(slots_of(vectors, kept))

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
        self, share: Array, iterations: NDArray[np.int64], found: Mapping[str, Array]
    ) -> Equilibria:
        equations, n = self.equations, len(share)
        by_load, by_driver = dict[str, tuple[Array, Array]](), dict[str, tuple[Array, Array]]()
        least, unstable = np.full(n, np.nan), [""] * n
        if "tangent" in found:
            for each in equations.loads:
                by = np.stack([found[f"{BY}{each.name}.{k}"].T for k in range(6)], axis=-1)
                by_load[each.name] = by[:, : equations.unknowns], by[:, equations.unknowns :]
            for name in self.drivers:
                per = 1.0 if self.mechanism.driver(name).turns else 1.0 / equations.frame.unit
                by = per * found[f"{BY}{name}"].T
                by_driver[name] = by[:, : equations.unknowns], by[:, equations.unknowns :]
            least, unstable = self._stability(found["tangent"])
        return Equilibria(
            self,
            share >= 1.0,
            share,
            {name: found[name] for name in equations.design},
            dict(zip(self.drivers, found[EFFORTS], strict=True)),
            by_load,
            by_driver,
            least,
            unstable,
            iterations,
            {k.removeprefix(FORCE): x for k, x in found.items() if k.startswith(FORCE)},
            {k.removeprefix(DRIVE): x for k, x in found.items() if k.startswith(DRIVE)},
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
            motion = free @ modes[:, 0]
            said.append(motion_of(self.equations.columns, motion) if least[k] < -NEGATIVE else "")
        return least, said


def _steady(one: Array, other: Array) -> Lanes:
    return (one <= STEADY * other) & (other <= STEADY * one)
