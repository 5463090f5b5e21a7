"""The equations of equilibrium of a mechanism, their exact tangent, and programs to solve them.

    F(x) - J(x)^T lambda = rest,    Phi(x) = 0        F = -(gravity, force elements, loads)

The unknowns are a step (dr, dpi) of every body, and the multipliers lambda of independent rows. The
equations are traced at the state after the step, differentiated by the chain rule, and then the
step is set to zero, so that all terms fold as in other programs. The tangent is exact for these
equations. `rest` is the unbalance at design, taken away little by little.

    newton       one iteration: state, multipliers, size of the step, signs and size of the
                 determinant
    compliance   derivatives of the step and of the drivers' efforts by loads and drivers
    tangent      the entries of the tangent
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from typing import Any

import numpy as np

from ...algebra import ZERO, Scalar, cross, is_literal_zero, vec
from ...errors import SolveError
from ...joints import AxialJoint
from ...kinematics.compiled.request import Layout
from ...kinematics.compiled.traced_forces import angles
from ...kinematics.forces.equations import BodyStates, ForceEquations
from ...kinematics.forces.wanted import wanted_forces
from ...kinematics.formulation.cartesian import Cartesian
from ...kinematics.formulation.constraints import frames
from ...kinematics.formulation.formulation import GROUND_ACCELERATION, Configuration
from ...kinematics.formulation.state_vectors import jacobian as rows_at
from ...kinematics.formulation.state_vectors import moved_most
from ...kinematics.structure.redundancy import independent_rows
from ...mechanism.loads import TorsionSpringDamper
from ...mechanism.mechanism import Mechanism, Point
from ...mechanism.motions import Driver, JointAngle, JointDisplacement, JointDriver
from ...primitives.base import Drive, Twist
from ...program import (
    Elimination,
    NumpyExecutor,
    Plan,
    Program,
    Tape,
    absolute,
    maximum,
)
from ...program.executor import Executor
from ...program.tape import OPERATIONS, Traced, jacobian, live, where_larger
from ...trajectory import Array

STEP, SIGNS, DETERMINANT = "step", "signs", "determinant"
"""Slots: the largest component of the step, and signs and size of the blocks' determinants."""
LOAD = "load "
"""Before the name of a load: its force and torque [N, N m], global axes."""
DRIVE = "drive "
"""Before the name of a held driver: its value from design, and cosine and sine of its half."""
REST = "rest"
"""The vector of the unbalance that is left, by the unknowns [J]."""
MULTIPLIERS = "multipliers"
BY = "by "
"""Before the name of a load's component or a driver: derivatives of step and efforts by it."""
EFFORTS = "efforts"
FORCE = "force of "
"""Before the name of a force element or joint: its amount, or its force and moment."""
# A motion with less stiffness than this part of the largest has none: round-off is 1e-15, and
# torsion of rubber beside a stiff bushing is 1e-6.
FREE = 1e-11
# A motion turns a body rather than moves it, if it turns by more than this per unit of length.
TURNS = 1e-3


class StaticEquations:
    """The traced equations of a mechanism; its drivers are held, all other motions are free.

    Attributes:
        plan: the programs and the slots of a lane.
        vectors: slots by the name of a vector.
        design: vectors of the state at design.
        columns: first unknown of each moving body.
        tangent: row and column of each slot of the tangent; rows of constraints come last.
        unknowns: number of the step's components.
        order: number of all unknowns.
        chosen, dropped: independent rows, and redundant ones.
        rest: the unbalance at design [J], shape (unknowns,).
        multipliers: of the chosen rows at design, which carry the other forces [J].
        wanted: force elements and joints whose forces the programs have.

    Args:
        forces: names of these.

    Raises:
        SolveError: nothing holds a body in some direction, or no force has such a name.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        loads: Sequence[Point] = (),
        forces: Collection[str] = (),
    ) -> None:
        self.wanted = wanted_forces(mechanism, forces)
        for each in mechanism.forces:
            if isinstance(each, TorsionSpringDamper) and not isinstance(
                mechanism.joint(each.joint), AxialJoint
            ):
                raise SolveError(
                    f"{each}: {mechanism.joint(each.joint)} does not turn about one axis, and"
                    " statics follow no other angle; give the spring another joint"
                )
        self.mechanism, self.loads, self.frame = mechanism, tuple(loads), frames(mechanism)
        self._tape, self._layout = Tape(), Layout()
        self.vectors = self._layout.vectors
        self.chosen, self.dropped, self._matrix = self._independent()
        self._drives = dict[str, Drive]()
        for driver in mechanism.drivers:
            value, *half = self._vector(f"{DRIVE}{driver.name}", 3)
            self._drives[driver.name] = Drive(value, 0.0, 0.0, *half)
        self._formulation = formulation = self.formulated(self._drives)
        self.design, self.columns = formulation.design, formulation.columns
        self._now = formulation.configuration(
            {name: self._vector(name, len(value)) for name, value in self.design.items()}
        )
        self.unknowns = formulation.unknowns
        self.order = self.unknowns + len(self.chosen)
        self.plan = self._programs()

    def formulated(self, drives: Mapping[str, Drive]) -> Cartesian:
        """Return the formulation with the numbers of the held drivers."""
        return Cartesian.of(self.mechanism, self.frame, drives, named=angles(self.mechanism))

    def _vector(self, name: str, count: int) -> list[Any]:
        return [self._tape.input(slot) for slot in self._layout.vector(name, count)]

    def _program(self, name: str, vectors: Mapping[str, Sequence[Scalar]]) -> Program:
        return self._layout.program(name, self._tape, vectors)

    def _independent(self) -> tuple[list[int], list[int], Array]:
        """Return the independent rows at design, the others, and the matrix of the former.

        Raises:
            SolveError: joints or other drivers hold the coordinate of a driver already.
        """
        drivers, at_rest = self.mechanism.drivers, self.formulated({})
        matrix = rows_at(at_rest)
        first = len(matrix) - len(drivers)
        rank = len(independent_rows(matrix[:first], 0))
        for k, driver in enumerate(drivers, 1):
            if len(independent_rows(matrix[: first + k], 0)) < rank + k:
                raise SolveError(
                    f"driver {driver.name!r} holds nothing at the design position: joints or other"
                    " held drivers hold its coordinate already; leave it out"
                )
        chosen = independent_rows(matrix, len(drivers), at_rest.conditions)
        return chosen, [k for k in range(len(matrix)) if k not in chosen], matrix[chosen]

    def _programs(self) -> Plan:
        step = self._vector(STEP + " of", self.unknowns)
        multipliers = self._vector(MULTIPLIERS, len(self.chosen))
        pulls = [x for each in self.loads for x in self._vector(f"{LOAD}{each.name}", 6)]
        drives = [
            x for each in self._drives.values() for x in (each.c, each.half_cos, each.half_sin)
        ]
        at = self._formulation.configuration(self._formulation.retract(self._now, step))
        balance, forces = self._balance(at, multipliers, pulls)
        slopes = jacobian(self._tape, balance, [*step, *multipliers, *drives, *pulls], smooth=True)
        # at a step of zero; in one call, as values and slopes share most operations
        every = [*balance, *(x for row in slopes for x in row.values())]
        every += [x for each in forces.values() for x in each]
        found = iter(folded(self._tape, every, dict.fromkeys(self.vectors[f"{STEP} of"], 0.0)))
        balance = [next(found) for _ in balance]
        rows = [{k: next(found) for k in row} for row in slopes]
        forces = {name: [next(found) for _ in each] for name, each in forces.items()}
        slopes = [{k: x for k, x in row.items() if not is_literal_zero(x)} for row in rows]
        tangent = [{k: x for k, x in row.items() if k < self.order} for row in slopes[: self.order]]
        self.tangent = [(i, k) for i, row in enumerate(tangent) for k in row]
        entries = self._program(
            "tangent", {"tangent": [x for row in tangent for x in row.values()]}
        )
        scale, exponent = self._at_design(entries, balance[: self.unknowns])
        rest = self._vector(REST, self.unknowns)
        left = [(1.0 / scale) * (x - y) for x, y in zip(balance, rest, strict=False)]
        factor = Elimination(
            [
                {k: (1.0 / scale) * x if max(i, k) < self.unknowns else x for k, x in row.items()}
                for i, row in enumerate(tangent)
            ]
        )
        corrections = factor.solve([*left, *balance[self.unknowns : self.order]])
        by_step = [-x for x in corrections[: self.unknowns]]
        changes = zip(multipliers, corrections[self.unknowns :], strict=True)
        per_pivot = 2.0 ** -round(exponent / max(1, len(factor.pivots)))
        newton = {
            **self._formulation.retract(self._now, by_step),
            MULTIPLIERS: [x - scale * change for x, change in changes],
            STEP: [reduce(maximum, map(absolute, by_step))],
            SIGNS: [factor.orientation],
            DETERMINANT: [factor.determinant(per_pivot)],
        }
        compliance = {EFFORTS: balance[self.order :], **self._compliance(factor, slopes, scale)}
        compliance |= forces
        programs = (
            entries,
            self._program("newton", newton),
            self._program("compliance", compliance),
        )
        return Plan({each.name: each for each in programs}, dict(self._layout.slots))

    def _balance(
        self, at: Configuration, multipliers: Sequence[Scalar], pulls: Sequence[Scalar]
    ) -> tuple[list[Scalar], dict[str, list[Scalar]]]:
        """Return F - J^T lambda by the unknowns [J], the gaps of the chosen rows, and the efforts
        of the drivers [N or N m]; and the wanted forces by slots.
        """
        bodies = self._formulation.bodies
        still = dict.fromkeys(bodies, Twist(ZERO, ZERO))
        rests = dict.fromkeys(bodies, GROUND_ACCELERATION)
        states = BodyStates(self.frame, at.poses, still, rests)
        equations = ForceEquations.with_angles(self.mechanism, self._formulation, at, states)
        demand = [*equations.demand]
        for each, first in zip(self.loads, range(0, len(pulls), 6), strict=True):
            force, torque = vec(pulls[first : first + 3]), vec(pulls[first + 3 : first + 6])
            if each.body in self.columns:
                arm = states.arm(each.body, each.position)
                pull = [*(self.frame.unit * force), *(cross(arm, force) + torque)]
                for k, x in enumerate(pull, self.columns[each.body]):
                    demand[k] = demand[k] - x
        every: list[Scalar] = [0.0] * len(equations.rows)
        for row, multiplier in zip(self.chosen, multipliers, strict=True):
            every[row] = multiplier
            for k, x in equations.rows[row].items():
                demand[k] = demand[k] - x * multiplier
        gaps = self._formulation.phi(at)
        efforts = [equations.effort(each, every) for each in self.mechanism.drivers]
        forces = {f"{FORCE}{x}": [equations.applied[x].amount] for x in self.wanted.elements}
        for name in self.wanted.joints:
            force, moment = equations.reaction(self.mechanism.joint(name), every)
            forces[f"{FORCE}{name}"] = [*((1.0 / self.frame.unit) * force), *moment]
        return [*demand, *(gaps[k] for k in self.chosen), *efforts], forces

    def _at_design(self, entries: Program, forces: Sequence[Scalar]) -> tuple[float, float]:
        """Find what is out of balance at the design position without loads, and the multipliers
        that carry the rest; return the scale of the stiffness and the binary exponent of the
        determinant.

        Raises:
            SolveError: nothing holds a body in some direction.
        """
        unbalanced = self._program("unbalanced", {"unbalanced": forces})
        both = {each.name: each for each in (entries, unbalanced)}
        executor = NumpyExecutor(Plan(both, dict(self._layout.slots)), 1)
        executor.clear()
        self.multipliers = np.zeros(len(self.chosen))
        self.set_to_design(executor)
        executor.run("unbalanced")
        out = self.vectors["unbalanced"]
        # joints carry what they can, which changes the stiffness; the rest is out of balance
        found = np.linalg.lstsq(self._matrix.T, executor.get(out)[:, 0], rcond=None)[0]
        self.multipliers = np.asarray(found, dtype=np.float64)
        self.set_to_design(executor)
        for name in both:
            executor.run(name)
        self.rest = executor.get(out)[:, 0]
        matrix = np.zeros((self.order, self.order))
        matrix[tuple(np.array(self.tangent).T)] = executor.get(self.vectors["tangent"])[:, 0]
        stiffness = matrix[: self.unknowns, : self.unknowns]
        largest = float(np.abs(stiffness).max(initial=0.0))
        self._require_held(stiffness, largest)
        scale = 2.0 ** round(np.log2(largest)) if largest else 1.0
        stiffness /= scale
        return scale, float(np.linalg.slogdet(matrix)[1]) / np.log(2.0)

    def set_to_design(self, executor: Executor) -> None:
        """Set all lanes to the design position without loads."""
        for name, values in self.design.items():
            executor.put(self.vectors[name], np.array(values)[:, None])
        for name in self._drives:
            executor.put(self.vectors[f"{DRIVE}{name}"], np.array([[0.0], [1.0], [0.0]]))
        executor.put(self.vectors[MULTIPLIERS], self.multipliers[:, None])

    def _require_held(self, stiffness: Array, largest: float) -> None:
        free = null_space(self._matrix, self.unknowns)
        reduced = free.T @ stiffness @ free
        u, sizes, _ = np.linalg.svd(reduced)
        loose = u[:, sizes <= FREE * largest] if largest else u
        if not loose.size:
            return
        motion = free @ loose[:, 0]
        name, _ = moved_most(self.columns, motion)
        own = [each for each in self.mechanism.forces if name in each.bodies]
        verb = "does" if len(own) == 1 else "do"
        known = f" ({', '.join(map(str, own))} {verb} not)" if own else ""
        raise SolveError(
            f"{motion_of(self.columns, motion)} freely: no joint, spring or bushing"
            f" holds it at the design position{known}; give stiffness or turning_stiffness there,"
            " hold a driver, or give another design position"
        )

    def _compliance(
        self, factor: Elimination, slopes: Sequence[Mapping[int, Scalar]], scale: float
    ) -> dict[str, list[Scalar]]:
        """Return the derivatives of step and efforts by each driver and component of a load."""
        n, found = self.unknowns, dict[str, list[Scalar]]()

        def add(name: str, first: int, weights: Sequence[Scalar], *, pulls: bool) -> None:
            def by_input(row: Mapping[int, Scalar]) -> Scalar:
                return sum((row.get(first + k, 0.0) * x for k, x in enumerate(weights)), 0.0)

            # drivers move the rows, and loads pull
            pull = [(-1.0 / scale) * by_input(row) if pulls else 0.0 for row in slopes[:n]]
            gaps = [0.0 if pulls else -by_input(row) for row in slopes[n : self.order]]
            rates = factor.solve([*pull, *gaps])
            step, rates = rates[:n], [*rates[:n], *(scale * x for x in rates[n:])]
            efforts = [
                sum((x * rates[k] for k, x in row.items() if k < self.order), by_input(row))
                for row in slopes[self.order :]
            ]
            found[f"{BY}{name}"] = [*step, *efforts]

        loads = self.order + 3 * len(self._drives)
        components = [f"{each.name}.{k}" for each in self.loads for k in range(6)]
        for k, name in enumerate(components, loads):
            add(name, k, (1.0,), pulls=True)
        for (name, drive), first in zip(
            self._drives.items(), range(self.order, loads, 3), strict=True
        ):
            weights = (1.0, -0.5 * drive.half_sin, 0.5 * drive.half_cos)
            add(name, first, weights, pulls=False)
        return found


def with_free_coordinates(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with drivers of joints' coordinates that its own drivers leave free, as
    far as joints have any.
    """
    driven = {(x.joint, x.freedom) for x in mechanism.drivers if isinstance(x, JointDriver)}
    names, candidates = {each.name for each in mechanism.drivers}, list[Driver]()
    for joint in mechanism.joints:
        kinds = [
            each
            for each in (JointAngle, JointDisplacement)
            if each.freedom in joint.freedoms and (joint.name, each.freedom) not in driven
        ]
        whole = joint.name not in names and len(kinds) == 1
        for each in kinds:
            name = joint.name if whole else f"{joint.name}.{each.freedom}"
            candidates.append(each(name, joint.name))
    every = replace(mechanism, drivers=[*mechanism.drivers, *candidates])
    rows = rows_at(Cartesian.of(every, frames(every), named=angles(every)))
    first, chosen = len(rows) - len(candidates), list[Driver]()
    kept = rows[:first]
    rank = len(independent_rows(kept, 0))
    for driver, row in zip(candidates, rows[first:], strict=True):
        wider = np.vstack([kept, row])
        if (of_wider := len(independent_rows(wider, 0))) > rank:
            kept, rank = wider, of_wider
            chosen.append(driver)
    return replace(mechanism, drivers=[*mechanism.drivers, *chosen])


def null_space(rows: Array, unknowns: int) -> Array:
    """Return an orthonormal basis of the motions left by independent rows, as columns."""
    if not len(rows):
        return np.eye(unknowns)
    return np.linalg.qr(rows.T, mode="complete")[0][:, len(rows) :]


def motion_of(columns: Mapping[str, int], motion: Array) -> str:
    """Return a motion of the unknowns in words, by the body moved most."""
    name, own = moved_most(columns, motion)
    turning = np.linalg.norm(own[3:]) > TURNS * np.linalg.norm(own[:3])
    along = own[3:] if turning else own[:3]
    size = float(np.abs(along).max())
    axis = ", ".join(f"{round(float(x) / size, 6) + 0.0:.3g}" for x in along)
    return f"body {name!r} {'turns about' if turning else 'moves along'} [{axis}]"


def folded(tape: Tape, values: Sequence[Scalar], known: Mapping[int, Scalar]) -> list[Scalar]:
    """Return scalars with numbers in place of some inputs, by slot, or with scalars of one other
    kind in place of all: all operations fold again.
    """
    new: dict[int, Scalar] = {}
    for number in live(tape, values):
        op, *rest = tape.nodes[number]
        if op == "input":
            new[number] = known.get(int(rest[0]), tape.scalars[number])
        elif op == "const":
            new[number] = float(rest[0])
        elif op == "where":
            _, *sizes = tape.nodes[int(rest[0])]
            new[number] = where_larger(*(new[int(k)] for k in (*sizes, *rest[1:])))
        elif op != "larger":  # which "where" reads itself
            new[number] = OPERATIONS[str(op)](*(new[int(k)] for k in rest))
    return [new[each.number] if isinstance(each, Traced) else each for each in values]
