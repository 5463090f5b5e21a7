"""Equations of a large mechanism as elements: constraints of one kind share one small program, and
its table is repeated for each of them.

Constraints are of one kind if their primitives have the same type, the same of their sides move and
the same vectors are zero (the arm of a joint at a body's origin). Numbers common to all of a kind
are constants of its program; others are read from slots of their own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from ...algebra import Scalar, Vec3
from ...program import Tape, Traced, program
from ...program.straight_line import Bytecode, bytecode, repeated
from ...trajectory import Array
from ..formulation.cartesian import COLUMNS, Cartesian
from ..formulation.constraints import Constraint, Relation
from .request import RATE, Layout

Indices = NDArray[np.intp]
ROWS, GAMMA, RETRACT = "rows", "gamma", "retract"
GEOMETRY = "geometry"
"""The vector of the numbers that differ within a kind."""
AFTER = "after "
"""Before the names of the vectors of a state: after the step."""


@dataclass(frozen=True, eq=False)
class Elements:
    """The programs of all elements as tables.

    Attributes:
        rows, columns: of the entries of the Jacobian.
        tables: of phi, nu and entries; of gamma; of the state after a step.
        sizes: operations and flops of each.
        geometry: values of the vector `GEOMETRY`.
    """

    rows: Indices
    columns: Indices
    tables: Mapping[str, Bytecode]
    sizes: Mapping[str, Mapping[str, int]]
    geometry: Array


@dataclass
class _Kind:
    """The program of one kind being traced.

    Attributes:
        sources: for each input slot, the slot of each element.
    """

    tape: Tape
    sources: list[Sequence[int]]

    def read(self, slots: Sequence[int]) -> Traced:
        """Return an input that each element reads from its own slot."""
        self.sources.append(slots)
        return self.tape.input(len(self.sources) - 1)

    def vector(self, slots: Sequence[Sequence[int]]) -> list[Scalar]:
        """Return the inputs of vectors, by element."""
        return [self.read(each) for each in zip(*slots, strict=True)]


def linked(formulation: Cartesian, layout: Layout, width: int) -> Elements:
    """Return the equations of a formulation as elements.

    Args:
        formulation: of joints that take numbers known later: those of the library.
        layout: of the slots; more are added to it.
        width: lanes of a vector.
    """
    writer = _Writer(formulation, layout)
    first, kinds = 0, dict[Any, list[tuple[Constraint | Relation, int]]]()
    for c in formulation.constraints:
        kinds.setdefault(_kind(c, formulation), []).append((c, first))
        first += 1 if isinstance(c, Relation) else c.primitive.n
    for members in kinds.values():
        writer.add([c for c, _ in members], np.array([row for _, row in members]))
    writer.retract()
    return writer.finished(width)


class _Writer:
    def __init__(self, formulation: Cartesian, layout: Layout) -> None:
        self.formulation, self.layout, self.geometry = formulation, layout, list[float]()
        self.rates = layout.vector(RATE, formulation.unknowns)
        self.step = layout.vector("step", formulation.unknowns)
        n = len(formulation.owners)
        self.of_row = {
            name: np.array(layout.vector(name, n), np.intp) for name in ("phi", "nu", "gamma")
        }
        self.rows, self.columns = list[Indices](), list[Indices]()
        self.written: dict[str, list[tuple[Any, Indices]]] = {ROWS: [], GAMMA: [], RETRACT: []}

    def add(self, members: Sequence[Constraint | Relation], first: Indices) -> None:
        """Add the constraints of one kind, with their first rows."""
        whole, kind = self.formulation, _Kind(Tape(), [])
        lifted = self._lifted(members, kind)
        sides = (
            [each for each in ("i", "j") if each in (lifted.i, lifted.j)]
            if isinstance(lifted, Constraint)
            else []
        )
        bodies = [[getattr(c, side) for c in members] for side in sides]
        own = Cartesian(
            [lifted], sides, tuple(lifted.weights) if isinstance(lifted, Relation) else ()
        )
        named = [_coordinates(c) for c in members]
        state = {
            f"{label} {side}": kind.vector([self.layout.vectors[f"{label} {b}"] for b in each])
            for side, each in zip(sides, bodies, strict=True)
            for label in "uq"
        }
        state |= {
            f"x {name}": kind.vector([self.layout.vectors[f"x {x[k]}"] for x in named])
            for k, name in enumerate(own.coordinates)
        }
        columns = [
            [whole.columns[b] + k for b in each] for each in bodies for k in range(COLUMNS)
        ] + [[whole.coordinates[x[k]] for x in named] for k in range(len(own.coordinates))]
        at = own.configuration(state)
        matrix = [(k, j, x) for k, row in enumerate(own.rows(at)) for j, x in row.items()]
        m = len(members)
        entries = self.layout.vectors.setdefault("entries", [])
        taken = range(len(entries), len(entries) + m * len(matrix))
        places = np.array([self.layout.scalar(f"entries.{k}") for k in taken], np.intp)
        entries += places.tolist()
        self.rows += [first + k for k, _, _ in matrix]
        self.columns += [np.array(columns[j], np.intp) for _, j, _ in matrix]
        values = {name: getattr(own, name)(at) for name in ("phi", "nu")}
        out = [
            (x, self.of_row[name][first + k])
            for name, each in values.items()
            for k, x in enumerate(each)
        ]
        of_entries = places.reshape(len(matrix), m)
        out += [(x, each) for (_, _, x), each in zip(matrix, of_entries, strict=True)]
        self._write(ROWS, kind, out)
        rates = [kind.read([self.rates[j] for j in each]) for each in columns]
        gamma = enumerate(own.gamma(at, rates))
        self._write(GAMMA, kind, [(x, self.of_row["gamma"][first + k]) for k, x in gamma])

    def retract(self) -> None:
        """Add the steps of all bodies and coordinates."""
        whole, vectors = self.formulation, self.layout.vectors
        for name, value in whole.design.items():
            self.layout.vector(AFTER + name, len(value))
        for names, own, size in (
            (whole.columns, Cartesian([], ("i",)), COLUMNS),
            (whole.coordinates, Cartesian([], (), ("x",)), 1),
        ):
            if not names:
                continue
            kind, labels = _Kind(Tape(), []), ("u", "q") if size == COLUMNS else ("x",)
            (local,) = (*own.bodies, *own.coordinates)
            slots = {label: [vectors[f"{label} {name}"] for name in names] for label in labels}
            state = {f"{label} {local}": kind.vector(slots[label]) for label in labels}
            step = [kind.read([self.step[k + at] for at in names.values()]) for k in range(size)]
            after = own.retract(own.configuration(state), step)
            self._write(
                RETRACT,
                kind,
                [
                    (x, np.array([vectors[f"{AFTER}{label} {name}"][k] for name in names]))
                    for label in labels
                    for k, x in enumerate(after[f"{label} {local}"])
                ],
            )

    def _write(self, name: str, kind: _Kind, out: Sequence[tuple[Scalar, Indices]]) -> None:
        """Add a program of a kind with its values and the slots of each element they go to."""
        inputs = len(kind.sources)
        traced = program(name, kind.tape, {inputs + k: x for k, (x, _) in enumerate(out)})
        slots = [np.array(each) for each in kind.sources] + [each for _, each in out]
        self.written[name].append((traced, np.array(slots, np.intp)))

    def _lifted(self, members: Sequence[Constraint | Relation], kind: _Kind) -> Any:
        """Return one constraint for all: numbers that differ become inputs."""
        every = zip(*(list(_leaves(_content(c))) for c in members), strict=True)
        numbers = iter([self._number(each, kind) for each in every])
        first = members[0]
        content = _rebuilt(_content(first), numbers)
        if isinstance(first, Relation):
            weights = {f"x{k}": w for k, w in enumerate(content[0])}
            return replace(first, weights=weights, curve=content[1], drive=content[2])
        moving = self.formulation.columns
        sides = (
            side if body in moving else ""
            for side, body in zip("ij", (first.i, first.j), strict=True)
        )
        i, j = sides
        return Constraint("", content, i, j, "x" if first.coordinate else "")

    def _number(self, each: Sequence[Scalar], kind: _Kind) -> Scalar:
        first = each[0]
        if isinstance(first, float | int) and all(x == first for x in each):
            return first
        slots = list[int]()
        for x in each:
            if isinstance(x, Traced):
                op, slot = x.tape.nodes[x.number][:2]
                assert op == "input", op
                slots.append(int(slot))
            else:
                self.geometry.append(float(x))
                slots.append(-len(self.geometry))  # its slot comes last
        return kind.read(slots)

    def finished(self, width: int) -> Elements:
        """Return the elements with all tables."""
        geometry = np.array(self.layout.vector(GEOMETRY, len(self.geometry)), np.intp)
        slots, tables, sizes = len(self.layout.slots), dict[str, Bytecode](), dict[str, Any]()
        for name, parts in self.written.items():
            size = {"operations": 0, "flops": 0}
            for _, places in parts:
                places[places < 0] = geometry[-1 - places[places < 0]]
            for traced, places in parts:
                for label, each in traced.size.items():
                    size[label] += each * places.shape[1]
            sizes[name] = size
            tables[name] = repeated(
                [(bytecode(traced, len(places), 1), places) for traced, places in parts],
                slots,
                width,
            )
        return Elements(
            np.concatenate(self.rows),
            np.concatenate(self.columns),
            tables,
            sizes,
            np.array(self.geometry),
        )


def _content(c: Constraint | Relation) -> Any:
    """Return what of a constraint holds its numbers."""
    if isinstance(c, Relation):
        return tuple(c.weights.values()), c.curve, c.drive
    return c.primitive


def _coordinates(c: Constraint | Relation) -> tuple[str, ...]:
    if isinstance(c, Relation):
        return tuple(c.weights)
    return (c.coordinate,) if c.coordinate else ()


def _kind(c: Constraint | Relation, formulation: Cartesian) -> Any:
    """Return a key, equal for constraints of one kind."""
    moving = formulation.columns
    sides = () if isinstance(c, Relation) else (c.i in moving, c.j in moving)
    return sides, len(_coordinates(c)), _signature(_content(c))


def _signature(value: Any) -> Any:
    """Return all of a value but its numbers; whether a vector is zero is part of it."""
    if _is_number(value):
        return Traced if isinstance(value, Traced) else float
    if isinstance(value, Vec3):
        return Vec3, any(isinstance(x, Traced) or x != 0.0 for x in value)
    parts = _parts(value)
    return value if parts is None else (type(value), *map(_signature, parts))


def _leaves(value: Any) -> Iterator[Scalar]:
    """Yield the numbers of a value."""
    if _is_number(value):
        yield value
    for part in _parts(value) or ():
        yield from _leaves(part)


def _rebuilt(value: Any, numbers: Iterator[Scalar]) -> Any:
    """Return a value with other numbers, in the order of `_leaves`."""
    if _is_number(value):
        return next(numbers)
    parts = _parts(value)
    if parts is None:
        return value
    new = [_rebuilt(part, numbers) for part in parts]
    if isinstance(value, tuple):
        return tuple(new)
    return replace(value, **dict(zip(_names(value.__class__) or (), new, strict=True)))


def _is_number(value: Any) -> bool:
    return isinstance(value, Traced | float | int) and not isinstance(value, bool)


def _parts(value: Any) -> list[Any] | None:
    """Return the parts of a tuple or of a data class; None of anything else."""
    if isinstance(value, tuple):
        return [*cast("tuple[Any, ...]", value)]
    names = _names(value.__class__)
    return None if names is None else [getattr(value, name) for name in names]


@cache
def _names(kind: Any) -> tuple[str, ...] | None:
    """Return the names of the fields of a data class; None of another type."""
    return tuple(each.name for each in fields(kind)) if is_dataclass(kind) else None
