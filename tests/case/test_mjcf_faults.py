"""MJCF models that are cut, mistyped, open, or beyond what joints can say: one message each, of
file, line, found and remedy.
"""

from pathlib import Path

import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError

GRIPPER = Path(__file__).parents[1] / "data" / "mjcf" / "robotiq_2f85.xml"
SPRINGS = ("right_spring_link_joint", "left_spring_link_joint")
DRIVEN = Supplied(drive=("right_driver_joint:0:0.8:17",), hold=SPRINGS)


def complains(file, supplied, *fragments):
    """Exactly a CaseError, on one line, that begins with the file and contains all the
    fragments.
    """
    with pytest.raises(CaseError) as caught:
        load(file, supplied)
    message = str(caught.value)
    assert message.startswith(f"{file}: ")
    assert "\n" not in message
    assert [fragment for fragment in fragments if fragment not in message] == [], message


def edited(tmp_path, *edits):
    text = GRIPPER.read_text()
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    file = tmp_path / GRIPPER.name
    file.write_text(text)
    return file


COUPLING = '<joint joint1="right_driver_joint" joint2="left_driver_joint" polycoef="0 1 0 0 0"'
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
    "joint in a frame": ((BASE, "<frame><joint/></frame>" + BASE), ["<frame>", "holds a joint"]),
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
    "three in a tendon": (
        ('coef="0.5"/>', 'coef="0.5"/><joint joint="right_coupler_joint" coef="1"/>'),
        ["couples 3 joints"],
    ),
    "flex": ((FIRST, '<flex flex="cloth"/>' + FIRST), ["<flex>", "no joint for it"]),
}
ALSO = {
    "all aligned": (BASE, "<body><freejoint/></body>" + BASE),
    "tendon over more": (FIRST, '<tendon tendon1="rope"/>' + FIRST),
    "tendon nowhere": (FIRST, '<tendon tendon1="rope"/>' + FIRST),
    "tendon of a body": (FIRST, '<tendon tendon1="rope"/>' + FIRST),
    "spatial tendon": (FIRST, '<tendon tendon1="split" tendon2="rope"/>' + FIRST),
    "three in a tendon": (FIRST, '<tendon tendon1="split"/>' + FIRST),
    "weld turned": (
        '<body name="right_pad" ',
        '<site name="turned" pos="0 -0.0215 0.03202" euler="0.1 0 0"/><body name="right_pad" ',
    ),
}


@pytest.mark.parametrize("kind", FAULTS)
def test_models(tmp_path, kind):
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
def test_no_document_types(tmp_path, head, fragments):
    file = tmp_path / "model.xml"
    file.write_text(head + GRIPPER.read_text())
    complains(file, DRIVEN, *fragments)


@pytest.mark.parametrize(
    ("text", "fragments"),
    [
        ("", ["line 1", "no element found"]),
        (GRIPPER.read_text()[:3000], ["not valid XML"]),
        ("<robot name='a'/>", ["<robot> 'a'", "expected a model <mujoco>"]),
        ("<mujoco><worldbody/></mujoco>", ["no body with a joint"]),
        ("<mujoco>" + "<a>" * 300 + "</a>" * 300 + "</mujoco>", ["nested more than 200 deep"]),
        ("<mujoco>&bomb;</mujoco>", ["undefined entity"]),
        ("<mujoco a='1' a='2'/>", ["duplicate attribute"]),
        ("<mujoco><worldbody><body name='&#133;'/></worldbody></mujoco>", ["control characters"]),
    ],
)
def test_other_texts(tmp_path, text, fragments):
    file = tmp_path / "model.xml"
    file.write_text(text)
    complains(file, DRIVEN, *fragments)


def test_too_large(tmp_path):
    file = tmp_path / "model.xml"
    file.write_text(" " * 4_000_001)
    complains(file, DRIVEN, "larger than 4000000 bytes")


DRIVES = {
    "nothing said": (
        Supplied(),
        [
            "3 degrees of freedom",
            "nothing said of what drives it",
            "--drive JOINT:START:STOP",
            "2 more",
        ],
    ),
    "a template": (Supplied("mcpherson", drive=DRIVEN.drive), ["--template"]),
    "one short": (
        Supplied(drive=DRIVEN.drive, hold=SPRINGS[:1]),
        ["3 degrees of freedom, and 2 driven or held", "--hold JOINT for 1 more"],
    ),
    "one too many": (
        Supplied(drive=DRIVEN.drive, hold=(*SPRINGS, "left_coupler_joint")),
        ["4 driven or held", "fewer --hold, by 1"],
    ),
    "only held": (Supplied(hold=SPRINGS), ["2 driven or held", "--drive JOINT:START:STOP"]),
    "misspelt": (Supplied(drive=("right_drive_joint:0:1",)), ["--drive", "'right_driver_joint'"]),
    "no range": (
        Supplied(drive=("right_driver_joint",)),
        ["--drive", "JOINT:START:STOP", "[rad, m]", "right_driver_joint:START:STOP"],
    ),
    "no end": (
        Supplied(drive=("right_driver_joint:0",)),
        ["say from where to where: right_driver_joint:START:STOP"],
    ),
    "misspelt, no range": (
        Supplied(drive=("right_drive_joint",)),
        ["did you mean 'right_driver_joint'?"],
    ),
    "too many samples": (
        Supplied(drive=("right_driver_joint:0:1:2000000",)),
        ["2 to 1000000 samples; correct the numbers"],
    ),
    "no numbers": (
        Supplied(drive=("right_driver_joint:0:wide",)),
        ["--drive", "correct the numbers"],
    ),
    "no samples": (
        Supplied(drive=("right_driver_joint:0:1:0",)),
        ["--drive", "correct the numbers"],
    ),
    "nowhere": (Supplied(drive=("right_driver_joint:1:1",)), ["--drive", "correct the numbers"]),
    "two": (
        Supplied(drive=("right_driver_joint:0:1", "left_driver_joint:0:1")),
        ["2 driven or held", "--hold JOINT for 2 more", "others for 1 that depend on each other"],
    ),
    "hold misspelt": (
        Supplied(drive=DRIVEN.drive, hold=("right_spring_link",)),
        ["--hold", "'right_spring_link_joint'"],
    ),
    "hold driven": (
        Supplied(drive=DRIVEN.drive, hold=("right_driver_joint",)),
        ["--hold", "which is driven"],
    ),
    "units": (Supplied(units="mm"), ["--units", "MJCF model", "--drive, --hold"]),
}


@pytest.mark.parametrize(
    ("supplied", "found"),
    [
        (
            DRIVEN,
            (
                "--drive: found 'right_driver_joint', which an equality of the file locks, expected"
                " a joint that moves; name another"
            ),
        ),
        (
            Supplied(drive=("left_driver_joint:0:0.8",), hold=("right_driver_joint",)),
            "joint that moves; leave it out",
        ),
    ],
)
def test_a_joint_that_the_file_locks_is_not_driven(tmp_path, supplied, found):
    complains(edited(tmp_path, (COUPLING, '<joint joint1="right_driver_joint"')), supplied, found)


@pytest.mark.parametrize("kind", DRIVES)
def test_driving(kind):
    supplied, fragments = DRIVES[kind]
    complains(GRIPPER, supplied, *fragments)
