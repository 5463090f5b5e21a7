"""The identity of a run: a digest of the content of cases and settings."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np


def digest(*things: Any) -> str:
    """Return the SHA-256 digest of data: dataclasses by class and fields, arrays by their bits.

    A pickle is unsuitable: it depends on which equal parts are one object. Objects of other types
    enter by their text; a text with a memory address makes every digest different.
    """
    whole = hashlib.sha256()
    for piece in _pieces(things):
        whole.update(piece)
    return whole.hexdigest()


def _pieces(thing: Any) -> Iterator[bytes]:
    if isinstance(thing, np.ndarray):
        values: Any = np.ascontiguousarray(thing)  # pyright: ignore
        yield f"array{values.shape}{values.dtype.str}".encode()
        yield values.tobytes()
    elif is_dataclass(thing) and not isinstance(thing, type):
        yield f"({type(thing).__qualname__}".encode()
        for field in fields(thing):
            yield f",{field.name}=".encode()
            yield from _pieces(getattr(thing, field.name))
        yield b")"
    elif isinstance(thing, Mapping):
        yield b"{"
        for key, value in thing.items():  # pyright: ignore
            yield from _pieces(key)
            yield from _pieces(value)
        yield b"}"
    elif isinstance(thing, Sequence) and not isinstance(thing, str | bytes):
        yield b"["
        for each in thing:  # pyright: ignore
            yield from _pieces(each)
        yield b"]"
    else:
        yield f"{type(thing).__name__}:{thing!r};".encode("utf-8", "surrogatepass")
