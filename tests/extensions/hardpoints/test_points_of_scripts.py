"""Points in the forms that MATLAB and Python scripts write them in."""

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
    assert re.fullmatch(r"line \d+ \(clear all\)", found.left_out[0])


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
    assert found.left_out[0] == "line 1 (import numpy)"
    assert "wheel" in " ".join(found.left_out)


def rows(form, between=", "):
    return between.join(form.format(name=name, row=place) for name, place in POINTS.items())


def camel(name):
    first, *others = name.split("_")
    return first + "".join(map(str.capitalize, others))


POINT = "HP = {'lca_front': (1, 2, 3)}\n"
TUPLES = rows("{name!r}: {row}")
CENTER = POINTS["wheel_center"]
ARM = ", ".join(f"{name!r}: {place}" for name, place in POINTS.items() if name != "wheel_center")
SHIFTED = rows("{name!r}: 2 * np.array({row}) / 2 + np.array([0, 0, 1 - 1.0])")
SCRIPTS = {
    "variable": f"HP_FRONT = {{{TUPLES}}}",
    "arrays": f"import numpy as np\nHP_FRONT = {{{rows('{name!r}: np.array({row})')}}}",
    "types of numbers": f"HP = {{{rows('{name!r}: np.array({row}, dtype=float)')}}}",
    "point beside": f"HP_FRONT = {{{ARM}}}\nWHEEL_CENTER = np.array({CENTER})",
    "point beside container": f"hardpoints = {{{ARM}}}\nwheel_center = {CENTER}",
    "nested": f"HARDPOINTS = {{'front': {{{ARM}}}}}\nwheelCenter = {CENTER}",
    "front of two": f"HARDPOINTS = {{'front': {{{TUPLES}}}, 'rear': {{'lca_front': (0, 0, 0)}}}}",
    "front of two variables": f"HP_FRONT = {{{TUPLES}}}\nHP_REAR = {{'lca_front': (0, 0, 0)}}",
    "front of two in camel case": f"frontHP = {{{TUPLES}}}\nrearHP = {{'lcaFront': (0, 0, 0)}}",
    "camel names": f"P = {{{', '.join(f'{camel(n)!r}: {p}' for n, p in POINTS.items())}}}",
    "names that stand for dictionaries": f"F = {{{TUPLES}}}\nHP = {{'front': F}}",
    "names that stand for points": rows("{name} = {row}", "\n")
    + f"\nHP = {{{rows('{name!r}: {name}')}}}\nALL = [lca_front, lca_rear]",
    "arithmetic": f"HP = {{{SHIFTED}}}",
    "constants": "HALF = 1200 / 2\nZERO = -HALF + 600.0\n"
    f"HP = {{{rows('{name!r}: np.array({row}) + np.array([ZERO, 0, 0])')}}}",
    "pairs": f"HP = [{rows('({name!r}, {row})')}]",
    "calls with names": f"HP = SimpleNamespace({rows('{name}=Vector{row}')})",
    "coordinates": f"HP = dict({rows('{name}=Point(x={row[0]}, y={row[1]}, z={row[2]})')})",
    "several at once": f"{', '.join(POINTS)} = {rows('{row}')}",
    "subscripts": "HP = {'front': {}}\n" + rows("HP['front'][{name!r}] = {row}", "\n"),
}


@pytest.mark.parametrize("form", SCRIPTS)
def test_python_form_is_read(tmp_path, form):
    file = tmp_path / "points.py"
    file.write_text(f"# of a car [mm]\n{SCRIPTS[form]}\nprint(1 / 0)\n")
    sheet = "front" if form.startswith("front of two") else None
    found = load(file, Supplied("double_wishbone", "mm", "iso", sheet=sheet))
    points = {row.roles[0]: tuple(1000.0 * x for x in row.position) for row in found.hardpoints}
    assert points.keys() == POINTS.keys()
    for name, place in POINTS.items():
        assert points[name] == pytest.approx(place, abs=1e-9)


@pytest.mark.parametrize("form", ["front of two", "front of two variables"])
def test_python_two_axles_are_refused(tmp_path, form):
    (tmp_path / "points.py").write_text(SCRIPTS[form])
    with pytest.raises(CaseError, match="Choose a section by --sheet NAME"):
        load(tmp_path / "points.py", Supplied("double_wishbone", "mm", "iso"))


@pytest.mark.parametrize(
    "change",
    [
        "HP['lca_front'][2] += 5",
        "HP['lca_front'][2] = 5",
        "HP = {key: place / 1000 for key, place in HP.items()}",
        "for key in HP:\n    HP[key] = scaled(HP[key])",
        "HP.update(moved(HP))",
        "del HP['lca_front']",
    ],
)
def test_python_changed_points_are_refused(tmp_path, change):
    (tmp_path / "points.py").write_text(f"{POINT}{change}\n")
    with pytest.raises(CaseError, match=r"points\.py: line 2: changes HP.*expected points that"):
        read_hardpoints(tmp_path / "points.py")


@pytest.mark.parametrize(
    "value", ["f(1)", "[1, 2, 1 / 0]", "[1, 2] * 3", "turned([1, 2, 3])", "[1, sqrt(2), 3]"]
)
def test_python_value_unknown_is_listed(tmp_path, value):
    (tmp_path / "points.py").write_text(f"{POINT}p = {value}\n")
    found = read_hardpoints(tmp_path / "points.py")
    assert [*found.points] == ["lca_front"]
    assert found.left_out == ["values line 2 p"]


@pytest.mark.parametrize(
    "comment", ["# a car [mm]", "# front,\n# in mm", "# units: mm", "#\n# (mm)"]
)
def test_python_unit_is_read(tmp_path, comment):
    (tmp_path / "points.py").write_text(f"# [m]\nRADIUS = 0.3\n{comment}\n{POINT}")
    assert read_hardpoints(tmp_path / "points.py").unit == "mm"


def test_python_value_like_unit_is_listed(tmp_path):
    (tmp_path / "points.py").write_text(f"{POINT}unit = 'mm'\nlabel = 'mm'\n")
    found = read_hardpoints(tmp_path / "points.py")
    assert (found.unit, found.left_out) == ("mm", ["values line 3 label"])


def test_python_two_units_are_refused(tmp_path):
    (tmp_path / "points.py").write_text(f"{POINT}b = (1, 2, 3)  # in m\nc = (1, 2, 4)  # [mm]\n")
    with pytest.raises(CaseError, match="line 3: found 'mm', and 'm' above, expected one unit"):
        read_hardpoints(tmp_path / "points.py")
