"""Hardpoints in further forms: a coordinate in each row, rows without a head, trees in YAML and
JSON, and assignments of scripts. Each gives the mechanism of the plain table.
"""

import json
from dataclasses import replace

import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError
from kincheck.core.extensions.hardpoints.reader import read_hardpoints
from kincheck.core.extensions.measured.reference_curve import CurveOptions, with_curve

from ...support.case_texts import complains, line_with, rows, write
from ...support.examples import examples
from .test_hardpoint_dialects import POINTS, comma, table

FAULTS, PATTERNS, EXPLORER, CORNERS = examples(
    __file__, "faults", "patterns", "explorer", "corners"
)

SAID = Supplied("double_wishbone", "mm", "rearward,right,up")


def lines(form, points=POINTS, between="\n"):
    return between.join(form.format(name, *at) for name, at in points.items()) + "\n"


def axes(form, points=POINTS, names="xyz", last="\n"):
    return "".join(
        form.format(name, axis, x) + last
        for name, at in points.items()
        for axis, x in zip(names, at, strict=True)
    )


@pytest.fixture
def plain(tmp_path):
    return load(write(tmp_path, table().replace(";", ","), "car.csv"), SAID).mechanism


def tree(points=POINTS):
    return {name: dict(zip("xyz", at, strict=True)) for name, at in points.items()}


LISTED = [{"name": name, "position": list(at)} for name, at in POINTS.items()]
RIGHT = {name: (x, -y, z) for name, (x, y, z) in POINTS.items()}
NESTED = {
    "uca": {"chassis_front": "uca_front", "chassis_rear": "uca_rear", "knuckle": "uca_outer"},
    "lca": {"chassis_front": "lca_front", "chassis_rear": "lca_rear", "knuckle": "lca_outer"},
    "tie_rod": {"rack": "tierod_inner", "knuckle": "tierod_outer"},
    "wheel": {"center": "wheel_center"},
}
NESTED = {part: {end: POINTS[role] for end, role in ends.items()} for part, ends in NESTED.items()}


@pytest.mark.parametrize(("name", "each", "pattern", "head"), rows(PATTERNS))
def test_hardpoint_patterns_read_alike(tmp_path, plain, name, each, pattern, head):
    if ".y" in name:
        pytest.importorskip("yaml")
    text = head + {"axes": axes, "lines": lines}[each](pattern)
    assert load(write(tmp_path, text, name), SAID).mechanism == plain


FORMS = {
    "with a head and units": ("car.csv", axes("{} {};{};[mm];a note").join(["point;value\n", ""])),
    "a coordinate a row, decimal comma": ("car.csv", comma(axes("{}|{};{}")).replace("|", ".")),
    "one wide row": (
        "car.csv",
        "\n".join(
            ",".join(each)
            for each in zip(*(x.split(",") for x in axes("{}_{},{}").split()), strict=False)
        ),
    ),
    "no head, decimal comma": ("car.csv", "Front axle\n" + comma(lines("{};{};{};{}"))),
    "MATLAB": (
        "car.m",
        "clear\n% units: mm\n" + lines("front.{} = [{} {}, {}]; % [mm]") + "d = 18; % [in]",
    ),
    "MATLAB, left and right": (
        "car.m",
        lines("hp.left.{} = [{}, {}, {}];") + lines("hp.right.{} = [{}, {}, {}];", RIGHT),
    ),
    "YAML": ("car.yaml", "hardpoints:\n" + lines("  {}: {{x: {}, y: {}, z: {}}}")),
    "JSON": ("car.json", json.dumps({"unit": "mm", "hardpoints": {"left": tree()}})),
    "JSON, parts": ("car.json", json.dumps(NESTED)),
    "JSON, a list": ("car.json", json.dumps(LISTED)),
    "JSON, flat": (
        "car.json",
        json.dumps(
            {f"{n}_{a}": x for n, at in POINTS.items() for a, x in zip("xyz", at, strict=False)}
        ),
    ),
}


@pytest.mark.parametrize("kind", FORMS)
def test_hardpoint_forms_read_alike(tmp_path, plain, kind):
    name, text = FORMS[kind]
    if name.endswith(("yaml", "yml")):
        pytest.importorskip("yaml")
    found = load(write(tmp_path, text, name), SAID).mechanism
    assert found == plain


def test_json_keys_template_units_axes(tmp_path, plain):
    keys = {"type": "double_wishbone", "units": "mm", "axes": "rearward,right,up", "side": "left"}
    file = write(tmp_path, json.dumps({**keys, "hardpoints": tree()}), "car.json")
    assert load(file).mechanism == plain


def test_sheet_option_chooses_json_section(tmp_path, plain):
    text = json.dumps({"front": tree(), "rear": tree(RIGHT)})
    file = write(tmp_path, text, "car.json")
    with pytest.raises(CaseError, match=r"found points in 'front', 'rear', .* --sheet NAME"):
        load(file, SAID)
    found = load(file, replace(SAID, sheet="front"))
    assert found.mechanism == plain
    assert "9 points of other sections" in found.source
    with pytest.raises(CaseError, match=r"--sheet: found no section 'frnt', .* 'front'"):
        load(file, replace(SAID, sheet="frnt"))


def test_camel_case_point_names(tmp_path, plain):
    text = lines("{};{};{};{}").replace("uca_outer", "upperBallJoint").replace("_center", "Centre")
    found = load(write(tmp_path, text, "car.csv"), SAID).mechanism
    assert found == plain


def test_wheel_of_hub_offset_and_tire(tmp_path):
    """The offset is inboard; the radius is half the rim in inches and the height of the tire."""
    pytest.importorskip("yaml")
    case = load(write(tmp_path, EXPLORER, "car.yaml"), Supplied(axes="iso"))
    assert case.mechanism.point("wheel_center").position == pytest.approx((-0.02, 0.91, 0.3))
    (toe,) = (each for each in case.outputs if each.name == "toe")
    assert toe.vehicle.wheel_radius == pytest.approx(0.3136)
    assert toe.vehicle.static_camber == 0.0


def test_spin_axis_direction_is_omitted(tmp_path):
    """An axis of one metre from the origin would be a wheel of another attitude."""
    text = json.dumps({**NESTED, "wheel": NESTED["wheel"] | {"spin_axis": [0, 1, 0]}})
    case = load(write(tmp_path, text, "car.json"), SAID)
    assert "wheel.spin_axis" in case.source


TEXTS = {
    "": "",
    "rows": axes("{}_{},{}"),
    "rows and units": axes("{}_{};{};mm"),
    "table": table().replace(";", ","),
    "script": lines("{} = [{}, {}, {}];"),
    "units in remarks": lines("{} = [{}, {}, {}]; % [mm]"),
    "tree": json.dumps(tree()),
    "list": json.dumps(LISTED),
}


@pytest.mark.parametrize(("name", "form", "old", "new", "message"), rows(FAULTS))
def test_hardpoint_form_faults(tmp_path, name, form, old, new, message):
    if name.endswith("yaml"):
        pytest.importorskip("yaml")
    assert old in TEXTS[form]
    complains(write(tmp_path, TEXTS[form].replace(old, new, 1), name), message, SAID)


@pytest.mark.parametrize("heads", CORNERS)
def test_german_corners_are_read(tmp_path, heads):
    """As the English ones: `axle;side` with `front;left`."""
    rows = ["# units: mm", "# axes: forward,left,up", f"{heads};Name;x;y;z"]
    for k, cells in enumerate(CORNERS[heads].values()):
        rows += [f"{cells};p{n};{n},5;{k},0;{n * n},0" for n in range(4)]
    (file := tmp_path / "auto.csv").write_text("\n".join(rows))
    for k, corner in enumerate(CORNERS[heads]):
        found = read_hardpoints(file, Supplied(corner=corner))
        assert [each.position for each in found.points.values()] == [
            (n + 0.5, float(k), float(n * n)) for n in range(4)
        ]
        assert found.side == ("right" if corner == "FR" else "left")


def test_names_of_comments_alone(tmp_path):
    names = write(tmp_path, '# uca_front = "A"\n\n# uca_rear = "B"\n', "names.toml")
    file = write(tmp_path, table().replace("uca_", "q_"), "car.csv")
    with pytest.raises(CaseError, match=r"names\.toml: found no names, all lines are comments"):
        load(file, replace(SAID, names=names, ask_names=True))


def test_german_names_of_curves(tmp_path):
    text = "Einfederung [mm];Vorspur [°];Sturz [°]\n" + "".join(
        f"{z},0;0,1;{k},5\n" for k, z in enumerate((-20, -10, 0, 10, 20))
    )
    case = load(write(tmp_path, table(), "car.csv"), SAID)
    curve = write(tmp_path, text, "rig.csv")
    found, notes = with_curve(case, curve, CurveOptions())
    assert {*found.reference} == {"toe", "camber"}
    assert "read stroke [mm], toe [deg, column 'Vorspur [°]'], camber" in notes[0]


@pytest.mark.parametrize("ending", ["json", "yaml"])
@pytest.mark.parametrize("head", ["", '{"units": "mm",\n"points":'])
def test_point_in_list_has_line(tmp_path, ending, head):
    """Of a list of points, alone or in a table; YAML reads JSON."""
    pytest.importorskip("yaml")
    points = [{"name": f"p{k}", "x": 1, "y": 2, "z": "1e999" if k == 2 else 3} for k in range(4)]
    text = f"{head}\n{json.dumps(points, indent=0)}{'}' * bool(head)}"
    line = line_with(text, "1e999")
    said = rf"line {line}: (points)?\[2\]\.z \((points\.)?p2\.z\): found '1e999'"
    with pytest.raises(CaseError, match=said):
        read_hardpoints(write(tmp_path, text, f"points.{ending}"))
