"""From public tables to curves: sweeps of other programs, and independent solutions."""

import csv
import math

import kincheck.cases
import numpy as np
import pytest
from kincheck.adapters.native import Native
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.harness.execution import Answer, Pair, attempt
from scipy.optimize import brentq, least_squares

from ...oracles.rods import rotation
from ...support.case_texts import rows
from ...support.examples import examples
from ...support.rods_of_templates import CLOSE, DATA, expected, solved

SAME, STRUT = examples(__file__, "same", "strut")

# A tyre 270/55 on a 13 inch rim: 0.5 * 13 * 25.4 + 0.55 * 270 mm.
RADIUS = 0.3136
EXPLORER = Supplied(travel="-0.04:0.12:41", rack="-0.04:0.04", wheel_radius=str(RADIUS))


def curves(case):
    found = attempt(Pair(case, Native(), 1e-12, timed=False)).result
    assert isinstance(found, Answer), found
    assert found.message == ""
    return {name: series.position for name, series in found.outputs.items()}


@pytest.fixture(scope="module")
def explorer():
    return curves(load(DATA / "wishbone_explorer.csv", EXPLORER))


@pytest.fixture(scope="module")
def published():
    with (DATA / "wishbone_explorer_sweep.csv").open() as lines:
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(lines)]
    return {key: np.array([row[key] for row in rows]) for key in rows[0]}


DEGREE, MM = np.pi / 180.0, 1e-3
# Rack and wheel of the published sweep are up to 3e-6 mm off their targets (its columns target_rack
# and wheel_travel). The slopes of all these curves by either are below 0.4 degrees/mm and 1 mm/mm,
# those of the slopes below 0.01 degrees/mm^2; five such errors are allowed.
ANGLE, LENGTH, SLOPE = 5 * 0.4 * 3e-6 * DEGREE, 5 * 3e-6 * MM, 5 * 0.01 * 3e-6 * DEGREE / MM
UNITS = {
    "angle": (DEGREE, ANGLE),
    "length": (MM, LENGTH),
    "slope": (DEGREE / MM, SLOPE),
    "ratio": (1.0, SLOPE),
}


@pytest.mark.parametrize(("theirs", "ours", "kind"), rows(SAME, named=False))
def test_wishbone_explorer_sweep(explorer, published, theirs, ours, kind):
    """Rack and wheel move together; derivatives hold the rack."""
    unit, allowed = UNITS[kind]
    assert np.abs(explorer[ours] - unit * published[theirs]).max() < allowed


def test_wishbone_explorer_half_track(explorer, published):
    half_track = MM * published["half_track"]
    change = explorer["half_track_change"] + 0.95 + RADIUS * 5.0 / np.hypot(150.0, 5.0)
    assert np.abs(change - half_track).max() < LENGTH


def test_wishbone_explorer_camber(explorer, published):
    """Seen from the front, where ISO 8855 has the angle of the wheel plane itself."""
    toe, camber = explorer["toe"], explorer["camber"]
    seen = np.arctan2(np.tan(camber), np.cos(toe))
    assert np.abs(seen - DEGREE * published["camber"]).max() < ANGLE
    by_camber = 1.0 / np.cos(camber) ** 2 / np.cos(toe)
    by_toe = np.tan(camber) * np.sin(toe) / np.cos(toe) ** 2
    slope = by_camber * explorer["camber.per_travel"] + by_toe * explorer["toe.per_travel"]
    theirs = DEGREE / MM * published["deriv_camber_wrt_hub_z"]
    assert np.abs(slope * np.cos(seen) ** 2 - theirs).max() < SLOPE


def corner(at, travel, start):
    """Wheel and rocker at a travel, by distances alone: the upright on five rods, the pushrod, and
    two distances that hold each rocker point to the rocker's axis.

    Returns:
        unknowns: shift and rotation vector of the upright, place of two points of the rocker.
    """
    wishbones = [
        (f"{arm}_wishbone_inboard_{end}", f"{arm}_wishbone_outboard")
        for arm in ("lower", "upper")
        for end in ("front", "rear")
    ]
    rods = [*wishbones, ("trackrod_inboard", "trackrod_outboard")]
    wheel, outer = at["wheel_center"], at["pushrod_outboard"]
    inner, spring = at["pushrod_inboard"], at["strut_bottom"]
    ends = at["rocker_axis_a"], at["rocker_axis_b"]

    def gaps(u):
        def moved(point):
            return wheel + u[:3] + rotation(u[3:6]) @ (point - wheel)

        a, b = u[6:9], u[9:12]
        pairs = [(at[p], moved(at[q]), at[p], at[q]) for p, q in rods]
        pairs += [(moved(outer), a, outer, inner), (a, b, inner, spring)]
        pairs += [(end, now, end, then) for end in ends for now, then in ((a, inner), (b, spring))]
        return [*((p - q) @ (p - q) - (r - s) @ (r - s) for p, q, r, s in pairs), u[2] - travel]

    found = least_squares(gaps, start, xtol=3e-16, ftol=3e-16, gtol=3e-16, x_scale="jac")
    assert np.abs(found.fun).max() < 1e-13
    return found.x


def test_formula_student_pushrod_corner():
    file = DATA / "formula_student_pushrod.csv"
    case = load(file, Supplied(travel="0.03:7"))
    found = curves(case)
    lines = [line.split(",") for line in file.read_text().splitlines() if line[0] != "#"][1:]
    at = {name: np.array([*map(float, xyz)]) / 1000.0 for name, *xyz in lines}
    rest = np.concatenate([np.zeros(6), at["pushrod_inboard"], at["strut_bottom"]])
    step = 1e-4
    for k, travel in enumerate(case.sweep.values):
        u = corner(at, travel, rest)
        s = rotation(u[3:6]) @ (0.0, 1.0, 0.0)
        lengths = [
            np.linalg.norm(corner(at, travel + d, u)[9:] - at["strut_top"])
            for d in (-2 * step, -step, step, 2 * step)
        ]
        # by central differences of the fourth order: 1e-9 of rounding, less of truncation
        rate = (lengths[0] - 8 * lengths[1] + 8 * lengths[2] - lengths[3]) / (12 * step)
        true = {
            "toe": np.arctan2(s[0], s[1]),
            "camber": -np.arcsin(s[2]),
            "wheel_center.x": u[0],
            "wheel_center.y": u[1] + 0.6,
        }
        assert {name: found[name][k] for name in true} == pytest.approx(true, abs=1e-10)
        assert found["spring_ratio"][k] == pytest.approx(-rate, abs=1e-8)


ROAD = ("scrub_radius", "mechanical_trail", "roll_center_height", "half_track_change")


def test_mcpherson_strut_to_50_digits(tmp_path):
    """Against 50 digits of an independent solution; see the head of the built-in table."""
    file = tmp_path / "strut.csv"
    file.write_text(STRUT)
    found = curves(load(file, Supplied(travel="0.08:33", wheel_radius="0.3")))
    lines = kincheck.cases.file("mcpherson_suspension").with_suffix(".csv").read_text().splitlines()
    rows = [*csv.DictReader(line for line in lines if not line.startswith("#"))]
    for name in ("toe", "camber", "caster", "kingpin_inclination", *ROAD):
        true = np.array([float(row[name]) for row in rows])
        assert np.abs(found[name] - true).max() < 1e-13, name


def test_wishbone_explorer_csv_by_command(tmp_path, explorer):
    """The curves leave as a table; there is nothing to compare a single engine with."""
    options = ["--travel=-0.04:0.12:3", "--rack", "0.04", "--wheel-radius", str(RADIUS)]
    file, out = str(DATA / "wishbone_explorer.csv"), tmp_path / "curves.csv"
    assert main(["run", file, "--engine", "native", "--csv", str(out), *options]) == 2
    rows = csv.DictReader(out.read_text().splitlines())
    toe = [math.radians(float(row["toe [deg]"])) for row in rows]
    assert toe == pytest.approx(explorer["toe"][::20], abs=1e-13)


@pytest.mark.needs("measured", "suspects")
def test_measured_camber_definition_is_named(tmp_path, published, capsys):
    """Compared as it stands, the camber is off, and the message states its other definition."""
    sweep = tmp_path / "sweep.csv"
    rows = zip(*(published[name] for name in ("wheel_travel", "toe_angle", "camber")), strict=True)
    lines = [",".join(f"{value:.12g}" for value in row) for row in rows]
    sweep.write_text("\n".join(["Wheel Travel [mm],Toe [deg],Camber [deg]", *lines]))
    options = ["--travel=-0.04:0.12:41", "--rack=-0.04:0.04", "--wheel-radius", str(RADIUS)]
    options += ["--accuracy", "toe=1e-5 deg", "--accuracy", "camber=1e-5 deg"]
    file = str(DATA / "wishbone_explorer.csv")
    assert main(["run", file, "--engine", "native", "--reference", str(sweep), *options]) == 1
    said = " ".join(capsys.readouterr().out.split())
    seen = "taken as the camber seen from the front, with tan(seen) cos(toe) = tan(camber)"
    assert f"camber (position): the reference {seen}, fits within" in said


# Suspension outputs of Project Chrono's models, against an independent solution of


def test_chrono_static_toe_and_camber(tmp_path):
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


def test_chrono_strut_with_wheel_radius():
    """Toe, camber and half track from 40-digit centres and spin axes; see test_hardpoints."""
    said = Supplied(travel="0.07:15", wheel_radius="0.4")
    found = solved(load(DATA / "chrono_macpherson_strut.json", said))
    lines = (DATA / "chrono_sweeps.csv").read_text().splitlines()
    truth = [line.split(",")[1:] for line in lines if line.startswith("chrono_macpherson_strut,")]
    _, _, y, _, *s = np.array(truth, dtype=float).T
    level = np.hypot(s[0], s[1])
    track = y + 0.4 * s[1] * s[2] / level
    true = {
        "toe": np.arctan2(s[0], s[1]),
        "camber": np.arctan2(-s[2], level),
        "half_track_change": track - track[7],
    }
    for name, values in true.items():
        assert found[name] == pytest.approx(values, abs=1e-14)


def test_chrono_semi_trailing_arm_outputs():
    """A turn about one line: the angle of each travel by scipy's root, all else by rotation."""
    said = Supplied(travel="0.1:9", wheel_radius="0.45")
    case = load(DATA / "chrono_semi_trailing_arm.json", said)
    found = solved(case)
    pivot, outer, wheel = np.array([[0.42, 0.6, -0.05], [0.5, 0.9, 0.0], [0.0, 1.1, 0.0]])
    low, high = np.array([0.3, 0.8, 0.0]), np.array([0.3, 0.8, 0.4])
    axis = (outer - pivot) / np.linalg.norm(outer - pivot)

    def moved(point, angle):
        return pivot + rotation(angle * axis) @ (point - pivot)

    for k, travel in enumerate(case.sweep.values):
        angle = brentq(
            lambda angle, z=travel: moved(wheel, angle)[2] - z, -0.5, 0.5, xtol=1e-15, rtol=1e-15
        )
        center, spring = moved(wheel, angle), moved(low, angle)
        s = rotation(angle * axis) @ (0.0, 1.0, 0.0)
        rise = np.array([0.0, 0.0, 1.0]) - s[2] * s
        contact = center - 0.45 * rise / np.linalg.norm(rise)
        per_turn = [np.cross(axis, each - pivot) for each in (center, contact, spring)]
        vy, vz = per_turn[1][1:]
        shortening = (high - spring) @ per_turn[2] / np.linalg.norm(high - spring)
        true = {
            "wheel_center.x": center[0],
            "wheel_center.y": center[1],
            "toe": np.arctan2(s[0], s[1]),
            "camber": -np.arcsin(s[2]),
            "half_track_change": contact[1] - 1.1,
            "roll_center_height": contact[1] * vy / vz,
            "spring_ratio": shortening / per_turn[0][2],
        }
        assert {name: found[name][k] for name in true} == pytest.approx(true, abs=1e-13)


def test_chrono_three_link_outputs():
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
