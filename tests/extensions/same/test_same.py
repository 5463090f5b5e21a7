"""kincheck same: files of one mechanism in several formats, and planted differences by hand."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from kincheck import cases
from kincheck.core import Body, JointDisplacement, Mechanism, Translational
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.extensions.exports.command import writer_of
from kincheck.core.extensions.exports.model_writer import written
from kincheck.core.extensions.same.undriven import undriven_case, undriven_file
from kincheck.core.extensions.same.verdict import compare

from ...support.case_texts import write
from ...support.examples import examples
from ...support.model_files import driven
from ...support.written_mechanisms import CASES, case
from . import converters

(SLIDER,) = examples(__file__, "slider")

LIMIT = '<limit lower="-0.2" upper="0.8" effort="5" velocity="2"/>'
MIMIC = '<mimic joint="left" multiplier="-1" offset="0.02"/>'
GRIPPER = f"""<robot name="gripper">
  <link name="base"/>
  <link name="left_link"><inertial><origin xyz="0.01 0.02 0.05"/><mass value="0.2"/>
    <inertia ixx="1e-4" iyy="1.5e-4" izz="8e-5" ixy="1e-5" ixz="0" iyz="0"/></inertial></link>
  <link name="right_link"><inertial><mass value="0.3"/>
    <inertia ixx="1e-4" iyy="1e-4" izz="8e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="left" type="revolute"><parent link="base"/><child link="left_link"/>
    <origin xyz="0.03 0 0.1" rpy="0.1 0.2 0.3"/><axis xyz="0 1 0"/>{LIMIT}</joint>
  <joint name="right" type="revolute"><parent link="base"/><child link="right_link"/>
    <origin xyz="-0.03 0 0.1" rpy="-0.1 0.2 -0.3"/><axis xyz="0 1 0"/>
    <limit lower="-0.8" upper="0.3" effort="5" velocity="2"/>{MIMIC}</joint>
</robot>"""
# A hinge's axis through its origin, seen from the other side.
REVERSED = GRIPPER.replace(
    '<axis xyz="0 1 0"/><limit lower="-0.2" upper="0.8"',
    '<axis xyz="0 -1 0"/><limit lower="-0.8" upper="0.2"',
).replace('multiplier="-1"', 'multiplier="1"')


def against(tmp_path, text, *options, first=GRIPPER):
    files = tmp_path / "a.urdf", tmp_path / "b.urdf"
    for file, each in zip(files, (first, text), strict=True):
        file.write_text(each)
    status = main(
        ["same", *map(str, files), "--json", str(out := tmp_path / "found.json"), *options]
    )
    found = json.loads(out.read_text())
    assert status == {"same": 0, "differs": 1, "not judged": 2}[found["verdict"]]
    return found


SAME = {
    "as it is": (GRIPPER, ""),
    "reversed axis": (REVERSED, "sense of left: reversed in b.urdf"),
    "limits": (GRIPPER.replace(LIMIT, ""), "lost in b.urdf: limits of left"),
    "other limits": (GRIPPER.replace('"0.8"', '"0.7"'), "limits of left: -0.2 to 0.8"),
    "effort": (GRIPPER.replace('upper="0.8" effort="5"', 'upper="0.8"'), "effort limit of left"),
    "degrees": (
        GRIPPER.replace('"-0.2" upper="0.8"', '"-11.4591559" upper="45.8366236"'),
        "as between degrees and radians",
    ),
    "mass": (GRIPPER.replace('"0.2"/>\n', '"0.25"/>\n'), "mass of left_link: 0.2 against 0.25 kg"),
    "product of inertia": (GRIPPER.replace('ixy="1e-5"', 'ixy="-1e-5"'), "inertia of left_link"),
    "centre": (GRIPPER.replace("0.01 0.02 0.05", "0.01 0.02 0.06"), "centre of mass of left_link"),
    "renamed links": (GRIPPER.replace("left_link", "finger"), ""),
}


@pytest.mark.by_day(2)
@pytest.mark.parametrize(("text", "lost"), SAME.values(), ids=SAME)
def test_same_motion_names_lost_facts(text, lost, tmp_path):
    found = against(tmp_path, text)
    assert found["verdict"] == "same", found["reason"]
    assert found["largest_m"] < 1e-15
    assert found["freedoms"] == [1, 1]
    assert lost in "; ".join(found["lost"])
    assert bool(found["lost"]) == bool(lost)


def test_radians_for_degrees_are_named(tmp_path):
    degrees, unit = SAME["degrees"]
    assert unit in "; ".join(against(tmp_path, GRIPPER, first=degrees)["lost"])


DIFFERENT = {
    "no mimic": (GRIPPER.replace(MIMIC, ""), "freedom 1 against 2: right.mimic in a.urdf only"),
    "sense of the mimic": (GRIPPER.replace('"-1"', '"1"'), "right.mimic"),
    "offset of the mimic": (GRIPPER.replace('"0.02"/>', '"0.03"/>'), "right.mimic"),
    "axis by a microradian": (GRIPPER.replace('"0 1 0"', '"1e-6 1 0"', 1), "left of b.urdf"),
    "hinge by 0.1 mm": (GRIPPER.replace('="0.03 0', '="0.0301 0'), "left of b.urdf"),
    "millimetres": (
        GRIPPER.replace("0.03 0 0.1", "30 0 100"),
        "1000 times those of a.urdf, as between metres and millimetres",
    ),
}


@pytest.mark.parametrize(("text", "reason"), DIFFERENT.values(), ids=DIFFERENT)
def test_different_motion_names_joint_and_place(text, reason, tmp_path):
    found = against(tmp_path, text)
    assert found["verdict"] == "differs"
    assert reason in found["reason"]
    assert found["largest_m"] > 1e-9


def test_moved_base_is_placement(tmp_path):
    moved = GRIPPER.replace('<link name="base"/>', '<link name="root"/><link name="base"/>')
    moved = moved.replace(
        "</robot>",
        '<joint name="mount" type="fixed"><parent link="root"/><child link="base"/>'
        '<origin xyz="1 2 3" rpy="0 0 0.5"/></joint></robot>',
    )
    found = against(tmp_path, moved)
    assert found["verdict"] == "same"
    assert "turned by 0.5 rad and moved by (1, 2, 3) m" in found["notes"][-1]


def test_unmatched_links_are_not_judged(tmp_path):
    text = GRIPPER.replace("left_link", "x").replace("right_link", "y")
    twins = text.replace(MIMIC, "").replace("0.03 0 0.1", "0.04 0 0.1")
    twins = twins.replace("-0.04", "-0.03").replace('rpy="-0.1 0.2 -0.3"', 'rpy="0 0 0"')
    first = GRIPPER.replace(MIMIC, "")
    found = against(tmp_path, twins, first=first)
    assert found["verdict"] == "not judged"
    assert "--match LINK=LINK" in found["reason"]
    options = ["--match", "left_link=x", "--match", "right_link=y"]
    assert against(tmp_path, twins, *options, first=first)["verdict"] == "differs"


def wedges():
    """Slides alone: in MJCF and SDF a body shares its mass with a link that is welded to it."""
    solid = {"mass": 2.0, "center_of_mass": (0.1, 0.2, 0.3), "inertia": (1, 2, 2.5, 0, 0.1, 0)}
    slides = [
        Translational("across", "low", "ground", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        Translational("up", "ground", "high", (0.4, 0.5, 0.0), (0.0, 1.0, 0.0)),
        Translational("slope", "high", "low", (0.2, 0.3, 0.0), (2.0, 1.0, 0.0)),
    ]
    driver = JointDisplacement("push", "across")
    mechanism = Mechanism("wedges", [Body("low", **solid), Body("high", **solid)], slides)
    return case(replace(mechanism, drivers=[driver], gravity=(0.0, 0.0, -9.8)), 0.1)


@pytest.mark.parametrize(
    "name",
    ["four_bar", "five_bar", "hooke_joint_cross", "mcpherson_arm", "strut_swapped", "wedges"],
)
@pytest.mark.by_day(4)
@pytest.mark.parametrize("form", ["mjcf", "urdf", "sdf", "osim"])
def test_exported_case_is_same_mechanism(name, form, tmp_path):
    own = {"strut_swapped": lambda: CASES[name], "wedges": wedges}
    given = own.get(name, lambda: cases.load(name))()
    for suffix, text in written(given, writer_of(form), None).items():
        (tmp_path / f"{name}{suffix}").write_text(text)
    (file,) = (each for each in tmp_path.iterdir() if not each.name.endswith(".json"))
    found = compare(undriven_case(given, name), undriven_file(file), {})
    assert found.verdict == "same", found.reason
    assert found.largest is not None
    assert found.largest < 1e-14
    assert found.lost == []


def test_same_converted_file_within_digits(tmp_path, capsys):
    pytest.importorskip("mujoco")
    (file := tmp_path / "gripper.urdf").write_text(GRIPPER)
    assert main(["same", str(file), "--converted-by", "mujoco"]) == 0
    text = capsys.readouterr().out
    assert "all of it by the files' digits" in text
    assert "velocity limit of left, right" in text


def test_different_mechanisms_differ_by_freedoms():
    pair = (undriven_case(cases.load(name), name) for name in ("four_bar", "five_bar"))
    found = compare(*pair, {})
    assert found.verdict == "differs"
    assert "freedom 1 against 2" in found.reason
    assert found.largest is None


def test_same_with_one_file_is_refused(tmp_path, capsys):
    (file := Path(tmp_path) / "gripper.urdf").write_text(GRIPPER)
    assert main(["same", str(file)]) == 2
    assert "expected two or more" in capsys.readouterr().err


def test_converter_without_output_is_refused(tmp_path, capsys):
    (file := tmp_path / "gripper.urdf").write_text(GRIPPER)
    for name in ("drake", "pinocchio"):
        assert main(["same", str(file), "--converted-by", name]) == 2
        assert f"--converted-by {name}: " in capsys.readouterr().err


def test_converter_table_has_row_per_file(tmp_path):
    pytest.importorskip("mujoco")
    (tmp_path / "gripper.urdf").write_text(GRIPPER)
    (tmp_path / "none.urdf").write_text("<robot name='r'/>")
    *_, first, second = converters.rows([tmp_path / "gripper.urdf", tmp_path / "none.urdf"])
    assert "the same motion within" in first
    assert "lost in converted.xml: velocity limit of left, right" in first
    assert second.startswith("| `none.urdf` | mujoco | not judged: ")


def test_same_without_omits_elements_of_both(tmp_path, capsys):
    tied = GRIPPER.replace("</robot>", '<tie a="left_link" b="right_link"/></robot>')
    for name, text in (("tied", tied), ("plain", GRIPPER)):
        (tmp_path / f"{name}.urdf").write_text(text)
    files = [str(tmp_path / f"{name}.urdf") for name in ("tied", "plain")]
    assert main(["same", *files]) == 2
    assert main(["same", *files, "--without", "tie"]) == 0
    assert "tied.urdf: left out by --without: line 12: <tie>" in capsys.readouterr().out
    assert main(["same", files[1], files[1], "--without", "mimik"]) == 2
    assert "did you mean 'mimic'?" in capsys.readouterr().err


OFFSET = """<mujoco><compiler angle="radian"/><worldbody>
<body name="a"><joint name="first" axis="0 1 0"/><geom size="0.1"/></body>
<body name="b" pos="1 0 0"><joint name="second" axis="0 1 0"/><geom size="0.1"/></body>
</worldbody><equality>
<joint joint1="second" joint2="first" polycoef="0.1 1.5 0 0 0"/></equality></mujoco>"""


def written_as_urdf(file: Path, *drive: str) -> Path:
    out = file.parent / "written.urdf"
    assert main(["export", str(file), *drive, "--to", "urdf", "--out", str(out)]) == 0
    return out


def test_exported_coupling_offset_moves_zero(tmp_path, capsys):
    """Links stand in the file where they stood in the model at that coordinate."""
    (file := tmp_path / "offset.xml").write_text(OFFSET)
    written = written_as_urdf(file, "--drive", "first:-0.2:0.2")
    capsys.readouterr()
    assert main(["same", str(file), str(written)]) == 0
    assert "zero of second: moved by -0.1 rad in written.urdf" in capsys.readouterr().out


def test_same_with_loops_opened_elsewhere(tmp_path, capsys):
    """A joint that closes a loop moves a copy in a model, and none in a case."""
    (tmp_path / "ram.sdf").write_text(SLIDER)
    (file := tmp_path / "ram.toml").touch()
    assert main(["import", str(tmp_path / "ram.sdf"), "--drive", "ram:-0.1:0.1"]) == 0
    file.write_text(capsys.readouterr().out)
    assert main(["same", str(file), str(written_as_urdf(file))]) == 0
    text = capsys.readouterr().out
    assert "the same motion" in text
    assert "placed where they fit" not in text


def test_same_reports_unreadable_file_as_json(tmp_path, capsys):
    (file := tmp_path / "gripper.urdf").write_text(GRIPPER)
    assert main(["same", str(file), str(tmp_path / "none.urdf"), "--json", "-"]) == 2
    found = json.loads(capsys.readouterr().out)
    assert found["verdict"] == "not judged"
    assert "no such file" in found["reason"]
    assert found["poses"] == 0


SLIDE = """<mujoco><worldbody><body name="a"><joint name="ja" axis="0 1 0"/>
<inertial pos="0.1 0 0" mass="1" diaginertia="0.1 0.1 0.1"/><body name="c" pos="0.5 0 0">
<joint name="jc" type="slide" axis="1 0 2" stiffness="20" damping="3" springref="0.1"/>
<inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></body></worldbody></mujoco>"""


@pytest.mark.parametrize("form", ["mjcf", "osim", "sdf", "urdf"])
def test_spring_of_slide_between_points(form, tmp_path):
    """Formats have it between two points, or an export writes it so."""
    first = write(tmp_path, SLIDE, "first.xml")
    texts = written(load(first, driven("ja:0:0.1:3", hold_rest=True)), writer_of(form), None)
    if form == "osim":  # ends exchanged
        change = {"1>": "2>", "2>": "1>"}
        old = texts[".osim"]
        texts = {".osim": re.sub(r"(?<=body|oint)[12]>", lambda x: change[x[0]], old)}
        assert texts[".osim"] != old
    files = [write(tmp_path, text, f"second{ending}") for ending, text in texts.items()]
    second = undriven_file(next(file for file in files if file.suffix != ".json"))
    found = compare(undriven_file(first), second, {})
    assert found.verdict == "same"
    assert not [each for each in found.lost if "limit" not in each]
    softer = write(tmp_path, SLIDE.replace('"20"', '"10"'), "softer.xml")
    found = compare(undriven_file(softer), second, {})
    assert [each for each in found.lost if "limit" not in each] == [
        "stiffness of jc: 10 against 20"
    ]
