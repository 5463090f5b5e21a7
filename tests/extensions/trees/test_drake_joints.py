"""Joints of Drake in URDF and SDF: they move as Drake moves them."""

import importlib

import numpy as np
import pytest
from kincheck.core.case.models.files import load
from scipy.spatial.transform import Rotation

from ...support.case_texts import complains, write
from ...support.examples import examples
from ...support.model_files import driven
from ...support.model_poses import EXACT, solution
from .test_joining_elements import GATE

(JOINTS_OF_DRAKE,) = examples(__file__, "joints_of_drake")


def assert_stands_as_in_drake(file, link, values, motion, base="world"):
    """Compare the last pose of a link with Drake's, at these coordinates of its joint q."""
    plants = pytest.importorskip("pydrake.multibody.plant", reason="drake is not installed")
    plant = plants.MultibodyPlant(1e-3)
    parsing = importlib.import_module("pydrake.multibody.parsing")
    parsing.Parser(plant).AddModels(str(file))
    if base != "world":
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(base))
    plant.Finalize()
    context, joint = plant.CreateDefaultContext(), plant.GetJointByName("q")
    assert joint.num_positions() == len(values)
    positions, start = plant.GetPositions(context), joint.position_start()
    positions[start : start + len(values)] = values
    plant.SetPositions(context, positions)
    pose = plant.GetFrameByName(link).CalcPoseInWorld(context)
    assert motion.r[-1] == pytest.approx(pose.translation(), abs=EXACT)
    assert np.abs(motion.p[-1] @ pose.rotation().ToQuaternion().wxyz()) == pytest.approx(1.0)


@pytest.mark.parametrize("kind", JOINTS_OF_DRAKE)
def test_drake_joint_in_urdf_matches_drake(kind, tmp_path):
    """Its freedoms, and the place of the tip when the last one moves; a ball is held."""
    inside, moving, freedoms = JOINTS_OF_DRAKE[kind]
    joint = (
        '<link name="tip"/>'
        f'<drake:joint name="q" type="{kind}"><parent link="base"/><child link="tip"/>'
        f'<origin xyz="0.3 0 0.2" rpy="0.1 0.2 0.3"/>{inside}</drake:joint>'
    )
    file = write(tmp_path, GATE.format(joint), "gate.urdf")
    case = load(file, driven(f"{moving or 'drive'}:0:0.3:2", hold_rest=True))
    if not moving:
        assert case.mechanism.joint("q").type == "fixed"
        return
    values = [0.0] * (freedoms - 1) + [0.3]
    assert_stands_as_in_drake(file, "tip", values, solution(case).bodies["tip"], "base")


PLANAR = """<sdf version="1.9"><model name="m"><link name="a"/>
<link name="b"><pose>0.1 0 0.2 0.3 0 0.4</pose></link>
<frame name="f" attached_to="a"><pose>0.1 0 0.2 0.3 0 0.4</pose></frame>
<joint name="A" type="revolute"><parent>world</parent><child>a</child>
<axis><xyz>0 0 1</xyz></axis></joint>
<drake:joint name="q" type="planar"><drake:parent>f</drake:parent><drake:child>b</drake:child>
<drake:damping>0 0 0</drake:damping></drake:joint></model></sdf>"""


MOVES = {"q.slide1": (0.5, 0, 0), "q.slide2": (0, 0.5, 0), "q.rotation": (0, 0, 0.5)}


@pytest.mark.parametrize("moved", MOVES)
def test_planar_joint_in_sdf_matches_drake(moved, tmp_path):
    """Along x and y of the parent's frame, and about its z; where Drake is, by Drake too."""
    file = write(tmp_path, PLANAR, "m.sdf")
    held = tuple(each for each in MOVES if each != moved)
    found = solution(load(file, driven(f"{moved}:0:0.5:2", hold=("A", *held)))).bodies["b"]
    x, y, angle = MOVES[moved]
    frame = Rotation.from_euler("xyz", (0.3, 0, 0.4))
    assert found.r[-1] == pytest.approx(frame.apply((x, y, 0)) + (0.1, 0, 0.2), abs=EXACT)
    turned = frame * Rotation.from_euler("z", angle)
    assert abs(turned.as_quat(scalar_first=True) @ found.p[-1]) == pytest.approx(1.0)
    assert_stands_as_in_drake(file, "b", MOVES[moved], found)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('type="planar"', 'type="curvilinear"', "found 'curvilinear', expected one of planar"),
        ("<pose>0.1 0 0.2 0.3 0 0.4</pose></link>", "<pose>0.2 0 0.2 0 0 0</pose></link>", "apart"),
        ("<drake:damping>0 0 0</drake:damping>", "<pose>0 0 0 0 0 0</pose>", "<pose>"),
        ("<drake:child>b<", "<drake:child>c<", "found the frame 'm::c'"),
    ],
)
def test_faulty_drake_joint_in_sdf(old, new, said, tmp_path):
    complains(write(tmp_path, PLANAR.replace(old, new), "m.sdf"), said, driven())
