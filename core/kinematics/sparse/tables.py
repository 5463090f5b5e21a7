"""Operations on several poses of a sparse system, as tables: elements, elimination and steps linked
over one memory.
"""

from __future__ import annotations

import numpy as np

from ...program.linker import Linker, Memory, Words, joined, numbers
from ...program.llvm.compiler import vector_width
from ...program.llvm.jit import interpreter
from ...program.memory import address, aligned
from ...program.static_lu import FixedOrder
from ...trajectory import Array
from ..structure.sparse_lu import Indices, Ordered
from .element_types import HOW, WHERE, ElementType
from .elements import Elements
from .rotation_update import BY, TO, turned


class SparseTables:
    """Numbers of as many poses as a vector has lanes, a row for each, and the operations on them.

    Rows: the state (see `Numbering`) and then the drives, rates, accelerations and a step of the
    unknowns, and the results of all elements with their parts.

    Attributes:
        width: number of poses.
    """

    def __init__(self, elements: Elements, bodies: int) -> None:
        self.width = vector_width()
        self._link, self._interpret = Linker(self.width), interpreter(self.width)
        numbering, given = elements.numbering, Memory()
        self._zero, self._one = (given.take(1).start for _ in range(2))
        sizes = {
            "state": numbering.state,
            "drives": 5 * elements.drivers,
            "results": len(elements.results),
        }
        sizes |= dict.fromkeys(("rates", "accelerations", "step"), numbering.unknowns)
        self._rows = {name: given.take(size) for name, size in sizes.items()}
        results = self._rows["results"].start
        self._rows |= {
            name: slice(results + part.start, results + part.stop)
            for name, part in elements.parts.items()
        }
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

    def _slots(self, kind: ElementType, outputs: dict[str, Indices], geometry: slice) -> Indices:
        """Rows of the slots of each constraint of a kind."""
        found = np.zeros((len(kind.plan.slots), kind.lanes), np.intp)
        # the drives come next
        found[kind.inputs[WHERE]] = self._rows["state"].start + kind.read[WHERE]
        found[kind.inputs[HOW]] = self._rows["rates"].start + kind.read[HOW]
        end = kind.geometry_at + len(kind.geometry)
        found[kind.geometry_at : end] = numbers(geometry).reshape(-1, kind.lanes)
        for name, places in outputs.items():
            found[kind.outputs[name]] = self._rows["results"].start + places
        return found

    def _moves(self, n: int, given: Memory) -> list[Words]:
        """The state by the step: see `SparseModel.moved`."""
        state, step, new = self._at("state"), self._at("step"), numbers(given.take(4 * n))
        q, pi = state[3 * n : 7 * n], step[3 * n : 6 * n]
        slots = np.zeros((TO.stop, n), np.intp)
        slots[BY], slots[TO] = np.concatenate([q, pi]).reshape(-1, n), new.reshape(-1, n)
        added, by = (
            np.append(state[: 3 * n], state[7 * n :]),
            np.append(step[: 3 * n], step[6 * n :]),
        )
        return [
            self._link.lanes(turned(), slots, given),
            self._link.operations("copy", q, new),
            self._link.operations("+", added, added, by),
        ]

    def order(self, order: Ordered, entries: Indices, rows: Indices) -> None:
        """Eliminate in this order.

        Args:
            entries, rows: of the matrix in this order, their places among those of all constraints.
        """
        given, link = Memory(), self._link
        given.take(self._base)
        fixed = FixedOrder(order.rows.tolist(), order.columns.tolist(), len(rows))
        factors, inverse, right, self._sums = (
            given.take(size) for size in (fixed.count, *[len(rows)] * 3)
        )
        self._factor = joined(
            fixed.factor(
                link, self._at("entries")[entries], factors, inverse, (self._zero, self._one)
            )
        )
        solve, into = fixed.solve(link, factors, inverse, right), numbers(right)

        def solved(quantity: str, op: str, found: str) -> Words:
            taken = link.operations("copy", into, self._at(quantity)[rows])
            return joined([taken, *solve, link.operations(op, self._at(found), into[order.column])])

        self._newton, self._velocity = solved("phi", "neg", "step"), solved("nu", "copy", "rates")
        self._acceleration = solved("gamma", "copy", "accelerations")
        self._place, step, sums = order.row, self._at("step"), numbers(self._sums)
        there, back = (
            fixed.solve(link, factors, inverse, right, transposed=True),
            fixed.solve(link, factors, inverse, right),
        )
        self._transposed = joined(
            [
                link.operations("copy", into[order.column], step),
                *there,
                link.operations("copy", sums, into),
            ]
        )
        self._solved = joined(
            [
                link.operations("copy", into, sums),
                *back,
                link.operations("copy", step, into[order.column]),
            ]
        )
        self._pivots: Indices = factors.start + fixed.pivots
        self._multipliers: Indices = factors.start + fixed.multipliers
        memory = aligned(given.count * self.width).reshape(-1, self.width)
        memory[: self._base] = self._memory[: self._base]
        self._memory = memory

    def _at(self, name: str) -> Indices:
        return numbers(self._rows[name])

    def __getitem__(self, name: str) -> Array:
        """Numbers of all poses, shape (numbers, width), for reading and writing: of the state and
        all other rows.
        """
        return self._memory[self._rows[name]]

    @property
    def pivots(self) -> Array:
        """Of the factors, in their order."""
        found: Array = self._memory.take(self._pivots, axis=0)
        return found

    @property
    def growth(self) -> Array:
        """The largest entry of L, shape (width,), growth of rounding errors; NaN if any is."""
        found: Array = self._memory.take(self._multipliers, axis=0)
        return np.abs(found).max(axis=0, initial=0.0)

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
        """Take the Newton step for phi, by the present factors."""
        self._go(self._newton)
        self._go(self._move)

    def motion(self) -> None:
        """Compute rates and accelerations at the last evaluated pose."""
        for table in (self._factor, self._velocity, self._how, self._acceleration):
            self._go(table)

    def solve(self, b: Array) -> Array:
        """Solve by the present factors for all poses: shape (n, width), in the order of the solved
        rows.
        """
        self._memory[self._sums][self._place] = b
        self._go(self._solved)
        return self["step"].copy()

    def solve_transposed(self, b: Array) -> Array:
        """Likewise with the matrices transposed."""
        self["step"][:] = b
        self._go(self._transposed)
        found: Array = self._memory[self._sums][self._place]
        return found

    def _go(self, table: Words) -> None:
        self._interpret(address(self._memory), address(table))
