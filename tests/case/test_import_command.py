"""What `kincheck import` writes: a case file that reads as the same case, whatever was read."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kincheck import cases
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.errors import CaseError
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table

from ..support.case_texts import complains, refused, write
from ..support.model_poses import solution
from ..support.written_again import written_again

GRIPPER = Path(__file__).parents[1] / "data" / "mjcf" / "robotiq_2f85.xml"
CLOSING = Supplied(
    drive=("right_driver_joint:0:0.8:17",),
    hold=("right_spring_link_joint", "left_spring_link_joint"),
)
QUANTITIES = ("position", "velocity", "acceleration")


@pytest.mark.by_day(3)
@pytest.mark.parametrize("name", cases.names())
def test_built_in_case_round_trip(name, tmp_path):
    """Their references too, whose rows are exact."""
    case = cases.load(name)
    again = written_again(case, tmp_path)
    assert again.truth is case.truth
    assert again.reference.keys() == case.reference.keys()
    for output, series in case.reference.items():
        for quantity in QUANTITIES:
            there, here = (getattr(each.reference[output], quantity) for each in (case, again))
            np.testing.assert_equal(there, here)
        assert again.reference[output].uncertainty == {} == series.uncertainty


@pytest.mark.parametrize("template", TEMPLATES)
@pytest.mark.parametrize("axle", [None, "steer"])
def test_hardpoint_table_round_trip(template, axle, tmp_path):
    file = tmp_path / "car.csv"
    file.write_text(sample_table(TEMPLATES[template]))
    try:
        case = load(file, Supplied(travel="0.02:5", axle=axle))
    except CaseError as error:
        assert axle is not None
        pytest.skip(f"no such axle: {error}")
    written_again(case, tmp_path)


def test_imported_model_moves_alike(tmp_path):
    case = load(GRIPPER, CLOSING)
    there, here = solution(case), solution(written_again(case, tmp_path))
    assert here.solved.all()
    for name, motion in there.bodies.items():
        assert np.array_equal(motion.r, here.bodies[name].r)
        assert np.array_equal(motion.p, here.bodies[name].p)


REFERRED = """<mujoco><compiler angle="radian"/><worldbody><body name="arm" euler="0.1 0.2 0.3">
<joint name="hinge" axis="1 2 2" ref="0.4"/></body></worldbody></mujoco>"""


DRIVEN = Supplied(drive=("hinge:0:1:5",))


@pytest.fixture
def model(tmp_path):
    return write(tmp_path, REFERRED, "model.xml")


def test_imported_joint_values_start_at_zero(model, tmp_path):
    """A joint of a case file is zero at design, where the model's has its own reference."""
    case = load(model, DRIVEN)
    assert case.sweep.design == 0.4
    again = written_again(case, tmp_path)
    assert (again.sweep.values[0], again.sweep.values[-1]) == (-0.4, 0.6)
    found = [solution(each).bodies["arm"].p for each in (case, again)]
    assert np.abs(found[0] - found[1]).max() < 1e-15


def crank(tmp_path, *more):
    """Return the case of a file with more lines at its end."""
    return load_case(write(tmp_path, "\n".join([CRANK, *more])))


CRANK = """schema = "kincheck-case/1"
name = "crank"
source = "made up for this test"
truth = "closed_form"
[bodies.arm]
[joints.hinge]
type = "revolute"
bodies = ["ground", "arm"]
point = [0.0, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]
[points.tip]
body = "arm"
position = [1.0, 0.0, 0.0]
[drivers.turn]
type = "joint_angle"
joint = "hinge"
[outputs.x]
point = "tip"
component = "x"
"""
ROWS = "rows = [[0.0, 1.0], [0.1, 0.9950041652780258], [0.25, 0.9689124217106447]]"
EVEN = '[sweep]\ndriver = "turn"\nstart = 0.0\nstop = 0.25\nsteps = 3\n'


def test_import_keeps_sweep_at_reference(tmp_path):
    case = crank(tmp_path, '[sweep]\ndriver = "turn"\nat = "reference"', "[reference]", ROWS)
    again = written_again(case, tmp_path)
    assert np.array_equal(again.reference["x"].position, case.reference["x"].position)
    assert 'at = "reference"' in case_text(case)
    bare = replace(case, reference={}, origin=None)
    refused(lambda: case_text(bare), "no even grid ... ; give an even one")


def test_import_omits_reference_with_uncertainties(tmp_path):
    rows = [[0.1 * k, float(f"{np.cos(0.1 * k):.6f}")] for k in range(6)]
    case = crank(tmp_path, EVEN, "[reference]", f"rows = {rows}")
    assert case.reference["x"].uncertainty
    text = case_text(case)
    assert text.startswith("# The reference is left out, because its values have uncertainties")
    assert "reference" not in tomllib.loads(text)


def test_import_keeps_closure_notes(tmp_path):
    case = crank(tmp_path, EVEN, '[closure]\nnotes = ["the start was open by 1e-7 m"]')
    assert case.assembly == ("the start was open by 1e-7 m",)
    written_again(case, tmp_path)


def test_import_refuses_too_long_texts(tmp_path):
    file = write(tmp_path, REFERRED.replace('"arm"', f'"{201 * "a"}"'), "model.xml")
    case = load(file, DRIVEN)
    refused(lambda: case_text(case), "found 201 characters, expected 1 to 200 ... ; rename it")
    case, cut = crank(tmp_path, EVEN), f"{9_994 * 's'} [...]"
    for source, kept in ((10_000 * "s",) * 2, (10_001 * "s", cut), (20_000 * "s", cut)):
        text = case_text(replace(case, source=source))
        assert load_case(write(tmp_path, text)).source == kept
    file = write(tmp_path, text.replace("ss [...]", "sss [...]"))
    complains(file, "found a text of 10001 characters, expected 10000 at most")


def test_import_command_writes_case(model, tmp_path, capsys):
    out = tmp_path / "case.toml"
    drive = ["--drive", "hinge:0:1:5"]
    assert main(["import", str(model), *drive]) == 0
    printed = capsys.readouterr()
    assert printed.out.startswith(
        "#:schema kincheck-case.schema.json\n# Written by kincheck import from model.xml.\nschema ="
    )
    assert "left out: nothing" in printed.err
    assert main(["import", *drive, "--out", str(out), str(model)]) == 0
    assert capsys.readouterr().out == ""
    assert out.read_text() == printed.out
    assert solution(load_case(out)).solved.all()


def test_import_command_takes_one_file(model, tmp_path, capsys):
    assert main(["import"]) == 2
    assert "found 0 files, expected one" in capsys.readouterr().err
    assert main(["import", str(model), "--out", str(tmp_path)]) == 2
    assert "--out" in capsys.readouterr().err
    # --hold takes several names, and gives the file back
    assert main(["import", "--hold", "shin", str(model)]) == 2
    assert "found 'shin', expected a joint" in capsys.readouterr().err
