"""URDF with loops: links stand and move as Pinocchio, which reads the file itself, says they do."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from kincheck import adapters
from kincheck.core.algebra import X, Y, Z
from kincheck.core.case.case import Case, Sweep, Truth
from kincheck.core.case.io.model_writer import written
from kincheck.core.case.io.reader_options import LEFT_OUT, Supplied
from kincheck.core.case.models.files import load
from kincheck.core.case.models.mjcf.elements import parse_xml
from kincheck.core.case.models.robots.urdf import read_urdf
from kincheck.core.errors import CaseError
from kincheck.core.joints import Polynomial, Revolute
from kincheck.core.mechanism.drivers import JointAngle
from kincheck.core.mechanism.mechanism import Body, Mechanism

from ..fuzz import urdf as seeds
from ..support.exported_again import same_motion
from ..support.model_poses import coordinate, solution

# Rounding of metre-sized coordinates, some operations deep.
EXACT = 1e-13
DRIVE = Supplied(drive=("A:0:0.5:5",))
FOUR_BAR = seeds.FOUR_BAR.decode()
LOOP = FOUR_BAR[FOUR_BAR.index("<constraint") : FOUR_BAR.index("</robot>")]
TREE = FOUR_BAR.replace(LOOP, "")
ENDS = '<parent link="b"/><parent_origin xyz="4 0 0"/><child link="c"/>'
THERE = 'xyz="-0.958851077208406 0 1.7551651237807455"'


def robot(folder: Path, text: str, **beside: str) -> Path:
    """Return the file of a robot, and write the files beside it."""
    file = folder / "robot.urdf"
    file.write_text(text)
    for ending, content in beside.items():
        file.with_suffix(f".{ending.replace('_', '.')}").write_text(content)
    return file


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
    found = read_urdf(tmp_path / "robot.urdf", parse_xml(tmp_path / "robot.urdf", text))
    model = pin.buildModelFromXML(text)
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    for name, place in found.links.items():
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
    assert same_motion(case, again) < EXACT


def edited(folder: Path, old: str, new: str) -> Path:
    assert old in FOUR_BAR
    return robot(folder, FOUR_BAR.replace(old, new, 1))


FAULTS = {
    "two joints above": (
        '<child link="c"/>',
        '<child link="b"/>',
        "'B' holds already.*<constraint>",
    ),
    "no link": ('<child link="c"/>', '<child link="cc"/>', "found 'cc', expected a link; did you"),
    "ring": (
        '<parent link="base"/><child link="a"/>',
        '<parent link="tip"/><child link="a"/>',
        "hangs on itself",
    ),
    "no child": ('<child link="a"/>', "", "<child>: missing, expected a link; add it"),
    "two bases": (
        '<link name="c"/>',
        '<link name="c"/><link name="e"/>',
        r"found 2 links .*\(base, e\)",
    ),
    "zero axis": ('xyz="0 1 0"', 'xyz="0 0 0"', "found zero, expected the direction of an axis"),
    "mistyped attribute": (
        'rpy="1 2 3"',
        'rpq="1 2 3"',
        "URDF does not have.*; did you mean 'rpy'",
    ),
    "mistyped element": ("<origin", "<orgin", "unknown in <joint>; did you mean 'origin'"),
    "no type": (
        'type="spherical"',
        'type="rolling"',
        "found 'rolling', expected one of fixed, link",
    ),
    "unknown joint": ('type="revolute"', 'type="hinge"', "found 'hinge', expected one of revolute"),
    "macros": ("<constraint", "<xacro:leg/><constraint", "is a macro.*; expand the file"),
    "twice": ('<link name="c"/>', '<link name="b"/>', "found 'b' again"),
}


@pytest.mark.parametrize(("old", "new", "said"), FAULTS.values(), ids=FAULTS)
def test_a_fault_is_one_message(old: str, new: str, said: str, tmp_path: Path):
    file = edited(tmp_path, old, new)
    with pytest.raises(CaseError, match=said) as caught:
        load(file, DRIVE)
    assert str(caught.value).startswith(f"{file}: line ")


COINCIDENT = {
    "joint": "C",
    "kind": "coincident",
    "i": {"link": "b", "point": [4.0, 0.0, 0.0]},
    "j": {"link": "c", "point": [-0.958851077208406, 0.0, 1.7551651237807455]},
}
BESIDE_FAULTS = {
    "other schema": ({"schema": "mine"}, "found 'mine', expected 'kincheck-constraints/1'"),
    "unknown link": (
        {"i": {"link": "bb", "point": [4.0, 0.0, 0.0]}},
        "found 'bb', expected a link",
    ),
    "open": ({"i": {"link": "b", "point": [4.1, 0.0, 0.0]}}, "is open by 0.1 in the zero pose"),
    "no joint": ({"kind": "distance", "value": 1.0}, "is open by -1"),
    "no point": ({"i": None}, "found no two links"),
    "unknown kind": ({"kind": "weld"}, "weld"),
}


def beside(folder: Path, **changes: object) -> Path:
    """The four-bar, closed by a file beside it."""
    schema = changes.pop("schema", "kincheck-constraints/1")
    table = {"schema": schema, "constraints": [COINCIDENT | changes]}
    return robot(folder, TREE, constraints_json=json.dumps(table))


def test_a_file_of_conditions_closes_the_loop_beside_it(tmp_path: Path):
    (other := tmp_path / "other").mkdir()
    found = solution(load(beside(tmp_path), DRIVE)).bodies["c"].r
    same = solution(load(robot(other, FOUR_BAR), DRIVE)).bodies["c"].r
    assert np.array_equal(found, same)


@pytest.mark.parametrize(("changes", "said"), BESIDE_FAULTS.values(), ids=BESIDE_FAULTS)
def test_a_fault_of_a_file_of_conditions_names_it(changes: dict, said: str, tmp_path: Path):
    file = beside(tmp_path, **changes)
    with pytest.raises(CaseError, match=said) as caught:
        load(file, DRIVE)
    assert str(caught.value).startswith(str(file.with_suffix(".constraints.json")))


PAIRS = {
    "a reference": ("closed_loop: [&x [a, b], *x]\ntype: [3d, 3d]", "found a reference"),
    "fewer types": ("closed_loop: [[a, b]]\ntype: []", "type: found 0, expected 1"),
    "unknown frame": ("closed_loop: [[a, bb]]\ntype: [3d]", "found 'bb', expected a link or joint"),
    "unknown type": ("closed_loop: [[a, b]]\ntype: [4d]", "found '4d', expected 3d or 6d"),
    "unknown joint": ("joint_name: [Q]\njoint_type: [FIXED]", "found 'Q', expected a joint"),
    "no axes": (
        "joint_name: [B]\njoint_type: [UJOINT_XW]",
        "found 'UJOINT_XW', expected SPHERICAL",
    ),
    "no mapping": ("- 1", "expected closed_loop, type"),
    "nested": ("[" * 400, "nested too deeply"),
    "syntax": ("a: [", "not valid YAML"),
}


@pytest.mark.parametrize(("text", "said"), PAIRS.values(), ids=PAIRS)
def test_a_fault_of_a_file_of_pairs_names_it(text: str, said: str, tmp_path: Path):
    pytest.importorskip("yaml")
    file = robot(tmp_path, TREE, yaml=text)
    with pytest.raises(CaseError, match=said) as caught:
        load(file, DRIVE)
    assert str(caught.value).startswith(str(file.with_suffix(".yaml")))


@pytest.mark.parametrize("name", ["robot.xacro", "robot.usd", "part.STL", "r.constraints.json"])
def test_a_file_that_is_beside_models_is_told(name: str, tmp_path: Path):
    (tmp_path / name).write_bytes(b"\x00\xff")
    with pytest.raises(CaseError, match=r"found a \.[\w.]+ file, which .*; "):
        load(tmp_path / name)


@pytest.mark.parametrize(
    ("text", "advice"),
    [
        ("<mujocoinclude/>", "give the file that includes it"),
        ("<OpenSimDocument/>", "give MJCF or a case file"),
        ("<launch/>", "give the URDF"),
        (TREE.replace('xyz="0 0 2"', 'xyz="${l} 0 2"'), "xacro FILE"),
    ],
)
def test_other_documents_are_told(text: str, advice: str, tmp_path: Path):
    file = tmp_path / "model.xml"
    file.write_text(text)
    with pytest.raises(CaseError, match=advice):
        load(file)


def test_entities_are_refused(tmp_path: Path):
    file = robot(tmp_path, '<!DOCTYPE r [<!ENTITY a "b">]>' + FOUR_BAR)
    with pytest.raises(CaseError, match="found <!DOCTYPE>, expected none"):
        load(file, DRIVE)


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
