"""Hardpoint files of Project Chrono, Adams/Car and plain tables: the suspensions they mean, in any
units and axes.
"""

import csv
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from kincheck.core.case.case import Truth
from kincheck.core.case.io.reader_options import LEFT_OUT, Supplied
from kincheck.core.case.models.files import load
from kincheck.core.case.models.hardpoints.templates import TEMPLATES
from kincheck.core.kinematics import solve
from scipy.optimize import fsolve

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
def test_chrono_suspensions_move_as_rods_and_lines_do(name):
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


def test_what_is_left_out_is_listed():
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


def test_the_template_of_the_file_may_be_said_too():
    said = load(DATA / "chrono_multi_link.json", Supplied(template="multi-link"))
    assert said.mechanism == load(DATA / "chrono_multi_link.json").mechanism


def test_comments_as_chrono_takes_them(tmp_path):
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


def test_adams_front_suspension_moves_as_five_rods_do():
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
def test_a_table_in_any_units_and_axes_is_the_same_suspension(tmp_path, axes, unit):
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
def test_a_table_can_say_its_units_and_axes(tmp_path, head, comment):
    file = tmp_path / ADAMS.with_suffix(".csv").name
    file.write_text(table(adams_points(), head, comment))
    assert load(file, Supplied(template="double_wishbone")).mechanism == load(ADAMS, AXLE).mechanism


def test_semicolons_prefixes_and_spelling(tmp_path):
    file = tmp_path / ADAMS.with_suffix(".csv").name
    points = {f"hpl_{name}": at for name, at in adams_points().items()}
    points["hpl_Wheel Centre"] = points.pop("hpl_wheel_center")
    file.write_text(table(points).replace(",", ";"))
    assert (
        load(file, Supplied("double_wishbone", "mm", "adams")).mechanism
        == load(ADAMS, AXLE).mechanism
    )


def test_the_right_side_of_a_file_is_left_out(tmp_path):
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
def test_templates_make_sense(template):
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
