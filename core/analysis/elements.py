"""The constraints of a large mechanism as elements: constraints of one kind share one small program, its lanes are the constraints.

Constraints are of one kind where their primitives have the same type, the same of their bodies move and the same vectors are zero
(the arm of a joint at a body's origin). What all of a kind have in common is a constant of its program; all else is an input:
geometry once, poses and drives at every evaluation, rates for the accelerations.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..algebra import Scalar, Vec3, vec
from ..mechanism import GROUND
from ..primitives.base import Drive
from ..program import Executor, LlvmCode, LlvmExecutor, NumpyExecutor, Plan, Program, Tape, Traced, program
from ..program.compiler import available
from ..trajectory import Array
from .cartesian import Cartesian
from .equations import Constraint, Relation

Indices = NDArray[np.intp]
SIDES = ("i", "j")
WHERE, HOW = "where", "how"
"""The programs of a kind: what follows from where its bodies are, and gamma, which needs to know how they move."""
QUANTITIES: tuple[str, ...] = ("phi", "nu", "gamma", "branch", "entries")


@dataclass(frozen=True)
class Numbering:
    """Places in the vectors of a mechanism: component by component, in each the bodies in order, and then the coordinates.

    A state has u and q of the bodies, and drives may stand behind it; rates have v and w, steps dr and dpi.
    """

    bodies: Mapping[str, int]
    coordinates: Mapping[str, int]

    @property
    def state(self) -> int:
        """Numbers of a state."""
        return 7 * len(self.bodies) + len(self.coordinates)

    @property
    def unknowns(self) -> int:
        """Numbers of the rates."""
        return 6 * len(self.bodies) + len(self.coordinates)

    def places(self, components: int, bodies: Iterable[str], coordinates: Iterable[str]) -> list[int]:
        """Where the components of some bodies stand, and then some coordinates: 7 for a state, 6 for rates."""
        n = len(self.bodies)
        found = [k * n + self.bodies[body] for body in bodies for k in range(components)]
        return found + [components * n + self.coordinates[name] for name in coordinates]


@dataclass(frozen=True)
class Member:
    """A constraint, the number of its first row, and of the driver that moves it; None where none does."""

    constraint: Constraint | Relation
    row: int
    driver: int | None

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The coordinates it reads."""
        c = self.constraint
        return tuple(c.weights) if isinstance(c, Relation) else (c.coordinate,) if c.coordinate else ()

    def bodies(self, moving: Mapping[str, int]) -> dict[str, str]:
        """Those of its bodies that move, by side."""
        c = self.constraint
        if isinstance(c, Relation):
            return {}
        return {side: body for side, body in zip(SIDES, (c.i, c.j), strict=True) if body in moving}

    def geometry(self) -> dict[str, Any]:
        """What it is made of, by name."""
        c = self.constraint
        if isinstance(c, Relation):
            return {**{f"x{k}": weight for k, weight in enumerate(c.weights.values())}, "drive": c.drive}
        return {each.name: getattr(c.primitive, each.name) for each in fields(c.primitive)}

    def kind(self, moving: Mapping[str, int]) -> Any:
        """What constraints must have in common to share a program."""
        # vectors, not their components: axes that happen to lie in a global plane would make a kind each
        zero = tuple(not any(value) for value in self.geometry().values() if isinstance(value, Vec3))
        named = len(self.coordinates), self.driver is not None
        c = self.constraint
        return (Relation if isinstance(c, Relation) else type(c.primitive), tuple(self.bodies(moving)), *named, zero)


class Elements:
    """All constraints. What they evaluate to stands in arrays that the next evaluation overwrites.

    Attributes:
        numbering: of states and rates.
        owners: for every row the joint or driver, and the primitive, it belongs to.
        phi, nu, gamma: shape (rows,), in the order of the constraints.
        branch: all branch tests, shape (tests,).
        entries: of the Jacobian, shape (entries,); each place occurs once.
        rows, columns: where the entries belong, same shape.
    """

    def __init__(
        self, constraints: Sequence[Constraint | Relation], bodies: Sequence[str], drivers: int, *, compiled: bool
    ) -> None:
        members: list[Member] = []
        self.owners: list[tuple[str, str]] = []
        for k, c in enumerate(constraints, drivers - len(constraints)):  # the drivers come last
            members.append(Member(c, len(self.owners), k if k >= 0 else None))
            relation = isinstance(c, Relation)
            self.owners += [(c.owner, "Relation")] if relation else [(c.owner, type(c.primitive).__name__)] * c.primitive.n
        coordinates = dict.fromkeys(name for member in members for name in member.coordinates)
        self.numbering = Numbering(*({name: k for k, name in enumerate(names)} for names in (bodies, coordinates)))
        kinds: dict[Any, list[Member]] = {}
        for member in members:
            kinds.setdefault(member.kind(self.numbering.bodies), []).append(member)
        self._kinds = [_Kind(each, self.numbering) for each in kinds.values()]
        self.rows, self.columns = (
            np.concatenate([getattr(kind, name).ravel() for kind in self._kinds]) for name in ("rows", "columns")
        )
        sizes = dict.fromkeys(QUANTITIES, len(self.owners))
        sizes |= {name: sum(kind.size(name) for kind in self._kinds) for name in ("branch", "entries")}
        ends = np.cumsum(list(sizes.values()))
        # one array, so that each kind writes once
        self._results = np.zeros(ends[-1])
        self.phi, self.nu, self.gamma, self.branch, self.entries = np.split(self._results, ends[:-1])
        starts: dict[str, int] = dict(zip(QUANTITIES, [0, *ends[:-1].tolist()], strict=True))
        for kind in self._kinds:
            kind.bind(self._results, starts, compiled=compiled)
            starts["branch"] += kind.size("branch")
            starts["entries"] += kind.size("entries")

    @property
    def sizes(self) -> list[dict[str, int]]:
        """Of each kind: how many constraints there are, and the flops of one."""
        return [kind.sizes for kind in self._kinds]

    def evaluate(self, state: Array, drives: Array) -> None:
        """Update phi, nu, branch and entries.

        Args:
            state: see `Numbering`.
            drives: c, c_t, c_tt, cos c/2 and sin c/2 of every driver, shape (drivers * 5,).
        """
        given = np.concatenate([state, drives])
        for kind in self._kinds:
            kind.run(WHERE, given)

    def accelerate(self, rates: Array) -> None:
        """Update gamma at the rates, where the bodies were last evaluated."""
        for kind in self._kinds:
            kind.run(HOW, rates)


class _Kind:
    """The constraints of one kind.

    Slots of a lane: the numbers of its state and drive, those of its rates, its geometry, its outputs.
    """

    def __init__(self, members: Sequence[Member], numbering: Numbering) -> None:
        first, self._lanes, self._tape, moving = members[0], len(members), Tape(), numbering.bodies
        sides = [(member.bodies(moving).values(), member.coordinates) for member in members]
        where = [numbering.places(7, *each) for each in sides]
        if first.driver is not None:
            for places, member in zip(where, members, strict=True):
                places += [numbering.state + 5 * (member.driver or 0) + k for k in range(5)]
        self._read: dict[str, Indices] = {
            WHERE: np.array(where, np.intp).T,
            HOW: np.array([numbering.places(6, *each) for each in sides], np.intp).T,
        }
        self._inputs = {WHERE: range(len(self._read[WHERE]))}
        self._inputs[HOW] = range(len(self._read[WHERE]), len(self._read[WHERE]) + len(self._read[HOW]))
        self._geometry: list[Array] = []
        self._first_geometry = self._inputs[HOW].stop
        formulation = self._formulation(members, moving)
        given = iter(self._inputs[WHERE])
        state = {
            f"{part} {side}": self._next(given, count) for side in first.bodies(moving) for part, count in (("u", 3), ("q", 4))
        }
        state |= {f"x {name}": self._next(given, 1) for name in formulation.coordinates}
        at = formulation.configuration(state)
        rows = [(k, column, value) for k, row in enumerate(formulation.rows(at)) for column, value in row.items()]
        self._values: dict[str, Sequence[Scalar]] = {
            "phi": formulation.phi(at),
            "nu": formulation.nu(at),
            "gamma": formulation.gamma(at, [self._tape.input(slot) for slot in self._inputs[HOW]]),
            "branch": formulation.branch(at),
            "entries": [value for *_, value in rows],
        }
        self._row = np.array([member.row for member in members], np.intp)
        self.rows = self._row + np.array([[k] for k, *_ in rows], np.intp)
        self.columns = self._read[HOW][[column for _, column, _ in rows]]

    def _next(self, slots: Iterator[int], count: int) -> list[Scalar]:
        return [self._tape.input(slot) for slot in islice(slots, count)]

    def _formulation(self, members: Sequence[Member], moving: Mapping[str, int]) -> Cartesian:
        """The equations of one of them, over numbers that are known when the program runs, but for those all have in common."""
        first, drive = members[0], self._inputs[WHERE][-5:]
        geometry = {name: self._lifted(name, value, members) for name, value in first.geometry().items()}
        if first.driver is not None:
            geometry["drive"] = Drive(*(self._tape.input(slot) for slot in drive))
        c = first.constraint
        if isinstance(c, Relation):
            drive = geometry.pop("drive")
            return Cartesian([Relation("", geometry, drive)], (), tuple(geometry))
        i, j = (side if side in first.bodies(moving) else GROUND for side in SIDES)
        lifted = Constraint("", replace(c.primitive, **geometry), i, j, "x" if c.coordinate else "")
        return Cartesian([lifted], tuple(first.bodies(moving)))

    def _lifted(self, name: str, value: Any, members: Sequence[Member]) -> Any:
        if isinstance(value, Drive):
            return value
        numbers = np.array([[*each] if isinstance(each, Vec3) else [each] for m in members for each in [m.geometry()[name]]]).T
        found = [self._constant_or_input(row) for row in numbers]
        return vec(found) if isinstance(value, Vec3) else found[0]

    def _constant_or_input(self, numbers: Array) -> Scalar:
        if (numbers == numbers[0]).all():
            return float(numbers[0])
        self._geometry.append(numbers)
        return self._tape.input(self._first_geometry + len(self._geometry) - 1)

    def size(self, quantity: str) -> int:
        """How many numbers of a quantity it gives."""
        return len(self._values[quantity]) * self._lanes

    def bind(self, results: Array, starts: Mapping[str, int], *, compiled: bool) -> None:
        """Write what is constant, and prepare to write the rest, into an array where every quantity has its start."""
        end = self._first_geometry + len(self._geometry)
        programs: dict[str, Program] = {}
        self._results = results
        outputs: dict[str, tuple[range, Indices]] = {}
        for name, quantities in ((WHERE, ("phi", "nu", "branch", "entries")), (HOW, ("gamma",))):
            wanted: dict[int, Scalar] = {}
            places: list[Indices] = []
            for quantity in quantities:
                for k, value in enumerate(self._values[quantity]):
                    lanes = k * self._lanes + np.arange(self._lanes) if quantity in ("branch", "entries") else self._row + k
                    if isinstance(value, Traced):
                        wanted[end + len(wanted)] = value
                        places.append(starts[quantity] + lanes)
                    else:
                        results[starts[quantity] + lanes] = value
            if wanted:
                programs[name] = program(name, self._tape, wanted)
                outputs[name] = range(end, end := end + len(wanted)), np.array(places)
        self.sizes = {"constraints": self._lanes} | {f"flops {name}": each.flops for name, each in programs.items()}
        plan = Plan(programs, {str(k): k for k in range(end)})
        self._executor: Executor = (
            LlvmExecutor(LlvmCode(plan), self._lanes) if compiled and available() else NumpyExecutor(plan, self._lanes)
        )
        # gathered and scattered by one call each: of some hundred bodies it is the calls that take the time
        inputs = {name: (self._inputs[name], places) for name, places in self._read.items()}
        self._taken, self._written = (
            {name: (self._executor.window(slots), self._executor.arranged(places).copy()) for name, (slots, places) in each.items()}
            for each in (inputs, outputs)
        )
        if self._geometry:
            self._executor.put(range(self._first_geometry, self._first_geometry + len(self._geometry)), np.array(self._geometry))

    def run(self, name: str, given: Array) -> None:
        """Run a program over numbers of the whole mechanism, and write what it gives."""
        window, places = self._taken[name]
        window[:] = given[places]
        if name in self._written:
            window, places = self._written[name]
            self._executor.run(name)
            self._results[places] = window
