"""URDF and the files beside it: one message for each fault."""

import numpy as np
import pytest
from kincheck.core.case.models.files import load

from ...support.case_texts import complains, write
from ...support.model_files import driven, edited
from ...support.model_poses import solution
from ...support.urdf_texts import DRIVE, FOUR_BAR, TREE, beside, robot

FAULTS = {
    "two joints above": (
        '<child link="c"/>',
        '<child link="b"/>',
        "'B' holds already ... <constraint>",
    ),
    "no link": ('<child link="c"/>', '<child link="cc"/>', "found 'cc', expected a link; did you"),
    "ring": (
        '<parent link="base"/><child link="a"/>',
        '<parent link="tip"/><child link="a"/>',
        "hangs on itself",
    ),
    "no child": ('<child link="a"/>', "", "<child>: missing, expected a link; add it"),
    "two bases": (
        '<link name="c"/>',
        '<link name="c"/><link name="e"/>',
        "found 2 links  ... (base, e)",
    ),
    "zero axis": ('xyz="0 1 0"', 'xyz="0 0 0"', "found zero, of no direction"),
    "mistyped attribute": (
        'rpy="1 2 3"',
        'rpq="1 2 3"',
        "URDF does not have ... ; did you mean 'rpy'",
    ),
    "mistyped element": ("<origin", "<orgin", "unknown in <joint>; did you mean 'origin'"),
    "no type": (
        'type="spherical"',
        'type="rolling"',
        "found 'rolling', expected one of fixed, link",
    ),
    "unknown joint": ('type="revolute"', 'type="hinge"', "found 'hinge', expected one of revolute"),
    "macros": ("<constraint", "<xacro:leg/><constraint", "is a macro ... ; expand the file"),
    "twice": ('<link name="c"/>', '<link name="b"/>', "found 'b' again"),
}


@pytest.mark.parametrize("kind", FAULTS)
def test_urdf_fault_is_one_message(kind, tmp_path):
    *edit, said = FAULTS[kind]
    file = edited(tmp_path, FOUR_BAR, edit, name="robot.urdf")
    complains(file, f"{file}: line  ... {said}", DRIVE)


BESIDE_FAULTS = {
    "other schema": ({"schema": "mine"}, "found 'mine', expected 'kincheck-constraints/1'"),
    "unknown link": (
        {"i": {"link": "bb", "point": [4.0, 0.0, 0.0]}},
        "found 'bb', expected a link",
    ),
    "open": ({"i": {"link": "b", "point": [4.1, 0.0, 0.0]}}, "is open by 0.1 in the zero pose"),
    "no joint": ({"kind": "distance", "value": 1.0}, "is open by -1"),
    "no point": ({"i": None}, "found no two links"),
    "unknown kind": ({"kind": "weld"}, "weld"),
    "huge": ({"value": 1e101}, "value: found 1e+101"),
    "no curve": ({"kind": "polynomial", "driven": "B", "driving": "A"}, "found no coefficients"),
    "high curve": ({"kind": "polynomial", "coefficients": [0.0] * 6}, "length <= 5"),
}


def test_constraints_file_closes_loop(tmp_path):
    (other := tmp_path / "other").mkdir()
    found = solution(load(beside(tmp_path), DRIVE)).bodies["c"].r
    same = solution(load(robot(other, FOUR_BAR), DRIVE)).bodies["c"].r
    assert np.array_equal(found, same)


@pytest.mark.parametrize(("changes", "said"), BESIDE_FAULTS.values(), ids=BESIDE_FAULTS)
def test_constraints_file_fault_names_file(changes, said, tmp_path):
    file = beside(tmp_path, **changes)
    complains(file, f"{file.with_suffix('.constraints.json')} ... {said}", DRIVE)


PAIRS = {
    "a reference": ("closed_loop: [&x [a, b], *x]\ntype: [3d, 3d]", "found a reference"),
    "fewer types": ("closed_loop: [[a, b]]\ntype: []", "type: found 0, expected 1"),
    "unknown frame": ("closed_loop: [[a, bb]]\ntype: [3d]", "found 'bb', expected a link or joint"),
    "unknown type": ("closed_loop: [[a, b]]\ntype: [4d]", "found '4d', expected 3d or 6d"),
    "unknown joint": ("joint_name: [Q]\njoint_type: [FIXED]", "found 'Q', expected a joint"),
    "no axes": (
        "joint_name: [B]\njoint_type: [UJOINT_XW]",
        "found 'UJOINT_XW', expected SPHERICAL",
    ),
    "no mapping": ("- 1", "expected closed_loop, type"),
    "nested": ("[" * 400, "nested too deeply"),
    "syntax": ("a: [", "not valid YAML"),
}


@pytest.mark.parametrize(("text", "said"), PAIRS.values(), ids=PAIRS)
def test_pairs_file_fault_names_file(text, said, tmp_path):
    pytest.importorskip("yaml")
    file = robot(tmp_path, TREE, yaml=text)
    complains(file, f"{file.with_suffix('.yaml')} ... {said}", DRIVE)


@pytest.mark.parametrize("name", ["robot.xacro", "robot.mo", "part.STL", "r.constraints.json"])
def test_file_beside_model_is_refused(name, tmp_path):
    complains(write(tmp_path, b"\x00\xff", name), "found a . ...  file, which  ... ; ", driven())


@pytest.mark.parametrize(
    ("text", "advice"),
    [
        ("<mujocoinclude/>", "give the file that includes it"),
        ("<launch/>", "give the URDF"),
        (TREE.replace('xyz="0 0 2"', 'xyz="${l} 0 2"'), "xacro FILE"),
    ],
)
def test_other_document_gets_advice(text, advice, tmp_path):
    complains(write(tmp_path, text, "model.xml"), advice, driven())


def test_document_type_is_refused(tmp_path):
    file = robot(tmp_path, '<!DOCTYPE r [<!ENTITY a "b">]>' + FOUR_BAR)
    complains(file, "found <!DOCTYPE>, expected none", DRIVE)


MOVING = """<robot name="r"><link name="base"/><link name="{name}"/><link name="tip"/>
<joint name="turn" type="{kind}"><parent link="base"/><child link="{name}"/>{limit}</joint>
<joint name="end" type="revolute"><parent link="{name}"/><child link="tip"/>{limit}</joint></robot>
"""
LIMIT = '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>'


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
@pytest.mark.parametrize("name", ["ground", "world"])
def test_moving_link_named_world_is_refused(name, kind, tmp_path):
    """It is not taken for the world, which would fix it in silence."""
    file = robot(tmp_path, MOVING.format(name=name, kind=kind, limit=LIMIT))
    complains(file, f"found '{name}' ... rename", DRIVE)
