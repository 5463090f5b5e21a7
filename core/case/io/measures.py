"""Measures of a case file: typed [outputs.NAME] without a suspension, read to `case.measures`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, replace
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import msgspec
from msgspec import Meta

from ...mechanism.mechanism import Vector
from ..case import Case, size
from ..measures import NAMES, Measure, key_of, own_keys
from .document import explained
from .reference import Convert
from .schema import Flag, Text, ToleranceKeys
from .tolerance import tolerance
from .typed_tables import typed

_DIRECTIONS = Annotated[
    tuple[Vector, Vector], Meta(description="two directions [[x, y, z], [x, y, z]]")
]


@cache
def measure_keys(cls: type[Measure]) -> type[msgspec.Struct]:
    """Return the keys of a measure: type, fields, tolerance and its reason."""
    hints = get_type_hints(cls)
    keys: list[Any] = [("type", Text)]
    for each in own_keys(cls):
        key = key_of(each)
        shape = _shape_of(key, hints[each.name])
        keys.append((key, shape) if each.default is MISSING else (key, shape, each.default))
    return msgspec.defstruct(
        cls.__name__, keys, bases=(ToleranceKeys,), kw_only=True, forbid_unknown_fields=True
    )


def _shape_of(key: str, hint: Any) -> Any:
    """Return the annotation of a field: names, directions, some words, or a flag."""
    if isinstance(hint, type) and issubclass(hint, StrEnum):
        return Annotated[hint, Meta(description=f"one of {', '.join(hint)}")]
    what = NAMES.get(key)
    pair = Annotated[
        tuple[str, str], Meta(description=f'two names ["first {what}", "second {what}"]')
    ]
    known = {str: Text, bool: Flag, tuple[str, str]: pair, tuple[Vector, Vector]: _DIRECTIONS}
    return known[hint]


def read_measure(
    file: Path,
    key: str,
    cls: type[Measure],
    name: str,
    value: object,
    case: Case,
    units: Mapping[str, Convert],
) -> Measure:
    """Read a measure of the given class.

    Args:
        case: the case as read so far.
        units: conversions from the file's units, by SI unit.

    Raises:
        CaseError: an unknown key, an unknown name, or a joint without this freedom.
    """
    keys = typed(file, key, value, measure_keys(cls))
    given = {each.name: getattr(keys, key_of(each)) for each in own_keys(cls)}
    with explained(file, key):
        output = cls(name, 0.0, 0.0, "", **given)
        output.check(case.mechanism)
    assert isinstance(keys, ToleranceKeys)
    unit = output.unit
    atol, rtol, why = tolerance(file, key, keys, units[unit], size(case), unit)
    return replace(output, atol=atol, rtol=rtol, why=why)
