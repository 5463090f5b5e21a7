"""Cases of tables of hardpoints, and what is wrong with a table."""

import csv
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from kincheck.core.case.case import Truth
from kincheck.core.case.io.reader_options import LEFT_OUT, Supplied
from kincheck.core.case.models.files import load
from kincheck.core.case.models.hardpoints.templates import TEMPLATES
from kincheck.core.cli.main import main
from kincheck.core.kinematics import solve
from scipy.optimize import fsolve

from ..support.case_texts import complains

DATA = Path(__file__).parents[1] / "data" / "hardpoints"
CHRONO = {
    "chrono_macpherson_strut": "mcpherson",
    "chrono_double_wishbone": "double_wishbone",
    "chrono_multi_link": "five_link",
    "chrono_sedan_double_wishbone": "double_wishbone",
}
ADAMS = DATA / "adams_front_suspension.sub"
AXLE = Supplied(template="double_wishbone", travel="0.06:13")

# Natural rounding of metre-sized coordinates, and what a mechanism amplifies it by.
EXACT = 1e-14


def swept(case):
    found = solve(case.mechanism, "stroke", case.sweep.change, bodies=["knuckle"])
    assert found.solved.all(), found.message
    return found


def turned(p, a):
    """The direction a, fixed in a body that was not turned at design, for Euler parameters p, shape
    (n, 4).
    """
    e0, e = p[:, :1], p[:, 1:]
    return (2.0 * e0**2 - 1.0) * a + 2.0 * e * (e @ a)[:, None] + 2.0 * e0 * np.cross(e, a)


@pytest.mark.parametrize("name", CHRONO)
def test_chrono_suspension_sweeps_to_40_digits(name):
    """Wheel centre and spin axis against 40-digit solutions by another formulation; the template is
    the file's own.
    """
    case = load(DATA / f"{name}.json", Supplied(travel="0.07:15"))
    with (DATA / "chrono_sweeps.csv").open() as lines:
        rows = [
            [float(row[key]) for key in row if key != "file"]
            for row in csv.DictReader(lines)
            if row["file"] == name
        ]
    truth = np.array(rows)
    found = swept(case)
    assert case.truth is Truth.CONSENSUS_ONLY
    assert np.allclose(case.sweep.values, truth[:, 0], rtol=0, atol=EXACT)
    assert np.abs(found.points["wheel_center"].position - truth[:, 1:4]).max() < EXACT
    assert (
        np.abs(turned(found.bodies["knuckle"].p, np.array([0.0, 1.0, 0.0])) - truth[:, 4:]).max()
        < EXACT
    )


def test_chrono_omitted_keys_are_listed():
    source = load(DATA / "chrono_macpherson_strut.json").source
    assert source.startswith(
        "Project Chrono hardpoints of chrono_macpherson_strut.json on the template mcpherson"
    )
    listed = source.split(LEFT_OUT)[1]
    for part in (
        "Spring (Spring Coefficient, Free Length)",
        "Shock/Location Chassis",
        "Spindle (Mass, Inertia",
        "Axle (Inertia)",
    ):
        assert part in listed
    assert "Control Arm/Location" not in listed
    assert "[PARAMETER] (4 rows)" in load(ADAMS, AXLE).source.split(LEFT_OUT)[1]


def test_chrono_template_option_agrees_with_file():
    said = load(DATA / "chrono_multi_link.json", Supplied(template="multi-link"))
    assert said.mechanism == load(DATA / "chrono_multi_link.json").mechanism


def test_chrono_json_comments(tmp_path):
    text = (DATA / "chrono_macpherson_strut.json").read_text()
    commented = tmp_path / "chrono_macpherson_strut.json"
    commented.write_text(
        text.replace('"Axle"', '// the "axle", of no use here\n /* 1, 2\n 3 */ "Axle"')
    )
    assert load(commented).mechanism == load(DATA / "chrono_macpherson_strut.json").mechanism


def rods(points, travel):
    """The wheel centre of a carrier on rods, by its own equations: lengths stay, Rodrigues'
    rotation, scipy's root.
    """
    ends = [
        (points["lca_front"], points["lca_outer"]),
        (points["lca_rear"], points["lca_outer"]),
        (points["uca_front"], points["uca_outer"]),
        (points["uca_rear"], points["uca_outer"]),
        (points["tierod_inner"], points["tierod_outer"]),
    ]
    ends, wheel = [tuple(map(np.array, pair)) for pair in ends], np.array(points["wheel_center"])

    def carried(x, p):
        angle = np.linalg.norm(x[3:]) or 1.0
        axis, arm = x[3:] / angle, p - wheel
        turn = (
            arm * np.cos(angle)
            + np.cross(axis, arm) * np.sin(angle)
            + axis * (axis @ arm) * (1.0 - np.cos(angle))
        )
        return wheel + x[:3] + (turn if x[3:].any() else arm)

    def defects(x):
        lengths = [(carried(x, q) - p) @ (carried(x, q) - p) - (q - p) @ (q - p) for p, q in ends]
        return [*lengths, x[2] - travel]

    return wheel + fsolve(defects, [0.0, 0.0, travel, 0.0, 0.0, 0.0], xtol=1e-12)[:3]


def test_adams_front_suspension_on_five_rods():
    """Millimetres, x rearward and y right in the file; metres, x forward and y left in the case."""
    case = load(ADAMS, AXLE)
    iso = {name: np.array([-x, -y, z]) / 1000.0 for name, (x, y, z) in adams_points().items()}
    path = swept(case).points["wheel_center"].position
    assert case.mechanism.point("wheel_center").position == (-0.267, 0.76, 0.33)
    for travel, position in zip(case.sweep.values, path, strict=True):
        # fsolve stops at steps of 1e-12 relative; its Jacobian is differenced
        assert np.abs(position - rods(iso, travel)).max() < 1e-10


def adams_points():
    """The rows of the file, read in another way."""
    rows = [
        line.replace("'", " ").split()
        for line in ADAMS.read_text().splitlines()
        if "left/right" in line
    ]
    return {
        row[0]: tuple(map(float, row[2:5])) for row in rows if len(row) == 5 and row[2] != "real"
    }


def table(points, head="name,x,y,z", comment=""):
    return "\n".join(
        [
            *([comment] if comment else []),
            head,
            *(f"{name},{x!r},{y!r},{z!r}" for name, (x, y, z) in points.items()),
        ]
    )


AXES = {
    "forward,left,up": lambda x, y, z: (-x, -y, z),
    "forward,right,down": lambda x, y, z: (-x, y, -z),
    "rearward,right,up": lambda x, y, z: (x, y, z),
    "up,left,rearward": lambda x, y, z: (z, -y, x),
}


@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("unit", ["mm", "m"])
def test_hardpoint_table_units_and_axes(tmp_path, axes, unit):
    file, scale = tmp_path / ADAMS.with_suffix(".csv").name, 1.0 if unit == "mm" else 1000.0
    points = {
        name: tuple(value / scale for value in AXES[axes](*at))
        for name, at in adams_points().items()
    }
    file.write_text(table(points))
    said = Supplied(template="double_wishbone", units=unit, axes=axes)
    assert load(file, said).mechanism == load(ADAMS, AXLE).mechanism


@pytest.mark.parametrize(
    ("head", "comment"),
    [
        ("name,x [mm],y [mm],z [mm]", "# axes: rearward, right, up"),
        ("Name,X_mm,Y_mm,Z_mm", "# Axes = adams"),
        ("name,x,y,z", "# axes: rearward,right,up\n# units: mm"),
    ],
)
def test_hardpoint_table_states_units_and_axes(tmp_path, head, comment):
    file = tmp_path / ADAMS.with_suffix(".csv").name
    file.write_text(table(adams_points(), head, comment))
    assert load(file, Supplied(template="double_wishbone")).mechanism == load(ADAMS, AXLE).mechanism


def test_hardpoint_table_semicolons_and_prefixes(tmp_path):
    file = tmp_path / ADAMS.with_suffix(".csv").name
    points = {f"hpl_{name}": at for name, at in adams_points().items()}
    points["hpl_Wheel Centre"] = points.pop("hpl_wheel_center")
    file.write_text(table(points).replace(",", ";"))
    assert (
        load(file, Supplied("double_wishbone", "mm", "adams")).mechanism
        == load(ADAMS, AXLE).mechanism
    )


def test_adams_right_side_is_omitted(tmp_path):
    file = tmp_path / ADAMS.name
    broken = " 'lca_outer                   '  'right       '    267.0      750.0      130.0\n"
    file.write_text(
        ADAMS.read_text().replace(
            "$----------------------------------------------------------------------PARAM",
            f"{broken}$",
        )
    )
    case = load(file, AXLE)
    assert case.mechanism == load(ADAMS, AXLE).mechanism
    assert "1 points of the right side" in case.source


@pytest.mark.parametrize("template", TEMPLATES.values(), ids=lambda template: template.name)
def test_template_roles_are_consistent(template):
    """Roles are named once, and what is compared tells how the knuckle stands."""
    names = [role.name for role in template.roles]
    assert len(set(names)) == len(names)
    paired = {role for pair in (*template.above, *template.ahead) for role in pair}
    assert {*paired, *template.watched} <= set(names)
    assert len(template.watched) == 3
    for a, b in combinations(template.roles, 2):
        shared = set(a.names) & set(b.names)
        # only the ball that two links of an arm share
        assert not shared or {a.name, b.name} == {"upper_front_outer", "upper_rear_outer"}


STRUT, MULTI_LINK = DATA / "chrono_macpherson_strut.json", DATA / "chrono_multi_link.json"
WISHBONE = "double_wishbone"
TABLE = """name,x,y,z
lca_front,67,-400,180
lca_outer,267,-750,130
lca_rear,467,-450,185
tierod_inner,467,-400,330
tierod_outer,417,-750,330
uca_front,367,-450,555
uca_outer,307,-675,555
uca_rear,517,-490,560
wheel_center,267,-760,330
"""
WHOLE = Supplied(WISHBONE, "mm", "rearward,right,up")


def edited(tmp_path, source, *edits):
    text, name = (
        (source, "car.csv") if isinstance(source, str) else (source.read_text(), source.name)
    )
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    file = tmp_path / name
    file.write_text(text)
    return file


CHRONO_FAULTS = {
    "cut": (("Location Chassis Front", "Loc"), "not valid JSON"),
    "misspelt": (
        ('"Location Upright": [-0.02', '"Location Uprihgt": [-0.02'),
        "lca_outer ... Control Arm/Location Uprihgt",
    ),
    "no list": (
        ("[0.22, 0.52, -0.156]", "0.22"),
        "Control Arm/Location Chassis Front ... 0.22 ... three numbers",
    ),
    "two numbers": (
        ("[0.22, 0.52, -0.156]", "[0.22, 0.52]"),
        "Control Arm/Location Chassis Front ... three numbers",
    ),
    "text": (
        ("[0.22, 0.52, -0.156]", '[0.22, 0.52, "low"]'),
        "Control Arm/Location Chassis Front ... 'low' ... coordinate",
    ),
    "no suspension": (
        ('"Type": "Suspension"', '"Type": "Steering"'),
        "Type ... Steering ... Suspension",
    ),
    "other template": (
        ('"MacPhersonStrut"', '"SolidAxle"'),
        ("Template ... SolidAxle ... mcpherson, double_wishbone,  ... five_link, three_link"),
    ),
    "template no text": (('"MacPhersonStrut"', "7"), "Template ... 7 ... name"),
    "millimetres": (("0.22, 0.52, -0.156", "220.0, 520.0, -156.0"), "span ... another unit"),
}


@pytest.mark.parametrize("kind", CHRONO_FAULTS)
def test_chrono_file_faults(tmp_path, kind):
    edit, fragments = CHRONO_FAULTS[kind]
    file = edited(tmp_path, STRUT, edit)
    if kind == "cut":
        file.write_text(file.read_text()[:600])
    complains(file, fragments, Supplied(ask_names=True))


ADAMS_FAULTS = {
    "no units": (
        (" LENGTH  =  'mm'\n", ""),
        "does not say in which unit ... --units mm or --units m",
    ),
    "unknown unit": (("'mm'", "'furlong'"), "unit ... furlong ... mm"),
    "cut row": (("-750.0      130.0", "-750.0"), "line 17 ... found 4 fields ... expected 5"),
    "no number": (
        ("-750.0      130.0", "-750.0      13O.0"),
        "line 17 ... lca_outer ... z_value ... '13O.0'",
    ),
    "digit separators": (
        ("-750.0      130.0", "-750.0      1_30.0"),
        "line 17 ... lca_outer ... z_value ... '1_30.0'",
    ),
    "unknown side": (
        ("'left/right  '    267.0", "'lift/right  '    267.0"),
        "line 17 ... lca_outer ... 'lift/right' ... 'left/right'",
    ),
    "twice": (("'lca_rear ", "'lca_front"), "line 18 ... lca_front ... line 16 ... expected once"),
    "misspelt": (("'uca_rear ", "'uca_raer "), "uca_rear ... 'uca_raer' ... line 23 ... is it"),
    "no block": (("[HARDPOINT]", "[HARDPIONT]"), "no row in a block [HARDPOINT]"),
    "other columns": (("x_value    y_value", "x_value    r_value"), "line 15 ... r_value"),
}


@pytest.mark.parametrize("kind", ADAMS_FAULTS)
def test_adams_hardpoint_faults(tmp_path, kind):
    edit, fragments = ADAMS_FAULTS[kind]
    complains(edited(tmp_path, ADAMS, edit), fragments, Supplied(WISHBONE, ask_names=True))


def test_adams_truncated_hardpoints_are_refused(tmp_path):
    file = tmp_path / ADAMS.name
    file.write_text(ADAMS.read_text().split(" 'uca_rear")[0])
    missing = "missing uca_rear, the upper arm's rear pivot ... wheel_center, the wheel's centre"
    complains(file, missing, Supplied(WISHBONE))


TABLE_FAULTS = {
    "no unit": ((), Supplied(WISHBONE, None, "adams"), "--units mm or --units m"),
    "no axes": ((), Supplied(WISHBONE, "mm"), "where x, y and z point ... --axes forward,left,up"),
    "no template": (
        (),
        Supplied(None, "mm", "adams", ask_names=True),
        "--template ... mcpherson, double_wishbone,  ... five_link, three_link",
    ),
    "no template, and names that fit none": (
        ("uca_outer", "my_point"),
        Supplied(None, "mm", "adams"),
        "--template ... mcpherson, double_wishbone,  ... five_link, three_link",
    ),
    "neither unit nor axes": ((), Supplied(WISHBONE), "--units mm or m ... --axes forward,left"),
    "misspelt template": (
        (),
        Supplied("duoble_wishbone", "mm", "adams"),
        "--template ... 'duoble_wishbone' ... 'double_wishbone'",
    ),
    "wrong template": (
        (),
        Supplied("mcpherson", "mm", "adams"),
        "template mcpherson: missing strut_lower ... uca_front",
    ),
    "misspelt unit": ((), Supplied(WISHBONE, "milimetre", "adams"), "--units ... 'milimetre'"),
    "wrong unit": ((), Supplied(WISHBONE, "m", "adams"), "span ... expected a suspension"),
    "misspelt axes": (
        (),
        Supplied(WISHBONE, "mm", "rearward,rihgt,up"),
        "--axes ... rihgt ... left or right",
    ),
    "axes twice": ((), Supplied(WISHBONE, "mm", "left,right,up"), "--axes ... one each"),
    "mirrored": (
        (),
        Supplied(WISHBONE, "mm", "rearward,left,up"),
        "wheel_center ... y = -760 ... expected the left side ... --axes",
    ),
    "backwards": (
        (),
        Supplied(WISHBONE, "mm", "forward,right,up"),
        "uca_front ... uca_rear ... in front of that ... --axes",
    ),
    "upside down": (
        (),
        Supplied(WISHBONE, "mm", "rearward,right,down"),
        "uca_outer ... lca_outer ... expected it above",
    ),
    "travel": ((), Supplied(WISHBONE, "mm", "adams", "5deg"), "--travel ... '5deg' ... a length"),
    "separated travel": (
        (),
        Supplied(WISHBONE, "mm", "adams", "0.0_5"),
        "--travel ... '0.0_5' ... a length",
    ),
    "many samples": (
        (),
        Supplied(WISHBONE, "mm", "adams", "0.05:1000000000"),
        "LENGTH:SAMPLES, 2 to 1000000 of them",
    ),
    "one sample": (
        (),
        Supplied(WISHBONE, "mm", "adams", "0.05:1"),
        "LENGTH:SAMPLES, 2 to 1000000 of them",
    ),
    "no travel": ((), Supplied(WISHBONE, "mm", "adams", "0"), "--travel ... '0' ... a length"),
    "drive": (
        (),
        Supplied(WISHBONE, "mm", "adams", drive=("a:0:1",)),
        "--drive ... hardpoint table",
    ),
    "cut row": (("417,-750,330", "417,-750"), WHOLE, "line 6 ... found 3 fields ... expected 4"),
    "no number": (
        ("417,-750,330", "417,-75O,330"),
        WHOLE,
        "line 6 ... tierod_outer ... y ... '-75O'",
    ),
    "digit separators": (
        ("417,-750,330", "417,-7_50,330"),
        WHOLE,
        "line 6 ... tierod_outer ... y ... '-7_50' ... correct",
    ),
    "other digits": (
        ("417,-750,330", "417,-７５０,330"),
        WHOLE,
        "line 6 ... tierod_outer ... y ... '-７５０'",
    ),
    "not finite": (("417,-750,330", "417,nan,330"), WHOLE, "line 6 ... tierod_outer ... 'nan'"),
    "twice": (("lca_rear", "lca_front"), WHOLE, "line 4 ... lca_front ... line 2"),
    "two for one": (
        ("lca_rear", "wheel"),
        WHOLE,
        "wheel_center ... 'wheel' (line 4) ... 'wheel_center' (line 10)",
    ),
    "misspelt": (
        ("lca_rear", "lca_raer"),
        replace(WHOLE, ask_names=True),
        "lca_rear, the lower arm's rear pivot ... is it 'lca_raer', line 4?",
    ),
    "no head": (("name,x,y,z\n", "1,2,3,4,5\n"), WHOLE, "line 1 ... expected the head name,x,y,z"),
    "two units": (("name,x,y,z", "name,x [mm],y [mm],z [m]"), WHOLE, "line 1 ... one unit"),
    "unit contradicts": (
        ("name,x,y,z", "name,x [m],y [m],z [m]"),
        WHOLE,
        "--units ... found mm ... in m",
    ),
    "remark contradicts": (
        ("name,x,y,z", "# units: m\nname,x [mm],y [mm],z [mm]"),
        WHOLE,
        "line 2 ... in mm, and m",
    ),
    "no name": (("lca_rear", ""), WHOLE, "line 4 ... name the point"),
}


@pytest.mark.parametrize("kind", TABLE_FAULTS)
def test_hardpoint_table_faults(tmp_path, kind):
    edit, supplied, fragments = TABLE_FAULTS[kind]
    complains(edited(tmp_path, TABLE, *([edit] if edit else [])), fragments, supplied)


@pytest.mark.parametrize(
    ("text", "fragment"),
    [("", "is empty"), ("name,x,y,z\n", "no row"), ("# nothing\n", "is empty")],
)
def test_empty_hardpoint_table_is_refused(tmp_path, text, fragment):
    file = tmp_path / "car.csv"
    file.write_text(text)
    complains(file, fragment, WHOLE)


@pytest.mark.parametrize("name", TEMPLATES)
def test_template_follows_from_point_names(tmp_path, name, capsys):
    rows = [f"{role},{x},{y},{z}" for role, (x, y, z) in TEMPLATES[name].sample.items()]
    file = tmp_path / "car.csv"
    file.write_text("\n".join(["# units: m", "# axes: forward,left,up", "name,x,y,z", *rows]))
    if name.startswith("pushrod"):
        three = "pushrod_lower_arm or pushrod_upper_arm or pushrod_knuckle"
        complains(file, f"add --template {three}", Supplied())
        return
    said = [note for note in load(file, Supplied()).assembly if "--template" in note]
    wanted = name.removeprefix("reduced_")
    assert said == [f"template {wanted}, by the names of its points: --template states it"]


def test_template_option_contradicting_file_is_refused():
    message = "--template ... found mcpherson ... MultiLink ... expected five_link"
    complains(MULTI_LINK, message, Supplied("mcpherson"))


def test_units_option_contradicting_chrono_is_refused():
    complains(STRUT, "--units ... found mm ... in m", Supplied(units="mm"))
    complains(STRUT, "--axes ... forward,left,up", Supplied(axes="adams"))


def test_run_command_reads_hardpoint_table(tmp_path, capsys):
    file = edited(tmp_path, TABLE)
    options = [
        "--engine",
        "native",
        "mujoco",
        "--template",
        WISHBONE,
        "--axes",
        "rearward,right,up",
    ]
    assert main(["run", str(file), *options]) == 2
    assert "--units mm" in capsys.readouterr().err
    assert main(["run", str(file), *options, "--units", "mm"]) == 0
    assert "left out: nothing" in capsys.readouterr().err
    assert main(["run", "mcpherson_strut", *options]) == 2
    assert "built-in case" in capsys.readouterr().err
