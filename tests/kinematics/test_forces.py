"""Reactions and efforts: equilibrium of every body, row styles, and what is determined."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import cases
from kincheck.core import solve
from kincheck.core.errors import SolveError
from kincheck.core.kinematics import NativeSolver
from kincheck.core.mechanism.motions import Path, Ramp

from ..oracles import naive, newton_euler
from ..support.loads import loaded, pushes, solved

EQUILIBRIUM = [
    "mcpherson_strut",
    "mcpherson_steered",
    "rssr",
    "four_bar",
    "spatial_slider_crank",
    "bennett",
    "bricard",
    "hooke_joint_cross",
    "double_cardan",
    "chrono_multi_link_bodies",
]


@pytest.mark.parametrize("name", EQUILIBRIUM)
def test_reactions_hold_bodies_in_equilibrium(name):
    """Newton and Euler, body by body: no row of the formulation is asked."""
    case = cases.load(name)
    mechanism = loaded(case.mechanism)
    found = solved(mechanism, case)
    every = range(0, len(case.sweep.values), max(1, len(case.sweep.values) // 5))
    largest = max(np.abs(each.force).max() for each in found.forces.joints.values())
    for k in every:
        left = newton_euler.left_over(mechanism, found, k, pushes(mechanism, found, k))
        for force, torque in left.values():
            assert max(np.abs(force).max(), np.abs(torque).max()) <= 1e-11 * largest
    assert np.abs(found.forces.power).max() <= 1e-12 * found.forces.largest_power.max()


def test_forces_of_named_members_only():
    case = cases.load("mcpherson_strut")
    mechanism = loaded(case.mechanism)
    found = solve(mechanism, "stroke", case.sweep.values, forces=["tie_rod"])
    assert [*found.forces.joints] == ["tie_rod"]
    assert [*found.forces.drivers] == []
    assert [*found.bodies] == []
    assert solve(mechanism, "stroke", case.sweep.values).forces is None
    with pytest.raises(SolveError, match="did you mean 'tie_rod'"):
        solve(mechanism, "stroke", case.sweep.values, forces=["tie_rods"])
    with pytest.raises(SolveError, match="expected a list of names"):
        solve(mechanism, "stroke", case.sweep.values, forces="tie_rod")


# Determinacy: forces.md of the study gives the same numbers


@pytest.mark.parametrize(
    ("name", "joint", "expected"),
    [
        ("mcpherson_strut", "ball", (3, 3, 6)),
        ("spatial_slider_crank", None, (3, 3, 6)),
        ("modelica_four_bar_universal", None, (3, 3, 6)),
        ("bricard", None, (None, None, 5)),
        ("bennett", None, (0, None, 3)),
        # of four parallel hinges: the force in the plane and the moment about its normal
        ("four_bar", None, (2, 1, 3)),
        ("planar_slider_crank", "crank_pin", (2, 1, 3)),
    ],
)
def test_determined_directions_of_redundant_joints(name, joint, expected):
    case = cases.load(name)
    mechanism = loaded(case.mechanism)
    found = solved(mechanism, case).forces
    for each, reaction in found.joints.items():
        if joint in (None, each):
            for count, wanted in zip(reaction.determined(), expected, strict=True):
                assert wanted in (None, count), (each, reaction.determined())
    # the effort is unique in every one of them
    assert all(np.isfinite(each).all() for each in found.drivers.values())


@pytest.mark.parametrize(
    "p", [(1.0, 0.0, 0.0, 0.0), (0.8, 0.36, 0.48, 0.0)], ids=["flat", "tilted"]
)
def test_undetermined_force_component_is_nan(p):
    """In a plane two directions of the force and one of the moment are determined; where it is
    tilted, no global component is.
    """
    turn = naive.A(np.array(p))
    case = cases.load("planar_slider_crank")

    def tilted(vector):
        return tuple(turn @ np.array(vector))

    joints = [
        replace(each, point=tilted(each.point), axis=tilted(each.axis))
        for each in case.mechanism.joints
    ]
    points = [replace(each, position=tilted(each.position)) for each in case.mechanism.points]
    mechanism = loaded(replace(case.mechanism, joints=joints, points=points))
    found = solved(mechanism, case).forces.joints["crank_pin"]
    assert found.determined() == (2, 1, 3)
    for moment in (False, True):
        known = [np.isfinite(found.along(axis, moment=moment)).all() for axis in turn.T]
        assert known == [not moment, not moment, moment]
    assert np.isfinite(found.along(0.6 * turn[:, 0] + 0.8 * turn[:, 1])).all()
    if p[0] < 1.0:
        assert all(np.isnan(found.along(axis)).all() for axis in np.eye(3))


@pytest.mark.parametrize(("values", "tol"), [([], 1e-12), ([0.1, 0.2], 1e-18)])
def test_forces_without_solved_sample_are_nan(values, tol):
    path = Path({"crank": Ramp(1.0)}, np.array(values))
    mechanism, solver = cases.load("four_bar").mechanism, NativeSolver(compiled=False)
    found = solver.prepare(mechanism, path, forces=["crank", "coupler_pin"])(tol)
    assert not found.solved.any()
    assert found.forces.power.shape == (len(values),)
    for each in (
        found.forces.power,
        found.forces.drivers["crank"],
        found.forces.joints["coupler_pin"].force,
    ):
        assert len(each) == len(values)
        assert np.isnan(each).all()
