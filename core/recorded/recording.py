"""Recordings: columns of numbers over samples in a file of another program."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from ..case.curves import Printed
from ..case.io.document import decimal, fault, shown
from ..trajectory import Array


@dataclass(frozen=True)
class Head:
    """The head of a column.

    Attributes:
        unit: as the file writes it; empty without one.
        part: names of the body whose pose the column is of; empty if the format does not say.
    """

    name: str
    unit: str = ""
    part: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Column:
    """Numbers in the unit of the file, NaN for gaps, and half a unit of the last digit of each."""

    head: Head
    values: Array
    half: Array


Choose: TypeAlias = Callable[[Sequence[Head]], Sequence[int]]
"""Choice of the columns to read, by their heads."""


@dataclass(frozen=True, eq=False)
class Recording:
    """The chosen columns of a file.

    Attributes:
        program: its writer, by the file.
        angle: unit of angles whose column has none, if the file has it.
        notes: for the user, on the reading.
        kinematic: whether it is a kinematic analysis of Adams, of driven freedoms alone.
    """

    file: Path
    columns: Mapping[int, Column]
    program: str = ""
    angle: str = ""
    notes: Sequence[str] = ()
    kinematic: bool = False


def column_of(file: Path, where: str, head: Head, cells: Iterable[str]) -> Column:
    """Return a column of printed numbers, gaps among them.

    Raises:
        CaseError: a cell is no number.
    """
    printed, values = Printed(), list[float]()
    for k, cell in enumerate(cells):
        try:
            values.append(decimal(cell))
        except ValueError:
            expected = "expected a number; correct it"
            raise fault(file, f"{where} {k}", f"found {shown(cell)}, {expected}") from None
        printed.add(cell)
    found = np.array(values)
    return Column(head, np.where(np.isfinite(found), found, np.nan), printed.half(found))
