"""Constraints of one kind, with their shared equations as one small program; see `elements`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import islice
from typing import Any

import numpy as np

from ...algebra import Scalar, Vec3, vec
from ...mechanism.mechanism import GROUND
from ...primitives.base import Drive
from ...program import Plan, Program, Tape, Traced, program
from ...trajectory import Array
from ..formulation.cartesian import Cartesian
from ..formulation.constraints import Constraint, Relation
from ..structure.sparse_lu import Indices

SIDES = ("i", "j")
POWER = "power "
WHERE, HOW = "where", "how"
"""The programs of a kind: what follows from where its bodies are, and gamma, which needs to know
how they move.
"""
QUANTITIES: tuple[str, ...] = ("phi", "nu", "gamma", "branch", "entries")


@dataclass(frozen=True)
class Numbering:
    """Places in the vectors of a mechanism: component by component, in each the bodies in order,
    and then the coordinates.

    A state has u and q of the bodies, and drives may stand behind it; rates have v and w, steps dr
    and dpi.
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

    def places(
        self, components: int, bodies: Iterable[str], coordinates: Iterable[str]
    ) -> list[int]:
        """Where the components of some bodies stand, and then some coordinates: 7 for a state, 6
        for rates.
        """
        n = len(self.bodies)
        found = [k * n + self.bodies[body] for body in bodies for k in range(components)]
        return found + [components * n + self.coordinates[name] for name in coordinates]


@dataclass(frozen=True)
class Member:
    """A constraint, the number of its first row, and of its driver; None without a driver."""

    constraint: Constraint | Relation
    row: int
    driver: int | None

    @property
    def what(self) -> str:
        """Its type."""
        c = self.constraint
        return type(c if isinstance(c, Relation) else c.primitive).__name__

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The coordinates it reads."""
        c = self.constraint
        return (
            tuple(c.weights) if isinstance(c, Relation) else (c.coordinate,) if c.coordinate else ()
        )

    def bodies(self, moving: Mapping[str, int]) -> dict[str, str]:
        """Its moving bodies by side."""
        c = self.constraint
        if isinstance(c, Relation):
            return {}
        return {side: body for side, body in zip(SIDES, (c.i, c.j), strict=True) if body in moving}

    def geometry(self) -> dict[str, Any]:
        """Its geometry by name."""
        c = self.constraint
        if isinstance(c, Relation):
            return {
                **{f"x{k}": weight for k, weight in enumerate(c.weights.values())},
                **{f"{POWER}{k}": each for k, each in enumerate(c.curve)},
                "drive": c.drive,
            }
        return {each.name: getattr(c.primitive, each.name) for each in fields(c.primitive)}

    def kind(self, moving: Mapping[str, int]) -> Any:
        """Return the common features of constraints with one program."""
        # vectors, not their components: axes that happen to lie in a global plane would make a kind
        # each
        zero = tuple(
            not any(value) for value in self.geometry().values() if isinstance(value, Vec3)
        )
        c = self.constraint
        powers = len(c.curve) if isinstance(c, Relation) else 0
        named = len(self.coordinates), self.driver is not None, powers
        return (
            Relation if isinstance(c, Relation) else type(c.primitive),
            tuple(self.bodies(moving)),
            *named,
            zero,
        )


class ElementType:
    """The constraints of one kind, with the traced inputs and outputs of their programs.

    Slots of a lane: the numbers of its state and drive, those of its rates, its geometry, its
    outputs.
    """

    def __init__(self, members: Sequence[Member], numbering: Numbering) -> None:
        first, self.lanes, self._tape, moving = members[0], len(members), Tape(), numbering.bodies
        self.label = f"{first.what} like row {first.row} of {first.constraint.owner}"
        sides = [(member.bodies(moving).values(), member.coordinates) for member in members]
        where = [numbering.places(7, *each) for each in sides]
        if first.driver is not None:
            for places, member in zip(where, members, strict=True):
                places += [numbering.state + 5 * (member.driver or 0) + k for k in range(5)]
        self.read: dict[str, Indices] = {
            WHERE: np.array(where, np.intp).T,
            HOW: np.array([numbering.places(6, *each) for each in sides], np.intp).T,
        }
        self.inputs = {WHERE: range(len(self.read[WHERE]))}
        self.inputs[HOW] = range(len(self.read[WHERE]), len(self.read[WHERE]) + len(self.read[HOW]))
        self.geometry: list[Array] = []
        self.geometry_at = self.inputs[HOW].stop
        formulation = self._formulation(members, moving)
        given = iter(self.inputs[WHERE])
        state = {
            f"{part} {side}": self._next(given, count)
            for side in first.bodies(moving)
            for part, count in (("u", 3), ("q", 4))
        }
        state |= {f"x {name}": self._next(given, 1) for name in formulation.coordinates}
        at = formulation.configuration(state)
        rows = [
            (k, column, value)
            for k, row in enumerate(formulation.rows(at))
            for column, value in row.items()
        ]
        self._values: dict[str, Sequence[Scalar]] = {
            "phi": formulation.phi(at),
            "nu": formulation.nu(at),
            "gamma": formulation.gamma(at, [self._tape.input(slot) for slot in self.inputs[HOW]]),
            "branch": formulation.branch(at),
            "entries": [value for *_, value in rows],
        }
        self._row = np.array([member.row for member in members], np.intp)
        self.rows = self._row + np.array([[k] for k, *_ in rows], np.intp)
        self.columns = self.read[HOW][[column for _, column, _ in rows]]
        end, programs = self.geometry_at + len(self.geometry), dict[str, Program]()
        self.outputs: dict[str, range] = {}
        for name in (WHERE, HOW):
            values = [
                value
                for of, *_, value in self._written()
                if of == name and isinstance(value, Traced)
            ]
            if values:
                self.outputs[name] = range(end, end := end + len(values))
                programs[name] = program(
                    name, self._tape, dict(zip(self.outputs[name], values, strict=True))
                )
        self.plan = Plan(programs, {str(k): k for k in range(end)})

    def _next(self, slots: Iterator[int], count: int) -> list[Scalar]:
        return [self._tape.input(slot) for slot in islice(slots, count)]

    def _formulation(self, members: Sequence[Member], moving: Mapping[str, int]) -> Cartesian:
        """Return the equations of one constraint over numbers known at run time, except those
        common to all.
        """
        first, drive = members[0], self.inputs[WHERE][-5:]
        geometry = {
            name: self._lifted(name, value, members) for name, value in first.geometry().items()
        }
        if first.driver is not None:
            geometry["drive"] = Drive(*(self._tape.input(slot) for slot in drive))
        c = first.constraint
        if isinstance(c, Relation):
            drive = geometry.pop("drive")
            curve = tuple(geometry.pop(f"{POWER}{k}") for k in range(len(c.curve)))
            return Cartesian([Relation("", geometry, drive, curve)], (), tuple(geometry))
        i, j = (side if side in first.bodies(moving) else GROUND for side in SIDES)
        lifted = Constraint("", replace(c.primitive, **geometry), i, j, "x" if c.coordinate else "")
        return Cartesian([lifted], tuple(first.bodies(moving)))

    def _lifted(self, name: str, value: Any, members: Sequence[Member]) -> Any:
        if isinstance(value, Drive):
            return value
        numbers = np.array(
            [
                [*each] if isinstance(each, Vec3) else [each]
                for m in members
                for each in [m.geometry()[name]]
            ]
        ).T
        found = [self._constant_or_input(row) for row in numbers]
        return vec(found) if isinstance(value, Vec3) else found[0]

    def _constant_or_input(self, numbers: Array) -> Scalar:
        if (numbers == numbers[0]).all():
            return float(numbers[0])
        self.geometry.append(numbers)
        return self._tape.input(self.geometry_at + len(self.geometry) - 1)

    def size(self, quantity: str) -> int:
        """How many numbers of a quantity it gives."""
        return len(self._values[quantity]) * self.lanes

    def _written(self) -> Iterator[tuple[str, str, Indices, Scalar]]:
        """Return the outputs of all constraints at a time: name of a program, quantity and places
        in it, and the value.
        """
        for name, quantities in ((WHERE, ("phi", "nu", "branch", "entries")), (HOW, ("gamma",))):
            for quantity in quantities:
                for k, value in enumerate(self._values[quantity]):
                    rows = (
                        k * self.lanes + np.arange(self.lanes)
                        if quantity in ("branch", "entries")
                        else self._row + k
                    )
                    yield name, quantity, rows, value

    def places(self, starts: Mapping[str, int]) -> dict[str, Indices]:
        """Where the outputs of its programs go, where every quantity has its start, shape (outputs,
        constraints).
        """
        found: dict[str, list[Indices]] = {name: [] for name in self.outputs}
        for name, quantity, rows, value in self._written():
            if isinstance(value, Traced):
                found[name].append(starts[quantity] + rows)
        return {name: np.array(rows) for name, rows in found.items()}

    def constants(self, starts: Mapping[str, int]) -> Iterator[tuple[Indices, float]]:
        """Return the constant outputs likewise: the same at every pose."""
        for _, quantity, rows, value in self._written():
            if not isinstance(value, Traced):
                yield starts[quantity] + rows, value

    @property
    def sizes(self) -> dict[str, dict[str, int]]:
        """Operations and flops of one constraint, by program."""
        return {
            f"{name}, {self.lanes} {self.label}": each.size
            for name, each in self.plan.programs.items()
        }
