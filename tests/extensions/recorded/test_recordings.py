"""Recordings as engines: a four-bar by closed form in 40 digits, as other programs write it."""

import csv
import io
import re
import struct
import zlib
from itertools import product
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from kincheck.adapters import engine
from scipy.io import savemat

from ...support.case_texts import write
from ...support.examples import examples

(GEARS,) = examples(__file__, "gears")

DATA = Path(__file__).parents[2] / "data" / "recordings"
NATIVE = engine("native")
CASE = DATA / "fourbar.toml"
PARTS = {"PART_2": "crank", "PART_3": "coupler", "PART_4": "rocker"}
MODELICA = ["--map", "MOTION_1=crank.phi", "--map", "JOINT_4.angle=rocker.phi"]
ANGLES = ["--map", "MOTION_1=crank", "--map", "JOINT_4.angle=rocker"]
XYZW, EULER = "quaternion xyzw qx qy qz qw", "euler 123 a b c"


def maps(attitude, parts=PARTS):
    """Return the options that state poses in columns like crank.x."""
    return [
        word for part in parts for word in ("--map", f"{part}={PARTS[part]}: x y z, {attitude}")
    ]


@pytest.fixture
def judged(last_record):
    """Returns status and record of a recording of the four-bar; the record is None without one."""

    def run(file, *options):
        return last_record(CASE, "--recorded", file, *options)

    return run


@pytest.fixture
def table(tmp_path):
    """Returns a file with the changed rows of a table of the data folder, its first 25 samples."""

    def write(name, change):
        rows = list(csv.reader((DATA / name).read_text().splitlines()))[:26]
        file = tmp_path / "changed.csv"
        file.write_text("".join(",".join(row) + "\n" for row in change(rows)))
        return file

    return write


def changed_cell(row, column, change):
    """Return the change of a table that changes the text of one cell."""

    def changed(rows):
        rows[row][column] = change(rows[row][column])
        return rows

    return changed


def more(by):
    return lambda cell: f"{float(cell) + by:.9g}"


def largest(record, quantity="position"):
    """Return the largest deviation of outputs."""
    found = [each[quantity] for each in record["errors"].values()]
    return max(each["max_abs"] for each in found if each)


@pytest.mark.parametrize(
    ("file", "options", "gap"),
    [
        ("fourbar.res", [], 1e-15),
        ("fourbar_xyzw.csv", maps(XYZW), 7.6e-10),
        ("fourbar_123.csv", maps(EULER), 3.3e-9),
        ("fourbar_xyzw.csv", [w + ", first" if "=" in w else w for w in maps(XYZW)], 1e-8),
    ],
    ids=["Adams", "quaternions", "Euler angles", "from the first pose"],
)
def test_true_recorded_poses_pass(judged, file, options, gap):
    status, record = judged(DATA / file, *options)
    assert (status, record["outcome"], record["mode"]) == (0, "pass", "recorded")
    assert record["engine"] == Path(file).stem
    assert 0.0 < record["details"]["rows"]["position"] < gap


def test_map_of_body_to_prefix(judged, capsys):
    prefixes = [word for part, prefix in PARTS.items() for word in ("--map", f"{part}={prefix}")]
    status, record = judged(DATA / "fourbar_xyzw.csv", *prefixes)
    assert (status, record["outcome"]) == (0, "pass")
    assert 0.0 < record["details"]["rows"]["position"] < 7.6e-10
    assert judged(DATA / "fourbar_123.csv", *prefixes)[0] == 2
    told = "found no pose of PART_2 in columns of known names below 'crank'"
    assert told in capsys.readouterr().err


def test_adams_results_are_judged_with_rates(judged):
    _, record = judged(DATA / "fourbar.res", "--analysis", "kinematic_001")
    assert largest(record) < 2e-15
    assert largest(record, "velocity") < 1e-14
    # 16 units in the last place of the largest, the joints' 46.6 rad/s^2
    assert largest(record, "acceleration") < 16 * np.spacing(46.6)
    assert "read the analysis kinematic_001" in record["message"]


@pytest.mark.parametrize(
    ("file", "options", "tolerance"),
    [
        ("fourbar_modelica.mat", MODELICA, 2e-15),
        ("fourbar_modelica_single.mat", MODELICA, 1e-7),
        ("fourbar.mot", ANGLES, 1e-9),
    ],
    ids=["Modelica", "single precision", "OpenSim"],
)
def test_true_recorded_angles_pass(judged, file, options, tolerance):
    status, record = judged(DATA / file, *options)
    assert status == 0
    assert largest(record) < tolerance
    assert ("angles without a unit in deg" in record["message"]) == file.endswith("mot")


def written_as(file, form, crank, rocker):
    """Write the angles [rad] as a program would, and return the options that state their names."""
    rows = np.column_stack([crank, rocker]).tolist()
    if form == "workbook":
        book = openpyxl.Workbook()
        for row in [("crank [rad]", "rocker [rad]"), *rows]:
            book.active.append(row)
        book.save(file)
        return ANGLES
    if form == "storage":
        lines = ["run", "inDegrees=no", "endheader", "crank\trocker"]
        file.write_text("\n".join([*lines, *(f"{x!r}\t{y!r}" for x, y in rows)]))
        return ANGLES
    variables, names = {
        "vectors": ({"crank": crank, "rocker": rocker, "n": 3.0}, ("crank", "rocker")),
        "matrix": ({"log": np.column_stack([crank, rocker])}, ("log(1)", "log(2)")),
        "struct": ({"log": {"crank": crank, "rocker": rocker}}, ("log.crank", "log.rocker")),
    }[form]
    savemat(file, variables, do_compression=form != "vectors")
    return ["--map", f"MOTION_1={names[0]} [rad]", "--map", f"JOINT_4.angle={names[1]} [rad]"]


@pytest.mark.by_day(2)
@pytest.mark.parametrize(
    ("form", "suffix"),
    [
        ("workbook", ".xlsx"),
        ("storage", ".sto"),
        ("vectors", ".mat"),
        ("matrix", ".mat"),
        ("struct", ".mat"),
    ],
)
def test_recording_in_other_formats_is_judged(judged, tmp_path, form, suffix):
    _, truth = judged(DATA / "fourbar_modelica.mat", *MODELICA)
    crank = np.array(truth["driver"]["MOTION_1"])
    rocker = np.array(truth["outputs"]["JOINT_4.angle"]["position"])
    file = tmp_path / f"run{suffix}"
    status, record = judged(file, *written_as(file, form, crank, rocker))
    assert status == 0
    assert largest(record) < 2e-15
    rocker[30] += 1e-5
    status, record = judged(file, *written_as(file, form, crank, rocker))
    assert status == 1
    assert record["errors"]["JOINT_4.angle"]["position"]["worst_step"] == 30


def damaged(place, number):
    """Return a MAT-file with another number at a place."""
    savemat(stream := io.BytesIO(), {"a": np.arange(9.0)})
    data = bytearray(stream.getvalue())
    struct.pack_into("<I", data, place, number)
    return bytes(data)


RESULTS = (DATA / "fourbar.res").read_text()
TWO = RESULTS.replace("</Data>\n<Term", "</Data><Data name='dynamic_002'></Data>\n<Term")
REFUSED = {
    "MotionSolve": ("a.abf", b"\0", "of MotionSolve. In HyperGraph, export the curves as CSV"),
    "Simpack": ("a.sbr", b"\0", "Simpack. In its PostProcessor, export the channels as CSV"),
    "requests": ("a.req", b"\0", "a request file of Adams. Say RESULTS/XRF in the deck"),
    "level 7.3": ("a.mat", b"MATLAB 7.3 MAT-file", "of version 7.3. In MATLAB: save"),
    "no MAT-file": ("a.mat", b"junk" * 99, "found no readable MAT-file"),
    "no driver": ("a.csv", "time,z\n0,1\n", "the columns 'time', 'z', expected one of MOTION_1"),
    "two analyses": (
        "a.res",
        TWO,
        "the analyses 'kinematic_001', 'dynamic_002', expected one. Say --analysis NAME",
    ),
    "cut off": ("a.res", RESULTS[:5000], "not valid XML"),
    "old text": ("a.res", "1 2 3\n", "Say RESULTS/XRF in the deck, which writes XML"),
    "entities": ("a.res", "<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>", "expected"),
    # a matrix without rows is left out
    "no rows": (
        "a.mat",
        struct.pack("<5i", 0, 0, 2_000_000_000, 0, 2) + b"a\0",
        "found the columns none, expected one of MOTION_1",
    ),
    # with which scipy 1.17 ends the process
    "type of numbers": ("a.mat", damaged(176, 199), "numbers of type 199"),
    "type of element": ("a.mat", damaged(128, 13), "an element of type 13"),
    "no head": ("a.mat", damaged(152, 1), "a matrix without its head"),
    "length": ("a.mat", damaged(132, 10**9), "an element is cut off"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_unreadable_recording_is_refused(judged, tmp_path, capsys, kind):
    name, content, text = REFUSED[kind]
    assert judged(write(tmp_path, content, name))[0] == 2
    assert text in capsys.readouterr().err


def test_matlab_zip_bomb_is_refused(judged, tmp_path, capsys):
    head = b"MATLAB 5.0".ljust(124) + b"\0\1IM"
    packed = zlib.compress(bytes(300_000_000), 9)
    data = head + struct.pack("<II", 15, len(packed)) + packed
    assert judged(write(tmp_path, data, "run.mat"))[0] == 2
    assert "bytes when unpacked: write fewer samples or channels" in capsys.readouterr().err


COLUMNS = [2, 5, 7, 8, 13, 14, 16, 18, 21]


PLACES = [
    *(("fourbar_xyzw.csv", XYZW, column) for column in COLUMNS),
    *(("fourbar_123.csv", EULER, column) for column in COLUMNS[:-1]),
]


@pytest.mark.by_day(4)
@pytest.mark.parametrize("place", PLACES)
def test_wrong_number_in_poses_is_located(judged, table, place):
    name, attitude, column = place
    sample = 7 * column % 25
    heads = (DATA / name).read_text().split("\n", 1)[0].split(",")
    length, angle = {XYZW: (1e-5, 1e-4), EULER: (1e-2, 6e-3)}[attitude]
    by = length if heads[column].endswith("m]") else angle
    file = table(name, changed_cell(sample + 1, column, more(by)))
    status, record = judged(file, *maps(attitude))
    part = next(p for p, body in PARTS.items() if heads[column].startswith(body))
    found = re.search(r"gap of \S+ m in (\w+) at sample (\d+) \(([^)]*)\)", record["message"])
    assert status == 1
    assert (int(found[2]), part in found[3]) == (sample, True)
    assert "24 of 25 samples" in record["message"]


@pytest.mark.by_day(2)
@pytest.mark.parametrize(
    ("number", "text"),
    [
        (2, "recorded poses leave a gap of 1e-05 m in JOINT_2 at sample 4 (PART_2)"),
        (26, "recorded velocities leave 1e-05 m/s in JOINT_2 at sample 4 (PART_3)"),
        (51, "recorded accelerations leave 1e-05 m/s² in JOINT_4 at sample 4 (PART_4)"),
    ],
)
def test_wrong_number_in_adams_is_located(judged, tmp_path, number, text):
    first, *steps = RESULTS.split('<Step type="kinematic">')
    head, tail = steps[40].split("</Step>")
    numbers = head.split()
    numbers[number - 1] = repr(float(numbers[number - 1]) + 0.01)
    steps[40] = "\n" + " ".join(numbers) + "\n</Step>" + tail
    moved = '<Step type="kinematic">'.join([first, *steps[36:45], steps[-1]])
    status, record = judged(write(tmp_path, moved, "moved.res"))
    assert status == 1
    assert text in record["message"]


@pytest.mark.parametrize(
    ("file", "wrong", "right"),
    [
        ("fourbar_123.csv", "euler 321 a b c", "Read as euler 123 the gap"),
        ("fourbar_xyzw.csv", "quaternion wxyz qx qy qz qw", "Read as quaternion xyzw the gap"),
        ("fourbar_xyzw.csv", "quaternion xyzw inverted qx qy qz qw", "quaternion xyzw the gap"),
        ("fourbar_xyzw.csv", XYZW + ", position x y z [mm]", "positions in m, not mm, the gap"),
    ],
)
def test_wrong_attitude_convention_is_named(judged, table, file, wrong, right):
    texts = [w.replace("x y z, ", "") if "[mm]" in wrong else w for w in maps(wrong)]
    status, record = judged(table(file, list), *texts)
    assert status == 1
    assert right in record["message"]


def test_other_zero_angles_are_explained(judged):
    rate = ["--map", "JOINT_4.angle.velocity=rocker rate"]
    status, record = judged(DATA / "fourbar_angles.csv", *ANGLES, *rate)
    stated = re.findall(r'--map "([^"]*)"', record["message"])
    assert status == 1
    assert stated == [
        "MOTION_1=crank-50 [deg]",
        "JOINT_4.angle=-rocker+90 [deg]",
        "JOINT_4.angle.velocity=-rocker rate [deg/s]",
    ]
    options = [word for text in stated for word in ("--map", text)]
    status, record = judged(DATA / "fourbar_angles.csv", *options)
    assert status == 0
    assert 8e-7 < largest(record) < 9e-7


RIGHT = ["--map", "MOTION_1=crank-50 [deg]", "--map", "JOINT_4.angle=-rocker+90 [deg]"]


def shifted(rows):
    return [rows[0], *([a[0], *b[1:]] for a, b in zip(rows[2:], rows[1:], strict=False))]


def from_zero(rows):
    return [rows[0], *([f"{float(row[0]) - 50:.4f}", *row[1:]] for row in rows[1:])]


@pytest.mark.by_day(2)
@pytest.mark.parametrize(
    ("options", "change", "text"),
    [
        (RIGHT, shifted, "the recording shifted by one sample, each taken from the next"),
        (
            ["--map", "MOTION_1=-crank+50 [deg]", *RIGHT[2:]],
            list,
            'read with --map "MOTION_1=crank-50 [deg]" the recording leaves',
        ),
        (
            [*RIGHT[:3], "JOINT_4.angle=-rocker [rad]"],
            list,
            "times pi/180",
        ),
        (
            ["--map", "MOTION_1=crank [rad]", *RIGHT[2:]],
            from_zero,
            'read with --map "MOTION_1=crank [deg]" the recording leaves',
        ),
    ],
    ids=["late", "driver sign", "output unit", "driver unit"],
)
def test_slip_in_recording_is_named(judged, table, options, change, text):
    status, record = judged(table("fourbar_angles.csv", change), *options)
    assert status == 1
    assert text in record["message"]


@pytest.mark.parametrize("said", ["rocker-90 [deg]", "-rocker+90.0 [rad]"])
def test_slip_names_option_that_states_it(judged, said):
    """A wrong sign and a wrong unit of an output; with the option the recording is right."""
    options = [*RIGHT[:3], f"JOINT_4.angle={said}"]
    status, record = judged(DATA / "fourbar_angles.csv", *options)
    (stated,) = re.findall(r'If it is meant, say --map "([^"]*)"', record["message"])
    assert status == 1
    assert judged(DATA / "fourbar_angles.csv", *RIGHT[:2], "--map", stated)[0] == 0


def test_map_offset_has_a_unit(judged):
    options = ["--map", "MOTION_1=crank-0.8726646259971648 [rad]", *RIGHT[2:]]
    assert judged(DATA / "fourbar_angles.csv", *options)[0] == 0


def test_joints_without_poses_are_not_judged(judged):
    status, record = judged(DATA / "fourbar_xyzw.csv", *maps(XYZW, ["PART_2", "PART_4"]))
    assert status == 0
    told = "joints not judged, without the pose of a body: JOINT_2 (PART_3), JOINT_3 (PART_3)"
    assert told in record["message"]


def test_recording_of_driver_alone_is_unjudged(judged, tmp_path):
    status, record = judged(write(tmp_path, "MOTION_1 [deg]\n0\n5\n", "driver.csv"))
    assert (status, record["outcome"]) == (2, "unjudged")


@pytest.mark.parametrize(
    "rows",
    [slice(1, None, 4), slice(1, 2)],
    ids=["coarser", "one sample"],
)
def test_recording_of_fewer_samples_passes(judged, table, rows):
    file = table("fourbar_xyzw.csv", lambda every: [every[0], *every[rows]])
    assert judged(file, *maps(XYZW))[0] == 0


def test_equal_event_rows_are_merged(judged, table):
    file = table("fourbar_xyzw.csv", lambda rows: [*rows[:10], *rows[9:]])
    status, record = judged(file, *maps(XYZW))
    assert (status, len(record["driver"]["MOTION_1"])) == (0, 25)
    assert "merged 1 row" in record["message"]


def test_unequal_event_rows_need_option(judged, table, capsys):
    def changed(rows):
        return [*rows[:10], [*rows[9][:2], "-0.04", *rows[9][3:]], *rows[10:]]

    file = table("fourbar_xyzw.csv", changed)
    assert judged(file, *maps(XYZW))[0] == 2
    assert 'Say which rows to take: --map "event=first"' in capsys.readouterr().err
    assert judged(file, *maps(XYZW), "--map", "event=first")[0] == 0
    assert judged(file, *maps(XYZW), "--map", "event=last")[0] == 1


@pytest.mark.parametrize("cell", ["", "NaN"])
@pytest.mark.parametrize(
    ("column", "text"),
    [(2, "left out 1 sample without the pose of a driver"), (9, "PART_3 at 1 sample")],
)
def test_gaps_in_poses_are_named(judged, table, cell, column, text):
    file = table("fourbar_xyzw.csv", changed_cell(9, column, lambda _: cell))
    status, record = judged(file, *maps(XYZW))
    assert status == 0
    assert text in record["message"]


def test_accuracy_option_of_recording(judged, table):
    moved = changed_cell(8, 1, more(1e-5))
    file = table("fourbar_xyzw.csv", moved)
    assert judged(file, *maps(XYZW))[0] == 1
    assert judged(file, *maps(XYZW), "--accuracy", "position=0.005 mm")[0] == 1
    status, record = judged(file, *maps(XYZW), "--accuracy", "position=0.02 mm")
    assert status == 0
    assert record["details"]["rows"]["position"] == pytest.approx(1e-5, rel=1e-3)


def test_even_driver_values_are_exact(judged, tmp_path):
    _, truth = judged(DATA / "fourbar.mot", *ANGLES)
    angles = truth["outputs"]["JOINT_4.angle"]["position"]
    for change, status in ((0.0, 0), (1e-6, 1)):
        rows = [f"{5 * k},{x + change * (k == 30)!r}" for k, x in enumerate(angles)]
        text = "\n".join(["MOTION_1 [deg],JOINT_4.angle [rad]", *rows])
        file = write(tmp_path, text, "a.csv")
        assert judged(file, "--accuracy", "JOINT_4.angle=1e-8 rad")[0] == status


HINGE = 'type = "revolute"\nbodies = ["ground", "b"]'
RACK = GEARS.replace(HINGE, HINGE.replace("revolute", "translational")).replace("ratio = -0.4", "")
RACK = RACK.replace('type = "gear"', 'type = "rack_pinion"\nradius = 0.05')
RACK = RACK.replace('component = "x"', 'component = "z"')


def turning(body, place, angle):
    """Return the columns of a body that turns about z."""
    nil, half = 0.0 * angle, 0.5 * angle
    values = (*(nil + x for x in place), np.cos(half), nil, nil, np.sin(half))
    names = ("x", "y", "z", "e0", "e1", "e2", "e3")
    return {f"{body}.{name}": each for name, each in zip(names, values, strict=True)}


@pytest.fixture
def coupled(last_record, tmp_path):
    """Returns the status and record of columns, recorded of a case of coupled joints."""

    def run(text, columns):
        case, file = tmp_path / "case.toml", tmp_path / "run.csv"
        case.write_text(text)
        rows = np.column_stack([*columns.values()])
        np.savetxt(file, rows, "%.9f", ",", header=",".join(columns), comments="")
        return last_record(case, "--recorded", file)

    return run


@pytest.mark.by_day(5)
@pytest.mark.parametrize(
    "given", [*product(["gears", "rack"], [0, 20, 45], ["by column", "by poses"])]
)
def test_recorded_couplers_pass_after_turns(coupled, given):
    kind, first, driven = given
    turn = np.linspace(0.0, 12.0, 61)[first:]
    other, lift = {"gears": (-1.25, 0.0), "rack": (0.0, 0.05)}[kind]
    columns = {"turn": turn} if driven == "by column" else {}
    columns |= turning("a", (0.0, 0.0, 0.0), turn)
    columns |= turning("b", (0.3, 0.0, lift * turn), 2.0 * other * turn)
    text = {"gears": GEARS, "rack": RACK}[kind]
    status, record = coupled(text, columns)
    assert status == 0
    assert ("coupled joints begin after whole turns" in record["message"]) == (first > 0)
    wrong = text.replace("-0.4", "-0.40001").replace("0.05", "0.05001")
    assert coupled(wrong, columns)[0] == 1


def test_recorded_gear_half_turn_off_fails(coupled):
    """A turn more of the driver would explain it; the driver's column says that there is none."""
    turn = np.linspace(0.0, 2.0, 11)
    columns = {"turn": turn} | turning("b", (0.3, 0.0, 0.0), -2.5 * turn - np.pi)
    columns |= turning("a", (0.0, 0.0, 0.0), turn)
    text = GEARS.replace('body = "b"\nposition = [0.4', 'body = "a"\nposition = [0.1')
    assert coupled(text, columns)[0] == 1


@pytest.mark.parametrize(
    ("column", "outcome"),
    [(None, "pass"), ("position", "fail"), ("velocity", "fail"), ("acceleration", "fail")],
)
def test_long_csv_as_recording(judged, kincheck_main, tmp_path, column, outcome):
    """With its rates; a single number that is wrong by a thousandth shows."""
    file = tmp_path / "curves.csv"
    options = ["--csv", file, "--long", "--quiet"]
    kincheck_main("run", CASE, *options, engines=[NATIVE])
    head, *rows = csv.reader(file.read_text().splitlines())
    k = next(k for k, row in enumerate(rows) if row[1] == "native" and row[5] == "17")
    if column is not None:
        rows[k][head.index(column)] = repr(1.001 * float(rows[k][head.index(column)]))
    file.write_text("".join(",".join(row) + "\n" for row in (head, *rows)))
    status, record = judged(file)
    assert (status, record["outcome"]) == (int(outcome == "fail"), outcome)


def test_long_csv_of_two_cases(judged, kincheck_main, tmp_path, capsys):
    file = tmp_path / "curves.csv"
    options = ["--csv", file, "--long", "--quiet"]
    kincheck_main("run", CASE, "crank", *options, engines=[NATIVE])
    assert judged(file)[0] == 2
    assert "'crank', expected one. Write a file for each" in capsys.readouterr().err
