"""Hardpoint tables as they come from spreadsheets, Adams, OptimumK and Lotus, damaged or written in
other ways: each is read rightly, or refused with one clear message and status 2.
"""

import io
import zipfile

import pytest
from kincheck.core.case.io.reader_options import LEFT_OUT, Supplied
from kincheck.core.case.models.files import load
from kincheck.core.case.models.hardpoints.templates import TEMPLATES
from kincheck.core.cli.main import main
from kincheck.core.errors import CaseError

from .test_hardpoint_dialects import POINTS, SAID, comma, integers, read, table


@pytest.fixture
def plain(tmp_path):
    return read(tmp_path, table().replace(";", ",")).mechanism


OPTIMUM = {
    "uca_front": "CHAS_UppFor",
    "uca_rear": "CHAS_UppAft",
    "uca_outer": "UPRI_UppPnt",
    "lca_front": "CHAS_LowFor",
    "lca_rear": "CHAS_LowAft",
    "lca_outer": "UPRI_LowPnt",
    "tierod_inner": "CHAS_TiePnt",
    "tierod_outer": "UPRI_TiePnt",
    "wheel_center": "Wheel_Centre",
}
LOTUS = dict(
    zip(
        POINTS,
        (
            "Upper wishbone front pivot",
            "Upper wishbone rear pivot",
            "Upper wishbone outer ball joint",
            "Lower wishbone front pivot",
            "Lower wishbone rear pivot",
            "Lower wishbone outer ball joint",
            "Inner track rod ball joint",
            "Outer track rod ball joint",
            "Wheel centre point",
        ),
        strict=True,
    )
)
RIGHT = {f"{name}_right": (x, -y, z) for name, (x, y, z) in POINTS.items()}
LEFT = {f"{name}_left": at for name, at in POINTS.items()}


def renamed(names):
    return {names[name]: at for name, at in POINTS.items()}


def columns(head=("name", "x", "y", "z")):
    """The table with a column a point."""
    rows = [head, *((name, *map(str, at)) for name, at in POINTS.items())]
    return "\n".join(";".join(each) for each in zip(*rows, strict=True)) + "\n"


READ = {
    "OptimumK": table("Point Name;X (mm);Y (mm);Z (mm)", points=renamed(OPTIMUM)),
    "Lotus": table(",x,y,z", "{},{},{},{}", renamed(LOTUS)),
    "corners": table(points={f"{name} FL": at for name, at in renamed(LOTUS).items()}),
    "corners before": table(points={f"FL_{name}": at for name, at in POINTS.items()}),
    "both sides": table(points=LEFT | RIGHT),
    "one side of a few": table(points=POINTS | {"spring_right": (1.5, 2.5, 3.5)}),
    "index of pandas": table(",x,y,z", "{},{},{},{}"),
    "a name of its own for names": table("Bezeichnung;X;Y;Z"),
    "units in words": table("name;x in mm;y in mm;z in mm"),
    "long names of axes": table("name;X-coordinate [mm];Y-coordinate [mm];Z-coordinate [mm]"),
    "units with a slash": table("name;x/mm;y/mm;z/mm"),
    "columns of points": columns(),
    "columns, German": comma(columns()),
    "configuration below": table() + "Steering rack;XXXX;;\nWheelbase;1550;;\n",
    "notes below": table() + ";;;\nAll points from CAD, rev 3\n* not to scale;;;\n",
    "headings between": table().replace("lca_front", "Lower arm;;;\nlca_front"),
    "comment of a spreadsheet": '"# axes: rearward,right,up"\n# units: mm;;;\n' + table(),
    "comment in cells": "# axes: rearward;right;up\n" + table(),
    "title with a unit": "units: mm\n" + table(),
    "blank columns": table(";name;;x;y;z;", ";{};;{};{};{};"),
    "sign of typography": table().replace("-", "\u2212"),
    "spaces around": table("name ; x ; y ; z", " {} ;  {} ; {} ;{} "),
    "plus signs": table().replace(";110.25", ";+110.25"),
    "lines of Windows": table().replace("\n", "\r\n"),
    "lines of an old Mac": table().replace("\n", "\r"),
    "Windows-1252": ("Radaufhängung, außen\n" + table()).encode("cp1252"),
    "quoted": table('"name";"x";"y";"z"', '"{}";"{}";"{}";"{}"'),
    "numbered": table("No.;Name;x;y;z", "7;{};{};{};{}"),
}


@pytest.mark.parametrize("kind", READ)
def test_read(tmp_path, plain, kind):
    assert read(tmp_path, READ[kind]).mechanism == plain


def test_a_strut_by_the_names_of_optimumk(tmp_path):
    names = {"lca_front": "CHAS_LowFor", "lca_rear": "CHAS_LowAft", "lca_outer": "UPRI_LowPnt"}
    rows = {names.get(name, name): at for name, at in TEMPLATES["mcpherson"].sample.items()}
    file = tmp_path / "car.csv"
    file.write_text(table("name;x [m];y [m];z [m]", points=rows))
    by_role = Supplied("mcpherson", axes="iso")
    theirs = load(file, by_role).mechanism
    file.write_text(table("name;x [m];y [m];z [m]", points=TEMPLATES["mcpherson"].sample))
    assert theirs == load(file, by_role).mechanism


def test_what_is_no_point_is_listed(tmp_path):
    listed = read(tmp_path, READ["configuration below"]).source.split(LEFT_OUT)[1]
    assert listed == "line 11 (Steering rack,XXXX), line 12 (Wheelbase,1550)"
    listed = read(tmp_path, READ["both sides"]).source.split(LEFT_OUT)[1]
    assert listed.split(", ") == [*RIGHT]


def test_the_right_side_is_read_as_the_left(tmp_path, plain):
    """Mirrored by its axes, as the message says."""
    text = table(points={name: (x, -y, z) for name, (x, y, z) in POINTS.items()})
    with pytest.raises(CaseError, match="those of the right side are read as left ones if --axes"):
        read(tmp_path, text)
    said = Supplied("double_wishbone", "mm", "rearward,left,up")
    assert read(tmp_path, text, said).mechanism == plain


def edited(old, new):
    assert old in table()
    return table().replace(old, new)


FAULTS = {
    "sign of one y": (
        edited("-219.75", "219.75"),
        ["tierod_inner", "y = 219.75 mm", "on the other side than wheel_center", "correct its"],
    ),
    "thousands by a blank": (edited("-611.75", "-1 611.75"), ["line 10", "separators of thous"]),
    "thousands of the French": (
        edited("-611.75", "-1\u202f611.75"),
        ["line 10", "separators of thousands"],
    ),
    "thousands of the Swiss": (edited("-611.75", "-1'611.75"), ["separators of thousands"]),
    "thousands and decimals": (edited("-611.75", "-1.611,75"), ["separators of thousands"]),
    "formula": (edited("-611.75", "=A1+1"), ["line 10: wheel_center: y", "'=A1+1'", "save the"]),
    "error of a formula": (edited("-611.75", "#REF!"), ["line 10: wheel_center: y", "'#REF!'"]),
    "dash": (edited("-611.75", "\u2013611.75"), ["'–611.75'", "as a hyphen"]),
    "unit in a cell": (edited("-611.75", "-611.75 mm"), ["'-611.75 mm'", "leave the unit out"]),
    "fraction": (edited("-611.75", "-611 3/4"), ["'-611 3/4'", "correct the number"]),
    "letter O": (edited("-611.75", "-61O.75"), ["'-61O.75'", "correct the number"]),
    "NaN": (edited("-611.75", "NaN"), ["'NaN'"]),
    "infinite": (edited("-611.75", "inf"), ["'inf'"]),
    "dash for nothing": (edited("-611.75", "-"), ["line 10: wheel_center: y", "'-'"]),
    "date": (edited("-611.75", "2026-05-01"), ["'2026-05-01'", "took the number for a date"]),
    "hexadecimal": (edited("-611.75", "0x1F"), ["'0x1F'"]),
    "a point without numbers": (edited("0.25;-611.75;228.25", ";;"), ["line 10", "complete the"]),
    "missing point": (
        edited("wheel_center;0.25;-611.75;228.25\n", ""),
        ["missing wheel_center, the wheel's centre"],
    ),
    "front and rear corners": (
        table(
            points={f"{name}_{side}": at for name, at in POINTS.items() for side in ("FL", "RL")}
        ),
        ["uca_front", "'uca_front_FL' (line 2) and 'uca_front_RL' (line 3)", "expected one"],
    ),
    "twice, equal": (table() + "wheel_center;0.25;-611.75;228.25\n", ["given before, in line 10"]),
    "twice, named otherwise": (table() + "Wheel Centre;0;-600;228.25\n", ["'Wheel Centre' (line"]),
    "metres said to be mm": (
        table(points={name: tuple(x / 1000 for x in at) for name, at in POINTS.items()}),
        ["span", "metres declared as mm?"],
    ),
    "no head at all": (table(row="{};1;{};{};{}").partition("\n")[2], ["expected the head"]),
    "two tables": (table() + "\n" + table(), ["a second head", "keep one"]),
    "two dimensions": ("name;x;y\nwheel;1;2\n", ["expected the head name,x,y,z"]),
    "head of one letter": ("x\n1\n", ["expected the head name,x,y,z"]),
    "grouped or not": (
        table(points=integers()).replace("-611", "-1.611"),
        ["is -1.611 or -1611"],
    ),
    "decimal commas between commas": (comma(table()).replace(";", ","), ["needs semicolons"]),
    "unknown unit": (table("name;x [furlong];y [furlong];z [furlong]"), ["unit", "'furlong'"]),
    "JSON": ('{"wheel_center": [0, 1, 2]}', ["expected the head"]),
    "control characters": (table().encode() + b"\x00\x01\xff", ["a binary file, expected text"]),
}


@pytest.mark.parametrize("kind", FAULTS)
def test_refused(tmp_path, kind):
    text, fragments = FAULTS[kind]
    with pytest.raises(CaseError) as caught:
        read(tmp_path, text)
    message = str(caught.value)
    assert message.startswith(str(tmp_path))
    assert "\n" not in message
    assert [each for each in fragments if each not in message] == [], message


def zipped(name):
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr(name, "made up")
    return stream.getvalue()


OFFICE = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(500)
OTHERS = {
    "car.xls": (OFFICE, "found an Excel file before 2007 (.xls)"),
    "car.xlsx": (OFFICE, "or one with a password, expected a workbook (.xlsx)"),
    "car.pdf": (b"%PDF-1.7\n\xff", "found a PDF document, expected text; export the numbers"),
    "car.png": (b"\x89PNG\r\n\x1a\n", "found a PNG image, expected text; type the numbers"),
    "car.jpg": (b"\xff\xd8\xff\xe0", "found a JPEG image"),
    "car.ods": (zipped("content.xml"), "found an OpenDocument file (.ods, .odt)"),
    "car.docx": (zipped("word/document.xml"), "found a Word document"),
    "car.xlsb": (zipped("xl/workbook.bin"), "found a binary Excel workbook (.xlsb)"),
    "table.xlsx": (zipped("word/document.xml"), "found a Word document, expected a workbook"),
    "car.zip": (zipped("car.csv"), "found a zip archive, expected text; unpack it"),
    "page.csv": (b"<!DOCTYPE html><html>", "found a web page (HTML)"),
    "book.csv": (zipped("xl/workbook.xml"), "found an Excel workbook, expected text; name it"),
    "text.xlsx": (table().encode(), "found a text, expected a workbook (.xlsx)"),
    "noise.xlsx": (bytes(range(256)), "found another binary file, expected a workbook (.xlsx)"),
    "noise.csv": (bytes(range(256)), "found a binary file, expected text"),
    "empty.csv": (b"", "is empty, expected a table of hardpoints"),
    "empty.xlsx": (b"", "is empty, expected a workbook"),
    "car.parquet": (b"PAR1\x15", "found a Parquet file, expected text; export the table"),
    "car.mat": (b"MATLAB 5.0 MAT-file, \x00", "found a MATLAB file, expected text; write the"),
    "car.gz": (b"\x1f\x8b\x08\x00", "found a gzip archive, expected text; unpack it"),
}


@pytest.mark.parametrize("name", OTHERS)
def test_other_files(tmp_path, name):
    data, fragment = OTHERS[name]
    file = tmp_path / name
    file.write_bytes(data)
    with pytest.raises(CaseError) as caught:
        load(file, SAID)
    assert str(caught.value).startswith(f"{file}: ")
    assert fragment in str(caught.value)


def test_a_folder(tmp_path, capsys):
    (tmp_path / "car.csv").mkdir()
    assert main(["explain", str(tmp_path / "car.csv")]) == 2
    assert "car.csv: a folder, not a regular file; give the path" in capsys.readouterr().err
