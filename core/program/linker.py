"""Programs linked into one table (see `bytecode`): many lanes and the operations between them, in
one interpreter call.

One memory of rows, a vector each, holds all numbers. The inputs and outputs of a program are rows
of it, for each lane its own, so there is no gather before and no scatter after. A vector holds the
same number of several variants or samples.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from .bytecode import ARITY, KINDS, bytecode
from .straight_line import Program

Rows = NDArray[np.intp]
Words = NDArray[np.uint32]
ABREAST = 8
"""Lanes interleaved operation by operation, so no operation waits for the previous one."""
MOST = 2**26
"""Rows that 32-bit offsets can address, of vectors of eight numbers."""


class Memory:
    """Allocator of rows."""

    def __init__(self) -> None:
        self.count = 0

    def take(self, count: int) -> slice:
        """Return the next `count` rows. Raise MemoryError if a table could not address them."""
        first, self.count = self.count, self.count + count
        if self.count > MOST:
            raise MemoryError(
                f"{self.count} rows of numbers are asked for, a table names {MOST} at most"
            )
        return slice(first, self.count)


class Linker:
    """Writer of tables over rows of vectors of a given width."""

    def __init__(self, width: int) -> None:
        self._vector = 8 * width

    def operations(self, op: str, *rows: Rows | int) -> Words:
        """Return one operation on several rows: the rows of results first, then those of each
        operand.
        """
        every = np.broadcast_arrays(*rows)
        return self.staged(1, (op, np.zeros(len(every[0]), np.intp), every))

    def staged(self, stages: int, *parts: tuple[str, Rows, Sequence[Rows | int]]) -> Words:
        """Return operations in stages; within a stage the parts run in order.

        Args:
            parts: an operation, the stage of each row, and the rows as in `operations`.
        """
        counts = [np.bincount(stage, minlength=stages) for _, stage, _ in parts]
        takes = [
            np.where(count > 0, 2 + count * (1 + ARITY[op]), 0)
            for count, (op, *_) in zip(counts, parts, strict=True)
        ]
        sizes = np.stack(takes, axis=1)
        starts = (np.cumsum(sizes) - sizes.ravel()).reshape(sizes.shape)
        words = np.empty(sizes.sum(), np.uint32)
        for count, start, (op, stage, rows) in zip(counts, starts.T, parts, strict=True):
            some, size, order = (
                np.flatnonzero(count),
                1 + ARITY[op],
                np.argsort(stage, kind="stable"),
            )
            words[start[some]], words[start[some] + 1] = KINDS[op], 4 * size * count[some]
            # position of each row within its stage
            before = np.arange(len(stage)) - (np.cumsum(count) - count)[stage[order]]
            at = start[stage[order]] + 2 + size * before
            words[at[:, None] + np.arange(size)] = (
                self._vector * np.stack(np.broadcast_arrays(*rows), axis=-1)[order]
            )
        return words

    def lanes(self, program: Program, slots: Rows, memory: Memory) -> Words:
        """Return a program for many lanes.

        Args:
            slots: rows of the slots of each lane, shape (slots, lanes).
            memory: allocates the rows of intermediate values.
        """
        count, lanes = len(slots), len(slots.T)
        table = bytecode(program, count, 1)  # any width will do: offsets are scaled below
        abreast = min(ABREAST, lanes)
        # the last group repeats the last lane, which gives the same result again
        groups = np.minimum(np.arange(-(-lanes // abreast) * abreast), lanes - 1).reshape(
            -1, abreast
        )
        cells = memory.take(table.cells * abreast).start + np.arange(table.cells * abreast).reshape(
            -1, 1, abreast
        )
        where = self._vector * np.concatenate(
            [slots[:, groups], np.broadcast_to(cells, (table.cells, *groups.shape))]
        )
        found: list[Rows] = []
        words: Rows = table.words.astype(np.intp)
        at = 0
        while words[at]:
            op, size = _OPS[int(words[at])], int(words[at + 1]) // 4
            rows = words[at + 2 : at + 2 + size].reshape(-1, 1 + ARITY[op])
            placed = np.empty((len(groups), len(rows), abreast, rows.shape[1]), np.intp)
            # the operands of a constant are its value
            named = 1 if op == "const" else rows.shape[1]
            placed[..., :named] = where[rows[:, :named] // 8].transpose(2, 0, 3, 1)
            placed[..., named:] = rows[:, None, named:]
            placed = placed.reshape(len(groups), -1)
            found += [np.broadcast_to(_head(op, placed.shape[1]), (len(groups), 2)), placed]
            at += 2 + size
        return np.concatenate(found, axis=1).ravel().astype(np.uint32)


def numbers(rows: slice) -> Rows:
    """Return the numbers of allocated rows."""
    return np.arange(rows.start, rows.stop, dtype=np.intp)


def joined(parts: Iterable[Words]) -> Words:
    """Return several tables as one, in order."""
    return np.concatenate([*parts, np.zeros(2, np.uint32)])


_OPS = {kind: op for op, kind in KINDS.items()}


def _head(op: str, size: int) -> Rows:
    """Return the head of a stretch with this many words."""
    return np.array([KINDS[op], 4 * size])
