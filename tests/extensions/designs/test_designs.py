"""Many designs by one call: each as if solved alone, or refused with the reason."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from kincheck import (
    Body,
    JointAngle,
    Mechanism,
    Point,
    Ramp,
    Screw,
    Sine,
    SolveError,
    solve,
    solve_designs,
)
from kincheck.cases import load
from kincheck.core.extensions.designs import design_batch
from kincheck.core.extensions.designs.design_batch import solve_variants
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table
from kincheck.core.extensions.sweep.curves import curves
from kincheck.core.kinematics import placed, places
from kincheck.core.kinematics.compiled import compiled_model
from kincheck.core.kinematics.compiled.compiled_model import compile_model, recent_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.compiled.routes import Route
from kincheck.core.kinematics.continuation.sweep import follow
from kincheck.core.mechanism.motions import Path
from kincheck.core.program import NODES

from ...support.mechanisms import (
    BRANCH,
    ORIGIN,
    X,
    Z,
    chain,
    circles_meet,
    four_bar,
    planar_four_bar,
    solve_all,
)


@pytest.mark.parametrize("values", [[0.0], [0.1, 0.0, -0.1]], ids=["design", "sweep"])
def test_locked_variant_is_refused(values):
    """A four-bar of four hinges with the last one tilted: it closes where it is, and is a frame."""
    mechanism, tilts = four_bar(), np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 1e-3], [0.1, 1.0, 0.0]])
    found = solve_designs(mechanism, "turn", values, {"joints.D.axis": tilts}, order=2)
    assert found.solved.tolist() == [[True] * len(values), *[[False] * len(values)] * 2]
    assert np.isnan(found.points["C"].velocity[1:]).all()
    assert sorted(found.messages) == [1, 2]
    for k, message in found.messages.items():
        with pytest.raises(SolveError) as own:
            solve(placed(mechanism, {"joints.D.axis": tuple(tilts[k])}), "turn", values)
        assert message == str(own.value)


# 128 of them at once, or 32 of many samples


@pytest.mark.parametrize(
    ("geometry", "message"),
    [
        (
            {"joints.tie_rod.end": np.zeros((4, 3))},
            "no place to vary 'joints.tie_rod.end'; did you mean 'joints.tie_rod.points.1'",
        ),
        ({"joints.ball.point": np.zeros((4, 2))}, r"has shape \(4, 2\), expected \(designs, 3\)"),
        ({"joints.ball.point": np.full((4, 3), np.nan)}, "is not finite everywhere"),
        (
            {"joints.ball.point": np.ones((4, 3)), "joints.strut_top.point": np.ones((5, 3))},
            r"found \[4, 5\] designs",
        ),
        ({}, "^solve_designs: geometry names no place to vary; known: joints.lca_pivot.point, "),
    ],
    ids=["unknown place", "shape", "not finite", "numbers of designs", "no place"],
)
def test_designs_refuse_bad_geometry(geometry, message):
    with pytest.raises(SolveError, match=message):
        solve_designs(strut()[0], "stroke", [0.0], geometry)


@pytest.mark.parametrize(("varied", "shape"), [((), (0, 1)), (("joints.ball.point",), (3, 0))])
def test_designs_refuse_nothing_to_solve(varied, shape):
    route = lanes_of(PATHS["one side"], strut()[0], varied)
    with pytest.raises(SolveError, match="vary one place at least"):
        solve_variants(route, np.zeros(shape), TOL)


def test_designs_refuse_bad_order():
    with pytest.raises(SolveError, match=r"^solve_designs: order is 5, expected 0, 1 or 2"):
        solve_designs(strut()[0], "stroke", [0.0], {"joints.ball.point": np.zeros((4, 3))}, order=5)


def test_designs_refuse_nearly_singular_samples():
    """What a run by itself would solve more closely; a study of many does not, and says so."""
    mechanism, samples = chain(1), [0.0, 1.8, BRANCH - 1e-4, 1.9]
    ends = np.array([mechanism.point("end").position]) + np.array(
        [[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]]
    )
    found = solve_designs(mechanism, "turn", samples, {"points.end.position": ends})
    assert found.solved.tolist() == [[True, True, False, False]] * 2
    assert np.isnan(found.points["end"].position[:, 2:]).all()
    for message in found.messages.values():
        assert "cannot be followed beyond turn = 1.8707" in message
        assert "; refused at 1 sample" in message
        assert "as at turn = 1.87069633" in message


def test_designs_vary_screw_lead():
    """In the rows it is a weight, which is known only when the programs run."""
    thread = Screw("thread", "ground", "nut", ORIGIN, Z, lead=0.01)
    mechanism = Mechanism(
        "nut", [Body("nut")], [thread], [Point("rim", "nut", X)], [JointAngle("turn", "thread")]
    )
    # the last larger than all else there is
    turns, leads = np.array([0.0, 1.0, 2.0]), [0.01, 0.011, 50.0]
    designs = solve_designs(mechanism, "turn", turns, {"joints.thread.lead": leads}, order=1)
    found = designs.points["rim"]
    for k, lead in enumerate(leads):
        slope = lead / (2.0 * np.pi)
        place = np.column_stack([np.cos(turns), np.sin(turns), slope * turns])
        rate = np.column_stack([-np.sin(turns), np.cos(turns), np.full(3, slope)])
        for values, expected in ((found.position, place), (found.velocity, rate)):
            assert np.abs(values[k] - expected).max() <= 1e-15 * max(1.0, lead)


def test_variant_beyond_travel_says_why():
    found = solve_designs(
        strut()[0], "stroke", [0.0, 0.5], {"joints.ball.point": [strut()[0].joint("ball").point]}
    )
    assert "cannot be followed beyond stroke = 0.293" in found.messages[0]
    assert found.messages[0].endswith(
        "by itself, a variant may pass a singular pose; many at once do not"
    )


def test_variant_with_dependent_rows_says_why():
    """A kite off by a twentieth, its rod on universals: one row too many, and the one that is left
    out does not stay so.
    """
    turn, rest = np.linspace(0.0, 1.6, 17), (1.2, 0.0, 0.0)
    pin = 1.25 * np.array([np.cos(1.1), -np.sin(1.1), 0.0])
    meet = circles_meet(pin, 0.7, rest, 0.7)
    kite = planar_four_bar(pin, meet, rest, "universals")
    solve_all(kite, "turn", turn)
    found = solve_designs(kite, "turn", turn, {"points.meet.position": np.array([meet])})
    assert not found.solved.all()
    assert (
        "what is singular may be the 18 rows chosen at the nominal design out of 19"
        in found.messages[0]
    )
    assert "solve this variant by itself" in found.messages[0]


# Variants as lanes: the same as solving each variant alone, whatever the path, and whichever are


TOL = 1e-12
# Two ways to the same pose: the variant's lanes and a model of its own differ in the order of
# operations, not in equations.
SAME = 1e-13


def strut():
    case = load("mcpherson_strut")
    return case.mechanism, tuple(name for name in places(case.mechanism) if "axis" not in name)


def lanes_of(path, mechanism, varied, *, order=2, compiled=True):
    """A route of the strut with some of its geometry as lanes."""
    request = Request(("stroke",), ("wheel_center",), order=order, varied=varied, compiled=compiled)
    return Route(recent_model(mechanism, request), path)


def alone(path, mechanism, varied, numbers):
    """The wheel center of one variant, by a model of its own."""
    return follow(lanes_of(path, variant(mechanism, varied, numbers), ()), TOL)


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
    numbers = drawn(mechanism, varied, 11, 2e-3)
    route = lanes_of(path, mechanism, varied, compiled=compiled)
    found = solve_variants(route, numbers, TOL)
    assert found.solved.all()
    assert not found.messages
    for k in (0, 7, 10):
        own = alone(path, mechanism, varied, numbers[:, k]).points["wheel_center"]
        for label in ("position", "velocity", "acceleration"):
            lanes = found.kept[route.model.rows[f"{label} wheel_center"], :, k].T
            expected = getattr(own, label)
            assert np.abs(lanes - expected).max() <= SAME * max(1.0, np.abs(expected).max())


FINE = np.linspace(0.0, 0.06, 31)
ROUGH = {
    "every sample twice": np.repeat(np.linspace(0.0, 0.06, 16), 2),
    "a fine grid gets coarse": np.concatenate([FINE[:11] / 10.0, FINE[4:]]),
    "back and forth": np.concatenate([FINE[::2], -FINE[::3]]),
}


@pytest.mark.by_day(2)
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
    numbers = drawn(mechanism, varied, 11, 2e-3)
    route = partial(lanes_of, Path({"stroke": Ramp(1.0)}, values), mechanism, varied)
    route = partial(route, order=order, compiled=compiled)
    model, found = route().model, solve_variants(route(), numbers, TOL)
    assert found.solved.all()
    assert found.retried == 0
    iterations = found.kept[model.rows["iterations"].start]
    assert values is not FINE or (iterations[NODES:] == 1).all()
    monkeypatch.setattr(
        "kincheck.core.kinematics.compiled.routes.weights_of_samples",
        lambda times: np.full((NODES, len(times)), np.nan),
    )
    by_rates = solve_variants(route(), numbers, TOL)
    assert by_rates.retried == 0
    rows = slice(0, model.rows["closure"].start)
    np.testing.assert_allclose(found.kept[rows], by_rates.kept[rows], rtol=0, atol=SAME)
    # weights are infinite
    assert np.array_equal(found.kept[rows], by_rates.kept[rows]) == (
        values is ROUGH["every sample twice"]
    )


@pytest.mark.parametrize("compiled", [True, False])
def test_worst_sample_of_each_lane(compiled):
    """Over both sides of the start, and of lanes that are lost on one of them, in the middle and at
    the end of a vector.
    """
    mechanism, varied = strut()
    path = Path({"stroke": Ramp(1.0)}, np.linspace(-0.25, 0.25, 41))
    route, numbers = (
        lanes_of(path, mechanism, varied, compiled=compiled),
        drawn(mechanism, varied, 19, 2e-3),
    )
    rows = route.model.rows
    numbers[2, [3, 18]] += 0.28  # as below: their way is shorter
    kept, closes, worst = design_batch._together(route, numbers, TOL)
    assert closes.all()
    closure, sigma = (kept[rows[name].start] for name in ("closure", "sigma"))
    lost = np.isnan(closure).any(axis=0)
    assert 0 < lost.sum() < 19
    np.testing.assert_array_equal(worst["closure"], np.where(lost, np.nan, closure.max(axis=0)))
    np.testing.assert_array_equal(worst["sigma"], np.where(lost, np.nan, sigma.min(axis=0)))


@pytest.mark.parametrize(
    "times",
    [np.linspace(-0.25, 0.25, 11), np.array([0.1, -0.2, 0.25, 0.0, -0.25, 0.2, -0.1])],
    ids=["in order", "in no order"],
)
def test_unsolved_variant_says_why(times):
    """A ball 0.28 m higher shortens the way of the arm; samples in no order find their places."""
    mechanism, _ = strut()
    varied = ("joints.ball.point",)
    numbers = np.repeat(np.array(places(mechanism)[varied[0]])[:, None], 3, axis=1)
    numbers[2, 1] += 0.28
    route = lanes_of(Path({"stroke": Ramp(1.0)}, times), mechanism, varied)
    found = solve_variants(route, numbers, TOL)
    own = alone(route.path, mechanism, varied, numbers[:, 1])
    assert 0 < own.solved.sum() < len(times)
    np.testing.assert_array_equal(found.solved[:, 1], own.solved)
    lanes = found.kept[route.model.rows["position wheel_center"], :, 1].T
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
    mechanism, varied = strut()[0], ("joints.tie_rod.length",)
    rod = mechanism.joint("tie_rod").changed(length=0.32)
    joints = [rod if joint.name == rod.name else joint for joint in mechanism.joints]
    route = lanes_of(PATHS["one side"], replace(mechanism, joints=joints), varied)
    found = solve_variants(route, np.array([[0.32, 0.05]]), TOL)
    assert found.solved.all(axis=0).tolist() == [True, False]
    assert found.messages[1].startswith("does not close at its design position; check")


def test_tables_of_a_template_share_programs(tmp_path, monkeypatch):
    """Of other numbers, for curves by other places."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    traced, trace, file = [], compiled_model._trace, tmp_path / "car.csv"
    monkeypatch.setattr(compiled_model, "_trace", lambda *x: traced.append(x) or trace(*x))
    text = sample_table(TEMPLATES["double_wishbone"])
    for k, place in enumerate(("lca_front x", "tierod_inner z")):
        file.write_text(text.replace("front,90", f"front,9{k}"))
        curves(file, [place], [[0.0]], ["toe.per_travel"])
    assert "front,91" in file.read_text()
    assert len(traced) == 1
