"""Case files with couplers and motions: in the units of the file, and what a table of them
covers.
"""

from pathlib import Path

import numpy as np
import pytest
from kincheck.adapters.native import Native
from kincheck.core.case.io.case_file import load_case
from kincheck.core.joints import Gear, OrientationLock, RackPinion, Screw
from kincheck.core.mechanism.motions import Absolute, Ramp, Sine, Table

from ..support.case_texts import edited, write
from .test_casefile import same

COUPLED = """
schema = "kincheck-case/1"
name = "steering/box"
source = "made up for this test"
[units]
length = "mm"
angle = "deg"
[bodies.column]
[bodies.pinion]
[bodies.rack]
[bodies.nut]
[bodies.carrier]
[joints.column_axle]
type = "revolute"
bodies = ["ground", "column"]
point = [0, 0, 100]
axis = [0, 0, 1]
[joints.pinion_axle]
type = "revolute"
bodies = ["ground", "pinion"]
point = [60, 0, 100]
axis = [0, 0, 1]
[joints.mesh]
type = "gear"
joints = ["column_axle", "pinion_axle"]
ratio = -2.0
[joints.guide]
type = "translational"
bodies = ["ground", "rack"]
point = [60, 20, 100]
axis = [1, 0, 0]
[joints.rolls]
type = "rack_pinion"
joints = ["pinion_axle", "guide"]
radius = -20
[joints.thread]
type = "screw"
bodies = ["column", "nut"]
point = [0, 0, 100]
axis = [0, 0, 1]
lead = 6
[joints.upright]
type = "orientation_lock"
bodies = ["ground", "nut"]
[joints.hangs]
type = "spherical"
bodies = ["nut", "carrier"]
point = [0, 10, 100]
[joints.level]
type = "orientation_lock"
bodies = ["ground", "carrier"]
[points.rack_end]
body = "rack"
position = [160, 20, 100]
[points.nut]
body = "carrier"
position = [0, 10, 100]
[drivers.turn]
type = "joint_angle"
joint = "column_axle"
[sweep]
driver = "turn"
start = -360
stop = 360
steps = 9
"""


def test_couplers_and_joints_without_geometry(tmp_path: Path):
    """A steering column turns a pinion by a gear, that moves a rack, and lifts a nut by a
    thread.
    """
    case = load_case(write(tmp_path, COUPLED))
    assert case.mechanism.couplers == (
        Gear("mesh", ("column_axle", "pinion_axle"), -2.0),
        RackPinion("rolls", ("pinion_axle", "guide"), -0.02),
    )
    assert case.mechanism.joint("thread") == Screw(
        "thread", "column", "nut", (0.0, 0.0, 0.1), (0.0, 0.0, 1.0), 0.006
    )
    assert case.mechanism.joint("upright") == OrientationLock("upright", "ground", "nut")
    found = Native().solve(Native().build(case), case, 1e-12)
    assert found.solved.all()
    turn = case.sweep.values
    assert found.points["rack_end"].position[:, 0] == pytest.approx(
        0.16 - 0.02 * turn / -2.0, abs=1e-14
    )
    assert found.points["nut"].position[:, 2] == pytest.approx(
        0.1 - 0.006 * turn / (2.0 * np.pi), abs=1e-14
    )


MOTION = """[drivers.turn.motion]
type = "sine"
amplitude = 90
frequency = 2
phase = 45
[drivers.shift]
type = "joint_displacement"
joint = "guide"
[drivers.shift.motion]
type = "ramp"
rate = 3
[drivers.hang]
type = "point_coordinate"
point = "rack_end"
direction = [0, 3, 4]
relative = false
[drivers.hang.motion]
type = "table"
times = [0, 1.5]
values = [10, 20]
[sweep]
"""


def test_motions_are_in_the_units_of_the_file(tmp_path: Path):
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


def test_what_a_table_covers_is_told_to_the_rounding_of_its_times(tmp_path: Path):
    """2.1 m at 0.7 m/s take 3.0000000000000004 s, more than the table has."""
    motion = MOTION[MOTION.index("[drivers.hang]") :].replace("[0, 1.5]", "[-3, 3]")
    push = edited(
        ("[sweep]\n", motion.replace("rack_end", "tip")),
        ("= -0.1", "= -2.1"),
        ("stop = 0.1", "stop = 2.1"),
        ("= 2.0", "= 0.7"),
    )
    assert load_case(write(tmp_path, push)).sweep.path.times[-1] > 3.0


CURVED = """schema = "kincheck-case/1"
name = "knee"
source = "test"
units = {length = "mm", angle = "deg"}
bodies = {carriage = {}, shank = {}}
[joints]
slide = {type = "translational", bodies = ["ground", "carriage"], point = [0, 0, 0], axis = [1, 0, 0]}
flex = {type = "revolute", bodies = ["carriage", "shank"], point = [0, 0, 0], axis = [0, 1, 0]}
[couplers]
knee = {type = "polynomial", joints = ["slide", "flex"], coefficients = [0, 0.2, -0.006, 2e-5, 1e-7]}
[points.pin]
body = "carriage"
position = [0, 0, 0]
[drivers.flex]
type = "joint_angle"
joint = "flex"
[sweep]
driver = "flex"
start = 0
stop = 90
steps = 7
"""  # noqa: E501


def test_a_polynomial_is_in_the_units_of_the_file(tmp_path: Path):
    """Millimetres by powers of degrees, between the freedoms that the joints have."""
    case = load_case(write(tmp_path, CURVED))
    (knee,) = case.mechanism.couplers
    assert knee.freedoms == ("translation", "rotation")
    turn = np.linspace(0.0, 90.0, 7)
    shift = np.polynomial.Polynomial([0, 0.2, -0.006, 2e-5, 1e-7])(turn) / 1000.0
    found = Native().solve(Native().build(case), case, 1e-12)
    assert found.points["pin"].position[:, 0] == pytest.approx(shift, abs=1e-15)
