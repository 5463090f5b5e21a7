"""Folds: every engine refuses steps over one, and a stress family looks for such steps."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from kincheck.core.case.io.case_file import load_case
from kincheck.core.extensions.laboratory.stress.families import FAMILIES
from kincheck.core.extensions.laboratory.stress.families.base import as_case
from kincheck.core.extensions.laboratory.stress.families.linkages import (
    any_plane,
    polar,
    slider_crank,
)
from kincheck.core.extensions.laboratory.stress.run import specimen
from kincheck.core.extensions.laboratory.stress.verdicts import Verdict, judge_answer, once
from kincheck.core.extensions.laboratory.truth.fold import first_fold
from kincheck.core.extensions.laboratory.truth.motion import Reach, follow_motion
from kincheck.core.harness.execution import Pair
from kincheck.core.kinematics import continuous, is_continuation, regular_between

from ...support.engine_motion import SIMULATORS, installed, rotation

BEYOND = Path(__file__).parents[2] / "data" / "beyond_a_fold.toml"


@pytest.mark.parametrize("name", ["native", *SIMULATORS])
def test_fold_after_sample_ends_motion(name):
    """The rates beside the fold are so large that they seem to lead to another assembly."""
    engine, case = installed(name), load_case(BEYOND)
    found = engine.solve(engine.build(case), case, 1e-12)
    assert found.solved.tolist() == [True, True, False]
    assert "cannot be followed beyond lift = 0.05341" in found.message
    assert "last reachable sample at lift = 0.0524" in found.message
    assert np.isnan(found.points["P"].position[2]).all()


def test_fold_by_two_continuations_agrees():
    """By arclength, and by steps of the driver in extended precision."""
    case = load_case(BEYOND)
    assert follow_motion(case).reach.tolist() == [Reach.REACHED, Reach.REACHED, Reach.BEYOND]
    assert first_fold(case, 0.143) == pytest.approx(0.05341366, rel=1e-6)
    assert first_fold(case, 0.053) is None


def test_fold_at_end_of_stroke():
    """A slider-crank driven at its slider, where the rod is stretched and where it is folded."""
    crank, rod = 0.3, 1.0
    b = polar(crank, 0.4)
    c = float(b.real + np.sqrt(rod**2 - b.imag**2))
    plane = any_plane(np.random.default_rng(2))
    mechanism, _ = slider_crank(plane, b, complex(c), "rod", "slide")
    case = as_case(mechanism, "slide", np.array([0.1]))
    assert first_fold(case, 1.0) == pytest.approx(crank + rod - c, abs=1e-8)
    assert first_fold(case, -1.0) == pytest.approx(rod - crank - c, abs=1e-8)


@pytest.fixture(scope="module")
def past_folds():
    """Of the mechanisms of `kincheck stress --family folds --seed 0`, two with another assembly
    that a step can meet, and one without.
    """
    return [specimen(FAMILIES["folds"], 0, number, 5) for number in (0, 16, 21)]


@pytest.mark.nightly
@pytest.mark.parametrize("name", SIMULATORS)
def test_simulator_steps_over_no_fold(name, past_folds):
    """A small part of a campaign: `kincheck stress --family folds --engine mujoco --samples
    15000`. In this process, because workers take longer to begin than to solve.
    """
    engine, verdicts = installed(name), Counter()
    for one in past_folds:
        answer = once(Pair(one.case, engine, one.specimen.tol))
        verdicts += Counter(judge_answer(one.specimen, one.case, one.truth, answer).counts)
    assert verdicts == {Verdict.RIGHT: 6, Verdict.REFUSED_RIGHTLY: 2}


# What is asked of a step


@pytest.mark.parametrize(
    ("ratio", "regular"),
    [
        (np.eye(3), True),
        (np.diag([1.0, 1.4, 0.6]), True),
        (np.diag([1.0, 1.0, 0.4]), False),
        (np.diag([1.0, 1.0, -1.0]), False),  # one that passed zero
        (-np.eye(2), False),  # two, and the sign of the determinant is as it was
        (rotation((0, 0, 1), 0.3), True),
        (rotation((0, 0, 1), 2.0), False),  # no eigenvalue is near the negative axis
        (np.array([[1.1, 1e6], [1e-7, 0.9]]), True),  # unknowns of very different units
        (np.array([[1.1, 1e6], [1e-5, 0.9]]), False),
        (np.array([[1.1, 1e9], [0.0, 0.9]]), True),  # blocks: one is solved after the other
        (np.diag([1.0, np.nan]), False),
        (np.diag([1.0, np.inf]), False),
        (np.diag([1.0, 1e300]), False),
    ],
)
def test_regular_between_small_jacobian_changes(ratio, regular):
    assert regular_between(ratio) == regular


def test_continuation_criterion_beside_fold():
    """Beside a fold the rates are very large: half their sum over the step may be any change."""
    dt, before, now = 0.02, np.array([60.0]), np.array([2.0])
    assert continuous(np.array([0.49]), now, before, dt, 1.0)
    assert not is_continuation(np.array([0.49]), now, before, dt)
    assert is_continuation(np.array([0.49]), np.array([24.0]), np.array([25.5]), dt)
    assert not is_continuation(np.array([0.51]), np.array([25.5]), np.array([25.5]), dt)  # too long
    assert is_continuation(np.zeros(1), np.zeros(1), np.zeros(1), dt)


@pytest.mark.parametrize(("seed", "number", "passed"), [(101, 364, 0), (109, 192, 2)])
def test_passed_singular_pose_is_no_fold(seed, number, passed):
    """Rates stay finite there, and `trace` goes on through a branch point or without an event."""
    truth = specimen(FAMILIES["folds"], seed, number, 4).truth
    assert truth.reach[passed] == Reach.UNKNOWN
