"""Joints of Drake in URDF and SDF: they move as Drake moves them."""

import importlib
import re
from pathlib import Path

import numpy as np
import pytest
from kincheck.core.case.models.files import load, read_tree
from kincheck.core.errors import CaseError
from scipy.spatial.transform import Rotation

from ..support.model_files import driven
from ..support.model_poses import solution
from .test_joining_elements import EXACT, GATE, read

JOINTS_OF_DRAKE = {
    "ball": ("", 3),
    "universal": ("", 2),
    "planar": ('<axis xyz="0 1 0"/>', 3),
    "screw": ('<axis xyz="0 0 1"/><drake:screw_thread_pitch value="0.5"/>', 1),
}


@pytest.mark.parametrize(
    ("kind", "inside", "freedoms"), [(kind, *each) for kind, each in JOINTS_OF_DRAKE.items()]
)
def test_drake_joint_in_urdf_matches_drake(kind, inside, freedoms, tmp_path: Path):
    """Its freedoms, and the place of the tip when the last one moves."""
    plants = pytest.importorskip("pydrake.multibody.plant", reason="drake is not installed")
    parsing = pytest.importorskip("pydrake.multibody.parsing")
    joint = (
        '<link name="tip"/>'
        f'<drake:joint name="q" type="{kind}"><parent link="base"/><child link="tip"/>'
        f'<origin xyz="0.3 0 0.2" rpy="0.1 0.2 0.3"/>{inside}</drake:joint>'
    )
    case = read(tmp_path, GATE.format(joint))
    between = {joint.name: joint for joint in case.mechanism.joints if joint.name.startswith("q")}
    plant = plants.MultibodyPlant(1e-3)
    parsing.Parser(plant).AddModels(str(tmp_path / "gate.urdf"))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    plant.Finalize()
    assert plant.GetJointByName("q").num_positions() == freedoms
    if kind == "ball":
        assert between["q"].type == "fixed"  # held
        return
    moving = {"universal": "q.2", "planar": "q.rotation", "screw": "q.rotation"}[kind]
    supplied = driven(f"{moving}:0:0.3:2", hold_rest=True)
    found = solution(load(tmp_path / "gate.urdf", supplied)).bodies["tip"]
    context = plant.CreateDefaultContext()
    positions = plant.GetPositions(context)
    positions[plant.GetJointByName("q").position_start() + freedoms - 1] = 0.3
    plant.SetPositions(context, positions)
    pose = plant.GetFrameByName("tip").CalcPoseInWorld(context)
    assert found.r[-1] == pytest.approx(pose.translation(), abs=EXACT)
    assert np.abs(found.p[-1] @ pose.rotation().ToQuaternion().wxyz()) == pytest.approx(1.0)


PLANAR = """<sdf version="1.9"><model name="m"><link name="a"/>
<link name="b"><pose>0.1 0 0.2 0.3 0 0.4</pose></link>
<frame name="f" attached_to="a"><pose>0.1 0 0.2 0.3 0 0.4</pose></frame>
<joint name="A" type="revolute"><parent>world</parent><child>a</child>
<axis><xyz>0 0 1</xyz></axis></joint>
<drake:joint name="q" type="planar"><drake:parent>f</drake:parent><drake:child>b</drake:child>
<drake:damping>0 0 0</drake:damping></drake:joint></model></sdf>"""


MOVES = {"q.slide1": (0.5, 0, 0), "q.slide2": (0, 0.5, 0), "q.rotation": (0, 0, 0.5)}


@pytest.mark.parametrize("moved", MOVES)
def test_planar_joint_in_sdf_matches_drake(moved: str, tmp_path: Path):
    """Along x and y of the parent's frame, and about its z; where Drake is, by Drake too."""
    (tmp_path / "m.sdf").write_text(PLANAR)
    held = tuple(each for each in MOVES if each != moved)
    supplied = driven(f"{moved}:0:0.5:2", hold=("A", *held))
    found = solution(load(tmp_path / "m.sdf", supplied)).bodies["b"]
    x, y, angle = MOVES[moved]
    frame = Rotation.from_euler("xyz", (0.3, 0, 0.4))
    assert found.r[-1] == pytest.approx(frame.apply((x, y, 0)) + (0.1, 0, 0.2), abs=EXACT)
    e0, *e = found.p[-1]
    turned = frame * Rotation.from_euler("z", angle)
    assert abs(turned.as_quat() @ (*e, e0)) == pytest.approx(1.0)
    plants = pytest.importorskip("pydrake.multibody.plant", reason="drake is not installed")
    plant = plants.MultibodyPlant(1e-3)
    importlib.import_module("pydrake.multibody.parsing").Parser(plant).AddModels(
        str(tmp_path / "m.sdf")
    )
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.GetJointByName("q").set_translation(context, [x, y])
    plant.GetJointByName("q").set_rotation(context, angle)
    pose = plant.GetFrameByName("b").CalcPoseInWorld(context)
    assert found.r[-1] == pytest.approx(pose.translation(), abs=EXACT)
    assert abs(found.p[-1] @ pose.rotation().ToQuaternion().wxyz()) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('type="planar"', 'type="curvilinear"', "found 'curvilinear', expected one of planar"),
        ("<pose>0.1 0 0.2 0.3 0 0.4</pose></link>", "<pose>0.2 0 0.2 0 0 0</pose></link>", "apart"),
        ("<drake:damping>0 0 0</drake:damping>", "<pose>0 0 0 0 0 0</pose>", "<pose>"),
        ("<drake:child>b<", "<drake:child>c<", "found the frame 'm::c'"),
    ],
)
def test_faulty_drake_joint_in_sdf(old: str, new: str, said: str, tmp_path: Path):
    (tmp_path / "m.sdf").write_text(PLANAR.replace(old, new))
    with pytest.raises(CaseError, match=re.escape(said)):
        read_tree(tmp_path / "m.sdf")
