"""URDF with loops: links stand and move as Pinocchio, which reads the file itself, says they do."""

import math

import numpy as np
import pytest
from kincheck.core.algebra import X, Y, Z
from kincheck.core.case.case import Case, Sweep, Truth
from kincheck.core.case.io.readers import LEFT_OUT
from kincheck.core.case.models.files import load
from kincheck.core.extensions.exports.command import writer_of
from kincheck.core.extensions.exports.model_writer import written
from kincheck.core.extensions.same.undriven import undriven_case, undriven_file
from kincheck.core.extensions.same.verdict import compare
from kincheck.core.extensions.trees.reader import read_tree
from kincheck.core.joints import Polynomial, Revolute
from kincheck.core.mechanism.mechanism import Body, Mechanism
from kincheck.core.mechanism.motions import JointAngle

from ...support.case_texts import write
from ...support.model_files import driven, edited
from ...support.model_poses import EXACT, near, solution
from ...support.urdf_texts import DRIVE, FOUR_BAR, TREE, robot
from .fuzz import urdf as seeds

ENDS = '<parent link="b"/><parent_origin xyz="4 0 0"/><child link="c"/>'
THERE = 'xyz="-0.958851077208406 0 1.7551651237807455"'


def random_tree(seed: int) -> str:
    """Return links with any places and axes, each on any one before it."""
    rng = np.random.default_rng(seed)
    text = '<robot name="r"><link name="l0"/>'
    for k in range(1, 9):
        kind = rng.choice(["revolute", "continuous", "prismatic", "fixed"])
        xyz, rpy, axis = (" ".join(map(repr, row)) for row in rng.normal(size=(3, 3)).tolist())
        text += (
            f'<link name="l{k}"/><joint name="j{k}" type="{kind}">'
            f'<parent link="l{rng.integers(k)}"/><child link="l{k}"/>'
            f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>'
            '<limit lower="-9" upper="9" effort="1" velocity="1"/></joint>'
        )
    return text + "</robot>"


@pytest.mark.parametrize("seed", range(4))
def test_random_tree_places_match_pinocchio(seed, tmp_path):
    pin = pytest.importorskip("pinocchio")
    text = random_tree(seed)
    found = read_tree(robot(tmp_path, text)).places
    model = pin.buildModelFromXML(text)
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    for name in (f"l{k}" for k in range(9)):
        place = found[name]
        frame = data.oMf[model.getFrameId(name)]
        assert near([*place.at], frame.translation)
        turned = [[*place.direction(axis)] for axis in (X, Y, Z)]
        assert near(np.transpose(turned), frame.rotation)


Y_AXIS = '<parent_axis xyz="0 1 0"/>'
AT = f"<child_origin {THERE}/>"
CLOSED = {
    "hinge": f'<constraint type="Revolute">{ENDS}{Y_AXIS}{AT}</constraint>',
    "hinge, turned": f'<constraint type="revolute">{ENDS}{Y_AXIS}'
    f'<child_origin {THERE} rpy="0 0.3 0"/></constraint>',
    "points": '<constraint name="C" type="position">'
    '<predecessor link="b"><origin xyz="4 0 0"/></predecessor>'
    f'<successor link="c"><origin {THERE}/></successor></constraint>',
    "cylindrical": f'<constraint type="cylindrical">{ENDS}{Y_AXIS}{AT}</constraint>',
    "universal": f'<constraint type="universal">{ENDS}{Y_AXIS}<child_axis xyz="0 0 1"/>{AT}'
    "</constraint>",
    "a link cut in two": '<link name="half"/><joint name="H" type="continuous">'
    f'<parent link="c"/><child link="half"/><origin {THERE}/><axis xyz="0 1 0"/></joint>'
    '<constraint type="link"><parent link="b"/><parent_origin xyz="4 0 0" rpy="0 0.5 0"/>'
    '<child link="half"/></constraint>',
}


@pytest.mark.parametrize("closing", CLOSED.values(), ids=CLOSED)
def test_urdf_constraint_types_close_loop(closing, tmp_path):
    same = solution(load(robot(tmp_path, FOUR_BAR), DRIVE)).bodies
    case = load(robot(tmp_path, TREE.replace("</robot>", closing + "</robot>")), DRIVE)
    found = solution(case)
    for name in ("a", "b", "c"):
        assert np.abs(found.bodies[name].r - same[name].r).max() < EXACT


def test_universal_constraint_has_both_axes(tmp_path):
    """The second is in the frame of its link, turned by half a radian at zero. In a plane the joint
    turns about the first alone: motion does not tell the second.
    """
    text = TREE.replace("</robot>", CLOSED["universal"] + "</robot>")
    joints = load(robot(tmp_path, text), DRIVE).mechanism.joints
    axes = {each.name: each.axis for each in joints if each.name.startswith("constraint1.hinge")}
    assert near(axes["constraint1.hinge1"], (0.0, 1.0, 0.0))
    assert near(axes["constraint1.hinge2"], (math.sin(0.5), 0.0, math.cos(0.5)))


def test_left_out_elements_are_listed(tmp_path):
    text = FOUR_BAR.replace(
        '<link name="c"/>', '<link name="c"><visual><mesh filename="no.stl"/></visual></link>'
    )
    case = load(robot(tmp_path, text.replace("</robot>", "<gazebo/></robot>")), DRIVE)
    assert case.source.split(LEFT_OUT)[1] == "gazebo (1), visual (2), limit of joints (1)"


PAIRED = seeds.PAIRED.decode().replace("yaml=", "said=")
PAIRS = PAIRED.split('said="')[1].split('"')[0]


def test_pairs_file_closes_loop(tmp_path):
    """Of example-parallel-robots: frames are links or joints, and joints get other types."""
    pytest.importorskip("yaml")
    case = load(robot(tmp_path, PAIRED, yaml=PAIRS), DRIVE)
    assert "with robot.yaml" in case.source
    hinges = dict.fromkeys(("A", "B_Y", "B_X", "D"), "revolute")
    types = {joint.name: joint.type for joint in case.mechanism.joints}
    assert types == {**hinges, "X = y": "spherical"}
    solution(case)


def test_pairs_file_with_open_zero_pose(tmp_path):
    """The file has no other start; another model so far open is refused."""
    pytest.importorskip("yaml")
    file = edited(tmp_path, PAIRED, ('xyz="0 0 3"', 'xyz="0 0 1.5"'), name="robot.urdf")
    case = load(robot(tmp_path, file.read_text(), yaml=PAIRS), DRIVE)
    said = "the start (its zero pose) is assembled: closed_loop[0]: X = y was open by 1.5 m"
    assert said in case.assembly[0]
    solution(case)


def test_exported_polynomial_coupling_is_read(tmp_path):
    pins = [
        Revolute("A", "ground", "a", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        Revolute("B", "ground", "b", (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    ]
    coupling = Polynomial("P", ("B", "A"), (0.0, 0.5, 0.2, -0.1, 0.05))
    mechanism = Mechanism("m", [Body("a"), Body("b")], pins, [], [JointAngle("A", "A")], [coupling])
    sweep = Sweep("A", np.linspace(0.0, 1.0, 3))
    case = Case("m", "made up for this test", Truth.CONSENSUS_ONLY, mechanism, sweep, ())
    texts = written(case, writer_of("urdf"))
    file = robot(tmp_path, texts[".urdf"], constraints_json=texts[".constraints.json"])
    again = load(file, driven("A:0:1:3"))
    assert [each.type for each in again.mechanism.couplers] == ["polynomial"]
    same = compare(undriven_case(case, "case"), undriven_file(file), {})
    assert same.verdict == "same", same.reason
    assert same.largest < EXACT


AXES = ["3 4 0", "0.33 0 0.9439809320108114", "0 -0.6 0.8", "1e100 0 0", "2 3 6"]


@pytest.mark.parametrize("axis", AXES)
def test_axis_is_normalized_once(axis, tmp_path):
    numbers = [float(each) for each in axis.split()]
    length = math.hypot(*numbers)
    unit = abs(length - 1.0) < 1e-15
    expected = tuple(numbers if unit else [each / length for each in numbers])
    text = (
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="revolute">'
        f'<parent link="a"/><child link="b"/><axis xyz="{axis}"/></joint></robot>'
    )
    case = load(robot(tmp_path, text), driven("j:0:1"))
    assert case.mechanism.joint("j").axis == expected
    text = (
        '<mujoco><worldbody><body name="b"><geom size="0.1"/>'
        f'<joint name="j" axis="{axis}"/></body></worldbody></mujoco>'
    )
    case = load(write(tmp_path, text, "model.xml"), driven("j:0:1"))
    assert case.mechanism.joint("j").axis == expected
