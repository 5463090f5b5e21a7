"""MJCF models: the mechanism that is read moves as MuJoCo, which has loaded the model itself, says
it may.
"""

import pytest
from kincheck.core.case.case import Truth
from kincheck.core.case.io.readers import LEFT_OUT
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.extensions.exports.command import keep_texts

from ...support.examples import examples
from ...support.mjcf_models import agree, closes_in_mujoco, model
from ...support.model_files import DRIVEN, GRIPPER, SPRINGS

(ORIENTATIONS,) = examples(__file__, "orientations")


def test_gripper_closes_in_mujoco():
    """A published model: two five-bars, closed by connects and geared, over the stroke that its
    file gives.
    """
    case = load(GRIPPER, DRIVEN)
    assert case.truth is Truth.CONSENSUS_ONLY
    assert {point.name for point in case.mechanism.points} >= {
        "right_follower",
        "left_pad",
        "right_pad",
    }
    closes_in_mujoco(GRIPPER, DRIVEN)


def test_left_out_elements_are_listed():
    listed = load(GRIPPER, DRIVEN).source.split(LEFT_OUT)[1].split(", ")
    lost = "ranges of joints (8)", "armature of joints (2)"
    assert {*lost, "tendon: fixed (1)", "actuator: general (1)"} <= {*listed}


@pytest.mark.parametrize("angle", ["degree", "radian"])
@pytest.mark.parametrize("sequence", ["xyz", "zyx", "XYZ", "zXy"])
@pytest.mark.parametrize("orientation", ORIENTATIONS.values(), ids=ORIENTATIONS)
def test_orientations_match_mujoco(tmp_path, orientation, sequence, angle):
    text = f"""
    <mujoco><compiler angle="{angle}" eulerseq="{sequence}"/><worldbody>
      <body name="a" pos="0.1 0.2 0.3" {orientation}><joint name="j" axis="1 2 2" pos="0.3 0 0.1" ref="0.4"/>
        <frame pos="0 0.1 0" {orientation}>
          <body name="b" pos="0.2 0 -0.1" {orientation}><joint name="k" type="slide" axis="0 1 1" ref="0.2"/>
          <site name="s" pos="0.1 0 0" {orientation}/></body>
        </frame>
      </body>
    </worldbody></mujoco>"""  # noqa: E501
    agree(model(tmp_path, text))


def test_default_classes_match_mujoco(tmp_path):
    """A joint takes what it lacks from its class, from the class of the body around it, or from the
    outermost class.
    """
    text = """
    <mujoco>
      <default class="main"><joint axis="0 1 0" pos="0 0 0.1"/>
        <default class="outer"><joint axis="1 0 0" type="slide"/>
          <default class="inner"><joint pos="0.2 0 0"/><site euler="0 30 0"/></default>
          <site quat="1 2 3 4"/>
        </default>
      </default>
      <worldbody>
        <body name="main"><joint name="main"/></body>
        <body name="by_body" childclass="outer"><joint name="by_body"/>
          <body name="part" pos="0 0 1"><site name="tip" pos="0.1 0 0"/>
            <site name="turned" zaxis="1 2 0"/><site name="inner" class="inner"/>
            <body name="own" pos="0 1 0"><joint name="own" class="inner" type="hinge"/><joint name="again"/>
              <body name="ball" childclass="inner"><joint name="ball" type="ball"/></body>
            </body>
          </body>
        </body>
      </worldbody>
    </mujoco>"""  # noqa: E501
    tree = agree(model(tmp_path, text))
    kinds = " ".join(joint.kind for joint in tree.joints.values())
    assert kinds == "hinge slide hinge slide ball"
    assert tree.carriers["part"] == "by_body"
    assert tree.sites["tip"][0] == "by_body"
    assert tree.joints["own"].outer == "by_body"
    assert tree.joints["own"].inner == tree.joints["again"].outer == "own.own"
    assert tree.massless == {"own.own"}


def test_model_name_with_path_in_export(tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    keep_texts({".xml": "<mujoco/>"}, "../../out of/here", None)
    assert [file.name for file in (tmp_path / "here").iterdir()] == [".._.._out of_here.xml"]


def test_run_command_with_gripper(capsys):
    options = "run --jobs 0 --engine native mujoco --drive right_driver_joint:0:0.8:5 --hold"
    assert main([*options.split(), *SPRINGS, str(GRIPPER)]) == 0
    out, err = capsys.readouterr()
    assert "1 pass, 1 not judged" in out
    assert "with the masses of its bodies; left out: " in err
