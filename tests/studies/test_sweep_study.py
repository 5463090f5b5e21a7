"""Sweeps over designs: held against closed forms, against runs of single variants, and against
themselves in any number of jobs.
"""

from io import StringIO
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
from kincheck import adapters
from kincheck.cases import load
from kincheck.core import SolveError, solve
from kincheck.core.algebra import Vec3
from kincheck.core.case.case import without_forces
from kincheck.core.case.suspension.base import where_moving
from kincheck.core.errors import KincheckError
from kincheck.core.harness.compare import output_series
from kincheck.core.jet import Jet
from kincheck.core.studies.tolerance.statistics import QUANTILES
from kincheck.core.studies.tolerance.study import Ready, Study
from kincheck.core.studies.tolerance.sweep import sweep_designs
from kincheck.core.studies.tolerance.tables import print_sweep

from ..support.fakes import crank, exact
from .test_vary import vary

TIP = {"at": "tip", "sigma": [1.0, 2.0, 0.0]}
PIVOT = {"at": "pivot", "half_width": [0.0, 5.0, 0.0]}
STRUT = {
    "tie_rod_outer": {"at": "joints.tie_rod.points.0", "sigma": 1.0},
    "ball": {"at": "ball", "sigma": 1.0},
    "wheel_center": {"at": "wheel_center", "half_width": 2.0},
    "pivot_axis": {"at": "joints.lca_pivot.axis", "sigma": 0.1},
}


def cranks(case, variation, seed, count):
    """x, from design, and y of the tip of every variant by the closed form p + R(angle) (tip - p),
    shape (2, n, count).
    """
    angle = case.sweep.change[:, None]
    dx, dy, py = np.array([variation.of_variant(seed, k) for k in range(count)]).T
    ax, ay = 0.5 + dx, dy - py
    x = np.cos(angle) * ax - np.sin(angle) * ay
    return np.stack([x - ax, py + np.sin(angle) * ax + np.cos(angle) * ay])


@pytest.mark.parametrize("jobs", [1, 3])
def test_a_sweep_is_the_closed_form_of_every_variant(tmp_path, jobs):
    case, count = crank(), 700
    variation = vary(tmp_path, case, tip=TIP, pivot=PIVOT)
    found = sweep_designs(case, variation, samples=count, seed=11, jobs=jobs)
    right = cranks(case, variation, 11, count)
    assert (found.samples, found.unsolved, found.quantiles_of) == (count, 0, count)
    for values, name in zip(right, ("x", "y"), strict=True):
        each = found.outputs[name]
        assert each.count == [count] * 9
        for mine, theirs in (
            (each.min, values.min(axis=1)),
            (each.max, values.max(axis=1)),
            (each.mean, values.mean(axis=1)),
            (each.standard_deviation, values.std(axis=1, ddof=1)),
            *((each.quantiles[f"{p:g}"], np.quantile(values, p, axis=1)) for p in QUANTILES),
        ):
            np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-14)
        assert values[:, each.min_variant].min() == pytest.approx(values.min(), abs=1e-14)
        assert values[:, each.max_variant].max() == pytest.approx(values.max(), abs=1e-14)
    p, _, _ = exact(case)
    np.testing.assert_allclose(found.outputs["y"].nominal, p[:, 1], atol=1e-15)


def test_sweep_results_ignore_number_of_jobs(tmp_path):
    case = load("mcpherson_strut")
    variation = vary(tmp_path, case, **STRUT)

    def swept(jobs):
        found = sweep_designs(case, variation, samples=1500, seed=3, order=1, jobs=jobs)
        return msgspec.json.encode(msgspec.structs.replace(found, run={}, measured={}))

    assert swept(1) == swept(2) == swept(5)


def test_many_quantiles_are_of_a_random_subset(tmp_path, monkeypatch):
    from kincheck.core.studies.tolerance import sweep

    monkeypatch.setattr(sweep, "KEPT", 400)
    case, count = crank(), 4000
    variation = vary(tmp_path, case, tip=TIP, pivot=PIVOT)
    found = sweep_designs(case, variation, samples=count, seed=1, jobs=2)
    assert 300 < found.quantiles_of < 500  # five standard errors of a share of a tenth
    right = np.quantile(cranks(case, variation, 1, count), 0.95, axis=2)[1]
    each = found.outputs["y"]
    off = (np.array(each.quantiles["0.95"]) - right) / np.array(each.standard_errors["0.95"])
    assert 0.0 < np.abs(off).max() < 5.0
    print_sweep(found, text := StringIO())
    assert "quantiles are of a random subset of" in text.getvalue()
    assert each.count == [count] * 9


def test_variant_outputs_equal_single_cases(tmp_path):
    """All outputs of a suspension and their derivatives by travel: markers, vectors and quotients
    of velocities.
    """
    case = load("mcpherson_suspension")
    study = Study(case, vary(tmp_path, case, **STRUT), 40, 2, picked=frozenset({0, 17, 39}))
    chunk = Ready.of(study).chunk(0)
    engine = adapters.engine("native")
    assert len(study.rows) == len(case.outputs) == 26
    for variant, values in chunk.picked.items():
        own = study.of_variant(variant)
        trajectory = engine.solve(engine.build(own), own, 1e-12)
        for row, mine in zip(study.rows, values, strict=True):
            theirs = output_series(own, row.output, trajectory).position
            # a derivative by travel divides twice by what changes by a thousandth
            scale = max(1.0, np.nanmax(np.abs(theirs)))
            np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-11 * scale, err_msg=row.name)


def test_stillness_is_judged_per_variant():
    """A quotient by the speed of travel is left out where that is small beside the fastest point:
    of the same variant.
    """
    one = np.ones((5, 2))
    fast = one * [1.0, 1e6]
    corner: Any = SimpleNamespace(center=SimpleNamespace(z=Jet(one, one, one)))
    at = {"slow": Vec3(*[Jet(one, one, one)] * 3), "fast": Vec3(*[Jet(one, fast, one)] * 3)}
    assert np.isnan(where_moving(Jet(one, one, one), corner, at).x).tolist() == [[False, True]] * 5


def test_sweep_order_adds_derivatives(tmp_path):
    case = crank()
    variation = vary(tmp_path, case, tip=TIP)
    assert list(sweep_designs(case, variation, samples=3, order=0).outputs) == ["x", "y"]
    found = sweep_designs(case, variation, samples=200, order=2)
    assert list(found.outputs) == [
        "x",
        "x.velocity",
        "x.acceleration",
        "y",
        "y.velocity",
        "y.acceleration",
    ]
    _, v, a = exact(case)
    np.testing.assert_allclose(found.outputs["y.velocity"].nominal, v[:, 1], atol=1e-14)
    np.testing.assert_allclose(found.outputs["x.acceleration"].nominal, a[:, 0], atol=1e-14)
    assert found.outputs["y.acceleration"].unit == "m/s^2"


def test_large_chunks_are_solved_in_parts(tmp_path, monkeypatch):
    case = crank()
    variation = vary(tmp_path, case, tip=TIP, pivot=PIVOT)
    study = Study(case, variation, 300, 4)
    whole = Ready.of(study).chunk(0)
    monkeypatch.setattr("kincheck.core.kinematics.native_solver.RECYCLED", 22_000)
    ready = Ready.of(study)
    assert 8 < ready.lanes < 100
    parts = ready.chunk(0)
    np.testing.assert_array_equal(np.concatenate(parts.kept, axis=2), whole.kept[1])
    np.testing.assert_allclose(parts.summary.mean, whole.summary.mean, rtol=0, atol=1e-16)
    np.testing.assert_array_equal(parts.summary.extremes, whole.summary.extremes)


def test_one_at_a_time_gives_effects(tmp_path):
    case = crank()
    variation = vary(
        tmp_path, case, "one_at_a_time", tip={"at": "tip", "values": [[-2, 2], [1], [0]]}
    )
    found = sweep_designs(case, variation)
    assert [(each.coordinate, round(each.offset, 6)) for each in found.effects] == [
        ("tip.x", -0.002),
        ("tip.x", 0.002),
        ("tip.y", 0.001),
    ]
    # y changes by sin(angle) dx, most at -1 and 1 rad, and x by -sin(angle) dy
    assert abs(found.effects[1].changes["y"]) == pytest.approx(0.002 * np.sin(1.0), abs=1e-14)
    assert abs(found.effects[2].changes["x"]) == pytest.approx(0.001 * np.sin(1.0), abs=1e-14)
    assert found.outputs["y"].standard_errors is None
    many = {"at": "tip", "half_width": [1, 0, 0], "steps": 400}
    long = sweep_designs(case, vary(tmp_path, case, "one_at_a_time", tip=many)).effects
    assert [each.variant for each in long] == [*range(1, 401)]
    np.testing.assert_allclose([each.offset for each in long], np.linspace(-1e-3, 1e-3, 400))
    with pytest.raises(
        KincheckError, match=r"one_at_a_time has 4 variants as listed, none is drawn. Leave it out"
    ):
        sweep_designs(case, variation, samples=3)


def test_a_grid_is_swept_as_a_whole(tmp_path):
    case = crank()
    variation = vary(
        tmp_path, case, "grid", tip={"at": "tip", "values": [[-2, 2], [-1, 0, 3], [0]]}
    )
    found = sweep_designs(case, variation)
    assert found.samples == 6
    angle = case.sweep.change
    np.testing.assert_allclose(
        found.outputs["y"].max,
        np.sin(angle) * np.where(angle > 0, 0.502, 0.498) + np.cos(angle) * 0.003,
    )
    tip = {"at": "tip", "half_width": 1, "steps": 9999}
    with pytest.raises(
        KincheckError, match=r"999700029999 variants, expected 1 to 10000000000. Vary less"
    ):
        sweep_designs(case, vary(tmp_path, case, "grid", tip=tip))
    with pytest.raises(
        KincheckError, match=r"draws as many variants as it is told. Give --samples"
    ):
        sweep_designs(case, vary(tmp_path, case, tip=TIP))


VARIANTS = 24


def test_unsolved_variants_are_counted_and_named(tmp_path):
    """A rod too short or too long for the crank to go round; each is what `solve` makes of it, NaN
    for what is not there.
    """
    case = without_forces(load("rssr"))
    variation = vary(tmp_path, case, rod={"at": "joints.rod.length", "half_width": 3500.0})
    study = Study(case, variation, VARIANTS, 1)
    found = sweep_designs(case, variation, samples=VARIANTS, seed=1, jobs=2)
    n, missing = len(case.sweep.values), {}
    for variant in range(VARIANTS):
        try:
            own = solve(study.of_variant(variant).mechanism, "crank", case.sweep.change)
            missing[variant] = n - int(own.solved.sum())
        except SolveError:
            missing[variant] = n
    assert {each.variant: each.samples for each in found.failed} == {
        k: count for k, count in missing.items() if count
    }
    assert 2 < found.unsolved == len(found.failed) < VARIANTS - 2
    assert {n} < {each.samples for each in found.failed}
    assert all(
        "cannot be followed beyond" in each.message or "does not close" in each.message
        for each in found.failed
    )
    assert sum(VARIANTS - count for count in found.outputs["rocker_pin_y"].count) == sum(
        missing.values()
    )
    assert None not in found.outputs["rocker_pin_y"].mean
    later = Ready.of(Study(case, variation, 128, 1)).chunk(1).unsolved
    assert later
    assert {each.variant for each in later} <= set(range(64, 128))
