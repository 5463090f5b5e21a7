"""The programs of a sweep, traced from the equations, with one layout of slots.

    newton    state, drives -> state, residual, sigma, orientation
              one Newton-Raphson iteration; residual, sigma and orientation are those before it
    outputs   state, drives' rates -> v, a, wanted motions, closure, leftover, branch
              one factorisation at the converged pose, solved for nu and gamma
    tangent   state, drives' rates -> v, a
              at the start of a march, if `outputs` does not compute all of it

`predictor` and `acceptance` hold the programs that follow a motion. Each program is traced for the
requested order: without accelerations no gamma, without velocities no factorisation after the last
iteration.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property, reduce
from typing import Any, Protocol, TypeAlias

from ...algebra import Quat, Scalar, Vec3, quat, vec
from ...mechanism.mechanism import Mechanism, Vector
from ...primitives.base import GROUND_POSE, GROUND_TWIST, Drive, Pose, Twist
from ...program import Elimination, Prepared, Program, Tape, absolute, maximum, minimum, program
from ...trajectory import QUANTITIES
from ..forces.equations import BodyStates
from ..formulation.acceptance_criteria import EPSILON
from ..formulation.cartesian import Cartesian, PrescribedBody
from ..formulation.constraints import Frames, frames
from ..formulation.formulation import (
    GROUND_ACCELERATION,
    Acceleration,
    State,
    motion_of_frame,
    motion_of_point,
)
from ..formulation.parameters import every_place, placed
from ..formulation.state_vectors import turns
from ..formulation.styles import NATIVE, formulate
from ..structure.degrees_of_freedom import Selection, select_rows
from .request import (
    BLOCKS,
    CARRIED,
    FIRM,
    ORIENTATION,
    PRESCRIBED,
    RATE,
    RATE_T,
    SIGMA,
    Layout,
    Request,
    by_block,
)
from .traced_forces import Rows, TracedForces, angles, native_rows

Moving: TypeAlias = Callable[[str], tuple[Pose, Twist, Acceleration]]
"""Pose, twist and acceleration of a body by its name."""
Further: TypeAlias = Callable[[dict[int, Scalar], Sequence[Scalar], Sequence[Scalar]], None]
"""Adds to the outputs of a program, from rates of the unknowns and their accelerations."""


def nothing_further(out: dict[int, Scalar], v: Sequence[Scalar], a: Sequence[Scalar]) -> None:
    """Add nothing."""


class Section(Protocol):
    """A part of a mechanism that is solved on its own."""

    @property
    def points(self) -> Mapping[str, tuple[str, Vector, Vec3]]: ...
    @property
    def outputs(self) -> Mapping[str, tuple[Vector, Vec3, Quat]]: ...
    def formulation(
        self, prescribed: Mapping[str, PrescribedBody], drives: Mapping[str, Drive]
    ) -> Cartesian: ...


class Alike(Protocol):
    """Sections that differ in some of their numbers only."""

    @property
    def frame(self) -> Frames: ...
    @property
    def given(self) -> Sequence[str]: ...
    @property
    def numbers(self) -> list[Scalar]: ...
    def with_numbers(self, given: Sequence[Scalar]) -> Section: ...
    def select(self) -> Selection: ...


class Tracer:
    """One tape for all programs: shared operations are recorded once.

    Args:
        alike: sections of the mechanism, to be solved instead of the whole of it.
        frame: of the lengths, if it is not that of the mechanism's size.
        selection: of the rows, if it is known.

    Attributes:
        selection: the rows solved, by default those independent at the design position.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        request: Request,
        alike: Alike | None = None,
        *,
        frame: Frames | None = None,
        selection: Selection | None = None,
    ) -> None:
        self.request, self.tape, self.layout = request, Tape(), Layout()
        self.mechanism, self._alike = mechanism, alike
        # the angle of a torsional spring is a coordinate, followed through any number of turns
        self.named = angles(mechanism) if request.forces else []
        if selection is not None:
            self.selection = selection
        if alike:
            self.frame, varied = alike.frame, alike.numbers
            self.geometry = {"geometry": varied} if varied else {}
        else:
            self.frame, known = frame or frames(mechanism), every_place(mechanism)
            self.geometry = {place: known[place] for place in request.varied}
        self.described = mechanism, self.frame  # without traced numbers
        given = {place: self.vector(place, len(value)) for place, value in self.geometry.items()}
        slots = {slot for place in given for slot in self.layout.vectors[place]}
        self.prepared = Prepared(self.tape, slots, self.layout.scalar)
        self.prescribed = {
            name: self._prescribed_body(name) for name in (alike.given if alike else ())
        }
        self.drives = {name: Drive(*self.vector(f"drive {name}", 5)) for name in request.drivers}
        if alike:
            section = alike.with_numbers(given.get("geometry", ()))
            self.formulation = section.formulation(self.prescribed, self.drives)
            self._points, self._bodies = section.points, section.outputs
        else:
            if given:
                self.mechanism = placed(mechanism, given)
                self.frame = frames(self.mechanism, self.frame.unit)
            self.formulation = self.formulate(self.mechanism, self.frame, self.drives)
            points = map(self.mechanism.point, request.points)
            bodies = map(self.mechanism.body, request.bodies)
            self._points = {
                each.name: (each.body, *self.frame.end(each.body, each.position)) for each in points
            }
            self._bodies = {
                each.name: (*self.frame.end(each.name, each.origin), quat(each.euler_parameters))
                for each in bodies
            }
        design = self.formulation.design
        for label in BLOCKS:
            for name, value in design.items():
                self.layout.vector(label + name, len(value))
        self.at = self.formulation.configuration(
            {name: self.vector(name, len(value)) for name, value in design.items()}
        )
        self.unknowns = self.formulation.unknowns

    def formulate(
        self, mechanism: Mechanism, frame: Frames, drives: Mapping[str, Drive]
    ) -> Cartesian:
        return formulate(mechanism, frame, self.request.style, drives, self.named)

    def _prescribed_body(self, name: str) -> PrescribedBody:
        """A prescribed body, its motion read from slots."""
        u, q, v, w, v_t, w_t = (
            self.vector(f"prescribed {label} {name}", count) for label, count in PRESCRIBED.items()
        )
        return PrescribedBody(
            Pose.of(vec(u), quat(q)), Twist(vec(v), vec(w)), Acceleration(vec(v_t), vec(w_t))
        )

    def read(self, name: str) -> Scalar:
        """A scalar of the lanes."""
        return self.tape.input(self.layout.scalar(name))

    def vector(self, name: str, count: int) -> list[Scalar]:
        """A vector of the lanes."""
        return [self.tape.input(slot) for slot in self.layout.vector(name, count)]

    def store(self, out: dict[int, Scalar], name: str, value: Iterable[Scalar]) -> None:
        """Add the components of a vector to the outputs."""
        scalars = list(value)
        out.update(zip(self.layout.vector(name, len(scalars)), scalars, strict=True))

    def store_state(self, out: dict[int, Scalar], state: State) -> None:
        """Add a state to the outputs."""
        for name, value in state.items():
            self.store(out, name, value)

    @cached_property
    def selection(self) -> Selection:
        """Raises SolveError: the mechanism cannot be solved as described, see `select_rows`."""
        if self._alike:
            return self._alike.select()
        formulation = self.formulate(*self.described, {})
        return select_rows(*self.described, formulation, self.request.rows)

    def chosen(self, values: Sequence[Any]) -> list[Any]:
        return [values[k] for k in self.selection.chosen]

    @cached_property
    def factor(self) -> Elimination:
        """The factored rows at the state, for iterations and, at the solution, for the rates."""
        return Elimination(self.chosen(self.formulation.rows(self.at)))

    @property
    def turns(self) -> Sequence[str]:
        """Names of the angles of turning drivers."""
        return turns(self.mechanism, self.request.drivers)

    @property
    def blocks(self) -> int:
        """Blocks of the rows, each with an estimate of its own of how singular it is."""
        return len(self.factor.sigmas)

    def newton(self) -> Program:
        """One Newton-Raphson iteration of (28), Phi = 0: (29) Phi_Pi dPi = -Phi."""
        phi = self.chosen(self.formulation.phi(self.at))
        out: dict[int, Scalar] = {
            # iterations end by this: a pose is off by the residual over sigma, and the next one by
            # the square of that
            self.layout.scalar("residual"): (
                largest(phi) * maximum(1.0, FIRM / maximum(self.factor.sigma, EPSILON))
            ),
            self.layout.scalar(SIGMA): self.factor.sigma,
            self.layout.scalar(ORIENTATION): self.factor.orientation,
        }
        out |= {
            self.layout.scalar(name): x
            for name, x in zip(by_block(SIGMA, self.blocks), self.factor.sigmas, strict=True)
        }
        step = self.factor.solve(phi)
        self.store_state(out, self.formulation.retract(self.at, [-x for x in step]))
        return program("newton", self.tape, out, self.prepared)

    def tangent(self) -> Program:
        """Rates of the unknowns and their accelerations."""
        return program("tangent", self.tape, self._solve_rates(2)[-1], self.prepared)

    def _solve_rates(self, order: int) -> tuple[list[Scalar], list[Scalar], dict[int, Scalar]]:
        """v and a as far as an order wants them, else zero, and by slot: one factorisation for
        both.
        """
        out: dict[int, Scalar] = {}
        v = a = list[Scalar]([0.0] * self.unknowns)
        # (30) Phi_Pi v = nu and (32) Phi_Pi a = gamma are linear: one factor at the pose serves
        # both; the paper iterates, (31)
        if order:
            v = self.factor.solve(self.chosen(self.formulation.nu(self.at)))
            self.store(out, RATE, v)
        if order == 2:
            a = self.factor.solve(self.chosen(self.formulation.gamma(self.at, v)))
            self.store(out, RATE_T, a)
        return v, a, out

    @property
    def at_rest(self) -> Mapping[str, Sequence[float]]:
        """The vectors of prescribed bodies' motions, at rest at the design position."""
        values = {
            label: (1.0, 0.0, 0.0, 0.0) if label == "q" else (0.0, 0.0, 0.0) for label in PRESCRIBED
        }
        return {
            f"prescribed {label} {name}": value
            for name in self.prescribed
            for label, value in values.items()
        }

    def outputs(self, further: Further = nothing_further) -> Program:
        """Return the program of the wanted motions with their rates, and the tests of a solution:
        closure, redundant rows, branch.

        One program for all: operations on the pose are shared, and fill the waits between the
        pivots of the elimination.
        """
        v, a, out = self._solve_rates(self.request.order)
        phi = self.formulation.phi(self.at)
        out[self.layout.scalar("closure")] = largest(self.chosen(phi))
        out[self.layout.scalar("leftover")] = largest([phi[k] for k in self.selection.dropped])
        return self._outputs(v, a, out, further)

    def outputs_of_rates(self) -> Program:
        """Return the program of the wanted motions and of the branch for given rates."""
        return self._outputs(
            self.vector(RATE, self.unknowns), self.vector(RATE_T, self.unknowns), {}
        )

    def _outputs(
        self,
        v: Sequence[Scalar],
        a: Sequence[Scalar],
        tests: Mapping[int, Scalar],
        further: Further = nothing_further,
    ) -> Program:
        out = {
            **tests,
            self.layout.scalar("branch"): reduce(minimum, self.formulation.branch(self.at), 1.0),
        }
        moving, unit = self.moving(v, a), self.frame.unit
        for name, (body, position, arm) in self._points.items():
            found = motion_of_point(position, arm, unit, *moving(body))
            self._store_motion(out, QUANTITIES, name, found)
        for name, (position, arm, p) in self._bodies.items():
            found = motion_of_point(position, arm, unit, *moving(name))
            self._store_motion(out, ("r", "rdot", "rddot"), name, found)
            self._store_motion(
                out, ("p", "omega", "omega_t"), name, motion_of_frame(p, *moving(name))
            )
        further(out, v, a)
        if wanted := self.request.forces:
            forces = self.forces(v, a)
            for name, value in forces.vectors(wanted):
                self.store(out, name, value)
            if wanted.slopes:
                self.store(out, CARRIED, forces.multipliers)
        return program("outputs", self.tape, out, self.prepared)

    def forces(
        self, v: Sequence[Scalar], a: Sequence[Scalar], multipliers: Sequence[Scalar] = ()
    ) -> TracedForces:
        """Return the forces at rates of the unknowns; see `TracedForces`."""
        twists = self.formulation.twists(self.at, v)
        accelerations = self.formulation.accelerations(self.at, v, a)
        states = BodyStates(self.frame, self.at.poses, twists, accelerations)
        return TracedForces(
            self.mechanism, self.force_rows, states, self.at, self.drives, multipliers
        )

    def moving(self, v: Sequence[Scalar], a: Sequence[Scalar]) -> Moving:
        """Return the motion of each body at unknown rates v and accelerations a, by its name."""
        twists = self.formulation.twists(self.at, v)
        accelerations = self.formulation.accelerations(self.at, v, a)

        def found(body: str) -> tuple[Pose, Twist, Acceleration]:
            pose, twist = self.at.poses.get(body, GROUND_POSE), twists.get(body, GROUND_TWIST)
            return pose, twist, accelerations.get(body, GROUND_ACCELERATION)

        return found

    @cached_property
    def force_rows(self) -> Rows:
        """The rows that forces are solved by."""
        if self.request.style == NATIVE:
            return Rows(self.formulation, self.selection, self.factor)
        return native_rows(self.mechanism, self.frame, self.drives, self.at)

    def _store_motion(
        self,
        out: dict[int, Scalar],
        labels: Sequence[str],
        name: str,
        found: Iterable[Iterable[Scalar]],
    ) -> None:
        """Add a motion as far as an order wants it."""
        for label, value in zip(labels[: self.request.order + 1], found, strict=False):
            self.store(out, f"{label} {name}", value)


def largest(values: Sequence[Scalar]) -> Scalar:
    """The largest size of numbers, or zero."""
    return reduce(maximum, (absolute(value) for value in values)) if values else 0.0
