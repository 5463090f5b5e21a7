"""MJCF models; what the command line says of them, --drive, --hold and --start, stands in a comment
of the input.
"""

import re
from pathlib import Path

from kincheck.core.extensions.trees.mjcf_language import DYNAMIC, IN_BODY, KNOWN, MAKE_BODIES, ROOT

from ....fuzz.fuzzing import changing, reading
from ....fuzz.trees import changed_xml

LONGEST = 4200
SAYS = """angle eulerseq degree radian local hinge slide ball free default childclass mocap fixed
spatial joint coef flag equality disable autolimits compiler drive hold rest keyframe:k
out0=0.2 key qpos include replicate fromto count model world main active false x y z XYZ
0:0.5:5 weld connect tendon springlength spring damper passive"""
WORDS = (
    *ROOT,
    *IN_BODY,
    *MAKE_BODIES,
    *DYNAMIC,
    *(name for each in KNOWN.values() for name in each),
    *SAYS.split(),
)
FOUR_BAR = b"""<mujoco model="drive crank:0:0.5:5 hold "><worldbody>
<body name="a"><joint name="crank" axis="0 1 0"/>
<body name="b" pos="0 0 2"><joint name="B" axis="0 1 0"/><site name="C" pos="4 0 0"/></body></body>
<body name="c" pos="4 0 0"><joint name="D" axis="0 1 0"/><site name="c" pos="0 0 2"/></body></worldbody>
<equality><connect site1="C" site2="c"/></equality></mujoco>"""  # noqa: E501
SLIDERS = b"""<mujoco model="drive s:0:0.1:3 hold b free "><compiler angle="radian" eulerseq="zyx"/>
<default><joint axis="1 0 0"/><default class="q"><joint type="slide"/></default></default><worldbody>
<frame pos="0 0 1" euler="0 0.1 0"><body name="a" childclass="q" quat="1 0 0 0.5">
<joint name="s"/><joint name="t" type="hinge" ref="0.2"/></body></frame>
<body name="c"><joint name="u" class="q"/></body><body name="d"><joint name="b" type="ball"/><geom size="1"/></body>
<body name="free" pos="1 1 1"><freejoint/></body></worldbody>
<tendon><fixed name="f"><joint joint="s" coef="2"/><joint joint="u" coef="-1"/></fixed></tendon>
<equality><joint joint1="t" joint2="s" polycoef="0 3"/><tendon tendon1="f"/></equality></mujoco>"""  # noqa: E501
ROD = b"""<mujoco model="drive in:0:0.5:5 hold "><worldbody><body name="a"><joint name="in" axis="0 0 1"/></body>
<body name="b" pos="2 1 3"><joint name="out" axis="1 0 0"/>
<body name="rod" pos="0 3.9 -0.8"><joint name="r" type="ball"/></body></body></worldbody>
<equality><connect body1="rod" body2="a" anchor="-3 -4.9 -2.2"/>
<weld body1="a" body2="world" active="false"/></equality></mujoco>"""  # noqa: E501

CURVED = b"""<mujoco model="drive in:0:0.5:5 hold rest keyframe:k out0=0.2 "><worldbody><body name="f"><freejoint/>
<body name="a"><joint name="in" axis="0 0 1"/><site name="s" type="box" fromto="0 0 0 1 1 0"/></body>
<replicate count="2" offset="1 0 0" euler="0 0 30"><body name="b"><joint name="out" axis="0 0 1" type="slide"/>
<body name="c" pos="1 0 0"><joint name="end" type="ball"/><site name="t" pos="0 0 1.001"/></body></body></replicate>
</body></worldbody><equality><joint joint1="in" joint2="out0" polycoef="0.1 1 0.2 -0.3 0.1"/></equality>
<keyframe><key name="k" qpos="0 0 0 1 0 0 0 0.1 0 1 0 0 0 0 1 0 0 0"/></keyframe></mujoco>"""  # noqa: E501
SPRINGS = b"""<mujoco model="drive s:0:0.1:3 hold h "><default><tendon stiffness="3"/></default><worldbody>
<body name="a"><joint name="s" type="slide" stiffness="40" springref="-0.2" damping="2"/><site name="p" pos="0 1 1"/>
<body name="b" pos="1 0 0"><joint name="h" ref="30" springref="10" stiffness="5 0 0" damping="1"/><geom size="0.1"/></body></body>
<site name="q"/></worldbody><tendon><spatial name="t" springlength="0.5" damping="1"><site site="p"/><site site="q"/></spatial>
</tendon></mujoco>"""  # noqa: E501


one = reading("model.xml")


def seeds() -> list[bytes]:
    """A gripper, a linkage, sliders, a rod, copies on curves from a keyframe, and springs."""
    gripper = (Path(__file__).parents[3] / "data" / "mjcf" / "robotiq_2f85.xml").read_bytes()
    springs = b"right_driver_joint:0:0.8:17 hold right_spring_link_joint left_spring_link_joint "
    return [
        FOUR_BAR,
        SLIDERS,
        ROD,
        CURVED,
        SPRINGS,
        re.sub(rb'model="[^"]*"', b'model="drive ' + springs + b'"', gripper, count=1),
    ]


mutate = changing(changed_xml, words=WORDS)
