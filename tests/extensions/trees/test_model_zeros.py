"""Coordinates of models whose zero is not their start: outputs from both, and what says which."""

import csv
import xml.etree.ElementTree as ET
from functools import partial

import numpy as np
import pytest
from kincheck.core.cli.main import main

# Euler's and the native equations agree to round-off; numbers of files are decimal.
EXACT = 1e-12
near = partial(np.allclose, rtol=0, atol=EXACT)
LOOP = """<mujoco model="loop"><compiler angle="degree"/><worldbody>
<body name="crank"><joint name="crank" axis="0 0 1" ref="40"/><geom size=".01"/>
 <body name="rod" pos=".1 0 0"><joint name="pin" axis="0 0 1" ref="-15"/><geom size=".01"/></body></body>
<body name="rocker" pos=".3 -.05 0"><joint name="rocker" axis="0 0 1" ref="435"/><geom size=".01"/>
</body></worldbody><equality><connect body1="rod" body2="rocker" anchor=".25 .1 0"/></equality>
</mujoco>"""  # noqa: E501


def curves(model, *options):
    """The heads of a run's CSV file, and its rows by output."""
    out = model.with_suffix(".csv")
    # no reference, so that nothing is judged
    assert main(["run", str(model), "--engine", "native", "--csv", str(out), *options]) == 2
    with out.open(encoding="utf-8") as file:
        rows = [*csv.DictReader(file)]
    found = {}
    for row in rows:
        found.setdefault(row["output"], []).append(row)
    return [*rows[0]], found


def numbers(rows, key="position"):
    return np.array([float(row[key]) for row in rows])


@pytest.fixture
def model(tmp_path):
    (file := tmp_path / "loop.xml").write_text(LOOP)
    return file


DRIVE = ("--drive", "crank:0.6:0.8:3")


def test_qpos_outputs_close_loop_in_mujoco(model):
    mujoco = pytest.importorskip("mujoco")
    _, found = curves(model, *DRIVE)
    there = mujoco.MjModel.from_xml_path(str(model))
    data = mujoco.MjData(there)
    joints = "crank", "pin", "rocker"
    for qpos in np.column_stack([numbers(found[f"{name}.qpos"]) for name in joints]):
        data.qpos[:] = qpos
        mujoco.mj_forward(there, data)
        assert np.abs(data.efc_pos[:3]).max() < EXACT
    assert near(numbers(found["crank.qpos"]), [0.6, 0.7, 0.8])
    assert (numbers(found["rocker.qpos"]) > 2 * np.pi).all()


def test_csv_heads_name_zero_of_joints(model, capsys):
    heads, found = curves(model, *DRIVE)
    assert heads[-2:] == ["counts_from", "driver_counts_from"]
    for name, zero in (("crank.angle", "design"), ("crank.qpos", "model"), ("rod.x", "")):
        assert {row["counts_from"] for row in found[name]} == {zero}
    assert {row["driver_counts_from"] for row in found["crank.angle"]} == {"model"}
    assert "JOINT.qpos, --drive and --start count from" in capsys.readouterr().out


def test_imported_case_keeps_zeros_of_model(model, tmp_path, capsys):
    _, before = curves(model, *DRIVE)
    case = tmp_path / "case.toml"
    assert main(["import", str(model), *DRIVE, "--out", str(case)]) == 0
    _, after = curves(case)
    for name in ("crank.qpos", "rocker.qpos", "pin.angle"):
        assert near(numbers(after[name]), numbers(before[name]))
    capsys.readouterr()


def test_value_at_design_in_file_units(tmp_path):
    (file := tmp_path / "slide.toml").write_text("""schema = "kincheck-case/1"
name = "slide"
source = "own"
units = {length = "mm", angle = "deg"}
[bodies.arm]
[joints.pin]
type = "revolute"
bodies = ["ground", "arm"]
point = [0, 0, 0]
axis = [0, 0, 1]
[drivers.turn]
type = "joint_angle"
joint = "pin"
[sweep]
driver = "turn"
start = 0
stop = 450
steps = 4
[outputs.angle]
type = "joint_angle"
joint = "pin"
at_design = 270
""")
    _, found = curves(file)
    assert np.allclose(np.degrees(numbers(found["angle"])), [270, 420, 570, 720], rtol=0, atol=1e-9)


def test_csv_heads_of_model_from_zero(model):
    text = LOOP
    for ref in ("40", "-15", "435"):
        text = text.replace(f' ref="{ref}"', "")
    model.write_text(text)
    heads, found = curves(model, "--drive", "crank:-0.1:0.1:3")
    assert heads[-1] == "acceleration"
    assert not any(name.endswith(".qpos") for name in found)


@pytest.mark.needs("exports", "writers")
def test_exported_mjcf_keeps_zeros_of_model(model, tmp_path, capsys):
    """A spring of the model counts from its zero too."""
    text = LOOP.replace('ref="-15"', 'ref="-15" stiffness="2" springref="10"')
    model.write_text(text)
    out = tmp_path / "again.xml"
    assert main(["export", str(model), *DRIVE, "--to", "mjcf", "--out", str(out)]) == 0
    assert main(["same", str(model), str(out)]) == 0
    assert "zero of" not in capsys.readouterr().out
    (pin,) = (each for each in ET.parse(out).iter("joint") if each.get("name") == "pin")
    assert float(pin.get("ref")) == pytest.approx(np.radians(-15), abs=EXACT)
    assert float(pin.get("springref")) == pytest.approx(np.radians(10), abs=EXACT)


@pytest.mark.needs("exports", "writers")
@pytest.mark.parametrize("to", ["urdf", "sdf", "exudyn"])
def test_exports_note_zero_of_case(to, model, tmp_path):
    out = tmp_path / "again"
    assert main(["export", str(model), *DRIVE, "--to", to, "--out", str(out)]) == 0
    (text,) = (each.read_text() for each in tmp_path.iterdir() if each.name == "again")
    assert "those of the case are crank rotation 0.698131700798, pin rotation -0.26" in text
