"""What executors know of a motion they follow again and again: programs run over blocks of slots,
tables, and the worst sample.
"""

from __future__ import annotations

import weakref
from concurrent.futures import ThreadPoolExecutor
from unittest.mock import Mock

import numpy as np
import pytest
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import FROM, SIGMA, TIME, Request
from kincheck.core.kinematics.compiled.routes import Route
from kincheck.core.kinematics.continuation.sweep import follow
from kincheck.core.kinematics.continuation.walk import follow_samples, marcher
from kincheck.core.mechanism.motions import Path, Ramp
from kincheck.core.program import NumpyExecutor
from kincheck.core.program.llvm.compiler import available

from ..support.mechanisms import four_bar, mcpherson, slider_crank

COMPILED = [
    False,
    pytest.param(
        True, marks=pytest.mark.skipif(not available(), reason="llvmlite is not installed")
    ),
]
TOL = 1e-12


def route_of(mechanism, driver, values, *, compiled=True, order=2):
    request = Request(
        (driver,), tuple(point.name for point in mechanism.points), order=order, compiled=compiled
    )
    return Route(
        compile_model(mechanism, request),
        Path({driver: Ramp(1.0)}, np.asarray(values, dtype=float)),
    )


SWEEPS = {
    "every sample": (mcpherson, "stroke", np.linspace(-0.05, 0.05, 33)),
    "an end on one side": (mcpherson, "stroke", np.linspace(-0.05, 0.4, 46)),
    "steps that are divided": (four_bar, "turn", np.linspace(0.0, 6.0, 5)),
}


@pytest.mark.parametrize("compiled", COMPILED)
@pytest.mark.parametrize(
    ("sweep", "order"), [(name, (0, 2)[k % 2]) for k, name in enumerate(SWEEPS)]
)
def test_worst_values_of_kept_samples(compiled, sweep, order):
    make, driver, values = SWEEPS[sweep]
    route = route_of(make(), driver, values, compiled=compiled, order=order)
    for _ in range(2):
        found = follow_samples(route, TOL)
        assert found.solved.all() == (sweep != "an end on one side")
        closure, leftover, sigma = (
            found.kept[route.model.rows[name].start, found.solved]
            for name in ("closure", "leftover", SIGMA)
        )
        assert found.worst == [closure.max(), leftover.max(), sigma.min()]


@pytest.mark.parametrize("compiled", COMPILED)
def test_worst_values_of_shorter_march(compiled):
    route = route_of(mcpherson(), "stroke", np.linspace(0.0, 0.2, 41), compiled=compiled)
    whole, half = follow_samples(route, TOL), follow_samples(route, TOL, visit={20})
    sigma = half.kept[route.model.rows[SIGMA].start, :21]
    assert half.worst[-1] == sigma.min() > whole.worst[-1]


@pytest.mark.parametrize("compiled", COMPILED)
def test_sweeps_of_one_model_are_independent(compiled):
    """Whatever was swept in between, by whatever tolerance: the same bits, and what was given away
    stays as it was.
    """
    route = route_of(mcpherson(), "stroke", np.linspace(-0.08, 0.08, 33), compiled=compiled)
    other = Route(route.model, Path({"stroke": Ramp(1.0)}, np.linspace(0.02, 0.3, 33)))
    first = follow(route, TOL).points["wheel"]
    was = first.position.copy(), first.acceleration.copy()
    follow(other, TOL)
    assert not follow_samples(route, 1e-19).solved.all()
    again = follow(route, TOL).points["wheel"]
    assert not np.shares_memory(first.position, again.position)
    for now in (first, again):
        np.testing.assert_array_equal(now.position, was[0])
        np.testing.assert_array_equal(now.acceleration, was[1])


@pytest.mark.skipif(not available(), reason="llvmlite is not installed")
def test_route_keeps_no_results():
    route = route_of(mcpherson(), "stroke", np.linspace(-0.08, 0.08, 33))
    found = follow(route, TOL)
    table = weakref.ref(found.points["wheel"].position.base)
    del found
    assert table() is None


@pytest.mark.parametrize("compiled", COMPILED)
def test_route_swept_by_threads(compiled):
    route = route_of(mcpherson(), "stroke", np.linspace(-0.08, 0.08, 161), compiled=compiled)
    alone = follow(route, TOL).points["wheel"].acceleration.copy()
    with ThreadPoolExecutor(4) as threads:
        for found in threads.map(lambda _: follow(route, TOL), range(24)):
            np.testing.assert_array_equal(found.points["wheel"].acceleration, alone)


def test_interrupted_march_is_repeated(monkeypatch):
    route = route_of(mcpherson(), "stroke", np.linspace(-0.05, 0.05, 33), compiled=False)
    first = follow_samples(route, TOL)
    monkeypatch.setattr(NumpyExecutor, "run", Mock(side_effect=KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        follow_samples(route, TOL)
    monkeypatch.undo()
    np.testing.assert_array_equal(follow_samples(route, TOL).kept, first.kept)


@pytest.mark.parametrize("order", [0, 2])
@pytest.mark.parametrize("compiled", COMPILED)
def test_visited_samples_have_their_times(compiled, order):
    """A sweep leaves no anchors there; who follows a side by hand goes on from one."""
    route = route_of(
        mcpherson(), "stroke", np.linspace(-0.08, 0.08, 161), compiled=compiled, order=order
    )
    whole = follow_samples(route, TOL)
    visited = follow_samples(route, TOL, visit={0, 81, 103, 160}).visited
    time = route.model.slots[FROM + TIME]
    assert {k: float(lane[time]) for k, lane in visited.items()} == {
        k: float(route.path.times[k]) for k in (0, 81, 103, 160)
    }
    again = follow_samples(route, TOL)
    np.testing.assert_array_equal(again.kept, whole.kept)


@pytest.mark.parametrize("compiled", COMPILED)
def test_partly_accepted_group_is_continued(compiled):
    """Without a word from whoever divides steps."""
    route = route_of(
        slider_crank(),
        "turn",
        np.concatenate([[0.5, 1.0, 1.5], 1.5 + 0.002 * np.arange(1.0, 62.0)]),
        compiled=compiled,
    )
    bound = marcher(route, TOL, crossing=False)
    bound.run()
    kept = bound.track.begin()
    assert [*bound.track.run()] == [64]
    assert np.isfinite(kept).all()
