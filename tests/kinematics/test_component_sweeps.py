"""Where a motion by components ends, what it passes, and the component that is named."""

from dataclasses import replace
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
from ..support.mechanisms import (
    BRANCH,
    LEAN,
    ORIGIN,
    Z,
    chain,
    chain_end,
    circles_meet,
    errors,
    mcpherson,
)


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
    bodies, joints = [Body("crank")], [Revolute("turn", "ground", "crank", ORIGIN, Z)]
    carrier, start = "crank", 0.0
    for k, (angle, crank, rod, rocker) in enumerate(((1.0, 1.0, 3.2, 2.6), (1.3, 2.0, 3.0, 1.5))):
        pin = (start + crank * np.cos(angle), crank * np.sin(angle), 0.0)
        start += 4.0
        rest = (start, 0.0, 0.0)
        meet = tuple(circles_meet(pin, rod, rest, rocker).tolist())
        bodies += [Body(f"rod{k}"), Body(f"rocker{k}")]
        joints += [
            Revolute(f"a{k}", carrier, f"rod{k}", pin, Z),
            Revolute(f"b{k}", f"rod{k}", f"rocker{k}", meet, Z),
            Revolute(f"c{k}", "ground", f"rocker{k}", rest, Z),
        ]
        carrier = f"rocker{k}"
    mechanism = Mechanism(
        "two loops",
        bodies,
        joints,
        [Point("end", carrier, rest)],
        [JointAngle("turn", "turn")],
    )
    for values in (np.linspace(0.0, 6.0, 31), [0.0, 3.0], [0.1, 2.0, 4.0]):
        found = solve_components(mechanism, Path({"turn": Ramp(1.0)}, np.array(values)), ("end",))
        assert not found.solved.all()
        assert "the component of rod1, rocker1: there is a singular pose ahead" in found.message


def test_components_refuse_couplers_and_freedom():
    m = chain(2)
    coupled = replace(m, couplers=[Gear("gear", ("pivot0", "pivot1"), ratio=1.0)])
    with pytest.raises(SolveError, match="couplers"):
        ComponentLanes(coupled, Request(("turn",), ()))
    with pytest.raises(SolveError, match="not driven enough"):
        ComponentLanes(replace(m, drivers=[]), Request((), ()))


def test_chain_passes_links_in_line():
    """Every loop may fold there; that the motion goes on is said."""
    loops, turn = 20, np.linspace(-0.1, 2.4, 26)
    found = solve_components(chain(loops), Path({"turn": Ramp(1.0)}, turn), ("end",))
    assert found.solved.all(), found.message
    expected, *_ = chain_end(loops, turn)
    # every loop adds its rounding, over the sine of how far its links are from in line
    rounding = 4.0 * loops * np.finfo(float).eps / np.abs(np.cos(turn - LEAN))
    assert (np.abs(found.points["end"].position - expected).max(axis=1) <= rounding).all()
    (note,) = found.details["notes"]
    assert "crosses a singular pose near turn = 1.870" in note


def test_links_in_line_are_interpolated():
    turn = np.array([0.0, 1.8, BRANCH, 1.9, 2.4])
    for values in (turn, turn[2:3]):
        found = solve_components(chain(3), Path({"turn": Ramp(1.0)}, values), ("end",))
        assert found.solved.all(), found.message
        assert any("interpolated there" in note for note in found.details["notes"])
        assert errors(found.points["end"], chain_end(3, values))[0] <= 1e-12


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
