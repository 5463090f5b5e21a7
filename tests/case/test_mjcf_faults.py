"""MJCF models that are cut, mistyped, open, or beyond what joints can say: one message each, of
file, line, found and remedy.
"""

import pytest

from ..support.mjcf_complaints import COUPLING, DRIVEN, GRIPPER, complains, edited

FIRST = '<connect anchor="0 0 0" body1="right_follower"'
BASE = '<body name="base_mount" pos="0 0 0.007" quat="1 0 0 1"'
FAULTS = {
    "misspelt attribute": (
        ('axis="1 0 0"/>', 'axes="1 0 0"/>'),
        ["line 8: <joint>", "'axes'", "did you mean 'axis'?"],
    ),
    "misspelt element": (
        ('<site name="right_pad"', '<sitte name="right_pad"'),
        ["<sitte> 'right_pad'", "did you mean 'site'?"],
    ),
    "misspelt section": (("<worldbody>", "<worldboy>"), ["mismatched tag"]),
    "unknown section": (("<tendon>", "<legs/><tendon>"), ["<legs>", "unknown in a model"]),
    "two numbers": (
        ('pos="0 0.0132 0.0609"', 'pos="0 0.0132"'),
        ["'right_spring_link'", "pos", "3 numbers"],
    ),
    "no number": (
        ('pos="0 0.0132 0.0609"', 'pos="0 0.0132 O"'),
        ["'right_spring_link'", "pos", "'0 0.0132 O'"],
    ),
    "digit separators": (
        ('pos="0 0.0132 0.0609"', 'pos="0 0.0132 1_0"'),
        ["'right_spring_link'", "pos", "'0 0.0132 1_0'"],
    ),
    "not finite": (('pos="0 0.0132 0.0609"', 'pos="0 0.0132 inf"'), ["'right_spring_link'", "pos"]),
    "two orientations": (
        (BASE, f'{BASE} euler="0 0 90"'),
        ["'base_mount'", "quat and euler", "one orientation"],
    ),
    "no orientation": (('quat="1 0 0 -1"', 'quat="0 0 0 0"'), ["'base'", "quat", "no direction"]),
    "zero axis": (
        ('<joint axis="1 0 0"/>', '<joint axis="0 0 0"/>'),
        ["'right_driver_joint'", "axis", "no direction"],
    ),
    "unknown joint type": (
        ('name="right_coupler_joint"', 'name="right_coupler_joint" type="hing"'),
        ["type", "'hing'", "'hinge'"],
    ),
    "unknown class": (
        ('class="driver"/>', 'class="drivr"/>'),
        ["'right_driver_joint'", "class", "'drivr'", "'driver'"],
    ),
    "class without name": (
        ('<default class="coupler">', "<default>"),
        ["<default>", "class", "missing"],
    ),
    "outer class": (
        ("<default>", '<default class="all">'),
        ["<default>", "class", "'all'", "main"],
    ),
    "class twice": (
        ('<default class="coupler">', '<default class="driver">'),
        ["class", "'driver' again"],
    ),
    "body twice": (
        ('<body name="left_driver"', '<body name="right_driver"'),
        ["'right_driver'", "again"],
    ),
    "joint twice": (
        ('<joint name="left_driver_joint"', '<joint name="right_driver_joint"'),
        ["'right_driver_joint'", "again"],
    ),
    "site twice": (('<site name="left_pad"', '<site name="right_pad"'), ["'right_pad'", "again"]),
    "eulerseq": (('angle="radian"', 'angle="radian" eulerseq="xyw"'), ["eulerseq", "'xyw'"]),
    "angle": (('angle="radian"', 'angle="radians"'), ["angle", "'radians'", "'radian'"]),
    "global coordinates": (
        ('angle="radian"', 'angle="radian" coordinate="global"'),
        ["coordinate", "'global'", "local"],
    ),
    "include": (
        ("<tendon>", '<include file="x.xml"/><tendon>'),
        ["<include>", "'x.xml'", "no such file"],
    ),
    "include in a body": (
        (BASE, '<include file="x.xml"/>' + BASE),
        ["<include>", "'x.xml'", "no such file"],
    ),
    "replicate": (
        (BASE, '<replicate count="0"/>' + BASE),
        ["<replicate>", "count: found '0'", "1 to 1000"],
    ),
    "composite": (
        (BASE, '<composite count="3"/>' + BASE),
        ["<composite>", "makes bodies", "mj_saveLastXML"],
    ),
    "free below": (
        ('<joint name="right_coupler_joint" class="coupler"/>', "<freejoint/>"),
        ["<freejoint>", "worldbody"],
    ),
    "joint in a frame": ((BASE, "<frame><joint/></frame>" + BASE), ["<joint>", "is in no body"]),
    "unknown body": (
        (FIRST, FIRST.replace("right_follower", "right_folower")),
        ["body1", "'right_folower'", "'right_follower'"],
    ),
    "no body": ((FIRST, '<connect anchor="0 0 0"'), ["<connect>", "body1: missing"]),
    "no anchor": ((FIRST, '<connect body1="right_follower"'), ["<connect>", "anchor: missing"]),
    "with itself": (
        (FIRST, '<connect anchor="0 0 0" body1="right_coupler"'),
        ["joins 'right_coupler' with itself"],
    ),
    "unknown site": (
        (FIRST, '<connect site1="right_pad" site2="left_pod"/>' + FIRST),
        ["site2", "'left_pod'", "'left_pad'"],
    ),
    "sites apart": (
        (FIRST, '<connect site1="right_pad" site2="left_pad"/>' + FIRST),
        ["is open in the start", "a tenth of the model's size", "--start"],
    ),
    "weld apart": (
        (
            FIRST,
            '<weld body1="right_driver" body2="left_driver" relpose="0 0 0.1 1 0 0 0"/>' + FIRST,
        ),
        ["<weld>", "is open in the start", "--start"],
    ),
    "weld turned": (
        (FIRST, '<weld site1="right_pad" site2="turned"/>' + FIRST),
        ["<weld>", "with itself"],
    ),
    "curve of a sum": (
        (FIRST, '<tendon tendon1="split" polycoef="0 1 0.1" tendon2="split"/>' + FIRST),
        ["polycoef", "curve between sums", "one joint on either side"],
    ),
    "unknown joint": (
        (COUPLING, COUPLING.replace("left_driver_", "left_drivr_")),
        ["joint2", "'left_drivr_joint'"],
    ),
    "joint with itself": (
        (COUPLING, COUPLING.replace("left", "right")),
        ["couples the joint 'right_driver_joint' with itself"],
    ),
    "no tendon": ((FIRST, '<tendon tendon1="spilt"/>' + FIRST), ["tendon1", "'spilt'", "'split'"]),
    "no turning": (
        (FIRST, '<weld body1="right_driver" body2="left_driver" torquescale="0"/>' + FIRST),
        ["torquescale", "<connect>"],
    ),
    "misspelt compiler": (
        ('angle="radian"', 'angel="radian"'),
        ["<compiler>", "'angel'", "did you mean 'angle'?"],
    ),
    "attribute of the world": (
        ("<worldbody>", '<worldbody childclass="driver">'),
        ["<worldbody>", "'childclass'"],
    ),
    "aligned": (
        (BASE, '<body><freejoint align="true"/></body>' + BASE),
        ["<freejoint>", "inertia", 'align="false"'],
    ),
    "all aligned": (
        ('angle="radian"', 'angle="radian" alignfree="true"'),
        ["<freejoint>", "inertia", "alignfree of <compiler>"],
    ),
    "ground": (
        (BASE, '<body name="ground"><joint/></body>' + BASE),
        ["<body> 'ground'", "rename the body"],
    ),
    "tendon over more": (
        ("<fixed", '<spatial name="rope"><site site="right_pad"/></spatial><fixed'),
        ["goes over site", "two sites"],
    ),
    "tendon nowhere": (
        (
            "<fixed",
            '<spatial name="rope"><site site="right_pad"/><site site="left_pod"/></spatial><fixed',
        ),
        ["site: found 'left_pod'", "'left_pad'"],
    ),
    "tendon of a body": (
        (
            "<fixed",
            '<spatial name="rope"><site site="right_pad"/><site site="right_pad"/></spatial><fixed',
        ),
        ["<spatial> 'rope'", "between two points of 'right_follower'"],
    ),
    "spatial tendon": (
        ("<fixed", '<spatial name="rope"/><fixed'),
        ["tendon2", "'rope' is a spatial tendon"],
    ),
    "tendon of no range": (
        ('<fixed name="split"', '<fixed name="split" limited="true" range="0 0"'),
        ["'split'", "range: found '0 0' with limited", '<tendon tendon1="split"'],
    ),
    "joint of no range": (
        ('name="right_coupler_joint"', 'name="right_coupler_joint" limited="true" range="1 1"'),
        ["range: found '1 1' with limited", '<joint joint1="right_coupler_joint"'],
    ),
    "flex": ((FIRST, '<flex flex="cloth"/>' + FIRST), ["<flex>", "no joint for it"]),
}


ALSO = {
    "all aligned": (BASE, "<body><freejoint/></body>" + BASE),
    "tendon over more": (FIRST, '<tendon tendon1="rope"/>' + FIRST),
    "tendon nowhere": (FIRST, '<tendon tendon1="rope"/>' + FIRST),
    "tendon of a body": (FIRST, '<tendon tendon1="rope"/>' + FIRST),
    "spatial tendon": (FIRST, '<tendon tendon1="split" tendon2="rope"/>' + FIRST),
    "weld turned": (
        '<body name="right_pad" ',
        '<site name="turned" pos="0 -0.0215 0.03202" euler="0.1 0 0"/><body name="right_pad" ',
    ),
}


@pytest.mark.parametrize("kind", FAULTS)
def test_mjcf_fault_is_one_message(tmp_path, kind):
    edit, fragments = FAULTS[kind]
    complains(edited(tmp_path, edit, *([ALSO[kind]] if kind in ALSO else [])), DRIVEN, *fragments)


@pytest.mark.parametrize(
    ("head", "fragments"),
    [
        ("<!DOCTYPE mujoco>", ["line 1", "<!DOCTYPE>", "remove it"]),
        (
            '<!DOCTYPE a [<!ENTITY b "c"><!ENTITY d "&b;&b;&b;&b;">]>',
            ["line 1", "<!DOCTYPE>", "entities"],
        ),
        ('<!DOCTYPE a SYSTEM "file:///etc/hostname">', ["line 1", "<!DOCTYPE>"]),
    ],
)
def test_document_type_is_refused(tmp_path, head, fragments):
    file = tmp_path / "model.xml"
    file.write_text(head + GRIPPER.read_text())
    complains(file, DRIVEN, *fragments)


@pytest.mark.parametrize(
    ("text", "fragments"),
    [
        ("", ["line 1", "no element found"]),
        (GRIPPER.read_text()[:3000], ["not valid XML"]),
        ("<scene name='a'/>", ["<scene> 'a'", "expected a model <mujoco>"]),
        ("<mujoco><worldbody/></mujoco>", ["no body with a joint"]),
        ("<mujoco>" + "<a>" * 300 + "</a>" * 300 + "</mujoco>", ["nested more than 200 deep"]),
        ("<mujoco>&bomb;</mujoco>", ["undefined entity"]),
        ("<mujoco a='1' a='2'/>", ["duplicate attribute"]),
        ("<mujoco><worldbody><body name='&#133;'/></worldbody></mujoco>", ["control characters"]),
    ],
)
def test_text_without_mjcf_model_is_refused(tmp_path, text, fragments):
    file = tmp_path / "model.xml"
    file.write_text(text)
    complains(file, DRIVEN, *fragments)


def test_too_large_file_is_refused(tmp_path):
    file = tmp_path / "model.xml"
    file.write_text(" " * 4_000_001)
    complains(file, DRIVEN, "larger than 4000000 bytes")
