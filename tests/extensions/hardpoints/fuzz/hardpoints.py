"""Hardpoint files: Project Chrono (JSON with comments), Adams/Car blocks, plain tables, workbooks
and the cells of their sheets, trees in YAML and JSON, and assignments of scripts, onto a template.
"""

import math
from contextlib import suppress
from dataclasses import replace

from kincheck.core.case.case import Case
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.io.table import Cell, Table
from kincheck.core.case.models.files import load
from kincheck.core.extensions.hardpoints.read import case_of_hardpoints
from kincheck.core.extensions.hardpoints.rows import read_rows
from kincheck.core.extensions.hardpoints.templates import TEMPLATES

from ....fuzz.fuzzing import FOLDER, changing, read_or_refused, written
from ....fuzz.keeping import seeds_in_file
from ....fuzz.trees import changed_json, changed_lines

LONGEST = 8000
ROLES = [
    name
    for template in TEMPLATES.values()
    for role in template.roles
    for name in (role.name, *role.also)
]
KEYS = """name x y z mm cm inch [HARDPOINT] [UNITS] {hardpoint_name symmetry x_value y_value z_value} left/right single right LENGTH
= Type Template Suspension Spindle COM Location // /* */ $ # units: axes: rearward,right,up
hardpoints left right front rear position type type: = [1,2,3]; _x .y z= [mm] value wheel offset axle_inboard axle_outboard tire
units axes left_ _FL CHAS_LowFor =A1+1 sep=; (VARIANTS) 1,5 -1.234,5 1,234 "2,5" point;"""  # noqa: E501
WORDS = (
    *KEYS.split(),
    *ROLES,
    *TEMPLATES,
    *(name for each in TEMPLATES.values() for name in each.also),
)


SHEET, YAML, SCRIPT = b"sheet\n", b"---\n", b"%"
SAID = Supplied("double_wishbone", "mm", "adams")
WORD_OF = {b"strut": "mcpherson", b"trailing": "five_link", b"rocker": "pushrod_knuckle"}
"""Word of a table -> its template."""


def one(data: bytes) -> None:
    """Read one input as the kind of file that it begins like."""
    if data.startswith(SHEET):
        return read_or_refused(lambda: of_cells(data.removeprefix(SHEET)))
    template = next((of for word, of in WORD_OF.items() if word in data), "double_wishbone")
    start, name, said = data.lstrip()[:2], "car.csv", SAID
    if data.startswith(YAML):
        name, said = "car.yaml", replace(SAID, sheet="front" if b"\nrear:" in data else None)
    elif data.startswith(SCRIPT):
        name = "car.m"
    elif data.startswith(b"PK"):
        name = "car.xlsx"
    elif start in (b"[{", b"[[") or b'"hardpoints"' in data:
        name = "tree.json"
    elif start[:1] in (b"{", b"/"):
        name, said = "car.json", Supplied(None if b"Template" in data else "mcpherson")
    elif start[:1] == b"[" or b"[HARDPOINT]" in data:
        name, said = "car.sub", Supplied(template)
    else:
        units, axes = (None if b"unit" in data else "mm"), (None if b"axes" in data else "adams")
        said = Supplied(template, units, axes)
    return read_or_refused(lambda: load(written(name, data), said))


def of_cells(data: bytes) -> Case:
    """The case of a sheet's cells, without the program that makes a workbook of them."""
    lines = (line for line in data.decode("latin-1").split("\n") if line.strip())
    rows = [(f"row {k}", [*map(cell_of, line.split("\t"))]) for k, line in enumerate(lines, 1)] or [
        ("row 1", [""])
    ]
    table = read_rows(Table(FOLDER / "car.xlsx", sheet=rows), "Excel", {}, Supplied())
    return case_of_hardpoints(table, Supplied("double_wishbone", None, None))


def cell_of(text: str) -> Cell:
    """A number where the text is one that a sheet can hold."""
    with suppress(ValueError):
        if math.isfinite(number := float(text)):
            return number
    return text.strip()


def seeds() -> list[bytes]:
    """The files of the tests, and their points as tables, trees, scripts and a workbook."""
    return seeds_in_file("hardpoints")


mutate = changing(changed_json, changed_lines, words=WORDS)
