"""Verdicts and digits do not depend on the blocks that a mechanism is solved by."""

import numpy as np
import pytest
from kincheck import Ramp, Sine, cases, solve
from kincheck.core.extensions.laboratory.bench.size import LEAN, ring
from kincheck.core.kinematics import Method, NativeSolver, start_of
from kincheck.core.kinematics.compiled.compiled_model import recent_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.compiled.routes import Route
from kincheck.core.kinematics.continuation.singular_samples import scrutinise
from kincheck.core.kinematics.continuation.walk import follow_samples
from kincheck.core.mechanism.motions import Path

from ...support.block_structures import assert_alike, solve_as, torus, with_one_program
from ...support.mechanisms import (
    BRANCH,
    chain,
    chain_end,
    crank_tip,
    errors,
    four_bar,
    mcpherson,
    slider_crank,
)

METHODS = Method.ONE_PROGRAM, Method.BY_COMPONENTS, Method.SPARSE


def in_every_way(mechanism, turn, points, driver="turn"):
    path = Path({driver: Ramp(1.0)}, np.asarray(turn))
    return [solve_as(method, mechanism, path, points) for method in METHODS]


IN_BLOCKS = pytest.mark.parametrize("method", METHODS[1:])


# several drivers, redundant rows, all kinds of joints, a sweep that does not start at the design
@IN_BLOCKS
@pytest.mark.by_day(2)
@pytest.mark.parametrize(
    "name",
    [
        *("mcpherson_steered", "mcpherson_strut", "bricard", "four_bar"),
        *("andrews_squeezer", "delta_robot", "double_cardan", "rssr"),
    ],
)
def test_blocks_match_one_program(name, method):
    case = cases.load(name)
    assert_alike(*with_one_program(method, case.mechanism, case.sweep.path, case.points))


@IN_BLOCKS
@pytest.mark.parametrize(
    "times",
    [
        np.linspace(2.0, 3.0, 5),
        np.linspace(-0.2, 0.9, 70)[::-1],
        np.zeros(1),
        np.array([0.5, 0.5, -0.5]),
    ],
    ids=["beyond the design", "backwards", "at the design", "in no order"],
)
def test_blocks_with_unordered_samples(times, method):
    for mechanism in (slider_crank(1.01), four_bar()):
        points = tuple(point.name for point in mechanism.points)
        path = Path({"turn": Ramp(2.0)}, times)
        assert_alike(*with_one_program(method, mechanism, path, points))


@pytest.mark.parametrize(
    ("method", "mechanism", "point", "body"),
    [
        (Method.BY_COMPONENTS, chain(3), "end", "crank3"),
        (Method.SPARSE, ring(12), "tip6", "plate5"),
    ],
    ids=METHODS[1:],
)
def test_blocks_by_numpy(method, mechanism, point, body):
    path = Path({"turn": Ramp(1.0)}, np.linspace(-0.5, 0.5, 9))
    found = (
        solve_as(method, mechanism, path, [point], [body], compiled=each) for each in (False, True)
    )
    assert_alike(*found)


@pytest.mark.by_day(2)
@IN_BLOCKS
@pytest.mark.parametrize(
    "times",
    [np.linspace(-7.0, -6.0, 5), np.linspace(1001.0, 1000.0, 4)],
    ids=["before", "long after"],
)
def test_blocks_start_away_from_design(times, method):
    """The drivers go there in a second of their own; the path's own time may be any."""
    for mechanism, point in ((chain(3), "end"), (four_bar(), "C")):
        path = Path({"turn": Sine(1.2, 1e-2, np.pi / 2.0)}, times)
        assert not start_of(mechanism, path).starts_at_design
        assert_alike(*with_one_program(method, mechanism, path, (point,)))


@pytest.mark.parametrize("method", METHODS)
def test_limit_of_travel_has_one_verdict(method):
    values = np.linspace(-0.04, 0.4, 23)
    path = Path({"stroke": Ramp(1.0)}, values)
    solver = NativeSolver(order=1, method=method).prepare(mcpherson(), path, ["wheel"], ["knuckle"])
    found, again = solver(1e-12), solver(1e-12)
    assert (found.solved == (values < 0.29337)).all()  # formulation section 10
    wheel, knuckle = found.points["wheel"], found.bodies["knuckle"]
    assert np.isnan(wheel.position[~found.solved]).all()
    assert (wheel.acceleration, knuckle.a) == (None, None)
    assert np.array_equal(again.points["wheel"].position, wheel.position, equal_nan=True)
    assert "cannot be followed beyond stroke = 0.293" in found.message
    assert "last reachable sample at stroke = 0.28; shorten the sweep" in found.message
    assert ("knuckle" in found.message) or method is Method.SPARSE
    assert 0.0 < found.details["smallest_singular_value"] < 1e-1
    far = solve_as(
        method, mcpherson(), Path({"stroke": Ramp(1.0)}, np.array([0.4, 0.5])), ["wheel"]
    )
    assert "no sample reached on this side" in far.message
    assert not far.solved.any()
    assert far.points["wheel"].position.shape == (2, 3)
    # nothing was found, which is not zero
    details = (
        far.residual,
        far.details["smallest_singular_value"],
        far.details["redundant_residual"],
    )
    assert np.isnan(details).all()


@pytest.mark.by_day(3)
@pytest.mark.parametrize("size", [(2, 2, 2), (2, 3, 1), (3, 3, 3)], ids=["2x2", "2x3", "3x3"])
def test_torus_has_one_verdict(size):
    """Singular values vanish in pairs and in threes: neither pivots nor signs of determinants show
    it, estimates of singular values do.
    """
    rows, columns, crossed = size
    mechanism, at = torus(rows, columns)
    turn = np.linspace(-0.5, 0.5, 32)
    for found in in_every_way(mechanism, turn, ("tip",)):
        assert found.solved.all(), found.message
        notes = found.details["notes"]
        assert sum("crosses a singular pose" in note for note in notes) >= crossed
        position, *rates = crank_tip(at[0], LEAN - turn)
        expected = position + [0.0, at[1], 0.0], *rates
        # what is interpolated is allowed 1e-9
        assert (errors(found.points["tip"], expected) <= [3e-14, 1e-11, 1e-9]).all()


@pytest.mark.parametrize("count", [1, 3, 9, 65])
def test_links_in_line_have_one_verdict(count):
    """The middle sample is where all links are in line: what is known on both sides gives it."""
    turn = BRANCH + (np.linspace(-0.5, 0.5, count) if count > 1 else np.zeros(1))
    for found in in_every_way(chain(3), turn, ("end",)):
        assert found.solved.all(), found.message
        assert errors(found.points["end"], chain_end(3, turn))[0] <= 1e-11
        assert any("interpolated there" in note for note in found.details["notes"])


def test_component_rates_beside_singular_pose():
    """Two millionths of a radian from a singular pose, rates were wrong in silence."""
    turn = BRANCH - np.array([1e-1, 1e-5, 2e-6])
    found = solve(chain(21), "turn", turn)
    off = np.abs(found.points["end"].acceleration - chain_end(21, turn)[2]).max(axis=1)
    assert (off[found.solved] <= 1e-9).all()


ACROSS = Path({"turn": Ramp(1.0)}, np.linspace(-0.5, 0.5, 32))
"""Over singular poses of the torus."""


def test_singular_samples_are_cached_by_route():
    """A route that is solved again gives the same digits, findings and details, and its owner may
    change them.
    """
    mechanism, _ = torus(2, 2)
    solver = NativeSolver(method=Method.ONE_PROGRAM).prepare(mechanism, ACROSS, ("tip",))
    first, second = solver(1e-12), solver(1e-12)
    assert first.details["retried_samples"] > 0
    assert first.details == second.details
    for label in ("position", "velocity", "acceleration"):
        np.testing.assert_array_equal(
            getattr(first.points["tip"], label), getattr(second.points["tip"], label)
        )
    second.details["notes"].clear()
    second.details["singular_poses"].clear()
    assert solver(1e-12).details == first.details


def test_singular_samples_of_other_poses():
    mechanism, _ = torus(2, 2)
    route = Route(recent_model(mechanism, Request(("turn",), ("tip",))), ACROSS)
    findings = [scrutinise(route, follow_samples(route, 1e-12), 1e-12) for _ in range(2)]
    assert findings[0] is findings[1]
    other = follow_samples(route, 1e-12)
    other.kept[route.model.rows["position tip"].start, 3] += 1e-6
    assert scrutinise(route, other, 1e-12) is not findings[0]
