"""The comparison of public robots, on small models of our own."""

import pytest

from ...support.model_poses import EXACT
from .fuzz import mjcf

pytest.importorskip("mujoco")
public_robots = pytest.importorskip("tests.oracles.public_robots")
FOUR_BAR = mjcf.FOUR_BAR.decode()

PAIRED = """<robot name="r"><link name="base"/><link name="a"/><link name="b"/><link name="c"/>
<link name="x"/><link name="y"/>
<joint name="A" type="continuous"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/></joint>
<joint name="B" type="continuous"><parent link="a"/><child link="b"/><origin xyz="0 0 2"/></joint>
<joint name="D" type="continuous"><parent link="base"/><child link="c"/><origin xyz="4 0 0"/>
<axis xyz="0 1 0"/></joint>
<joint name="X" type="fixed"><parent link="b"/><child link="x"/><origin xyz="4 0 0.1"/></joint>
<joint name="Y" type="fixed"><parent link="c"/><child link="y"/><origin xyz="0 0 2"/></joint>
</robot>
"""
PAIRS = """closed_loop: [[x, y]]
type: [3d]
name_mot: [A]
joint_name: [B]
joint_type: [UJOINT_YX]
"""


def test_public_mjcf_loop_agrees_with_mujoco(tmp_path):
    (tmp_path / "bars.xml").write_text(FOUR_BAR)
    (tmp_path / "open.xml").write_text(
        mjcf.FOUR_BAR.decode().replace('pos="4 0 0"><joint', "><joint")
    )
    (tmp_path / "serial.xml").write_text(
        "<mujoco><worldbody><body><joint/></body></worldbody></mujoco>"
    )
    bars, refused = public_robots.rows_of([tmp_path])
    name, freedoms, size, closures, _, samples, *differences, residual = bars.cells
    assert (name, freedoms, size, closures) == ("bars.xml", "1", "3, 4", "1")
    assert samples == "9, 9 of 9"
    assert all(0.0 < float(each) < EXACT for each in (*differences, residual))
    assert refused.cells[0] == "open.xml"
    assert refused.cells[1].startswith("refused: ")


def test_loop_in_included_file_counts_once(tmp_path):
    whole = FOUR_BAR.replace("</mujoco>", '<include file="parts/loop.xml"/></mujoco>')
    start, end = whole.index("<equality>"), whole.index("</equality>") + len("</equality>")
    (tmp_path / "parts").mkdir()
    loop = f"<mujocoinclude>{whole[start:end]}</mujocoinclude>"
    (tmp_path / "parts" / "loop.xml").write_text(loop)
    (tmp_path / "bars.xml").write_text(whole[:start] + whole[end:])
    (row,) = public_robots.rows_of([tmp_path])
    assert (row.cells[0], row.cells[3]) == ("bars.xml", "1")


def test_urdf_with_pairs_agrees_with_pinocchio(tmp_path):
    pytest.importorskip("pinocchio")
    pytest.importorskip("yaml")
    (tmp_path / "robot.urdf").write_text(PAIRED)
    (tmp_path / "robot.yaml").write_text(PAIRS)
    (row,) = public_robots.rows_of([tmp_path])
    assert row.cells[5] == "9, 9 of 9", row
    assert all(0.0 < float(each) < EXACT for each in row.cells[6:])


def test_difference_from_mujoco_is_seen(tmp_path, monkeypatch):
    oracle = public_robots.MujocoNewton
    own = oracle.body
    monkeypatch.setattr(oracle, "body", lambda self, name: shifted(own(self, name)))
    file = tmp_path / "bars.xml"
    file.write_text(FOUR_BAR)
    (row,) = public_robots.rows_of([file])
    assert float(row.cells[6]) == pytest.approx(1e-6, rel=0.1)


def shifted(place):
    return None if place is None else (place[0] + 1e-6, place[1])
