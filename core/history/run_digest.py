"""What makes two runs the same: a digest of cases and settings by their content."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np


def digest(*things: Any) -> str:
    """SHA-256 of data: dataclasses by their class and fields, arrays by their bits, and what these
    are made of.

    Not of their pickle: that one changes with which equal parts happen to be one object. What else
    is in there counts by its text; where that has an address, no two digests are equal.
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
