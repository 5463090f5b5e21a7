"""Equations of a large mechanism as elements: constraints of one kind share one small program, and
its table is repeated for each of them.

Constraints are of one kind if their primitives have the same type, the same of their sides move and
the same vectors are zero (the arm of a joint at a body's origin). Numbers common to all of a kind
are constants of its program; others are read from slots of their own.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...algebra import Scalar
from ...kinematics.compiled.compiled_model import is_builtin
from ...kinematics.compiled.dense_equations import GEOMETRY, System
from ...kinematics.compiled.request import RATE, Layout
from ...kinematics.formulation.cartesian import COLUMNS, Cartesian
from ...kinematics.formulation.constraints import Constraint, Relation
from ...kinematics.formulation.styles import NATIVE
from ...program import Plan, Program, Tape, Traced, program
from ...program.executor import Bind
from ..llvm.bytecode import Bytecode, bytecode, repeated
from ..llvm.executor import LlvmExecutor
from ..llvm.jit import LlvmCode
from .fixed_order import LANES
from .numbers_of import coordinates_of, renamed, structure, with_numbers

Indices = NDArray[np.intp]
ROWS, GAMMA, RETRACT = "rows", "gamma", "retract"
AFTER = "after "
"""Before the names of the vectors of a state: after the step."""


class LargeSystem(System):
    """A system in machine code: interpreted, because it takes longer to compile so many operations
    than they ever run. Joints of the library in the native style are elements.

    Attributes:
        tables: of elements; None of other equations.
        stride: slots of a lane, with those of intermediate values.
    """

    tables: Mapping[str, Bytecode] | None

    def ready(self, outputs: Program) -> tuple[Plan, Bind]:
        """See `System`."""
        tracer, tables = self.tracer, None
        if tracer.request.style == NATIVE and is_builtin(tracer.mechanism):
            found, self.after = Elements(tracer.formulation, tracer.layout, LANES), AFTER
            self.rows, self.columns, self.sizes = found.rows, found.columns, {**found.sizes}
            self.geometry = found.geometry[:, None]
            last = bytecode(outputs, len(tracer.layout.slots), LANES)
            tables = {**found.tables, outputs.name: last}
            programs = {name: Program(name, (), {}) for name in found.tables}
            plan = Plan({**programs, outputs.name: outputs}, tracer.layout.slots)
        else:
            plan, _ = super().ready(outputs)
        code = LlvmCode(plan, often=math.inf, tables=tables, width=LANES)
        self.tables, self.stride = tables, code.stride
        return plan, partial(LlvmExecutor, code)


class _Member(NamedTuple):
    """A constraint, the same with names of its own, the numbers of that, and its first row."""

    c: Constraint | Relation
    alone: Constraint | Relation
    numbers: Sequence[Scalar]
    row: int


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


class Elements:
    """The equations of a formulation as elements.

    Args:
        formulation: of joints that take numbers known later: those of the library.
        layout: of the slots; more are added to it.
        width: lanes of a vector.

    Attributes:
        rows, columns: of the entries of the Jacobian.
        tables: of phi, nu and entries; of gamma; of the state after a step.
        sizes: operations and flops of each.
        geometry: values of the vector `GEOMETRY`.
    """

    def __init__(self, formulation: Cartesian, layout: Layout, width: int) -> None:
        self.formulation, self.layout, self._geometry = formulation, layout, list[float]()
        self._rates = layout.vector(RATE, formulation.unknowns)
        self._step = layout.vector("step", formulation.unknowns)
        n = len(formulation.owners)
        self._of_row = {
            name: np.array(layout.vector(name, n), np.intp) for name in ("phi", "nu", "gamma")
        }
        self._at = list[tuple[Indices, Indices]]()
        self._written: dict[str, list[tuple[Program, Indices]]] = {ROWS: [], GAMMA: [], RETRACT: []}
        first, kinds = 0, dict[Hashable, list[_Member]]()
        for c in formulation.constraints:
            # as the only constraint of a mechanism
            names = [f"x{k}" for k in range(len(coordinates_of(c)))]
            sides = {} if isinstance(c, Relation) else {c.i: "i", c.j: "j"}
            moving = {body: side for body, side in sides.items() if body in formulation.columns}
            alone, numbers = renamed(c, "", moving, names), list[Scalar]()
            kinds.setdefault(structure(alone, numbers), []).append(
                _Member(c, alone, numbers, first)
            )
            first += c.n
        for members in kinds.values():
            self._add(members)
        self._retract()
        rows, columns = zip(*self._at, strict=True)
        self.rows, self.columns = np.concatenate(rows), np.concatenate(columns)
        self.geometry = np.array(self._geometry)
        last = np.array(layout.vector(GEOMETRY, len(self.geometry)), np.intp)
        self.tables, self.sizes = dict[str, Bytecode](), dict[str, dict[str, int]]()
        for name, parts in self._written.items():
            size = self.sizes[name] = {"operations": 0, "flops": 0}
            for traced, places in parts:
                places[places < 0] = last[-1 - places[places < 0]]
                for label, each in traced.size.items():
                    size[label] += each * places.shape[1]
            found = [(bytecode(traced, len(places), 1), places) for traced, places in parts]
            self.tables[name] = repeated(found, len(layout.slots), width)

    def _add(self, members: Sequence[_Member]) -> None:
        """Add the constraints of one kind."""
        whole, kind, alone = self.formulation, _Kind(Tape(), []), members[0].alone
        first = np.array([each.row for each in members])
        # numbers that differ become inputs
        every = zip(*(each.numbers for each in members), strict=True)
        lifted = with_numbers(alone, iter([self._number(each, kind) for each in every]))
        sides = [each for each in "ij" if each == getattr(alone, each, "")]
        bodies = [[getattr(each.c, side) for each in members] for side in sides]
        own = Cartesian([lifted], sides, coordinates_of(alone))
        named = [coordinates_of(each.c) for each in members]
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
        self._at += [(first + k, np.array(columns[j], np.intp)) for k, j, _ in matrix]
        values = {name: getattr(own, name)(at) for name in ("phi", "nu")}
        out = [
            (x, self._of_row[name][first + k])
            for name, each in values.items()
            for k, x in enumerate(each)
        ]
        of_entries = places.reshape(len(matrix), m)
        out += [(x, each) for (_, _, x), each in zip(matrix, of_entries, strict=True)]
        self._write(ROWS, kind, out)
        rates = [kind.read([self._rates[j] for j in each]) for each in columns]
        gamma = enumerate(own.gamma(at, rates))
        self._write(GAMMA, kind, [(x, self._of_row["gamma"][first + k]) for k, x in gamma])

    def _retract(self) -> None:
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
            step = [kind.read([self._step[k + at] for at in names.values()]) for k in range(size)]
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
        self._written[name].append((traced, np.array(slots, np.intp)))

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
                self._geometry.append(float(x))
                slots.append(-len(self._geometry))  # its slot comes last
        return kind.read(slots)
