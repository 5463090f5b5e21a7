"""Specification limits of a study: yield, capability and histograms, against closed forms."""

import csv
import json
import math
from dataclasses import replace
from importlib import import_module

import msgspec
import numpy as np
import pytest
from kincheck.cases import load
from kincheck.core.cli.main import main
from kincheck.core.errors import KincheckError
from kincheck.core.studies.tolerance.conformance import sparkline
from kincheck.core.studies.tolerance.page import page
from kincheck.core.studies.tolerance.sweep import sweep_designs
from kincheck.core.studies.tolerance.tables import limit_notes, remarks
from kincheck.core.studies.variation.study_choices import Sampling
from kincheck.core.studies.variation.variation import FileUnits, Limit
from kincheck.core.studies.variation.variation_file import limits_of_texts

from ..support.fakes import crank
from .test_vary import vary, vary_file

TIP = {"at": "tip", "sigma": [0.0, 1.0, 0.0]}


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The crank at its design: y of the tip is normal, of one millimetre, about zero."""
    case = crank()
    still = replace(case, sweep=replace(case.sweep, values=case.sweep.values[4:5]))
    assert still.sweep.change == pytest.approx(0.0)
    variation = vary(tmp_path_factory.mktemp("limits"), still, tip=TIP)
    limits = (Limit("y", -2e-3, 3e-3), Limit("x", high=1.0))
    return sweep_designs(
        still, replace(variation, limits=limits), samples=4096, seed=2, sampling=Sampling.SOBOL
    )


@pytest.fixture(scope="module")
def stats():
    """It takes a second to import, and others collect these tests too."""
    return import_module("scipy.stats")


def test_yield_and_capability_of_a_normal_output(found, stats):
    y, x, whole = found.limits
    expected = stats.norm.cdf(3.0) - stats.norm.cdf(-2.0)
    assert y.share == pytest.approx(expected, abs=2.0 / 4096)
    assert y.below / 4096 == pytest.approx(stats.norm.cdf(-2.0), abs=1.0 / 4096)
    assert y.above / 4096 == pytest.approx(stats.norm.sf(3.0), abs=1.0 / 4096)
    assert (y.cp, y.cpk, y.sample) == (
        pytest.approx(5.0 / 6.0, rel=2e-3),
        pytest.approx(2.0 / 3.0, rel=2e-3),
        0,
    )
    assert y.by_quantiles == pytest.approx(2.0 / 3.0, rel=2e-2)
    assert (x.share, x.cp, x.cpk) == (1.0, None, None)  # x from the design does not change
    assert (whole.output, whole.outside, whole.share) == ("", y.outside, y.share)


def test_the_interval_is_that_of_clopper_and_pearson(found, stats):
    y = found.limits[0]
    inside = y.known - y.outside
    low = stats.beta.ppf(0.025, inside, y.outside + 1)
    high = stats.beta.ppf(0.975, inside + 1, y.outside)
    assert y.interval == pytest.approx((low, high), rel=1e-9)
    assert found.limits[1].interval == pytest.approx((0.025 ** (1.0 / 4096), 1.0), rel=1e-9)


def test_the_histogram_counts_every_variant(found, stats):
    each = found.outputs["y"].histogram
    assert sum(each.counts) == 4096
    assert len(each.edges) == len(each.counts) + 1 == 31
    assert each.edges[0] == found.outputs["y"].min[0]
    assert each.edges[-1] == found.outputs["y"].max[0]
    expected = 4096 * np.diff(stats.norm.cdf(np.array(each.edges) / 1e-3))
    np.testing.assert_allclose(each.counts, expected, atol=3.0)
    text = sparkline(each)
    assert len(text) == 30
    assert text[np.argmax(each.counts)] == "█"
    assert found.outputs["x"].histogram is None


def test_the_page_has_limits_histograms_and_legends(found):
    text = page(found)
    assert "Specification limits" in text
    assert text.count('tabindex="0" aria-label="Histogram of y') == 1
    for words in ("nominal", "median", "5 to 95 %", "least and most", "limits", "variants at"):
        assert f"</svg> {words}" in text
    assert "Sobol" not in text
    assert "--sampling sobol --replay" in text


@pytest.mark.parametrize(
    ("changes", "said", "told"),
    [
        ({}, "a Sobol sequence is balanced", False),
        ({"asked": 4097}, "4097 is none, so the means converge more slowly: 8192 would be", True),
        ({"asked": 4097, "sampling": "random"}, "Sobol", False),
        ({"unsolved": 10}, "in all", False),
        ({"unsolved": 11}, "unsolved: 11 in all, the first 0 in the results", True),
        ({}, "assumes independent variants; for sobol sampling it is usually too wide", True),
        ({"sampling": "random"}, "assumes independent variants", False),
    ],
)
def test_remarks_of_a_study(found, changes, said, told):
    results = msgspec.structs.replace(found, **changes)
    lines = [*remarks(results), *limit_notes(results)]
    assert any(said in line for line in lines) is told, lines


def test_counts_do_not_depend_on_chunks_and_jobs(tmp_path):
    case = crank()
    limits = (Limit("y", high=0.4995),)
    variation = replace(vary(tmp_path, case, tip=TIP), limits=limits)
    one, three = (
        sweep_designs(case, variation, samples=300, seed=1, jobs=jobs).limits for jobs in (1, 3)
    )
    assert one == three
    values = np.array([variation.of_variant(1, k)[0] for k in range(300)])
    angle = case.sweep.change[:, None]
    y = 0.5 * np.sin(angle) + np.cos(angle) * values
    assert one[0].above == int((y > 0.4995).any(axis=0).sum())


def test_limits_of_a_rate_take_its_order(tmp_path):
    case = crank()
    limits = (Limit("y.velocity", high=0.4),)
    variation = replace(vary(tmp_path, case, tip=TIP), limits=limits)
    with pytest.raises(KincheckError, match=r"limits of y.velocity: .+ Give --order 1"):
        sweep_designs(case, variation, samples=4)
    found = sweep_designs(case, variation, samples=4, order=1)
    assert found.limits[0].unit == "m/s"


@pytest.fixture
def file(tmp_path):
    limits = {"half_track_change": {"low": -12.0, "high": 1.0}}
    return vary_file(tmp_path, {"ball": {"at": "ball", "sigma": 1.0}}, limits=limits)


def test_limits_use_units_of_the_file(file, tmp_path, capsys):
    out = tmp_path / "out"
    command = f"sweep mcpherson_strut --vary {file} --samples 50".split()
    limits = "--limit wheelbase_change::3.5 --limit half_track_change:-11:1".split()
    assert main([*command, *limits, "--sampling", "latin", "--out", str(out)]) == 0
    found = json.loads((out / "sweep.json").read_text())
    assert found["sampling"] == "latin"
    assert [(each["output"], each["low"], each["high"]) for each in found["limits"]] == [
        ("half_track_change", -0.011, 0.001),
        ("wheelbase_change", None, 0.0035),
        ("", None, None),
    ]
    with (out / "limits.csv").open() as lines:
        rows = list(csv.DictReader(lines))
    assert [(each["output"], each["unit"], each["low"], each["high"]) for each in rows] == [
        ("half_track_change", "mm", "-11.0", "1.0"),
        ("wheelbase_change", "mm", "", "3.5"),
        ("all", "", "", ""),
    ]
    told = capsys.readouterr().out
    assert "Specification limits" in told
    assert "95 % interval" in told


@pytest.mark.parametrize(
    ("limit", "low", "high"),
    [
        ("toe:-2:3deg", -2.0, 3.0),
        ("toe:-2deg:3deg", -2.0, 3.0),
        ("toe:-2 deg:", -2.0, math.inf),
        ("toe::90arcmin", -math.inf, 1.5),
        ("toe:-1e-1:0.1rad", -math.degrees(0.1), math.degrees(0.1)),
    ],
)
def test_limits_take_a_unit(limit, low, high):
    (found,) = limits_of_texts([limit], load("mcpherson_suspension"), FileUnits("mm", "rad"))
    ends = [math.radians(low), math.radians(high)]
    assert [found.low, found.high] == pytest.approx(ends, rel=1e-15)


def test_limits_of_a_table_are_in_degrees(tmp_path, capsys):
    main(["templates", "mcpherson"])
    car, out = tmp_path / "car.csv", tmp_path / "out"
    car.write_text(capsys.readouterr().out)
    rows = {"ball": {"at": "lca_outer", "sigma": 1.0}}
    varied = vary_file(tmp_path, rows, units={"length": "mm"})
    said = ["--limit", "toe:-1.5:3", "--output", "toe", "--samples", "20", "--out", str(out)]
    assert main(["sweep", str(car), "--vary", str(varied), *said]) == 0
    (limit, _) = json.loads((out / "sweep.json").read_text())["limits"]
    assert [limit["low"], limit["high"]] == pytest.approx(np.radians([-1.5, 3.0]), rel=1e-15)
    with (out / "limits.csv").open() as lines:
        row = next(csv.DictReader(lines))
    assert row["unit"] == "deg"
    assert [float(row["low"]), float(row["high"])] == pytest.approx([-1.5, 3.0])


@pytest.mark.parametrize("limit", ["toe:-2:2mm", "toe:-2deg:2rad", "toe:-2:2dgr", "toe:deg:deg"])
def test_limits_of_another_unit_are_refused(limit):
    with pytest.raises(
        KincheckError, match=r"--limit.*(expected one such as rad|OUTPUT:LOW:HIGH|neither)"
    ):
        limits_of_texts([limit], load("mcpherson_suspension"), FileUnits("mm", "rad"))
