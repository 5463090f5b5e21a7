"""Large sparse matrices and their blocks: factors by SuperLU, or of several matrices at once in an
order of SuperLU's.

The columns are in COLAMD's order. Times for a ring of N spatial loops, without any decomposition,
and a chain (least of 15, one Zen 4 core, N = 1,000, ring and chain): COLAMD 2.4 and 1.7 ms, minimum
degree of A^T A 3.0 and 1.6, reverse Cuthill-McKee of the bodies 2.9 and 1.5. Minimum degree of
A + A^T is unsuitable for these matrices, whose diagonals have no meaning: it took 1.6 s.

The rows of several matrices are in the order that SuperLU chose for one of them. Those whose
multipliers grow by it are factored one by one; if they become many, their order takes its place.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...caches import cache_last
from ...kinematics.compiled.dense_equations import System
from ...kinematics.structure.degrees_of_freedom import NARROW, Indices
from ...trajectory import Array
from ..llvm.machine_code import works
from .fixed_order import LANES, FixedOrder, load_loops

GROWTH = 50.0
"""Largest entry of L that is believed in an order made for another matrix: SuperLU's are one at
most. Twice as much lost more digits of the rates than the conditions of the library explain.
"""
STRAYED = 32
"""Matrices factored one by one until a new order is made, which takes about as long."""


class SingularError(ArithmeticError):
    """The matrix cannot be factored."""


@dataclass(frozen=True, eq=False)
class Order:
    """SuperLU's order: the place of each row and column, and the sign of its exchanges of rows."""

    rows: Indices
    columns: Indices
    sign: float
    factors: FixedOrder

    def solve(self, b: Array, *, transposed: bool) -> Array:
        """Return solutions by the last factors, see `FixedOrder.solve`."""
        first, last = self._sides(transposed=transposed)
        ordered = np.empty_like(b)
        ordered[first] = b
        return self.factors.solve(ordered, transposed=transposed).take(last, axis=0)

    def solving(self, given: Indices, found: Indices, *, transposed: bool) -> list[NDArray[Any]]:
        """Return the table to solve in slots, see `FixedOrder.solving`."""
        first, last = map(np.argsort, self._sides(transposed=transposed))
        return self.factors.solving(given[first], found[last], transposed=transposed)

    def _sides(self, *, transposed: bool) -> tuple[Indices, Indices]:
        return (self.columns, self.rows) if transposed else (self.rows, self.columns)

    @property
    def signs(self) -> Array:
        """The signs of the determinants, see `Factors.sign`."""
        return np.where(self.factors.odd, -self.sign, self.sign)


class Pattern:
    """A square pattern of entries.

    Args:
        at: places of the entries among the values of a matrix, which may have others too.
        values: of one matrix; several ones are factored in its order at first, if that can be by
            machine code. None if each is factored alone.

    Attributes:
        order: the order in which several are factored.
    """

    order: Order | None

    def __init__(
        self, rows: Indices, columns: Indices, n: int, at: Indices, values: Array | None
    ) -> None:
        sparse: Any = importlib.import_module("scipy.sparse")
        self._splu: Any = importlib.import_module("scipy.sparse.linalg").splu
        self._matrix = sparse.csc_matrix(
            (np.arange(len(rows)) + 0.0, (rows, columns)), shape=(n, n)
        )
        self.at, self._entries = at, at[self._matrix.data.astype(np.intp)]
        self._places, self._orders = (rows, columns, n), list[Order]()
        if values is not None and works(load_loops):
            self._reorder(self._factor_or_none(values))
        self.begin()

    def begin(self) -> None:
        """Return to the first order: the same matrices have the same factors again."""
        self.order, self._strayed = self._orders[0] if self._orders else None, 0

    def factor(self, values: Array) -> Factors:
        """Return the factors of a matrix.

        Raises:
            SingularError: the matrix is singular, or digits are lost in the elimination.
        """
        self._matrix.data[:] = values[self._entries]
        try:
            return Factors(self._splu(self._matrix, permc_spec="COLAMD", **NARROW))
        except RuntimeError as error:
            # the second message means a loss of digits in the elimination
            if any(said in str(error) for said in ("singular", "failed to factorize")):
                raise SingularError("exactly singular") from error
            raise

    def factor_lanes(self, values: Array, lanes: Indices) -> FactorsOfLanes:
        """Return the factors of some of several matrices, of values of shape (values, m). They are
        good until the next ones of this pattern.
        """
        order = self.order if values.shape[1] == LANES else None
        if order is not None:
            order.factors.factor(values)
            good = (order.factors.growth <= GROWTH) & (order.factors.inverse < np.inf)
            lanes = lanes[~good[lanes]]
            self._strayed += len(lanes)
        alone = {k: self._factor_or_none(values[:, k]) for k in lanes.tolist()}
        if self._strayed > STRAYED:
            self._reorder(next((each for each in alone.values() if each), None))
        return FactorsOfLanes(order, alone)

    def _factor_or_none(self, values: Array) -> Factors | None:
        try:
            return self.factor(values)
        except SingularError:
            return None

    def _reorder(self, factors: Factors | None) -> None:
        if factors is None:
            return
        self._strayed, (row, column) = 0, factors.order
        for order in self._orders:
            if (order.rows == row).all():
                self.order = order
                return
        rows, columns, n = self._places
        sign = -1.0 if _exchanges(row.tobytes()) % 2 else 1.0
        self.order = Order(row, column, sign, FixedOrder(row[rows], column[columns], n, self.at))
        self._orders.append(self.order)


class Factors:
    """The factors of a square matrix, as SuperLU has them."""

    def __init__(self, factors: Any) -> None:
        self._factors = factors

    @property
    def entries(self) -> int:
        """The number of entries of both factors together."""
        return self._factors.nnz

    @property
    def order(self) -> tuple[Indices, Indices]:
        """The place of each row and column in the elimination."""
        return self._factors.perm_r.astype(np.intp), self._factors.perm_c.astype(np.intp)

    def solve(self, b: Array, *, transposed: bool = False) -> Array:
        """Solve for a right-hand side, with the matrix or the transposed one."""
        return self._factors.solve(b, "T" if transposed else "N")

    @property
    def sign(self) -> float:
        """The sign of the determinant, or for all values of a pattern the opposite: its columns are
        always in the same order.
        """
        odd = np.count_nonzero(self._factors.U.diagonal() < 0.0)
        odd += _exchanges(self.order[0].tobytes())
        return -1.0 if odd % 2 else 1.0


class FactorsOfLanes:
    """The factors of several matrices: together, and of some alone, None where one is singular."""

    def __init__(self, together: Order | None, alone: Mapping[int, Factors | None]) -> None:
        self._together, self._alone = together, alone

    def regular(self, lanes: Indices) -> Indices:
        """Return which of the lanes that were asked for have factors."""
        return np.array([k for k in lanes.tolist() if self._alone.get(k, self)], np.intp)

    def solve(self, b: Array, *, transposed: bool = False) -> Array:
        """Return solutions, of the matrices or of the transposed ones, NaN without factors, shape
        (n, lanes).
        """
        found = (
            np.full_like(b, np.nan)
            if self._together is None
            else self._together.solve(b, transposed=transposed)
        )
        for k, each in self._alone.items():
            found[:, k] = each.solve(b[:, k], transposed=transposed) if each else np.nan
        return found

    def signs(self, count: int) -> Array:
        """Return the sign of each determinant, see `Factors.sign`; NaN without factors."""
        found = np.full(count, np.nan) if self._together is None else self._together.signs
        for k, each in self._alone.items():
            found[k] = each.sign if each else np.nan
        return found


class Blocks:
    """The blocks of a pattern to be solved one after the other.

    Args:
        at, values: see `Pattern`.

    Attributes:
        count: number of blocks.
        of_rows, of_columns: the block of each row and column.
        pattern: of the entries inside them.
        start: of inverse iteration, shape (n, 1).
    """

    def __init__(
        self, rows: Indices, columns: Indices, n: int, at: Indices, values: Array | None
    ) -> None:
        sparse, graphs = (
            importlib.import_module(name) for name in ("scipy.sparse", "scipy.sparse.csgraph")
        )
        pattern = sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=(n, n))
        row_of: Indices = graphs.maximum_bipartite_matching(pattern, perm_type="row")
        needs = sparse.csr_array((np.ones(len(rows)), (rows, row_of[columns])), shape=(n, n))
        self.count, of_rows = graphs.connected_components(needs, directed=True, connection="strong")
        of_columns: Indices = of_rows[row_of]
        inside = of_rows[rows] == of_columns[columns]
        self.pattern = Pattern(rows[inside], columns[inside], n, at[inside], values)
        self.of_rows, self.of_columns = of_rows, of_columns
        self.start = np.random.default_rng(0).normal(size=(n, 1))
        self._sum_rows, self._sum_columns = (
            sparse.csr_array((np.ones(n), (of, np.arange(n)))) for of in (of_rows, of_columns)
        )

    def sigmas(self, values: Array, lanes: Indices) -> tuple[Array, Array]:
        """Return an estimate of the smallest singular value of each block, shape (blocks, m), and
        the sign of the determinant, shape (m,), of some of several matrices, of values of shape
        (values, m); NaN of singular ones and of others.

        The estimate is by a step of inverse iteration: of one row exact, else never smaller, and
        closer the more singular a block is.
        """
        factors, m = self.pattern.factor_lanes(values, lanes), values.shape[1]
        left = factors.solve(np.repeat(self.start, m, axis=1), transposed=True)
        right = factors.solve(left)
        squares = self._sum_rows @ left**2, self._sum_columns @ right**2
        return np.sqrt(np.divide(*squares)), factors.signs(m)


class Rows:
    """A choice of the rows to solve.

    Args:
        kept: the solved ones.
        entries: of all rows at one pose; several lanes are factored in the order of that pose.

    Attributes:
        dropped: redundant rows.
        pattern, blocks: of the solved ones.
    """

    def __init__(self, kept: Indices, system: System, entries: Array, *, compiled: bool) -> None:
        count = len(system.tracer.formulation.owners)
        place = np.full(count, -1, np.intp)
        place[kept] = np.arange(len(kept))
        solved = np.flatnonzero(place[system.rows] >= 0)
        square = place[system.rows[solved]], system.columns[solved], len(kept), solved
        values = entries if compiled else None
        self.kept, self.dropped = kept, np.setdiff1d(np.arange(count), kept)
        self.pattern, self.blocks = Pattern(*square, values), Blocks(*square, values)

    def begin(self) -> None:
        """Forget the orders of before."""
        self.pattern.begin()
        self.blocks.pattern.begin()


@cache_last(64)
def _exchanges(content: bytes) -> int:
    """Return the number of exchanges that a permutation takes: its length less its cycles.

    Neighbouring poses mostly have the same.
    """
    permutation = np.frombuffer(content, np.intp)
    n = len(permutation)
    sparse, graphs = (
        importlib.import_module(name) for name in ("scipy.sparse", "scipy.sparse.csgraph")
    )
    graph = sparse.csr_matrix((np.ones(n), permutation, np.arange(n + 1)), shape=(n, n))
    return n - int(graphs.connected_components(graph, directed=False, return_labels=False))
