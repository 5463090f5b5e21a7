"""Points in the forms that MATLAB scripts write them in, and in classes of Python scripts."""

import re

import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError
from kincheck.core.extensions.hardpoints.reader import read_hardpoints
from kincheck.core.extensions.hardpoints.templates import TEMPLATES

POINTS = {
    name: tuple(round(1000.0 * x, 6) for x in place)
    for name, place in TEMPLATES["double_wishbone"].sample.items()
    if not name.startswith(("spring", "wheel_contact"))
}
ROWS = {name: " ".join(f"{x:g}" for x in place) for name, place in POINTS.items()}


def each(form, between="\n"):
    return between.join(form.format(name=name, row=row) for name, row in ROWS.items())


FORMS = {
    "fields": each("hp.{name} = [{row}];"),
    "columns": each("hp.{name} = [{row}].';"),
    "several lines": each("hp.{name} = [{row}];").replace(" ", "\n  ").replace("\n  =\n  ", " = "),
    "continued": each("hp.{name} = ... a remark [1 2 3]\n [{row}];"),
    "one line": each("hp.{name} = [{row}]", "; "),
    "struct": "hp = struct(" + each("'{name}', [{row}]", ", ...\n") + ");",
    "struct in a struct": "front = struct('hp', struct(" + each("'{name}', [{row}]", ", ") + "));",
    "cell of rows": "hp = {\n" + each("'{name}', {row};") + "\n};",
    "cell of cells": "hp = { ...\n" + each("'{name}' [{row}]", "; ...\n") + "};",
    "double quotes": "hp = struct(" + each('"{name}", [{row}]', ", ") + ")",
    "rows with names": "P = [\n" + each("{row} % {name}") + "\n];",
    "names and rows": "n = {" + each("'{name}'", ", ") + "};\nP = [" + each("{row}", "; ") + "];",
    "map": "hp = containers.Map();\n" + each("hp('{name}') = [{row}];"),
    "function": "function hp = points()\n" + each("hp.{name} = [{row}];") + "\nend",
    "block remark": "%{\nlca_front = [9 9 9];\n%}\n" + each("{name} = [{row}];  % {name}"),
}


@pytest.mark.parametrize("form", FORMS)
def test_matlab_form_is_read(tmp_path, form):
    file = tmp_path / "front.m"
    file.write_text("% units: mm\n% axes: forward,left,up\n" + FORMS[form] + "\n")
    found = load(file, Supplied("double_wishbone"))
    points = {row.roles[0]: tuple(1000.0 * x for x in row.position) for row in found.hardpoints}
    assert points.keys() == POINTS.keys()
    for name, place in POINTS.items():
        assert points[name] == pytest.approx(place, abs=1e-9)


@pytest.mark.parametrize("value", ["[a 2 3]", "[1+1 2 3]", "[1 - 2 3 4]", "2 * [1 2 3]"])
def test_matlab_expression_is_omitted(tmp_path, value):
    file = tmp_path / "front.m"
    file.write_text(f"{FORMS['fields']}\nhp.other = {value};\nclear all\n")
    found = read_hardpoints(file, Supplied("double_wishbone", "mm", "iso"))
    assert "hp.other" not in found.points
    assert "hp.other" in " ".join(found.left_out)
    assert re.search(r"line \d+$", found.left_out[0])


@pytest.mark.parametrize(
    "text", ["hp = struct('a', [1 2 3]", "hp = {'a', 1, 2; 'b', 3, 4", "x = [1 2 3"]
)
def test_matlab_unclosed_bracket_is_refused(tmp_path, text):
    file = tmp_path / "front.m"
    file.write_text(text)
    with pytest.raises(CaseError, match=r"front\.m: "):
        load(file, Supplied("double_wishbone", "mm", "iso"))


def test_python_class_of_points_is_read(tmp_path):
    rows = "\n".join(f"    {name}: tuple = {place}" for name, place in POINTS.items())
    file = tmp_path / "front.py"
    file.write_text(f"import numpy\n\nclass Front:\n    wheel = Front()\n{rows}\n")
    found = read_hardpoints(file, Supplied("double_wishbone", "mm", "iso"))
    assert {name.split(".")[-1]: each.position for name, each in found.points.items()} == POINTS
    assert found.left_out[0] == "line 1"
    assert "wheel" in " ".join(found.left_out)
