"""Tables from a file somebody wrote: TOML or JSON in, plain checked data out, and one clear
CaseError for whatever is wrong.

Nothing is evaluated or imported from a file. Every message says: file, key, what was found, what
was expected, what to do.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
import reprlib
import tomllib
from collections import Counter
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Annotated, Any, TypeAlias, TypeVar, cast, get_args, get_origin

import msgspec

from ...errors import LONGEST_NAME, CaseError, MechanismError, remedy, similar
from ..units import METRE, Unit
from .escape import visible

# Numbers are squared and multiplied on the way: within these bounds that neither overflows nor
# underflows.
LARGEST, SMALLEST = 1e100, 1e-100
# Tables of a case are three deep, rows of numbers two more; what nests beyond that only hides in a
# message.
DEEPEST = 16
# Texts say where numbers come from; what is longer hides the rest of a message.
LONGEST_TEXT = 10_000
LONGEST_MESSAGE = 3_000
# Python's bound for decimal integers, which keeps their conversion from taking hours, is 4300
# digits.
_TOO_MANY_DIGITS = "Exceeds the limit"
# tomllib takes the square of a dotted key's length, in time and in memory: gigabytes for one of a
# hundred kilobytes.
_TOML_TEXT = re.compile(
    r'"""(?:[^"\\]|\\.|"(?!""))*+"*+|\'\'\'(?:[^\']|\'(?!\'\'))*+\'*+|"(?:[^"\\\n]|\\.)*+"?|\'[^\'\n]*+\'?|#[^\n]*+',
    re.DOTALL,
)
_LONG_KEY = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{DEEPEST + 1}}}")

_short = reprlib.Repr()
_short.maxstring = _short.maxother = 60
_short.maxlevel = 3

_Struct = TypeVar("_Struct", bound=msgspec.Struct)
_Class = TypeVar("_Class", bound=type)


def fault(file: Path, key: str, problem: str) -> CaseError:
    """The error to raise: 'FILE: KEY: PROBLEM', or 'FILE: PROBLEM' where no key is to blame; of a
    long one both ends.
    """
    whole = visible(": ".join(filter(None, (str(file), key, problem))))
    half = LONGEST_MESSAGE // 2
    return CaseError(
        whole if len(whole) <= LONGEST_MESSAGE else f"{whole[:half]} [...] {whole[-half:]}"
    )


@contextmanager
def explained(
    file: Path, key: str = "", length: Unit = METRE, given: object = None
) -> Generator[None]:
    """What a description refuses becomes an error of the file, at the key that it names, or else at
    the one given.

    Args:
        length: the file's unit; the message has lengths in it, and as the file has them.
        given: the table of the file whose numbers the message may be about.
    """
    try:
        yield
    except MechanismError as error:
        among = [*_numbers(given)]
        raise fault(
            file, error.key or key, error.phrase.within(lambda value: length.written(value, among))
        ) from None


def _numbers(value: object) -> Iterator[float]:
    """All numbers in a value of a file."""
    waiting: list[Any] = [value]
    while waiting:
        each = waiting.pop()
        if isinstance(each, dict | list | tuple):
            waiting += (
                cast("dict[str, Any]", each).values()
                if isinstance(each, dict)
                else cast("Sequence[Any]", each)
            )
        elif isinstance(each, int | float):
            yield each


def shown(value: object) -> str:
    """A found value in a message, abridged."""
    return _short.repr(value)


def join(key: str, name: str) -> str:
    """The path of a key inside a table."""
    name = name if name.isprintable() and name else repr(name)
    return f"{key}.{name}" if key else name


def decimal(text: str) -> float:
    """The number that a text is, as every language reads it.

    Raises:
        ValueError: it is none, or of digits that only Python takes: 1_0 is ten there, and a slip of
            the pen anywhere else.
    """
    if "_" in text or not text.isascii():
        raise ValueError(text)
    return float(text)


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


def sha256(file: Path) -> str:
    """The digest of a file that has been read, as `sha256sum` prints it."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def parse(file: Path, text: str) -> dict[str, Any]:
    """The tables of a TOML or JSON text: JSON if the file is called so, or if it is called neither
    and starts with a brace.

    Raises:
        CaseError: the syntax is wrong, a key is given twice, or a number or text cannot be worked
            with.
    """
    suffix = file.suffix.lower()
    is_json = suffix == ".json" or (suffix != ".toml" and text.lstrip().startswith("{"))
    if not is_json and (found := _LONG_KEY.search(_TOML_TEXT.sub(_blank, text))):
        line = text.count("\n", 0, found.start()) + 1
        raise fault(
            file,
            f"line {line}",
            f"found a key nested more than {DEEPEST} deep, expected two or three parts; correct it",
        )
    try:
        data = json.loads(text, object_pairs_hook=_once) if is_json else tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        what = "nested too deeply" if isinstance(error, RecursionError) else str(error)
        if what.startswith(_TOO_MANY_DIGITS):
            raise fault(
                file,
                "",
                "found an integer of thousands of digits, expected numbers of a size; correct it",
            ) from None
        raise fault(
            file, "", f"not valid {'JSON' if is_json else 'TOML'}: {what}; correct the syntax"
        ) from None
    if not isinstance(data, dict):
        raise fault(
            file, "", f"found {shown(data)}, expected the keys of a case; write an object {{...}}"
        )
    tables = cast("dict[str, Any]", data)
    _check_values(file, tables)
    return tables


def _blank(found: re.Match[str]) -> str:
    """A quoted key in place of a text, and nothing of a comment; its lines stay, and what is after
    it keeps its place.
    """
    part = found.group()
    return re.sub(r"[^\n]", " " if part.startswith("#") else "_", part)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        counts = Counter(name for name, _ in pairs)
        raise ValueError(
            f"the key {shown(min(name for name, count in counts.items() if count > 1))} is given"
            " twice"
        )
    return table


_Path: TypeAlias = "tuple[_Path, str | int] | None"
"""The way to a value: that to what holds it, and its name or index there. Written out only where
something is wrong.
"""


def _written(path: _Path) -> str:
    steps: list[str | int] = []
    while path is not None:
        path, step = path
        steps.append(step)
    key = ""
    for step in reversed(steps):
        key = f"{key}[{step}]" if isinstance(step, int) else join(key, step)
    return key


def _check_values(file: Path, tables: Mapping[str, Any]) -> None:
    """Numbers must be usable, and text printable: it ends up in terminals and reports."""
    # a stack: nesting may be deeper than Python recurses
    waiting: list[tuple[_Path, Any, int]] = [(None, tables, 0)]
    while waiting:
        path, value, depth = waiting.pop()
        if depth > DEEPEST:
            problem = (
                f"nested more than {DEEPEST} deep, expected tables and rows of numbers; correct the"
                " table"
            )
            raise fault(file, _written(path), problem)
        if isinstance(value, dict):
            table = cast("dict[str, Any]", value)
            for name in table:
                if not name or not name.isprintable() or len(name) > LONGEST_NAME:
                    expected = f"expected 1 to {LONGEST_NAME} printable characters"
                    raise fault(
                        file, _written(path), f"found the name {shown(name)}, {expected}; rename it"
                    )
            waiting += [((path, name), each, depth + 1) for name, each in table.items()]
        elif isinstance(value, list):
            waiting += [
                ((path, k), each, depth + 1) for k, each in enumerate(cast("list[Any]", value))
            ]
        elif isinstance(value, str):
            if not all(letter.isprintable() or letter in "\n\t" for letter in value):
                problem = (
                    f"found {shown(value)}, expected printable text; remove the control characters"
                )
                raise fault(file, _written(path), problem)
            if len(value) > LONGEST_TEXT:
                problem = (
                    f"found a text of {len(value)} characters, expected {LONGEST_TEXT} at most;"
                    " shorten it"
                )
                raise fault(file, _written(path), problem)
        elif isinstance(value, int | float) and not usable(value):
            # the digits of a huge integer are not shown: Python refuses to print them
            found = "a huge integer" if isinstance(value, int) else repr(value)
            problem = (
                f"found {found}, expected 0 or a finite number of {SMALLEST:g} to {LARGEST:g};"
                " correct the number"
            )
            raise fault(file, _written(path), problem)


def usable(number: float) -> bool:
    """Whether a number is finite, and zero or of a size that can be squared."""
    return number == 0 or (
        abs(number) <= LARGEST and abs(number) >= SMALLEST and math.isfinite(number)
    )


def as_table(file: Path, key: str, value: object) -> dict[str, Any]:
    """A value that has to be a table.

    Raises:
        CaseError: it is something else.
    """
    if not isinstance(value, dict):
        raise fault(
            file, key, f"found {shown(value)}, expected a table; write [{key}] and its keys below"
        )
    return cast("dict[str, Any]", value)


def class_of(file: Path, key: str, what: str, value: object, known: Mapping[str, _Class]) -> _Class:
    """The class that the key `type` of a table names.

    Raises:
        CaseError: not a table, or no such type.
    """
    table = as_table(file, key, value)
    if "type" not in table:
        raise fault(
            file,
            join(key, "type"),
            f"missing, expected a {what} type; add it, one of {', '.join(known)}",
        )
    name = table["type"]
    if not isinstance(name, str) or name not in known:
        raise fault(
            file,
            join(key, "type"),
            f"found {shown(name)}, expected a {what} type; {remedy(str(name), known)}",
        )
    return known[name]


def typed(file: Path, key: str, value: object, struct: type[_Struct]) -> _Struct:
    """A table as the struct that says which keys it has; the fields' `msgspec.Meta` descriptions
    serve as expectations.

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
    """By key; looked up once, not for each of ten thousand bodies."""
    return {field.encode_name: field for field in msgspec.structs.fields(struct)}


def _key_remedy(name: str, known: Iterable[str]) -> str:
    close = similar(name, known)
    return f"did you mean {close!r}?" if close else "remove it"


def description(annotation: Any) -> str:
    """What `typing.Annotated[type, msgspec.Meta(description=...)]` says of a value."""
    for part in get_args(annotation):
        if isinstance(part, msgspec.Meta) and part.description:
            return part.description
        if get_origin(part) is Annotated:  # of Annotated[...] | None
            return description(part)
    raise TypeError(f"{annotation} has no description")
