"""Sweeps to the ends of travel and beyond, and steps of many turns."""

import re

import numpy as np
import pytest
from kincheck.core.kinematics import Method, NativeSolver, solve
from kincheck.core.mechanism.motions import Path, Ramp

from ..support.mechanisms import (
    CRANK,
    mcpherson,
    slider_crank,
    slider_crank_motion,
)


@pytest.mark.parametrize(
    ("way", "turn", "solved"),
    [
        (Method.ONE_PROGRAM, 1000.0, True),
        (Method.ONE_PROGRAM, 1e6, False),
        (Method.BY_COMPONENTS, 1000.0, True),
        (Method.BY_COMPONENTS, 1e6, False),
        (Method.SPARSE, 100.0, True),  # a part takes it a hundred times as long
    ],
)
def test_step_of_many_turns(way, turn, solved):
    m = slider_crank()
    path = Path({"turn": Ramp(1.0)}, np.array([0.0, turn]))
    found = NativeSolver(method=way).prepare(m, path, ("end",))(1e-12)
    assert found.solved.tolist() == [True, solved], found.message
    assert ("give samples in between" in found.message) is not solved
    assert "assembly" not in found.message
    if solved:
        x = slider_crank_motion(turn).x
        # a thousand radians round at 1e-13
        assert np.abs(found.points["end"].position[1, 0] - x) <= 1e-12


@pytest.mark.parametrize(("far", "limit"), [(0.4, 0.29337), (-0.4, -0.31674)])
@pytest.mark.parametrize("steps", [401, 9])
def test_lock_up_of_strut(far, limit, steps):
    """Formulation section 10: the first extrema of the wheel's height along the branch, to the
    digits given there.
    """
    values = np.linspace(0.0, far, steps)
    found = solve(mcpherson(), "stroke", values)
    within = np.abs(values) < abs(limit)
    assert (found.solved == within).all()
    assert np.isnan(found.points["wheel"].position[~within]).all()
    assert np.isfinite(found.points["wheel"].acceleration[within]).all()
    beyond, wanted, pivot, last = (
        float(x)
        for x in re.match(
            r"cannot be followed beyond stroke = (\S+) \(wanted stroke = (\S+)\): .*; smallest"
            r" singular value there "
            r"about (\S+) .*lock-up.*"
            r"last reachable sample at stroke = (\S+); shorten the sweep",
            found.message,
        ).groups()
    )
    assert beyond == pytest.approx(limit, abs=1e-4)
    assert wanted == pytest.approx(values[~within][0], rel=1e-8)
    assert last == pytest.approx(values[within][-1], rel=1e-8)
    assert 0.0 < pivot < 0.02


def test_end_before_first_sample():
    found = solve(mcpherson(), "stroke", [0.4])
    assert not found.solved.any()
    assert "no sample reached on this side" in found.message
    assert found.points["wheel"].position.shape == (1, 3)


def test_samples_beyond_dead_centre():
    """Past a dead centre the crank could be assembled again, but not without passing where it
    cannot.
    """
    m = slider_crank(rod=0.1)  # shorter than the crank: the pin cannot pass overhead
    found = solve(m, "turn", np.linspace(0.0, np.pi, 61))
    limit = np.arcsin(0.1 / CRANK)
    assert (found.solved == (np.linspace(0.0, np.pi, 61) < limit)).all()
    assert "cannot be followed" in found.message


@pytest.mark.parametrize("samples", [3, 5, 9, 20])
def test_both_directions_end(samples):
    """Both fronts divide their steps at once, in one block of lanes."""
    found = solve(mcpherson(), "stroke", np.linspace(-1.5, 1.5, samples))
    assert found.message.count("cannot be followed beyond stroke = ") == 2
    assert not found.solved.all()
