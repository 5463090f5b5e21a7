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

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np

from ...algebra import ZERO, Scalar, cross, is_literal_zero, vec
from ...errors import SolveError
from ...joints import AxialJoint
from ...mechanism.loads import TorsionSpringDamper
from ...mechanism.mechanism import Mechanism, Vector
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
    program,
)
from ...program.llvm.executor import Executor
from ...program.tape import folded, jacobian
from ...trajectory import Array
from ..compiled.request import Layout
from ..compiled.traced_forces import angles
from ..forces.equations import BodyStates, ForceEquations, Wrench, at_work
from ..formulation.cartesian import COLUMNS, Cartesian
from ..formulation.constraints import Frames, constraints, frames
from ..formulation.formulation import GROUND_ACCELERATION
from ..formulation.state_vectors import jacobian as rows_at
from ..structure.redundancy import independent_rows

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
# A motion with less stiffness than this part of the largest has none: round-off is 1e-15, and
# torsion of rubber beside a stiff bushing is 1e-6.
FREE = 1e-11
# A motion turns a body rather than moves it, if it turns by more than this per unit of length.
TURNS = 1e-3


@dataclass(frozen=True)
class LoadPoint:
    """A place of loads: a force at a point carried by a body, and a torque."""

    name: str
    body: str
    position: Vector


@dataclass(frozen=True, eq=False)
class StaticEquations:
    """The traced equations of a mechanism.

    Attributes:
        plan: the programs and the slots of a lane.
        vectors: slots by the name of a vector.
        design: vectors of the state at design.
        columns: first unknown of each moving body.
        tangent: row and column of each slot of the tangent; rows of constraints come last.
        unknowns: number of the step's components.
        scale: of forces [J].
        chosen, dropped: independent rows, and redundant ones.
        rest: the unbalance at design [J], shape (unknowns,).
        multipliers: of the chosen rows at design, which carry the other forces [J].
    """

    mechanism: Mechanism
    loads: tuple[LoadPoint, ...]
    plan: Plan
    vectors: Mapping[str, Sequence[int]]
    design: Mapping[str, Sequence[float]]
    columns: Mapping[str, int]
    tangent: Sequence[tuple[int, int]]
    unknowns: int
    scale: float
    chosen: tuple[int, ...]
    dropped: tuple[int, ...]
    rest: Array
    multipliers: Array
    frame: Frames

    @property
    def order(self) -> int:
        """Number of all unknowns."""
        return self.unknowns + len(self.chosen)


def static_equations(mechanism: Mechanism, loads: Sequence[LoadPoint] = ()) -> StaticEquations:
    """Trace the equations of a mechanism; its drivers are held, all other motions are free.

    Raises:
        SolveError: nothing holds a body in some direction.
    """
    return _Tracer(mechanism, loads).equations()


def with_free_coordinates(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with drivers of joints' coordinates that its own drivers leave free, as
    far as joints have any.
    """
    driven = {(x.joint, x.freedom) for x in mechanism.drivers if isinstance(x, JointDriver)}
    names = {each.name for each in mechanism.drivers}
    candidates = [
        cls(joint.name if joint.name not in names else f"{joint.name}.{cls.freedom}", joint.name)
        for joint in mechanism.joints
        for cls in (JointAngle, JointDisplacement)
        if cls.freedom in joint.freedoms and (joint.name, cls.freedom) not in driven
    ]
    every = replace(mechanism, drivers=[*mechanism.drivers, *candidates])
    frame, drives = frames(every), {each.name: Drive() for each in every.drivers}
    found = constraints(every, frame, drives, named=angles(every))
    rows = rows_at(Cartesian(found, frame.moving))
    first, chosen = len(rows) - len(candidates), list[Driver]()
    kept = rows[:first]
    rank = len(independent_rows(kept, 0))
    for driver, row in zip(candidates, rows[first:], strict=True):
        wider = np.vstack([kept, row])
        if (of_wider := len(independent_rows(wider, 0))) > rank:
            kept, rank = wider, of_wider
            chosen.append(driver)
    return replace(mechanism, drivers=[*mechanism.drivers, *chosen])


class _Tracer:
    def __init__(self, mechanism: Mechanism, loads: Sequence[LoadPoint]) -> None:
        for each in mechanism.forces:
            if isinstance(each, TorsionSpringDamper) and not isinstance(
                mechanism.joint(each.joint), AxialJoint
            ):
                raise SolveError(
                    f"{each}: statics follow the angle of hinges and of other joints about one"
                    f" axis; {mechanism.joint(each.joint)} is none, give the spring another joint"
                )
        self.mechanism, self.loads = mechanism, tuple(loads)
        self.tape, self.layout, self.frame = Tape(), Layout(), frames(mechanism)
        drives = {each.name: Drive() for each in mechanism.drivers}
        at_rest = self._formulate(drives)
        matrix = rows_at(at_rest)
        held = len(mechanism.drivers)
        self.chosen = tuple(independent_rows(matrix, held, at_rest.conditions))
        self._require_free(matrix, held)
        self.dropped = tuple(k for k in range(len(matrix)) if k not in self.chosen)
        self.matrix = matrix[list(self.chosen)]
        inputs = {name: self._vector(f"{DRIVE}{name}", 3) for name in drives}
        self.drives = {name: Drive(c, 0.0, 0.0, cos, sin) for name, (c, cos, sin) in inputs.items()}
        self.formulation = self._formulate(self.drives)
        self.state = {
            name: self._vector(name, len(value)) for name, value in self.formulation.design.items()
        }
        self.n = self.formulation.unknowns
        self.step = self._vector(STEP + " of", self.n)
        self.multipliers = self._vector(MULTIPLIERS, len(self.chosen))
        self.at = self.formulation.configuration(
            self.formulation.retract(self.formulation.configuration(self.state), self.step)
        )
        still = {name: Twist(ZERO, ZERO) for name in self.formulation.bodies}
        rests = dict.fromkeys(self.formulation.bodies, GROUND_ACCELERATION)
        self.states = BodyStates(self.frame, self.at.poses, still, rests)

    def _require_free(self, matrix: Array, held: int) -> None:
        """Raise SolveError if joints or other drivers hold the coordinate of a driver already."""
        first, rank = len(matrix) - held, len(independent_rows(matrix[: len(matrix) - held], 0))
        for k, driver in enumerate(self.mechanism.drivers, 1):
            if len(independent_rows(matrix[: first + k], 0)) < rank + k:
                raise SolveError(
                    f"driver {driver.name!r} holds nothing at the design position: joints or other"
                    " held drivers hold its coordinate already; leave it out"
                )

    def _formulate(self, drives: Mapping[str, Drive]) -> Cartesian:
        found = constraints(self.mechanism, self.frame, drives, named=angles(self.mechanism))
        return Cartesian(found, self.frame.moving)

    def _vector(self, name: str, count: int) -> list[Any]:
        return [self.tape.input(slot) for slot in self.layout.vector(name, count)]

    def equations(self) -> StaticEquations:
        """Return the equations with all programs."""
        rows = self.formulation.rows(self.at)
        gaps = [self.formulation.phi(self.at)[k] for k in self.chosen]
        forces, efforts = self._forces([rows[k] for k in self.chosen]), self._efforts()
        drives = [x for drive in self.drives.values() for x in _numbers(drive)]
        inputs = [*self.step, *self.multipliers, *drives]
        slopes = jacobian(self.tape, [*forces, *gaps, *efforts], inputs, smooth=True)
        values, slopes = self._now([*forces, *gaps, *efforts], slopes)
        balance, efforts = values[: self.order], values[self.order :]
        tangent = [{k: x for k, x in row.items() if k < self.order} for row in slopes[: self.order]]
        at_design = self._at_design(tangent, balance[: self.n])
        scale = at_design.scale
        rest = self._vector(REST, self.n)
        left = [(1.0 / scale) * (x - y) for x, y in zip(balance, rest, strict=False)]
        factor = Elimination(
            [
                {k: (1.0 / scale) * x if max(i, k) < self.n else x for k, x in row.items()}
                for i, row in enumerate(tangent)
            ]
        )
        programs = [
            at_design.program,
            self._newton(factor, [*left, *balance[self.n :]], at_design),
            self._compliance(factor, slopes, efforts, scale),
        ]
        return StaticEquations(
            self.mechanism,
            self.loads,
            Plan({each.name: each for each in programs}, dict(self.layout.slots)),
            self.layout.vectors,
            self.formulation.design,
            self.formulation.columns,
            [(i, k) for i, row in enumerate(tangent) for k in row],
            self.n,
            scale,
            self.chosen,
            self.dropped,
            at_design.unbalanced,
            at_design.multipliers,
            self.frame,
        )

    @property
    def order(self) -> int:
        """Number of all unknowns."""
        return self.n + len(self.chosen)

    def _forces(self, rows: Sequence[Mapping[int, Scalar]]) -> list[Scalar]:
        """Return F - J^T lambda by the unknowns [J]."""
        wrenches = dict[str, Wrench]()
        for each in self.loads:
            slots = self._vector(f"{LOAD}{each.name}", 6)
            force, torque = vec(slots[:3]), vec(slots[3:])
            at_point = Wrench.at(self.states.arm(each.body, each.position), force)
            wrenches[each.name] = at_point + Wrench(ZERO, torque)
        applied = at_work(
            self.mechanism, self.states, lambda joint: self.at.state[f"x {joint}.rotation"][0]
        )
        self.balance = ForceEquations(
            *(self.mechanism, self.formulation, self.at, self.states, applied), Cartesian((), ())
        )
        found = list(self.balance.demand)
        for each in self.loads:
            if each.body in self.formulation.columns:
                first, wrench = self.formulation.columns[each.body], wrenches[each.name]
                pull = [*(self.frame.unit * wrench.force), *wrench.torque]
                for k, x in enumerate(pull, first):
                    found[k] = found[k] - x
        for row, multiplier in zip(rows, self.multipliers, strict=True):
            for k, x in row.items():
                found[k] = found[k] - x * multiplier
        return found

    def _efforts(self) -> list[Scalar]:
        """Return the efforts of the drivers [N or N m]."""
        every: list[Scalar] = [0.0] * len(self.balance.rows)
        for k, x in zip(self.chosen, self.multipliers, strict=True):
            every[k] = x
        return [self.balance.effort(each, every) for each in self.mechanism.drivers]

    def _now(
        self, values: Sequence[Scalar], slopes: Sequence[Mapping[int, Scalar]]
    ) -> tuple[list[Scalar], list[dict[int, Scalar]]]:
        """Return values and their derivatives at a step of zero."""
        zero = dict.fromkeys(self.layout.vectors[f"{STEP} of"], 0.0)
        # in one call, as they share most operations
        every = [*values, *(x for row in slopes for x in row.values())]
        found = folded(self.tape, every, zero)
        rest = iter(found[len(values) :])
        rows = [{k: next(rest) for k in row} for row in slopes]
        return found[: len(values)], [
            {k: x for k, x in row.items() if not is_literal_zero(x)} for row in rows
        ]

    def _at_design(
        self, tangent: Sequence[Mapping[int, Scalar]], forces: Sequence[Scalar]
    ) -> _AtDesign:
        """Evaluate tangent and forces at the design position without loads.

        Raises:
            SolveError: nothing holds a body in some direction.
        """
        places = [(i, k) for i, row in enumerate(tangent) for k in row]
        entries = [x for row in tangent for x in row.values()]
        slots = self.layout.vector("tangent", len(places))
        found = program("tangent", self.tape, dict(zip(slots, entries, strict=True)))
        out = self.layout.vector("unbalanced", self.n)
        of_forces = program("unbalanced", self.tape, dict(zip(out, forces, strict=True)))
        both = {each.name: each for each in (found, of_forces)}
        executor = NumpyExecutor(Plan(both, dict(self.layout.slots)), 1)
        executor.clear()
        put_design(executor, self.layout.vectors, self.formulation.design, self.drives)
        executor.run("unbalanced")
        # joints carry what they can, which changes the stiffness; the rest is out of balance
        carried: Any = np.linalg.lstsq(self.matrix.T, executor.get(out)[:, 0], rcond=None)[0]
        executor.put(self.layout.vectors[MULTIPLIERS], carried[:, None])
        for name in both:
            executor.run(name)
        matrix = np.zeros((self.order, self.order))
        matrix[tuple(np.array(places).T)] = executor.get(slots)[:, 0]
        stiffness = matrix[: self.n, : self.n]
        largest = float(np.abs(stiffness).max(initial=0.0))
        self._require_held(stiffness, largest)
        scale = 2.0 ** round(np.log2(largest)) if largest else 1.0
        stiffness /= scale
        exponent = float(np.linalg.slogdet(matrix)[1]) / np.log(2.0)
        return _AtDesign(found, scale, exponent, carried, executor.get(out)[:, 0])

    def _require_held(self, stiffness: Array, largest: float) -> None:
        free = null_space(self.matrix, self.n)
        reduced = free.T @ stiffness @ free
        u, sizes, _ = np.linalg.svd(reduced)
        loose = u[:, sizes <= FREE * largest] if largest else u
        if not loose.size:
            return
        motion = free @ loose[:, 0]
        name, _ = moved_most(self.formulation.columns, motion)
        own = [each for each in self.mechanism.forces if name in each.bodies]
        verb = "does" if len(own) == 1 else "do"
        known = f" ({', '.join(map(str, own))} {verb} not)" if own else ""
        raise SolveError(
            f"{motion_of(self.formulation.columns, motion)} freely: no joint, spring or bushing"
            f" holds it at the design position{known}; give stiffness or turning_stiffness there,"
            " hold a driver, or give another design position"
        )

    def _newton(self, factor: Elimination, left: Sequence[Scalar], at_design: _AtDesign) -> Program:
        found, out = factor.solve(left), dict[int, Scalar]()
        by_step = [-x for x in found[: self.n]]
        new = self.formulation.retract(self.formulation.configuration(self.state), by_step)
        for name, values in new.items():
            out |= zip(self.layout.vectors[name], values, strict=True)
        multipliers = zip(self.multipliers, found[self.n :], strict=True)
        slots = self.layout.vectors[MULTIPLIERS]
        out |= zip(slots, (x - at_design.scale * change for x, change in multipliers), strict=True)
        out[self.layout.scalar(STEP)] = reduce(maximum, map(absolute, by_step))
        out[self.layout.scalar(SIGNS)] = factor.orientation
        per_pivot = 2.0 ** -round(at_design.exponent / max(1, len(factor.pivots)))
        out[self.layout.scalar(DETERMINANT)] = factor.determinant(per_pivot)
        return program("newton", self.tape, out)

    def _compliance(
        self,
        factor: Elimination,
        slopes: Sequence[Mapping[int, Scalar]],
        efforts: Sequence[Scalar],
        scale: float,
    ) -> Program:
        out = dict[int, Scalar]()
        out |= zip(self.layout.vector(EFFORTS, len(efforts)), efforts, strict=True)
        of_efforts = slopes[self.order :]

        def add(name: str, right: list[Scalar], own: Sequence[Scalar]) -> None:
            found = factor.solve(right)
            step, rates = found[: self.n], [*found[: self.n], *(scale * x for x in found[self.n :])]
            totals = [
                sum((x * rates[k] for k, x in row.items() if k < self.order), start)
                for row, start in zip(of_efforts, own, strict=True)
            ]
            values = [*step, *totals]
            out.update(zip(self.layout.vector(f"{BY}{name}", len(values)), values, strict=True))

        none = [0.0] * len(efforts)
        now = self.formulation.configuration(self.state)
        for each in self.loads:
            for k in range(6):
                right: list[Scalar] = [0.0] * self.order
                first = self.formulation.columns.get(each.body)
                if first is not None:
                    unit = vec([float(k == x) for x in range(3)])
                    turn = vec([float(k == x) for x in range(3, 6)])
                    pose = now.poses[each.body]
                    arm = self.frame.unit * pose.turn(self.frame.arm(each.body, each.position))
                    pull = [*(self.frame.unit * unit), *(cross(arm, unit) + turn)]
                    for x, value in enumerate(pull, first):
                        right[x] = (1.0 / scale) * value
                add(f"{each.name}.{k}", right, none)
        for number, (name, drive) in enumerate(self.drives.items()):
            first = self.order + 3 * number
            weights = (1.0, -0.5 * drive.half_sin, 0.5 * drive.half_cos)

            def by_drive(row: Mapping[int, Scalar], first: int, weights: Any) -> Scalar:
                return sum((row.get(first + k, 0.0) * x for k, x in enumerate(weights)), 0.0)

            right = [0.0] * self.n
            right += [-by_drive(row, first, weights) for row in slopes[self.n : self.order]]
            add(name, right, [by_drive(row, first, weights) for row in of_efforts])
        return program("compliance", self.tape, out)


@dataclass(frozen=True, eq=False)
class _AtDesign:
    """The program of the tangent, the scale of its stiffness, the binary exponent of its
    determinant, the multipliers that carry most of the forces, and the rest of them.
    """

    program: Program
    scale: float
    exponent: float
    multipliers: Array
    unbalanced: Array


def _numbers(drive: Drive) -> tuple[Scalar, Scalar, Scalar]:
    return drive.c, drive.half_cos, drive.half_sin


def put_design(
    executor: Executor,
    vectors: Mapping[str, Sequence[int]],
    design: Mapping[str, Sequence[float]],
    drivers: Iterable[str],
) -> None:
    """Set all lanes to the design position without loads."""
    for name, values in design.items():
        executor.put(vectors[name], np.array(values)[:, None])
    for name in drivers:
        executor.put(vectors[f"{DRIVE}{name}"], np.array([[0.0], [1.0], [0.0]]))


def null_space(rows: Array, unknowns: int) -> Array:
    """Return an orthonormal basis of the motions left by independent rows, as columns."""
    if not len(rows):
        return np.eye(unknowns)
    return np.linalg.qr(rows.T, mode="complete")[0][:, len(rows) :]


def moved_most(columns: Mapping[str, int], motion: Array) -> tuple[str, Array]:
    """Return the body moved most by a motion of the unknowns, and its part (dr, dpi)."""
    name, first = max(
        columns.items(), key=lambda each: float(np.linalg.norm(motion[each[1] : each[1] + COLUMNS]))
    )
    return name, motion[first : first + COLUMNS]


def motion_of(columns: Mapping[str, int], motion: Array) -> str:
    """Return a motion of the unknowns in words, by the body moved most."""
    name, own = moved_most(columns, motion)
    turning = np.linalg.norm(own[3:]) > TURNS * np.linalg.norm(own[:3])
    along = own[3:] if turning else own[:3]
    size = float(np.abs(along).max())
    axis = ", ".join(f"{round(float(x) / size, 6) + 0.0:.3g}" for x in along)
    return f"body {name!r} {'turns about' if turning else 'moves along'} [{axis}]"
