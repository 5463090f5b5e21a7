"""Readers of MAT-files: results of Modelica tools (level 4), and matrices and structs of MATLAB
(level 5).
"""

from __future__ import annotations

import io
import re
import struct
import zlib
from collections.abc import Iterator, Mapping
from importlib import import_module
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from ..case.io.document import fault
from ..errors import CaseError, brief
from ..trajectory import Array
from .recording import Choose, Column, Head, Recording

_UNIT = re.compile(r"\[([^\]|]*)")
_V73 = (b"MATLAB 7.3", b"\x89HDF")
# Level 5: bytes of the head, types of elements, classes of matrices that hold others, their depth.
_HEAD, _MATRIX, _COMPRESSED, _NESTING, _DEEPEST = 128, 14, 15, (1, 2, 3), 20
_INT8, _INT32, _UINT32 = 1, 5, 6
_NUMBERS = (1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18)


def of_mat(file: Path, choose: Choose, data: bytes, largest: int, less: str) -> Recording:
    """Read a MAT-file.

    Args:
        largest: most bytes of its contents when unpacked.
        less: what to do with a larger one.

    Raises:
        CaseError: it is of another version, damaged, or too large.
    """
    if data.startswith(_V73):
        raise fault(file, "", "found a MAT-file of version 7.3; in MATLAB: save(..., '-v7')")
    try:
        # scipy tells the level so
        if data[:4].count(0) == 0 and _unpacked(data, largest) > largest:
            raise fault(file, "", f"found more than {largest} bytes when unpacked; {less}")
        scipy_io: Any = import_module("scipy.io")  # slow to import
        found: dict[str, Any] = scipy_io.loadmat(io.BytesIO(data), chars_as_strings=False)
        modelica = "Aclass" in found and "dataInfo" in found
        series = [*(_of_modelica(found) if modelica else _of_matlab(found))]
    except CaseError:
        raise
    except Exception as error:  # scipy raises many errors for a damaged file
        what = brief(f"{type(error).__name__}: {error}")
        expected = "expected one of MATLAB (save with -v7) or of a Modelica tool; or give CSV"
        raise fault(file, "", f"found no readable MAT-file ({what}), {expected}") from None
    chosen = choose([head for head, _ in series])
    columns = {k: Column(series[k][0], *_numbers(series[k][1])) for k in chosen}
    return Recording(file, columns, "Modelica" if modelica else "MATLAB")


def _unpacked(data: bytes, largest: int) -> int:
    """Return the size of the compressed elements of level 5, unpacked to just above the largest.

    Raises:
        ValueError: with such an element scipy 1.17 ends the process or takes all memory.
    """
    total = 0
    order = "<" if data[126:128] == b"IM" else ">"
    for kind, part in _elements(data[_HEAD:], order):
        if kind == _COMPRESSED:
            part = zlib.decompressobj().decompress(part, largest + 1 - total)
            total += len(part)
            if total > largest:
                break
            for inner, each in _elements(part, order):
                _require_sound_matrix(inner, each, order, 0)
        else:
            _require_sound_matrix(kind, part, order, 0)
    return total


def _require_sound_matrix(kind: int, data: bytes, order: str, depth: int) -> None:
    if kind != _MATRIX or depth > _DEEPEST:
        raise ValueError(f"an element of type {kind} at depth {depth}")
    if not data:
        return
    (flags, first), (size, dimensions), (text, _), *parts = _elements(data, order)
    if (flags, len(first), size, text) != (_UINT32, 8, _INT32, _INT8):
        raise ValueError("a matrix without its head")
    nesting = struct.unpack(f"{order}I", first[:4])[0] & 255 in _NESTING
    numbers = struct.unpack(f"{order}{len(dimensions) // 4}i", dimensions)
    if min(numbers) < 0 or (nesting and prod(numbers) > len(parts)):
        raise ValueError(f"a matrix of {' x '.join(map(str, numbers))}")
    for inner, each in parts:
        if nesting and inner == _MATRIX:
            _require_sound_matrix(inner, each, order, depth + 1)
        elif inner not in _NUMBERS:
            raise ValueError(f"numbers of type {inner}")


def _elements(data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Yield types and contents of elements; small ones are within their tag."""
    place = 0
    while place < len(data):
        kind, count = struct.unpack_from(f"{order}II", data, place)
        small = kind >> 16
        kind, count = (kind & 0xFFFF, small) if small else (kind, count)
        start = place + (4 if small else 8)
        if start + count > (place + 8 if small else len(data)):
            raise ValueError("an element is cut off")
        yield kind, data[start : start + count]
        padding = 0 if small or kind == _COMPRESSED else -count % 8
        place = place + 8 if small else start + count + padding


def _numbers(values: Any) -> tuple[Array, Array]:
    """Return numbers, and half the distance of those of single precision."""
    single = values.dtype == np.float32
    exact = values.astype(np.float64)
    known = np.where(np.isfinite(exact), exact, np.nan)
    half = 0.5 * np.spacing(np.abs(values)).astype(np.float64) if single else np.zeros(len(values))
    return known, half


def _of_modelica(found: Mapping[str, Any]) -> Iterator[tuple[Head, Any]]:
    """Yield heads and values by the layout of Dymola and OpenModelica; constants are repeated."""
    kind = ["".join(row).rstrip("\0 ") for row in found["Aclass"]]
    turned = len(kind) > 3 and kind[3] == "binTrans"

    def table(name: str) -> Any:
        return found[name].T if turned else found[name]

    names, texts = (
        ["".join(row).rstrip("\0 ") for row in table(key)] for key in ("name", "description")
    )
    count = len(table("data_2"))
    for name, text, (block, column, *_) in zip(
        names, texts, table("dataInfo").tolist(), strict=True
    ):
        values = table(f"data_{int(block) or 2}")[:, abs(int(column)) - 1]
        values = -values if column < 0 else values
        unit = _UNIT.search(text)
        if block == 1:  # constants have their first and last value
            values = np.repeat(values[:1], count)
        yield Head(name, unit[1].strip() if unit else ""), values


def _of_matlab(found: Mapping[str, Any]) -> Iterator[tuple[Head, Any]]:
    """Yield columns of matrices and of the fields of structs, those of one length."""
    tables: dict[str, Any] = {}
    for name, each in found.items():
        if name.startswith("__"):
            continue
        if each.dtype.names and each.size == 1:
            tables |= {f"{name}.{field}": each[field].item() for field in each.dtype.names}
        else:
            tables[name] = each
    for name, each in tables.items():
        numbers: Any = np.asarray(each)
        # a matrix without rows may state any number of columns
        if numbers.dtype.kind in "fiu" and numbers.ndim == 2 and numbers.size:
            numbers = numbers.T if numbers.shape[0] == 1 else numbers
            for k in range(numbers.shape[1]):
                yield Head(name if numbers.shape[1] == 1 else f"{name}({k + 1})"), numbers[:, k]
