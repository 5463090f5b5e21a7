"""Robots whose motors and limits say what moves, run without --drive."""

from pathlib import Path

import numpy as np
import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.io.readers import LEFT_OUT
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError

from ...support.examples import examples
from ...support.model_files import driven

(GRIPPER,) = examples(__file__, "gripper")

JOINT = """<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/>
<origin xyz="1 0 0"/><axis xyz="0 0 1"/><limit lower="-0.5" upper="{3}" effort="1" velocity="1"/>
</joint>"""
MOTOR = '<transmission name="{0} drive"><joint name="{0}"/><actuator name="{0} m"/></transmission>'


def arm(folder: Path, *motors: str, upper: str = "1") -> Path:
    links = "".join(f'<link name="{name}"/>' for name in ("base", "upper", "fore"))
    joints = JOINT.format("shoulder", "base", "upper", upper)
    joints += JOINT.format("elbow", "upper", "fore", "0.25")
    (file := folder / "arm.urdf").write_text(
        f"<robot name='arm'>{links}{joints}{''.join(map(MOTOR.format, motors))}</robot>"
    )
    return file


def test_motors_move_through_their_limits(tmp_path):
    case = load(arm(tmp_path, "shoulder", "elbow"))
    assert case.sweep.driver == "shoulder"
    assert [case.sweep.values[0], case.sweep.values[-1]] == [-0.5, 1.0]
    assert np.ptp(case.sweep.path.motions["elbow"].at(case.sweep.path.times)[0]) == 0.75
    assert any("shoulder, elbow move through their limits" in note for note in case.assembly)


def test_note_of_one_motor(tmp_path):
    note = "elbow moves through its limits"
    file = tmp_path / "arm.urdf"
    text = arm(tmp_path, "shoulder", "elbow").read_text()
    file.write_text(text.replace('name="shoulder" type="revolute"', 'name="shoulder" type="fixed"'))
    assert any(note in each for each in load(file).assembly)


def test_ros2_control_commands_are_motors(tmp_path):
    file = arm(tmp_path, "elbow")
    commanded = '<joint name="shoulder"><command_interface name="position"/></joint>'
    file.write_text(
        file.read_text().replace(
            "</robot>",
            f"<ros2_control>{commanded}"
            '<joint name="elbow"><state_interface name="position"/></joint></ros2_control></robot>',
        )
    )
    assert [*load(file).sweep.path.motions] == ["shoulder", "elbow"]


def test_motor_of_tendon_moves_its_joints(tmp_path):
    coupling = '<equality><joint joint1="left" joint2="right"/></equality>'
    (file := tmp_path / "gripper.xml").write_text(GRIPPER.replace("COUPLING", coupling))
    assert load(file).sweep.driver == "right"
    file.write_text(GRIPPER.replace("COUPLING", ""))
    with pytest.raises(CaseError, match=r"drives it: its motors, of right, move 1 of them"):
        load(file)


@pytest.mark.parametrize(
    ("motors", "upper", "why"),
    [
        ((), "1", "the file marks no motors"),
        (("shoulder",), "1", "its motors, of shoulder, move 1 of them"),
        (("elbow", "shoulder"), "-1", "its motors, of shoulder, elbow, have no limits at shoulder"),
    ],
)
def test_unused_motors_give_reason(motors, upper, why, tmp_path):
    with pytest.raises(CaseError, match=rf"nothing says what drives it: {why}. Say"):
        load(arm(tmp_path, *motors, upper=upper))


def test_motor_held_by_rest_is_offered(tmp_path):
    with pytest.raises(CaseError, match=r"of shoulder, elbow, do without --hold-rest. Say"):
        load(arm(tmp_path, "shoulder", "elbow"), Supplied(hold_rest=True))


WIPER = """<mujoco><worldbody>
<body name="arm"><joint name="motor" range="-180 180"/></body></worldbody>
<actuator><motor joint="motor"/><position tendon="none"/></actuator>
<keyframe><key name="up" qpos="1"/><key name="down" qpos="0"/></keyframe></mujoco>"""


def test_motor_in_parent_drives_its_joint(tmp_path):
    text = WIPER.replace('<motor joint="motor"/>', '<motor jointinparent="motor"/>')
    (file := tmp_path / "wiper.xml").write_text(text)
    assert load(file).sweep.driver == "motor"


def test_used_motors_are_not_left_out(tmp_path):
    (file := tmp_path / "wiper.xml").write_text(WIPER)
    case = load(file, Supplied(start=("keyframe:up",)))
    assert case.source.split(LEFT_OUT)[1] == "actuator: position (1), keyframe: key (1)"
    assert any("joint motor moves through its limits" in note for note in case.assembly)
    assert load(arm(tmp_path, "shoulder", "elbow")).source.endswith(f"{LEFT_OUT}nothing")
    source = load(file, driven("motor:0:1")).source
    assert {"ranges of joints (1)", "actuator: motor (1)"} < {
        *source.split(LEFT_OUT)[1].split(", ")
    }


def test_locked_joint_named_like_link(tmp_path):
    (file := tmp_path / "arm.xml").write_text(
        '<mujoco><worldbody><body name="upper"><joint name="arm"/><body name="arm" pos="1 0 0">'
        '<joint name="elbow" axis="0 1 0"/></body></body></worldbody>'
        '<equality><joint joint1="arm" polycoef="0 0"/></equality></mujoco>'
    )
    with pytest.raises(CaseError, match="found 'arm', which an equality of the file locks"):
        load(file, driven("arm:0:1", hold=("elbow",)))
