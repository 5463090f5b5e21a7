"""Catalogue of the types in case files: their keys, and the rows and freedoms of joints; and the
JSON Schema of case files, made from the types of their readers.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING
from typing import Any, TypeAlias, TypeVar, cast

import msgspec

from ...errors import MechanismError
from ...joints import Coupler, Joint
from ...mechanism.body import dimension_of
from ...mechanism.loads import ELEMENTS, Bushing, SpringDamper
from ...mechanism.motions import Motion
from ..joint_probe import specimen
from ..measures import Measure, key_of
from ..quantity import TypedQuantity, own_keys
from .mechanism_sections import DRIVERS
from .schema import (
    COORDINATE,
    SCHEMA,
    BodyKeys,
    ClosureKeys,
    OutputKeys,
    PointKeys,
    ReferenceKeys,
    SweepKeys,
    UnitsKeys,
    keys_of,
    own_fields,
)
from .sections import case_keys, sections, types

_SENTENCES = re.compile(r"(?<=[^.]\.) (?=[A-Z])")
"""The end of a sentence."""

T = TypeVar("T")
Rows: TypeAlias = list[tuple[str, ...]]

ON_TYPES = (
    "points and directions are [x, y, z], global, at the design; of points and axes there is one on"
    " each body",
    "keys in brackets may be left out; body i is the first, j the second",
)
"""Remarks on the tables."""


def catalogue() -> Iterator[str]:
    """Yield lines to print, one for each type of joint, coupler, driver, motion and force."""
    yield from ON_TYPES
    yield from _table_lines(type_tables())


def output_catalogue() -> Iterator[str]:
    """Yield lines of the output types: unit, keys, needs from [suspension], and signs."""
    yield from _table_lines(output_tables())
    yield from on_outputs()


def type_tables() -> dict[str, Rows]:
    """Return joints, couplers, drivers, motions and force elements by heading; a row starts with
    the name of the type and ends with its meaning.
    """
    return {
        'joints: type, bodies = ["first", "second"], and': _rows(
            Joint.registry, lambda cls: (_keys(cls), *_counts(cls))
        ),
        'joints that couple two others: type, joints = ["first", "second"], and': _rows(
            Coupler.registry,
            lambda cls: (_keys(cls), "1 row", f"couples {' and '.join(cls.freedoms)}"),
        ),
        "drivers: type, and": _rows(DRIVERS),
        "motions of drivers: type, and": _rows(Motion.types()),
        "force elements: type, and": _rows(
            ELEMENTS,
            lambda cls: (
                'bodies = ["first", "second"], ' * issubclass(cls, SpringDamper | Bushing)
                + _keys(cls),
            ),
        ),
    }


def output_tables() -> dict[str, Rows]:
    """Return the output types by heading: name, keys and meaning; of a wheel: name, unit, keys,
    sign and needs.
    """

    def keys(cls: type[TypedQuantity]) -> str:
        named = ((key_of(each), each.default) for each in own_keys(cls))
        return ", ".join(key if default is MISSING else f"({key})" for key, default in named)

    def row(name: str, cls: type[TypedQuantity]) -> tuple[str, ...]:
        needs = f"needs {', '.join(cls.needs)}" if cls.needs else ""
        return name, f"[{cls.measure}]", keys(cls), f"positive: {cls.positive}", needs

    of_all = (
        "outputs: (type) = coordinate, point, component or direction, (relative); or a type, and"
    )
    return {
        of_all: _rows(Measure.registry, lambda cls: (keys(cls),)),
        **{
            each.heading: [row(*one) for one in sorted(each.types.items())]
            for each in sections()
            if each.types
        },
    }


def on_outputs() -> list[str]:
    """Return the remarks on the output types of extensions."""
    return [each.remark for each in sections() if each.remark]


def _rows(
    registry: Mapping[str, type[T]],
    cells: Callable[[type[T]], tuple[str, ...]] = lambda cls: (_keys(cls),),
) -> Rows:
    return [(name, *cells(cls), _meaning(cls)) for name, cls in sorted(registry.items())]


def rows_of(cls: type[Joint]) -> int | None:
    """Return the number of constraint equations of a joint type; None if no specimen of it can be
    made.
    """
    try:
        return specimen(cls).rows
    except MechanismError:
        return None


def _counts(cls: type[Joint]) -> tuple[str, str]:
    """Return a joint's number of rows, and the number and names of its freedoms."""
    rows = rows_of(cls)
    count, left = ("?", "?") if rows is None else (str(rows), str(6 - rows))
    names = f": {', '.join(cls.freedoms)}" if cls.freedoms else ""
    return f"{count} {'row' if rows == 1 else 'rows'}", f"{left} free{names}"


def _keys(cls: type[Any]) -> str:
    """Return the keys of a type. Optional keys are in brackets; keys of motions and forces have
    units.
    """
    names = list[str]()
    for each in own_fields(cls):
        measure, dimension = each.metadata.get("measure"), dimension_of(each)
        unit = dimension.of("length", "angle") if dimension else measure and measure.value
        name = f"{each.name} [{unit}]" if unit else each.name
        names.append(name if each.default is MISSING else f"({name})")
    return ", ".join(names) or "nothing else"


def _meaning(cls: type[Any]) -> str:
    """Return the first sentence of a class's docstring. For a dataclass without a docstring,
    Python gives the signature.
    """
    paragraph = " ".join((cls.__doc__ or "").strip().partition("\n\n")[0].split())
    return "" if paragraph.startswith(f"{cls.__name__}(") else _SENTENCES.split(paragraph)[0]


def _table_lines(tables: Mapping[str, Rows]) -> Iterator[str]:
    for heading, rows in tables.items():
        yield heading
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        for row in rows:
            cells = (f"{cell:{width}}" for cell, width in zip(row, widths, strict=True))
            yield f"  {'  '.join(cells).rstrip()}"


Keys: TypeAlias = type[msgspec.Struct]
Tables: TypeAlias = Mapping[str, Keys | Mapping[str, Keys]]
"""Keys of a table in a table of tables, by the name of the outer table; or keys by `type`."""

DIALECT = "https://json-schema.org/draft/2020-12/schema"
TEMPLATE = "#/$defs/{name}"


def case_schema() -> dict[str, Any]:
    """Return the schema of case files, with all joint types registered so far."""
    measures, outputs = map(_structs, (Measure.registry, types()))
    tables: Tables = {
        "bodies": BodyKeys,
        "joints": _structs({**Joint.registry, **Coupler.registry}),
        "couplers": _structs(Coupler.registry),
        "points": PointKeys,
        "drivers": _structs(DRIVERS),
        "forces": _structs(ELEMENTS),
        "outputs": {COORDINATE: OutputKeys, **measures, **outputs},
    }
    single = {
        "units": UnitsKeys,
        "closure": ClosureKeys,
        "sweep": SweepKeys,
        **{each.key: each.keys for each in sections() if each.types},
        "reference": ReferenceKeys,
    }
    motions = _structs(Motion.types())
    found = document_schema(SCHEMA, case_keys(), tables, single, {"motion": motions})
    for name in DRIVERS:
        keys = found["$defs"][f"drivers.{name}"]["properties"]
        keys["motion"] = any_of([f"motion.{name}" for name in motions])
    return found


def _structs(registry: Mapping[str, type[Any]]) -> dict[str, Keys]:
    return {name: keys_of(cls) for name, cls in registry.items()}


def document_schema(
    name: str,
    keys: Keys,
    tables: Tables,
    single: Mapping[str, Keys],
    further: Tables | None = None,
) -> dict[str, Any]:
    """Return the schema of a file of tables.

    Args:
        name: name of the schema, as in the key `schema` of the file.
        keys: the keys at the top of the file.
        tables: the keys of each table in a table of tables.
        single: the keys of a table.
        further: definitions used by other definitions.
    """
    structs = {"": keys, **single}
    for table, each in {**tables, **(further or {})}.items():
        kinds = each if isinstance(each, Mapping) else {"": each}
        structs |= {f"{table}.{kind}".rstrip("."): struct for kind, struct in kinds.items()}
    definitions = {label: struct_schema(struct) for label, struct in structs.items()}
    for label, definition in definitions.items():
        if kind := label.partition(".")[2]:
            definition["properties"]["type"] = {"const": kind}
    whole = definitions.pop("")
    properties = whole["properties"] | {"schema": {"const": name}}
    for table, each in tables.items():
        labels = [f"{table}.{kind}" for kind in each] if isinstance(each, Mapping) else [table]
        properties[table] = {"type": "object", "additionalProperties": any_of(labels)}
    properties |= {table: any_of([table]) for table in single}
    return whole | {"$schema": DIALECT, "properties": properties, "$defs": definitions}


def any_of(labels: list[str]) -> dict[str, Any]:
    """Return the schema of a value of any of the definitions."""
    refs = [{"$ref": TEMPLATE.format(name=label)} for label in labels]
    return refs[0] if len(refs) == 1 else {"anyOf": refs}


def struct_schema(struct: Keys) -> dict[str, Any]:
    """Return the schema of a struct, with all references replaced by their definitions."""
    (ref,), parts = msgspec.json.schema_components([struct], ref_template=TEMPLATE)

    def inline_references(value: Any) -> Any:
        if isinstance(value, dict):
            table = cast("dict[str, Any]", value)
            if "$ref" in table:
                return inline_references(parts[table["$ref"].rpartition("/")[2]])
            return {key: inline_references(each) for key, each in table.items()}
        if isinstance(value, list):
            return [inline_references(each) for each in cast("list[Any]", value)]
        return value

    return inline_references(ref)
