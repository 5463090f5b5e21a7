"""Reader of measures: typed [outputs.NAME] of a case file without a suspension."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, replace
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Annotated, Any, get_args, get_type_hints

import msgspec
import numpy as np
from msgspec import Meta

from ...mechanism.loads import Bushing, ForceElement, Torque, TorsionSpringDamper
from ...mechanism.mechanism import Mechanism, Vector
from ..case import Case, pace, size
from ..measures import NAMES, ForceMeasure, Measure, key_of
from ..quantity import own_keys
from .document import explained
from .reference_columns import Convert
from .schema import Flag, Text, ToleranceKeys
from .tolerance import tolerance
from .typed_tables import typed

_DIRECTION = Annotated[Vector | None, Meta(description="a direction [x, y, z]")]
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
    words = next((each for each in (hint, *get_args(hint)) if _is_words(each)), None)
    if words is not None:
        return Annotated[hint, Meta(description=f"one of {', '.join(words)}")]
    what = NAMES.get(key)
    pair = Annotated[
        tuple[str, str], Meta(description=f'two names ["first {what}", "second {what}"]')
    ]
    known: Mapping[Any, Any] = {
        str: Text,
        str | None: Annotated[str | None, Meta(description="a name")],
        bool: Flag,
        tuple[str, str]: pair,
        Vector | None: _DIRECTION,
        tuple[Vector, Vector]: _DIRECTIONS,
    }
    return known[hint]


def _is_words(hint: Any) -> bool:
    return isinstance(hint, type) and issubclass(hint, StrEnum)


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
        case: the case read so far.
        units: conversions from the file's units, by SI unit.

    Raises:
        CaseError: an unknown key, an unknown name, or a joint without this freedom.
    """
    keys = typed(file, key, value, measure_keys(cls))
    given = {each.name: getattr(keys, key_of(each)) for each in own_keys(cls)}
    with explained(file, key):
        output = cls(name, 0.0, 0.0, "", **given)
        output.check(case.mechanism)
        output = output.bound(case.mechanism)
    assert isinstance(keys, ToleranceKeys)
    unit = output.unit
    scale = size(case)
    if isinstance(output, ForceMeasure):
        loads = largest_load(case.mechanism, scale, pace(case))
        scale = loads * scale if output.turns else loads
    atol, rtol, why = tolerance(file, key, keys, units[unit], scale, unit)
    return replace(output, atol=atol, rtol=rtol, why=why)


def _largest(each: ForceElement, name: str) -> float:
    """Return the largest of an element's numbers of a name; zero without it."""
    return float(np.max(getattr(each, name, 0.0)))


def _steepest(each: ForceElement) -> float:
    """Return the steepest slope between rows of an element's curves."""
    given: Any = getattr(each, "curve", None) or ()
    tables = given if isinstance(each, Bushing) else (given,)
    slopes = [np.abs(np.divide(*np.diff(table, axis=0).T[::-1])).max() for table in tables if table]
    return float(max(slopes, default=0.0))


def largest_load(mechanism: Mechanism, size: float, pace: float) -> float:
    """Return an estimate of the largest force of a mechanism [N], the scale of errors.

    It counts the weights, the inertia forces at a pace [1/s], springs stretched by their own
    length, and applied forces.
    """
    masses = sum(body.mass for body in mechanism.moving)
    total = masses * (math.hypot(*mechanism.gravity) + size * pace**2)
    for each in mechanism.forces:
        arm = 1.0 / size if isinstance(each, TorsionSpringDamper) else size
        total += (_largest(each, "stiffness") + _largest(each, "damping") * pace) * arm
        turning = _largest(each, "turning_stiffness") + _largest(each, "turning_damping") * pace
        total += turning / size + _largest(each, "preload") + _steepest(each) * arm
        vector = getattr(each, "vector", (0.0,))
        total += float(np.linalg.norm(vector)) / (size if isinstance(each, Torque) else 1.0)
    return total
