"""Specification limits of outputs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...case.case import Case, Quantity
from ...case.io.document import decimal, fault, join, typed
from ...case.units import ANGLES, LENGTHS, in_units
from ...errors import KincheckError, remedy
from ...trajectory import PER_TIME, QUANTITIES
from .file_units import FileUnits
from .variation_schema import LimitKeys

_EXPECTED = "expected OUTPUT:LOW:HIGH, one number of which may be missing, such as camber:-1.5:1.5"


@dataclass(frozen=True)
class Limit:
    """Limits of an output, or of its derivative by time, at every sample.

    Attributes:
        output: name of the output; with the suffix of a derivative, as in camber.velocity.
        low, high: smallest and largest value [SI unit of the output]; infinite without a limit.
    """

    output: str
    low: float = -math.inf
    high: float = math.inf


def read_limits(
    file: Path, tables: Mapping[str, Any], case: Case, units: FileUnits
) -> tuple[Limit, ...]:
    """Return the limits of a variation file.

    Raises:
        CaseError: there is no such output, or the limits make no sense.
    """
    found: list[Limit] = []
    for name, table in tables.items():
        key = join("limits", name)
        keys = typed(file, key, table, LimitKeys)
        try:
            found.append(limit_of(case, units, name, keys.low, keys.high))
        except ValueError as error:
            raise fault(file, key, str(error)) from None
    return tuple(found)


def limits_of_texts(texts: Iterable[str], case: Case, units: FileUnits) -> tuple[Limit, ...]:
    """Return the limits in texts OUTPUT:LOW:HIGH, in the units of a variation file.

    Raises:
        KincheckError: a text has another form, there is no such output, or the limits make no
            sense.
    """
    found: list[Limit] = []
    for text in texts:
        name, *numbers = text.rsplit(":", 2)
        try:
            low, high = (decimal(each) if each.strip() else None for each in numbers)
        except ValueError:
            raise KincheckError(f"--limit: found {text!r}, {_EXPECTED}; correct it") from None
        try:
            found.append(limit_of(case, units, name, low, high))
        except ValueError as error:
            raise KincheckError(f"--limit {text}: {error}") from None
    return tuple(found)


def limit_of(
    case: Case, units: FileUnits, name: str, low: float | None, high: float | None
) -> Limit:
    """Return the limits of an output, converted to SI.

    Raises:
        ValueError: there is no such output, or the limits make no sense.
    """
    output, derivative = _found(case, name)
    unit = output.unit + PER_TIME[derivative]
    _, size = in_units(unit, LENGTHS[units.length], ANGLES[units.angle])
    numbers = [each for each in (low, high) if each is not None]
    if not numbers:
        raise ValueError("found neither low nor high, expected one limit at least; give one")
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"found {numbers}, expected finite numbers; leave out what has no limit")
    if len(numbers) == 2 and numbers[0] >= numbers[1]:
        raise ValueError(
            f"found low = {numbers[0]:g} and high = {numbers[1]:g}, expected low below high;"
            " correct them"
        )
    return Limit(
        name,
        -math.inf if low is None else size * low,
        math.inf if high is None else size * high,
    )


def _found(case: Case, name: str) -> tuple[Quantity, int]:
    """Return the output and the order of the time derivative of a name."""
    known = {output.name: output for output in case.outputs}
    base, _, quantity = name.rpartition(".")
    derivative = QUANTITIES.index(quantity) if quantity in QUANTITIES[1:] else 0
    if name in known:
        return known[name], 0
    if not derivative or base not in known:
        raise ValueError(f"there is no output {name!r} of the case; {remedy(name, known)}")
    output = known[base]
    if derivative >= output.orders:
        raise ValueError(f"output {base!r} has no {quantity}; limit its value")
    return output, derivative
