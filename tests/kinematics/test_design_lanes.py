"""Variants as lanes: the same as solving each variant alone, whatever the path, and whichever are
solved beside it.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.cases import load
from kincheck.core import (
    Ramp,
    Sine,
)
from kincheck.core.kinematics import design_batch
from kincheck.core.kinematics.compiled.compiled_model import compile_model, recent_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.compiled.routes import Route
from kincheck.core.kinematics.continuation.sweep import follow
from kincheck.core.kinematics.design_batch import solve_variants
from kincheck.core.kinematics.formulation.parameters import placed, places
from kincheck.core.mechanism.motions import Path
from kincheck.core.program import NODES

TOL = 1e-12
# Two ways to the same pose: the variant's lanes and a model of its own differ in the order of
# operations, not in equations.
SAME = 1e-13


def strut():
    case = load("mcpherson_strut")
    return case.mechanism, tuple(name for name in places(case.mechanism) if "axis" not in name)


def drawn(mechanism, varied, count, spread, seed=0):
    nominal = np.array([x for name in varied for x in places(mechanism)[name]])
    return (
        nominal[:, None] + np.random.default_rng(seed).normal(size=(len(nominal), count)) * spread
    )


def variant(mechanism, varied, numbers):
    values, at = {}, 0
    for name in varied:
        size = len(places(mechanism)[name])
        values[name] = tuple(numbers[at : at + size])
        at += size
    return placed(mechanism, values)


PATHS = {
    "from design, both ways": Path({"stroke": Ramp(1.0)}, np.linspace(-0.06, 0.06, 13)),
    "in no order": Path({"stroke": Ramp(1.0)}, np.array([0.02, -0.03, 0.0, 0.05, -0.01, 0.04])),
    "one side": Path({"stroke": Ramp(2.0)}, np.linspace(0.01, 0.03, 5)),
    "not through the design": Path({"stroke": Sine(0.04, 1.0, 0.7)}, np.linspace(0.1, 0.5, 9)),
}


@pytest.mark.parametrize(
    ("path", "compiled"),
    [
        *(pytest.param(path, True, id=name) for name, path in PATHS.items()),
        pytest.param(PATHS["in no order"], False, id="in no order, by numpy"),
    ],
)
def test_lane_matches_own_model(path, compiled):
    mechanism, varied = strut()
    request = Request(("stroke",), ("wheel_center",), varied=varied, compiled=compiled)
    model = recent_model(mechanism, request)
    numbers = drawn(mechanism, varied, 11, 2e-3)
    found = solve_variants(Route(model, path), numbers, TOL)
    assert found.solved.all()
    assert not found.messages
    for k in (0, 7, 10):
        own = recent_model(variant(mechanism, varied, numbers[:, k]), replace(request, varied=()))
        alone = follow(Route(own, path), TOL).points["wheel_center"]
        for label in ("position", "velocity", "acceleration"):
            lanes = found.kept[model.rows[f"{label} wheel_center"], :, k].T
            scale = max(1.0, np.abs(getattr(alone, label)).max())
            np.testing.assert_allclose(lanes, getattr(alone, label), rtol=0, atol=SAME * scale)


FINE = np.linspace(0.0, 0.06, 31)
ROUGH = {
    "every sample twice": np.repeat(np.linspace(0.0, 0.06, 16), 2),
    "a fine grid gets coarse": np.concatenate([FINE[:11] / 10.0, FINE[4:]]),
    "back and forth": np.concatenate([FINE[::2], -FINE[::3]]),
}


@pytest.mark.parametrize(
    ("values", "compiled", "order"),
    [
        pytest.param(values, compiled, order, id=f"{name}-{compiled}-{order}")
        for k, (name, values) in enumerate({"fine": FINE, **ROUGH}.items())
        for compiled, order in ((True, (0, 2)[k % 2]), (False, (2, 0)[k % 2]))
    ],
)
def test_lanes_extrapolate_or_use_rates(values, compiled, order, monkeypatch):
    mechanism, varied = strut()
    model = compile_model(
        mechanism,
        Request(("stroke",), ("wheel_center",), order=order, varied=varied, compiled=compiled),
    )
    path, numbers = Path({"stroke": Ramp(1.0)}, values), drawn(mechanism, varied, 11, 2e-3)
    found = solve_variants(Route(model, path), numbers, TOL)
    assert found.solved.all()
    assert found.retried == 0
    iterations = found.kept[model.rows["iterations"].start]
    assert values is not FINE or (iterations[NODES:] == 1).all()
    monkeypatch.setattr(
        "kincheck.core.kinematics.compiled.routes.weights_of_samples",
        lambda times: np.full((NODES, len(times)), np.nan),
    )
    by_rates = solve_variants(Route(model, path), numbers, TOL)
    assert by_rates.retried == 0
    rows = slice(0, model.rows["closure"].start)
    np.testing.assert_allclose(found.kept[rows], by_rates.kept[rows], rtol=0, atol=SAME)
    # weights are infinite
    assert np.array_equal(found.kept[rows], by_rates.kept[rows]) == (
        values is ROUGH["every sample twice"]
    )


@pytest.mark.parametrize(
    "path",
    [PATHS["from design, both ways"], Path({"stroke": Ramp(1.0)}, np.linspace(-0.06, 0.06, 61))],
)
def test_lane_ignores_neighbours(path):
    mechanism, varied = strut()
    model = compile_model(
        mechanism, Request(("stroke",), ("wheel_center",), order=0, varied=varied)
    )
    route = Route(model, path)
    numbers = drawn(mechanism, varied, 40, 2e-3)
    together = solve_variants(route, numbers, TOL).kept
    for columns in (slice(3, 4), slice(17, 40), [5, 2, 31]):
        apart = solve_variants(route, numbers[:, columns], TOL).kept
        rows = slice(0, model.rows["iterations"].start)
        np.testing.assert_array_equal(apart[rows], together[rows][:, :, columns])


@pytest.mark.parametrize("compiled", [True, False])
def test_worst_sample_of_each_lane(compiled):
    """Over both sides of the start, and of lanes that are lost on one of them, in the middle and at
    the end of a vector.
    """
    mechanism, varied = strut()
    model = compile_model(
        mechanism, Request(("stroke",), ("wheel_center",), varied=varied, compiled=compiled)
    )
    path, numbers = (
        Path({"stroke": Ramp(1.0)}, np.linspace(-0.25, 0.25, 41)),
        drawn(mechanism, varied, 19, 2e-3),
    )
    numbers[2, [3, 18]] += 0.28  # as below: their way is shorter
    kept, closes, worst = design_batch._together(Route(model, path), numbers, TOL)
    assert closes.all()
    lost = np.isnan(kept[model.rows["closure"].start]).any(axis=0)
    assert 0 < lost.sum() < 19
    closure, sigma = (kept[model.rows[name].start] for name in ("closure", "sigma"))
    np.testing.assert_array_equal(worst["closure"], np.where(lost, np.nan, closure.max(axis=0)))
    np.testing.assert_array_equal(worst["sigma"], np.where(lost, np.nan, sigma.min(axis=0)))


@pytest.mark.parametrize(
    "times", [np.linspace(-0.25, 0.25, 11), np.array([0.1, -0.2, 0.25, 0.0, -0.25, 0.2, -0.1])]
)
def test_unsolved_variant_says_why(times):
    """A ball 0.28 m higher shortens the way of the arm; samples in no order find their places."""
    mechanism, _ = strut()
    varied = ("joints.ball.point",)
    numbers = np.repeat(np.array(places(mechanism)[varied[0]])[:, None], 3, axis=1)
    numbers[2, 1] += 0.28
    path = Path({"stroke": Ramp(1.0)}, times)
    model = compile_model(mechanism, Request(("stroke",), ("wheel_center",), varied=varied))
    found = solve_variants(Route(model, path), numbers, TOL)
    own = follow(
        Route(
            compile_model(
                variant(mechanism, varied, numbers[:, 1]), Request(("stroke",), ("wheel_center",))
            ),
            path,
        ),
        TOL,
    )
    assert 0 < own.solved.sum() < len(times)
    np.testing.assert_array_equal(found.solved[:, 1], own.solved)
    lanes = found.kept[model.rows["position wheel_center"], :, 1].T
    np.testing.assert_allclose(lanes, own.points["wheel_center"].position, rtol=0, atol=SAME)
    assert set(found.messages) >= {1}
    assert "cannot be followed beyond" in found.messages[1]
    np.testing.assert_array_equal(found.kept[:14, :, 0], found.kept[:14, :, 2])


def test_lost_lane_is_solved_alone(monkeypatch):
    """Half a turn of the crank in one step instead of sixteen."""
    monkeypatch.setattr(design_batch, "LEAD", 1)
    mechanism, varied = load("rssr").mechanism, ("joints.rod.points.0",)
    path = Path({"crank": Sine(3.0, 1.0, 1.5)}, np.linspace(0.0, 0.02, 5))
    model = compile_model(mechanism, Request(("crank",), ("rocker_pin",), varied=varied))
    numbers = drawn(mechanism, varied, 5, 2e-3)
    found = solve_variants(Route(model, path), numbers, TOL)
    assert found.retried == 5
    assert found.solved.all()
    monkeypatch.undo()
    usual = solve_variants(Route(model, path), numbers, TOL)
    assert usual.retried == 0
    rows = model.rows["position rocker_pin"]
    np.testing.assert_allclose(found.kept[rows], usual.kept[rows], rtol=0, atol=SAME)


def test_open_variant_is_refused():
    """A rod that is a third of the distance it has to span."""
    case = load("mcpherson_strut")
    joints = [
        replace(joint, length=0.32) if joint.name == "tie_rod" else joint
        for joint in case.mechanism.joints
    ]
    mechanism = replace(case.mechanism, joints=joints)
    model = compile_model(
        mechanism, Request(("stroke",), ("wheel_center",), varied=("joints.tie_rod.length",))
    )
    found = solve_variants(Route(model, PATHS["one side"]), np.array([[0.32, 0.05]]), TOL)
    assert found.solved.all(axis=0).tolist() == [True, False]
    assert found.messages[1].startswith("does not close at its design position; check")
