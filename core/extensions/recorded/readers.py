"""Recordings: columns of numbers over samples in a file of another program. They are read of
tables, records of JSON, motions of OpenSim (.mot, .sto), results of Adams in XML (.res), and
MAT-files: results of Modelica tools (level 4), and matrices and structs of MATLAB (level 5).
"""

from __future__ import annotations

import io
import re
import struct
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from math import prod
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from ...case.curves import Printed
from ...case.io.document import decimal, fault, read_bytes, read_text, shown
from ...case.io.reference_samples import RATES, layout_of, read_table, samples_of
from ...case.io.table import Table, unit_of_head
from ...errors import MOST_NAMED, CaseError, brief, remedy, shortened
from ...trajectory import Array
from ..xml.element import Element, parse_xml
from .records import JSON, table_of_json


@dataclass(frozen=True)
class Head:
    """The head of a column.

    Attributes:
        unit: as the file writes it; empty without one.
        part: names of the body whose pose the column is of; empty if the format does not say.
    """

    name: str
    unit: str = ""
    part: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Column:
    """Numbers in the unit of the file, NaN for gaps, and half a unit of the last digit of each."""

    head: Head
    values: Array
    half: Array


Choose: TypeAlias = Callable[[Sequence[Head]], Sequence[int]]
"""Choice of the columns to read, by their heads."""


@dataclass(frozen=True, eq=False)
class Recording:
    """The chosen columns of a file.

    Attributes:
        program: its writer, by the file.
        angle: unit of angles whose column has none, if the file has it.
        notes: for the user, on the reading.
        kinematic: whether it is a kinematic analysis of Adams, of driven freedoms alone.
    """

    file: Path
    columns: Mapping[int, Column]
    program: str = ""
    angle: str = ""
    notes: Sequence[str] = ()
    kinematic: bool = False


def column_of(file: Path, where: str, head: Head, cells: Iterable[str]) -> Column:
    """Return a column of printed numbers, gaps among them.

    Raises:
        CaseError: a cell is no number.
    """
    printed, values = Printed(), list[float]()
    for k, cell in enumerate(cells):
        try:
            values.append(decimal(cell))
        except ValueError:
            expected = "expected a number. Correct it"
            raise fault(file, f"{where} {k}", f"found {shown(cell)}, {expected}") from None
        printed.add(cell)
    found = np.array(values)
    return Column(
        head,
        np.where(np.isfinite(found), found, np.nan),
        printed.half(np.nan_to_num(found), alone=True),
    )


_UNIT = re.compile(r"\[([^\]|]*)")
_V73 = (b"MATLAB 7.3", b"\x89HDF")
# Level 5: bytes of the head, types of elements, classes of matrices that hold others, their depth.
_HEAD, _MATRIX, _COMPRESSED, _NESTING, _DEEPEST = 128, 14, 15, (1, 2, 3), 20
_INT8, _INT32, _UINT32 = 1, 5, 6
_NUMBERS = (1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18)


def _of_mat(file: Path, choose: Choose) -> Recording:
    data = read_bytes(file, LARGEST_FILE, LESS)
    if data.startswith(_V73):
        raise fault(file, "", "found a MAT-file of version 7.3. In MATLAB: save(..., '-v7')")
    try:
        # scipy tells the level so
        if data[:4].count(0) == 0 and _unpacked_size(data) > LARGEST_FILE:
            raise fault(file, "", f"found more than {LARGEST_FILE} bytes when unpacked: {LESS}")
        scipy_io: Any = import_module("scipy.io")  # slow to import
        found: dict[str, Any] = scipy_io.loadmat(io.BytesIO(data), chars_as_strings=False)
        modelica = "Aclass" in found and "dataInfo" in found
        series = [*(_of_modelica(found) if modelica else _of_matlab(found))]
    except CaseError:
        raise
    except Exception as error:  # scipy raises many errors for a damaged file
        what = brief(f"{type(error).__name__}: {error}")
        expected = "expected one of MATLAB (save with -v7) or of a Modelica tool. Or give CSV"
        raise fault(file, "", f"found no readable MAT-file ({what}), {expected}") from None
    chosen = choose([head for head, _ in series])
    columns = {k: Column(series[k][0], *_numbers(series[k][1])) for k in chosen}
    return Recording(file, columns, "Modelica" if modelica else "MATLAB")


def _unpacked_size(data: bytes) -> int:
    """Return the size of the compressed elements of level 5, unpacked to just above the largest.

    Raises:
        ValueError: with such an element scipy 1.17 ends the process or takes all memory.
    """
    total = 0
    order = "<" if data[126:128] == b"IM" else ">"
    for kind, part in _elements(data[_HEAD:], order):
        if kind == _COMPRESSED:
            part = zlib.decompressobj().decompress(part, LARGEST_FILE + 1 - total)
            total += len(part)
            if total > LARGEST_FILE:
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
    tables = dict[str, Any]()
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


LARGEST_FILE = 256_000_000
LESS = "write fewer samples or channels"
_OPENSIM, _END = (".mot", ".sto"), "endheader"
_DEGREES = re.compile(r"^\s*inDegrees\s*=\s*(yes|no)\s*$", re.IGNORECASE | re.MULTILINE)
# Blocks of an analysis that are no motion.
_NO_MOTION = ("modelInput", "initialConditions")
_POSE = "_XFORM"
_LONG = (
    *("case", "engine", "mode", "output", "unit", "sample", "driver", "driver_unit"),
    *("driver_value", "position", "velocity", "acceleration"),
)

UNREAD: Mapping[str, str] = {
    ".abf": "a binary result of MotionSolve. In HyperGraph, export the curves as CSV",
    ".mrf": "a binary result of MotionSolve. In HyperGraph, export the curves as CSV",
    ".sbr": "a binary result of Simpack. In its PostProcessor, export the channels as CSV",
    ".req": "a request file of Adams. Say RESULTS/XRF in the deck, which writes XML (.res)",
    ".gra": "a graphics file of Adams. Say RESULTS/XRF in the deck, which writes XML (.res)",
    ".mdf": "a measurement file (MDF). Export the channels as CSV",
    ".mf4": "a measurement file (MDF). Export the channels as CSV",
    ".fmu": "a model, not its results. Say --fmu FILE",
}
"""Formats that are not read, and the export to choose, by suffix."""


def read_recording(
    file: Path, choose: Choose, *, analysis: str | None = None, sheet: str | None = None
) -> Recording:
    """Read a recording of any known format.

    Args:
        analysis: name of one of several analyses of Adams results.
        sheet: name of a sheet of a workbook with several.

    Raises:
        CaseError: the file is unreadable, of another format, or holds several analyses.
    """
    suffix = file.suffix.lower()
    if suffix in UNREAD:
        raise fault(file, "", f"found {UNREAD[suffix]}")
    if suffix == ".res":
        return _of_adams(file, choose, analysis)
    if analysis is not None:
        raise fault(file, "--analysis", "found for a file without analyses. Leave it out")
    if suffix == ".mat":
        return _of_mat(file, choose)
    return _of_table(file, choose, sheet)


def _of_table(file: Path, choose: Choose, sheet: str | None) -> Recording:
    suffix, notes = file.suffix.lower(), list[str]()
    opensim = suffix in _OPENSIM
    if suffix in JSON and sheet is None:
        table, notes = table_of_json(file, LARGEST_FILE, LESS)
    else:
        table = read_table(file, sheet, "--sheet NAME", _END)
    table = _wide_table(table)
    layout = layout_of(table)
    chosen = choose([Head(*unit_of_head(file, layout.where, text)) for text in layout.heads])
    samples = samples_of(table, chosen, remarks=True, gaps=True)
    columns = dict[int, Column]()
    for k, values, printed, text in zip(
        chosen, samples.numbers.T, samples.printed, samples.columns, strict=True
    ):
        columns[k] = Column(
            # the text has the unit of a row of units
            Head(*unit_of_head(file, layout.where, text)),
            values,
            printed.half(np.nan_to_num(values), alone=True),
        )
    if rows := shortened(samples.left_out, MOST_NAMED):
        notes.append(f"{file}: left out the rows without samples: {rows}")
    stated = _DEGREES.search(read_text(file, LARGEST_FILE, LESS)) if opensim else None
    if stated is None:
        return Recording(file, columns, "OpenSim" * opensim, notes=notes)
    angle = "deg" if stated[1].lower() == "yes" else "rad"
    note = f"{file}: angles without a unit in {angle}, as its head says"
    return Recording(file, columns, "OpenSim", angle, [note, *notes])


def _wide_table(table: Table) -> Table:
    """Return a table with a row for each output, as `run --csv --long` writes, with a row for each
    sample; others as they are.

    Raises:
        CaseError: it has several cases.
    """
    rows = table.rows()
    heads = [str(cell).strip() for cell in next(rows, ("", ()))[1]]
    if not {*_LONG} <= {*heads}:
        return table
    samples, columns = dict[tuple[str, ...], dict[str, str]](), dict[str, None]()
    for _, cells in rows:
        at = dict(zip(heads, map(str, cells), strict=False))
        name, unit = at["output"], at["unit"]
        found = {f"{at['driver']} [{at['driver_unit']}]": at["driver_value"]}
        for what, time in RATES.items():
            value = at[what.removeprefix(".") or "position"]
            if value or not what:
                found[f"{name}{what} [{unit}{time}]"] = value
        columns |= dict.fromkeys(found)
        key = at["case"], at["engine"], at["mode"], at["sample"]
        samples.setdefault(key, {}).update(found)
    cases = [*dict.fromkeys(case for case, *_ in samples)]
    if len(cases) > 1:
        listed = shortened([shown(case) for case in cases], MOST_NAMED)
        problem = f"found the cases {listed}, expected one. Write a file for each"
        raise fault(table.file, "case", problem)
    body = [
        (f"sample {k}", [row.get(name, "") for name in columns]) for (*_, k), row in samples.items()
    ]
    return replace(table, lines=(), sheet=[("line 1", [*columns]), *body])


def _of_adams(file: Path, choose: Choose, wanted: str | None) -> Recording:
    text = read_text(file, LARGEST_FILE, LESS)
    if not text.lstrip().startswith("<"):
        what = "no XML, as of old results of Adams" if text.strip() else "an empty file"
        advice = "Say RESULTS/XRF in the deck, which writes XML"
        raise fault(file, "", f"found {what}, expected results in XML. {advice}")
    root = parse_xml(file, text)
    if root.tag != "Results":
        raise root.fault("found another document, expected <Results> of Adams. Give its .res")
    found = {
        (analysis.attributes.get("name", ""), data.attributes.get("name", "")): (analysis, data)
        for analysis in root.findall("Analysis")
        for data in analysis.findall("Data")
        if not data.attributes.get("name", "").startswith(_NO_MOTION)
    }
    names = {key: key[1] for key in found}
    if len({*names.values()}) < len(names):
        names = {key: "/".join(key) for key in found}
    chosen = [key for key, name in names.items() if wanted in (None, name, key[0])]
    if len(chosen) != 1:
        listed = ", ".join(map(shown, names.values())) or "none"
        advice = f": {remedy(wanted, names.values())}" if wanted else ". Say --analysis NAME"
        raise fault(file, "--analysis", f"found the analyses {listed}, expected one{advice}")
    analysis, data = found[chosen[0]]
    heads = _heads(analysis)
    steps = [(step, step.text.split()) for step in data.findall("Step")]
    for step, numbers in steps:
        if len(numbers) < max(heads, default=0):
            problem = f"found {len(numbers)} numbers, expected {max(heads)}, one a component"
            raise step.fault(f"{problem}. Write the results anew")
    ids = [*heads]
    columns = {
        k: column_of(file, "step", heads[ids[k]], (row[ids[k] - 1] for _, row in steps))
        for k in choose([*heads.values()])
    }
    note = f"{file}: read the analysis {names[chosen[0]]}"
    program = " ".join(analysis.attributes.get("Solver", "").split())
    kinematic = chosen[0][1].lower().startswith("kinematic")
    return Recording(file, columns, program or "Adams", notes=[note], kinematic=kinematic)


def _heads(analysis: Element) -> Mapping[int, Head]:
    """Return the heads of components by their ids."""
    found = dict[int, Head]()
    for entity in (each for map_ in analysis.findall("StepMap") for each in map_.findall("Entity")):
        name = entity.attributes.get("name", "")
        part = (
            entity.attributes.get("entity", ""),
            name.removesuffix(_POSE),
            f"PART_{entity.attributes.get('objectId', '')}",
        )
        for each in entity.findall("Component"):
            number = each.attributes.get("id", "")
            if not (number.isascii() and number.isdigit() and 0 < len(number) < 9 and int(number)):
                problem = f"id: found {shown(number)}, expected a whole number from 1"
                raise each.fault(f"{problem}. Write the results anew")
            unit = each.attributes.get("unitsValue", "").replace("**", "^").replace("sec", "s")
            head = f"{name}.{each.attributes.get('name', '')}"
            posed = part if name.endswith(_POSE) else ()
            found[int(number)] = Head(head, "" if unit == "no_units" else unit, posed)
    return found
