"""SDF: places in frames of each other, and links that several joints hold, against closed forms."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from kincheck.core.case.models.files import load
from kincheck.core.extensions.same.undriven import undriven_file
from kincheck.core.extensions.same.verdict import compare
from kincheck.core.extensions.trees.reader import read_tree

from ...support.case_texts import complains, refused, write
from ...support.examples import examples
from ...support.model_files import driven, edited
from ...support.model_poses import EXACT, coordinate, near, solution
from .fuzz import sdf as seeds

FAULTS, AXES, NOT_INCLUDED = examples(__file__, "faults", "axes", "not_included")

DRIVE = driven("A:0:0.5:5")
FOUR_BAR = seeds.FOUR_BAR.decode()
TYPED = seeds.TYPED.decode()


model = partial(write, name="model.sdf")


def test_loop_joint_is_driven(tmp_path):
    """It is a joint like any other."""
    file = model(tmp_path, FOUR_BAR)
    crank, loop = (solution(load(file, each)) for each in (DRIVE, driven("C:0:-0.5:5")))
    assert np.abs(crank.bodies["b"].r - loop.bodies["b"].r).max() < EXACT


def test_all_sdf_joint_types(tmp_path):
    supplied = driven("m::s:0:0.1:3", hold=("m::u.1", "m::u.2", "m::ball", "m::w.rotation"))
    case = load(
        model(tmp_path, TYPED.replace('<model name="n"><link name="base"/></model>', "")), supplied
    )
    types = {joint.name: joint.type for joint in case.mechanism.joints}
    revolute = dict.fromkeys(("m::u.1", "m::u.2", "m::w.rotation", "m::m"), "revolute")
    slides = dict.fromkeys(("m::s", "m::w.translation"), "translational")
    assert types == {**revolute, **slides, "m::ball": "fixed"}  # the ball is held
    turned = read_tree(tmp_path / "model.sdf").places["m::c"]
    assert [*turned.turn] == pytest.approx([0.8, 0, 0, 0.6])
    (thread,) = (each for each in case.mechanism.couplers if each.name == "m::w.thread")
    assert thread.radius == pytest.approx(0.01 / (2 * np.pi))  # metres for a radian
    found = solution(case)
    assert coordinate(case, found, "m::m")[2] == pytest.approx(0.2, abs=EXACT)


def test_screw_advances_by_pitch(tmp_path):
    text = """<sdf version="1.10"><model name="m"><link name="nut"/><joint name="w" type="screw">
    <parent>world</parent><child>nut</child><axis/><screw_thread_pitch>0.01</screw_thread_pitch>
    </joint></model></sdf>"""
    case = load(model(tmp_path, text), driven("w.rotation:0:6.283185307179586:3"))
    assert solution(case).bodies["nut"].r[:, 2] == pytest.approx([0, 0.005, 0.01], abs=EXACT)


CARDAN = """<sdf version="1.9"><model name="m"><link name="a"/><link name="b"/>
<joint name="A" type="revolute"><parent>world</parent><child>a</child><axis/></joint>
<joint name="U" type="universal"><parent>{}</parent><child>{}</child><axis><xyz>{}</xyz></axis>
<axis2><xyz>{}</xyz></axis2></joint></model></sdf>"""


def test_universal_joint_with_links_exchanged(tmp_path):
    """The cross stays, with its second axis first."""
    ways = ("a", "b", "1 0 0", "0 1 0"), ("b", "a", "0 1 0", "1 0 0")
    cases = [undriven_file(model(tmp_path, CARDAN.format(*way))) for way in ways]
    found = compare(*cases, {})
    assert found.verdict == "same", found.reason


@pytest.mark.parametrize(("version", "axis", "expected"), AXES.values(), ids=AXES)
def test_axis_frame_by_version_and_attribute(version, axis, expected, tmp_path):
    half = np.pi / 2
    text = f"""<sdf version="{version}"><model name="m">
    <link name="a"><pose>0 0 0 0 {half} 0</pose></link>
    <link name="b"><pose>1 0 0 0 0 {half}</pose></link>
    <joint name="j" type="revolute">
    <parent>a</parent><child>b</child><axis>{axis}</axis></joint></model></sdf>"""
    hinge = read_tree(model(tmp_path, text)).moves["j"]
    assert [*hinge.axis] == pytest.approx(expected, abs=EXACT)
    assert [*hinge.point] == pytest.approx((1, 0, 0), abs=EXACT)


def test_links_without_joint_are_free(tmp_path):
    text = FOUR_BAR.replace("<parent>world</parent>", "<parent>base</parent>")
    text = text.replace("<visual", '<visual name="w"/><visual', 1).replace(
        '<link name="a">', '<link name="base"/><link name="a">', 1
    )
    complains(file := model(tmp_path, text), "Free bodies: base", DRIVE)
    solution(load(file, replace(DRIVE, hold=("base",))))


@pytest.mark.parametrize("kind", FAULTS)
def test_sdf_fault_is_one_message(kind, tmp_path):
    *edit, said = FAULTS[kind]
    file = edited(tmp_path, FOUR_BAR, edit, name="model.sdf")
    complains(file, f"{file}: line  ... {said}", DRIVE)


@pytest.mark.parametrize("text", ['<sdf version="1.7"/>', '<sdf><model name="m"/></sdf>'])
def test_sdf_without_mechanism_is_refused(text, tmp_path):
    complains(model(tmp_path, text), "has no  ... , expected", DRIVE)


CONFIG = "<model><sdf version='1.4'>old.sdf</sdf><sdf version='1.9'>four bar.sdf</sdf></model>"
GEARS = """<sdf version="1.9"><model name="gears"><link name="frame"/>
<link name="sun"/><link name="wheel"><pose>1 0 0 0 0 0</pose></link>
<joint name="s" type="revolute"><parent>frame</parent><child>sun</child>
<axis><xyz>0 0 1</xyz></axis></joint>
<joint name="w" type="revolute"><parent>wheel</parent><child>frame</child>
<axis><xyz>0 0 SIGN</xyz></axis></joint>
<joint name="fixed" type="fixed"><parent>world</parent><child>frame</child></joint>
<joint name="gear" type="gearbox"><parent>sun</parent><child>wheel</child>
<axis><xyz>0 0 1</xyz></axis><axis2><xyz>AXIS</xyz></axis2><gearbox_ratio>3</gearbox_ratio>
<gearbox_reference_body>frame</gearbox_reference_body></joint></model></sdf>"""


@pytest.mark.parametrize(("axis", "turns"), [("0 0 1", -3.0), ("0 0 -1", 3.0)])
@pytest.mark.parametrize("sign", ["1", "-1"])
def test_gearbox_couples_turns_about_reference(axis, turns, sign, tmp_path):
    """SDF: the child turns by minus the ratio times the turn of the parent, each about its axis."""
    text = GEARS.replace("SIGN", sign).replace("AXIS", axis)
    found = solution(load(model(tmp_path, text), driven("s:0:0.5:3")))
    half = 0.5 * turns * np.array([0.0, 0.25, 0.5])
    assert np.allclose(found.bodies["wheel"].p[:, 3] / found.bodies["wheel"].p[:, 0], np.tan(half))


def test_gearbox_without_hinges_is_refused(tmp_path):
    text = GEARS.replace("SIGN", "1").replace("AXIS", "1 0 0")
    said = "<axis2>: there is no hinge between 'wheel' and 'frame'"
    complains(model(tmp_path, text), said, driven())


def test_model_placement_frame_matches_drake(tmp_path):
    """As Drake 1.51 places the links, to its printed digits."""
    text = (
        '<sdf version="1.9"><model name="m" placement_frame="v"><pose>0 0 1 0 0 0.3</pose>'
        '<link name="u"/><link name="v"><pose>1 2 5 0.3 0 0</pose></link></model></sdf>'
    )
    places = read_tree(model(tmp_path, text)).places
    assert [*places["u"].at] == pytest.approx([0.04596695, -3.53246201, -3.18564203], abs=1e-8)
    assert [*places["v"].at] == pytest.approx([0.0, 0.0, 1.0], abs=1e-15)


INCLUDED = {
    "folder with its description": "model://bars",
    "folder of that name alone": "../other",
    "file": "../bars/four bar.sdf",
    "file of a scheme": "file://../bars/four bar.sdf",
}


def including(folder: Path, uri: str, more: str = "", version: str = "1.9") -> Path:
    """A world of a four-bar in a folder beside, 2 m along x and turned a quarter about z."""
    for name, file in (("bars", "four bar.sdf"), ("other", "model.sdf")):
        (folder / name).mkdir()
        (folder / name / file).write_text(FOUR_BAR)
    (folder / "bars" / "model.config").write_text(CONFIG)
    (folder / "worlds").mkdir()
    return model(
        folder / "worlds",
        f'<sdf version="{version}"><world name="w"><include><uri>{uri}</uri><name>two</name>'
        f"<pose>2 0 0 0 0 {np.pi / 2!r}</pose>{more}</include></world></sdf>",
    )


@pytest.mark.parametrize("uri", INCLUDED.values(), ids=INCLUDED)
def test_included_model_is_placed(uri, tmp_path):
    case = load(including(tmp_path, uri), DRIVE)
    found = solution(case)
    # the pose of the include takes the place of the model's own, 1 m up and turned by 30 degrees
    pin = 2.0 * np.sin(case.sweep.values)
    expected = [np.full(5, 2.0), pin, 2.0 * np.cos(case.sweep.values)]
    assert near(found.points["B"].position, np.transpose(expected))


@pytest.mark.parametrize(("uri", "more", "said"), NOT_INCLUDED.values(), ids=NOT_INCLUDED)
def test_unreadable_include_is_refused(uri, more, said, tmp_path):
    refused(lambda: load(including(tmp_path, uri, more), DRIVE), said)


def test_include_of_other_version_is_refused(tmp_path):
    file = including(tmp_path, "model://bars", version="1.4")
    refused(lambda: load(file, DRIVE), "is of SDF 1.9, whose axes have another meaning")


def test_ring_of_includes_is_refused(tmp_path):
    text = FOUR_BAR.replace("</model>", "<include><uri>model.sdf</uri></include></model>")
    complains(model(tmp_path, text), "found more than 100 includes, or a ring of them", DRIVE)


def test_empty_moments_of_inertia_are_defaults(tmp_path):
    """As of Gazebo's four-bar, split and fixed."""
    inertia = "<ixx>2</ixx><iyy></iyy><izz>2.5</izz><ixy></ixy>"
    text = (
        '<sdf version="1.5"><model name="m"><link name="a"><inertial><mass>3</mass>'
        f"<inertia>{inertia}</inertia></inertial></link></model></sdf>"
    )
    (mass,) = read_tree(model(tmp_path, text)).masses["a"]
    assert mass.mass == 3.0
    assert mass.inertia.tolist() == [[2, 0, 0], [0, 1, 0], [0, 0, 2.5]]
