"""Loops of a URDF that files beside it, and names of its frames, close."""

import re

import pytest
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError
from kincheck.core.extensions.trees.reader import read_tree

from ...support.case_texts import write
from ...support.examples import examples
from ...support.model_files import driven
from ...support.model_poses import coordinate, solution
from ...support.urdf_texts import robot

FIVE_BAR, BESIDE, UNKNOWN = examples(__file__, "five_bar", "beside", "unknown")

FOUR_LINKS = """<robot name="r"><link name="base"/><link name="crank"/><link name="coupler"/>
<link name="rocker"/><joint name="A" type="continuous"><parent link="base"/><child link="crank"/>
<axis xyz="0 0 1"/></joint>
<joint name="B" type="continuous"><parent link="crank"/><child link="coupler"/>
<origin xyz="0 0.2 0"/><axis xyz="0 0 1"/></joint>
<joint name="D" type="continuous"><parent link="base"/><child link="rocker"/>
<origin xyz="0.5 0 0"/><axis xyz="0 0 1"/></joint></robot>"""
CLOSURE = """closures:
- {link_a: coupler, link_b: rocker, point: [0.6, 0.3, 0.0], axis: [0, 0, 1]}
independent: [A]
dependent: [B, D]
"""


@pytest.mark.parametrize("way", BESIDE)
def test_closures_beside_urdf_close_loop(way, tmp_path):
    """The turn of B is that of two circles that meet, solved apart."""
    pytest.importorskip("yaml")
    file = robot(tmp_path, FOUR_LINKS)
    name, text = BESIDE[way]
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_text(text)
    case = load(file, driven("A:0:0.5:3"))
    assert f"with {name.rpartition('/')[2]}" in case.source
    turned = coordinate(case, solution(case), "B")
    assert turned == pytest.approx([0.0, -0.21837050332959212, -0.4317512663107136], abs=1e-12)


@pytest.mark.parametrize(("old", "new", "said"), UNKNOWN)
def test_unknown_name_in_closures_is_named(old, new, said, tmp_path):
    pytest.importorskip("yaml")
    file = robot(tmp_path, FOUR_LINKS)
    (tmp_path / "loop_closures.yaml").write_text(CLOSURE.replace(old, new, 1))
    with pytest.raises(CaseError, match=re.escape(said)):
        load(file, driven("A:0:0.5:3"))


def test_closures_of_others_are_noted(tmp_path):
    pytest.importorskip("yaml")
    file = robot(tmp_path, FOUR_LINKS)
    other = CLOSURE.replace("coupler", "p").replace("rocker", "q")
    (tmp_path / "loop_closures.yaml").write_text(other)
    (tmp_path / "robot.yaml").write_text("controller: {p: 1}")
    unread = (
        *("closed_loops.json", "robot.json", "kinematic-Loops.toml", "robot_closures.xml"),
        "robot_two.txt",
    )
    others = ("robot_two.urdf", "robot_two_loops.json")
    for name in (*unread, *others):
        (tmp_path / name).write_text("{}")
    (tmp_path / "robot.toml").write_text('schema = "kincheck-case/1"\n')
    notes = load(file, driven("A:0:0.5:3", hold_rest=True)).assembly
    assert "loop_closures.yaml beside it is of other links, and not read" in notes
    assert "robot.yaml: not read: line 1: controller" in notes
    said = [each.split(" beside")[0] for each in notes if "beside it may close loops" in each]
    assert [each.removeprefix("warning: ") for each in said] == sorted(unread[:4])
    assert any(each.startswith("warning: held by --hold-rest") for each in notes)


@pytest.mark.parametrize("beside", ["loop_closures.yaml", "robot.yaml"])
@pytest.mark.parametrize("name", ["robot.sdf", "robot.xml"])
def test_loops_beside_other_format_warn(name, beside, tmp_path):
    """Unless a URDF lies there, whose file it is."""
    texts = {
        "robot.sdf": "<sdf version='1.9'><model name='m'><link name='a'/></model></sdf>",
        "robot.xml": "<mujoco><worldbody><body name='a'><freejoint/></body></worldbody></mujoco>",
    }
    file = write(tmp_path, texts[name], name)
    assert not any("beside it" in note for note in read_tree(file).notes)
    write(tmp_path, "closed_loop: []", beside)
    said = f"warning: {beside} beside it may close loops, and is not read; write them into {name}"
    assert said in read_tree(file).notes
    write(tmp_path, "", "other.urdf")
    assert said not in read_tree(file).notes


def test_closing_frames_are_one_point(tmp_path):
    """As onshape-to-robot names them; what --hold-rest holds is near the base."""
    case = load(robot(tmp_path, FIVE_BAR), driven("m1:0:0.4:3", hold_rest=True))
    assert [driver.name for driver in case.mechanism.drivers] == ["m1", "m2"]
    found = solution(case)
    for name, angles in {
        "p1": [0.0, -0.29186540314305265, -0.5725761939938617],
        "p2": [0.0, 0.11533378148300301, 0.25608668202885787],
    }.items():
        assert coordinate(case, found, name) == pytest.approx(angles, abs=1e-12)
    assert "closing_tip_1 and closing_tip_2 are one point, as their names say" in case.assembly


def test_closing_frame_alone_is_warning(tmp_path):
    text = FIVE_BAR.replace("closing_tip_2", "closing_end_2")
    notes = load(robot(tmp_path, text), driven("m1:0:0.4:3", hold_rest=True)).assembly
    assert "warning: closing_tip_1 has no other end: that loop is open" in notes


def test_closing_frames_tied_already(tmp_path):
    """A constraint of the same links stays the only one."""
    loop = '<constraint name="C" type="spherical"><parent link="l2"/><child link="r2"/>'
    ends = '<parent_origin xyz="0.15 0.2 0"/><child_origin xyz="-0.15 0.2 0"/></constraint>'
    text = FIVE_BAR.replace("</robot>", f"{loop}{ends}</robot>")
    tree = read_tree(robot(tmp_path, text))
    assert [each.name for each in tree.ties] == ["C"]


FAULTS_FAULTS_BESIDE = {
    "robot.yaml": "closed_loop: [[a, b],\n [a, zq]]\ntype: [3d, 3d] | line 2: closed_loop[1]",
    "robot.yml": "pin_loops:\n- {parent: a}\n | line 2: pin_loops[0]: Object missing",
    "robot.constraints.json": (
        '{"schema": "kincheck-constraints/1",\n"constraints": [],\n"bodes": {}}'
        " | line 3: bodes: unknown key, expected one of ... did you mean 'bodies'?"
    ),
}


@pytest.mark.parametrize("name", FAULTS_FAULTS_BESIDE)
def test_file_beside_robot_has_line(tmp_path, name):
    if not name.endswith("json"):
        pytest.importorskip("yaml")
    text, _, said = FAULTS_FAULTS_BESIDE[name].partition(" | ")
    robot = (
        "<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='continuous'>"
        "<parent link='a'/><child link='b'/><axis xyz='0 0 1'/></joint></robot>"
    )
    write(tmp_path, text, name)
    with pytest.raises(CaseError) as found:
        load(write(tmp_path, robot, "robot.urdf"), driven("j:0:1:3"))
    assert all(part in str(found.value) for part in (name, *said.split(" ... ")))
