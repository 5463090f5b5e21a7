"""Models of robots as public projects write them: white space, names and joints of what stands
still.
"""

import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.io.readers import LEFT_OUT
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError

DRIVE = Supplied(drive=("hinge:0:0.1:2",), hold_rest=True)
ARM = '<body name="arm"><joint name="hinge"/></body>'
SDF_ARM = """<link name="arm"/><joint name="hinge" type="revolute"><parent>world</parent>
<child>arm</child><axis/></joint>"""


def read(tmp_path, text, name, supplied=DRIVE):
    file = tmp_path / name
    file.write_text(text)
    return load(file, supplied)


def test_xml_declaration_after_white_space(tmp_path):
    text = f"""
 <?xml version="1.0" encoding="UTF-8"?>
<mujoco><worldbody>{ARM}</worldbody><x/></mujoco>"""
    with pytest.raises(CaseError, match="line 3: <x>"):
        read(tmp_path, text, "arm.xml")
    assert read(tmp_path, text.replace("<x/>", ""), "arm.xml").mechanism.joints


def test_mjcf_fixed_body_named_ground(tmp_path):
    text = f"""<mujoco><worldbody><body name="ground" pos="1 0 0">{ARM}</body>{{}}</worldbody>
<equality><connect body1="ground" body2="arm" anchor="0 0 0"/></equality></mujoco>"""
    case = read(tmp_path, text.format(""), "arm.xml")
    assert case.mechanism.joint("hinge").bodies == ("ground", "arm")
    assert case.mechanism.body("arm").origin == (1.0, 0.0, 0.0)
    moving = text.format('<body name="x"><joint/><body name="ground"/></body>')
    with pytest.raises(CaseError, match="rename the body"):
        read(tmp_path, moving.replace('"ground" pos', '"base" pos'), "arm.xml")


def test_constraints_between_fixed_bodies_are_omitted(tmp_path):
    text = f"""<mujoco><worldbody>{ARM}<body name="a"/><body name="b" mocap="true"/></worldbody>
<equality><weld body1="a" body2="b"/><connect body1="a" anchor="0 0 0"/></equality></mujoco>"""
    case = read(tmp_path, text, "arm.xml")
    assert "equalities of what stands still (2)" in case.source.split(LEFT_OUT)[1]
    text = f"""<sdf version="1.9"><world name="w"><model name="cart"><static>1</static>
<link name="a"/><link name="b"/><joint name="wheel" type="ball"><parent>a</parent><child>b</child>
</joint></model><model name="m">{SDF_ARM}</model></world></sdf>"""
    case = read(tmp_path, text, "arm.sdf", Supplied(drive=("m::hinge:0:0.1:2",)))
    assert "joints of what stands still (1)" in case.source.split(LEFT_OUT)[1]


def test_urdf_world_without_link(tmp_path):
    text = """<robot name="r"><link name="base"/><link name="arm"/><joint name="foot" type="fixed">
<parent link="world"/><child link="base"/><origin xyz="0 0 2"/></joint>
<joint name="hinge" type="continuous"><parent link="base"/><child link="arm"/></joint></robot>"""
    case = read(tmp_path, text, "arm.urdf")
    assert case.mechanism.body("arm").origin == (0.0, 0.0, 2.0)


def test_mjcf_joints_at_one_place(tmp_path):
    """Rounding of a composed place is no gap of a tenth of the model."""
    text = """<mujoco><worldbody><body name="arm" pos="0.1 0.2 0.3" euler="1 2 3">
<joint name="hinge"/><body name="tip" pos="-0.1 -0.2 -0.3">
<joint name="other" pos="0.1 0.2 0.3"/></body></body>
</worldbody><equality><weld body1="tip" body2="arm"/></equality></mujoco>"""
    assert read(tmp_path, text, "arm.xml").mechanism.joints


def test_sdf_message_states_element(tmp_path):
    text = '<sdf version="1.9"><model name="m"><link name="a"/><static>1</static></model></sdf>'
    with pytest.raises(CaseError, match="line 1: <sdf>: has no body with a joint"):
        read(tmp_path, text, "still.sdf")
