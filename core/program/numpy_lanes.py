"""Execution of programs with numpy: one ufunc call per operation, over all lanes at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..trajectory import Array
from .executor_protocol import Table
from .plan import DONE, ITERATIONS, Plan
from .straight_line import Program
from .tape import LEAVES, operands, place_of


def _min(a: Array, b: Array, out: Array) -> None:
    np.minimum(a, b, out=out)  # by keyword: numpy rejects a third positional array


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


def _largest(out: Array, values: Array) -> None:
    np.maximum.reduce(values, axis=0, out=out)


class NumpyLanes:
    """A plan bound to a block of lanes, shape (slots, lanes).

    Attributes:
        heads: lanes without a lane before them.
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
        """Attempt all lanes: predict by `start`, iterate Newton, run the tests."""
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

    def go_back(self, sample: Array) -> None:
        """Restore the lanes to the state they were predicted from, ready for a new prediction.

        Args:
            sample: values of `Plan.sampled` there, shape (sampled, 1).
        """
        source, target = np.array(self.plan.carried).T
        self.block[source], self.block[list(self.plan.sampled)] = self.block[target], sample
        for name in self.plan.onward:
            self.run(name)

    def _before(self, x: Array, first: Array, out: Array) -> None:
        out[..., 1:] = x[..., :-1]
        out[..., self.heads] = first[..., self.heads]

    def _bind(self, program: Program) -> list[Call]:
        """Return the calls of a program; a register is free again after its last reader."""
        times, block, functions = (
            program.times,
            self.block,
            {**_UFUNCS, "before": self._before},
        )
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
            elif op == "where":  # every other operation where rows are chosen; two calls are
                decision, chosen, otherwise = read  # quicker than one of Python around them
                calls += [
                    (np.copyto, (out, otherwise)),
                    (np.putmask, (out, decision, chosen)),
                ]
            else:
                calls.append((functions[op], (*read, out)))
            for x in set(arguments):
                if last[x] == k and x not in kept and program.nodes[x][0] not in LEAVES:
                    free[np.bool_ if program.nodes[x][0] == "larger" else np.float64].append(
                        place[x]
                    )
        # an input that goes to another slot must survive the output that overwrites its own
        for node in kept:
            if program.nodes[node][0] in ("input", "node"):
                copy = np.empty(shape)
                calls.append((np.copyto, (copy, place[node])))
                place[node] = copy
        write = np.copyto if times == 1 else _largest
        return calls + [
            (write, (block[slot], place[node])) for slot, node in program.outputs.items()
        ]
