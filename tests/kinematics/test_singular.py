"""Samples at, near and beyond singular poses: right and said to be, or refused with the number;
never taken in silence.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import Joint, cases, solve
from kincheck.adapters.native import Native
from kincheck.core.case.joint_probe import probe
from kincheck.core.harness.run import run
from kincheck.core.kinematics.compiled import dense_equations
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.dense_equations import System
from kincheck.core.kinematics.compiled.request import SIGMA, Request
from kincheck.core.kinematics.compiled.routes import Route
from kincheck.core.kinematics.continuation.sweep import follow
from kincheck.core.kinematics.continuation.walk import follow_samples, longest
from kincheck.core.kinematics.formulation.acceptance_criteria import is_uncertain
from mpmath import mp, mpf

from ..support.mechanisms import (
    BRANCH,
    CRANK,
    chain,
    chain_end,
    errors,
    mcpherson,
    pushed,
    solve_all,
)

# The strut's limits of travel [m] to 18 digits, by other means than the package's: the six numbers
# of the knuckle's pose in 40 digits close two rods, the arm's axis and the strut's line (as in
# strut_oracle.py), and a secant rule makes the stroke stationary.
LIMITS = {1: 0.293337313746648221, -1: -0.316737084187394147}

# In doubt


@pytest.mark.parametrize("compiled", [False, True])
def test_doubtful_estimate_is_judged_by_sigma(compiled, monkeypatch):
    """The estimate says a fifth of sigma; equations for that are traced for the first sweep
    only.
    """
    case, traced = probe(Joint.registry["revolute_spherical"]), list[System]()
    monkeypatch.setattr(
        dense_equations, "System", lambda model: traced.append(System(model)) or traced[-1]
    )
    model = compile_model(
        case.mechanism, Request((case.sweep.driver,), case.points, compiled=compiled)
    )
    route, tol = Route(model, case.sweep.path), 2e-13
    estimates = follow_samples(route, tol).kept[model.rows[SIGMA].start]
    doubted = is_uncertain(estimates, 0.0, tol)
    assert 0 < doubted.sum() < len(doubted)
    for _ in range(2):
        found = follow(route, tol)
        assert found.solved.all(), found.message
        assert "retried_samples" not in found.details
        assert (
            estimates.min() < found.details["smallest_singular_value"] == estimates[~doubted].min()
        )
    assert len(traced) == 1


# Bifurcations


@pytest.mark.parametrize("loops", [1, 2])
@pytest.mark.parametrize("near", [0.0, 1e-13, -1e-9])
def test_sample_at_bifurcation(loops, near):
    """Its equations say nothing of it; it is interpolated, said to be, and the samples beyond are
    reached.
    """
    turn = np.array([0.0, 0.7, 1.4, BRANCH + near, 2.3, 3.0])
    found = solve_all(chain(loops), "turn", turn)
    assert (errors(found.points["end"], chain_end(loops, turn)) <= [1e-12, 1e-11, 1e-9]).all()
    (note,) = found.details["notes"]
    assert note.startswith(f"passes a singular pose at turn = {BRANCH:.9g}")
    assert "the branch followed is the continuation of the motion" in note
    (pose,) = found.details["singular_poses"]
    assert pose["outcome"] == "passed"
    assert pose["kind"] == "bifurcation"
    assert pose["sample"] == 3
    assert pose["driver"] == {"turn": pytest.approx(BRANCH)}
    assert pose["smallest_singular_value"] < 1e-6
    assert any(name.startswith("coupler") for name in pose["direction"])
    assert "turn" not in pose["rows_of"]


def test_samples_around_bifurcation():
    """Fine steps up to it: some are interpolated, none is wrong."""
    turn = BRANCH + np.linspace(-1e-3, 1e-3, 21)
    found = solve_all(chain(1), "turn", turn)
    assert errors(found.points["end"], chain_end(1, turn))[0] <= 1e-9
    assert found.details["retried_samples"] >= 1


def test_bifurcation_between_samples():
    found = solve_all(chain(1), "turn", np.linspace(0.0, 2.4, 7))
    (pose,) = found.details["singular_poses"]
    assert pose["outcome"] == "crossed"
    assert pose["driver"]["turn"] == pytest.approx(BRANCH, abs=0.4 / 17)
    assert "crosses a singular pose between turn = 1.6 and turn = 2" in found.details["notes"][0]


def test_bifurcations_on_both_sides():
    found = solve_all(chain(1), "turn", np.linspace(-3.0, 6.0, 40))
    places = sorted(pose["driver"]["turn"] for pose in found.details["singular_poses"])
    assert places == pytest.approx([BRANCH - np.pi, BRANCH, BRANCH + np.pi], abs=0.02)


def test_run_reports_singular_pose():
    case = cases.load("iftomm_n_four_bar")
    sweep = replace(case.sweep, values=np.deg2rad(np.array([0.0, 60.0, 90.0, 110.0])))
    (record,) = run([replace(case, sweep=sweep, reference={})], [Native()], tol=1e-12).records
    assert record.outcome == "unjudged"  # the case is without its reference here
    assert record.solved == 4
    assert "passes a singular pose at crank = 1.57079633" in record.message


def test_ordinary_sweeps_report_nothing():
    for mechanism, driver in ((mcpherson(), "stroke"), (chain(1), "turn")):
        details = solve(mechanism, driver, np.linspace(-0.08, 0.08, 9)).details
        assert not {"notes", "singular_poses", "retried_samples"} & set(details)


# Lock-up


def pin_height(design, pin, push):
    """Of the pin below the guide [m], in 40 digits from the doubles that the mechanism has."""
    with mp.workdps(40):
        x, crank = mpf(design) + mpf(push), mp.norm([mpf(v) for v in pin])
        rod = mp.norm([mpf(design) - mpf(pin[0]), mpf(pin[2])])
        along = (x * x + crank * crank - rod * rod) / (2 * x)
        return -mp.sqrt(crank * crank - along * along)


GAPS = np.array([1e-3, 1e-6, 1e-9, 1e-12])


def test_positions_beside_dead_centre():
    """1e-12 m before it a residual of 1e-12 would be 1e-6 m of the pin; samples are solved again
    until rounding ends it.
    """
    mechanism, design, pin = pushed()
    values = CRANK + 1.0 - design - GAPS
    found = solve_all(mechanism, "push", values, order=0)
    for position, value in zip(found.points["pin"].position, values.tolist(), strict=True):
        assert abs(mpf(float(position[2])) - pin_height(design, pin, value)) <= 1e-9
    assert found.details["retried_samples"] >= 2


def test_uncertain_rates_are_refused():
    mechanism, design, _ = pushed()
    found = solve(mechanism, "push", CRANK + 1.0 - design - GAPS)
    assert found.solved.tolist() == [True, True, False, False]
    assert np.isnan(found.points["pin"].position[2:]).all()
    assert "refused at push = " in found.message
    assert found.details["uncertain_samples"] == [2, 3]
    assert "rates by" in found.message
    assert "a driver's row depends on the joints' (lock-up), of p" in found.message
    assert [pose["outcome"] for pose in found.details["singular_poses"]] == ["refused", "refused"]


def test_tolerance_below_rounding_is_refused():
    found = solve(mcpherson(), "stroke", [0.0], tol=1e-30)
    assert not found.solved.any()
    assert "rounding alone leaves the pose uncertain by" in found.message
    assert "by the tolerance 1e-30; smallest singular value 0.12" in found.message
    assert "the pose is regular; allow more" in found.message
    assert "singular_poses" not in found.details


@pytest.mark.parametrize("direction", [1, -1])
def test_strut_limit_is_reported(direction):
    found = solve(mcpherson(), "stroke", direction * np.linspace(0.0, 0.4, 21))
    assert f"the limit of travel is stroke = {LIMITS[direction]:.9g}" in found.message
    assert "kincheck trace" in found.message
    (pose,) = found.details["singular_poses"]
    assert pose["outcome"] == "limit"
    assert pose["driver"]["stroke"] == pytest.approx(LIMITS[direction], abs=1e-14)
    assert pose["kind"] == "lock-up"
    assert "stroke" in pose["rows_of"]
    assert {"lca", "knuckle"} <= set(pose["direction"])


def test_accelerations_beside_singular_pose():
    """There sigma is 6e-4: solved only as any other sample they are off by 1e-8."""
    turn = BRANCH + np.array([-0.2, -0.1, -0.05, -0.002])
    found = solve(chain(1), "turn", turn)
    assert found.details["retried_samples"] == 1
    assert errors(found.points["end"], chain_end(1, turn))[2] <= 1e-9


@pytest.mark.parametrize(
    ("margins", "part"),
    [
        ([1.0, 1.0, 1.0], 0),
        ([-1.0, 1.0, -1.0, 1.0, 1.0], 3),
        ([1.0, np.nan, 1.0], None),
        ([-1.0, -1.0], None),
        ([-1.0, 1.0], None),
    ],
    ids=str,
)
def test_part_of_step_needs_half(margins, part):
    assert longest(np.array(margins)) == part
