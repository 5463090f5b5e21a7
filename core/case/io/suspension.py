"""Reader of the suspension outputs of a case file, typed [outputs.NAME]."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import msgspec

from ..case import Case, Quantity, size
from ..quantity import own_keys
from ..suspension import AxleOutput, PerTravel, Side, SuspensionOutput, Vehicle
from .class_keys import key_of
from .document import fault, join, shown
from .reference_columns import Convert
from .schema import Flag, Text, ToleranceKeys
from .suspension_table import Points, Sides, SuspensionTable, check_point, one_of
from .tolerance import tolerance
from .travel_driver import require_travel
from .typed_tables import typed


@cache
def output_keys(cls: type[SuspensionOutput]) -> type[msgspec.Struct]:
    """Return the keys of a suspension output class: type, side of the wheel, fields, tolerance and
    its reason.
    """
    hints = get_type_hints(cls)
    keys: list[Any] = [("type", Text)]
    if not issubclass(cls, AxleOutput):
        keys.append(("side", Sides | None, None))
    for each in own_keys(cls):
        keys.append(key_of(each, _shape_of(hints[each.name])))
    return msgspec.defstruct(
        cls.__name__, keys, bases=(ToleranceKeys,), kw_only=True, forbid_unknown_fields=True
    )


def _shape_of(hint: Any) -> Any:
    """Return the annotation of an output's own field: some words, two point names, or a flag."""
    if isinstance(hint, type) and issubclass(hint, StrEnum):
        return Annotated[hint, one_of(hint)]
    return {tuple[str, str]: Points, bool: Flag}[hint]


def read_output(
    file: Path,
    key: str,
    cls: type[SuspensionOutput],
    name: str,
    value: object,
    table: SuspensionTable | None,
    case: Case,
    units: Mapping[str, Convert],
) -> SuspensionOutput:
    """Read an output of the given class.

    Args:
        case: the case read so far.
        units: conversions from the file's units, by SI unit.

    Raises:
        CaseError: an unknown key, a missing input of the type, or a type undefined for this wheel.
    """
    if table is None:
        raise fault(
            file,
            "suspension",
            f"missing, expected a table for {key} of type {cls.type!r}; add [suspension]",
        )
    keys: Any = typed(file, key, value, output_keys(cls))
    vehicle = _wheel(file, key, cls, table, getattr(keys, "side", None))
    for need in cls.needs:
        if getattr(vehicle, need) is None:
            raise fault(
                file,
                join("suspension", need),
                f"missing, expected it for {key} of type {cls.type!r}; add it",
            )
    given: dict[str, Any] = {each.name: getattr(keys, each.name) for each in own_keys(cls)}
    if issubclass(cls, AxleOutput):
        given["other"] = table.other
    output = cls(
        name,
        vehicle,
        *tolerance(file, key, keys, units[cls.measure], size(case), cls.measure),
        **given,
    )
    if problem := output.problem:
        raise fault(file, key, problem)
    for each in own_keys(cls):
        if isinstance(given[each.name], tuple):  # names of points
            for point in given[each.name]:
                check_point(file, join(key, each.name), point, case.mechanism)
    require_travel(file, key, output, case)
    return output


def _wheel(
    file: Path, key: str, cls: type[SuspensionOutput], table: SuspensionTable, side: Side | None
) -> Vehicle:
    """Return the vehicle with the wheel of an output."""
    if issubclass(cls, AxleOutput) and table.other is None:
        raise fault(
            file,
            "suspension.other",
            f"missing, expected the other wheel for {key} of type {cls.type!r}; add"
            " [suspension.other]",
        )
    wheels = [each for each in (table.vehicle, table.other) if each]
    for wheel in wheels:
        if side in (None, wheel.side):
            return wheel
    raise fault(
        file,
        join(key, "side"),
        f"found {shown(str(side))}, expected {wheels[0].side}, the side in [suspension]; correct"
        " it, or add [suspension.other]",
    )


def with_slopes(outputs: Sequence[Quantity], size: float) -> tuple[Quantity, ...]:
    """Return the outputs, each output of a wheel followed by its derivative by travel.

    Args:
        size: size of the mechanism [m]. If a pose error changes an output by d, it changes the
            slope by about d / size.
    """
    both: list[Quantity] = []
    for output in outputs:
        both.append(output)
        if isinstance(output, SuspensionOutput) and not isinstance(output, AxleOutput):
            both.append(PerTravel(output, output.atol / size))
    return tuple(both)
