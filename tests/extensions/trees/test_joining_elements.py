"""What joins links and is not read stops a model by name; extensions that join nothing do not."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kincheck import adapters
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.io.readers import LEFT_OUT
from kincheck.core.case.measures import DriverEffort
from kincheck.core.case.models.files import load
from kincheck.core.case.quantity import with_markers
from kincheck.core.extensions.trees.mjcf_language import require_known_attributes
from kincheck.core.extensions.xml.element import parse_xml
from kincheck.core.harness.compare import output_series

from ...support.case_texts import complains, refused, write
from ...support.examples import examples
from ...support.model_files import driven, edited
from ...support.model_poses import EXACT, coordinate, solution

LOOPS, JOINING, JOINING_IN_SDF, JOINING_IN_MJCF, APART, WITHOUT = examples(
    __file__, "loops", "joining", "joining_in_sdf", "joining_in_mjcf", "apart", "without"
)
MISTYPED, MISTYPED_IN_URDF, MISTYPED_IN_MJCF = examples(
    __file__, "mistyped", "mistyped_in_urdf", "mistyped_in_mjcf"
)

DRIVE = driven("drive:-0.2:0.2:5", hold_rest=True)
HINGE = '<joint name="{}" type="continuous"><parent link="{}"/><child link="{}"/>{}</joint>'
GATE = (
    '<robot name="gate" xmlns:drake="http://drake.mit.edu"><link name="base"/><link name="swing"/>'
    '<link name="strut"/><link name="follower"/>'
    + HINGE.format("drive", "base", "swing", '<axis xyz="0 1 0"/>')
    + HINGE.format("pin", "swing", "strut", '<origin xyz="0 0 0.25"/><axis xyz="0 1 0"/>')
    + HINGE.format("pivot", "base", "follower", '<origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>')
    + "{}</robot>"
)
IN_SDF = """<sdf version="1.9" xmlns:drake="http://drake.mit.edu"><model name="gate">
<link name="swing"/><link name="strut"><pose>0 0 0.25 0 0 0</pose></link>
<link name="follower"><pose>0.4 0 0 0 0 0</pose></link>
<joint name="drive" type="revolute"><parent>world</parent><child>swing</child>
<axis><xyz>0 1 0</xyz></axis></joint>
<joint name="pin" type="revolute"><parent>swing</parent><child>strut</child>
<axis><xyz>0 1 0</xyz></axis></joint>
<joint name="pivot" type="revolute"><parent>world</parent><child>follower</child>
<axis><xyz>0 1 0</xyz></axis></joint>
{}</model></sdf>"""


IN_MJCF = """<mujoco><option gravity="0 0 -1"/><default><geom density="1"/></default><worldbody>
<body name="a"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint name="drive"/>
<geom name="g" size="0.1"/><body name="b" pos="1 0 0"><joint name="pin"/>
<geom size="0.1" pos="1 0 0"/></body></body></worldbody>
<contact><exclude body1="a" body2="b"/></contact>
<sensor><framepos objtype="body" objname="a" reftype="body" refname="b"/></sensor>{}</mujoco>"""
BASES = {"gate.urdf": GATE, "gate.sdf": IN_SDF, "model.xml": IN_MJCF}


def read(folder: Path, text: str, name: str = "gate.urdf", supplied: Supplied = DRIVE):
    return load(write(folder, text, name), supplied)


def read_inside(folder: Path, inside: str, name: str = "gate.urdf", supplied: Supplied = DRIVE):
    """Read a model with further elements inside."""
    return read(folder, BASES[name].format(inside), name, supplied)


def follower_angles() -> np.ndarray:
    """The follower of the four-bar, by the circles of its coupler's end: a crank of 0.25 at the
    origin, a coupler of (0.3, 0.2), and a follower at x = 0.4 whose end is at (-0.1, 0.45).
    """
    angle = np.linspace(-0.2, 0.2, 5)
    pin = 0.25 * np.exp(1j * (np.pi / 2 - angle))  # x and z, as complex numbers
    back = pin - 0.4
    size, rod, arm = np.abs(back), np.hypot(0.3, 0.2), np.hypot(0.1, 0.45)
    along = (size**2 + arm**2 - rod**2) / (2.0 * size)
    end = back / size * (along - 1j * np.sqrt(arm**2 - along**2))
    return np.angle(-0.1 + 0.45j) - np.angle(end)


@pytest.mark.parametrize("loop", LOOPS.values(), ids=LOOPS)
def test_gazebo_or_drake_loop_closes(loop, tmp_path):
    case = read_inside(tmp_path, loop)
    turned = coordinate(case, solution(case), "pivot")
    expected = follower_angles()
    assert turned == pytest.approx(expected, abs=EXACT)
    assert expected[[0, -1]] == pytest.approx([-0.10101, 0.090703], abs=5e-6)


@pytest.mark.parametrize("tilt", ["0.1", "0.001"])
def test_tilted_loop_hinge_is_open(tilt, tmp_path):
    loop = LOOPS["loop_joint with an axis"].replace(
        'link2 link="follower"', f'link2 link="follower" rpy="{tilt} 0 0"'
    )
    refused(lambda: read_inside(tmp_path, loop), "'c': is open")


TWO = "names the links 'strut' and 'follower', which it may join, and is not read, expected a"
JOINING_IN = {
    "gate.urdf": JOINING,
    "gate.sdf": {kind: (text, TWO) for kind, text in JOINING_IN_SDF.items()},
    "model.xml": JOINING_IN_MJCF,
}


@pytest.mark.parametrize(
    ("name", "kind"), [(name, kind) for name, table in JOINING_IN.items() for kind in table]
)
def test_element_joining_links_is_refused(name, kind, tmp_path):
    text, said = JOINING_IN[name][kind]
    refused(
        lambda: read_inside(tmp_path, text, name), f"{tmp_path / name}: line  ... : < ... {said}"
    )


@pytest.mark.parametrize(
    "link",
    [
        '<link name="strut"><welded to="follower"/></link>',
        '<link name="strut" welded_to="follower"/>',
    ],
    ids=["element", "attribute"],
)
def test_link_naming_another_is_refused(link, tmp_path):
    text = GATE.format("").replace('<link name="strut"/>', link)
    refused(lambda: read(tmp_path, text), TWO)


@pytest.mark.parametrize("text", APART.values(), ids=APART)
def test_element_joining_nothing_is_left_out(text, tmp_path):
    case = read_inside(tmp_path, text)
    assert case.source.split(LEFT_OUT)[1] not in ("", "nothing")


def test_links_named_by_numbers(tmp_path):
    numbered = GATE.replace('"strut"', '"1"').replace('"follower"', '"2"')
    read(tmp_path, numbered.format('<gazebo reference="1"><mu1>2</mu1></gazebo>'))
    tied = numbered.format("<tie><link>1</link><link>2</link></tie>")
    refused(lambda: read(tmp_path, tied), "names the links '1' and '2'")


def test_drake_screw_advances_by_pitch(tmp_path):
    screw = (
        '<link name="tip"/><drake:joint name="q" type="screw"><parent link="base"/>'
        '<child link="tip"/><axis xyz="0 1 0"/><drake:screw_thread_pitch value="0.5"/>'
        "</drake:joint>"
    )
    supplied = driven(f"q.rotation:0:{np.pi}:2", hold_rest=True)
    found = solution(read_inside(tmp_path, screw, supplied=supplied)).bodies["tip"]
    assert found.r[-1] == pytest.approx((0.0, 0.25, 0.0), abs=EXACT)


def test_plugin_repeating_mimic_is_left_out(tmp_path):
    text = GATE.format(JOINING["mimic plugin"][0] + JOINING["mimic of ros2_control"][0])
    case = read(
        tmp_path, text.replace('<origin xyz="0.4', '<mimic joint="drive"/><origin xyz="0.4')
    )
    assert [coupler.name for coupler in case.mechanism.couplers] == ["pivot.mimic"]


BUSHING = """<drake:linear_bushing_rpy name="rubber">
<drake:bushing_frameA{0}f{1}bushing_frameA>
<drake:bushing_frameC{0}g{1}bushing_frameC>
<drake:bushing_torque_stiffness{2}1 2 3{3}bushing_torque_stiffness>
<drake:bushing_torque_damping{2}0.1 0.2 0.3{3}bushing_torque_damping>
<drake:bushing_force_stiffness{2}100 200 300{3}bushing_force_stiffness>
<drake:bushing_force_damping{2}4 5 6{3}bushing_force_damping></drake:linear_bushing_rpy>"""
OF_URDF = ' name="', '"></drake:', ' value="', '"></drake:'
OF_SDF = ">", "</drake:", ">", "</drake:"
FRAMES_OF_URDF = (
    '<frame name="f" link="strut" xyz="0.3 0 0.2" rpy="0 0 {0}"/>'
    '<frame name="g" link="follower" xyz="-0.1 0.01 0.45" rpy="0 0 {1}"/>'
)
FRAMES_OF_SDF = (
    '<frame name="f" attached_to="strut"><pose>0.3 0 0.2 0 0 {0}</pose></frame>'
    '<frame name="g" attached_to="follower"><pose>-0.1 0.01 0.45 0 0 {1}</pose></frame>'
)
QUARTER = f"{np.pi / 2!r}"


def rubber(folder: Path, form: str, turned: str = QUARTER):
    """The bushing between strut and follower; all joints of the open chain are driven or held."""
    frames = (FRAMES_OF_URDF if form == "urdf" else FRAMES_OF_SDF).format(QUARTER, turned)
    text = frames + BUSHING.format(*(OF_URDF if form == "urdf" else OF_SDF))
    return read_inside(folder, text, f"gate.{form}")


@pytest.mark.parametrize("form", ["urdf", "sdf"])
def test_drake_bushing_is_read(form, tmp_path):
    case = rubber(tmp_path, form)
    (bushing,) = case.mechanism.forces
    # frames turned by a quarter about z: their x is global y; C is 0.01 along it from A
    assert np.array(bushing.axes) == pytest.approx(np.array([[0, 1, 0], [-1, 0, 0]]), abs=1e-15)
    assert bushing.point == pytest.approx((0.3, 0.01, 0.45))
    assert bushing.preload == pytest.approx((1.0, 0.0, 0.0), abs=1e-12)
    assert bushing.stiffness == (100.0, 200.0, 300.0)
    assert bushing.turning_damping == (0.1, 0.2, 0.3)
    assert any("halfway between both frames" in note for note in case.assembly)


def test_twisted_drake_bushing_leaves_motion(tmp_path):
    case = rubber(tmp_path, "urdf", f"{np.pi / 2 + 0.4!r}")
    assert not case.mechanism.forces
    assert "drake:linear_bushing_rpy (1)" in case.source
    assert any("turned against each other by 0.4 rad" in note for note in case.assembly)


# Generalized forces on both slides by Drake 1.51 (CalcGeneralizedForces, rates 1, 0).
BY_DRAKE = {
    "drive": (62.991102249156285, 53.76723589616181, 44.54336954316733),
    "held": (-135.0, -135.0, -135.0),
}


def test_drake_bushing_forces_match_drake(tmp_path):
    slide = (
        '<link name="{1}"><inertial><mass value="1"/></inertial></link><joint name="{0}"'
        ' type="prismatic"><parent link="base"/><child link="{1}"/><origin xyz="{2}"/>'
        '<axis xyz="{3}"/></joint>'
    )
    text = (
        '<robot name="r" xmlns:drake="http://drake.mit.edu"><link name="base"/>'
        + slide.format("drive", "strut", "0 0 0", "1 0 0")
        + slide.format("held", "follower", "1 0 0.2", "0 0 1")
        + FRAMES_OF_URDF.format("0.5", "0.5")
        + BUSHING.format(*OF_URDF)
        + "</robot>"
    )
    drive = driven("drive:0.05:0.2:3", hold=("held",))
    case = read(tmp_path, text, supplied=drive)
    mechanism = replace(case.mechanism, gravity=(0.0, 0.0, 0.0))
    native = adapters.engine("native")
    for name, expected in BY_DRAKE.items():
        effort = DriverEffort(name, 1e-9, 0.0, "", driver=name).bound(mechanism)
        with_effort = with_markers(mechanism, [effort])
        one = replace(case, mechanism=with_effort, outputs=(effort,), reference={})
        found = output_series(one, effort, native.solve(native.build(one), one, 1e-13)).position
        assert found == pytest.approx(-np.array(expected), abs=1e-7)


def test_mjcf_exclusions_and_sensors_join_nothing(tmp_path):
    case = read_inside(tmp_path, "", "model.xml")
    assert "contact: exclude (1), sensor: framepos (1)" in case.source
    assert case.mechanism.gravity == (0.0, 0.0, -1.0)


MISTYPED_IN = {
    "gate.sdf": MISTYPED,
    "gate.urdf": MISTYPED_IN_URDF,
    "model.xml": MISTYPED_IN_MJCF,
}


@pytest.mark.parametrize(
    ("name", "kind"), [(name, kind) for name, table in MISTYPED_IN.items() for kind in table]
)
def test_mistyped_name_is_refused(name, kind, tmp_path):
    *edit, said = MISTYPED_IN[name][kind]
    file = edited(tmp_path, BASES[name].format(""), edit, name=name)
    complains(file, f"{file}: line  ... : ... {said}", DRIVE)


def test_mjcf_attribute_of_other_release(tmp_path):
    read(tmp_path, IN_MJCF.format("").replace('name="g"', 'name="g" mystery="1"'), "model.xml")
    file = edited(tmp_path, IN_MJCF.format(""), ('"drive"', '"drive" mystery="1"'))
    complains(file, "the attribute 'mystery', which MJCF does not have here", DRIVE)


def test_all_attributes_of_mujoco_are_accepted(tmp_path):
    """Of its own schema: no attribute that is not read is taken for a mistyped one."""
    mujoco = pytest.importorskip("mujoco")
    path: list[str] = []
    found: dict[str, list[str]] = {}
    for line in mujoco.mj_printSchema(False, False).splitlines():
        if head := re.match(r"( *)(?:\(world\))?([a-z]+) \(.\)(.*)", line):
            path[len(head[1]) // 3 :] = [head[2]]
            found["/".join(path)] = head[3].split()
        elif path:
            found["/".join(path)] += line.split()
    tested = {
        **{each: each.split("/")[-1:] for each in ("mujoco/body/geom", "mujoco/body/inertial")},
        "mujoco/option": ["option"],
        "mujoco/option/flag": ["option", "flag"],
        "mujoco/default/geom": ["default", "geom"],
        "mujoco/default/tendon": ["default", "tendon"],
        "mujoco/tendon/spatial": ["tendon", "spatial"],
        "mujoco/tendon/fixed": ["tendon", "fixed"],
    }
    for schema, tags in tested.items():
        text = " ".join(f'{name}=""' for name in found[schema])
        whole = f"<{tags[-1]} {text}/>"
        for tag in reversed(tags[:-1]):
            whole = f"<{tag}>{whole}</{tag}>"
        if "body" in schema:
            whole = f"<worldbody><body>{whole}</body></worldbody>"
        require_known_attributes(parse_xml(tmp_path / "m.xml", f"<mujoco>{whole}</mujoco>"))
    assert len(found["mujoco/body/geom"]) > 30


@pytest.mark.parametrize(("text", "name", "said"), WITHOUT.values(), ids=WITHOUT)
def test_without_option_notes_element(text, name, said, tmp_path):
    case = read_inside(tmp_path, text, supplied=replace(DRIVE, without=(name,)))
    assert [joint.name for joint in case.mechanism.joints] == ["drive", "pin", "pivot"]
    assert case.assembly[0].startswith("left out by --without: ")
    assert said in case.assembly[0]


def test_without_option_refuses_unknown_name(tmp_path):
    file = write(tmp_path, GATE.format("<mujoco/>"), "gate.urdf")
    complains(file, "did you mean 'mujoco'", replace(DRIVE, without=("mujcoo",)))


def test_without_option_drops_mjcf_equality(tmp_path):
    tied = '<equality><joint name="t" joint1="drive" joint2="pin"/></equality>'
    for without in ((), ("t",)):
        case = read_inside(tmp_path, tied, "model.xml", replace(DRIVE, without=without))
        assert bool(case.mechanism.couplers) is not bool(without)


@pytest.mark.parametrize(
    "motor", ["", '<transmission name="t{0}"><joint name="j{0}"/></transmission>']
)
def test_hold_rest_asks_about_passive_joints(motor, tmp_path):
    links = '<link name="l0"/>' + "".join(
        f'<link name="l{k}"/>' + HINGE.format(f"j{k}", f"l{k - 1}", f"l{k}", "") + motor.format(k)
        for k in range(1, 41)
    )
    text = f'<robot name="r">{links}</robot>'
    supplied = driven("j1:0:1:2", hold_rest=True)
    if motor:
        assert len(read(tmp_path, text, supplied=supplied).mechanism.drivers) == 40
    else:
        file = write(tmp_path, text, "gate.urdf")
        complains(file, "39 joints without a motor, of 40  ...  --hold j2 j3 ", supplied)
