"""Tables of documents as typed structs, with one clear CaseError for each fault."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, TypeVar, cast, get_args, get_origin

import msgspec

from ...errors import similar, with_article
from .document import fault, join, parse, read_text, shown, unknown_name

_Struct = TypeVar("_Struct", bound=msgspec.Struct)
_Class = TypeVar("_Class", bound=type)


def read_tables(file: Path, limit: int, why_limit: str, schema: str) -> dict[str, Any]:
    """Return the tables of a file of at most `limit` bytes and of this schema.

    Raises:
        CaseError: the file cannot be read, or has another schema or none.
    """
    tables = parse(file, read_text(file, limit, why_limit))
    if tables.get("schema") != schema:
        found = shown(tables["schema"]) if "schema" in tables else "none"
        raise fault(
            file, "schema", f'found {found}, expected "{schema}"; write schema = "{schema}"'
        )
    return tables


def as_table(file: Path, key: str, value: object) -> dict[str, Any]:
    """Return a value as a table.

    Raises:
        CaseError: the value is no table.
    """
    if not isinstance(value, dict):
        raise fault(
            file, key, f"found {shown(value)}, expected a table; write [{key}] and its keys below"
        )
    return cast("dict[str, Any]", value)


def class_of(file: Path, key: str, what: str, value: object, known: Mapping[str, _Class]) -> _Class:
    """Return the class named by the key `type` of a table.

    Raises:
        CaseError: not a table, or an unknown type.
    """
    table = as_table(file, key, value)
    if "type" not in table:
        raise fault(
            file,
            join(key, "type"),
            f"missing, expected {with_article(what)} type; add it, one of {', '.join(known)}",
        )
    name = table["type"]
    if not isinstance(name, str) or name not in known:
        raise unknown_name(file, join(key, "type"), name, known, f"{with_article(what)} type")
    return known[name]


def typed(file: Path, key: str, value: object, struct: type[_Struct]) -> _Struct:
    """Return a table as a struct.

    Args:
        struct: declares the keys; messages quote the `msgspec.Meta` descriptions of its fields.

    Raises:
        CaseError: not a table, an unknown key, a missing key, or a value of another type or shape
            than described.
    """
    table = as_table(file, key, value)
    fields = _fields(struct)
    for name in table:
        if name not in fields:
            raise fault(
                file,
                join(key, name),
                f"unknown key, expected one of {', '.join(fields)}; {_key_remedy(name, fields)}",
            )
    for name, field in fields.items():
        if field.required and name not in table:
            raise fault(
                file,
                join(key, name),
                f"missing, expected {description(field.type)}; add the key {name!r}",
            )
    for name, found in table.items():
        try:
            msgspec.convert(found, fields[name].type)
        except msgspec.ValidationError:
            expected = description(fields[name].type)
            raise fault(
                file,
                join(key, name),
                f"found {shown(found)}, expected {expected}; correct the value",
            ) from None
    return msgspec.convert(table, struct)


@cache
def _fields(struct: type[msgspec.Struct]) -> Mapping[str, msgspec.structs.FieldInfo]:
    """Return the fields of a struct by key; cached, as a file may have ten thousand bodies."""
    return {field.encode_name: field for field in msgspec.structs.fields(struct)}


def _key_remedy(name: str, known: Iterable[str]) -> str:
    close = similar(name, known)
    return f"did you mean {close!r}?" if close else "remove it"


def description(annotation: Any) -> str:
    """Return the description in `typing.Annotated[type, msgspec.Meta(description=...)]`."""
    for part in get_args(annotation):
        if isinstance(part, msgspec.Meta) and part.description:
            return part.description
        if get_origin(part) is Annotated:  # of Annotated[...] | None
            return description(part)
    raise TypeError(f"{annotation} has no description")
