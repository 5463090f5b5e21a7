"""What a sparse system does not solve, and the reason it gives by name."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core import (
    Body,
    Distance,
    JointAngle,
    Mechanism,
    PointCoordinate,
    SolveError,
    Spherical,
)
from kincheck.core.kinematics import Method
from kincheck.core.kinematics.blocks.sparse_lanes import SparseLanes
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.mechanism.motions import Path, Ramp

from ..support.block_structures import solve_as, solve_sparse
from ..support.mechanisms import X, chain, four_bar, mcpherson, slider_crank
from .test_sparse import CRANK, turning


def test_sparse_wrong_branch_is_refused():
    lanes = SparseLanes(CRANK, Request(("turn",), ()))
    lanes.solve_near(lanes.design, 1e-12)
    lanes.set_prediction_start(0.0, turning(0.0))
    # half a turn about x: the axes are parallel, but opposite
    over = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    here = lanes.anchor(0.0)
    lanes.restore(replace(here, pose=(replace(here.pose[0], state=over), here.pose[1])))
    assert not lanes.attempt(np.zeros(1), turning(0.0))[0] > 0.0
    assert "wrong branch" in str(lanes.failure(1e-12))


def test_tilted_hinge_has_one_verdict():
    mechanism = four_bar()
    joints = [
        joint.changed(axis=(0.0, 1.0, 1e-3)) if joint.name == "D" else joint
        for joint in mechanism.joints
    ]
    for method in (Method.ONE_PROGRAM, Method.SPARSE):
        with pytest.raises(SolveError, match=r"0 degrees of freedom .* but 1 driver"):
            solve_as(method, replace(mechanism, joints=joints), turning(0.5))


def test_sparse_limit_of_travel():
    values = np.linspace(-0.04, 0.4, 23)
    found = solve_sparse(
        mcpherson(), Path({"stroke": Ramp(1.0)}, values), ["wheel"], ["knuckle"], order=1
    )
    assert (found.solved == (values < 0.29337)).all()  # formulation section 10
    assert np.isnan(found.points["wheel"].position[~found.solved]).all()
    assert "cannot be followed beyond stroke = 0.293" in found.message
    assert "last reachable sample at stroke = 0.28;" in found.message
    assert 0.0 < found.details["smallest_singular_value"] < 1e-1
    assert found.points["wheel"].acceleration is None
    assert found.bodies["knuckle"].a is None
    far = solve_sparse(mcpherson(), Path({"stroke": Ramp(1.0)}, np.array([0.4, 0.5])))
    assert "no sample reached on this side" in far.message
    assert not far.solved.any()
    assert np.isnan([far.residual, far.details["redundant_residual"]]).all()


CHAIN, STRUT, STRETCHED = chain(40), mcpherson(), slider_crank()
ROD = [
    Spherical("inner", "chassis", "rod", (1.14, 0.355, 0.1455)),
    Spherical("outer", "knuckle", "rod", (1.115, 0.665, 0.118)),
]
REFUSED = [
    (
        replace(CHAIN, drivers=()),
        r"1 degree of freedom .* but 0 drivers; what can still move is most of all 'crank0', ",
    ),
    (
        replace(CHAIN, drivers=[*CHAIN.drivers, JointAngle("second", "pivot20")]),
        r"1 degree of freedom .* but 2 drivers; not independent are .*'second'",
    ),
    (
        replace(STRETCHED, drivers=[PointCoordinate("push", "end", X)]),
        r"driven by 'push' it does not move .*dead centre",
    ),
    (
        replace(
            STRUT,
            joints=[
                each.changed(length=3.0) if isinstance(each, Distance) else each
                for each in STRUT.joints
            ],
        ),
        "does not close at the design position: residual",
    ),
    (Mechanism("still", [Body("wall", fixed=True)], []), "no body can move"),
    (
        replace(
            STRUT,
            bodies=[*STRUT.bodies, Body("rod")],
            joints=[*(each for each in STRUT.joints if not isinstance(each, Distance)), *ROD],
        ),
        r"but 1 driver; 'rod' can turn; .*use distance",
    ),
]


@pytest.mark.parametrize(("mechanism", "message"), REFUSED)
def test_sparse_refusals_name_cause(mechanism, message):
    with pytest.raises(SolveError, match=message):
        SparseLanes(mechanism, Request(tuple(each.name for each in mechanism.drivers), ()))
