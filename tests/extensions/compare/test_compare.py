"""kincheck compare, against an independent solution of rods and lines, and as a user meets it."""

import csv
import json

import kincheck
import pytest
from kincheck.core.cli.main import main
from kincheck.core.extensions.compare import designs
from kincheck.core.extensions.hardpoints.templates import TEMPLATES

from ...report.page import Page
from ...support.case_texts import rows
from ...support.rods_of_templates import CLOSE, expected

TEMPLATE = TEMPLATES["double_wishbone"]
MOVED = {"uca_outer": (-0.015, 0.54, 0.314), "tierod_inner": (0.07, 0.223, 0.15)}


def table(file, points, unit="mm", size=1e-3, axes="forward,left,up", signs=(1, 1, 1)):
    """Write points in metres, forward, left and up."""
    lines = [f"# template: {TEMPLATE.name}", f"# units: {unit}", f"# axes: {axes}", "name,x,y,z"]
    for name, place in points.items():
        numbers = (repr(sign * x / size) for sign, x in zip(signs, place, strict=True))
        lines.append(",".join((name, *numbers)))
    file.parent.mkdir(exist_ok=True)
    file.write_text("\n".join(lines) + "\n")
    return str(file)


@pytest.fixture
def old(tmp_path):
    return table(tmp_path / "old.csv", TEMPLATE.sample)


@pytest.fixture
def new(tmp_path):
    return table(tmp_path / "new.csv", {**TEMPLATE.sample, **MOVED})


def test_compare_writes_differences_of_curves(tmp_path, old, new, capsys):
    files = f"--csv {tmp_path / 'd.csv'} --json {tmp_path / 'd.json'} --out {tmp_path / 'out'}"
    assert main(["compare", old, new, "--travel", "40mm:5", *files.split()]) == 0
    rows = [*csv.DictReader((tmp_path / "d.csv").read_text().splitlines())]
    at = {**TEMPLATE.sample, **MOVED}
    for row in rows:
        travel = float(row["stroke [mm]"]) / 1000.0
        before, after = (expected(TEMPLATE.name, each, travel) for each in (TEMPLATE.sample, at))
        for head, factor in (("roll_center_height old [mm]", 1e3), ("scrub_radius old [mm]", 1e3)):
            name, _, unit = head.partition(" old ")
            true = factor * (after[name] - before[name])
            assert float(row[f"{name} new - old {unit}"]) == pytest.approx(true, abs=1e3 * CLOSE)
            assert float(row[head]) == pytest.approx(factor * before[name], abs=1e3 * CLOSE)
        turned = float(row["camber new - old [deg]"]) * 3.141592653589793 / 180.0
        assert turned == pytest.approx(after["camber"] - before["camber"], abs=CLOSE)
    printed = capsys.readouterr().out
    assert "uca_outer     new     -15, 540, 312  -15, 540, 314        0, 0, 2" in printed
    assert "tierod_inner  new      70, 220, 150   70, 223, 150        0, 3, 0" in printed
    assert {each["case"] for each in json.loads((tmp_path / "d.json").read_text())["records"]} == {
        "old",
        "new",
    }
    page = Page((tmp_path / "out" / "compare.html").read_text())
    assert "new against old" in page.text
    assert ["tierod_inner", "new", "70, 220, 150", "70, 223, 150", "0, 3, 0"] in page.tables[1][1]


def test_printed_changes_are_from_first_design(tmp_path, old, new):
    """Each change is the value less the value above it, to their digits, and so is the largest."""
    main(["compare", old, new, "--travel", "40mm:3", "--out", str(tmp_path / "out")])
    (_, rows), *_ = Page((tmp_path / "out" / "compare.html").read_text()).tables
    found = [row for row in rows if row[1:2] in (["old"], ["new"])]
    assert len(found) >= 20
    for above, below in zip(found[::2], found[1::2], strict=True):
        changes = list[float]()
        for k in range(2, len(above) - 2, 2):
            texts = above[k], below[k], below[k + 1]
            before, after, change = map(_number, texts)
            of_each = [len(each.strip().partition(".")[2]) for each in texts if _number(each)]
            digits = min(of_each, default=9)
            assert change == pytest.approx(after - before, abs=1.01 * 10.0**-digits)
            changes.append(change)
        largest = max(map(abs, changes[:3]))  # of rebound, design and jounce, and not of the slope
        assert abs(_number(below[-2])) == pytest.approx(largest, rel=0.06)


def _number(text):
    return float(text.replace("−", "-"))


def test_compare_converts_units_and_axes(tmp_path, old, capsys):
    inch = table(
        tmp_path / "inch.csv", TEMPLATE.sample, "inch", 0.0254, "rearward,right,up", (-1, -1, 1)
    )
    assert main(["compare", old, inch, "--tolerance", "camber=1e-9"]) == 0
    printed = capsys.readouterr().out
    assert "No difference: toe, camber, caster, kingpin_inclination, roll_center_height" in printed
    assert "No point that both have differs between old and inch." in printed


def test_compare_prints_points_in_first_axes(tmp_path, new, capsys):
    first = table(
        tmp_path / "adams.csv", TEMPLATE.sample, axes="rearward,right,up", signs=(-1, -1, 1)
    )
    assert main(["compare", first, new]) == 0
    assert "tierod_inner  new     -70, -220, 150  -70, -223, 150" in capsys.readouterr().out


def test_compare_labels_equal_names_by_file(tmp_path, old, new, capsys):
    other = table(tmp_path / "b" / "old.csv", {**TEMPLATE.sample, **MOVED})
    assert main(["compare", old, other, new]) == 0
    printed = capsys.readouterr().out
    assert f"{other}, {new} against {old}" in printed
    assert sum(line.startswith("uca_outer") for line in printed.splitlines()) == 2


@pytest.mark.parametrize(
    ("option", "status"),
    [("toe=1e-3", 1), ("toe=5 deg", 0), ("toe=1e-6rad", 1), ("scrub_radius=20mm", 0)],
)
def test_compare_tolerance_gives_exit_status(old, new, capsys, option, status):
    assert main(["compare", old, new, "--tolerance", option]) == status
    assert ("toe of new differs by" in capsys.readouterr().out) == (status == 1)


def test_compare_omits_differently_defined_outputs(tmp_path, old, capsys):
    bare = {name: at for name, at in TEMPLATE.sample.items() if name != "wheel_contact"}
    assert main(["compare", old, table(tmp_path / "bare.csv", bare), "--travel", "20mm:3"]) == 0
    printed = capsys.readouterr().out
    assert (
        "defined otherwise: half_track_change (old: half_track_change at contact; bare:" in printed
    )
    assert "Only in old: wheel_contact." in printed


def test_compare_beyond_reach_has_status_2(tmp_path, old, new, capsys):
    file = tmp_path / "d.csv"
    assert main(["compare", old, new, "--travel", "300mm:5", "--csv", str(file)]) == 2
    found = capsys.readouterr()
    assert "uca_outer" in found.out
    assert "kincheck: old: " in found.err
    assert len(file.read_text().splitlines()) == 6


@pytest.mark.parametrize(
    ("given", "said"),
    rows(
        """
OLD | found one design, expected two or more
OLD NEW OLD | found twice
OLD nosuch.csv | nosuch.csv: no such file
OLD four_bar | four_bar: found the driver crank, expected stroke
mcpherson_suspension mcpherson_strut | have no output in common
OLD NEW --tolerance tow=1 | did you mean 'toe'?
OLD NEW --tolerance toe=1mm | expected an angle
OLD NEW --tolerance toe | expected a positive number
OLD NEW --axle hheave | did you mean 'heave'?
""",
        named=False,
    ),
)
def test_compare_invalid_arguments_are_refused(old, new, capsys, given, said):
    words = given.replace("OLD", old).replace("NEW", new).split()
    assert main(["compare", *words]) == 2
    assert said in capsys.readouterr().err


def test_compare_in_python_equals_command(tmp_path, old, new):
    file, travel = tmp_path / "d.csv", kincheck.Supplied(travel="40mm:5")
    assert main(["compare", old, new, "--travel", "40mm:5", "--csv", str(file)]) == 0
    rows = [*csv.DictReader(file.read_text().splitlines())]
    found = kincheck.compare([old, new], supplied=travel, tolerance="toe=0.001 deg")
    table = found.to_dict()["data_vars"]["camber"]
    assert table["attrs"] == {"units": "deg"}
    for label, values in zip(("old", "new"), table["data"], strict=True):
        assert values == [float(row[f"camber {label} [deg]"]) for row in rows]
    assert "toe of new differs" in found.exceeded[0]
    assert "new against old" in repr(found)
    assert "<svg xmlns" in found.to_html()
    cases = [kincheck.load(each, travel) for each in (old, new)]
    toe = found.curves["new"]["toe"]
    assert kincheck.compare(*cases).curves["new"]["toe"] == pytest.approx(toe)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"tolerance": "tow=1"}, "did you mean 'toe'"),
        ({"supplied": kincheck.Supplied(travel="300mm:5")}, "not reached|cannot"),
    ],
)
def test_compare_in_python_refuses_invalid_arguments(old, new, given, said):
    with pytest.raises(kincheck.KincheckError, match=said):
        kincheck.compare(old, new, **given)


def test_compare_of_cases_prints_directions(tmp_path, capsys):
    """Of a case in millimetres: points in these, directions as they are; a point in metres."""
    text = """schema = "kincheck-case/1"
name = "NAME"
source = "made up"
units = { length = "mm" }
[bodies.crank]
[joints.axle]
type = "revolute"
bodies = ["ground", "crank"]
point = POINT
axis = AXIS
[points.tip]
body = "crank"
position = [100.0, 0.0, 0.0]
[drivers.turn]
type = "joint_angle"
joint = "axle"
[sweep]
driver = "turn"
start = -0.4
stop = 0.4
steps = 4
[outputs.x]
type = "coordinate"
point = "tip"
direction = [1, 0, 0]
"""
    files = []
    for name, point, axis in (("a", "[0, 0, 0]", "[0, 0, 1]"), ("b", "[5, 0, 0]", "[0, 0.6, 0.8]")):
        file = tmp_path / f"{name}.toml"
        file.write_text(text.replace("NAME", name).replace("POINT", point).replace("AXIS", axis))
        files.append(str(file))
    assert main(["compare", *files, "--json", str(tmp_path / "d.json")]) == 0
    assert "per m of travel" not in capsys.readouterr().out
    found = json.loads((tmp_path / "d.json").read_text())["run"]["comparison"]["points"]
    assert {each["point"]: each["moved by [mm]"] for each in found} == {
        "joints.axle.point": "5, 0, 0",
        "joints.axle.axis": "0, 0.6, -0.2",
    }


def test_columns_stand_at_the_decimal(old, new):
    """And what is below the digits of an output is 0, not a power of ten."""
    rows = designs.comparison(kincheck.compare(old, new), []).sections[0].rows
    for column in [*zip(*rows, strict=True)][2:-1]:
        cells = [each.replace("\u2008", ".") for each in column if each]
        assert len({len(each.partition(".")[2]) for each in cells}) == 1
        assert not any("e" in each for each in cells)
