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
from ..support.mechanisms import four_bar, mcpherson, slider_crank
from .test_chain import chain
from .test_sparse import CRANK, X, turning


def ready(mechanism):
    return SparseLanes(mechanism, Request(tuple(each.name for each in mechanism.drivers), ()))


def test_a_wrong_branch_is_no_solution():
    lanes = SparseLanes(CRANK, Request(("turn",), ()))
    lanes.stand_at(lanes.design, 1e-12)
    lanes.depart(0.0, turning(0.0))
    # half a turn about x: the axes are parallel, but opposite
    over = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    here = lanes.anchor(0.0)
    lanes.restore(replace(here, pose=(replace(here.pose[0], state=over), here.pose[1])))
    assert not lanes.attempt(np.zeros(1), turning(0.0))[0] > 0.0
    assert "wrong branch" in str(lanes.failure(1e-12))


def test_a_hinge_askew_has_one_verdict():
    mechanism = four_bar()
    joints = [
        joint.changed(axis=(0.0, 1.0, 1e-3)) if joint.name == "D" else joint
        for joint in mechanism.joints
    ]
    for method in (Method.ONE_PROGRAM, Method.SPARSE):
        with pytest.raises(SolveError, match=r"0 degrees of freedom .* but 1 driver"):
            solve_as(method, replace(mechanism, joints=joints), turning(0.5))


def test_an_end_of_the_travel_is_told_and_the_other_side_goes_on():
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


def without_driver(mechanism):
    return Mechanism(mechanism.name, mechanism.bodies, mechanism.joints, mechanism.points)


def test_what_cannot_be_solved_is_refused_by_name():
    whole = chain(40)
    with pytest.raises(
        SolveError,
        match=(
            r"1 degree of freedom .* but 0 drivers; what can still move is most of all 'crank0', "
        ),
    ):
        ready(without_driver(whole))
    second = JointAngle("second", "pivot20")
    with pytest.raises(
        SolveError, match=r"1 degree of freedom .* but 2 drivers; not independent are .*'second'"
    ):
        ready(Mechanism("two", whole.bodies, whole.joints, (), [*whole.drivers, second]))
    stretched = slider_crank()
    push = [PointCoordinate("push", "end", X)]
    with pytest.raises(SolveError, match=r"driven by 'push' it does not move .*dead centre"):
        ready(Mechanism("stuck", stretched.bodies, stretched.joints, stretched.points, push))
    m = mcpherson()
    joints = [
        joint.changed(length=3.0) if isinstance(joint, Distance) else joint for joint in m.joints
    ]
    with pytest.raises(SolveError, match="does not close at the design position: residual"):
        ready(Mechanism("apart", m.bodies, joints, m.points, m.drivers))
    with pytest.raises(SolveError, match="no body can move"):
        ready(Mechanism("still", [Body("wall", fixed=True)], []))


def test_a_rod_that_spins_freely_is_named():
    mechanism = mcpherson()
    rod = [
        Spherical("inner", "chassis", "rod", (1.14, 0.355, 0.1455)),
        Spherical("outer", "knuckle", "rod", (1.115, 0.665, 0.118)),
    ]
    joints = [*(joint for joint in mechanism.joints if not isinstance(joint, Distance)), *rod]
    with pytest.raises(SolveError, match=r"but 1 driver; 'rod' can turn; .*use distance"):
        ready(
            Mechanism(
                "spinning",
                [*mechanism.bodies, Body("rod")],
                joints,
                mechanism.points,
                mechanism.drivers,
            )
        )
