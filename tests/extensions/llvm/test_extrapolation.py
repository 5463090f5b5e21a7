"""Lanes that are predicted by the samples before them: to one iteration, to the same pose; and
where that fails, by their rates.
"""

from functools import partial

import numpy as np
import pytest
from kincheck import Ramp
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import ACCEPT, FROM, RATE, RATE_T, TIME, Request
from kincheck.core.kinematics.compiled.routes import weights_of_groups, weights_of_samples
from kincheck.core.kinematics.continuation.sweep import sweep
from kincheck.core.mechanism.motions import Path
from kincheck.core.program import NODES, NumpyExecutor, groups_behind, place_of

from ...support.examples import examples
from ...support.mechanisms import errors, mcpherson, slider_crank, slider_crank_motion

(SPANS,) = examples(__file__, "spans")

STROKES = np.linspace(-0.08, 0.08, 33)


@pytest.mark.parametrize(("lanes", "behind"), SPANS)
def test_extrapolation_nodes_span_groups(lanes, behind):
    nodes = [group * lanes + lane for group, lane in (place_of(k, lanes) for k in range(NODES))]
    assert groups_behind(lanes) == behind
    assert (nodes[0], nodes[-1]) == (0, behind * lanes - 1)
    assert np.ptp(np.diff(nodes)) <= 1


@pytest.mark.parametrize("lanes", [2, 4, 8])
def test_extrapolation_weights_are_fifth_order(lanes):
    times = np.cumsum(np.random.default_rng(1).uniform(0.5, 1.5, 40))
    values = np.polynomial.Polynomial([1.0, -2.0, 0.5, 1.0, -0.3, 0.02])(times / 10.0)
    of_samples, of_groups = weights_of_samples(times), weights_of_groups(times, lanes)
    behind = groups_behind(lanes) * lanes
    assert not of_samples[:, :NODES].any()
    assert not of_groups[:, :behind].any()
    for k in range(behind, len(times)):
        past = [
            values[j] for place in range(NODES) for j in range(k - NODES, k) if j % NODES == place
        ]
        assert of_samples[:, k] @ past == pytest.approx(values[k], rel=1e-11)
        groups = values[k // lanes * lanes - behind : k // lanes * lanes].reshape(-1, lanes)
        nodes = [groups[place_of(j, lanes)] for j in range(NODES)]
        assert of_groups[:, k] @ nodes == pytest.approx(values[k], rel=1e-9)
    for weights in (weights_of_samples, partial(weights_of_groups, lanes=lanes)):
        for few in range(9):
            assert weights(times[:few]).shape == (NODES, few)
        assert not np.isfinite(weights(np.repeat(times, 2))[:, 8:]).all(axis=0).any()


def positions(values, order=0, *, compiled=False):
    """Of the strut, as many samples at once as a vector of machine code has lanes."""
    model = compile_model(
        mcpherson(), Request(("stroke",), ("wheel",), order=order, compiled=compiled)
    )
    found = sweep(model, Path({"stroke": Ramp(1.0)}, np.asarray(values)), 1e-12)
    assert found.solved.all(), found.message
    return found


def assert_same(found, expected):
    """Two motions of the wheel that differ by round-off."""
    wheel = expected.points["wheel"]
    off = errors(found.points["wheel"], [wheel.position, wheel.velocity, wheel.acceleration])
    assert (off <= [4e-16, 4e-15, 4e-14][: len(off)]).all()


def crank_motion(angles, order=2, *, compiled=True):
    """The slider-crank at these angles, against its closed form; its iterations."""
    request = Request(("turn",), ("end",), order=order, compiled=compiled)
    path = Path({"turn": Ramp(1.0)}, angles)
    found = sweep(compile_model(slider_crank(), request), path, 1e-12)
    x = found.points["end"].position[:, 0]
    assert np.abs(x - slider_crank_motion(angles).x).max() <= 1e-15
    return found.iterations


@pytest.fixture
def eight_lanes(monkeypatch):
    monkeypatch.setattr("kincheck.core.kinematics.compiled.routes.LANES", 8)
    # whatever the processor's
    monkeypatch.setattr("kincheck.core.extensions.llvm.compiler.vector_width", lambda: 8)


@pytest.mark.usefixtures("eight_lanes")
@pytest.mark.parametrize("order", [0, 1, 2])
def test_extrapolated_lanes_need_one_iteration(order):
    fine = np.linspace(-0.08, 0.08, 161)
    found = positions(fine, order)
    # there is nothing yet to extrapolate the first eight on either side from
    later = np.abs(np.arange(161) - 80) > 8
    assert (found.iterations[later] == 1).all()
    by_rates = positions(fine[::8], order)  # all that is left of the lanes before are rates
    assert (by_rates.iterations[1:-1] > 1).any()
    assert errors(by_rates.points["wheel"], [found.points["wheel"].position[::8]])[0] <= 4e-16


@pytest.mark.parametrize("interpreted", [False, True])
@pytest.mark.parametrize("order", [0, 2])
@pytest.mark.parametrize("lanes", [2, 4, 8])
def test_extrapolation_by_several_vectors(lanes, order, interpreted, monkeypatch):
    """Whatever the processor's: it runs such vectors too. On from where the grid changes it takes
    as many again.
    """
    pytest.importorskip("llvmlite", reason="numpy takes as many lanes as there are samples")
    monkeypatch.setattr("kincheck.core.extensions.llvm.compiler.vector_width", lambda: lanes)
    monkeypatch.setattr("kincheck.core.extensions.llvm.jit.OFTEN", 10**9 if interpreted else 0)
    grid = np.concatenate(
        [
            np.linspace(-0.08, 0.0, 80),
            0.001 * np.arange(1.0, 41.0),
            0.06 + 0.001 * np.arange(1.0, 20.0),
        ]
    )
    found, first = positions(grid, order, compiled=True), groups_behind(lanes) * lanes
    assert_same(found, positions(grid, order))
    below, above = found.iterations[78::-1], found.iterations[79:]  # the sides, from the start
    assert (below[:first] > 1).any()
    assert (below[first:] == 1).all()
    assert (above[first:40] == 1).all()
    assert (above[41 : 41 + first] > 1).any()
    assert (above[41 + lanes + first :] == 1).all()


@pytest.mark.parametrize("order", [0, 2])
def test_extrapolation_carries_no_rates(order):
    found = compile_model(
        mcpherson(), Request(("stroke",), ("wheel",), order=order, compiled=False)
    )
    slots, vectors, plan = found.slots, found.vectors, found.plan
    left_out = {slot for name in (RATE, RATE_T) for slot in vectors[FROM + name]}
    assert {target for _, target in plan.continued} == {
        target for _, target in plan.carried
    } - left_out
    assert (slots[TIME], slots[FROM + TIME]) in {*plan.continued}
    # what stands in the last lane `extrapolate` puts out itself
    puts = plan.programs["extrapolate"].outputs
    assert {*plan.moves} == {pair for pair in plan.continued if pair[1] not in puts}
    assert {target for _, target in plan.moves} == {slots[name] for name in (FROM + TIME, *ACCEPT)}


def test_gaps_of_neighbours_reach_lane_before():
    programs = compile_model(mcpherson(), Request(("stroke",), ())).programs
    for name, neighbours in (("joined_gaps", True), ("alone_gaps", False)):
        assert ("before" in {node[0] for node in programs[name].nodes}) == neighbours


GRIDS = {
    "every sample twice": np.repeat(STROKES, 2),
    "a fine grid gets coarse": [*np.linspace(0.0, 0.008, 17), *np.linspace(0.01, 0.08, 8)],
    "one step as long as a hundred": [*np.linspace(0.0, 0.008, 16), 0.08],
}


@pytest.mark.usefixtures("eight_lanes")
@pytest.mark.parametrize("values", GRIDS.values(), ids=GRIDS)
@pytest.mark.parametrize("order", [0, 2])
def test_rates_replace_failed_extrapolation(values, order, monkeypatch):
    """Two samples at one time make it infinite, a long step makes it wild. A lane alone is never
    extrapolated.
    """
    both = [positions(values, order, compiled=compiled) for compiled in (False, True)]
    monkeypatch.setattr("kincheck.core.kinematics.compiled.routes.LANES", 1)
    for found in both:
        assert_same(found, positions(values, order))
    numpy, machine = (found.iterations.sum() for found in both)
    assert numpy <= machine  # groups of numpy begin anywhere


@pytest.mark.parametrize("lanes", [2, 4, 8])
def test_extrapolation_after_long_step(lanes, monkeypatch):
    """A group of eight is accepted in part there, and those after it begin at no multiple of
    eight.
    """
    pytest.importorskip("llvmlite", reason="numpy takes as many lanes as there are samples")
    monkeypatch.setattr("kincheck.core.extensions.llvm.compiler.vector_width", lambda: lanes)
    angles = np.concatenate([0.002 * np.arange(21.0), 0.94 + 0.002 * np.arange(60.0)])
    iterations = crank_motion(angles)
    assert (iterations[21:25] > 1).any()
    assert (iterations[-40:] == 1).all()


def test_whole_turn_takes_few_programs(monkeypatch):
    """By numpy each run of a program takes as long, however many lanes are of use: a group goes as
    far as lanes are accepted, and its iteration ends with them.
    """
    runs: list[str] = []
    run = NumpyExecutor.run
    monkeypatch.setattr(
        NumpyExecutor, "run", lambda self, name: (runs.append(name), run(self, name))
    )
    assert crank_motion(np.linspace(0.0, 2.0 * np.pi, 181), compiled=False).max() <= 4
    # 11 and 74 in groups of a fixed length that are predicted by rates
    assert runs.count("joined") <= 7
    assert runs.count("newton") <= 28
