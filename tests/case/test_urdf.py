"""URDF with loops: links stand and move as Pinocchio, which reads the file itself, says they do."""

import math
from pathlib import Path

import numpy as np
import pytest
from kincheck import adapters
from kincheck.core.algebra import X, Y, Z
from kincheck.core.case.case import Case, Sweep, Truth
from kincheck.core.case.io.model_writer import written
from kincheck.core.case.io.reader_options import LEFT_OUT, Supplied
from kincheck.core.case.models.files import load, read_tree
from kincheck.core.case.models.undriven import undriven_case, undriven_file
from kincheck.core.joints import Polynomial, Revolute
from kincheck.core.mechanism.mechanism import Body, Mechanism
from kincheck.core.mechanism.motions import JointAngle
from kincheck.core.studies.same import compare

from ..fuzz import urdf as seeds
from ..support.model_poses import coordinate, solution
from ..support.urdf_texts import DRIVE, FOUR_BAR, TREE, robot

# Rounding of metre-sized coordinates, some operations deep.
EXACT = 1e-13
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
def test_links_of_any_tree_stand_where_pinocchio_has_them(seed: int, tmp_path: Path):
    pin = pytest.importorskip("pinocchio")
    text = random_tree(seed)
    found = read_tree(robot(tmp_path, text)).places
    model = pin.buildModelFromXML(text)
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    for name in (f"l{k}" for k in range(9)):
        place = found[name]
        frame = data.oMf[model.getFrameId(name)]
        assert np.allclose([*place.at], frame.translation, rtol=0, atol=EXACT)
        turned = [[*place.direction(axis)] for axis in (X, Y, Z)]
        assert np.allclose(np.transpose(turned), frame.rotation, rtol=0, atol=EXACT)


def test_a_closed_robot_moves_as_pinocchio_moves_its_joints(tmp_path: Path):
    """All links, at every sample; the frames of the loop coincide there."""
    pin = pytest.importorskip("pinocchio")
    case = load(robot(tmp_path, FOUR_BAR), DRIVE)
    found = solution(case)
    assert found.solved.all()
    model = pin.buildModelFromXML(FOUR_BAR)
    data, names = model.createData(), [*model.names][1:]
    for k, swept in enumerate(case.sweep.values):
        angles = {
            name: coordinate(case.mechanism, found, case.mechanism.joint(name), k) for name in names
        }
        assert angles["A"] == pytest.approx(swept, abs=EXACT)
        q = pin.neutral(model)
        for name, angle in angles.items():
            joint = model.joints[model.getJointId(name)]
            two = joint.nq == 2  # continuous: cosine and sine
            q[joint.idx_q : joint.idx_q + joint.nq] = (
                (np.cos(angle), np.sin(angle)) if two else angle
            )
        pin.framesForwardKinematics(model, data, q)
        for name in ("a", "b", "c"):
            frame = data.oMf[model.getFrameId(name)]
            assert np.allclose(found.bodies[name].r[k], frame.translation, rtol=0, atol=EXACT)
        there, here = (data.oMf[model.getFrameId(name)] for name in ("b", "c"))
        gap = there.act(np.array([4.0, 0, 0])) - here.act(
            np.array([*map(float, THERE.split('"')[1].split())])
        )
        assert np.abs(gap).max() < EXACT
    tip = case.mechanism.point("tip")
    assert tip.body == "b"
    assert tip.position == pytest.approx((2.0, 0.0, 3.0))


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
def test_a_loop_can_be_closed_in_many_ways(closing: str, tmp_path: Path):
    same = solution(load(robot(tmp_path, FOUR_BAR), DRIVE)).bodies
    case = load(robot(tmp_path, TREE.replace("</robot>", closing + "</robot>")), DRIVE)
    found = solution(case)
    assert found.solved.all()
    for name in ("a", "b", "c"):
        assert np.abs(found.bodies[name].r - same[name].r).max() < EXACT


def test_what_is_lost_is_listed(tmp_path: Path):
    text = FOUR_BAR.replace(
        '<link name="c"/>', '<link name="c"><visual><mesh filename="no.stl"/></visual></link>'
    )
    case = load(robot(tmp_path, text.replace("</robot>", "<gazebo/></robot>")), DRIVE)
    assert case.source.split(LEFT_OUT)[1] == "gazebo (1), visual (2), limit of joints (1)"


def test_a_file_of_pairs_closes_the_loop_beside_it(tmp_path: Path):
    """Of example-parallel-robots: frames are links or joints, and joints get other types."""
    pytest.importorskip("yaml")
    text = seeds.PAIRED.decode().replace("yaml=", "said=")
    pairs = text.split('said="')[1].split('"')[0]
    file = robot(tmp_path, text, yaml=pairs)
    case = load(file, DRIVE)
    assert "with robot.yaml" in case.source
    assert {joint.name: joint.type for joint in case.mechanism.joints} == {
        "A": "revolute",
        "B_Y": "revolute",
        "B_X": "revolute",
        "D": "revolute",
        "X = y": "spherical",
    }
    assert solution(case).solved.all()


def test_paired_frames_need_not_meet_in_the_zero_pose(tmp_path: Path):
    """The file has no other start; another model so far open is refused."""
    pytest.importorskip("yaml")
    text = seeds.PAIRED.decode().replace("yaml=", "said=")
    pairs = text.split('said="')[1].split('"')[0]
    far = text.replace('<origin xyz="0 0 3"/>', '<origin xyz="0 0 1.5"/>')
    assert far != text
    case = load(robot(tmp_path, far, yaml=pairs), DRIVE)
    assert (
        "the start (its zero pose) is assembled: closed_loop: X = y was open by 1.5 m"
        in (case.assembly[0])
    )
    assert solution(case).solved.all()


def test_a_polynomial_coupling_is_read_back(tmp_path: Path):
    pins = [
        Revolute("A", "ground", "a", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        Revolute("B", "ground", "b", (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    ]
    coupling = Polynomial("P", ("B", "A"), (0.0, 0.5, 0.2, -0.1, 0.05))
    mechanism = Mechanism("m", [Body("a"), Body("b")], pins, [], [JointAngle("A", "A")], [coupling])
    sweep = Sweep("A", np.linspace(0.0, 1.0, 3))
    case = Case("m", "made up for this test", Truth.CONSENSUS_ONLY, mechanism, sweep, ())
    texts = written(case, adapters.writer("urdf"))
    file = robot(tmp_path, texts[".urdf"], constraints_json=texts[".constraints.json"])
    again = load(file, Supplied(drive=("A:0:1:3",)))
    assert [each.type for each in again.mechanism.couplers] == ["polynomial"]
    same = compare(undriven_case(case, "case"), undriven_file(file), {})
    assert same.verdict == "same", same.reason
    assert same.largest < EXACT


AXES = ["3 4 0", "0.33 0 0.9439809320108114", "0 -0.6 0.8", "1e100 0 0", "2 3 6"]


@pytest.mark.parametrize("axis", AXES)
def test_an_axis_is_divided_by_its_length_once_or_kept(axis: str, tmp_path: Path):
    numbers = [float(each) for each in axis.split()]
    length = math.hypot(*numbers)
    unit = abs(length - 1.0) < 1e-15
    expected = tuple(numbers if unit else [each / length for each in numbers])
    text = (
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="revolute">'
        f'<parent link="a"/><child link="b"/><axis xyz="{axis}"/></joint></robot>'
    )
    case = load(robot(tmp_path, text), Supplied(drive=("j:0:1",)))
    assert case.mechanism.joint("j").axis == expected
    file = tmp_path / "model.xml"
    file.write_text(
        '<mujoco><worldbody><body name="b"><geom size="0.1"/>'
        f'<joint name="j" axis="{axis}"/></body></worldbody></mujoco>'
    )
    case = load(file, Supplied(drive=("j:0:1",)))
    assert case.mechanism.joint("j").axis == expected
