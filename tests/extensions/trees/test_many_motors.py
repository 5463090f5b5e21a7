"""Robots of many motors that do not know of one another: the work grows with their number."""

from types import SimpleNamespace

import numpy as np
import pytest
from kincheck.core.case.models.files import load
from kincheck.core.extensions.trees.assembly import assemble
from kincheck.core.extensions.trees.driving import UndrivenMotions, read_start
from kincheck.core.extensions.trees.reader import read_tree
from kincheck.core.harness.compare import output_series
from kincheck.core.kinematics import Method, NativeSolver
from kincheck.core.mechanism.motions import Table
from kincheck.core.report.axis import driver_axis

JOINT = """<link name="l{0}"/><joint name="j{0}" type="revolute"><parent link="base"/>
<child link="l{0}"/><origin xyz="{0} 0 0"/><axis xyz="0 1 0"/>
<limit lower="{1}" upper="{2}" effort="1" velocity="1"/></joint>
<transmission name="t{0}"><joint name="j{0}"/><actuator name="m{0}"/></transmission>"""


def board(folder, count, lower=-0.5, upper=0.5):
    joints = "".join(JOINT.format(k, lower, upper + 0.001 * k) for k in range(count))
    (file := folder / f"board{count}.urdf").write_text(
        f'<robot name="board"><link name="base"/>{joints}</robot>'
    )
    return file


def solved(case):
    points = tuple(dict.fromkeys(name for each in case.outputs for name in each.points))
    return NativeSolver(method=Method.BY_COMPONENTS).prepare(
        case.mechanism, case.sweep.path, points
    )(1e-12)


@pytest.mark.needs("blocks")
@pytest.mark.parametrize("limits", [(-0.5, 0.5), (0.4, 2.9)])
def test_motion_evaluations_grow_linearly_with_motors(limits, tmp_path, monkeypatch):
    at, calls = Table.at, []

    def counted(self, t):
        calls.append(self)
        return at(self, t)

    monkeypatch.setattr(Table, "at", counted)
    each_one = []
    for motors in (8, 32):
        case = load(board(tmp_path, motors, *limits))
        found = solved(case)
        calls.clear()
        series = {each.name: output_series(case, each, found) for each in case.outputs}
        each_one.append(len(calls) / (motors - 1))  # the first one is the ramp of the sweep
        values = case.sweep.path.values(case.sweep.path.times)
        for k, name in enumerate(case.sweep.path.motions):
            assert np.allclose(series[f"{name}.angle"].position, values[k], rtol=0.0, atol=1e-9)
    assert each_one[0] == each_one[1]


def test_freedoms_of_separate_joints(tmp_path):
    model = assemble(read_start(read_tree(board(tmp_path, 5)), ()), None)
    assert [part.basis.shape for part in model.free] == [(1, 1)] * 5
    freedom = UndrivenMotions(model, {})
    freedom.take("j2")
    assert (freedom.dof, freedom.remaining, freedom.count("j2"), freedom.count("j3")) == (
        5,
        4,
        0,
        1,
    )


def test_axis_caption_of_many_drivers():
    driver = {"name": "d0", "type": "joint_angle"}
    record = SimpleNamespace(driver={f"d{k}": [0.0, 1.0] for k in range(100)})
    axis = driver_axis({"driver": driver}, [record], ())
    assert axis.besides == "Also driven: d1, d2, d3, d4, d5, d6, d7, d8 and 91 more."
    assert axis.at(1).endswith(" and 92 more")
