"""Masses of models: those of MuJoCo itself, of URDF and SDF alike, and what is not read of them."""

import re
from functools import partial

import kincheck.cases
import numpy as np
import pytest
from kincheck.adapters.writers import mjcf, sdf
from kincheck.core.algebra import vec
from kincheck.core.case.models.files import load
from kincheck.core.extensions.exports.model_writer import written
from kincheck.core.extensions.trees.reader import read_tree
from kincheck.core.extensions.trees.tree import Mass, sum_of_masses
from kincheck.core.kinematics import NativeSolver
from kincheck.core.mechanism.body import inertia_matrix

from ...support.case_texts import complains, write
from ...support.examples import examples
from ...support.model_files import driven, edited

WEIGHED, SETTINGS = examples(__file__, "weighed", "settings")

mujoco = pytest.importorskip("mujoco")

# Sums of some ten masses in metre-sized frames.
EXACT = 1e-12
near = partial(np.allclose, rtol=0, atol=EXACT)


@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS)
def test_mjcf_masses_match_mujoco(tmp_path, settings):
    file = edited(tmp_path, WEIGHED, ("<default>", settings + "<default>"))
    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    tree = read_tree(file)
    assert not tree.unweighed
    for joint, k in zip(tree.moves.values(), model.jnt_bodyid, strict=True):
        parts = []
        for body in np.flatnonzero(model.body_weldid == k):
            axes = data.ximat[body].reshape(3, 3)
            inertia = axes @ np.diag(model.body_inertia[body]) @ axes.T
            parts.append(Mass(model.body_mass[body], vec(data.xipos[body]), inertia))
        theirs = sum_of_masses(parts)
        ours = sum_of_masses(tree.masses[joint.inner]).in_frame(tree.moving[joint.inner])
        assert ours.mass == pytest.approx(theirs.mass, rel=EXACT)
        assert near([*ours.center], [*theirs.center])
        size = np.abs(theirs.inertia).max()
        assert np.allclose(ours.inertia, theirs.inertia, rtol=0, atol=EXACT * size)


MJCF = """<mujoco><compiler angle="radian" eulerseq="XYZ"/><worldbody><body name="arm" pos="0 0 1" euler="0.1 0.2 0.3"><joint name="J" axis="0 1 0"/>
<inertial pos="0.5 0.1 0.2" mass="2" fullinertia="0.4 0.5 0.6 0.01 0.02 0.03"/>
<body name="tip" pos="1 0 0"><inertial pos="0.1 0 0" euler="0 0 0.5" mass="1" diaginertia="0.1 0.2 0.25"/></body></body></worldbody></mujoco>"""  # noqa: E501
URDF = """<robot name="r"><link name="base"/>
<link name="arm"><inertial><origin xyz="0.5 0.1 0.2"/><mass value="2"/>
<inertia ixx="0.4" iyy="0.5" izz="0.6" ixy="0.01" ixz="0.02" iyz="0.03"/></inertial></link>
<link name="tip"><inertial><origin xyz="0.1 0 0" rpy="0 0 0.5"/><mass value="1"/><inertia ixx="0.1" iyy="0.2" izz="0.25"/></inertial></link>
<joint name="J" type="continuous"><parent link="base"/><child link="arm"/><origin xyz="0 0 1" rpy="0.1 0.2 0.3"/><axis xyz="0 1 0"/></joint>
<joint name="t" type="fixed"><parent link="arm"/><child link="tip"/><origin xyz="1 0 0"/></joint></robot>"""  # noqa: E501
SDF = """<sdf version="1.11"><world name="w"><gravity>0 0 -9.81</gravity><model name="m">
<link name="arm"><pose>0 0 1 0.1 0.2 0.3</pose><inertial><pose>0.5 0.1 0.2 0 0 0</pose><mass>2</mass>
<inertia><ixx>0.4</ixx><iyy>0.5</iyy><izz>0.6</izz><ixy>0.01</ixy><ixz>0.02</ixz><iyz>0.03</iyz></inertia></inertial></link>
<link name="tip"><pose relative_to="arm">1 0 0 0 0 0</pose><inertial><pose>0.1 0 0 0 0 0.5</pose><mass>1</mass>
<inertia><ixx>0.1</ixx><iyy>0.2</iyy><izz>0.25</izz></inertia></inertial></link>
<joint name="J" type="revolute"><parent>world</parent><child>arm</child><axis><xyz>0 1 0</xyz></axis></joint>
<joint name="t" type="fixed"><parent>arm</parent><child>tip</child></joint></model></world></sdf>"""  # noqa: E501
DRIVEN = driven("J:-0.4:0.4:5")


def case_of(tmp_path, text, supplied=DRIVEN):
    ending = {"<m": "xml", "<r": "urdf", "<s": "sdf"}[text[:2]]
    return load(write(tmp_path, text, f"robot.{ending}"), supplied)


def test_masses_agree_across_formats(tmp_path):
    cases = [case_of(tmp_path, text) for text in (MJCF, URDF, SDF)]
    bodies = [case.mechanism.body("arm") for case in cases]
    for case, body in zip(cases, bodies, strict=True):
        assert case.mechanism.gravity == (0.0, 0.0, -9.81)
        assert "with the masses of its bodies" in case.source
        assert body.mass == 3.0
        first, other = ((*x.center_of_mass, *x.inertia) for x in (bodies[0], body))
        assert near(first, other)


def test_sdf_link_without_mass_has_one(tmp_path):
    light = re.sub(r"<inertial><pose>0\.1.*?</inertial>", "", SDF, flags=re.S)
    case = case_of(tmp_path, light)
    assert case.mechanism.body("arm").mass == 3.0
    assert "masses of links without one, 1 kg each as in SDF" in case.source


@pytest.mark.parametrize("text", [URDF, SDF], ids=["urdf", "sdf"])
def test_fixed_link_with_mass_is_output(tmp_path, text):
    """Its place is asked for as that of a fixed link without a mass."""
    case = case_of(tmp_path, text)
    assert case.mechanism.point("tip").body == "arm"
    assert case.outputs[3].point == "tip"


def test_driver_effort_matches_mujoco(tmp_path):
    case = case_of(tmp_path, MJCF)
    found = NativeSolver(compiled=False).prepare(case.mechanism, case.sweep.path, forces=["J"])(
        1e-12
    )
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    data = mujoco.MjData(model)
    for angle, effort in zip(case.sweep.values, found.forces.drivers["J"], strict=True):
        data.qpos[:], data.qvel[:] = angle, 1.0
        mujoco.mj_inverse(model, data)
        assert effort == pytest.approx(data.qfrc_inverse[0], rel=0, abs=1e-11)


ROD = """<mujoco><worldbody><body name="a"><joint name="J" axis="0 1 0"/><inertial pos="0 0 1" mass="1" diaginertia="1 1 1"/>
<body name="rod" pos="0 0 2"><joint name="B" type="ball"/><inertial pos="1 0 0" mass="2" diaginertia="0.1 1 1"/></body></body>
<body name="c" pos="4 0 0"><joint name="D" axis="0 1 0"/><inertial pos="0 0 1" mass="1" diaginertia="1 1 1"/></body></worldbody>
<equality><connect body1="rod" body2="c" anchor="4 0 0"/></equality></mujoco>"""  # noqa: E501


def test_rod_mass_is_at_its_ends(tmp_path):
    """Two kilograms, a quarter of the length from its first end."""
    case = case_of(tmp_path, ROD)
    assert "moments of inertia of rods, whose masses are at their ends: rod" in case.source
    assert {body.name: body.mass for body in case.mechanism.bodies} == {"a": 2.5, "c": 1.5}
    # the rod's weight at its centre, 1 m beside the crank's pin, is lifted by both
    center = case.mechanism.body("a").center_of_mass
    assert center == pytest.approx((0.0, 0.0, (1.0 + 1.5 * 2.0) / 2.5))


START, END = MJCF.index('<inertial pos="0.5'), MJCF.index('<body name="tip"')
BOUNDED = (MJCF[:START] + MJCF[END:]).replace(
    "<compiler angle", '<compiler inertiafromgeom="false" boundinertia="1" angle'
)
UNREADABLE = {
    "a negative mass": (MJCF, 'mass="2"', 'mass="-2"'),
    "no number": (URDF, 'value="2"', 'value="heavy"'),
    "no rigid body": (URDF, 'ixx="0.4"', 'ixx="-4"'),
    "of collisions": (SDF, "<inertial><pose>0.5", '<inertial auto="true"><pose>0.5'),
    "moments without mass": (
        BOUNDED,
        'mass="1"',
        'mass="0"',
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", UNREADABLE)
def test_unreadable_mass_is_noted(tmp_path, kind):
    text, old, new = UNREADABLE[kind]
    assert old in text
    case = case_of(tmp_path, text.replace(old, new))
    assert "masses that cannot be read, of arm" in case.source


def test_mesh_has_unknown_mass(tmp_path):
    text = (
        '<mujoco><worldbody><body name="arm"><joint name="J"/><geom type="mesh" mesh="m"/></body>'
        "</worldbody></mujoco>"
    )
    case = case_of(tmp_path, text)
    assert "masses that cannot be read, of arm" in case.source
    assert case.mechanism.gravity == (0.0, 0.0, 0.0)  # as long as nothing has a mass


def test_mistyped_mass_setting_is_refused(tmp_path):
    file = edited(tmp_path, MJCF, ("<compiler", '<compiler inertiafromgeom="yes"'))
    complains(file, "inertiafromgeom: found 'yes'", DRIVEN)


STAND_INS = {"mjcf": (mjcf, ".xml"), "sdf": (sdf, ".sdf")}


@pytest.mark.parametrize(
    ("form", "edit", "masses"),
    [
        ("mjcf", ("", ""), []),
        ("sdf", ("", ""), []),
        ("sdf", ("<mass>1e-06", "<mass>2e-06"), [2e-6]),
        ("sdf", ("<ixx>1e-06", "<ixx>2e-06"), [1e-6]),
    ],
)
def test_exported_stand_ins_are_no_masses(tmp_path, form, edit, masses):
    """What kincheck writes for a mechanism without masses is read so; numbers unlike it count."""
    writer, ending = STAND_INS[form]
    text = written(load(kincheck.cases.FOLDER / "five_bar.toml"), writer.write)[ending]
    file = edited(tmp_path, text, edit, name="model" + ending)
    case = load(file, driven("left_pivot:0:0.1:3", hold_rest=True))
    assert [body.mass for body in case.mechanism.bodies if body.mass] == masses
    assert ("with the masses" in case.source) is bool(masses)


def test_inertia_in_global_axes(tmp_path):
    """A bar along x in a body turned by 90 degrees about z lies along y."""
    text = (
        '<mujoco><option gravity="0 1 0"/><worldbody><body name="arm" euler="0 0 90">'
        '<joint name="J"/><inertial pos="1 0 0" mass="1" diaginertia="0.1 1 1"/></body>'
        "</worldbody></mujoco>"
    )
    case = case_of(tmp_path, text)
    body = case.mechanism.body("arm")
    assert near(body.center_of_mass, [0, 1, 0])
    assert near(inertia_matrix(body.inertia), np.diag([1, 0.1, 1]))
    assert case.mechanism.gravity == (0.0, 1.0, 0.0)


def test_settotalmass_leaves_masses_unread(tmp_path):
    """It scales all of them, below a kilogram too; zero or less is MuJoCo's word for none."""
    for total, unread in (("0.5", True), ("-1", False)):
        file = edited(tmp_path, WEIGHED, ("<compiler ", f'<compiler settotalmass="{total}" '))
        assert bool(read_tree(file).unweighed) is unread
