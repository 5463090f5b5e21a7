"""Columns of a reference: which holds the driver values, which hold outputs, and their units.

A head is the name of an output, or `OUTPUT.velocity` or `OUTPUT.acceleration`, with or without a
unit: `toe [deg]`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from ...errors import remedy
from ..case import Quantity
from ..units import Unit, si_of
from .column_units import required_unit, unit_of_head
from .document import fault, shown
from .reference_samples import Samples

DERIVATIVES = (".velocity", ".acceleration")

Convert: TypeAlias = Callable[[float], float]
"""Conversion from the unit of a file to SI."""


@dataclass(frozen=True)
class Column:
    """A column of a reference.

    Attributes:
        place: its index.
        unit: its unit in the file, in words.
        convert: conversion of its numbers to SI.
    """

    place: int
    unit: str
    convert: Convert


@dataclass(frozen=True)
class Columns:
    """The columns of a reference.

    Attributes:
        driver: the unit of the driver values, in the first column.
        name: name of the first column.
        of: columns by OUTPUT, OUTPUT.velocity and OUTPUT.acceleration.
    """

    driver: Unit
    name: str
    of: Mapping[str, Column]


def known_columns(outputs: Iterable[Quantity]) -> dict[str, str]:
    """Return the SI unit of each possible column of outputs, by name."""
    return {
        output.name + ending: output.unit + time
        for output in outputs
        for ending, time in zip(("", *DERIVATIVES), ("", "/s", "/s^2"), strict=True)
    }


def driver_unit(samples: Samples, default: Unit) -> tuple[str, Unit]:
    """Return the name of the first column, and the unit of the driver values in it.

    Args:
        default: unit without one in the head.

    Raises:
        CaseError: the unit is unknown, or of something else.
    """
    text = samples.columns[0]
    name, unit = unit_of_head(samples.file, samples.header, text)
    if not unit:
        return text, default
    found = required_unit(samples.file, samples.header, text, unit, si_of(default))
    return name, Unit(found.name, found.convert(1.0), found.convert)


def read_columns(
    samples: Samples,
    driver: Unit,
    units: Mapping[str, Convert],
    outputs: Sequence[Quantity],
) -> Columns:
    """Return the columns of a reference of a case file.

    Args:
        driver: unit of the driver values, unless the head gives another one.
        units: conversions from the case file's units, by SI unit: m, rad and 1.

    Raises:
        CaseError: a column is unknown or given twice, or a unit is not the output's.
    """
    file, where, known = samples.file, samples.header, known_columns(outputs)
    first, driver = driver_unit(samples, driver)
    heads = [unit_of_head(file, where, text, known) for text in samples.columns[1:]]
    names = [
        name if name in known else text
        for (name, _), text in zip(heads, samples.columns[1:], strict=True)
    ]
    _check(samples, first, names, [output.name for output in outputs], known)
    columns = {
        name: column_of(samples, k, unit, known[name], units)
        for k, (name, (_, unit)) in enumerate(zip(names, heads, strict=True), 1)
    }
    return Columns(driver, first, columns)


def column_of(samples: Samples, k: int, unit: str, si: str, units: Mapping[str, Convert]) -> Column:
    """Return a column.

    Args:
        k: its index.
        unit: its unit, from the head; empty for the default.
        si: the SI unit of its values.
        units: conversions from the default units, by SI unit.

    Raises:
        CaseError: the unit is unknown, or of something else.
    """
    if not unit:
        return Column(k, *unit_of(si.removesuffix("^2").removesuffix("/s"), units))
    found = required_unit(samples.file, samples.header, samples.columns[k], unit, si)
    return Column(k, found.name, found.convert)


def unit_of(unit: str, units: Mapping[str, Convert]) -> tuple[str, Convert]:
    """Return the unit of an output in the file, and the conversion of its numbers to SI."""
    above, _, below = unit.partition("/")
    convert = units[above]
    name, per = (getattr(units[each], "name", each) if each else "" for each in (above, below))
    if not below:
        return name, convert
    scale = units[below](1.0)
    return f"{name}/{per}", lambda number: convert(number) / scale


def _check(
    samples: Samples,
    first: str,
    names: Sequence[str],
    outputs: Sequence[str],
    known: Mapping[str, str],
) -> None:
    counts = Counter(names)
    if not names:
        raise fault(
            samples.file,
            samples.header,
            f"found no column of an output, expected some of {', '.join(outputs)}; add one",
        )
    if first in known:
        problem = f"found {first!r} first, the name of an output, expected the driver values"
        problem += "; put their column first, or name it otherwise"
        raise fault(samples.file, samples.header, problem)
    for name in names:
        if counts[name] > 1:
            raise fault(
                samples.file,
                samples.header,
                f"found the column {name!r} twice, expected it once; remove one",
            )
        if name not in known:
            problem = (
                f"found the column {shown(name)}, expected outputs of the case;"
                f" {remedy(name, known)}"
            )
            raise fault(samples.file, samples.header, problem)
        require_positions(samples, name, counts)


def require_positions(samples: Samples, name: str, names: Collection[str]) -> None:
    """Refuse a derivative without the column of its positions."""
    stem = name.removesuffix(".velocity").removesuffix(".acceleration")
    if stem not in names:
        problem = f"found {name!r} alone, expected its positions too; add the column {stem!r}"
        raise fault(samples.file, samples.header, problem)
