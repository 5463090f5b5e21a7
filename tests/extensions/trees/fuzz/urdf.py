"""URDF robots, with files beside them; attributes of the root say how it is driven, and hold those
files.
"""

import html
import re

from kincheck.core.extensions.trees.urdf import (
    IN_CONSTRAINT,
    IN_JOINT,
    IN_ROBOT,
    JOINT_MOVES,
    TYPES,
)

from ....fuzz.fuzzing import FOLDER, changing, reading, written
from ....fuzz.trees import changed_xml

LONGEST = 4200
BESIDE = {
    ending: re.compile(rf"{kind}=(?:\"([^\"]*)\"|'([^']*)')")
    for kind, ending in (("json", ".constraints.json"), ("yaml", ".yaml"))
}
WORDS = (
    *(*IN_ROBOT, *IN_JOINT, *IN_CONSTRAINT, *TYPES, *JOINT_MOVES, "origin", "xyz", "rpy", "link"),
    *("multiplier", "offset", "joint", "type", "name", "closed_loop", "joint_name", "joint_type"),
    *("UJOINT_XY", "SPHERICAL", "6d", "3d", "coincident", "distance", "directions", "linear"),
)
FOUR_BAR = b"""<robot name="drive A:0:0.5:5 hold "><link name="base"/><link name="a"><visual><geometry><sphere radius="1"/></geometry></visual></link>
<link name="b"/><link name="c"/><link name="tip"/>
<joint name="A" type="continuous"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/></joint>
<joint name="B" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 2"/><axis xyz="0 1 0"/><limit lower="-9" upper="9" effort="1" velocity="1"/></joint>
<joint name="D" type="continuous"><parent link="base"/><child link="c"/><origin xyz="4 0 0" rpy="0 0.5 0"/><axis xyz="0 1 0"/></joint>
<joint name="t" type="fixed"><parent link="b"/><child link="tip"/><origin xyz="2 0 1" rpy="1 2 3"/></joint>
<constraint name="C" type="spherical"><parent link="b"/><parent_origin xyz="4 0 0"/><child link="c"/><child_origin xyz="-0.958851077208406 0 1.7551651237807455"/></constraint>
</robot>"""  # noqa: E501
TYPED = b"""<robot name="drive s:0:0.1:3 hold p.slide1 p.slide2 p.rotation ball f.x f.y f.z f free"><link name="base"/><link name="a"/><link name="b"/>
<link name="c"/><link name="d"/><link name="e"/><link name="g"/>
<joint name="s" type="prismatic"><parent link="base"/><child link="a"/><axis xyz="1 2 2"/></joint>
<joint name="p" type="planar"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>
<joint name="ball" type="ball"><parent link="a"/><child link="c"/></joint>
<joint name="f" type="floating"><parent link="a"/><child link="d"/></joint>
<joint name="free" type="floating"><parent link="base"/><child link="e"/></joint>
<joint name="q" type="revolute"><parent link="a"/><child link="g"/><mimic joint="s" multiplier="2"/></joint></robot>"""  # noqa: E501
PAIRED = b"""<robot name="drive A:0:0.2:3 hold " yaml="closed_loop: [[X, y]]
type: [3d]
name_mot: [A]
joint_name: [B]
joint_type: [UJOINT_YX]"><link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="x"/><link name="y"/>
<joint name="A" type="continuous"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/></joint>
<joint name="B" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 2"/></joint>
<joint name="D" type="continuous"><parent link="base"/><child link="c"/><origin xyz="4 0 0"/><axis xyz="0 1 0"/></joint>
<joint name="X" type="fixed"><parent link="b"/><child link="x"/><origin xyz="4 0 1"/></joint>
<joint name="Y" type="fixed"><parent link="c"/><child link="y"/><origin xyz="0 0 3"/></joint></robot>"""  # noqa: E501
CLOSED = b"""<robot name="drive A:0:0.2:3 hold " json='{"schema": "kincheck-constraints/1", "constraints": [
{"joint": "C", "kind": "coincident", "i": {"link": "b", "point": [4, 0, 0]}, "j": {"link": "c", "point": [0, 2, 0]}},
{"joint": "C", "kind": "directions", "x": {"link": "b", "direction": [1, 0, 0]}, "y": {"link": "c", "direction": [0, 0, 1]}},
{"joint": "C", "kind": "directions", "x": {"link": "b", "direction": [0, 1, 0]}, "y": {"link": "c", "direction": [0, 0, 1]}},
{"joint": "R", "kind": "distance", "i": {"link": "a", "point": [0, 1, 0]}, "j": {"link": "d", "point": [0, 0, 0]}, "value": 3},
{"joint": "S", "kind": "linear", "weights": {"A": 1, "E": -2}}]}'>
<link name="ground"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/><link name="e"/>
<joint name="A" type="continuous"><parent link="ground"/><child link="a"/><axis xyz="0 0 1"/></joint>
<joint name="B" type="continuous"><parent link="a"/><child link="b"/><origin xyz="0 2 0"/><axis xyz="0 0 1"/></joint>
<joint name="D" type="continuous"><parent link="ground"/><child link="c"/><origin xyz="4 0 0"/><axis xyz="0 0 1"/></joint>
<joint name="R1" type="prismatic"><parent link="ground"/><child link="d"/><origin xyz="0 4 0"/><axis xyz="0 1 0"/></joint>
<joint name="E" type="prismatic"><parent link="ground"/><child link="e"/><origin xyz="3 4 0"/></joint></robot>"""  # noqa: E501


def one(data: bytes) -> None:
    """Read one input with what it says itself, and with the files beside it."""
    for ending, pattern in BESIDE.items():
        (FOLDER / f"robot{ending}").unlink(missing_ok=True)
        if beside := pattern.search(data.decode("latin-1")):
            text = html.unescape(beside[1] or beside[2] or "")
            written(f"robot{ending}", text.encode("utf-8", "surrogatepass"))
    reading("robot.urdf")(data)


def seeds() -> list[bytes]:
    """A four-bar, all types of joints, and robots with files beside them."""
    return [FOUR_BAR, TYPED, PAIRED, CLOSED]


mutate = changing(changed_xml, words=WORDS)
