"""The programs of a sweep, traced from the equations: they share one layout of slots.

    predict   from state, v, a and time; time    -> state        Taylor step of second order
    extrapolate   states and times of a group of lanes; time   -> state        through `NODES` of them, without v and a
    newton    state, drives                      -> state, residual, sigma, orientation   one Newton-Raphson iteration; what is
                                                    said of residual and rows is that before it
    motion    state, drives' rates               -> v, a         one factorisation at the converged pose, solved for nu and gamma
    outputs   state, v, a                        -> wanted motions, closure, leftover, branch
    alone, joined   all that, and the tolerance  -> margin         positive where a lane may be accepted

Each is traced for what is asked: no acceleration, no gamma; no velocity, no factorisation after the last iteration.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property, reduce
from operator import mul
from typing import Any

from ..algebra import ZERO, Quat, Scalar, cross, rotation_less_identity, vec
from ..mechanism import Mechanism, Vector
from ..primitives.base import GROUND_MOTION, GROUND_POSE, Drive, Motion, Pose
from ..program import (
    DONE,
    MARGIN,
    NODES,
    Elimination,
    Prepared,
    Program,
    Tape,
    absolute,
    before,
    maximum,
    minimum,
    program,
    where_larger,
)
from .cartesian import Cartesian, Given
from .components import Section, select_section
from .continuity import EPSILON, FOLLOWED, LARGEST_CORRECTION, LARGEST_RATIO, LONGEST_STEP, NEGLIGIBLE, TURNED, WORSE
from .equations import Style, constraints, frames
from .formulation import Acceleration, Formulation, State
from .freedom import select_rows
from .geometry import placed, places
from .relative import Relative
from .request import ACCEPT, EARLIER, FROM, GIVEN, LARGEST_SIGMA, ORIENTATION, RATE, RATE_T, SIGMA, STOOD, TIME, Layout, Request

EULER_PARAMETERS = 4
ABOUT = 1.5
"""A step may be this much longer than the one it learns from."""


class Tracer:
    """One tape for all programs: what they share is written down once.

    Raises:
        SolveError: the mechanism cannot be solved as described (see `select_rows`).
    """

    def __init__(self, mechanism: Mechanism, request: Request, section: Section | None = None) -> None:
        self.request, self.tape, self.layout = request, Tape(), Layout()
        self.mechanism, self._section = mechanism, section
        self.frame = section.frame(mechanism) if section else frames(mechanism)
        self.given: Mapping[str, Given] = {name: Given() for name in section.given} if section else {}
        self.selection = (select_section if section else select_rows)(mechanism, self.frame, self._formulate({}))
        self.geometry = {place: places(mechanism)[place] for place in request.varied}
        given = {place: self._vector(place, len(value)) for place, value in self.geometry.items()}
        slots = {slot for place in given for slot in self.layout.vectors[place]}
        self.prepared = Prepared(self.tape, slots, self.layout.scalar)
        if given:
            self.mechanism = placed(mechanism, given)
            self.frame = section.frame(self.mechanism) if section else frames(self.mechanism, self.frame.unit)
        self.given = {name: self._moved(name) for name in self.given}
        self.formulation = self._formulate({name: Drive(*self._vector(f"drive {name}", 5)) for name in request.drivers})
        design = self.formulation.design
        self.at = self.formulation.configuration({name: self._vector(name, len(value)) for name, value in design.items()})
        self.unknowns = self.formulation.unknowns

    def _formulate(self, drives: Mapping[str, Drive]) -> Formulation:
        found = constraints(self.mechanism, self.frame, drives, self.request.style)
        if self.request.style is Style.RELATIVE:
            return Relative.of(self.mechanism, self.frame, found)
        return Cartesian(found, self.frame.moving, given=self.given)

    def _moved(self, name: str) -> Given:
        """A given body, its motion read from slots."""
        u, (e0, *e), v, w, v_t, w_t = (self._vector(f"given {label} {name}", count) for label, count in GIVEN.items())
        return Given(Pose.of(vec(u), Quat(e0, vec(e))), Motion(vec(v), vec(w)), Acceleration(vec(v_t), vec(w_t)))

    def _in(self, name: str) -> Scalar:
        return self.tape.input(self.layout.scalar(name))

    def _vector(self, name: str, count: int) -> list[Scalar]:
        return [self.tape.input(slot) for slot in self.layout.vector(name, count)]

    def _store(self, out: dict[int, Scalar], name: str, value: Iterable[Scalar]) -> None:
        scalars = list(value)
        out.update(zip(self.layout.vector(name, len(scalars)), scalars, strict=True))

    def _store_state(self, out: dict[int, Scalar], state: State) -> None:
        for name, value in state.items():
            self._store(out, name, value)

    def _kept(self, values: Sequence[Any]) -> list[Any]:
        return [values[k] for k in self.selection.kept]

    @cached_property
    def _factor(self) -> Elimination:
        """The rows at the state, factored: to iterate, and where the iteration ends for the rates."""
        return Elimination(self._kept(self.formulation.rows(self.at)))

    def newton(self) -> Program:
        """One Newton-Raphson iteration."""
        phi = self._kept(self.formulation.phi(self.at))
        out: dict[int, Scalar] = {
            self.layout.scalar("residual"): _largest(phi),
            self.layout.scalar(SIGMA): self._factor.sigma,
            self.layout.scalar(ORIENTATION): self._factor.orientation,
        }
        step = self._factor.solve(phi)
        self._store_state(out, self.formulation.retract(self.at, [-x for x in step]))
        return program("newton", self.tape, out, self.prepared)

    def motion(self, name: str, order: int) -> Program:
        """Rates of the unknowns, and with order 2 their accelerations: one factorisation for both."""
        out: dict[int, Scalar] = {}
        v = self._factor.solve(self._kept(self.formulation.nu(self.at)))
        self._store(out, RATE, v)
        if order == 2:
            self._store(out, RATE_T, self._factor.solve(self._kept(self.formulation.gamma(self.at, v))))
        return program(name, self.tape, out, self.prepared)

    @property
    def at_rest(self) -> Mapping[str, Sequence[float]]:
        """The vectors that tell how given bodies move, at rest at the design position."""
        values = {label: (1.0, 0.0, 0.0, 0.0) if label == "q" else (0.0, 0.0, 0.0) for label in GIVEN}
        return {f"given {label} {name}": value for name in self.given for label, value in values.items()}

    @property
    def carried(self) -> list[tuple[int, int]]:
        """Slots of a solved lane, and of what the lanes after it are predicted from."""
        sizes = {name: len(value) for name, value in self.formulation.design.items()}
        sizes |= {f"predicted {name}": count for name, count in sizes.items()}
        sizes |= {RATE: self.unknowns, RATE_T: self.unknowns}
        pairs = [(self.layout.scalar(FROM + TIME), self.layout.scalar(EARLIER + TIME))]
        pairs += [(self.layout.scalar(name), self.layout.scalar(FROM + name)) for name in (TIME, SIGMA, ORIENTATION, LARGEST_SIGMA)]
        pairs += [(self.layout.scalar(name), self.layout.scalar(name)) for name in ACCEPT]
        for name, count in sizes.items():
            pairs += zip(self.layout.vector(name, count), self.layout.vector(FROM + name, count), strict=True)
        return pairs

    def predict(self) -> Program:
        """The state at the time by a Taylor step of second order, and what the last such step lacked.

        That is of third order, whatever the coordinates: it grows by the cube of the step. It is known where the step before was
        about as long as this one, or longer.
        """
        time, here, earlier = (self._in(label + TIME) for label in ("", FROM, EARLIER))
        h, h_before = time - here, here - earlier
        v, a = self._vector(FROM + RATE, self.unknowns), self._vector(FROM + RATE_T, self.unknowns)
        step = [h * (v_k + (0.5 * h) * a_k) for v_k, a_k in zip(v, a, strict=True)]
        start = {name: self._vector(FROM + name, len(value)) for name, value in self.formulation.design.items()}
        taylor = self.formulation.retract(self.formulation.configuration(start), step)
        part = h / h_before
        lack = where_larger(ABOUT * h_before, h, part * part * part, 0.0)
        out: dict[int, Scalar] = {}
        corrected: dict[str, list[Scalar]] = {}
        for name, value in taylor.items():
            self._store(out, f"predicted {name}", value)  # kept, to see what the iteration makes of it
            solved, predicted = start[name], self._vector(f"{FROM}predicted {name}", len(value))
            corrected[name] = [x + lack * (b - p) for x, b, p in zip(value, solved, predicted, strict=True)]
            corrected[name] = _of_length_one(corrected[name])
        self._store_state(out, corrected)
        return program("predict", self.tape, out, self.prepared)

    def extrapolate(self) -> Program:
        """The state at the time by Lagrange's formula, through nodes of the group of lanes before; NaN where two share a time."""
        time, layout = self._in(TIME), self.layout
        nodes = [self.tape.at(k, layout.scalar(STOOD)) for k in range(NODES)]
        weights: list[Scalar] = []
        for node in nodes:
            others = [each for each in nodes if each is not node]
            weights.append(reduce(mul, (time - each for each in others)) / reduce(mul, (node - each for each in others)))
        out: dict[int, Scalar] = {}
        for name, value in self.formulation.design.items():
            slots = layout.vector(name, len(value))
            found = [sum((w * self.tape.at(k, slot) for k, w in enumerate(weights)), 0.0) for slot in slots]
            for label in (name, f"predicted {name}"):
                self._store(out, label, _of_length_one(found))
        return program("extrapolate", self.tape, out, self.prepared)

    def test(self, name: str, *, neighbours: bool) -> Program:
        """By how much a lane passes all tests of a solution: it has converged, closes, is on its branch, agrees with the
        redundant rows, and continues the motion it is predicted from.

        The last is seen from the correction that Newton made of the prediction: it changes from the lane before, or where lanes
        are no neighbours from nothing at the start, by much less than the pose does. No lane is taken that is far from there, nor
        one beyond a singular pose: whether the motion passes it, or turns round a corner before it, is not seen from afar.
        """
        gap, moved, reach = list[Scalar](), list[Scalar](), list[Scalar]()
        for each, value in self.formulation.design.items():
            vectors = (self._vector(label, len(value)) for label in (each, f"predicted {each}", FROM + each))
            for x, predicted, start in zip(*vectors, strict=True):
                x_before, predicted_before = (before(x, start), before(predicted, start)) if neighbours else (start, start)
                gap.append((x - predicted) - (x_before - predicted_before))
                moved.append(x - x_before)
                reach.append(x - start)
        tol, consistent, crossing = (self._in(label) for label in ACCEPT)
        closure, sigma, turned = (self._in(name) for name in ("closure", SIGMA, ORIENTATION))
        sigma_before, turned_before, largest = (self._in(FROM + name) for name in (SIGMA, ORIENTATION, LARGEST_SIGMA))
        largest = maximum(sigma, largest)
        if neighbours:
            sigma_before, turned_before = before(sigma, sigma_before), before(turned, turned_before)
        uncertain = (WORSE * largest) * maximum(closure, EPSILON)
        margins = (
            self._in(DONE) - 0.5,
            tol - closure,
            consistent - self._in("leftover"),
            self._in("branch"),
            LARGEST_CORRECTION * _largest(moved) + NEGLIGIBLE - _largest(gap),
            LONGEST_STEP - _largest(reach),
            (LARGEST_RATIO * sigma - sigma_before) * (LARGEST_RATIO * sigma_before - sigma) + crossing,
            0.5 - absolute(turned - turned_before) + crossing,
            FOLLOWED * sigma * sigma - uncertain,
            maximum(TURNED * sigma * sigma - uncertain, sigma_before - sigma),
        )
        out = {self.layout.scalar(MARGIN): reduce(minimum, margins), self.layout.scalar(LARGEST_SIGMA): largest}
        out |= {self.layout.scalar(STOOD): self._in(TIME)} if neighbours else {}
        return program(name, self.tape, out, self.prepared)

    def outputs(self) -> Program:
        """The wanted motions, and the tests of a solution: closure, redundant rows, branch."""
        phi = self.formulation.phi(self.at)
        out: dict[int, Scalar] = {
            self.layout.scalar("closure"): _largest(self._kept(phi)),
            self.layout.scalar("leftover"): _largest([phi[k] for k in self.selection.dropped]),
            self.layout.scalar("branch"): reduce(minimum, self.formulation.branch(self.at), 1.0),
        }
        v, a = self._vector(RATE, self.unknowns), self._vector(RATE_T, self.unknowns)
        motions = self.formulation.motions(self.at, v)
        accelerations = self.formulation.accelerations(self.at, v, a)
        for name in self.request.points:
            point = self.mechanism.point(name)
            self._store_point(
                out, ("position", "velocity", "acceleration"), name, point.body, point.position, motions, accelerations
            )
        for name in self.request.bodies:
            origin = self.mechanism.body(name).origin
            self._store_point(out, ("r", "rdot", "rddot"), name, name, origin, motions, accelerations)
            self._store_rotation(out, name, motions, accelerations)
        return program("outputs", self.tape, out, self.prepared)

    def _store_point(
        self,
        out: dict[int, Scalar],
        labels: tuple[str, str, str],
        name: str,
        body: str,
        position: Vector,
        motions: Mapping[str, Motion],
        accelerations: Mapping[str, Acceleration],
    ) -> None:
        """Position, velocity and acceleration of a point in metres; its displacement is formed first, and added once."""
        pose, motion = self.at.poses.get(body, GROUND_POSE), motions.get(body, GROUND_MOTION)
        acceleration = accelerations.get(body, Acceleration(ZERO, ZERO))
        arm, metres = self.frame.arm(body, position), self.frame.unit
        turned = pose.turn(arm)
        found = (
            vec(position) + metres * (pose.u + pose.swing(arm)),
            metres * motion.of(turned),
            metres * (acceleration.v_t + cross(acceleration.w_t, turned) + motion.centripetal(turned)),
        )
        for label, value in zip(labels[: self.request.order + 1], found, strict=False):
            self._store(out, f"{label} {name}", value)

    def _store_rotation(
        self, out: dict[int, Scalar], name: str, motions: Mapping[str, Motion], accelerations: Mapping[str, Acceleration]
    ) -> None:
        """p, omega' and omega'dot of a body's own frame: the paper's variables."""
        pose, motion = self.at.poses.get(name, GROUND_POSE), motions.get(name, GROUND_MOTION)
        e0, *e = self.mechanism.body(name).euler_parameters
        p = pose.q * Quat(e0, vec(e))
        to_body = rotation_less_identity(p).T
        w_t = accelerations.get(name, Acceleration(ZERO, ZERO)).w_t
        found = (p, motion.w + to_body @ motion.w, w_t + to_body @ w_t)
        for label, value in zip(("p", "omega", "omega_t")[: self.request.order + 1], found, strict=False):
            self._store(out, f"{label} {name}", value)


def _of_length_one(value: list[Scalar]) -> list[Scalar]:
    """Euler parameters of length one, up to the square of what they lack; any other vector as it is."""
    if len(value) != EULER_PARAMETERS:
        return value
    k = 1.5 - 0.5 * sum((x * x for x in value), 0.0)
    return [k * x for x in value]


def _largest(values: Sequence[Scalar]) -> Scalar:
    return reduce(maximum, (absolute(value) for value in values)) if values else 0.0
