"""Digits of recordings: a four-bar by closed form, printed in many ways; true ones pass, wrong ones
fail.
"""

import json

import numpy as np
import pytest

from ...support.examples import examples

(REFUSED,) = examples(__file__, "refused")

A, B, C, D = (np.array(x) for x in ((0, 0), (0.1, 0), (0.26875, 0.24803918541230535), (0.3, 0)))
P = np.array([0.2, 0.1])
CASE = f"""schema = "kincheck-case/1"
name = "four_bar"
source = "made up for this test"
[bodies.crank]
[bodies.rod]
[bodies.rock]
[joints]
A = {{ type = "revolute", bodies = ["ground", "crank"], point = [0, 0, 0], axis = [0, 0, 1] }}
B = {{ type = "revolute", bodies = ["crank", "rod"], point = [0.1, 0, 0], axis = [0, 0, 1] }}
C = {{ type = "revolute", bodies = ["rod", "rock"], point = {[*C.tolist(), 0]}, axis = [0, 0, 1] }}
D = {{ type = "revolute", bodies = ["ground", "rock"], point = [0.3, 0, 0], axis = [0, 0, 1] }}
[points.P]
body = "rod"
position = [0.2, 0.1, 0]
[drivers.turn]
type = "joint_angle"
joint = "A"
[sweep]
driver = "turn"
start = 0
stop = 2
steps = 21
[outputs]
x = {{ point = "P", component = "x", relative = false }}
y = {{ point = "P", component = "y", relative = false }}
swing = {{ type = "joint_angle", joint = "D" }}
"""


def rotated(p, angle):
    return np.stack(
        [p[0] * np.cos(angle) - p[1] * np.sin(angle), p[0] * np.sin(angle) + p[1] * np.cos(angle)],
        1,
    )


def closed_form(turn, longer=1.0):
    """Return point P and the rocker's angle, with a rod longer than that of the case."""
    rod, rocker = longer * np.hypot(*(C - B)), np.hypot(*(C - D))
    end = rotated(B, turn)
    to = D - end
    far = np.hypot(*to.T)
    angle = np.arctan2(to[:, 1], to[:, 0])
    angle += np.arccos((far**2 + rod**2 - rocker**2) / (2.0 * far * rod))
    place = end + rotated(P - B, angle - np.arctan2(*(C - B)[::-1]))
    tip = end + rotated(np.array([rod, 0.0]), angle) - D
    return place, np.arctan2(tip[:, 1], tip[:, 0]) - np.arctan2(*(C - D)[::-1])


def text_of(form, turn, place, swing):
    """Return a table in mm and degrees; the form gets row, column and number."""
    columns = np.column_stack([np.degrees(turn), 1e3 * place, np.degrees(swing)]).tolist()
    rows = [",".join(form(k, n, x) for n, x in enumerate(row)) for k, row in enumerate(columns)]
    return "\n".join(["turn [deg],x [mm],y [mm],swing [deg]", *rows, ""])


def digits(count):
    return lambda k, n, x: f"{x:.{count}g}"


def random_digits():
    rng = np.random.default_rng(5)
    return lambda k, n, x: f"{x:.{rng.integers(4, 13)}g}"


def width(k, n, x):
    """Return a number in nine places, as in tables of fixed width."""
    texts = (f"{x:.{count}g}" for count in range(12, 0, -1))
    return next(text for text in texts if len(text) <= 9)


FORMS = {
    **{f"%.{count}g": lambda count=count: digits(count) for count in range(4, 13)},
    **{f"%.{n}f": lambda n=n: lambda k, c, x: f"{x:.{n}f}" for n in (2, 3, 6)},
    "spreadsheet": lambda: lambda k, n, x: repr(round(x, 4)).removesuffix(".0"),
    "mixed cells": random_digits,
    "mixed columns": lambda: lambda k, n, x: f"{x:.{4 + 2 * n}g}",
    "mixed rows": lambda: lambda k, n, x: f"{x:.{(4, 6, 9)[k % 3]}g}",
    "one row": lambda: lambda k, n, x: f"{x:.{4 if k == 7 else 6}g}",
    "last rows": lambda: lambda k, n, x: f"{x:.{5 if k > 15 else 6}g}",
    "width": lambda: width,
    "all digits": lambda: lambda k, n, x: repr(x),
}
GRIDS = {
    "even": np.linspace(0.0, 2.0, 21),
    "few": np.linspace(0.0, 1.0, 11),  # an even grid in degrees of four digits, too
    "odd": np.sort(np.random.default_rng(2).uniform(0.0, 2.0, 21)),
}


@pytest.fixture
def recorded(last_record, tmp_path):
    """Returns status and record of a recording of the four-bar, by its text."""
    case = tmp_path / "case.toml"
    case.write_text(CASE)

    def run(text, *options, name="run.csv"):
        file = tmp_path / name
        file.write_text(text)
        return last_record(case, "--recorded", file, *options)

    return run


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.by_day(2)
@pytest.mark.parametrize("form", FORMS)
def test_digits_of_true_recording_pass(recorded, form, grid):
    turn = GRIDS[grid]
    status, record = recorded(text_of(FORMS[form](), turn, *closed_form(turn)))
    assert status == 0, record["message"]


@pytest.mark.by_day(5)
@pytest.mark.parametrize("form", FORMS)
def test_digits_of_wrong_recording_fail(recorded, form):
    turn = GRIDS["even"]
    assert recorded(text_of(FORMS[form](), turn, *closed_form(turn, longer=1.01)))[0] == 1
    place, swing = closed_form(turn)
    place[10, 0] *= 1.005
    status, record = recorded(text_of(FORMS[form](), turn, place, swing))
    assert (status, record["errors"]["x"]["position"]["worst_step"]) == (1, 10)


def test_sign_with_unit_names_option(recorded):
    turn = GRIDS["few"]
    place, swing = closed_form(turn)
    text = text_of(digits(9), turn, place * [1.0, -1.0], swing).replace("y [mm]", "Y")
    status, record = recorded(text, "--map", "y=Y [m]")
    assert status == 1
    assert 'If it is meant, say --map "y=-Y [mm]"' in record["message"]
    assert recorded(text, "--map", "y=-Y [mm]")[0] == 0


def test_driver_that_somebody_set(recorded):
    """Numbers of one or two digits are exact beside outputs of more."""
    turn = np.array([0.0, 0.3, 0.7, 1.2, 1.9])
    place, swing = closed_form(turn)
    rows = np.column_stack([turn, place, swing])
    text = "turn,x,y,swing\n" + "\n".join(",".join(f"{x:.9g}" for x in row) for row in rows)
    assert recorded(text)[0] == 0
    assert recorded(text.replace("0.3,", "0.301,"))[0] == 1


def test_whole_turns_of_angles_are_named(recorded):
    turn = GRIDS["even"]
    place, swing = closed_form(turn)
    status, record = recorded(text_of(digits(8), turn, place, swing + 2.0 * np.pi))
    assert status == 0
    told = "swing: the recording is off by whole turns, +1, at all samples"
    assert told in record["message"]
    wrapped = np.where(np.arange(21) > 4, swing - 2.0 * np.pi, swing)
    _, record = recorded(text_of(digits(8), turn, place, wrapped))
    assert "off by whole turns, -1, at 16 of 21 samples, first at 5" in record["message"]
    status, record = recorded(text_of(digits(8), turn - 4.0 * np.pi, place, swing))
    assert status == 0
    assert "off by whole turns from the sweep, -2" in record["message"]
    assert "whole turns" not in recorded(text_of(digits(8), turn, place, swing))[1]["message"]


def test_unknown_columns_are_named(recorded):
    turn = GRIDS["even"]
    text = text_of(digits(8), turn, *closed_form(turn)).replace("swing", "swng")
    status, record = recorded(text.replace("y [mm]", "height [mm]"))
    assert status == 0
    assert (
        "columns of no known name are left out: 'swng' (is it swing?), 'height'"
        in (record["message"])
    )


def test_lines_beside_samples_are_listed(recorded):
    turn = GRIDS["even"]
    text = text_of(digits(8), turn, *closed_form(turn))
    status, record = recorded(f"# units: inch\nRig, 4711\n{text}end of test\n# signs")
    assert status == 0
    assert (
        "left out the rows without samples: # units: inch, # signs, line 2 (Rig, 4711),"
        " line 25 (end of test)"
    ) in record["message"]


def poses(turn, length=1.0, form=None):
    """Return a table of the rod's poses, its quaternions of another length."""
    place, _ = closed_form(turn)
    end = rotated(B, turn)
    arm = (place - end) @ np.array([[1, -1j], [1j, 1]])[:, 0] / ((P - B) @ np.array([1, 1j]))
    angle = np.angle(arm)
    origin = end - rotated(B, angle)
    numbers = [turn, *origin.T, 0.0 * turn, length * np.cos(angle / 2.0), 0.0 * turn, 0.0 * turn]
    rows = np.column_stack([*numbers, length * np.sin(angle / 2.0)]).tolist()
    head = "turn," + ",".join(f"rod.{each}" for each in ("x", "y", "z", "e0", "e1", "e2", "e3"))
    form = form or digits(10)
    return "\n".join([head, *(",".join(form(0, 0, x) for x in row) for row in rows)])


@pytest.mark.parametrize("count", [4, 6, 9, 12])
def test_quaternions_of_wrong_length_fail(recorded, count):
    """A row of their own, also where no joint has the poses of both bodies."""
    turn = GRIDS["even"]
    assert recorded(poses(turn, form=digits(count)))[0] == 0
    status, record = recorded(poses(turn, 1.01, digits(count)))
    assert status == 1
    assert "the recorded attitude of rod is a quaternion of length 1.0" in record["message"]
    assert record["details"]["rows"]["attitude"] == pytest.approx(0.01, abs=1e-3)
    nothing = poses(turn, np.where(np.arange(21) == 5, 0.0, 1.0), digits(count))
    status, record = recorded(nothing)
    assert (status, "of length 0 at sample 5" in record["message"]) == (1, True)


def planar(turn, unit, factor):
    """Return planar poses of crank and rod."""
    place, _ = closed_form(turn)
    end = rotated(B, turn)
    angle = np.angle(((place - end) @ np.array([1, 1j])) / ((P - B) @ np.array([1, 1j])))
    origin = end - rotated(B, angle)
    still = 0.0 * turn
    rows = np.column_stack([still, still, factor * turn, *origin.T, factor * angle]).tolist()
    heads = [f"{body}_{n}" for body in ("crank", "rod") for n in ("x [m]", "y [m]", f"theta{unit}")]
    return "\n".join([",".join(heads), *(",".join(map(repr, row)) for row in rows)])


PLANAR = ["--map", "crank=crank: x y theta", "--map", "rod=rod: x y theta"]


def test_planar_poses_are_judged(recorded):
    turn = GRIDS["odd"]
    for unit, factor in (("", 1.0), (" [rad]", 1.0), (" [deg]", 180.0 / np.pi)):
        status, record = recorded(planar(turn, unit, factor), *PLANAR)
        assert status == 0
        assert record["details"]["rows"]["position"] < 1e-12
    stated = [word.replace("theta", "theta [deg]") for word in PLANAR]
    assert recorded(planar(turn, "", 180.0 / np.pi), *stated)[0] == 0
    status, record = recorded(planar(turn, "", -1.0), *PLANAR)
    assert status == 1
    assert "Read as euler 3 inverted the gap is within" in record["message"]


RATES = {
    "in one": "velocity vx vy w, acceleration ax ay alpha",
    "apart": "velocity vx vy, omega w, acceleration ax ay, alpha alpha",
    "in space": "velocity vx vy zero, omega zero zero w",
    "angle alone in degrees": "velocity vx vy w [deg/s]",
}


def planar_rates(turn, unit, faster=1.0, slope=1.0):
    """Return the crank's planar poses at a place of it, and their rates; the turn's has all digits
    in degrees.
    """
    x, y = (P - B) * 0.5
    c, s, none = np.cos(turn), np.sin(turn), 0.0 * turn
    place, along = (c * x - s * y, s * x + c * y), (-s * x - c * y, c * x - s * y)
    rows = {
        "turn": turn,
        **dict(zip(("x", "y", "theta"), (*place, turn), strict=True)),
        **dict(zip(("vx", "vy"), along, strict=True)),
        "w": faster * np.degrees(1.0 + none),
        **dict(zip(("ax", "ay"), (-place[0], -place[1]), strict=True)),
        "alpha": none,
        "zero": none,
    }
    rows["vx"] = slope * rows["vx"]
    head = ",".join(name if name == "turn" else f"crank.{name}" for name in rows)
    head = head.replace(".w,", f".w{unit},")
    table = np.column_stack([*rows.values()]).tolist()
    return "\n".join([head, *(",".join(map(repr, row)) for row in table)])


@pytest.mark.parametrize("form", RATES)
def test_planar_velocities_are_judged(recorded, form):
    turn, unit = GRIDS["even"], "" if "degrees" in form else " [deg/s]"
    x, y = (P - B) * 0.5
    pose = f"crank=crank: x y theta, frame {x} {y} 0 1 0 0 0, {RATES[form]}"
    status, record = recorded(planar_rates(turn, unit), "--map", pose)
    assert status == 0, record["message"]
    assert record["details"]["rows"]["velocity"] < 1e-12
    for wrong in (planar_rates(turn, unit, 1.01), planar_rates(turn, unit, slope=1.01)):
        status, record = recorded(wrong, "--map", pose)
        assert status == 1
        assert record["details"]["rows"]["velocity"] > 5e-4


def test_pose_without_attitude_is_refused(recorded, capsys):
    text = planar(GRIDS["even"], "", 1.0).replace("theta", "z")
    options = [word.replace("theta", "z") for word in PLANAR]
    assert recorded(text, *options)[0] == 2
    assert "without attitude, expected them" in capsys.readouterr().err


def json_forms(turn):
    """Yield texts of JSON, as programs and data frames write them."""
    place, swing = closed_form(turn)
    names = ("turn", "x", "y", "swing")
    rows = np.column_stack([turn, place, swing]).tolist()
    records = [dict(zip(names, row, strict=True)) for row in rows]
    columns = dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))
    yield "records", records
    yield "below a key", {"steps": records, "program": "made up"}
    yield "columns", columns
    yield "columns below a key", {"meta": {"version": 2, "tags": ["a"]}, "data": columns}
    yield "frame", {"columns": names, "index": [*range(len(rows))], "data": rows}
    index = [*map(str, range(len(rows)))]
    yield "frame by columns", {n: dict(zip(index, c, strict=True)) for n, c in columns.items()}
    yield "frame by rows", dict(zip(index, records, strict=True))
    yield "rows", [names, *rows]
    scaled = [{**r, "turn": np.degrees(r["turn"]), "x": 1e3 * r["x"]} for r in records]
    yield "units", {"units": {"turn": "deg", "x": "mm"}, "steps": scaled}


FORMS_OF_JSON = [name for name, _ in json_forms(GRIDS["few"])]


@pytest.mark.parametrize("form", FORMS_OF_JSON)
def test_json_records_are_read(recorded, form):
    value = dict(json_forms(GRIDS["odd"]))[form]
    status, record = recorded(json.dumps(value), name="run.json")
    assert status == 0
    assert all(each["position"]["max_abs"] < 1e-13 for each in record["errors"].values())
    assert ("left out what is no column" in record["message"]) == ("below a key" in form)


def test_json_lines_and_gaps_are_read(recorded):
    records = dict(json_forms(GRIDS["odd"]))["records"]
    records[3]["x"], records[4]["y"] = None, float("nan")
    lines = "\n\n".join(map(json.dumps, records))
    status, record = recorded(lines, name="run.jsonl")
    assert status == 0
    assert "nothing is recorded: x at 1 sample, y at 1 sample" in record["message"]
    records[6]["x"] *= 1.001
    assert recorded("\n".join(map(json.dumps, records)), name="run.ndjson")[0] == 1


@pytest.mark.parametrize("kind", REFUSED)
def test_other_json_is_refused(recorded, capsys, kind):
    value, told = REFUSED[kind]
    assert recorded(json.dumps(value), name="run.json")[0] == 2
    assert told in capsys.readouterr().err
