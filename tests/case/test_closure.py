"""Cases within the digits of their files: rows that are redundant but for digits are left out."""

import numpy as np
import pytest
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.errors import CaseError
from kincheck.core.kinematics import degrees_of_freedom, solve

HEAD = """schema = "kincheck-case/1"
name = "loop"
source = "made up"
[sweep]
driver = "turn"
start = -3.0
stop = 3.0
steps = 61
[drivers.turn]
type = "joint_angle"
joint = "o"
"""
A, B = (0.3108049841353322, 0.3916634548137417, 0.0), (1.4857380145900183, 0.6356560242632388, 0.0)
PLACES = {"o": (0.0, 0.0, 0.0), "a": A, "b": B, "g": (1.0, 0.0, 0.0)}
BODIES = {"o": ("ground", "crank"), "a": ("crank", "rod"), "b": ("rod", "rocker")}
BODIES["g"] = ("ground", "rocker")
TILT = 1e-6


def four_bar(tmp_path, tail="", turn=None, **kinds):
    """The four-bar of four hinges, one of them tilted, all turned as a whole; as a file."""
    turn = np.eye(3) if turn is None else turn
    text = HEAD + tail
    text += "".join(f"[bodies.{name}]\n" for name in ("crank", "rod", "rocker"))
    for name, place in PLACES.items():
        axis = turn @ np.array([TILT if name == "o" else 0.0, 0.0, 1.0])
        point = (turn @ np.array(place)).tolist()
        kind = kinds.get(name, "revolute")
        text += f'[joints.{name}]\ntype = "{kind}"\nbodies = {[*BODIES[name]]}\npoint = {point}\n'
        if kind == "universal":
            axes = [axis.tolist(), (turn @ np.array([0.6, 0.8, 0.0])).tolist()]
            text += f"axes = {axes}\n"
        elif kind != "spherical":
            text += f"axis = {axis.tolist()}\n"
    text += f'[points.B]\nbody = "rocker"\nposition = {(turn @ np.array(B)).tolist()}\n'
    file = tmp_path / "loop.toml"
    file.write_text(text)
    return file


def rocker_end(angles):
    """The end of the rocker of the ideal linkage by intersecting two circles, shape (n, 3)."""
    turn = np.arctan2(A[1], A[0]) + angles
    a = np.hypot(*A[:2]) * np.column_stack([np.cos(turn), np.sin(turn)])
    rod, rocker = np.hypot(B[0] - A[0], B[1] - A[1]), np.hypot(B[0] - 1.0, B[1])
    d = np.array([1.0, 0.0]) - a
    c = np.linalg.norm(d, axis=1)
    along = (rod**2 - rocker**2 + c**2) / (2.0 * c)
    across = np.sqrt(rod**2 - along**2)
    normal = np.column_stack([-d[:, 1], d[:, 0]]) / c[:, None]
    found = a + along[:, None] * d / c[:, None] + across[:, None] * normal
    return np.column_stack([found, np.zeros(len(angles))])


def turned(angles=(0.3, 1.1, -0.7)):
    """A rotation about all axes."""
    found = np.eye(3)
    for k, angle in enumerate(angles):
        c, s = np.cos(angle), np.sin(angle)
        i, j = (k + 1) % 3, (k + 2) % 3
        one = np.eye(3)
        one[i, i], one[i, j], one[j, i], one[j, j] = c, -s, s, c
        found = one @ found
    return found


@pytest.mark.parametrize("last", ["revolute", "spherical", "cylindrical", "universal"])
@pytest.mark.parametrize("turn", [np.eye(3), turned()], ids=["level", "turned"])
def test_closure_tolerance_moves_like_ideal_loop(tmp_path, last, turn):
    file = four_bar(tmp_path, f"[closure]\ntolerance = {TILT}\n", turn, g=last)
    case = load_case(file)
    assert degrees_of_freedom(case.mechanism) == 1
    found = solve(case.mechanism, "turn", case.sweep.values)
    assert found.solved.all()
    ideal = rocker_end(case.sweep.values) @ turn.T
    assert np.abs(found.points["B"].position - ideal).max() < 10.0 * TILT
    (note,) = case.assembly
    assert "[closure] tolerance" in note
    assert "joint 'g'" in note
    assert 1e-8 < float(note.rsplit(" m", 1)[0].split()[-1]) < 10.0 * TILT


def test_tilted_loop_without_tolerance_is_refused(tmp_path, capsys):
    file = four_bar(tmp_path)
    assert load_case(file).assembly == ()
    assert main(["run", str(file), "--engine", "native"]) == 2
    assert "0 degrees of freedom" in capsys.readouterr().err


def test_closure_option_overrides_file(tmp_path):
    file = four_bar(tmp_path, "[closure]\ntolerance = 1e-9\n")
    assert load(file).assembly == ()
    assert "--closure" in load(file, Supplied(closure=TILT)).assembly[0]


def test_closure_tolerance_in_all_engines(tmp_path, capsys):
    file = four_bar(tmp_path, "[closure]\ntolerance = 1e-6\n")
    assert main(["run", str(file), "--jobs", "0"]) == 0, capsys.readouterr()


def test_closure_tolerance_in_unit_of_file(tmp_path):
    file = four_bar(tmp_path, '[closure]\ntolerance = 1e-3\n[units]\nlength = "mm"\n')
    assert load_case(file).assembly
    file.write_text(file.read_text().replace("tolerance = 1e-3", "tolerance = 1e-8"))
    assert not load_case(file).assembly


@pytest.mark.parametrize("value", ["0", "-1e-6", '"small"', "nan"])
def test_closure_tolerance_out_of_range(tmp_path, value):
    with pytest.raises(CaseError, match="tolerance"):
        load_case(four_bar(tmp_path, f"[closure]\ntolerance = {value}\n"))


def test_closure_tolerance_with_any_driven_joint(tmp_path):
    file = four_bar(tmp_path, "[closure]\ntolerance = 1e-6\n")
    text = file.read_text()
    for joint in PLACES:
        file.write_text(text.replace('joint = "o"', f'joint = "{joint}"'))
        case = load_case(file)
        assert case.assembly, joint
        assert degrees_of_freedom(case.mechanism) == 1, joint


def test_closure_rows_violated_along_motion(tmp_path):
    """A hinge that is tilted by a hundredth opens by as much as it turns."""
    file = four_bar(tmp_path, "[closure]\ntolerance = 2e-3\n")
    file.write_text(file.read_text().replace("[1e-06, 0.0, 1.0]", "[0.01, 0.0, 1.0]"))
    with pytest.raises(CaseError, match=r"along the motion they are off by up to 0\.0") as refused:
        load_case(file)
    assert str(refused.value).startswith(f"{file}: closure: rows of ")
