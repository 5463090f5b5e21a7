"""Cases within the digits of their files: rows that are redundant but for digits are left out."""

import numpy as np
import pytest
from kincheck import Supplied, solve
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.kinematics import degrees_of_freedom
from scipy.spatial.transform import Rotation

from ...support.case_texts import complains
from ...support.four_bar_within_digits import BODIES, written

TILT = 1e-6
TILTED = {"a": (TILT, 1.0, 0.0)}
SWEEP = {"driver": "turn", "start": -3.0, "stop": 3.0, "steps": 61}
SWEPT = np.linspace(-3.0, 3.0, 61)
ONE_OUTPUT = {"tip_x": {"point": "tip", "component": "x"}}


def four_bar(folder, tolerance=None, axes=TILTED, **more):
    """The four-bar with a tilted hinge over nearly a turn, as a file."""
    if tolerance is not None:
        more["closure"] = {"tolerance": tolerance}
    return written(folder, axes, sweep=SWEEP, outputs=ONE_OUTPUT, **more)


@pytest.mark.parametrize("last", ["revolute", "spherical", "cylindrical", "universal"])
@pytest.mark.parametrize("angles", [(0, 0, 0), (0.3, 1.1, -0.7)], ids=["level", "turned"])
def test_closure_tolerance_moves_like_ideal_loop(tmp_path, last, angles):
    """Like the linkage of parallel hinges."""
    turn = Rotation.from_euler("xyz", angles).as_matrix()
    kind = {"cross": (0.8, 0.0, 0.6)} if last == "universal" else {"last": last}
    ideal = load_case(four_bar(tmp_path, axes={}))
    case = load_case(four_bar(tmp_path, 2.0 * TILT, turn=turn, **kind))
    assert degrees_of_freedom(case.mechanism) == 1
    found, expected = (solve(each.mechanism, "turn", SWEPT) for each in (case, ideal))
    assert found.solved.all()
    off = found.points["tip"].position - expected.points["tip"].position @ turn.T
    assert np.abs(off).max() < 10.0 * TILT
    (note,) = case.assembly
    assert "[closure] tolerance" in note
    assert f"joint '{'c' if last == 'universal' else 'd'}'" in note
    assert 1e-8 < float(note.rsplit(" m", 1)[0].split()[-1]) <= 2.0 * TILT


def test_tilted_loop_without_tolerance_is_refused(tmp_path, capsys):
    file = four_bar(tmp_path)
    assert load_case(file).assembly == ()
    assert main(["run", str(file), "--engine", "native"]) == 2
    assert "0 degrees of freedom" in capsys.readouterr().err


def test_closure_option_overrides_file(tmp_path):
    file = four_bar(tmp_path, 1e-9)
    assert load(file).assembly == ()
    assert "--closure" in load(file, Supplied(closure=TILT)).assembly[0]


def test_closure_tolerance_in_all_engines(tmp_path, capsys):
    assert main(["run", str(four_bar(tmp_path, TILT)), "--jobs", "0"]) == 0, capsys.readouterr()


@pytest.mark.parametrize(("tolerance", "closes"), [(1e-3, True), (1e-8, False)])
def test_closure_tolerance_in_unit_of_file(tmp_path, tolerance, closes):
    file = four_bar(tmp_path, tolerance, units={"length": "mm"})
    assert bool(load_case(file).assembly) is closes


@pytest.mark.parametrize("value", [0, -1e-6, "small", float("nan")])
def test_closure_tolerance_out_of_range(tmp_path, value):
    complains(four_bar(tmp_path, value), "tolerance")


@pytest.mark.parametrize("joint", BODIES)
def test_closure_tolerance_with_any_driven_joint(tmp_path, joint):
    drivers = {"turn": {"type": "joint_angle", "joint": joint}}
    case = load_case(four_bar(tmp_path, TILT, drivers=drivers))
    assert case.assembly
    assert degrees_of_freedom(case.mechanism) == 1


def test_closure_rows_violated_along_motion(tmp_path):
    """A hinge that is tilted by a hundredth opens by as much as it turns."""
    file = four_bar(tmp_path, 1e-3, {"a": (0.01, 1.0, 0.0)})
    complains(file, "closure: rows of  ... along the motion they are off by up to 0.0")
