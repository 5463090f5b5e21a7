"""Programs linked into one table (see `bytecode`): many lanes of them, and what is done in between,
gone through in one call.

All numbers stand in one memory of rows, a vector each. What a program reads and writes are rows of
it, for every lane its own: nothing is gathered before and scattered after. A vector holds the same
number of several cases.
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
"""Lanes of which each operation is done before the next: none waits for the one before it."""
MOST = 2**26
"""Rows that words of 32 bits can name, of vectors of eight numbers."""


class Memory:
    """Rows to be given out."""

    def __init__(self) -> None:
        self.count = 0

    def take(self, count: int) -> slice:
        """The next rows, as many as that. Raises MemoryError where a table could not name them."""
        first, self.count = self.count, self.count + count
        if self.count > MOST:
            raise MemoryError(
                f"{self.count} rows of numbers are asked for, a table names {MOST} at most"
            )
        return slice(first, self.count)


class Linker:
    """Makes tables over rows of vectors of so many numbers."""

    def __init__(self, width: int) -> None:
        self._vector = 8 * width

    def operations(self, op: str, *rows: Rows | int) -> Words:
        """One operation, done for each of the rows: those of results and then of operands, one
        after the other.
        """
        every = np.broadcast_arrays(*rows)
        return self.staged(1, (op, np.zeros(len(every[0]), np.intp), every))

    def staged(self, stages: int, *parts: tuple[str, Rows, Sequence[Rows | int]]) -> Words:
        """Operations in so many stages, in each first all of the first part.

        Args:
            parts: an operation, the stages it is done at, and rows as of `operations`.
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
            # of each row how many are before it at its stage
            before = np.arange(len(stage)) - (np.cumsum(count) - count)[stage[order]]
            at = start[stage[order]] + 2 + size * before
            words[at[:, None] + np.arange(size)] = (
                self._vector * np.stack(np.broadcast_arrays(*rows), axis=-1)[order]
            )
        return words

    def lanes(self, program: Program, slots: Rows, memory: Memory) -> Words:
        """A program for many lanes.

        Args:
            slots: where the slots of each lane are, shape (slots, lanes).
            memory: gives the rows in between.
        """
        count, lanes = len(slots), len(slots.T)
        table = bytecode(program, count, 1)  # bytes of a vector of one are as good as any
        abreast = min(ABREAST, lanes)
        # the last group is filled up with the last lane, which gives the same once more
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
            # of a constant the operands are the number itself
            named = 1 if op == "const" else rows.shape[1]
            placed[..., :named] = where[rows[:, :named] // 8].transpose(2, 0, 3, 1)
            placed[..., named:] = rows[:, None, named:]
            placed = placed.reshape(len(groups), -1)
            found += [np.broadcast_to(_head(op, placed.shape[1]), (len(groups), 2)), placed]
            at += 2 + size
        return np.concatenate(found, axis=1).ravel().astype(np.uint32)


def numbers(rows: slice) -> Rows:
    """Return the numbers of rows that were given out."""
    return np.arange(rows.start, rows.stop, dtype=np.intp)


def joined(parts: Iterable[Words]) -> Words:
    """One table of several, one after the other."""
    return np.concatenate([*parts, np.zeros(2, np.uint32)])


_OPS = {kind: op for op, kind in KINDS.items()}


def _head(op: str, size: int) -> Rows:
    """What a stretch of so many numbers begins with."""
    return np.array([KINDS[op], 4 * size])
