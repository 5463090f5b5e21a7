"""MJCF models that are cut, mistyped, open, or beyond what joints can say: one message each, of
file, line, found and remedy.
"""

import pytest

from ...support.case_texts import complains, rows, write
from ...support.model_files import DRIVEN, GRIPPER, edited

FIRST = '<connect anchor="0 0 0" body1="right_follower"'
BASE = '<body name="base_mount" pos="0 0 0.007" quat="1 0 0 1"'
FAULTS = {
    row.id: row.values
    for row in rows("""
misspelt attribute | axis="1 0 0"/> | axes="1 0 0"/>
    | line 8: <joint> ... 'axes' ... did you mean 'axis'?
misspelt element | <site name="right_pad" | <sitte name="right_pad"
    | <sitte> 'right_pad' ... did you mean 'site'?
misspelt section | <worldbody> | <worldboy> | mismatched tag
unknown section | <tendon> | <legs/><tendon> | <legs> ... unknown in a model
two numbers | pos="0 0.0132 0.0609" | pos="0 0.0132" | 'right_spring_link' ... pos ... 3 numbers
no number | pos="0 0.0132 0.0609" | pos="0 0.0132 O"
    | 'right_spring_link' ... pos ... '0 0.0132 O'
digit separators | pos="0 0.0132 0.0609" | pos="0 0.0132 1_0"
    | 'right_spring_link' ... pos ... '0 0.0132 1_0'
not finite | pos="0 0.0132 0.0609" | pos="0 0.0132 inf" | 'right_spring_link' ... pos
two orientations | <body name="base_mount" pos="0 0 0.007" quat="1 0 0 1"
    | <body name="base_mount" pos="0 0 0.007" quat="1 0 0 1" euler="0 0 90"
    | 'base_mount' ... quat and euler ... one orientation
no orientation | quat="1 0 0 -1" | quat="0 0 0 0" | 'base' ... quat ... no direction
zero axis | <joint axis="1 0 0"/> | <joint axis="0 0 0"/>
    | 'right_driver_joint' ... axis ... no direction
unknown joint type | name="right_coupler_joint" | name="right_coupler_joint" type="hing"
    | type ... 'hing' ... 'hinge'
unknown class | class="driver"/> | class="drivr"/>
    | 'right_driver_joint' ... class ... 'drivr' ... 'driver'
class without name | <default class="coupler"> | <default> | <default> ... class ... missing
outer class | <default> | <default class="all"> | <default> ... class ... 'all' ... main
class twice | <default class="coupler"> | <default class="driver"> | class ... 'driver' again
body twice | <body name="left_driver" | <body name="right_driver" | 'right_driver' ... again
joint twice | <joint name="left_driver_joint" | <joint name="right_driver_joint"
    | 'right_driver_joint' ... again
site twice | <site name="left_pad" | <site name="right_pad" | 'right_pad' ... again
eulerseq | angle="radian" | angle="radian" eulerseq="xyw" | eulerseq ... 'xyw'
angle | angle="radian" | angle="radians" | angle ... 'radians' ... 'radian'
global coordinates | angle="radian" | angle="radian" coordinate="global"
    | coordinate ... 'global' ... local
include | <tendon> | <include file="x.xml"/><tendon> | <include> ... 'x.xml' ... no such file
include in a body | <worldbody> | <worldbody><include file="x.xml"/>
    | <include> ... 'x.xml' ... no such file
replicate | <worldbody> | <worldbody><replicate count="0"/>
    | <replicate> ... count: found '0' ... 1 to 1000
composite | <worldbody> | <worldbody><composite count="3"/>
    | <composite> ... makes bodies ... mj_saveLastXML
free below | <joint name="right_coupler_joint" class="coupler"/> | <freejoint/>
    | <freejoint> ... worldbody
joint in a frame | <worldbody> | <worldbody><frame><joint/></frame> | <joint> ... is in no body
unknown body | <connect anchor="0 0 0" body1="right_follower"
    | <connect anchor="0 0 0" body1="right_folower"
    | body1 ... 'right_folower' ... 'right_follower'
no body | <connect anchor="0 0 0" body1="right_follower" | <connect anchor="0 0 0"
    | <connect> ... body1: missing
no anchor | <connect anchor="0 0 0" body1="right_follower" | <connect body1="right_follower"
    | <connect> ... anchor: missing
with itself | <connect anchor="0 0 0" body1="right_follower"
    | <connect anchor="0 0 0" body1="right_coupler" | joins 'right_coupler' with itself
unknown site | <equality> | <equality><connect site1="right_pad" site2="left_pod"/>
    | site2 ... 'left_pod' ... 'left_pad'
sites apart | <equality> | <equality><connect site1="right_pad" site2="left_pad"/>
    | is open in the start ... a tenth of the model's size ... --start
weld apart | <equality>
    | <equality><weld body1="right_driver" body2="left_driver" relpose="0 0 0.1 1 0 0 0"/>
    | <weld> ... is open in the start ... --start
weld turned | <equality> | <equality><weld site1="right_pad" site2="turned"/>
    | <weld> ... with itself
curve of a sum | <equality>
    | <equality><tendon tendon1="split" polycoef="0 1 0.1" tendon2="split"/>
    | polycoef ... curve between sums ... one joint on either side
unknown joint | <joint joint1="right_driver_joint" joint2="left_driver_joint" polycoef="0 1 0 0 0"
    | <joint joint1="right_driver_joint" joint2="left_drivr_joint" polycoef="0 1 0 0 0"
    | joint2 ... 'left_drivr_joint'
joint with itself
    | <joint joint1="right_driver_joint" joint2="left_driver_joint" polycoef="0 1 0 0 0"
    | <joint joint1="right_driver_joint" joint2="right_driver_joint" polycoef="0 1 0 0 0"
    | couples the joint 'right_driver_joint' with itself
no tendon | <equality> | <equality><tendon tendon1="spilt"/> | tendon1 ... 'spilt' ... 'split'
no turning | <equality>
    | <equality><weld body1="right_driver" body2="left_driver" torquescale="0"/>
    | torquescale ... <connect>
misspelt compiler | angle="radian" | angel="radian"
    | <compiler> ... 'angel' ... did you mean 'angle'?
attribute of the world | <worldbody> | <worldbody childclass="driver">
    | <worldbody> ... 'childclass'
aligned | <worldbody> | <worldbody><body><freejoint align="true"/></body>
    | <freejoint> ... inertia ... align=
all aligned | angle="radian" | angle="radian" alignfree="true"
    | <freejoint> ... inertia ... alignfree of <compiler>
ground | <worldbody> | <worldbody><body name="ground"><joint/></body>
    | <body> 'ground' ... rename the body
tendon over more | <fixed | <spatial name="rope"><site site="right_pad"/></spatial><fixed
    | goes over site ... two sites
tendon nowhere | <fixed
    | <spatial name="rope"><site site="right_pad"/><site site="left_pod"/></spatial><fixed
    | site: found 'left_pod' ... 'left_pad'
tendon of a body | <fixed
    | <spatial name="rope"><site site="right_pad"/><site site="right_pad"/></spatial><fixed
    | <spatial> 'rope' ... between two points of 'right_follower'
spatial tendon | <fixed | <spatial name="rope"/><fixed | tendon2 ... 'rope' is a spatial tendon
tendon of no range | <fixed name="split" | <fixed name="split" limited="true" range="0 0"
    | 'split' ... range: found '0 0' with limited ... <tendon tendon1="split"
joint of no range | name="right_coupler_joint"
    | name="right_coupler_joint" limited="true" range="1 1"
    | range: found '1 1' with limited ... <joint joint1="right_coupler_joint"
flex | <equality> | <equality><flex flex="cloth"/> | <flex> ... no joint for it
""")
} | {
    "weld turned apart": (
        "<equality>",
        '<equality><weld body1="right_driver" body2="right_coupler"'
        ' relpose="0 0.0315 -0.0041 0 0 1 0"/>',
        "<weld> ... is open in the start ... --start",
    ),
}


ALSO = {
    "all aligned": ("<worldbody>", "<worldbody><body><freejoint/></body>"),
    "tendon over more": ("<equality>", '<equality><tendon tendon1="rope"/>'),
    "tendon nowhere": ("<equality>", '<equality><tendon tendon1="rope"/>'),
    "tendon of a body": ("<equality>", '<equality><tendon tendon1="rope"/>'),
    "spatial tendon": ("<equality>", '<equality><tendon tendon1="split" tendon2="rope"/>'),
    "weld turned": (
        '<body name="right_pad" ',
        '<site name="turned" pos="0 -0.0215 0.03202" euler="0.1 0 0"/><body name="right_pad" ',
    ),
}


@pytest.mark.parametrize("kind", FAULTS)
def test_mjcf_fault_is_one_message(tmp_path, kind):
    *edit, said = FAULTS[kind]
    edits = [edit, ALSO[kind]] if kind in ALSO else [edit]
    complains(edited(tmp_path, GRIPPER.read_text(), *edits), said, DRIVEN)


WHOLE = GRIPPER.read_text()
TEXTS = {
    "document type": ("<!DOCTYPE mujoco>" + WHOLE, "line 1 ... <!DOCTYPE> ... remove it"),
    "entities": (
        '<!DOCTYPE a [<!ENTITY b "c"><!ENTITY d "&b;&b;&b;&b;">]>' + WHOLE,
        "line 1 ... <!DOCTYPE> ... entities",
    ),
    "external entity": (
        '<!DOCTYPE a SYSTEM "file:///etc/hostname">' + WHOLE,
        "line 1 ... <!DOCTYPE>",
    ),
    "empty": ("", "line 1 ... no element found"),
    "cut": (WHOLE[:3000], "not valid XML"),
    "other document": ("<scene name='a'/>", "<scene> 'a' ... expected a model <mujoco>"),
    "no joint": ("<mujoco><worldbody/></mujoco>", "no body with a joint"),
    "nested": ("<mujoco>" + "<a>" * 300 + "</a>" * 300 + "</mujoco>", "nested more than 200 deep"),
    "undefined entity": ("<mujoco>&bomb;</mujoco>", "undefined entity"),
    "attribute twice": ("<mujoco a='1' a='2'/>", "duplicate attribute"),
    "control characters": (
        "<mujoco><worldbody><body name='&#133;'/></worldbody></mujoco>",
        "control characters",
    ),
    "too large": (" " * 4_000_001, "larger than 4000000 bytes"),
}


@pytest.mark.parametrize("kind", TEXTS)
def test_text_without_mjcf_model_is_refused(tmp_path, kind):
    text, said = TEXTS[kind]
    complains(write(tmp_path, text, "model.xml"), said, DRIVEN)
