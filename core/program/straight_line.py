"""Straight-line programs: the operations of a tape that the outputs need, in executable order."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ..algebra import Scalar
from .tape import LEAVES, Node, Tape, operands

FLOPS = frozenset(
    {
        *("+", "-", "*", "/", "neg", "sqrt", "sin", "cos", "atan2"),
        *("abs", "min", "max", "larger", "where"),
    }
)


@dataclass(frozen=True)
class Program:
    """Operations in executable order, and the slots of the results.

    Attributes:
        nodes: the live operations only; operands are positions in this tuple.
        outputs: slot -> position of its node. Outputs are written after the last input is read.
        times: number of repetitions. Each repetition reads every input one slot further, and each
            output is the largest of its values. These outputs are not negative; NaN counts as
            larger than any number.
    """

    name: str
    nodes: tuple[Node, ...]
    outputs: Mapping[int, int]
    times: int = 1

    @property
    def operations(self) -> Counter[str]:
        """Number of occurrences of each operation."""
        found = Counter(
            {
                op: self.times * count
                for op, count in Counter(node[0] for node in self.nodes).items()
            }
        )
        return found + Counter({"max": len(self.outputs) * (self.times - 1)})

    @cached_property
    def flops(self) -> int:
        """Arithmetic operations of one lane: all but reads of inputs and constants."""
        return sum(count for op, count in self.operations.items() if op in FLOPS)

    @property
    def size(self) -> dict[str, int]:
        """Operations of one lane (with inputs and constants), and its flops."""
        return {"operations": len(self.nodes), "flops": self.flops}

    def run(
        self,
        operations: Mapping[str, Callable[..., Any]],
        inputs: Any,
        lift: Callable[[float], Any],
    ) -> dict[int, Any]:
        """Return the outputs by slot, over any kind of scalar, from its inputs by slot.

        Args:
            operations: the operations of the kind.
            lift: conversion of constants to the kind.
        """
        values: list[Any] = []
        for op, *rest in self.nodes:
            if op == "input":
                values.append(inputs[int(rest[0])])
            elif op == "const":
                values.append(lift(rest[0]))
            elif len(rest) == 2:  # most operations; a call with any number takes twice as long
                values.append(operations[op](values[int(rest[0])], values[int(rest[1])]))
            else:
                values.append(operations[op](*(values[int(k)] for k in rest)))
        return {slot: values[k] for slot, k in self.outputs.items()}


def program(
    name: str,
    tape: Tape,
    outputs: Mapping[int, Scalar],
    prepared: Prepared | None = None,
    times: int = 1,
) -> Program:
    """Return the program of some outputs (slot -> scalar); prepared terms are read from their
    slots.
    """
    wanted = {slot: tape.number(value) for slot, value in outputs.items()}
    live: dict[int, Node] = {}
    waiting = list(wanted.values())
    while waiting:
        number = waiting.pop()
        if number not in live:
            live[number] = node = tape.nodes[number] if prepared is None else prepared.node(number)
            waiting += operands(node)
    order = sorted(live)
    position = dict(zip(order, range(len(order)), strict=True))
    nodes = tuple(
        node if node[0] in LEAVES else (node[0], *[position[x] for x in operands(node)])
        for node in map(live.__getitem__, order)
    )
    return Program(name, nodes, {slot: position[number] for slot, number in wanted.items()}, times)


class Prepared:
    """Terms of some slots alone (the geometry), computed once by a separate program and stored.

    Args:
        given: the slots the terms may depend on.
        slot: return a new slot for a name.
    """

    def __init__(self, tape: Tape, given: Collection[int], slot: Callable[[str], int]) -> None:
        self.tape, self._given, self._slot = tape, given, slot
        self._fixed: list[bool] = []
        self._kept: dict[int, int] = {}

    def node(self, number: int) -> Node:
        """Return the node; for a prepared term, the input of its slot."""
        node = self.tape.nodes[number]
        # a decision is not a number and has no slot: it is computed again from prepared terms
        if (
            not self._given
            or node[0] in LEAVES
            or node[0] == "larger"
            or not self._is_fixed(number)
        ):
            return node
        if number not in self._kept:
            self._kept[number] = self._slot(f"prepared {len(self._kept)}")
        return ("input", self._kept[number])

    @property
    def slots(self) -> list[int]:
        """The slots of the prepared terms."""
        return [*self._kept.values()]

    def program(self) -> Program:
        """Return the program of all prepared terms that programs have read so far."""
        return program(
            "prepare",
            self.tape,
            {slot: self.tape.scalars[number] for number, slot in self._kept.items()},
        )

    def _is_fixed(self, number: int) -> bool:
        for node in self.tape.nodes[len(self._fixed) :]:
            if node[0] == "input":
                self._fixed.append(node[1] in self._given)
            else:
                self._fixed.append(
                    node[0] != "node" and all(self._fixed[x] for x in operands(node))
                )
        return self._fixed[number]
