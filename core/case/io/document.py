"""Documents: TOML, JSON or YAML text to plain checked data, and its tables to typed structs, with
one clear CaseError for each fault.

Nothing is evaluated or imported from a file. Every message states file, key, found, expected and
remedy. Every scalar of YAML is a text; its references and repeated keys are refused.
"""

from __future__ import annotations

import codecs
import json
import math
import re
import reprlib
import tomllib
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Annotated, Any, TypeVar, cast, get_args, get_origin

import msgspec

from ...errors import LONGEST_NAME, CaseError, MechanismError, remedy, similar, with_article
from ..units import METRE, FileUnits, Unit
from .escape import visible
from .foreign import binary, foreign
from .lines import DEEPEST, TEXT, join, key_again, place

# Squares and products of numbers within these bounds neither overflow nor underflow.
LARGEST, SMALLEST = 1e100, 1e-100
# Texts give the sources of numbers; a longer text hides the rest of a message.
LONGEST_TEXT = 10_000
LONGEST_MESSAGE = 3_000
# Python limits decimal integers to 4300 digits: the conversion of longer ones could take hours.
_TOO_MANY_DIGITS = "Exceeds the limit"
# Time and memory of tomllib grow with the square of a dotted key's length: gigabytes for a key of a
# hundred kilobytes.
_TOML_TEXT = re.compile(TEXT, re.DOTALL)
_LONG_KEY = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{DEEPEST + 1}}}")

_short = reprlib.Repr()
_short.maxstring = _short.maxother = 60
_short.maxlevel = 3


def fault(file: Path, key: str, problem: str) -> CaseError:
    """Return the error 'FILE: KEY: PROBLEM', or 'FILE: PROBLEM' without a key; with the line before
    a key of TOML, JSON or YAML.

    A long message loses its middle.
    """
    whole = visible(": ".join(filter(None, (str(file), place(file, key), problem))))
    half = LONGEST_MESSAGE // 2
    return CaseError(
        whole if len(whole) <= LONGEST_MESSAGE else f"{whole[:half]} [...] {whole[-half:]}"
    )


@contextmanager
def explained(
    file: Path, key: str = "", length: Unit = METRE, given: object = None
) -> Generator[None]:
    """Turn a MechanismError into an error of the file, at the error's key, or else at the given
    key.

    Args:
        length: the file's unit of length, also for lengths in the message.
        given: table of the file with the numbers for the message.
    """
    try:
        yield
    except MechanismError as error:
        among = [*_numbers(given)]
        raise fault(
            file, error.key or key, error.phrase.within(lambda value: length.written(value, among))
        ) from None


def _numbers(value: object) -> Iterator[float]:
    """Yield all numbers in a value of a file."""
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
    """Return a found value for a message, abridged."""
    return _short.repr(value)


def unknown_name(
    file: Path, key: str, name: object, known: Iterable[str], expected: str
) -> CaseError:
    """Return the error of a name that is none of the known ones.

    Args:
        expected: what it should name, for the message: "a point".
    """
    return fault(file, key, f"found {shown(name)}, expected {expected}; {remedy(str(name), known)}")


def require_known(
    file: Path, key: str, name: str | None, known: Iterable[str], expected: str
) -> None:
    """Refuse a name that is none of the known ones; see `unknown_name`. None is no name."""
    if name is not None and name not in (names := [*known]):
        raise unknown_name(file, key, name, names, expected)


def decimal(text: str) -> float:
    """Return the number of a text, in notation common to all languages.

    Raises:
        ValueError: not a number, or a number for Python alone: 1_0 is ten in Python, and a typing
            error anywhere else.
    """
    if "_" in text or not text.isascii():
        raise ValueError(text)
    return float(text)


def number_or_nan(text: str) -> float:
    """Return the number of a text as `decimal` reads it; NaN for any other text."""
    try:
        return decimal(text)
    except ValueError:
        return math.nan


def measure(text: str, units: Mapping[str, Unit], bare: str) -> tuple[float, str]:
    """Return a measure of an option in SI and the name of its unit: "0.05", "50mm" or "-30 deg".

    Args:
        units: those of the quantity, by name.
        bare: unit of a number without one; its name is returned as an empty text.

    Raises:
        ValueError: another text, or a unit of another quantity.
    """
    number, unit = text.strip(), ""
    for name in sorted(units, key=len, reverse=True):
        if number.endswith(name):
            number, unit = number.removesuffix(name).rstrip(), name
            break
    return units[unit or bare](decimal(number)), unit


def interval(parts: Sequence[str], units: Mapping[str, Unit], bare: str) -> tuple[list[float], str]:
    """Return the ends of a range of an option in SI, and their unit; the unit of one end holds for
    an end without one: "-80:80mm".

    Raises:
        ValueError: as `measure`.
    """
    stated = next((unit for part in parts if (unit := measure(part, units, bare)[1])), "")
    return [measure(part, units, stated or bare)[0] for part in parts], stated


def read_bytes(file: Path, limit: int, why_limit: str) -> bytes:
    """Return the content of a file of at most `limit` bytes.

    Raises:
        CaseError: the file is missing, not regular, not readable, or too large.
    """
    require_file(file, limit, why_limit)
    try:
        with file.open("rb") as stream:
            data = stream.read(limit + 1)
    except OSError as error:
        raise fault(file, "", f"cannot be read ({error.strerror}); check path and rights") from None
    if len(data) > limit:  # it has grown
        raise fault(file, "", f"larger than {limit} bytes, expected less; {why_limit}")
    return data


def require_file(file: Path, limit: int, why_limit: str) -> None:
    """Refuse what is no regular file of at most `limit` bytes."""
    try:
        size = file.stat().st_size if file.exists() else None
    except OSError as error:
        raise fault(file, "", f"cannot be read ({error.strerror}); check path and rights") from None
    if size is None:
        raise fault(file, "", "no such file; check the path")
    if not file.is_file():
        what = "a folder, not a regular file" if file.is_dir() else "not a regular file"
        raise fault(file, "", f"{what}; give the path of a file")
    if size > limit:
        raise fault(file, "", f"larger than {limit} bytes, expected less; {why_limit}")


def read_text(file: Path, limit: int, why_limit: str, *, of_spreadsheet: bool = False) -> str:
    """Return the text of a file of at most `limit` bytes.

    Args:
        of_spreadsheet: accept the encodings of spreadsheets: UTF-16 with a byte order mark, and
            Windows-1252, with the same digits and signs as UTF-8.

    Raises:
        CaseError: the file is missing, not regular, not readable, too large, of another program,
            or in another encoding.
    """
    data = read_bytes(file, limit, why_limit)
    if problem := foreign(data):
        raise fault(file, "", problem)
    marked = of_spreadsheet and data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    try:
        return data.decode("utf-16" if marked else "utf-8-sig")
    except UnicodeDecodeError as error:
        if of_spreadsheet and not marked and not binary(data):
            with suppress(UnicodeDecodeError):
                return data.decode("cp1252")
        problem = f"byte {error.start} is not UTF-{16 if marked else 8}; save the file as UTF-8"
        utf_16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        if binary(data) and not utf_16:
            problem = "found a binary file, expected text; give what the program exports as text"
        raise fault(file, "", problem) from None


def parse(file: Path, text: str) -> dict[str, Any]:
    """Return the tables of a TOML or JSON text.

    The text is JSON if the suffix is .json. With a suffix of neither format, it is JSON if it
    starts with a brace.

    Raises:
        CaseError: the syntax is wrong, a key is given twice, or a number or text is unusable.
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
    data = parse_json(file, text) if is_json else _loaded(file, "TOML", tomllib.loads, text)
    if not isinstance(data, dict):
        raise fault(
            file, "", f"found {shown(data)}, expected the keys of a case; write an object {{...}}"
        )
    tables = cast("dict[str, Any]", data)
    check_values(file, tables)
    return tables


def parse_json(file: Path, text: str, **hooks: Callable[[str], object]) -> Any:
    """Return the value of a JSON text.

    Args:
        hooks: of `json.loads`, to read numbers in another way.

    Raises:
        CaseError: the syntax is wrong, or a key is given twice.
    """
    once = partial(_once, text)
    return _loaded(file, "JSON", partial(json.loads, object_pairs_hook=once, **hooks), text)


def _loaded(file: Path, kind: str, load: Callable[[str], Any], text: str) -> Any:
    try:
        return load(text)
    except (ValueError, RecursionError) as error:
        what = "nested too deeply" if isinstance(error, RecursionError) else str(error)
        problem = f"not valid {kind}: {what}; correct the syntax"
        if what.startswith(_TOO_MANY_DIGITS):
            problem = (
                "found an integer of thousands of digits, expected numbers of a size; correct it"
            )
        raise fault(file, "", problem) from None


def _blank(found: re.Match[str]) -> str:
    """Return underscores for a text, and blanks for a comment, of equal length and lines."""
    part = found.group()
    return re.sub(r"[^\n]", " " if part.startswith("#") else "_", part)


def _once(text: str, pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        raise ValueError(f"{key_again(text)} is given twice")
    return table


def check_values(file: Path, tables: object) -> None:
    """Refuse unusable numbers, deep nesting, and text unprintable on terminals and in reports."""
    # a stack: nesting may be deeper than Python recurses
    waiting: list[tuple[tuple[str | int, ...], Any]] = [((), tables)]
    while waiting:
        path, value = waiting.pop()
        problem = ""
        if len(path) > DEEPEST:
            problem = (
                f"nested more than {DEEPEST} deep, expected tables and rows of numbers; correct the"
                " table"
            )
        elif isinstance(value, dict):
            table = cast("dict[str, Any]", value)
            for name in table:
                if not name or not name.isprintable() or len(name) > LONGEST_NAME:
                    expected = f"expected 1 to {LONGEST_NAME} printable characters"
                    problem = f"found the name {shown(name)}, {expected}; rename it"
                    break
            waiting += [((*path, name), each) for name, each in table.items()]
        elif isinstance(value, list):
            waiting += [((*path, k), each) for k, each in enumerate(cast("list[Any]", value))]
        elif isinstance(value, str):
            if not all(letter.isprintable() or letter in "\n\t" for letter in value):
                problem = (
                    f"found {shown(value)}, expected printable text; remove the control characters"
                )
            elif len(value) > LONGEST_TEXT:
                problem = (
                    f"found a text of {len(value)} characters, expected {LONGEST_TEXT} at most;"
                    " shorten it"
                )
        elif isinstance(value, int | float) and not usable(value):
            # omit the digits of a huge integer: Python refuses to print them
            found = "a huge integer" if isinstance(value, int) else repr(value)
            problem = (
                f"found {found}, expected 0 or a finite number of {SMALLEST:g} to {LARGEST:g};"
                " correct the number"
            )
        if problem:
            key = ""
            for step in path:
                key = f"{key}[{step}]" if isinstance(step, int) else join(key, step)
            raise fault(file, key, problem)


def usable(number: float) -> bool:
    """Return whether a number is finite, and zero or small and large enough to be squared."""
    return number == 0 or (
        abs(number) <= LARGEST and abs(number) >= SMALLEST and math.isfinite(number)
    )


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


@dataclass(frozen=True)
class Section:
    """A value of a document with its place for messages.

    Attributes:
        key: path of the keys to it; empty for the whole document.
        units: of the numbers of the document.
    """

    file: Path
    key: str
    value: object
    units: FileUnits = FileUnits()  # noqa: RUF009 - it is frozen

    @property
    def _entries(self) -> dict[str, Any]:
        value = self.value
        return cast("dict[str, Any]", value) if isinstance(value, dict) else {}

    def at(self, name: str) -> Section:
        """Return the value of a key in this table; None without it, or if this is no table."""
        return Section(self.file, join(self.key, name), self._entries.get(name), self.units)

    def each(self) -> Iterator[tuple[str, Section]]:
        """Yield names and values of this table; nothing without it.

        Raises:
            CaseError: the value is no table.
        """
        if self.value is not None:
            yield from ((name, self.at(name)) for name in self.table)

    def fault(self, problem: str) -> CaseError:
        """Return the error of this value; see `fault`."""
        return fault(self.file, self.key, problem)

    def explained(self) -> AbstractContextManager[None]:
        """Turn a MechanismError on this value into an error of the file; see `explained`."""
        return explained(self.file, self.key, self.units.length, self.value)

    def unknown(self, name: object, known: Iterable[str], expected: str) -> CaseError:
        """Return the error of a name here that is none of the known ones; see `unknown_name`."""
        return unknown_name(self.file, self.key, name, known, expected)

    def require(self, name: str | None, known: Iterable[str], expected: str) -> None:
        """Refuse a name here that is none of the known ones; see `require_known`."""
        require_known(self.file, self.key, name, known, expected)

    def require_keys(self, known: Iterable[str]) -> None:
        """Refuse unread keys of this table: almost always misspelt ones.

        Raises:
            CaseError: the value is no table, or has such a key.
        """
        known = [*known]
        unknown = [name for name in self.table if name not in known]
        if not unknown:
            return
        # a misspelt type is why others seem unknown
        name = ("type" in known and similar("type", unknown)) or next(
            (name for name in unknown if similar(name, known)), unknown[0]
        )
        close = similar(name, known)
        further = not self.key and isinstance(self.table[name], dict)
        remove = f"remove it{', or install the extension that reads it' * further}"
        advice = f"did you mean {close!r}?" if close else remove
        raise self.at(name).fault(
            f"unknown key, expected {'one of ' * (len(known) > 1)}{', '.join(known)}; {advice}"
        )

    @property
    def table(self) -> dict[str, Any]:
        """The value as a table.

        Raises:
            CaseError: the value is no table.
        """
        if not isinstance(self.value, dict):
            raise self.fault(
                f"found {shown(self.value)}, expected a table; write [{self.key}] and its keys"
                " below"
            )
        return self._entries

    def typed(self, struct: type[_Struct]) -> _Struct:
        """Return the value as a struct; see `typed`."""
        return typed(self.file, self.key, self.value, struct)

    def class_of(self, what: str, known: Mapping[str, _Class]) -> _Class:
        """Return the class named by the key `type` of this table.

        Raises:
            CaseError: not a table, or an unknown type.
        """
        expected = f"{with_article(what)} type"
        if "type" not in self.table:
            if wrong := similar("type", self.table):
                raise self.at(wrong).fault("unknown key; did you mean 'type'?")
            raise self.at("type").fault(
                f"missing, expected {expected}; add it, one of {', '.join(known)}"
            )
        name = self.table["type"]
        if not isinstance(name, str) or name not in known:
            raise self.at("type").unknown(name, known, expected)
        return known[name]


def typed(file: Path, key: str, value: object, struct: type[_Struct]) -> _Struct:
    """Return a table as a struct.

    Args:
        struct: declares the keys; messages quote the `msgspec.Meta` descriptions of its fields.

    Raises:
        CaseError: not a table, an unknown key, a missing key, or a value of another type or shape
            than described.
    """
    section, fields = Section(file, key, value), _fields(struct)
    section.require_keys(fields)
    table = section.table
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


def description(annotation: Any) -> str:
    """Return the description in `typing.Annotated[type, msgspec.Meta(description=...)]`."""
    for part in get_args(annotation):
        if isinstance(part, msgspec.Meta) and part.description:
            return part.description
        if get_origin(part) is Annotated:  # of Annotated[...] | None
            return description(part)
    raise TypeError(f"{annotation} has no description")
