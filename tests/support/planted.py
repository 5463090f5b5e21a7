"""Whether everything that a result says is in every form of it.

Each word and each number of a result is changed in turn, and every form is written again: the new
word, or the new number to the digits that the form has, must stand there, and must not have before.
"""

from __future__ import annotations

import base64
import copy
import dataclasses
import enum
import html
import re
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import msgspec
import numpy as np

MARK = "qvx7"
"""A word that stands nowhere."""
TIMES = 1.7
"""What numbers are changed by: far beyond the single digit of some tables."""
FACTORS = 1.0, 1e3, 1e-3, 1e2, 1e6, 180.0 / np.pi, 1e3 * 180.0 / np.pi, 1e-3 * 180.0 / np.pi
"""Units of tables and pages, of numbers in SI."""
NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Yield the path and value of every word and number; of lists and tables, all entries."""
    if isinstance(value, enum.Enum | bool) or value is None:
        return
    if isinstance(value, str | int | float):
        yield path, value
        return
    for key, each in _parts(value):
        yield from leaves(each, (*path, key))


def _parts(value: Any) -> Iterator[tuple[Any, Any]]:
    if isinstance(value, msgspec.Struct):
        yield from ((name, getattr(value, name)) for name in value.__struct_fields__)
    elif dataclasses.is_dataclass(value):
        yield from ((each.name, getattr(value, each.name)) for each in dataclasses.fields(value))
    elif isinstance(value, Mapping):
        yield from value.items()
    elif isinstance(value, np.ndarray):
        yield from enumerate(value.tolist())
    elif isinstance(value, Sequence):
        yield from enumerate(value)


def changed(value: Any, path: tuple[Any, ...], new: Any) -> Any:
    """Return a copy with one part changed."""
    if not path:
        return new
    key, *rest = path
    old = dict(_parts(value))[key]
    new = changed(old, tuple(rest), new)
    if isinstance(value, msgspec.Struct):
        return msgspec.structs.replace(value, **{key: new})
    if dataclasses.is_dataclass(value):
        value = copy.copy(value)
        object.__setattr__(value, key, new)
        return value
    if isinstance(value, Mapping):
        return {**value, key: new}
    if isinstance(value, np.ndarray):
        value = value.copy()
        value[key] = new
        return value
    return type(value)([*value[:key], new, *value[key + 1 :]])


def pattern(path: tuple[Any, ...], keys: Sequence[str]) -> str:
    """Return a path without the places in lists, and without the names of cases and outputs."""
    return ".".join(str(each) for each in path if not isinstance(each, int) and (each not in keys))


def text_of_page(page: str) -> str:
    """Return a page with the data of its scripts as text."""
    packed = re.findall(r">([A-Za-z0-9+/=]{200,})<", page)
    data = [zlib.decompress(base64.b64decode(each)).decode() for each in packed]
    return "\n".join([html.unescape(page), *data])


def holes(
    result: Any, forms: Mapping[str, Callable[[Any], str]], keys: Sequence[str] = ()
) -> dict[str, list[str]]:
    """Return the words and numbers that a form lacks: forms by pattern."""
    before = {name: form(result) for name, form in forms.items()}
    counts = {name: Counter(NUMBER.findall(text)) for name, text in before.items()}
    found: dict[str, list[str]] = {}
    seen: set[str] = set()
    for path, value in leaves(result):
        name = pattern(path, keys)
        if name in seen:
            continue
        seen.add(name)
        word = isinstance(value, str)
        new = f"{value} {MARK}" if word else type(value)(TIMES * value) or type(value)(1)
        if new == value:
            new += 1
        try:
            other = changed(result, path, new)
        except Exception as error:
            print("cannot change", name, error)
            continue
        for form, write in forms.items():
            try:
                text = write(other)
            except Exception as error:
                found.setdefault(name, []).append(f"{form}: {type(error).__name__} {error}"[:100])
                continue
            there = MARK in text if word else _appears(new, text, counts[form])
            if not there:
                found.setdefault(name, []).append(form)
    return found


def _appears(value: float, text: str, before: Counter[str]) -> bool:
    fresh = Counter(NUMBER.findall(text)) - before
    return any(_rounds_to(size * value, each) for each in fresh for size in FACTORS)


def _rounds_to(value: float, text: str) -> bool:
    digits = re.sub(r"[eE].*", "", text)
    _, _, decimals = digits.partition(".")
    exponent = int(re.search(r"[eE]([-+]?\d+)$", text)[1]) if re.search(r"[eE]", text) else 0
    last = 10.0 ** (exponent - len(decimals))
    return abs(abs(float(text)) - abs(value)) <= 0.51 * last and float(text) != 0.0
