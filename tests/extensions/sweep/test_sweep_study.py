"""Studies of designs: draws, chunks, and what is reduced."""

import math
from dataclasses import replace
from io import StringIO
from itertools import pairwise

import msgspec
import numpy as np
import pytest
from kincheck.cases import load
from kincheck.core import SolveError, solve
from kincheck.core.case.case import without_forces
from kincheck.core.case.measures import Component, JointAngle, JointDisplacement, Orientation
from kincheck.core.case.quantity import where_moving, with_markers
from kincheck.core.errors import KincheckError
from kincheck.core.extensions.sweep.statistics import (
    QUANTILES,
    empty_summary,
    merge,
    quantiles,
    summary_of,
)
from kincheck.core.extensions.sweep.study import Ready, Study, gradients
from kincheck.core.extensions.sweep.study_choices import Sampling
from kincheck.core.extensions.sweep.sweep import sweep_designs
from kincheck.core.extensions.sweep.tables import print_sweep, without_gradients
from kincheck.core.extensions.sweep.variation import DRAWN, Law, Limit
from kincheck.core.jet import Jet
from scipy import stats

from ...support.examples import examples
from ...support.fakes import crank, exact, swept
from ...support.measure_cases import arm
from ...support.variations import vary

TIP_LAWS, STRUT = examples(__file__, "tip_laws", "strut")

TIP = {"at": "tip", "sigma": [1.0, 2.0, 0.0]}
PIVOT = {"at": "pivot", "half_width": [0.0, 5.0, 0.0]}


def cranks(case, variation, seed, count):
    """x, from design, and y of the tip of every variant by the closed form p + R(angle) (tip - p),
    shape (2, n, count).
    """
    angle = case.sweep.change[:, None]
    dx, dy, py = variation.offsets(seed, 0, count)
    ax, ay = 0.5 + dx, dy - py
    x = np.cos(angle) * ax - np.sin(angle) * ay
    return np.stack([x - ax, py + np.sin(angle) * ax + np.cos(angle) * ay])


@pytest.mark.parametrize("jobs", [1, 3])
def test_sweep_equals_closed_form(tmp_path, jobs):
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


def test_sweep_results_ignore_job_count(tmp_path):
    case = load("mcpherson_strut")
    limits = (Limit("half_track_change", high=1e-3),)
    variation = replace(vary(tmp_path, case, **STRUT), limits=limits)

    def results(jobs):
        found = sweep_designs(case, variation, samples=1500, seed=3, order=1, jobs=jobs)
        return msgspec.json.encode(msgspec.structs.replace(found, run={}, measured={}))

    assert results(1) == results(2) == results(5)


def test_quantiles_of_large_sweep_use_subset(tmp_path):
    case, count = crank(), 40_000
    variation = vary(tmp_path, case, tip=TIP, pivot=PIVOT)
    found = sweep_designs(case, variation, samples=count, seed=1, jobs=2)
    assert 9_500 < found.quantiles_of < 10_500  # five standard errors of a share of a quarter
    right = np.quantile(cranks(case, variation, 1, count), 0.95, axis=2)[1]
    each = found.outputs["y"]
    off = (np.array(each.quantiles["0.95"]) - right) / np.array(each.standard_errors["0.95"])
    assert 0.0 < np.abs(off).max() < 5.0
    print_sweep(found, text := StringIO())
    assert "quantiles are of a random subset of" in text.getvalue()
    assert each.count == [count] * 9


def test_stillness_is_judged_per_variant():
    """A quotient by the speed of travel is left out where that is small beside the fastest point:
    of the same variant.
    """
    one = np.ones((5, 2))
    fast = one * [1.0, 1e12]
    assert np.isnan(where_moving(Jet(one, one, one), (one, fast)).x).tolist() == [[False, True]] * 5


def test_large_chunks_are_solved_in_parts(tmp_path):
    case = crank(reference=False)
    case = swept(case, np.linspace(-1.0, 1.0, 9001))
    variation = vary(tmp_path, case, tip=TIP, pivot=PIVOT)
    ready = Ready.of(Study(case, variation, 300, 4))
    assert 8 < ready.outputs.at_once < 64
    parts, right = ready.chunk(0), cranks(case, variation, 4, 64)
    np.testing.assert_allclose(np.concatenate(parts.kept, axis=2), right, rtol=0, atol=1e-14)
    np.testing.assert_allclose(parts.summary.mean, right.mean(axis=2), rtol=0, atol=1e-14)
    np.testing.assert_allclose(parts.summary.most, right.max(axis=2), rtol=0, atol=1e-14)


def test_one_at_a_time_effects(tmp_path):
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


def test_grid_sweep_covers_all_combinations(tmp_path):
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


# What is made of many variants: extremes, moments, quantiles and gradients, held against closed


def test_merged_summaries_equal_whole_summary():
    """Ten thousand times as far from zero as they are apart: the sum of squares must not be a
    difference of large numbers.
    """
    random = np.random.default_rng(1)
    values = 1e4 + random.normal(size=(2, 3, 100))
    values[0, 1, random.random(100) < 0.3] = np.nan
    values[1, 2] = np.nan
    values[1, 0, 40:70] = np.nan
    for cuts in ([0, 100], [0, 1, 40, 70, 71, 100], [0, 55, 100]):
        whole = empty_summary(2, 3)
        for a, b in pairwise(cuts):
            whole = merge(whole, summary_of(values[:, :, a:b], a))
        np.testing.assert_array_equal(whole.count, (~np.isnan(values)).sum(axis=2))
        some = whole.count > 0
        with np.errstate(all="ignore"):
            np.testing.assert_array_equal(whole.least[some], np.nanmin(values[some], axis=1))
            np.testing.assert_array_equal(whole.most[some], np.nanmax(values[some], axis=1))
            np.testing.assert_allclose(
                whole.mean[some], np.nanmean(values[some], axis=1), rtol=1e-14
            )
            np.testing.assert_allclose(
                whole.deviation[some], np.nanstd(values[some], axis=1, ddof=1), rtol=1e-9
            )
        assert np.isnan(
            [each[1, 2] for each in (whole.least, whole.most, whole.mean, whole.deviation)]
        ).all()
        for q in range(2):
            low, high = whole.extremes[q]
            assert np.nanmin(values[q]) in values[q, :, low]
            assert np.nanmax(values[q]) in values[q, :, high]
    assert empty_summary(1, 2).extremes.tolist() == [[-1, -1]]


def test_quantiles_and_standard_errors():
    """The spread of quantiles over many samples is the standard error that each of them is given,
    to the fifth of it.
    """
    random = np.random.default_rng(2)
    kept = random.normal(size=(300, 1000))
    found = quantiles([kept[:, :600], kept[:, 600:]], exact=False)
    np.testing.assert_allclose(found.values, np.quantile(kept, QUANTILES, axis=1), rtol=1e-13)
    np.testing.assert_allclose(found.errors.mean(axis=1), found.values.std(axis=1), rtol=0.2)
    assert quantiles([kept], exact=True).errors is None
    holes = kept[:4].copy()
    holes[1, ::2], holes[2] = np.nan, np.nan
    some = quantiles([holes], exact=True).values
    np.testing.assert_allclose(some[:, 1], np.quantile(kept[1, 1::2], QUANTILES), rtol=1e-13)
    assert np.isnan(some[:, 2]).all()


def test_coarse_variants_count_nominal_turns(tmp_path):
    """At the samples and at design, where gradients are read too."""
    output = JointAngle("turned", 1e-9, 0.0, "test", "pivot")
    attitude = Orientation("e0", 1e-9, 0.0, "test", "arm", Component.E0)
    case, values = crank(), np.array([0.0, 20.0, 61.0])
    case = replace(
        case,
        mechanism=with_markers(case.mechanism, [output, attitude]),
        sweep=replace(case.sweep, values=values),
        outputs=(output, attitude),
        reference={},
    )
    ready = Ready.of(Study(case, vary(tmp_path, case, tip={"at": "tip", "sigma": 1}), 1, 0))
    rows, *_ = ready.values(np.full((3, 2), 1e-3))
    wanted = np.array([values, np.cos(0.5 * values)])[:, :, None] + np.zeros(2)
    np.testing.assert_allclose(rows, wanted, rtol=0, atol=1e-12)
    found = gradients(ready.study)
    assert np.abs(found.along).max() <= 1e-9
    assert np.abs(found.design).max() <= 1e-9


ATTITUDES = (
    JointAngle("turned", 1e-9, 0.0, "test", "hinge"),
    JointDisplacement("gone", 1e-9, 0.0, "test", "bore"),
    *(
        Orientation(f"slide_{x}", 1e-9, 0.0, "test", "slide", x)
        for x in (Component.Z, Component.E1)
    ),
)


def differences(study):
    """Gradients by Richardson's central differences of variants, shape (coordinates, rows, n), and
    what 1e-13 of the rows leaves in them.
    """
    ready, h = Ready.of(study), np.array([0.1 * x.scale for x in study.variation.coordinates])
    ends = np.concatenate([share * np.diag(h) for share in (1.0, -1.0, 0.5, -0.5)], axis=1)
    plus, minus, half_plus, half_minus = np.split(ready.values(ends)[0], 4, axis=2)
    found = (8.0 * (half_plus - half_minus) - plus + minus) / 6.0
    size = np.fmax(np.nanmax(np.abs(ready.nominal), axis=1), 1.0)
    return np.moveaxis(found, -1, 0) / h[:, None, None], 1e-13 * (size / h[:, None])[:, :, None]


def turning(folder):
    """More than a turn of a joint and of a body, whose Euler parameters go on through zero."""
    case = arm(np.linspace(0.0, 7.0, 29))
    case = replace(case, mechanism=with_markers(case.mechanism, ATTITUDES), outputs=ATTITUDES)
    axes = {name: {"at": f"joints.{name}.axis", "sigma": 1.0} for name in ("hinge", "bore")}
    study = Study(case, vary(folder, case, **axes), 1, 0, order=2)
    assert Ready.of(study).nominal[0, -1] == pytest.approx(7.0)
    return study


def steered(folder):
    """Rates, forces and quotients of rates of a corner, near the end of its travel."""
    case = swept(load("mcpherson_strut_loaded"), np.linspace(-0.05, 0.05, 5))
    loads = {
        "rate": {"at": "forces.spring.stiffness", "half_width": 2.0},
        "mass": {"at": "bodies.knuckle.mass", "half_width": 3.0},
    }
    return Study(case, vary(folder, case, **loads, **STRUT), 1, 0, order=2)


def redundant(folder):
    """Reactions beside rows that are redundant."""
    case = load("planar_slider_crank")
    pin = {"at": "joints.crank_pin.point", "half_width": [0.5, 0.5, 0.0]}
    mass = {"at": "bodies.slider.mass", "half_width": 0.1}
    return Study(case, vary(folder, case, pin=pin, mass=mass), 1, 0, order=2)


@pytest.mark.parametrize("study", [turning, steered, redundant])
def test_gradients_of_rates_and_forces(tmp_path, study):
    """Against differences of variants."""
    found = study(tmp_path)
    own, (expected, round_off) = gradients(found).along, differences(found)
    assert np.isfinite(own).any(axis=2).all()
    np.testing.assert_array_equal(np.isnan(own), np.isnan(expected))
    assert np.nanmax(np.abs(own - expected) / round_off) < 1.0


def test_untraced_forces_have_no_gradients(tmp_path, monkeypatch):
    """As of rows that are redundant but for digits: the values are there, and the table says why
    their gradients are not.
    """
    tracing = "kincheck.core.kinematics.compiled.traced_forces"
    monkeypatch.setattr(f"{tracing}.can_trace", lambda mechanism: False)
    study = redundant(tmp_path)
    case = replace(study.case, outputs=tuple(each for each in study.case.outputs if each.forces))
    assert np.isnan(gradients(replace(study, case=case, order=0)).along).all()
    found = sweep_designs(case, study.variation, samples=2)
    assert all(each.largest is None for each in found.gradients)
    assert found.unsolved == 0
    (line,) = without_gradients(found)
    assert line.startswith("no gradients of crank_torque")


# Distributions, samplings and correlations of drawn variants, held against scipy's


@pytest.fixture
def of_scipy(law):
    """The law in mm."""
    return {
        "normal": stats.norm(scale=2.0),
        "truncated_normal": stats.truncnorm(-1.5, 1.5, scale=2.0),
        "uniform": stats.uniform(-2.0, 4.0),
        "triangular": stats.triang(0.5, -2.0, 4.0),
    }[law]


@pytest.mark.parametrize("law", TIP_LAWS)
@pytest.mark.parametrize("sampling", [Sampling.LATIN, Sampling.SOBOL])
def test_stratified_sampling_fills_every_interval(tmp_path, law, sampling, of_scipy):
    """A Latin hypercube has that for any number, a Sobol sequence for powers of two."""
    count = 1000 if sampling is Sampling.LATIN else 1024
    found = vary(tmp_path, crank(), tip=TIP_LAWS[law]).sampled(sampling, count)
    assert found.coordinates[0].law == Law(law)
    shares = np.sort(of_scipy.cdf(1e3 * found.offsets(3, 0, count)[0]))
    np.testing.assert_array_equal(np.floor(shares * count + 1e-9), np.arange(count))


@pytest.mark.parametrize("law", TIP_LAWS)
def test_standard_deviation_of_laws(tmp_path, law, of_scipy):
    (coordinate,) = vary(tmp_path, crank(), tip=TIP_LAWS[law]).coordinates
    assert 1e3 * coordinate.standard_deviation == pytest.approx(of_scipy.std(), rel=1e-12)
    for bound, rel in ((1e-6, 1e-12), (0.1, 1e-12), (30.0, 1e-12)):
        cut = replace(coordinate, law=Law.TRUNCATED_NORMAL, scale=1.0, bound=bound)
        wanted = bound / math.sqrt(3.0) if bound < 1e-3 else stats.truncnorm.std(-bound, bound)
        assert cut.standard_deviation == pytest.approx(wanted, rel=rel)


def test_listed_offsets_rank_by_deviation(tmp_path):
    tip = {"at": "tip", "values": [[0.0, 1.0], [-1.0, 0.0, 4.0], [0.0]]}
    found = [
        1e3 * x.standard_deviation for x in vary(tmp_path, crank(), "grid", tip=tip).coordinates
    ]
    assert found[:2] == pytest.approx([0.5, math.sqrt(14.0 / 3.0)])


@pytest.mark.parametrize("law", ["truncated_normal", "triangular"])
def test_random_draws_follow_distribution(tmp_path, law, of_scipy):
    drawn = 1e3 * vary(tmp_path, crank(), tip=TIP_LAWS[law]).offsets(1, 0, 4 * DRAWN)[0]
    assert stats.kstest(drawn, of_scipy.cdf).pvalue > 0.01  # of a fixed seed
    assert np.abs(drawn).max() <= {"truncated_normal": 3.0, "triangular": 2.0}[law]


def test_random_draws_equal_earlier_versions(tmp_path):
    """Equal seeds give equal numbers: normal and uniform coordinates are drawn as ever."""
    found = vary(
        tmp_path,
        crank(),
        tip=TIP_LAWS["normal"],
        pivot={"at": "pivot", "half_width": [3.0, 0.0, 0.0]},
    ).offsets(5, DRAWN, 2)
    seed = np.random.SeedSequence(5, spawn_key=(1, 0))
    random = np.random.Generator(np.random.Philox(seed))
    normal = 0.001 * 2.0 * random.standard_normal((1, DRAWN))
    uniform = 0.001 * 3.0 * random.uniform(-1.0, 1.0, (1, DRAWN))
    np.testing.assert_array_equal(found, np.concatenate([normal, uniform])[:, :2])


@pytest.mark.parametrize("sampling", Sampling)
def test_variant_depends_on_seed_and_index(tmp_path, sampling):
    found = vary(
        tmp_path, crank(), tip=TIP_LAWS["triangular"], pivot={"at": "pivot", "sigma": 1.0}
    ).sampled(sampling, 700)
    whole = found.offsets(4, 0, 700)
    assert len(np.unique(whole)) == whole.size
    for first, count in ((513, 100), (0, 3), (250, 300), (699, 1)):
        np.testing.assert_array_equal(
            found.offsets(4, first, count), whole[:, first : first + count]
        )
    assert not np.isin(found.offsets(5, 0, 700), whole).any()
    again = found.sampled(sampling, 1400).offsets(4, 0, 700)
    assert (again == whole).all() == (sampling is not Sampling.LATIN)


def correlated(tmp_path, law, r, count=8192):
    keys = {
        "normal": {"sigma": 2.0},
        "uniform": {"half_width": 2.0},
    }[law]
    matrix = {"coordinates": ["tip.x", "tip.z"], "matrix": [[1, r], [r, 1]]}
    tables = {"correlations": {"a": matrix}}
    found = vary(tmp_path, crank(), tables=tables, tip={"at": "tip", **keys})
    return found.sampled(Sampling.SOBOL, count).offsets(1, 0, count)


@pytest.mark.parametrize("r", [0.8, -0.5, 1.0])
def test_correlated_normal_draws_have_correlation(tmp_path, r):
    x, y, z = correlated(tmp_path, "normal", r)
    found = np.corrcoef([x, y, z])
    assert found[0, 2] == pytest.approx(r, abs=5e-3)
    assert found[0, 1] == pytest.approx(0.0, abs=5e-3)
    assert [each.std() for each in (x, y, z)] == pytest.approx([2e-3] * 3, rel=5e-3)
    if r == 1.0:
        np.testing.assert_allclose(x, z, rtol=1e-12)


def test_correlated_uniform_draws_follow_copula(tmp_path):
    x, _, z = correlated(tmp_path, "uniform", 0.8)
    assert np.corrcoef(x, z)[0, 1] == pytest.approx(6.0 / np.pi * np.arcsin(0.4), abs=5e-3)
    assert np.abs([x, z]).max() <= 2e-3
    assert x.std() == pytest.approx(2e-3 / np.sqrt(3.0), rel=5e-3)


def test_impossible_samplings_are_refused(tmp_path):
    found = vary(tmp_path, crank(), tip={"at": "tip", "sigma": 1.0})
    with pytest.raises(KincheckError, match=r"6 GB of memory, expected at most 1. Take fewer"):
        found.sampled(Sampling.LATIN, 500_000_000)
    with pytest.raises(KincheckError, match=r"expected at most 4294967296. Take fewer"):
        found.sampled(Sampling.SOBOL, 2**32 + 1)
    grid = vary(tmp_path, crank(), "grid", tip={"at": "tip", "values": [-1, 1]})
    with pytest.raises(KincheckError, match="--sampling latin: grid draws nothing"):
        grid.sampled(Sampling.LATIN, 8)
