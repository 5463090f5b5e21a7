"""What tables of hardpoints and files beside them have is read, listed, or stops by name."""

import json
import random
import re

import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError
from kincheck.core.extensions.hardpoints.reader import read_hardpoints
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table

from ...support.case_texts import write
from ...support.examples import examples

(WRONG_BUSHINGS,) = examples(__file__, "wrong_bushings")

NAME = "zq_unknown"
BUSHINGS = "[bushings.uca_front]\nstiffness = 5e6\n"


@pytest.mark.parametrize("fault", WRONG_BUSHINGS)
def test_unknown_name_of_bushings_is_named(fault, tmp_path):
    table = write(tmp_path, sample_table(TEMPLATES["double_wishbone"]), "car.csv")
    right = write(tmp_path, BUSHINGS, "right.toml")
    assert load(table, Supplied(bushings=right)).mechanism.bushings
    old, new = WRONG_BUSHINGS[fault]
    file = write(tmp_path, BUSHINGS.replace(old, new), "wrong.toml")
    wrong = re.split(r"[.\]\s]", new.lstrip("["))[0]
    with pytest.raises(CaseError, match=f"wrong.toml: .*{wrong}"):
        load(table, Supplied(bushings=file))


def test_unknown_name_in_names_is_named(tmp_path):
    table = write(tmp_path, sample_table(TEMPLATES["double_wishbone"]), "car.csv")
    for text in (f'{NAME} = "uca_front"\n', f'uca_front = "{NAME}"\n', f"[{NAME}]\na = 1\n"):
        with pytest.raises(CaseError, match=NAME):
            load(table, Supplied(names=write(tmp_path, text, "names.toml")))


def test_unknown_name_of_table_is_listed(tmp_path):
    sample = sample_table(TEMPLATES["double_wishbone"])
    rows = [line.split(",") for line in sample.splitlines() if not line.startswith("#")][1:]
    tree = {name: [float(each) for each in numbers[:3]] for name, *numbers in rows}
    facts = dict(re.findall(r"# (units|axes): ([\w,]+)", sample))
    for name, text in {
        "car.csv": f"{sample.rstrip()}\n{NAME},1,2,3\n",
        "car.json": json.dumps({**facts, **tree, NAME: 5, "setup": {NAME: "x"}}),
        "car.toml": "".join(
            f"{key} = {json.dumps(value)}\n" for key, value in {**facts, **tree, NAME: 5}.items()
        ),
    }.items():
        case = load(write(tmp_path, text, name), Supplied(template="double_wishbone"))
        assert NAME in case.source, name


def a_table(rng):
    """Lines of a table, and how many of each sort: comments, facts, columns, points, other rows."""
    columns = rng.sample(["meaning", "supplier", "mass", "torque"], rng.randint(0, 4))
    comments = [f"# remark {k}" for k in range(rng.randint(0, 3))]
    facts = ["# units: mm", "# axes: forward,left,up"]
    titles = [f"title {k}" for k in range(rng.randint(0, 2))]
    points = TEMPLATES["double_wishbone"].sample
    rows = [
        ",".join([name, *(f"{1000.0 * x:g}" for x in place), *("5" for _ in columns)])
        for name, place in points.items()
    ]
    more = [f"{NAME}{k},1,2,3{',5' * len(columns)}" for k in range(rng.randint(0, 2))]
    gaps = [f"gap {k},,,{',5' * len(columns)}" for k in range(rng.randint(0, 2))]
    head = ",".join(["name", "x", "y", "z", *columns])
    body = [*rows, *more, *gaps]
    rng.shuffle(body)
    above = [*comments, *facts, *titles]
    rng.shuffle(above)
    counts = {
        "comments": len(comments),
        "columns": len(columns),
        "rows": len(titles) + len(gaps),
        "points": len(rows) + len(more),
    }
    return [*above, head, *body], counts


@pytest.mark.parametrize("seed", range(12))
def test_account_of_table_adds_up(seed, tmp_path):
    """What is read and what is listed are all lines and columns."""
    lines, counts = a_table(random.Random(seed))
    table = read_hardpoints(write(tmp_path, "\n".join(lines), "car.csv"))
    assert (table.unit, table.axes) == ("mm", "forward,left,up")
    assert len(table.points) == counts["points"]
    comments = [each for each in table.left_out if "(remark " in each]
    assert comments == [
        f"line {k} ({line[2:]})" for k, line in enumerate(lines, 1) if line.startswith("# remark")
    ]
    assert len(comments) == counts["comments"]
    assert sum(each.startswith("column ") for each in table.left_out) == counts["columns"]
    assert sum(each.startswith("line ") for each in table.left_out) == (
        counts["rows"] + counts["comments"]
    )
    assert len(table.left_out) == counts["comments"] + counts["columns"] + counts["rows"]


def test_other_sheets_and_columns_are_listed(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["name", "x", "y", "z"])
    for name, place in TEMPLATES["double_wishbone"].sample.items():
        book.active.append([name, *place])
    book.active.cell(3, 6, "beside")
    book.create_sheet("springs").append(["rate", 5])
    book.save(tmp_path / "car.xlsx")
    found = read_hardpoints(tmp_path / "car.xlsx")
    assert found.left_out == ["column 6, which has no head", "sheet 'springs'"]


def test_remark_beside_coordinate_is_listed(tmp_path):
    rows = [f"p{k}_{axis},{k},mm,checked" for k in range(2) for axis in "xyz"]
    found = read_hardpoints(write(tmp_path, "\n".join(rows), "car.csv"), Supplied("mcpherson"))
    assert len(found.points) == 2
    assert found.left_out == [f"line {k} (checked)" for k in range(1, 7)]


@pytest.mark.parametrize("name", ["car.csv", "car.m", "car.py"])
def test_contradicting_facts_are_refused(name, tmp_path):
    sign = "%" if name == "car.m" else "#"
    facts = "".join(f"{sign} units: {unit}\n" for unit in ("mm", "MM", "m"))
    assigned = "a = [1, 2, 3]\nb = [1, 2, 4]\nc = [1, 2, 5]\n"
    text = "name,x,y,z\na,1,2,3\n" if name == "car.csv" else assigned
    with pytest.raises(CaseError, match="found unit 'm', and 'mm' above, expected one"):
        read_hardpoints(write(tmp_path, facts + text, name), Supplied("mcpherson"))


@pytest.mark.parametrize("name", ["car.csv", "car.toml"])
def test_misspelt_fact_of_comment_is_refused(name, tmp_path):
    points = (
        "name,x,y,z\na,1,2,3\n"
        if name == "car.csv"
        else "a = [1, 2, 3]\nb = [2, 3, 4]\nc = [1, 2, 5]\n"
    )

    def read(comment):
        file = write(tmp_path, f"# about\n# {comment}\n{points}", name)
        return read_hardpoints(file, Supplied("mcpherson"))

    for slip, right in {
        "wheel_raduis: 300 mm": "'wheel_radius'",
        "statik toe: 0.2": "'static_toe'",
        "unti: mm": "'unit'",
        "templaet: mcpherson": "'template'",
        "wheel radius: 300 ells": "a number with its unit",
    }.items():
        with pytest.raises(CaseError, match=f"line 2: found .*{slip}', expected {right}"):
            read(slip)
    for remark in ("wheels: 4", "toe link: 300", "units: see sheet 2", "wheel radius: as drawn"):
        assert len(read(remark).points) > 0
