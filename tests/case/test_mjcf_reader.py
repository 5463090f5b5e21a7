"""MJCF models: the mechanism that is read moves as MuJoCo, which has loaded the model itself, says
it may.
"""

from pathlib import Path

import numpy as np
import pytest
from kincheck.core.algebra import Quat, X, Y, Z, vec
from kincheck.core.case.case import Truth
from kincheck.core.case.io.reader_options import LEFT_OUT, Supplied
from kincheck.core.case.models.files import load
from kincheck.core.case.models.mjcf.classes import read_classes
from kincheck.core.case.models.mjcf.elements import parse_xml
from kincheck.core.case.models.mjcf.frames import read_compiler
from kincheck.core.case.models.mjcf.tree import read_tree
from kincheck.core.cli.export import keep_texts
from kincheck.core.cli.main import main
from kincheck.core.errors import CaseError

from ..support.model_poses import mujoco_errors, solution

mujoco = pytest.importorskip("mujoco")

GRIPPER = Path(__file__).parents[1] / "data" / "mjcf" / "robotiq_2f85.xml"
CLOSING = Supplied(
    drive=("right_driver_joint:0:0.8:17",),
    hold=("right_spring_link_joint", "left_spring_link_joint"),
)

# MuJoCo's residuals at kincheck's poses: rounding of metre-sized coordinates, some operations deep.
EXACT = 1e-13

# Without it MuJoCo refuses a moving body; masses move nothing here.
MASS = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'


def model(tmp_path, text, name="model.xml"):
    """The text as a file, with an inertia in every body."""
    file = tmp_path / name
    file.write_text(
        "".join(
            part + ">" + MASS * part.lstrip().startswith("<body")
            for part in text.split(">")
            if part.strip()
        )
    )
    return file


def test_the_gripper_moves_as_mujoco_allows():
    """A published model: two five-bars, closed by connects and geared, over the stroke that its
    file gives.
    """
    case = load(GRIPPER, CLOSING)
    assert case.truth is Truth.CONSENSUS_ONLY
    assert {point.name for point in case.mechanism.points} >= {
        "right_follower",
        "left_pad",
        "right_pad",
    }
    residual, distance = mujoco_errors(mujoco, GRIPPER, case, range(17))
    assert residual < EXACT
    assert distance < EXACT


def test_the_gripper_moves_at_all_and_alike_on_both_sides():
    found = solution(load(GRIPPER, CLOSING)).points
    right, left = found["right_pad"].position, found["left_pad"].position
    assert np.abs(right[-1] - right[0]).max() > 0.02
    assert np.abs(right * [-1, -1, 1] - left).max() < EXACT


def test_what_is_lost_is_listed():
    listed = load(GRIPPER, CLOSING).source.split(LEFT_OUT)[1].split(", ")
    assert {
        "ranges of joints (8)",
        "armature of joints (2)",
    } <= set(listed)
    assert {"tendon: fixed (1)", "actuator: general (1)"} <= set(listed)


ORIENTATIONS = {
    "quaternion, not normalised": 'quat="1 2 -0.5 0.3"',
    "axis and angle": 'axisangle="1 2 3 40"',
    "two axes, not square": 'xyaxes="1 0.2 0 -0.1 2 0.4"',
    "two axes, half a turn": 'xyaxes="-1 0 0 0 -1 0"',
    "two axes, half a turn about x": 'xyaxes="1 0 0 0 -1 0"',
    "two axes, half a turn about y": 'xyaxes="-1 0 0 0 1 0"',
    "z axis": 'zaxis="1 -2 0.5"',
    "z axis as it is": 'zaxis="0 0 3"',
    "z axis opposite": 'zaxis="0 0 -2"',
    "Euler angles": 'euler="20 -30 50"',
    "none": "",
}


def agree(file):
    """Compare what the tree holds at qpos0 with MuJoCo: places and turns of bodies, points and axes
    of joints, sites.
    """
    root = parse_xml(file, file.read_text())
    tree = read_tree(root, read_classes(root), read_compiler(root))
    loaded = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(loaded)
    mujoco.mj_kinematics(loaded, data)
    for name, place in tree.places.items():
        body = data.body(name)
        assert np.allclose([*place.at], body.xpos, rtol=0, atol=EXACT), name
        between = place.turn.conjugate() * Quat(body.xquat[0], vec(body.xquat[1:]))
        assert np.abs([*between.e]).max() < EXACT, name
    for name, joint in tree.joints.items():
        there = data.joint(name)
        assert np.allclose([*joint.point], there.xanchor, rtol=0, atol=EXACT), name
        if joint.type != "ball":
            assert np.allclose([*joint.axis], there.xaxis, rtol=0, atol=EXACT), name
            assert np.isclose(
                joint.ref, loaded.qpos0[loaded.joint(name).qposadr[0]], rtol=0, atol=EXACT
            ), name
    for name, (_, place) in tree.sites.items():
        assert np.allclose([*place.at], data.site(name).xpos, rtol=0, atol=EXACT), name
        for column, axis in enumerate((X, Y, Z)):
            assert np.allclose(
                [*place.direction(axis)],
                data.site(name).xmat.reshape(3, 3)[:, column],
                rtol=0,
                atol=EXACT,
            ), name
    return tree


@pytest.mark.parametrize("angle", ["degree", "radian"])
@pytest.mark.parametrize("sequence", ["xyz", "zyx", "XYZ", "zXy"])
@pytest.mark.parametrize("orientation", ORIENTATIONS.values(), ids=ORIENTATIONS)
def test_orientations(tmp_path, orientation, sequence, angle):
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


def test_classes_of_joints_and_bodies_without_joints(tmp_path):
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
    assert [joint.type for joint in tree.joints.values()] == [
        "hinge",
        "slide",
        "hinge",
        "slide",
        "ball",
    ]
    assert tree.carriers["part"] == "by_body"
    assert tree.sites["tip"][0] == "by_body"
    assert tree.joints["own"].outer == "by_body"
    assert tree.joints["own"].inner == tree.joints["again"].outer == "own.own"
    assert tree.massless == {"own.own"}


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
        <fixed name="both"><joint joint="reach" coef="3"/><joint joint="out" coef="0.5"/></fixed></tendon>
      <equality>{equality}</equality>{more}
    </mujoco>"""  # noqa: E501


EVERYTHING = ("crank", "pivot", "reach", "lever", "out", "cross_1", "cross_2")
EQUALITIES = {
    "connect": ('<connect body1="end" body2="lever" anchor="0.1 0 0"/>', "pivot reach"),
    "connect to the ground": ('<connect body1="end" anchor="0.1 0 0"/>', "pivot reach"),
    "weld": ('<weld body1="end" body2="lever" anchor="0.1 0 0"/>', "pivot reach lever"),
    "gear": ('<joint joint1="lever" joint2="crank" polycoef="0 -0.7"/>', "lever"),
    "gear of one": ('<joint joint1="lever" joint2="crank" polycoef="0"/>', "lever"),
    "hinge by slide": ('<joint joint1="lever" joint2="reach" polycoef="0 4 0 0 0"/>', "lever"),
    "slide by hinge": ('<joint joint1="out" joint2="crank" polycoef="0 0.3"/>', "out"),
    "two slides": ('<joint joint1="out" joint2="reach" polycoef="0 -0.6"/>', "out"),
    "locked": ('<joint joint1="pivot"/>', "pivot"),
    "locked by nought": ('<joint joint1="pivot" joint2="crank" polycoef="0 0"/>', "pivot"),
    "tendon": ('<tendon tendon1="sum"/>', "lever"),
    "tendon of one": ('<tendon tendon1="one"/>', "lever"),
    "two tendons": ('<tendon tendon1="sum" tendon2="one" polycoef="0 0.5"/>', "lever"),
    "rod": ('<tendon tendon1="length"/>', "lever"),
    "locked, whatever the coefficients of nothing": (
        '<joint joint1="lever" polycoef="0 1 2"/>',
        "lever",
    ),
    "tendon of slides": ('<tendon tendon1="both"/>', "out"),
}


@pytest.mark.parametrize("kind", EQUALITIES)
def test_equalities(tmp_path, kind):
    """Each closes what it says: driven joints and residuals in MuJoCo."""
    equality, closed = EQUALITIES[kind]
    file = model(tmp_path, linkage(equality))
    swept = "reach" if kind in ("hinge by slide", "two slides", "tendon of slides") else "crank"
    values = ":0.02:0.15:5" if swept == "reach" else ":0.45:0.75:5"
    hold = tuple(name for name in EVERYTHING if name not in (*closed.split(), swept))
    case = load(file, Supplied(drive=(swept + values,), hold=hold))
    residual, distance = mujoco_errors(mujoco, file, case, range(5))
    assert residual < EXACT
    assert distance < EXACT


BLOCK = """<body name="block" pos="0.4 0 0.4" quat="1 0 1 0"><joint name="x" type="slide" axis="0 0 1"/>
    <joint name="z" type="slide" axis="1 0 0"/><site name="hub" pos="0 0 0.1" euler="0 0 50"/></body><body name="lever\""""  # noqa: E501


@pytest.mark.parametrize("kind", ["connect", "weld"])
def test_sites(tmp_path, kind):
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
    case = load(file, Supplied(drive=("crank:0.5:0.8:4",), hold=EVERYTHING[1:]))
    residual, distance = mujoco_errors(mujoco, file, case, range(4))
    assert residual < EXACT
    assert distance < EXACT


def test_bodies_made_of_several_joints_are_no_others(tmp_path):
    """The body between two joints of one body has a name that none of the file has."""
    text = """
    <mujoco><worldbody>
      <body name="arm"><joint name="x" type="slide"/><joint name="y" axis="0 1 0"/></body>
      <body name="arm.x"><joint name="z" axis="1 0 0"/></body><body name="arm.x'"></body>
    </worldbody></mujoco>"""
    tree = agree(model(tmp_path, text))
    assert list(tree.moving) == ["arm.x''", "arm", "arm.x"]
    assert tree.joints["z"].inner == "arm.x"
    with pytest.raises(CaseError, match="the model has 3 degrees of freedom"):
        load(model(tmp_path, text), Supplied(drive=("y:0:1",), hold=("x",)))


def test_inactive_equalities_are_left_out(tmp_path):
    gear = '<joint joint1="lever" joint2="crank" active="false"/>'
    for text in (
        linkage(gear),
        linkage(gear.replace("false", "true"), '<option><flag equality="disable"/></option>'),
    ):
        case = load(model(tmp_path, text), Supplied(drive=("crank:0.5:0.6",), hold=EVERYTHING[1:]))
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


def test_a_rod_on_a_ball_and_a_connect_does_not_spin(tmp_path):
    """Its turn about itself, which nothing can drive, is left out; a free body can be held."""
    file = model(tmp_path, ROD)
    case = load(file, Supplied(drive=("crank:0.2:0.9:6",), hold=("frame",)))
    assert case.mechanism.joint("ball").type == "distance"
    assert "body 'rod' and its turn about itself" in case.source
    residual, distance = mujoco_errors(mujoco, file, case, range(6))
    assert residual < EXACT
    assert distance < EXACT


def test_what_was_exported_is_read(tmp_path):
    """The strut: its tie rod is a tendon between two sites there, and a distance again here."""
    file = tmp_path / "strut.xml"
    assert main(["export", "mcpherson_strut", "--to", "mjcf", "--out", str(file)]) == 0
    case = load(file, Supplied(drive=("lca_pivot:-0.1:0.1:3",)))
    assert [joint.type for joint in case.mechanism.joints].count("distance") == 1
    residual, distance = mujoco_errors(mujoco, file, case, range(3))
    assert residual < EXACT
    assert distance < EXACT


def test_a_name_that_is_a_path_is_no_place_to_write_to(tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    keep_texts({".xml": "<mujoco/>"}, "../../out of/here", None)
    assert [file.name for file in (tmp_path / "here").iterdir()] == [".._.._out of_here.xml"]


def test_every_engine_reads_the_gripper_from_the_command_line(capsys):
    options = [
        "--drive",
        "right_driver_joint:0:0.8:5",
        "--hold",
        "right_spring_link_joint",
        "left_spring_link_joint",
        str(GRIPPER),
    ]
    assert main(["run", "--jobs", "0", "--engine", "native", "mujoco", *options]) == 0
    out, err = capsys.readouterr()
    assert "1 pass, 1 not judged" in out
    assert "with the masses of its bodies; left out: " in err
