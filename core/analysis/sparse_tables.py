"""All that is done for several poses of a sparse system, as tables: elements, elimination and steps linked over one memory."""

from __future__ import annotations

import numpy as np

from ..program.compiler import vector_width
from ..program.fixed_order import FixedOrder
from ..program.linked import Linker, Memory, Words, joined, numbers
from ..program.machine_code import walker
from ..program.memory import address, aligned
from ..trajectory import Array
from .elements import Elements
from .factors import Indices, Ordered
from .kinds import HOW, WHERE, Kind
from .turning import BY, TO, turned


class SparseTables:
    """Numbers of as many poses as a vector has lanes, a row for each, and what is done with them.

    Attributes:
        width: how many poses.
    """

    def __init__(self, elements: Elements, bodies: int) -> None:
        self.width = vector_width()
        self._elements, self._link, self._walk = elements, Linker(self.width), walker(self.width)
        numbering, given = elements.numbering, Memory()
        self._zero, self._one = (given.take(1).start for _ in range(2))
        self._state, self._drives = given.take(numbering.state), given.take(5 * elements.drivers)
        self._rates, self._accelerations, self._step = (given.take(numbering.unknowns) for _ in range(3))
        self._results = given.take(len(elements.results))
        geometry: list[tuple[slice, Array]] = []
        programs: dict[str, list[Words]] = {WHERE: [], HOW: []}
        for kind, starts in zip(elements.kinds, elements.starts, strict=True):
            rows = given.take(len(kind.geometry) * kind.lanes)
            if kind.geometry:
                geometry.append((rows, np.concatenate(kind.geometry)))
            slots = self._slots(kind, kind.places(starts), rows)
            for name, each in kind.plan.programs.items():
                programs[name].append(self._link.lanes(each, slots, given))
        self._where, self._how = (joined(each) for each in programs.values())
        self._move = joined(self._moves(bodies, given))
        self._base = given.count
        self._memory = np.zeros((given.count, self.width))
        self._memory[self._one] = 1.0
        for rows, found in geometry:
            self._memory[rows] = found[:, None]

    def _slots(self, kind: Kind, outputs: dict[str, Indices], geometry: slice) -> Indices:
        """Rows of the slots of each constraint of a kind."""
        found = np.zeros((len(kind.plan.slots), kind.lanes), np.intp)
        found[kind.inputs[WHERE]] = self._state.start + kind.read[WHERE]
        found[kind.inputs[HOW]] = self._rates.start + kind.read[HOW]
        end = kind.geometry_at + len(kind.geometry)
        found[kind.geometry_at : end] = numbers(geometry).reshape(-1, kind.lanes)
        for name, places in outputs.items():
            found[kind.outputs[name]] = self._results.start + places
        return found

    def _moves(self, n: int, given: Memory) -> list[Words]:
        """The state by the step: see `stand.moved`."""
        state, step, free = self._state.start, self._step.start, given.take(4 * n).start
        q, pi, new = state + 3 * n + np.arange(4 * n), step + 3 * n + np.arange(3 * n), free + np.arange(4 * n)
        slots = np.zeros((TO.stop, n), np.intp)
        slots[BY], slots[TO] = np.concatenate([q, pi]).reshape(-1, n), new.reshape(-1, n)
        count = self._elements.numbering.unknowns - 6 * n
        added = np.concatenate([np.arange(3 * n), 7 * n + np.arange(count)])
        by = np.concatenate([np.arange(3 * n), 6 * n + np.arange(count)])
        return [
            self._link.lanes(turned(), slots, given),
            self._link.operations("copy", q, new),
            self._link.operations("+", state + added, state + added, step + by),
        ]

    def order(self, order: Ordered, entries: Indices, rows: Indices) -> None:
        """Eliminate in this order.

        Args:
            entries, rows: of the matrix in that order, their places among those of all constraints.
        """
        given, link, parts = Memory(), self._link, self._elements.parts
        given.take(self._base)
        fixed = FixedOrder(order.rows.tolist(), order.columns.tolist(), len(rows))
        factors, inverse, right = given.take(fixed.count), given.take(len(rows)), given.take(len(rows))
        matrix = self._results.start + parts["entries"].start + entries
        self._factor = joined(fixed.factor(link, matrix, factors, inverse, (self._zero, self._one)))
        solve, into = fixed.solve(link, factors, inverse, right), numbers(right)

        def solved(quantity: str, op: str, found: slice) -> Words:
            given = self._results.start + parts[quantity].start + rows
            put = link.operations(op, numbers(found), into[order.column])
            return joined([link.operations("copy", into, given), *solve, put])

        self._newton, self._velocity = solved("phi", "neg", self._step), solved("nu", "copy", self._rates)
        self._acceleration = solved("gamma", "copy", self._accelerations)
        self._pivots, self._multipliers = factors.start + fixed.pivots, factors.start + fixed.multipliers
        memory = aligned(given.count * self.width).reshape(-1, self.width)
        memory[: self._base] = self._memory[: self._base]
        self._memory = memory

    @property
    def state(self) -> Array:
        """See `Numbering`; as all that follows, shape (numbers, width), and to be written."""
        return self._memory[self._state]

    @property
    def drives(self) -> Array:
        """As of `Elements.evaluate`."""
        return self._memory[self._drives]

    @property
    def step(self) -> Array:
        """Of the unknowns."""
        return self._memory[self._step]

    @property
    def rates(self) -> Array:
        """Of the unknowns."""
        return self._memory[self._rates]

    @property
    def accelerations(self) -> Array:
        """Of the unknowns."""
        return self._memory[self._accelerations]

    @property
    def results(self) -> Array:
        """Of `Elements`, constants and all."""
        return self._memory[self._results]

    def part(self, quantity: str) -> Array:
        """One of the quantities."""
        return self.results[self._elements.parts[quantity]]

    @property
    def pivots(self) -> Array:
        """Of the factors, in their order."""
        return self._memory[self._pivots]

    @property
    def growth(self) -> Array:
        """The largest entry of L, shape (width,): by how much rounding errors may grow; NaN where there is one."""
        return np.abs(self._memory[self._multipliers]).max(axis=0, initial=0.0)

    def move(self) -> None:
        """Take the step from the state."""
        self._go(self._move)

    def evaluate(self) -> None:
        """Phi, nu, branch and entries of the state."""
        self._go(self._where)

    def factor(self) -> None:
        """Factor the matrices of the entries."""
        self._go(self._factor)

    def newton(self) -> None:
        """Take the step that phi asks for, by the factors as they are."""
        self._go(self._newton)
        self._go(self._move)

    def motion(self) -> None:
        """Rates and accelerations where all was last evaluated."""
        for table in (self._factor, self._velocity, self._how, self._acceleration):
            self._go(table)

    def _go(self, table: Words) -> None:
        self._walk(address(self._memory), address(table))
