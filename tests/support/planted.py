"""Whether everything that a result says is in every form of it.

Each word and each number of a result is changed in turn, and every form is written again: the new
word, or the new number to the digits that the form has, must stand there, and stood not before.
"""

from __future__ import annotations

import base64
import copy
import dataclasses
import enum
import html
import io
import math
import re
import zlib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec
import numpy as np
from jinja2 import UndefinedError
from kincheck.core.harness.record import to_json

MARK = "qvx7"
"""A word that stands nowhere."""
TIMES = 1.7
"""What numbers are changed by: beyond the one digit of some tables."""
DEGREE = math.degrees(1.0)
UNITS = 1.0, 1e3, 1e-3, 1e2, 1e6, DEGREE, 1e3 * DEGREE, 1e-3 * DEGREE, 1e2 * DEGREE, 1.0 / DEGREE
"""Of tables and pages: mm, deg, kN, %, deg/kN and the like, of numbers in SI."""
NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
Path = tuple[Any, ...]
Forms = Mapping[str, Callable[[Any], str]]


def missing(result, forms, ours=(), of=".*"):
    """Return the forms that do not say something, by its place in the result.

    Args:
        ours: keys that are no part of a place: names of cases and outputs.
        of: pattern of the places that are looked at.
    """
    before = {name: Counter(NUMBER.findall(form(result))) for name, form in forms.items()}
    found: dict[str, list[str]] = {}
    for place, (path, value) in _places(result, ours).items():
        if not re.fullmatch(of, place):
            continue
        new = f"{value} {MARK}" if isinstance(value, str) else _other(value)
        changed = _changed(result, path, new)
        for name, write in forms.items():
            try:
                text = write(changed)
            except (ValueError, LookupError, UndefinedError):  # a name that the form looks up
                continue
            said = MARK in text if isinstance(value, str) else _appears(new, text, before[name])
            if not said:
                found.setdefault(place, []).append(name)
    return found


def unfilled(result):
    """Return the fields of a result that are empty in all of its parts, by their class."""
    named, filled, waiting = set[str](), set[str](), [result]
    while waiting:
        if isinstance(value := waiting.pop(), str):
            continue
        parts = _parts(value)
        waiting += parts.values()
        if isinstance(value, msgspec.Struct):
            named |= {f"{type(value).__name__}.{key}" for key in parts}
            filled |= {
                f"{type(value).__name__}.{key}"
                for key, each in parts.items()
                if each is not None and each is not msgspec.UNSET and each not in ({}, [], "")
            }
    return named - filled


def text_of_page(page):
    """Return a page as text, with the packed data of its figures."""
    packed = re.findall(r">([A-Za-z0-9+/=]{200,})<", page)
    data = [zlib.decompress(base64.b64decode(each)).decode() for each in packed]
    return "\n".join([html.unescape(page), *data])


def _places(result, ours):
    """Return the first word or number of each place: without the places in lists, records apart."""
    found: dict[str, tuple[Path, Any]] = {}
    for path, names, value in _leaves(result):
        place = ".".join(name for name in names if name not in ours)
        found.setdefault(place, (path, value))
    return found


def _leaves(value, path=(), names=()):
    if value is None or isinstance(value, enum.Enum | bool):
        return
    if isinstance(value, str | int | float):
        yield path, names, value
        return
    for key, each in _parts(value).items():
        said = () if isinstance(key, int) else (str(key),)
        if isinstance(key, int) and hasattr(each, "engine"):
            said = (f"<{each.engine}>",)
        yield from _leaves(each, (*path, key), (*names, *said))


def _parts(value):
    if isinstance(value, msgspec.Struct):
        return msgspec.structs.asdict(value)
    if dataclasses.is_dataclass(value):
        return {each.name: getattr(value, each.name) for each in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, np.ndarray):
        return dict(enumerate(value.tolist()))
    return dict(enumerate(value)) if isinstance(value, Sequence) else {}


def _other(value):
    new = type(value)(TIMES * value)
    return new + 1 if new == value else new


def _changed(value, path, new):
    """Return a copy with one part changed."""
    if not path:
        return new
    key, *rest = path
    new = _changed(_parts(value)[key], tuple(rest), new)
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


def _appears(value, text, before):
    fresh = Counter(NUMBER.findall(text)) - before
    return any(_rounds(size * value, each) for each in fresh for size in UNITS)


def _rounds(value, text):
    """Return whether a text is a number rounded to its digits, of either sign."""
    digits, _, exponent = text.lower().partition("e")
    last = 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))
    return float(text) != 0.0 and abs(abs(float(text)) - abs(value)) <= 0.51 * last


def on_terminal(write):
    def form(result):
        write(result, text := io.StringIO())
        return text.getvalue()

    return form


def as_json(result):
    return to_json(result).decode()


def unexplained(found, exempt):
    """Places that a form lacks without a reason, and reasons that no form needs any more."""
    lacking = {(place, form) for place, forms in found.items() for form in forms}
    excused = [
        {
            (place, form)
            for place, form in lacking
            if re.fullmatch(of, place) and form in forms.split()
        }
        for of, forms, *_ in exempt
    ]
    needless = [each for each, pairs in zip(exempt, excused, strict=True) if not pairs]
    return sorted(lacking.difference(*excused)), needless
