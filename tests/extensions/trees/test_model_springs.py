"""Springs and dampers of models: efforts are those of MuJoCo's inverse dynamics."""

from pathlib import Path

import numpy as np
import pytest
from kincheck.core.case.io.readers import LEFT_OUT
from kincheck.core.case.models.files import load
from kincheck.core.mechanism.loads import SpringDamper, TorsionSpringDamper

from ...support.loads import solved
from ...support.model_files import driven

# All terms of the efforts are below 100 N or N m; the spring of the slide acts from 250 m behind
# it, whose last digit is 6e-14 m at 90 N/m.
EXACT = 1e-11

TREE = """<mujoco><compiler angle="{angle}"/><option gravity="1 2 -9"/><worldbody>
<body name="arm" pos="0.1 0.2 0.3" euler="{turn}"><joint name="hinge" axis="1 2 2" pos="0.1 0 0"
 ref="{ref}" springref="{rest}" stiffness="40" damping="3"/>
<inertial pos="0.1 0.2 0" mass="2" diaginertia="0.1 0.2 0.25"/>
<body name="sled" pos="1 0 0"><joint name="slide" type="slide" axis="1 -1 0" ref="0.2"
 springref="-0.4" stiffness="90" damping="5"/>
<inertial pos="0 0 0.2" mass="1" diaginertia="0.1 0.1 0.1"/><site name="there" pos="0 1 1"/></body>
</body><site name="here" pos="1 1 0"/></worldbody>
<tendon><spatial name="cord" {cord}><site site="here"/><site site="there"/></spatial></tendon>
</mujoco>"""
DEGREES = {"angle": "degree", "turn": "20 30 40", "ref": "30", "rest": "-50"}
DRIVE = driven("hinge:0.2:1:4", "slide:-0.3:0.5:4")


@pytest.mark.parametrize(
    "cord", ['stiffness="20" damping="2" springlength="0.7"', 'damping="2" stiffness="0"', ""]
)
def test_spring_efforts_match_mujoco(tmp_path, cord):
    mujoco = pytest.importorskip("mujoco")
    file = tmp_path / "model.xml"
    file.write_text(TREE.format(cord=cord, **DEGREES))
    case = load(file, DRIVE)
    assert len(case.mechanism.forces) == 2 + bool(cord)
    forces = solved(case.mechanism, case).forces
    assert forces is not None
    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    hinge = case.sweep.values
    # the slide goes as far as the hinge's share of its way
    data.qvel[:] = 1.0, 0.8 / np.ptp(hinge)
    for k, angle in enumerate(hinge):
        data.qpos[:] = angle, np.interp(angle, [hinge[0], hinge[-1]], [-0.3, 0.5])
        mujoco.mj_inverse(model, data)
        here = [forces.drivers[name][k] for name in ("hinge", "slide")]
        assert np.abs(here - data.qfrc_inverse).max() < EXACT


def read(tmp_path: Path, text: str, name: str = "model.xml"):
    file = tmp_path / name
    file.write_text(text)
    case = load(file, driven("hinge:0:0.1:2", hold_rest=True))
    return case.mechanism.forces, case.source.split(LEFT_OUT)[1]


@pytest.mark.parametrize(
    ("springs", "counted"),
    [
        ('stiffness="1 2"', "springs of joints (1)"),
        ('stiffness="-1"', "springs of joints (1)"),
        ('damping="x"', "damping of joints (1)"),
        ('springdamper="1 0.5" damping="1"', "springs of joints (1), damping of joints (1)"),
    ],
)
def test_nonlinear_springs_are_left_out(tmp_path, springs, counted):
    text = f"""<mujoco><worldbody><body name="arm"><joint name="hinge" {springs}/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""
    assert read(tmp_path, text) == ((), counted)


@pytest.mark.parametrize(("flag", "left"), [("spring", 0.0), ("damper", 2.0), ("passive", None)])
def test_disabled_passive_forces_are_absent(tmp_path, flag, left):
    text = f"""<mujoco><option><flag {flag}="disable"/></option><worldbody><body name="arm">
<joint name="hinge" stiffness="2" damping="3"/></body></worldbody></mujoco>"""
    forces, _ = read(tmp_path, text)
    expected = (
        () if left is None else (TorsionSpringDamper("hinge", "hinge", left, 3.0 - 1.5 * left),)
    )
    assert forces == expected


CORD = """<mujoco><default><tendon stiffness="5"/></default><worldbody><body name="arm">
<joint name="hinge" axis="0 1 0" {joint}/><site name="tip" pos="3 4 0"/></body><site name="wall"/>
</worldbody><tendon><spatial name="cord" {cord}><site site="wall"/><site site="tip"/></spatial>
</tendon></mujoco>"""


@pytest.mark.parametrize(
    ("cord", "joint", "length"),
    [
        ("", "", 5.0),
        ('springlength="2"', 'ref="3"', 2.0),
        ('springlength="2 3"', "", None),
        ("", 'ref="3"', None),
        ('stiffness="0"', "", None),
    ],
)
def test_spring_tendon_rest_length(tmp_path, cord, joint, length):
    forces, counted = read(tmp_path, CORD.format(cord=cord, joint=joint))
    if length is None:
        assert not forces
        assert "tendon: spatial (1)" in counted
    else:
        (spring,) = forces
        assert isinstance(spring, SpringDamper)
        assert (spring.stiffness, spring.free_length) == (5.0, length)
        assert "tendon" not in counted


def test_springs_of_urdf_and_sdf(tmp_path):
    urdf = """<robot name="a"><link name="base"/><link name="arm"/>
<joint name="hinge" type="continuous"><parent link="base"/><child link="arm"/>
<dynamics damping="3" friction="1"/></joint></robot>"""
    (damper,), counted = read(tmp_path, urdf, "a.urdf")
    assert damper == TorsionSpringDamper("hinge", "hinge", 0.0, 3.0, 0.0)
    assert "friction and rotors of joints (1)" in counted
    sdf = """<sdf version="1.9"><model name="a"><link name="arm"/><link name="wheel"/>
<joint name="hinge" type="revolute"><parent>world</parent><child>arm</child><axis>
<xyz>0 1 0</xyz><dynamics><damping>3</damping><spring_stiffness>4</spring_stiffness>
<spring_reference>0.5</spring_reference></dynamics></axis></joint>
<joint name="axle" type="revolute"><parent>arm</parent><child>wheel</child><axis>
<dynamics><damping>-1</damping></dynamics></axis></joint>
<drake:linear_spring_damper name="strut"><drake:linear_spring_damper_body_A>arm
</drake:linear_spring_damper_body_A><drake:linear_spring_damper_p_AP>1 0 0
</drake:linear_spring_damper_p_AP><drake:linear_spring_damper_body_B>wheel
</drake:linear_spring_damper_body_B><drake:linear_spring_damper_p_BQ>0 2 0
</drake:linear_spring_damper_p_BQ><drake:linear_spring_damper_free_length>1.5
</drake:linear_spring_damper_free_length><drake:linear_spring_damper_stiffness>7
</drake:linear_spring_damper_stiffness></drake:linear_spring_damper></model></sdf>"""
    forces, counted = read(tmp_path, sdf, "a.sdf")
    assert forces == (
        TorsionSpringDamper("hinge", "hinge", 4.0, 3.0, 0.5),
        SpringDamper("strut", "arm", "wheel", ((1, 0, 0), (0, 2, 0)), 7.0, 0.0, 1.5),
    )
    assert "dynamics of joints (1)" in counted
    (hinge,), counted = read(tmp_path, sdf.replace(">7\n", ">0\n"), "a.sdf")
    assert hinge.name == "hinge"
    assert "drake:linear_spring_damper (1)" in counted
