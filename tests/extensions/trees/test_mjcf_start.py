"""Where models start: keyframes and joint values as MuJoCo has them, assembled onto the closures;
what is driven and held; rods; includes and replicates.
"""

import numpy as np
import pytest
from kincheck.core.case.models.files import load
from kincheck.core.extensions.trees.driving import read_start
from kincheck.core.extensions.trees.reader import read_tree

from ...support.case_texts import complains, refused
from ...support.examples import examples
from ...support.mjcf_models import agree, model, mujoco, stands_as
from ...support.model_files import driven
from ...support.model_poses import EXACT, near, solution

START_FAULTS, RODS, INCLUDES = examples(__file__, "start_faults", "rods", "includes")

ALL_KINDS = """<mujoco><compiler angle="degree" eulerseq="zyx"/><worldbody>
  <body name="base" pos="1 2 3" euler="10 20 30"><freejoint name="root"/>
    <body name="arm" pos="0.1 0 0.2" euler="0 40 0"><joint name="turn" axis="1 2 2" pos="0.1 0 0" ref="30"/>
      <frame pos="0 0 0.1" euler="0 0 20"><joint name="push" type="slide" axis="0 1 1"/></frame>
      <body name="hand" pos="0.3 0 0" euler="50 0 0"><joint name="wrist" type="ball" pos="0 0.1 0"/>
        <site name="tip" pos="0 0 0.2"/></body></body></body>
  <body name="other" pos="0 1 0"><joint name="lone" axis="0 1 0"/></body>
</worldbody><keyframe><key name="bent" qpos="0.5 1 2 0.5 -0.5 0.5 0.5 0.9 0.2 0.6 0.8 0 0 -0.4"/></keyframe>
</mujoco>"""  # noqa: E501


@pytest.mark.parametrize("said", [("keyframe:bent",), ("keyframe:bent", "push=-0.1", "lone=0.7")])
def test_start_pose_matches_mujoco(tmp_path, said):
    file = model(tmp_path, ALL_KINDS)
    tree = read_tree(file)
    there = read_start(tree, said).pose.as_tree()
    loaded = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(loaded)
    data.qpos[:] = loaded.key("bent").qpos
    for each in said[1:]:
        name, value = each.split("=")
        data.joint(name).qpos[:] = float(value)
    mujoco.mj_kinematics(loaded, data)
    places = {name: there.moving[name] for name in tree.places if name in there.moving}
    assert len(places) == 4
    for name, place in places.items():
        assert stands_as(place, data.body(name))
    assert near([*there.sites["tip"][1].at], data.site("tip").xpos)
    for name in ("turn", "push", "lone"):
        assert there.joints[name].value == pytest.approx(data.joint(name).qpos[0], abs=EXACT)


@pytest.mark.parametrize("start", START_FAULTS)
def test_start_faults(tmp_path, start):
    tree = read_tree(model(tmp_path, ALL_KINDS))
    refused(lambda: read_start(tree, start.split()), f"--start ... {START_FAULTS[start]}")


# A parallelogram of 1 m and 0.5 m whose sites miss each other by a part of a metre.
def parallelogram(gap, digits="0.5123456"):
    return f"""<mujoco><compiler angle="radian"/><worldbody>
      <body name="a"><joint name="crank" axis="0 1 0"/>
        <body name="b" pos="0 0 {digits}"><joint name="knee" axis="0 1 0"/>
          <site name="b" pos="{1.0 + gap!r} 0 0"/></body></body>
      <body name="c" pos="1 0 0"><joint name="rocker" axis="0 1 0"/><site name="c" pos="0 0 {digits}"/></body>
    </worldbody><equality><connect site1="b" site2="c"/></equality></mujoco>"""  # noqa: E501


def test_open_start_is_assembled(tmp_path):
    file = model(tmp_path, parallelogram(0.01))
    case = load(file, driven("crank:0:0.2:5"))
    note, zeros = case.assembly
    assert "are at the start knee 9.66" in zeros
    assert "open by 0.01 m" in note
    assert "moved were rocker by" in note
    assert "crank by" not in note  # it is driven, and stays
    found = solution(case)
    # where the rod's end is, of both bodies
    end = case.mechanism.joint("connect1").point
    assert np.hypot(end[0] - 0.0, end[2] - 0.5123456) == pytest.approx(1.01, abs=EXACT)
    assert np.hypot(end[0] - 1.0, end[2]) == pytest.approx(0.5123456, abs=EXACT)
    assert np.allclose(found.bodies["b"].r[-1], 0.5123456 * np.array([np.sin(0.2), 0, np.cos(0.2)]))


def test_far_open_start_is_refused(tmp_path):
    file = model(tmp_path, parallelogram(0.3))
    complains(file, "open in the start  ...  by 0.3 m, expected 0.13", driven("crank:0:0.2:5"))
    # who says where a joint is lets the others find their places
    assert load(file, driven("crank:0:0.2:5", start=("crank=0",))).assembly


CHAIN = """<mujoco><compiler angle="radian"/><worldbody>
  <body name="base"><freejoint name="root"/>
    <body name="one"><joint name="one" axis="0 0 1"/>
      <body name="two" pos="1 0 0"><joint name="two" axis="0 1 0"/>
        <body name="three" pos="1 0 0"><joint name="ball" type="ball"/><site name="s"/></body></body></body>
  </body></worldbody><actuator><motor joint="two"/></actuator></mujoco>"""  # noqa: E501


def test_hold_rest_covers_all_freedoms(tmp_path):
    file = model(tmp_path, CHAIN)
    said = "11 degrees of freedom, and 1 driven or held ... --hold JOINT for 10 more"
    joints = "first: two. Ball joints: ball. Free bodies: base"
    complains(file, f"{said} ... {joints}", driven("one:0:1"))
    case = load(file, driven("one:0:1:5", hold_rest=True))
    assert [driver.name for driver in case.mechanism.drivers] == ["one", "two"]
    assert case.mechanism.body("base").fixed
    assert case.mechanism.joint("ball").type == "fixed"


def test_two_joints_driven_together(tmp_path):
    case = load(
        model(tmp_path, CHAIN),
        driven("one:0:1:5", "two:0.5:-0.3", hold=("base", "ball")),
    )
    one, two = np.linspace(0.0, 1.0, 5), np.linspace(0.5, -0.3, 5)
    assert np.allclose(case.sweep.moved["two"], two, rtol=0, atol=1e-15)
    found = solution(case).points["s"].position
    reach = 1.0 + np.cos(two)
    expected = np.stack([reach * np.cos(one), reach * np.sin(one), -np.sin(two)], axis=1)
    assert near(found, expected)
    said = "5 of 'one', 7 of 'two' samples"
    complains(tmp_path / "model.xml", said, driven("one:0:1:5", "two:0:1:7", hold_rest=True))


@pytest.mark.parametrize("kind", RODS)
def test_rod_between_balls_does_not_spin(tmp_path, kind):
    inside, equality = RODS[kind]
    free = '<body name="free" pos="0.2 0 0.3"><freejoint/></body>' * (kind == "free body")
    text = f"""<mujoco><worldbody>
      <body name="crank" pos="0.2 0 0.3"><joint name="crank" axis="0 0 1" pos="-0.2 0 0"/>{inside}</body>
      <body name="slider" pos="1 0 0"><joint name="slider" type="slide" axis="1 0 0"/></body>{free}
      </worldbody><equality>{equality}</equality></mujoco>"""  # noqa: E501
    case = load(model(tmp_path, text), driven("crank:0:0.5:4"))
    assert "turn about itself" in case.source
    turned = np.linspace(0.0, 0.5, 4)
    x, y, z = 0.2 * np.cos(turned), 0.2 * np.sin(turned), 0.3
    slid = x + np.sqrt(0.8**2 + 0.3**2 - y**2 - z**2)
    assert near(solution(case).points["slider"].position[:, 0], slid)


def test_rods_in_series_count_freedoms(tmp_path):
    """The one that cannot be a distance is kept from turning about itself by a row."""
    text = """<mujoco><worldbody>
      <body name="crank"><joint name="crank" axis="0 0 1"/>
        <body name="first" pos="0.2 0 0"><joint name="f" type="ball"/>
          <body name="second" pos="0 0 0.5"><joint name="s" type="ball"/></body></body></body>
      <body name="end" pos="0.2 0 1"><joint name="x" type="slide"/><joint name="y" type="slide" axis="0 1 0"/>
        <joint name="z" type="slide" axis="0 0 1"/></body>
      </worldbody><equality><connect body1="second" body2="end" anchor="0.1 0 0.5"/></equality></mujoco>"""  # noqa: E501
    file = model(tmp_path, text)
    # crank and three slides; the middle ball of the rods moves on a circle: one more
    complains(file, "the model has 5 degrees of freedom", driven("crank:0:0.1:3"))


def test_include_and_replicate_match_mujoco(tmp_path):
    (tmp_path / "parts").mkdir()
    leg = (
        '<mujocoinclude><body name="leg" pos="0 0 1"><joint name="hip"/>'
        '<site name="foot" type="capsule" size="0.1" fromto="0 0 0 1 2 3"/></body></mujocoinclude>'
    )
    model(tmp_path / "parts", leg, "leg.xml")
    text = """<mujoco><compiler angle="degree"/><worldbody>
      <body name="hub"><joint name="hub"/><include file="parts/leg.xml"/>
      <replicate count="12" offset="0.5 0.1 0" euler="0 30 90" sep="-">
        <body name="arm" pos="0.5 0 0">
        <joint name="j" axis="0 1 0"/><site name="s" pos="0 1 0"/></body></replicate></body>
      </worldbody></mujoco>"""
    file = model(tmp_path, text)
    tree = agree(file)
    spec = mujoco.MjSpec.from_file(str(file))  # the parser alone, before it is compiled
    assert {body.name for body in spec.bodies} == {*tree.places}
    assert len(tree.joints) == spec.compile().njnt


def test_include_from_folder_beside_model(tmp_path):
    (tmp_path / "leg").mkdir()
    (tmp_path / "scene").mkdir()
    part = '<mujocoinclude><body name="b"><joint name="j"/></body></mujocoinclude>'
    model(tmp_path / "scene", part, "part.xml")
    text = '<mujoco><worldbody><include file="../scene/part.xml"/></worldbody></mujoco>'
    tree = read_tree(model(tmp_path / "leg", text))
    assert [*tree.joints] == ["j"]


@pytest.mark.parametrize("include", INCLUDES)
def test_include_from_elsewhere_is_refused(tmp_path, include):
    folder = tmp_path / "robots" / "inside"
    folder.mkdir(parents=True)
    (tmp_path / "outside.xml").write_text("<mujoco/>")
    (folder.parent / "notes.txt").write_text("<mujoco/>")
    (folder / "link.xml").symlink_to(tmp_path / "outside.xml")
    file = model(folder, f'<mujoco><include file="{include}"/><worldbody/></mujoco>')
    complains(file, INCLUDES[include], driven())
