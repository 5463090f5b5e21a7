"""Readers of recordings: tables, motions of OpenSim (.mot, .sto), results of Adams in XML (.res),
and MAT-files.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..case.io.document import fault, read_bytes, read_text, shown
from ..case.io.reference_samples import layout_of, read_table, samples_of
from ..case.io.table import Table, unit_of_head
from ..case.models.trees.element import Element, parse_xml
from ..errors import MOST_NAMED, remedy, shortened
from .mat_files import of_mat
from .recording import Choose, Column, Head, Recording, column_of

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
    ".abf": "a binary result of MotionSolve; in HyperGraph, export the curves as CSV",
    ".mrf": "a binary result of MotionSolve; in HyperGraph, export the curves as CSV",
    ".sbr": "a binary result of Simpack; in its PostProcessor, export the channels as CSV",
    ".req": "a request file of Adams; say RESULTS/XRF in the deck, which writes XML (.res)",
    ".gra": "a graphics file of Adams; say RESULTS/XRF in the deck, which writes XML (.res)",
    ".mdf": "a measurement file (MDF); export the channels as CSV",
    ".mf4": "a measurement file (MDF); export the channels as CSV",
    ".fmu": "a model, not its results; say --fmu FILE",
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
        raise fault(file, "--analysis", "found for a file without analyses; leave it out")
    if suffix == ".mat":
        return of_mat(file, choose, read_bytes(file, LARGEST_FILE, LESS), LARGEST_FILE, LESS)
    return _of_table(file, choose, sheet)


def _of_table(file: Path, choose: Choose, sheet: str | None) -> Recording:
    opensim = file.suffix.lower() in _OPENSIM
    table = _widened(read_table(file, sheet, "--sheet NAME", _END if opensim else ""))
    layout = layout_of(table)
    chosen = choose([Head(*unit_of_head(file, layout.where, text)) for text in layout.heads])
    samples = samples_of(table, chosen, remarks=True, gaps=True)
    columns: dict[int, Column] = {}
    for k, values, printed, text in zip(
        chosen, samples.numbers.T, samples.printed, samples.columns, strict=True
    ):
        head = Head(*unit_of_head(file, layout.where, text))  # with the unit of a row of units
        columns[k] = Column(head, values, printed.half(np.nan_to_num(values)))
    rows = shortened(samples.left_out, MOST_NAMED)
    notes = [f"{file}: left out the rows without numbers: {rows}"] if rows else []
    if not opensim:
        return Recording(file, columns, notes=notes)
    stated = _DEGREES.search(read_text(file, LARGEST_FILE, LESS))
    if stated is None:
        return Recording(file, columns, "OpenSim", notes=notes)
    angle = "deg" if stated[1].lower() == "yes" else "rad"
    note = f"{file}: angles without a unit in {angle}, as its head says"
    return Recording(file, columns, "OpenSim", angle, [note, *notes])


def _widened(table: Table) -> Table:
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
        for what, time in zip(("", ".velocity", ".acceleration"), ("", "/s", "/s^2"), strict=True):
            value = at[what.removeprefix(".") or "position"]
            if value or not what:
                found[f"{name}{what} [{unit}{time}]"] = value
        columns |= dict.fromkeys(found)
        key = at["case"], at["engine"], at["mode"], at["sample"]
        samples.setdefault(key, {}).update(found)
    cases = [*dict.fromkeys(case for case, *_ in samples)]
    if len(cases) > 1:
        listed = shortened([shown(case) for case in cases], MOST_NAMED)
        problem = f"found the cases {listed}, expected one; write a file for each"
        raise fault(table.file, "case", problem)
    body = [
        (f"sample {k}", [row.get(name, "") for name in columns]) for (*_, k), row in samples.items()
    ]
    return replace(table, lines=(), sheet=[("line 1", [*columns]), *body])


def _of_adams(file: Path, choose: Choose, wanted: str | None) -> Recording:
    text = read_text(file, LARGEST_FILE, LESS)
    if not text.lstrip().startswith("<"):
        what = "no XML, as of old results of Adams" if text.strip() else "an empty file"
        advice = "say RESULTS/XRF in the deck, which writes XML"
        raise fault(file, "", f"found {what}, expected results in XML; {advice}")
    root = parse_xml(file, text)
    if root.tag != "Results":
        raise root.fault("found another document, expected <Results> of Adams; give its .res")
    found = {
        (analysis.attributes.get("name", ""), data.attributes.get("name", "")): (analysis, data)
        for analysis in root.only("Analysis")
        for data in analysis.only("Data")
        if not data.attributes.get("name", "").startswith(_NO_MOTION)
    }
    names = {key: key[1] for key in found}
    if len({*names.values()}) < len(names):
        names = {key: "/".join(key) for key in found}
    chosen = [key for key, name in names.items() if wanted in (None, name, key[0])]
    if len(chosen) != 1:
        listed = ", ".join(map(shown, names.values())) or "none"
        advice = remedy(wanted, names.values()) if wanted else "say --analysis NAME"
        raise fault(file, "--analysis", f"found the analyses {listed}, expected one; {advice}")
    analysis, data = found[chosen[0]]
    heads = _heads(analysis)
    steps = [(step, step.text.split()) for step in data.only("Step")]
    for step, numbers in steps:
        if len(numbers) < max(heads, default=0):
            problem = f"found {len(numbers)} numbers, expected {max(heads)}, one a component"
            raise step.fault(f"{problem}; write the results anew")
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
    found: dict[int, Head] = {}
    for entity in (each for map_ in analysis.only("StepMap") for each in map_.only("Entity")):
        name = entity.attributes.get("name", "")
        part = (
            entity.attributes.get("entity", ""),
            name.removesuffix(_POSE),
            f"PART_{entity.attributes.get('objectId', '')}",
        )
        for each in entity.only("Component"):
            number = each.attributes.get("id", "")
            if not (number.isascii() and number.isdigit() and 0 < len(number) < 9 and int(number)):
                problem = f"id: found {shown(number)}, expected a whole number from 1"
                raise each.fault(f"{problem}; write the results anew")
            unit = each.attributes.get("unitsValue", "").replace("**", "^").replace("sec", "s")
            head = f"{name}.{each.attributes.get('name', '')}"
            posed = part if name.endswith(_POSE) else ()
            found[int(number)] = Head(head, "" if unit == "no_units" else unit, posed)
    return found
