"""Forces by the mechanism's own program, against singular values over its solved motion."""

import numpy as np
import pytest
from kincheck import cases
from kincheck.core import solve
from kincheck.core.joints import Gear, Revolute, Screw
from kincheck.core.kinematics import Method, NativeSolver, Style, with_forces
from kincheck.core.kinematics.compiled.solution import ForceTable
from kincheck.core.kinematics.forces.wanted import wanted_forces
from kincheck.core.mechanism import motions
from kincheck.core.mechanism.body import Body
from kincheck.core.mechanism.loads import Force, SpringDamper, Torque, TorsionSpringDamper
from kincheck.core.mechanism.mechanism import Mechanism
from kincheck.core.mechanism.motions import JointAngle
from kincheck.core.program.llvm.compiler import available

from ..support.loads import GRAVITY, loaded, six
from .test_chain import chain
from .test_singular import BRANCH


def both(mechanism, path, *, style="native", compiled=False):
    """The forces by the program, and by singular values over the motion of all bodies."""
    names = tuple(body.name for body in mechanism.moving)
    solver = NativeSolver(style=Style(style), compiled=compiled, method=Method.ONE_PROGRAM)
    members = (*mechanism.joints, *mechanism.drivers, *mechanism.forces)
    traced = solver.prepare(mechanism, path, forces=[each.name for each in members])(1e-12)
    motion = NativeSolver().prepare(mechanism, path, bodies=names)(1e-12)
    return traced, with_forces(mechanism, path, motion)


def by_program(trajectory):
    """Whether the program computed the forces, and they were not found anew."""
    return not isinstance(trajectory.forces.joints, dict)


def agree(traced, expected, allowed=1e-13):
    """All that both have is the same to round-off of the largest force."""
    found, wanted = traced.forces, expected.forces
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
    return motions.Path(path.motions, path.times[::step], path.design)


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize(
    "name", ["mcpherson_strut", "four_bar", "bricard", "planar_slider_crank", "rssr"]
)
def test_traced_forces_equal_svd_forces(name, compiled):
    if compiled and not available():
        pytest.skip("llvmlite is missing")
    case = cases.load(name)
    traced, expected = both(loaded(case.mechanism), few(case), compiled=compiled)
    assert by_program(traced)
    agree(traced, expected)


@pytest.mark.parametrize("style", ["paper", "conventional", "mixed", "relative"])
@pytest.mark.parametrize("name", ["mcpherson_strut", "four_bar"])
def test_traced_forces_in_row_styles(style, name):
    case = cases.load(name)
    traced, expected = both(loaded(case.mechanism), few(case), style=style)
    assert by_program(traced)
    agree(traced, expected)


def train():
    """A screw that lifts a nut, geared to a shaft, with an element of every kind."""
    z, tilted = (0.0, 0.0, 1.0), (0.6, 0.0, 0.8)
    moments = np.diag([0.3, 0.4, 0.5]) + 0.05
    bodies = [
        Body("nut", mass=2.0, center_of_mass=(0.2, 0.1, 0.3), inertia=six(moments)),
        Body("shaft", (1.0, 0.0, 0.0), mass=1.0, inertia=six(moments)),
    ]
    joints = [
        Screw("screw", "ground", "nut", (0.1, 0.2, 0.3), tilted, 0.05),
        Revolute("hinge", "shaft", "ground", (1.0, 0.0, 0.0), z),
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


@pytest.mark.parametrize("style", ["native", "mixed", "relative"])
def test_traced_forces_of_every_element(style):
    """Angles of torsional springs are followed through more than a turn."""
    path = motions.Path({"screw": motions.Sine(9.0, 0.3)}, np.linspace(-0.6, 0.9, 9))
    traced, expected = both(train(), path, style=style)
    assert by_program(traced)
    agree(traced, expected, 1e-12)


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
    case = cases.load("mcpherson_strut")
    mechanism = loaded(case.mechanism)
    values = np.array([0.0, 0.05, 5.0])
    found = solve(mechanism, "stroke", values, forces=True)
    assert found.solved.tolist() == [True, True, False]
    for each in found.forces.joints.values():
        assert np.isfinite(each.force).all(axis=1).tolist() == found.solved.tolist()
        assert each.determined() == (3, 3, 6)
    assert np.isfinite(found.forces.power).tolist() == found.solved.tolist()
    assert found.facts["forces"]["power_missing"] <= 1e-13


def test_large_mechanism_forces_by_svd():
    mechanism = loaded(chain(21))
    found = solve(mechanism, "turn", [0.1, 0.2], forces=["turn"])
    assert not by_program(found)
    assert np.isfinite(found.forces.drivers["turn"]).all()
    assert np.abs(found.forces.power).max() <= 1e-12 * found.forces.largest_power.max()


def test_program_holds_requested_forces_only():
    case = cases.load("mcpherson_strut")
    mechanism = loaded(case.mechanism)
    found = solve(mechanism, "stroke", case.sweep.values[::40], forces=["ball"])
    assert by_program(found)
    assert [*found.forces.joints] == ["ball"]
    with pytest.raises(KeyError):
        found.forces.joints["tie_rod"]
    program = found.details["program"]["outputs"]["flops"]
    every = solve(mechanism, "stroke", case.sweep.values[::40], forces=True).details["program"]
    without = solve(mechanism, "stroke", case.sweep.values[::40]).details["program"]
    assert without["outputs"]["flops"] < program < every["outputs"]["flops"]


def test_nearly_singular_rows_use_svd_forces():
    mechanism = loaded(cases.load("rssr").mechanism)
    wanted = wanted_forces(mechanism, [])
    power, own = {"power": slice(0, 2)}, {"force sigma": slice(2, 3)}
    regular = ForceTable(wanted, power, 1.0)
    table = np.array([[0.0, 1.0, 0.5], [0.0, 1.0, 1e-7], [np.nan] * 3])
    assert regular.read(table, 1e-3) is not None
    assert regular.read(table, 1e-5) is None
    assert regular.read(table, np.nan) is None
    assert ForceTable(wanted, power | own, 1.0).read(table, 1.0) is None
    # rows that are chosen of more may be nearly singular where all of them are not
    chosen = ForceTable(wanted, power | {"redundant": slice(3, 5)}, 1.0)
    assert chosen.read(np.zeros((3, 5)), 5e-4) is None
