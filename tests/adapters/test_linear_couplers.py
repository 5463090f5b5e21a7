"""Couplers of three joints in every simulator, against the sum that they keep at zero."""

import kincheck
import numpy as np
import pytest
from kincheck import adapters
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.case.io.model_writer import written
from kincheck.core.case.models.undriven import undriven_case, undriven_file
from kincheck.core.errors import MechanismError
from kincheck.core.joints import LinearCoupler
from kincheck.core.studies.same import compare

from ..support.engine_motion import SIMULATORS, installed

# q1 + 0.05/mm q2 - 2 q3 = 0 with q1 = t, q2 = 10 mm sin(pi t): q3 = t / 2 + 0.25 sin(pi t), whose
# couple is -1/2 of that on the first joint; the arm of 2 kg at 0.3 m weighs on the third.
CASE = """schema = "kincheck-case/1"
name = "differential"
source = "made for this test"
truth = "closed_form"
gravity = [0, -10000, 0]
[units]
length = "mm"
[bodies.left]
[bodies.rack]
[bodies.cage]
mass = 2
center_of_mass = [300, 0, 0]
[joints.left]
type = "revolute"
bodies = ["ground", "left"]
point = [0, 0, 0]
axis = [0, 0, 1]
[joints.rack]
type = "translational"
bodies = ["left", "rack"]
point = [0, 0, 0]
axis = [1, 0, 0]
[joints.cage]
type = "revolute"
bodies = ["ground", "cage"]
point = [0, 0, 0]
axis = [0, 0, 1]
[couplers.sum]
type = "linear_coupler"
joints = ["left", "rack", "cage"]
factors = [1, 0.05, -2]
[drivers.left]
type = "joint_angle"
joint = "left"
[drivers.rack]
type = "joint_displacement"
joint = "rack"
[drivers.rack.motion]
type = "sine"
amplitude = 10
frequency = 0.5
[sweep]
driver = "left"
start = 0
stop = 1
steps = 5
[outputs.cage]
type = "joint_angle"
joint = "cage"
[outputs.effort]
type = "driver_effort"
driver = "left"
[reference]
columns = ["left", "cage", "cage.velocity", "cage.acceleration", "effort"]
rows = [
ROWS
]
citation = "the sum"
"""


def differential(folder):
    t = np.linspace(0.0, 1.0, 5)
    turn = 0.5 * t + 0.25 * np.sin(np.pi * t)
    rate = 0.5 + 0.25 * np.pi * np.cos(np.pi * t)
    curvature = -0.25 * np.pi**2 * np.sin(np.pi * t)
    # a torque on the cage of I a + m g x [N mm], of which the first joint has half
    effort = 500.0 * (2.0 * 0.3**2 * curvature + 2.0 * 10.0 * 0.3 * np.cos(turn))
    rows = np.stack([t, turn, rate, curvature, effort], axis=1)
    text = CASE.replace("ROWS", ",\n".join(str(row) for row in rows.tolist()))
    (file := folder / "differential.toml").write_text(text)
    return load_case(file)


@pytest.mark.parametrize("engine", ["native", *SIMULATORS])
def test_three_coupled_joints_keep_their_sum(engine, tmp_path):
    case = differential(tmp_path)
    if engine != "native":
        installed(engine)
    (found,) = kincheck.run(case, engine).records
    assert found.outcome.value == "pass", found


def test_linear_coupler_is_written_and_read_again(tmp_path):
    case = differential(tmp_path)
    (file := tmp_path / "again.toml").write_text(case_text(case))
    assert load_case(file).mechanism.couplers == case.mechanism.couplers
    for form in ("mjcf", "urdf"):
        for suffix, text in written(case, adapters.writer(form), None).items():
            (tmp_path / f"written_{form}{suffix}").write_text(text)
    for name in ("written_mjcf.xml", "written_urdf.urdf"):
        same = compare(undriven_case(case, "case"), undriven_file(tmp_path / name), {})
        assert same.verdict == "same", same.reason
        assert same.largest < 1e-14


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ((("a", "b", "a"), (1.0, 1.0, 1.0)), "couples 'a' with itself"),
        ((("a", "b", "c"), (1.0, 1.0)), "found 2, expected 3"),
        ((("a", "b", "c"), (1.0, 0.0, 1.0)), "would lock or lose a joint"),
        ((("a",), (1.0,)), "two names or more"),
    ],
)
def test_linear_coupler_without_sense_is_refused(given, said):
    with pytest.raises(MechanismError, match=said):
        LinearCoupler("sum", *given)
