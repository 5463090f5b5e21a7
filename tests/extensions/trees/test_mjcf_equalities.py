"""Equalities of MJCF models close what MuJoCo says they do."""

import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError

from ...support.examples import examples
from ...support.mjcf_models import agree, closes_in_mujoco, model
from ...support.model_files import driven

(EQUALITIES,) = examples(__file__, "equalities")


# A crank with a slide on it, whose end rides on the ground; the equality under test closes it.
def linkage(equality, more=""):
    return f"""
    <mujoco><compiler angle="degree" eulerseq="zyx"/>
      <worldbody>
        <site name="ground" pos="1.2 0 0.5"/>
        <body name="crank"><joint name="crank" axis="0 1 0" ref="30"/><site name="pin" pos="0.5 0 0.4"/>
          <body name="rod" pos="0.5 0 0.4" euler="0 20 0"><joint name="pivot" axis="0 1 0"/>
            <body name="end" pos="0.8 0 0"><joint name="reach" type="slide" axis="1 0 0"/><site name="tip" pos="0.1 0 0"/></body>
          </body>
        </body>
        <body name="lever" pos="1.4 0 0.2"><joint name="lever" axis="0 1 0"/><joint name="out" type="slide" axis="0 0 1"/>
          <site name="side" pos="0 0 0.5"/></body>
        <body name="cross" pos="2 0 0"><joint name="cross_1" axis="1 0 0"/><joint name="cross_2" axis="0 1 0"/></body>
      </worldbody>
      <tendon><fixed name="sum"><joint joint="crank" coef="2"/><joint joint="lever" coef="-0.5"/></fixed>
        <spatial name="length"><site site="pin"/><site site="side"/></spatial>
        <fixed name="one"><joint joint="lever" coef="3"/></fixed>
        <fixed name="three"><joint joint="crank" coef="2"/><joint joint="lever" coef="-0.5"/><joint joint="out" coef="1.5"/></fixed>
        <fixed name="both"><joint joint="reach" coef="3"/><joint joint="out" coef="0.5"/></fixed></tendon>
      <equality>{equality}</equality>{more}
    </mujoco>"""  # noqa: E501


EVERYTHING = ("crank", "pivot", "reach", "lever", "out", "cross_1", "cross_2")


@pytest.mark.by_day(3)
@pytest.mark.parametrize("kind", EQUALITIES)
def test_equality_closes_as_in_mujoco(tmp_path, kind):
    """Each closes what it says: driven joints and residuals in MuJoCo."""
    equality, closed = EQUALITIES[kind]
    file = model(tmp_path, linkage(equality))
    swept = "reach" if kind in ("hinge by slide", "two slides", "tendon of slides") else "crank"
    values = ":0.02:0.15:5" if swept == "reach" else ":0.45:0.75:5"
    hold = tuple(name for name in EVERYTHING if name not in (*closed.split(), swept))
    closes_in_mujoco(file, Supplied(drive=(swept + values,), hold=hold))


BLOCK = """<body name="block" pos="0.4 0 0.4" quat="1 0 1 0"><joint name="x" type="slide" axis="0 0 1"/>
    <joint name="z" type="slide" axis="1 0 0"/><site name="hub" pos="0 0 0.1" euler="0 0 50"/></body><body name="lever\""""  # noqa: E501


@pytest.mark.parametrize("kind", ["connect", "weld"])
def test_equality_between_sites(tmp_path, kind):
    """Sites that coincide at qpos0: the block follows the crank's pin, or it locks it."""
    text = linkage(f'<{kind} site1="pin" site2="hub"/>').replace('<body name="lever"', BLOCK)
    if kind == "weld":
        text = text.replace(
            '<site name="pin" pos="0.5 0 0.4"/>',
            '<site name="pin" pos="0.5 0 0.4" quat="1 0 1 0"/>',
        )
        text = text.replace(' euler="0 0 50"', "").replace(
            'name="x" type="slide" axis="0 0 1"',
            'name="x" type="hinge" axis="0 1 0" pos="0.4 0 -0.4"',
        )
    file = model(tmp_path, text)
    closes_in_mujoco(file, driven("crank:0.5:0.8:4", hold=EVERYTHING[1:]))


def test_name_of_body_between_two_joints(tmp_path):
    """The body between two joints of one body has a name that none of the file has."""
    text = """
    <mujoco><worldbody>
      <body name="arm"><joint name="x" type="slide"/><joint name="y" axis="0 1 0"/></body>
      <body name="arm.x"><joint name="z" axis="1 0 0"/></body><body name="arm.x'"></body>
    </worldbody></mujoco>"""
    tree = agree(model(tmp_path, text))
    assert list(tree.moving) == ["arm.x'2", "arm", "arm.x"]
    assert tree.joints["z"].inner == "arm.x"
    with pytest.raises(CaseError, match="the model has 3 degrees of freedom"):
        load(model(tmp_path, text), driven("y:0:1", hold=("x",)))


def test_inactive_equality_is_left_out(tmp_path):
    gear = '<joint joint1="lever" joint2="crank" active="false"/>'
    for text in (
        linkage(gear),
        linkage(gear.replace("false", "true"), '<option><flag equality="disable"/></option>'),
    ):
        case = load(model(tmp_path, text), driven("crank:0.5:0.6", hold=EVERYTHING[1:]))
        assert case.mechanism.couplers == ()
        assert "equalities that are not active (1)" in case.source


ROD = """
    <mujoco><compiler angle="radian"/><worldbody>
      <body name="frame" pos="0 0 1"><freejoint/>
        <body name="crank" pos="0 0 0.5"><joint name="crank" axis="0 0 1"/>
          <body name="rod" pos="0.2 0 0"><joint name="ball" type="ball"/></body></body>
        <body name="slider" pos="1 0 0"><joint name="slider" type="slide" axis="1 0.1 0"/></body>
      </body>
    </worldbody><equality><connect body1="rod" body2="slider" anchor="0.8 0.1 -0.4"/></equality></mujoco>"""  # noqa: E501


def test_rod_spin_is_left_out(tmp_path):
    """Its turn about itself, which nothing can drive, is left out; a free body can be held."""
    file = model(tmp_path, ROD)
    case = load(file, supplied := driven("crank:0.2:0.9:6", hold=("frame",)))
    assert case.mechanism.joint("ball").type == "distance"
    assert "body 'rod' and its turn about itself" in case.source
    closes_in_mujoco(file, supplied)
