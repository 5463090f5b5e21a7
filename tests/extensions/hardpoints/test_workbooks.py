"""Hardpoints and references in workbooks (.xlsx): values, titles, sheets; and what is refused."""

import re
import struct
import sys
import zipfile
from dataclasses import replace
from datetime import datetime

import numpy as np
import pytest
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.io.readers import LEFT_OUT
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.harness.record import Outcome

from ...case.test_reference import AT, OWN, crank_text, curve
from ...case.test_reference import judged as reference_judged
from ...support.case_texts import complains, refused, write
from .test_hardpoint_dialects import POINTS, SAID, read, table

openpyxl = pytest.importorskip("openpyxl")
HEAD = ["name", "x", "y", "z"]
ROWS = [HEAD, *([name, *at] for name, at in POINTS.items())]


def book(folder, sheets, name="car.xlsx"):
    """A workbook of sheets: rows of values by name, or a function that fills it."""
    made = openpyxl.Workbook()
    made.remove(made.active)
    for title, rows in sheets.items():
        sheet = made.create_sheet(title)
        if callable(rows):
            rows(sheet)
        else:
            for row in rows:
                sheet.append(row)
    file = folder / name
    made.save(file)
    return file


@pytest.fixture
def plain(tmp_path):
    return read(tmp_path, table().replace(";", ",")).mechanism


def merged(sheet):
    sheet.append(["Front suspension, left", None, None, None, "rev 3"])
    sheet.merge_cells("A1:D1")
    sheet.append([])
    sheet.append([None, "Coordinates", None, None])
    sheet.merge_cells("B3:D3")
    for row in ROWS:
        sheet.append([None, *row])
    sheet.append([])
    sheet.append([None, "all from CAD"])
    sheet.sheet_properties.tabColor = "1072BA"


SHEETS = {
    "as it is": {"Front": ROWS},
    "merged titles, blank column": {"Front": merged},
    "empty sheets beside": {"Notes": [["who", "when"], ["me", "now"]], "Empty": [], "Front": ROWS},
    "texts for numbers": {"Front": [HEAD, *([n, *map(str, at)] for n, at in POINTS.items())]},
    "German texts": {
        "Vorn": [HEAD, *([n, *(str(x).replace(".", ",") for x in at)] for n, at in POINTS.items())]
    },
    "columns for rows": {"Front": [*map(list, zip(*ROWS, strict=True))]},
    "units below": {"Front": [HEAD, [None, "mm", "mm", "mm"], *ROWS[1:]]},
    "no head over the names": {"Front": [[None, "X [mm]", "Y [mm]", "Z [mm]"], *ROWS[1:]]},
    "facts above": {"Front": [["units", "mm"], ["axes:", "rearward", "right", "up"], *ROWS]},
    "three decimals": {"Front": [HEAD, *ROWS[1:-1], ["wheel_center", 0.25, -611.75, 228.25]]},
}


@pytest.mark.parametrize("kind", SHEETS)
def test_workbook_layouts(tmp_path, plain, kind):
    assert load(book(tmp_path, SHEETS[kind]), SAID).mechanism == plain


def test_workbook_three_decimals_are_no_thousands(tmp_path):
    """A text 1.125 beside whole numbers may be grouped; a number of a sheet is what it is."""
    rows = [HEAD, *([name, *map(int, at)] for name, at in POINTS.items())]
    rows[1][1] = -89.125
    assert load(book(tmp_path, {"a": rows}), SAID).mechanism.points


def test_workbook_omissions_are_listed(tmp_path):
    source = load(book(tmp_path, {"Front": merged}), SAID).source
    assert source.startswith("Sheet 'Front': hardpoints of car.xlsx on the template")
    for part in ("row 1 (Front suspension, left", "row 3 (", "(all from CAD)"):
        assert part in source.split(LEFT_OUT)[1]


def test_workbook_formulas_are_read_by_value(tmp_path, plain):
    """openpyxl writes no values; a spreadsheet program does, as here into the file."""
    rows = [list(row) for row in ROWS]
    rows[1][1] = "=-90+0.25"
    file = book(tmp_path, {"Front": rows})
    complains(file, "row 2: uca_front: x: found '=-90+0.25' ... save the table", SAID)
    with zipfile.ZipFile(file) as old:
        parts = {name: old.read(name) for name in old.namelist()}
    key = "xl/worksheets/sheet1.xml"
    parts[key], count = re.subn(rb"<v></v>|<v ?/>", b"<v>-89.75</v>", parts[key], count=1)
    assert count == 1
    with zipfile.ZipFile(file, "w") as new:
        for name, data in parts.items():
            new.writestr(name, data)
    assert load(file, SAID).mechanism == plain


@pytest.mark.needs("explain")
def test_sheet_option_chooses_hardpoints(tmp_path, plain, capsys):
    rear = [HEAD, *([name, x, 2 * y, z] for name, (x, y, z) in POINTS.items())]
    file = book(tmp_path, {"Front axle": ROWS, "Rear axle": rear, "Notes": [["x"]]})
    complains(
        file, "the sheets 'Front axle', 'Rear axle' have tables ... Add: --sheet 'Front axle'", SAID
    )
    options = ["--template", "double_wishbone", "--units", "mm", "--axes", "adams"]
    assert load(file, replace(SAID, sheet="Front axle")).mechanism == plain
    assert main(["explain", str(file), *options, "--sheet", "Front"]) == 2
    assert "found no sheet 'Front'" in capsys.readouterr().err
    csv = tmp_path / "car.csv"
    csv.write_text(table())
    assert main(["explain", str(csv), *options, "--sheet", "Front"]) == 2
    assert "--sheet: found 'Front' for a table of text" in capsys.readouterr().err


NO_NUMBERS = {
    "a date": (datetime(2026, 5, 1), "'2026-05-01 00:00:00' ... took the number for a date"),
    "an error": ("#DIV/0!", "'#DIV/0!' ... Correct the number"),
    "a truth": (True, "'True'"),
    "an empty cell": (None, "''"),
}
FAULTS = {
    name: (
        {"a": [*ROWS[:-1], ["wheel_center", 0.25, cell, 228.25]]},
        f"row 10: wheel_center: y ... {said}",
    )
    for name, (cell, said) in NO_NUMBERS.items()
} | {
    "no head": (
        {"a": [[1, 2], ["x"]], "b": [["x"]]},
        "no head on the sheets 'a', 'b' ... name,x,y,z",
    ),
    "nothing": ({"a": []}, "no sheet with cells"),
    "many rows": ({"a": [*ROWS, *[["p"]] * 20_000]}, "than 20000 rows"),
    "many columns": ({"a": [[*HEAD, *range(1200)]]}, "1000 columns"),
}


@pytest.mark.parametrize("kind", FAULTS)
def test_faulty_workbook_is_refused(tmp_path, kind):
    sheets, fragments = FAULTS[kind]
    file = book(tmp_path, sheets)
    complains(file, f"{file}: ... {fragments}", SAID)


def test_damaged_workbook_is_refused(tmp_path):
    file = book(tmp_path, {"a": ROWS})
    data = file.read_bytes()
    for part in (data[: len(data) // 2], data[:30] + b"\0" * 200 + data[230:]):
        file.write_bytes(part)
        complains(file, "workbook ( ... ; save it anew as .xlsx, or as CSV", SAID)


def test_workbook_zip_bomb_is_refused(tmp_path):
    """By the sizes that its directory tells."""
    file = book(tmp_path, {"a": ROWS})
    data = bytearray(file.read_bytes())
    struct.pack_into("<I", data, data.index(b"PK\1\2") + 24, 2_000_000_000)
    file.write_bytes(data)
    complains(file, "unpacks to 20000 ... expected 128000000", SAID)


def test_workbook_without_openpyxl_is_refused(tmp_path, monkeypatch):
    file = book(tmp_path, {"a": ROWS})
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    complains(file, "needs openpyxl,  ... pip install ... as CSV", SAID)


def judged(folder, sheets, sheet="", sweep=AT):
    book(folder, sheets, "rig.xlsx")
    text = crank_text(sweep).replace("rig.csv", "rig.xlsx")
    return reference_judged(load_case(write(folder, text + sheet)))


def test_reference_in_workbook(tmp_path):
    """Typed with six digits, below a title, judged by them; shifted by two tolerances, found."""
    rows = [[float(f"{x:.6g}") for x in row] for row in curve(OWN)]
    sheets = {"Rig": [["Rig 3, sheet 12"], ["turn", "x", "y"], *rows]}
    right = judged(tmp_path, sheets)
    assert right.outcome is Outcome.PASS
    assert "printed to 6 digits" in right.evidence.limits["x"]
    shift = 2e3 * max(each.position.tolerance for each in right.errors.values())
    sheets = {"Rig": [["turn", "x", "y"], *([t, x, y + shift] for t, x, y in rows)]}
    assert judged(tmp_path, sheets).outcome is Outcome.FAIL


def test_sheet_key_chooses_reference(tmp_path):
    rows = np.array(curve(OWN)).tolist()
    sheets = {"Rig": [["turn", "x", "y"], *rows], "Old": [["turn", "x", "y"], [0, 1, 2]]}
    assert judged(tmp_path, sheets, 'sheet = "Rig"').outcome is Outcome.PASS
    told = "sheets 'Rig', 'Old' ... sheet = \"NAME\" in [reference]"
    refused(lambda: judged(tmp_path, sheets), told)


def test_workbook_whole_numbers_are_rounded(tmp_path):
    """Its file has them as 5.0 or 5, and a program may have rounded them."""
    rows = [
        ["turn", "x", "y"],
        *([t, round(x), round(y, 1)] for t, x, y in curve([-1.0, 0.3, 1.0])),
    ]
    book(tmp_path, {"rig": rows}, "rig.xlsx")
    text = crank_text(AT).replace("rig.csv", "rig.xlsx")
    case = load_case(write(tmp_path, text))
    halves = [case.reference[name].uncertainty["position"].max() for name in "xy"]
    assert halves == pytest.approx([0.5e-3, 0.05e-3])
