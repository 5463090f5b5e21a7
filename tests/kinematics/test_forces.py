"""Reactions and efforts: equilibrium of every body, what is determined, by singular values, by the
mechanism's own program, and of many designs.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import (
    Body,
    Gear,
    JointAngle,
    Mechanism,
    Ramp,
    Revolute,
    Screw,
    Sine,
    SolveError,
    cases,
    solve,
)
from kincheck.core.kinematics import Method, NativeSolver, styles, with_forces
from kincheck.core.kinematics.compiled import traced_forces
from kincheck.core.kinematics.compiled.solution import ForceTable
from kincheck.core.kinematics.forces.wanted import wanted_forces
from kincheck.core.mechanism.loads import Force, SpringDamper, Torque, TorsionSpringDamper
from kincheck.core.mechanism.motions import Path
from kincheck.core.program.executor import compiler

from ..oracles import naive, newton_euler
from ..support.examples import examples
from ..support.loads import GRAVITY, loaded, pushes, six, solved
from ..support.mechanisms import BRANCH, X, Z, chain

(DETERMINED,) = examples(__file__, "determined")
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


@pytest.mark.by_day(2)
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


@pytest.mark.parametrize(("name", "joint", "expected"), DETERMINED, ids=str)
def test_determined_directions_of_redundant_joints(name, joint, expected):
    case = cases.load(name)
    mechanism = loaded(case.mechanism)
    found = solved(mechanism, case).forces
    for each, reaction in found.joints.items():
        if joint in ("", each):
            for count, wanted in zip(reaction.determined(), expected, strict=True):
                assert wanted in ("", count), (each, reaction.determined())
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


@pytest.mark.parametrize(("values", "tol"), [([], 1e-12), ([0.1, 0.2], 1e-18)], ids=str)
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


def by_program(trajectory):
    """Whether the program computed the forces, and they were not found anew."""
    return not isinstance(trajectory.forces.joints, dict)


def assert_traced(mechanism, path, allowed=1e-13, *, style="native", compiled=False):
    """The program's forces are those by singular values over the motion of all bodies, to round-off
    of the largest force.
    """
    names = tuple(body.name for body in mechanism.moving)
    solver = NativeSolver(style=style, compiled=compiled, method=Method.ONE_PROGRAM)
    members = (*mechanism.joints, *mechanism.drivers, *mechanism.forces)
    traced = solver.prepare(mechanism, path, forces=[each.name for each in members])(1e-12)
    assert by_program(traced)
    motion = NativeSolver().prepare(mechanism, path, bodies=names)(1e-12)
    found, wanted = traced.forces, with_forces(mechanism, path, motion).forces
    largest = max(np.nanmax(np.abs(each.force)) for each in wanted.joints.values())
    for name, reaction in wanted.joints.items():
        other = found.joints[name]
        for a, b in ((other.force, reaction.force), (other.moment, reaction.moment)):
            assert a == pytest.approx(b, abs=allowed * largest)
        # a basis of the undetermined directions is free; what it spans is not
        spans = [free @ free.swapaxes(1, 2) for free in (other.free, reaction.free)]
        np.testing.assert_allclose(*spans, rtol=0.0, atol=1e-13)
    for values, others in ((found.drivers, wanted.drivers), (found.elements, wanted.elements)):
        assert [*values] == [*others]
        for name in values:
            assert values[name] == pytest.approx(others[name], abs=allowed * largest)
    assert found.account()["determined_directions"] == wanted.account()["determined_directions"]
    assert np.nanmax(np.abs(found.power)) <= 1e-13 * np.nanmax(found.largest_power)
    np.testing.assert_allclose(found.largest_power, wanted.largest_power, rtol=1e-10)


def few(case, samples=7):
    """A few samples of a case's path."""
    path = case.sweep.path
    step = max(1, len(path.times) // samples)
    return Path(path.motions, path.times[::step], path.design)


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize(
    "name", ["mcpherson_strut", "four_bar", "bricard", "planar_slider_crank", "rssr"]
)
def test_traced_forces_equal_svd_forces(name, compiled):
    if compiled and not compiler():
        pytest.skip("nothing makes machine code")
    case = cases.load(name)
    assert_traced(loaded(case.mechanism), few(case), compiled=compiled)


def train():
    """A screw that lifts a nut, geared to a shaft, with an element of every kind."""
    tilted, moments = (0.6, 0.0, 0.8), np.diag([0.3, 0.4, 0.5]) + 0.05
    bodies = [
        Body("nut", mass=2.0, center_of_mass=(0.2, 0.1, 0.3), inertia=six(moments)),
        Body("shaft", X, mass=1.0, inertia=six(moments)),
    ]
    joints = [
        Screw("screw", "ground", "nut", (0.1, 0.2, 0.3), tilted, 0.05),
        Revolute("hinge", "shaft", "ground", X, Z),
    ]
    elements = [
        SpringDamper("spring", "nut", "shaft", ((0.5, 0.0, 0.0), (1.0, 0.4, 0.0)), 40.0, 3.0),
        TorsionSpringDamper("clock", "hinge", 5.0, 0.2, 0.4),
        TorsionSpringDamper("wound", "screw", 3.0, 0.1),
        Force("push", "nut", (0.3, 0.0, 0.0), (1.0, 2.0, 3.0), "body"),
        Torque("twist", "shaft", (0.5, 0.0, 0.7)),
    ]
    gear = Gear("hinge", ("screw", "hinge"), 2.0)  # a coupler may have a joint's name
    driver = JointAngle("screw", "screw")
    return Mechanism(
        "train", bodies, joints, [], [driver], [gear], gravity=GRAVITY, forces=elements
    )


@pytest.mark.parametrize("style", sorted({*styles()} - {"paper", "conventional"}))
def test_traced_forces_of_every_element(style):
    """Angles of torsional springs are followed through more than a turn."""
    path = Path({"screw": Sine(9.0, 0.3)}, np.linspace(-0.6, 0.9, 9))
    assert_traced(train(), path, 1e-12, style=style)


def test_forces_at_singular_pose_are_nan():
    """The pose is interpolated there; its forces are not."""
    mechanism = loaded(chain(1))
    turn = np.array([0.0, 0.7, 1.4, BRANCH, 2.3, 3.0])
    found = solve(mechanism, "turn", turn, forces=True)
    assert found.solved.all()
    assert not by_program(found)
    assert np.isnan(found.forces.drivers["turn"]).tolist() == (turn == BRANCH).tolist()
    assert "no forces at 1 sample" in found.message


def test_forces_beyond_lock_up_are_nan():
    mechanism = loaded(cases.load("mcpherson_strut").mechanism)
    found = solve(mechanism, "stroke", [0.0, 0.05, 5.0], forces=True)
    assert found.solved.tolist() == [True, True, False]
    for each in found.forces.joints.values():
        assert np.isfinite(each.force).all(axis=1).tolist() == found.solved.tolist()
        assert each.determined() == (3, 3, 6)
    assert np.isfinite(found.forces.power).tolist() == found.solved.tolist()
    assert found.facts["forces"]["power_missing"] <= 1e-13


@pytest.mark.needs("blocks")
def test_large_mechanism_forces_by_svd():
    mechanism = loaded(chain(21))
    found = solve(mechanism, "turn", [0.1, 0.2], forces=["turn"])
    assert not by_program(found)
    assert np.isfinite(found.forces.drivers["turn"]).all()
    assert np.abs(found.forces.power).max() <= 1e-12 * found.forces.largest_power.max()


def test_nearly_singular_rows_use_svd_forces():
    mechanism = loaded(cases.load("rssr").mechanism)
    wanted = wanted_forces(mechanism, [])
    power, own = {"power": slice(0, 2)}, {"force sigma": slice(2, 3)}
    regular = ForceTable(wanted, power, 0)
    table = np.array([[0.0, 1.0, 0.5], [0.0, 1.0, 1e-7], [np.nan] * 3])
    assert regular.read(table, 1e-3) is not None
    assert regular.read(table, 1e-5) is None
    assert regular.read(table, np.nan) is None
    assert ForceTable(wanted, power | own, 0).read(table, 1.0) is None
    # rows that are chosen of more may be nearly singular where all of them are not
    assert ForceTable(wanted, power, 1).read(table, 5e-4) is None


PIN = "joints.crank_pin.point"
NAMES = ("crank_pin", "gudgeon", "crank")
"""Two joints and the driver; rows are redundant, and some components not determined."""


@pytest.fixture(scope="module")
def case():
    return cases.load("planar_slider_crank")


def forces_of_designs(case, *, least=None):
    """The forces of three designs, and their geometry."""
    prepared = pytest.importorskip("kincheck.core.extensions.designs.prepared")
    designs = prepared.prepare_designs(
        NativeSolver(order=2), case.mechanism, case.sweep.path, [PIN], forces=NAMES
    )
    pin = np.array(case.mechanism.joint("crank_pin").point)
    geometry = pin[:, None] + np.outer([1.0, 0.5, 0.0], [-1e-3, 0.0, 2e-3])
    if least is not None:
        designs.route.model.forces.least = least
    found = designs.solve(geometry, 1e-12)
    assert found.solved.all(), found.messages
    return designs.forces(found, geometry, 1e-12)


@pytest.mark.parametrize("way", ["not traced", "singular"])
def test_design_forces_agree_in_both_ways(case, monkeypatch, way):
    right = forces_of_designs(case)
    assert right.decided.all()
    if way == "not traced":
        monkeypatch.setattr(traced_forces, "can_trace", lambda mechanism: False)
        found = forces_of_designs(case)
    else:  # as if every pose were nearly singular
        found = forces_of_designs(case, least=2.0)
    assert not found.decided.any()
    assert sorted(found.alone) == [0, 1, 2]
    for measure in (
        lambda forces: forces.drivers["crank"],
        lambda forces: forces.joints["gudgeon"].along(X),
        lambda forces: forces.joints["crank_pin"].along(Z, moment=True),
    ):
        values, expected = found.read(measure), right.read(measure)
        scale = np.nanmax(np.abs(expected), initial=0.0) or 1.0
        np.testing.assert_allclose(values / scale, expected / scale, atol=1e-12)
