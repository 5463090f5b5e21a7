"""A message about a number of a file has the number as the file has it, with the file's unit."""

import math
import re

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from kincheck import CaseError, Distance, MechanismError, Supplied
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.models.files import load
from kincheck.core.case.notes import notes
from kincheck.core.case.units import ANGLES, LENGTHS, plain

from ..support.case_texts import write
from ..support.examples import examples

TEXT, QUOTED = examples(__file__, "text", "quoted")

TURN = 'type = "joint_angle"\njoint = "pivot"'
SHIFT = 'type = "point_coordinate"\npoint = "tip"\ndirection = [1, 0, 0]'
ROD = (
    '[bodies.rocker]\n[joints.rod]\ntype = "distance"\nbodies = ["crank", "rocker"]\npoints = [[0,'
    " 0, 0], [SIDE, 0, 0]]\n"
)
VEHICLE = """[suspension]
convention = "iso8855"
side = "right"
forward = [1, 0, 0]
up = [0, 0, 1]
wheel_center = "tip"
"""
numbers = st.floats(1e-3, 1e4) | st.integers(1, 9999) | st.decimals(1, 999, places=4)
quick = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def as_read(number):
    """A number of a file, as Python shows it."""
    return repr(number if isinstance(number, int) else float(number))


def text(length="mm", angle="deg", driver=TURN, side="100", start="-1", stop="1"):
    changed = TEXT.replace("LENGTH", length).replace("ANGLE", angle).replace("DRIVER", driver)
    return changed.replace("SIDE", side).replace("START", start).replace("STOP", stop)


def refused(file, **more):
    with pytest.raises(CaseError) as caught:
        load(file, Supplied(**more)) if more else load_case(file)
    return str(caught.value)


@quick
@given(number=numbers, unit=st.sampled_from(["mm", "m", "deg", "rad"]), inline=st.booleans())
def test_driver_value_off_grid_is_quoted(tmp_path, number, unit, inline):
    """The start is quoted too: as expected."""
    units = {"angle": unit} if unit in ANGLES else {"length": unit, "driver": SHIFT}
    start, found = str(number), str(number * 2)
    rows = f"rows = [[{found}, 1.0], [1e5, 1.0]]"
    (tmp_path / "x.csv").write_text(f"turn,x\n{found},1.0\n1e5,1.0\n")
    given_by = rows if inline else 'file = "x.csv"'
    reference = f"[reference]\n{given_by}\n"
    message = refused(write(tmp_path, text(**units, start=start, stop="1e5") + reference))
    told = rf"driver value (\S+) {unit} at no sample of the sweep, the nearest is (\S+) {unit},"
    quoted = re.search(told, message)
    assert quoted is not None, message
    written = found if not inline else as_read(number * 2)
    assert quoted[1] == written
    assert math.isclose(float(quoted[2]), float(start), rel_tol=1e-9)
    if len(plain(float(start))) <= 15:
        assert quoted[2] == plain(float(start))


@quick
@given(number=numbers, unit=st.sampled_from(["mm", "m"]))
def test_negative_length_is_quoted(tmp_path, number, unit):
    rod = ROD.replace("SIDE", "100") + f"length = -{number}\n"
    message = refused(write(tmp_path, text(length=unit) + rod))
    assert f"length is {as_read(-number)} {unit}, expected a positive one" in message
    assert f"the points are 100 {unit} apart" in message


@quick
@given(number=st.decimals(1, 999, places=6), unit=st.sampled_from(["mm", "m"]))
def test_rod_note_quotes_length(tmp_path, number, unit):
    rod = ROD.replace("SIDE", "1234.5") + f"length = {number}\n"
    found = " ".join(notes(load_case(write(tmp_path, text(length=unit) + rod))))
    assert f"length {plain(float(number))} {unit}, points 1234.5 {unit} apart" in found


@pytest.mark.needs("hardpoints")
@quick
@given(number=numbers, unit=st.sampled_from(["mm", "m"]))
def test_wheel_on_other_side_is_quoted(tmp_path, number, unit):
    message = refused(write(tmp_path, text(length=unit, side=str(number)) + VEHICLE))
    (found,) = re.findall(rf"'tip' is (\S+) {unit} on the other side", message)
    assert math.isclose(float(found), number, rel_tol=1e-9)


POINTS = """name,x,y,z
lca_front,0.4,0.35,-0.1
lca_rear,0.0,0.35,-0.1
lca_outer,0.2,0.7,-0.15
uca_front,0.4,0.4,0.2
uca_rear,0.0,0.4,0.2
uca_outer,0.2,0.65,UPPER
tierod_inner,-0.1,0.35,0
tierod_outer,-0.1,0.7,0
wheel_center,0.2,WHEEL,0
"""


@pytest.mark.needs("hardpoints")
@pytest.mark.parametrize("unit", QUOTED)
@pytest.mark.parametrize(
    ("upper", "wheel", "axes", "words"),
    [
        (
            "-0.2345",
            "0.75",
            "forward,left,up",
            "uca_outer: found z = -0.2345 UNIT, not above lca_outer with z = -0.15 UNIT",
        ),
        (
            "0.2",
            "0.75",
            "rearward,left,up",
            "uca_front: found x = 0.4 UNIT, and uca_rear with x = 0 UNIT",
        ),
        (
            "0.2",
            "0.75",
            "forward,right,up",
            "wheel_center: found y = 0.75 UNIT, not left of the middle",
        ),
    ],
)
def test_hardpoints_quoted_in_file_axes(tmp_path, unit, upper, wheel, axes, words):
    file = write(tmp_path, POINTS.replace("UPPER", upper).replace("WHEEL", wheel), "points.csv")
    message = refused(file, template="double_wishbone", units=unit, axes=axes)
    if unit == "mm":  # less than a millimetre
        assert "the points span" in message
        assert "metres declared as mm?" in message
    elif "span" in message:
        assert re.search(rf"the points span \S+ {unit}, expected ", message)
    else:
        assert unit != "cm"
        assert words.replace("UNIT", unit) in message


@quick
@given(number=st.floats(1e-6, 1e6), unit=st.sampled_from([*LENGTHS.values(), *ANGLES.values()]))
def test_unit_round_trip(number, unit):
    written, name = unit.written(unit(number)).split()
    assert name == unit.name
    assert math.isclose(float(written), number, rel_tol=1e-9)
    assert unit.written(unit(number), [1.0, number]).split()[0] == repr(number)


@pytest.mark.parametrize("number", ["0.0349", "350", "12.7", "0.1", "123456.789", "1e-05"])
def test_unit_keeps_decimals(number):
    for unit in (*LENGTHS.values(), *ANGLES.values()):
        assert unit.written(unit(float(number))) == f"{number} {unit.name}"


def test_python_joint_fault_in_metres():
    with pytest.raises(
        MechanismError,
        match=r"length is -0\.35 m, expected a positive one; the points are 0\.5 m apart",
    ):
        Distance("rod", "a", "b", ((0.0, 0.0, 0.0), (0.5, 0.0, 0.0)), -0.35)
