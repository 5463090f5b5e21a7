"""Suspension outputs that a table of hardpoints has by default, against an independent solution of
rods and lines.
"""

from pathlib import Path

import numpy as np
import pytest
from kincheck.adapters.native import Native
from kincheck.core.case.io.case_writer import case_text
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.case.models.hardpoints.sample_table import sample_table
from kincheck.core.case.models.hardpoints.templates import TEMPLATES
from kincheck.core.cli.main import main
from kincheck.core.errors import CaseError
from kincheck.core.harness.compare import output_series
from scipy.optimize import brentq

from ..oracles.rods import Carrier, rotation

DATA = Path(__file__).parents[1] / "data" / "hardpoints"
# Round-off of a Newton step and of products of metre-sized numbers; quotients by the travel lose a
# digit.
CLOSE = 1e-13
ARMS = {
    "lca": (("lca_front", "lca_outer"), ("lca_rear", "lca_outer")),
    "uca": (("uca_front", "uca_outer"), ("uca_rear", "uca_outer")),
}
TIE_ROD = (("tierod_inner", "tierod_outer"),)
RODS = {
    "mcpherson": (*ARMS["lca"], *TIE_ROD),
    "double_wishbone": (*ARMS["lca"], *ARMS["uca"], *TIE_ROD),
    "five_link": tuple(
        (f"{link}_inner", f"{link}_outer")
        for link in ("upper_front", "upper_rear", "lower_front", "lower_rear", "tierod")
    ),
    "three_link": (("upper_inner", "upper_outer"), ("lower_inner", "lower_outer")),
    "semi_trailing_arm": (),
}
RODS["reduced_double_wishbone"] = RODS["double_wishbone"]
BALLS = {"three_link": ("arm_pivot",), "semi_trailing_arm": ("arm_inner", "arm_outer")}


def solved(case):
    engine = Native()
    trajectory = engine.solve(engine.build(case), case, 1e-12)
    assert trajectory.solved.all(), trajectory.message
    return {
        output.name: output_series(case, output, trajectory).position for output in case.outputs
    }


def sample(folder, name, travel="0.05:11", extra=""):
    file = folder / f"{name}.csv"
    file.write_text(sample_table(TEMPLATES[name]) + extra)
    return load(file, Supplied(travel=travel))


def carrier_of(name, at):
    line = ("strut_upper", "strut_lower") if name == "mcpherson" else None
    return Carrier(
        at["wheel_center"],
        [(at[inner], at[outer]) for inner, outer in RODS[name]],
        line and [at[role] for role in line],
        [at[role] for role in BALLS.get(name, ())],
    )


def arm_rate(carrier, at, arm, point):
    """Velocity of a point of an arm now, and its place: the arm turns as its ball tells."""
    front, rear, ball = (np.array(at[f"{arm}_{end}"]) for end in ("front", "rear", "outer"))
    axis = (front - rear) / np.linalg.norm(front - rear)
    start, now = ball - rear, carrier.at(ball) - rear
    flat = [a - (a @ axis) * axis for a in (start, now)]
    angle = np.arctan2(axis @ np.cross(*flat), flat[0] @ flat[1])
    place = rear + rotation(angle * axis) @ (np.array(at[point]) - rear)
    moving = carrier.velocity(carrier.at(ball))
    rate = axis @ np.cross(now, moving) / (flat[1] @ flat[1])
    return place, rate * np.cross(axis, place - rear)


def expected(name, at, travel, spin=(0.0, 1.0, 0.0)):
    """Outputs at a wheel travel, by their definitions."""
    carrier = carrier_of(name, at).go(travel)
    center, s = carrier.at(at["wheel_center"]), carrier.direction(spin)
    radius = np.linalg.norm(np.subtract(at["wheel_center"], at["wheel_contact"]))
    rise = np.array([0.0, 0.0, 1.0]) - s[2] * s
    contact = center - radius * rise / np.linalg.norm(rise)
    vy, vz = carrier.velocity(contact)[1:]
    values = {
        "toe": np.arctan2(s[0], s[1]),
        "camber": -np.arcsin(s[2]),
        "half_track_change": contact[1] - at["wheel_contact"][1],
        "roll_center_height": contact[1] * vy / vz,
    }
    for role in TEMPLATES[name].watched:
        values |= dict(zip((f"{role}.{axis}" for axis in "xyz"), carrier.at(at[role]), strict=True))
    if name not in ("mcpherson", "double_wishbone"):
        ends = carrier.at(at["spring_lower"]), np.array(at["spring_upper"])
        moving = carrier.velocity(ends[0])
    elif name == "mcpherson":
        ends = carrier.at(at["strut_lower"]), np.array(at["strut_upper"])
        moving = carrier.velocity(ends[0])
    else:
        place, moving = arm_rate(carrier, at, "lca", "spring_lower")
        ends = place, np.array(at["spring_upper"])
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    values["spring_ratio"] = along @ moving
    if name not in BALLS:
        if name == "five_link":
            low, axis = carrier.steering()
        else:
            low = carrier.at(at["lca_outer"])
            axis = (ends[1] if name == "mcpherson" else carrier.at(at["uca_outer"])) - low
        x, y, z = axis
        values |= {"caster": np.arctan2(-x, z), "kingpin_inclination": np.arctan2(-y, z)}
        meets = low + (contact[2] - low[2]) / z * axis - contact
        heading = np.cross(s, (0.0, 0.0, 1.0))
        heading = heading / np.linalg.norm(heading)
        values |= {
            "mechanical_trail": meets @ heading,
            "scrub_radius": meets @ np.cross(heading, (0.0, 0.0, 1.0)),
        }
    return values


@pytest.mark.parametrize("name", RODS)
def test_outputs_of_each_template(tmp_path, name):
    case = sample(tmp_path, name)
    found, at = solved(case), TEMPLATES[name].sample
    for k, travel in enumerate(case.sweep.values):
        true = expected(name, at, travel)
        values = {key: found[key][k] for key in found if not key.endswith(".per_travel")}
        assert values.keys() == true.keys()
        assert values == pytest.approx(true, abs=CLOSE)


@pytest.mark.parametrize("name", RODS)
def test_a_case_file_of_the_table(tmp_path, name):
    """Written and read, it has the same mechanism, outputs and samples."""
    case = sample(tmp_path, name)
    file = tmp_path / "case.toml"
    file.write_text(case_text(case))
    again = load(file)
    assert again.outputs == case.outputs
    assert again.mechanism == case.mechanism
    assert np.abs(again.sweep.values - case.sweep.values).max() < 1e-16


def test_a_slope_beside_each_output(tmp_path):
    found = solved(sample(tmp_path, "double_wishbone", "1e-4:3"))
    difference = (found["camber"][2] - found["camber"][0]) / 2e-4
    assert found["camber.per_travel"][1] == pytest.approx(difference, abs=1e-6)


def test_a_wheel_that_is_turned_at_design(tmp_path):
    """The wheel's axis by a point; toe and camber move as the carrier does."""
    toe, camber = np.radians(0.3), np.radians(-1.5)
    spin = np.array([np.cos(camber) * np.sin(toe), np.cos(camber) * np.cos(toe), -np.sin(camber)])
    x, y, z = 1000.0 * (np.array(TEMPLATES["mcpherson"].sample["wheel_center"]) + 0.2 * spin)
    found = solved(sample(tmp_path, "mcpherson", extra=f"wheel_axis,{x},{y},{z},\n"))
    true = expected("mcpherson", TEMPLATES["mcpherson"].sample, 0.05, spin)
    assert found["toe"][5] == pytest.approx(toe, abs=1e-14)
    assert found["camber"][5] == pytest.approx(camber, abs=1e-14)
    for name in ("toe", "camber", "scrub_radius", "roll_center_height"):
        assert found[name][10] == pytest.approx(true[name], abs=CLOSE)


def test_static_angles_of_chrono(tmp_path):
    """Chrono turns the spindle of a left wheel by minus toe about z after minus camber about x."""
    file = tmp_path / "strut.json"
    text = (DATA / "chrono_macpherson_strut.json").read_text()
    for key, value in (("Toe", "0.5"), ("Camber", "-2")):
        text = text.replace(f'"{key} Angle (deg)": 0', f'"{key} Angle (deg)": {value}')
    file.write_text(text)
    turn = rotation([0, 0, np.radians(-0.5)]) @ rotation([np.radians(2.0), 0, 0])
    x, y, z = turn @ (0.0, 1.0, 0.0)
    found = solved(load(file, Supplied(travel="0.02:3")))
    assert found["toe"][1] == pytest.approx(np.arctan2(x, y), abs=1e-15)
    assert found["camber"][1] == pytest.approx(np.arcsin(-z), abs=1e-15)


def test_without_a_radius_nothing_is_at_the_road():
    case = load(DATA / "chrono_double_wishbone.json")
    names = {output.name for output in case.outputs}
    assert {"toe", "camber", "caster", "spring_ratio", "damper_ratio"} <= names
    assert not names & {"scrub_radius", "mechanical_trail", "roll_center_height"}
    assert "--wheel-radius" in case.source
    track = next(each for each in case.outputs if each.name == "half_track_change")
    assert track.at == "wheel_center"


def test_chrono_strut_with_a_radius():
    """Toe, camber and half track from 40-digit centres and spin axes; see test_hardpoints."""
    case = load(
        DATA / "chrono_macpherson_strut.json", Supplied(travel="0.07:15", wheel_radius="0.4")
    )
    rows = [
        line.split(",")
        for line in (DATA / "chrono_sweeps.csv").read_text().splitlines()
        if line.startswith("chrono_macpherson_strut,")
    ]
    truth = np.array([row[1:] for row in rows], dtype=float)
    center, s = truth[:, 1:4], truth[:, 4:]
    level = np.hypot(s[:, 0], s[:, 1])
    found = solved(case)
    track = center[:, 1] + 0.4 * s[:, 1] * s[:, 2] / level
    assert np.abs(found["toe"] - np.arctan2(s[:, 0], s[:, 1])).max() < 1e-14
    assert np.abs(found["camber"] - np.arctan2(-s[:, 2], level)).max() < 1e-14
    assert np.abs(found["half_track_change"] - (track - track[7])).max() < 1e-14


def test_chrono_semi_trailing_arm():
    """A turn about one line: the angle of each travel by scipy's root, all else by rotation."""
    case = load(
        DATA / "chrono_semi_trailing_arm.json", Supplied(travel="0.1:9", wheel_radius="0.45")
    )
    found = solved(case)
    pivot, outer, wheel = (
        np.array(each) for each in ([0.42, 0.6, -0.05], [0.5, 0.9, 0.0], [0.0, 1.1, 0.0])
    )
    low, high = np.array([0.3, 0.8, 0.0]), np.array([0.3, 0.8, 0.4])
    axis = (outer - pivot) / np.linalg.norm(outer - pivot)
    for k, travel in enumerate(case.sweep.values):

        def height(angle, travel=travel):
            return (pivot + rotation(angle * axis) @ (wheel - pivot))[2] - travel

        angle = brentq(height, -0.5, 0.5, xtol=1e-15, rtol=1e-15)
        turn = rotation(angle * axis)
        center, s, spring = (
            pivot + turn @ (wheel - pivot),
            turn @ (0.0, 1.0, 0.0),
            pivot + turn @ (low - pivot),
        )
        rise = np.array([0.0, 0.0, 1.0]) - s[2] * s
        contact = center - 0.45 * rise / np.linalg.norm(rise)
        per_turn = [np.cross(axis, each - pivot) for each in (center, contact, spring)]
        _, vy, vz = per_turn[1]
        true = {
            "wheel_center.x": center[0],
            "wheel_center.y": center[1],
            "toe": np.arctan2(s[0], s[1]),
            "camber": -np.arcsin(s[2]),
            "half_track_change": contact[1] - 1.1,
            "roll_center_height": contact[1] * vy / vz,
            "spring_ratio": (high - spring)
            @ per_turn[2]
            / np.linalg.norm(high - spring)
            / per_turn[0][2],
        }
        assert {name: found[name][k] for name in true} == pytest.approx(true, abs=1e-13)


def test_chrono_three_link():
    case = load(DATA / "chrono_three_link.json", Supplied(travel="0.08:9", wheel_radius="0.45"))
    at = {
        "arm_pivot": (0.7, 0.9, 0.0),
        "upper_inner": (-0.1, 0.2, 0.4),
        "upper_outer": (-0.1, 0.9, 0.1),
        "lower_inner": (-0.1, 0.2, 0.3),
        "lower_outer": (-0.1, 0.9, 0.0),
        "wheel_center": (0.0, 1.1, 0.0),
        "wheel_contact": (0.0, 1.1, -0.45),
        "spring_lower": (0.3, 0.9, 0.0),
        "spring_upper": (0.3, 0.9, 0.4),
    }
    found = solved(case)
    for k, travel in enumerate(case.sweep.values):
        true = expected("three_link", at, travel)
        assert {name: found[name][k] for name in true} == pytest.approx(true, abs=CLOSE)


def test_chrono_reduced_double_wishbone(tmp_path):
    """The wheel moves as with arms of mass; the damper is on the knuckle."""
    text = (DATA / "chrono_double_wishbone.json").read_text()
    file = tmp_path / "reduced.json"
    shock = text.index('"Shock"')
    tail = text[shock:].replace("Location Arm", "Location Upright")
    file.write_text(text[:shock].replace('"DoubleWishbone"', '"DoubleWishboneReduced"') + tail)
    found, whole = (
        solved(load(each, Supplied(travel="0.07:15", wheel_radius="0.4")))
        for each in (file, DATA / "chrono_double_wishbone.json")
    )
    assert "damper_ratio" in found
    assert "spring_ratio" not in found
    for name in found.keys() - {"damper_ratio", "damper_ratio.per_travel"}:
        assert np.abs(found[name] - whole[name]).max() < 1e-12


@pytest.mark.parametrize(
    ("supplied", "extra", "fragments"),
    [
        ({"wheel_radius": "30 cm"}, "", ["--wheel-radius", "'30 cm'", "metres"]),
        ({"wheel_radius": "300"}, "", ["--wheel-radius", "300 m", "0.02 to 3 m"]),
        ({"wheel_radius": "0.3"}, "wheel_contact,0,612,0\n", ["--wheel-radius", "wheel_contact"]),
        ({}, "wheel_contact,0,612,220\n", ["wheel_contact", "0.008 m"]),
        ({}, "wheel_axis,0,412,228\n", ["wheel_axis", "inboard", "mirror"]),
    ],
)
def test_faults(tmp_path, supplied, extra, fragments):
    file = tmp_path / "car.csv"
    rows = [
        f"{role},{','.join(repr(1000.0 * x) for x in place)}\n"
        for role, place in TEMPLATES["double_wishbone"].sample.items()
        if role != "wheel_contact"
    ]
    file.write_text("name,x,y,z\n" + "".join(rows) + extra)
    with pytest.raises(CaseError) as caught:
        load(file, Supplied("double_wishbone", "mm", "iso", **supplied))
    assert [each for each in fragments if each not in str(caught.value)] == [], caught.value


def test_templates_prints_tables_that_run(tmp_path, capsys):
    assert main(["templates"]) == 0
    printed = capsys.readouterr().out
    assert [name for name in TEMPLATES if f"# template: {name}\n" not in printed] == []
    assert main(["templates", "five_link"]) == 0
    file = tmp_path / "car.csv"
    file.write_text(capsys.readouterr().out)
    assert main(["run", str(file), "--engine", "native"]) == 2  # nothing to compare
    assert "column meaning" in capsys.readouterr().err
    assert main(["templates", "five_links"]) == 2
    assert "'five_link'" in capsys.readouterr().err


def test_samples_have_all_that_is_required():
    for template in TEMPLATES.values():
        names = {role.name for role in template.roles}
        assert names <= template.sample.keys()
        assert template.sample.keys() <= names | {role.name for role in template.optional}


def test_the_template_of_a_table(tmp_path):
    file = tmp_path / "car.csv"
    file.write_text(sample_table(TEMPLATES["mcpherson"]))
    with pytest.raises(CaseError, match="expected mcpherson"):
        load(file, Supplied("five_link"))
    assert load(file, Supplied("mcpherson")).mechanism == load(file).mechanism
