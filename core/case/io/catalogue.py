"""Catalogue of the types in case files: their keys, and the rows and freedoms of joints."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import MISSING
from typing import Any, TypeAlias

from ...errors import MechanismError
from ...joints import Coupler, Joint, Kind
from ...mechanism.dimension import dimension_of
from ...mechanism.loads import ELEMENTS, Bushing, SpringDamper
from ...mechanism.motions import Motion
from .. import measures
from ..measures import Measure
from ..quantity import own_keys
from ..suspension import SuspensionOutput
from .class_keys import Described, kind_of, own_fields
from .driving import DRIVERS

# Geometry for any joint. A universal joint needs two perpendicular directions; these are, up to the
# rounding of a table. A constant-velocity joint needs shafts in the same sense.
_EXAMPLES: Mapping[Kind | None, Any] = {
    Kind.POSITION: (0.0, 0.0, 0.0),
    Kind.DIRECTION: (1.0, 0.0, 0.0),
    Kind.POSITIONS: ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
    Kind.DIRECTIONS: ((1.0, 0.0, 0.0), (0.005, 1.0, 0.0)),
    Kind.LENGTH: 1.0,
    None: 1.0,
}


_SENTENCES = re.compile(r"(?<=[^.]\.) (?=[A-Z])")
"""The end of a sentence."""

Rows: TypeAlias = list[tuple[str, ...]]

ON_TYPES = (
    "points and directions are [x, y, z], global, at the design; of points and axes there is one on"
    " each body",
    "keys in brackets may be left out; body i is the first, j the second",
)
ON_OUTPUTS = (
    "each with its derivative by wheel travel, jounce: NAME.per_travel [unit/m]; the table"
    " [suspension] says of which wheel"
)
"""Remarks on the tables."""


def catalogue() -> Iterator[str]:
    """Yield lines to print, one for each type of joint, coupler, driver, motion and force."""
    yield from ON_TYPES
    yield from _printed(type_tables())


def output_catalogue() -> Iterator[str]:
    """Yield lines of the output types: unit, keys, needs from [suspension], and signs."""
    yield from _printed(output_tables())
    yield ON_OUTPUTS


def type_tables() -> dict[str, Rows]:
    """Return joints, couplers, drivers, motions and force elements by heading; a row starts with
    the name of the type and ends with its meaning.
    """
    return {
        'joints: type, bodies = ["first", "second"], and': [
            (name, _keys(cls), *_counts(cls), _meaning(cls))
            for name, cls in sorted(Joint.registry.items())
        ],
        'joints that couple two others: type, joints = ["first", "second"], and': [
            (name, _keys(cls), "1 row", f"couples {' and '.join(cls.freedoms)}", _meaning(cls))
            for name, cls in sorted(Coupler.registry.items())
        ],
        "drivers: type, and": [
            (name, _keys(cls), _meaning(cls)) for name, cls in sorted(DRIVERS.items())
        ],
        "motions of drivers: type, and": [
            (name, _keys(cls), _meaning(cls)) for name, cls in sorted(Motion.registry.items())
        ],
        "force elements: type, and": [
            (
                name,
                f'bodies = ["first", "second"], {_keys(cls)}'
                if issubclass(cls, SpringDamper | Bushing)
                else _keys(cls),
                _meaning(cls),
            )
            for name, cls in sorted(ELEMENTS.items())
        ],
    }


def output_tables() -> dict[str, Rows]:
    """Return the output types by heading: name, keys and meaning; of a wheel: name, unit, keys,
    sign and needs.
    """
    rows: Rows = []
    for name, cls in sorted(SuspensionOutput.registry.items()):
        keys = [
            each.name if each.default is MISSING else f"({each.name})" for each in own_keys(cls)
        ]
        needs = f"needs {', '.join(cls.needs)}" if cls.needs else ""
        rows.append((name, f"[{cls.measure}]", ", ".join(keys), f"positive: {cls.positive}", needs))
    return {
        "outputs: (type) = coordinate, point, component or direction, (relative); or a type, and": [
            (name, ", ".join(_measure_keys(cls)), _meaning(cls))
            for name, cls in sorted(Measure.registry.items())
        ],
        "outputs of a wheel: type, and": rows,
    }


def rows_of(cls: type[Joint]) -> int | None:
    """Return the number of constraint equations of a joint type; None if the example geometry does
    not suit it.
    """
    given = {each.name: _EXAMPLES[kind_of(each)] for each in own_fields(cls)}
    try:
        return cls("example", "first", "second", **given).rows
    except MechanismError:
        return None


def _counts(cls: type[Joint]) -> tuple[str, str]:
    """Return a joint's number of rows, and the number and names of its freedoms."""
    rows = rows_of(cls)
    count, left = ("?", "?") if rows is None else (str(rows), str(6 - rows))
    names = f": {', '.join(cls.freedoms)}" if cls.freedoms else ""
    return f"{count} {'row' if rows == 1 else 'rows'}", f"{left} free{names}"


def _keys(cls: type[Described]) -> str:
    """Return the keys of a type. Optional keys are in brackets; keys of motions and forces have
    units.
    """
    names: list[str] = []
    for each in own_fields(cls):
        measure, dimension = each.metadata.get("measure"), dimension_of(each)
        unit = dimension.of("length", "angle") if dimension else measure and measure.value
        name = f"{each.name} [{unit}]" if unit else each.name
        names.append(name if each.default is MISSING else f"({name})")
    return ", ".join(names) or "nothing else"


def _measure_keys(cls: type[Measure]) -> Iterator[str]:
    for each in own_keys(cls):
        key = measures.key_of(each)
        yield key if each.default is MISSING else f"({key})"


def _meaning(cls: type[Described] | type[Measure]) -> str:
    """Return the first sentence of a class's docstring. For a dataclass without a docstring,
    Python gives the signature.
    """
    paragraph = " ".join((cls.__doc__ or "").strip().partition("\n\n")[0].split())
    return "" if paragraph.startswith(f"{cls.__name__}(") else _SENTENCES.split(paragraph)[0]


def _printed(tables: Mapping[str, Rows]) -> Iterator[str]:
    for heading, rows in tables.items():
        yield heading
        yield from _columns(rows)


def _columns(rows: Rows) -> Iterator[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        yield (
            "  "
            + "  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip()
        )
