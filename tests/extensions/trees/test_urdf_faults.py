"""URDF and the files beside it: one message for each fault."""

import numpy as np
import pytest
from kincheck.core.case.models.files import load

from ...support.case_texts import complains, write
from ...support.examples import examples
from ...support.model_files import driven, edited
from ...support.model_poses import solution
from ...support.urdf_texts import DRIVE, FOUR_BAR, TREE, beside, robot

FAULTS, PAIRS = examples(__file__, "faults", "pairs")


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
