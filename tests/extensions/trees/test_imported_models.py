"""What `kincheck import` writes of a model of a robot: a case that moves alike."""

import numpy as np
import pytest
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main

from ...support.case_texts import refused, write
from ...support.model_files import DRIVEN as CLOSED
from ...support.model_files import GRIPPER
from ...support.model_poses import solution
from ...support.written_again import written_again


def test_imported_model_moves_alike(tmp_path):
    case = load(GRIPPER, CLOSED)
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


def test_import_refuses_too_long_names(tmp_path):
    file = write(tmp_path, REFERRED.replace('"arm"', f'"{201 * "a"}"'), "model.xml")
    case = load(file, DRIVEN)
    refused(lambda: case_text(case), "found 201 characters, expected 1 to 200 ... ; rename it")
