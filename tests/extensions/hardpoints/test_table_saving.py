"""Tables saved with other numbers, as the live page does: in the form of the file, or as a new
table; read back equal.
"""

import openpyxl
import pytest
from kincheck import KincheckError, Supplied
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError
from kincheck.core.extensions.hardpoints.reader import read_hardpoints
from kincheck.core.extensions.hardpoints.saving import free_name, save_table
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table

from ...support.examples import examples
from ...support.written_again import written_again

(POINTS,) = examples(__file__, "points")

HEAD = ["# template: double_wishbone", "# units: mm", "# axes: forward,left,up"]


def text_of(delimiter, sign, head=(), end="\n", number=lambda x: f"{x:.2f}"):
    rows = [
        delimiter.join([name, *(number(x).replace(".", sign) for x in row), "Bemerkung für später"])
        for name, row in POINTS.items()
    ]
    lines = [*HEAD, *head, delimiter.join(["name", "x", "y", "z", "note"]), *rows, ""]
    return end.join(lines)


def moved(table, by=1.375):
    """Return the points of a table, two of them moved."""
    rows = [[*each.position] for each in table.points.values()]
    rows[0][0] += by
    rows[2][1] -= by
    return rows


def saved(file, supplied=Supplied()):  # noqa: B008
    """Return the file that a table is saved to, and its new points."""
    table = read_hardpoints(file, supplied)
    points = moved(table)
    found = save_table(table, supplied, points, free_name(file))
    return found, dict(zip(table.points, map(tuple, points), strict=True))


FORMS = {
    "commas": (",", ".", {}, "utf-8"),
    "semicolons": (";", ".", {}, "utf-8"),
    "decimal commas": (";", ",", {}, "utf-8"),
    "tabs and decimal commas": ("\t", ",", {}, "utf-8"),
    "lines of Windows": (";", ",", {"end": "\r\n"}, "utf-8-sig"),
    "Windows-1252": (";", ",", {}, "cp1252"),
    "UTF-16": ("\t", ",", {}, "utf-16"),
    "whole numbers": (";", ",", {"number": lambda x: f"{x:g}"}, "utf-8"),
    "right wheel": (";", ",", {"head": ["# side: right"]}, "utf-8"),
}


@pytest.mark.parametrize("form", FORMS)
def test_saved_table_keeps_its_form(tmp_path, form):
    """All but the changed numbers: comments, signs, ends of lines, encoding."""
    delimiter, sign, how, encoding = FORMS[form]
    file = tmp_path / "car.csv"
    text = text_of(delimiter, sign, **how)
    file.write_bytes(text.encode(encoding))
    new, points = saved(file)
    assert file.read_bytes() == text.encode(encoding)
    found = read_hardpoints(new)
    assert {name: each.position for name, each in found.points.items()} == points
    assert found.side == read_hardpoints(file).side
    number, expected = how.get("number", lambda x: f"{x:.2f}"), text
    for before, after in ((90.25, "91.625"), (540.0, "538.625")):
        old, changed = (each.replace(".", sign) for each in (number(before), after))
        expected = expected.replace(f"{delimiter}{old}", f"{delimiter}{changed}", 1)
    assert new.read_bytes() == expected.encode(encoding)


def test_quoted_numbers_make_a_new_table(tmp_path):
    file, toe = tmp_path / "car.csv", "# static_toe: 0.21 deg"
    file.write_text(text_of(",", ",", [toe], number=lambda x: f'"{x:.2f}"'))
    new, points = saved(file)
    assert new.read_text().splitlines()[3:6] == [toe, "name,x,y,z", "uca_front,91.625,260,285"]
    assert {name: each.position for name, each in read_hardpoints(new).points.items()} == points


@pytest.mark.parametrize("sheet", ["front", "rear"])
def test_workbook_with_sheets_is_saved(tmp_path, sheet):
    book = openpyxl.Workbook()
    for name, off in (("front", 0.0), ("rear", 2600.0)):
        page = book.create_sheet(name)
        for line in HEAD:
            page.append([line])
        page.append(["name", "x", "y", "z"])
        for point, (x, y, z) in POINTS.items():
            page.append([point, x - off, y, z])
    book.remove(book["Sheet"])
    book.save(file := tmp_path / "car.xlsx")
    new, points = saved(file, Supplied(sheet=sheet))
    assert new.name == "car_2.csv"
    assert {name: each.position for name, each in read_hardpoints(new).points.items()} == points


def test_corner_of_car_is_saved(tmp_path):
    rows = [
        f"{axle};{side};{name};{x - off};{way * y};{z}".replace(".", ",")
        for axle, off in (("front", 0.0), ("rear", 2600.0))
        for side, way in (("left", 1.0), ("right", -1.0))
        for name, (x, y, z) in POINTS.items()
    ]
    file = tmp_path / "car.csv"
    file.write_text("\n".join([*HEAD, "axle;side;name;x;y;z", *rows, ""]))
    supplied = Supplied(corner="RR")
    new, points = saved(file, supplied)
    found = read_hardpoints(new, supplied)
    assert {name: each.position for name, each in found.points.items()} == points
    assert found.side == "right"
    assert len(new.read_text().splitlines()) == len(file.read_text().splitlines())


def test_save_over_a_file_is_refused(tmp_path):
    file = tmp_path / "car.csv"
    file.write_text(text_of(";", ","))
    table = read_hardpoints(file)
    with pytest.raises(KincheckError, match="the file exists and stays"):
        save_table(table, Supplied(), moved(table), "car.csv")


@pytest.mark.parametrize("template", TEMPLATES)
@pytest.mark.parametrize("axle", [None, "steer"])
def test_hardpoint_table_round_trip(template, axle, tmp_path):
    file = tmp_path / "car.csv"
    file.write_text(sample_table(TEMPLATES[template]))
    try:
        case = load(file, Supplied(travel="0.02:5", axle=axle))
    except CaseError as error:
        assert axle is not None
        pytest.skip(f"no such axle: {error}")
    written_again(case, tmp_path)
