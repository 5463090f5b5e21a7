"""A case ready to be written as code: its compiled programs, the layout of a lane, its drivers as
functions of time, its outputs and its parameters.

The state of the code is three lanes: the current one, the one on its way, and the next attempt. A
lane holds the slots of the programs, then the numbers of `Tail`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...case.case import TIME as SWEPT_TIME
from ...case.case import Case, Quantity
from ...case.measures import ForceMeasure, Orientation
from ...errors import KincheckError, shortened
from ...forces import Forces, Reaction
from ...harness.compare import output_series
from ...jet import Jet
from ...joints.base import Kind
from ...kinematics import NativeSolver
from ...kinematics.compiled.compiled_model import ASSEMBLING, CLOSED, Model, recent_model
from ...kinematics.compiled.request import (
    ACCEPT,
    CONSISTENT,
    EFFORT,
    ELEMENT,
    FORCE_SIGMA,
    FROM,
    LARGEST_SIGMA,
    OUTPUT,
    REACTION,
    RESTING,
    SIGMA,
    accept_by,
    slots_of,
)
from ...kinematics.continuation.segments import BETTER, NEAR, Followed
from ...kinematics.continuation.walk import follow_samples
from ...kinematics.formulation.acceptance_criteria import LOW
from ...mechanism.motions import Absolute, Motion, Path, Ramp, Sine, Table
from ...program import DONE, MARGIN, Program, Tape, program
from ...trajectory import QUANTITIES
from ..designs.outputs import DesignOutputs
from ..sweep.curves import moved_by
from ..sweep.varied_places import Geometry, Moves

TOL = 1e-12
"""Largest accepted residual, as of `kincheck run`."""
HALVINGS = 40
"""Most halvings of a step in a row: its rest is no step in double precision."""


@dataclass(frozen=True)
class CodeOutput:
    """An output in the code.

    Attributes:
        slots: of its terms in a lane, by order; unknown orders have none.
        resting: slots of the two speeds of an output without a value at rest.
        period: of an angle with counted turns; zero for none.
        at_design: value of such an angle at the design position.
        kept: first number behind the slots for its turns or its sign.
        completion: program of an attitude, from four Euler parameters and their rates.
        pushed: of a force, as a sum: slots of forces, and a factor of each.
    """

    quantity: Quantity
    slots: Sequence[Sequence[int]]
    resting: Sequence[int] = ()
    period: float = 0.0
    at_design: float = 0.0
    kept: int = 0
    completion: Program | None = None
    pushed: Mapping[int, float] = field(default_factory=dict[int, float])


@dataclass(frozen=True)
class Parameter:
    """A number of the geometry to be set by a user of the code.

    Attributes:
        nominal: its value at design [SI], in the axes of its file.
        moves: slots of the geometry, and their change by it.
    """

    name: str
    unit: str
    nominal: float
    moves: Mapping[int, float]


@dataclass(frozen=True, eq=False)
class SolvedCase:
    """A case, and all parts of its code."""

    case: Case
    model: Model
    outputs: Sequence[CodeOutput]
    parameters: Sequence[Parameter]
    begin: float
    """Time at which the mechanism is at its design position [s]."""
    poses: Mapping[str, Sequence[int]]
    """Slots of origin [m] and Euler parameters, by body."""
    others: Sequence[Model]
    """Models with other choices of the independent rows, if one does not hold over the sweep."""
    is_steered: bool
    """Whether each driver can be moved to a value of its own."""

    @property
    def size(self) -> int:
        """Numbers of a lane: the slots, the time, the kept numbers of outputs, and the straight
        way of the drivers.
        """
        return self.steered + (1 + 2 * len(self.drives()) if self.is_steered else 0)

    @property
    def steered(self) -> int:
        """The number of a lane for a straight way of the drivers, above zero on one; its begin and
        its change follow by driver.
        """
        kept = [each.kept + (4 if each.completion else 1) for each in self.outputs if each.kept]
        return max([self.at + 2, *kept])

    @property
    def at(self) -> int:
        """The number behind the slots for the time of the lane; the choice of its rows is
        the next.
        """
        return len(self.model.slots)

    @property
    def programs(self) -> Mapping[str, Sequence[Program]]:
        """The programs in use, by their names in the code: one, or one for each choice of rows."""
        names = ["predict", "newton", "outputs", *self.model.plan.alone]
        names += ["prepare"] if "prepare" in self.model.plan.programs else []
        found = {name: self._by_choice(name) for name in names}
        for k, each in enumerate(self.outputs):
            if each.completion is not None:
                found[f"complete_{k}"] = [each.completion]
        return found

    def _by_choice(self, name: str) -> Sequence[Program]:
        """Return a program for each choice, on the slots of the first; one if they are equal."""
        first, own = self.model.plan.programs[name], self.model.slots
        found = [first]
        for model in self.others:
            slots = {slot: own[each] for each, slot in model.slots.items()}
            other = model.plan.programs[name]
            nodes = [
                (op, slots[int(read[0])]) if op == "input" else (op, *read)
                for op, *read in other.nodes
            ]
            outputs = {slots[slot]: k for slot, k in other.outputs.items()}
            found.append(replace(other, nodes=tuple(nodes), outputs=outputs))
        is_same = all(
            (each.nodes, each.outputs) == (first.nodes, first.outputs) for each in found[1:]
        )
        return found[:1] if is_same else found

    @property
    def state(self) -> list[int]:
        """Slots of the solved pose."""
        return slots_of(self.model.vectors, self.model.state)

    @property
    def standing(self) -> list[int]:
        """Numbers of a lane kept with another choice of rows: pose, geometry, limits, and all
        behind the slots.
        """
        given = [*self.model.prescribed, *self.model.varied]
        slots = [*self.state, *slots_of(self.model.vectors, given)]
        return [*slots, *(self.model.slots[name] for name in ACCEPT), *range(self.at, self.size)]

    @cached_property
    def start(self) -> list[float]:
        """The numbers of a lane at the design position; a number without a use is zero."""
        found = np.zeros(self.size)
        found[: self.at] = self.model.design
        for name, value in accept_by(TOL).items():
            found[self.model.slots[name]] = value
        found[self.at] = self.begin
        for each in self.outputs:
            if each.period:
                found[each.kept] = each.at_design
            elif each.completion:
                found[each.kept] = 1.0
        return np.where(np.isfinite(found), found, 0.0).tolist()

    @property
    def numbers(self) -> dict[str, float]:
        """The named numbers of the code."""
        slots, plan = self.model.slots, self.model.plan
        named = {"RESIDUAL": "residual", "CLOSURE": "closure", "BRANCH": "branch"}
        named |= {"IS_DONE": DONE, "MARGIN": MARGIN, "SIGMA": FROM + SIGMA}
        named |= {"LEFTOVER": "leftover", "LARGEST_NOW": LARGEST_SIGMA}
        named |= {"LARGEST": FROM + LARGEST_SIGMA}
        sweep = self.case.sweep
        return {name: slots[slot] for name, slot in named.items()} | {
            "SIZE": self.size,
            "AT": self.at,
            "CHOICE": self.at + 1,
            "CHOICES": 1 + len(self.others),
            "MOST": plan.most,
            "HALVINGS": HALVINGS,
            "TOLERANCE": plan.tolerance,
            "ASSEMBLING": ASSEMBLING,
            "CLOSED": CLOSED,
            "SIGMA_NOW": self.model.vectors.get(FORCE_SIGMA, [slots[SIGMA]])[0],
            "FIRM": 0.0 if self.model.forces is None else self.model.forces.least,
            "CARRIED": len(plan.carried),
            "POSE": len(self.state),
            "STAYING": len(self.standing),
            "CONSISTENT": CONSISTENT,
            "NEAR": NEAR,
            "BETTER": BETTER,
            "STEERED": self.steered,
            "DRIVERS": len(self.drives()),
            "OUTPUTS": len(self.outputs),
            "PARAMETERS": len(self.parameters),
            "DESIGN": 0.0 if sweep.driver == SWEPT_TIME else sweep.design,
            "PACE": 1.0 if sweep.driver == SWEPT_TIME else sweep.pace,
        }

    def unit(self, driver: str) -> str:
        """Return the unit of a driver, or of time."""
        if driver == SWEPT_TIME:
            return "s"
        return "rad" if self.case.mechanism.driver(driver).turns else "m"

    @property
    def drivers(self) -> list[str]:
        """Names of the moving drivers, in the case's order."""
        moving = self.case.sweep.path.motions
        return [each.name for each in self.case.mechanism.drivers if each.name in moving]

    def drives(self) -> list[tuple[Sequence[int], Motion, float]]:
        """Return for each moving driver its five slots, its motion from the design, and the factor
        from SI to the unit of the slots.
        """
        motions, length = self.case.sweep.path.motions, 1.0 / self.model.frame.unit
        return [
            (self.model.vectors[f"drive {name}"], motions[name], factor)
            for name in self.drivers
            for factor in [1.0 if self.unit(name) == "rad" else length]
        ]


def solved_case(
    case: Case,
    places: Sequence[str],
    bodies: Sequence[str] = (),
    *,
    forces: bool = False,
    steered: Sequence[Path] = (),
) -> SolvedCase:
    """Return a case ready to be written as code.

    Args:
        places: names of the parameters, see `kincheck.curves`.
        bodies: names of those whose poses are wanted.
        forces: whether the code has the outputs of forces.
        steered: further paths, of all drivers, on which redundant rows are exchanged. With them,
            or with several drivers, each driver can be moved to a value of its own.

    Raises:
        KincheckError: the code cannot have a part of the case, or a place is unknown.
    """
    names = [each.name for each in case.mechanism.drivers]
    if is_steered := bool(steered) or len(names) > 1:
        held = {name: Ramp(0.0) for name in names if name not in case.sweep.path.motions}
        motions = {**case.sweep.motions, **held}
        case = replace(case, sweep=replace(case.sweep, motions=motions))
    path = case.sweep.path
    for name, motion in path.motions.items():
        plain = motion.motion if isinstance(motion, Absolute) else motion
        if not isinstance(plain, Ramp | Sine | Table):
            raise KincheckError(
                f"{case.name}: the driver {name} follows a {type(plain).__name__.lower()}, which"
                " code cannot have. Give it a table, a ramp or a sine, or sweep it."
            )
    measured = tuple(each for each in case.outputs if forces or not each.forces)
    if not measured:
        left = shortened([each.name for each in case.outputs], 5)
        raise KincheckError(
            f"{case.name}: all outputs are forces ({left}), which the code has only if asked for."
            " Give --forces, or add an output of the motion."
        )
    case = replace(case, outputs=measured)
    none = Moves({}, np.empty(0), np.empty((0, 0)))
    varied, units = moved_by(case, places) if places else (none, dict[str, str]())
    made = DesignOutputs.of(case, varied.places, derivative=2, bodies=bodies)
    route = made.designs.route
    if route.begin.lead is not None:
        raise KincheckError(
            f"{case.name}: the motion does not begin at the design position. Change the drivers"
            " so that they have their design values at one time."
        )
    model, kept = route.model, len(route.model.slots) + 2
    geometry, parameters = Geometry(case), list[Parameter]()
    for k, (name, unit) in enumerate(units.items()):
        moved = {model.geometry[i]: float(x) for i, x in enumerate(varied.moves[:, k]) if x}
        parameters.append(Parameter(name, unit, _nominal(geometry, name), moved))
    pushes = _pushes(case, model) if case.forces else {}
    outputs: list[CodeOutput] = []
    for each in measured:
        found = (
            CodeOutput(each, (), pushed=pushes[each.name])
            if each.forces
            else _output(model, each, kept)
        )
        outputs.append(found)
        kept += 4 if found.completion else 1 if found.period else 0
    poses = {
        name: [slot for part in "rp" for slot in model.plan.kept[model.rows[f"{part} {name}"]]]
        for name in bodies
    }
    others = [
        recent_model(model.mechanism, replace(model.request, rows=rows))
        for rows in _other_rows(case, model, [path, *steered])
    ]
    begin = route.begin.time
    return SolvedCase(case, model, outputs, parameters, begin, poses, others, is_steered)


def _pushes(case: Case, model: Model) -> dict[str, dict[int, float]]:
    """Return by output of a force the slots of its sum, with the factor of each.

    Raises:
        KincheckError: forces cannot be traced, or redundant rows leave one undetermined.
    """
    wanted, rows = model.request.forces, model.rows
    if wanted is None:
        raise KincheckError(
            f"{case.name}: the forces of this mechanism are none that code can have. Leave --forces"
            " out."
        )
    if model.selection.dropped and (loose := loose_forces(case)):
        raise KincheckError(
            f"{case.name}: redundant rows leave {shortened(loose, 5)} undetermined, as kincheck"
            " run tells. Leave these outputs out, or --forces."
        )
    names = [f"{REACTION}{each}" for each in wanted.joints]
    names += [f"{EFFORT}{each}" for each in wanted.drivers]
    names += [f"{ELEMENT}{each}" for each in wanted.elements]
    slots, columns = list[int](), dict[str, slice]()
    for name in names:  # without what redundant rows leave free
        own = model.plan.kept[rows[name]][: 6 if name.startswith(REACTION) else 1]
        columns[name] = slice(len(slots), len(slots) + len(own))
        slots += own
    units = np.eye(len(slots))  # one force after the other is one, and all others are zero
    wrenches = {name: units[:, columns[f"{REACTION}{name}"]] for name in wanted.joints}
    none, zero = np.zeros((len(slots), 6, 0)), np.zeros(len(slots))
    ones = Forces(
        {name: Reaction(each[:, :3], each[:, 3:], none) for name, each in wrenches.items()},
        {name: units[:, columns[f"{EFFORT}{name}"].start] for name in wanted.drivers},
        {name: units[:, columns[f"{ELEMENT}{name}"].start] for name in wanted.elements},
        zero,
        zero,
    )
    return {
        each.name: {slot: float(x) for slot, x in zip(slots, each.values(ones), strict=True) if x}
        for each in case.outputs
        if isinstance(each, ForceMeasure)
    }


def loose_forces(case: Case) -> list[str]:
    """Return the names of the outputs of forces left undetermined somewhere on the sweep."""
    solver = NativeSolver()
    found = solver.prepare(case.mechanism, case.sweep.path, case.points, (), case.forces)(TOL)
    forces = [each for each in case.outputs if each.forces]
    values = {each.name: output_series(case, each, found).position for each in forces}
    return [name for name, each in values.items() if np.isnan(each[found.solved]).any()]


def _other_rows(case: Case, model: Model, paths: Sequence[Path]) -> list[tuple[int, ...]]:
    """Return the further choices of independent rows by native on paths."""
    if not model.selection.dropped:
        return []
    made, found = DesignOutputs.of(case, (), derivative=2), dict[tuple[int, ...], None]()
    for path in paths:
        route = made.on_path(path).designs.route
        followed = Followed(route, follow_samples(route, TOL, low=LOW), TOL)
        followed.go_on()
        followed.renew(followed.visit(np.flatnonzero(followed.needs_check).tolist()))
        found |= dict.fromkeys(each.selection.chosen for each in followed.models[1:])
    return [*found]


def _nominal(geometry: Geometry, name: str) -> float:
    """Return the value of a number at design [SI]; an angle of a direction is zero there."""
    whole, _, axis = name.rpartition(" ")
    variable = geometry.variable(whole if axis in ("x", "y", "z") and whole else name)
    place = variable.places[0]
    value = np.atleast_1d(geometry.values[place])
    if variable.kind is Kind.DIRECTION:
        return 0.0
    column = "xyz".index(axis) if len(value) == 3 else 0
    return float(variable.moves[place][:, column] @ value)


def _output(model: Model, quantity: Quantity, kept: int) -> CodeOutput:
    names = (f"{OUTPUT}{label} {quantity.name}" for label in QUANTITIES)
    slots = [model.plan.kept[model.rows[name]] for name in names if name in model.rows]
    rows = model.rows.get(f"{RESTING}{quantity.name}")
    resting = () if rows is None else model.plan.kept[rows]
    if isinstance(quantity, Orientation):
        return CodeOutput(quantity, slots, kept=kept, completion=_completion(quantity))
    if quantity.period:
        at_design = float(getattr(quantity, "at_design", 0.0))
        return CodeOutput(quantity, slots, period=quantity.period, at_design=at_design, kept=kept)
    return CodeOutput(quantity, slots, resting)


def _completion(quantity: Orientation) -> Program:
    """Return the program of an attitude: twelve numbers, Euler parameters and two rates, to the
    three orders of the component.
    """
    tape = Tape()
    e = [Jet(*(tape.input(4 * order + k) for order in range(3))) for k in range(4)]
    found = quantity.component_of(e)
    return program("complete", tape, dict(enumerate((found.x, found.v, found.a))))
