"""Where a motion by components ends, what it passes, and the component that is named."""

from pathlib import Path as File

import numpy as np
import pytest
from kincheck.core import Body, Gear, JointAngle, Mechanism, Point, Revolute, SolveError
from kincheck.core.case.io.case_file import load_case
from kincheck.core.kinematics import Method, NativeSolver
from kincheck.core.kinematics.blocks.component_lanes import ComponentLanes
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.mechanism.motions import Path, Ramp

from ..support.block_structures import assert_alike, solve_components, with_one_program
from ..support.mechanisms import LEAN, chain, mcpherson


def test_component_limit_of_travel_is_reported():
    mechanism = mcpherson()
    values = np.linspace(0.0, 0.4, 41)
    path = Path({"stroke": Ramp(1.0)}, values)
    solve = NativeSolver(method=Method.BY_COMPONENTS).prepare(mechanism, path, ("wheel",))
    found = solve(1e-12)
    assert (found.solved == (values < 0.29337)).all()  # formulation section 10
    assert np.isnan(found.points["wheel"].position[~found.solved]).all()
    assert "cannot be followed beyond stroke = 0.293" in found.message
    assert "knuckle" in found.message
    assert "; last reachable sample at stroke = 0.29; shorten the sweep" in found.message
    assert np.array_equal(
        solve(1e-12).points["wheel"].position, found.points["wheel"].position, equal_nan=True
    )


def test_singular_component_is_named():
    """The second of two four-bars, which cannot turn on; the first one's crank can, and its
    residuals are no larger.
    """
    # ground, rod, rocker, crank, angle
    links = {"rod0": (4.0, 3.2, 2.6, 1.0, 1.0), "rod1": (4.0, 3.0, 1.5, 2.0, 1.3)}
    axis = (0.0, 0.0, 1.0)
    bodies, joints, start = (
        [Body("crank")],
        [Revolute("turn", "ground", "crank", (0.0, 0.0, 0.0), axis)],
        0.0,
    )
    carrier = "crank"
    for k, (rod, (ground, long, rocker, crank, angle)) in enumerate(links.items()):
        a, c = (
            np.array([start, 0.0]) + crank * np.array([np.cos(angle), np.sin(angle)]),
            np.array([start + ground, 0.0]),
        )
        apart = c - a
        along = (apart @ apart + long**2 - rocker**2) / (2.0 * (apart @ apart))
        off = np.sqrt(long**2 / (apart @ apart) - along**2)
        b = a + along * apart + off * np.array([-apart[1], apart[0]])
        bodies += [Body(rod), Body(f"rocker{k}")]
        ends = (
            (f"a{k}", carrier, rod, a),
            (f"b{k}", rod, f"rocker{k}", b),
            (f"c{k}", "ground", f"rocker{k}", c),
        )
        joints += [
            Revolute(name, i, j, (*map(float, place), 0.0), axis) for name, i, j, place in ends
        ]
        carrier, start = f"rocker{k}", start + ground
    mechanism = Mechanism(
        "two loops",
        bodies,
        joints,
        [Point("end", carrier, (start, 0.0, 0.0))],
        [JointAngle("turn", "turn")],
    )
    for values in (np.linspace(0.0, 6.0, 31), [0.0, 3.0], [0.1, 2.0, 4.0]):
        found = solve_components(mechanism, Path({"turn": Ramp(1.0)}, np.array(values)), ("end",))
        assert not found.solved.all()
        assert "the component of rod1, rocker1: there is a singular pose ahead" in found.message


def test_components_refuse_couplers_and_freedom():
    m = chain(2)
    coupled = type(m)(
        m.name,
        m.bodies,
        m.joints,
        m.points,
        m.drivers,
        [Gear("gear", ("pivot0", "pivot1"), ratio=1.0)],
    )
    with pytest.raises(SolveError, match="couplers"):
        ComponentLanes(coupled, Request(("turn",), ()))
    free = type(m)(m.name, m.bodies, m.joints, m.points, [])
    with pytest.raises(SolveError, match="not driven enough"):
        ComponentLanes(free, Request((), ()))
    assert isinstance(m.drivers[0], JointAngle)


def test_chain_passes_links_in_line():
    """Every loop may fold there; that the motion goes on is said."""
    loops, turn = 20, np.linspace(-0.1, 2.4, 26)
    found = solve_components(chain(loops), Path({"turn": Ramp(1.0)}, turn), ("end",))
    assert found.solved.all(), found.message
    expected = np.column_stack([loops + np.sin(LEAN - turn), np.cos(LEAN - turn), 0.0 * turn])
    # every loop adds its rounding, over the sine of how far its links are from in line
    rounding = 4.0 * loops * np.finfo(float).eps / np.abs(np.cos(turn - LEAN))
    assert (np.abs(found.points["end"].position - expected).max(axis=1) <= rounding).all()
    (note,) = found.details["notes"]
    assert "crosses a singular pose near turn = 1.870" in note


def test_links_in_line_are_interpolated():
    turn = np.array([0.0, 1.8, LEAN + np.pi / 2.0, 1.9, 2.4])
    for values in (turn, turn[2:3]):
        found = solve_components(chain(3), Path({"turn": Ramp(1.0)}, values), ("end",))
        assert found.solved.all(), found.message
        assert any("interpolated there" in note for note in found.details["notes"])
        expected = np.column_stack([3.0 + np.sin(LEAN - values), np.cos(LEAN - values), 0 * values])
        assert np.abs(found.points["end"].position - expected).max() <= 1e-12


def test_components_without_solved_sample():
    found = solve_components(mcpherson(), Path({"stroke": Ramp(1.0)}, np.array([0.4])), ("wheel",))
    assert not found.solved.any()
    # nothing was found, which is not zero
    assert np.isnan([found.residual, found.details["smallest_singular_value"]]).all()


@pytest.mark.parametrize("name", ["kite", "four_bar_in_one_step"])
def test_components_stop_at_narrow_gap(name):
    """The sample is beyond a gap, or a corner, of less than a thousandth of the step."""
    case = load_case(File(__file__).parents[1] / "data" / "stress" / f"{name}.toml")
    path = case.sweep.path
    found, expected = with_one_program(Method.BY_COMPONENTS, case.mechanism, path, case.points)
    if expected.solved.all():
        assert_alike(found, expected)
    else:
        assert not found.solved.any()
        assert "cannot be followed beyond" in found.message
