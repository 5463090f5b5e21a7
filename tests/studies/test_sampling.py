"""Distributions, samplings and correlations of drawn variants, held against scipy's."""

from importlib import import_module

import numpy as np
import pytest
from kincheck.core.errors import KincheckError
from kincheck.core.studies.variation.study_choices import Sampling
from kincheck.core.studies.variation.variation import DRAWN, Law
from kincheck.core.studies.variation.variation_file import read_variation

from ..support.fakes import crank
from .test_vary import vary_file

TIP = {
    "normal": {"at": "tip", "sigma": [0.0, 2.0, 0.0]},
    "truncated_normal": {
        "at": "tip",
        "sigma": [0.0, 2.0, 0.0],
        "half_width": 3.0,
        "distribution": "truncated_normal",
    },
    "uniform": {"at": "tip", "half_width": [0.0, 2.0, 0.0]},
    "triangular": {"at": "tip", "half_width": [0.0, 2.0, 0.0], "distribution": "triangular"},
}


@pytest.fixture(scope="module")
def stats():
    """It takes a second to import, and others collect these tests too."""
    return import_module("scipy.stats")


@pytest.fixture
def of_scipy(stats, law):
    """The law in mm."""
    return {
        "normal": stats.norm(scale=2.0),
        "truncated_normal": stats.truncnorm(-1.5, 1.5, scale=2.0),
        "uniform": stats.uniform(-2.0, 4.0),
        "triangular": stats.triang(0.5, -2.0, 4.0),
    }[law]


def variation(tmp_path, tables=None, **hardpoints):
    return read_variation(vary_file(tmp_path, hardpoints, **(tables or {})), crank())


@pytest.mark.parametrize("law", TIP)
@pytest.mark.parametrize("sampling", [Sampling.LATIN, Sampling.SOBOL])
def test_stratified_sampling_fills_every_interval(tmp_path, law, sampling, of_scipy):
    """A Latin hypercube has that for any number, a Sobol sequence for powers of two."""
    count = 1000 if sampling is Sampling.LATIN else 1024
    found = variation(tmp_path, tip=TIP[law]).sampled(sampling, count)
    assert found.coordinates[0].law == Law(law)
    shares = np.sort(of_scipy.cdf(1e3 * found.offsets(3, 0, count)[0]))
    np.testing.assert_array_equal(np.floor(shares * count + 1e-9), np.arange(count))


@pytest.mark.parametrize("law", ["truncated_normal", "triangular"])
def test_random_draws_have_the_distribution(tmp_path, law, stats, of_scipy):
    drawn = 1e3 * variation(tmp_path, tip=TIP[law]).offsets(1, 0, 4 * DRAWN)[0]
    assert stats.kstest(drawn, of_scipy.cdf).pvalue > 0.01  # of a fixed seed
    assert np.abs(drawn).max() <= {"truncated_normal": 3.0, "triangular": 2.0}[law]


def test_random_draws_equal_earlier_versions(tmp_path):
    """Equal seeds give equal numbers: normal and uniform coordinates are drawn as ever."""
    found = variation(
        tmp_path, tip=TIP["normal"], pivot={"at": "pivot", "half_width": [3.0, 0.0, 0.0]}
    ).offsets(5, DRAWN, 2)
    seed = np.random.SeedSequence(5, spawn_key=(1, 0))
    random = np.random.Generator(np.random.Philox(seed))
    normal = 0.001 * 2.0 * random.standard_normal((1, DRAWN))
    uniform = 0.001 * 3.0 * random.uniform(-1.0, 1.0, (1, DRAWN))
    np.testing.assert_array_equal(found, np.concatenate([normal, uniform])[:, :2])


@pytest.mark.parametrize("sampling", Sampling)
def test_variant_depends_on_seed_and_index(tmp_path, sampling):
    found = variation(tmp_path, tip=TIP["triangular"], pivot={"at": "pivot", "sigma": 1.0}).sampled(
        sampling, 700
    )
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
    tables = {
        "correlations": {"a": {"coordinates": ["tip.x", "tip.z"], "matrix": [[1, r], [r, 1]]}}
    }
    found = variation(tmp_path, tables, tip={"at": "tip", **keys})
    return found.sampled(Sampling.SOBOL, count).offsets(1, 0, count)


@pytest.mark.parametrize("r", [0.8, -0.5, 1.0])
def test_correlated_normal_coordinates_have_the_correlation(tmp_path, r):
    x, y, z = correlated(tmp_path, "normal", r)
    found = np.corrcoef([x, y, z])
    assert found[0, 2] == pytest.approx(r, abs=5e-3)
    assert found[0, 1] == pytest.approx(0.0, abs=5e-3)
    assert [each.std() for each in (x, y, z)] == pytest.approx([2e-3] * 3, rel=5e-3)
    if r == 1.0:
        np.testing.assert_allclose(x, z, rtol=1e-12)


def test_correlated_uniform_coordinates_follow_copula(tmp_path):
    x, _, z = correlated(tmp_path, "uniform", 0.8)
    assert np.corrcoef(x, z)[0, 1] == pytest.approx(6.0 / np.pi * np.arcsin(0.4), abs=5e-3)
    assert np.abs([x, z]).max() <= 2e-3
    assert x.std() == pytest.approx(2e-3 / np.sqrt(3.0), rel=5e-3)


def test_impossible_samplings_are_refused(tmp_path):
    found = variation(tmp_path, tip={"at": "tip", "sigma": 1.0})
    with pytest.raises(KincheckError, match=r"6 GB of memory, expected at most 1. Take fewer"):
        found.sampled(Sampling.LATIN, 500_000_000)
    with pytest.raises(KincheckError, match=r"expected at most 4294967296. Take fewer"):
        found.sampled(Sampling.SOBOL, 2**32 + 1)
    tables = {"mode": "grid"}
    grid = variation(tmp_path, tables, tip={"at": "tip", "values": [-1, 1]})
    with pytest.raises(KincheckError, match="--sampling latin: grid draws nothing"):
        grid.sampled(Sampling.LATIN, 8)
