"""Right wheels, and tables of the whole car: one corner is read, and a right wheel moves as the
mirror image of the left.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.case.io.reader_options import LEFT_OUT, Supplied
from kincheck.core.case.models.files import load
from kincheck.core.case.models.hardpoints.templates import TEMPLATES
from kincheck.core.errors import CaseError

from ..support.rods_of_templates import solved

SAID = Supplied(units="mm", axes="forward,left,up", travel="0.04:5", rack="0.01", position="front")
# Round-off of metre-sized numbers; quotients by travel lose two digits.
CLOSE = 1e-12
CORNERS = {"FL": (1, 0.0), "FR": (-1, 0.0), "RL": (1, -2600.0), "RR": (-1, -2600.0)}


def rows(name, corner="FL"):
    """Rows of a template's sample at a corner; all corners differ by more than place and side."""
    side, along = CORNERS[corner]
    wider = 1.0 + 0.01 * (list(CORNERS).index(corner) // 2)
    return [
        [role, *(f"{x:.10g}" for x in (1e3 * x + along, side * wider * 1e3 * y, 1e3 * z))]
        for role, (x, y, z) in TEMPLATES[name].sample.items()
    ]


def written(folder, lines, name="car.csv"):
    file = folder / name
    file.write_text("\n".join(lines) + "\n")
    return file


def plain(folder, name, corner, *above):
    lines = [*above, "name,x,y,z", *(",".join(row) for row in rows(name, corner))]
    return written(folder, lines, f"{corner}.csv")


def of(name, **own):
    steered = {} if TEMPLATES[name].steered else {"rack": None}
    return replace(SAID, template=name, **{**steered, **own})


@pytest.mark.parametrize("name", TEMPLATES)
def test_right_wheel_has_the_left_ones_outputs(tmp_path, name):
    """The rack moves to the other side for the mirror image."""
    left = load(plain(tmp_path, name, "FL"), of(name))
    other_way = {"rack": "0.01:-0.01"} if TEMPLATES[name].steered else {}
    right = load(plain(tmp_path, name, "FR"), of(name, **other_way))
    theirs, ours = solved(left), solved(right)
    assert theirs.keys() == ours.keys()
    assert [note for note in right.assembly if "right of the middle" in note]
    mirrored = {each for each in ours if each.endswith((".y", "_y"))}
    for output, values in ours.items():
        expected = -theirs[output] if output in mirrored else theirs[output]
        np.testing.assert_allclose(values, expected, rtol=CLOSE, atol=CLOSE, err_msg=output)


def test_side_is_stated_in_the_file(tmp_path):
    case = load(plain(tmp_path, "mcpherson", "FR", "# side: right"), of("mcpherson"))
    assert not case.assembly
    assert "right side" in case.source
    file = tmp_path / "again.toml"
    file.write_text(case_text(case))
    again, ours = solved(load_case(file)), solved(case)
    np.testing.assert_allclose(again["toe"], ours["toe"], rtol=CLOSE, atol=CLOSE)


@pytest.mark.parametrize(
    ("corner", "above", "own", "fragments"),
    [
        ("FR", ["# side: left"], {}, ["y = -750 mm", "side says left"]),
        ("FL", [], {"side": "right"}, ["y = 750 mm", "--side says right"]),
        ("FL", ["# side: left"], {"side": "right"}, ["--side: found right", "left side"]),
        ("FL", [], {"side": "lft"}, ["--side: found 'lft'", "'left'"]),
        ("FR", [], {"axes": "forward,right,down", "units": "mm"}, ["above"]),
        ("FL", [], {"axes": "forward,right,up"}, ["left-handed", "--side right"]),
        ("FL", [], {"corner": "FR"}, ["--corner: found no point of FR"]),
        ("FL", [], {"corner": "front"}, ["--corner: found no point of front"]),
        ("FL", [], {"corner": "nose"}, ["--corner: found 'nose'", "FL, FR, RL, RR"]),
    ],
)
def test_contradicted_sides_are_refused(tmp_path, corner, above, own, fragments):
    with pytest.raises(CaseError) as caught:
        load(plain(tmp_path, "mcpherson", corner, *above), of("mcpherson", **own))
    assert [each for each in fragments if each not in str(caught.value)] == [], caught.value


WORDS = {"FL": "Front,Left", "FR": "Front,Right", "RL": "Rear,Left", "RR": "Rear,Right"}
TABLES = {
    "column": lambda corner, row: ["corner,point,x,y,z", ",".join([corner, *row])],
    "words": lambda corner, row: [
        "wheel;name;x;y;z",
        ";".join([WORDS[corner].replace(",", " "), *row]),
    ],
    "last column": lambda corner, row: ["name,x,y,z,corner", ",".join([*row, corner])],
    "two columns": lambda corner, row: ["axle,side,point,x,y,z", ",".join([WORDS[corner], *row])],
    "letters": lambda corner, row: ["axle,side,point,x,y,z", ",".join([*corner, *row])],
    "merged cells": lambda corner, row: [
        "corner,point,x,y,z",
        ",".join([corner if row[0] == rows("double_wishbone")[0][0] else "", *row]),
    ],
    "suffix": lambda corner, row: ["name,x,y,z", ",".join([f"{row[0]}_{corner}", *row[1:]])],
    "prefix": lambda corner, row: ["name,x,y,z", ",".join([f"{corner}_{row[0]}", *row[1:]])],
    "script": lambda corner, row: [
        "% the car",
        f"{corner}.{row[0]} = [{' '.join(row[1:])}];",
    ],
}


@pytest.mark.parametrize("corner", CORNERS)
@pytest.mark.parametrize("kind", TABLES)
def test_corner_of_a_whole_car_is_read(tmp_path, kind, corner):
    name = "double_wishbone"
    said = of(name, corner=corner)
    pairs = [TABLES[kind](each, row) for each in CORNERS for row in rows(name, each)]
    lines = [pairs[0][0], *(line for _, line in pairs)]
    case = load(written(tmp_path, lines, "car.m" if kind == "script" else "car.csv"), said)
    alone = load(plain(tmp_path, name, corner), of(name))
    theirs, ours = solved(alone), solved(case)
    assert theirs.keys() == ours.keys()
    for output, values in ours.items():
        np.testing.assert_array_equal(values, theirs[output], err_msg=output)
    assert case.source.split(LEFT_OUT)[1] != "nothing"


def test_several_corners_ask_for_one(tmp_path):
    lines = ["corner,point,x,y,z"]
    lines += [",".join([each, *row]) for each in CORNERS for row in rows("mcpherson", each)]
    file = written(tmp_path, lines)
    with pytest.raises(
        CaseError, match=r"front left, front right, rear left, rear right.*--corner"
    ):
        load(file, of("mcpherson"))
    with pytest.raises(CaseError, match="expected left; choose"):
        load(file, of("mcpherson", corner="left"))


def test_sheet_of_a_corner_is_read(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for corner in CORNERS:
        sheet = book.create_sheet(corner)
        sheet.append(["name", "x", "y", "z"])
        for role, *place in rows("mcpherson", corner):
            sheet.append([role, *map(float, place)])
    file = tmp_path / "car.xlsx"
    book.save(file)
    case = load(file, of("mcpherson", corner="rear right"))
    theirs = load(plain(tmp_path, "mcpherson", "RR"), of("mcpherson"))
    np.testing.assert_array_equal(solved(case)["toe"], solved(theirs)["toe"])
    with pytest.raises(CaseError, match="--corner FL"):
        load(file, of("mcpherson"))
