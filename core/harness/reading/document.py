"""Tables from a file somebody wrote: TOML or JSON in, plain checked data out, and one clear CaseError for whatever is wrong.

Nothing is evaluated or imported from a file. Every message says: file, key, what was found, what was expected, what to do.
"""

from __future__ import annotations

import difflib
import json
import math
import reprlib
import tomllib
from collections.abc import Generator, Iterable, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, TypeVar, cast, get_args, get_origin

import msgspec

from ...errors import CaseError, MechanismError

# Numbers are squared and multiplied on the way: within these bounds that neither overflows nor underflows.
LARGEST, SMALLEST = 1e100, 1e-100
# Tables of a case are three deep, rows of numbers two more; what nests beyond that only hides in a message.
DEEPEST = 16

_short = reprlib.Repr()
_short.maxstring = _short.maxother = 60
_short.maxlevel = 3

_Struct = TypeVar("_Struct", bound=msgspec.Struct)
_Class = TypeVar("_Class", bound=type)


def fault(file: Path, key: str, problem: str) -> CaseError:
    """The error to raise: 'FILE: KEY: PROBLEM', or 'FILE: PROBLEM' where no key is to blame."""
    return CaseError(": ".join(filter(None, (str(file), key, problem))))


@contextmanager
def explained(file: Path, key: str = "") -> Generator[None]:
    """What a description refuses becomes an error of the file, at the key that it names, or else at the one given."""
    try:
        yield
    except MechanismError as error:
        raise fault(file, error.key or key, str(error)) from None


def shown(value: object) -> str:
    """A found value in a message, abridged."""
    return _short.repr(value)


def join(key: str, name: str) -> str:
    """The path of a key inside a table."""
    name = name if name.isprintable() and name else repr(name)
    return f"{key}.{name}" if key else name


def remedy(name: str, known: Iterable[str]) -> str:
    """What to write instead of a name that is not known."""
    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=1)
    return f"did you mean {close[0]!r}?" if close else f"known: {', '.join(names) or 'none'}"


def read_text(file: Path, limit: int, why_limit: str) -> str:
    """The text of a file of at most `limit` bytes.

    Raises:
        CaseError: not there, not a regular file, not readable, too large, or not UTF-8.
    """
    try:
        if not file.exists():
            raise fault(file, "", "no such file; check the path")
        if not file.is_file():
            raise fault(file, "", "not a regular file; give the path of a file")
        with file.open("rb") as stream:
            data = stream.read(limit + 1)
    except OSError as error:
        raise fault(file, "", f"cannot be read ({error.strerror}); check path and rights") from None
    if len(data) > limit:
        raise fault(file, "", f"larger than {limit} bytes, expected less; {why_limit}")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise fault(file, "", f"byte {error.start} is not UTF-8; save the file as UTF-8") from None


def parse(file: Path, text: str) -> dict[str, Any]:
    """The tables of a TOML or JSON text: JSON if the file is called so, or if it is called neither and starts with a brace.

    Raises:
        CaseError: the syntax is wrong, a key is given twice, or a number or text cannot be worked with.
    """
    suffix = file.suffix.lower()
    is_json = suffix == ".json" or (suffix != ".toml" and text.lstrip().startswith("{"))
    try:
        data = json.loads(text, object_pairs_hook=_once) if is_json else tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        what = "nested too deeply" if isinstance(error, RecursionError) else str(error)
        raise fault(file, "", f"not valid {'JSON' if is_json else 'TOML'}: {what}; correct the syntax") from None
    if not isinstance(data, dict):
        raise fault(file, "", f"found {shown(data)}, expected the keys of a case; write an object {{...}}")
    tables = cast("dict[str, Any]", data)
    _check_values(file, tables)
    return tables


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"the key {min(name for name in names if names.count(name) > 1)!r} is given twice")
    return table


def _check_values(file: Path, tables: Mapping[str, Any]) -> None:
    """Numbers must be usable, and text printable: it ends up in terminals and reports."""
    waiting: list[tuple[str, Any, int]] = [("", tables, 0)]  # a stack: nesting may be deeper than Python recurses
    while waiting:
        key, value, depth = waiting.pop()
        if depth > DEEPEST:
            raise fault(file, key, f"nested more than {DEEPEST} deep, expected tables and rows of numbers; correct the table")
        if isinstance(value, dict):
            table = cast("dict[str, Any]", value)
            for name in table:
                if not name or not name.isprintable():
                    raise fault(file, key, f"found the name {name!r}, expected printable characters; rename it")
            waiting += [(join(key, name), each, depth + 1) for name, each in table.items()]
        elif isinstance(value, list):
            waiting += [(f"{key}[{k}]", each, depth + 1) for k, each in enumerate(cast("list[Any]", value))]
        elif isinstance(value, str):
            if not all(letter.isprintable() or letter in "\n\t" for letter in value):
                raise fault(file, key, f"found {shown(value)}, expected printable text; remove the control characters")
        elif isinstance(value, int | float) and not usable(value):
            # the digits of a huge integer are not shown: Python refuses to print them
            found = "a huge integer" if isinstance(value, int) else repr(value)
            raise fault(
                file, key, f"found {found}, expected 0 or a finite number of {SMALLEST:g} to {LARGEST:g}; correct the number"
            )


def usable(number: float) -> bool:
    """Whether a number is finite, and zero or of a size that can be squared."""
    return number == 0 or (abs(number) <= LARGEST and abs(number) >= SMALLEST and math.isfinite(number))


def as_table(file: Path, key: str, value: object) -> dict[str, Any]:
    """A value that has to be a table.

    Raises:
        CaseError: it is something else.
    """
    if not isinstance(value, dict):
        raise fault(file, key, f"found {shown(value)}, expected a table; write [{key}] and its keys below")
    return cast("dict[str, Any]", value)


def class_of(file: Path, key: str, what: str, value: object, known: Mapping[str, _Class]) -> _Class:
    """The class that the key `type` of a table names.

    Raises:
        CaseError: not a table, or no such type.
    """
    name = as_table(file, key, value).get("type", "")
    if not isinstance(name, str) or name not in known:
        raise fault(file, join(key, "type"), f"found {shown(name)}, expected a {what} type; {remedy(str(name), known)}")
    return known[name]


def typed(file: Path, key: str, value: object, struct: type[_Struct]) -> _Struct:
    """A table as the struct that says which keys it has; the fields' `msgspec.Meta` descriptions serve as expectations.

    Raises:
        CaseError: not a table, an unknown key, a missing key, or a value of another type or shape than described.
    """
    table = as_table(file, key, value)
    fields = {field.encode_name: field for field in msgspec.structs.fields(struct)}
    for name in table:
        if name not in fields:
            raise fault(file, join(key, name), f"unknown key, expected one of {', '.join(fields)}; {_key_remedy(name, fields)}")
    for name, field in fields.items():
        if field.required and name not in table:
            raise fault(file, join(key, name), f"missing, expected {description(field.type)}; add the key {name!r}")
    for name, found in table.items():
        try:
            msgspec.convert(found, fields[name].type)
        except msgspec.ValidationError:
            expected = description(fields[name].type)
            raise fault(file, join(key, name), f"found {shown(found)}, expected {expected}; correct the value") from None
    return msgspec.convert(table, struct)


def _key_remedy(name: str, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(name, list(known), n=1)
    return f"did you mean {close[0]!r}?" if close else "remove it"


def description(annotation: Any) -> str:
    """What `typing.Annotated[type, msgspec.Meta(description=...)]` says of a value."""
    for part in get_args(annotation):
        if isinstance(part, msgspec.Meta) and part.description:
            return part.description
        if get_origin(part) is Annotated:  # of Annotated[...] | None
            return description(part)
    raise TypeError(f"{annotation} has no description")
