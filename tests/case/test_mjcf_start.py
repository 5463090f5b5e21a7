"""Where models start: keyframes and joint values as MuJoCo has them, assembled onto the closures;
what is driven and held; rods; includes and replicates.
"""

import numpy as np
import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load, read_tree
from kincheck.core.case.models.trees.driving import read_start
from kincheck.core.errors import CaseError
from kincheck.core.kinematics import NativeSolver

from ..support.model_files import driven

mujoco = pytest.importorskip("mujoco")

# Composed frames of metre-sized models, some operations deep.
EXACT = 1e-13
BODY = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'


def written(tmp_path, text, name="model.xml"):
    file = tmp_path / name
    file.write_text(text.replace("<geom/>", BODY))
    return file


def solved(case):
    names = tuple(body.name for body in case.mechanism.moving)
    solver = NativeSolver(compiled=False).prepare(
        case.mechanism, case.sweep.path, bodies=names, points=case.points
    )
    found = solver(1e-12)
    assert found.solved.all(), found.message
    return found


ALL_KINDS = """<mujoco><compiler angle="degree" eulerseq="zyx"/><worldbody>
  <body name="base" pos="1 2 3" euler="10 20 30"><freejoint name="root"/><geom/>
    <body name="arm" pos="0.1 0 0.2" euler="0 40 0"><joint name="turn" axis="1 2 2" pos="0.1 0 0" ref="30"/>
      <frame pos="0 0 0.1" euler="0 0 20"><joint name="push" type="slide" axis="0 1 1"/></frame><geom/>
      <body name="hand" pos="0.3 0 0" euler="50 0 0"><joint name="wrist" type="ball" pos="0 0.1 0"/><geom/>
        <site name="tip" pos="0 0 0.2"/></body></body></body>
  <body name="other" pos="0 1 0"><joint name="lone" axis="0 1 0"/><geom/></body>
</worldbody><keyframe><key name="bent" qpos="0.5 1 2 0.5 -0.5 0.5 0.5 0.9 0.2 0.6 0.8 0 0 -0.4"/></keyframe>
</mujoco>"""  # noqa: E501


@pytest.mark.parametrize("said", [("keyframe:bent",), ("keyframe:bent", "push=-0.1", "lone=0.7")])
def test_start_pose_matches_mujoco(tmp_path, said):
    file = written(tmp_path, ALL_KINDS)
    tree = read_tree(file)
    there = read_start(tree, said).pose.as_tree()
    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    data.qpos[:] = model.key("bent").qpos
    for each in said[1:]:
        name, value = each.split("=")
        data.joint(name).qpos[:] = float(value)
    mujoco.mj_kinematics(model, data)
    for name, place in there.moving.items():
        if name in tree.places:
            assert np.allclose([*place.at], data.body(name).xpos, rtol=0, atol=EXACT)
            turned = np.abs([*place.turn] @ data.body(name).xquat)
            assert turned == pytest.approx(1.0, abs=EXACT)
    assert np.allclose([*there.sites["tip"][1].at], data.site("tip").xpos, rtol=0, atol=EXACT)
    for name in ("turn", "push", "lone"):
        assert there.joints[name].value == pytest.approx(data.joint(name).qpos[0], abs=EXACT)


@pytest.mark.parametrize(
    ("said", "fragments"),
    [
        (("keyframe:bend",), ["'keyframe:bend'", "did you mean 'bent'?"]),
        (("keyframe:bent", "keyframe:0"), ["2 keyframes"]),
        (("push=far",), ["'far' for 'push'", "1 finite number"]),
        (("wrist=1,0,0",), ["a ball joint", "4 finite numbers"]),
        (("wrist=0,0,0,0",), ["quaternion of 'wrist' is zero"]),
        (("pull=1",), ["'pull'", "expected a joint; "]),
        (("push",), ["say the value"]),
        (("push=1", "push=2"), ["twice"]),
    ],
)
def test_start_faults(tmp_path, said, fragments):
    file = written(tmp_path, ALL_KINDS)
    tree = read_tree(file)
    with pytest.raises(CaseError) as caught:
        read_start(tree, said)
    assert [each for each in ["--start", *fragments] if each not in str(caught.value)] == []


# A parallelogram of 1 m and 0.5 m whose sites miss each other by a part of a metre.
def parallelogram(gap, digits="0.5123456"):
    return f"""<mujoco><compiler angle="radian"/><worldbody>
      <body name="a"><joint name="crank" axis="0 1 0"/><geom/>
        <body name="b" pos="0 0 {digits}"><joint name="knee" axis="0 1 0"/><geom/>
          <site name="b" pos="{1.0 + gap!r} 0 0"/></body></body>
      <body name="c" pos="1 0 0"><joint name="rocker" axis="0 1 0"/><geom/><site name="c" pos="0 0 {digits}"/></body>
    </worldbody><equality><connect site1="b" site2="c"/></equality></mujoco>"""  # noqa: E501


def test_open_start_is_assembled(tmp_path):
    file = written(tmp_path, parallelogram(0.01))
    case = load(file, driven("crank:0:0.2:5"))
    note, zeros = case.assembly
    assert "are at the start knee 9.66" in zeros
    assert "open by 0.01 m" in note
    assert "moved were rocker by" in note
    assert "crank by" not in note  # it is driven, and stays
    found = solved(case)
    # where the rod's end is, of both bodies
    end = case.mechanism.joint("connect1").point
    assert np.hypot(end[0] - 0.0, end[2] - 0.5123456) == pytest.approx(1.01, abs=EXACT)
    assert np.hypot(end[0] - 1.0, end[2]) == pytest.approx(0.5123456, abs=EXACT)
    assert np.allclose(found.bodies["b"].r[-1], 0.5123456 * np.array([np.sin(0.2), 0, np.cos(0.2)]))


def test_far_open_start_is_refused(tmp_path):
    file = written(tmp_path, parallelogram(0.3))
    with pytest.raises(CaseError, match=r"open in the start .* by 0\.3 m, expected 0\.13"):
        load(file, driven("crank:0:0.2:5"))
    # who says where a joint is lets the others find their places
    assert load(file, driven("crank:0:0.2:5", start=("crank=0",))).assembly


def test_joint_polynomial_offset_from_assembled_start(tmp_path):
    text = """<mujoco><compiler angle="radian"/><worldbody>
      <body name="a"><joint name="x" axis="0 0 1"/><geom/></body>
      <body name="b" pos="1 0 0"><joint name="y" axis="0 0 1"/><geom/><site name="tip" pos="0.5 0 0"/></body>
      </worldbody><equality><joint joint1="y" joint2="x" polycoef="0.1 0.9 0.4 -0.3 0.2"/></equality>
      </mujoco>"""  # noqa: E501
    case = load(written(tmp_path, text), driven("x:-0.4:0.6:6", start=("x=0.2",)))
    assert case.sweep.design == 0.2
    x = case.sweep.values
    y = 0.1 + x * (0.9 + x * (0.4 + x * (-0.3 + x * 0.2)))
    slope = 0.9 + x * (0.8 + x * (-0.9 + x * 0.8))
    bend = 0.8 + x * (-1.8 + x * 2.4)
    along, across = np.array([np.cos(y), np.sin(y)]), np.array([-np.sin(y), np.cos(y)])
    tip = solved(case).points["tip"]
    assert np.allclose(tip.position[:, :2].T, [[1.0], [0.0]] + 0.5 * along, rtol=0, atol=EXACT)
    assert np.allclose(tip.velocity[:, :2].T, 0.5 * slope * across, rtol=0, atol=EXACT)
    expected = 0.5 * (bend * across - slope**2 * along)
    assert np.allclose(tip.acceleration[:, :2].T, expected, rtol=0, atol=1e-12)


CHAIN = """<mujoco><compiler angle="radian"/><worldbody>
  <body name="base"><freejoint name="root"/><geom/>
    <body name="one"><joint name="one" axis="0 0 1"/><geom/>
      <body name="two" pos="1 0 0"><joint name="two" axis="0 1 0"/><geom/>
        <body name="three" pos="1 0 0"><joint name="ball" type="ball"/><geom/><site name="s"/></body></body></body>
  </body></worldbody><actuator><motor joint="two"/></actuator></mujoco>"""  # noqa: E501


def test_hold_rest_covers_all_freedoms(tmp_path):
    file = written(tmp_path, CHAIN)
    with pytest.raises(CaseError) as caught:
        load(file, driven("one:0:1"))
    message = str(caught.value)
    assert "11 degrees of freedom, and 1 driven or held" in message
    assert "--hold JOINT for 10 more" in message
    assert "first: two. Ball joints: ball. Free bodies: base" in message
    case = load(file, driven("one:0:1:5", hold_rest=True))
    assert [driver.name for driver in case.mechanism.drivers] == ["one", "two"]
    assert case.mechanism.body("base").fixed
    assert case.mechanism.joint("ball").type == "fixed"


def test_two_joints_driven_together(tmp_path):
    case = load(
        written(tmp_path, CHAIN),
        driven("one:0:1:5", "two:0.5:-0.3", hold=("base", "ball")),
    )
    one, two = np.linspace(0.0, 1.0, 5), np.linspace(0.5, -0.3, 5)
    assert np.allclose(case.sweep.moved["two"], two, rtol=0, atol=1e-15)
    found = solved(case).points["s"].position
    reach = 1.0 + np.cos(two)
    expected = np.stack([reach * np.cos(one), reach * np.sin(one), -np.sin(two)], axis=1)
    assert np.allclose(found, expected, rtol=0, atol=EXACT)
    with pytest.raises(CaseError, match="5 of 'one', 7 of 'two' samples"):
        load(tmp_path / "model.xml", driven("one:0:1:5", "two:0:1:7", hold_rest=True))


RODS = {
    "ball and connect": (
        '<body name="rod"><joint name="b" type="ball"/><geom/></body>',
        '<connect body1="rod" body2="slider" anchor="0.8 0 -0.3"/>',
    ),
    "free body": ("", '<connect body1="free" anchor="0 0 0" body2="crank"/>'
     '<connect body1="free" body2="slider" anchor="0.8 0 -0.3"/>'),
    "with a tendon on its line": (
        '<body name="rod"><joint name="b" type="ball"/><geom/><site name="mid" pos="0.4 0 -0.15"/></body>',  # noqa: E501
        '<connect body1="rod" body2="slider" anchor="0.8 0 -0.3"/>',
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", RODS)
def test_rod_between_balls_does_not_spin(tmp_path, kind):
    inside, equality = RODS[kind]
    free = '<body name="free" pos="0.2 0 0.3"><freejoint/><geom/></body>' * (kind == "free body")
    text = f"""<mujoco><worldbody>
      <body name="crank" pos="0.2 0 0.3"><joint name="crank" axis="0 0 1" pos="-0.2 0 0"/><geom/>{inside}</body>
      <body name="slider" pos="1 0 0"><joint name="slider" type="slide" axis="1 0 0"/><geom/></body>{free}
      </worldbody><equality>{equality}</equality></mujoco>"""  # noqa: E501
    case = load(written(tmp_path, text), driven("crank:0:0.5:4"))
    assert "turn about itself" in case.source
    turned = np.linspace(0.0, 0.5, 4)
    x, y, z = 0.2 * np.cos(turned), 0.2 * np.sin(turned), 0.3
    slid = x + np.sqrt(0.8**2 + 0.3**2 - y**2 - z**2)
    assert np.allclose(solved(case).points["slider"].position[:, 0], slid, rtol=0, atol=EXACT)


def test_rods_in_series_count_freedoms(tmp_path):
    """The one that cannot be a distance is kept from turning about itself by a row."""
    text = """<mujoco><worldbody>
      <body name="crank"><joint name="crank" axis="0 0 1"/><geom/>
        <body name="first" pos="0.2 0 0"><joint name="f" type="ball"/><geom/>
          <body name="second" pos="0 0 0.5"><joint name="s" type="ball"/><geom/></body></body></body>
      <body name="end" pos="0.2 0 1"><joint name="x" type="slide"/><joint name="y" type="slide" axis="0 1 0"/>
        <joint name="z" type="slide" axis="0 0 1"/><geom/></body>
      </worldbody><equality><connect body1="second" body2="end" anchor="0.1 0 0.5"/></equality></mujoco>"""  # noqa: E501
    file = written(tmp_path, text)
    with pytest.raises(CaseError) as caught:
        load(file, driven("crank:0:0.1:3"))
    # crank and three slides; the middle ball of the rods moves on a circle: one more
    assert "the model has 5 degrees of freedom" in str(caught.value)


def test_include_and_replicate_match_mujoco(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "leg.xml").write_text(
        '<mujocoinclude><body name="leg" pos="0 0 1"><joint name="hip"/><geom/>'
        '<site name="foot" type="capsule" size="0.1" fromto="0 0 0 1 2 3"/></body></mujocoinclude>'
        .replace("<geom/>", BODY)
    )  # fmt: skip
    text = """<mujoco><compiler angle="degree"/><worldbody>
      <body name="hub"><joint name="hub"/><geom/><include file="parts/leg.xml"/>
      <replicate count="12" offset="0.5 0.1 0" euler="0 30 90" sep="-">
        <body name="arm" pos="0.5 0 0">
        <joint name="j" axis="0 1 0"/><geom/><site name="s" pos="0 1 0"/></body></replicate></body>
      </worldbody></mujoco>"""
    file = written(tmp_path, text)
    tree = read_tree(file)
    spec = mujoco.MjSpec.from_file(str(file))  # the parser alone, before it is compiled
    assert {body.name for body in spec.bodies} == {*tree.places}
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    assert len(tree.joints) == model.njnt
    for name, place in tree.places.items():
        assert np.allclose([*place.at], data.body(name).xpos, rtol=0, atol=EXACT)
    for name, (_, place) in tree.sites.items():
        assert np.allclose([*place.at], data.site(name).xpos, rtol=0, atol=EXACT)
    for name, joint in tree.joints.items():
        assert np.allclose([*joint.axis], data.joint(name).xaxis, rtol=0, atol=EXACT)


def test_include_from_folder_beside_model(tmp_path):
    (tmp_path / "leg").mkdir()
    (tmp_path / "scene").mkdir()
    part = f'<mujocoinclude><body name="b"><joint name="j"/>{BODY}</body></mujocoinclude>'
    (tmp_path / "scene" / "part.xml").write_text(part)
    text = '<mujoco><worldbody><include file="../scene/part.xml"/></worldbody></mujoco>'
    tree = read_tree(written(tmp_path / "leg", text))
    assert [*tree.joints] == ["j"]


@pytest.mark.parametrize(
    ("include", "fragments"),
    [
        ("../../outside.xml", ["'../../outside.xml'", "in the folder of the model, in one beside"]),
        ("../notes.txt", ["in the folder of the model"]),
        ("/etc/hostname", ["in the folder of the model"]),
        ("", ["in the folder of the model"]),
        ("gone.xml", ["no such file"]),
        ("model.xml", ["again", "once"]),
        ("link.xml", ["in the folder of the model"]),
    ],
)
def test_include_from_elsewhere_is_refused(tmp_path, include, fragments):
    folder = tmp_path / "robots" / "inside"
    folder.mkdir(parents=True)
    (tmp_path / "outside.xml").write_text("<mujoco/>")
    (folder.parent / "notes.txt").write_text("<mujoco/>")
    (folder / "link.xml").symlink_to(tmp_path / "outside.xml")
    file = written(folder, f'<mujoco><include file="{include}"/><worldbody/></mujoco>')
    with pytest.raises(CaseError) as caught:
        load(file, Supplied())
    assert [each for each in fragments if each not in str(caught.value)] == []
