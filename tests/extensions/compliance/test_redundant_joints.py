"""Reactions of redundant joints in kc: determined ones equal statics by hand, others are named by
their joint with the reason.
"""

import json

import numpy as np
import pytest
from kincheck.core.case.io.case_file import load_case
from kincheck.core.cli.main import main
from kincheck.core.extensions.compliance.study import compliance

from .test_compliance_symmetry import arm_case

BALLS = {"front": 0.5, "rear": 0.1}
AXIS, WHEEL, SPRING = (0.0, 0.3), (-0.4, 0.7), (-0.2, 0.45)
"""x and z of the balls' line; x and y of the wheel's centre and of the spring, both at z = 0.3."""
TOP = 0.8


@pytest.fixture
def file(tmp_path):
    """Trailing arms, the left one on two balls, which share the force along their line."""
    case = json.loads((file := arm_case(tmp_path)).read_text())
    for table in ("joints", "forces", "outputs"):
        for name in [
            name for name in case[table] if name in ("pivot_left", "spring_left", "pivot")
        ]:
            del case[table][name]
    for name, y in BALLS.items():
        case["joints"][name] = {
            "type": "spherical",
            "bodies": ["ground", "arm_left"],
            "point": [AXIS[0], y, AXIS[1]],
        }
        for axis in "xyz":
            case["outputs"][f"{name}_{axis}"] = {
                "type": "joint_force",
                "joint": name,
                "component": axis,
            }
    x, y = SPRING
    case["forces"]["spring_left"] = {
        "type": "spring_damper",
        "bodies": ["ground", "arm_left"],
        "points": [[x, y, TOP], [x, y, AXIS[1]]],
        "stiffness": 9000.0,
        "free_length": 0.55,
    }
    case["outputs"]["spring"] = {"type": "element_force", "force": "spring_left"}
    case["outputs"]["along_arm"] = {
        "type": "joint_force",
        "joint": "front",
        "component": "x",
        "frame": "body",
    }
    file.write_text(json.dumps(case))
    return file


def by_hand(travel, effort, spring):
    """Forces x and z of the balls on the arm [N], by balance of forces and of moments."""
    sine = travel / 0.4
    x = SPRING[0] * np.sqrt(1.0 - sine**2)
    end = np.stack([x, AXIS[1] - SPRING[0] * sine])
    pull = spring * (np.array([[SPRING[0]], [TOP]]) - end)
    pull /= np.hypot(*(np.array([[SPRING[0]], [TOP]]) - end))
    lift = np.stack([0.0 * effort, effort])
    far, near = BALLS["front"], BALLS["rear"]
    moment = SPRING[1] * pull + WHEEL[1] * lift
    front = -(moment - near * (pull + lift)) / (far - near)
    return {"front": front, "rear": -(pull + lift) - front}


def test_determined_reactions_equal_statics(file):
    found = compliance(load_case(file), [-0.05, 0.0, 0.04]).travel
    values = {name: each.values for name, each in found.outputs.items()}
    truth = by_hand(found.at, found.wheel_load, values["spring"])
    for name, (x, z) in truth.items():
        assert values[f"{name}_x"] == pytest.approx(x, abs=1e-7)
        assert values[f"{name}_z"] == pytest.approx(z, abs=1e-7)
        assert np.isnan(values[f"{name}_y"]).all()
    sine = found.at / 0.4
    along = np.sqrt(1.0 - sine**2) * truth["front"][0] - sine * truth["front"][1]
    assert values["along_arm"] == pytest.approx(along, abs=1e-7)
    assert found.not_computed.keys() == {"front_y", "rear_y"}


def test_undetermined_reactions_are_named(file, capsys):
    assert main(["kc", str(file), "--travel=-10mm:10mm:3"]) == 0
    printed = capsys.readouterr().out
    for name in BALLS:
        said = (
            f"not computed: {name}_y: joint '{name}': rigid bodies do not determine it at 3 samples"
        )
        assert f"{said}: redundant rows leave 2 of 3 directions of the joint's force" in printed
