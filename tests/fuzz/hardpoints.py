"""Hardpoint files: Project Chrono (JSON with comments), Adams/Car blocks, plain tables, workbooks
and the cells of their sheets, trees in YAML and JSON, and assignments of scripts, onto a template.
"""

import importlib.util
import json
import math
from contextlib import suppress
from dataclasses import replace
from io import BytesIO
from pathlib import Path

from kincheck.core.case.case import Case
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.io.table import Cell, Table
from kincheck.core.case.models.files import load
from kincheck.core.case.models.hardpoints.read import case_of_hardpoints
from kincheck.core.case.models.hardpoints.rows import read_rows
from kincheck.core.case.models.hardpoints.templates import TEMPLATES

from .fuzzing import FOLDER, changing, read_or_refused, written
from .trees import changed_json, changed_lines

LONGEST = 8000
DATA = Path(__file__).parent.parent / "data" / "hardpoints"
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


def one(data: bytes) -> None:
    """Read one input as the kind of file that it begins like."""
    if data.startswith(SHEET):
        return read_or_refused(lambda: of_cells(data.removeprefix(SHEET)))
    if data.startswith(YAML):
        said = replace(SAID, sheet="front" if b"\nrear:" in data else None)
        return read_or_refused(lambda: load(written("car.yaml", data), said))
    if data.startswith(SCRIPT):
        return read_or_refused(lambda: load(written("car.m", data), SAID))
    if data.startswith(b"PK"):
        said = Supplied("double_wishbone", "mm", "adams")
        return read_or_refused(lambda: load(written("car.xlsx", data), said))
    start = data.lstrip()[:1]
    if data.lstrip().startswith((b"[{", b"[[")) or b'"hardpoints"' in data:
        return read_or_refused(lambda: load(written("tree.json", data), SAID))
    if start in (b"{", b"/"):
        return read_or_refused(
            lambda: load(
                written("car.json", data),
                Supplied(template=None if b"Template" in data else "mcpherson"),
            )
        )
    template = (
        "mcpherson"
        if b"strut" in data
        else "five_link"
        if b"trailing" in data
        else "pushrod_knuckle"
        if b"rocker" in data
        else "double_wishbone"
    )
    if start == b"[" or b"[HARDPOINT]" in data:
        return read_or_refused(lambda: load(written("car.sub", data), Supplied(template)))
    said = Supplied(
        template, None if b"unit" in data else "mm", None if b"axes" in data else "adams"
    )
    return read_or_refused(lambda: load(written("car.csv", data), said))


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
    """The files of the tests, and their points as tables."""
    adams = (DATA / "adams_front_suspension.sub").read_text()
    rows = [
        line.replace("'", "").split()
        for line in adams.split("z_value}")[1].split("[")[0].splitlines()
        if line.strip().startswith("'")
    ]
    table = "name,x,y,z\n" + "\n".join(",".join([row[0], *row[-3:]]) for row in rows)
    other = "# units: mm\n# axes: rearward,right,up\n" + table.replace(",", "\t")
    german = "Car\nsep=;\nname;x [mm];y [mm];z [mm];mass;\n" + "\n".join(
        ";".join([row[0], *row[-3:], "1;"]).replace(".", ",") for row in rows
    )
    variants = adams.replace(
        "[PARAMETER]", "(VARIANTS)\n 'lca_outer' 'left/right' 1 2 3\n[PARAMETER]"
    )
    points = {row[0].removeprefix("hpl_"): row[-3:] for row in rows}
    each = [f"{name}_{'xyz'[k]},{at[k]}" for name, at in points.items() for k in range(3)]
    assigned = [f"car.{name} = [{' '.join(at)}]; % [mm]" for name, at in points.items()]
    flow = [f"  {name}: [{', '.join(at)}]" for name, at in points.items()]
    block = [f"  {name}: {{x: {x}, y: {y}, z: {z}}}" for name, (x, y, z) in points.items()]
    config = "config:\n  wheel: {offset: 0, tire: {rim_diameter: 13}}\n"
    tree = {"units": "mm", "hardpoints": {"left": points}}
    listed = [{"name": name, "x": x, "y": y, "z": z} for name, (x, y, z) in points.items()]
    forms = [
        "\n".join(["parameter,value [mm]", *each]),
        "\n".join(each).replace(",", " = "),
        "\n".join(",".join([name, *at]) for name, at in points.items()),
        "\n".join(" ".join([*at, name]) for name, at in points.items()),
        "\n".join(["% units: mm", *assigned]),
        "\n".join(["---", "hardpoints:", *flow, config]),
        "\n".join(["---", "front:", *block, "rear: {lca_front: [1, 2, 3]}"]),
        json.dumps(tree),
        json.dumps(listed),
    ]
    return [
        *(text.encode() for text in forms),
        *(file.read_bytes() for file in sorted(DATA.glob("*.json"))),
        *(text.encode() for text in (adams, table, other, variants)),
        german.removeprefix("Car\n").encode("utf-16"),
        german.replace("sep=;\n", "").encode(),
        SHEET + ("units\tmm\naxes: adams\n" + table.replace(",", "\t")).encode(),
        *workbook([line.split(",") for line in table.splitlines()]),
    ]


def workbook(rows: list[list[str]]) -> list[bytes]:
    """A workbook with these rows; none where openpyxl is missing."""
    if importlib.util.find_spec("openpyxl") is None:
        return []
    openpyxl = importlib.import_module("openpyxl")
    book, stream = openpyxl.Workbook(), BytesIO()
    for row in rows:
        book.active.append([*map(cell_of, row)])
    book.save(stream)
    return [stream.getvalue()]


mutate = changing(changed_json, changed_lines, words=WORDS)
