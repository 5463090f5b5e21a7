"""Cases of tables of hardpoints, and what is wrong with a table."""

from itertools import combinations

import numpy as np
import pytest
from kincheck.core.case.case import Truth
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.io.readers import LEFT_OUT
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.extensions.hardpoints.rows import MOST_LINES
from kincheck.core.extensions.hardpoints.templates import TEMPLATES
from kincheck.core.kinematics import solve

from ...support.case_texts import complains, rows, supplied, write
from ...support.examples import examples
from ...support.rods_of_templates import CLOSE, DATA, carrier_of

CHRONO_FAULTS, ADAMS_FAULTS, TABLE_FAULTS, TABLE = examples(
    __file__, "chrono_faults", "adams_faults", "table_faults", "table"
)

CHRONO = ("macpherson_strut", "double_wishbone", "multi_link", "sedan_double_wishbone")
ADAMS = DATA / "adams_front_suspension.sub"
STRUT, MULTI_LINK = DATA / "chrono_macpherson_strut.json", DATA / "chrono_multi_link.json"
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


@pytest.mark.parametrize("name", [f"chrono_{each}" for each in CHRONO])
def test_chrono_suspension_sweeps_to_40_digits(name):
    """Wheel centre and spin axis against 40-digit solutions by another formulation; the template is
    the file's own.
    """
    case = load(DATA / f"{name}.json", Supplied(travel="0.07:15"))
    lines = (DATA / "chrono_sweeps.csv").read_text().splitlines()
    truth = np.array(
        [line.split(",")[1:] for line in lines if line.startswith(f"{name},")], dtype=float
    )
    found = swept(case)
    assert case.truth is Truth.CONSENSUS_ONLY
    assert np.allclose(case.sweep.values, truth[:, 0], rtol=0, atol=EXACT)
    assert np.abs(found.points["wheel_center"].position - truth[:, 1:4]).max() < EXACT
    spin = turned(found.bodies["knuckle"].p, np.array([0.0, 1.0, 0.0]))
    assert np.abs(spin - truth[:, 4:]).max() < EXACT


def test_chrono_omitted_keys_are_listed():
    source = load(STRUT).source
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
    said = load(MULTI_LINK, Supplied(template="multi-link"))
    assert said.mechanism == load(MULTI_LINK).mechanism


def test_chrono_json_comments(tmp_path):
    remarks = '// the "axle", of no use here\n /* 1, 2\n 3 */ "Axle"'
    commented = edited(tmp_path, STRUT, ('"Axle"', remarks))
    assert load(commented).mechanism == load(STRUT).mechanism


def test_adams_front_suspension_on_five_rods():
    """Millimetres, x rearward and y right in the file; metres, x forward and y left in the case."""
    case = load(ADAMS, AXLE)
    iso = {name: np.array([-x, -y, z]) / 1000.0 for name, (x, y, z) in adams_points().items()}
    path = swept(case).points["wheel_center"].position
    assert case.mechanism.point("wheel_center").position == (-0.267, 0.76, 0.33)
    for travel, position in zip(case.sweep.values, path, strict=True):
        true = carrier_of("double_wishbone", iso).go(travel).at(iso["wheel_center"])
        assert position == pytest.approx(true, abs=CLOSE)


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


def table(points, head="name,x,y,z"):
    rows = [f"{name},{x!r},{y!r},{z!r}" for name, (x, y, z) in points.items()]
    return "\n".join([head, *rows])


def assert_is_adams(folder, text, options):
    """A table is read as the suspension of the Adams file."""
    file = folder / ADAMS.with_suffix(".csv").name
    file.write_text(text)
    found = load(file, supplied(f"template=double_wishbone {options}"))
    assert found.mechanism == load(ADAMS, AXLE).mechanism


AXES = {
    "forward,left,up": lambda x, y, z: (-x, -y, z),
    "forward,right,down": lambda x, y, z: (-x, y, -z),
    "rearward,right,up": lambda x, y, z: (x, y, z),
    "up,left,rearward": lambda x, y, z: (z, -y, x),
}


@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize(("unit", "scale"), [("mm", 1.0), ("m", 1000.0)])
def test_hardpoint_table_units_and_axes(tmp_path, axes, unit, scale):
    points = {
        name: [x / scale for x in AXES[axes](*place)] for name, place in adams_points().items()
    }
    assert_is_adams(tmp_path, table(points), f"units={unit} axes={axes}")


@pytest.mark.parametrize(
    "head",
    [
        "# axes: rearward, right, up\nname,x [mm],y [mm],z [mm]",
        "# Axes = adams\nName,X_mm,Y_mm,Z_mm",
        "# axes: rearward,right,up\n# units: mm\nname,x,y,z",
    ],
)
def test_hardpoint_table_states_units_and_axes(tmp_path, head):
    assert_is_adams(tmp_path, table(adams_points(), head), "")


def test_adams_right_side_is_omitted(tmp_path):
    head = "$----------------------------------------------------------------------PARAM"
    broken = " 'lca_outer                   '  'right       '    267.0      750.0      130.0\n$"
    case = load(edited(tmp_path, ADAMS, (head, broken)), AXLE)
    assert case.mechanism == load(ADAMS, AXLE).mechanism
    assert "1 points of the right side" in case.source


@pytest.mark.parametrize("template", TEMPLATES.values(), ids=lambda template: template.name)
def test_template_roles_are_consistent(template):
    """Roles are named once, and what is compared tells how the knuckle stands."""
    names = [role.name for role in template.roles]
    assert len(set(names)) == len(names)
    paired = {role for pair in (*template.above, *template.ahead) for role in pair}
    assert {*paired, *template.watched} <= {*names, "wheel_contact"}
    assert len(template.watched) == 3
    for a, b in combinations(template.roles, 2):
        shared = set(a.names) & set(b.names)
        # only the ball that two links of an arm share
        assert not shared or {a.name, b.name} == {"upper_front_outer", "upper_rear_outer"}


WISHBONE = "double_wishbone"
WHOLE = "template=double_wishbone units=mm axes=adams"


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


@pytest.mark.parametrize(("old", "new", "message"), rows(CHRONO_FAULTS))
def test_chrono_file_faults(tmp_path, old, new, message):
    file = edited(tmp_path, STRUT, (old, new))
    if message == "not valid JSON":
        file.write_text(file.read_text()[:600])
    complains(file, message, Supplied(ask_names=True))


@pytest.mark.parametrize(("old", "new", "message"), rows(ADAMS_FAULTS))
def test_adams_hardpoint_faults(tmp_path, old, new, message):
    complains(edited(tmp_path, ADAMS, (old, new)), message, Supplied(WISHBONE, ask_names=True))


@pytest.mark.parametrize(("old", "new", "options", "message"), rows(TABLE_FAULTS))
def test_hardpoint_table_faults(tmp_path, old, new, options, message):
    if "drive=" in options:
        pytest.importorskip("kincheck.core.extensions.trees.reader")  # it has the option
    complains(edited(tmp_path, TABLE, (old, new)), message, supplied(f"{WHOLE} {options}"))


@pytest.mark.parametrize(
    ("text", "message"), [("", "is empty"), ("name,x,y,z\n", "no row"), ("# nothing\n", "is empty")]
)
def test_empty_hardpoint_table_is_refused(tmp_path, text, message):
    complains(edited(tmp_path, text), message, supplied(WHOLE))


@pytest.mark.parametrize("name", TEMPLATES)
def test_template_follows_from_point_names(tmp_path, name, capsys):
    rows = [f"{role},{x},{y},{z}" for role, (x, y, z) in TEMPLATES[name].sample.items()]
    file = tmp_path / "car.csv"
    file.write_text("\n".join(["# units: m", "# axes: forward,left,up", "name,x,y,z", *rows]))
    if name.startswith("pushrod"):
        complains(file, f"--template {name} ... Doubtful: it may be a pushrod_", Supplied())
        return
    said = [note for note in load(file, Supplied()).assembly if "--template" in note]
    wanted = name.removeprefix("reduced_")
    assert said == [f"template {wanted}, by the names of its points: --template states it"]


@pytest.mark.parametrize(
    ("file", "option", "message"),
    [
        (MULTI_LINK, "template=mcpherson", "found mcpherson ... MultiLink ... expected five_link"),
        (STRUT, "units=mm", "--units ... found mm ... in m"),
        (STRUT, "axes=adams", "--axes ... forward,left,up"),
    ],
    ids=["template", "units", "axes"],
)
def test_option_contradicting_chrono_is_refused(file, option, message):
    complains(file, message, supplied(option))


def test_run_command_reads_hardpoint_table(tmp_path, capsys):
    file = edited(tmp_path, TABLE)
    options = "--engine native mujoco --template double_wishbone --axes rearward,right,up".split()
    assert main(["run", str(file), *options]) == 2
    assert "--units mm" in capsys.readouterr().err
    assert main(["run", str(file), *options, "--units", "mm"]) == 0
    assert "left out: nothing" in capsys.readouterr().err
    assert main(["run", "mcpherson_strut", *options]) == 2
    assert "built-in case" in capsys.readouterr().err
    assert main(["run", str(file), *options, "--units", "mm", "--reactions"]) == 2
    said = capsys.readouterr().err
    assert "Write a case file, kincheck import TABLE > case.toml, and there" in said


def test_table_of_many_lines_is_refused(tmp_path):
    file = write(tmp_path, "a 1 2 3\n" * (MOST_LINES + 1), "table.dat")
    complains(file, f"found {MOST_LINES + 1} lines", Supplied())
