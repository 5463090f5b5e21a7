"""Limits, unsolved designs and forces in studies of designs."""

import csv
import io
import json
import math
import re
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from kincheck import adapters
from kincheck.cases import load
from kincheck.core import CaseError
from kincheck.core.case.case import Case, Output, Sweep, Truth
from kincheck.core.case.io.case_file import case_text
from kincheck.core.cli.main import main
from kincheck.core.errors import KincheckError
from kincheck.core.extensions.sweep.conformance import sparkline
from kincheck.core.extensions.sweep.cross_check import Check
from kincheck.core.extensions.sweep.page import page
from kincheck.core.extensions.sweep.study import RowLimit, limit_counts
from kincheck.core.extensions.sweep.study_choices import Incomplete, Sampling
from kincheck.core.extensions.sweep.sweep import sweep_designs
from kincheck.core.extensions.sweep.tables import limit_notes, limits_csv, print_sweep, remarks
from kincheck.core.extensions.sweep.variation import FileUnits, Limit
from kincheck.core.extensions.sweep.variation_file import limits_of_texts
from kincheck.core.harness.execution import solve_in_process
from kincheck.core.harness.record import to_json
from kincheck.core.joints import Distance, Revolute
from kincheck.core.mechanism.mechanism import Body, Mechanism, Point
from kincheck.core.mechanism.motions import JointAngle
from scipy import stats

from ...report.page import Page
from ...support.examples import examples
from ...support.fakes import crank, swept
from ...support.variations import HEAD, vary, vary_file

LOADED, REMARKS = examples(__file__, "loaded", "remarks")

TIP = {"at": "tip", "sigma": [0.0, 1.0, 0.0]}


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The crank at its design: y of the tip is normal, of one millimetre, about zero."""
    case = crank()
    still = swept(case, case.sweep.values[4:5])
    assert still.sweep.change == pytest.approx(0.0)
    variation = vary(tmp_path_factory.mktemp("limits"), still, tip=TIP)
    limits = (Limit("y", -2e-3, 3e-3), Limit("x", high=1.0))
    return sweep_designs(
        still, replace(variation, limits=limits), samples=4096, seed=2, sampling=Sampling.SOBOL
    )


def test_yield_and_capability_of_normal_output(found):
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
    assert x.interval == pytest.approx((0.025 ** (1.0 / 4096), 1.0), rel=1e-9)
    assert (whole.output, whole.outside, whole.share) == ("", y.outside, y.share)


def test_grid_has_yield_without_interval(tmp_path):
    """Its variants are chosen: nothing is estimated."""
    case = crank()
    variation = vary(tmp_path, case, "grid", tip={"at": "tip", "values": [[-1, 1], [0], [0]]})
    found = sweep_designs(case, replace(variation, limits=(Limit("y", high=1.0),)))
    assert [(each.known, each.interval) for each in found.limits] == [(2, None)] * 2


def test_histogram_counts_every_variant(found):
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


def test_sweep_page_has_limits_and_histograms(found):
    text = page(found)
    assert "Specification limits" in text
    assert text.count('tabindex="0" aria-label="Histogram of y') == 1
    for words in ("nominal", "median", "5 to 95 %", "least and most", "limits", "variants at"):
        assert f"</svg> {words}" in text
    assert "Sobol" not in text
    assert "--sampling sobol --replay" in text


@pytest.mark.parametrize(
    ("changes", "said", "told"),
    REMARKS.values(),
    ids=REMARKS,
)
def test_study_remarks(found, changes, said, told):
    results = msgspec.structs.replace(found, **changes)
    lines = [*remarks(results), *limit_notes(results)]
    assert any(said in line for line in lines) is told, lines


def test_rate_limits_raise_derivative_order(tmp_path):
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


def test_limits_use_file_units(file, tmp_path, capsys):
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


@pytest.mark.needs("hardpoints")
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
def test_limits_with_own_unit(limit, low, high):
    (found,) = limits_of_texts([limit], load("mcpherson_suspension"), FileUnits("mm", "rad"))
    ends = [math.radians(low), math.radians(high)]
    assert [found.low, found.high] == pytest.approx(ends, rel=1e-15)


@pytest.mark.needs("hardpoints")
def test_limits_of_table_in_degrees(tmp_path, capsys):
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


@pytest.mark.needs("hardpoints")
@pytest.mark.parametrize("limit", ["toe:-2:2mm", "toe:-2deg:2rad", "toe:-2:2dgr", "toe:deg:deg"])
def test_limits_of_wrong_unit_are_refused(limit):
    with pytest.raises(
        KincheckError, match=r"--limit.*(expected one such as rad|OUTPUT:LOW:HIGH|neither)"
    ):
        limits_of_texts([limit], load("mcpherson_suspension"), FileUnits("mm", "rad"))


# Yield of a study whose variants do not all reach every sample, and how it is printed


CRANK, PIVOT, END, LOW = 1.0, 4.0, (3.0, 2.0, 0.0), 0.7
JOINT = {"at": "joints.rod.points.1", "sigma": [150.0, 150.0, 0.0]}
VARIANTS = 120


def four_bar():
    """A crank of one metre, one turn from the pivot of the rocker, four metres away."""
    mechanism = Mechanism(
        "bars",
        [Body("crank"), Body("rocker")],
        [
            Revolute("input", "ground", "crank", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
            Revolute("output", "ground", "rocker", (PIVOT, 0.0, 0.0), (0.0, 0.0, 1.0)),
            Distance("rod", "crank", "rocker", ((CRANK, 0.0, 0.0), END)),
        ],
        [Point("end", "rocker", END)],
        [JointAngle("turn", "input")],
    )
    sweep = Sweep("turn", np.linspace(0.0, 2.0 * math.pi, 25))
    height = Output("height", "end", (0.0, 1.0, 0.0), False, 1e-9, 0.0, "test")
    return Case("bars", "made up", Truth.CONSENSUS_ONLY, mechanism, sweep, (height,))


def heights(case, at):
    """The height of the rocker's end by two circles; none if the crank cannot turn wholly."""
    rod, rocker = math.dist(at, (CRANK, 0.0)), math.dist(at, (PIVOT, 0.0))
    if rod + rocker < PIVOT + CRANK:  # stretched before the crank points away from the pivot
        return None
    tip = CRANK * np.exp(1j * case.sweep.values)
    along = PIVOT - tip
    d = np.abs(along)
    foot = (rod**2 - rocker**2 + d**2) / (2.0 * d)
    return (tip + along / d * (foot + 1j * np.sqrt(rod**2 - foot**2))).imag


def limited(folder):
    """The variation of the rocker's end, with a limit of its height."""
    return replace(vary(folder, four_bar(), end=JOINT), limits=(Limit("height", low=LOW),))


@pytest.fixture(scope="module")
def studied(tmp_path_factory):
    """Results by judgement; the numbers of variants: complete, and of them inside the limit."""
    case = four_bar()
    variation = limited(tmp_path_factory.mktemp("vary"))
    found = {
        each: sweep_designs(case, variation, samples=VARIANTS, seed=3, incomplete=each)
        for each in Incomplete
    }
    offsets = variation.offsets(3, 0, VARIANTS)
    known = [heights(case, np.add(END[:2], each)) for each in offsets.T]
    complete = [each for each in known if each is not None]
    return found, len(complete), int(sum(each.min() >= LOW for each in complete))


def test_incomplete_variants_outside_unless_ignored(studied):
    found, complete, inside = studied
    assert VARIANTS / 4 < complete < 0.75 * VARIANTS
    assert 0 < inside < complete
    for judgement, results in found.items():
        known = VARIANTS if judgement is Incomplete.OUTSIDE else complete
        assert results.incomplete == judgement
        for each in results.limits:
            assert (each.known, each.incomplete) == (known, VARIANTS - complete)
            assert each.outside == known - inside
            assert each.share == inside / known
            assert each.share_of_all == inside / VARIANTS
            assert each.share_of_complete == inside / complete
            low = stats.beta.ppf(0.025, inside, known - inside + 1)
            high = stats.beta.ppf(0.975, inside + 1, known - inside)
            assert each.interval == pytest.approx((low, high), rel=1e-9)
    below = [results.limits[0].below for results in found.values()]
    assert below[0] > below[1] == complete - inside


def test_outside_variants_by_side_and_completeness():
    nan = np.nan
    values = np.array(
        [
            [[0.0, 0.0, 9.0, nan, nan, -9.0], [0.0, -9.0, 0.0, 0.0, 9.0, 9.0]],
            [[0.0] * 6, [0.0, 0.0, 0.0, 0.0, 0.0, nan]],
        ]
    )
    limits = [RowLimit(0, -1.0, 1.0), RowLimit(1, -1.0, np.inf)]
    reached = np.ones((2, 6), dtype=np.bool_)
    # variants, incomplete, below, above; of the complete ones below, above, outside
    assert limit_counts(values, reached, np.zeros((2, 2)), limits).tolist() == [
        [6, 2, 2, 3, 2, 2, 3],
        [6, 1, 0, 0, 0, 0, 0],
        [6, 3, 2, 3, 1, 1, 2],
    ]


def test_samples_without_nominal_are_unjudged():
    """Ackermann of straight wheels has no value in any variant; a lock-up is of one."""
    values, reached = np.zeros((1, 4, 5)), np.ones((4, 5), dtype=np.bool_)
    nominal = np.array([[0.0, 0.0, np.nan, 0.0]])
    values[0, 2] = np.nan  # in no variant: all are complete
    values[0, 1, 1] = np.nan  # a value is missing
    values[0, :, 2] = np.nan  # all are
    reached[2, 3] = False  # a sample is
    counts = limit_counts(values, reached, nominal, [RowLimit(0, -1.0, 1.0)])
    assert counts[:, 1].tolist() == [3, 3]
    unknown = np.full((1, 4), np.nan)
    assert limit_counts(values, reached, unknown, [RowLimit(0, -1.0, 1.0)])[0, 1] == 2


def on_page(results):
    """The cells of the table of limits, heads first."""
    (rows,) = (
        rows for above, rows in Page(page(results)).tables if above == "Specification limits"
    )
    return [
        [cell.strip() for cell in row[:-1]] for row in rows
    ]  # without the place of the least Cpk


def on_terminal(results):
    """The cells of the table of limits, heads first; of two lines they are the second."""
    text = io.StringIO()
    print_sweep(results, text)
    lines = text.getvalue().split("Specification limits")[1].splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("output"))
    rows = [re.split(r"  +", line.strip()) for line in lines[start : start + 3]]
    rows[-1].insert(1, "")  # all together has no unit
    return rows


def printed(text):
    """A number as printed, of a share too; None for a dash."""
    return None if text == "–" else float(text.removesuffix(" %")) / (100.0 if "%" in text else 1.0)


def near(value, **tolerance):
    return None if value is None else pytest.approx(value, **tolerance)


CHANGES = {
    "as found": {},
    "no yield": {
        "share": 0.0,
        "interval": (0.0, 0.25),
        "share_of_all": 0.0,
        "share_of_complete": None,
    },
    "unknown": {"share": None, "interval": None, "share_of_all": 0.5, "share_of_complete": 0.0},
    "zeros": {"cp": 0.0, "cpk": 0.0, "below": 0},
}


@pytest.mark.parametrize("judgement", Incomplete)
@pytest.mark.parametrize("cells", [on_page, on_terminal])
@pytest.mark.parametrize("changed", CHANGES.values(), ids=CHANGES)
def test_printed_limits_equal_results(studied, judgement, cells, changed):
    """Zero is a number, and no number is a dash."""
    found, _, _ = studied
    first, whole = found[judgement].limits
    first = msgspec.structs.replace(first, **changed)
    results = msgspec.structs.replace(found[judgement], limits=[first, whole])
    head, *rows = cells(results)
    other = "of complete" if judgement is Incomplete.OUTSIDE else "of all"
    assert any(each.endswith(other) for each in head)
    for row, limit in zip(rows, json.loads(to_json(results))["limits"], strict=True):
        output, _, low, high, below, above, judged, interval, beside, *indices = row
        assert output == (limit["output"] or "all together")
        ends = ["–"] * 2 if interval == "–" else [f"{x} %" for x in interval[:-2].split(" to ")]
        unjudged = limit["share_of_complete" if other == "of complete" else "share_of_all"]
        shares = [limit["share"], unjudged, *(limit["interval"] or [None] * 2)]
        assert [*map(printed, (judged, beside, *ends))] == [
            near(share, abs=5.1e-5) for share in shares
        ]
        in_mm = [each and 1000.0 * each for each in (limit["low"], limit["high"])]
        others = [*in_mm, *(limit[key] for key in ("below", "above", "cp", "cpk", "by_quantiles"))]
        assert [*map(printed, (low, high, below, above, *indices))] == [
            near(value, rel=5.1e-3) for value in others
        ]


def test_limits_csv_equals_results(studied):
    for judgement, results in studied[0].items():
        for row, each in zip(
            csv.DictReader(io.StringIO(limits_csv(results))), results.limits, strict=True
        ):
            assert float(row["yield"]) == each.share
            assert (float(row["yield_from"]), float(row["yield_to"])) == each.interval
            assert float(row["yield_of_all"]) == each.share_of_all
            assert float(row["yield_of_complete"]) == each.share_of_complete
            counts = ("known", "below", "above", "outside", "incomplete")
            assert [int(row[key]) for key in counts] == [getattr(each, key) for key in counts]
        assert results.incomplete == judgement


@pytest.mark.parametrize(
    ("option", "judgement", "words"),
    [
        ("", "outside", "Incomplete, and so outside: "),
        ("--incomplete ignore", "ignore", "Incomplete, and left out: "),
    ],
)
def test_sweep_command_counts_incomplete_variants(tmp_path, capsys, option, judgement, words):
    file, points, out = tmp_path / "bars.toml", tmp_path / "vary.json", tmp_path / "out.json"
    file.write_text(case_text(four_bar()))
    tables = {**HEAD, "mode": "monte_carlo", "hardpoints": {"end": JOINT}}
    points.write_text(json.dumps(tables | {"limits": {"height": {"low": 1000.0 * LOW}}}))
    command = f"sweep {file} --vary {points} --samples 40 --json {out}".split()
    assert main([*command, *option.split()]) == 1
    found = json.loads(out.read_text())
    limit = found["limits"][0]
    assert (found["incomplete"], limit["known"]) == (
        judgement,
        40 - (limit["incomplete"] if option else 0),
    )
    told = capsys.readouterr().out
    assert f"{words}{limit['incomplete']} variants without all samples" in told
    assert f"{100.0 * limit['share_of_all']:.2f} %" in told
    assert f"{100.0 * limit['share_of_complete']:.2f} %" in told


# Studies of forces: against runs of single variants, by both ways; masses and loads vary


# The rows of the slider-crank are redundant: some components are not determined.


def test_units_of_varied_stiffness_and_mass(tmp_path):
    case = load("mcpherson_strut_loaded")
    rate, mass, *_ = vary(tmp_path, case, **LOADED["mcpherson_strut_loaded"]).coordinates
    assert (rate.unit, mass.unit) == ("N/m", "kg")
    assert rate.scale == pytest.approx(2000.0)  # of N/mm


def test_possibly_negative_mass_is_refused(tmp_path):
    case = load("planar_slider_crank")
    mass = case.mechanism.body("slider").mass
    with pytest.raises(CaseError, match=r"found offsets down to .+ expected zero or more"):
        vary(tmp_path, case, mass={"at": "bodies.slider.mass", "sigma": mass / 5.0})
    with pytest.raises(CaseError, match="vary it less"):
        vary(tmp_path, case, mass={"at": "bodies.slider.mass", "half_width": 2.0 * mass})


def test_force_study_is_linear_in_mass(tmp_path):
    """A force is linear in a mass: mean, extremes and gradient follow from two runs."""
    case = load("planar_slider_crank")
    mass = {"mass": {"at": "bodies.slider.mass", "half_width": 0.1}}
    found = sweep_designs(
        case,
        vary(tmp_path, case, **mass),
        samples=20,
        seed=1,
        check=Check(adapters.engine("native"), 0.05, solve_in_process, 1e-12),
    )
    assert [each.outcome.value for each in found.checked] == ["pass"]
    torque = found.outputs["crank_torque"]
    assert torque.unit == "N m"
    (slope,) = [each for each in found.gradients if each.output == "crank_torque"]
    assert slope.unit == "(N m)/kg"
    assert abs(slope.largest) > 1e-3  # the torque carries the mass
    offsets = vary(tmp_path, case, **mass).offsets(1, 0, 20)[0]
    ends = np.array(torque.nominal) + np.outer([offsets.min(), offsets.max()], slope.along)
    size = np.abs(torque.nominal).max()
    np.testing.assert_allclose(torque.min, ends.min(axis=0), atol=1e-9 * size)
    np.testing.assert_allclose(torque.max, ends.max(axis=0), atol=1e-9 * size)
