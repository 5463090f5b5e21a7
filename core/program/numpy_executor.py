"""Run programs with numpy: one ufunc call per operation, over all lanes at once. No start-up cost; the oracle of the tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..trajectory import Array
from .executor import DONE, ITERATIONS, MARGIN, Parts, Plan, Side, Table
from .numpy_track import NumpyTrack
from .straight_line import Program
from .trace import LEAVES, NODES, operands, place_of


def _min(a: Array, b: Array, out: Array) -> None:
    np.minimum(a, b, out=out)  # the output of these two by keyword: numpy wants no third position


def _max(a: Array, b: Array, out: Array) -> None:
    np.maximum(a, b, out=out)


_UFUNCS: dict[str, Callable[..., Any]] = {
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
    "neg": np.negative,
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "abs": np.absolute,
    "min": _min,
    "max": _max,
}

Call = tuple[Callable[..., Any], tuple[Any, ...]]


def _larger(a: Array, b: Array, size_a: Array, size_b: Array, out: Array) -> None:
    np.greater(np.absolute(a, size_a), np.absolute(b, size_b), out=out)


def _where(m: Array, p: Array, q: Array, out: Array) -> None:
    np.copyto(out, q)
    np.copyto(out, p, where=m)


def _largest(out: Array, values: Array) -> None:
    np.maximum.reduce(values, axis=0, out=out)


class NumpyExecutor:
    """A plan bound to a block of lanes, shape (slots, lanes).

    Attributes:
        heads: lanes that have no lane before them.
    """

    margin = 0

    def __init__(self, plan: Plan, lanes: int) -> None:
        self.lanes = self.group = lanes
        self.block: Array = np.zeros((len(plan.slots), lanes))
        self.plan = plan
        self.heads: list[int] = [0]
        self._calls: dict[str, list[Call]] = {}

    def clear(self) -> None:
        """See `Executor`."""
        self.block[:] = 0.0

    def put(self, slots: Sequence[int], values: Array) -> None:
        """See `Executor`."""
        self.block[slots] = values

    def get(self, slots: Sequence[int]) -> Array:
        """See `Executor`."""
        return self.block[slots]

    def window(self, slots: range) -> Array:
        """See `Executor`."""
        return self.block[slots.start : slots.stop]

    def arranged(self, table: Table) -> Table:
        """See `Executor`."""
        return table

    def run(self, name: str) -> None:
        """See `Executor`."""
        if name not in self._calls:
            self._calls[name] = self._bind(self.plan.programs[name])
        with np.errstate(all="ignore"):
            for call, arguments in self._calls[name]:
                call(*arguments)

    def attempt(self) -> None:
        """See `Executor`."""
        self.settle("predict", self.plan.alone)

    def settle(self, start: str, tests: Sequence[str]) -> None:
        """Attempt all lanes: predict, iterate and test by the programs of these names."""
        slots = self.plan.slots
        residual, iterations = (self.block[slots[name]] for name in ("residual", ITERATIONS))
        done = np.zeros(self.lanes, dtype=np.bool_)
        iterations[:] = 0.0
        self.run(start)
        for _ in range(self.plan.most):
            self.run("newton")
            iterations += ~done
            done |= residual < self.plan.tolerance
            if (done | ~np.isfinite(residual)).all():
                break
        for name in self.plan.after:
            self.run(name)
        self.block[slots[DONE]] = done
        for name in tests:
            self.run(name)

    def carry(self) -> None:
        """See `Executor`."""
        source, target = np.array(self.plan.carried).T
        self.block[target] = self.block[source]

    def track(self, sides: Sequence[Side], start: Array, n: int) -> NumpyTrack:
        """See `Executor`."""
        return NumpyTrack(self, sides, start, n)

    @property
    def room(self) -> int:
        """See `Executor`."""
        return self.lanes

    def table(self, columns: int) -> Array:
        """See `Executor`."""
        return np.empty((len(self.plan.kept), columns, self.room))

    def fan(self, samples: Array, out: Array, first: int, step: int) -> None:
        """See `Executor`."""
        plan, block = self.plan, self.block
        kept, remembered = list(plan.kept), list(plan.remembered)
        source, target = np.array(plan.carried_on).T
        past = block[plan.past : plan.past + NODES * len(remembered)].reshape(NODES, -1, self.lanes)
        alive = np.ones(self.lanes, dtype=np.bool_)
        for k, sample in enumerate(samples.T):
            accepted = self._accepted("extend", sample) if k >= NODES else ~alive
            if (alive & ~accepted).any():
                if k >= NODES:
                    self.go_back(samples[:, k - 1, None])
                    self.carry()
                accepted = self._accepted("predict", sample)
            alive &= accepted
            out[:, first + step * k] = np.where(alive, block[kept], np.nan)
            past[k % NODES] = block[remembered]
            if k + 1 < NODES:
                for name in plan.remaining:
                    self.run(name)
                self.carry()
            else:
                block[target] = block[source]

    def _accepted(self, start: str, sample: Array) -> NDArray[np.bool_]:
        self.block[list(self.plan.sampled)] = sample[:, None]
        self.settle(start, self.plan.alone)
        return self.block[self.plan.slots[MARGIN]] > 0.0

    def go_back(self, sample: Array) -> None:
        """Have lanes stand where they are predicted from, and be ready to be; the sample there, shape (sampled, 1)."""
        source, target = np.array(self.plan.carried).T
        self.block[source], self.block[list(self.plan.sampled)] = self.block[target], sample
        for name in self.plan.onward:
            self.run(name)

    def groups(self, lanes: int) -> int:
        """See `Executor`: its programs are bound to all lanes."""
        return 1

    def parts(self, parts: Parts) -> Callable[[int], object]:
        """See `Executor`."""
        plan, block = self.plan, self.block
        largest, smallest = np.split(parts.worst, [len(plan.largest)])

        def call(groups: int) -> None:
            for member, sources in zip(parts.members.tolist(), parts.taken, strict=True):
                block[list(plan.fixed)] = parts.fixed[member, :, None]
                block[list(plan.sampled)] = parts.samples
                block[list(plan.taken)] = parts.world[sources]
                self.attempt()
                row = parts.base + member * len(plan.kept)
                parts.world[row : row + len(plan.kept)] = block[list(plan.kept)]
                np.maximum(largest, block[list(plan.largest)], out=largest)
                np.minimum(smallest, block[list(plan.smallest)], out=smallest)
                for slot, k in plan.left:
                    parts.ahead[member, k] = block[slot, -1]

        return call

    def _before(self, x: Array, first: Array, out: Array) -> None:
        out[..., 1:] = x[..., :-1]
        out[..., self.heads] = first[..., self.heads]

    def _bind(self, program: Program) -> list[Call]:
        """Give every operation a register; a register is free again after its last reader."""
        times, block, functions = program.times, self.block, {**_UFUNCS, "where": _where, "before": self._before}
        shape = self.lanes if times == 1 else (times, self.lanes)
        scratch = np.empty((2, self.lanes)) if times == 1 else np.empty((2, times, self.lanes))
        last = {x: k for k, node in enumerate(program.nodes) for x in operands(node)}
        kept = set(program.outputs.values())
        place: list[Any] = []
        free: dict[type, list[Array]] = {np.float64: [], np.bool_: []}
        calls: list[Call] = []
        for k, (op, *rest) in enumerate(program.nodes):
            if op == "input":
                slot = int(rest[0])
                place.append(block[slot] if times == 1 else block[slot : slot + times])
                continue
            if op == "node":
                _, lane = place_of(int(rest[1]), self.lanes)
                place.append(self.block[int(rest[0]), lane : lane + 1])
                continue
            if op == "const":
                place.append(np.float64(rest[0]))
                continue
            arguments = [int(x) for x in rest]
            kind = np.bool_ if op == "larger" else np.float64
            out = free[kind].pop() if free[kind] else np.empty(shape, kind)
            place.append(out)
            read = [place[x] for x in arguments]
            if op == "larger":
                calls.append((_larger, (*read, *scratch, out)))
            else:
                calls.append((functions[op], (*read, out)))
            for x in set(arguments):
                if last[x] == k and x not in kept and program.nodes[x][0] not in LEAVES:
                    free[np.bool_ if program.nodes[x][0] == "larger" else np.float64].append(place[x])
        for node in kept:  # what stood in a slot and is put out elsewhere must survive the output that overwrites it
            if program.nodes[node][0] in ("input", "node"):
                copy = np.empty(shape)
                calls.append((np.copyto, (copy, place[node])))
                place[node] = copy
        write = np.copyto if times == 1 else _largest
        return calls + [(write, (block[slot], place[node])) for slot, node in program.outputs.items()]
