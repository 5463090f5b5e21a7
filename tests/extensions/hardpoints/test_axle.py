"""Whole axles against two independent carriers on rods, and wheels of a car."""

import re
from dataclasses import replace

import numpy as np
import pytest
from kincheck.adapters import engine
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.io.readers import LEFT_OUT
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.errors import CaseError
from kincheck.core.extensions.hardpoints.suspension import Convention
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table
from kincheck.core.harness.execution import Answer, Pair, attempt

from ...oracles.rods import Carrier
from ...support.case_texts import complains, rows, supplied, write
from ...support.examples import examples
from ...support.rods_of_templates import RODS as ALL_RODS
from ...support.rods_of_templates import solved
from ...support.written_again import written_again

OPTION_FAULTS, FAULTS, SIDE_FAULTS, TABLES = examples(
    __file__, "option_faults", "faults", "side_faults", "tables"
)

WHEELBASE = 1.55
RODS = {name: ALL_RODS[name] for name in ("double_wishbone", "five_link", "mcpherson")}
CLOSE = 1e-12


def axle(folder, name, motion, travel="0.04:9"):
    said = Supplied(travel=travel, axle=motion, wheelbase=str(WHEELBASE))
    return load(table(folder, name), said)


def table(folder, name="double_wishbone"):
    file = folder / f"{name}.csv"
    file.write_text(sample_table(TEMPLATES[name]))
    return file


def answer(case, name="native"):
    found = attempt(Pair(case, engine(name), 1e-12, timed=False)).result
    assert isinstance(found, Answer), found
    assert found.message == ""
    return {each: series.position for each, series in found.outputs.items()}


class Wheel:
    """A wheel of either side on its rods, where left is 1 and right -1."""

    def __init__(self, name, side, stroke, rack):
        at = {
            role: np.array(place) * (1.0, side, 1.0)
            for role, place in TEMPLATES[name].sample.items()
        }
        line = [at["strut_upper"], at["strut_lower"]] if name == "mcpherson" else None
        self.carrier = Carrier(at["wheel_center"], [(at[a], at[b]) for a, b in RODS[name]], line)
        tie_rod = len(RODS[name]) - 1
        for part in (0.25, 0.5, 0.75, 1.0):
            moved = {tie_rod: (0.0, part * rack, 0.0)}
            self.carrier.go(part * stroke, moved)
        self.s = self.carrier.direction((0.0, side, 0.0))
        radius = np.linalg.norm(at["wheel_center"] - at["wheel_contact"])
        rise = np.array([0.0, 0.0, 1.0]) - self.s[2] * self.s
        self.contact = self.carrier.at(at["wheel_center"]) - radius * rise / np.linalg.norm(rise)
        self.velocity, self.of_center = (
            self.carrier.velocity(place, moved)
            for place in (self.contact, self.carrier.at(at["wheel_center"]))
        )

    @property
    def steer(self):
        """Angle to the left."""
        heading = np.cross(self.s, (0.0, 0.0, 1.0)) * np.sign(self.s[1])
        return np.arctan(heading[1] / heading[0])


def wheels_of(name, motion, travel, rack):
    """Both wheels of an axle, left first."""
    left, right = {"heave": (1, 1), "roll": (1, -1), "steer": (0, 0)}[motion]
    return Wheel(name, 1, left * travel, rack), Wheel(name, -1, right * travel, rack)


def expected(a, b):
    """Outputs by the pose of both wheels, then those by its slope."""
    road = a.contact - b.contact
    lines = np.array([a.velocity[1:], b.velocity[1:]])
    y, z = np.linalg.solve(lines, [a.velocity[1:] @ a.contact[1:], b.velocity[1:] @ b.contact[1:]])
    normal = np.array([-road[2], road[1]]) / np.hypot(*road[1:])
    pose = {
        "left_toe": np.arctan2(a.s[0], a.s[1]),
        "right_toe": np.arctan2(b.s[0], -b.s[1]),
        "left_camber": -np.arcsin(a.s[2]),
        "right_camber": -np.arcsin(b.s[2]),
        "track": road[1],
        "roll_angle": np.arctan2(-road[2], road[1]),
    }
    slope = {
        "right_roll_center_height": -b.contact[1] * -b.velocity[1] / b.velocity[2],
        "axle_roll_center_height": ((y, z) - a.contact[1:]) @ normal,
        "axle_roll_center_offset": y,
    }
    return pose, slope


def steering(a, b):
    """Outputs by the steer angles of both wheels; none where they steer apart or hardly."""
    if min(a.steer * b.steer, abs(a.steer) - 0.01, abs(b.steer) - 0.01) <= 0.0:
        return {}
    track = (a.contact - b.contact)[1]
    ackermann = WHEELBASE / track * (1.0 / np.tan(b.steer) - 1.0 / np.tan(a.steer))
    angles = sorted(map(abs, (a.steer, b.steer)))
    outer, inner = angles if ackermann > 0.0 else angles[::-1]
    ideal = np.arctan(1.0 / (1.0 / np.tan(inner) + track / WHEELBASE))
    return {
        "ackermann": ackermann,
        "ackermann_angles": (inner - outer) / (inner - ideal),
        "turning_circle": 2.0 * WHEELBASE / np.sin(outer),
        "mean_steer_angle": 0.5 * np.sign(a.steer) * (inner + outer),
    }


def assert_close(found, sample, true, atol):
    values = {name: found[name][sample] for name in true}
    assert values == pytest.approx(true, abs=atol, rel=1e-11)


@pytest.mark.by_day(2)
@pytest.mark.parametrize("motion", ["heave", "roll", "steer"])
@pytest.mark.parametrize("name", RODS)
def test_axle_outputs_in_closed_form(tmp_path, name, motion):
    steered = motion == "steer"
    case = axle(tmp_path, name, motion, "0.03:5" if steered else "0.04:5")
    found = answer(case)
    for k, value in enumerate(case.sweep.values):
        wheels = wheels_of(name, motion, value, value if steered else 0.0)
        pose, slope = expected(*wheels)
        assert_close(found, k, {**pose, **slope, **(steering(*wheels) if steered else {})}, CLOSE)
    if steered:
        assert np.isnan(found["ackermann"][2])
        assert np.isfinite(np.delete(found["ackermann"], 2)).all()


@pytest.mark.parametrize("name", ["mujoco", "pinocchio", "exudyn"])
def test_axle_outputs_in_other_engines(tmp_path, name):
    pytest.importorskip(name)
    case = axle(tmp_path, "double_wishbone", "roll", "0.03:5")
    found, native = answer(case, name), answer(case)
    for output in case.outputs:
        off = np.abs(found[output.name] - native[output.name]).max()
        assert off < 1e-10, output.name


def test_axle_in_heave_equals_one_wheel(tmp_path):
    """The roll centre of the axle is that of either wheel; half a track is of one wheel."""
    found = answer(axle(tmp_path, "double_wishbone", "heave"))
    height = found["axle_roll_center_height"]
    assert np.abs(height - found["left_roll_center_height"]).max() < CLOSE
    assert np.abs(height - found["right_roll_center_height"]).max() < CLOSE
    assert np.abs(found["left_toe"] - found["right_toe"]).max() < CLOSE
    assert np.abs(found["axle_roll_center_offset"]).max() < CLOSE


def test_axle_without_steering(tmp_path):
    case = axle(tmp_path, "three_link", "roll")
    assert [driver.name for driver in case.mechanism.drivers] == ["left_stroke", "right_stroke"]
    found = answer(case)
    assert np.abs(found["left_camber"] - found["right_camber"][::-1]).max() < CLOSE


def test_trailing_arms_have_no_roll_centre(tmp_path):
    """Trailing arms on hinges across the car: the contacts move in planes along it."""
    file = tmp_path / "car.csv"
    rows = "arm_inner,0.5,0.3,0.3\narm_outer,0.5,0.6,0.3\nwheel_center,0,0.7,0.3\n"
    file.write_text("# template: semi_trailing_arm\n# axes: iso\nname,x [m],y [m],z [m]\n" + rows)
    found = answer(load(file, Supplied(axle="roll", wheel_radius="0.3", travel="0.02:5")))
    assert np.isnan(found["axle_roll_center_height"]).all()
    assert np.abs(found["left_roll_center_height"]).max() < 1e-15


def test_axle_case_file_round_trip(tmp_path):
    """[suspension.other] and the sides are in it."""
    written_again(axle(tmp_path, "five_link", "roll"), tmp_path)


def changed(folder, *edits):
    """The case file of an axle with patterns replaced."""
    text = case_text(axle(folder, "double_wishbone", "roll", "0.02:3"))
    for old, new in edits:
        text, count = re.subn(old, new, text, flags=re.DOTALL)
        assert count
    return write(folder, text)


@pytest.mark.parametrize(("old", "new", "message"), rows(FAULTS))
def test_axle_case_file_faults(tmp_path, old, new, message):
    complains(changed(tmp_path, (old, new)), message)


def test_roll_centre_needs_both_travel_drivers(tmp_path):
    points = r'point = "(left|right)_wheel_center"', r'point = "\1_tierod_outer"'
    outputs = r"\[outputs.*", '[outputs.rc]\ntype = "axle_roll_center_height"\n'
    file = changed(tmp_path, points, (r'travel = "\w+_stroke"\n', ""), outputs)
    with pytest.raises(CaseError, match=r"outputs\.rc: .* Name them by suspension\.travel and"):
        load_case(file)


def test_roll_centre_offset_in_sae_axes(tmp_path):
    """The offset is along y, which points to the other side."""
    case = axle(tmp_path, "double_wishbone", "roll", "0.03:5")
    there = {output.name: output for output in case.outputs}["axle_roll_center_offset"]
    wheels = [
        replace(each, convention=Convention.SAE_J670) for each in (there.vehicle, there.other)
    ]
    sae = replace(there, vehicle=wheels[0], other=wheels[1])
    here = answer(replace(case, outputs=(there,)))["axle_roll_center_offset"]
    assert np.abs(here).max() > 1e-3
    assert np.array_equal(answer(replace(case, outputs=(sae,)))["axle_roll_center_offset"], -here)
    assert "both wheels" in there.signs


CG_HEIGHT, SHARE = 0.3, 0.6
CAR = {
    "wheelbase": str(WHEELBASE),
    "cg_height": str(CG_HEIGHT),
    "brake_share": str(SHARE),
    "drive_share": "1",
}


@pytest.mark.parametrize(("motion", "position"), [("heave", "front"), ("roll", "rear")])
def test_axle_steered_during_travel(tmp_path, motion, position):
    said = Supplied(axle=motion, travel="0.03:3", rack="-0.02:0.03", position=position, **CAR)
    case = load(table(tmp_path), said)
    found = answer(case)
    for k, travel in enumerate(case.sweep.values):
        wheels = wheels_of("double_wishbone", motion, travel, 0.005 + travel * 0.025 / 0.03)
        pose, slope = expected(*wheels)
        for side, wheel in zip(("left", "right"), wheels, strict=True):
            anti = WHEELBASE / CG_HEIGHT * wheel.velocity[0] / wheel.velocity[2]
            if position == "front":
                slope[f"{side}_anti_dive"] = SHARE * anti
            else:
                slope[f"{side}_anti_lift"] = -SHARE * anti
                squat = -WHEELBASE / CG_HEIGHT * wheel.of_center[0] / wheel.of_center[2]
                slope[f"{side}_anti_squat"] = squat
        pose |= {name: x for name, x in steering(*wheels).items() if name == "ackermann"}
        assert_close(found, k, pose, CLOSE)
        assert_close(found, k, slope, 1e-11)
    assert np.isfinite(found["ackermann"]).any()


def test_anti_outputs_need_vehicle_data(tmp_path):
    names = {each.name for each in load(table(tmp_path)).outputs}
    assert not [name for name in names if "anti" in name]
    said = Supplied(position="front", wheelbase="2.6", cg_height="0.5")
    names = {each.name for each in load(table(tmp_path), said).outputs}
    assert "wheelbase_change" in names
    assert not [name for name in names if "anti" in name]


@pytest.mark.parametrize(("options", "message"), rows(OPTION_FAULTS))
def test_axle_option_faults(tmp_path, options, message):
    said = supplied(options)
    complains(table(tmp_path, said.template or "double_wishbone"), message, said)


def test_import_options_reach_case_file(tmp_path, capsys):
    options = ["--rack=0.02", "--position=front", "--wheelbase=2.6", "--cg-height=0.5"]
    options += ["--brake-share=0.6", "--drive-share=0.4", "--travel=-0.02:0.03:3"]
    out = tmp_path / "case.toml"
    assert main(["import", str(table(tmp_path)), *options, "--out", str(out)]) == 0
    text = out.read_text()
    for part in ("brake_share = 0.6", "drive_share = 0.4", "cg_height = 0.5", "anti_dive"):
        assert part in text, text


# Right wheels, and tables of the whole car: one corner is read, and a right wheel moves as the


SAID = Supplied(units="mm", axes="forward,left,up", travel="0.04:5", rack="0.01", position="front")
# Round-off of metre-sized numbers; quotients by travel lose two digits.
CORNERS = {"FL": (1, 0.0), "FR": (-1, 0.0), "RL": (1, -2600.0), "RR": (-1, -2600.0)}


def points_at(name, corner):
    """Rows of a template's sample at a corner; all corners differ by more than place and side."""
    side, along = CORNERS[corner]
    wider = 1.0 + 0.01 * (list(CORNERS).index(corner) // 2)
    return [
        [role, *(f"{x:.10g}" for x in (1e3 * x + along, side * wider * 1e3 * y, 1e3 * z))]
        for role, (x, y, z) in TEMPLATES[name].sample.items()
    ]


def written(folder, lines, name="car.csv"):
    file = folder / name
    file.write_text("\n".join(lines) + "\n")
    return file


def plain(folder, name, corner, *above):
    lines = [*above, "name,x,y,z", *(",".join(row) for row in points_at(name, corner))]
    return written(folder, lines, f"{corner}.csv")


def of(name, **own):
    steered = {} if TEMPLATES[name].steered else {"rack": None}
    return replace(SAID, template=name, **{**steered, **own})


@pytest.mark.parametrize("name", TEMPLATES)
def test_right_wheel_outputs_mirror_left(tmp_path, name):
    """The rack moves to the other side for the mirror image."""
    left = load(plain(tmp_path, name, "FL"), of(name))
    other_way = {"rack": "0.01:-0.01"} if TEMPLATES[name].steered else {}
    right = load(plain(tmp_path, name, "FR"), of(name, **other_way))
    theirs, ours = solved(left), solved(right)
    assert theirs.keys() == ours.keys()
    assert [note for note in right.assembly if "right of the middle" in note]
    mirrored = {each for each in ours if each.endswith((".y", "_y"))}
    for output, values in ours.items():
        expected = -theirs[output] if output in mirrored else theirs[output]
        np.testing.assert_allclose(values, expected, rtol=CLOSE, atol=CLOSE, err_msg=output)


def test_side_comment_in_hardpoint_table(tmp_path):
    case = load(plain(tmp_path, "mcpherson", "FR", "# side: right"), of("mcpherson"))
    assert not case.assembly
    assert "right side" in case.source
    again, ours = solved(written_again(case, tmp_path)), solved(case)
    np.testing.assert_allclose(again["toe"], ours["toe"], rtol=CLOSE, atol=CLOSE)


@pytest.mark.parametrize(("corner", "above", "options", "message"), rows(SIDE_FAULTS))
def test_contradictory_sides_are_refused(tmp_path, corner, above, options, message):
    own = {name: value for name, value in vars(supplied(options)).items() if f"{name}=" in options}
    complains(plain(tmp_path, "mcpherson", corner, above), message, of("mcpherson", **own))


WORDS = {"F": "Front", "R": "Rear"}, {"L": "Left", "R": "Right"}


@pytest.mark.by_day(4)
@pytest.mark.parametrize("corner", CORNERS)
@pytest.mark.parametrize(("head", "form"), rows(TABLES))
def test_corner_of_car_table_is_read(tmp_path, head, form, corner):
    said = of("double_wishbone", corner=corner)
    lines = [head]
    for each in CORNERS:
        axle, side = (words[letter] for words, letter in zip(WORDS, each, strict=True))
        for k, (name, x, y, z) in enumerate(points_at("double_wishbone", each)):
            place = {"name": name, "x": x, "y": y, "z": z, "first": "" if k else each}
            lines.append(form.format(corner=each, axle=axle, side=side, **place))
    case = load(written(tmp_path, lines, "car.m" if head[0] == "%" else "car.csv"), said)
    alone = load(plain(tmp_path, "double_wishbone", corner), of("double_wishbone"))
    theirs, ours = solved(alone), solved(case)
    assert theirs.keys() == ours.keys()
    for output, values in ours.items():
        np.testing.assert_array_equal(values, theirs[output], err_msg=output)
    assert case.source.split(LEFT_OUT)[1] != "nothing"


def test_several_corners_need_corner_option(tmp_path):
    lines = ["corner,point,x,y,z"]
    lines += [",".join([each, *row]) for each in CORNERS for row in points_at("mcpherson", each)]
    file = written(tmp_path, lines)
    with pytest.raises(
        CaseError, match=r"--corner FL: .* front left, front right, rear left, rear right"
    ):
        load(file, of("mcpherson"))
    with pytest.raises(CaseError, match=r"expected left\. Choose"):
        load(file, of("mcpherson", corner="left"))


def test_corner_sheet_of_workbook_is_read(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for corner in CORNERS:
        sheet = book.create_sheet(corner)
        sheet.append(["name", "x", "y", "z"])
        for role, *place in points_at("mcpherson", corner):
            sheet.append([role, *map(float, place)])
    file = tmp_path / "car.xlsx"
    book.save(file)
    case = load(file, of("mcpherson", corner="rear right"))
    theirs = load(plain(tmp_path, "mcpherson", "RR"), of("mcpherson"))
    np.testing.assert_array_equal(solved(case)["toe"], solved(theirs)["toe"])
    with pytest.raises(CaseError, match="--corner FL"):
        load(file, of("mcpherson"))
