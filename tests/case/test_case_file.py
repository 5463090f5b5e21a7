"""Case files: what they mean, motions of drivers, and their writing."""

import json
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from kincheck import (
    Distance,
    Gear,
    Joint,
    OrientationLock,
    RackPinion,
    Ramp,
    Screw,
    Sine,
    Spherical,
    Table,
)
from kincheck.adapters.native import Native
from kincheck.core.case.case import Truth
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.io.outputs import DEFAULT_ATOL, DEFAULT_RTOL, DEFAULT_WHY
from kincheck.core.case.quantity import Output
from kincheck.core.joints.base import length, position
from kincheck.core.mechanism.motions import Absolute

from ..support.case_texts import BASE, INLINE, edited, write
from ..support.examples import examples
from ..support.mechanisms import X, Y, Z

COUPLED, MOTION, CURVED, SWEEPS = examples(__file__, "coupled", "motion", "curved", "sweeps")

EXAMPLES = sorted((Path(__file__).parents[1] / "data" / "case_files").glob("*.toml"))


def same(a, b):
    assert (a.name, a.source, a.truth) == (b.name, b.source, b.truth)
    assert a.mechanism == b.mechanism
    assert a.outputs == b.outputs
    assert (a.sweep.driver, a.sweep.rate, a.sweep.design) == (
        b.sweep.driver,
        b.sweep.rate,
        b.sweep.design,
    )
    assert np.array_equal(a.sweep.values, b.sweep.values)
    assert a.reference.keys() == b.reference.keys()


def test_example_case_files_count():
    assert len(EXAMPLES) == 6


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_example_case_file_is_read(file):
    text = tomllib.loads(file.read_text())
    case = load_case(str(file))
    assert case.name == file.stem
    assert case.truth is Truth.CONSENSUS_ONLY  # without a reference, whatever the file claims
    types = {name: keys["type"] for name, keys in text["joints"].items()}
    assert {joint.name: joint.type for joint in case.mechanism.joints} == types
    assert [output.name for output in case.outputs] == list(text["outputs"])
    start, stop, steps = (text["sweep"][key] for key in ("start", "stop", "steps"))
    assert case.sweep.values.tolist() == np.linspace(start, stop, steps).tolist()


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_json_case_equals_toml_case(file, tmp_path):
    data = json.dumps(tomllib.loads(file.read_text()))
    same(load_case(write(tmp_path, data, "case.json")), load_case(file))
    same(load_case(write(tmp_path, data, "case")), load_case(file))  # told by its brace


def test_case_file_values(tmp_path):
    case = load_case(write(tmp_path, BASE + INLINE))
    why = "made up for this test"
    assert (case.name, case.source, case.truth) == ("slider", why, Truth.CLOSED_FORM)
    assert case.mechanism.body("slider").origin == (1.0, 2.0, 3.0)
    assert case.mechanism.joint("guide").bodies == ("ground", "slider")
    assert case.mechanism.point("tip").position == (1.5, 2.0, 3.0)
    assert (case.sweep.driver, case.sweep.rate, case.sweep.design) == ("push", 2.0, 0.0)
    assert case.sweep.values.tolist() == [-0.1, 0.0, 0.1]
    x = X
    assert case.outputs == (Output("tip_x", "tip", x, False, 1e-9, 0.0, why),)
    series = case.reference["tip_x"]
    assert series.position.tolist() == [1.4, 1.5, 1.6]
    assert series.velocity.tolist() == [2.0, 2.0, 2.0]
    assert series.acceleration is None


def test_case_in_millimetres_equals_metres(tmp_path):
    """Four joints, both kinds of driver: every number of the millimetre file is 1000 times that of
    the metre file.
    """
    metres = """
    schema = "kincheck-case/1"
    name = "arm"
    source = "made up for this test"
    truth = "closed_form"
    [bodies.arm]
    origin = [0.1, 0.2, 0.3]
    [bodies.rod]
    fixed = true
    [joints.pivot]
    type = "revolute"
    bodies = ["ground", "arm"]
    point = [0.1, 0.2, 0.3]
    axis = [0, 0, 5]
    [joints.tie]
    type = "distance"
    bodies = ["rod", "arm"]
    points = [[0.4, 0.5, 0.6], [0.7, 0.8, 0.9]]
    length = 0.52
    [points.tip]
    body = "arm"
    position = [0.9, 0.8, 0.7]
    [drivers.turn]
    type = "joint_angle"
    joint = "pivot"
    [sweep]
    driver = "turn"
    start = 0.0
    stop = 1.5707963267948966
    steps = 3
    rate = 3.141592653589793
    [outputs.tip_y]
    point = "tip"
    direction = [0, 3, 4]
    atol = 1e-3
    rtol = 0.5
    why = "made up for this test"
    [reference]
    rows = [[0.0, 0.8], [0.7853981633974483, 0.6], [1.5707963267948966, 0.4]]
    """
    millimetres = edited(
        ("[bodies.arm]", '[units]\nlength = "mm"\nangle = "deg"\n[bodies.arm]'),
        ("origin = [0.1, 0.2, 0.3]", "origin = [100, 200, 300]"),
        ("point = [0.1, 0.2, 0.3]", "point = [100, 200, 300]"),
        ("[[0.4, 0.5, 0.6], [0.7, 0.8, 0.9]]", "[[400, 500, 600], [700, 800, 900]]"),
        ("length = 0.52", "length = 520"),
        ("[0.9, 0.8, 0.7]", "[900, 800, 700]"),
        ("stop = 1.5707963267948966", "stop = 90"),
        ("rate = 3.141592653589793", "rate = 180"),
        ("atol = 1e-3", "atol = 1"),
        (
            "[[0.0, 0.8], [0.7853981633974483, 0.6], [1.5707963267948966, 0.4]]",
            "[[0, 800], [45, 600], [90, 400]]",
        ),
        base=metres,
    )
    a, b = load_case(write(tmp_path, metres)), load_case(write(tmp_path, millimetres))
    same(a, b)
    assert np.array_equal(a.reference["tip_y"].position, b.reference["tip_y"].position)
    assert b.outputs[0].direction == (0.0, 0.6, 0.8)
    assert b.outputs[0].rtol == 0.5
    tie = b.mechanism.joint("tie")
    assert isinstance(tie, Distance)
    assert tie.length == 0.52


def test_displacement_sweep_in_millimetres(tmp_path):
    text = edited(("[bodies.slider]", '[units]\nlength = "mm"\nangle = "deg"\n[bodies.slider]'))
    sweep = load_case(write(tmp_path, text)).sweep
    assert (sweep.values.tolist(), sweep.rate) == ([-1e-4, 0.0, 1e-4], 2e-3)


def test_absolute_point_driver_design_value(tmp_path):
    absolute = 'type = "point_coordinate"\npoint = "tip"\ndirection = [0, 3, 4]\nrelative = false'
    text = edited(('type = "joint_displacement"\njoint = "guide"', absolute))
    case = load_case(write(tmp_path, text))
    assert case.sweep.design == pytest.approx((3 * 2.0 + 4 * 3.0) / 5, rel=1e-15)
    case = load_case(write(tmp_path, text.replace("relative = false", "relative = true")))
    assert case.sweep.design == 0.0


def test_default_outputs_of_points(tmp_path):
    case = load_case(write(tmp_path, BASE[: BASE.index("[outputs")]))
    directions = {"tip.x": X, "tip.y": Y, "tip.z": Z}
    assert {output.name: output.direction for output in case.outputs} == directions
    for output in case.outputs:
        assert not output.relative
        assert (output.atol, output.why) == (DEFAULT_ATOL, DEFAULT_WHY)


def test_output_without_tolerance_gets_default(tmp_path):
    text = edited(('atol = 1e-9\nwhy = "made up for this test"', ""))
    (output,) = load_case(write(tmp_path, text)).outputs
    assert (output.atol, output.rtol, output.why) == (DEFAULT_ATOL, DEFAULT_RTOL, DEFAULT_WHY)


@pytest.mark.parametrize("where", ["named", "all"])
def test_default_tolerance_of_small_mechanism(tmp_path, where):
    """The tip is 5 um from the joint: a nanometre would let pass what is wrong in the fourth
    digit.
    """
    text = BASE[: BASE.index("[outputs") if where == "all" else BASE.index("atol")]
    small = ("[1.5, ", "[1.000005, "), ("-0.1", "-1e-7"), ("stop = 0.1", "stop = 1e-7")
    text = edited(*small, base=text)
    assert load_case(write(tmp_path, text)).outputs[0].atol == pytest.approx(5e-12, rel=1e-9)


@pytest.mark.parametrize(
    ("start", "stop", "steps", "values"),
    SWEEPS,
)
def test_sweep_downwards_or_of_one_sample(tmp_path, start, stop, steps, values):
    text = edited(
        ("start = -0.1", f"start = {start}"),
        ("stop = 0.1", f"stop = {stop}"),
        ("steps = 3", f"steps = {steps}"),
    )
    assert load_case(write(tmp_path, text)).sweep.values.tolist() == values


def test_sweep_rate_defaults_to_one(tmp_path):
    assert load_case(write(tmp_path, edited(("rate = 2.0\n", "")))).sweep.rate == 1.0


def test_own_joint_type_in_case_file(tmp_path):
    @dataclass(frozen=True)
    class Offset(Spherical):
        type = "offset_of_test_casefile"
        shift: float = length(default=0.0)
        second: tuple[float, float, float] | None = position(default=None)

    try:
        text = edited(
            ("[bodies.slider]", '[units]\nlength = "mm"\n[bodies.slider]'),
            ('type = "translational"', 'type = "offset_of_test_casefile"\nshift = 7'),
            ("axis = [1.0, 0.0, 0.0]", ""),
            (
                'type = "joint_displacement"\njoint = "guide"',
                'type = "point_coordinate"\npoint = "tip"\ndirection = [1, 0, 0]',
            ),
        )
        joint = load_case(write(tmp_path, text)).mechanism.joint("guide")
        assert isinstance(joint, Offset)
        assert (joint.point, joint.shift, joint.second) == ((0.001, 0.002, 0.003), 0.007, None)
    finally:
        del Joint.registry[Offset.type]


def test_byte_order_mark_and_windows_lines(tmp_path):
    marked = load_case(write(tmp_path, "\ufeff" + BASE.replace("\n", "\r\n")))
    same(marked, load_case(write(tmp_path, BASE, "b.toml")))


def solved(case):
    found = Native().solve(Native().build(case), case, 1e-12)
    assert found.solved.all()
    return found


def test_gear_rack_and_screw_move(tmp_path):
    """A steering column turns a pinion by a gear, that moves a rack, and lifts a nut by a
    thread.
    """
    case = load_case(write(tmp_path, COUPLED))
    assert case.mechanism.couplers == (
        Gear("mesh", ("column_axle", "pinion_axle"), -2.0),
        RackPinion("rolls", ("pinion_axle", "guide"), -0.02),
    )
    assert case.mechanism.joint("thread") == Screw(
        "thread", "column", "nut", (0.0, 0.0, 0.1), Z, 0.006
    )
    assert case.mechanism.joint("upright") == OrientationLock("upright", "ground", "nut")
    found = solved(case)
    turn = case.sweep.values
    assert found.points["rack_end"].position[:, 0] == pytest.approx(
        0.16 - 0.02 * turn / -2.0, abs=1e-14
    )
    assert found.points["nut"].position[:, 2] == pytest.approx(
        0.1 - 0.006 * turn / (2.0 * np.pi), abs=1e-14
    )


def test_driver_motions_in_file_units(tmp_path):
    sweep = COUPLED[COUPLED.index("[sweep]") :]
    text = edited((sweep, MOTION + "start = 0\nstop = 1.5\nsteps = 4\n"), base=COUPLED)
    case = load_case(write(tmp_path, text))
    assert (case.sweep.driver, case.sweep.rate, case.sweep.values.tolist()) == (
        "time",
        1.0,
        [0.0, 0.5, 1.0, 1.5],
    )
    turn, shift, hang = case.sweep.motions.values()
    assert turn == Sine(np.radians(90.0), 2.0, np.radians(45.0))
    assert shift == Ramp(0.003)
    assert isinstance(hang, Absolute)
    assert hang.motion == Table((0.0, 1.5), (0.01, 0.02))
    assert hang.design == pytest.approx((3 * 0.02 + 4 * 0.1) / 5, abs=1e-16)
    named = load_case(write(tmp_path, text.replace("[sweep]", '[sweep]\ndriver = "time"')))
    same(named, case)


def test_motion_table_covers_rounded_times(tmp_path):
    """2.1 m at 0.7 m/s take 3.0000000000000004 s, more than the table has."""
    motion = MOTION[MOTION.index("[drivers.hang]") :].replace("[0, 1.5]", "[-3, 3]")
    push = edited(
        ("[sweep]\n", motion.replace("rack_end", "tip")),
        ("= -0.1", "= -2.1"),
        ("stop = 0.1", "stop = 2.1"),
        ("= 2.0", "= 0.7"),
    )
    assert load_case(write(tmp_path, push)).sweep.path.times[-1] > 3.0


def test_polynomial_coupler_in_file_units(tmp_path):
    """Millimetres by powers of degrees, between the freedoms that the joints have."""
    case = load_case(write(tmp_path, CURVED))
    (knee,) = case.mechanism.couplers
    assert knee.freedoms == ("translation", "rotation")
    turn = np.linspace(0.0, 90.0, 7)
    shift = np.polynomial.Polynomial([0, 0.2, -0.006, 2e-5, 1e-7])(turn) / 1000.0
    found = solved(case)
    assert found.points["pin"].position[:, 0] == pytest.approx(shift, abs=1e-15)
